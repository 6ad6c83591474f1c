//! Density estimation in place: photons within the radius of an eye vertex are summed as the tree finds them.

use std::f32::consts::PI;

use glam::Vec3;

use super::bsdf::{Bsdf, Lobes, Transport};
use crate::index::PointBvh;
use crate::layout::{EYE_GATHER, EYE_GLOSSY, EyeVertex, FRAME_CONSTANT_KERNEL, Frame, Photon};
use crate::math::oct;
use crate::scene::PackedScene;

/// Photons whose surface is turned further away are on another one.
pub const MIN_NORMAL_COSINE: f32 = 0.9;
/// Photons further off the tangent plane, as a share of the radius, are on another one.
pub const MAX_PLANE_OFFSET: f32 = 0.1;

/// Radiance towards the eye: what the eye path found, and the photons within `radius` metres. `photons` are in the
/// order of the tree.
pub fn gather(
    scene: &PackedScene,
    tree: &PointBvh,
    photons: &[Photon],
    frame: &Frame,
    vertex: &EyeVertex,
    radius: f32,
) -> Vec3 {
    let found = Vec3::from(vertex.radiance);
    if vertex.flags & EYE_GATHER == 0 {
        return found;
    }
    let centre = Vec3::from(vertex.position);
    let normal = oct::decode(vertex.normal);
    let shading_normal = oct::decode(vertex.shading_normal);
    let segments = vertex.flags >> 8 & 0xff;
    let glossy =
        (vertex.flags & EYE_GLOSSY != 0).then(|| (Bsdf::of_vertex(scene, vertex), oct::decode(vertex.outgoing)));
    let both_sides = glossy.is_some() && vertex.transmission > 0.0;
    let constant = frame.flags & FRAME_CONSTANT_KERNEL != 0;
    let inverse_radius2 = 1.0 / (radius * radius);
    let mut diffuse_sum = Vec3::ZERO;
    let mut glossy_sum = Vec3::ZERO;
    tree.visit(centre, radius, |slot, distance2| {
        let photon = &photons[slot as usize];
        if (Vec3::from(photon.position) - centre).dot(normal).abs() > MAX_PLANE_OFFSET * radius {
            return;
        }
        let photon_normal = oct::decode24_unscaled(photon.normal_and_segments);
        let facing = photon_normal.dot(normal);
        if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * photon_normal.length_squared()
            || facing < 0.0 && !both_sides
        {
            return;
        }
        if segments + (photon.normal_and_segments >> 24) > frame.max_segments {
            return;
        }
        let weight = if constant { 1.0 } else { 2.0 * (1.0 - distance2 * inverse_radius2) };
        let power = Vec3::from(photon.power) * weight;
        let incoming = oct::decode_unscaled(photon.direction);
        if incoming.dot(shading_normal) > 0.0 {
            diffuse_sum += power;
        }
        if let Some((bsdf, outgoing)) = &glossy {
            let lobes = Lobes { diffuse: false, specular: true };
            glossy_sum += power * bsdf.evaluate(*outgoing, incoming.normalize(), lobes, Transport::Radiance);
        }
    });
    let sum = diffuse_sum * Vec3::from(vertex.diffuse) + glossy_sum;
    found + Vec3::from(vertex.throughput) * sum * (inverse_radius2 / (PI * frame.n_paths as f32))
}
