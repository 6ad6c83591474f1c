//! Reading scene files.
//!
//! A scene file is data from a stranger: every index, offset, count and size is checked before it is used or allocated
//! for, nothing outside the file's folder is opened, and only regular files are read. That is why glTF and OBJ are read
//! here rather than by the crates of those names, which panic, hang or follow `../` on some files; serde and the image
//! decoders do the rest under limits.

mod environment;
pub(super) mod files;
mod geometry;
mod gltf;
mod image;
mod mtl;
mod obj;
mod packing;

use super::Scene;
use crate::device::Interrupt;
use crate::mesh;
pub use environment::load_environment;
use files::Source;
use std::path::{Path, PathBuf};

/// Bytes of one file, at most.
const MAX_FILE_BYTES: u64 = 4 << 30;
/// Vertices of a scene, at most, instances counted.
const MAX_VERTICES: u64 = 256 << 20;
/// Triangles of a scene, at most, instances counted.
const MAX_TRIANGLES: u64 = 256 << 20;
/// Meshes of a scene, at most, instances counted.
const MAX_MESHES: u64 = 4 << 20;
/// Texels of a scene's images, at most.
const MAX_TEXELS: u64 = 1 << 30;
/// Width and height of an image, at most: sizes are packed into 16 bits for the backends.
const MAX_IMAGE_SIDE: u32 = 16_384;
/// Bytes that decoding one image may take.
const MAX_DECODE_BYTES: u64 = 512 << 20;
/// Metres from the origin, at most: squares of areas stay finite in f32.
const MAX_COORDINATE: f32 = 1e9;
/// Of a scene's size, how far apart coordinates may be: at ten times as much, light leaks and shadows break up.
const COARSE: f32 = 1e-5;
/// Warnings kept; the rest is counted.
const MAX_WARNINGS: usize = 100;

/// A scene, and what in its file was not honoured.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// [`Scene::check`] holds, unless there is nothing to see in it; it may have no camera and no light.
    pub scene: Scene,
    /// For the user, each naming the place in the file.
    pub warnings: Vec<String>,
}

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file that was asked for cannot be read.
    #[error("{}: {problem}", file.display())]
    Unreadable {
        /// As given by the caller.
        file: PathBuf,
        /// In words.
        problem: String,
    },
    /// Not what its name or its first bytes promise.
    #[error("{}: {problem}", file.display())]
    Format {
        /// As given by the caller.
        file: PathBuf,
        /// In words.
        problem: String,
    },
    /// A field or line is wrong.
    #[error("{}: {place}: {problem}", file.display())]
    Invalid {
        /// As given by the caller.
        file: PathBuf,
        /// Field (`meshes[0].primitives[2].indices`) or line.
        place: String,
        /// In words.
        problem: String,
    },
    /// A file named by the scene file cannot be used.
    #[error("{}: {place}: {}: {problem}", file.display(), path.display())]
    External {
        /// As given by the caller.
        file: PathBuf,
        /// Field or line that names it.
        place: String,
        /// The file named.
        path: PathBuf,
        /// In words.
        problem: String,
    },
    /// The file says that it cannot be shown without an extension that is not read here.
    #[error("{}: extensionsRequired: {extension} is not supported{hint}", file.display())]
    Extension {
        /// As given by the caller.
        file: PathBuf,
        /// Name of the extension.
        extension: String,
        /// What the user can do, or nothing.
        hint: &'static str,
    },
    /// Beyond a limit that keeps memory bounded.
    #[error("{}: {place}: {problem}", file.display())]
    TooLarge {
        /// As given by the caller.
        file: PathBuf,
        /// Field or line.
        place: String,
        /// In words, with the limit.
        problem: String,
    },
    /// An [`Interrupt`] ended the reading.
    #[error("interrupted")]
    Interrupted,
}

/// Reads a `.gltf`, `.glb` or `.obj` file.
///
/// Textures and buffers are looked for in the file's folder and below, never outside.
pub fn load(path: &Path) -> Result<Loaded, LoadError> {
    load_unless(path, &Interrupt::default())
}

