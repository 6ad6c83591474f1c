//! kd-trees over triangles.

mod growing;
mod meshes;
mod queries;
mod trees;
mod watertight;
