//! The tree over the scene's primitives, built by `obvhs` and stored with both children's boxes in one node.

use std::time::Duration;

use glam::Vec3A;
use obvhs::{BvhBuildParams, aabb::Aabb, bvh2::Bvh2};

use crate::layout::{NONE, SceneNode};

/// Deepest tree a traversal can walk: its stack holds one entry a level.
pub const MAX_DEPTH: usize = 64;

/// By how much boxes of nodes are larger than what is in them, in half-diagonals of the whole: more than the rounding of a
/// test against a triangle, so that which primitives are hit, and where, does not depend on the tree.
pub const MARGIN: f32 = 64.0 * f32::EPSILON;

/// Nodes (the first is the root; empty without primitives) and the order in which leaves list the primitives.
pub fn build(boxes: &[Aabb]) -> (Vec<SceneNode>, Vec<u32>) {
    if boxes.is_empty() {
        return (Vec::new(), Vec::new());
    }
    let tree = obvhs::bvh2::builder::build_bvh2(boxes, BvhBuildParams::medium_build(), &mut Duration::default());
    let mut flat = Flat::default();
    flat.root(&tree);
    let (mut nodes, order) = if flat.depth <= MAX_DEPTH { (flat.nodes, flat.order) } else { halved(boxes) };
    let margin = bounds(boxes).diagonal().length() * 0.5 * MARGIN;
    for node in &mut nodes {
        for corner in [&mut node.left_min, &mut node.right_min] {
            *corner = corner.map(|x| x - margin);
        }
        for corner in [&mut node.left_max, &mut node.right_max] {
            *corner = corner.map(|x| x + margin);
        }
    }
    (nodes, order)
}

fn halved(boxes: &[Aabb]) -> (Vec<SceneNode>, Vec<u32>) {
    // Agglomerative trees over adversarial input can be arbitrarily deep; halving by count never is.
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let mut nodes = vec![SceneNode::default()];
    halve(boxes, &mut order, 0, &mut nodes, 0);
    (nodes, order)
}

/// Of all boxes together.
pub fn bounds(boxes: &[Aabb]) -> Aabb {
    boxes.iter().fold(Aabb::empty(), |all, b| all.union(b))
}

#[derive(Default)]
struct Flat {
    nodes: Vec<SceneNode>,
    order: Vec<u32>,
    depth: usize,
}

/// (box, node or first primitive, number of primitives)
type Child = (Aabb, u32, u32);

fn set_children(node: &mut SceneNode, [l, r]: [Child; 2]) {
    node.left_min = l.0.min.to_array();
    node.left_max = l.0.max.to_array();
    (node.left, node.n_left) = (l.1, l.2);
    node.right_min = r.0.min.to_array();
    node.right_max = r.0.max.to_array();
    (node.right, node.n_right) = (r.1, r.2);
}

/// A box that no ray enters and a leaf that holds nothing: the sibling of a root that is itself a leaf.
fn nothing() -> Child {
    (Aabb::new(Vec3A::INFINITY, Vec3A::INFINITY), NONE, 1)
}

impl Flat {
    fn root(&mut self, tree: &Bvh2) {
        self.nodes.push(SceneNode::default());
        let root = &tree.nodes[0];
        if root.is_leaf() {
            let leaf = self.leaf(tree, 0);
            set_children(&mut self.nodes[0], [leaf, nothing()]);
            return;
        }
        // (node of `tree`, where it goes, depth)
        let mut todo = vec![(0u32, 0usize, 1usize)];
        while let Some((from, to, depth)) = todo.pop() {
            self.depth = self.depth.max(depth);
            let first = tree.nodes[from as usize].first_index;
            let children = [first, first + 1].map(|c| {
                let child = &tree.nodes[c as usize];
                if child.is_leaf() {
                    self.leaf(tree, c)
                } else {
                    let at = self.nodes.len();
                    self.nodes.push(SceneNode::default());
                    todo.push((c, at, depth + 1));
                    (*child.aabb(), at as u32, 0)
                }
            });
            set_children(&mut self.nodes[to], children);
        }
    }

