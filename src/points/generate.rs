//! Clouds made by code that look like scans: a closed surface seen by scanners around it, each on a raster of angles, so
//! that samples are dense where the surface faces a scanner and sparse where it turns away, with noise along the ray.

use std::f64::consts::TAU;
use std::sync::LazyLock;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{Cloud, Precision};
use crate::math::rng::{pcg4d, unit4};

/// Scanners, evenly around the surface.
const SCANNERS: usize = 12;
/// Their distance from the origin; the surface lies within 1.
const DISTANCE: f64 = 3.0;
/// Raster a scanner starts with, to see which share of the rays hits.
const PROBE: usize = 64;
/// Places of the raster are jittered by so much of a cell: a scanner's mirror is not perfect.
const JITTER: f64 = 0.25;
const BUMPS: usize = 24;
const MAX_STEPS: usize = 400;
/// Below the rounding of positions to 32 bits.
const HIT: f64 = 2e-8;

/// A closed surface, about 2 across, around the origin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// A ball with bumps and dents.
    Bumpy,
    /// Of radius 0.9.
    Sphere,
    /// Around z, radii 0.65 and 0.3.
    Torus,
}

/// The shapes with their names.
pub const SHAPES: [(&str, Shape); 3] = [("bumpy", Shape::Bumpy), ("sphere", Shape::Sphere), ("torus", Shape::Torus)];

impl Shape {
    /// Negative inside, zero on the surface; outside no greater than the distance to it.
    pub fn distance(self, p: DVec3) -> f64 {
        match self {
            Self::Sphere => p.length() - 0.9,
            Self::Torus => DVec2::new(p.truncate().length() - 0.65, p.z).length() - 0.3,
            // |p| − r has a gradient of at most 1.5 outside (r from 0.57 to 1, at most 0.84 a radian).
            Self::Bumpy => 0.55 * (p.length() - bumpy_radius(p.normalize_or(DVec3::Z))),
        }
    }

    /// Of unit length, outward, at a point near the surface.
    pub fn normal(self, p: DVec3) -> DVec3 {
        let h = 1e-5;
        let slope = |axis: DVec3| self.distance(p + axis * h) - self.distance(p - axis * h);
        DVec3::new(slope(DVec3::X), slope(DVec3::Y), slope(DVec3::Z)).normalize_or(DVec3::Z)
    }

    /// Where a ray from outside first meets the surface, as a distance.
    fn meet(self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let mut t = DISTANCE - 1.1;
        for _ in 0..MAX_STEPS {
            let d = self.distance(origin + direction * t);
            if d < HIT {
                return Some(t);
            }
            t += d;
            if t > DISTANCE + 1.1 {
                break;
            }
        }
        None
    }
}

/// A smooth cap: its middle, the cosine at its rim, and its height.
static CAPS: LazyLock<[(DVec3, f64, f64); BUMPS]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let width = 0.25 + 0.2 * (i as f64 * 0.754_877_666).fract();
        (around(i, BUMPS), 1.0 - width, if i % 3 == 0 { -0.12 } else { 0.08 })
    })
});

fn bumpy_radius(direction: DVec3) -> f64 {
    let mut radius = 0.78;
    for &(middle, rim, height) in CAPS.iter() {
        let cosine = direction.dot(middle);
        if cosine > rim {
            let x = (cosine - rim) / (1.0 - rim);
            radius += height * x * x * (3.0 - 2.0 * x);
        }
    }
    radius
}

/// Direction i of n, evenly over the sphere (a Fibonacci spiral).
fn around(i: usize, n: usize) -> DVec3 {
    let z = 1.0 - (2 * i + 1) as f64 / n as f64;
    let (sin, cos) = (i as f64 * TAU * 0.618_033_988_749_895).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// `points` samples of a shape, scanner by scanner and line by line; `noise` is the standard deviation along the ray,
/// at most 1e37: beyond, positions overflow 32 bits.
/// The same seed gives the same cloud, another the same surface with its samples elsewhere.
pub fn scan(shape: Shape, points: usize, noise: f64, seed: u32) -> Cloud {
    let share = raster(shape, PROBE, 0.0, seed).len() as f64 / (SCANNERS * PROBE * PROBE) as f64;
    let mut side = ((points as f64 / (share * SCANNERS as f64)).sqrt() * 1.01).ceil() as usize + 1;
    let mut hits = raster(shape, side, noise, seed);
    while hits.len() < points {
        side += side / 50 + 1;
        hits = raster(shape, side, noise, seed);
    }
    // As many too many, evenly left out.
    let (n, all) = (points as u128, hits.len() as u128);
    let kept = |i: usize| (i as u128 + 1) * n / all > i as u128 * n / all;
    let positions = hits.into_iter().enumerate().filter(|(i, _)| kept(*i)).map(|(_, p)| p).collect();
    Cloud { positions, precision: Precision::Single, ..Cloud::default() }
}

/// What `side` lines of `side` rays of each scanner hit.
fn raster(shape: Shape, side: usize, noise: f64, seed: u32) -> Vec<DVec3> {
    // The surface lies within 1 of the origin.
    let reach = (1.0_f64 / DISTANCE).asin();
    let line = |line: usize| {
        let (scanner, row) = (line / side, line % side);
        let origin = around(scanner, SCANNERS) * DISTANCE;
        let forward = -origin.normalize();
        let (right, up) = forward.any_orthonormal_pair();
        (0..side).filter_map(move |column| {
            let bits = |dimension: u32| unit4(pcg4d([(row * side + column) as u32, scanner as u32, dimension, seed]));
            let (place, range) = (bits(0).map(f64::from), bits(1).map(f64::from));
            let angle = |cell: usize, shift: f64| {
                reach * (2.0 * (cell as f64 + 0.5 + JITTER * (2.0 * shift - 1.0)) / side as f64 - 1.0)
            };
            // Lines of another seed lie elsewhere between the old ones.
            let (x, y) = (angle(column, place[0]).tan(), angle(row, place[1]).tan());
            let direction = (forward + right * x + up * y).normalize();
            let t = shape.meet(origin, direction)?;
            // Box & Muller 1958.
            let gauss = (-2.0 * (1.0 - range[0]).ln()).sqrt() * (TAU * range[1]).cos();
            let p = origin + direction * (t + noise * gauss);
            Some(p.as_vec3().as_dvec3())
        })
    };
    (0..SCANNERS * side).into_par_iter().flat_map_iter(line).collect()
}
