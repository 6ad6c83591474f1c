//! Pictures of another renderer (tests/reference/make.py), pixel by pixel, with the error bars of both.
//!
//! The radius is a quarter of a pixel or less. What blur is left there is a loss along edges and corners, of the order of
//! radius over pixel of the *indirect* light in the pixels that show one: [`BLUR`] is the allowance for it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use exr::prelude::read_first_flat_layer_from_file;
use glam::Vec3;
use serde_json::Value;
use sunfleck::cpu::CpuStages;
use sunfleck::ppm::{self, FirstRadius, Params, Stages};
use sunfleck::scene::{Camera, Environment, Material, Mesh, PackedScene, PunctualKind, PunctualLight, Scene, Sphere};

/// Independent runs, for the error bars.
const SEEDS: u32 = 12;
/// Renders behind the reference's variance: make.py's default.
const RENDERS: f64 = 64.0;
/// Share by which a block of 8×8 pixels may be off beyond its error bar.
const BLUR: f64 = 0.01;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference")
}

fn numbers<const N: usize>(v: &Value) -> [f32; N] {
    std::array::from_fn(|i| v[i].as_f64().unwrap() as f32)
}

fn vector(v: &Value) -> Vec3 {
    numbers(v).into()
}

fn number(v: &Value) -> f32 {
    v.as_f64().unwrap() as f32
}

fn list(v: &Value) -> impl Iterator<Item = &Value> {
    v.as_array().into_iter().flatten()
}

fn material(mesh: &Value) -> Material {
    if mesh["emission"].is_array() {
        return Material::emitter("lamp", vector(&mesh["emission"]));
    }
    let m = &mesh["material"];
    match m["type"].as_str().unwrap() {
        "diffuse" => Material::diffuse("", vector(&m["rgb"])),
        "mirror" => Material::metal("", Vec3::ONE, 0.0),
        "glass" => {
            let absorption = if m["absorption"].is_array() { vector(&m["absorption"]) } else { Vec3::ZERO };
            Material { absorption, ..Material::glass("", number(&m["ior"])) }
        }
        other => panic!("{other}"),
    }
}

/// The JSON form that make.py describes.
fn read_scene(description: &Value) -> (Scene, Camera) {
    let mut scene = Scene::default();
    for mesh in list(&description["meshes"]) {
        let index = scene.materials.len();
        scene.materials.push(material(mesh));
        let sphere = &mesh["sphere"];
        if sphere.is_object() {
            let (centre, radius) = (vector(&sphere["center"]), number(&sphere["radius"]));
            scene.spheres.push(Sphere { centre, radius, inward: false, material: index });
        } else {
            let mesh = Mesh {
                positions: list(&mesh["vertices"]).map(vector).collect(),
                triangles: list(&mesh["faces"]).map(|f| numbers(f).map(|i: f32| i as u32)).collect(),
                material: index,
                ..Mesh::default()
            };
            scene.meshes.push(mesh.into());
        }
    }
    for light in list(&description["lights"]) {
        scene.lights.push(if light["type"] == "point" {
            PunctualLight {
                name: String::new(),
                position: vector(&light["position"]),
                direction: Vec3::NEG_Y,
                intensity: vector(&light["intensity"]),
                kind: PunctualKind::Point,
            }
        } else {
            PunctualLight {
                name: String::new(),
                position: Vec3::ZERO,
                direction: vector(&light["direction"]).normalize(),
                intensity: vector(&light["illuminance"]),
                kind: PunctualKind::Directional,
            }
        });
    }
    let e = &description["environment"];
    if e.is_object() {
        scene.environment = Some(Environment {
            width: number(&e["width"]) as u32,
            height: number(&e["height"]) as u32,
            texels: list(&e["rgb"]).map(vector).collect::<Vec<_>>().into(),
            rotation: number(&e["rotation"]),
            strength: 1.0,
            tint: Vec3::ONE,
        });
    }
    let c = &description["camera"];
    let yfov = number(&c["vfov"]).to_radians();
    let camera = Camera::look_at("", vector(&c["position"]), vector(&c["target"]), vector(&c["up"]), yfov);
    (scene, camera)
}

/// Mean and the variance of it, of each pixel and channel, `[h·w·3]`.
struct Estimate {
    mean: Vec<f64>,
    variance: Vec<f64>,
}

fn read_reference(name: &str) -> Estimate {
    let image = read_first_flat_layer_from_file(folder().join(format!("{name}.exr"))).unwrap();
    let plane = |name: &str| -> Vec<f64> {
        let channel = image.layer_data.channel_data.list.iter().find(|c| c.name.eq_case_insensitive(name));
        channel.unwrap().sample_data.values_as_f32().map(f64::from).collect()
    };
    let mixed = |names: [&str; 3]| -> Vec<f64> {
        let planes = names.map(plane);
        (0..planes[0].len() * 3).map(|i| planes[i % 3][i / 3]).collect()
    };
    Estimate { mean: mixed(["R", "G", "B"]), variance: mixed(["variance.R", "variance.G", "variance.B"]) }
}

/// A normal deviate as improbable as Student's `t` (Wallace 1959).
fn normal_of_student(t: f64, freedom: f64) -> f64 {
    ((8.0 * freedom + 1.0) / (8.0 * freedom + 3.0)) * (freedom * (t * t / freedom).ln_1p()).sqrt().copysign(t)
}

