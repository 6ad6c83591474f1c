//! kd-trees over triangles.

mod growing;
pub mod meshes;
mod queries;
mod trees;
mod watertight;
