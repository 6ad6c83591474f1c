//! The GPU backend against straightforward computations on the CPU.

use std::sync::{Arc, Mutex, MutexGuard, OnceLock};

use glam::Vec3;
use sunfleck::gpu::{Choice, Context, GpuStages, Method};
use sunfleck::index;
use sunfleck::layout::{self, Camera, EyeVertex, FANOUT, Frame, LEAF_SIZE, Photon, PointBox};
use sunfleck::math::{morton, oct, rng};
use sunfleck::ppm::{Error, Stages, film};
use sunfleck::scene::PackedScene;

pub use crate::gpu_search::context;
use crate::gpu_search::meagre_device;

/// One set of buffers for the tests that need no scene.
fn stages() -> Option<MutexGuard<'static, GpuStages>> {
    static STAGES: OnceLock<Mutex<GpuStages>> = OnceLock::new();
    let context = context()?;
    let stages = STAGES.get_or_init(|| {
        Mutex::new(GpuStages::new(context, &PackedScene::default(), Camera::default()).expect("stages"))
    });
    Some(stages.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
}

/// One more that gathers by ray queries.
fn hardware_stages() -> Option<MutexGuard<'static, GpuStages>> {
    static STAGES: OnceLock<Mutex<GpuStages>> = OnceLock::new();
    let context = crate::gpu_hardware::context()?;
    let stages = STAGES.get_or_init(|| {
        let stages = GpuStages::with_method(context, &PackedScene::default(), Camera::default(), Method::Hardware);
        Mutex::new(stages.expect("stages"))
    });
    Some(stages.lock().unwrap_or_else(std::sync::PoisonError::into_inner))
}

fn random(i: u32, stream: u32) -> [f32; 4] {
    rng::unit4(rng::pcg4d([i, stream, 77, 1]))
}

fn photon(position: Vec3, i: u32) -> Photon {
    let [u, v, w, t] = random(i, 1000);
    let normal = if t < 0.8 { Vec3::Y } else { Vec3::new(u - 0.5, v - 0.5, w - 0.5).normalize_or(Vec3::Y) };
    Photon {
        position: position.to_array(),
        normal_and_segments: oct::encode24(normal) | (1 + i % 5) << 24,
        power: [u, v, w],
        direction: oct::encode(Vec3::new(u - 0.5, v - 0.3, w - 0.5).normalize_or(Vec3::Y)),
    }
}

/// Point sets that have broken trees before.
fn photon_sets() -> Vec<(&'static str, Vec<Photon>)> {
    let make = |n: u32, at: &dyn Fn(u32) -> Vec3| (0..n).map(|i| photon(at(i), i)).collect::<Vec<_>>();
    let unit = |i: u32, stream: u32| {
        let [x, y, z, _] = random(i, stream);
        Vec3::new(x, y, z)
    };
    vec![
        ("none", Vec::new()),
        ("one", make(1, &|_| Vec3::new(0.5, 0.5, 0.5))),
        ("nine", make(9, &|i| unit(i, 1))),
        ("random", make(20_000, &|i| unit(i, 2))),
        ("clustered", make(10_000, &|i| unit(i / 500, 3) + (unit(i, 4) - 0.5) * 1e-3)),
        ("coincident", make(3000, &|_| Vec3::new(-3.5, 2.0, 1e4))),
        ("on a plane", make(20_000, &|i| unit(i, 5) * Vec3::new(1.0, 0.0, 1.0))),
        ("on a line far away", make(5000, &|i| Vec3::new(148376.0, 1234.0, -223423.0 + i as f32 * 0.1))),
    ]
}

/// Morton keys of all photons, in their bounds.
fn keys(photons: &[Photon]) -> Vec<u64> {
    let at = |p: &Photon| Vec3::from(p.position);
    let low = photons.iter().map(at).reduce(Vec3::min).unwrap_or_default();
    let high = photons.iter().map(at).reduce(Vec3::max).unwrap_or_default();
    let scale = (high - low).map(|extent| if extent < 1e-30 { 0.0 } else { morton::CELLS / extent });
    let key = |p: &Photon| {
        let cell = ((at(p) - low) * scale).clamp(Vec3::ZERO, Vec3::splat(morton::CELLS - 1.0));
        morton::interleave(cell.to_array().map(|c| c as u32))
    };
    photons.iter().map(key).collect()
}

fn straightforward_tree(photons: &[Photon]) -> Vec<PointBox> {
    let around = |boxes: &[PointBox]| {
        boxes[1..].iter().fold(boxes[0], |a, b| PointBox {
            min: Vec3::from(a.min).min(Vec3::from(b.min)).to_array(),
            max: Vec3::from(a.max).max(Vec3::from(b.max)).to_array(),
            ..a
        })
    };
    let points: Vec<_> =
        photons.iter().map(|p| PointBox { min: p.position, max: p.position, ..Default::default() }).collect();
    let mut level: Vec<_> = points.chunks(LEAF_SIZE as usize).map(around).collect();
    let mut tree = level.clone();
    while level.len() > 1 {
        level = level.chunks(FANOUT as usize).map(around).collect();
        tree.extend(&level);
    }
    tree
}

