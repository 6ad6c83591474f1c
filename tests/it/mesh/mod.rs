//! Triangle meshes: made, split and simplified.

mod generate;
