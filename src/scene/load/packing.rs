//! Textures put together from several files: opacity from `map_d`, roughness and metalness from `map_Pr` and `map_Pm`.

use super::files::Source;
use super::{LoadError, MAX_TEXELS};
use crate::scene::{Image, Material, Texture};
use std::collections::HashMap;

/// A texture that MTL spreads over several files.
pub(super) struct Packing {
    pub(super) material: usize,
    pub(super) slot: Slot,
    /// Files for R, G, B and opacity, as indices of images. Colour comes from all of the first.
    pub(super) images: [Option<usize>; 4],
}

/// Which texture of a material is put together.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Slot {
    BaseColor,
    MetallicRoughness,
}

/// Puts all textures together, points the materials to them, and drops the images that were only parts.
pub(super) fn pack_all(
    source: &Source,
    packings: &[Packing],
    materials: &mut [Material],
    images: &mut Vec<Image>,
) -> Result<(), LoadError> {
    let mut packed = HashMap::new();
    let mut texels_left = MAX_TEXELS.saturating_sub(images.iter().map(|image| image.texels.len() as u64).sum());
    for packing in packings {
        let key = (packing.slot, packing.images);
        let image = match packed.get(&key) {
            Some(&image) => image,
            None => {
                let image = packing.pack(images, &mut texels_left).ok_or_else(|| {
                    let name = &materials[packing.material].name;
                    source.too_large(name, format!("the images have more than {MAX_TEXELS} texels together"))
                })?;
                images.push(image);
                packed.insert(key, images.len() - 1);
                images.len() - 1
            }
        };
        let material = &mut materials[packing.material];
        let texture = match packing.slot {
            Slot::BaseColor => &mut material.base_color_texture,
            Slot::MetallicRoughness => &mut material.metallic_roughness_texture,
        };
        if let Some(texture) = texture {
            texture.image = image;
        }
    }
    drop_unused(materials, images);
    Ok(())
}

impl Packing {
    /// As large as the largest part; `None` if that exceeds the texels left.
    fn pack(&self, images: &[Image], texels_left: &mut u64) -> Option<Image> {
        let part = |channel: usize| self.images[channel].map(|i| &images[i]);
        let parts = [part(0), part(1), part(2), part(3)];
        let width = parts.iter().flatten().map(|image| image.width).max()?;
        let height = parts.iter().flatten().map(|image| image.height).max()?;
        *texels_left = texels_left.checked_sub(u64::from(width) * u64::from(height))?;
        let texel = |image: &Image, x: u32, y: u32| {
            let x = u64::from(x) * u64::from(image.width) / u64::from(width);
            let y = u64::from(y) * u64::from(image.height) / u64::from(height);
            image.texels[(y * u64::from(image.width) + x) as usize]
        };
        // A mask is in the opacity of its file if that has any, else in its grey.
        let masks_by_opacity = parts[3].is_some_and(|image| image.texels.iter().any(|texel| texel[3] < 255));
        let mut texels = Vec::with_capacity((width * height) as usize);
        for y in 0..height {
            for x in 0..width {
                let mut result = [255; 4];
                match (self.slot, parts[0]) {
                    (Slot::BaseColor, Some(color)) => result = texel(color, x, y),
                    _ => {
                        for channel in 0..3 {
                            if let Some(image) = parts[channel] {
                                result[channel] = texel(image, x, y)[0];
                            }
                        }
                    }
                }
                if let Some(mask) = parts[3] {
                    result[3] = texel(mask, x, y)[if masks_by_opacity { 3 } else { 0 }];
                }
                texels.push(result);
            }
        }
        let names: Vec<&str> = parts.iter().flatten().map(|image| image.name.as_str()).collect();
        Some(Image { name: names.join(" + "), width, height, texels })
    }
}

/// Drops the images that only served as parts of others.
fn drop_unused(materials: &mut [Material], images: &mut Vec<Image>) {
    let mut textures: Vec<&mut Texture> = materials
        .iter_mut()
        .flat_map(|material| {
            [
                &mut material.base_color_texture,
                &mut material.metallic_roughness_texture,
                &mut material.normal_texture,
                &mut material.emission_texture,
                &mut material.transmission_texture,
            ]
        })
        .flatten()
        .collect();
    let mut new_index = vec![None; images.len()];
    for texture in &textures {
        new_index[texture.image] = Some(0);
    }
    for (n_kept, index) in new_index.iter_mut().flatten().enumerate() {
        *index = n_kept;
    }
    for texture in &mut textures {
        texture.image = new_index[texture.image].unwrap_or(0);
    }
    let mut kept = new_index.iter().map(Option::is_some);
    images.retain(|_| kept.next() == Some(true));
}
