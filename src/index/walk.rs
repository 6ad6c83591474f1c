//! The walk through the tree of [`PointBvh`], and the searches that take one query at a time.

use std::ops::ControlFlow;

use glam::Vec3;

use super::bvh::{Octet, PointBvh, Points};
use super::lanes::{Lanes, Task, WIDTH, dispatch};
use super::{FANOUT, LEAF_SIZE, Nearest, radius2};

/// 8^11 > 2^32.
const MAX_LEVELS: usize = 11;
/// Points found before they are handed out: a few leaves, so that the handing out is one loop.
const BATCH: usize = 64;

/// All points within √bound of a box: a ball where the box is a point.
#[derive(Clone, Copy)]
pub struct Reach<L: Lanes> {
    pub min: [L::F32; 3],
    pub max: [L::F32; 3],
    pub bound: L::F32,
}

impl<L: Lanes> Reach<L> {
    #[inline(always)]
    pub fn new(on: L, min: Vec3, max: Vec3, bound: f32) -> Self {
        let splat = |v: Vec3| [on.splat(v.x), on.splat(v.y), on.splat(v.z)];
        Self { min: splat(min), max: splat(max), bound: on.splat(bound) }
    }

    /// Squared distances of eight boxes. Rounding is monotonic: none is above that of a point in the box.
    #[inline(always)]
    fn distance2(&self, on: L, boxes: &Octet) -> L::F32 {
        let zero = on.splat(0.0);
        on.length2(std::array::from_fn(|axis| {
            let below = on.sub(on.load(&boxes.min[axis].0), self.max[axis]);
            let above = on.sub(self.min[axis], on.load(&boxes.max[axis].0));
            on.max(on.max(below, above), zero)
        }))
    }

    /// Bit i: box i is reached.
    #[inline(always)]
    fn boxes(&self, on: L, boxes: &Octet) -> u8 {
        on.le(self.distance2(on, boxes), self.bound)
    }

    /// An octet with those of its boxes that come within √bound, and the squared distances of all.
    #[inline(always)]
    fn enter(&self, on: L, tree: &PointBvh, level: usize, octet: u32, bound: f32) -> Pending {
        let d2 = self.distance2(on, &tree.boxes[(tree.levels[level] + octet) as usize]);
        (octet, on.le(d2, on.splat(bound)), on.store(d2))
    }

    /// Bit i: point i is reached.
    #[inline(always)]
    pub fn points(&self, on: L, points: &Points) -> u8 {
        let zero = on.splat(0.0);
        let d2 = on.length2(std::array::from_fn(|axis| {
            let p = on.load(&points.0[axis].0);
            on.max(on.max(on.sub(p, self.max[axis]), on.sub(self.min[axis], p)), zero)
        }));
        on.le(d2, self.bound)
    }
}

/// Depth first, in order of the slots.
pub struct Walk {
    /// Children of each level that are still to be entered: octet and bits.
    pending: [(u32, u32); MAX_LEVELS],
    level: usize,
}

impl Walk {
    #[inline(always)]
    pub fn new<L: Lanes>(on: L, tree: &PointBvh, reach: &Reach<L>) -> Self {
        let mut pending = [(0, 0); MAX_LEVELS];
        let level = tree.levels.len().saturating_sub(1);
        if let Some(&root) = tree.levels.last() {
            pending[level].1 = u32::from(reach.boxes(on, &tree.boxes[root as usize]));
        }
        Self { pending, level }
    }

    /// The next leaf that is reached.
    #[inline(always)]
    pub fn next<L: Lanes>(&mut self, on: L, tree: &PointBvh, reach: &Reach<L>) -> Option<u32> {
        loop {
            let (octet, bits) = self.pending[self.level];
            if bits == 0 {
                self.level += 1;
                if self.level >= tree.levels.len() {
                    self.level -= 1;
                    return None;
                }
                continue;
            }
            let child = octet * FANOUT + bits.trailing_zeros();
            self.pending[self.level].1 = bits & (bits - 1);
            if self.level == 0 {
                return Some(child);
            }
            self.level -= 1;
            let boxes = &tree.boxes[(tree.levels[self.level] + child) as usize];
            self.pending[self.level] = (child, u32::from(reach.boxes(on, boxes)));
        }
    }
}

struct Ball<'a, V> {
    tree: &'a PointBvh,
    centre: Vec3,
    radius: f32,
    slots: bool,
    visit: V,
}

/// Calls `visit` with the slot, or the index, and the squared distance of each point in the ball, in order of the slots.
#[inline]
pub fn ball<B>(
    tree: &PointBvh,
    centre: Vec3,
    radius: f32,
    slots: bool,
    visit: impl FnMut(u32, f32) -> ControlFlow<B>,
) -> ControlFlow<B> {
    dispatch(Ball { tree, centre, radius, slots, visit })
}

