//! The same stage on the same input, on the CPU and on the GPU.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Mat2, Vec2, Vec3, Vec4};
use sunfleck::cpu::CpuStages;
use sunfleck::cpu::bsdf::{Bsdf, Lobes, Transport};
use sunfleck::gpu::{BsdfQuery, GpuStages};
use sunfleck::layout::{self, EyeVertex, Photon};
use sunfleck::math::{oct, rng};
use sunfleck::ppm::{Direct, Params, Stages, iterate, start};
use sunfleck::scene::{
    AlphaMode, Camera, Environment, Image, Material, Mesh, PackedScene, PunctualKind, PunctualLight, Scene, Sphere,
    Texture, Wrap,
};

use crate::gpu::context;

mod replaced;

const SIZE: u32 = 96;

fn random(i: u32, stream: u32) -> [f32; 4] {
    rng::unit4(rng::pcg4d([i, stream, 78, 2]))
}

fn quad(name: &str, corners: [Vec3; 4], material: usize) -> Mesh {
    Mesh {
        name: name.into(),
        positions: corners.to_vec(),
        uv0: vec![Vec2::ZERO, Vec2::X * 3.0, Vec2::new(3.0, 2.0), Vec2::Y * 2.0],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    }
}

/// Upright, one unit wide, facing +z.
fn panel(name: &str, at: Vec3, material: usize) -> Mesh {
    let corners = [at, at + Vec3::X, at + Vec3::X + Vec3::Y, at + Vec3::Y];
    Mesh { normals: vec![Vec3::new(0.2, 0.1, 1.0).normalize(); 4], ..quad(name, corners, material) }
}

fn noise_image(name: &str, width: u32, height: u32) -> Image {
    let texels = (0..width * height).map(|i| rng::pcg4d([i, 5, 5, 5]).map(|v| (v >> 24) as u8 / 2 + 100)).collect();
    Image { name: name.into(), width, height, texels }
}

