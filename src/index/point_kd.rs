//! A balanced kd-tree: median splits of the widest axis, down to leaves of at most sixteen points.
//!
//! A node is a range of blocks of eight sorted points, and its children are the halves of it, so there are no pointers:
//! the split of a range is kept at the block that begins its second half. Both children's faces at the split are kept
//! (as FLANN does), and the square of the distance to a node's cell is taken anew at each node, from the distances along
//! the axes: it rounds as that of the points does, and never exceeds theirs.

use std::ops::{ControlFlow, Range};

use glam::Vec3;

use super::blocks::{self, Blocks, Hits, NOTHING, Walk, bounds, join, splat};
use super::lanes::{Lanes, WIDTH};
use super::median::{Numbered, both, halve};
use super::stats::{CountVisits, Hierarchy, Node, Tally, Visits};
use super::{Error, Nearest, RadiusSearch, check_points};

/// Blocks in the largest leaf.
const LEAF_BLOCKS: usize = 2;
/// Ranges are halved at most this often.
const MAX_DEPTH: usize = 32;

#[derive(Clone, Copy, Debug, Default)]
struct Split {
    /// No point of the first half is beyond.
    first_max: f32,
    /// No point of the second half is before.
    second_min: f32,
    axis: u32,
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct PointKd {
    bounds: (Vec3, Vec3),
    /// At b, the split of the range whose second half begins with block b.
    splits: Vec<Split>,
    blocks: Blocks,
    sorted: Vec<Numbered>,
}

impl PointKd {
    /// Over all of `points`.
    pub fn new(points: &[Vec3]) -> Result<Self, Error> {
        let mut tree = Self::default();
        tree.rebuild(points)?;
        Ok(tree)
    }

    /// Over other points, reusing the memory. After an error the tree is what it was.
    pub fn rebuild(&mut self, points: &[Vec3]) -> Result<(), Error> {
        check_points(points)?;
        self.bounds = bounds(points);
        self.sorted.clear();
        self.sorted.extend(points.iter().zip(0..).map(|(&p, i)| (p, i)));
        self.splits.clear();
        self.splits.resize(points.len().div_ceil(WIDTH), Split::default());
        split(&mut self.sorted, &mut self.splits);
        self.blocks.order.clear();
        self.blocks.order.extend(self.sorted.iter().map(|s| s.1));
        self.blocks.fill(points);
        Ok(())
    }

    fn slots(&self, blocks: &Range<usize>) -> Range<usize> {
        blocks.start * WIDTH..(blocks.end * WIDTH).min(self.len())
    }

    fn for_each_below(&self, blocks: Range<usize>, visit: &mut impl FnMut(Node)) {
        let slots = self.slots(&blocks);
        let n = slots.len();
        let (min, max) = slots.map(|slot| self.blocks.point(slot)).fold(NOTHING, |b, p| join(b, (p, p)));
        let leaf = (blocks.len() <= LEAF_BLOCKS).then_some(n);
        visit(Node { min, max, leaf });
        if leaf.is_none() {
            let middle = blocks.start + blocks.len() / 2;
            self.for_each_below(blocks.start..middle, visit);
            self.for_each_below(middle..blocks.end, visit);
        }
    }
}

#[inline]
fn square([x, y, z]: [f32; 3]) -> f32 {
    x * x + y * y + z * z
}

/// Sorts the points of a range, and fills in its splits.
fn split(points: &mut [Numbered], splits: &mut [Split]) {
    if splits.len() <= LEAF_BLOCKS {
        return;
    }
    let middle = splits.len() / 2;
    let axis = halve(points, middle * WIDTH);
    let (first, second) = points.split_at_mut(middle * WIDTH);
    splits[middle] = Split {
        first_max: first.iter().map(|p| p.0[axis]).fold(f32::NEG_INFINITY, f32::max),
        second_min: second[0].0[axis],
        axis: axis as u32,
    };
    // A range's own split is at its middle: no half of it begins or ends there.
    let (first_splits, second_splits) = splits.split_at_mut(middle);
    both(first.len(), || split(first, first_splits), || split(second, second_splits));
}

impl Walk for PointKd {
    /// The nearer half first; `bound` of the state may shrink as `visit` changes it.
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
        if self.is_empty() {
            return ControlFlow::Continue(());
        }
        let (c, splat) = (centre.to_array(), splat(on, centre));
        let outside = (self.bounds.0 - centre).max(centre - self.bounds.1).max(Vec3::ZERO);
        let mut pending = [(0u32, 0u32, [0.0f32; 3]); MAX_DEPTH];
        pending[0] = (0, self.splits.len() as u32, outside.to_array());
        let mut n_pending = 1;
        while n_pending > 0 {
            n_pending -= 1;
            let (start, end, mut away) = pending[n_pending];
            let (mut start, mut end) = (start as usize, end as usize);
            if square(away) > bound(state) {
                continue;
            }
            tally.node();
            while end - start > LEAF_BLOCKS {
                let middle = start + (end - start) / 2;
                let split = self.splits[middle];
                let axis = split.axis as usize;
                tally.boxes(2);
                let (mut near, mut far) = (away, away);
                let (to_first, to_second) = (c[axis] - split.first_max, split.second_min - c[axis]);
                let first_is_near = to_first <= to_second;
                near[axis] = near[axis].max(to_first.min(to_second));
                far[axis] = far[axis].max(to_first.max(to_second));
                let halves = [(start, middle), (middle, end)];
                if square(far) <= bound(state) {
                    let (start, end) = halves[usize::from(first_is_near)];
                    pending[n_pending] = (start as u32, end as u32, far);
                    n_pending += 1;
                }
                (start, end) = halves[usize::from(!first_is_near)];
                away = near;
                if square(away) > bound(state) {
                    end = start;
                    break;
                }
                tally.node();
            }
            if start < end {
                self.blocks.scan(on, self.slots(&(start..end)), &splat, state, tally, &bound, &mut visit)?;
            }
        }
        ControlFlow::Continue(())
    }
}

impl RadiusSearch for PointKd {
    fn len(&self) -> usize {
        self.blocks.len()
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

impl CountVisits for PointKd {
    fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        blocks::visits(self, centre, radius)
    }
}

impl Hierarchy for PointKd {
    fn for_each_node(&self, mut visit: impl FnMut(Node)) {
        if !self.is_empty() {
            self.for_each_below(0..self.splits.len(), &mut visit);
        }
    }
}
