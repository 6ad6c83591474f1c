//! Wavefront MTL, with the extensions for physically based materials.
//!
//! What a Phong material means here:
//! - `illum` 3, 5: a mirror of colour `Ks`. `illum` 4, 6, 7, 9 with `Ni`: a smooth solid dielectric tinted by `Tf`.
//!   Otherwise `Kd` under a dielectric coat of index `Ni`, weighted and tinted by `Ks`; without `Ks`, or with `illum` 0
//!   or 1, a Lambertian reflector. `Pm` and `Pr`, where given, are the metalness and the roughness.
//! - `Ns`: a Blinn-Phong exponent; GGX of about that width has α = √(2/(Ns + 2)).
//! - `Ke`: radiance, from the front only.
//! - `d` (or 1 − `Tr`): the share of light that meets the surface at all.

use super::files::Source;
use super::image::{Entry, ImageTable};
use super::packing::{self, Packing, Slot};
use super::{LoadError, Warnings};
use crate::scene::{AlphaMode, Image, Material, Texture, Wrap};
use glam::{Mat2, Vec2, Vec3};
use std::borrow::Cow;

/// Exponent from which a mirror is perfect: the largest that writers of MTL use.
const PERFECT_EXPONENT: f32 = 1000.0;
/// Materials of a scene, at most.
const MAX_MATERIALS: usize = 1 << 20;

/// A material as written.
#[derive(Default)]
struct Statement {
    name: String,
    place: String,
    diffuse: Option<Vec3>,
    specular: Option<Vec3>,
    emission: Option<Vec3>,
    filter: Option<Vec3>,
    exponent: Option<f32>,
    ior: Option<f32>,
    opacity: Option<f32>,
    transparency: Option<f32>,
    illumination: Option<i32>,
    roughness: Option<f32>,
    metallic: Option<f32>,
    diffuse_map: Option<Map>,
    emission_map: Option<Map>,
    normal_map: Option<Map>,
    opacity_map: Option<Map>,
    roughness_map: Option<Map>,
    metallic_map: Option<Map>,
}

/// A texture statement, its options parsed.
struct Map {
    place: String,
    file: String,
    scale: Vec2,
    offset: Vec2,
    clamp: bool,
    /// `-bm`.
    strength: f32,
}

/// The materials of a scene, their textures not yet decoded.
pub(super) struct Library<'a> {
    pub(super) materials: Vec<Material>,
    pub(super) images: ImageTable<'a>,
    packings: Vec<Packing>,
}

impl Library<'_> {
    pub(super) fn new() -> Self {
        Self { materials: Vec::new(), images: ImageTable::new(), packings: Vec::new() }
    }

    /// Parses the text of the material library `file` and appends its materials.
    pub(super) fn read(
        &mut self,
        source: &Source,
        file: &str,
        text: &str,
        warnings: &mut Warnings,
    ) -> Result<(), LoadError> {
        let mut builder = Builder { library: self, source, warnings, folder: folder_of(file) };
        let mut statement: Option<Statement> = None;
        for (i, line) in text.lines().enumerate() {
            let place = format!("{file}:{}", i + 1);
            let line = line.trim();
            let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let value = value.trim();
            if key.is_empty() || key.starts_with('#') {
                continue;
            }
            if key == "newmtl" {
                if let Some(done) = statement.replace(Statement::new(value, &place)) {
                    builder.finish(done)?;
                }
                if builder.library.materials.len() >= MAX_MATERIALS {
                    return Err(source.too_large(place, format!("more than {MAX_MATERIALS} materials")));
                }
                continue;
            }
            let Some(statement) = &mut statement else {
                builder.warnings.push_once(&format!("{key:.20} before the first newmtl is ignored"), &place);
                continue;
            };
            statement
                .read(key, value, &place, builder.warnings)
                .map_err(|problem| source.invalid(&place, format!("{key}: {problem}")))?;
        }
        match statement {
            Some(done) => builder.finish(done),
            None => Ok(()),
        }
    }

    /// Decodes the textures and puts together those that are spread over several files.
    pub(super) fn finish(self, source: &Source) -> Result<(Vec<Material>, Vec<Image>), LoadError> {
        let (mut materials, mut images) = (self.materials, self.images.decode(source)?);
        packing::pack_all(source, &self.packings, &mut materials, &mut images)?;
        Ok((materials, images))
    }
}

