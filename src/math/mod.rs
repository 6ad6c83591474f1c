//! Directions, random numbers and warps. Knows nothing of the rest of the crate.

pub mod frame;
pub mod ggx;
pub mod morton;
pub mod oct;
pub mod rng;
pub mod warp;
