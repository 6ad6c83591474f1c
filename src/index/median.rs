//! Median splits: how points are put into the order of a balanced kd-tree.

use glam::Vec3;

use super::blocks::{NOTHING, join};
use super::lanes::WIDTH;

/// Points below which a part is sorted on one thread.
const SERIAL: usize = 4096;

/// A point and its index.
pub type Numbered = (Vec3, u32);

/// Moves the `middle` points that come first along the widest axis to the front; that axis. Points at the same place on
/// it are in order of the index, so that the halves do not depend on threads.
pub fn halve(points: &mut [Numbered], middle: usize) -> usize {
    let (min, max) = points.iter().fold(NOTHING, |b, &(p, _)| join(b, (p, p)));
    let axis = (max - min).max_position();
    points.select_nth_unstable_by(middle, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    axis
}

/// Both halves of `n_first` and some points, at the same time if they are large.
pub fn both(n_first: usize, first: impl FnOnce() + Send, second: impl FnOnce() + Send) {
    if n_first < SERIAL {
        first();
        second();
    } else {
        rayon::join(first, second);
    }
}

/// Sorts points for a tree of eight children a node and eight points a leaf: halved, and halved again, where its nodes end.
pub fn sort(points: &mut [Numbered]) {
    let mut child = WIDTH;
    while child * WIDTH < points.len() {
        child *= WIDTH;
    }
    sort_node(points, child);
}

/// Sorts some of the children of a node, of so many points each.
fn sort_node(points: &mut [Numbered], child: usize) {
    match points.len().div_ceil(child) {
        0 | 1 if child <= WIDTH => {}
        0 | 1 => sort_node(points, child / WIDTH),
        n => {
            let middle = n / 2 * child;
            halve(points, middle);
            let (first, second) = points.split_at_mut(middle);
            both(middle, || sort_node(first, child), || sort_node(second, child));
        }
    }
}
