//! Point cloud files: PLY (ascii, binary of both byte orders), XYZ text and OBJ vertices in, binary PLY out.
//!
//! A file is data from a stranger: what its header promises is compared with its size before anything is allocated for.

mod ply;
mod text;

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

pub use ply::{read_ply, write_ply};
pub use text::{read_obj, read_xyz};

use super::{Cloud, Error};

/// Points of a file, at most: indices are written as PLY's `int`.
const MAX_POINTS: u64 = i32::MAX as u64;

/// Reads a `.ply`, `.obj`, `.xyz`, `.txt` or `.asc` file.
///
/// Of a PLY or OBJ the vertices are taken, not the faces. The error names the file and the line or the vertex.
pub fn read(path: &Path) -> Result<Cloud, Error> {
    let fail = |problem: String| Error::File { path: path.into(), problem };
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    // Before it is opened: opening a pipe would wait for a writer.
    let metadata = std::fs::metadata(path).map_err(|e| fail(plain(&e)))?;
    if !metadata.is_file() {
        return Err(fail("is not a regular file".into()));
    }
    let file = BufReader::with_capacity(1 << 16, File::open(path).map_err(|e| fail(plain(&e)))?);
    let cloud = match extension.as_str() {
        "ply" => read_ply(file, metadata.len()),
        "obj" => read_obj(file),
        "xyz" | "txt" | "asc" => read_xyz(file),
        _ => Err(format!("the extension {extension:?} is none of .ply, .obj, .xyz, .txt and .asc")),
    };
    cloud.map_err(fail)
}

/// What the system says, in words.
fn plain(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::Other | ErrorKind::InvalidInput | ErrorKind::InvalidData => error.to_string(),
        kind => kind.to_string(),
    }
}

/// A hostile word need not fill the screen.
fn shorten(word: &str) -> String {
    const LIMIT: usize = 40;
    let clean: String = word.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).take(LIMIT + 1).collect();
    match clean.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}…", &clean[..end]),
        None => clean,
    }
}
