//! Registration of two scans by iterative closest points: point-to-point (Besl & McKay 1992) and point-to-plane (Chen &
//! Medioni 1992), the latter linearised (Low 2004).

use glam::{DQuat, DVec3, Vec3};
use nalgebra::{SymmetricEigen, Vector6};
use rayon::prelude::*;

use super::cloud::{CHUNK, median};
use super::rigid::{chunked, fit};
use super::{Error, Indexed, Match, Rigid, automatic_outlier, correspond};

/// The automatic outlier distance, in medians of the distances of an iteration.
const MEDIANS: f64 = 3.0;
/// Pairs, at least.
const MIN_PAIRS: usize = 3;
/// Eigenvalue over the largest, below which the planes say nothing of that motion: a plane slides on a plane.
const FREE: f64 = 1e-6;
const EIGEN_ITERATIONS: usize = 256;

/// What is made small.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Squared distances between matched points. Robust; converges slowly along the surface.
    PointToPoint,
    /// Squared distances to the tangent planes of the matched points. Converges in few iterations; needs the target's
    /// normals.
    PointToPlane,
}

/// How to iterate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// What is made small.
    pub method: Method,
    /// Pairs farther apart are left out, clouds' unit. None: in each iteration three times the median distance, but not
    /// less than [`automatic_outlier`].
    pub outlier: Option<f64>,
    /// At most.
    pub iterations: usize,
    /// Converged once a step moves no matched point by more than this share of the diagonal of their box.
    pub tolerance: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { method: Method::PointToPoint, outlier: None, iterations: 100, tolerance: 1e-6 }
    }
}

/// How well the clouds fit before an iteration's step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Iteration {
    /// Root mean square distance of the pairs kept, clouds' unit.
    pub rms: f64,
    /// The same along the target's normals, for point-to-plane.
    pub plane_rms: Option<f64>,
    /// Share of the source's points that have a counterpart, 0 … 1.
    pub inliers: f64,
    /// The outlier distance, clouds' unit.
    pub outlier: f64,
}

/// Where the source goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Registration {
    /// From the source to the target.
    pub motion: Rigid,
    /// The first without any step, the last with the motion above.
    pub iterations: Vec<Iteration>,
    /// Whether the steps became small, rather than too many.
    pub converged: bool,
    /// Independent motions of which the last step's planes said nothing, 0 … 6; they were left alone.
    pub free: usize,
}

/// Moves `source` onto `target`. `normals` are the target's, of either sign, zero where there is none; needed for
/// point-to-plane only.
///
/// `watch` is told each iteration as it is done. The motion found is the best nearby: clouds turned against each other by more than some 45 degrees may lock in wrongly.
///
/// # Panics
/// If normals are needed and there are not as many as target points.
pub fn register(
    source: &[DVec3],
    target: &Indexed,
    normals: Option<&[Vec3]>,
    settings: &Settings,
    mut watch: impl FnMut(usize, &Iteration),
) -> Result<Registration, Error> {
    for points in [source.len(), target.positions().len()] {
        if points < MIN_PAIRS {
            return Err(Error::TooFew { points, task: "registration", needed: MIN_PAIRS });
        }
    }
    let normals = match settings.method {
        Method::PointToPoint => None,
        Method::PointToPlane => {
            let normals = normals.expect("point-to-plane needs the target's normals");
            assert_eq!(normals.len(), target.positions().len(), "as many normals as points");
            Some(normals)
        }
    };
    let least_outlier = automatic_outlier(target);
    let mut found = Registration { motion: Rigid::IDENTITY, iterations: Vec::new(), converged: false, free: 0 };
    for iteration in 0..=settings.iterations {
        let moved = found.motion.apply_all(source);
        let matches = correspond(&moved, target, settings.outlier.unwrap_or(f64::INFINITY))?;
        let outlier = settings.outlier.unwrap_or_else(|| {
            let distances = matches.iter().filter(|m| m.is_some()).map(|m| m.distance).collect();
            (MEDIANS * median(distances).unwrap_or(0.0)).max(least_outlier)
        });
        let pairs = pairs(&moved, target, normals, &matches, outlier);
        if pairs.len() < MIN_PAIRS {
            return Err(Error::Apart { iteration, matches: pairs.len(), distance: outlier });
        }
        let (distance2, plane2) = chunked(
            &pairs,
            (0.0, 0.0),
            |a, b| (a.0 + b.0, a.1 + b.1),
            |pair| {
                let d = pair.from - pair.to;
                (d.length_squared(), d.dot(pair.normal).powi(2))
            },
        );
        let root_mean = |sum: f64| (sum / pairs.len() as f64).sqrt();
        let fit_so_far = Iteration {
            rms: root_mean(distance2),
            plane_rms: normals.map(|_| root_mean(plane2)),
            inliers: pairs.len() as f64 / source.len() as f64,
            outlier,
        };
        watch(iteration, &fit_so_far);
        found.iterations.push(fit_so_far);
        if found.converged || iteration == settings.iterations {
            break;
        }
        let step = match normals {
            None => fit(&pairs.iter().map(|pair| (pair.from, pair.to)).collect::<Vec<_>>())?,
            Some(_) => {
                let (step, free) = fit_planes(&pairs)?;
                found.free = free;
                step
            }
        };
        found.motion = step.after(&found.motion);
        found.converged = reach(&step, &pairs) <= settings.tolerance;
    }
    Ok(found)
}