/// Every kind of lobe, texture, light and primitive there is.
pub fn everything() -> Scene {
    let mut materials = vec![
        Material::diffuse("floor", Vec3::new(0.7, 0.6, 0.5)),
        Material::glass("glass", 1.5),
        Material::metal("mirror", Vec3::new(0.9, 0.8, 0.7), 0.0),
        Material::metal("rough metal", Vec3::new(0.9, 0.6, 0.3), 0.4),
        Material {
            name: "plastic".into(),
            base_color: Vec3::new(0.2, 0.4, 0.8),
            roughness: 0.2,
            ..Material::default()
        },
        Material { name: "satin".into(), base_color: Vec3::new(0.8, 0.3, 0.3), roughness: 0.6, ..Material::default() },
        Material { roughness: 0.3, absorption: Vec3::new(0.1, 0.8, 2.0), ..Material::glass("frosted", 1.33) },
        Material {
            volume: false,
            roughness: 0.1,
            base_color: Vec3::new(0.5, 0.9, 0.6),
            ..Material::glass("sheet", 1.4)
        },
        Material { metallic: 0.5, roughness: 0.5, transmission: 0.4, ..Material::default() },
        Material::emitter("lamp", Vec3::new(20.0, 18.0, 15.0)),
        Material { double_sided: true, ..Material::emitter("bulb", Vec3::new(5.0, 6.0, 9.0)) },
    ];
    let texture = |image| Texture {
        transform: Mat2::from_cols(Vec2::new(1.2, 0.3), Vec2::new(-0.3, 1.2)),
        offset: Vec2::new(0.1, 0.7),
        ..Texture::new(image)
    };
    materials[0].base_color_texture = Some(texture(0));
    materials[5].normal_texture = Some(Texture { wrap: [Wrap::Mirror, Wrap::Clamp], ..texture(1) });
    materials[5].metallic_roughness_texture = Some(Texture { nearest: true, ..texture(0) });
    let masked = materials.len();
    materials.push(Material {
        alpha: AlphaMode::Mask(0.6),
        base_color_texture: Some(texture(1)),
        double_sided: false,
        ..materials[4].clone()
    });
    materials.push(Material { alpha: AlphaMode::Blend, opacity: 0.4, ..materials[4].clone() });

    let y = Vec3::new(0.0, 2.5, 0.0);
    let mut meshes = vec![
        quad("floor", [[-4.0, 0.0, 4.0], [4.0, 0.0, 4.0], [4.0, 0.0, -4.0], [-4.0, 0.0, -4.0]].map(Vec3::from), 0),
        quad("lamp", [y, y + Vec3::X, y + Vec3::X + Vec3::Z, y + Vec3::Z], 9),
        panel("satin", Vec3::new(-2.0, 0.5, -2.0), 5),
        panel("masked", Vec3::new(-0.5, 0.5, -2.0), masked),
        panel("blended", Vec3::new(1.0, 0.5, -2.0), masked + 1),
        panel("sheet", Vec3::new(-0.5, 0.2, 1.5), 7),
    ];
    meshes[2].colors = vec![Vec4::new(1.0, 0.5, 0.25, 1.0), Vec4::ONE, Vec4::new(0.3, 1.0, 0.7, 1.0), Vec4::ONE];
    meshes[4].colors = vec![Vec4::new(1.0, 1.0, 1.0, 0.5); 4];
    let spheres = [1, 2, 3, 4, 6, 8, 10]
        .iter()
        .enumerate()
        .map(|(i, &material)| Sphere {
            centre: Vec3::new(i as f32 * 1.0 - 3.0, 0.45, 0.6 * (i % 2) as f32),
            radius: 0.4,
            inward: false,
            material,
        })
        .collect();
    let light = |strength: f32, kind| PunctualLight {
        name: String::new(),
        position: Vec3::new(-1.0, 3.0, 2.0),
        direction: Vec3::new(0.3, -1.0, -0.4).normalize(),
        intensity: Vec3::new(4.0, 5.0, 6.0) * strength,
        kind,
    };
    Scene {
        meshes: meshes.into_iter().map(Arc::new).collect(),
        spheres,
        materials,
        images: [noise_image("color", 13, 7), noise_image("normal", 8, 8)].map(Arc::new).into(),
        lights: vec![
            light(1.0, PunctualKind::Point),
            light(2.0, PunctualKind::Spot { inner: 0.2, outer: 0.5 }),
            light(0.05, PunctualKind::Directional),
        ],
        environment: Some(Environment {
            width: 32,
            height: 16,
            texels: (0..512).map(|i| Vec3::from_slice(&random(i, 1)).powf(4.0)).collect::<Vec<_>>().into(),
            rotation: 0.7,
            strength: 0.02,
            tint: Vec3::new(1.0, 0.5, 2.0),
        }),
        cameras: vec![Camera {
            aperture_radius: 0.02,
            focus_distance: 5.0,
            ..Camera::look_at("main", Vec3::new(0.5, 2.0, 5.0), Vec3::new(0.0, 0.6, 0.0), Vec3::Y, 0.8)
        }],
    }
}

fn backends(scene: &Scene) -> Option<(CpuStages, GpuStages)> {
    let context = context()?;
    let packed = Arc::new(PackedScene::new(scene));
    let camera = scene.cameras[0].pack(SIZE, SIZE);
    let gpu = GpuStages::new(context, &packed, camera).expect("stages");
    Some((CpuStages::new(packed, camera, [SIZE, SIZE]), gpu))
}

fn params() -> Params {
    Params { n_paths: 40_000, ..Params::new(SIZE, SIZE) }
}

fn close(a: &[f32], b: &[f32], tolerance: f32) -> bool {
    let scale = a.iter().chain(b).fold(0f32, |m, v| m.max(v.abs()));
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= tolerance * scale)
}

fn same_direction(a: u32, b: u32) -> bool {
    (oct::decode(a) - oct::decode(b)).length() < 1e-3
}

fn same_vertex(a: &EyeVertex, b: &EyeVertex) -> bool {
    a.flags == b.flags
        && close(&a.radiance, &b.radiance, 1e-3)
        && (a.flags & 1 == 0
            || close(&a.position, &b.position, 1e-3)
                && close(&a.throughput, &b.throughput, 1e-3)
                && close(&a.diffuse, &b.diffuse, 1e-3)
                && close(&a.base_color, &b.base_color, 1e-3)
                && close(&a.f0, &b.f0, 1e-3)
                && close(
                    &[a.roughness, a.metallic, a.transmission, a.eta, a.f90],
                    &[b.roughness, b.metallic, b.transmission, b.eta, b.f90],
                    1e-3,
                )
                && a.material_flags == b.material_flags
                && same_direction(a.normal, b.normal)
                && same_direction(a.shading_normal, b.shading_normal)
                && same_direction(a.outgoing, b.outgoing))
}

