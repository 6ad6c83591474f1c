//! Many queries at once: neighbouring ones share one walk through the tree.
//!
//! A packet is a run of queries that lie close together. The points within reach of its box are gathered once, densely, and
//! each query then tests all of them, eight at a time and without a branch. Queries that do not come in such runs are
//! sorted first. Each query meets its neighbours in order of the slots, whatever packet it is in.

use glam::Vec3;
use rayon::prelude::*;

use super::bvh::PointBvh;
use super::lanes::{Lanes, Task, WIDTH, dispatch};
use super::walk::{self, Reach, Walk, distance2, leaf_ids};
use super::{Error, Nearest, NearestLists, Radii, RadiusSearch, radius2, radix};
use crate::math::morton;

/// Most queries in a packet.
const MAX_QUERIES: usize = 64;
/// The box of a packet's centres may have this sum of sides, in radii.
const MAX_EXTENT: f32 = 1.5;
/// Points gathered before the queries test them: they stay in the first cache.
const MAX_POINTS: usize = 512;
/// Queries that are sorted together, by one thread: at least and at most.
const BLOCK: [usize; 2] = [1 << 12, 1 << 18];
/// Queries in a row need no sorting if packets of them have this many.
const COHERENT: usize = 8;

/// Points within reach of a packet, component by component, padded to whole groups by points at infinity.
struct Candidates {
    position: [[f32; MAX_POINTS + WIDTH]; 3],
    id: [u32; MAX_POINTS + WIDTH],
    n: usize,
}

struct Packets<'a, Q, V> {
    tree: &'a PointBvh,
    n: usize,
    slots: bool,
    query: Q,
    visit: V,
}

/// For each i below `n`: `visit(i, slots or indices, squared distances)` with the points around `query(i)`, as often as
/// needed.
#[inline]
pub fn visit(
    tree: &PointBvh,
    n: usize,
    slots: bool,
    query: impl Fn(usize) -> (Vec3, f32),
    visit: impl FnMut(usize, &[u32], &[f32]),
) {
    dispatch(Packets { tree, n, slots, query, visit });
}

/// The queries of a packet, and the box of their centres.
struct Packet {
    centre: [Vec3; MAX_QUERIES],
    radius2: [f32; MAX_QUERIES],
    n: usize,
    min: Vec3,
    max: Vec3,
    max_radius2: f32,
}

impl Packet {
    /// Takes queries from `first` on as long as they lie together.
    #[inline(always)]
    fn fill(&mut self, first: usize, end: usize, query: impl Fn(usize) -> (Vec3, f32)) {
        self.n = 0;
        (self.min, self.max) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (mut least, mut most) = (f32::INFINITY, 0.0f32);
        for i in first..end.min(first + MAX_QUERIES) {
            let (centre, radius) = query(i);
            let (min, max) = (self.min.min(centre), self.max.max(centre));
            let sides = max - min;
            (least, most) = (least.min(radius), most.max(radius));
            if self.n > 0 && (sides.x + sides.y + sides.z > MAX_EXTENT * least || most > 2.0 * least) {
                break;
            }
            self.max_radius2 = radius2(most);
            (self.min, self.max) = (min, max);
            (self.centre[self.n], self.radius2[self.n]) = (centre, radius2(radius));
            self.n += 1;
        }
    }

    fn new() -> Self {
        Self {
            centre: [Vec3::ZERO; MAX_QUERIES],
            radius2: [0.0; MAX_QUERIES],
            n: 0,
            min: Vec3::ZERO,
            max: Vec3::ZERO,
            max_radius2: 0.0,
        }
    }
}

