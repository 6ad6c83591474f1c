//! Point cloud files: PLY (ascii, binary of both byte orders), XYZ text and OBJ vertices in, binary PLY out.
//!
//! A file is data from a stranger: what its header promises is compared with its size before anything is allocated for.

mod ply;
mod text;

use std::path::Path;

pub use ply::{read_ply, write_ply};
pub use text::{read_obj, read_xyz};

use super::{Cloud, Error};
use crate::files::open;

/// Reads a `.ply`, `.obj`, `.xyz`, `.txt` or `.asc` file.
///
/// Of a PLY or OBJ the vertices are taken, not the faces. The error names the file and the line or the vertex.
pub fn read(path: &Path) -> Result<Cloud, Error> {
    let fail = |problem: String| Error::File { path: path.into(), problem };
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let (file, size) = open(path).map_err(fail)?;
    let cloud = match extension.as_str() {
        "ply" => read_ply(file, size),
        "obj" => read_obj(file),
        "xyz" | "txt" | "asc" => read_xyz(file),
        _ => Err(format!("the extension {extension:?} is none of .ply, .obj, .xyz, .txt and .asc")),
    };
    cloud.map_err(fail)
}
