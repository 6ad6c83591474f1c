//! Every struct that crosses to WGSL, and nothing else. `shaders/layout.wgsl` is the twin, in the same order; a test
//! reflects it with naga and compares names, offsets and sizes.
//!
//! Directions packed in one `u32` are octahedral, 16 bits a component ([`crate::math::oct`]).

use bytemuck::{Pod, Zeroable};

/// No such index.
pub const NONE: u32 = u32::MAX;

pub use crate::index::{FANOUT, LEAF_SIZE};

/// A node of the tree over the scene's primitives: the boxes of both children, world space.
/// `n_left == 0`: `left` is a node; otherwise `left` is the first of `n_left` primitives. Likewise on the right.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneNode {
    /// Metres.
    pub left_min: [f32; 3],
    /// Node or first primitive.
    pub left: u32,
    /// Metres.
    pub left_max: [f32; 3],
    /// Primitives in the leaf; 0: inner.
    pub n_left: u32,
    /// Metres.
    pub right_min: [f32; 3],
    /// Node or first primitive.
    pub right: u32,
    /// Metres.
    pub right_max: [f32; 3],
    /// Primitives in the leaf; 0: inner.
    pub n_right: u32,
}

/// A triangle (`a`, `b`, `c` its corners) or, with [`PRIMITIVE_SPHERE`], a sphere (`a` its centre, `b[0]` its radius).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Primitive {
    /// Metres, world space.
    pub a: [f32; 3],
    /// Index into the materials.
    pub material: u32,
    /// Metres, world space.
    pub b: [f32; 3],
    /// Index into the lights if the material emits, else [`NONE`].
    pub light: u32,
    /// Metres, world space.
    pub c: [f32; 3],
    /// `PRIMITIVE_*` bits.
    pub flags: u32,
    /// Indices into the vertices.
    pub vertices: [u32; 3],
    /// What it is part of: the index of a mesh, or the number of meshes and the index of a sphere.
    pub object: u32,
}

/// The primitive is a sphere.
pub const PRIMITIVE_SPHERE: u32 = 1;
/// The sphere's front is its inside.
pub const PRIMITIVE_INWARD: u32 = 2;
/// The tangent frame is left-handed.
pub const PRIMITIVE_MIRRORED_UV: u32 = 4;
/// Opacity has to be looked up at a hit.
pub const PRIMITIVE_ALPHA: u32 = 8;
/// The eye does not see the back face.
pub const PRIMITIVE_SINGLE_SIDED: u32 = 16;
/// Neither texture coordinates nor vertex colours are needed.
pub const PRIMITIVE_PLAIN: u32 = 32;
/// The shading normal is the geometric one.
pub const PRIMITIVE_FLAT: u32 = 64;

/// What is interpolated over a triangle.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Vertex {
    /// Unit, world space.
    pub normal: [f32; 3],
    /// First texture coordinate, u.
    pub u0: f32,
    /// Unit, world space; zero where no normal map needs it.
    pub tangent: [f32; 3],
    /// First texture coordinate, v.
    pub v0: f32,
    /// Second texture coordinates.
    pub uv1: [f32; 2],
    /// Linear RGBA as four IEEE half floats: (r, g), (b, a).
    pub color: [u32; 2],
}

/// A material with indices of [`TextureSlot`]s ([`NONE`]: no texture).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Material {
    /// Linear, in [0, 1].
    pub base_color: [f32; 3],
    /// In [0, 1].
    pub opacity: f32,
    /// Radiance, front side.
    pub emission: [f32; 3],
    /// Negative: opaque; in [0, 1]: mask cut-off; 2: blend.
    pub alpha_cutoff: f32,
    /// 1/m.
    pub absorption: [f32; 3],
    /// Perceptual, in [0, 1].
    pub roughness: f32,
    /// Dielectric reflection at normal incidence, for ior, specular weight and specular colour together.
    pub f0: [f32; 3],
    /// In [0, 1].
    pub metallic: f32,
    /// In [0, 1].
    pub transmission: f32,
    /// Inside over outside.
    pub ior: f32,
    /// Scale of the normal map's x and y.
    pub normal_scale: f32,
    /// `MATERIAL_*` bits.
    pub flags: u32,
    /// Colour and opacity.
    pub base_color_slot: u32,
    /// Roughness in G, metalness in B.
    pub metallic_roughness_slot: u32,
    /// Tangent-space normal.
    pub normal_slot: u32,
    /// Radiance factor.
    pub emission_slot: u32,
    /// Transmission factor in R.
    pub transmission_slot: u32,
    /// Weight of the dielectric reflection at grazing angles, in [0, 1].
    pub f90: f32,
    /// Zero.
    pub pad: [u32; 2],
}

/// The surface bounds a refracting solid.
pub const MATERIAL_VOLUME: u32 = 1;
/// Both faces emit.
pub const MATERIAL_DOUBLE_SIDED: u32 = 2;