#[test]
fn photons_are_sorted_stably_and_the_boxes_are_tight() {
    let Some(mut gpu) = stages() else { return };
    for (name, photons) in photon_sets() {
        gpu.set_photons(&photons).expect("upload");
        gpu.build_index(&Frame::default()).expect("build");
        let built = gpu.photons().expect("photons");
        let mut sorted: Vec<(u64, Photon)> = keys(&photons).into_iter().zip(photons).collect();
        sorted.sort_by_key(|(key, _)| *key);
        let sorted: Vec<Photon> = sorted.into_iter().map(|(_, photon)| photon).collect();
        assert!(built == sorted, "{name}: not in the order of a stable sort");
        assert!(gpu.tree().expect("tree") == straightforward_tree(&built), "{name}: boxes");
    }
}

/// A pixel that gathers at a random place near the photons.
fn eye_vertex(photons: &[Photon], i: u32) -> EyeVertex {
    let [u, v, w, t] = random(i, 2000);
    let near = photons.get((u * photons.len() as f32) as usize).map_or(Vec3::splat(0.5), |p| Vec3::from(p.position));
    let normal = if t < 0.8 { Vec3::Y } else { Vec3::new(v - 0.5, 0.8, w - 0.5).normalize() };
    EyeVertex {
        position: (near + Vec3::new(v - 0.5, (w - 0.5) * 0.1, u - 0.5) * 0.02).to_array(),
        flags: if i % 16 == 7 { 0 } else { layout::EYE_GATHER } | (1 + i % 3) << 8,
        throughput: [0.5, 1.0, 2.0],
        normal: oct::encode(normal),
        shading_normal: oct::encode((normal + Vec3::new(0.1, 0.0, 0.0)).normalize()),
        diffuse: [0.2, 0.1, 0.3],
        radiance: [0.01, 0.02, 0.03],
        transmission: if i.is_multiple_of(5) { 0.5 } else { 0.0 },
        ..Default::default()
    }
}

/// Radiance by looking at every photon, in double precision, and how much of it hangs on tests too close to call in
/// single precision: there the device may decide otherwise, for it may fuse multiplications and additions.
fn brute_force(frame: &Frame, vertex: &EyeVertex, radius: f32, photons: &[Photon]) -> ([f64; 3], [f64; 3]) {
    let mut sum = [0.0; 3];
    let mut doubtful = [0.0; 3];
    let normal = oct::decode(vertex.normal).as_dvec3();
    let shading = oct::decode(vertex.shading_normal).as_dvec3();
    let r = f64::from(radius * frame.radius_scale);
    let x = Vec3::from(vertex.position);
    if vertex.flags & layout::EYE_GATHER != 0 {
        for p in photons {
            let delta = (Vec3::from(p.position) - x).as_dvec3();
            let t2 = delta.length_squared() / (r * r);
            let cosine = normal.dot(oct::decode24(p.normal_and_segments).as_dvec3());
            let off = delta.dot(normal).abs() / (0.1 * r);
            let side = oct::decode(p.direction).as_dvec3().dot(shading);
            let segments = (vertex.flags >> 8 & 255) + p.segments();
            if segments > frame.max_segments {
                continue;
            }
            let margins = [1.0 - t2, cosine - 0.9, 1.0 - off, side];
            let near = margins.iter().any(|m| m.abs() < 1e-5);
            if margins.iter().any(|m| *m < -1e-5) {
                continue;
            }
            let constant = frame.flags & layout::FRAME_CONSTANT_KERNEL != 0;
            let weight = if constant { 1.0 } else { 2.0 * (1.0 - t2).max(0.0) };
            let scale = weight / (std::f64::consts::PI * r * r * f64::from(frame.n_paths));
            for c in 0..3 {
                let part = scale * f64::from(p.power[c] * vertex.diffuse[c] * vertex.throughput[c]);
                if near { doubtful[c] += part } else { sum[c] += part }
            }
        }
    }
    for (sum, radiance) in sum.iter_mut().zip(vertex.radiance) {
        *sum += f64::from(radiance);
    }
    (sum, doubtful)
}

fn gather_frame(n: u32, flags: u32) -> Frame {
    Frame {
        width: n,
        height: 1,
        iteration: 1,
        n_paths: 1000,
        max_segments: 6,
        flags,
        radius_scale: 0.7,
        ..Frame::default()
    }
}

