//! Textures and what is interpolated over a triangle.

use glam::{Vec2, Vec3, Vec4};
use half::f16;

use crate::layout::{self, NONE, PRIMITIVE_PLAIN, PRIMITIVE_SPHERE, Primitive, Vertex};
use crate::scene::PackedScene;

/// Texture coordinates of both sets and vertex colour at a point of a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Attributes {
    /// First and second coordinates.
    pub uv: [Vec2; 2],
    /// Linear RGBA.
    pub color: Vec4,
}

fn halves(bits: u32) -> [f32; 2] {
    [f16::from_bits(bits as u16).to_f32(), f16::from_bits((bits >> 16) as u16).to_f32()]
}

fn color(v: &Vertex) -> Vec4 {
    let ([r, g], [b, a]) = (halves(v.color[0]), halves(v.color[1]));
    Vec4::new(r, g, b, a)
}

/// Where there is nothing to interpolate.
const PLAIN: Attributes = Attributes { uv: [Vec2::ZERO; 2], color: Vec4::ONE };

/// Interpolated with the weights `u`, `v` of the second and third corner.
pub fn attributes(scene: &PackedScene, p: &Primitive, u: f32, v: f32) -> Attributes {
    if p.flags & PRIMITIVE_SPHERE != 0 {
        return PLAIN;
    }
    if p.flags & PRIMITIVE_PLAIN != 0 {
        return PLAIN;
    }
    let [a, b, c] = p.vertices.map(|i| &scene.vertices[i as usize]);
    let w = 1.0 - u - v;
    let uv0 = Vec2::new(w * a.u0 + u * b.u0 + v * c.u0, w * a.v0 + u * b.v0 + v * c.v0);
    let uv1 = w * Vec2::from(a.uv1) + u * Vec2::from(b.uv1) + v * Vec2::from(c.uv1);
    let color = if a.color == WHITE && b.color == WHITE && c.color == WHITE {
        Vec4::ONE
    } else {
        w * color(a) + u * color(b) + v * color(c)
    };
    Attributes { uv: [uv0, uv1], color }
}

/// Four halves of one.
const WHITE: [u32; 2] = [0x3c00_3c00; 2];

/// Opacity at a hit.
pub fn opacity(scene: &PackedScene, p: &Primitive, material: &layout::Material, u: f32, v: f32) -> f32 {
    let at = attributes(scene, p, u, v);
    let texel = if material.base_color_slot == NONE { 1.0 } else { sample(scene, material.base_color_slot, &at).w };
    material.opacity * at.color.w * texel
}

/// A texture's value, linear RGBA.
pub fn sample(scene: &PackedScene, slot: u32, at: &Attributes) -> Vec4 {
    let s = &scene.slots[slot as usize];
    let uv = at.uv[usize::from(s.flags & layout::TEXTURE_UV1 != 0)];
    let [a, b, c, d] = s.transform;
    let uv = Vec2::new(a * uv.x + c * uv.y + s.offset[0], b * uv.x + d * uv.y + s.offset[1]);
    let (width, height) = ((s.size & 0xffff) as i32, (s.size >> 16) as i32);
    let x = wrapped(uv.x, s.flags >> 4 & 3) * width as f32;
    let y = wrapped(uv.y, s.flags >> 6 & 3) * height as f32;
    let fetch = |x: i32, y: i32| {
        let (x, y) = (inside(x, width, s.flags >> 4 & 3), inside(y, height, s.flags >> 6 & 3));
        texel(scene.texels[(s.first_texel + (y * width + x) as u32) as usize], s.flags & layout::TEXTURE_SRGB != 0)
    };
    if s.flags & layout::TEXTURE_NEAREST != 0 {
        return fetch(x.floor() as i32, y.floor() as i32);
    }
    let (x, y) = (x - 0.5, y - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let (i, j) = (x0 as i32, y0 as i32);
    let low = fetch(i, j) * (1.0 - fx) + fetch(i + 1, j) * fx;
    let high = fetch(i, j + 1) * (1.0 - fx) + fetch(i + 1, j + 1) * fx;
    low * (1.0 - fy) + high * fy
}

/// Into [0, 1].
fn wrapped(x: f32, wrap: u32) -> f32 {
    match wrap {
        0 => x - x.floor(),
        1 => {
            let y = x - 2.0 * (x * 0.5).floor();
            if y > 1.0 { 2.0 - y } else { y }
        }
        _ => x.clamp(0.0, 1.0),
    }
}

/// The texel next to the border, when a bilinear footprint reaches over it.
fn inside(i: i32, n: i32, wrap: u32) -> i32 {
    if wrap == 0 {
        if i < 0 {
            n - 1
        } else if i >= n {
            0
        } else {
            i
        }
    } else {
        i.clamp(0, n - 1)
    }
}

fn texel(bits: u32, srgb: bool) -> Vec4 {
    let [r, g, b, a] = bits.to_le_bytes().map(|c| f32::from(c) * (1.0 / 255.0));
    let rgb = if srgb { Vec3::new(linear(r), linear(g), linear(b)) } else { Vec3::new(r, g, b) };
    rgb.extend(a)
}

/// The sRGB transfer function, IEC 61966-2-1.
pub fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}
