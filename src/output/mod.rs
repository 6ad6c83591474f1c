//! Pictures on disk: OpenEXR with everything needed to make them again, PNG to look at; pictures on a screen; and how
//! two pictures differ.

pub mod atomic;
pub mod compare;
pub mod convergence;
pub mod difference;
pub mod display;
pub mod exr;
pub mod false_colour;
pub mod flip;
pub mod histogram;
pub mod png;
pub mod tonemap;

use std::path::{Path, PathBuf};

/// Version and commit of this build, such as "0.1.0 (86139c9a1b2c)".
pub const VERSION: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("SUNFLECK_COMMIT"), ")");

/// A picture in memory: scene-linear, the part of it that was computed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Picture {
    /// Of the whole picture, pixels: width, height.
    pub size: [u32; 2],
    /// The part that is here, pixels: x0, y0, x1, y1 (exclusive), y down.
    pub crop: [u32; 4],
    /// Radiance, linear RGB with the sRGB primaries, row-major over the crop.
    pub rgb: Vec<[f32; 3]>,
    /// Estimated variance of each pixel's luminance, row-major over the crop.
    pub variance: Option<Vec<f32>>,
}

impl Picture {
    /// Width and height of the part that is here, pixels.
    pub fn crop_size(&self) -> [usize; 2] {
        [(self.crop[2] - self.crop[0]) as usize, (self.crop[3] - self.crop[1]) as usize]
    }
}

/// Why a picture could not be written or read. One line, with the file's name.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file system refused.
    #[error("cannot write {}: {reason}", path.display())]
    Write {
        /// The file asked for.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The file cannot be read, or is not what its name says.
    #[error("cannot read {}: {reason}", path.display())]
    Read {
        /// The file asked for.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
}

impl Error {
    fn write(path: &Path, error: std::io::Error) -> Self {
        Self::Write { path: path.to_owned(), reason: without_number(error) }
    }

    fn read(path: &Path, error: impl ToString) -> Self {
        Self::Read { path: path.to_owned(), reason: without_number(error) }
    }
}

/// "No such file or directory (os error 2)" says the same without its end.
fn without_number(error: impl ToString) -> String {
    let text = error.to_string();
    match text.rfind(" (os error ") {
        Some(end) if text.ends_with(')') => text[..end].to_owned(),
        _ => text,
    }
}
