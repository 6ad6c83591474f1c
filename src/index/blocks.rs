//! Points in blocks of eight, component by component: what the leaves of the indices are made of, and how they are read.

use std::ops::{ControlFlow, Range};

use glam::Vec3;
use rayon::prelude::*;

use super::lanes::{Eight, Lanes, Portable, Task, WIDTH, dispatch};
use super::stats::{Tally, Visits};
use super::{Nearest, radius2};

/// A coordinate of the query in all lanes, for each axis.
pub type Splat<L> = [<L as Lanes>::F32; 3];

#[inline(always)]
pub fn splat<L: Lanes>(on: L, centre: Vec3) -> Splat<L> {
    [on.splat(centre.x), on.splat(centre.y), on.splat(centre.z)]
}

/// The points in an order of the index's choice; a slot is a place in it.
#[derive(Clone, Debug, Default)]
pub struct Blocks {
    /// Index of the point in each slot; once filled, padded to whole blocks.
    pub order: Vec<u32>,
    n: usize,
    points: Vec<[Eight; 3]>,
}

/// Points of a block that were found.
pub struct Hits<'a, L: Lanes> {
    /// Bit i: point i is within the bound.
    bits: u8,
    distances2: L::F32,
    indices: &'a [u32; WIDTH],
}

impl<L: Lanes> Hits<'_, L> {
    #[inline(always)]
    pub fn for_each(self, on: L, mut visit: impl FnMut(u32, f32)) {
        let distances2 = on.store(self.distances2);
        let mut bits = self.bits;
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            visit(self.indices[lane], distances2[lane]);
        }
    }
}

impl Blocks {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.n
    }

    /// Takes the points in the order that `order` has been set to.
    pub fn fill(&mut self, points: &[Vec3]) {
        self.n = self.order.len();
        let block = |slots: &[u32]| {
            let p: [Vec3; WIDTH] = std::array::from_fn(|i| slots.get(i).map_or(Vec3::ZERO, |&s| points[s as usize]));
            std::array::from_fn(|axis| Eight(p.map(|p| p[axis])))
        };
        self.order.par_chunks(WIDTH).with_min_len(1024).map(block).collect_into_vec(&mut self.points);
        self.order.resize(self.n.next_multiple_of(WIDTH), u32::MAX);
    }

    pub fn point(&self, slot: usize) -> Vec3 {
        Vec3::from_array(self.points[slot / WIDTH].map(|c| c.0[slot % WIDTH]))
    }

    /// Visits the points of `slots` whose squared distance is at most `bound` of the state, which `visit` may change.
    #[inline(always)]
    pub fn scan<L: Lanes, S, B>(
        &self,
        on: L,
        slots: Range<usize>,
        centre: &Splat<L>,
        state: &mut S,
        tally: &mut impl Tally,
        bound: &impl Fn(&S) -> f32,
        visit: &mut impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if slots.is_empty() {
            return ControlFlow::Continue(());
        }
        tally.points(slots.len());
        let (first, last) = (slots.start / WIDTH, (slots.end - 1) / WIDTH);
        let indices = &self.order.as_chunks::<WIDTH>().0[first..=last];
        for (at, (points, indices)) in self.points[first..=last].iter().zip(indices).enumerate() {
            let away = std::array::from_fn(|axis| on.sub(on.load(&points[axis].0), centre[axis]));
            let distances2 = on.length2(away);
            let mut bits = on.le(distances2, on.splat(bound(state)));
            if at == 0 {
                bits &= 0xff << (slots.start % WIDTH);
            }
            if first + at == last {
                bits &= 0xff >> (WIDTH - 1 - (slots.end - 1) % WIDTH);
            }
            visit(state, Hits { bits, distances2, indices })?;
        }
        ControlFlow::Continue(())
    }
}

