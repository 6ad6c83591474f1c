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

use glam::DVec3;

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
    #[error("more than {0} pairs of faces intersect or touch: this is not a surface")]
    Tangled(usize),
    /// So many pairs that looking at them would take too long. Without [`CheckOptions::intersections`] there is a report.
    #[error("the boxes of more than {0} pairs of faces overlap: too many to be tested")]
    Crowded(usize),
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

/// Of length 1, whatever the unit; none if rounding leaves none.
fn normal([a, b, c]: [[f64; 3]; 3]) -> Option<DVec3> {
    let (ab, ac) = (DVec3::from(b) - DVec3::from(a), DVec3::from(c) - DVec3::from(a));
    // Of lengths near 1, so that nothing vanishes when it is squared.
    let longest = largest(ab).max(largest(ac));
    let normal = (ab / longest).cross(ac / longest);
    let length = normal.length();
    (length > 0.0).then(|| normal / length)
}

/// Least and greatest corner of the box around some points.
fn corners_of_box(points: impl Iterator<Item = [f64; 3]>) -> [DVec3; 2] {
    let all = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    points.map(DVec3::from).fold(all, |[min, max], p| [min.min(p), max.max(p)])
}

/// Largest magnitude of a coordinate.
fn largest(a: DVec3) -> f64 {
    a.abs().max_element()
}
