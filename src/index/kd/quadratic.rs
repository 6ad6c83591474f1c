//! O(N²): every plane against every triangle. Slow, and plain enough to check the others by.

use super::cell::Part;
use super::sah::{Cheapest, Counts};

/// Both faces of every box along every axis.
pub fn offer(parts: &[Part], cheapest: &mut Cheapest<'_>) {
    for axis in 0..3 {
        for part in parts {
            for at in [part.bounds.min[axis], part.bounds.max[axis]] {
                cheapest.offer(axis, at, count(parts, axis, at));
            }
        }
    }
}

fn count(parts: &[Part], axis: usize, at: f32) -> Counts {
    let mut counts = Counts { below: 0, planar: 0, above: 0 };
    for part in parts {
        let (min, max) = (part.bounds.min[axis], part.bounds.max[axis]);
        if min == at && max == at {
            counts.planar += 1;
        } else {
            counts.below += usize::from(min < at);
            counts.above += usize::from(max > at);
        }
    }
    counts
}
