//! Every sampler against its density, its weights against the function it samples, and the photons' side against the
//! eye's.

use std::f64::consts::{PI, TAU};

use glam::{Vec2, Vec3};
use sunfleck::cpu::bsdf::{Bsdf, Lobes, Transport, dielectric};
use sunfleck::cpu::light;
use sunfleck::cpu::surface::Surface;
use sunfleck::cpu::trace::{self, Ray, Seer};
use sunfleck::layout::{MATERIAL_DOUBLE_SIDED, NONE};
use sunfleck::math::{basis::Basis, ggx, rng, warp};
use sunfleck::scene::{Environment, Material, Mesh, PackedScene, Scene, Sphere};

const THETAS: usize = 32;
const PHIS: usize = 64;
/// Midpoints of each bin, along each of its sides, at which a density is read; lamps have edges and need more.
const FINE: usize = 16;
/// More χ² tests than this module makes: what the 1 % is divided among (Šidák).
const N_TESTS: f64 = 400.0;

fn numbers(i: u32, stream: u32) -> [f32; 4] {
    rng::unit4(rng::pcg4d([i, stream, 0x51f1, 7]))
}

/// Probability that a normal variate exceeds z > 0: Laplace's continued fraction of Mills' ratio.
fn upper_tail(z: f64) -> f64 {
    if z < 0.5 {
        return 0.5;
    }
    let ratio = (1..200).rev().fold(z, |f, k| z + f64::from(k) / f);
    (-0.5 * z * z).exp() / (TAU.sqrt() * ratio)
}

/// Pearson's χ² of counts against expectations; bins that expect fewer than 10 are pooled. The probability of a larger
/// χ² must not be below Šidák's share of 1 % (Wilson & Hilferty 1931 for the quantiles).
#[track_caller]
fn assert_counts(name: &str, bins: impl Iterator<Item = (f64, f64)>) {
    let (mut chi2, mut freedom) = (0.0, -1.0);
    let (mut pool, mut total) = ((0.0, 0.0), (0.0, 0.0));
    let mut add = |(found, expected): (f64, f64)| {
        chi2 += (found - expected) * (found - expected) / expected;
        freedom += 1.0;
    };
    for (found, expected) in bins {
        total = (total.0 + found, total.1 + expected);
        if expected < 10.0 {
            pool = (pool.0 + found, pool.1 + expected);
        } else {
            add((found, expected));
        }
    }
    if pool.1 >= 10.0 {
        add(pool);
    } else {
        assert!(pool.0 < 40.0, "{name}: {} samples where {:.2} were expected", pool.0, pool.1);
    }
    assert!((total.0 / total.1 - 1.0).abs() < 2e-3, "{name}: the density accounts for {} of {}", total.1, total.0);
    if freedom < 1.0 {
        return;
    }
    let z = ((chi2 / freedom).cbrt() - (1.0 - 2.0 / (9.0 * freedom))) / (2.0 / (9.0 * freedom)).sqrt();
    let least = 1.0 - 0.99f64.powf(1.0 / N_TESTS);
    assert!(upper_tail(z) > least, "{name}: χ² {chi2:.1} over {freedom} degrees of freedom, {z:.1} σ");
}

fn direction(theta: f64, phi: f64) -> Vec3 {
    let (s, c) = theta.sin_cos();
    Vec3::new((s * phi.cos()) as f32, (s * phi.sin()) as f32, c as f32)
}

/// ∫ of `of` over each bin of the sphere around z, midpoint rule.
fn integrals<const N: usize>(fine: usize, of: impl Fn(Vec3) -> [f64; N]) -> Vec<[f64; N]> {
    let (dt, dp) = (PI / (THETAS * fine) as f64, TAU / (PHIS * fine) as f64);
    let bin = |b: usize| {
        let mut sum = [0.0; N];
        for i in 0..fine {
            let theta = ((b / PHIS * fine + i) as f64 + 0.5) * dt;
            for j in 0..fine {
                let value = of(direction(theta, ((b % PHIS * fine + j) as f64 + 0.5) * dp));
                (0..N).for_each(|c| sum[c] += value[c] * theta.sin() * dt * dp);
            }
        }
        sum
    };
    (0..THETAS * PHIS).map(bin).collect()
}

