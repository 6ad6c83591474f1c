//! Pairs of boxes that overlap, in O(N log N + pairs).
//!
//! A binary tree, halved at the median of the longest side, and walked against itself.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Least and greatest corner.
pub type Aabb = [[f64; 3]; 2];

const LEAF: usize = 4;
/// Nodes of fewer boxes are not shared among threads.
const GRAIN: usize = 1024;

struct Node {
    bounds: Aabb,
    /// In [`Overlaps::order`].
    begin: u32,
    end: u32,
    /// The other child is the next node; 0 for a leaf.
    second: u32,
}

impl Node {
    fn len(&self) -> usize {
        (self.end - self.begin) as usize
    }
}

pub struct Overlaps<'a> {
    boxes: &'a [Aabb],
    order: Vec<u32>,
    nodes: Vec<Node>,
    parallel: bool,
}

/// Two boxes, the lower index first, and what is known of them.
pub type Pair<K> = ([u32; 2], K);

/// Too many pairs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TooMany {
    /// Of those that are wanted.
    Found,
    /// Of those that had to be asked about.
    Asked,
}

/// What was found, and how much may be.
struct Found<'a, F> {
    kind: &'a F,
    n: AtomicUsize,
    n_asked: AtomicUsize,
    limits: Limits,
}

/// How many pairs there may be.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Of those that are wanted.
    pub found: usize,
    /// Of boxes in neighbouring leaves, which is what takes the time.
    pub asked: usize,
}

impl<F> Found<'_, F> {
    fn is_too_much(&self) -> bool {
        self.n.load(Ordering::Relaxed) > self.limits.found || self.n_asked.load(Ordering::Relaxed) > self.limits.asked
    }
}

impl<'a> Overlaps<'a> {
    /// Over those of `boxes` that `order` names.
    pub fn new(boxes: &'a [Aabb], mut order: Vec<u32>, parallel: bool) -> Self {
        let mut nodes = Vec::with_capacity(order.len());
        if !order.is_empty() {
            build(boxes, &mut order, 0, &mut nodes);
        }
        Self { boxes, order, nodes, parallel }
    }

    /// Every two overlapping boxes of which `kind` knows one, in rising order.
    pub fn pairs<K: Ord + Send>(
        &self,
        kind: impl Fn(u32, u32) -> Option<K> + Sync,
        limits: Limits,
    ) -> Result<Vec<Pair<K>>, TooMany> {
        let found = Found { kind: &kind, n: AtomicUsize::new(0), n_asked: AtomicUsize::new(0), limits };
        let mut pairs = Vec::new();
        if !self.nodes.is_empty() {
            self.within(0, &found, &mut pairs);
        }
        pairs.sort_unstable();
        if found.n.into_inner() > limits.found {
            Err(TooMany::Found)
        } else if found.n_asked.into_inner() > limits.asked {
            Err(TooMany::Asked)
        } else {
            Ok(pairs)
        }
    }

    fn boxes(&self, node: &Node) -> &[u32] {
        &self.order[node.begin as usize..node.end as usize]
    }

    fn within<K: Send, F: Fn(u32, u32) -> Option<K> + Sync>(
        &self,
        at: usize,
        found: &Found<F>,
        pairs: &mut Vec<Pair<K>>,
    ) {
        let node = &self.nodes[at];
        if node.second == 0 {
            let boxes = self.boxes(node);
            for (i, &a) in boxes.iter().enumerate() {
                boxes[i + 1..].iter().for_each(|&b| self.test(a, b, found, pairs));
            }
            return;
        }
        let (first, second) = (at + 1, node.second as usize);
        if self.parallel && node.len() > GRAIN {
            let (mut of_second, mut of_both) = (Vec::new(), Vec::new());
            rayon::join(
                || self.within(first, found, pairs),
                || {
                    rayon::join(
                        || self.within(second, found, &mut of_second),
                        || self.between(first, second, found, &mut of_both),
                    )
                },
            );
            pairs.append(&mut of_second);
            pairs.append(&mut of_both);
        } else {
            self.within(first, found, pairs);
            self.within(second, found, pairs);
            self.between(first, second, found, pairs);
        }
    }

