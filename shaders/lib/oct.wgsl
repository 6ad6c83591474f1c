// Octahedral directions, as in src/math/oct.rs.

// The magnitude of `a` with the sign of `b`, zeros included.
fn copysign(a: f32, b: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(a) & 0x7fffffffu) | (bitcast<u32>(b) & 0x80000000u));
}

fn vector_from_square(p: vec2<f32>) -> vec3<f32> {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let t = max(-z, 0.0);
    return vec3(p.x - copysign(t, p.x), p.y - copysign(t, p.y), z);
}

fn oct_decode(bits: u32) -> vec3<f32> {
    return normalize(oct_decode_unscaled(bits));
}

// Between 1/√3 and 1 long.
fn oct_decode_unscaled(bits: u32) -> vec3<f32> {
    return vector_from_square(vec2(f32(bits & 0xffffu), f32(bits >> 16u)) * (2.0 / 65535.0) - 1.0);
}

// The low 24 bits, 12 a component; between 1/√3 and 1 long.
fn oct_decode24_unscaled(bits: u32) -> vec3<f32> {
    return vector_from_square(vec2(f32(bits & 0xfffu), f32((bits >> 12u) & 0xfffu)) * (2.0 / 4095.0) - 1.0);
}

fn square_from_unit(unit: vec3<f32>) -> vec2<f32> {
    let v = unit / (abs(unit.x) + abs(unit.y) + abs(unit.z));
    if v.z >= 0.0 {
        return v.xy;
    }
    return vec2((1.0 - abs(v.y)) * copysign(1.0, v.x), (1.0 - abs(v.x)) * copysign(1.0, v.y));
}

fn oct_quantise(v: f32, steps: f32) -> u32 {
    return u32(clamp((v * 0.5 + 0.5) * steps + 0.5, 0.0, steps));
}

fn oct_encode(v: vec3<f32>) -> u32 {
    let p = square_from_unit(v);
    return oct_quantise(p.x, 65535.0) | (oct_quantise(p.y, 65535.0) << 16u);
}

fn oct_encode24(v: vec3<f32>) -> u32 {
    let p = square_from_unit(v);
    return oct_quantise(p.x, 4095.0) | (oct_quantise(p.y, 4095.0) << 12u);
}