/// Mean of what a picture is made of, and the standard error of the difference's mean.
fn difference(a: impl Iterator<Item = f32>, b: impl Iterator<Item = f32>) -> (f64, f64, f64) {
    let (mut sum, mut difference, mut squares, mut n) = (0.0, 0.0, 0.0, 0.0);
    for (a, b) in a.zip(b) {
        let d = f64::from(b) - f64::from(a);
        sum += f64::from(a);
        difference += d;
        squares += d * d;
        n += 1.0;
    }
    (sum / n, difference / n, f64::sqrt(squares) / n)
}

/// The share of eye paths that agree. The rest met an edge, a texel's border or a random number's threshold within
/// rounding, and went another way from there.
fn eye_paths_agree(scene: &Scene, params: &Params) {
    let Some((mut cpu, mut gpu)) = backends(scene) else { return };
    for i in 1..=2 {
        let frame = params.frame(i);
        cpu.trace_eye(&frame).expect("cpu");
        gpu.trace_eye(&frame).expect("gpu");
        let (a, b) = (cpu.eye_vertices().expect("cpu"), gpu.eye_vertices().expect("gpu"));
        assert_eq!(a.len(), b.len());
        let different: Vec<usize> = (0..a.len()).filter(|&i| !same_vertex(&a[i], &b[i])).collect();
        for &i in different.iter().take(3) {
            println!("pixel {i}:\n{:?}\n{:?}", a[i], b[i]);
        }
        println!("iteration {i}: {} of {} eye paths differ", different.len(), a.len());
        assert!(different.len() * 200 <= a.len(), "{} of {} eye paths differ", different.len(), a.len());
        let radiance = |v: &EyeVertex| v.radiance[0] + v.radiance[1] + v.radiance[2];
        let (mean, d, error) = difference(a.iter().map(radiance), b.iter().map(radiance));
        assert!(d.abs() <= 4.0 * error + 1e-4 * mean, "mean {mean}, difference {d} ± {error}");
    }
}

#[test]
fn eye_paths_agree_with_everything_in_view() {
    eye_paths_agree(&everything(), &params());
}

#[test]
fn eye_paths_agree_without_direct_light_or_roulette() {
    let params = Params { direct: Direct::Photons, roulette: false, max_eye_segments: 6, max_segments: 8, ..params() };
    eye_paths_agree(&everything(), &params);
}

fn same_photon(a: &Photon, b: &Photon) -> bool {
    (Vec3::from(a.position) - Vec3::from(b.position)).length() < 2e-3
        && close(&a.power, &b.power, 1e-3)
        && same_direction(a.direction, b.direction)
        && a.normal_and_segments >> 24 == b.normal_and_segments >> 24
        && (oct::decode24(a.normal_and_segments) - oct::decode24(b.normal_and_segments)).length() < 2e-3
}

/// How many of `a` are found in `b`.
fn found_in(a: &[Photon], b: &[Photon]) -> usize {
    let cell = |p: &Photon| p.position.map(|c| (c * 50.0).floor() as i32);
    let mut cells: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
    for (i, p) in b.iter().enumerate() {
        cells.entry(cell(p)).or_default().push(i as u32);
    }
    let near = |p: &Photon| {
        let [x, y, z] = cell(p);
        (0..27).any(|k| {
            let key = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
            cells.get(&key).is_some_and(|list| list.iter().any(|&i| same_photon(p, &b[i as usize])))
        })
    };
    a.iter().filter(|p| near(p)).count()
}

