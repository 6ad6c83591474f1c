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
//! ```

mod apply;
mod values;

use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use toml::de::DeTable;
pub use values::{Count, Direct, FirstRadius, Kernel, LightKind, Size, parse_count};

use super::load::{LoadError, files::read_regular};

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
    /// Photon paths emitted an iteration: a number or text such as `"500k"`.
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
    /// Spheres to add.
    #[serde(rename = "sphere", skip_serializing_if = "Vec::is_empty")]
    pub spheres: Vec<SphereSettings>,
    /// Lights to add.
    #[serde(rename = "light", skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightSettings>,
}

/// The camera: the one named, else the scene's first, else one that frames the scene; then changed as said.
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
    /// What is up in the picture, of any length; default +y.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub up: Option<[f32; 3]>,
    /// Full vertical field of view, degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yfov_degrees: Option<f32>,
    /// Radius of the lens, metres; 0 is a pinhole.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_radius: Option<f32>,
    /// Distance of the plane in focus, metres; default: the distance to `look_at`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub focus_distance: Option<f32>,
}

/// The environment: a file, or one colour all around.
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

impl Settings {
    /// Reads a settings file and checks every value by itself.
    pub fn load(path: &Path) -> Result<Self, SettingsError> {
        /// A settings file is written by hand.
        const MAX_BYTES: u64 = 16 << 20;
        let unreadable = |problem| SettingsError::Unreadable { file: path.into(), problem };
        let bytes = read_regular(path, MAX_BYTES).map_err(unreadable)?;
        let text = String::from_utf8(bytes).map_err(|_| unreadable("is not UTF-8 text".into()))?;
        Self::parse(&text, path)
    }

    /// Reads the text of a settings file; `file` is for messages.
    pub fn parse(text: &str, file: &Path) -> Result<Self, SettingsError> {
        let wrong = |offset: Option<usize>, field: String, problem: String| {
            let line =
                text.as_bytes()[..offset.unwrap_or(0).min(text.len())].iter().filter(|&&b| b == b'\n').count() + 1;
            SettingsError::File { file: file.into(), line, field, problem }
        };
        let deserializer = toml::Deserializer::parse(text).map_err(|e| {
            let offset = e.span().map(|span| span.start);
            let line =
                text.get(..offset.unwrap_or(0)).and_then(|before| text.lines().nth(before.matches('\n').count()));
            wrong(offset, "TOML".into(), format!("{}: {:.80?}", e.message(), line.unwrap_or("").trim()))
        })?;
        let settings: Self = serde_path_to_error::deserialize(deserializer).map_err(|e| {
            let field = e.path().to_string();
            let span = e.inner().span().map(|span| span.start).or_else(|| offset_of(text, &field));
            wrong(span, field, e.inner().message().into())
        })?;
        settings.check_values().map_err(|(field, problem)| wrong(offset_of(text, &field), field, problem))?;
        Ok(settings)
    }

    /// Overrides one field: `camera.yfov_degrees=40`, `photons=2M`, `sphere.0.radius=0.5`.
    ///
    /// The value is TOML, or else text.
    pub fn set(&mut self, assignment: &str) -> Result<(), SettingsError> {
        let wrong = |(field, problem): Wrong| SettingsError::Field { field, problem };
        let (key, value) = assignment
            .split_once('=')
            .ok_or_else(|| wrong((assignment.into(), "an override has the form field=value".into())))?;
        let (key, value) = (key.trim(), value.trim());
        let value = match toml::from_str::<toml::Table>(&format!("v = {value}")) {
            Ok(mut table) if table.len() == 1 => table.remove("v"),
            _ => None,
        }
        .unwrap_or_else(|| toml::Value::String(value.into()));
        let mut root = toml::Value::try_from(&*self).map_err(|e| wrong((key.into(), e.to_string())))?;
        *entry(&mut root, key).map_err(|problem| wrong((key.into(), problem)))? = value;
        let changed: Self = serde_path_to_error::deserialize(root).map_err(|e| {
            let field = e.path().to_string();
            wrong((field, e.inner().message().into()))
        })?;
        changed.check_values().map_err(wrong)?;
        *self = changed;
        Ok(())
    }
}

/// The value at a dotted key; tables on the way are made.
fn entry<'v>(root: &'v mut toml::Value, key: &str) -> Result<&'v mut toml::Value, String> {
    let mut value = root;
    for part in key.split('.') {
        value = match value {
            toml::Value::Table(table) => table.entry(part).or_insert_with(|| toml::Value::Table(toml::Table::new())),
            toml::Value::Array(list) => {
                let n = list.len();
                let index = part.parse::<usize>().map_err(|_| format!("{part:?} is not a number: there are {n}"))?;
                list.get_mut(index).ok_or_else(|| format!("there is no number {index}: there are {n}, from 0"))?
            }
            _ => return Err(format!("{part:?} is not a field")),
        };
    }
    Ok(value)
}

/// Where in the text the value of a dotted field begins, or the innermost table around it.
fn offset_of(text: &str, field: &str) -> Option<usize> {
    let table = DeTable::parse(text).ok()?;
    let mut offset = None;
    let mut value: Option<&toml::de::DeValue> = None;
    // As serde_path_to_error writes them: a.b[0].c
    for part in field.split(['.', '[', ']']).filter(|part| !part.is_empty()) {
        let next = match (value, part.parse::<usize>()) {
            (None, _) => table.get_ref().get(part),
            (Some(toml::de::DeValue::Array(list)), Ok(index)) => list.get(index),
            (Some(toml::de::DeValue::Table(table)), _) => table.get(part),
            _ => None,
        };
        let Some(next) = next else { break };
        offset = Some(next.span().start);
        value = Some(next.get_ref());
    }
    offset
}