    fn between<K, F: Fn(u32, u32) -> Option<K>>(&self, a: usize, b: usize, found: &Found<F>, pairs: &mut Vec<Pair<K>>) {
        let (node, other) = (&self.nodes[a], &self.nodes[b]);
        if !overlap(&node.bounds, &other.bounds) || found.is_too_much() {
            return;
        }
        if node.second == 0 && other.second == 0 {
            found.n_asked.fetch_add(node.len() * other.len(), Ordering::Relaxed);
            for &i in self.boxes(node) {
                self.boxes(other).iter().for_each(|&j| self.test(i, j, found, pairs));
            }
        } else if other.second == 0 || (node.second != 0 && node.len() >= other.len()) {
            self.between(a + 1, b, found, pairs);
            self.between(node.second as usize, b, found, pairs);
        } else {
            self.between(a, b + 1, found, pairs);
            self.between(a, other.second as usize, found, pairs);
        }
    }

    fn test<K, F: Fn(u32, u32) -> Option<K>>(&self, a: u32, b: u32, found: &Found<F>, pairs: &mut Vec<Pair<K>>) {
        let (a, b) = (a.min(b), a.max(b));
        if overlap(&self.boxes[a as usize], &self.boxes[b as usize])
            && let Some(kind) = (found.kind)(a, b)
            && found.n.fetch_add(1, Ordering::Relaxed) < found.limits.found
        {
            pairs.push(([a, b], kind));
        }
    }
}

fn build(boxes: &[Aabb], order: &mut [u32], begin: u32, nodes: &mut Vec<Node>) {
    let bounds = order.iter().map(|&i| boxes[i as usize]).fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], join);
    let at = nodes.len();
    nodes.push(Node { bounds, begin, end: begin + order.len() as u32, second: 0 });
    if order.len() <= LEAF {
        return;
    }
    let sides: [f64; 3] = std::array::from_fn(|axis| bounds[1][axis] - bounds[0][axis]);
    let axis = (1..3).fold(0, |best, axis| if sides[axis] > sides[best] { axis } else { best });
    let middle = |i: &u32| boxes[*i as usize][0][axis] + boxes[*i as usize][1][axis];
    let half = order.len() / 2;
    order.select_nth_unstable_by(half, |i, j| middle(i).total_cmp(&middle(j)));
    let (below, above) = order.split_at_mut(half);
    build(boxes, below, begin, nodes);
    nodes[at].second = nodes.len() as u32;
    build(boxes, above, begin + half as u32, nodes);
}

fn join(a: Aabb, b: Aabb) -> Aabb {
    [std::array::from_fn(|i| a[0][i].min(b[0][i])), std::array::from_fn(|i| a[1][i].max(b[1][i]))]
}

fn overlap(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|axis| a[0][axis] <= b[1][axis] && b[0][axis] <= a[1][axis])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::pcg4d;

    #[test]
    fn pairs_are_those_of_testing_all_and_limits_hold() {
        let edge = |word: u32, size: u32| f64::from(word % size);
        let boxes: Vec<Aabb> = (0..3000)
            .map(|i| {
                let (at, size) = (pcg4d([i, 0, 5, 7]), pcg4d([i, 1, 5, 7]));
                let min = [0, 1, 2].map(|axis| edge(at[axis], 60));
                // Some without size; many that only touch.
                [min, [0, 1, 2].map(|axis| min[axis] + edge(size[axis], 4))]
            })
            .collect();
        // Not all, and not in order.
        let some: Vec<u32> = (0..3000).rev().filter(|i| i % 7 != 0).collect();
        let mut expected = Vec::new();
        for &a in some.iter().rev() {
            expected.extend(
                some.iter()
                    .rev()
                    .filter(|&&b| b > a && overlap(&boxes[a as usize], &boxes[b as usize]))
                    .map(|&b| ([a, b], ())),
            );
        }
        assert!(expected.len() > 500, "{}", expected.len());
        for parallel in [false, true] {
            let overlaps = Overlaps::new(&boxes, some.clone(), parallel);
            let pairs = |found, asked| overlaps.pairs(|_, _| Some(()), Limits { found, asked });
            assert_eq!(pairs(expected.len(), usize::MAX), Ok(expected.clone()));
            assert_eq!(pairs(expected.len() - 1, usize::MAX), Err(TooMany::Found));
            assert_eq!(pairs(usize::MAX, expected.len() / 2), Err(TooMany::Asked));
            let odd =
                overlaps.pairs(|a, b| ((a + b) % 2 == 1).then_some(b), Limits { found: usize::MAX, asked: usize::MAX });
            let is_odd = |([a, b], ()): &&Pair<()>| (a + b) % 2 == 1;
            assert_eq!(
                odd.unwrap(),
                expected.iter().filter(is_odd).map(|&(pair, ())| (pair, pair[1])).collect::<Vec<_>>()
            );
        }
        assert_eq!(
            Overlaps::new(&boxes, Vec::new(), true).pairs(|_, _| Some(()), Limits { found: 0, asked: 0 }),
            Ok(vec![])
        );
    }
}
