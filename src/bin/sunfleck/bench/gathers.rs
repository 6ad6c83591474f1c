//! Other ways from photons to radiance than the renderer's, for comparison with it.

use anyhow::{Result, ensure};
use glam::Vec3;
use rayon::prelude::*;
use sunfleck::cpu::gather::Estimate;
use sunfleck::index::{Boxes, Buffers, Builder, KdBuffered, PointBvh, Radii, RadiusSearch, SampleBvh, SampleOptions};
use sunfleck::layout::{EYE_GATHER, EyeVertex, Frame, Photon};
use sunfleck::scene::PackedScene;

use super::measure::{Time, timed};

/// Most bytes of a buffer of results; what needs more is gathered in several parts.
const MOST_BUFFERED: usize = 512 << 20;
/// Bytes of a result: index and squared distance.
const RESULT: usize = 8;

/// What a gather starts from: the photons, and the eye vertices that gather, each with its radius.
pub struct Input<'a> {
    scene: &'a PackedScene,
    frame: &'a Frame,
    photons: &'a [Photon],
    vertices: &'a [EyeVertex],
    points: Vec<Vec3>,
    queries: Vec<Vec3>,
    radii: Vec<f32>,
    /// Pixel of each query.
    pixels: Vec<u32>,
    /// Most neighbours of a query.
    most: usize,
}

/// What came out, and how long it took.
pub struct Gathered {
    pub build: Time,
    pub gather: Time,
    /// Of every pixel.
    pub radiance: Vec<Vec3>,
}

impl<'a> Input<'a> {
    /// `first_radii` are those of all pixels before the frame's scale.
    pub fn new(
        scene: &'a PackedScene,
        frame: &'a Frame,
        photons: &'a [Photon],
        vertices: &'a [EyeVertex],
        first_radii: &[f32],
    ) -> Result<Self> {
        let gathers = |&(_, v): &(usize, &EyeVertex)| v.flags & EYE_GATHER != 0;
        let (pixels, queries): (Vec<u32>, Vec<Vec3>) = vertices
            .par_iter()
            .enumerate()
            .filter(gathers)
            .map(|(pixel, v)| (pixel as u32, Vec3::from(v.position)))
            .unzip();
        let radii: Vec<f32> = pixels.par_iter().map(|&p| first_radii[p as usize] * frame.radius_scale).collect();
        let points: Vec<Vec3> = photons.par_iter().map(|p| Vec3::from(p.position)).collect();
        let counts = PointBvh::new(&points)?.count_all(&queries, Radii::Each(&radii))?;
        let most = counts.iter().copied().max().unwrap_or(0) as usize;
        Ok(Self { scene, frame, photons, vertices, points, queries, radii, pixels, most })
    }

    /// The rows that a buffer must have.
    pub fn most(&self) -> usize {
        self.most
    }

    /// The paper's rival: a kd-tree fills `buffers`, which are read afterwards and kept from iteration to iteration.
    pub fn kd_buffered(&self, buffers: &mut Buffers) -> Result<Gathered> {
        let (tree, build) = timed(|| KdBuffered::new(&self.points, self.most));
        let tree = tree?;
        let part = (MOST_BUFFERED / (RESULT * self.most.max(1))).clamp(1, self.queries.len().max(1));
        let (found, gather) = timed(|| -> Result<Vec<Vec3>> {
            let mut found = Vec::with_capacity(self.queries.len());
            for first in (0..self.queries.len()).step_by(part) {
                let range = first..(first + part).min(self.queries.len());
                tree.fill(&self.queries[range.clone()], Radii::Each(&self.radii[range.clone()]), buffers)?;
                buffers.check()?;
                found.par_extend(range.clone().into_par_iter().with_min_len(256).map(|query| {
                    let mut estimate = self.estimate(query);
                    for near in buffers.row(query - first) {
                        estimate.add(&self.photons[near.index as usize], near.distance2);
                    }
                    estimate.radiance()
                }));
            }
            Ok(found)
        });
        Ok(Gathered { build, gather, radiance: self.radiance(&found?) })
    }

    /// The paper's method: a binary tree over boxes as wide as the largest radius, photons summed as they are found.
    pub fn boxes_in_place(&self) -> Result<Gathered> {
        let largest = self.radii.par_iter().copied().reduce(|| 0.0, f32::max);
        let options =
            SampleOptions { builder: Builder::Ploc { reach: 14 }, boxes: Boxes::Inflated(largest), leaf_size: 1 };
        let (tree, build) = timed(|| SampleBvh::new(&self.points, options));
        let tree = tree?;
        let each = |query: usize| {
            let mut estimate = self.estimate(query);
            tree.within(self.queries[query], self.radii[query], |i, d2| {
                estimate.add(&self.photons[i as usize], d2);
            });
            estimate.radiance()
        };
        let (found, gather) = timed(|| (0..self.queries.len()).into_par_iter().with_min_len(256).map(each).collect());
        let found: Vec<Vec3> = found;
        Ok(Gathered { build, gather, radiance: self.radiance(&found) })
    }

    fn estimate(&self, query: usize) -> Estimate<'_> {
        Estimate::new(self.scene, self.frame, &self.vertices[self.pixels[query] as usize], self.radii[query])
    }

    fn radiance(&self, found: &[Vec3]) -> Vec<Vec3> {
        let mut radiance: Vec<Vec3> = self.vertices.par_iter().map(|v| Vec3::from(v.radiance)).collect();
        for (&pixel, &found) in self.pixels.iter().zip(found) {
            radiance[pixel as usize] = found;
        }
        radiance
    }
}

/// Refuses a gather that is not the renderer's, but for rounding in another order of the sum.
pub fn check(name: &str, found: &[Vec3], right: &[[f32; 3]]) -> Result<()> {
    let sum = |values: &mut dyn Iterator<Item = f32>| values.map(f64::from).sum::<f64>();
    let all = sum(&mut right.iter().flatten().map(|c| c.abs()));
    let off = sum(&mut found.iter().zip(right).map(|(a, b)| (*a - Vec3::from(*b)).abs().element_sum()));
    ensure!(
        found.len() == right.len() && off <= 1e-4 * all,
        "{name} gathered something else than the renderer: {off} of {all}"
    );
    Ok(())
}
