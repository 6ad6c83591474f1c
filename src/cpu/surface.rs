//! What a hit looks like once textures are read.

use glam::Vec3;

use super::texture::{self, Attributes};
use super::trace::{self, Hit};
use crate::layout::{MATERIAL_DOUBLE_SIDED, NONE, PRIMITIVE_FLAT, PRIMITIVE_MIRRORED_UV, PRIMITIVE_SPHERE, Primitive};
use crate::math::basis::Basis;
use crate::scene::PackedScene;

/// A point on a surface as met from one side; the normals point to that side.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Metres, world space.
    pub position: Vec3,
    /// Unit, world space.
    pub normal: Vec3,
    /// Unit, world space: interpolated, then bent by the normal map.
    pub shading_normal: Vec3,
    /// Whether it was met from its front.
    pub front: bool,
    /// Index into the packed materials.
    pub material: u32,
    /// Index into the lights, or [`NONE`].
    pub light: u32,
    /// Linear, in [0, 1].
    pub base_color: Vec3,
    /// Perceptual, in [0, 1].
    pub roughness: f32,
    /// In [0, 1].
    pub metallic: f32,
    /// In [0, 1].
    pub transmission: f32,
    /// Radiance towards the side it was met from.
    pub emission: Vec3,
}

/// Looks up everything at a hit of a ray travelling along `direction`.
pub fn at(scene: &PackedScene, hit: &Hit, origin: Vec3, direction: Vec3) -> Surface {
    let p = &scene.primitives[hit.primitive as usize];
    let m = &scene.materials[p.material as usize];
    let position = point(p, hit, origin, direction);
    let outward = trace::geometric_normal(p, position);
    let front = outward.dot(direction) <= 0.0;
    let normal = if front { outward } else { -outward };
    let at = texture::attributes(scene, p, hit.u, hit.v);

    let mut base_color = Vec3::from(m.base_color) * at.color.truncate();
    if m.base_color_slot != NONE {
        base_color *= texture::sample(scene, m.base_color_slot, &at).truncate();
    }
    let (mut roughness, mut metallic) = (m.roughness, m.metallic);
    if m.metallic_roughness_slot != NONE {
        let t = texture::sample(scene, m.metallic_roughness_slot, &at);
        roughness *= t.y;
        metallic *= t.z;
    }
    let mut transmission = m.transmission;
    if m.transmission_slot != NONE {
        transmission *= texture::sample(scene, m.transmission_slot, &at).x;
    }
    Surface {
        position,
        normal,
        shading_normal: shading_normal(scene, p, hit, &at, outward, front, direction),
        front,
        material: p.material,
        light: p.light,
        base_color,
        roughness,
        metallic,
        transmission,
        emission: if front || m.flags & MATERIAL_DOUBLE_SIDED != 0 { emission(scene, p, &at) } else { Vec3::ZERO },
    }
}

/// From the corners where there are corners: nearer to the surface than origin + t·direction.
fn point(p: &Primitive, hit: &Hit, origin: Vec3, direction: Vec3) -> Vec3 {
    let along = origin + hit.t * direction;
    if p.flags & PRIMITIVE_SPHERE != 0 {
        let centre = Vec3::from(p.a);
        return centre + (along - centre).normalize() * p.b[0];
    }
    Vec3::from(p.a) * (1.0 - hit.u - hit.v) + Vec3::from(p.b) * hit.u + Vec3::from(p.c) * hit.v
}

/// Radiance that the front of a primitive emits at a point.
pub fn emission(scene: &PackedScene, p: &Primitive, at: &Attributes) -> Vec3 {
    let m = &scene.materials[p.material as usize];
    let emission = Vec3::from(m.emission);
    if m.emission_slot == NONE || emission == Vec3::ZERO {
        return emission;
    }
    emission * texture::sample(scene, m.emission_slot, at).truncate()
}

fn shading_normal(
    scene: &PackedScene,
    p: &Primitive,
    hit: &Hit,
    at: &Attributes,
    outward: Vec3,
    front: bool,
    direction: Vec3,
) -> Vec3 {
    let facing = |n: Vec3| if front { n } else { -n };
    if p.flags & (PRIMITIVE_SPHERE | PRIMITIVE_FLAT) != 0 {
        return facing(outward);
    }
    let m = &scene.materials[p.material as usize];
    let [a, b, c] = p.vertices.map(|i| &scene.vertices[i as usize]);
    let w = 1.0 - hit.u - hit.v;
    let mix = |a: [f32; 3], b: [f32; 3], c: [f32; 3]| Vec3::from(a) * w + Vec3::from(b) * hit.u + Vec3::from(c) * hit.v;
    let interpolated = mix(a.normal, b.normal, c.normal).normalize_or(outward);
    let mut n = interpolated;
    if m.normal_slot != NONE {
        let t = texture::sample(scene, m.normal_slot, at).truncate() * 2.0 - 1.0;
        let t = Vec3::new(t.x * m.normal_scale, t.y * m.normal_scale, t.z);
        let along = mix(a.tangent, b.tangent, c.tangent);
        let along = (along - interpolated * interpolated.dot(along)).normalize_or_zero();
        if along == Vec3::ZERO {
            let basis = Basis::around(interpolated);
            n = basis.world(t).normalize_or(interpolated);
        } else {
            let hand = if p.flags & PRIMITIVE_MIRRORED_UV != 0 { -1.0 } else { 1.0 };
            n = (along * t.x + interpolated.cross(along) * (hand * t.y) + interpolated * t.z)
                .normalize_or(interpolated);
        }
    }
    // A shading normal turned away from the viewer has no lobe to show; fall back step by step.
    let (n, interpolated, outward) = (facing(n), facing(interpolated), facing(outward));
    let seen = |n: Vec3| n.dot(direction) < -1e-3 && n.dot(outward) > 0.0;
    if seen(n) {
        n
    } else if seen(interpolated) {
        interpolated
    } else {
        outward
    }
}
