//! glTF 2.0, as `.gltf` or `.glb`.
//!
//! Light adds up: emissive surfaces, punctual lights and, from the settings, an environment. Not read: animation, skins
//! (the bind pose is shown), occlusion textures, and the extensions that a warning names.

mod buffers;
mod document;
mod material;
mod nodes;
mod primitive;

use super::files::Source;
use super::image::ImageTable;
use super::{Budget, LoadError, Warnings};
use crate::mesh::Mesh;
use crate::scene::Scene;
use buffers::Buffers;
use document::Document;
use std::sync::Arc;

/// What a file may require: read, or of no consequence to a still picture.
const SUPPORTED_EXTENSIONS: &[&str] = &[
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_variants",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions without which the file can be shown, if not as meant: a warning, even where they are required.
const IGNORED_EXTENSIONS: &[&str] = &[
    "KHR_animation_pointer",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_iridescence",
    "KHR_materials_sheen",
    "KHR_xmp_json_ld",
];

/// Reads a scene; `bytes` is the content of the file.
pub(super) fn load(source: &Source, bytes: &[u8], warnings: &mut Warnings) -> Result<Scene, LoadError> {
    let (document, binary) = open(source, bytes, warnings)?;
    let buffers = Buffers::load(source, &document, binary)?;
    let mut scene = Scene::default();
    let mut images = ImageTable::new();
    scene.materials = material::load_all(source, &document, &buffers, &mut images, warnings)?;
    let nodes = nodes::place(source, &document, &buffers, warnings)?;
    scene.cameras = nodes.cameras;
    scene.lights = nodes.lights;
    let mut budget = Budget::new();
    primitive::load_all(source, &document, &buffers, nodes.placements, &mut scene, &mut budget, warnings)?;
    // Last, and several at a time: the costliest part of many files.
    scene.images = images.decode(source)?.into_iter().map(Arc::new).collect();
    Ok(scene)
}

/// Reads the triangles alone.
pub(super) fn load_geometry(source: &Source, bytes: &[u8], warnings: &mut Warnings) -> Result<Mesh, LoadError> {
    let (document, binary) = open(source, bytes, warnings)?;
    let buffers = Buffers::load(source, &document, binary)?;
    let nodes = nodes::place(source, &document, &buffers, warnings)?;
    primitive::load_geometry(source, &document, &buffers, &nodes.placements, warnings)
}

fn open<'a>(
    source: &Source,
    bytes: &'a [u8],
    warnings: &mut Warnings,
) -> Result<(Document, Option<&'a [u8]>), LoadError> {
    let (json, binary) = if bytes.starts_with(b"glTF") { split_glb(source, bytes)? } else { (bytes, None) };
    let document = parse(source, json)?;
    check_version(source, &document)?;
    check_extensions(source, &document, warnings)?;
    Ok((document, binary))
}

/// The JSON and the binary chunk of a GLB file.
fn split_glb<'a>(source: &Source, bytes: &'a [u8]) -> Result<(&'a [u8], Option<&'a [u8]>), LoadError> {
    const JSON: u32 = u32::from_le_bytes(*b"JSON");
    const BINARY: u32 = u32::from_le_bytes(*b"BIN\0");
    let word = |at: usize| bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map(u32::from_le_bytes);
    let truncated = || source.format("the GLB file is truncated");
    let version = word(4).ok_or_else(truncated)?;
    if version != 2 {
        return Err(source.format(format!("GLB version {version} is not supported; glTF 2.0 has version 2")));
    }
    let length = word(8).ok_or_else(truncated)? as usize;
    if length > bytes.len() {
        let problem = format!("the GLB file is truncated: {length} bytes are promised, {} are there", bytes.len());
        return Err(source.format(problem));
    }
    let (mut json, mut binary) = (None, None);
    let mut at = 12;
    while let (Some(size), Some(kind)) = (word(at), word(at + 4)) {
        let chunk = bytes.get(at + 8..at + 8 + size as usize).ok_or_else(truncated)?;
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BINARY if binary.is_none() => binary = Some(chunk),
            _ => {} // The specification says to ignore others.
        }
        at += 8 + size as usize;
    }
    Ok((json.ok_or_else(|| source.format("the GLB file has no JSON chunk"))?, binary))
}

fn parse(source: &Source, json: &[u8]) -> Result<Document, LoadError> {
    let json = json.strip_prefix(b"\xef\xbb\xbf").unwrap_or(json).trim_ascii();
    let json = json.strip_suffix(b"\0").map_or(json, |_| json.split(|&b| b == 0).next().unwrap_or(json));
    if !json.starts_with(b"{") {
        return Err(source.format("is neither glTF (JSON) nor GLB"));
    }
    let mut deserializer = serde_json::Deserializer::from_slice(json);
    let document = serde_path_to_error::deserialize(&mut deserializer).map_err(|e| {
        let place = match e.path().to_string() {
            path if path == "." => "JSON".into(),
            path => path,
        };
        source.invalid(place, e.inner().to_string())
    })?;
    deserializer.end().map_err(|e| source.invalid("JSON", e.to_string()))?;
    Ok(document)
}

fn check_version(source: &Source, document: &Document) -> Result<(), LoadError> {
    let asset = &document.asset;
    let version = asset.min_version.as_ref().unwrap_or(&asset.version);
    match version.split_once('.') {
        _ if version.is_empty() => Err(source.invalid("asset.version", "is missing: is this a glTF file?")),
        Some(("2", "0")) => Ok(()),
        Some(("2", _)) if asset.min_version.is_none() => Ok(()),
        _ => Err(source.invalid("asset", format!("glTF {version:?} is not supported, 2.0 is"))),
    }
}

fn check_extensions(source: &Source, document: &Document, warnings: &mut Warnings) -> Result<(), LoadError> {
    for name in &document.extensions_required {
        if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) && !IGNORED_EXTENSIONS.contains(&name.as_str()) {
            let hint = match name.as_str() {
                "KHR_draco_mesh_compression" => "; save the file without Draco compression",
                "EXT_meshopt_compression" | "KHR_meshopt_compression" => "; save the file without meshopt compression",
                "KHR_texture_basisu" => "; save the textures as PNG, JPEG or WebP",
                _ => "",
            };
            return Err(source.extension(name, hint));
        }
    }
    for name in document.extensions_used.iter().chain(&document.extensions_required) {
        if !SUPPORTED_EXTENSIONS.contains(&name.as_str()) {
            warnings.push(format!("extensionsUsed: {name:.80} is ignored"));
        } else if name == "KHR_materials_unlit" {
            warnings.push("extensionsUsed: KHR_materials_unlit: such materials are lit here, as diffuse ones".into());
        } else if name == "KHR_materials_variants" {
            warnings.push("extensionsUsed: KHR_materials_variants: the default variant is shown".into());
        }
    }
    Ok(())
}