#[test]
fn gather_finds_what_brute_force_finds() {
    let Some(mut gpu) = stages() else { return };
    assert_gathers(&mut gpu);
}

#[test]
fn ray_queries_find_what_brute_force_finds() {
    let Some(mut gpu) = hardware_stages() else { return };
    assert_gathers(&mut gpu);
}

fn assert_gathers(gpu: &mut GpuStages) {
    for (name, photons) in photon_sets() {
        let n = 300;
        let vertices: Vec<_> = (0..n).map(|i| eye_vertex(&photons, i)).collect();
        let radii: Vec<f32> = (0..n).map(|i| 0.002 * 100f32.powf(random(i, 3000)[0])).collect();
        for flags in [0, layout::FRAME_CONSTANT_KERNEL] {
            let frame = gather_frame(n, flags);
            gpu.set_first_radii(&radii).expect("radii");
            gpu.set_eye_vertices(&vertices).expect("vertices");
            gpu.set_photons(&photons).expect("photons");
            gpu.build_index(&frame).expect("build");
            gpu.gather(&frame).expect("gather");
            let radiance = gpu.radiance().expect("radiance");
            let mut lit = 0;
            for (i, (got, vertex)) in radiance.iter().zip(&vertices).enumerate() {
                let (expected, doubtful) = brute_force(&frame, vertex, radii[i], &photons);
                lit += u32::from(expected[0] > 0.0101);
                for c in 0..3 {
                    let low = expected[c] * (1.0 - 2e-5);
                    let high = (expected[c] + doubtful[c]) * (1.0 + 2e-5);
                    let got = f64::from(got[c]);
                    assert!(low <= got && got <= high, "{name}, pixel {i}: {got} is not in [{low}, {high}]");
                }
            }
            assert!(photons.len() < 3000 || lit > 50, "{name}: only {lit} pixels found photons");
        }
    }
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let Some(mut gpu) = stages() else { return };
    let (_, photons) = photon_sets().swap_remove(3);
    let n = 5000;
    let vertices: Vec<_> = (0..n).map(|i| eye_vertex(&photons, i)).collect();
    let frame = gather_frame(n, 0);
    let mut run = || {
        gpu.set_first_radii(&vec![0.05; n as usize]).expect("radii");
        gpu.set_eye_vertices(&vertices).expect("vertices");
        gpu.set_photons(&photons).expect("photons");
        gpu.build_index(&frame).expect("build");
        gpu.gather(&frame).expect("gather");
        gpu.radiance().expect("radiance").into_iter().flatten().map(f32::to_bits).collect::<Vec<_>>()
    };
    assert!(run() == run());
}

/// Boxes are as wide as the radius they were built for.
#[test]
fn ray_queries_refuse_radii_above_the_built_one() {
    let Some(mut gpu) = hardware_stages() else { return };
    let (_, photons) = photon_sets().swap_remove(2);
    let frame = gather_frame(4, 0);
    let vertices: Vec<_> = (0..4).map(|i| eye_vertex(&photons, i)).collect();
    gpu.set_eye_vertices(&vertices).expect("vertices");
    gpu.set_photons(&photons).expect("photons");
    gpu.set_first_radii(&[0.1, 0.3, 0.2, 0.0]).expect("radii");
    gpu.build_index(&frame).expect("build");
    gpu.gather(&frame).expect("gather");
    gpu.set_first_radii(&[0.1, 0.1, 0.4, 0.0]).expect("radii");
    match gpu.gather(&frame) {
        Err(Error::Search(index::Error::RadiusAboveBuilt { query: 2, radius, built })) => {
            assert_eq!((radius, built), (0.4 * frame.radius_scale, 0.3 * frame.radius_scale));
        }
        other => panic!("{other:?}"),
    }
    gpu.build_index(&frame).expect("build");
    gpu.gather(&frame).expect("gather");
}

/// The constants of a scene do not fit: an error, though nobody handles what the device says.
#[test]
fn what_a_device_of_ones_own_refuses_is_an_error() {
    let context = meagre_device(|limits| {
        limits.max_storage_buffers_per_shader_stage = 11;
        limits.max_uniform_buffer_binding_size = 64;
    });
    let Some(context) = context else { return };
    let made = GpuStages::new(context, &PackedScene::default(), Camera::default()).map(drop);
    assert!(matches!(&made, Err(error) if error.to_string().contains("64")), "{made:?}");
}

#[test]
fn ray_queries_need_a_device_opened_for_them() {
    let Some(context) = context() else { return };
    let refused = GpuStages::with_method(context, &PackedScene::default(), Camera::default(), Method::Hardware);
    assert!(matches!(refused.err(), Some(Error::NoDevice(_))));
}

