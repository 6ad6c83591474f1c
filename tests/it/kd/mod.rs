//! kd-trees over triangles.

mod meshes;
mod queries;
mod trees;
mod watertight;
