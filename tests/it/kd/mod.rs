//! kd-trees over triangles.

pub mod meshes;
mod queries;
mod trees;
mod watertight;
