//! glTF materials and textures.

use super::buffers::{Buffers, lookup};
use super::document::{self, Document, TextureInfo};
use crate::scene::load::files::Source;
use crate::scene::load::image::{Entry, ImageTable};
use crate::scene::load::{LoadError, Warnings};
use crate::scene::{AlphaMode, Material, Texture, Wrap};
use glam::{Mat2, Vec2, Vec3};
use std::borrow::Cow;

/// Stands for an infinite index of refraction, which `KHR_materials_ior` writes as 0: reflects 99.6 % head on.
const INFINITE_IOR: f32 = 1000.0;

/// All materials in file order.
pub(super) fn load_all<'a>(
    source: &'a Source,
    document: &'a Document,
    buffers: &'a Buffers,
    images: &mut ImageTable<'a>,
    warnings: &mut Warnings,
) -> Result<Vec<Material>, LoadError> {
    let mut loader = Loader { source, document, buffers, images, warnings };
    let mut materials = Vec::with_capacity(document.materials.len());
    for (i, material) in document.materials.iter().enumerate() {
        materials.push(loader.material(material, &format!("materials[{i}]"))?);
    }
    Ok(materials)
}

/// glTF's material of primitives without one.
pub(super) fn default_material() -> Material {
    Material { name: "default".into(), metallic: 1.0, double_sided: false, ..Material::default() }
}

struct Loader<'a, 'l> {
    source: &'a Source,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    images: &'l mut ImageTable<'a>,
    warnings: &'l mut Warnings,
}

impl Loader<'_, '_> {
    fn material(&mut self, from: &document::Material, place: &str) -> Result<Material, LoadError> {
        let pbr = &from.pbr_metallic_roughness;
        let extensions = &from.extensions;
        let [r, g, b, opacity] = pbr.base_color_factor;
        let here = format!("{place}.pbrMetallicRoughness");
        let emission = self.emission(from, place)?;
        let mut material = Material {
            name: from.name.clone().unwrap_or_else(|| place.into()),
            base_color: self.unit3([r, g, b], &format!("{here}.baseColorFactor"))?,
            opacity: self.unit(opacity, &format!("{here}.baseColorFactor"))?,
            base_color_texture: self.texture(&pbr.base_color_texture, &format!("{here}.baseColorTexture"))?,
            alpha: self.alpha(from, place)?,
            metallic: self.unit(pbr.metallic_factor, &format!("{here}.metallicFactor"))?,
            roughness: self.unit(pbr.roughness_factor, &format!("{here}.roughnessFactor"))?,
            metallic_roughness_texture: self
                .texture(&pbr.metallic_roughness_texture, &format!("{here}.metallicRoughnessTexture"))?,
            normal_texture: self.texture(&from.normal_texture, &format!("{place}.normalTexture"))?,
            normal_scale: from.normal_texture.as_ref().map_or(1.0, |texture| texture.scale),
            emission,
            // Black times anything: not worth its memory.
            emission_texture: match emission == Vec3::ZERO {
                true => None,
                false => self.texture(&from.emissive_texture, &format!("{place}.emissiveTexture"))?,
            },
            double_sided: from.double_sided,
            ..Material::default()
        };
        if !material.normal_scale.is_finite() {
            return Err(self.source.invalid(format!("{place}.normalTexture.scale"), "is not finite"));
        }
        if extensions.unlit.is_some() {
            material = Material { metallic: 0.0, roughness: 1.0, specular: 0.0, ..material };
            material.metallic_roughness_texture = None;
        }
        if let Some(ior) = &extensions.ior {
            material.ior = self.ior(ior.ior, &format!("{place}.extensions.KHR_materials_ior.ior"))?;
        }
        if let Some(specular) = &extensions.specular {
            let here = format!("{place}.extensions.KHR_materials_specular");
            material.specular = self.unit(specular.specular_factor, &format!("{here}.specularFactor"))?;
            material.specular_color =
                self.positive3(specular.specular_color_factor, &format!("{here}.specularColorFactor"))?;
            if specular.specular_texture.is_some() || specular.specular_color_texture.is_some() {
                self.warnings.push(format!("{here}: textures are ignored"));
            }
        }
        if let Some(transmission) = &extensions.transmission {
            let here = format!("{place}.extensions.KHR_materials_transmission");
            material.transmission =
                self.unit(transmission.transmission_factor, &format!("{here}.transmissionFactor"))?;
            if material.transmission > 0.0 {
                material.transmission_texture =
                    self.texture(&transmission.transmission_texture, &format!("{here}.transmissionTexture"))?;
            }
        }
        if let Some(volume) = &extensions.volume {
            let here = format!("{place}.extensions.KHR_materials_volume");
            // The thickness itself is for renderers that do not know where light leaves the solid.
            let thick = self.positive(volume.thickness_factor, &format!("{here}.thicknessFactor"))? > 0.0;
            material.volume = thick && material.transmission > 0.0;
            let absorption = self.absorption(volume, &here)?;
            if material.volume {
                material.absorption = absorption;
            }
        }
        Ok(material)
    }

