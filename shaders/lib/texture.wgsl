// Textures and what is interpolated over a triangle, as in src/cpu/texture.rs.
#import scene

struct Attributes {
    // Both sets of texture coordinates.
    uv0: vec2<f32>,
    uv1: vec2<f32>,
    // Linear RGBA.
    color: vec4<f32>,
}

// Four halves; unpack2x16float is not everywhere.
fn vertex_color(color: vec2<u32>) -> vec4<f32> {
    let halves = vec4(color.x & 0xffffu, color.x >> 16u, color.y & 0xffffu, color.y >> 16u);
    let magnitude = bitcast<vec4<f32>>((halves & vec4(0x7fffu)) << vec4(13u)) * 5.192296858534828e33;
    return select(magnitude, -magnitude, (halves & vec4(0x8000u)) != vec4(0u));
}

// Four halves of one, twice.
const WHITE: u32 = 0x3c003c00u;

fn attributes_at(p: Primitive, u: f32, v: f32) -> Attributes {
    if (p.flags & (PRIMITIVE_SPHERE | PRIMITIVE_PLAIN)) != 0u {
        return Attributes(vec2(0.0), vec2(0.0), vec4(1.0));
    }
    let a = vertices[p.vertices.x];
    let b = vertices[p.vertices.y];
    let c = vertices[p.vertices.z];
    let w = 1.0 - u - v;
    let uv0 = vec2(w * a.u0 + u * b.u0 + v * c.u0, w * a.v0 + u * b.v0 + v * c.v0);
    let uv1 = w * a.uv1 + u * b.uv1 + v * c.uv1;
    var color = vec4(1.0);
    if any(a.color != vec2(WHITE)) || any(b.color != vec2(WHITE)) || any(c.color != vec2(WHITE)) {
        color = w * vertex_color(a.color) + u * vertex_color(b.color) + v * vertex_color(c.color);
    }
    return Attributes(uv0, uv1, color);
}

fn texture_opacity(p: Primitive, material: Material, u: f32, v: f32) -> f32 {
    let at = attributes_at(p, u, v);
    var texel = 1.0;
    if material.base_color_slot != NONE {
        texel = texture_sample(material.base_color_slot, at).w;
    }
    return material.opacity * at.color.w * texel;
}

fn texture_sample(slot: u32, at: Attributes) -> vec4<f32> {
    let s = slot_at(slot);
    var uv = select(at.uv0, at.uv1, (s.flags & TEXTURE_UV1) != 0u);
    let t = s.transform;
    uv = vec2(t.x * uv.x + t.z * uv.y + s.offset.x, t.y * uv.x + t.w * uv.y + s.offset.y);
    let width = i32(s.size & 0xffffu);
    let height = i32(s.size >> 16u);
    let wrap_u = (s.flags >> 4u) & 3u;
    let wrap_v = (s.flags >> 6u) & 3u;
    var x = texture_wrapped(uv.x, wrap_u) * f32(width);
    var y = texture_wrapped(uv.y, wrap_v) * f32(height);
    let nearest = (s.flags & TEXTURE_NEAREST) != 0u;
    if !nearest {
        x -= 0.5;
        y -= 0.5;
    }
    let x0 = floor(x);
    let y0 = floor(y);
    var sum = vec4(0.0);
    for (var corner = 0; corner < 4; corner++) {
        let dx = corner & 1;
        let dy = corner >> 1u;
        var weight = select(1.0 - (x - x0), x - x0, dx == 1) * select(1.0 - (y - y0), y - y0, dy == 1);
        if nearest {
            weight = select(0.0, 1.0, corner == 0);
        }
        if weight == 0.0 {
            continue;
        }
        let i = texture_inside(i32(x0) + dx, width, wrap_u);
        let j = texture_inside(i32(y0) + dy, height, wrap_v);
        sum += weight * texture_texel(texels[s.first_texel + u32(j * width + i)], (s.flags & TEXTURE_SRGB) != 0u);
    }
    return sum;
}

// Into [0, 1].
fn texture_wrapped(x: f32, wrap: u32) -> f32 {
    if wrap == 0u {
        return x - floor(x);
    }
    if wrap == 1u {
        let y = x - 2.0 * floor(x * 0.5);
        return select(y, 2.0 - y, y > 1.0);
    }
    return clamp(x, 0.0, 1.0);
}

// The texel next to the border, when a bilinear footprint reaches over it.
fn texture_inside(i: i32, n: i32, wrap: u32) -> i32 {
    if wrap == 0u {
        return select(select(i, 0, i >= n), n - 1, i < 0);
    }
    return clamp(i, 0, n - 1);
}

fn texture_texel(bits: u32, srgb: bool) -> vec4<f32> {
    let value = vec4<f32>(vec4(bits & 0xffu, (bits >> 8u) & 0xffu, (bits >> 16u) & 0xffu, bits >> 24u)) * (1.0 / 255.0);
    if !srgb {
        return value;
    }
    return vec4(select(pow((value.xyz + 0.055) / 1.055, vec3(2.4)), value.xyz / 12.92, value.xyz <= vec3(0.04045)), value.w);
}
