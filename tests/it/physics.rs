//! What a right renderer must show: closed forms, furnace, balance of flux, rates of convergence.
//!
//! Pixels of one run share photons, so every error bar comes from independent seeds.

use std::f32::consts::PI;
use std::sync::Arc;

use glam::Vec3;
use sunfleck::cpu::{CpuStages, photons};
use sunfleck::layout;
use sunfleck::ppm::{self, Direct, FirstRadius, Kernel, Params, Stages};
use sunfleck::scene::{
    Camera, Environment, Material, Mesh, PackedScene, Projection, PunctualKind, PunctualLight, Scene, Sphere,
};

/// Mean of `n` iterations, `[h·w]`.
fn render(scene: &Scene, camera: &Camera, params: &Params, n: u32) -> Vec<Vec3> {
    let packed = Arc::new(PackedScene::new(scene));
    let [w, h] = params.size;
    let mut stages = CpuStages::new(packed, camera.pack(w, h), params.film_size());
    ppm::start(&mut stages, params).unwrap();
    for i in 1..=n {
        ppm::iterate(&mut stages, &params.frame(i)).unwrap();
    }
    stages.film().unwrap().rgb().into_iter().map(Vec3::from).collect()
}

/// Mean and standard error over seeds of the picture's mean.
fn over_seeds(seeds: u32, mut mean_of: impl FnMut(u32) -> f64) -> (f64, f64) {
    let values: Vec<f64> = (0..seeds).map(&mut mean_of).collect();
    let mean = values.iter().sum::<f64>() / f64::from(seeds);
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / f64::from(seeds - 1);
    (mean, (variance / f64::from(seeds)).sqrt())
}

fn mean(picture: &[Vec3]) -> f64 {
    picture.iter().map(|c| f64::from(c.y)).sum::<f64>() / picture.len() as f64
}

#[track_caller]
fn assert_close((mean, error): (f64, f64), expected: f64, share: f64) {
    let off = (mean - expected).abs();
    assert!(off < 3.0 * error + 1e-5 * expected, "{mean} ± {error}, expected {expected}: {:.1} σ", off / error);
    assert!(off < share * expected, "{mean}, expected {expected} within {share}");
    assert!(error < share * expected, "the error bar {error} is too wide to show anything");
}

fn inside(material: Material) -> Scene {
    Scene {
        spheres: vec![Sphere { centre: Vec3::ZERO, radius: 2.0, inward: true, material: 0 }],
        materials: vec![material],
        ..Scene::default()
    }
}

fn off_centre() -> Camera {
    Camera::look_at("", Vec3::new(0.3, 0.2, 0.5), Vec3::new(0.0, 0.1, -2.0), Vec3::Y, 1.0)
}

fn small(n_paths: u32) -> Params {
    Params { n_paths, radius: FirstRadius::Fixed(0.25), ..Params::new(16, 16) }
}

fn point_light(position: Vec3, intensity: f32) -> PunctualLight {
    PunctualLight {
        name: String::new(),
        position,
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(intensity),
        kind: PunctualKind::Point,
    }
}

/// Inside a sphere that emits L and reflects ρ, radiance is L/(1 − ρ). The cap of a sphere within a chord r of a point
/// has area πr², so density estimation is unbiased at any radius.
#[test]
fn closed_enclosure() {
    let (emission, albedo) = (0.7, 0.6);
    let mut material = Material::diffuse("wall", Vec3::splat(albedo));
    material.emission = Vec3::splat(emission);
    let scene = inside(material);
    for direct in [Direct::Sampled, Direct::Photons] {
        for kernel in [Kernel::Epanechnikov, Kernel::Constant] {
            let found = over_seeds(10, |seed| {
                mean(&render(&scene, &off_centre(), &Params { seed, direct, kernel, ..small(20_000) }, 4))
            });
            assert_close(found, f64::from(emission / (1.0 - albedo)), 3e-3);
        }
    }
}

