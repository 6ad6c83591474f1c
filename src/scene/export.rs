//! Writes a scene as binary glTF 2.0, with all that glTF and its Khronos extensions can say of it.
//!
//! What they cannot say: the environment (see [`write_environment_hdr`]), a lens's aperture and focus (kept under the
//! camera's `extras`), and analytic spheres, which are tessellated. Same scene, same bytes.

mod materials;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use glam::{Mat3, Quat, Vec3};
use serde_json::{Map, Value, json};

use super::shipped::sphere_mesh;
use super::{Camera, Environment, Mesh, Projection, PunctualKind, PunctualLight, Scene};

/// Why a scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The file system refused.
    #[error("cannot write {}: {source}", path.display())]
    Io {
        /// What was to be written.
        path: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// An image could not be encoded.
    #[error("cannot encode image `{name}`: {source}")]
    Image {
        /// Of the image.
        name: String,
        /// Why not.
        source: image::ImageError,
    },
    /// A texture's coordinates are sheared, and `KHR_texture_transform` knows scale, rotation and offset only.
    #[error("material `{material}`: a sheared texture transform cannot be expressed in glTF")]
    ShearedTexture {
        /// Of the material.
        material: String,
    },
    /// A number is infinite or not a number.
    #[error("{place} is not a finite number")]
    NotFinite {
        /// Where.
        place: String,
    },
    /// A part refers to another that is not there.
    #[error("{place} refers to something that is not in the scene")]
    Dangling {
        /// Where.
        place: String,
    },
    /// A .glb file counts its bytes in 32 bits.
    #[error("the scene takes {bytes} bytes, more than the 4 GiB that a .glb file can hold")]
    TooLarge {
        /// Needed.
        bytes: usize,
    },
}

/// Writes `scene` to `path` as binary glTF.
pub fn write_glb(scene: &Scene, path: &Path) -> Result<(), ExportError> {
    let bytes = glb_bytes(scene)?;
    std::fs::write(path, bytes).map_err(|source| ExportError::Io { path: path.into(), source })
}

/// `scene` as the bytes of a binary glTF file.
pub fn glb_bytes(scene: &Scene) -> Result<Vec<u8>, ExportError> {
    let mut writer = Writer::default();
    // Cameras are chosen by name and keep theirs.
    writer.node_names.extend(scene.cameras.iter().map(|c| c.name.clone()));
    for (i, mesh) in scene.meshes.iter().enumerate() {
        writer.mesh(scene, mesh, &format!("mesh {i} `{}`", mesh.name))?;
    }
    for (i, sphere) in scene.spheres.iter().enumerate() {
        let place = format!("sphere {i}");
        writer.mesh(scene, &sphere_mesh(&place, sphere), &place)?;
    }
    writer.materials(scene)?;
    for light in &scene.lights {
        writer.light(light)?;
    }
    for camera in &scene.cameras {
        writer.camera(camera)?;
    }
    writer.finish()
}

/// Writes an environment beside a scene as Radiance RGBE: texels without `strength`, `tint` and `rotation`, row 0 on top.
pub fn write_environment_hdr(environment: &Environment, path: &Path) -> Result<(), ExportError> {
    let texels: Vec<_> = environment.texels.iter().map(|t| image::Rgb(t.to_array())).collect();
    let mut bytes = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut bytes)
        .encode(&texels, environment.width as usize, environment.height as usize)
        .map_err(|source| ExportError::Image { name: "environment".into(), source })?;
    std::fs::write(path, bytes).map_err(|source| ExportError::Io { path: path.into(), source })
}

/// Magic numbers of the format.
const FLOAT: u32 = 5126;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// The document in the making.
#[derive(Default)]
struct Writer {
    bin: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    meshes: Vec<Value>,
    nodes: Vec<Value>,
    cameras: Vec<Value>,
    lights: Vec<Value>,
    materials: Vec<Value>,
    textures: Vec<Value>,
    samplers: Vec<Value>,
    images: Vec<Value>,
    /// Smallest extent of the meshes of a material, metres.
    thickness: Vec<f32>,
    extensions: BTreeSet<&'static str>,
    node_names: BTreeSet<String>,
}