fn photon_paths_agree(scene: &Scene, params: &Params) {
    let Some((mut cpu, mut gpu)) = backends(scene) else { return };
    let frame = params.frame(1);
    cpu.trace_photons(&frame).expect("cpu");
    gpu.trace_photons(&frame).expect("gpu");
    let (a, b) = (cpu.photons().expect("cpu"), gpu.photons().expect("gpu"));
    assert_eq!(b.len(), gpu.n_photons() as usize);
    let (missing, extra) = (a.len() - found_in(&a, &b), b.len() - found_in(&b, &a));
    println!("{} and {} photons; {missing} missing, {extra} extra", a.len(), b.len());
    assert!(a.len() > 10_000, "only {} photons", a.len());
    let n_caustic = a.iter().filter(|p| p.is_caustic()).count();
    assert!(n_caustic > 20 && n_caustic < a.len(), "{n_caustic} of {} are caustic", a.len());
    // A path that goes another way takes the rest of its photons with it.
    assert!((missing + extra) * 100 <= a.len(), "{missing} missing, {extra} extra of {}", a.len());
    let power =
        |photons: &[Photon]| photons.iter().map(|p| f64::from(p.power[0] + p.power[1] + p.power[2])).sum::<f64>();
    let (powers, tolerance) =
        ([power(&a), power(&b)], 3.0 * f64::from((missing + extra) as u32).sqrt() / a.len() as f64);
    assert!((powers[1] / powers[0] - 1.0).abs() <= tolerance + 1e-4, "power {powers:?}, {tolerance}");
}

#[test]
fn photon_paths_agree_with_everything_lit() {
    photon_paths_agree(&everything(), &Params { n_paths: 150_000, ..params() });
}

/// On ground so wide that the rest is a speck: photons from far away come about it.
#[test]
fn photon_paths_agree_about_a_subject() {
    let mut scene = everything();
    let corners = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, z]| 120.0 * Vec3::new(x, -0.001, z));
    scene.meshes.push(Arc::new(quad("ground", corners, 0)));
    let info = PackedScene::new(&scene).info;
    assert!(info.subject_radius > 0.0 && info.subject_radius < 8.0 && info.radius > 150.0, "{info:?}");
    photon_paths_agree(&scene, &Params { n_paths: 150_000, direct: Direct::Photons, ..params() });
}

#[test]
fn photon_paths_agree_when_they_run_to_the_limit() {
    // More photons a path than one round stores, more in all than there is room for at first.
    let mut scene = everything();
    scene.environment = None;
    scene.lights.truncate(2);
    scene.spheres.push(Sphere { centre: Vec3::ZERO, radius: 9.0, inward: true, material: 0 });
    let params = Params { direct: Direct::Photons, roulette: false, max_photon_segments: 40, ..params() };
    photon_paths_agree(&scene, &Params { n_paths: 3000, ..params });
}

#[test]
fn whole_iterations_agree() {
    let scene = everything();
    let Some((mut cpu, mut gpu)) = backends(&scene) else { return };
    let params = params();
    for stages in [&mut cpu as &mut dyn Stages, &mut gpu] {
        stages.set_first_radii(&vec![0.1; (SIZE * SIZE) as usize]).expect("radii");
        for i in 1..=3 {
            iterate(stages, &params.frame(i)).expect("iteration");
        }
    }
    let (a, b) = (cpu.film().expect("cpu"), gpu.film().expect("gpu"));
    assert_eq!((a.n_iterations, a.width, a.height), (b.n_iterations, b.width, b.height));
    let different = a.pixels.iter().zip(&b.pixels).filter(|(a, b)| !close(&a[..3], &b[..3], 3e-3)).count();
    println!("{different} of {} pixels differ", a.pixels.len());
    assert!(different * 20 <= a.pixels.len(), "{different} of {} pixels differ", a.pixels.len());
    let value = |p: &[f32; 4]| p[0] + p[1] + p[2];
    let (mean, d, error) = difference(a.pixels.iter().map(value), b.pixels.iter().map(value));
    println!("mean {mean}, difference {d} ± {error}");
    assert!(d.abs() <= 4.0 * error + 1e-4 * mean, "mean {mean}, difference {d} ± {error}");
}

#[test]
fn the_same_seed_gives_the_same_bits_on_the_gpu() {
    let mut films = Vec::new();
    for _ in 0..2 {
        let Some((_, mut gpu)) = backends(&everything()) else { return };
        gpu.set_first_radii(&vec![0.1; (SIZE * SIZE) as usize]).expect("radii");
        for i in 1..=2 {
            iterate(&mut gpu, &params().frame(i)).expect("iteration");
        }
        films.push(gpu.film().expect("film").pixels.into_iter().flatten().map(f32::to_bits).collect::<Vec<_>>());
    }
    assert!(films[0] == films[1]);
}