fn bin_of(d: Vec3) -> usize {
    let theta = f64::from(d.truncate().length()).atan2(f64::from(d.z));
    let phi = f64::from(d.y).atan2(f64::from(d.x)).rem_euclid(TAU);
    let at = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
    at(theta / PI, THETAS) * PHIS + at(phi / TAU, PHIS)
}

/// χ² over the sphere. Samples that the sampler refuses are a bin of their own: what the density lacks to 1.
#[track_caller]
fn assert_sampled(name: &str, n: u32, sample: impl Fn([f32; 4]) -> Option<Vec3>, pdf: impl Fn(Vec3) -> f64) {
    assert_sampled_at(FINE, name, n, sample, pdf);
}

#[track_caller]
fn assert_sampled_at(
    fine: usize,
    name: &str,
    n: u32,
    sample: impl Fn([f32; 4]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f64,
) {
    let stream = name.bytes().fold(17u32, |h, b| h.wrapping_mul(31).wrapping_add(u32::from(b)));
    let mut counts = vec![0u32; THETAS * PHIS];
    let mut refused = 0u32;
    for i in 0..n {
        match sample(numbers(i, stream)) {
            Some(d) => counts[bin_of(d)] += 1,
            None => refused += 1,
        }
    }
    let expected: Vec<f64> = integrals(fine, |d| [pdf(d)]).into_iter().map(|[p]| p * f64::from(n)).collect();
    let missing = (f64::from(n) - expected.iter().sum::<f64>()).max(0.0);
    let bins = counts.iter().map(|&c| f64::from(c)).zip(expected);
    // A missing share within the quadrature's own error shows nothing, and none may be refused then.
    if missing > 1e-3 * f64::from(n) {
        assert_counts(name, bins.chain([(f64::from(refused), missing)]));
    } else {
        assert!(f64::from(refused) < 2e-3 * f64::from(n), "{name}: {refused} of {n} refused");
        assert_counts(name, bins);
    }
}

#[test]
fn warps() {
    let n = 400_000;
    assert_sampled("cosine", n, |u| Some(warp::cosine([u[0], u[1]])), |d| f64::from(warp::cosine_pdf(d.z)));
    assert_sampled("sphere", n, |u| Some(warp::sphere([u[0], u[1]])), |_| 1.0 / (4.0 * PI));
    // Its edge is an edge of bins.
    let cos = (PI * 5.0 / THETAS as f64).cos() as f32;
    let in_cone = |d: Vec3| if d.z > cos { f64::from(warp::cone_pdf(cos)) } else { 0.0 };
    assert_sampled("cone", n, |u| Some(warp::cone([u[0], u[1]], cos)), in_cone);

    // Equal areas: rings and sectors of the disc, and cells of the square that the triangle's inverse warp makes.
    let mut disc = [0u32; 256];
    let mut triangle = [0u32; 256];
    for i in 0..n {
        let [u, v, w, x] = numbers(i, 99);
        let p: Vec2 = warp::disc([u, v]);
        let cell = |x: f32, n: usize| ((x * n as f32) as usize).min(n - 1);
        let angle = p.y.atan2(p.x).rem_euclid(std::f32::consts::TAU) / std::f32::consts::TAU;
        disc[cell(p.length_squared(), 16) * 16 + cell(angle, 16)] += 1;
        let t = warp::triangle([w, x]);
        assert!(t.min_element() >= 0.0 && t.x + t.y <= 1.0 + 1e-6, "{t}");
        let sum = t.x + t.y;
        triangle[cell(sum * sum, 16) * 16 + cell(t.y / sum.max(f32::MIN_POSITIVE), 16)] += 1;
    }
    for (name, counts) in [("disc", disc), ("triangle", triangle)] {
        assert_counts(name, counts.iter().map(|&c| (f64::from(c), f64::from(n) / 256.0)));
    }
}

#[test]
fn visible_normals() {
    for alpha in [0.05, 0.2, 0.5, 1.0] {
        for theta in [0.0, 0.6, 1.2, 1.5] {
            let outgoing = direction(theta, 0.4);
            let pdf = |h: Vec3| {
                let cos = if h.z > 0.0 { outgoing.dot(h) } else { 0.0 };
                f64::from(ggx::visible_normal_pdf(outgoing.z, h.z, cos, alpha))
            };
            let sample = |u: [f32; 4]| Some(ggx::sample_visible_normal(outgoing, alpha, [u[0], u[1]]));
            assert_sampled(&format!("visible normals, α {alpha}, θ {theta}"), 200_000, sample, pdf);
            // Normalised: the projected area of the visible facets is the cosine, so masking is right too.
            let area: f64 = integrals(FINE, |h| [f64::from(ggx::distribution(h.z.max(0.0), alpha) * h.z.max(0.0))])
                .iter()
                .map(|[a]| a)
                .sum();
            assert!((area - 1.0).abs() < 5e-3, "∫ D·cos is {area} for α {alpha}");
        }
    }
}

/// Materials, each with whether it is met from outside.
fn materials() -> Vec<(String, Material, bool)> {
    let color = Vec3::new(0.9, 0.5, 0.2);
    let mut list = vec![("diffuse".to_owned(), Material::diffuse("", color), true)];
    for roughness in [0.2, 0.5, 1.0] {
        let plain = Material { base_color: color, roughness, ..Material::default() };
        let glass = Material { transmission: 1.0, ior: 1.5, ..plain.clone() };
        let solid = Material { volume: true, ..glass.clone() };
        let mut add = |name: &str, m: Material, front| list.push((format!("{name}, roughness {roughness}"), m, front));
        add("plastic", plain.clone(), true);
        add("metal", Material { metallic: 1.0, ..plain.clone() }, true);
        add("half metal", Material { metallic: 0.5, specular: 0.6, ..plain.clone() }, true);
        add("glass from outside", solid.clone(), true);
        add("glass from inside", solid.clone(), false);
        add("thin glass", glass, true);
        let tint = Vec3::new(1.0, 0.6, 0.3);
        let mix = Material { transmission: 0.5, metallic: 0.2, ior: 1.8, specular_color: tint, ..solid };
        add("mixture from outside", mix.clone(), true);
        add("mixture from inside", mix, false);
    }
    list
}

fn packed(material: &Material) -> PackedScene {
    let spheres = vec![Sphere { centre: Vec3::ZERO, radius: 1.0, inward: false, material: 0 }];
    PackedScene::new(&Scene { spheres, materials: vec![material.clone()], ..Scene::default() })
}

/// The surface as met from the side that `normal` points to.
fn surface(m: &Material, front: bool, normal: Vec3, shading_normal: Vec3) -> Surface {
    Surface {
        position: Vec3::ZERO,
        normal,
        shading_normal,
        front,
        material: 0,
        light: NONE,
        base_color: m.base_color,
        roughness: m.roughness,
        metallic: m.metallic,
        transmission: m.transmission,
        emission: Vec3::ZERO,
    }
}

const NORMAL: Vec3 = Vec3::new(0.48, -0.6, 0.64);
const ANGLES: [f64; 3] = [0.1, 0.8, 1.4];

#[test]
fn bsdf_samples_follow_their_density() {
    for (name, material, front) in materials() {
        let scene = packed(&material);
        let bsdf = Bsdf::new(&scene, &surface(&material, front, NORMAL, NORMAL));
        let around = Basis::around(NORMAL);
        for theta in ANGLES {
            let known = around.world(direction(theta, 2.0));
            for (lobes, which) in [
                (Lobes::ALL, "all"),
                (Lobes { diffuse: true, specular: false }, "diffuse"),
                (Lobes { diffuse: false, specular: true }, "specular"),
            ] {
                let name = format!("{name}, θ {theta}, {which}");
                let draw = |u: [f32; 4]| bsdf.sample(known, lobes, Transport::Importance, [u[0], u[1], u[2]]);
                if bsdf.pdf(known, around.world(direction(0.3, 1.0)), lobes) == 0.0
                    && (0..100).all(|i| draw(numbers(i, 1)).is_none())
                {
                    continue; // There is no such lobe.
                }
                let sample = |u| draw(u).map(|s| around.local(s.direction));
                let pdf = |d| f64::from(bsdf.pdf(known, around.world(d), lobes));
                // At grazing incidence on the roughest glass the density has a ridge that is narrower than its bins.
                let ridge = theta > 1.0 && material.transmission > 0.0 && material.roughness == 1.0;
                assert_sampled_at(if ridge { 40 } else { FINE }, &name, 100_000, sample, pdf);
            }
        }
    }
}

/// weight · density = |cos| · f, whichever side is known; with bent normals too, where photons are corrected (Veach
/// 1997, equation 5.20).
#[test]
fn bsdf_weights_are_the_function_over_the_density() {
    let bent = (NORMAL + 0.25 * Basis::around(NORMAL).x).normalize();
    let mut n_checked = 0;
    for (name, material, front) in materials() {
        let scene = packed(&material);
        for shading in [NORMAL, bent] {
            let bsdf = Bsdf::new(&scene, &surface(&material, front, NORMAL, shading));
            for theta in ANGLES {
                let known = Basis::around(shading).world(direction(theta, 2.0));
                for transport in [Transport::Radiance, Transport::Importance] {
                    for i in 0..2000 {
                        let [a, b, c, _] = numbers(i, 5);
                        let Some(s) = bsdf.sample(known, Lobes::ALL, transport, [a, b, c]) else { continue };
                        let o = s.direction;
                        let close = |a: f32, b: f32| (a - b).abs() <= 1e-2 * b.abs() + 1e-5;
                        assert!(close(s.pdf, bsdf.pdf(known, o, Lobes::ALL)), "{name}: density {}", s.pdf);
                        assert_eq!(s.transmitted, o.dot(shading) < 0.0);
                        let mut expected =
                            bsdf.evaluate(known, o, Lobes::ALL, transport) * (shading.dot(o).abs() / s.pdf);
                        if transport == Transport::Importance && shading != NORMAL {
                            let numerator = shading.dot(known) * NORMAL.dot(o);
                            expected *= (numerator / (NORMAL.dot(known) * shading.dot(o))).abs().min(8.0);
                        }
                        for c in 0..3 {
                            let (w, e) = (s.weight[c], expected[c]);
                            assert!(close(w, e), "{name}, {transport:?}: weight {w}, expected {e} for {s:?}");
                        }
                        n_checked += 1;
                    }
                }
            }
        }
    }
    assert!(n_checked > 400_000, "{n_checked}");
}

/// The mean of the weights is the directional albedo, ∫ f·|cos|, and no more comes out than went in.
#[test]
fn bsdf_weights_add_up_to_the_albedo() {
    for (name, material, front) in materials() {
        let white = Material { base_color: Vec3::ONE, specular_color: Vec3::ONE, ..material.clone() };
        for (material, is_white) in [(material, false), (white, true)] {
            let scene = packed(&material);
            let bsdf = Bsdf::new(&scene, &surface(&material, front, NORMAL, NORMAL));
            let around = Basis::around(NORMAL);
            for (theta, transport) in
                ANGLES.iter().flat_map(|&t| [(t, Transport::Radiance), (t, Transport::Importance)])
            {
                let known = around.world(direction(theta, 2.0));
                let n = 20_000;
                let (mut sum, mut squares) = ([0.0; 3], [0.0; 3]);
                for i in 0..n {
                    let [a, b, c, _] = numbers(i, 6);
                    let weight = bsdf.sample(known, Lobes::ALL, transport, [a, b, c]).map_or(Vec3::ZERO, |s| s.weight);
                    for c in 0..3 {
                        sum[c] += f64::from(weight[c]);
                        squares[c] += f64::from(weight[c]).powi(2);
                    }
                }
                let albedo = integrals(FINE, |d| {
                    let f = bsdf.evaluate(known, around.world(d), Lobes::ALL, transport) * d.z.abs();
                    f.to_array().map(f64::from)
                });
                for c in 0..3 {
                    let mean = sum[c] / f64::from(n);
                    let error = ((squares[c] / f64::from(n) - mean * mean).max(0.0) / f64::from(n)).sqrt();
                    let expected: f64 = albedo.iter().map(|a| a[c]).sum();
                    assert!(
                        (mean - expected).abs() < 4.5 * error + 2e-3 * expected,
                        "{name}, θ {theta}, {transport:?}: mean weight {mean} ± {error}, albedo {expected}"
                    );
                }
                // Radiance grows by η² into a denser medium. Photons meet the compensation for multiple scattering from
                // the side it is not normalised for: at grazing incidence more may come out. Rough
                // glass is not compensated: at roughness 1 it loses most of the light.
                let refracts = material.volume && transport == Transport::Radiance;
                let most = if transport == Transport::Radiance || material.transmission == 1.0 { 1.003 } else { 2.0 };
                let least =
                    if material.transmission > 0.0 || transport == Transport::Importance { 0.25 } else { 0.985 };
                let albedo: f64 = albedo.iter().map(|a| a[0]).sum();
                if !refracts {
                    assert!(albedo < most, "{name}, θ {theta}, {transport:?}: {albedo} of the light comes out");
                    assert!(!is_white || albedo > least, "{name}, θ {theta}, {transport:?}: only {albedo} is left");
                }
            }
        }
    }
}

/// Light from ωᵢ seen along ωₒ: the eye, which knows ωₒ, and the photon, which knows ωᵢ and may be on the other side,
/// describe one function.
#[test]
fn eye_and_photons_scatter_alike() {
    for (name, material, front) in materials() {
        let scene = packed(&material);
        let (mut n_reflected, mut n_transmitted) = (0, 0);
        for i in 0..4000 {
            let [a, b, c, d] = numbers(i, 8);
            let around = Basis::around(NORMAL);
            let eye = around.world(warp::cosine([a, b]));
            let light = around.world(warp::sphere([c, d]));
            let side = light.dot(NORMAL);
            if eye.dot(NORMAL) < 1e-2 || side.abs() < 1e-2 {
                continue;
            }
            let of_eye = Bsdf::new(&scene, &surface(&material, front, NORMAL, NORMAL));
            let turned = NORMAL * side.signum();
            let of_photon = Bsdf::new(&scene, &surface(&material, front == (side > 0.0), turned, turned));
            let f = of_eye.evaluate(eye, light, Lobes::ALL, Transport::Radiance);
            let g = of_photon.evaluate(light, eye, Lobes::ALL, Transport::Importance);
            let most = f.max_element().max(g.max_element());
            assert!((f - g).abs().max_element() <= 5e-3 * most + 1e-6, "{name}: {f} for the eye, {g} for photons");
            if most > 0.0 {
                if side > 0.0 { n_reflected += 1 } else { n_transmitted += 1 }
            }
        }
        assert!(n_reflected > 500 && (n_transmitted > 100) == (material.transmission > 0.0), "{name}");
    }
}

/// Fresnel's equations in their trigonometric form.
fn fresnel(theta: f64, eta: f64) -> f64 {
    let sin = theta.sin() / eta;
    if sin >= 1.0 {
        return 1.0;
    }
    let t = sin.asin();
    let s = (theta - t).sin() / (theta + t).sin();
    let p = (theta - t).tan() / (theta + t).tan();
    0.5 * (s * s + p * p)
}

/// Mirrors: where they send light, how often, and that weights times probabilities are the energy.
#[test]
fn smooth_lobes_split_by_fresnel() {
    for (ior, volume, front) in
        [(1.5, true, true), (1.5, true, false), (1.5, false, true), (2.4, true, true), (2.4, true, false)]
    {
        let tint = Vec3::new(1.0, 0.8, 0.6);
        let material =
            Material { base_color: tint, roughness: 0.0, transmission: 1.0, volume, ior, ..Material::default() };
        let scene = packed(&material);
        let bsdf = Bsdf::new(&scene, &surface(&material, front, NORMAL, NORMAL));
        let eta = if volume && !front { 1.0 / f64::from(ior) } else { f64::from(ior) };
        let around = Basis::around(NORMAL);
        for theta in [0.1, 0.35, 0.6, 0.8, 1.2, 1.5] {
            let k = direction(theta, 2.0);
            let reflects = fresnel(theta, eta);
            assert!((f64::from(dielectric(k.z, eta as f32)) - reflects).abs() < 1e-4, "Fresnel at {theta}, η {eta}");
            for transport in [Transport::Radiance, Transport::Importance] {
                let n = 40_000;
                let mut n_reflected = 0;
                for i in 0..n {
                    let [a, b, c, _] = numbers(i, 11);
                    let s = bsdf.sample(around.world(k), Lobes::ALL, transport, [a, b, c]).unwrap();
                    assert!(s.pdf == 0.0);
                    let o = around.local(s.direction);
                    let (sideways, expected) = if !s.transmitted {
                        n_reflected += 1;
                        (1.0, Vec3::ONE)
                    } else if volume {
                        let scale = if transport == Transport::Radiance { 1.0 / (eta * eta) } else { 1.0 };
                        (1.0 / eta as f32, tint * scale as f32)
                    } else {
                        (1.0, tint)
                    };
                    assert!((o.truncate() + sideways * k.truncate()).length() < 1e-4, "{k} to {o}");
                    assert_eq!(s.transmitted, o.z < 0.0);
                    assert!((s.weight - expected).abs().max_element() < 1e-4, "{transport:?}: {s:?}, {expected}");
                }
                let sigma = (f64::from(n) * reflects * (1.0 - reflects)).sqrt();
                let off = f64::from(n_reflected) - f64::from(n) * reflects;
                assert!(off.abs() <= 4.5 * sigma + 2.0, "{n_reflected} of {n} reflected, F = {reflects}");
            }
        }
    }
    // Coat over a base: Σ weight·probability is the albedo, whatever the split.
    for (roughness, metallic) in [(0.0, 0.0), (0.0, 0.5), (0.0, 1.0)] {
        let material = Material { roughness, metallic, ..Material::default() };
        let scene = packed(&material);
        let bsdf = Bsdf::new(&scene, &surface(&material, true, NORMAL, NORMAL));
        for theta in ANGLES {
            let known = Basis::around(NORMAL).world(direction(theta, 2.0));
            let n = 40_000;
            let weights = (0..n).map(|i| {
                let [a, b, c, _] = numbers(i, 12);
                let s = bsdf.sample(known, Lobes::ALL, Transport::Radiance, [a, b, c]);
                f64::from(s.map_or(0.0, |s| s.weight.y))
            });
            let mean = weights.sum::<f64>() / f64::from(n);
            assert!((mean - 1.0).abs() < 1e-2, "metallic {metallic}, θ {theta}: {mean}");
        }
    }
}

/// A dim sky with a sun of one texel and a bright patch, turned.
fn sky() -> Environment {
    let (width, height) = (32, 16);
    let mut texels: Vec<Vec3> = (0..width * height)
        .map(|i| Vec3::new(0.2, 0.3, 0.5) * (1.0 + (i % width) as f32 / 8.0 + (i / width % 3) as f32))
        .collect();
    texels[(3 * width + 20) as usize] = Vec3::splat(200.0);
    texels[(12 * width) as usize] = Vec3::new(10.0, 0.0, 0.0);
    Environment { width, height, texels: texels.into(), rotation: 0.7, strength: 0.5, tint: Vec3::new(1.0, 0.5, 2.0) }
}

/// Triangles, a ball and a turned sky, chosen by power: the sum of their densities at each direction.
#[test]
fn light_samples_follow_their_density() {
    let quad = |at: Vec3, x: Vec3, y: Vec3, material| Mesh {
        positions: vec![at, at + x, at + x + y, at + y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        material,
        ..Mesh::default()
    };
    let mut two_sided = Material::emitter("", Vec3::ONE);
    two_sided.double_sided = true;
    let lamps = Scene {
        meshes: vec![
            quad(Vec3::new(-1.0, 2.0, -1.0), Vec3::new(2.0, 0.3, 0.0), Vec3::new(0.0, 0.0, 1.5), 0).into(),
            quad(Vec3::new(-2.0, -1.0, 1.0), Vec3::new(0.0, 1.5, 0.0), Vec3::new(1.5, 0.0, 1.0), 2).into(),
        ],
        spheres: vec![Sphere { centre: Vec3::new(2.0, -1.0, -0.5), radius: 0.8, inward: false, material: 1 }],
        materials: vec![Material::emitter("", Vec3::splat(3.0)), Material::emitter("", Vec3::splat(2.0)), two_sided],
        ..Scene::default()
    };
    let alone = Scene {
        spheres: vec![Sphere { centre: Vec3::ZERO, radius: 0.1, inward: false, material: 0 }],
        materials: vec![Material::diffuse("", Vec3::ONE)],
        environment: Some(sky()),
        ..Scene::default()
    };
    let mut both = lamps.clone();
    both.environment = Some(Environment { strength: 0.05, ..sky() });
    for (name, scene) in [("lamps", lamps), ("sky", alone), ("lamps and sky", both)] {
        let scene = PackedScene::new(&scene);
        let position = Vec3::new(0.1, -0.2, 0.3);
        // Bins around y that the sky's texels share their edges with.
        let rotation = if scene.environment.is_empty() { [1.0, 0.0] } else { scene.info.environment_rotation };
        let from_bin = |d: Vec3| {
            let [c, s] = rotation;
            Vec3::new(c * d.x + s * d.y, d.z, -s * d.x + c * d.y)
        };
        let to_bin = |d: Vec3| {
            let [c, s] = rotation;
            Vec3::new(c * d.x - s * d.z, s * d.x + c * d.z, d.y)
        };
        let pdf = |d: Vec3| {
            let direction = from_bin(d);
            let ray = Ray { origin: position, direction, t_max: f32::INFINITY, alpha_seed: 0, seer: Seer::Light };
            let lamp = trace::nearest(&scene, &ray).map_or(0.0, |hit| {
                let p = &scene.primitives[hit.primitive as usize];
                let cos = trace::geometric_normal(p, position + hit.t * direction).dot(direction);
                // A lamp's back is dark; what is not a lamp has no density.
                let shines = cos < 0.0 || scene.materials[p.material as usize].flags & MATERIAL_DOUBLE_SIDED != 0;
                if shines { light::area_pdf(&scene, p.light, hit.t, cos) } else { 0.0 }
            });
            f64::from(lamp + light::environment_pdf(&scene, direction))
        };
        let sample = |u: [f32; 4]| {
            let incoming = light::sample(&scene, position, [u[0], u[1], u[2]])?;
            assert!(!incoming.point_like && (incoming.direction.length() - 1.0).abs() < 1e-5);
            Some(to_bin(incoming.direction))
        };
        // Lamps have edges, and the ball's density grows without bound towards its limb.
        let (fine, n) = if name == "sky" { (FINE, 300_000) } else { (64, 60_000) };
        assert_sampled_at(fine, name, n, sample, pdf);
        // The densities that samples carry are those of the density functions, and weights of constant light add up to
        // the solid angle.
        let mut n_seen = 0;
        for i in 0..20_000 {
            let [a, b, c, _] = numbers(i, 13);
            let Some(incoming) = light::sample(&scene, position, [a, b, c]) else { continue };
            let d = incoming.direction;
            let expected = if incoming.distance == f32::INFINITY {
                assert_eq!(incoming.light, light::environment(&scene, d));
                light::environment_pdf(&scene, d)
            } else {
                let ray =
                    Ray { origin: position, direction: d, t_max: f32::INFINITY, alpha_seed: 0, seer: Seer::Light };
                let Some(hit) = trace::nearest(&scene, &ray) else { continue };
                if (hit.t / incoming.distance - 1.0).abs() > 1e-4 {
                    continue; // The far side of the ball.
                }
                let p = &scene.primitives[hit.primitive as usize];
                let cos = trace::geometric_normal(p, position + hit.t * d).dot(d);
                light::area_pdf(&scene, p.light, hit.t, cos)
            };
            // At a texel's edge the direction may round into its neighbour.
            n_seen += u32::from((incoming.pdf / expected - 1.0).abs() < 1e-2);
        }
        assert!(n_seen > 10_000, "{name}: {n_seen}");
    }
}
