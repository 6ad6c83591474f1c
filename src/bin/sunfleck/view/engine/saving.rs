//! A film on its way to a file.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::Result;
use sunfleck::output;
use sunfleck::output::display::Look;

use super::Frame;

/// What to write, and where.
#[derive(Clone, Debug, PartialEq)]
pub struct Save {
    /// `.exr` or `.png`.
    pub path: PathBuf,
    pub look: Look,
}

/// The newest film that was read back, and what rendered it.
pub struct Newest {
    pub frame: Arc<Frame>,
    pub device: String,
}

impl Newest {
    /// Returns the number of its iterations.
    pub fn write(self, save: &Save) -> Result<u32> {
        let Self { frame, device } = self;
        let (film, params) = (&frame.film, &frame.params);
        let picture = frame.picture();
        if is_png(&save.path) {
            output::png::write(&save.path, &picture, &save.look)?;
        } else {
            let header = output::exr::Header {
                scene: frame.opened.source.name.clone(),
                command: frame.opened.command(&frame.settings, frame.backend, film.n_iterations, &save.path),
                adapter: device,
                seed: params.seed,
                alpha: params.alpha,
                first_radius: frame.first_radius,
                last_radius: frame.radius,
                iterations: film.n_iterations,
                photons_per_iteration: params.n_paths,
                seconds: frame.seconds,
                camera: frame.camera,
            };
            output::exr::write(&save.path, &picture, &header)?;
        }
        Ok(film.n_iterations)
    }
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
}
