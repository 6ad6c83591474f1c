//! What readers of files have in common. Shared by the tasks on points and on meshes, by scenes and by pictures.
//!
//! A file is data from a stranger: what its header promises is compared with its size before anything is allocated for.

#[cfg(feature = "render")]
pub mod exr;
mod lines;
pub mod ply;

use std::fs::File;
use std::io::{BufReader, ErrorKind};
use std::path::Path;

pub use lines::{lines, number};

/// A regular file, and its size in bytes.
pub fn open(path: &Path) -> Result<(BufReader<File>, u64), String> {
    // Before it is opened: opening a pipe would wait for a writer.
    let metadata = std::fs::metadata(path).map_err(|e| plain(&e))?;
    if !metadata.is_file() {
        return Err("is not a regular file".into());
    }
    Ok((BufReader::with_capacity(1 << 16, File::open(path).map_err(|e| plain(&e))?), metadata.len()))
}

/// What went wrong in words: the system's, if it was the system, without the number that says the same.
pub fn plain(error: &std::io::Error) -> String {
    let text = error.to_string();
    match error.kind() {
        _ if error.raw_os_error().is_some() => text.split(" (os error ").next().unwrap_or(&text).to_owned(),
        ErrorKind::Other | ErrorKind::InvalidInput | ErrorKind::InvalidData => text,
        kind => kind.to_string(),
    }
}

/// A hostile word need not fill the screen.
pub fn shorten(word: &str) -> String {
    const LIMIT: usize = 40;
    let clean: String = word.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).take(LIMIT + 1).collect();
    match clean.char_indices().nth(LIMIT) {
        Some((end, _)) => format!("{}…", &clean[..end]),
        None => clean,
    }
}