/// A point of the source as moved so far, its counterpart, and the normal there (zero for point-to-point).
struct Pair {
    from: DVec3,
    to: DVec3,
    normal: DVec3,
}

fn pairs(moved: &[DVec3], target: &Indexed, normals: Option<&[Vec3]>, matches: &[Match], outlier: f64) -> Vec<Pair> {
    let pair = |(&from, m): (&DVec3, &Match)| {
        let to = *target.positions().get(m.index as usize)?;
        let normal = normals.map_or(DVec3::ZERO, |n| n[m.index as usize].as_dvec3());
        let fits = m.distance <= outlier && (normals.is_none() || normal != DVec3::ZERO);
        fits.then_some(Pair { from, to, normal })
    };
    moved.par_iter().zip(matches).with_min_len(CHUNK).filter_map(pair).collect()
}

/// The farthest that a step moves a corner of the pairs' box, and so at least as far as any of them, over its diagonal.
fn reach(step: &Rigid, pairs: &[Pair]) -> f64 {
    let corners = pairs.iter().map(|pair| (pair.from, pair.from)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
    let Some((min, max)) = corners else { return 0.0 };
    let corner = |i: usize| {
        DVec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 0 { min[axis] } else { max[axis] }))
    };
    (0..8).map(corner).map(|c| step.apply(c).distance(c)).fold(0.0, f64::max) / min.distance(max)
}

/// The small motion that brings the points to the planes, and the number of motions that the planes leave free.
///
/// Least squares of (p + ω×p + t − q)·n over the rotation ω and the translation t, about the points' mean and in units
/// of their spread, so that turning and moving weigh alike. Along eigenvectors that the planes do not see nothing moves.
fn fit_planes(pairs: &[Pair]) -> Result<(Rigid, usize), Error> {
    let n = pairs.len() as f64;
    let first = pairs.first().ok_or(Error::Undetermined)?.from;
    let mean = first + chunked(pairs, DVec3::ZERO, |a, b| a + b, |pair| pair.from - first) / n;
    let spread = (chunked(pairs, 0.0, |a, b| a + b, |pair| pair.from.distance_squared(mean)) / n).sqrt();
    if spread.is_nan() || spread <= 0.0 {
        return Err(Error::Undetermined);
    }
    // The matrix's 36 entries, then the right-hand side's 6.
    type Sums = [f64; 42];
    let add = |mut a: Sums, b: Sums| {
        a.iter_mut().zip(b).for_each(|(a, b)| *a += b);
        a
    };
    let sums = chunked(pairs, [0.0; 42], add, |pair| {
        let turn = ((pair.from - mean) / spread).cross(pair.normal);
        let row = [turn.x, turn.y, turn.z, pair.normal.x, pair.normal.y, pair.normal.z];
        let off = (pair.to - pair.from).dot(pair.normal) / spread;
        std::array::from_fn(|i| if i < 36 { row[i / 6] * row[i % 6] } else { row[i - 36] * off })
    });
    let eigen = SymmetricEigen::try_new(nalgebra::Matrix6::from_row_slice(&sums[..36]), f64::EPSILON, EIGEN_ITERATIONS)
        .ok_or(Error::Undetermined)?;
    let right = Vector6::from_column_slice(&sums[36..]);
    let largest = eigen.eigenvalues.max();
    let (mut x, mut free) = (Vector6::zeros(), 0);
    for (value, axis) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value > FREE * largest {
            x += axis * (axis.dot(&right) / value);
        } else {
            free += 1;
        }
    }
    let rotation = DQuat::from_scaled_axis(DVec3::new(x[0], x[1], x[2]));
    Ok((Rigid::about(mean, rotation, DVec3::new(x[3], x[4], x[5]) * spread), free))
}