impl<Q, V> Task for Packets<'_, Q, V>
where
    Q: Fn(usize) -> (Vec3, f32),
    V: FnMut(usize, &[u32], &[f32]),
{
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(mut self, on: L) {
        let tree = self.tree;
        let mut packet = Packet::new();
        let mut candidates = Candidates { position: [[0.0; MAX_POINTS + WIDTH]; 3], id: [0; MAX_POINTS + WIDTH], n: 0 };
        let mut ids = [0; MAX_POINTS + WIDTH];
        let mut distances2 = [0.0; MAX_POINTS + WIDTH];
        let mut first = 0;
        while first < self.n {
            packet.fill(first, self.n, &self.query);
            let reach = Reach::new(on, packet.min, packet.max, packet.max_radius2);
            let mut walk = Walk::new(on, tree, &reach);
            let mut done = false;
            while !done {
                done = candidates.fill(on, tree, &mut walk, &reach, self.slots);
                let n_points = candidates.n.next_multiple_of(WIDTH);
                let [x, y, z] = candidates.position.each_ref().map(|c| c[..n_points].as_chunks::<WIDTH>().0);
                let candidate_ids = candidates.id[..n_points].as_chunks::<WIDTH>().0;
                for (i, (c, &radius2)) in packet.centre[..packet.n].iter().zip(&packet.radius2).enumerate() {
                    let (centre, bound) = ([on.splat(c.x), on.splat(c.y), on.splat(c.z)], on.splat(radius2));
                    let mut n = 0;
                    for (((x, y), z), id) in x.iter().zip(y).zip(z).zip(candidate_ids) {
                        let d2 = distance2(on, &[x, y, z], &centre);
                        let bits = on.le(d2, bound);
                        ids[n..n + WIDTH].copy_from_slice(&on.compress_u32(bits, id));
                        distances2[n..n + WIDTH].copy_from_slice(&on.compress(bits, d2));
                        n += bits.count_ones() as usize;
                    }
                    (self.visit)(first + i, &ids[..n], &distances2[..n]);
                }
            }
            first += packet.n;
        }
    }
}

impl Candidates {
    /// Gathers from where `walk` stands; whether that was all.
    #[inline(always)]
    fn fill<L: Lanes>(&mut self, on: L, tree: &PointBvh, walk: &mut Walk, reach: &Reach<L>, slots: bool) -> bool {
        let mut n = 0;
        let mut done = false;
        while n <= MAX_POINTS - WIDTH {
            let Some(leaf) = walk.next(on, tree, reach) else {
                done = true;
                break;
            };
            let points = &tree.leaves[leaf as usize];
            let bits = reach.points(on, points);
            for (to, from) in self.position.iter_mut().zip(&points.0) {
                to[n..n + WIDTH].copy_from_slice(&on.compress(bits, on.load(&from.0)));
            }
            self.id[n..n + WIDTH].copy_from_slice(&on.compress_u32(bits, &leaf_ids(tree, leaf, slots)));
            n += bits.count_ones() as usize;
        }
        for c in &mut self.position {
            c[n..n + WIDTH].fill(f32::INFINITY);
        }
        self.n = n;
        done
    }
}

/// [`RadiusSearch::fold_all`] by packets.
pub fn fold_all<T: Send>(
    tree: &PointBvh,
    queries: &[Vec3],
    radii: Radii<'_>,
    start: impl Fn(usize) -> T + Sync,
    visit_one: impl Fn(&mut T, u32, f32) + Sync,
) -> Result<Vec<T>, Error> {
    radii.check(queries, tree.max_radius())?;
    let mut states: Vec<T> = (0..queries.len()).into_par_iter().with_min_len(4096).map(&start).collect();
    let size = block_size(queries.len());
    states.par_chunks_mut(size).enumerate().for_each(|(block, states)| {
        let first = block * size;
        let query = |i: usize| (queries[first + i], radii.of(first + i));
        let fold = |state: &mut T, ids: &[u32], distances2: &[f32]| {
            for (&id, &d2) in ids.iter().zip(distances2) {
                visit_one(state, id, d2);
            }
        };
        if is_coherent(states.len(), query) {
            visit(tree, states.len(), false, query, |i, ids, d2| fold(&mut states[i], ids, d2));
        } else {
            let order = sorted(states.len(), query);
            let at = |i: usize| order[i] as u32 as usize;
            visit(tree, states.len(), false, |i| query(at(i)), |i, ids, d2| fold(&mut states[at(i)], ids, d2));
        }
    });
    Ok(states)
}

