//! Neighbour search over points: radius search and truncated k-NN; and rays among triangles ([`kd`]). Usable alone: nothing
//! here knows of photons.
//!
//! Everything is in the caller's unit. A point is within a radius when |p − q|² ≤ r², the squares taken in `f32` as
//! x² + y² + z² from left to right, so that every index finds the same set, bit for bit. A distance whose square
//! overflows is beyond every radius, the infinite one included.
//!
//! # Which index
//!
//! | points and queries | index |
//! |---|---|
//! | any; several radii, or one a query; points that are soon others; the same tree on the GPU | [`PointBvh::new`] |
//! | the same for points that stay and are asked much; k-NN | [`PointBvh::with_order`], [`PointOrder::Median`] |
//! | one radius for all, asked many times; k-NN within a radius that few points are in | [`HashGrid`] |
//! | radii far below the largest | not a grid or inflated boxes, which look as far as the largest: [`PointBvh`], [`PointKd`] |
//! | a handful, or to check another index by | [`BruteForce`] |
//! | triangles and rays, not points | [`kd`] |
//! | to compare: FLANN's form, with result buffers | [`KdBuffered`] |
//! | to compare: the paper's form, boxes inflated by the radius, and the same with tight boxes | [`SampleBvh`] |
//! | to compare: what the paper rejects | [`queries_as_boxes`] |
//!
//! What a query visits, on average ([`stats`]), among 500,000 points on the walls of a room and a ball in it, with 50
//! neighbours each:
//!
//! | index | nodes | boxes or planes | points |
//! |---|---|---|---|
//! | [`HashGrid`] | 7.9 runs of cells | – | 141 |
//! | [`PointBvh`] | 41, of eight boxes | 179 | 139 |
//! | [`PointKd`] | 46 | 71 | 157 |
//! | [`SampleBvh`], LBVH, tight, one point to a leaf | 145 | 189 | 51 |
//! | the same, inflated | 176 | 220 | 66 |
//! | [`SampleBvh`], LBVH, tight, eight points to a leaf | 55 | 83 | 81 |
//! | the same, inflated | 61 | 89 | 97 |
//!
//! PLOC's trees are no better for points of this density (SAH 929 against 936 with inflated boxes and one point to a leaf),
//! and take three times as long to build.

mod batch;
mod blocks;
mod bvh;
mod grid;
pub mod kd;
mod kd_buffered;
mod lanes;
mod median;
mod nearest;
mod packet;
mod point_kd;
mod queries_as_boxes;
mod radix;
mod sample_boxes;
mod sample_build;
pub mod stats;
mod walk;

use std::ops::ControlFlow;

use glam::Vec3;

pub use batch::{NearestLists, Neighbours, Radii};
pub use bvh::{PointBvh, PointOrder};
pub use grid::{HashGrid, QueryOrder};
pub use kd_buffered::{Buffers, KdBuffered};
pub use nearest::{MAX_K, Nearest, Neighbour};
pub use point_kd::PointKd;
pub use queries_as_boxes::queries_as_boxes;
pub use sample_boxes::{Boxes, Builder, SampleBvh, SampleOptions};

/// Points in one leaf of [`PointBvh`].
pub const LEAF_SIZE: u32 = 8;
/// Children of one of its inner nodes.
pub const FANOUT: u32 = 8;

/// Why a search cannot be made or asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// NaN or infinite.
    #[error("{what} {at} is not finite")]
    NotFinite {
        /// `point` or `query`.
        what: &'static str,
        /// Its index.
        at: usize,
    },
    /// More points than `u32` counts (the last value stands for none).
    #[error("{0} points: at most {max} can be indexed", max = u32::MAX - 1)]
    TooMany(usize),
    /// NaN or negative.
    #[error("radius {radius} of query {query} is not zero or more")]
    Radius {
        /// Index of the query.
        query: usize,
        /// As given.
        radius: f32,
    },
    /// An index is built for a radius of zero or more, infinite included.
    #[error("an index cannot be built for the radius {0}")]
    BuiltRadius(f32),
    /// Above [`RadiusSearch::max_radius`]: neighbours would be missed.
    #[error("radius {radius} of query {query} is above {built}, for which the index was built")]
    RadiusAboveBuilt {
        /// Index of the query.
        query: usize,
        /// As given.
        radius: f32,
        /// What the index answers.
        built: f32,
    },
    /// Not in 1 … [`MAX_K`].
    #[error("k is {0}: 1 to {MAX_K} are possible")]
    K(usize),
    /// More neighbours than a row of the result buffers holds: none is dropped silently.
    #[error("{queries} queries have more than {capacity} neighbours, one of them {most}")]
    Truncated {
        /// How many queries.
        queries: usize,
        /// Length of a row.
        capacity: usize,
        /// The most neighbours of one query.
        most: u32,
    },
    /// As many radii as queries are needed.
    #[error("{radii} radii for {queries} queries")]
    Lengths {
        /// Number of queries.
        queries: usize,
        /// Number of radii.
        radii: usize,
    },
}

