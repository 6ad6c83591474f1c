//! An implicit 8-ary tree of tight boxes over points in Morton order, or in that of a kd-tree.
//!
//! Box k of level 0 holds the sorted points 8k … 8k+7; box k of level l+1 holds the boxes 8k … 8k+7 of level l, up to a
//! level of one box. There are no pointers, the build is a sort and one pass a level, and the GPU builds the same tree in Morton order.
//! Boxes are not grown by the radius: a query tests its ball against them, so one tree serves every radius, and k-NN can
//! shrink its ball as it goes.

use std::ops::{ControlFlow, Range};

use glam::Vec3;
use rayon::prelude::*;

use super::lanes::{Eight, WIDTH};
use super::median::{self, Numbered};
use super::{Error, FANOUT, LEAF_SIZE, Nearest, NearestLists, Radii, RadiusSearch, check_points, packet, radix, walk};
use crate::math::morton::Grid;

const _: () = assert!(LEAF_SIZE == FANOUT && FANOUT as usize == WIDTH);
/// Bits of a Morton key that are sorted by only where the others agree.
const LOWER: u32 = 31;
/// No box is nearer than this to anything: padding of incomplete groups.
const FAR: f32 = f32::INFINITY;

/// Eight boxes, component by component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Octet {
    pub(super) min: [Eight; 3],
    pub(super) max: [Eight; 3],
}

/// Eight points, component by component.
#[derive(Clone, Copy, Debug)]
pub(super) struct Points(pub(super) [Eight; 3]);

/// The order that points are put into, and with it which of them share a box.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PointOrder {
    /// Along the Morton curve: a radix sort, for points that are soon others. Boxes overlap where the curve jumps.
    #[default]
    Morton,
    /// Halved at the median of the widest axis, and so on: boxes overlap in faces at most. It takes some three times as
    /// long to build, and searches of uniform points half to two thirds as long: for points that are asked much.
    Median,
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct PointBvh {
    point_order: PointOrder,
    /// Number of points.
    n: usize,
    /// Index of the point in each slot, padded to whole leaves.
    pub(super) order: Vec<u32>,
    pub(super) leaves: Vec<Points>,
    /// Boxes of level 0 first; each level padded to whole octets.
    pub(super) boxes: Vec<Octet>,
    /// First octet of each level.
    pub(super) levels: Vec<u32>,
    /// Over all points, of the Morton order.
    grid: Grid,
    /// Upper half of the Morton key of each leaf's first point; none in another order.
    firsts: Vec<u32>,
    /// What is sorted, and room for it.
    words: Vec<u64>,
    other: Vec<u64>,
    numbered: Vec<Numbered>,
    /// Boxes of the level that is built.
    bounds: Vec<(Vec3, Vec3)>,
}

impl PointBvh {
    /// Over all of `points`, in Morton order.
    pub fn new(points: &[Vec3]) -> Result<Self, Error> {
        Self::with_order(points, PointOrder::Morton)
    }

    /// Over all of `points`; [`PointBvh::rebuild`] keeps to that order.
    pub fn with_order(points: &[Vec3], point_order: PointOrder) -> Result<Self, Error> {
        check_points(points)?;
        let mut tree = Self { point_order, ..Self::default() };
        tree.rebuild(points.len(), |i| points[i]);
        Ok(tree)
    }

    /// Over `n` other points, reusing the memory. They must be finite.
    pub fn rebuild(&mut self, n: usize, point: impl Fn(usize) -> Vec3 + Sync) {
        assert!(n < u32::MAX as usize, "more points than 32 bits count");
        self.n = n;
        self.sort(n, &point);
        let at = |slot: usize| if slot < n { point(self.order[slot] as usize) } else { Vec3::splat(FAR) };
        let n_leaves = n.div_ceil(WIDTH);
        (0..n_leaves)
            .into_par_iter()
            .with_min_len(1024)
            .map(|leaf| {
                let p: [Vec3; WIDTH] = std::array::from_fn(|i| at(leaf * WIDTH + i));
                Points(std::array::from_fn(|axis| Eight(p.map(|p| p[axis]))))
            })
            .collect_into_vec(&mut self.leaves);
        self.levels.clear();
        self.boxes.clear();
        if n == 0 {
            return;
        }
        self.leaves
            .par_iter()
            .with_min_len(1024)
            .enumerate()
            .map(|(leaf, points)| points.bounds((n - leaf * WIDTH).min(WIDTH)))
            .collect_into_vec(&mut self.bounds);
        loop {
            self.levels.push(self.boxes.len() as u32);
            self.boxes.extend(self.bounds.chunks(WIDTH).map(Octet::of));
            let above = self.bounds.len().div_ceil(WIDTH);
            if self.bounds.len() == 1 {
                break;
            }
            for k in 0..above {
                self.bounds[k] = union(&self.bounds[k * WIDTH..((k + 1) * WIDTH).min(self.bounds.len())]);
            }
            self.bounds.truncate(above);
        }
    }

