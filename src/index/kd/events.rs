//! Sorted events: where triangles begin and end along the axes (Wald & Havran 2006).
//!
//! Sorted anew in each node that is O(N log² N). Sorted once it is O(N log N): a split keeps the events of triangles that
//! are on one side, which leaves them in order; only those of triangles that the plane cuts are made anew, sorted, and
//! merged in. They are few: O(√N) of N.

use rayon::prelude::*;

use super::cell::{ABOVE, CUT, Halves, Part};
use super::sah::{Cheapest, Counts};

/// One word, in the order of the sweep: 32 bits of place, 2 of kind, 30 of the triangle's index in its cell.
type Event = u64;

/// Kinds, in the order they are counted in at one place.
const END: u64 = 0;
const PLANAR: u64 = 1;
const START: u64 = 2;
const INDEX_BITS: u32 = 30;
const INDEX: u64 = (1 << INDEX_BITS) - 1;

/// Events that one thread sweeps or divides at a time.
const PIECE: usize = 1 << 13;

/// The events of a cell: one sorted list, axis by axis.
#[derive(Debug)]
pub struct Events([Vec<Event>; 3]);

/// The bits of a number, so that their order is that of the numbers. Zero has one form only.
#[inline]
fn key(x: f32) -> u32 {
    let bits = x.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

#[inline]
fn place(event: Event) -> f32 {
    let key = (event >> 32) as u32;
    f32::from_bits(if key >> 31 == 1 { key & !(1 << 31) } else { !key })
}

#[inline]
fn kind(event: Event) -> u64 {
    event >> INDEX_BITS & 3
}

#[inline]
fn event(at: f32, kind: u64, index: u64) -> Event {
    u64::from(key(at)) << 32 | kind << INDEX_BITS | index
}

/// The events of one triangle along one axis.
#[inline]
fn push(part: &Part, index: u64, axis: usize, into: &mut Vec<Event>) {
    let (min, max) = (part.bounds.min[axis], part.bounds.max[axis]);
    if min == max {
        into.push(event(min, PLANAR, index));
    } else {
        into.push(event(min, START, index));
        into.push(event(max, END, index));
    }
}

/// What an axis gives, for each.
fn axes<R: Send>(parallel: bool, run: impl Fn(usize) -> R + Sync) -> [R; 3] {
    if parallel {
        let (x, (y, z)) = rayon::join(|| run(0), || rayon::join(|| run(1), || run(2)));
        [x, y, z]
    } else {
        [run(0), run(1), run(2)]
    }
}

impl Events {
    /// Of all triangles of a cell.
    pub fn of(parts: &[Part], parallel: bool) -> Self {
        Self(axes(parallel, |axis| {
            let mut events = Vec::with_capacity(2 * parts.len());
            for (part, index) in parts.iter().zip(0..) {
                push(part, index, axis, &mut events);
            }
            if parallel {
                events.par_sort_unstable();
            } else {
                events.sort_unstable();
            }
            events
        }))
    }

    /// Every place where something begins or ends, with the counts there. `n` triangles are in the cell.
    pub fn offer(&self, n: usize, cheapest: &mut Cheapest<'_>, parallel: bool) {
        if parallel {
            let of_axes = axes(true, |axis| sweep_beside(&self.0[axis], axis, (0, n), cheapest));
            of_axes.iter().for_each(|other| cheapest.join(other));
        } else {
            for (axis, events) in self.0.iter().enumerate() {
                sweep(events, axis, (0, n), cheapest);
            }
        }
    }

    /// The events of both halves.
    pub fn divide(&self, halves: &Halves, parallel: bool) -> [Self; 2] {
        let [x, y, z] = axes(parallel, |axis| {
            let lists = if parallel {
                let pieces = self.0[axis].par_chunks(PIECE).map(|piece| divide(piece, halves, piece.len()));
                pieces.reduce(Default::default, |[mut below, mut above], [more_below, more_above]| {
                    below.extend_from_slice(&more_below);
                    above.extend_from_slice(&more_above);
                    [below, above]
                })
            } else {
                divide(&self.0[axis], halves, usize::MAX)
            };
            let mut half = 0;
            lists.map(|mut list| {
                let mut new = Vec::with_capacity(2 * halves.cut[half].len());
                for &index in &halves.cut[half] {
                    push(&halves.parts[half][index as usize], u64::from(index), axis, &mut new);
                }
                new.sort_unstable();
                merge(&mut list, &new);
                half += 1;
                list
            })
        });
        let ([x, x_above], [y, y_above], [z, z_above]) = (x, y, z);
        [Self([x, y, z]), Self([x_above, y_above, z_above])]
    }
}

/// Offers every place in a list of events, before which `below` triangles have begun and behind which `above` end.
fn sweep(events: &[Event], axis: usize, (mut below, mut above): (usize, usize), cheapest: &mut Cheapest<'_>) {
    let mut events = events.iter().copied().peekable();
    while let Some(first) = events.next() {
        let at = first >> 32;
        let (mut ending, mut planar, mut starting) = (0, 0, 0);
        let mut next = Some(first);
        while let Some(e) = next {
            ending += usize::from(kind(e) == END);
            planar += usize::from(kind(e) == PLANAR);
            starting += usize::from(kind(e) == START);
            next = events.next_if(|e| e >> 32 == at);
        }
        above -= ending + planar;
        cheapest.offer(axis, place(first), Counts { below, planar, above });
        below += starting + planar;
    }
}

/// The same on several threads: the second half of the list is swept from the counts at its beginning.
fn sweep_beside<'a>(
    events: &[Event],
    axis: usize,
    (below, above): (usize, usize),
    cheapest: &Cheapest<'a>,
) -> Cheapest<'a> {
    // Events of one place stay together.
    let middle = events.get(events.len() / 2).map_or(0, |m| events.partition_point(|e| e >> 32 < m >> 32));
    if events.len() <= PIECE || middle == 0 {
        let mut cheapest = cheapest.clone();
        sweep(events, axis, (below, above), &mut cheapest);
        return cheapest;
    }
    let (first, second) = events.split_at(middle);
    let begun = first.iter().filter(|&&e| kind(e) != END).count();
    let ended = first.iter().filter(|&&e| kind(e) != START).count();
    let (mut best, other) = rayon::join(
        || sweep_beside(first, axis, (below, above), cheapest),
        || sweep_beside(second, axis, (below + begun, above - ended), cheapest),
    );
    best.join(&other);
    best
}

