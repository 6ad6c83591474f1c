//! A light and a camera for scenes that bring none.

use super::{Camera, Environment, Material, Scene};
use glam::Vec3;
use std::sync::Arc;

/// Texels of the default sky's height; its width is twice that.
const SKY_HEIGHT: u32 = 128;

/// Gives a scene in which nothing shines a soft sky, and says so; a scene with any light is left alone.
pub fn add_default_light(scene: &mut Scene) -> Option<String> {
    if has_light(scene) {
        return None;
    }
    let warning = match used_materials(scene).any(|material| material.emission != Vec3::ZERO) {
        true => "nothing in the scene gives light but painted glow: a soft sky is added",
        false => "nothing in the scene gives light: a soft sky is added",
    };
    scene.environment = Some(default_sky());
    Some(warning.into())
}

/// Whether a lamp is in use, or there is a light or an environment, however dim.
///
/// An emission texture of strength 1 at most is no lamp: it paints the displays and status lights of a model that is
/// meant to be lit by something else.
pub fn has_light(scene: &Scene) -> bool {
    let is_lamp =
        |m: &Material| m.emission != Vec3::ZERO && (m.emission_texture.is_none() || m.emission.max_element() > 1.0);
    !scene.lights.is_empty() || scene.environment.is_some() || used_materials(scene).any(is_lamp)
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
    let texels = (0..width * height).map(texel).collect();
    Environment { width, height, texels: Arc::new(texels), rotation: 0.0, strength: 1.0 }
}

fn smoothstep(t: f32) -> f32 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// A camera that has the whole scene in view, in pictures at least as wide as high, and as near as that lets it: a
/// little from the right, a little from above. Rooms made of one inward sphere do not count as long as there is
/// something else.
pub fn default_camera(scene: &Scene) -> Camera {
    const YFOV: f32 = 40_f32.to_radians();
    /// Half the field of view that is filled: a little air is left around the scene.
    const FILLED: f32 = 0.93 * 0.5 * YFOV;
    let (azimuth, elevation) = (30_f32.to_radians(), 20_f32.to_radians());
    let outside = bounding_sphere(scene, false);
    let with_inward = outside.is_none();
    let (centre, radius) = outside.or_else(|| bounding_sphere(scene, true)).unwrap_or_default();
    let radius = if radius > 0.0 { radius } else { 1.0 };
    let (sin, cos) = azimuth.sin_cos();
    let towards = Vec3::new(sin * elevation.cos(), elevation.sin(), cos * elevation.cos());
    let right = Vec3::Y.cross(towards).normalize();
    let up = towards.cross(right);
    // A point stays inside a side of the frustum if distance·tan ≥ depth·tan ± (offset along the axis); the two sides of
    // an axis together give the distance, and what differs between them is where the middle of the picture should be.
    let (tan, secant) = (FILLED.tan(), 1.0 / FILLED.cos());

    let mut sides = [f32::NEG_INFINITY; 4];
    for (p, radius) in points(scene, with_inward) {
        let q = p - centre;
        let base = q.dot(towards) * tan + radius * secant;
        let (x, y) = (q.dot(right), q.dot(up));
        for (side, offset) in sides.iter_mut().zip([x, -x, y, -y]) {
            *side = side.max(base + offset);
        }
    }
    let [right_side, left_side, top, bottom] = if sides[0].is_finite() { sides } else { [radius; 4] };
    // A speck has no size of its own.
    let distance = ((right_side + left_side).max(top + bottom) * 0.5 / tan).max(1e-3 * radius);
    let target = centre + right * (0.5 * (right_side - left_side)) + up * (0.5 * (top - bottom));
    Camera::look_at("default", target + towards * distance, target, Vec3::Y, YFOV)
}

/// Vertices, and spheres with their radii. Only vertices in use: files carry stray ones.
fn points(scene: &Scene, with_inward: bool) -> impl Iterator<Item = (Vec3, f32)> {
    let vertices = scene
        .meshes
        .iter()
        .flat_map(|mesh| mesh.triangles.iter().flatten().filter_map(move |&i| mesh.positions.get(i as usize).copied()));
    let spheres = scene.spheres.iter().filter(move |sphere| with_inward || !sphere.inward);
    vertices.map(|p| (p, 0.0)).chain(spheres.map(|s| (s.centre, s.radius)))
}

impl Scene {
    /// Least and greatest corner of all surfaces, metres; none if there are none.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        bounding_box(self, true)
    }
}

fn bounding_box(scene: &Scene, with_inward: bool) -> Option<[Vec3; 2]> {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for (p, radius) in points(scene, with_inward) {
        low = low.min(p - radius);
        high = high.max(p + radius);
    }
    (low.is_finite() && high.is_finite()).then_some([low, high])
}

/// Centre of the bounding box of everything and the radius that reaches every point.
fn bounding_sphere(scene: &Scene, with_inward: bool) -> Option<(Vec3, f32)> {
    let [low, high] = bounding_box(scene, with_inward)?;
    let centre = 0.5 * (low + high);
    let reach = points(scene, with_inward).map(|(p, radius)| p.distance(centre) + radius).fold(0.0, f32::max);
    Some((centre, reach))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Projection, Sphere, Texture};

    #[test]
    fn the_camera_sees_every_vertex() {
        let positions: Vec<Vec3> = (0..8)
            .map(|i| Vec3::new((i & 1) as f32 * 5.0, (i >> 1 & 1) as f32, (i >> 2) as f32 * 3.0) + 10.0)
            .collect();
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [3, 4, 5], [5, 6, 7]], ..Mesh::default() };
        let dome = Sphere { centre: Vec3::ZERO, radius: 1000.0, inward: true, material: 0 };
        let scene = Scene { meshes: vec![mesh], spheres: vec![dome], ..Scene::default() };
        let camera = default_camera(&scene);
        let Projection::Perspective { yfov } = camera.projection else { panic!("a perspective camera") };
        let inverse = camera.world_from_camera.inverse();
        let mut widest = 0.0;
        for &p in &scene.meshes[0].positions {
            let [x, y, z] = inverse.transform_point3(p).to_array();
            assert!(z < 0.0 && x.abs().max(y.abs()) <= -z * (0.5 * yfov).tan(), "{p}");
            widest = f32::max(widest, x.abs() / (-z * (0.5 * yfov).tan()));
        }
        // And it comes near: the scene is wider than high.
        assert!(widest > 0.9, "{widest}");
        assert!(camera.focus_distance < 20.0);
    }

    #[test]
    fn the_sky_is_only_for_dark_scenes() {
        let mesh = Mesh { positions: vec![Vec3::ZERO; 3], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let materials = vec![Material::default(), Material::emitter("lamp", Vec3::ONE)];
        let mut dark = Scene { meshes: vec![mesh], materials, ..Scene::default() };
        let mut lit = dark.clone();
        lit.meshes[0].material = 1;
        assert!(add_default_light(&mut lit).is_none() && lit.environment.is_none());
        // A glowing display is no lamp, unless it is brighter than what a texture can hold.
        let mut display = lit.clone();
        display.materials[1].emission_texture = Some(Texture::new(0));
        assert!(!has_light(&display));
        display.materials[1].emission *= 2.0;
        assert!(has_light(&display));
        assert!(add_default_light(&mut dark).is_some());
        assert_eq!(dark.check(), Ok(()));
        assert!(add_default_light(&mut dark).is_none());
    }
}
