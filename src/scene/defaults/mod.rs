//! A light and a camera for scenes that bring none.

mod camera;
mod inside;
mod view;

pub use camera::default_camera;

use super::{Environment, Material, Scene};
use glam::Vec3;
use std::sync::{Arc, OnceLock};

/// Texels of the default sky's height; its width is twice that.
const SKY_HEIGHT: u32 = 128;

/// Gives a scene in which nothing shines ([`has_light`]) a soft sky, and says so.
pub fn add_default_light(scene: &mut Scene) -> String {
    let warning = match used_materials(scene).any(|material| material.emission != Vec3::ZERO) {
        true => "nothing in the scene's file gives light but painted glow: a soft sky is added",
        false => "nothing in the scene's file gives light: a soft sky is added",
    };
    scene.environment = Some(default_sky());
    warning.into()
}

/// Whether a lamp is in use, or there is a light or an environment, however dim.
pub fn has_light(scene: &Scene) -> bool {
    !scene.lights.is_empty() || scene.environment.is_some() || used_materials(scene).any(is_lamp)
}

/// An emission texture of strength 1 at most is no lamp: it paints the displays and status lights of a model that is
/// meant to be lit by something else.
pub(super) fn is_lamp(material: &Material) -> bool {
    material.emission != Vec3::ZERO && (material.emission_texture.is_none() || material.emission.max_element() > 1.0)
}

fn used_materials(scene: &Scene) -> impl Iterator<Item = &Material> {
    let of_meshes = scene.meshes.iter().filter(|mesh| !mesh.triangles.is_empty()).map(|mesh| mesh.material);
    let of_spheres = scene.spheres.iter().map(|sphere| sphere.material);
    of_meshes.chain(of_spheres).filter_map(|material| scene.materials.get(material))
}

/// A gradient from a dim ground to a pale horizon to a bluish zenith, and one broad bright region high on the left of
/// [`default_camera`], wide enough for soft shadows and bright enough for caustics.
pub fn default_sky() -> Environment {
    /// Radiance at the middle of the bright region.
    const SUN: Vec3 = Vec3::new(24.0, 22.5, 20.0);
    /// 1 − cosine at which the region has fallen to 1/e: about 16°.
    const SUN_WIDTH: f32 = 0.04;
    let (ground, horizon, zenith) = (Vec3::splat(0.18), Vec3::splat(0.75), Vec3::new(0.30, 0.38, 0.52));
    let sun_direction = Vec3::new(-0.55, 0.75, 0.45).normalize();
    let (width, height) = (2 * SKY_HEIGHT, SKY_HEIGHT);
    let texel = |i: u32| {
        let uv = glam::Vec2::new((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let direction = Environment::direction_of(uv / glam::Vec2::new(width as f32, height as f32));
        let sky = horizon.lerp(zenith, direction.y.max(0.0).sqrt());
        // A horizon without an edge.
        let base = ground.lerp(sky, smoothstep((direction.y + 0.1) / 0.2));
        base + SUN * ((direction.dot(sun_direction) - 1.0) / SUN_WIDTH).exp()
    };
    // The very same each time, for those who compare.
    static TEXELS: OnceLock<Arc<Vec<Vec3>>> = OnceLock::new();
    let texels = TEXELS.get_or_init(|| Arc::new((0..width * height).map(texel).collect()));
    Environment { width, height, texels: Arc::clone(texels), rotation: 0.0, strength: 1.0, tint: Vec3::ONE }
}

fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Texture};

    #[test]
    fn the_sky_is_only_for_dark_scenes() {
        let mesh = Mesh { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let materials = vec![Material::default(), Material::emitter("lamp", Vec3::ONE)];
        let mut dark = Scene { meshes: vec![mesh.into()], materials, ..Scene::default() };
        let mut lit = dark.clone();
        Arc::make_mut(&mut lit.meshes[0]).material = 1;
        assert!(has_light(&lit));
        // A glowing display is no lamp, unless it is brighter than what a texture can hold.
        let mut display = lit.clone();
        display.materials[1].emission_texture = Some(Texture::new(0));
        assert!(!has_light(&display));
        display.materials[1].emission *= 2.0;
        assert!(has_light(&display));
        assert!(!has_light(&dark) && add_default_light(&mut dark).contains("sky"));
        assert_eq!(dark.check(), Ok(()));
        assert!(has_light(&dark));
    }
}
