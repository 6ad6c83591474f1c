// Random numbers by counting, as in src/math/rng.rs: the same integers.

fn pcg4d(seed: vec4<u32>) -> vec4<u32> {
    var v = seed * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

fn rng_unit(bits: u32) -> f32 {
    return f32(bits >> 8u) * (1.0 / 16777216.0);
}

const STREAM_EYE: u32 = 0u;
const STREAM_PHOTON: u32 = 1u;

struct Rng {
    path: u32,
    dimension: u32,
    iteration: u32,
    seed: u32,
}

fn rng_new(stream: u32, path: u32, iteration: u32, seed: u32) -> Rng {
    return Rng(path, stream << 24u, iteration, seed);
}

fn rng_next4(rng: ptr<function, Rng>) -> vec4<f32> {
    let bits = pcg4d(vec4((*rng).path, (*rng).dimension, (*rng).iteration, (*rng).seed));
    (*rng).dimension += 1u;
    return vec4<f32>(bits >> vec4(8u)) * (1.0 / 16777216.0);
}

fn rng_alpha_seed(rng: Rng) -> u32 {
    return (rng.path * 0x9e3779b1u) ^ (rng.iteration * 0x85ebca6bu) ^ rng.dimension ^ rng.seed;
}
