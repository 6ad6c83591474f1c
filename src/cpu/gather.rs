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
    if vertex.flags & EYE_GATHER == 0 {
        return Vec3::from(vertex.radiance);
    }
    let mut estimate = Estimate::new(scene, frame, vertex, radius);
    tree.visit(estimate.centre, radius, |slot, distance2| estimate.add(&photons[slot as usize], distance2));
    estimate.radiance()
}

/// The estimate at one eye vertex that gathers, whatever finds the photons for it.
pub struct Estimate<'a> {
    frame: &'a Frame,
    vertex: &'a EyeVertex,
    centre: Vec3,
    radius: f32,
    inverse_radius2: f32,
    normal: Vec3,
    shading_normal: Vec3,
    segments: u32,
    glossy: Option<(Bsdf<'a>, Vec3)>,
    both_sides: bool,
    constant: bool,
    diffuse_sum: Vec3,
    glossy_sum: Vec3,
}

impl<'a> Estimate<'a> {
    /// Without photons.
    #[inline]
    pub fn new(scene: &'a PackedScene, frame: &'a Frame, vertex: &'a EyeVertex, radius: f32) -> Self {
        let glossy =
            (vertex.flags & EYE_GLOSSY != 0).then(|| (Bsdf::of_vertex(scene, vertex), oct::decode(vertex.outgoing)));
        Self {
            frame,
            vertex,
            centre: Vec3::from(vertex.position),
            radius,
            inverse_radius2: 1.0 / (radius * radius),
            normal: oct::decode(vertex.normal),
            shading_normal: oct::decode(vertex.shading_normal),
            segments: vertex.flags >> 8 & 0xff,
            both_sides: glossy.is_some() && vertex.transmission > 0.0,
            glossy,
            constant: frame.flags & FRAME_CONSTANT_KERNEL != 0,
            diffuse_sum: Vec3::ZERO,
            glossy_sum: Vec3::ZERO,
        }
    }

    /// Takes a photon within the radius, unless it lies on another surface.
    #[inline]
    pub fn add(&mut self, photon: &Photon, distance2: f32) {
        let offset = (Vec3::from(photon.position) - self.centre).dot(self.normal);
        if offset.abs() > MAX_PLANE_OFFSET * self.radius {
            return;
        }
        let photon_normal = oct::decode24_unscaled(photon.normal_and_segments);
        let facing = photon_normal.dot(self.normal);
        if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * photon_normal.length_squared()
            || facing < 0.0 && !self.both_sides
        {
            return;
        }
        if self.segments + (photon.normal_and_segments >> 24) > self.frame.max_segments {
            return;
        }
        let weight = if self.constant { 1.0 } else { 2.0 * (1.0 - distance2 * self.inverse_radius2) };
        let power = Vec3::from(photon.power) * weight;
        let incoming = oct::decode_unscaled(photon.direction);
        if incoming.dot(self.shading_normal) > 0.0 {
            self.diffuse_sum += power;
        }
        if let Some((bsdf, outgoing)) = &self.glossy {
            let lobes = Lobes { diffuse: false, specular: true };
            self.glossy_sum += power * bsdf.evaluate(*outgoing, incoming.normalize(), lobes, Transport::Radiance);
        }
    }

    /// What [`gather`] returns.
    #[inline]
    pub fn radiance(&self) -> Vec3 {
        let vertex = self.vertex;
        let sum = self.diffuse_sum * Vec3::from(vertex.diffuse) + self.glossy_sum;
        let scale = self.inverse_radius2 / (PI * self.frame.n_paths as f32);
        Vec3::from(vertex.radiance) + Vec3::from(vertex.throughput) * sum * scale
    }
}