#[test]
fn the_film_accumulates_as_on_the_cpu() {
    let Some(mut gpu) = stages() else { return };
    let n = 70_000;
    gpu.set_first_radii(&vec![0.1; n as usize]).expect("radii");
    gpu.set_photons(&[]).expect("photons");
    let mut expected = vec![[0f32; 4]; n as usize];
    for iteration in 1..=4 {
        let frame = Frame { iteration, ..gather_frame(n, 0) };
        let vertices: Vec<EyeVertex> = (0..n)
            .map(|i| {
                let [r, g, b, _] = random(i, iteration);
                EyeVertex { radiance: [r, g, b], ..Default::default() }
            })
            .collect();
        gpu.set_eye_vertices(&vertices).expect("vertices");
        gpu.build_index(&frame).expect("build");
        gpu.gather(&frame).expect("gather");
        gpu.accumulate(&frame).expect("accumulate");
        for (pixel, vertex) in expected.iter_mut().zip(&vertices) {
            film::add(pixel, iteration, vertex.radiance);
        }
    }
    let film = gpu.film().expect("film");
    assert_eq!((film.width, film.height, film.n_iterations), (n, 1, 4));
    for (got, expected) in film.pixels.iter().zip(&expected) {
        for c in 0..4 {
            assert!((got[c] - expected[c]).abs() < 2e-6, "{got:?} against {expected:?}");
        }
    }
    assert!(gpu.times().expect("times").total() > 0.0);
}

#[test]
fn what_does_not_fit_is_refused_with_its_size() {
    if context().is_none() {
        return;
    }
    let mut context = Context::new(&Choice::Any).expect("a second device");
    context.set_budget(1 << 20);
    let mut gpu = GpuStages::new(Arc::new(context), &PackedScene::default(), Camera::default()).expect("stages");
    gpu.set_photons(&vec![Photon::default(); 1000]).expect("within the budget");
    match gpu.set_photons(&vec![Photon::default(); 100_000]) {
        Err(Error::TooLarge { what, needed, allowed, .. }) => {
            assert_eq!((what.as_str(), needed), ("photons", 3_200_000));
            assert!(allowed <= 1 << 20);
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_lost_device_is_an_error() {
    if context().is_none() {
        return;
    }
    let context = Arc::new(Context::new(&Choice::Any).expect("a second device"));
    let mut gpu = GpuStages::new(Arc::clone(&context), &PackedScene::default(), Camera::default()).expect("stages");
    context.destroy();
    let result = gpu.set_photons(&[Photon::default(); 10]).and_then(|()| gpu.photons());
    assert!(matches!(result, Err(Error::Device { .. })), "{result:?}");
}

#[test]
fn devices_are_chosen_by_index_and_name() {
    let devices = sunfleck::gpu::list_devices();
    if context().is_none() {
        return;
    }
    let first = &devices[0];
    let part = first.name.to_uppercase();
    assert_eq!(Context::new(&Choice::Name(part)).expect("by name").info().name, first.name);
    assert_eq!(Context::new(&Choice::Index(0)).expect("by index").info(), first);
    for choice in [Choice::Index(devices.len()), Choice::Name("no such thing".into())] {
        match Context::new(&choice) {
            Err(Error::NoDevice(message)) => assert!(message.contains(&first.name), "{message}"),
            _ => panic!("{choice:?} was found"),
        }
    }
    let real = devices.iter().any(|d| d.is_real());
    assert_eq!(Context::new(&Choice::Real).is_ok(), real);
}

/// Not a test: `cargo test --test it gpu::speed -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn speed() {
    let Some(mut gpu) = stages() else { return };
    let n = 500_000;
    let photons: Vec<Photon> = (0..n)
        .map(|i| {
            let [x, y, z, t] = random(i, 9);
            let wall = [Vec3::new(x, y, 0.0), Vec3::new(x, 0.0, z), Vec3::new(0.0, y, z)][(t * 3.0) as usize];
            photon(wall, i)
        })
        .collect();
    let side = 512;
    let vertices: Vec<EyeVertex> = (0..side * side)
        .map(|i| {
            let position = Vec3::new((i % side) as f32, 0.0, (i / side) as f32) / side as f32;
            EyeVertex { position: position.to_array(), normal: oct::encode(Vec3::Y), ..eye_vertex(&[], i) }
        })
        .collect();
    let frame = Frame { width: side, height: side, radius_scale: 1.0, ..gather_frame(0, 0) };
    for radius in [0.004, 0.008] {
        for _ in 0..4 {
            gpu.set_first_radii(&vec![radius; vertices.len()]).expect("radii");
            gpu.set_eye_vertices(&vertices).expect("vertices");
            gpu.set_photons(&photons).expect("photons");
            gpu.build_index(&frame).expect("build");
            gpu.gather(&frame).expect("gather");
            gpu.accumulate(&frame).expect("accumulate");
            println!("radius {radius}: {:?}", gpu.times().expect("times"));
        }
    }
}
