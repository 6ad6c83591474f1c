//! Scene files, valid and hostile, written here from code.

mod changes;
mod environment;
mod gltf_hostile;
mod gltf_valid;
mod obj;
mod settings;

use serde_json::{Value, json};
use std::fs;
use std::path::PathBuf;
use sunfleck::scene::Scene;
use sunfleck::scene::load::{Loaded, load};
use tempfile::TempDir;

/// A folder of files to load.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(&path, bytes).unwrap();
        path
    }

    fn load(&self, name: &str, bytes: impl AsRef<[u8]>) -> Loaded {
        let loaded = load(&self.write(name, bytes)).unwrap();
        if !loaded.scene.meshes.is_empty() {
            loaded.scene.check().unwrap();
        }
        loaded
    }

    /// Loads a file that must be refused, in words that name it.
    fn refuse(&self, name: &str, bytes: impl AsRef<[u8]>) -> String {
        let message = load(&self.write(name, bytes)).unwrap_err().to_string();
        assert!(message.contains(name), "{message} does not name {name}");
        assert!(!message.contains('\n') && message.len() < 600, "{message}");
        message
    }
}

/// A glTF document and its binary chunk.
struct Glb {
    json: Value,
    binary: Vec<u8>,
}

impl Glb {
    /// One node with one triangle, (0,0,0) (1,0,0) (0,1,0).
    fn triangle() -> Self {
        let mut glb = Self {
            json: json!({
                "asset": {"version": "2.0"},
                "scene": 0,
                "scenes": [{"nodes": [0]}],
                "nodes": [{"mesh": 0}],
                "meshes": [{"name": "triangle", "primitives": [{"attributes": {}}]}],
                "accessors": [],
                "bufferViews": [],
                "buffers": [],
            }),
            binary: Vec::new(),
        };
        let positions = glb.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        glb.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = positions.into();
        glb
    }

    /// The first primitive.
    fn primitive(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        self.binary.extend_from_slice(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    fn accessor(&mut self, component: u32, shape: &str, count: usize, bytes: &[u8]) -> usize {
        let view = self.view(bytes);
        let accessor = json!({"bufferView": view, "componentType": component, "type": shape, "count": count});
        push(&mut self.json["accessors"], accessor)
    }

    fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.accessor(5126, shape, values.len() / width, &bytes)
    }

    fn indices(&mut self, values: &[u16]) {
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let accessor = self.accessor(5123, "SCALAR", values.len(), &bytes);
        self.primitive()["indices"] = accessor.into();
    }

    /// An image in the binary chunk, and a texture of it; returns the texture.
    fn texture(&mut self, png: &[u8]) -> usize {
        let view = self.view(png);
        let image = push(self.json.entry("images"), json!({"bufferView": view, "mimeType": "image/png"}));
        push(self.json.entry("textures"), json!({"source": image}))
    }

    fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if json["buffers"].as_array().is_some_and(Vec::is_empty) {
            json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        }
        let mut text = json.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let mut binary = self.binary.clone();
        binary.resize(binary.len().next_multiple_of(4), 0);
        let word = |n: usize| (n as u32).to_le_bytes();
        let header = [*b"glTF", word(2), word(12 + 8 + text.len() + 8 + binary.len())];
        [&header.concat(), &word(text.len())[..], b"JSON", &text, &word(binary.len()), b"BIN\0", &binary].concat()
    }

    fn load(&self) -> Loaded {
        Folder::new().load("scene.glb", self.bytes())
    }

    fn scene(&self) -> Scene {
        self.load().scene
    }
}

trait Entry {
    /// The array of that name, made if it is not there.
    fn entry(&mut self, name: &str) -> &mut Value;
}

impl Entry for Value {
    fn entry(&mut self, name: &str) -> &mut Value {
        let entry = &mut self[name];
        if entry.is_null() {
            *entry = json!([]);
        }
        entry
    }
}

fn push(list: &mut Value, value: Value) -> usize {
    let list = list.as_array_mut().unwrap();
    list.push(value);
    list.len() - 1
}

/// A PNG of 8-bit RGBA texels.
fn png(width: u32, height: u32, texels: &[[u8; 4]]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(::png::ColorType::Rgba);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(texels.as_flattened()).unwrap();
    bytes
}