/// Cut at D segments, the sum of the series stops there: L(1 − ρ^D)/(1 − ρ).
#[test]
fn closed_enclosure_cut_at_a_length() {
    let (emission, albedo) = (0.7f32, 0.8f32);
    let mut material = Material::diffuse("wall", Vec3::splat(albedo));
    material.emission = Vec3::splat(emission);
    let scene = inside(material);
    for (depth, direct, roulette) in [
        (1, Direct::Sampled, true),
        (2, Direct::Sampled, true),
        (4, Direct::Sampled, true),
        (4, Direct::Photons, false),
    ] {
        let expected = emission * (1.0 - albedo.powi(depth as i32)) / (1.0 - albedo);
        let found = over_seeds(10, |seed| {
            let params = Params { seed, direct, roulette, max_segments: depth, ..small(20_000) };
            mean(&render(&scene, &off_centre(), &params, 3))
        });
        if depth == 1 {
            assert!((found.0 - f64::from(expected)).abs() < 1e-5, "{found:?}");
        } else {
            assert_close(found, f64::from(expected), 3e-3);
        }
    }
}

/// A point light I in the middle of a diffuse sphere of radius R: L = ρI/(πR²(1 − ρ)).
#[test]
fn point_light_in_a_sphere() {
    let albedo = 0.5;
    let mut scene = inside(Material::diffuse("wall", Vec3::splat(albedo)));
    scene.lights.push(point_light(Vec3::ZERO, 3.0));
    let expected = f64::from(albedo * 3.0 / (PI * 4.0 * (1.0 - albedo)));
    for direct in [Direct::Sampled, Direct::Photons] {
        let found =
            over_seeds(10, |seed| mean(&render(&scene, &off_centre(), &Params { seed, direct, ..small(30_000) }, 4)));
        assert_close(found, expected, 3e-3);
    }
}

/// Inside uniform light a clear solid cannot be seen: radiance scales by η² across its surface and back, and what
/// photons bring through it is not scaled.
#[test]
fn glass_in_an_enclosure_is_invisible() {
    let mut wall = Material::diffuse("wall", Vec3::splat(0.5));
    wall.emission = Vec3::splat(0.5);
    let mut scene = inside(wall);
    scene.materials.push(Material::glass("glass", 1.5));
    scene.spheres.push(Sphere { centre: Vec3::new(0.1, 0.0, -0.9), radius: 0.5, inward: false, material: 1 });
    let found = over_seeds(10, |seed| mean(&render(&scene, &off_centre(), &Params { seed, ..small(30_000) }, 8)));
    assert_close(found, 1.0, 4e-3);
}

/// A white core in a glass ball in uniform light: the eye looks into the denser medium, where radiance is η² larger, and
/// sees it scaled back. All of the core's light is brought by photons.
#[test]
fn diffuser_inside_glass_sees_enclosure_radiance() {
    let mut wall = Material::diffuse("wall", Vec3::ZERO);
    wall.emission = Vec3::ONE;
    let mut scene = inside(wall);
    scene.materials.push(Material::glass("glass", 1.5));
    scene.materials.push(Material::diffuse("core", Vec3::ONE));
    let centre = Vec3::new(0.0, 0.0, -0.9);
    scene.spheres.push(Sphere { centre, radius: 0.6, inward: false, material: 1 });
    scene.spheres.push(Sphere { centre, radius: 0.35, inward: false, material: 2 });
    let camera = Camera::look_at("", Vec3::new(0.0, 0.0, 0.5), centre, Vec3::Y, 0.4);
    let found = over_seeds(10, |seed| {
        let params = Params { seed, radius: FirstRadius::Fixed(0.06), ..small(200_000) };
        mean(&render(&scene, &camera, &params, 12))
    });
    assert_close(found, 1.0, 8e-3);
}

