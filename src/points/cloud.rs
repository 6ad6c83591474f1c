//! A cloud of points, and the index over it.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Error;
use crate::index::{MAX_K, NearestLists, PointBvh, PointOrder, Radii, RadiusSearch};

/// Size of a coordinate, at most: its square and sums of squares stay finite.
pub const MAX_COORDINATE: f64 = 1e100;
/// Points asked for the spacing of a cloud, or for its middle.
const SAMPLES: usize = 16_384;
/// Of which coincident points may hide the nearest distinct one.
const SPACING_K: usize = 8;
/// Points whose sums are taken by one thread: fixed, so that sums do not depend on the number of threads.
pub(super) const CHUNK: usize = 4096;

/// What positions are written as.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32-bit floats.
    #[default]
    Single,
    /// 64-bit floats.
    Double,
}

/// Points, and what is known of each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cloud {
    /// In the cloud's unit; finite.
    pub positions: Vec<DVec3>,
    /// Of unit length, or zero where there is none.
    pub normals: Option<Vec<Vec3>>,
    /// Red, green, blue, alpha, as found.
    pub colours: Option<Vec<[u8; 4]>>,
    /// Of the file that it came from.
    pub precision: Precision,
}

impl Cloud {
    /// Bare points.
    pub fn new(positions: Vec<DVec3>) -> Self {
        Self { positions, ..Self::default() }
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }
}

/// Coordinates for the search: the median of each coordinate at the origin, half of the points elsewhere within 1 of it.
///
/// The scale is a power of two, so it costs no rounding; a position is rounded by 2⁻²⁴ of its distance from the origin
/// along each axis. Stray points, as long as they are fewer than half, cost the others no precision, however far off. With
/// the scale a cloud gives the same answers in millimetres and in kilometres, and squared distances between the points
/// about the origin neither overflow nor vanish. What lies more than 10¹⁸ off is moved there: far from the rest, but no
/// longer told apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    origin: DVec3,
    scale: f64,
}

impl Frame {
    /// That of a cloud.
    pub fn of(positions: &[DVec3]) -> Self {
        let Some(&first) = positions.first() else { return Self { origin: DVec3::ZERO, scale: 1.0 } };
        let step = positions.len().div_ceil(SAMPLES);
        let sample: Vec<DVec3> = positions.iter().copied().step_by(step).collect();
        let one_place = Self { origin: first, scale: 1.0 };
        Self::of_sample(&sample).or_else(|| Self::of_sample(positions)).unwrap_or(one_place)
    }

    /// By the upper medians; None if all are in one place.
    fn of_sample(positions: &[DVec3]) -> Option<Self> {
        let middle = |axis: usize| median(positions.iter().map(|p| p[axis]).collect());
        let origin = DVec3::new(middle(0)?, middle(1)?, middle(2)?);
        let sizes = positions.iter().map(|&p| (p - origin).abs().max_element());
        let size = median(sizes.filter(|&size| size > 0.0).collect())?;
        Some(Self { origin, scale: (-size.log2().ceil()).clamp(-1000.0, 1000.0).exp2() })
    }

    /// A position in the frame; what lies further off than squares reach is moved nearer, and is still far from all.
    #[inline]
    pub fn local(&self, position: DVec3) -> Vec3 {
        let far = DVec3::splat(1e18);
        ((position - self.origin) * self.scale).clamp(-far, far).as_vec3()
    }

    /// A distance in the frame.
    #[inline]
    pub fn length(&self, distance: f64) -> f64 {
        distance * self.scale
    }

    fn locals(&self, positions: &[DVec3]) -> Vec<Vec3> {
        positions.par_iter().with_min_len(CHUNK).map(|&p| self.local(p)).collect()
    }
}

/// A cloud's points with the index over them.
#[derive(Clone, Debug)]
pub struct Indexed<'a> {
    positions: &'a [DVec3],
    frame: Frame,
    tree: PointBvh,
}

impl<'a> Indexed<'a> {
    /// Builds the index; refuses what is not finite.
    pub fn new(positions: &'a [DVec3]) -> Result<Self, Error> {
        check(positions)?;
        let frame = Frame::of(positions);
        // Its boxes follow the points: a stray one far off does not widen those of the others.
        let tree = PointBvh::with_order(&frame.locals(positions), PointOrder::Median)?;
        Ok(Self { positions, frame, tree })
    }

    /// The points.
    pub fn positions(&self) -> &'a [DVec3] {
        self.positions
    }

    /// Where the index lives.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Over the points in the frame.
    pub fn tree(&self) -> &PointBvh {
        &self.tree
    }

    /// The `k` nearest points of each query within `radius` (cloud's unit, may be infinite; slightly more is found, for
    /// the rounding in the frame). Distances are the frame's.
    pub fn nearest(&self, queries: &[DVec3], radius: f64, k: usize) -> Result<NearestLists, Error> {
        let radius = self.frame.length(radius);
        let queries = self.frame.locals(queries);
        // None for a negative radius, which the search refuses.
        let rounding = if radius < 0.0 { 0.0 } else { 1e-6 };
        let radius = |q: &Vec3| (radius + rounding * (1.0 + radius + f64::from(q.abs().max_element()))) as f32;
        let radii: Vec<f32> = queries.iter().map(radius).collect();
        Ok(self.tree.nearest_all(&queries, Radii::Each(&radii), k)?)
    }

    /// Median distance of a point to the nearest one that is elsewhere, cloud's unit; None if there is no such.
    pub fn spacing(&self) -> Option<f64> {
        let step = self.positions.len().div_ceil(SAMPLES).max(1);
        let asked: Vec<DVec3> = self.positions.iter().copied().step_by(step).collect();
        // More where each position occurs many times.
        self.spacing_among(&asked, SPACING_K).or_else(|| self.spacing_among(&asked, MAX_K))
    }

    fn spacing_among(&self, asked: &[DVec3], k: usize) -> Option<f64> {
        let lists = self.nearest(asked, f64::INFINITY, k).ok()?;
        let elsewhere = |(row, &p): (&[u32], &DVec3)| {
            let near = row.iter().filter_map(|&i| self.positions.get(i as usize));
            near.map(|q| q.distance(p)).filter(|&d| d > 0.0).min_by(f64::total_cmp)
        };
        median(lists.indices.chunks(k).zip(asked).filter_map(elsewhere).collect())
    }
}

/// The upper median; None of nothing.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Refuses coordinates that cannot be computed with.
pub(super) fn check(positions: &[DVec3]) -> Result<(), Error> {
    let wrong = |p: &DVec3| !p.is_finite() || p.abs().max_element() > MAX_COORDINATE;
    positions.iter().position(wrong).map_or(Ok(()), |at| Err(Error::Coordinate(at)))
}