/// The tenth nearest photon is as far away as brute force says, however many there are.
#[test]
fn first_radii_are_chosen_from_the_same_distances() {
    let Some(context) = context() else { return };
    let (scene, [width, height]) = (everything(), [97, 61]);
    let (packed, camera) = (Arc::new(PackedScene::new(&scene)), scene.cameras[0].pack(width, height));
    let mut gpu = GpuStages::new(context, &packed, camera).expect("stages");
    let mut cpu = CpuStages::new(packed, camera, [width, height]);
    let frame = Params { n_paths: 40_000, ..Params::new(width, height) }.frame(0);
    cpu.trace_eye(&frame).expect("eye paths");
    cpu.trace_photons(&frame).expect("photons");
    let (vertices, all) = (cpu.eye_vertices().expect("vertices"), cpu.photons().expect("photons"));
    let one_place = vec![all[0]; 300];
    let flat: Vec<Photon> = all.iter().map(|p| Photon { position: [p.position[0], 0.25, 0.0], ..*p }).collect();
    gpu.set_eye_vertices(&vertices).expect("room");
    gpu.set_reaches_on_device(true);
    // As many dispatches as there can be.
    gpu.set_dispatch_seconds(0.0);
    for photons in [&all[..0], &all[..9], &all[..10], &all[..23], &one_place, &flat[..500], &all] {
        let stages: [&mut dyn Stages; 2] = [&mut cpu, &mut gpu];
        let [on_cpu, on_gpu] = stages.map(|stages| {
            stages.set_photons(photons).expect("room");
            stages.reaches(&frame, 1).expect("distances")
        });
        assert_eq!((on_cpu.len(), on_gpu.len()), (vertices.len(), vertices.len()));
        for (a, b) in on_cpu.iter().zip(&on_gpu) {
            assert!(close(&[a.distance], &[b.distance], 1e-5) && close(&[a.footprint], &[b.footprint], 1e-5));
        }
        for (vertex, reach) in vertices.iter().zip(&on_cpu).step_by(37) {
            let from = Vec3::from(vertex.position);
            let mut distances: Vec<f32> = photons.iter().map(|p| from.distance(p.position.into())).collect();
            distances.sort_by(f32::total_cmp);
            let tenth = distances.get(layout::REACHED as usize - 1).copied().unwrap_or(f32::MAX);
            let expected = if vertex.flags & layout::EYE_GATHER != 0 { tenth } else { -1.0 };
            assert!(close(&[reach.distance], &[expected], 1e-5), "{} photons: {reach:?}, {expected}", photons.len());
        }
    }
}

/// The bits of a film after two iterations.
pub fn film_bits(stages: &mut dyn Stages, params: &Params) -> Vec<u32> {
    start(stages, params).expect("start");
    for i in 1..=2 {
        iterate(stages, &params.frame(i)).expect("iteration");
        stages.times().expect("times");
    }
    let film = stages.film().expect("film");
    assert_eq!(([film.width, film.height], film.n_iterations), (params.film_size(), 2));
    film.pixels.into_iter().flatten().map(f32::to_bits).collect()
}

#[test]
fn an_empty_scene_is_black_on_both() {
    let scene = Scene { cameras: everything().cameras, ..Scene::default() };
    let Some((mut cpu, mut gpu)) = backends(&scene) else { return };
    for stages in [&mut cpu as &mut dyn Stages, &mut gpu] {
        stages.set_first_radii(&vec![0.1; (SIZE * SIZE) as usize]).expect("radii");
        iterate(stages, &params().frame(1)).expect("iteration");
        assert_eq!(stages.n_photons(), 0);
        assert!(stages.film().expect("film").pixels.iter().all(|p| *p == [0.0; 4]));
    }
}

/// A random material, as extreme as not.
fn random_vertex(i: u32) -> EyeVertex {
    let pick = |v: f32| {
        if v < 0.3 {
            0.0
        } else if v < 0.5 {
            1.0
        } else {
            (v - 0.5) * 2.0
        }
    };
    let ([a, b, c, d], [e, f, g, h], [r, s, t, _]) = (random(i, 10), random(i, 11), random(i, 12));
    let normal = sunfleck::math::warp::sphere([a, b]);
    let shading = (normal + 0.3 * pick(c) * sunfleck::math::warp::sphere([d, e])).normalize();
    EyeVertex {
        normal: oct::encode(normal),
        shading_normal: oct::encode(if d < 0.5 { normal } else { shading }),
        base_color: [r, s, t],
        roughness: if f < 0.15 { 0.0 } else { f },
        f0: [0.04 * pick(g); 3],
        f90: pick(g),
        metallic: pick(h),
        transmission: pick(a * 7.0 % 1.0),
        eta: if b < 0.5 { 1.5 } else { 1.0 / 1.33 },
        material_flags: u32::from(c < 0.7),
        ..EyeVertex::default()
    }
}