/// Names in a library are relative to the library.
fn folder_of(file: &str) -> String {
    match file.replace('\\', "/").rsplit_once('/') {
        Some((folder, _)) => format!("{folder}/"),
        None => String::new(),
    }
}

impl Statement {
    fn new(name: &str, place: &str) -> Self {
        Self { name: name.into(), place: place.into(), ..Self::default() }
    }

    fn read(&mut self, key: &str, value: &str, place: &str, warnings: &mut Warnings) -> Result<(), String> {
        match key.to_ascii_lowercase().as_str() {
            "kd" => self.diffuse = color(value)?,
            "ks" => self.specular = color(value)?,
            "ke" => self.emission = color(value)?,
            "tf" => self.filter = color(value)?,
            "ns" => self.exponent = Some(number(value)?),
            "ni" => self.ior = Some(number(value)?),
            "d" => self.opacity = Some(number(value.trim_start_matches("-halo"))?),
            "tr" => self.transparency = Some(number(value)?),
            "pr" => self.roughness = Some(number(value)?),
            "pm" => self.metallic = Some(number(value)?),
            "illum" => self.illumination = Some(value.parse().map_err(|_| format!("{value:.40?} is not an integer"))?),
            "map_kd" => self.diffuse_map = Some(Map::parse(value, place)?),
            "map_ke" => self.emission_map = Some(Map::parse(value, place)?),
            "norm" | "map_norm" => self.normal_map = Some(Map::parse(value, place)?),
            "map_d" => self.opacity_map = Some(Map::parse(value, place)?),
            "map_pr" => self.roughness_map = Some(Map::parse(value, place)?),
            "map_pm" => self.metallic_map = Some(Map::parse(value, place)?),
            // Ambient light is what is computed here.
            "ka" | "map_ka" | "sharpness" => {}
            _ => warnings.push_once(&format!("{key:.20} is ignored"), &place),
        }
        Ok(())
    }
}

/// Three numbers, or one for all three.
fn color(value: &str) -> Result<Option<Vec3>, String> {
    let numbers: Vec<f32> = match value.split_whitespace().next() {
        Some("spectral" | "xyz") => return Err("only RGB colours are read".into()),
        _ => value.split_whitespace().take(4).map(number).collect::<Result<_, _>>()?,
    };
    let color = match numbers[..] {
        [grey] => Vec3::splat(grey),
        [r, g, b] => Vec3::new(r, g, b),
        _ => return Err(format!("a colour has 3 numbers (or 1), not {}", numbers.len())),
    };
    match color.min_element() >= 0.0 {
        true => Ok(Some(color)),
        false => Err(format!("{color} has a negative component")),
    }
}

fn number(value: &str) -> Result<f32, String> {
    match value.trim().parse::<f32>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err(format!("{value:.40?} is not a finite number")),
    }
}

/// What is left of a line, word by word.
struct Words<'a>(&'a str);

impl<'a> Words<'a> {
    fn next(&mut self) -> &'a str {
        let word = self.0.split_whitespace().next().unwrap_or("");
        self.0 = self.0.trim_start()[word.len()..].trim_start();
        word
    }

    /// The next word if it is a number.
    fn next_number(&mut self) -> Option<f32> {
        let before = self.0;
        let number = number(self.next()).ok();
        if number.is_none() {
            self.0 = before;
        }
        number
    }
}

impl Map {
    /// `[-option arguments]… file name with spaces`.
    fn parse(value: &str, place: &str) -> Result<Self, String> {
        let mut map = Self {
            place: place.into(),
            file: String::new(),
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            clamp: false,
            strength: 1.0,
        };
        let mut words = Words(value.trim());
        loop {
            let before = words.0;
            let option = words.next();
            match option {
                "-s" | "-o" | "-t" => {
                    let x = words.next_number().ok_or_else(|| format!("{option} without a number"))?;
                    let y = words.next_number();
                    words.next_number(); // z, of solid textures
                    match option {
                        "-s" => map.scale = Vec2::new(x, y.unwrap_or(1.0)),
                        "-o" => map.offset = Vec2::new(x, y.unwrap_or(0.0)),
                        _ => {} // Turbulence
                    }
                }
                "-clamp" => map.clamp = words.next() == "on",
                "-bm" => map.strength = words.next_number().ok_or("-bm without a number")?,
                "-mm" => {
                    words.next();
                    words.next();
                }
                "-blendu" | "-blendv" | "-boost" | "-cc" | "-imfchan" | "-texres" | "-type" => {
                    words.next();
                }
                _ => {
                    map.file = before.trim().trim_matches('"').into();
                    break;
                }
            }
        }
        if map.file.is_empty() { Err("no file is named".into()) } else { Ok(map) }
    }

