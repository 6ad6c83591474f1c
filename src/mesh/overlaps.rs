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

/// What was found, and how much may be.
struct Found<'a, F> {
    is_wanted: &'a F,
    n: AtomicUsize,
    limit: usize,
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

    /// Every two overlapping boxes for which `is_wanted`, the lower index first, in rising order; none if there are more
    /// than `limit`.
    pub fn pairs(&self, is_wanted: impl Fn(u32, u32) -> bool + Sync, limit: usize) -> Option<Vec<[u32; 2]>> {
        let found = Found { is_wanted: &is_wanted, n: AtomicUsize::new(0), limit };
        let mut pairs = Vec::new();
        if !self.nodes.is_empty() {
            self.within(0, &found, &mut pairs);
        }
        pairs.sort_unstable();
        (found.n.into_inner() <= limit).then_some(pairs)
    }

    fn boxes(&self, node: &Node) -> &[u32] {
        &self.order[node.begin as usize..node.end as usize]
    }

    fn within<F: Fn(u32, u32) -> bool + Sync>(&self, at: usize, found: &Found<F>, pairs: &mut Vec<[u32; 2]>) {
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

    fn between<F: Fn(u32, u32) -> bool>(&self, a: usize, b: usize, found: &Found<F>, pairs: &mut Vec<[u32; 2]>) {
        let (node, other) = (&self.nodes[a], &self.nodes[b]);
        if !overlap(&node.bounds, &other.bounds) || found.n.load(Ordering::Relaxed) > found.limit {
            return;
        }
        if node.second == 0 && other.second == 0 {
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

    fn test<F: Fn(u32, u32) -> bool>(&self, a: u32, b: u32, found: &Found<F>, pairs: &mut Vec<[u32; 2]>) {
        let (a, b) = (a.min(b), a.max(b));
        if overlap(&self.boxes[a as usize], &self.boxes[b as usize])
            && (found.is_wanted)(a, b)
            && found.n.fetch_add(1, Ordering::Relaxed) < found.limit
        {
            pairs.push([a, b]);
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