/// E = I·h/(h² + x²)^1.5 below a point light, and the constant kernel's bias is ∇²E·r²/8.
#[test]
fn point_light_over_a_plane_with_the_bias_of_its_kernel() {
    let (height, intensity, radius) = (1.0f32, 2.0f32, 0.3f32);
    let scene = plane(height, intensity);
    // Mean of E over the disc below the light: ∫ I·h·s/(h² + s²)^1.5 · 2/r² ds; to first order 1 − 6r²/8h².
    let lit = intensity / (height * height);
    let in_disc = 2.0 * intensity / radius.powi(2) * (1.0 - height / height.hypot(radius));
    assert!((in_disc / lit - (1.0 - 6.0 / 8.0 * radius.powi(2))).abs() < 6e-3, "the form in quality.md");
    let camera = down(0.01);
    let found = over_seeds(20, |seed| {
        let params = Params {
            seed,
            direct: Direct::Photons,
            kernel: Kernel::Constant,
            radius: FirstRadius::Fixed(radius),
            n_paths: 200_000,
            ..Params::new(2, 2)
        };
        mean(&render(&scene, &camera, &params, 1))
    });
    assert_close(found, f64::from(in_disc / PI), 2e-2);
    let sampled = mean(&render(&scene, &camera, &Params { n_paths: 10, ..Params::new(2, 2) }, 1));
    assert!((sampled - f64::from(lit / PI)).abs() < 1e-3 * sampled, "{sampled}");
}

/// Photons of light from far away are sent about what is a speck in the scene; on the ground around it irradiance is the same
/// everywhere, E = L·cos θ of a sun and πL of an even sky, but for what the speck, which is black, hides of it.
#[test]
fn far_light_is_as_bright_beside_a_subject_and_far_from_it() {
    let albedo = 0.5;
    let speck = Sphere { centre: Vec3::new(0.0, 5.0, 0.0), radius: 0.5, inward: false, material: 1 };
    let mut scene = plane(1.0, 0.0);
    let mut ground = Mesh::clone(&scene.meshes[0]);
    ground.positions.iter_mut().for_each(|p| *p *= 40.0);
    scene.meshes = vec![ground.into()];
    scene.materials = vec![Material::diffuse("", Vec3::splat(albedo)), Material::diffuse("", Vec3::ZERO)];
    scene.spheres = vec![speck];
    let direction = Vec3::new(0.6, -0.8, 0.0);
    let kind = PunctualKind::Directional;
    let sun = PunctualLight { direction, kind, intensity: Vec3::ONE, ..point_light(Vec3::ZERO, 1.0) };
    let mut sunny = scene.clone();
    sunny.lights = vec![sun];
    let mut overcast = scene;
    overcast.lights = vec![];
    overcast.environment = Some(Environment::uniform(Vec3::ONE));
    let info = PackedScene::new(&sunny).info;
    assert!(info.subject_radius == 0.5 && info.radius > 280.0, "{info:?}");
    // How far to the side, how large a square, how large a radius.
    for (aside, half, radius, error) in [(-3.0f32, 1.0, 0.5, 3e-2), (40.0, 4.0, 2.0, 4e-2), (-150.0, 30.0, 8.0, 4e-2)] {
        let mut camera = down(half);
        camera.world_from_camera.translation.x += aside;
        let seen = |scene: &Scene, seed| {
            let params = Params {
                seed,
                direct: Direct::Photons,
                radius: FirstRadius::Fixed(radius),
                n_paths: 100_000,
                ..Params::new(4, 4)
            };
            mean(&render(scene, &camera, &params, 8))
        };
        assert_close(over_seeds(8, |seed| seen(&sunny, seed)), f64::from(albedo / PI * 0.8), error);
        let away = speck.centre.distance(Vec3::new(aside, 0.0, 0.0));
        let hidden = (speck.radius / away).powi(2) * speck.centre.y / away;
        assert_close(over_seeds(8, |seed| seen(&overcast, seed)), f64::from(albedo * (1.0 - hidden)), error);
    }
}

