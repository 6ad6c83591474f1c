//! Rigid motions, and the one that fits pairs of points best.

use glam::{DMat3, DQuat, DVec3};
use nalgebra::{Matrix3, SVD};
use rayon::prelude::*;

use super::Error;
use super::cloud::CHUNK;

/// Second singular value over the first, below which points count as lying on a line.
const LINE: f64 = 1e-10;
const SVD_ITERATIONS: usize = 256;

/// x ↦ R·x + t.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rigid {
    /// R, of unit length.
    pub rotation: DQuat,
    /// t, in the clouds' unit.
    pub translation: DVec3,
}

impl Rigid {
    /// Moves nothing.
    pub const IDENTITY: Self = Self { rotation: DQuat::IDENTITY, translation: DVec3::ZERO };

    /// Turns by `rotation` about `centre`, then moves by `translation`.
    pub fn about(centre: DVec3, rotation: DQuat, translation: DVec3) -> Self {
        let rotation = rotation.normalize();
        Self { rotation, translation: centre - rotation * centre + translation }
    }

    /// Of one position.
    #[inline]
    pub fn apply(&self, position: DVec3) -> DVec3 {
        self.rotation * position + self.translation
    }

    /// Of many.
    pub fn apply_all(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let rotation = DMat3::from_quat(self.rotation);
        positions.par_iter().with_min_len(CHUNK).map(|&p| rotation * p + self.translation).collect()
    }

    /// This one after `first`.
    pub fn after(&self, first: &Self) -> Self {
        let rotation = (self.rotation * first.rotation).normalize();
        Self { rotation, translation: self.apply(first.translation) }
    }

    /// Undoes it.
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.conjugate();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// The homogeneous matrix, row by row; it multiplies columns (x, y, z, 1).
    pub fn rows(&self) -> [[f64; 4]; 4] {
        let (r, t) = (DMat3::from_quat(self.rotation), self.translation);
        let row = |i: usize| [r.x_axis[i], r.y_axis[i], r.z_axis[i], t[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// Angle of the rotation, radians, 0 … π.
    pub fn angle(&self) -> f64 {
        let axis = DVec3::new(self.rotation.x, self.rotation.y, self.rotation.z);
        2.0 * axis.length().atan2(self.rotation.w.abs())
    }
}

/// The motion that takes each first point to its second with the least sum of squared distances: singular value
/// decomposition of the cross-covariance, a reflection ruled out (Kabsch 1976; Umeyama 1991).
pub fn fit(pairs: &[(DVec3, DVec3)]) -> Result<Rigid, Error> {
    let n = pairs.len() as f64;
    let add = |a: (DVec3, DVec3), b: (DVec3, DVec3)| (a.0 + b.0, a.1 + b.1);
    let zero = (DVec3::ZERO, DVec3::ZERO);
    // Sums about the first pair, so that a cloud far from its origin loses nothing.
    let Some(&first) = pairs.first() else { return Err(Error::Undetermined) };
    let sum = chunked(pairs, zero, add, |&(p, q)| (p - first.0, q - first.1));
    let (mean_p, mean_q) = (first.0 + sum.0 / n, first.1 + sum.1 / n);
    let covariance = chunked(
        pairs,
        DMat3::ZERO,
        |a, b| a + b,
        |&(p, q)| {
            let (p, q) = (p - mean_p, q - mean_q);
            DMat3::from_cols(q * p.x, q * p.y, q * p.z)
        },
    );
    let size = covariance.to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    if size.is_nan() || size <= 0.0 {
        return Err(Error::Undetermined);
    }
    // Columns of glam's are columns of nalgebra's.
    let matrix = Matrix3::from_column_slice(&(covariance * size.recip()).to_cols_array());
    let svd = SVD::try_new(matrix, true, true, f64::EPSILON, SVD_ITERATIONS).ok_or(Error::Undetermined)?;
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err(Error::Undetermined) };
    let mut values = [svd.singular_values[0], svd.singular_values[1], svd.singular_values[2]];
    let least = (0..3).min_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(2);
    values.sort_unstable_by(f64::total_cmp);
    if values[1] <= LINE * values[2] {
        return Err(Error::Undetermined);
    }
    let mut signs = Matrix3::identity();
    signs[(least, least)] = (u * v_t).determinant().signum();
    let rotation = u * signs * v_t;
    let rotation = DQuat::from_mat3(&DMat3::from_cols_slice(rotation.as_slice())).normalize();
    Ok(Rigid { rotation, translation: mean_q - rotation * mean_p })
}

/// Sum over fixed chunks, in order: the same at any number of threads.
pub(super) fn chunked<P: Sync, T: Copy + Send + Sync>(
    items: &[P],
    zero: T,
    add: impl Fn(T, T) -> T + Sync,
    term: impl Fn(&P) -> T + Sync,
) -> T {
    let of_chunk = |chunk: &[P]| chunk.iter().fold(zero, |sum, item| add(sum, term(item)));
    let sums: Vec<T> = items.par_chunks(CHUNK).map(of_chunk).collect();
    sums.into_iter().fold(zero, add)
}
