//! Points in blocks of eight, component by component: what the leaves of the indices are made of.

use std::ops::{ControlFlow, Range};

use glam::Vec3;
use rayon::prelude::*;
use wide::f32x8;

use super::stats::Tally;

/// Points in a block.
pub(super) const WIDTH: usize = 8;

/// A coordinate of the query in all lanes, for each axis.
pub(super) type Splat = [f32x8; 3];

#[inline]
pub(super) fn splat(centre: Vec3) -> Splat {
    [f32x8::splat(centre.x), f32x8::splat(centre.y), f32x8::splat(centre.z)]
}

/// The points in an order of the index's choice; a slot is a place in it.
#[derive(Clone, Debug, Default)]
pub(super) struct Blocks {
    /// Index of the point in each slot.
    pub order: Vec<u32>,
    points: Vec<[f32x8; 3]>,
}

impl Blocks {
    /// Takes the points in the order that `order` has been set to.
    pub fn fill(&mut self, points: &[Vec3]) {
        let order = &self.order;
        let block = |slots: &[u32]| {
            let p: [Vec3; WIDTH] = std::array::from_fn(|i| slots.get(i).map_or(Vec3::ZERO, |&s| points[s as usize]));
            std::array::from_fn(|axis| f32x8::from(p.map(|p| p[axis])))
        };
        order.par_chunks(WIDTH).with_min_len(1024).map(block).collect_into_vec(&mut self.points);
    }

    pub fn point(&self, slot: usize) -> Vec3 {
        Vec3::from_array(self.points[slot / WIDTH].map(|c| c.to_array()[slot % WIDTH]))
    }

    /// Visits the points of `slots` whose squared distance is at most `bound` of the state, which `visit` may change.
    #[inline]
    pub fn scan<S, B>(
        &self,
        slots: Range<usize>,
        centre: &Splat,
        state: &mut S,
        tally: &mut impl Tally,
        bound: &impl Fn(&S) -> f32,
        visit: &mut impl FnMut(&mut S, u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if slots.is_empty() {
            return ControlFlow::Continue(());
        }
        tally.points(slots.len());
        let (first, last) = (slots.start / WIDTH, (slots.end - 1) / WIDTH);
        for (at, [x, y, z]) in self.points[first..=last].iter().enumerate() {
            let (x, y, z) = (*x - centre[0], *y - centre[1], *z - centre[2]);
            let d2 = x * x + y * y + z * z;
            let mut inside = d2.simd_le(f32x8::splat(bound(state))).to_bitmask();
            if at == 0 {
                inside &= 0xff << (slots.start % WIDTH);
            }
            if first + at == last {
                inside &= 0xff >> (WIDTH - 1 - (slots.end - 1) % WIDTH);
            }
            if inside == 0 {
                continue;
            }
            let d2 = d2.to_array();
            while inside != 0 {
                let lane = inside.trailing_zeros() as usize;
                inside &= inside - 1;
                visit(state, self.order[(first + at) * WIDTH + lane], d2[lane])?;
            }
        }
        ControlFlow::Continue(())
    }
}

/// No coordinate of a point within a radius of this square is further from the query's, roundings included: that of the
/// square of their difference, which may vanish, and that of the difference.
#[inline]
pub(super) fn reach(radius2: f32) -> f32 {
    radius2.next_up().sqrt().next_up()
}

/// Least and largest corner of a box outside of which no point is within the reach of `centre`. (Rounding is monotonic,
/// and coordinates are numbers already rounded: none comes to lie outside.)
#[inline]
pub(super) fn around(centre: Vec3, reach: f32) -> (Vec3, Vec3) {
    (centre - reach, centre + reach)
}

/// The box that is neutral in a union.
pub(super) const NOTHING: (Vec3, Vec3) = (Vec3::INFINITY, Vec3::NEG_INFINITY);

#[inline]
pub(super) fn join(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The box of all points.
pub(super) fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    let fold = |b, &p: &Vec3| join(b, (p, p));
    points.par_iter().with_min_len(8192).fold(|| NOTHING, fold).reduce(|| NOTHING, join)
}