/// An index over blocks.
pub trait Walk {
    /// Visits all points whose squared distance is at most `bound` of the state, which may shrink from the radius's square
    /// on as `visit` changes it.
    fn walk<L: Lanes, S, B>(
        &self,
        on: L,
        centre: Vec3,
        radius: f32,
        state: &mut S,
        tally: &mut impl Tally,
        bound: impl Fn(&S) -> f32,
        visit: impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B>;

    /// Truncated k-NN, into what is empty.
    #[inline(always)]
    fn walk_nearest<L: Lanes>(&self, on: L, centre: Vec3, radius: f32, mut nearest: &mut Nearest) {
        let radius2 = radius2(radius);
        let bound = |nearest: &&mut Nearest| nearest.bound().min(radius2);
        let _: ControlFlow<()> = self.walk(on, centre, radius, &mut nearest, &mut (), bound, |nearest, hits| {
            hits.for_each(on, |i, d2| nearest.insert(i, d2));
            ControlFlow::Continue(())
        });
    }
}

/// [`super::RadiusSearch::try_within`].
#[inline]
pub fn within<B>(
    index: &impl Walk,
    centre: Vec3,
    radius: f32,
    visit: impl FnMut(u32, f32) -> ControlFlow<B>,
) -> ControlFlow<B> {
    dispatch(Within { index, centre, radius, visit })
}

/// [`super::RadiusSearch::nearest`].
#[inline]
pub fn nearest(index: &impl Walk, centre: Vec3, radius: f32, nearest: &mut Nearest) {
    nearest.clear();
    dispatch(NearestOf { index, centre, radius, nearest });
}

/// [`super::stats::CountVisits::visits`].
pub fn visits(index: &impl Walk, centre: Vec3, radius: f32) -> Visits {
    let (mut visits, mut found) = (Visits::default(), 0);
    let bound = radius2(radius);
    let _: ControlFlow<()> = index.walk(
        Portable,
        centre,
        radius,
        &mut found,
        &mut visits,
        |_| bound,
        |found, hits| {
            *found += u64::from(hits.bits.count_ones());
            ControlFlow::Continue(())
        },
    );
    visits.found = found;
    visits
}

struct NearestOf<'a, I> {
    index: &'a I,
    centre: Vec3,
    radius: f32,
    nearest: &'a mut Nearest,
}

impl<I: Walk> Task for NearestOf<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, on: L) {
        self.index.walk_nearest(on, self.centre, self.radius, self.nearest);
    }
}

struct Within<'a, I, V> {
    index: &'a I,
    centre: Vec3,
    radius: f32,
    visit: V,
}

/// Points found before they are handed out: a few blocks, so that the handing out is one loop.
const BATCH: usize = 64;

struct Found<V> {
    indices: [u32; BATCH],
    distances2: [f32; BATCH],
    n: usize,
    visit: V,
}

impl<V> Found<V> {
    #[inline(always)]
    fn hand_out<B>(&mut self) -> ControlFlow<B>
    where
        V: FnMut(u32, f32) -> ControlFlow<B>,
    {
        let n = std::mem::take(&mut self.n);
        for (&i, &d2) in self.indices[..n].iter().zip(&self.distances2[..n]) {
            (self.visit)(i, d2)?;
        }
        ControlFlow::Continue(())
    }
}

impl<B, I: Walk, V: FnMut(u32, f32) -> ControlFlow<B>> Task for Within<'_, I, V> {
    type Output = ControlFlow<B>;

    #[inline(always)]
    fn run<L: Lanes>(self, on: L) -> ControlFlow<B> {
        let mut found = Found { indices: [0; BATCH], distances2: [0.0; BATCH], n: 0, visit: self.visit };
        let bound = radius2(self.radius);
        self.index.walk(
            on,
            self.centre,
            self.radius,
            &mut found,
            &mut (),
            |_| bound,
            |found, hits| {
                let n = found.n;
                found.indices[n..n + WIDTH].copy_from_slice(&on.compress_u32(hits.bits, hits.indices));
                found.distances2[n..n + WIDTH].copy_from_slice(&on.compress(hits.bits, hits.distances2));
                found.n += hits.bits.count_ones() as usize;
                if found.n > BATCH - WIDTH { found.hand_out() } else { ControlFlow::Continue(()) }
            },
        )?;
        found.hand_out()
    }
}

/// No coordinate of a point within a radius of this square is further from the query's, roundings included: that of the
/// square of their difference, which may vanish, and that of the difference.
#[inline]
pub fn reach(radius2: f32) -> f32 {
    radius2.next_up().sqrt().next_up()
}

/// Least and largest corner of a box outside of which no point is within the reach of `centre`. (Rounding is monotonic,
/// and coordinates are numbers already rounded: none comes to lie outside.)
#[inline]
pub fn around(centre: Vec3, reach: f32) -> (Vec3, Vec3) {
    (centre - reach, centre + reach)
}

/// The box that is neutral in a union.
pub const NOTHING: (Vec3, Vec3) = (Vec3::INFINITY, Vec3::NEG_INFINITY);

#[inline]
pub fn join(a: (Vec3, Vec3), b: (Vec3, Vec3)) -> (Vec3, Vec3) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// The box of all points.
pub fn bounds(points: &[Vec3]) -> (Vec3, Vec3) {
    let fold = |b, &p: &Vec3| join(b, (p, p));
    points.par_iter().with_min_len(8192).fold(|| NOTHING, fold).reduce(|| NOTHING, join)
}