/// A white plane at y = 0 with a point light above its middle.
fn plane(height: f32, intensity: f32) -> Scene {
    let corner = |x: f32, z: f32| Vec3::new(x * 5.0, 0.0, z * 5.0);
    Scene {
        meshes: vec![Arc::new(Mesh {
            positions: vec![corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..Mesh::default()
        })],
        materials: vec![Material::diffuse("plane", Vec3::ONE)],
        lights: vec![point_light(Vec3::new(0.0, height, 0.0), intensity)],
        ..Scene::default()
    }
}

/// Looks straight down at a square of the plane.
fn down(half: f32) -> Camera {
    let mut camera = Camera::look_at("", Vec3::new(0.0, 0.5, 0.0), Vec3::ZERO, Vec3::NEG_Z, 1.0);
    camera.projection = Projection::Orthographic { ymag: half };
    camera
}

/// Knaus & Zwicker 2011: with α = 2/3 the variance of the mean falls as N^(−2/3), and so does the squared error.
#[test]
fn error_falls_at_the_rate_of_knaus_and_zwicker() {
    let packed = Arc::new(PackedScene::new(&plane(1.0, 1.0)));
    let camera = down(1.0);
    let n_side = 12;
    let stops = [4u32, 16, 64, 256];
    // Irradiance of the light over π, averaged over each pixel.
    let truth: Vec<f64> = (0..n_side * n_side)
        .map(|i| {
            let sub_pixels = (0..64).map(|s| {
                let at = |p: u32, s: u32| (f64::from(p) + (f64::from(s) + 0.5) / 8.0) / f64::from(n_side) * 2.0 - 1.0;
                let (x, y) = (at(i % n_side, s % 8), at(i / n_side, s / 8));
                (1.0 + x * x + y * y).powf(-1.5) / std::f64::consts::PI / 64.0
            });
            sub_pixels.sum()
        })
        .collect();
    let mut squared = [0.0; 4];
    for seed in 0..12 {
        let params = Params {
            seed,
            direct: Direct::Photons,
            radius: FirstRadius::Fixed(0.25),
            n_paths: 3000,
            ..Params::new(n_side, n_side)
        };
        let mut stages = CpuStages::new(packed.clone(), camera.pack(n_side, n_side), [n_side; 2]);
        ppm::start(&mut stages, &params).unwrap();
        for i in 1..=stops[3] {
            ppm::iterate(&mut stages, &params.frame(i)).unwrap();
            if let Some(k) = stops.iter().position(|&s| s == i) {
                let film = stages.film().unwrap().rgb();
                squared[k] += film.iter().zip(&truth).map(|(p, t)| (f64::from(p[1]) - t).powi(2)).sum::<f64>();
            }
        }
    }
    // Least squares through the logarithms.
    let points: Vec<(f64, f64)> = stops.iter().zip(squared).map(|(&n, e)| (f64::from(n).ln(), e.ln())).collect();
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / 4.0, points.iter().map(|p| p.1).sum::<f64>() / 4.0);
    let slope = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum::<f64>()
        / points.iter().map(|p| (p.0 - mx).powi(2)).sum::<f64>();
    assert!((slope + 2.0 / 3.0).abs() < 0.07, "slope {slope}, {points:?}");
}

/// Every material of albedo 1 disappears in uniform light.
#[test]
fn white_furnace() {
    let white = |metallic, roughness, specular| Material { metallic, roughness, specular, ..Material::default() };
    let glass = |roughness, volume| Material { roughness, transmission: 1.0, volume, ..Material::default() };
    // (material, energy that single scattering may lose)
    let mut cases = vec![(white(0.0, 1.0, 0.0), 0.0), (glass(0.0, true), 0.0), (glass(0.0, false), 0.0)];
    for roughness in [0.0, 0.1, 0.25, 0.4, 0.7, 1.0] {
        for metallic in [0.0, 0.5, 1.0] {
            cases.push((white(metallic, roughness, 1.0), 0.0));
        }
    }
    // Rough glass is not compensated: it darkens by what is reflected twice between its microfacets. Another renderer's
    // solid ball of this roughness keeps 0.817; a few lines of NumPy say 0.792 of the thin one.
    cases.extend([(glass(0.2, true), 0.01), (glass(0.5, true), 0.19), (glass(0.5, false), 0.21)]);
    cases.push((Material { transmission: 0.5, roughness: 0.0, volume: true, ..Material::default() }, 0.0));
    for (material, may_lose) in cases {
        let scene = Scene {
            spheres: vec![Sphere { centre: Vec3::ZERO, radius: 1.0, inward: false, material: 0 }],
            materials: vec![material.clone()],
            environment: Some(Environment::uniform(Vec3::ONE)),
            ..Scene::default()
        };
        let camera = Camera::look_at("", Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 0.4);
        // Photons matter only where they are gathered inside or behind glass: the ball is convex.
        let n_paths = if material.transmission > 0.0 { 60_000 } else { 1000 };
        let (found, error) = over_seeds(6, |seed| {
            let params = Params { seed, radius: FirstRadius::Fixed(0.1), n_paths, ..Params::new(128, 128) };
            mean(&render(&scene, &camera, &params, 8))
        });
        let off = found - 1.0;
        let name = format!(
            "metallic {} roughness {} transmission {}",
            material.metallic, material.roughness, material.transmission
        );
        eprintln!("{name}: {off:+.4} ± {error:.4}");
        assert!(off < 3.0 * error + 2e-3, "{name} glows: {found} ± {error}");
        assert!(off > -3.0 * error - 3e-3 - may_lose, "{name} darkens: {found} ± {error}");
        assert!(error < if may_lose > 0.0 { 1e-2 } else { 4e-3 }, "{name}: {error}");
    }
}