    /// Fills in the slots; ties in order of the index.
    fn sort(&mut self, n: usize, point: &(impl Fn(usize) -> Vec3 + Sync)) {
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = (0..n)
            .into_par_iter()
            .with_min_len(8192)
            .fold(|| nothing, |(min, max), i| (min.min(point(i)), max.max(point(i))))
            .reduce(|| nothing, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        self.grid = Grid::new(min, max);
        match self.point_order {
            PointOrder::Morton => self.sort_by_key(n, point),
            PointOrder::Median => {
                let numbered = |i: usize| (point(i), i as u32);
                (0..n).into_par_iter().with_min_len(8192).map(numbered).collect_into_vec(&mut self.numbered);
                median::sort(&mut self.numbered);
                self.numbered.par_iter().with_min_len(8192).map(|p| p.1).collect_into_vec(&mut self.order);
            }
        }
        self.order.resize(n.next_multiple_of(WIDTH), u32::MAX);
    }

    fn sort_by_key(&mut self, n: usize, point: &(impl Fn(usize) -> Vec3 + Sync)) {
        let grid = self.grid;
        let key = |i: usize| grid.key(point(i));
        // The upper half of each key before the index; the few that agree in it are sorted by the whole key.
        let word = |i: usize| key(i) >> LOWER << 32 | i as u64;
        (0..n).into_par_iter().with_min_len(8192).map(word).collect_into_vec(&mut self.words);
        self.other.resize(n, 0);
        radix::sort(&mut self.words, &mut self.other, 32, 63 - LOWER);
        let whole = |&word: &u64| key(word as u32 as usize);
        for run in self.words.chunk_by_mut(|a, b| a >> 32 == b >> 32) {
            if run.len() < 20 { run.sort_by_key(whole) } else { run.sort_by_cached_key(whole) }
        }
        self.words.par_iter().with_min_len(8192).map(|&word| word as u32).collect_into_vec(&mut self.order);
        let firsts = self.words.par_iter().step_by(WIDTH).with_min_len(8192);
        firsts.map(|&word| (word >> 32) as u32).collect_into_vec(&mut self.firsts);
    }

    /// Leaves about the place that a point would have in Morton order: one, and more where `k` needs them; none in an
    /// order whose boxes do not overlap, where the nearest of them is the best start.
    #[inline]
    pub(super) fn leaves_about(&self, p: Vec3, k: usize) -> Range<u32> {
        if self.firsts.is_empty() {
            return 0..0;
        }
        let key = (self.grid.key(p) >> LOWER) as u32;
        let place = self.firsts.partition_point(|&first| first <= key).saturating_sub(1);
        let more = k / WIDTH;
        place.saturating_sub(more) as u32..(place + more + 1).min(self.leaves.len()) as u32
    }

    /// About how far points are apart if they fill the cube around them.
    pub(super) fn spacing(&self) -> f32 {
        self.grid.longest_side() / (self.n as f32).cbrt()
    }

    /// Index of the point in each slot: slots are what [`PointBvh::visit`] reports.
    pub fn order(&self) -> &[u32] {
        &self.order[..self.n]
    }

    /// The boxes (least and largest corner) of all levels, level 0 first, without padding: what the GPU builds from points
    /// in Morton order.
    pub fn boxes(&self) -> Vec<(Vec3, Vec3)> {
        let mut boxes = Vec::new();
        let mut n = self.n;
        for &first in &self.levels {
            n = n.div_ceil(WIDTH);
            boxes.extend((0..n).map(|k| {
                let o = &self.boxes[first as usize + k / WIDTH];
                let corner = |c: [Eight; 3]| Vec3::from_array(c.map(|c| c.0[k % WIDTH]));
                (corner(o.min), corner(o.max))
            }));
        }
        boxes
    }

    /// Calls `visit` with the slot and the squared distance of each point within `radius` of `centre`, in order of the
    /// slots.
    #[inline]
    pub fn visit(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let _: ControlFlow<()> = walk::ball(self, centre, radius, true, |slot, d2| {
            visit(slot, d2);
            ControlFlow::Continue(())
        });
    }

    /// For each i below `n` the points around `query(i)`, a centre and a radius, in order of the slots:
    /// `visit(i, slots, squared distances)`, as often as needed. It pays when successive queries are close to each other.
    #[inline]
    pub fn visit_packets(
        &self,
        n: usize,
        query: impl Fn(usize) -> (Vec3, f32),
        visit: impl FnMut(usize, &[u32], &[f32]),
    ) {
        packet::visit(self, n, true, query, visit);
    }
}

impl RadiusSearch for PointBvh {
    fn len(&self) -> usize {
        self.n
    }

    #[inline]
    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        walk::ball(self, centre, radius, false, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        walk::nearest(self, 1, |_| (centre, radius), nearest, |_, _| ());
    }

    fn fold_all<T: Send>(
        &self,
        queries: &[Vec3],
        radii: Radii<'_>,
        start: impl Fn(usize) -> T + Sync,
        visit: impl Fn(&mut T, u32, f32) + Sync,
    ) -> Result<Vec<T>, Error> {
        packet::fold_all(self, queries, radii, start, visit)
    }

    fn nearest_all(&self, queries: &[Vec3], radii: Radii<'_>, k: usize) -> Result<NearestLists, Error> {
        packet::nearest_all(self, queries, radii, k)
    }
}

fn union(boxes: &[(Vec3, Vec3)]) -> (Vec3, Vec3) {
    boxes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
}

impl Octet {
    fn of(boxes: &[(Vec3, Vec3)]) -> Self {
        let at = |i: usize| boxes.get(i).copied().unwrap_or((Vec3::splat(FAR), Vec3::splat(FAR)));
        let b: [(Vec3, Vec3); WIDTH] = std::array::from_fn(at);
        Self {
            min: std::array::from_fn(|axis| Eight(b.map(|b| b.0[axis]))),
            max: std::array::from_fn(|axis| Eight(b.map(|b| b.1[axis]))),
        }
    }
}

impl Points {
    fn bounds(&self, n: usize) -> (Vec3, Vec3) {
        let [x, y, z] = self.0.map(|c| c.0);
        (0..n)
            .map(|i| Vec3::new(x[i], y[i], z[i]))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |a, p| (a.0.min(p), a.1.max(p)))
    }
}
