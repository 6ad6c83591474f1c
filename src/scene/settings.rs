//! The settings file that lies beside a scene: camera, lights and how to render, in TOML; the command line overrides it.
//!
//! ```toml
//! scene = "table.glb"
//! size = [1280, 720]
//! photons = "500k"
//!
//! [camera]
//! position = [0.0, 1.2, 3.0]
//! look_at = [0.0, 0.8, 0.0]
//! yfov_degrees = 35
//!
//! [[sphere]]
//! centre = [0.0, 1.0, 0.0]
//! radius = 0.2
//! glass = true
//!
//! [[material]] # one of the scene file, changed
//! name = "floor"
//! roughness = 0.2
//!
//! [[scene_light]] # one of the scene file, changed
//! name = "sun"
//! strength = 0.5
//! ```
//!
//! An override may set any of it ([`Settings::set`]): `photons=2M`, `camera.yfov_degrees=40`, `material.floor.roughness=0.2`.

mod apply;
mod changes;
mod difference;
mod text;
mod values;

pub use changes::{MaterialSettings, SceneLightSettings};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
pub use values::{Count, Direct, FirstRadius, Index, Kernel, LightKind, Size, ToneMap, parse_count};

use super::load::LoadError;
use super::{Accelerator, Environment};

/// Width and height of a picture, pixels, at most.
pub const MAX_SIDE: u32 = 65_535;
/// Exposure, stops up or down, at most.
pub const MAX_EXPOSURE: f32 = 64.0;

/// Whether alpha may be this: between 0 and 1, neither included.
pub fn is_alpha(x: f32) -> bool {
    x > 0.0 && x < 1.0
}

/// Reads the environment of a file, with warnings, as [`load_environment`](super::load::load_environment) does.
pub type ReadEnvironment<'a> = dyn FnMut(&Path) -> Result<(Environment, Vec<String>), LoadError> + 'a;

/// What a settings file says. A field left out has the default named, or keeps what the scene file says.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Settings {
    /// Scene file, relative to the settings file, or the name of a scene that comes with the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<String>,
    /// Picture, pixels: `[width, height]` or `"1280x720"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size: Option<Size>,
    /// Photons emitted an iteration: a number or text such as `"500k"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub photons: Option<Count>,
    /// Share of the radius' area that an iteration keeps, Knaus & Zwicker's α in (0, 1).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub alpha: Option<f32>,
    /// First radius: metres, or `"automatic"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<FirstRadius>,
    /// Density estimation kernel: `"epanechnikov"` or `"constant"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kernel: Option<Kernel>,
    /// Who brings light straight from a lamp: `"sampled"` or `"photons"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direct: Option<Direct>,
    /// What finds photons: `"tree"`, the default, or `"hardware"`, on a GPU with ray queries. The picture converges to the
    /// same; a device that cannot goes by the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub index: Option<Index>,
    /// What finds the surface a ray meets: `"bvh"`, the default, or `"kd"`, on the CPU. The picture is the same; a device
    /// that cannot goes by the default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accel: Option<Accelerator>,
    /// Stop after so many iterations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<Count>,
    /// Stop after so much time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seconds: Option<f64>,
    /// Same seed, same picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// Stops (powers of two) that the picture is brightened by for display.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exposure: Option<f32>,
    /// Tone curve for display: `"neutral"`, the default, `"agx"` or `"srgb"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tonemap: Option<ToneMap>,
    /// Longest path from lamp to lens, segments.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_segments: Option<u32>,
    /// Factor on every light: emissive surfaces, punctual lights, environment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub light_scale: Option<f32>,
    /// Camera to choose and change.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraSettings>,
    /// Light from infinitely far away.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentSettings>,
    /// Materials of the scene to change, in this order.
    #[serde(rename = "material", skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialSettings>,
    /// Punctual lights of the scene to change, in this order. Emissive surfaces are lights by their material.
    #[serde(rename = "scene_light", skip_serializing_if = "Vec::is_empty")]
    pub scene_lights: Vec<SceneLightSettings>,
    /// Spheres to add.
    #[serde(rename = "sphere", skip_serializing_if = "Vec::is_empty")]
    pub spheres: Vec<SphereSettings>,
    /// Lights to add.
    #[serde(rename = "light", skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightSettings>,
}