#[derive(Default)]
struct Balance {
    emitted: f64,
    absorbed: f64,
    escaped: f64,
    cut_off: f64,
    stored: Vec<layout::Photon>,
}

impl photons::Sink for Balance {
    fn store(&mut self, photon: layout::Photon) {
        self.stored.push(photon);
    }
    fn emitted(&mut self, power: Vec3) {
        self.emitted += f64::from(power.y);
    }
    fn absorbed(&mut self, power: Vec3) {
        self.absorbed += f64::from(power.y);
    }
    fn escaped(&mut self, power: Vec3) {
        self.escaped += f64::from(power.y);
    }
    fn cut_off(&mut self, power: Vec3) {
        self.cut_off += f64::from(power.y);
    }
}

fn balance(scene: &Scene, params: &Params) -> Balance {
    let packed = PackedScene::new(scene);
    let mut b = Balance::default();
    for path in 0..params.n_paths {
        photons::trace(&packed, &params.frame(1), path, &mut b);
    }
    b
}

/// What is emitted is absorbed, escapes or is cut off; and it is absorbed in the expected amount: with albedo ρ,
/// a share ρ^D of a closed room's light is left after D segments.
#[test]
fn flux_is_balanced() {
    let albedo = 0.7f32;
    let mut scene = inside(Material::diffuse("wall", Vec3::splat(albedo)));
    scene.lights.push(point_light(Vec3::new(0.2, 0.0, 0.0), 3.0));
    scene.materials.push(Material { volume: true, transmission: 1.0, roughness: 0.3, ..Material::default() });
    scene.spheres.push(Sphere { centre: Vec3::new(-0.8, 0.0, 0.0), radius: 0.4, inward: false, material: 1 });
    let n_paths = 200_000;
    for (roulette, depth) in [(true, 255), (false, 6)] {
        let params = Params { roulette, max_photon_segments: depth, n_paths, ..Params::new(1, 1) };
        let b = balance(&scene, &params);
        let emitted = 4.0 * std::f64::consts::PI * 3.0;
        assert!((b.emitted / f64::from(n_paths) / emitted - 1.0).abs() < 1e-6);
        let sum = b.absorbed + b.escaped + b.cut_off;
        assert!((sum / b.emitted - 1.0).abs() < 1e-6, "{sum} of {}", b.emitted);
        assert!(b.escaped == 0.0, "a closed room lets nothing out: {}", b.escaped);
    }
    // Without the ball the share that is left is known.
    scene.spheres.pop();
    let b = balance(&scene, &Params { roulette: false, max_photon_segments: 6, n_paths: 20_000, ..Params::new(1, 1) });
    let left = f64::from(albedo).powi(6);
    assert!((b.cut_off / b.emitted / left - 1.0).abs() < 1e-4, "{} of {left}", b.cut_off / b.emitted);
    // Each photon stands for the flux through its place: stored flux = incident flux = Σ ρ^k, first bounces not stored.
    let stored: f64 = b.stored.iter().map(|p| f64::from(p.power[1])).sum();
    let expected: f64 = (1..6).map(|k| f64::from(albedo).powi(k)).sum();
    assert!((stored / b.emitted / expected - 1.0).abs() < 1e-4, "{} of {expected}", stored / b.emitted);
}

