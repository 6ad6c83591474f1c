//! Mesh files: OBJ, PLY, STL, OFF and TetGen's `.node` with `.face` in; OBJ, PLY, STL and OFF out.
//!
//! Coordinates are read in double precision. A file is data from a stranger: every index is checked, and what a header
//! promises is compared with the file's size before anything is allocated for it.

mod obj;
mod off;
mod ply;
mod stl;
mod tetgen;
mod write;

use std::path::Path;

use glam::DVec3;

use super::{Error, Mesh};
use crate::files::open;
use crate::math::polygon::triangulate;

pub use obj::read_obj;
pub use off::read_off;
pub use ply::read_ply;
pub use stl::read_stl;
pub use tetgen::read_tetgen;
pub use write::{Format, write};

/// What [`read`] reads.
pub const EXTENSIONS: [&str; 6] = ["obj", "ply", "stl", "off", "node", "face"];

/// Faces of a file, at most, triangulated: as many as a kd-tree takes.
const MAX_FACES: usize = 1 << 28;
/// Vertices of a file, at most.
const MAX_VERTICES: usize = 1 << 30;

/// A mesh as a file has it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// In triangles: polygons are cut up. Vertices are the file's, in its order; of an STL, three for each facet.
    pub mesh: Mesh,
    /// For each face of `mesh`, which polygon of the file it is of: counted from 0 in the order of the file.
    pub polygons: Vec<u32>,
    /// Polygons of the file.
    pub n_polygons: usize,
}

impl Loaded {
    /// For readers that have no polygons.
    pub fn of_triangles(mesh: Mesh) -> Self {
        let n_polygons = mesh.faces.len();
        Self { mesh, polygons: (0..n_polygons as u32).collect(), n_polygons }
    }

    fn vertex(&mut self, p: [f64; 3]) -> Result<(), String> {
        if self.mesh.vertices.len() >= MAX_VERTICES {
            return Err(format!("more than {MAX_VERTICES} vertices"));
        }
        check_position(p)?;
        self.mesh.vertices.push(p);
        Ok(())
    }

    /// Corners as indices from 0, of vertices that are there. One of more than 64 corners is taken as convex.
    fn polygon(&mut self, corners: &[u32]) -> Result<(), String> {
        if corners.len() < 3 {
            return Err(format!("a face of {} corners", corners.len()));
        }
        if self.mesh.faces.len() + corners.len() - 2 > MAX_FACES {
            return Err(format!("more than {MAX_FACES} triangles"));
        }
        match *corners {
            [a, b, c] => self.mesh.faces.push([a, b, c]),
            _ => {
                let points: Vec<DVec3> = corners.iter().map(|&v| self.mesh.vertices[v as usize].into()).collect();
                self.mesh.faces.extend(triangulate(&points).map(|triangle| triangle.map(|i| corners[i])));
            }
        }
        self.polygons.resize(self.mesh.faces.len(), self.n_polygons as u32);
        self.n_polygons += 1;
        Ok(())
    }
}

/// Reads a `.obj`, `.ply`, `.stl`, `.off`, `.node` or `.face` file; of the last two either, with the other beside it.
///
/// The error names the file and the line, the vertex or the face.
pub fn read(path: &Path) -> Result<Loaded, Error> {
    let fail = |problem: String| Error::File { path: path.into(), problem };
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if matches!(extension.as_str(), "node" | "face") {
        let open = |extension: &str| {
            let path = path.with_extension(extension);
            open(&path).map_err(|problem| Error::File { path, problem })
        };
        let ((nodes, _), (faces, _)) = (open("node")?, open("face")?);
        return read_tetgen(nodes, faces)
            .map_err(|(extension, problem)| Error::File { path: path.with_extension(extension), problem });
    }
    let (file, size) = open(path).map_err(fail)?;
    let loaded = match extension.as_str() {
        "obj" => read_obj(file),
        "ply" => read_ply(file, size),
        "stl" => read_stl(file, size),
        "off" => read_off(file),
        "gltf" | "glb" => Err("glTF is read by sunfleck::scene::load::load_gltf_mesh".into()),
        _ => Err(format!("the extension {extension:?} is none of .{}", EXTENSIONS.join(", ."))),
    };
    loaded.map_err(fail)
}

fn check_position(p: [f64; 3]) -> Result<(), String> {
    /// What a kd-tree takes.
    const LIMIT: f64 = 1e90;
    match p.iter().position(|c| c.is_nan() || c.abs() > LIMIT) {
        Some(axis) => Err(format!("{} is {}", ["x", "y", "z"][axis], p[axis])),
        None => Ok(()),
    }
}

/// An index from 0 of `n` vertices.
fn check_index(index: i64, n: usize) -> Result<u32, String> {
    match u32::try_from(index) {
        Ok(found) if (found as usize) < n => Ok(found),
        _ => Err(format!("vertex {index} of {n}")),
    }
}
