//! The light of an iteration, by the way it came; and what its gather cost.

use glam::Vec3;
use rayon::prelude::*;

use crate::cpu::gather::Estimate;
use crate::device::{Error, Interrupt};
use crate::index::PointBvh;
use crate::index::stats::CountedPointBvh;
use crate::layout::{EYE_GATHER, EyeVertex, Frame, Photon};
use crate::scene::PackedScene;

/// Pixels between two looks at an interrupt.
const CHUNK: usize = 2048;

/// What a backend's getters give after [`crate::ppm::Stages::gather`], on the CPU, whichever backend it was.
pub struct Iteration<'a> {
    scene: &'a PackedScene,
    frame: &'a Frame,
    vertices: &'a [EyeVertex],
    first_radii: &'a [f32],
    /// In the order of the tree.
    photons: Vec<Photon>,
    tree: PointBvh,
}

/// Of one pixel. The three kinds of light are radiance, linear RGB, and add up to what was gathered.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Parts {
    /// What the eye path found and the lights sampled at its end; photons straight from a lamp, if those are stored.
    pub direct: [f32; 3],
    /// Photons that are [caustic](crate::layout::PHOTON_CAUSTIC).
    pub caustic: [f32; 3],
    /// All other photons.
    pub indirect: [f32; 3],
    /// Number of photons that went into the estimate.
    pub gathered: f32,
}

/// Mean of [`Parts`] over iterations.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Split {
    /// In the mean.
    pub n_iterations: u32,
    /// `[h·w]`, row-major.
    pub pixels: Vec<Parts>,
}

impl<'a> Iteration<'a> {
    /// `vertices` and `first_radii` (metres) of the film's pixels, `[h·w]`; `photons` in any order.
    pub fn new(
        scene: &'a PackedScene,
        frame: &'a Frame,
        vertices: &'a [EyeVertex],
        first_radii: &'a [f32],
        photons: &[Photon],
    ) -> Self {
        let mut tree = PointBvh::default();
        tree.rebuild(photons.len(), |i| photons[i].position.into());
        let photons = tree.order().iter().map(|&i| photons[i as usize]).collect();
        Self { scene, frame, vertices, first_radii, photons, tree }
    }

    /// Gathers again, each kind of photon by itself, on all threads; some two and a half times the work of the CPU's gather.
    pub fn split(&self, interrupt: &Interrupt) -> Result<Split, Error> {
        let pixels = self.each(interrupt, |vertex, radius| self.parts(vertex, radius))?;
        Ok(Split { n_iterations: 1, pixels })
    }

    fn parts(&self, vertex: &EyeVertex, radius: f32) -> Parts {
        if vertex.flags & EYE_GATHER == 0 {
            return Parts { direct: vertex.radiance, ..Parts::default() };
        }
        let dark = EyeVertex { radiance: [0.0; 3], ..*vertex };
        let estimate = |vertex| Estimate::new(self.scene, self.frame, vertex, radius);
        let (mut direct, mut caustic, mut indirect) = (estimate(vertex), estimate(&dark), estimate(&dark));
        let mut gathered = 0;
        self.tree.visit(vertex.position.into(), radius, |slot, distance2| {
            let photon = &self.photons[slot as usize];
            let part = match photon.segments() {
                _ if photon.is_caustic() => &mut caustic,
                1 => &mut direct,
                _ => &mut indirect,
            };
            gathered += u32::from(part.add(photon, distance2));
        });
        let [direct, caustic, indirect] = [direct, caustic, indirect].map(|part| part.radiance().to_array());
        Parts { direct, caustic, indirect, gathered: gathered as f32 }
    }

    /// Radius of the iteration, metres, `[h·w]`.
    pub fn radii(&self) -> Vec<f32> {
        self.first_radii.iter().map(|r| r * self.frame.radius_scale).collect()
    }

    /// Nodes of the tree over the photons that each pixel's search enters, `[h·w]`; 0 where nothing is gathered.
    /// As much work as [`Iteration::split`].
    pub fn nodes_visited(&self, interrupt: &Interrupt) -> Result<Vec<u32>, Error> {
        let tree = CountedPointBvh::new(&self.tree);
        self.each(interrupt, |vertex, radius| {
            let gathers = vertex.flags & EYE_GATHER != 0;
            if gathers { tree.visits(vertex.position.into(), radius).nodes as u32 } else { 0 }
        })
    }

    fn each<T: Clone + Default + Send>(
        &self,
        interrupt: &Interrupt,
        value: impl Fn(&EyeVertex, f32) -> T + Sync,
    ) -> Result<Vec<T>, Error> {
        let mut values = vec![T::default(); self.vertices.len()];
        let pixels = self.vertices.par_chunks(CHUNK).zip(self.first_radii.par_chunks(CHUNK));
        let done: Result<(), Error> = values.par_chunks_mut(CHUNK).zip(pixels).try_for_each(|(values, pixels)| {
            let (vertices, first_radii) = pixels;
            interrupt.check()?;
            for ((to, vertex), first_radius) in values.iter_mut().zip(vertices).zip(first_radii) {
                *to = value(vertex, first_radius * self.frame.radius_scale);
            }
            Ok(())
        });
        done.map(|()| values)
    }
}

impl Split {
    /// Takes another mean in, weighed by its iterations. One of another film begins anew.
    pub fn add(&mut self, other: &Self) {
        if self.pixels.len() != other.pixels.len() {
            self.clone_from(other);
            return;
        }
        self.n_iterations += other.n_iterations;
        let share = other.n_iterations as f32 / self.n_iterations.max(1) as f32;
        let mix = |mean: &mut [f32; 3], next: [f32; 3]| {
            *mean = (Vec3::from(*mean) + (Vec3::from(next) - Vec3::from(*mean)) * share).to_array();
        };
        for (mean, next) in self.pixels.iter_mut().zip(&other.pixels) {
            mix(&mut mean.direct, next.direct);
            mix(&mut mean.caustic, next.caustic);
            mix(&mut mean.indirect, next.indirect);
            mean.gathered += (next.gathered - mean.gathered) * share;
        }
    }
}