/// The radiometry of every light: flux through a sphere around it, or onto the scene's disc.
#[test]
fn lights_emit_their_power() {
    let pi = std::f64::consts::PI;
    let (inner, outer) = (0.3f32, 0.6f32);
    let light = |kind| PunctualLight {
        name: String::new(),
        position: Vec3::ZERO,
        direction: Vec3::new(0.6, -0.8, 0.0),
        intensity: Vec3::ONE,
        kind,
    };
    let ball = |material, lights: Vec<PunctualLight>, environment: Option<Environment>| Scene {
        spheres: vec![Sphere { centre: Vec3::ZERO, radius: 0.5, inward: false, material: 0 }],
        materials: vec![material],
        lights,
        environment,
        ..Scene::default()
    };
    let white = || Material::diffuse("", Vec3::ONE);
    // ∫ of the spot's falloff ((cos − cos_o)/(cos_i − cos_o))² over its rim is a third of the rim.
    let (ci, co) = (f64::from(inner.cos()), f64::from(outer.cos()));
    let spot_power = 2.0 * pi * ((1.0 - ci) + (ci - co) / 3.0);
    let disc = |scene: &Scene| pi * f64::from(PackedScene::new(scene).info.radius).powi(2);
    let sun = ball(white(), vec![light(PunctualKind::Directional)], None);
    let sky = ball(white(), vec![], Some(Environment { strength: 0.5, ..Environment::uniform(Vec3::ONE) }));
    let (sun_power, sky_power) = (disc(&sun), 0.5 * 4.0 * pi * disc(&sky));
    let mut both_sides = Material::emitter("lamp", Vec3::ONE);
    both_sides.double_sided = true;
    let cases = [
        (ball(Material::emitter("lamp", Vec3::ONE), vec![], None), pi * pi),
        (ball(both_sides, vec![], None), 2.0 * pi * pi),
        (ball(white(), vec![light(PunctualKind::Point)], None), 4.0 * pi),
        (ball(white(), vec![light(PunctualKind::Spot { inner, outer })], None), spot_power),
        (sun, sun_power),
        (sky, sky_power),
    ];
    for (scene, expected) in cases {
        let n_paths = 100_000;
        let b = balance(&scene, &Params { n_paths, ..Params::new(1, 1) });
        let found = b.emitted / f64::from(n_paths);
        assert!((found / expected - 1.0).abs() < 5e-3, "{found}, expected {expected}");
    }
}

fn room() -> (Scene, Camera) {
    let mut scene = inside(Material::diffuse("wall", Vec3::new(0.7, 0.6, 0.5)));
    scene.materials.push(Material::emitter("lamp", Vec3::splat(8.0)));
    scene.materials.push(Material { roughness: 0.5, metallic: 0.3, ..Material::default() });
    scene.materials.push(Material::metal("", Vec3::new(0.9, 0.7, 0.5), 0.15));
    scene.spheres.push(Sphere { centre: Vec3::new(0.0, 1.2, -0.6), radius: 0.25, inward: false, material: 1 });
    scene.spheres.push(Sphere { centre: Vec3::new(-0.6, -0.5, -1.0), radius: 0.4, inward: false, material: 2 });
    scene.spheres.push(Sphere { centre: Vec3::new(0.6, -0.5, -1.0), radius: 0.4, inward: false, material: 3 });
    (scene, off_centre())
}

