//! Which way faces look, by rays.
//!
//! The check of Schuhmacher 2022 that the kd-tree thesis speeds up: a ray leaves a face along its normal, and an even number
//! of crossings means that the normal points outward. That holds where the surface is closed, and for the solid between
//! shells too: the shell around a cavity points outward where it points into the cavity.
//!
//! No threshold has a unit. Each crossing comes with a bound on its rounding error, from the lengths in it; where the bound
//! leaves open whether a face is hit, or whether before or behind the start, the ray is cast again from another point of the
//! face in another direction on the side of its normal.

use std::ops::ControlFlow;

use glam::DVec3;
use rayon::prelude::*;

use super::{corners_of_box, largest, normal};
use crate::index::kd::{Hit, Ray, RaySearch};
use crate::math::rng::pcg4d;

/// Which way the normal of a face points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Out of the solid.
    Outward,
    /// Into it.
    Inward,
    /// The face has no area to speak of, or coincides with another.
    Undecided,
}

/// Rays from one face, at most.
const ATTEMPTS: u32 = 32;
/// Roundings that a crossing may be off by.
const ROUNDINGS: f64 = 64.0;
/// Cosine of the angle between a ray and the normal, at least.
const MIN_COSINE: f64 = 0.1;
/// Faces a thread takes at a time.
const CHUNK: usize = 256;

/// One ray a face, or more where it grazes something. Means something only on a closed surface.
///
/// The answer is the same for any tree, in parallel or not. At an offset of k times the mesh's size, faces smaller than
/// some k·10⁻¹⁵ of it stay undecided.
pub fn by_rays(mesh: &impl RaySearch<f64>, parallel: bool) -> Vec<Facing> {
    let n = mesh.triangles().len();
    let size = size(mesh);
    let mut facings = vec![Facing::Undecided; n];
    let decide = |(chunk, facings): (usize, &mut [Facing])| {
        let mut hits = Vec::new();
        for (i, facing) in facings.iter_mut().enumerate() {
            *facing = of_face(mesh, size, (chunk * CHUNK + i) as u32, &mut hits);
        }
    };
    if parallel {
        facings.par_chunks_mut(CHUNK).enumerate().for_each(decide);
    } else {
        facings.chunks_mut(CHUNK).enumerate().for_each(decide);
    }
    facings
}

/// The longest side of the box.
fn size(mesh: &impl RaySearch<f64>) -> f64 {
    let used = mesh.triangles().faces().iter().flatten().map(|&v| mesh.triangles().vertices()[v as usize]);
    let [min, max] = corners_of_box(used);
    largest(max - min)
}

fn of_face(mesh: &impl RaySearch<f64>, size: f64, face: u32, hits: &mut Vec<Hit<f64>>) -> Facing {
    let corners = mesh.triangles().corners(face);
    let Some(normal) = normal(corners) else { return Facing::Undecided };
    let [a, b, c] = corners.map(DVec3::from);
    for attempt in 0..ATTEMPTS {
        let ([u, v], direction) = start(normal, face, attempt);
        if direction.dot(normal) < MIN_COSINE {
            continue;
        }
        let origin = a + u * (b - a) + v * (c - a);
        if let Some(n_crossings) = crossings(mesh, face, origin, direction * size, size, hits) {
            return if n_crossings % 2 == 0 { Facing::Outward } else { Facing::Inward };
        }
    }
    Facing::Undecided
}

/// Weights of the second and third corner, and a direction: first the middle along the normal, then others at random.
fn start(normal: DVec3, face: u32, attempt: u32) -> ([f64; 2], DVec3) {
    const THIRD: f64 = 1.0 / 3.0;
    if attempt == 0 {
        return ([THIRD; 2], normal);
    }
    let unit = |word: u32| f64::from(word) / f64::from(u32::MAX);
    let [x, y, z, _] = pcg4d([face, attempt, 0, 0x6d657368]).map(|word| 2.0 * unit(word) - 1.0);
    let [p, q, r, _] = pcg4d([face, attempt, 1, 0x6d657368]).map(|word| 0.25 + unit(word));
    ([p / (p + q + r), q / (p + q + r)], normal + DVec3::new(x, y, z))
}

/// Number of faces that the ray crosses after it leaves `face`; none if rounding leaves a doubt.
fn crossings(
    mesh: &impl RaySearch<f64>,
    face: u32,
    origin: DVec3,
    direction: DVec3,
    size: f64,
    hits: &mut Vec<Hit<f64>>,
) -> Option<usize> {
    // The face itself is met before or behind the origin, as that is rounded.
    let before = ROUNDINGS * f64::EPSILON * (largest(origin) / size + 1.0);
    let ray = Ray::new(origin.to_array(), direction.to_array()).ok()?.within(-before, f64::INFINITY);
    hits.clear();
    let _: ControlFlow<()> = mesh.try_hits(&ray, |hit| {
        hits.push(hit);
        ControlFlow::Continue(f64::INFINITY)
    });
    let own = *hits.iter().find(|hit| hit.face == face)?;
    let doubt = |hit: &Hit<f64>| doubt(&ray, mesh.triangles().corners(hit.face), hit);
    let own_doubt = doubt(&own)?;
    hits.sort_unstable_by_key(|hit| hit.face);
    hits.dedup_by_key(|hit| hit.face);
    let mut n = 0;
    for hit in hits.iter().filter(|hit| hit.face != face) {
        if (hit.t - own.t).abs() <= doubt(hit)? + own_doubt {
            return None;
        }
        n += usize::from(hit.t > own.t);
    }
    Some(n)
}

/// How far the t of a hit may be off; none if the ray may have missed.
///
/// Each corner, as the ray sees it, is rounded by as much as ε times its distance. That moves the edges by as much, the
/// weights by that over the width of the triangle, and t by that of its depth.
fn doubt(ray: &Ray<f64>, corners: [[f64; 3]; 3], hit: &Hit<f64>) -> Option<f64> {
    let [a, b, c] = corners.map(DVec3::from);
    let (origin, direction) = (DVec3::from(ray.origin()), DVec3::from(ray.direction()));
    let (ab, ac, bc) = (b - a, c - a, c - b);
    let longest = largest(ab).max(largest(ac)).max(largest(bc));
    let reach = [a, b, c].into_iter().fold(0.0f64, |m, p| m.max(largest(p - origin)));
    let length = largest(direction);
    let rounding = ROUNDINGS * f64::EPSILON * reach;
    // Twice the area that the ray sees.
    let seen = (direction / length).dot(ab.cross(ac)).abs();
    let nearest_edge = hit.u.min(hit.v).min(1.0 - hit.u - hit.v);
    (nearest_edge * seen > rounding * longest).then(|| rounding * (1.0 + longest * longest / seen) / length)
}
