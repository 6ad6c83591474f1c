//! The paper's method in its own form: a binary tree over the samples' boxes.
//!
//! Each sample is a box as wide as the largest query radius, and a query is the boxes that hold its point, the samples
//! of which are then tested (Evangelou et al. 2021, Algorithm 1, with the point-in-box test for the infinitesimal ray).
//! The same tree over tight boxes, into which the query takes its ball instead, is there to compare.

use std::ops::ControlFlow;

use glam::Vec3;

use super::blocks::{self, Blocks, Hits, NOTHING, Splat, Walk, around, join, reach, splat};
use super::lanes::{Lanes, Portable};
use super::sample_build::Topology;
use super::stats::{self, CountVisits, Hierarchy, Tally, Visits};
use super::{Error, Nearest, RadiusSearch, check_points, check_radius, distance2, radius2};

/// How the tree is built.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Builder {
    /// Karras 2012, over 63-bit Morton keys.
    Lbvh,
    /// Meister and Bittner 2018.
    Ploc {
        /// Clusters to either side, in Morton order, among which the nearest is sought; at least 1.
        reach: usize,
    },
}

/// What the boxes hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Boxes {
    /// The points; queries take their ball into the tree, of any radius.
    Tight,
    /// The balls about them, of the largest radius that may be asked for.
    Inflated(f32),
}

/// Of a [`SampleBvh`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleOptions {
    /// How the tree is built.
    pub builder: Builder,
    /// What its boxes hold.
    pub boxes: Boxes,
    /// Subtrees of at most this many points are leaves; at least 1, as in the paper.
    pub leaf_size: usize,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    min: Vec3,
    /// Inner: the node that follows those below. Leaf: its first slot.
    link: u32,
    max: Vec3,
    /// Points of a leaf, 0 for inner nodes, whose children are the next node and the one it links to.
    n: u32,
}

/// See the module.
#[derive(Clone, Debug)]
pub struct SampleBvh {
    options: SampleOptions,
    /// Depth first.
    nodes: Vec<Node>,
    blocks: Blocks,
    depth: usize,
    topology: Topology,
}

/// Trees up to this depth are searched nearest first.
const STACK: usize = 128;

impl SampleBvh {
    /// Over all of `points`.
    pub fn new(points: &[Vec3], options: SampleOptions) -> Result<Self, Error> {
        let mut tree =
            Self { options, nodes: Vec::new(), blocks: Blocks::default(), depth: 0, topology: Topology::default() };
        tree.rebuild(points, options)?;
        Ok(tree)
    }

    /// Over other points, or with other options, reusing the memory. After an error the tree is what it was.
    pub fn rebuild(&mut self, points: &[Vec3], options: SampleOptions) -> Result<(), Error> {
        check_points(points)?;
        let grow = match options.boxes {
            Boxes::Tight => None,
            Boxes::Inflated(radius) => {
                check_radius(radius)?;
                Some(reach(radius2(radius)))
            }
        };
        self.options = options;
        self.build(points, |i| match grow {
            Some(reach) => around(points[i], reach),
            None => (points[i], points[i]),
        });
        Ok(())
    }

    /// Over boxes with a point each.
    pub(super) fn over(points: &[Vec3], options: SampleOptions, aabb: impl Fn(usize) -> (Vec3, Vec3) + Sync) -> Self {
        let mut tree =
            Self { options, nodes: Vec::new(), blocks: Blocks::default(), depth: 0, topology: Topology::default() };
        tree.build(points, aabb);
        tree
    }

    fn build(&mut self, points: &[Vec3], aabb: impl Fn(usize) -> (Vec3, Vec3) + Sync) {
        self.nodes.clear();
        self.blocks.order.clear();
        self.depth = 0;
        if points.is_empty() {
            self.blocks.fill(points);
            return;
        }
        let finite = |i: usize| {
            let (min, max) = aabb(i);
            (min.max(Vec3::MIN), max.min(Vec3::MAX))
        };
        match self.options.builder {
            Builder::Lbvh => self.topology.lbvh(points.len(), finite),
            Builder::Ploc { reach } => self.topology.ploc(points.len(), reach, finite),
        }
        self.lay_out(points.len());
        self.blocks.fill(points);
        // Children come after their parents.
        for at in (0..self.nodes.len()).rev() {
            let Node { link, n, .. } = self.nodes[at];
            let bounds = if n == 0 {
                let second = self.second(at);
                join(self.bounds(at + 1), self.bounds(second))
            } else {
                let slots = link as usize..(link + n) as usize;
                self.blocks.order[slots].iter().fold(NOTHING, |b, &i| join(b, aabb(i as usize)))
            };
            (self.nodes[at].min, self.nodes[at].max) = bounds;
        }
    }