    fn emission(&mut self, from: &document::Material, place: &str) -> Result<Vec3, LoadError> {
        let factor = self.positive3(from.emissive_factor, &format!("{place}.emissiveFactor"))?;
        let strength = match &from.extensions.emissive_strength {
            Some(strength) => self.positive(
                strength.emissive_strength,
                &format!("{place}.extensions.KHR_materials_emissive_strength.emissiveStrength"),
            )?,
            None => 1.0,
        };
        self.positive3((factor * strength).to_array(), &format!("{place}.emissiveFactor × emissiveStrength"))
    }

    fn alpha(&mut self, from: &document::Material, place: &str) -> Result<AlphaMode, LoadError> {
        match from.alpha_mode.as_str() {
            "OPAQUE" => Ok(AlphaMode::Opaque),
            "MASK" => Ok(AlphaMode::Mask(self.positive(from.alpha_cutoff, &format!("{place}.alphaCutoff"))?)),
            "BLEND" => Ok(AlphaMode::Blend),
            other => {
                let problem = format!("{other:?} is none of OPAQUE, MASK and BLEND");
                Err(self.source.invalid(format!("{place}.alphaMode"), problem))
            }
        }
    }

    fn ior(&mut self, ior: f32, place: &str) -> Result<f32, LoadError> {
        match self.positive(ior, place)? {
            0.0 => {
                self.warnings.push(format!("{place}: 0 (everything is reflected) is taken as {INFINITE_IOR}"));
                Ok(INFINITE_IOR)
            }
            ior => Ok(ior),
        }
    }

    /// σ = −ln(colour)/distance, `KHR_materials_volume`.
    fn absorption(&mut self, volume: &document::Volume, place: &str) -> Result<Vec3, LoadError> {
        /// Nothing is blacker: −ln of it is about 46, and its transmittance rounds to nothing.
        const DARKEST: f32 = 1e-20;
        let color = self.unit3(volume.attenuation_color, &format!("{place}.attenuationColor"))?;
        match volume.attenuation_distance {
            Some(0.0) => {
                self.warnings.push(format!("{place}.attenuationDistance: 0 is not a distance; nothing is absorbed"));
                Ok(Vec3::ZERO)
            }
            Some(distance) if distance < 0.0 => {
                Err(self.source.invalid(format!("{place}.attenuationDistance"), format!("{distance} is not positive")))
            }
            // 1e999 and the like: as good as the default, infinity.
            Some(distance) if distance.is_finite() => {
                let ln = color.max(Vec3::splat(DARKEST)).map(f32::ln);
                Ok((-ln / distance).max(Vec3::ZERO).min(Vec3::splat(1e12)))
            }
            _ => Ok(Vec3::ZERO),
        }
    }