/// Welch's statistic of a difference as a normal deviate; `blur` is the bias allowed.
fn deviate(difference: f64, ours: f64, theirs: f64, blur: f64) -> f64 {
    let variance = ours + theirs;
    let beyond = (difference.abs() - blur).max(0.0).copysign(difference);
    if beyond == 0.0 {
        return 0.0;
    }
    // Two programs round differently even where neither has noise.
    let variance = variance.max(1e-14);
    let freedom =
        variance * variance / (ours * ours / f64::from(SEEDS - 1) + theirs * theirs / (RENDERS - 1.0)).max(1e-40);
    normal_of_student(beyond / variance.sqrt(), freedom.clamp(1.0, 1e6))
}

fn assert_agrees(name: &str, radius: f32, n_paths: u32, iterations: u32) {
    let text = std::fs::read_to_string(folder().join(format!("{name}.json"))).unwrap();
    let description: Value = serde_json::from_str(&text).unwrap();
    let (scene, camera) = read_scene(&description);
    let packed = Arc::new(PackedScene::new(&scene));
    let (width, height) = (number(&description["width"]) as u32, number(&description["height"]) as u32);
    let runs: Vec<Vec<f64>> = (0..SEEDS)
        .map(|seed| {
            let params = Params {
                seed,
                n_paths,
                radius: FirstRadius::Fixed(radius),
                max_segments: number(&description["segments"]) as u32,
                ..Params::new(width, height)
            };
            let mut stages = CpuStages::new(packed.clone(), camera.pack(width, height), [width, height]);
            ppm::start(&mut stages, &params).unwrap();
            for i in 1..=iterations {
                ppm::iterate(&mut stages, &params.frame(i)).unwrap();
            }
            stages.film().unwrap().rgb().into_iter().flatten().map(f64::from).collect()
        })
        .collect();
    let seeds = f64::from(SEEDS);
    // Mean over the runs and variance of that mean, of any functional of a picture.
    let estimate = |of: &dyn Fn(&[f64]) -> f64| {
        let values: Vec<f64> = runs.iter().map(|r| of(r)).collect();
        let mean = values.iter().sum::<f64>() / seeds;
        (mean, values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (seeds - 1.0) / seeds)
    };
    let reference = read_reference(name);
    let (w, h) = (width as usize, height as usize);
    assert_eq!(reference.mean.len(), w * h * 3);
    // Sums over pixels: ours share photons, so their variance is that of the sum; the reference's are independent.
    let over = |pixels: &[usize]| {
        let n = pixels.len() as f64;
        let (ours, variance) = estimate(&|r| pixels.iter().map(|&i| r[i]).sum::<f64>() / n);
        let theirs = pixels.iter().map(|&i| reference.mean[i]).sum::<f64>() / n;
        (ours, variance, theirs, pixels.iter().map(|&i| reference.variance[i]).sum::<f64>() / (n * n))
    };

    let mut report = Vec::new();
    for c in 0..3 {
        let pixels: Vec<usize> = (0..w * h).map(|i| i * 3 + c).collect();
        let (ours, v, theirs, u) = over(&pixels);
        let (off, error) = ((ours - theirs) / theirs, (v + u).sqrt() / theirs);
        report.push(format!("mean of channel {c} off by {off:+.5} ± {error:.5}"));
        assert!(off.abs() < 5e-3 + 3.0 * error, "{name}: {ours}, expected {theirs}: {off:+.4} ± {error:.4}");
        assert!(error < 3e-3, "{name}: the error bar {error} is too wide to show anything");
    }

    // Pixels. 1 % shared among all (Šidák) is 5.0 σ for some 9,216 values; five in a thousand may exceed even that.
    let deviates: Vec<f64> = (0..w * h * 3)
        .map(|i| {
            let (ours, variance) = estimate(&|r| r[i]);
            deviate(ours - reference.mean[i], variance, reference.variance[i], 0.0)
        })
        .collect();
    let passed = deviates.iter().filter(|z| z.abs() < 5.0).count() as f64 / deviates.len() as f64;
    let rms = (deviates.iter().map(|z| z * z).sum::<f64>() / deviates.len() as f64).sqrt();
    report.push(format!("{:.3} % of values within 5 σ, rms {rms:.3} σ", 100.0 * passed));

    // Blocks: less noise, so less may hide. 4.3 σ is 1 % among 144 × 4 scenes (Šidák).
    let mut worst = 0f64;
    for block in 0..w / 8 * (h / 8) * 3 {
        let (c, x, y) = (block % 3, block / 3 % (w / 8), block / 3 / (w / 8));
        let pixels: Vec<usize> = (0..64).map(|k| ((y * 8 + k / 8) * w + x * 8 + k % 8) * 3 + c).collect();
        let (ours, v, theirs, u) = over(&pixels);
        let z = deviate(ours - theirs, v, u, BLUR * theirs);
        if z.abs() > worst.abs() {
            worst = z;
            report.push(format!("block ({x}, {y}), channel {c}: {ours:.5}, expected {theirs:.5}: {z:+.1} σ"));
        }
    }
    eprintln!("{name}: {}", report.join("; "));
    assert!(passed >= 0.995, "{name}: {}", report.join("; "));
    assert!(rms < 1.25, "{name}: {}", report.join("; "));
    assert!(worst.abs() < 4.3, "{name}: {}", report.join("; "));
}

/// A caustic through a glass ball, a mirror ball, coloured walls, one lamp.
#[test]
fn cornell() {
    assert_agrees("cornell", 0.012, 60_000, 8);
}

/// Blocks and a ball between coloured walls, a lamp and a point light.
#[test]
fn room() {
    assert_agrees("room", 0.012, 60_000, 8);
}

/// Diffuse things on the ground under a turned sky with a small sun, and light from one direction.
#[test]
fn sky() {
    assert_agrees("sky", 0.012, 50_000, 24);
}

/// A ball and a block of coloured absorbing glass.
#[test]
fn amber() {
    assert_agrees("amber", 0.012, 60_000, 8);
}