impl<B, V: FnMut(u32, f32) -> ControlFlow<B>> Task for Ball<'_, V> {
    type Output = ControlFlow<B>;

    #[inline(always)]
    fn run<L: Lanes>(mut self, on: L) -> ControlFlow<B> {
        let reach = Reach::new(on, self.centre, self.centre, radius2(self.radius));
        let mut walk = Walk::new(on, self.tree, &reach);
        let (mut ids, mut distances2) = ([0; BATCH + WIDTH], [0.0; BATCH + WIDTH]);
        loop {
            let (mut n, mut done) = (0, true);
            while let Some(leaf) = walk.next(on, self.tree, &reach) {
                let d2 = distance2(on, &self.tree.leaves[leaf as usize].0.each_ref().map(|c| &c.0), &reach.min);
                let bits = on.le(d2, reach.bound);
                ids[n..n + WIDTH].copy_from_slice(&on.compress_u32(bits, &leaf_ids(self.tree, leaf, self.slots)));
                distances2[n..n + WIDTH].copy_from_slice(&on.compress(bits, d2));
                n += bits.count_ones() as usize;
                if n > BATCH - WIDTH {
                    done = false;
                    break;
                }
            }
            for (&id, &d2) in ids[..n].iter().zip(&distances2[..n]) {
                (self.visit)(id, d2)?;
            }
            if done {
                return ControlFlow::Continue(());
            }
        }
    }
}

/// The squared distances of eight points from a centre.
#[inline(always)]
pub fn distance2<L: Lanes>(on: L, points: &[&[f32; WIDTH]; 3], centre: &[L::F32; 3]) -> L::F32 {
    on.length2(std::array::from_fn(|axis| on.sub(on.load(points[axis]), centre[axis])))
}

/// What stands for the points of a leaf: slots, or indices.
#[inline(always)]
pub fn leaf_ids(tree: &PointBvh, leaf: u32, slots: bool) -> [u32; WIDTH] {
    if slots {
        std::array::from_fn(|i| leaf * LEAF_SIZE + i as u32)
    } else {
        tree.order.as_chunks::<WIDTH>().0[leaf as usize]
    }
}

struct NearestOf<'a, Q, R> {
    tree: &'a PointBvh,
    n: usize,
    query: Q,
    nearest: &'a mut Nearest,
    report: R,
}

/// Truncated k-NN of `query(i)`, a centre and a radius, for each i below `n`: `report(i, what was found)`.
#[inline]
pub fn nearest(
    tree: &PointBvh,
    n: usize,
    query: impl Fn(usize) -> (Vec3, f32),
    nearest: &mut Nearest,
    report: impl FnMut(usize, &Nearest),
) {
    dispatch(NearestOf { tree, n, query, nearest, report });
}

impl<Q: Fn(usize) -> (Vec3, f32), R: FnMut(usize, &Nearest)> Task for NearestOf<'_, Q, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, on: L) {
        let mut pending = [(0, 0, [0.0; WIDTH]); MAX_LEVELS];
        for i in 0..self.n {
            let (centre, radius) = (self.query)(i);
            self.nearest.clear();
            nearest_one(on, self.tree, centre, radius, self.nearest, &mut pending);
            (self.report)(i, self.nearest);
        }
    }
}

/// Of a level: octet, children still to be entered, and the squared distances of all.
type Pending = (u32, u8, [f32; WIDTH]);

/// First the leaves about the centre's place in Morton order, for a bound: of several boxes that hold the centre, the
/// nearest may well have no point near it. Then nearer children first; each is entered only if its box is still near
/// enough when its turn comes.
#[inline(always)]
fn nearest_one<L: Lanes>(
    on: L,
    tree: &PointBvh,
    centre: Vec3,
    radius: f32,
    nearest: &mut Nearest,
    pending: &mut [Pending; MAX_LEVELS],
) {
    let Some(top) = tree.levels.len().checked_sub(1) else { return };
    let radius2 = radius2(radius);
    let reach = Reach::new(on, centre, centre, radius2);
    let mut bound = radius2;
    let seeds = tree.leaves_about(centre, nearest.k());
    for leaf in seeds.clone() {
        bound = nearest_in_leaf(on, tree, leaf, &reach, bound, nearest).min(radius2);
    }
    let mut level = top;
    pending[top] = reach.enter(on, tree, top, 0, bound);
    loop {
        let (octet, bits, d2) = &mut pending[level];
        let (least, child) = if *bits == 0 { (f32::INFINITY, 0) } else { on.least(*bits, on.load(d2)) };
        if least > bound {
            if level == top {
                return;
            }
            level += 1;
            continue;
        }
        *bits &= !(1 << child);
        let child = *octet * FANOUT + child;
        if level > 0 {
            level -= 1;
            pending[level] = reach.enter(on, tree, level, child, bound);
            continue;
        }
        if !seeds.contains(&child) {
            bound = nearest_in_leaf(on, tree, child, &reach, bound, nearest).min(radius2);
        }
    }
}

/// Takes the points of a leaf that are within √bound; the new bound.
#[inline(always)]
fn nearest_in_leaf<L: Lanes>(
    on: L,
    tree: &PointBvh,
    leaf: u32,
    reach: &Reach<L>,
    bound: f32,
    nearest: &mut Nearest,
) -> f32 {
    let d2 = distance2(on, &tree.leaves[leaf as usize].0.each_ref().map(|c| &c.0), &reach.min);
    let mut inside = on.le(d2, on.splat(bound));
    let d2 = on.store(d2);
    while inside != 0 {
        let i = inside.trailing_zeros();
        inside &= inside - 1;
        nearest.insert(tree.order[(leaf * LEAF_SIZE + i) as usize], d2[i as usize]);
    }
    nearest.bound()
}
