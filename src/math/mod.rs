//! Directions, random numbers, warps and seeded point sets. Knows nothing of the rest of the crate.

pub mod basis;
pub mod clouds;
pub mod ggx;
pub mod morton;
pub mod oct;
pub mod polygon;
pub mod rng;
pub mod warp;