/// One use of an image.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TextureSlot {
    /// Column-major 2×2, image from mesh coordinates.
    pub transform: [f32; 4],
    /// Added after `transform`.
    pub offset: [f32; 2],
    /// First texel in the texel array.
    pub first_texel: u32,
    /// Width in the low, height in the high 16 bits.
    pub size: u32,
    /// `TEXTURE_*` bits; wrap of u in bits 4–5, of v in bits 6–7 (0 repeat, 1 mirror, 2 clamp).
    pub flags: u32,
    /// Zero.
    pub pad: [u32; 3],
}

/// RGB is sRGB-encoded.
pub const TEXTURE_SRGB: u32 = 1;
/// Use the second coordinates.
pub const TEXTURE_UV1: u32 = 2;
/// Nearest texel.
pub const TEXTURE_NEAREST: u32 = 4;

/// A light; `kind` is one of the `LIGHT_*`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Light {
    /// World space, metres (point, spot).
    pub position: [f32; 3],
    /// `LIGHT_*`.
    pub kind: u32,
    /// Unit, the way light travels (spot, directional).
    pub direction: [f32; 3],
    /// The emitting primitive (area).
    pub primitive: u32,
    /// Intensity (point, spot), irradiance (directional); radiance is looked up (area, environment).
    pub intensity: [f32; 3],
    /// m² (area).
    pub area: f32,
    /// Cosine of the inner half-angle (spot).
    pub cos_inner: f32,
    /// Cosine of the outer half-angle (spot).
    pub cos_outer: f32,
    /// With which this light is chosen; all add up to 1.
    pub probability: f32,
    /// Sum of the probabilities up to and including this one.
    pub cumulative: f32,
}

/// An emitting primitive.
pub const LIGHT_AREA: u32 = 0;
/// A point light.
pub const LIGHT_POINT: u32 = 1;
/// A spot light.
pub const LIGHT_SPOT: u32 = 2;
/// A directional light.
pub const LIGHT_DIRECTIONAL: u32 = 3;
/// The environment.
pub const LIGHT_ENVIRONMENT: u32 = 4;

/// Scalars of a scene.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct SceneInfo {
    /// Centre of the bounding sphere, metres.
    pub centre: [f32; 3],
    /// Its radius, metres.
    pub radius: f32,
    /// Number of lights.
    pub n_lights: u32,
    /// The light that is the environment, or [`NONE`].
    pub environment_light: u32,
    /// Texels.
    pub environment_width: u32,
    /// Texels; 0: no environment.
    pub environment_height: u32,
    /// Cosine and sine of the environment's rotation about +y.
    pub environment_rotation: [f32; 2],
    /// Smallest distance a ray starts away from a surface, relative to the largest coordinate of the point.
    pub epsilon: f32,
    /// Zero.
    pub pad0: u32,
    /// Factor on the environment's texels.
    pub environment_scale: [f32; 3],
    /// Zero.
    pub pad1: u32,
    /// Centre of a sphere about what a picture is of, if the rest is much larger, metres.
    pub subject_centre: [f32; 3],
    /// Its radius, metres; 0: there is none.
    pub subject_radius: f32,
}

/// The camera; rows of world-from-camera.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Camera {
    /// World space, unit: camera +x.
    pub right: [f32; 3],
    /// Half the width of the view at distance 1 (perspective) or in metres (orthographic).
    pub half_width: f32,
    /// World space, unit: camera +y.
    pub up: [f32; 3],
    /// Half the height, likewise.
    pub half_height: f32,
    /// World space, unit: camera −z.
    pub forward: [f32; 3],
    /// Radius of the lens, metres.
    pub aperture_radius: f32,
    /// Metres, world space.
    pub position: [f32; 3],
    /// Metres.
    pub focus_distance: f32,
    /// 1: parallel rays.
    pub orthographic: u32,
    /// Zero.
    pub pad: [u32; 3],
}

/// What changes from one iteration to the next, and the fixed choices the stages read.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Frame {
    /// Of the film (the crop), pixels.
    pub width: u32,
    /// Of the film, pixels.
    pub height: u32,
    /// Left edge of the film in the picture, pixels.
    pub crop_x: u32,
    /// Upper edge of the film in the picture, pixels.
    pub crop_y: u32,
    /// Of the whole picture, pixels.
    pub full_width: u32,
    /// Of the whole picture, pixels.
    pub full_height: u32,
    /// From 1; 0 is the pilot that chooses the first radii.
    pub iteration: u32,
    /// Chosen by the user.
    pub seed: u32,
    /// Photon paths emitted in this iteration.
    pub n_paths: u32,
    /// Longest eye path, segments.
    pub max_eye_segments: u32,
    /// Longest photon path, segments.
    pub max_photon_segments: u32,
    /// Longest whole path, segments.
    pub max_segments: u32,
    /// `FRAME_*` bits.
    pub flags: u32,
    /// Radius of this iteration over the first one.
    pub radius_scale: f32,
    /// Zero.
    pub pad: [u32; 2],
}