    /// Nodes depth first, points in the order of the leaves.
    fn lay_out(&mut self, n: usize) {
        enum Step {
            Enter(u32, usize),
            Leave(usize),
        }
        let leaf_size = self.options.leaf_size.max(1);
        let topology = &self.topology;
        let mut steps = vec![Step::Enter(topology.root, 1)];
        let mut below = Vec::new();
        while let Some(step) = steps.pop() {
            match step {
                Step::Leave(node) => self.nodes[node].link = self.nodes.len() as u32,
                Step::Enter(id, depth) => {
                    self.depth = self.depth.max(depth);
                    let pair = (id as usize).checked_sub(n).map(|node| topology.pairs[node]);
                    let (at, link) = (self.nodes.len(), self.blocks.order.len() as u32);
                    match pair.filter(|pair| pair.n as usize > leaf_size) {
                        Some(pair) => {
                            self.nodes.push(Node { min: Vec3::ZERO, link: 0, max: Vec3::ZERO, n: 0 });
                            steps.push(Step::Leave(at));
                            steps.push(Step::Enter(pair.right, depth + 1));
                            steps.push(Step::Enter(pair.left, depth + 1));
                        }
                        None => {
                            let n_points = pair.map_or(1, |pair| pair.n);
                            self.nodes.push(Node { min: Vec3::ZERO, link, max: Vec3::ZERO, n: n_points });
                            below.push(id);
                            while let Some(id) = below.pop() {
                                match (id as usize).checked_sub(n) {
                                    None => self.blocks.order.push(topology.keys[id as usize].1),
                                    Some(node) => {
                                        let pair = topology.pairs[node];
                                        below.extend([pair.right, pair.left]);
                                    }
                                }
                            }
                        }
                    }
                }
            }
        }
    }

    fn bounds(&self, node: usize) -> (Vec3, Vec3) {
        (self.nodes[node].min, self.nodes[node].max)
    }

    /// The node after all that are below one.
    #[inline]
    fn after(&self, node: usize) -> usize {
        let Node { link, n, .. } = self.nodes[node];
        if n == 0 { link as usize } else { node + 1 }
    }

    /// Second child of an inner node.
    #[inline]
    fn second(&self, node: usize) -> usize {
        self.after(node + 1)
    }

    /// Nearest boxes first. Tight boxes only.
    #[inline(always)]
    fn nearest_first<L: Lanes>(&self, on: L, centre: Vec3, radius2: f32, nearest: &mut Nearest) {
        let splat = splat(on, centre);
        let bound = |nearest: &&mut Nearest| nearest.bound().min(radius2);
        let mut state = nearest;
        let mut pending = [(0u32, 0.0f32); STACK];
        let Some(root) = self.nodes.first() else { return };
        pending[0] = (0, root.distance2(centre));
        let mut n_pending = 1;
        while n_pending > 0 {
            n_pending -= 1;
            let (mut at, d2) = (pending[n_pending].0 as usize, pending[n_pending].1);
            if d2 > bound(&state) {
                continue;
            }
            while self.nodes[at].n == 0 {
                let (mut near, mut far) = (at + 1, self.second(at));
                let (mut near2, mut far2) = (self.nodes[near].distance2(centre), self.nodes[far].distance2(centre));
                if far2 < near2 {
                    (near, near2, far, far2) = (far, far2, near, near2);
                }
                if far2 <= bound(&state) {
                    pending[n_pending] = (far as u32, far2);
                    n_pending += 1;
                }
                at = near;
                if near2 > bound(&state) {
                    break;
                }
            }
            let node = &self.nodes[at];
            if node.n > 0 {
                let _: ControlFlow<()> =
                    self.leaf(on, node, &splat, &mut state, &mut (), &bound, &mut |nearest, hits| {
                        hits.for_each(on, |i, d2| nearest.insert(i, d2));
                        ControlFlow::Continue(())
                    });
            }
        }
    }

