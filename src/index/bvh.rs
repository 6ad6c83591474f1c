//! An implicit 8-ary tree of tight boxes over points in Morton order.
//!
//! Box k of level 0 holds the sorted points 8k … 8k+7; box k of level l+1 holds the boxes 8k … 8k+7 of level l, up to a
//! level of one box. There are no pointers, the build is a sort and one pass a level, and the GPU builds the same tree.
//! Boxes are not grown by the radius: a query tests its ball against them, so one tree serves every radius, and k-NN can
//! shrink its ball as it goes.

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;
use wide::f32x8;

use super::{Error, FANOUT, LEAF_SIZE, Nearest, RadiusSearch, check_points};
use crate::math::morton;

const WIDTH: usize = FANOUT as usize;
const _: () = assert!(LEAF_SIZE == FANOUT);
/// 8^11 > 2^32.
const MAX_LEVELS: usize = 11;
/// No box is nearer than this to anything: padding of incomplete groups.
const FAR: f32 = f32::INFINITY;

/// Eight boxes, or with min = max eight points, component by component.
#[derive(Clone, Copy, Debug)]
struct Octet {
    min: [f32x8; 3],
    max: [f32x8; 3],
}

/// Eight points, component by component.
#[derive(Clone, Copy, Debug)]
struct Points([f32x8; 3]);

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct PointBvh {
    /// Index of the point in each slot.
    order: Vec<u32>,
    leaves: Vec<Points>,
    /// Boxes of level 0 first; each level padded to whole octets.
    boxes: Vec<Octet>,
    /// First octet of each level.
    levels: Vec<u32>,
    keys: Vec<(u64, u32)>,
}

impl PointBvh {
    /// Over all of `points`.
    pub fn new(points: &[Vec3]) -> Result<Self, Error> {
        check_points(points)?;
        let mut tree = Self::default();
        tree.rebuild(points.len(), |i| points[i]);
        Ok(tree)
    }

    /// Over `n` other points, reusing the memory. They must be finite.
    pub fn rebuild(&mut self, n: usize, point: impl Fn(usize) -> Vec3 + Sync) {
        assert!(n < u32::MAX as usize, "more points than 32 bits count");
        self.sort(n, &point);
        let at = |slot: usize| if slot < n { point(self.order[slot] as usize) } else { Vec3::splat(FAR) };
        let n_leaves = n.div_ceil(WIDTH);
        (0..n_leaves)
            .into_par_iter()
            .with_min_len(1024)
            .map(|leaf| {
                let p: [Vec3; WIDTH] = std::array::from_fn(|i| at(leaf * WIDTH + i));
                Points(std::array::from_fn(|axis| f32x8::from(p.map(|p| p[axis]))))
            })
            .collect_into_vec(&mut self.leaves);
        self.levels.clear();
        self.boxes.clear();
        if n == 0 {
            return;
        }
        let mut bounds: Vec<(Vec3, Vec3)> = self
            .leaves
            .par_iter()
            .with_min_len(1024)
            .enumerate()
            .map(|(leaf, points)| points.bounds((n - leaf * WIDTH).min(WIDTH)))
            .collect();
        loop {
            self.levels.push(self.boxes.len() as u32);
            self.boxes.extend(bounds.chunks(WIDTH).map(Octet::of));
            if bounds.len() == 1 {
                break;
            }
            bounds = bounds.chunks(WIDTH).map(union).collect();
        }
    }

    /// Slots in Morton order; ties in order of the index.
    fn sort(&mut self, n: usize, point: &(impl Fn(usize) -> Vec3 + Sync)) {
        let nothing = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = (0..n)
            .into_par_iter()
            .with_min_len(8192)
            .fold(|| nothing, |(min, max), i| (min.min(point(i)), max.max(point(i))))
            .reduce(|| nothing, |a, b| (a.0.min(b.0), a.1.max(b.1)));
        let scale = (max - min).map(|extent| if extent > 0.0 { morton::CELLS / extent } else { 0.0 });
        (0..n)
            .into_par_iter()
            .with_min_len(8192)
            .map(|i| {
                let cell = ((point(i) - min) * scale).min(Vec3::splat(morton::CELLS - 1.0)).as_uvec3();
                (morton::interleave(cell.to_array()), i as u32)
            })
            .collect_into_vec(&mut self.keys);
        self.keys.par_sort_unstable();
        self.keys.par_iter().with_min_len(8192).map(|k| k.1).collect_into_vec(&mut self.order);
    }

