//! What a plane costs, and which is the cheapest.

use super::Error;
use super::clip::Aabb;

/// The surface area heuristic: a ray that meets a cell meets a part of it as often as their surfaces say
/// (MacDonald & Booth 1990; Wald & Havran 2006, equations 5 to 8).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sah {
    /// κ_T, the cost of a step down the tree.
    pub traversal: f64,
    /// κ_I, the cost of a test against a triangle.
    pub intersection: f64,
    /// λ, by which the cost of a plane is multiplied that has nothing on one side, planar triangles not counted.
    pub empty: f64,
    /// Cells so deep are not split, at most [`Sah::MAX_DEPTH`]; the root has depth 0.
    pub max_depth: u32,
}

impl Default for Sah {
    fn default() -> Self {
        Self { traversal: 1.0, intersection: 1.0, empty: 0.8, max_depth: Self::MAX_DEPTH }
    }
}

impl Sah {
    /// No deeper tree can be walked.
    pub const MAX_DEPTH: u32 = 64;

    pub(super) fn check(&self) -> Result<(), Error> {
        let fine = |x: f64| x.is_finite() && x >= 0.0;
        let all = fine(self.traversal) && fine(self.intersection) && fine(self.empty);
        if all && self.max_depth <= Self::MAX_DEPTH { Ok(()) } else { Err(Error::Sah(*self)) }
    }
}

/// Where a cell is split.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane {
    pub axis: usize,
    /// In the frame.
    pub at: f32,
    /// Triangles in the plane go below it, otherwise above.
    pub planar_below: bool,
}

/// Triangles of a cell by where they are: below a plane, in it, above it; one that it cuts is below and above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    pub below: usize,
    pub planar: usize,
    pub above: usize,
}

/// Keeps the cheapest plane. Of planes that cost the same it is the one of the first axis, then the lowest, then planar
/// triangles below it: so the order in which they are offered does not matter.
pub struct Cheapest<'a> {
    sah: &'a Sah,
    cell: &'a Aabb,
    area: f64,
    best: Option<(f64, Plane)>,
}

impl<'a> Cheapest<'a> {
    pub fn new(sah: &'a Sah, cell: &'a Aabb) -> Self {
        Self { sah, cell, area: cell.area(), best: None }
    }

    /// Both ways with the planar triangles. A plane on a face of the cell would split nothing.
    #[inline]
    pub fn offer(&mut self, axis: usize, at: f32, counts: Counts) {
        if !(at > self.cell.min[axis] && at < self.cell.max[axis]) || self.area <= 0.0 {
            return;
        }
        let Counts { below, planar, above } = counts;
        let [area_below, area_above] = self.cell.cut(axis, at).map(|part| part.area());
        let (sah, area) = (self.sah, self.area);
        let bonus = if below == 0 || above == 0 { sah.empty } else { 1.0 };
        let cost = |below: usize, above: usize| {
            let tests = (area_below * below as f64 + area_above * above as f64) / area;
            bonus * (sah.traversal + sah.intersection * tests)
        };
        self.consider(cost(below + planar, above), Plane { axis, at, planar_below: true });
        if planar > 0 {
            self.consider(cost(below, above + planar), Plane { axis, at, planar_below: false });
        }
    }

    #[inline]
    fn consider(&mut self, cost: f64, plane: Plane) {
        let before = |cost: f64, plane: Plane, best: Plane, best_cost: f64| {
            if cost != best_cost {
                return cost < best_cost;
            }
            (plane.axis, plane.at, !plane.planar_below) < (best.axis, best.at, !best.planar_below)
        };
        if self.best.is_none_or(|(best_cost, best)| before(cost, plane, best, best_cost)) {
            self.best = Some((cost, plane));
        }
    }

    /// The cheapest plane, if it is cheaper than to test all `n` triangles.
    pub fn worth(self, n: usize) -> Option<Plane> {
        let (cost, plane) = self.best?;
        (cost < self.sah.intersection * n as f64).then_some(plane)
    }
}
