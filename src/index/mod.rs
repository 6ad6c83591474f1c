//! Radius search over points, usable alone: nothing here knows of photons.

mod bvh;

use glam::Vec3;

pub use bvh::PointBvh;

/// Points in one leaf of [`PointBvh`].
pub const LEAF_SIZE: u32 = 8;
/// Children of one of its inner nodes.
pub const FANOUT: u32 = 8;

/// What every index answers.
pub trait RadiusSearch {
    /// Calls `visit` once for each point with |p − centre|² ≤ radius², squares taken in `f32` as x² + y² + z² from left
    /// to right; with the point's index and that squared distance. In no particular order.
    fn within(&self, centre: Vec3, radius: f32, visit: impl FnMut(u32, f32));
}

/// The squared distance as every index computes it.
#[inline]
pub fn distance2(a: Vec3, b: Vec3) -> f32 {
    let d = a - b;
    d.x * d.x + d.y * d.y + d.z * d.z
}

/// Tests every point: the oracle of the others.
#[derive(Clone, Copy, Debug)]
pub struct BruteForce<'a>(pub &'a [Vec3]);

impl RadiusSearch for BruteForce<'_> {
    fn within(&self, centre: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        for (i, &p) in self.0.iter().enumerate() {
            let d2 = distance2(p, centre);
            if d2 <= radius * radius {
                visit(i as u32, d2);
            }
        }
    }
}