    /// Index of the point in each slot: slots are what [`PointBvh::visit`] reports.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The boxes (least and largest corner) of all levels, level 0 first, without padding: what the GPU builds.
    pub fn boxes(&self) -> Vec<(Vec3, Vec3)> {
        let mut boxes = Vec::new();
        let mut n = self.order.len();
        for &first in &self.levels {
            n = n.div_ceil(WIDTH);
            boxes.extend((0..n).map(|k| {
                let o = &self.boxes[first as usize + k / WIDTH];
                let corner = |c: [f32x8; 3]| Vec3::from_array(c.map(|c| c.to_array()[k % WIDTH]));
                (corner(o.min), corner(o.max))
            }));
        }
        boxes
    }

    /// Calls `visit` with the slot and the squared distance of each point within `radius` of `centre`, in order of the
    /// slots.
    #[inline]
    pub fn visit(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        let _: ControlFlow<()> = self.walk(
            centre,
            &mut squared(radius),
            |r2| *r2,
            |_, slot, d2| {
                visit(slot, d2);
                ControlFlow::Continue(())
            },
        );
    }

    /// Depth first; `bound` of the state may shrink as `visit` changes it.
    #[inline]
    fn walk<S, B>(
        &self,
        centre: Vec3,
        state: &mut S,
        bound: impl Fn(&S) -> f32,
        mut visit: impl FnMut(&mut S, u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let Some(top) = self.levels.len().checked_sub(1) else { return ControlFlow::Continue(()) };
        let c = [f32x8::splat(centre.x), f32x8::splat(centre.y), f32x8::splat(centre.z)];
        // Children of each level that are still to be entered: octet and bits.
        let mut pending = [(0u32, 0u32); MAX_LEVELS];
        let mut level = top;
        pending[top] = (0, self.boxes[self.levels[top] as usize].within(&c, bound(state)));
        loop {
            let (octet, bits) = pending[level];
            if bits == 0 {
                if level == top {
                    return ControlFlow::Continue(());
                }
                level += 1;
                continue;
            }
            let child = octet * FANOUT + bits.trailing_zeros();
            pending[level].1 = bits & (bits - 1);
            if level > 0 {
                level -= 1;
                let octet = &self.boxes[(self.levels[level] + child) as usize];
                pending[level] = (child, octet.within(&c, bound(state)));
                continue;
            }
            let d2 = self.leaves[child as usize].distance2(&c);
            let mut inside = d2.simd_le(f32x8::splat(bound(state))).to_bitmask();
            if inside == 0 {
                continue;
            }
            let d2 = d2.to_array();
            while inside != 0 {
                let i = inside.trailing_zeros();
                inside &= inside - 1;
                visit(state, child * LEAF_SIZE + i, d2[i as usize])?;
            }
        }
    }
}

/// Padding lies at infinity: no bound reaches it.
fn squared(radius: f32) -> f32 {
    (radius * radius).min(f32::MAX)
}

impl RadiusSearch for PointBvh {
    fn len(&self) -> usize {
        self.order.len()
    }

    #[inline]
    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        mut visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.walk(centre, &mut squared(radius), |r2| *r2, |_, slot, d2| visit(self.order[slot as usize], d2))
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        nearest.clear();
        let radius2 = squared(radius);
        let _: ControlFlow<()> = self.walk(
            centre,
            nearest,
            |nearest| nearest.bound().min(radius2),
            |nearest, slot, d2| {
                nearest.insert(self.order[slot as usize], d2);
                ControlFlow::Continue(())
            },
        );
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
            min: std::array::from_fn(|axis| f32x8::from(b.map(|b| b.0[axis]))),
            max: std::array::from_fn(|axis| f32x8::from(b.map(|b| b.1[axis]))),
        }
    }

    /// Bit i: box i comes within √bound of the centre.
    #[inline]
    fn within(&self, c: &[f32x8; 3], bound: f32) -> u32 {
        let outside = |axis: usize| (self.min[axis] - c[axis]).fast_max(c[axis] - self.max[axis]).fast_max(f32x8::ZERO);
        let (x, y, z) = (outside(0), outside(1), outside(2));
        (x * x + y * y + z * z).simd_le(f32x8::splat(bound)).to_bitmask()
    }
}

impl Points {
    #[inline]
    fn distance2(&self, c: &[f32x8; 3]) -> f32x8 {
        let (x, y, z) = (self.0[0] - c[0], self.0[1] - c[1], self.0[2] - c[2]);
        x * x + y * y + z * z
    }

    fn bounds(&self, n: usize) -> (Vec3, Vec3) {
        let [x, y, z] = self.0.map(|c| c.to_array());
        (0..n)
            .map(|i| Vec3::new(x[i], y[i], z[i]))
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |a, p| (a.0.min(p), a.1.max(p)))
    }
}
