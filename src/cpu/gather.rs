//! Density estimation in place: photons within the radius of an eye vertex are summed as the tree finds them.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::bsdf::{Bsdf, Lobes, Transport};
use crate::device::{Error, Interrupt};
use crate::index::PointBvh;
use crate::layout::{EYE_GATHER, EYE_GLOSSY, EyeVertex, FRAME_CONSTANT_KERNEL, Frame, Photon};
use crate::math::oct;
use crate::scene::PackedScene;

/// Photons whose surface is turned further away are on another one.
pub const MIN_NORMAL_COSINE: f32 = 0.9;
/// Photons further off the tangent plane, as a share of the radius, are on another one.
pub const MAX_PLANE_OFFSET: f32 = 0.1;

/// Side of the square of pixels whose vertices are searched around together.
const TILE: usize = 8;
/// Pixels one task takes, unless a row has more.
const BAND: usize = 4096;

/// Radiance towards the eye of each pixel of a film `width` wide: what the eye path found, and the photons within
/// `first_radii · frame.radius_scale` metres. `photons` are in the order of the tree.
pub fn gather(
    scene: &PackedScene,
    tree: &PointBvh,
    photons: &[Photon],
    frame: &Frame,
    width: usize,
    vertices: &[EyeVertex],
    first_radii: &[f32],
    radiance: &mut [[f32; 3]],
    interrupt: &Interrupt,
) -> Result<(), Error> {
    let rows = (BAND / width.max(1)).clamp(1, TILE);
    let band = (rows * width).max(1);
    let bands = radiance.par_chunks_mut(band).zip(vertices.par_chunks(band)).zip(first_radii.par_chunks(band));
    bands.try_for_each(|((radiance, vertices), first_radii)| {
        interrupt.check()?;
        for (out, vertex) in radiance.iter_mut().zip(vertices) {
            *out = vertex.radiance;
        }
        let pixels = in_tiles(width, vertices);
        let radius = |pixel: usize| first_radii[pixel] * frame.radius_scale;
        // Of each pixel so far: its photons may come in several parts.
        let mut sums = vec![Sums::default(); pixels.len()];
        tree.visit_packets(
            pixels.len(),
            |i| {
                let pixel = pixels[i] as usize;
                (Vec3::from(vertices[pixel].position), radius(pixel))
            },
            |i, slots, distances2| {
                let pixel = pixels[i] as usize;
                let mut estimate = Estimate::new(scene, frame, &vertices[pixel], radius(pixel));
                estimate.sums = sums[i];
                for (&slot, &distance2) in slots.iter().zip(distances2) {
                    estimate.add(&photons[slot as usize], distance2);
                }
                sums[i] = estimate.sums;
                radiance[pixel] = estimate.radiance().to_array();
            },
        );
        Ok(())
    })
}

/// The pixels of a band that gather, tile by tile.
fn in_tiles(width: usize, vertices: &[EyeVertex]) -> Vec<u32> {
    let mut pixels = Vec::with_capacity(vertices.len());
    for left in (0..width).step_by(TILE) {
        for row in (0..vertices.len()).step_by(width) {
            let tile = row + left..row + (left + TILE).min(width);
            pixels.extend(tile.filter(|&pixel| vertices[pixel].flags & EYE_GATHER != 0).map(|pixel| pixel as u32));
        }
    }
    pixels
}

/// What the photons about a vertex add up to.
#[derive(Clone, Copy, Default)]
struct Sums {
    diffuse: Vec3,
    glossy: Vec3,
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
    sums: Sums,
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
            sums: Sums::default(),
        }
    }

    /// Takes a photon within the radius, unless it lies on another surface or its path is too long; returns whether.
    #[inline]
    pub fn add(&mut self, photon: &Photon, distance2: f32) -> bool {
        let offset = (Vec3::from(photon.position) - self.centre).dot(self.normal);
        if offset.abs() > MAX_PLANE_OFFSET * self.radius {
            return false;
        }
        let photon_normal = oct::decode24_unscaled(photon.normal_and_segments);
        let facing = photon_normal.dot(self.normal);
        if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * photon_normal.length_squared()
            || facing < 0.0 && !self.both_sides
        {
            return false;
        }
        if self.segments + photon.segments() > self.frame.max_segments {
            return false;
        }
        let weight = if self.constant { 1.0 } else { 2.0 * (1.0 - distance2 * self.inverse_radius2) };
        let power = Vec3::from(photon.power) * weight;
        let incoming = oct::decode_unscaled(photon.direction);
        if incoming.dot(self.shading_normal) > 0.0 {
            self.sums.diffuse += power;
        }
        if let Some((bsdf, outgoing)) = &self.glossy {
            let lobes = Lobes { diffuse: false, specular: true };
            self.sums.glossy += power * bsdf.evaluate(*outgoing, incoming.normalize(), lobes, Transport::Radiance);
        }
        true
    }

    /// Radiance towards the eye, what its path found included.
    #[inline]
    pub fn radiance(&self) -> Vec3 {
        let vertex = self.vertex;
        let sum = self.sums.diffuse * Vec3::from(vertex.diffuse) + self.sums.glossy;
        let scale = self.inverse_radius2 / (PI * self.frame.n_paths as f32);
        Vec3::from(vertex.radiance) + Vec3::from(vertex.throughput) * sum * scale
    }
}