/// What every index answers: one query at a time, or all of a slice on all threads.
///
/// A single query takes a finite centre and a radius from 0 to [`RadiusSearch::max_radius`]; the forms over slices check
/// that, and return an error.
pub trait RadiusSearch: Sync {
    /// Number of points.
    fn len(&self) -> usize;

    /// Whether there are none.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The largest radius that may be asked for: infinite unless the index was built for one.
    fn max_radius(&self) -> f32 {
        f32::INFINITY
    }

    /// Calls `visit` once for each point within `radius`, with its index and squared distance, in no particular order,
    /// until it breaks.
    fn try_within<B>(&self, centre: Vec3, radius: f32, visit: impl FnMut(u32, f32) -> ControlFlow<B>)
    -> ControlFlow<B>;

    /// Calls `visit` once for each point within `radius`, with its index and squared distance, in no particular order.
    #[inline]
    fn within(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let _: ControlFlow<()> = self.try_within(centre, radius, |i, d2| {
            visit(i, d2);
            ControlFlow::Continue(())
        });
    }

    /// Number of points within `radius`.
    fn count(&self, centre: Vec3, radius: f32) -> usize {
        let mut n = 0;
        self.within(centre, radius, |_, _| n += 1);
        n
    }

    /// Truncated k-NN: replaces what is in `nearest` by the nearest points within `radius`, as many as it takes
    /// ([`Nearest::new`]). Of points equally far the one of lower index is nearer.
    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        nearest.clear();
        self.within(centre, radius, |i, d2| nearest.insert(i, d2));
    }

    /// For each query, in place: `start(query)`, then `visit` with each neighbour's index and squared distance, in no
    /// particular order. What it leaves behind comes back, in the order of the queries.
    fn fold_all<T: Send>(
        &self,
        queries: &[Vec3],
        radii: Radii<'_>,
        start: impl Fn(usize) -> T + Sync,
        visit: impl Fn(&mut T, u32, f32) + Sync,
    ) -> Result<Vec<T>, Error>
    where
        Self: Sized,
    {
        batch::fold_each(self, queries, radii, start, visit)
    }

    /// Number of neighbours of each query.
    fn count_all(&self, queries: &[Vec3], radii: Radii<'_>) -> Result<Vec<u32>, Error>
    where
        Self: Sized,
    {
        self.fold_all(queries, radii, |_| 0, |n, _, _| *n += 1)
    }

    /// All neighbours of all queries, sized by counting first.
    fn neighbours_all(&self, queries: &[Vec3], radii: Radii<'_>) -> Result<Neighbours, Error>
    where
        Self: Sized,
    {
        batch::neighbours(self, queries, radii)
    }

    /// Truncated k-NN of all queries; `k` from 1 to [`MAX_K`].
    fn nearest_all(&self, queries: &[Vec3], radii: Radii<'_>, k: usize) -> Result<NearestLists, Error>
    where
        Self: Sized,
    {
        batch::nearest(self, queries, radii, k)
    }
}

/// The squared distance as every index computes it.
#[inline]
pub fn distance2(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x * d.x + d.y * d.y + d.z * d.z
}

/// The square of a radius, as every index compares with it: finite, so that what is infinitely far is never within.
#[inline]
pub fn radius2(radius: f32) -> f32 {
    (radius * radius).min(f32::MAX)
}

/// Refuses points that no index takes.
pub fn check_points(points: &[Vec3]) -> Result<(), Error> {
    if points.len() >= u32::MAX as usize {
        return Err(Error::TooMany(points.len()));
    }
    match points.iter().position(|p| !p.is_finite()) {
        Some(at) => Err(Error::NotFinite { what: "point", at }),
        None => Ok(()),
    }
}

/// Refuses radii that no index is built for.
pub fn check_radius(radius: f32) -> Result<(), Error> {
    if radius >= 0.0 { Ok(()) } else { Err(Error::BuiltRadius(radius)) }
}

/// Tests every point: the oracle of the others.
#[derive(Clone, Copy, Debug)]
pub struct BruteForce<'a>(pub &'a [Vec3]);

impl RadiusSearch for BruteForce<'_> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        mut visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let radius2 = radius2(radius);
        for (i, &p) in self.0.iter().enumerate() {
            let d2 = distance2(p, centre);
            if d2 <= radius2 {
                visit(i as u32, d2)?;
            }
        }
        ControlFlow::Continue(())
    }
}
