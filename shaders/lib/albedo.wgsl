// Directional albedo of the GGX lobe, as in src/scene/albedo.rs.
#import scene

const COSINES: u32 = 64u;
const ROUGHNESSES: u32 = 32u;

fn albedo_at(i: u32, j: u32) -> vec2<f32> {
    let index = j * COSINES + i;
    let pair = bitcast<vec4<f32>>(table[tables.albedo + index / 2u]);
    return select(pair.zw, pair.xy, (index & 1u) == 0u);
}

fn albedo_look_up(cosine: f32, roughness: f32) -> vec2<f32> {
    let x = clamp(cosine, 0.0, 1.0) * f32(COSINES - 1u);
    let y = clamp(roughness, 0.0, 1.0) * f32(ROUGHNESSES - 1u);
    let i = min(u32(x), COSINES - 2u);
    let j = min(u32(y), ROUGHNESSES - 2u);
    let fx = x - f32(i);
    let fy = y - f32(j);
    let low = albedo_at(i, j) * (1.0 - fx) + albedo_at(i + 1u, j) * fx;
    let high = albedo_at(i, j + 1u) * (1.0 - fx) + albedo_at(i + 1u, j + 1u) * fx;
    return low * (1.0 - fy) + high * fy;
}
