//! Builders of binary trees over boxes: LBVH and PLOC.
//!
//! Karras, "Maximizing Parallelism in the Construction of BVHs, Octrees, and k-d Trees", HPG 2012; Meister and Bittner,
//! "Parallel Locally-Ordered Clustering for Bounding Volume Hierarchy Construction", TVCG 24(3), 2018.

use glam::Vec3;
use rayon::prelude::*;

use super::blocks::{NOTHING, join};
use crate::math::morton::Grid;

type Aabb = (Vec3, Vec3);

/// A node's children: primitives where below their number, then nodes.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pair {
    pub left: u32,
    pub right: u32,
    /// Primitives below.
    pub n: u32,
}

/// What a builder leaves: primitives in Morton order, and the inner nodes over them.
#[derive(Clone, Debug, Default)]
pub(super) struct Topology {
    /// Morton keys of the boxes' centres, each with the index of its primitive.
    pub keys: Vec<(u64, u32)>,
    pub pairs: Vec<Pair>,
    /// Index into primitives and nodes.
    pub root: u32,
    boxes: Vec<Aabb>,
    clusters: Vec<Cluster>,
    best: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Cluster {
    aabb: Aabb,
    /// As in [`Pair`].
    node: u32,
    n: u32,
}

impl Topology {
    /// Sorts the primitives, whose boxes are finite. At least one.
    fn sort(&mut self, n: usize, aabb: impl Fn(usize) -> Aabb + Sync) {
        (0..n).into_par_iter().with_min_len(8192).map(&aabb).collect_into_vec(&mut self.boxes);
        let all = self.boxes.par_iter().with_min_len(8192).copied().reduce(|| NOTHING, join);
        // To fit a box of at most 1 an axis, so that neither areas nor extents overflow.
        let largest = all.0.abs().max(all.1.abs()).max_element();
        let scale = if largest > 0.0 { (0.5 / largest).min(f32::MAX) } else { 1.0 };
        self.boxes.par_iter_mut().with_min_len(8192).for_each(|b| *b = (b.0 * scale, b.1 * scale));
        let centre = |b: &Aabb| (b.0 + b.1) * 0.5;
        let fold = |all, b: &Aabb| join(all, (centre(b), centre(b)));
        let (min, max) = self.boxes.par_iter().with_min_len(8192).fold(|| NOTHING, fold).reduce(|| NOTHING, join);
        let grid = Grid::new(min, max);
        let key = |(i, b): (usize, &Aabb)| (grid.key(centre(b)), i as u32);
        self.boxes.par_iter().with_min_len(8192).enumerate().map(key).collect_into_vec(&mut self.keys);
        self.keys.par_sort_unstable();
    }

    /// A binary radix tree over the Morton keys: each node splits where its keys' highest bit changes.
    pub fn lbvh(&mut self, n: usize, aabb: impl Fn(usize) -> Aabb + Sync) {
        self.sort(n, aabb);
        let keys = &self.keys;
        // Length of the common prefix; equal keys go on with their place.
        let prefix = |i: usize, j: i64| -> i32 {
            if j < 0 || j >= n as i64 {
                return -1;
            }
            match keys[i].0 ^ keys[j as usize].0 {
                0 => 64 + (i as u64 ^ j as u64).leading_zeros() as i32,
                differ => differ.leading_zeros() as i32,
            }
        };
        let pair = |i: usize| {
            let at = |steps: i64| prefix(i, i as i64 + steps);
            let towards = if at(1) > at(-1) { 1 } else { -1 };
            let least = at(-towards);
            let mut most = 2;
            while at(most * towards) > least {
                most *= 2;
            }
            let mut length = 0;
            let mut step = most / 2;
            while step > 0 {
                if at((length + step) * towards) > least {
                    length += step;
                }
                step /= 2;
            }
            let common = at(length * towards);
            let mut before_split = 0;
            let mut step = length;
            while step > 1 {
                step = (step + 1) / 2;
                if at((before_split + step) * towards) > common {
                    before_split += step;
                }
            }
            let end = i as i64 + length * towards;
            let (first, last) = ((i as i64).min(end), (i as i64).max(end));
            let split = i as i64 + before_split * towards + towards.min(0);
            let child = |at: i64, is_leaf: bool| (if is_leaf { at } else { n as i64 + at }) as u32;
            Pair {
                left: child(split, split == first),
                right: child(split + 1, split + 1 == last),
                n: (last - first + 1) as u32,
            }
        };
        (0..n - 1).into_par_iter().with_min_len(1024).map(pair).collect_into_vec(&mut self.pairs);
        self.root = if n == 1 { 0 } else { n as u32 };
    }

    /// Clusters in Morton order, each pair that are each other's nearest among `reach` places to either side merged, over
    /// and over. Nearest: least area of the common box.
    pub fn ploc(&mut self, n: usize, reach: usize, aabb: impl Fn(usize) -> Aabb + Sync) {
        let reach = reach.max(1);
        self.sort(n, aabb);
        self.pairs.clear();
        self.clusters.clear();
        let boxes = &self.boxes;
        self.clusters.par_extend(self.keys.par_iter().enumerate().map(|(slot, key)| Cluster {
            aabb: boxes[key.1 as usize],
            node: slot as u32,
            n: 1,
        }));
        while self.clusters.len() > 1 {
            let clusters = &self.clusters;
            let nearest = |i: usize| {
                let (from, to) =
                    (i.saturating_sub(reach), i.saturating_add(reach).saturating_add(1).min(clusters.len()));
                let aabb = clusters[i].aabb;
                // Never itself: each round must merge something.
                let (mut best, mut least) = (if i == 0 { 1 } else { i - 1 }, f32::INFINITY);
                for j in (from..i).chain(i + 1..to) {
                    let area = half_area(join(aabb, clusters[j].aabb));
                    if area < least || (area == least && is_before((i, j), (i, best))) {
                        (best, least) = (j, area);
                    }
                }
                best as u32
            };
            (0..clusters.len()).into_par_iter().with_min_len(512).map(nearest).collect_into_vec(&mut self.best);
            let mut kept = 0;
            for i in 0..self.clusters.len() {
                let other = self.best[i] as usize;
                let mut cluster = self.clusters[i];
                if self.best[other] as usize == i {
                    if other < i {
                        continue;
                    }
                    let right = self.clusters[other];
                    let merged = Pair { left: cluster.node, right: right.node, n: cluster.n + right.n };
                    cluster = Cluster {
                        aabb: join(cluster.aabb, right.aabb),
                        node: (n + self.pairs.len()) as u32,
                        n: merged.n,
                    };
                    self.pairs.push(merged);
                }
                self.clusters[kept] = cluster;
                kept += 1;
            }
            self.clusters.truncate(kept);
        }
        self.root = self.clusters[0].node;
    }
}

#[inline]
fn half_area((min, max): Aabb) -> f32 {
    let e = max - min;
    e.x * e.y + e.y * e.z + e.z * e.x
}

/// Of pairs of clusters with equal area, which is merged first: one order for all pairs, so that some pair is always
/// each other's nearest, and neighbours from an even place on first, so that equal points are halved and not eaten up
/// from one end.
fn is_before(a: (usize, usize), b: (usize, usize)) -> bool {
    let key = |(i, j): (usize, usize)| (i.abs_diff(j), i.min(j) % 2, i.min(j));
    key(a) < key(b)
}