    fn texture(&self, image: usize) -> Texture {
        let mut texture = Texture::new(image);
        // MTL counts v from the bottom, images here from the top: v' = 1 − (s·(1 − v) + o).
        texture.transform = Mat2::from_diagonal(self.scale);
        texture.offset = Vec2::new(self.offset.x, 1.0 - self.scale.y - self.offset.y);
        if self.clamp {
            texture.wrap = [Wrap::Clamp; 2];
        }
        texture
    }
}

struct Builder<'b, 'a> {
    library: &'b mut Library<'a>,
    source: &'b Source,
    warnings: &'b mut Warnings,
    folder: String,
}

impl Builder<'_, '_> {
    /// Makes a material of what was written about it.
    fn finish(&mut self, from: Statement) -> Result<(), LoadError> {
        let diffuse = self.reflectance(from.diffuse, "Kd", &from);
        let specular = self.reflectance(from.specular, "Ks", &from);
        let emission = from.emission.unwrap_or(Vec3::ZERO);
        let ior = from.ior.filter(|&ior| ior > 0.0);
        let illumination = from.illumination.unwrap_or(2);
        let exponent_roughness = from.exponent.map(|exponent| (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt());
        let mut material = Material {
            name: from.name.clone(),
            base_color: diffuse.unwrap_or(Vec3::splat(0.5)),
            roughness: exponent_roughness.unwrap_or(1.0).min(1.0),
            emission,
            ior: ior.unwrap_or(1.5),
            // A lamp with two bright sides would light its own inside.
            double_sided: emission == Vec3::ZERO && from.emission_map.is_none(),
            ..Material::default()
        };
        let weight = specular.map_or(0.0, Vec3::max_element);
        let is_glass = matches!(illumination, 4 | 6 | 7 | 9) && ior.is_some();
        if is_glass {
            material.base_color = self.reflectance(from.filter, "Tf", &from).unwrap_or(Vec3::ONE);
            material.roughness = 0.0;
            material.transmission = 1.0;
            material.volume = true;
        } else if matches!(illumination, 3 | 5) && weight > 0.0 {
            material.metallic = 1.0;
            material.base_color = specular.unwrap_or(Vec3::ONE);
            if from.exponent.is_none_or(|exponent| exponent >= PERFECT_EXPONENT) {
                material.roughness = 0.0;
            }
        } else if matches!(illumination, 0 | 1) || weight <= 0.0 {
            material.specular = 0.0;
        } else {
            material.specular = weight;
            material.specular_color = specular.unwrap_or(Vec3::ONE) / weight;
        }
        if let Some(metallic) = from.metallic {
            material.metallic = metallic.clamp(0.0, 1.0);
            if metallic > 0.0 && !is_glass {
                material.base_color = diffuse.unwrap_or(Vec3::ONE);
            }
        }
        if let Some(roughness) = from.roughness {
            material.roughness = roughness.clamp(0.0, 1.0);
        }
        if (from.metallic.is_some() || from.roughness.is_some()) && from.specular.is_none() {
            material.specular = 1.0; // Written for a physically based renderer.
        }
        self.textures(&from, &mut material)?;
        let opacity = from.opacity.or(from.transparency.map(|t| 1.0 - t)).unwrap_or(1.0).clamp(0.0, 1.0);
        if (opacity < 1.0 || from.opacity_map.is_some()) && !is_glass {
            material.opacity = opacity;
            material.alpha = AlphaMode::Blend;
        }
        self.library.materials.push(material);
        Ok(())
    }

    fn textures(&mut self, from: &Statement, material: &mut Material) -> Result<(), LoadError> {
        if let Some(map) = &from.diffuse_map {
            material.base_color_texture = Some(map.texture(self.image(map)?));
            // Often written beside a texture that is meant to be seen.
            if material.base_color == Vec3::ZERO {
                self.warnings.push(format!("{}: Kd of 0 would hide the texture; 1 is used", map.place));
                material.base_color = Vec3::ONE;
            }
        }
        if let Some(map) = &from.emission_map {
            material.emission_texture = Some(map.texture(self.image(map)?));
            if material.emission == Vec3::ZERO {
                material.emission = Vec3::ONE;
            }
        }
        if let Some(map) = &from.normal_map {
            material.normal_texture = Some(map.texture(self.image(map)?));
            material.normal_scale = map.strength;
        }
        let number = self.library.materials.len();
        if let Some(mask) = &from.opacity_map
            && from.diffuse_map.as_ref().is_none_or(|color| color.file != mask.file)
        {
            let color = match &from.diffuse_map {
                Some(map) => Some(self.image(map)?),
                None => None,
            };
            let image = self.image(mask)?;
            material.base_color_texture.get_or_insert_with(|| mask.texture(image));
            let images = [color, None, None, Some(image)];
            self.library.packings.push(Packing { material: number, slot: Slot::BaseColor, images });
        }
        let mut images = [None; 4];
        for (channel, map) in [(1, &from.roughness_map), (2, &from.metallic_map)] {
            if let Some(map) = map {
                let image = self.image(map)?;
                images[channel] = Some(image);
                material.metallic_roughness_texture.get_or_insert_with(|| map.texture(image));
            }
        }
        if images != [None; 4] {
            // The map is the value where no number is given.
            if from.roughness_map.is_some() && from.roughness.is_none() {
                material.roughness = 1.0;
            }
            if from.metallic_map.is_some() && from.metallic.is_none() {
                material.metallic = 1.0;
            }
            self.library.packings.push(Packing { material: number, slot: Slot::MetallicRoughness, images });
        }
        Ok(())
    }

    fn image(&mut self, map: &Map) -> Result<usize, LoadError> {
        let file = format!("{}{}", self.folder, map.file);
        if let Some(found) = self.library.images.find(&file) {
            return Ok(found);
        }
        let bytes = Cow::Owned(self.source.read(&map.place, &file)?);
        let entry = Entry { name: file.clone(), place: map.place.clone(), file: file.clone(), bytes };
        self.library.images.insert(self.source, file, entry)
    }

    /// At most 1: more would reflect more than arrives.
    fn reflectance(&mut self, color: Option<Vec3>, key: &str, from: &Statement) -> Option<Vec3> {
        if color.is_some_and(|color| color.max_element() > 1.0) {
            self.warnings.push(format!("{}: {key} of {:?} is reduced to 1", from.place, from.name));
        }
        color.map(|color| color.min(Vec3::ONE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn map_options_come_before_a_name_with_spaces() {
        let map = Map::parse("-s 2 3 1 -o .5 -clamp on -bm 0.25 my wood.png", "").unwrap();
        assert_eq!((map.scale, map.offset, map.clamp), (Vec2::new(2.0, 3.0), Vec2::new(0.5, 0.0), true));
        assert_eq!((map.strength, map.file.as_str()), (0.25, "my wood.png"));
        assert_eq!(Map::parse("-1.png", "").unwrap().file, "-1.png");
        assert!(Map::parse("-s 2", "").is_err() && Map::parse("-s", "").is_err());
    }

    #[test]
    fn texture_options_hold_from_the_bottom() {
        let map = Map::parse("-s 2 4 -o 0.25 0.5 x.png", "").unwrap();
        let texture = map.texture(0);
        // (u, v) = (0.3, 0.1) from the bottom left is (0.3, 0.9) from the top left.
        let found = texture.transform * Vec2::new(0.3, 0.9) + texture.offset;
        assert!(found.abs_diff_eq(Vec2::new(2.0 * 0.3 + 0.25, 1.0 - (4.0 * 0.1 + 0.5)), 1e-6));
    }

    #[test]
    fn a_colour_has_one_or_three_numbers() {
        assert_eq!(color("0.5"), Ok(Some(Vec3::splat(0.5))));
        assert_eq!(color("1 2 3 "), Ok(Some(Vec3::new(1.0, 2.0, 3.0))));
        for bad in ["", "1 1", "1 1 x", "1 -1 1", "nan", "spectral a.rfl", "1 2 3 4"] {
            assert!(color(bad).is_err(), "{bad}");
        }
    }
}
