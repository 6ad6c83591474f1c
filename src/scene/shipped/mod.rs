//! The scenes that come with the renderer, made by code: own work, CC0, the same at every call.
//!
//! Metres, y up. Each is a case of its own: `cornell` a first picture, `glass` a clean caustic, `pool` caustics under
//! waves, `bathroom` light that reaches nothing except through glass, `fireplace` hundreds of small lamps.

mod bathroom;
mod cornell;
mod curved;
mod fireplace;
mod furniture;
mod glass;
mod pattern;
mod pool;
mod shape;
#[cfg(test)]
mod tests;

use glam::{Affine3A, Mat3, Vec3};

use super::{Camera, Image, Material, Mesh, Projection, Scene, Sphere, Texture};
use shape::Shape;

/// The names that [`shipped`] knows.
pub const NAMES: [&str; 5] = ["cornell", "glass", "pool", "bathroom", "fireplace"];

/// The scene of that name, made anew.
pub fn shipped(name: &str) -> Option<Scene> {
    match name {
        "cornell" => Some(cornell::scene()),
        "glass" => Some(glass::scene()),
        "pool" => Some(pool::scene()),
        "bathroom" => Some(bathroom::scene()),
        "fireplace" => Some(fireplace::scene()),
        _ => None,
    }
}

/// An analytic sphere as a mesh, close enough that its outline looks round.
pub(super) fn sphere_mesh(name: &str, sphere: &Sphere) -> Mesh {
    let shape = Shape::icosphere(sphere.centre, sphere.radius, 5);
    let shape = if sphere.inward { shape.inverted() } else { shape };
    shape.into_mesh(name, sphere.material)
}

/// A scene being put together.
#[derive(Default)]
struct Builder {
    scene: Scene,
}

impl Builder {
    /// Adds a material; its index.
    fn material(&mut self, material: Material) -> usize {
        self.scene.materials.push(material);
        self.scene.materials.len() - 1
    }

    /// Adds an image; a use of it that shows it once every `size` metres.
    fn image(&mut self, image: Image, size: [f32; 2]) -> Texture {
        self.scene.images.push(image.into());
        let mut texture = Texture::new(self.scene.images.len() - 1);
        texture.transform = glam::Mat2::from_diagonal(glam::Vec2::new(1.0 / size[0], 1.0 / size[1]));
        texture
    }

    /// Adds a mesh. Texture coordinates are left out where the material has no texture.
    fn add(&mut self, name: &str, shape: Shape, material: usize) {
        let m = &self.scene.materials[material];
        let textured = m.base_color_texture.is_some()
            || m.metallic_roughness_texture.is_some()
            || m.normal_texture.is_some()
            || m.emission_texture.is_some()
            || m.transmission_texture.is_some();
        let shape = if textured { shape } else { shape.without_uvs() };
        self.scene.meshes.push(shape.into_mesh(name, material).into());
    }

    /// Adds a pinhole camera; `yfov` in degrees.
    fn camera(&mut self, name: &str, eye: Vec3, target: Vec3, yfov: f32, aspect: f32) {
        self.scene.cameras.push(Camera {
            name: name.into(),
            world_from_camera: looking_at(eye, target),
            projection: Projection::Perspective { yfov: yfov.to_radians() },
            aperture_radius: 0.0,
            focus_distance: eye.distance(target),
            aspect: Some(aspect),
        });
    }
}

/// World from camera for an eye that looks at `target` with +y up.
fn looking_at(eye: Vec3, target: Vec3) -> Affine3A {
    let back = (eye - target).normalize();
    let right = Vec3::Y.cross(back).normalize();
    Affine3A::from_mat3_translation(Mat3::from_cols(right, back.cross(right), back), eye)
}

/// A dielectric with a diffuse body: paint, ceramic, plastic, varnish.
fn glossy(name: &str, base_color: Vec3, roughness: f32) -> Material {
    Material { name: name.into(), base_color, roughness, ..Material::default() }
}

/// Linear RGB from three sRGB bytes, as in 0xC04030.
fn srgb(hex: u32) -> Vec3 {
    let channel = |shift: u32| {
        let v = (hex >> shift & 0xff) as f32 / 255.0;
        if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
    };
    Vec3::new(channel(16), channel(8), channel(0))
}
