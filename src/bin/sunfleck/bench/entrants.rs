//! Which indices take part.

use glam::Vec3;
use sunfleck::index::{BruteForce, PointBvh};

use super::contest::{Entrant, Of};

/// The library's default.
pub const DEFAULT: &str = "bvh8";
/// The paper's method.
pub const METHOD: &str = "brute";
/// The paper's rival.
pub const RIVAL: &str = "brute";

/// Those of Figures 3 to 6.
pub fn radius_search(points: &[Vec3]) -> Vec<Box<dyn Entrant + '_>> {
    vec![
        Box::new(Of::new(DEFAULT, |_| PointBvh::new(points))),
        Box::new(Of::new("brute", |_| Ok(BruteForce(points)))),
    ]
}
