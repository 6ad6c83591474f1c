//! What the nodes of the tree say.

use sunfleck::layout::{FANOUT, TreeNode};

use super::{clouds, search};

/// Steps of a node's child along an axis: low and high.
fn steps(node: &TreeNode, axis: usize, child: usize) -> [f32; 2] {
    let words = [node.x, node.y, node.z][axis];
    [0, 2].map(|first| (words[first + child / 4] >> (8 * (child % 4)) & 255) as f32)
}

/// What a node says of its children's boxes holds, and is little more than they are.
#[test]
fn nodes_hold_their_children_closely() {
    let Some(mut search) = search() else { return };
    let mut n_children = 0;
    for (name, points) in clouds() {
        search.build(&points).expect("build");
        let (boxes, nodes) = (search.boxes().expect("boxes"), search.nodes().expect("nodes"));
        // First box of the level below, of the level, and the number of boxes of each.
        let (mut below, mut n_below) = (0, points.len().div_ceil(8));
        let mut nodes = nodes.iter();
        while n_below > 1 {
            let n = n_below.div_ceil(FANOUT as usize);
            for k in 0..n {
                let (node, parent) = (nodes.next().expect("a node for each box"), &boxes[below + n_below + k]);
                let children = &boxes[below + 8 * k..below + n_below.min(8 * k + 8)];
                assert_eq!((node.exponents >> 24) as usize, children.len(), "{name}");
                for (axis, (i, child)) in (0..3).flat_map(|axis| children.iter().enumerate().map(move |c| (axis, c))) {
                    let scale = f32::from_bits((node.exponents >> (8 * axis) & 255) << 23);
                    let [low, high] = steps(node, axis, i).map(|steps| node.origin[axis] + steps * scale);
                    assert!(low <= child.min[axis] && child.max[axis] <= high, "{name}, node {k}, child {i}");
                    let extent = f64::from(parent.max[axis]) - f64::from(parent.min[axis]);
                    // Beside that a rounding of the coordinate, and the least step there is.
                    let rounding = f64::from(parent.max[axis].abs().max(parent.min[axis].abs()) * f32::EPSILON);
                    let most = extent / 127.0 + 2.0 * rounding + f64::from(f32::MIN_POSITIVE);
                    let looseness = [child.min[axis] - low, high - child.max[axis]].map(f64::from);
                    assert!(looseness.iter().all(|l| *l <= most), "{name}: {looseness:?}, at most {most}");
                    n_children += 1;
                }
            }
            (below, n_below) = (below + n_below, n);
        }
        assert!(nodes.next().is_none(), "{name}: more nodes than boxes above the leaves");
    }
    assert!(n_children > 10_000, "{n_children}");
}