/// Whether queries that follow each other lie together, judged by samples.
fn is_coherent(n: usize, query: impl Fn(usize) -> (Vec3, f32)) -> bool {
    const SAMPLE: usize = 64;
    let mut packet = Packet::new();
    let (mut n_packets, mut n_queries) = (0, 0);
    for sample in (0..n).step_by(SAMPLE * 32) {
        let end = (sample + SAMPLE).min(n);
        let mut first = sample;
        while first < end {
            packet.fill(first, end, &query);
            first += packet.n;
            n_packets += 1;
        }
        n_queries += end - sample;
    }
    n_queries >= COHERENT * n_packets
}

/// Truncated k-NN of all queries, those that are close to each other soon after each other.
pub fn nearest_all(tree: &PointBvh, queries: &[Vec3], radii: Radii<'_>, k: usize) -> Result<NearestLists, Error> {
    let mut lists = NearestLists::none(queries, radii, tree.max_radius(), k)?;
    let size = block_size(queries.len());
    let rows = lists.indices.par_chunks_mut(size * k).zip(lists.distances2.par_chunks_mut(size * k));
    rows.zip(lists.found.par_chunks_mut(size)).enumerate().for_each(|(block, ((indices, distances2), found))| {
        let first = block * size;
        let query = |i: usize| (queries[first + i], radii.of(first + i));
        // Lists are short: queries further apart than points are have little in common, whatever their radius.
        let close = |i: usize| (query(i).0, query(i).1.min(tree.spacing()));
        let order = if is_coherent(found.len(), close) { None } else { Some(sorted(found.len(), close)) };
        let at = |i: usize| order.as_ref().map_or(i, |order| order[i] as u32 as usize);
        walk::nearest(
            tree,
            found.len(),
            |i| query(at(i)),
            &mut Nearest::new(k),
            |i, nearest| {
                let i = at(i);
                found[i] = nearest.found().len() as u32;
                let row = indices[i * k..].iter_mut().zip(&mut distances2[i * k..]);
                for ((index, distance2), neighbour) in row.zip(nearest.found()) {
                    (*index, *distance2) = (neighbour.index, neighbour.distance2);
                }
            },
        );
    });
    Ok(lists)
}

/// Queries a thread takes at once.
fn block_size(n: usize) -> usize {
    n.div_ceil(2 * rayon::current_num_threads()).clamp(BLOCK[0], BLOCK[1])
}

/// Queries in Morton order, the number of each in the lower half.
fn sorted(n: usize, query: impl Fn(usize) -> (Vec3, f32)) -> Vec<u64> {
    let (mut min, mut max, mut sum) = (Vec3::INFINITY, Vec3::NEG_INFINITY, 0.0f64);
    for i in 0..n {
        let (centre, radius) = query(i);
        (min, max, sum) = (min.min(centre), max.max(centre), sum + f64::from(radius));
    }
    // Cells of half a radius, but no more than tell the queries apart, and enough for the tree where radii are large.
    let extent = max - min;
    let cells = 2.0 * f64::from(extent.max_element()) * n as f64 / sum;
    let bits = (cells.log2().ceil() as i32).clamp(5, (n.ilog2() as i32 / 2 + 1).clamp(5, 10)) as u32;
    let size = ((1u32 << bits) - 1) as f32;
    let scale = extent.map(|extent| if extent > 0.0 { size / extent } else { 0.0 });
    let key = |i: usize| {
        let cell = ((query(i).0 - min) * scale).min(Vec3::splat(size)).as_uvec3();
        morton::interleave(cell.to_array()) << 32 | i as u64
    };
    let mut keys: Vec<u64> = (0..n).map(key).collect();
    let mut other = vec![0; n];
    radix::sort(&mut keys, &mut other, 32, 3 * bits);
    keys
}
