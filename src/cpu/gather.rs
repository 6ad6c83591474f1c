//! Density estimation in place: photons within the radius of an eye vertex are summed as the tree finds them.

use std::f32::consts::PI;

use glam::Vec3;
use rayon::prelude::*;

use super::bsdf::{Bsdf, Lobes, Transport};
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
/// Pixels of a band of tiles, at most: what one task takes.
const BAND: usize = 4096;

/// What the photons about one vertex add up to.
#[derive(Clone, Copy, Default)]
struct Sums {
    diffuse: Vec3,
    glossy: Vec3,
}

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
) {
    // Tiles of a wide film are cut off at the side of a task, which costs a little; what is found does not change.
    let rows = (BAND / width.max(1)).clamp(1, TILE);
    let band = (rows * width).max(1);
    let bands = radiance.par_chunks_mut(band).zip(vertices.par_chunks(band)).zip(first_radii.par_chunks(band));
    bands.for_each(|((radiance, vertices), first_radii)| {
        let pixels = in_tiles(width, vertices);
        let radius = |pixel: usize| first_radii[pixel] * frame.radius_scale;
        let mut sums = vec![Sums::default(); pixels.len()];
        tree.visit_packets(
            pixels.len(),
            |i| {
                let pixel = pixels[i] as usize;
                (Vec3::from(vertices[pixel].position), radius(pixel))
            },
            |i, slots, distances2| {
                let pixel = pixels[i] as usize;
                let found = slots.iter().zip(distances2).map(|(&slot, &d2)| (&photons[slot as usize], d2));
                add(scene, frame, &vertices[pixel], radius(pixel), found, &mut sums[i]);
            },
        );
        for (out, vertex) in radiance.iter_mut().zip(vertices) {
            *out = vertex.radiance;
        }
        for (&pixel, sums) in pixels.iter().zip(&sums) {
            let (vertex, radius) = (&vertices[pixel as usize], radius(pixel as usize));
            let sum = sums.diffuse * Vec3::from(vertex.diffuse) + sums.glossy;
            let gathered =
                Vec3::from(vertex.throughput) * sum * ((1.0 / (radius * radius)) / (PI * frame.n_paths as f32));
            radiance[pixel as usize] = (Vec3::from(vertex.radiance) + gathered).to_array();
        }
    });
}

/// The pixels of a band that gather, tile by tile.
fn in_tiles(width: usize, vertices: &[EyeVertex]) -> Vec<u32> {
    let rows = vertices.len().div_ceil(width.max(1));
    let mut pixels = Vec::with_capacity(vertices.len());
    for left in (0..width).step_by(TILE) {
        for row in 0..rows {
            let row = row * width;
            pixels.extend(
                (row + left..row + (left + TILE).min(width))
                    .filter(|&pixel| vertices.get(pixel).is_some_and(|vertex| vertex.flags & EYE_GATHER != 0))
                    .map(|pixel| pixel as u32),
            );
        }
    }
    pixels
}

/// Adds the photons found within `radius` of a vertex, each with its squared distance.
#[inline(always)]
fn add<'a>(
    scene: &PackedScene,
    frame: &Frame,
    vertex: &EyeVertex,
    radius: f32,
    found: impl Iterator<Item = (&'a Photon, f32)>,
    sums: &mut Sums,
) {
    let centre = Vec3::from(vertex.position);
    let normal = oct::decode(vertex.normal);
    let shading_normal = oct::decode(vertex.shading_normal);
    let segments = vertex.flags >> 8 & 0xff;
    let glossy =
        (vertex.flags & EYE_GLOSSY != 0).then(|| (Bsdf::of_vertex(scene, vertex), oct::decode(vertex.outgoing)));
    let both_sides = glossy.is_some() && vertex.transmission > 0.0;
    let constant = frame.flags & FRAME_CONSTANT_KERNEL != 0;
    let inverse_radius2 = 1.0 / (radius * radius);
    let mut sum = *sums;
    for (photon, distance2) in found {
        if (Vec3::from(photon.position) - centre).dot(normal).abs() > MAX_PLANE_OFFSET * radius {
            continue;
        }
        let photon_normal = oct::decode24_unscaled(photon.normal_and_segments);
        let facing = photon_normal.dot(normal);
        if facing * facing < MIN_NORMAL_COSINE * MIN_NORMAL_COSINE * photon_normal.length_squared()
            || facing < 0.0 && !both_sides
        {
            continue;
        }
        if segments + (photon.normal_and_segments >> 24) > frame.max_segments {
            continue;
        }
        let weight = if constant { 1.0 } else { 2.0 * (1.0 - distance2 * inverse_radius2) };
        let power = Vec3::from(photon.power) * weight;
        let incoming = oct::decode_unscaled(photon.direction);
        if incoming.dot(shading_normal) > 0.0 {
            sum.diffuse += power;
        }
        if let Some((bsdf, outgoing)) = &glossy {
            let lobes = Lobes { diffuse: false, specular: true };
            sum.glossy += power * bsdf.evaluate(*outgoing, incoming.normalize(), lobes, Transport::Radiance);
        }
    }
    *sums = sum;
}
