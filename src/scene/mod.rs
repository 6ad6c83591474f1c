//! A scene: what a file says, checked once, then never changed.
//!
//! World space is right-handed with y up and metres (glTF's). Light is in one consistent set of units: radiance for
//! emission (nits in glTF), intensity per steradian for point and spot lights (candela), irradiance for directional
//! ones (lux). Colours are linear RGB with the sRGB primaries.

use std::sync::Arc;

use glam::{Affine3A, Mat2, Vec2, Vec3, Vec4};

/// Everything a picture is computed from. Plain data: [`Scene::check`] says whether it can be rendered. What is large is shared: a
/// clone costs little.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// Triangle meshes in world space.
    pub meshes: Vec<Arc<Mesh>>,
    /// Analytic spheres in world space.
    pub spheres: Vec<Sphere>,
    /// Materials, referred to by index.
    pub materials: Vec<Material>,
    /// Images, referred to by index from [`Texture`].
    pub images: Vec<Arc<Image>>,
    /// Point, spot and directional lights. Emissive materials make area lights by themselves.
    pub lights: Vec<PunctualLight>,
    /// Light from infinitely far away.
    pub environment: Option<Environment>,
    /// Cameras, in file order.
    pub cameras: Vec<Camera>,
}

/// A triangle mesh with one material. The optional attributes are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// For messages.
    pub name: String,
    /// Metres, world space.
    pub positions: Vec<Vec3>,
    /// Unit, world space; empty: faceted.
    pub normals: Vec<Vec3>,
    /// Unit xyz and handedness w (±1), world space; empty: derived from `uv0` where a normal map needs it.
    pub tangents: Vec<Vec4>,
    /// First texture coordinates; empty: (0, 0).
    pub uv0: Vec<Vec2>,
    /// Second texture coordinates; empty: `uv0`.
    pub uv1: Vec<Vec2>,
    /// Linear RGBA that multiplies the base colour; empty: white.
    pub colors: Vec<Vec4>,
    /// Counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// An analytic sphere; its front is outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Metres, world space.
    pub centre: Vec3,
    /// Metres, positive. With `inward`, the front is the inside.
    pub radius: f32,
    /// Whether the front is the inside (a closed room).
    pub inward: bool,
    /// Index into [`Scene::materials`].
    pub material: usize,
}

/// glTF's metallic-roughness material with transmission, index of refraction, volume and specular weight.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// For messages and for selection.
    pub name: String,
    /// Linear, each in [0, 1].
    pub base_color: Vec3,
    /// Opacity in [0, 1].
    pub opacity: f32,
    /// sRGB colour and linear opacity, multiplied into the two above.
    pub base_color_texture: Option<Texture>,
    /// What opacity does.
    pub alpha: AlphaMode,
    /// In [0, 1].
    pub metallic: f32,
    /// Perceptual, in [0, 1]; the GGX width is its square.
    pub roughness: f32,
    /// Roughness in G, metalness in B, multiplied into the two above.
    pub metallic_roughness_texture: Option<Texture>,
    /// Tangent-space normals.
    pub normal_texture: Option<Texture>,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// Radiance leaving the front (both sides if `double_sided`); linear, any non-negative value.
    pub emission: Vec3,
    /// sRGB, multiplied into the above.
    pub emission_texture: Option<Texture>,
    /// Share of the light entering a dielectric that is let through, in [0, 1].
    pub transmission: f32,
    /// Multiplied in from R.
    pub transmission_texture: Option<Texture>,
    /// Index of refraction of the inside over that of the outside; positive.
    pub ior: f32,
    /// Weight of the dielectric reflection (`KHR_materials_specular`) in [0, 1]; 0 is a pure diffuser.
    pub specular: f32,
    /// Colour of the dielectric reflection at normal incidence.
    pub specular_color: Vec3,
    /// The surface bounds a solid that refracts and absorbs; otherwise it is infinitely thin.
    pub volume: bool,
    /// Absorption inside a solid, 1/m, each ≥ 0: transmittance over t metres is exp(−absorption·t).
    pub absorption: Vec3,
    /// Whether the eye sees the back face. Light never passes an opaque back face.
    pub double_sided: bool,
}

impl Default for Material {
    fn default() -> Self {
        Self {
            name: String::new(),
            base_color: Vec3::ONE,
            opacity: 1.0,
            base_color_texture: None,
            alpha: AlphaMode::Opaque,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal_texture: None,
            normal_scale: 1.0,
            emission: Vec3::ZERO,
            emission_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_color: Vec3::ONE,
            volume: false,
            absorption: Vec3::ZERO,
            double_sided: true,
        }
    }
}

impl Material {
    /// Whether any texture is used.
    pub fn is_textured(&self) -> bool {
        let textures = [
            &self.base_color_texture,
            &self.metallic_roughness_texture,
            &self.normal_texture,
            &self.emission_texture,
            &self.transmission_texture,
        ];
        textures.iter().any(|t| t.is_some())
    }

    /// A pure Lambertian reflector.
    pub fn diffuse(name: &str, base_color: Vec3) -> Self {
        Self { name: name.into(), base_color, specular: 0.0, ..Self::default() }
    }