/// Events of triangles that are on one side, renumbered, each list in order. At most `most` are in one.
fn divide(events: &[Event], halves: &Halves, most: usize) -> [Vec<Event>; 2] {
    let mut lists = [&halves.parts[0], &halves.parts[1]].map(|parts| Vec::with_capacity(most.min(2 * parts.len())));
    for &e in events {
        let place = halves.places[(e & INDEX) as usize];
        if place != CUT {
            lists[usize::from(place & ABOVE != 0)].push(e & !INDEX | u64::from(place & !ABOVE));
        }
    }
    lists
}

/// Merges one sorted list into another, from behind.
fn merge(list: &mut Vec<Event>, new: &[Event]) {
    let (mut a, mut b) = (list.len(), new.len());
    list.resize(a + b, 0);
    for to in (0..a + b).rev() {
        if b == 0 {
            break;
        }
        if a > 0 && list[a - 1] > new[b - 1] {
            a -= 1;
            list[to] = list[a];
        } else {
            b -= 1;
            list[to] = new[b];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::clip::Aabb;
    use super::super::sah::Sah;
    use super::*;
    use crate::math::rng::pcg4d;

    #[test]
    fn words_are_in_the_order_of_places_then_kinds_and_keep_both() {
        let places = [-1.0, -1e-30, 0.0, f32::MIN_POSITIVE, 0.3, 1.0f32];
        let mut last = None;
        for at in places {
            for k in [END, PLANAR, START] {
                let e = event(at, k, 5);
                assert!((place(e), kind(e), e & INDEX) == (at, k, 5));
                assert!(last < Some(e));
                last = Some(e);
            }
        }
    }

    /// The cheapest plane and its cost, in bits: of many triangles, some of them planar, in cells of which either end is cheap.
    #[test]
    fn a_sweep_on_several_threads_counts_as_one_does() {
        for seed in 0..6 {
            let parts: Vec<Part> = (0..3 * PIECE as u32)
                .map(|i| {
                    let draw = pcg4d([i, seed, 2, 9]).map(|word| (word >> 8) as f32 / (1u32 << 24) as f32);
                    let min = [draw[0].powi(1 + seed as i32), 1.0 - draw[1].powi(1 + seed as i32), draw[2]];
                    let size = if i % 3 == 0 { 0.0 } else { 0.01 * draw[3] };
                    Part { face: i, bounds: Aabb { min, max: min.map(|x| x + size) } }
                })
                .collect();
            let cell = Aabb { min: [-0.1; 3], max: [1.1; 3] };
            let sah = Sah::default();
            let [alone, beside] = [false, true].map(|parallel| {
                let mut cheapest = Cheapest::new(&sah, &cell);
                Events::of(&parts, parallel).offer(parts.len(), &mut cheapest, parallel);
                cheapest.best
            });
            assert_eq!(alone, beside);
            // Each part of the sweep by itself, not only the best of all.
            let events = Events::of(&parts, false);
            for (axis, events) in events.0.iter().enumerate() {
                let cheapest = Cheapest::new(&sah, &cell);
                let mut alone = cheapest.clone();
                sweep(events, axis, (0, parts.len()), &mut alone);
                assert_eq!(sweep_beside(events, axis, (0, parts.len()), &cheapest).best, alone.best);
            }
        }
    }

    #[test]
    fn merging_is_sorting() {
        for (a, b) in
            [(vec![], vec![]), (vec![3, 5], vec![]), (vec![], vec![1]), (vec![2, 4, 9], vec![1, 4, 5, 10, 11])]
        {
            let mut merged = a.clone();
            merge(&mut merged, &b);
            let mut sorted = [a, b].concat();
            sorted.sort_unstable();
            assert_eq!(merged, sorted);
        }
    }
}
