//! Meshes out.

use std::io::{Result, Write};
use std::path::Path;

use crate::mesh::{Mesh, normal};

/// What a mesh is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `.obj`: text, exact.
    Obj,
    /// `.ply`: binary, little-endian, double precision.
    Ply,
    /// `.stl`: binary, of single precision; vertices are not shared.
    Stl,
    /// `.off`: text, exact.
    Off,
}

impl Format {
    /// By the extension.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "obj" => Some(Self::Obj),
            "ply" => Some(Self::Ply),
            "stl" => Some(Self::Stl),
            "off" => Some(Self::Off),
            _ => None,
        }
    }
}

/// Writes vertices and faces, in their order.
///
/// # Panics
/// If a face of an STL names a vertex that is not there.
pub fn write(out: &mut impl Write, mesh: &Mesh, format: Format) -> Result<()> {
    match format {
        Format::Obj => {
            for [x, y, z] in &mesh.vertices {
                writeln!(out, "v {x:?} {y:?} {z:?}")?;
            }
            for face in &mesh.faces {
                let [a, b, c] = face.map(|v| u64::from(v) + 1);
                writeln!(out, "f {a} {b} {c}")?;
            }
        }
        Format::Off => {
            writeln!(out, "OFF\n{} {} 0", mesh.vertices.len(), mesh.faces.len())?;
            for [x, y, z] in &mesh.vertices {
                writeln!(out, "{x:?} {y:?} {z:?}")?;
            }
            for [a, b, c] in &mesh.faces {
                writeln!(out, "3 {a} {b} {c}")?;
            }
        }
        Format::Ply => {
            let (vertices, faces) = (mesh.vertices.len(), mesh.faces.len());
            write!(
                out,
                "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty double x\nproperty double y\n\
                 property double z\nelement face {faces}\nproperty list uchar uint vertex_indices\nend_header\n"
            )?;
            for x in mesh.vertices.iter().flatten() {
                out.write_all(&x.to_le_bytes())?;
            }
            for face in &mesh.faces {
                out.write_all(&[3])?;
                face.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
            }
        }
        Format::Stl => {
            out.write_all(&[0; 80])?;
            out.write_all(&(mesh.faces.len() as u32).to_le_bytes())?;
            for face in &mesh.faces {
                let corners = face.map(|v| mesh.vertices[v as usize]);
                let normal = normal(corners).unwrap_or_default().to_array();
                for x in normal.iter().chain(corners.iter().flatten()) {
                    out.write_all(&(*x as f32).to_le_bytes())?;
                }
                out.write_all(&[0; 2])?;
            }
        }
    }
    Ok(())
}