#[test]
fn the_bsdf_is_the_same_on_both() {
    let Some((_, mut gpu)) = backends(&everything()) else { return };
    let packed = PackedScene::new(&everything());
    let queries: Vec<BsdfQuery> = (0..40_000)
        .map(|i| {
            let mut vertex = random_vertex(i / 8);
            let ([a, b, c, d], [e, f, g, h]) = (random(i, 20), random(i, 21));
            let shading = oct::decode(vertex.shading_normal);
            let known = sunfleck::math::warp::sphere([a, b]);
            vertex.outgoing = oct::encode(if known.dot(shading) < 0.0 { -known } else { known });
            // Near the mirrored direction too, where the lobes are.
            let mirrored = known.reflect(shading).normalize();
            let anywhere = sunfleck::math::warp::sphere([c, d]);
            let other = if h < 0.5 { anywhere } else { (mirrored + 0.2 * anywhere).normalize() };
            BsdfQuery { vertex, other: other.to_array(), lobes: 1 + i % 3, u: [e, f, g], transport: i / 3 % 2 }
        })
        .collect();
    let answers = gpu.ask_bsdf(&queries).expect("answers");
    let (mut differ, mut lit) = (0, 0);
    for (q, a) in queries.iter().zip(&answers) {
        let bsdf = Bsdf::of_vertex(&packed, &q.vertex);
        let lobes = Lobes { diffuse: q.lobes & 1 != 0, specular: q.lobes & 2 != 0 };
        let transport = [Transport::Radiance, Transport::Importance][q.transport as usize];
        let (known, other) = (oct::decode(q.vertex.outgoing), Vec3::from(q.other));
        let value = bsdf.evaluate(known, other, lobes, transport);
        let pdf = bsdf.pdf(known, other, lobes);
        let sampled = bsdf.sample(known, lobes, transport, q.u);
        lit += u32::from(value != Vec3::ZERO && sampled.is_some());
        let same = close(&value.to_array(), &a.value, 2e-3)
            && close(&[pdf], &[a.pdf], 2e-3)
            && u32::from(sampled.is_some()) == a.flags & 1
            && sampled.is_none_or(|s| {
                close(&s.direction.to_array(), &a.direction, 2e-3)
                    && close(&s.weight.to_array(), &a.weight, 2e-3)
                    && close(&[s.pdf], &[a.sampled_pdf], 5e-3)
                    && u32::from(s.transmitted) == a.flags >> 1
            });
        if !same {
            differ += 1;
            if differ <= 5 {
                println!("{q:?}\n{value} {pdf} {sampled:?}\n{a:?}");
            }
        }
    }
    println!("{differ} of {} differ, {lit} are not zero", queries.len());
    assert!(lit > 5000, "only {lit} are not zero");
    // Peaks so narrow that rounding the half-way vector moves them, and numbers within rounding of a choice.
    assert!(differ * 500 <= queries.len(), "{differ} of {} differ", queries.len());
}

/// A closed box with a glass ball and a lamp.
fn cornell() -> Scene {
    let white = Material::diffuse("white", Vec3::splat(0.73));
    let red = Material::diffuse("red", Vec3::new(0.65, 0.05, 0.05));
    let wall =
        |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3], m| Arc::new(quad("wall", [a, b, c, d].map(Vec3::from), m));
    Scene {
        meshes: vec![
            wall([-1., -1., 1.], [1., -1., 1.], [1., -1., -1.], [-1., -1., -1.], 0),
            wall([-1., 1., -1.], [1., 1., -1.], [1., 1., 1.], [-1., 1., 1.], 0),
            wall([-1., -1., -1.], [1., -1., -1.], [1., 1., -1.], [-1., 1., -1.], 0),
            wall([-1., -1., 1.], [-1., -1., -1.], [-1., 1., -1.], [-1., 1., 1.], 1),
            wall([1., -1., -1.], [1., -1., 1.], [1., 1., 1.], [1., 1., -1.], 1),
            wall([-0.25, 0.99, -0.25], [0.25, 0.99, -0.25], [0.25, 0.99, 0.25], [-0.25, 0.99, 0.25], 3),
        ],
        spheres: vec![Sphere { centre: Vec3::new(0.3, -0.6, 0.2), radius: 0.4, inward: false, material: 2 }],
        materials: vec![white, red, Material::glass("glass", 1.5), Material::emitter("lamp", Vec3::splat(15.0))],
        cameras: vec![Camera::look_at("main", Vec3::new(0.0, 0.0, 3.4), Vec3::ZERO, Vec3::Y, 0.7)],
        ..Scene::default()
    }
}

