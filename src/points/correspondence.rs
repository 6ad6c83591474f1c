//! Nearest correspondence between two clouds: k = 1, within an outlier distance.

use glam::DVec3;
use rayon::prelude::*;

use super::cloud::{CHUNK, check};
use super::{Error, Indexed};

/// The automatic outlier distance, in spacings. On a surface sampled at random, the distance to the nearest sample exceeds
/// four times its median for one point in 65,000 (P = 2^(−16), a Poisson process in the plane).
const SPACINGS: f64 = 4.0;

/// The nearest point of the other cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Of the point; `u32::MAX` for none.
    pub index: u32,
    /// Between the two, in the clouds' unit; infinite for none.
    pub distance: f64,
}

impl Match {
    /// Nothing is near enough.
    pub const NONE: Self = Self { index: u32::MAX, distance: f64::INFINITY };

    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        self.index != u32::MAX
    }
}

/// For each point of `source` the nearest one of `target` at most `outlier` away (infinite: always one, unless there are
/// none).
///
/// The nearest is found in the target's [`super::Frame`]: of points that differ by less than its rounding either may be
/// taken. Distances are computed from the positions themselves.
pub fn correspond(source: &[DVec3], target: &Indexed, outlier: f64) -> Result<Vec<Match>, Error> {
    check(source)?;
    let lists = target.nearest(source, outlier, 1)?;
    let of = |(&index, &p): (&u32, &DVec3)| match target.positions().get(index as usize) {
        Some(&q) if q.distance(p) <= outlier => Match { index, distance: q.distance(p) },
        _ => Match::NONE,
    };
    Ok(lists.indices.par_iter().zip(source).with_min_len(CHUNK).map(of).collect())
}

/// A distance beyond which a point has no counterpart in a cloud sampled like this one, in its unit: four times the
/// spacing. Zero if all points are in one place.
pub fn automatic_outlier(target: &Indexed) -> f64 {
    SPACINGS * target.spacing().unwrap_or(0.0)
}
