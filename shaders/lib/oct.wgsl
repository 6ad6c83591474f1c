// Octahedral directions, as in src/math/oct.rs.

fn oct_unfold(x: f32, y: f32) -> vec3<f32> {
    let z = 1.0 - abs(x) - abs(y);
    let t = max(-z, 0.0);
    let folded = vec3(select(x + t, x - t, x >= 0.0), select(y + t, y - t, y >= 0.0), z);
    return normalize(folded);
}

fn oct_decode(packed: u32) -> vec3<f32> {
    return oct_unfold(f32(packed & 0xffffu) / 65535.0 * 2.0 - 1.0, f32(packed >> 16u) / 65535.0 * 2.0 - 1.0);
}

// The low 24 bits: 12 a component.
fn oct_decode_24(packed: u32) -> vec3<f32> {
    return oct_unfold(f32(packed & 0xfffu) / 4095.0 * 2.0 - 1.0, f32((packed >> 12u) & 0xfffu) / 4095.0 * 2.0 - 1.0);
}

fn oct_fold(direction: vec3<f32>) -> vec2<f32> {
    let v = direction / (abs(direction.x) + abs(direction.y) + abs(direction.z));
    if v.z >= 0.0 {
        return v.xy;
    }
    return vec2(select(abs(v.y) - 1.0, 1.0 - abs(v.y), v.x >= 0.0), select(abs(v.x) - 1.0, 1.0 - abs(v.x), v.y >= 0.0));
}

fn oct_encode(direction: vec3<f32>) -> u32 {
    let q = vec2<u32>(floor(clamp(oct_fold(direction) * 0.5 + 0.5, vec2(0.0), vec2(1.0)) * 65535.0 + 0.5));
    return q.x | (q.y << 16u);
}

fn oct_encode_24(direction: vec3<f32>) -> u32 {
    let q = vec2<u32>(floor(clamp(oct_fold(direction) * 0.5 + 0.5, vec2(0.0), vec2(1.0)) * 4095.0 + 0.5));
    return q.x | (q.y << 12u);
}