/// Direct light is sampled at the camera's hit; photons that have not bounced are not stored.
pub const FRAME_SAMPLE_DIRECT: u32 = 1;
/// Paths are ended by Russian roulette.
pub const FRAME_ROULETTE: u32 = 2;
/// The constant kernel instead of Epanechnikov's.
pub const FRAME_CONSTANT_KERNEL: u32 = 4;

/// Where an eye path ended, and what the gather needs there.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct EyeVertex {
    /// Metres, world space.
    pub position: [f32; 3],
    /// `EYE_*` bits; segments of the path so far in bits 8–15.
    pub flags: u32,
    /// Product of the BSDF weights from the lens to here; radiance transport.
    pub throughput: [f32; 3],
    /// Geometric normal on the eye's side, octahedral.
    pub normal: u32,
    /// Diffuse BRDF, 1/sr: for this outgoing direction it does not depend on the incoming one.
    pub diffuse: [f32; 3],
    /// Shading normal on the eye's side, octahedral.
    pub shading_normal: u32,
    /// Base colour: reflection of the metal at normal incidence, tint of transmission.
    pub base_color: [f32; 3],
    /// Unit, towards where the eye path came from, octahedral.
    pub outgoing: u32,
    /// Radiance found on the way and by sampling lights here; no photons.
    pub radiance: [f32; 3],
    /// Perceptual roughness.
    pub roughness: f32,
    /// Dielectric reflection at normal incidence.
    pub f0: [f32; 3],
    /// In [0, 1].
    pub metallic: f32,
    /// In [0, 1].
    pub transmission: f32,
    /// Transmitted over incident side, seen from the eye; 1 for thin surfaces.
    pub eta: f32,
    /// Weight of the dielectric reflection at grazing angles.
    pub f90: f32,
    /// Bits as in the material.
    pub material_flags: u32,
}

/// Photons are to be gathered here.
pub const EYE_GATHER: u32 = 1;
/// There is more than the diffuse lobe to evaluate.
pub const EYE_GLOSSY: u32 = 2;

/// What is around the end of an eye path, for its first radius.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Reach {
    /// To the [`REACHED`]-th nearest photon, metres; `f32::MAX` if there are not as many, below 0 if nothing is gathered there.
    pub distance: f32,
    /// Width of a pixel there, as if the path had been straight, metres.
    pub footprint: f32,
}

/// Photons of the pilot that a first radius reaches. Fewer would only be noisier, more only blurrier: at equal photons
/// the error changes little around ten.
pub const REACHED: u32 = 10;

/// A photon where it met a surface.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Photon {
    /// Metres, world space.
    pub position: [f32; 3],
    /// Geometric normal on the side the photon came from: octahedral, 12 bits a component, in the low 24 bits. In the high
    /// 8: segments of the path so far, at most [`MAX_PHOTON_SEGMENTS`], and [`PHOTON_CAUSTIC`].
    pub normal_and_segments: u32,
    /// Flux, W, linear RGB, before the division by the number of paths.
    pub power: [f32; 3],
    /// Unit, towards where the photon came from, octahedral.
    pub direction: u32,
}

/// Longest photon path, segments, and the mask of their number in the high 8 bits of a photon's word.
pub const MAX_PHOTON_SEGMENTS: u32 = 127;
/// In the same 8 bits: since it left the lamp, the photon was deflected at least once, and only by what the eye path would
/// have followed instead of gathering there (mirrors, clear glass, and coats nearly as smooth).
pub const PHOTON_CAUSTIC: u32 = 128;

impl Photon {
    /// Of the path from the lamp to here; 1: straight from the lamp.
    #[inline]
    pub fn segments(&self) -> u32 {
        self.normal_and_segments >> 24 & MAX_PHOTON_SEGMENTS
    }

    /// Whether it has [`PHOTON_CAUSTIC`].
    #[inline]
    pub fn is_caustic(&self) -> bool {
        self.normal_and_segments >> 24 & PHOTON_CAUSTIC != 0
    }
}

/// A box of the tree over points.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct PointBox {
    /// Metres, world space.
    pub min: [f32; 3],
    /// Zero.
    pub pad0: u32,
    /// Metres, world space.
    pub max: [f32; 3],
    /// Zero.
    pub pad1: u32,
}

/// Eight boxes of the tree over points, in 64 bytes: a box reaches from `origin + low · 2^e` to `origin + high · 2^e`
/// along each axis and holds what it stands for (the compressed wide nodes of Ylitie et al. 2017).
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct TreeNode {
    /// Least corner of all children.
    pub origin: [f32; 3],
    /// e + 127 of x, y and z from the lowest byte up; the highest is the number of children.
    pub exponents: u32,
    /// Along x, a byte a child: low of children 0–3, of 4–7, high of 0–3, of 4–7.
    pub x: [u32; 4],
    /// Along y.
    pub y: [u32; 4],
    /// Along z.
    pub z: [u32; 4],
}