    #[inline(always)]
    fn leaf<L: Lanes, S, B>(
        &self,
        on: L,
        node: &Node,
        centre: &Splat<L>,
        state: &mut S,
        tally: &mut impl Tally,
        bound: &impl Fn(&S) -> f32,
        visit: &mut impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let slots = node.link as usize..(node.link + node.n) as usize;
        self.blocks.scan(on, slots, centre, state, tally, bound, visit)
    }

    /// Calls `visit` with the index of each point whose box holds `centre`, and perhaps of some whose box does not.
    #[inline]
    pub(super) fn holding(&self, centre: Vec3, mut visit: impl FnMut(u32)) {
        let bound = |_: &()| f32::INFINITY;
        let _: ControlFlow<()> = self.walk(Portable, centre, f32::INFINITY, &mut (), &mut (), bound, |(), hits| {
            hits.for_each(Portable, |i, _| visit(i));
            ControlFlow::Continue(())
        });
    }
}

impl Node {
    #[inline]
    fn holds(&self, p: Vec3) -> bool {
        p.x >= self.min.x
            && p.x <= self.max.x
            && p.y >= self.min.y
            && p.y <= self.max.y
            && p.z >= self.min.z
            && p.z <= self.max.z
    }

    #[inline]
    fn distance2(&self, p: Vec3) -> f32 {
        distance2((self.min - p).max(p - self.max).max(Vec3::ZERO), Vec3::ZERO)
    }
}

impl Walk for SampleBvh {
    /// Nodes in order, those below a box that fails skipped.
    #[inline(always)]
    fn walk<L: Lanes, S, B>(
        &self,
        on: L,
        centre: Vec3,
        _radius: f32,
        state: &mut S,
        tally: &mut impl Tally,
        bound: impl Fn(&S) -> f32,
        mut visit: impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let inflated = matches!(self.options.boxes, Boxes::Inflated(_));
        let splat = splat(on, centre);
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            tally.boxes(1);
            let is_in = if inflated { node.holds(centre) } else { node.distance2(centre) <= bound(state) };
            if !is_in {
                at = if node.n == 0 { node.link as usize } else { at + 1 };
                continue;
            }
            tally.node();
            if node.n > 0 {
                self.leaf(on, node, &splat, state, tally, &bound, &mut visit)?;
            }
            at += 1;
        }
        ControlFlow::Continue(())
    }

    /// With inflated boxes the search cannot shrink, as the paper says: all that hold the centre are visited.
    #[inline(always)]
    fn walk_nearest<L: Lanes>(&self, on: L, centre: Vec3, radius: f32, mut nearest: &mut Nearest) {
        let radius2 = radius2(radius);
        if self.options.boxes == Boxes::Tight && self.depth < STACK {
            self.nearest_first(on, centre, radius2, nearest);
            return;
        }
        let bound = |nearest: &&mut Nearest| nearest.bound().min(radius2);
        let _: ControlFlow<()> = self.walk(on, centre, radius, &mut nearest, &mut (), bound, |nearest, hits| {
            hits.for_each(on, |i, d2| nearest.insert(i, d2));
            ControlFlow::Continue(())
        });
    }
}

impl RadiusSearch for SampleBvh {
    fn len(&self) -> usize {
        self.blocks.len()
    }

    fn max_radius(&self) -> f32 {
        match self.options.boxes {
            Boxes::Tight => f32::INFINITY,
            Boxes::Inflated(radius) => radius,
        }
    }

    #[inline]
    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        blocks::within(self, centre, radius, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        blocks::nearest(self, centre, radius, nearest);
    }
}

impl CountVisits for SampleBvh {
    fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        blocks::visits(self, centre, radius)
    }
}

impl Hierarchy for SampleBvh {
    fn for_each_node(&self, mut visit: impl FnMut(stats::Node)) {
        for node in &self.nodes {
            let leaf = (node.n > 0).then_some(node.n as usize);
            visit(stats::Node { min: node.min, max: node.max, leaf });
        }
    }
}
