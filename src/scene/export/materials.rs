//! Materials, textures and images of the exported file.

use glam::{Mat2, Vec3};
use image::ImageEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use serde_json::{Map, Value, json};

use super::{ExportError, Writer, number, numbers};
use crate::scene::{AlphaMode, Image, Material, Scene, Texture, Wrap};

impl Writer {
    /// All materials, in order, and the images they use.
    pub(super) fn materials(&mut self, scene: &Scene) -> Result<(), ExportError> {
        for image in &scene.images {
            self.image(image)?;
        }
        for (i, material) in scene.materials.iter().enumerate() {
            let thickness = self.thickness.get(i).copied().filter(|t| t.is_finite()).unwrap_or(0.01);
            let value = self.material(material, thickness, scene.images.len())?;
            self.materials.push(value);
        }
        Ok(())
    }

    fn material(&mut self, m: &Material, thickness: f32, n_images: usize) -> Result<Value, ExportError> {
        let place = format!("material `{}`", m.name);
        let f = |v: f32| number(v, &place);
        let rgb = |v: Vec3| numbers(&v.to_array(), &place);
        let mut surface = json!({
            "baseColorFactor": numbers(&m.base_color.extend(m.opacity).to_array(), &place)?,
            "metallicFactor": f(m.metallic)?,
            "roughnessFactor": f(m.roughness)?,
        });
        let mut texture = |texture: &Option<Texture>| -> Result<Option<Value>, ExportError> {
            texture.as_ref().map(|t| self.texture(t, m, n_images)).transpose()
        };
        if let Some(info) = texture(&m.base_color_texture)? {
            surface["baseColorTexture"] = info;
        }
        if let Some(info) = texture(&m.metallic_roughness_texture)? {
            surface["metallicRoughnessTexture"] = info;
        }
        let mut value = json!({ "name": m.name, "pbrMetallicRoughness": surface });
        if let Some(mut info) = texture(&m.normal_texture)? {
            info["scale"] = f(m.normal_scale)?;
            value["normalTexture"] = info;
        }
        let mut extensions = Map::new();
        let strength = m.emission.max_element().max(1.0);
        if m.emission != Vec3::ZERO {
            value["emissiveFactor"] = rgb(m.emission / strength)?;
        }
        if strength > 1.0 {
            extensions.insert("KHR_materials_emissive_strength".into(), json!({ "emissiveStrength": f(strength)? }));
        }
        if let Some(info) = texture(&m.emission_texture)? {
            value["emissiveTexture"] = info;
        }
        match m.alpha {
            AlphaMode::Opaque => {}
            AlphaMode::Mask(cutoff) => {
                value["alphaMode"] = json!("MASK");
                value["alphaCutoff"] = f(cutoff)?;
            }
            AlphaMode::Blend => value["alphaMode"] = json!("BLEND"),
        }
        if m.double_sided {
            value["doubleSided"] = json!(true);
        }
        let transmission_texture = texture(&m.transmission_texture)?;
        if m.transmission > 0.0 || transmission_texture.is_some() {
            let mut transmission = json!({ "transmissionFactor": f(m.transmission)? });
            if let Some(info) = transmission_texture {
                transmission["transmissionTexture"] = info;
            }
            extensions.insert("KHR_materials_transmission".into(), transmission);
        }
        if m.ior != 1.5 {
            extensions.insert("KHR_materials_ior".into(), json!({ "ior": f(m.ior)? }));
        }
        if m.specular != 1.0 || m.specular_color != Vec3::ONE {
            let mut specular = json!({ "specularFactor": f(m.specular)? });
            if m.specular_color != Vec3::ONE {
                specular["specularColorFactor"] = rgb(m.specular_color)?;
            }
            extensions.insert("KHR_materials_specular".into(), specular);
        }
        if m.volume {
            let mut volume = json!({ "thicknessFactor": f(thickness)? });
            let strongest = m.absorption.max_element();
            if strongest > 0.0 {
                // Over this distance the colour stays between 1/e and 1.
                let distance = 1.0 / strongest;
                volume["attenuationDistance"] = f(distance)?;
                volume["attenuationColor"] = rgb((-m.absorption * distance).exp())?;
            }
            extensions.insert("KHR_materials_volume".into(), volume);
        }
        if !extensions.is_empty() {
            const KNOWN: [&str; 5] = [
                "KHR_materials_emissive_strength",
                "KHR_materials_transmission",
                "KHR_materials_ior",
                "KHR_materials_specular",
                "KHR_materials_volume",
            ];
            self.extensions.extend(KNOWN.into_iter().filter(|name| extensions.contains_key(*name)));
            value["extensions"] = Value::Object(extensions);
        }
        Ok(value)
    }