/// The same, unless `interrupt` ends it: with [`LoadError::Interrupted`], soon, but for the reading of a single large file
/// from the disk, and for what is done at once to a single large mesh or image.
pub fn load_unless(path: &Path, interrupt: &Interrupt) -> Result<Loaded, LoadError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    if !matches!(extension.as_str(), "gltf" | "glb" | "obj") {
        // Say "no such file" before "unknown extension".
        files::check_regular(path).map_err(|problem| LoadError::Unreadable { file: path.into(), problem })?;
        let problem = match extension.as_str() {
            "toml" => "is a settings file, where a scene is asked for: .gltf, .glb or .obj".into(),
            _ => format!("the extension {extension:?} is none of .gltf, .glb and .obj (settings: .toml)"),
        };
        return Err(LoadError::Format { file: path.into(), problem });
    }
    let (source, bytes) = Source::open(path, interrupt)?;
    let mut warnings = Warnings::default();
    let scene = if extension == "obj" {
        obj::load(&source, &bytes, &mut warnings)?
    } else {
        gltf::load(&source, &bytes, &mut warnings)?
    };
    if let Some(warning) = far_away(&scene) {
        warnings.push(format!("{}: {warning}", path.display()));
    }
    if scene.meshes.iter().all(|mesh| mesh.triangles.is_empty()) {
        warnings.push(format!("{}: there are no triangles", path.display()));
    }
    Ok(Loaded { scene, warnings: warnings.finish() })
}

/// What is to be said of a scene that is so far from the origin, for its size, that f32 has too few places for it.
fn far_away(scene: &Scene) -> Option<String> {
    let [low, high] = scene.bounds(&[])?;
    let (size, farthest) = (low.distance(high), low.abs().max(high.abs()).max_element());
    let step = farthest.next_up() - farthest;
    let metres = |x: f32| if x < 10.0 { format!("{x:.1e} m") } else { format!("{x:.0} m") };
    (step > COARSE * size && size > 0.0).then(|| {
        format!(
            "lies {} from the origin, where coordinates are {} apart: too coarse for a scene of {}; move it to the origin",
            metres(farthest),
            metres(step),
            metres(size)
        )
    })
}

/// Reads the triangles of a `.gltf` or `.glb` file for a check: in double precision, nodes applied, faces in the order of the
/// nodes and their primitives. And what in the file was not honoured.
pub fn load_gltf_mesh(path: &Path) -> Result<(mesh::io::Loaded, Vec<String>), LoadError> {
    let (source, bytes) = Source::open(path, &Interrupt::default())?;
    let mut warnings = Warnings::default();
    let mesh = gltf::load_geometry(&source, &bytes, &mut warnings)?;
    Ok((mesh::io::Loaded::of_triangles(mesh), warnings.finish()))
}

/// Collects warnings, each once, a bounded number of them.
#[derive(Default)]
struct Warnings {
    lines: Vec<String>,
    /// Of [`Self::push_once`].
    topics: Vec<String>,
    n_dropped: usize,
    /// Triangles without area, and where the first was.
    flat: Option<(usize, String)>,
}

impl Warnings {
    fn push(&mut self, line: String) {
        if self.lines.contains(&line) {
            return;
        }
        if self.lines.len() < MAX_WARNINGS {
            self.lines.push(line);
        } else {
            self.n_dropped += 1;
        }
    }

    /// Says `topic` only where it first comes up.
    fn push_once(&mut self, topic: &str, place: &dyn std::fmt::Display) {
        if self.topics.len() < MAX_WARNINGS && !self.topics.iter().any(|t| t == topic) {
            self.topics.push(topic.into());
            self.push(format!("{place}: {topic}"));
        }
    }

    /// Counts triangles that were left out.
    fn add_flat(&mut self, n: usize, place: &str) {
        self.flat.get_or_insert_with(|| (0, place.into())).0 += n;
    }

    fn finish(mut self) -> Vec<String> {
        if let Some((n, place)) = self.flat.take() {
            self.push(format!("{n} triangles without area are left out, the first in {place}"));
        }
        if self.n_dropped > 0 {
            self.lines.push(format!("{} more warnings of this file are not shown", self.n_dropped));
        }
        self.lines
    }
}

/// What is left of the limits on a scene's size.
struct Budget {
    vertices: u64,
    triangles: u64,
    meshes: u64,
}

impl Budget {
    fn new() -> Self {
        Self { vertices: MAX_VERTICES, triangles: MAX_TRIANGLES, meshes: MAX_MESHES }
    }

    /// Takes `copies` meshes of that many vertices and triangles; the error says which limit they exceed.
    fn take(&mut self, vertices: u64, triangles: u64, copies: u64) -> Result<(), String> {
        let spend = |left: &mut u64, each: u64, what: &str, limit: u64| {
            *left = each
                .checked_mul(copies)
                .and_then(|all| left.checked_sub(all))
                .ok_or_else(|| format!("{copies} × {each} {what}: more than {limit} {what} in the scene"))?;
            Ok(())
        };
        spend(&mut self.meshes, 1, "meshes", MAX_MESHES)?;
        spend(&mut self.vertices, vertices, "vertices", MAX_VERTICES)?;
        spend(&mut self.triangles, triangles, "triangles", MAX_TRIANGLES)
    }
}
