//! Point clouds that are hard on an index, and queries that are hard on its boundaries.

use glam::Vec3;
use sunfleck::math::{rng, warp};

/// Three numbers in [−1, 1).
pub fn cube(seed: u32, i: u32) -> Vec3 {
    let [x, y, z, _] = rng::unit4(rng::pcg4d([i, seed, 1, 2]));
    Vec3::new(x, y, z) * 2.0 - 1.0
}

/// One number in [0, 1).
pub fn unit(seed: u32, i: u32) -> f32 {
    rng::unit(rng::pcg4d([i, seed, 3, 4])[0])
}

pub const SHAPES: [&str; 12] = [
    "uniform",
    "clustered",
    "equal",
    "ten points, each many times",
    "zeros of both signs",
    "on an axis",
    "on a line",
    "on a plane",
    "on a tilted plane",
    "lattice",
    "on a sphere",
    "one far away",
];

/// Scale and offset of a shape; the last is where squares vanish, the one before where they overflow.
pub const PLACES: [(f32, f32); 8] =
    [(1.0, 0.0), (1.0, 1e4), (-1e-12, 0.0), (1e-3, -1e6), (37.0, 1e3), (1e15, 0.0), (1e19, 0.0), (1e-22, 0.0)];

/// `n` points of `SHAPES[shape]`.
pub fn cloud(shape: usize, seed: u32, n: u32, (scale, offset): (f32, f32)) -> Vec<Vec3> {
    let point = |i: u32| match shape {
        0 => cube(seed, i),
        // Clouds that shrink by powers of ten around a few centres.
        1 => cube(seed, i % 7) + cube(seed + 1, i) * 10f32.powi(-(i as i32 % 6)),
        2 => Vec3::new(0.3, -0.7, 0.2),
        3 => cube(seed, i % 10),
        4 => Vec3::splat(if i.is_multiple_of(2) { 0.0 } else { -0.0 }),
        5 => Vec3::Y * cube(seed, i).x,
        6 => Vec3::new(0.3, -0.8, 0.5) * cube(seed, i).x,
        7 => cube(seed, i) * Vec3::new(1.0, 0.0, 1.0),
        8 => {
            let p = cube(seed, i);
            Vec3::new(p.x, 0.5 * p.x - p.z, p.z)
        }
        9 => Vec3::new((i % 9) as f32, (i / 9 % 9) as f32, (i / 81) as f32) * 0.25,
        10 => warp::sphere([unit(seed, i), unit(seed + 1, i)]),
        _ => cube(seed, i) * if i == 3 { 1e6 } else { 1.0 },
    };
    (0..n).map(|i| point(i) * scale + Vec3::new(offset, -offset, 0.5 * offset)).collect()
}

/// Queries at points, beside them, and anywhere, each with a radius of up to `largest`: many reach a point exactly, or
/// as nearly as f32 does, from inside or outside.
pub fn queries(points: &[Vec3], seed: u32, n: u32, scale: f32, largest: f32) -> (Vec<Vec3>, Vec<f32>) {
    let pick = |seed: u32, i: u32| {
        let at = (unit(seed, i) * points.len() as f32) as usize;
        points.get(at.min(points.len().saturating_sub(1))).copied().unwrap_or(Vec3::ZERO)
    };
    let query = |i: u32| {
        let centre = match i % 5 {
            0 => pick(seed, i),
            1 | 2 => pick(seed, i) + cube(seed + 1, i) * scale * 10f32.powi(-(i as i32 / 5 % 8)),
            3 => pick(seed, i) + Vec3::AXES[i as usize / 5 % 3] * scale * 0.25,
            _ => cube(seed + 2, i) * scale * 1.3,
        };
        let reach = centre.distance(pick(seed + 3, i));
        let radius = match i / 5 % 8 {
            0 => 0.0,
            1 | 2 => reach,
            3 => reach.next_down(),
            4 => reach.next_up(),
            5 => largest,
            6 => unit(seed + 4, i) * largest.min(f32::MAX),
            _ => unit(seed + 4, i).powi(4) * scale.abs(),
        };
        // An overflown distance is no radius; the sphere through the nearest is as good.
        (centre, if radius.is_nan() { 0.0 } else { radius.clamp(0.0, largest) })
    };
    (0..n).map(query).unzip()
}