    /// A reference to a texture; textures and samplers are made once for each image and way of reading it.
    fn texture(&mut self, t: &Texture, m: &Material, n_images: usize) -> Result<Value, ExportError> {
        if t.image >= n_images {
            return Err(ExportError::Dangling { place: format!("a texture of material `{}`", m.name) });
        }
        let wrap = |w: Wrap| match w {
            Wrap::Repeat => 10497,
            Wrap::Mirror => 33648,
            Wrap::Clamp => 33071,
        };
        let filter = if t.nearest { 9728 } else { 9729 };
        let sampler =
            json!({ "magFilter": filter, "minFilter": filter, "wrapS": wrap(t.wrap[0]), "wrapT": wrap(t.wrap[1]) });
        let sampler = index_of(&mut self.samplers, sampler);
        let texture = index_of(&mut self.textures, json!({ "source": t.image, "sampler": sampler }));
        let mut info = json!({ "index": texture });
        if t.uv_set != 0 {
            info["texCoord"] = json!(t.uv_set);
        }
        if t.transform != Mat2::IDENTITY || t.offset != glam::Vec2::ZERO {
            self.extensions.insert("KHR_texture_transform");
            let place = format!("a texture of material `{}`", m.name);
            let (scale, rotation) = scale_and_rotation(t.transform)
                .ok_or_else(|| ExportError::ShearedTexture { material: m.name.clone() })?;
            let mut transform = json!({
                "offset": numbers(&t.offset.to_array(), &place)?,
                "scale": numbers(&scale, &place)?,
            });
            if rotation != 0.0 {
                transform["rotation"] = number(rotation, &place)?;
            }
            info["extensions"] = json!({ "KHR_texture_transform": transform });
        }
        Ok(info)
    }

    /// An image as PNG in the binary chunk; opacity is left out where there is nothing but 255.
    fn image(&mut self, image: &Image) -> Result<(), ExportError> {
        let opaque = image.texels.iter().all(|t| t[3] == 255);
        let (pixels, kind): (Vec<u8>, _) = if opaque {
            (image.texels.iter().flat_map(|t| [t[0], t[1], t[2]]).collect(), image::ExtendedColorType::Rgb8)
        } else {
            (image.texels.iter().flatten().copied().collect(), image::ExtendedColorType::Rgba8)
        };
        let mut png = Vec::new();
        PngEncoder::new_with_quality(&mut png, CompressionType::Best, FilterType::Adaptive)
            .write_image(&pixels, image.width, image.height, kind)
            .map_err(|source| ExportError::Image { name: image.name.clone(), source })?;
        let view = self.view(&png, None);
        self.images.push(json!({ "name": image.name, "bufferView": view, "mimeType": "image/png" }));
        Ok(())
    }
}

/// Where `value` is in `list`, appended if it is not.
fn index_of(list: &mut Vec<Value>, value: Value) -> usize {
    list.iter().position(|v| *v == value).unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    })
}

/// Scale and angle of `KHR_texture_transform`: first the scale, then the rotation, in radians counter-clockwise seen with
/// v running down, as other programs read it. None if sheared.
fn scale_and_rotation(transform: Mat2) -> Option<([f32; 2], f32)> {
    let (x, y) = (transform.x_axis, transform.y_axis);
    let (width, height) = (x.length(), y.length());
    if x.dot(y).abs() > 1e-5 * width * height {
        return None;
    }
    if x.y == 0.0 && y.x == 0.0 {
        return Some(([x.x, y.y], 0.0));
    }
    let height = if transform.determinant() < 0.0 { -height } else { height };
    Some(([width, height], (-x.y).atan2(x.x)))
}