/// Light sampled at the hit and light carried by photons are the same light.
#[test]
fn direct_modes_agree_in_the_limit() {
    let (scene, camera) = room();
    let at = |direct, seed| {
        let params = Params { seed, direct, radius: FirstRadius::Fixed(0.05), n_paths: 150_000, ..Params::new(24, 24) };
        mean(&render(&scene, &camera, &params, 12))
    };
    let sampled = over_seeds(6, |seed| at(Direct::Sampled, seed));
    let photons = over_seeds(6, |seed| at(Direct::Photons, seed));
    let off = (sampled.0 - photons.0).abs();
    // At this radius the blur at silhouettes is still worth some tenths of a percent.
    assert!(off < 3.0 * sampled.1.hypot(photons.1) + 6e-3 * sampled.0, "{sampled:?} {photons:?}");
}

/// Same seed, same bits, whatever the number of threads; another seed, another picture.
#[test]
fn threads_do_not_change_a_bit() {
    let (scene, camera) = room();
    let at = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&scene, &camera, &Params { seed, n_paths: 20_000, ..Params::new(32, 24) }, 3))
    };
    let one = at(1, 7);
    assert_eq!(one, at(2, 7));
    assert_eq!(one, at(5, 7));
    assert_ne!(one, at(2, 8));
}

/// A crop is the same pixels.
#[test]
fn a_crop_computes_the_same_eye_paths() {
    let (scene, camera) = room();
    let packed = Arc::new(PackedScene::new(&scene));
    let whole = Params { n_paths: 100, ..Params::new(32, 24) };
    let part = Params { crop: [5, 3, 20, 17], ..whole.clone() };
    let vertices = |params: &Params| {
        let mut stages = CpuStages::new(packed.clone(), camera.pack(32, 24), params.film_size());
        stages.trace_eye(&params.frame(1)).unwrap();
        stages.eye_vertices().unwrap()
    };
    let (all, some) = (vertices(&whole), vertices(&part));
    for y in 0..14 {
        for x in 0..15 {
            assert_eq!(some[y * 15 + x], all[(y + 3) * 32 + x + 5]);
        }
    }
}

/// The automatic radius follows the unit of length: a scene a thousand times larger gives the same picture.
#[test]
fn the_unit_of_length_does_not_matter() {
    let (scene, camera) = room();
    let scaled = |s: f32| {
        let mut scene = scene.clone();
        for sphere in &mut scene.spheres {
            sphere.centre *= s;
            sphere.radius *= s;
        }
        let mut camera = camera.clone();
        camera.world_from_camera.translation *= s;
        mean(&render(&scene, &camera, &Params { n_paths: 50_000, ..Params::new(32, 24) }, 4))
    };
    let metre = scaled(1.0);
    for s in [1e-3, 1e3] {
        let other = scaled(s);
        assert!((other / metre - 1.0).abs() < 0.02, "{other} at {s}, {metre} at 1");
    }
}

/// A small white ball in the middle of a round lamp, all in an absorbing fluid that does not refract: light crosses the
/// lamp's radius and then the depth of the ball, L = L_e·exp(−σ(R + d)), whether the lamp is sampled or found.
#[test]
fn lamps_inside_a_medium_are_absorbed() {
    let (sigma, depth) = (0.4f32, 1.5f32);
    let fluid = Material { absorption: Vec3::splat(sigma), ..Material::glass("fluid", 1.0) };
    for surface in [Material::metal("", Vec3::ONE, 0.5), Material::diffuse("", Vec3::ONE)] {
        let scene = Scene {
            spheres: vec![
                Sphere { centre: Vec3::ZERO, radius: depth, inward: false, material: 0 },
                Sphere { centre: Vec3::ZERO, radius: 1.0, inward: true, material: 1 },
                Sphere { centre: Vec3::ZERO, radius: 2e-3, inward: false, material: 2 },
            ],
            materials: vec![fluid.clone(), Material::emitter("lamp", Vec3::ONE), surface],
            ..Scene::default()
        };
        let camera = Camera::look_at("", Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, Vec3::Y, 5e-4);
        let found = over_seeds(6, |seed| mean(&render(&scene, &camera, &Params { seed, ..small(10) }, 64)));
        assert_close(found, f64::from((-sigma * (1.0 + depth)).exp()), 2e-2);
    }
}
