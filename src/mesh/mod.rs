//! Triangle meshes as such: made by a rule, read from a file, and checked: closed, manifold, normals outward?
//!
//! Double precision throughout: the answers do not depend on the unit of length, or on where the mesh lies.
//!
//! ```
//! use sunfleck::mesh::{CheckOptions, Mesh, Verdict, check};
//!
//! let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let mut mesh = Mesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] };
//! assert_eq!(check(&mesh, &CheckOptions::default())?.verdict, Verdict::Outward);
//! mesh.flip(&[2]);
//! let report = check(&mesh, &CheckOptions::default())?;
//! assert_eq!((report.verdict, report.inward), (Verdict::Mixed, vec![2]));
//! # Ok::<(), sunfleck::mesh::Error>(())
//! ```

mod check;
mod collapse;
mod crossings;
pub mod generate;
pub mod io;
pub mod orientation;
mod overlaps;
mod report;
pub mod resize;
mod topology;

pub use check::{CheckOptions, check};
pub use report::{Doubt, Report, Shell, Verdict};

use std::path::PathBuf;

use crate::index::kd;

/// Vertices, and three of them for each face, anticlockwise as seen from where its normal (b − a) × (c − a) points to.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// In any unit.
    pub vertices: Vec<[f64; 3]>,
    /// Indices of vertices.
    pub faces: Vec<[u32; 3]>,
}

/// Why a mesh cannot be checked. One line.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// An index out of range, a coordinate that is not finite or too large, or too many faces.
    #[error(transparent)]
    Mesh(#[from] kd::Error),
    /// A file cannot be read, or is not what its name says.
    #[error("{}: {problem}", path.display())]
    File {
        /// As given, or the one beside it.
        path: PathBuf,
        /// In words, with the line, the vertex or the face.
        problem: String,
    },
    /// So many pairs that listing them helps nobody.
    #[error("more than {0} pairs of faces intersect: this is not a surface")]
    Tangled(usize),
}

impl Mesh {
    /// What a kd-tree is built over; refuses indices out of range, and coordinates that are not finite.
    pub fn triangles(&self) -> Result<kd::Triangles<f64>, kd::Error> {
        kd::Triangles::new(self.vertices.clone(), self.faces.clone())
    }

    /// Turns the normals of these faces round: the second and third corner change places. Indices out of range are ignored.
    pub fn flip(&mut self, faces: &[u32]) {
        for &face in faces {
            if let Some(corners) = self.faces.get_mut(face as usize) {
                corners.swap(1, 2);
            }
        }
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Largest magnitude of a coordinate.
fn largest(a: [f64; 3]) -> f64 {
    a[0].abs().max(a[1].abs()).max(a[2].abs())
}