impl Writer {
    /// A buffer view with these bytes; its index.
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        let offset = self.bin.len();
        self.bin.extend_from_slice(bytes);
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": offset, "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.views.push(view);
        self.views.len() - 1
    }

    /// An accessor of vertex data, `[rows · columns]`; its index.
    fn floats(&mut self, values: &[f32], kind: &str, columns: usize, place: &str) -> Result<usize, ExportError> {
        if values.iter().any(|v| !v.is_finite()) {
            return Err(ExportError::NotFinite { place: place.into() });
        }
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(ARRAY_BUFFER));
        let count = values.len() / columns;
        self.accessors.push(json!({ "bufferView": view, "componentType": FLOAT, "count": count, "type": kind }));
        Ok(self.accessors.len() - 1)
    }

    fn mesh(&mut self, scene: &Scene, mesh: &Mesh, place: &str) -> Result<(), ExportError> {
        let dangling = || ExportError::Dangling { place: place.into() };
        if mesh.material >= scene.materials.len() {
            return Err(dangling());
        }
        let n = mesh.positions.len();
        if mesh.triangles.is_empty() {
            return Ok(()); // glTF has no empty accessors.
        }
        if mesh.triangles.iter().flatten().any(|&i| i as usize >= n) {
            return Err(dangling());
        }
        let mut attributes = Map::new();
        let flat: Vec<f32> = mesh.positions.iter().flat_map(|p| p.to_array()).collect();
        let positions = self.floats(&flat, "VEC3", 3, place)?;
        let (low, high) = mesh
            .positions
            .iter()
            .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
        self.accessors[positions]["min"] = numbers(&low.to_array(), place)?;
        self.accessors[positions]["max"] = numbers(&high.to_array(), place)?;
        self.thickness.resize(scene.materials.len(), f32::INFINITY);
        let thickness = &mut self.thickness[mesh.material];
        *thickness = thickness.min((high - low).min_element().max(1e-4));
        attributes.insert("POSITION".into(), json!(positions));

        let mut attribute = |name: &str, values: Vec<f32>, kind: &str, columns: usize| {
            if !values.is_empty() {
                let accessor = self.floats(&values, kind, columns, place)?;
                attributes.insert(name.into(), json!(accessor));
            }
            Ok::<_, ExportError>(())
        };
        attribute("NORMAL", mesh.normals.iter().flat_map(|v| v.to_array()).collect(), "VEC3", 3)?;
        attribute("TANGENT", mesh.tangents.iter().flat_map(|v| v.to_array()).collect(), "VEC4", 4)?;
        attribute("TEXCOORD_0", mesh.uv0.iter().flat_map(|v| v.to_array()).collect(), "VEC2", 2)?;
        attribute("TEXCOORD_1", mesh.uv1.iter().flat_map(|v| v.to_array()).collect(), "VEC2", 2)?;
        if mesh.colors.iter().all(|c| c.w == 1.0) {
            attribute("COLOR_0", mesh.colors.iter().flat_map(|v| v.truncate().to_array()).collect(), "VEC3", 3)?;
        } else {
            attribute("COLOR_0", mesh.colors.iter().flat_map(|v| v.to_array()).collect(), "VEC4", 4)?;
        }

        let indices = mesh.triangles.iter().flatten();
        // 65535 restarts primitives and is no index.
        let (bytes, component): (Vec<u8>, u32) = if n < 0xffff {
            (indices.flat_map(|&i| (i as u16).to_le_bytes()).collect(), UNSIGNED_SHORT)
        } else {
            (indices.flat_map(|i| i.to_le_bytes()).collect(), UNSIGNED_INT)
        };
        let view = self.view(&bytes, Some(ELEMENT_ARRAY_BUFFER));
        let count = 3 * mesh.triangles.len();
        self.accessors
            .push(json!({ "bufferView": view, "componentType": component, "count": count, "type": "SCALAR" }));
        let primitive =
            json!({ "attributes": attributes, "indices": self.accessors.len() - 1, "material": mesh.material });
        self.meshes.push(json!({ "name": mesh.name, "primitives": [primitive] }));
        let name = self.node_name(&mesh.name);
        self.nodes.push(json!({ "name": name, "mesh": self.meshes.len() - 1 }));
        Ok(())
    }

    /// A name that no other node has: some programs take nodes of one name for one.
    fn node_name(&mut self, name: &str) -> String {
        let mut unique = name.to_owned();
        let mut n = 1;
        while !self.node_names.insert(unique.clone()) {
            n += 1;
            unique = format!("{name} {n}");
        }
        unique
    }

    fn light(&mut self, light: &PunctualLight) -> Result<(), ExportError> {
        self.extensions.insert("KHR_lights_punctual");
        let index = self.lights.len();
        let place = format!("light {index}");
        let intensity = light.intensity.max_element();
        let color = if intensity > 0.0 { light.intensity / intensity } else { Vec3::ONE };
        let mut value =
            json!({ "color": numbers(&color.to_array(), &place)?, "intensity": number(intensity, &place)? });
        if !light.name.is_empty() {
            value["name"] = json!(light.name);
        }
        value["type"] = match light.kind {
            PunctualKind::Point => json!("point"),
            PunctualKind::Directional => json!("directional"),
            PunctualKind::Spot { inner, outer } => {
                value["spot"] =
                    json!({ "innerConeAngle": number(inner, &place)?, "outerConeAngle": number(outer, &place)? });
                json!("spot")
            }
        };
        self.lights.push(value);
        let mut node =
            json!({ "name": self.node_name(&place), "extensions": { "KHR_lights_punctual": { "light": index } } });
        if light.kind != PunctualKind::Directional {
            node["translation"] = numbers(&light.position.to_array(), &place)?;
        }
        if light.kind != PunctualKind::Point {
            let turn = Quat::from_rotation_arc(-Vec3::Z, light.direction.normalize());
            node["rotation"] = numbers(&turn.normalize().to_array(), &place)?;
        }
        self.nodes.push(node);
        Ok(())
    }

    fn camera(&mut self, camera: &Camera) -> Result<(), ExportError> {
        let index = self.cameras.len();
        let place = format!("camera {index} `{}`", camera.name);
        let aspect = camera.aspect.unwrap_or(1.0);
        let mut value = match camera.projection {
            Projection::Perspective { yfov } => {
                let mut lens = json!({ "yfov": number(yfov, &place)?, "znear": 0.01 });
                if let Some(aspect) = camera.aspect {
                    lens["aspectRatio"] = number(aspect, &place)?;
                }
                json!({ "type": "perspective", "perspective": lens })
            }
            Projection::Orthographic { ymag } => json!({
                "type": "orthographic",
                "orthographic": {
                    "xmag": number(ymag * aspect, &place)?, "ymag": number(ymag, &place)?, "znear": 0.0, "zfar": 1000.0,
                },
            }),
        };
        value["name"] = json!(camera.name);
        if camera.aperture_radius > 0.0 {
            value["extras"] = json!({
                "aperture_radius": number(camera.aperture_radius, &place)?,
                "focus_distance": number(camera.focus_distance, &place)?,
            });
        }
        self.cameras.push(value);
        let turn = Quat::from_mat3(&Mat3::from(camera.world_from_camera.matrix3)).normalize();
        let at = Vec3::from(camera.world_from_camera.translation);
        self.nodes.push(json!({
            "name": camera.name, "camera": index,
            "rotation": numbers(&turn.to_array(), &place)?, "translation": numbers(&at.to_array(), &place)?,
        }));
        Ok(())
    }

    /// Header, JSON chunk, binary chunk.
    fn finish(mut self) -> Result<Vec<u8>, ExportError> {
        let roots: Vec<usize> = (0..self.nodes.len()).collect();
        let mut document = json!({
            "asset": { "version": "2.0", "generator": "Sunfleck" },
            "scene": 0,
            "scenes": [if roots.is_empty() { json!({}) } else { json!({ "nodes": roots }) }],
        });
        if !self.lights.is_empty() {
            document["extensions"] = json!({ "KHR_lights_punctual": { "lights": self.lights } });
        }
        if !self.extensions.is_empty() {
            document["extensionsUsed"] = json!(self.extensions);
        }
        if !self.bin.is_empty() {
            document["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        }
        let parts = [
            ("bufferViews", self.views),
            ("accessors", self.accessors),
            ("meshes", self.meshes),
            ("nodes", self.nodes),
            ("cameras", self.cameras),
            ("materials", self.materials),
            ("textures", self.textures),
            ("samplers", self.samplers),
            ("images", self.images),
        ];
        for (name, part) in parts {
            // Empty arrays are not allowed.
            if !part.is_empty() {
                document[name] = Value::Array(part);
            }
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let chunks: [(&[u8; 4], &mut Vec<u8>); 2] = [(b"JSON", &mut text), (b"BIN\0", &mut self.bin)];
        let mut bytes = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        for (kind, chunk) in chunks {
            if !chunk.is_empty() {
                let length = u32::try_from(chunk.len()).map_err(|_| ExportError::TooLarge { bytes: chunk.len() })?;
                bytes.extend_from_slice(&length.to_le_bytes());
                bytes.extend_from_slice(kind);
                bytes.append(chunk);
            }
        }
        let total = u32::try_from(bytes.len()).map_err(|_| ExportError::TooLarge { bytes: bytes.len() })?;
        bytes[8..12].copy_from_slice(&total.to_le_bytes());
        Ok(bytes)
    }
}

/// The shortest decimal number that is read back as the same 32-bit float.
fn number(value: f32, place: &str) -> Result<Value, ExportError> {
    let shortest = value.to_string().parse::<f64>().ok();
    let number = shortest.and_then(serde_json::Number::from_f64);
    number.map(Value::Number).ok_or_else(|| ExportError::NotFinite { place: place.into() })
}

/// The same for several.
fn numbers(values: &[f32], place: &str) -> Result<Value, ExportError> {
    values.iter().map(|v| number(*v, place)).collect::<Result<Vec<_>, _>>().map(Value::Array)
}