    fn texture(&mut self, info: &Option<TextureInfo>, place: &str) -> Result<Option<Texture>, LoadError> {
        let Some(info) = info else { return Ok(None) };
        let (source, document) = (self.source, self.document);
        let texture = lookup(source, &document.textures, info.index, "textures", &format!("{place}.index"))?;
        let here = format!("textures[{}]", info.index);
        let Some(image) = texture.source.or(texture.extensions.webp.as_ref().map(|webp| webp.source)) else {
            self.warnings.push(format!("{here}: no image in a format that is read here; the texture is ignored"));
            return Ok(None);
        };
        let mut result = Texture::new(self.image(image, &format!("{here}.source"))?);
        result.uv_set = info.tex_coord;
        if let Some(sampler) = texture.sampler {
            let sampler = lookup(source, &document.samplers, sampler, "samplers", &format!("{here}.sampler"))?;
            result.wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
            result.nearest = sampler.mag_filter == Some(9728);
        }
        if let Some(transform) = &info.extensions.transform {
            let scale = Vec2::from(transform.scale);
            // Counter-clockwise as one looks at an image, where v points down.
            let (sin, cos) = transform.rotation.sin_cos();
            result.transform = Mat2::from_cols(Vec2::new(cos, -sin), Vec2::new(sin, cos)) * Mat2::from_diagonal(scale);
            result.offset = Vec2::from(transform.offset);
            result.uv_set = transform.tex_coord.unwrap_or(result.uv_set);
            if !result.transform.is_finite() || !result.offset.is_finite() {
                return Err(source.invalid(format!("{place}.extensions.KHR_texture_transform"), "is not finite"));
            }
        }
        if result.uv_set > 1 {
            self.warnings.push(format!("{place}: TEXCOORD_{} is not read; TEXCOORD_0 is used", result.uv_set));
            result.uv_set = 0;
        }
        Ok(Some(result))
    }

    /// The index in the scene of image `index` of the document.
    fn image(&mut self, index: usize, place: &str) -> Result<usize, LoadError> {
        let image = lookup(self.source, &self.document.images, index, "images", place)?;
        // Some files list one picture several times.
        let key = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => uri.clone(),
            (None, Some(view)) => format!("bufferViews[{view}]"),
            (None, None) => {
                return Err(self.source.invalid(format!("images[{index}]"), "has neither uri nor bufferView"));
            }
        };
        if let Some(found) = self.images.find(&key) {
            return Ok(found);
        }
        let (place, file, bytes) = match (&image.uri, image.buffer_view) {
            (None, Some(view)) => {
                let place = format!("images[{index}].bufferView");
                let bytes = self.buffers.view(view, &place)?;
                (place, "", Cow::Borrowed(bytes))
            }
            _ => {
                let place = format!("images[{index}].uri");
                let bytes = self.source.read_uri(&place, &key)?;
                let file = if key.starts_with("data:") { "" } else { key.as_str() };
                (place, file, Cow::Owned(bytes))
            }
        };
        let name = match &image.name {
            Some(name) => name.clone(),
            None if file.is_empty() => format!("images[{index}]"),
            None => file.into(),
        };
        let entry = Entry { name, place, file: file.into(), bytes };
        self.images.insert(self.source, key, entry)
    }

    /// A finite number ≥ 0.
    fn positive(&mut self, value: f32, place: &str) -> Result<f32, LoadError> {
        if value.is_finite() && value >= 0.0 {
            Ok(value)
        } else {
            Err(self.source.invalid(place, format!("{value} is not a finite number ≥ 0")))
        }
    }

    fn positive3(&mut self, value: [f32; 3], place: &str) -> Result<Vec3, LoadError> {
        let [r, g, b] = value;
        Ok(Vec3::new(self.positive(r, place)?, self.positive(g, place)?, self.positive(b, place)?))
    }

    /// A number in [0, 1]; larger ones are clamped.
    fn unit(&mut self, value: f32, place: &str) -> Result<f32, LoadError> {
        let value = self.positive(value, place)?;
        if value > 1.0 {
            self.warnings.push(format!("{place}: {value} is reduced to 1"));
        }
        Ok(value.min(1.0))
    }

    fn unit3(&mut self, value: [f32; 3], place: &str) -> Result<Vec3, LoadError> {
        let [r, g, b] = value;
        Ok(Vec3::new(self.unit(r, place)?, self.unit(g, place)?, self.unit(b, place)?))
    }
}

fn wrap(code: Option<u32>) -> Wrap {
    match code {
        Some(33071) => Wrap::Clamp,
        Some(33648) => Wrap::Mirror,
        _ => Wrap::Repeat,
    }
}
