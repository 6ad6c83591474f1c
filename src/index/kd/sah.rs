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
#[derive(Clone)]
pub struct Cheapest<'a> {
    sah: &'a Sah,
    cell: &'a Aabb,
    /// Of the cell's faces across each axis, and half their edges.
    faces: [f64; 3],
    rims: [f64; 3],
    /// κ_I over the cell's area.
    weight: f64,
    /// Its cost, too.
    pub(super) best: Option<(f64, Plane)>,
}

impl<'a> Cheapest<'a> {
    pub fn new(sah: &'a Sah, cell: &'a Aabb) -> Self {
        let size: [f64; 3] = std::array::from_fn(|axis| f64::from(cell.max[axis]) - f64::from(cell.min[axis]));
        let others = |axis: usize| (size[(axis + 1) % 3], size[(axis + 2) % 3]);
        let faces = [0, 1, 2].map(|axis| others(axis).0 * others(axis).1);
        let rims = [0, 1, 2].map(|axis| others(axis).0 + others(axis).1);
        // Of a cell without area, which no ray meets, no cost is a number below that of a leaf.
        let weight = sah.intersection / (faces[0] + faces[1] + faces[2]);
        Self { sah, cell, faces, rims, weight, best: None }
    }

    /// Both ways with the planar triangles. A plane on a face of the cell would split nothing.
    #[inline]
    pub fn offer(&mut self, axis: usize, at: f32, counts: Counts) {
        let (min, max) = (self.cell.min[axis], self.cell.max[axis]);
        if !(at > min && at < max) {
            return;
        }
        let Counts { below, planar, above } = counts;
        let (face, rim, at64) = (self.faces[axis], self.rims[axis], f64::from(at));
        let area_below = face + rim * (at64 - f64::from(min));
        let area_above = face + rim * (f64::from(max) - at64);
        let bonus = if below == 0 || above == 0 { self.sah.empty } else { 1.0 };
        let (traversal, weight) = (self.sah.traversal, self.weight);
        let cost = |below: usize, above: usize| {
            bonus * (traversal + weight * (area_below * below as f64 + area_above * above as f64))
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

    /// Also those that were offered to another.
    pub fn join(&mut self, other: &Self) {
        if let Some((cost, plane)) = other.best {
            self.consider(cost, plane);
        }
    }

    /// The cheapest plane, if it is cheaper than to test all `n` triangles.
    pub fn worth(self, n: usize) -> Option<Plane> {
        let (cost, plane) = self.best?;
        (cost < self.sah.intersection * n as f64).then_some(plane)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CELL: Aabb = Aabb { min: [0.0; 3], max: [1.0; 3] };
    const SAH: Sah = Sah { traversal: 0.5, intersection: 2.0, empty: 0.75, max_depth: 64 };

    fn offered(offers: &[(usize, f32, [usize; 3])]) -> Option<(f64, Plane)> {
        let mut cheapest = Cheapest::new(&SAH, &CELL);
        for &(axis, at, [below, planar, above]) in offers {
            cheapest.offer(axis, at, Counts { below, planar, above });
        }
        cheapest.best
    }

    /// Half the areas are 3, 1.5 below a quarter and 2.5 above it.
    #[test]
    fn costs_are_those_of_the_definition() {
        let cost = |at, counts| offered(&[(1, at, counts)]).map(|(cost, plane)| (cost, plane.planar_below));
        let of = |below: f64, above: f64| 0.5 + 2.0 * (1.5 * below + 2.5 * above) / 3.0;
        let near = |found: Option<(f64, bool)>, expected: f64, below: bool| {
            let (cost, planar_below) = found.unwrap();
            assert!((cost - expected).abs() < 1e-12 && planar_below == below, "{cost} {expected}");
        };
        near(cost(0.25, [3, 0, 4]), of(3.0, 4.0), true);
        // Those in the plane go where they cost less; they do not make a half full.
        near(cost(0.25, [3, 2, 4]), of(5.0, 4.0), true);
        near(cost(0.75, [3, 2, 4]), of(6.0, 3.0), false);
        near(cost(0.25, [0, 2, 4]), 0.75 * of(2.0, 4.0), true);
        near(cost(0.25, [3, 2, 0]), 0.75 * of(5.0, 0.0), true);
        near(cost(0.75, [0, 0, 3]), 0.75 * of(3.0, 0.0), true);
        near(cost(0.75, [3, 0, 0]), 0.75 * of(0.0, 3.0), true);
        // Nothing is split on a face of the cell.
        assert_eq!((cost(0.0, [0, 2, 4]), cost(1.0, [4, 2, 0])), (None, None));
    }

    #[test]
    fn of_equal_planes_the_first_axis_the_lowest_place_and_below() {
        let all = [(0, 0.25, [3, 0, 3]), (0, 0.75, [3, 0, 3]), (1, 0.25, [3, 0, 3]), (2, 0.75, [3, 0, 3])];
        for order in [[0, 1, 2, 3], [3, 2, 1, 0], [2, 0, 3, 1]] {
            let (_, plane) = offered(&order.map(|i| all[i])).unwrap();
            assert_eq!(plane, Plane { axis: 0, at: 0.25, planar_below: true });
        }
        assert!(offered(&[(0, 0.5, [3, 1, 3])]).unwrap().1.planar_below);
    }

    #[test]
    fn a_split_that_costs_as_much_as_a_leaf_is_none() {
        let worth = |n| {
            let mut cheapest = Cheapest::new(&SAH, &CELL);
            // 0.75 · (0.5 + 2 · 2 · 2.25 / 3) = 2.625
            cheapest.offer(0, 0.625, Counts { below: 2, planar: 0, above: 0 });
            cheapest.worth(n)
        };
        assert!(worth(2).is_some() && worth(1).is_none());
        let sah = Sah { traversal: 1.0, intersection: 1.0, empty: 1.0, max_depth: 64 };
        let mut cheapest = Cheapest::new(&sah, &CELL);
        // 1 + (2 · 2 + 2 · 2 + 2 · 2) / 3 = 5 = n
        cheapest.offer(2, 0.5, Counts { below: 3, planar: 0, above: 3 });
        assert_eq!((cheapest.clone().worth(5), cheapest.worth(6).is_some()), (None, true));
        // A cell without area.
        let mut cheapest = Cheapest::new(&sah, &Aabb { max: [1.0, 0.0, 0.0], ..CELL });
        cheapest.offer(0, 0.5, Counts { below: 1, planar: 0, above: 1 });
        assert_eq!(cheapest.worth(1000), None);
    }
}