/// Not a test: `cargo test --test it backends::speed -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn speed() {
    for (name, scene) in [("cornell", cornell()), ("everything", everything())] {
        let size = 512;
        let packed = Arc::new(PackedScene::new(&scene));
        let camera = scene.cameras[0].pack(size, size);
        let Some(context) = context() else { return };
        let mut gpu = GpuStages::new(context, &packed, camera).expect("stages");
        let mut cpu = CpuStages::new(packed, camera, [size, size]);
        let params = Params { n_paths: 262_144, ..Params::new(size, size) };
        for stages in [&mut cpu as &mut dyn Stages, &mut gpu] {
            println!("{name} on {}", stages.device());
            stages.set_first_radii(&vec![0.01; (size * size) as usize]).expect("radii");
            let mut laps = Vec::new();
            for i in 0..5 {
                let frame = params.frame(i + 1);
                let mut lap = [cpu_seconds(); 5];
                // Reading the times waits for the device.
                stages.trace_eye(&frame).and_then(|()| stages.times()).expect("eye");
                lap[1] = cpu_seconds();
                stages.trace_photons(&frame).and_then(|()| stages.times()).expect("photons");
                lap[2] = cpu_seconds();
                stages.build_index(&frame).and_then(|()| stages.times()).expect("build");
                lap[3] = cpu_seconds();
                stages.gather(&frame).and_then(|()| stages.times()).expect("gather");
                lap[4] = cpu_seconds();
                stages.accumulate(&frame).expect("accumulate");
                laps.push([lap[1] - lap[0], lap[2] - lap[1], lap[3] - lap[2], lap[4] - lap[3]]);
            }
            // The first holds the compilation.
            let median = |stage: usize| {
                let mut all: Vec<f64> = laps[1..].iter().map(|lap| lap[stage]).collect();
                all.sort_by(f64::total_cmp);
                all[all.len() / 2]
            };
            println!(
                "CPU s: eye {:.2} photons {:.2} build {:.2} gather {:.2}; {} photons",
                median(0),
                median(1),
                median(2),
                median(3),
                stages.n_photons()
            );
        }
    }
}

/// CPU seconds of this process so far.
fn cpu_seconds() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let ticks: f64 = after_name.split_whitespace().skip(11).take(2).filter_map(|t| t.parse::<f64>().ok()).sum();
    ticks / 100.0
}

/// Not a test: `MESA_SHADER_CACHE_DISABLE=true cargo test --test it compile_times -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn compile_times() {
    let scene = Scene { cameras: everything().cameras, ..Scene::default() };
    let Some((_, mut gpu)) = backends(&scene) else { return };
    gpu.set_first_radii(&vec![0.1; (SIZE * SIZE) as usize]).expect("radii");
    let frame = Params { n_paths: 64, ..params() }.frame(1);
    let mut last = cpu_seconds();
    let mut lap = |what: &str| {
        let now = cpu_seconds();
        println!("{what}: {:.2} CPU s", now - last);
        last = now;
    };
    gpu.trace_eye(&frame).and_then(|()| gpu.times()).expect("eye");
    lap("eye");
    gpu.trace_photons(&frame).and_then(|()| gpu.times()).expect("photons");
    lap("photons");
    gpu.set_photons(&[Photon::default(); 100]).expect("photons");
    gpu.build_index(&frame).and_then(|()| gpu.times()).expect("build");
    lap("build");
    gpu.gather(&frame).and_then(|()| gpu.times()).expect("gather");
    lap("gather");
}