    fn leaf(&mut self, tree: &Bvh2, node: u32) -> Child {
        let node = &tree.nodes[node as usize];
        let first = self.order.len() as u32;
        let range = node.first_index as usize..(node.first_index + node.prim_count) as usize;
        self.order.extend_from_slice(&tree.primitive_indices[range]);
        (*node.aabb(), first, node.prim_count)
    }
}

/// Halves `order` at its median along the longest axis of the centroids until four are left.
fn halve(boxes: &[Aabb], order: &mut [u32], offset: u32, nodes: &mut Vec<SceneNode>, at: usize) {
    let centroid = |i: u32| boxes[i as usize].center();
    let mut extent = Aabb::empty();
    for &i in order.iter() {
        extent.extend(centroid(i));
    }
    let d = extent.diagonal();
    let axis = if d.x >= d.y && d.x >= d.z { 0 } else { 1 + usize::from(d.z > d.y) };
    let middle = order.len() / 2;
    if middle > 0 {
        order.select_nth_unstable_by(middle, |&a, &b| centroid(a)[axis].total_cmp(&centroid(b)[axis]).then(a.cmp(&b)));
    }
    let (left, right) = order.split_at_mut(middle);
    let child = |part: &mut [u32], offset: u32, nodes: &mut Vec<SceneNode>| -> Child {
        if part.is_empty() {
            return nothing();
        }
        let bounds = part.iter().fold(Aabb::empty(), |all, &i| all.union(&boxes[i as usize]));
        if part.len() <= 4 {
            return (bounds, offset, part.len() as u32);
        }
        let at = nodes.len();
        nodes.push(SceneNode::default());
        halve(boxes, part, offset, nodes, at);
        (bounds, at as u32, 0)
    };
    let l = child(left, offset, nodes);
    let r = child(right, offset + middle as u32, nodes);
    set_children(&mut nodes[at], [l, r]);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(nodes: &[SceneNode], order: &[u32], boxes: &[Aabb]) -> usize {
        let mut seen = vec![false; boxes.len()];
        let mut todo = vec![(0u32, 1usize)];
        let mut deepest = 0;
        while let Some((n, depth)) = todo.pop() {
            deepest = deepest.max(depth);
            let node = nodes[n as usize];
            for (min, max, index, count) in [
                (node.left_min, node.left_max, node.left, node.n_left),
                (node.right_min, node.right_max, node.right, node.n_right),
            ] {
                if index == NONE {
                    continue;
                }
                if count == 0 {
                    todo.push((index, depth + 1));
                }
                for slot in index..index + count {
                    let primitive = order[slot as usize] as usize;
                    assert!(!std::mem::replace(&mut seen[primitive], true), "listed twice");
                    let b = &boxes[primitive];
                    assert!(b.min.cmpge(min.into()).all() && b.max.cmple(max.into()).all());
                }
            }
        }
        assert!(seen.iter().all(|&s| s));
        deepest
    }

    #[test]
    fn every_primitive_is_in_exactly_one_leaf_whatever_the_input() {
        for n in [0, 1, 2, 3, 5, 100, 3000] {
            for spread in [0.0, 1.0] {
                let boxes: Vec<_> = (0..n)
                    .map(|i| {
                        let p = Vec3A::new((i * 7919 % 1009) as f32, (i * 104_729 % 997) as f32, i as f32) * spread;
                        Aabb::new(p, p + 0.5)
                    })
                    .collect();
                let (nodes, order) = build(&boxes);
                if n > 0 {
                    assert!(check(&nodes, &order, &boxes) <= MAX_DEPTH);
                    let (nodes, order) = halved(&boxes);
                    assert!(check(&nodes, &order, &boxes) <= 16);
                }
            }
        }
    }
}
