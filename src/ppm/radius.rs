//! How large the radius is: first, and in each iteration.

use glam::Vec3;
use rayon::prelude::*;

use crate::device::{Error, Interrupt};
use crate::index::{Nearest, PointBvh, RadiusSearch};
use crate::layout::{Camera, EYE_GATHER, EyeVertex, Frame, REACHED, Reach};

/// Knaus & Zwicker 2011, equation 15 and its product form: r²(i+1) = r²(i)·(i+α)/(i+1), so
/// r²(i) = r²(1)·Γ(i+α)/(Γ(1+α)·i!).
#[derive(Clone, Copy, Debug)]
pub struct RadiusSchedule {
    alpha: f64,
}

impl RadiusSchedule {
    /// α in (0, 1).
    pub fn new(alpha: f32) -> Self {
        Self { alpha: f64::from(alpha) }
    }

    /// Radius of iteration `i` (from 1) over the radius of iteration 1.
    pub fn scale(&self, i: u32) -> f32 {
        // The product itself up to here, then what is left of it by Stirling's series for ln Γ: exact to rounding.
        const FACTORS: u32 = 32;
        let direct: f64 = (1..i.min(FACTORS)).map(|k| ((f64::from(k) + self.alpha) / (f64::from(k) + 1.0)).ln()).sum();
        let rest = if i > FACTORS {
            let ratio = |i: u32| ln_gamma(f64::from(i) + self.alpha) - ln_gamma(f64::from(i) + 1.0);
            ratio(i) - ratio(FACTORS)
        } else {
            0.0
        };
        (0.5 * (direct + rest)).exp() as f32
    }
}

/// ln Γ(x) for x ≥ 32: Stirling's series to x⁻³, the next term being below 1e-10.
fn ln_gamma(x: f64) -> f64 {
    (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + 1.0 / (12.0 * x) - 1.0 / (360.0 * x.powi(3))
}

/// Where photons are rare, the radius stops at this many times its median.
const MOST_OF_MEDIAN: f32 = 4.0;
/// The radius is at least this share of the pixel's width on the surface: what is finer, the pixel blurs anyway.
const LEAST_OF_PIXEL: f32 = 0.7;
/// Pixels that the median is taken of.
const SAMPLE: usize = 4096;

/// First radius of each film pixel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FirstRadii {
    /// Metres, `[h·w]`, above 0.
    pub each: Vec<f32>,
    /// Whether it was chosen for what is there, `[h·w]`. Elsewhere the pilot's path had nothing to gather (a lamp, the sky),
    /// and the radius is that of pixels nearby, for a later path that has. A radius that is given is so everywhere, until
    /// [`FirstRadii::look_at`].
    pub gathers: Vec<bool>,
}

/// Whether there is something to gather at the end of an eye path.
fn gathers(v: &EyeVertex) -> bool {
    v.flags & EYE_GATHER != 0
}

impl FirstRadii {
    /// The same for `n` pixels, asked for.
    pub(super) fn fixed(radius: f32, n: usize) -> Self {
        Self { each: vec![radius; n], gathers: vec![true; n] }
    }

    /// Notes which pixels gather by the eye paths of an iteration: with a radius that is given nobody has traced any before.
    pub fn look_at(&mut self, eye: &[EyeVertex]) {
        self.gathers = eye.iter().map(gathers).collect();
    }

    /// Metres of the pixels that gather, row-major.
    pub fn gathering(&self) -> impl Iterator<Item = f32> {
        self.each.iter().zip(&self.gathers).filter_map(|(&radius, &gathers)| gathers.then_some(radius))
    }

    /// Of the pixels that gather, of all if none does: the smallest, the median and the largest, metres. 0 without pixels.
    pub fn spread(&self) -> [f32; 3] {
        let mut radii: Vec<f32> = self.gathering().collect();
        if radii.is_empty() {
            radii.clone_from(&self.each);
        }
        if radii.is_empty() {
            return [0.0; 3];
        }
        let middle = radii.len() / 2;
        let (below, &mut median, above) = radii.select_nth_unstable_by(middle, f32::total_cmp);
        [below.iter().copied().fold(median, f32::min), median, above.iter().copied().fold(median, f32::max)]
    }
}