    /// A smooth clear solid.
    pub fn glass(name: &str, ior: f32) -> Self {
        Self { name: name.into(), roughness: 0.0, transmission: 1.0, ior, volume: true, ..Self::default() }
    }

    /// A metal of the given colour at normal incidence.
    pub fn metal(name: &str, base_color: Vec3, roughness: f32) -> Self {
        Self { name: name.into(), base_color, metallic: 1.0, roughness, ..Self::default() }
    }

    /// A black surface that emits.
    pub fn emitter(name: &str, emission: Vec3) -> Self {
        Self {
            name: name.into(),
            base_color: Vec3::ZERO,
            specular: 0.0,
            emission,
            double_sided: false,
            ..Self::default()
        }
    }
}

/// What a material does with opacity (glTF `alphaMode`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AlphaMode {
    /// Ignored.
    Opaque,
    /// There where it is at least the cut-off, absent elsewhere.
    Mask(f32),
    /// There with that probability.
    Blend,
}

/// One use of an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Scene::images`].
    pub image: usize,
    /// Which coordinates: 0 or 1.
    pub uv_set: u32,
    /// Linear part of image-from-mesh coordinates (`KHR_texture_transform`), applied before `offset`.
    pub transform: Mat2,
    /// Offset after `transform`.
    pub offset: Vec2,
    /// Behaviour outside [0, 1] in u and v.
    pub wrap: [Wrap; 2],
    /// Nearest texel instead of bilinear.
    pub nearest: bool,
}

impl Texture {
    /// The image as it is: first coordinates, repeated, bilinear.
    pub fn new(image: usize) -> Self {
        Self {
            image,
            uv_set: 0,
            transform: Mat2::IDENTITY,
            offset: Vec2::ZERO,
            wrap: [Wrap::Repeat; 2],
            nearest: false,
        }
    }
}

/// Texture addressing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrap {
    /// Tiles.
    Repeat,
    /// Tiles, every other one mirrored.
    Mirror,
    /// The border goes on.
    Clamp,
}

/// An image of 8-bit RGBA, row 0 on top (v = 0). Its use decides whether RGB is sRGB-encoded.
#[derive(Clone, Debug)]
pub struct Image {
    /// For messages.
    pub name: String,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// `[height · width]`, row-major.
    pub texels: Vec<[u8; 4]>,
}

/// A light without extent.
#[derive(Clone, Debug, PartialEq)]
pub struct PunctualLight {
    /// For messages and for selection; may be empty.
    pub name: String,
    /// World space, metres; of no meaning for a directional light.
    pub position: Vec3,
    /// Unit, the way the light travels; of no meaning for a point light.
    pub direction: Vec3,
    /// Linear colour times candela (point, spot) or lux (directional).
    pub intensity: Vec3,
    /// Which of the three.
    pub kind: PunctualKind,
}

/// The kinds of `KHR_lights_punctual`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PunctualKind {
    /// Alike in all directions.
    Point,
    /// Full inside the inner half-angle, none outside the outer one (radians, 0 ≤ inner < outer ≤ π/2).
    Spot {
        /// Radians from the axis.
        inner: f32,
        /// Radians from the axis.
        outer: f32,
    },
    /// From infinitely far away.
    Directional,
}

/// Radiance from all directions, latitude-longitude: u from 0 to 1 turns once around +y beginning at −x by way of
/// −z … see [`Environment::uv_of`]; v = 0 is +y.
#[derive(Clone, Debug)]
pub struct Environment {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Radiance, linear RGB, `[height · width]`, row 0 is +y. Shared: a clone costs nothing.
    pub texels: Arc<Vec<Vec3>>,
    /// Radians about +y, counter-clockwise seen from above.
    pub rotation: f32,
    /// Factor on every texel.
    pub strength: f32,
    /// Another, linear RGB.
    pub tint: Vec3,
}

/// A camera that looks along its −z with +y up (glTF's).
#[derive(Clone, Debug)]
pub struct Camera {
    /// For `--camera NAME`.
    pub name: String,
    /// Rigid: rotation and translation only.
    pub world_from_camera: Affine3A,
    /// How rays leave.
    pub projection: Projection,
    /// Radius of the lens, metres; 0 is a pinhole.
    pub aperture_radius: f32,
    /// Distance of the plane in focus, metres.
    pub focus_distance: f32,
    /// Width over height, if the file says.
    pub aspect: Option<f32>,
}

/// How a camera's rays leave.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// All through one point.
    Perspective {
        /// Full vertical field of view, radians.
        yfov: f32,
    },
    /// All parallel.
    Orthographic {
        /// Half the height of the view, metres.
        ymag: f32,
    },
}

pub mod albedo;
pub mod bvh;
mod camera;
pub mod check;
pub mod defaults;
mod environment;
pub mod export;
mod kd;
pub mod load;
mod packed;
pub mod settings;
pub mod shipped;
mod subject;

pub use check::SceneError;
pub use kd::{Accelerator, SceneKd};
pub use packed::PackedScene;
pub use settings::Settings;
