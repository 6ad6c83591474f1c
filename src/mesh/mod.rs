//! Triangle meshes as such: made by a rule, read from a file, and checked: closed, manifold, normals outward?
//!
//! Double precision throughout: the answers do not depend on the unit of length, or on where the mesh lies.

mod collapse;
pub mod generate;
pub mod resize;

use crate::index::kd;

/// Vertices, and three of them for each face, anticlockwise as seen from where its normal (b − a) × (c − a) points to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// In any unit.
    pub vertices: Vec<[f64; 3]>,
    /// Indices of vertices.
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// What a kd-tree is built over; refuses indices out of range, and coordinates that are not finite.
    pub fn triangles(&self) -> Result<kd::Triangles<f64>, kd::Error> {
        kd::Triangles::new(self.vertices.clone(), self.faces.clone())
    }
}
