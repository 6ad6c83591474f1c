//! What a search costs, told without a clock: the cost models of a tree, and what its queries visit.

use std::ops::AddAssign;

use glam::Vec3;

use super::{BruteForce, PointBvh, RadiusSearch};

/// What queries visited. Does not depend on the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Visits {
    /// Nodes entered; of a grid, runs of cells.
    pub nodes: u64,
    /// Boxes, or bounding planes of a kd-tree, tested.
    pub boxes: u64,
    /// Points tested.
    pub points: u64,
    /// Points within the radius.
    pub found: u64,
}

impl AddAssign for Visits {
    fn add_assign(&mut self, other: Self) {
        self.nodes += other.nodes;
        self.boxes += other.boxes;
        self.points += other.points;
        self.found += other.found;
    }
}

/// An index whose visits can be counted.
pub trait CountVisits: RadiusSearch {
    /// Of one radius query.
    fn visits(&self, centre: Vec3, radius: f32) -> Visits;

    /// Of many.
    fn visits_of(&self, queries: &[Vec3], radius: f32) -> Visits {
        let mut sum = Visits::default();
        queries.iter().for_each(|&q| sum += self.visits(q, radius));
        sum
    }
}

/// Hears of a traversal; `()` does not listen, and costs nothing.
pub(super) trait Tally {
    fn node(&mut self) {}
    fn boxes(&mut self, _n: usize) {}
    fn points(&mut self, _n: usize) {}
}

impl Tally for () {}

impl Tally for Visits {
    fn node(&mut self) {
        self.nodes += 1;
    }
    fn boxes(&mut self, n: usize) {
        self.boxes += n as u64;
    }
    fn points(&mut self, n: usize) {
        self.points += n as u64;
    }
}

impl CountVisits for BruteForce<'_> {
    fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        Visits { points: self.len() as u64, found: self.count(centre, radius) as u64, ..Visits::default() }
    }
}

/// A node of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Least corner of its box.
    pub min: Vec3,
    /// Largest corner.
    pub max: Vec3,
    /// Points, if it is a leaf.
    pub leaf: Option<usize>,
}

/// A tree whose cost can be told.
pub trait Hierarchy {
    /// Every node once, the root first.
    fn for_each_node(&self, visit: impl FnMut(Node));
}

/// Weights of the cost models: of testing an inner node, a leaf and a point (C_i, C_l and C_k of the paper).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Weights {
    /// C_i.
    pub inner: f64,
    /// C_l; the paper has 0.
    pub leaf: f64,
    /// C_k.
    pub point: f64,
}

impl Default for Weights {
    fn default() -> Self {
        Self { inner: 1.0, leaf: 0.0, point: 1.0 }
    }
}

/// Cost of a tree by the surface area and the volume heuristic, Eqs. 3 and 4 of Evangelou et al., "Fast Radius Search
/// Exploiting Ray Tracing Frameworks", JCGT 10(1), 2021.
///
/// The volume heuristic is the expected cost of a query uniform in the root's box; the surface area heuristic is never
/// below it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Costs {
    /// Surface area heuristic; NaN if the root has no area.
    pub sah: f64,
    /// Volume heuristic; NaN if the root has no volume.
    pub vh: f64,
    /// Inner nodes.
    pub n_inner: usize,
    /// Leaves.
    pub n_leaves: usize,
}

impl Costs {
    /// With all boxes grown by `radius` first: 0 for a tree of boxes that are inflated already, the query's radius for
    /// one of tight boxes.
    pub fn of(tree: &impl Hierarchy, radius: f32, weights: Weights) -> Self {
        let mut costs = Self::default();
        let mut root = None;
        tree.for_each_node(|node| {
            let [w, h, d] = (node.max.as_dvec3() - node.min.as_dvec3() + 2.0 * f64::from(radius)).to_array();
            let (area, volume) = (w * h + h * d + w * d, w * h * d);
            let (all_area, all_volume) = *root.get_or_insert((area, volume));
            let weight = match node.leaf {
                Some(n) => {
                    costs.n_leaves += 1;
                    weights.leaf + weights.point * n as f64
                }
                None => {
                    costs.n_inner += 1;
                    weights.inner
                }
            };
            costs.sah += weight * area / all_area;
            costs.vh += weight * volume / all_volume;
        });
        costs
    }
}

/// Points or boxes under one node of [`PointBvh`].
const WIDTH: usize = super::FANOUT as usize;

impl Hierarchy for PointBvh {
    fn for_each_node(&self, mut visit: impl FnMut(Node)) {
        let boxes = self.boxes();
        let n_leaves = self.len().div_ceil(WIDTH);
        for (at, &(min, max)) in boxes.iter().enumerate().rev() {
            let leaf = (at < n_leaves).then(|| (self.len() - at * WIDTH).min(WIDTH));
            visit(Node { min, max, leaf });
        }
    }
}

/// Counts the visits of a [`PointBvh`], whose own traversal does not.
#[derive(Clone, Debug)]
pub struct CountedPointBvh<'a> {
    tree: &'a PointBvh,
    boxes: Vec<(Vec3, Vec3)>,
    /// First box of each level.
    levels: Vec<usize>,
}

impl<'a> CountedPointBvh<'a> {
    /// Copies the boxes.
    pub fn new(tree: &'a PointBvh) -> Self {
        let boxes = tree.boxes();
        let mut levels = Vec::new();
        let (mut first, mut n) = (0, tree.len());
        while first < boxes.len() {
            n = n.div_ceil(WIDTH);
            levels.push(first);
            first += n;
        }
        Self { tree, boxes, levels }
    }

    /// Of one radius query: boxes are tested eight at a time, one node each, and so are the points of a leaf.
    pub fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        let mut visits = Visits { found: self.tree.count(centre, radius) as u64, ..Visits::default() };
        let mut pending = Vec::new();
        if let Some(top) = self.levels.len().checked_sub(1) {
            pending.push((top, 0, 1));
            visits.nodes += 1;
        }
        while let Some((level, first, n)) = pending.pop() {
            visits.boxes += n as u64;
            let below = if level == 0 { self.tree.len() } else { self.levels[level] - self.levels[level - 1] };
            for child in first..first + n {
                let (min, max) = self.boxes[self.levels[level] + child];
                let outside = (min - centre).max(centre - max).max(Vec3::ZERO);
                if super::distance2(outside, Vec3::ZERO) > super::radius2(radius) {
                    continue;
                }
                visits.nodes += 1;
                let n = (below - child * WIDTH).min(WIDTH);
                if level == 0 {
                    visits.points += n as u64;
                } else {
                    pending.push((level - 1, child * WIDTH, n));
                }
            }
        }
        visits
    }
}
