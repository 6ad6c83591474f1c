// Twin of src/layout.rs, in the same order; a test compares names, offsets and sizes. What the fields mean stands there.

const NONE: u32 = 0xffffffffu;

const LEAF_SIZE: u32 = 8u;
const FANOUT: u32 = 8u;

struct SceneNode {
    left_min: vec3<f32>,
    left: u32,
    left_max: vec3<f32>,
    n_left: u32,
    right_min: vec3<f32>,
    right: u32,
    right_max: vec3<f32>,
    n_right: u32,
}

struct Primitive {
    a: vec3<f32>,
    material: u32,
    b: vec3<f32>,
    light: u32,
    c: vec3<f32>,
    flags: u32,
    vertices: vec3<u32>,
    object: u32,
}

const PRIMITIVE_SPHERE: u32 = 1u;
const PRIMITIVE_INWARD: u32 = 2u;
const PRIMITIVE_MIRRORED_UV: u32 = 4u;
const PRIMITIVE_ALPHA: u32 = 8u;
const PRIMITIVE_SINGLE_SIDED: u32 = 16u;
const PRIMITIVE_PLAIN: u32 = 32u;
const PRIMITIVE_FLAT: u32 = 64u;

struct Vertex {
    normal: vec3<f32>,
    u0: f32,
    tangent: vec3<f32>,
    v0: f32,
    uv1: vec2<f32>,
    color: vec2<u32>,
}

struct Material {
    base_color: vec3<f32>,
    opacity: f32,
    emission: vec3<f32>,
    alpha_cutoff: f32,
    absorption: vec3<f32>,
    roughness: f32,
    f0: vec3<f32>,
    metallic: f32,
    transmission: f32,
    ior: f32,
    normal_scale: f32,
    flags: u32,
    base_color_slot: u32,
    metallic_roughness_slot: u32,
    normal_slot: u32,
    emission_slot: u32,
    transmission_slot: u32,
    f90: f32,
    pad: vec2<u32>,
}

const MATERIAL_VOLUME: u32 = 1u;
const MATERIAL_DOUBLE_SIDED: u32 = 2u;

struct TextureSlot {
    transform: vec4<f32>,
    offset: vec2<f32>,
    first_texel: u32,
    size: u32,
    flags: u32,
    pad: array<u32, 3>,
}

const TEXTURE_SRGB: u32 = 1u;
const TEXTURE_UV1: u32 = 2u;
const TEXTURE_NEAREST: u32 = 4u;

struct Light {
    position: vec3<f32>,
    kind: u32,
    direction: vec3<f32>,
    primitive: u32,
    intensity: vec3<f32>,
    area: f32,
    cos_inner: f32,
    cos_outer: f32,
    probability: f32,
    cumulative: f32,
}

const LIGHT_AREA: u32 = 0u;
const LIGHT_POINT: u32 = 1u;
const LIGHT_SPOT: u32 = 2u;
const LIGHT_DIRECTIONAL: u32 = 3u;
const LIGHT_ENVIRONMENT: u32 = 4u;

struct SceneInfo {
    centre: vec3<f32>,
    radius: f32,
    n_lights: u32,
    environment_light: u32,
    environment_width: u32,
    environment_height: u32,
    environment_rotation: vec2<f32>,
    epsilon: f32,
    pad0: u32,
    environment_scale: vec3<f32>,
    pad1: u32,
    subject_centre: vec3<f32>,
    subject_radius: f32,
}

struct Camera {
    right: vec3<f32>,
    half_width: f32,
    up: vec3<f32>,
    half_height: f32,
    forward: vec3<f32>,
    aperture_radius: f32,
    position: vec3<f32>,
    focus_distance: f32,
    orthographic: u32,
    // A uniform may hold neither array<u32, 3> nor, here, a vec3.
    pad_x: u32,
    pad_y: u32,
    pad_z: u32,
}

struct Frame {
    width: u32,
    height: u32,
    crop_x: u32,
    crop_y: u32,
    full_width: u32,
    full_height: u32,
    iteration: u32,
    seed: u32,
    n_paths: u32,
    max_eye_segments: u32,
    max_photon_segments: u32,
    max_segments: u32,
    flags: u32,
    radius_scale: f32,
    pad: vec2<u32>,
}

const FRAME_SAMPLE_DIRECT: u32 = 1u;
const FRAME_ROULETTE: u32 = 2u;
const FRAME_CONSTANT_KERNEL: u32 = 4u;

struct EyeVertex {
    position: vec3<f32>,
    flags: u32,
    throughput: vec3<f32>,
    normal: u32,
    diffuse: vec3<f32>,
    shading_normal: u32,
    base_color: vec3<f32>,
    outgoing: u32,
    radiance: vec3<f32>,
    roughness: f32,
    f0: vec3<f32>,
    metallic: f32,
    transmission: f32,
    eta: f32,
    f90: f32,
    material_flags: u32,
}

const EYE_GATHER: u32 = 1u;
const EYE_GLOSSY: u32 = 2u;

struct Reach {
    distance: f32,
    footprint: f32,
}

const REACHED: u32 = 10u;

struct Photon {
    position: vec3<f32>,
    normal_and_segments: u32,
    power: vec3<f32>,
    direction: u32,
}

const MAX_PHOTON_SEGMENTS: u32 = 127u;
const PHOTON_CAUSTIC: u32 = 128u;

struct PointBox {
    min: vec3<f32>,
    pad0: u32,
    max: vec3<f32>,
    pad1: u32,
}

struct TreeNode {
    origin: vec3<f32>,
    exponents: u32,
    x: vec4<u32>,
    y: vec4<u32>,
    z: vec4<u32>,
}