/// To the tenth nearest photon of a first pass, between a share of the pixel's footprint and a multiple of the picture's
/// median. Where the pilot's path gathers nothing: the mean of the pixels around, or the median.
///
/// `reaches` are those of [`Stages::reaches`](super::Stages::reaches), of a film of that width.
pub fn first_radii(reaches: &[Reach], width: usize) -> FirstRadii {
    let gathers = |reach: &Reach| reach.distance >= 0.0;
    let gathering = reaches.iter().map(gathers).collect();
    let every = (reaches.len() / SAMPLE).max(1);
    let is_known = |distance: &f32| (0.0..f32::MAX).contains(distance);
    let mut sample: Vec<f32> = reaches.iter().step_by(every).map(|reach| reach.distance).filter(is_known).collect();
    sample.sort_unstable_by(f32::total_cmp);
    let Some(&median) = sample.get(sample.len() / 2) else {
        return FirstRadii { each: vec![without_photons(reaches); reaches.len()], gathers: gathering };
    };
    let most = median * MOST_OF_MEDIAN;
    let radius = |reach: &Reach| match gathers(reach) {
        true => reach.distance.min(most).max(LEAST_OF_PIXEL * reach.footprint),
        false => 0.0,
    };
    let mut each = reaches.par_iter().map(radius).collect::<Vec<_>>();
    fill_gaps(&mut each, width, median);
    FirstRadii { each, gathers: gathering }
}

/// [`Stages::reaches`](super::Stages::reaches) on the CPU, by a tree over the photons.
pub fn reaches(
    frame: &Frame,
    camera: &Camera,
    eye: &[EyeVertex],
    photons: &PointBvh,
    step: usize,
    interrupt: &Interrupt,
) -> Result<Vec<Reach>, Error> {
    let mut reaches: Vec<Reach> =
        eye.par_iter().map(|v| Reach { distance: -1.0, footprint: footprint(frame, camera, v) }).collect();
    let (width, step) = (frame.width as usize, step.max(1));
    reaches.par_chunks_mut(width * step).zip(eye.par_chunks(width * step)).try_for_each(|(reaches, eye)| {
        interrupt.check()?;
        // A ball around the square to the left, grown by the way from there, holds the same ten photons.
        let mut last: Option<(Vec3, f32)> = None;
        for left in (0..width).step_by(step) {
            let columns = left..(left + step).min(width);
            let pixels = (0..eye.len()).step_by(width).flat_map(|row| columns.clone().map(move |x| row + x));
            let mut pixels = pixels.filter(|&i| gathers(&eye[i])).peekable();
            let Some(&first) = pixels.peek() else { continue };
            let position = Vec3::from(eye[first].position);
            let bound = last.map_or(f32::MAX, |(p, r)| (r + p.distance(position)) * (1.0 + 1e-5)).min(f32::MAX);
            let mut nearest = Nearest::new(REACHED as usize);
            photons.nearest(position, bound, &mut nearest);
            let distance = nearest.kth().map_or(bound, |last| last.distance2.sqrt());
            last = Some((position, distance));
            pixels.for_each(|i| reaches[i].distance = distance);
        }
        Ok::<_, Error>(())
    })?;
    Ok(reaches)
}

/// Width of a pixel where its eye path ended, as if that path had been straight; metres.
fn footprint(frame: &Frame, camera: &Camera, v: &EyeVertex) -> f32 {
    let pixel = 2.0 * camera.half_height / frame.full_height as f32;
    if camera.orthographic != 0 {
        return pixel;
    }
    pixel * Vec3::from(v.position).distance(camera.position.into())
}

/// No photon was stored: any radius gathers the same nothing, but it has to be one.
fn without_photons(reaches: &[Reach]) -> f32 {
    let widest = reaches.iter().map(|reach| reach.footprint).fold(0.0, f32::max);
    if widest > 0.0 && widest.is_finite() { widest } else { 1.0 }
}

/// Pixels whose pilot path gathered nothing (a lamp, the sky, an edge) take the mean of the neighbours that did.
fn fill_gaps(radii: &mut [f32], width: usize, median: f32) {
    let known = radii.to_vec();
    for (i, r) in radii.iter_mut().enumerate().filter(|(_, r)| **r == 0.0) {
        let (x, y) = (i % width, i / width);
        let (mut sum, mut n) = (0.0, 0);
        for ny in y.saturating_sub(1)..(y + 2).min(known.len() / width) {
            for nx in x.saturating_sub(1)..(x + 2).min(width) {
                if known[ny * width + nx] > 0.0 {
                    sum += known[ny * width + nx];
                    n += 1;
                }
            }
        }
        *r = if n > 0 { sum / n as f32 } else { median };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schedule_is_the_product_however_far_it_goes() {
        for alpha in [0.1, 0.5, 2.0 / 3.0, 0.9] {
            let schedule = RadiusSchedule::new(alpha);
            let mut squared = 1.0;
            for i in 1..5000u32 {
                assert!((f64::from(schedule.scale(i)) / f64::sqrt(squared) - 1.0).abs() < 2e-7, "α {alpha}, i {i}");
                squared *= (f64::from(i) + f64::from(alpha)) / (f64::from(i) + 1.0);
            }
        }
    }
}