/// The camera: the one named (or of that number, from 0), else the scene's first, else one that frames the scene; then changed as said.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CameraSettings {
    /// A camera of the scene file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f32; 3]>,
    /// Point in the middle of the picture, metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub look_at: Option<[f32; 3]>,
    /// Viewing direction, of any length; instead of `look_at`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub forward: Option<[f32; 3]>,
    /// What is up in the picture, of any length; by default the axis of the scene's camera ([`super::Camera::up_axis`]), +y or +z.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<[f32; 3]>,
    /// Full vertical field of view, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yfov_degrees: Option<f32>,
    /// Half the height of the view, metres, of an orthographic camera; instead of `yfov_degrees`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ymag: Option<f32>,
    /// Radius of the lens, metres; 0 is a pinhole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_radius: Option<f32>,
    /// Distance of the plane in focus, metres; default: the distance to `look_at`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f32>,
}

/// The environment: a file, or one colour all around; without either, the scene's own, changed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EnvironmentSettings {
    /// `.hdr` or `.exr`, relative to the settings file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// About +y, counter-clockwise seen from above.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_degrees: Option<f32>,
    /// Factor.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength: Option<f32>,
    /// Linear RGB: the radiance without a file, a factor with one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<[f32; 3]>,
}

/// A sphere, with a material of the scene file or one of its own.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SphereSettings {
    /// Metres.
    pub centre: [f32; 3],
    /// Metres.
    pub radius: f32,
    /// Whether the front is the inside (a closed room).
    #[serde(default)]
    pub inward: bool,
    /// Name of a material of the scene file; excludes the fields below.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<String>,
    /// Linear RGB in [0, 1]; default grey, white for glass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_color: Option<[f32; 3]>,
    /// A smooth clear solid; default false.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub glass: Option<bool>,
    /// Index of refraction; default 1.5. Given, the surface also reflects as a dielectric.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ior: Option<f32>,
    /// In [0, 1]; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metallic: Option<f32>,
    /// Perceptual, in [0, 1]; default 0 for glass and metal, else 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<f32>,
    /// Absorption inside glass, 1/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorption: Option<[f32; 3]>,
    /// Radiance, linear RGB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emission: Option<[f32; 3]>,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightSettings {
    /// `"point"`, `"spot"` or `"directional"`.
    pub kind: LightKind,
    /// Metres; of point and spot lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position: Option<[f32; 3]>,
    /// The way the light travels, of any length; of spot and directional lights.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f32; 3]>,
    /// Candela (point, spot) or lux (directional).
    pub intensity: f32,
    /// Linear RGB; default white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<[f32; 3]>,
    /// Half-angle of full light, degrees, of spot lights; default 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub inner_degrees: Option<f32>,
    /// Half-angle of no light, degrees, of spot lights; default 45.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub outer_degrees: Option<f32>,
}

/// Why settings cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SettingsError {
    /// The file cannot be read.
    #[error("{}: {problem}", file.display())]
    Unreadable {
        /// As given by the caller.
        file: PathBuf,
        /// In words.
        problem: String,
    },
    /// A line of the file is wrong.
    #[error("{}:{line}: {field}: {problem}", file.display())]
    File {
        /// As given by the caller.
        file: PathBuf,
        /// From 1.
        line: usize,
        /// Dotted, `camera.yfov_degrees`, or a dot.
        field: String,
        /// In words.
        problem: String,
    },
    /// An override is wrong.
    #[error("{field}: {problem}")]
    Field {
        /// Dotted.
        field: String,
        /// In words.
        problem: String,
    },
    /// The environment cannot be read.
    #[error("environment.file: {0}")]
    Environment(#[from] LoadError),
}

/// A dotted field and what is wrong with it.
type Wrong = (String, String);
