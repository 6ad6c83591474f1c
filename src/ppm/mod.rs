//! Progressive photon mapping: the algorithm, apart from any backend.
//!
//! Each iteration is an independent photon-mapping image with its own camera rays and its own photons; the picture is
//! the mean of the iterations' images while the radius shrinks (Knaus & Zwicker 2011, "Progressive Photon Mapping: A
//! Probabilistic Approach").

pub mod film;
pub mod radius;
pub mod stages;

use crate::layout;
pub use crate::scene::settings::{Direct, FirstRadius, Kernel};
pub use film::Film;
pub use radius::{FirstRadii, RadiusSchedule, first_radii, reaches};
pub use stages::{Error, Interrupt, StageTimes, Stages};

/// What a render is asked to do. Nothing here depends on the backend.
#[derive(Clone, Debug, PartialEq)]
pub struct Params {
    /// Whole picture, pixels: width, height.
    pub size: [u32; 2],
    /// The part to compute, pixels: x0, y0, x1, y1 (exclusive).
    pub crop: [u32; 4],
    /// Same seed, same backend, same adapter: the same bits.
    pub seed: u32,
    /// Photon paths emitted an iteration.
    pub n_paths: u32,
    /// Knaus & Zwicker's α in (0, 1): the share of the radius' area that an iteration keeps is (i+α)/(i+1).
    pub alpha: f32,
    /// First radius; the automatic ones are those of [`first_radii`].
    pub radius: FirstRadius,
    /// Density estimation kernel.
    pub kernel: Kernel,
    /// Who brings direct light.
    pub direct: Direct,
    /// End paths by Russian roulette; without it they run to `max_eye_segments` and `max_photon_segments`.
    pub roulette: bool,
    /// Longest eye path, segments (at most [`SEGMENT_CAP`]).
    pub max_eye_segments: u32,
    /// Longest photon path, segments (at most [`layout::MAX_PHOTON_SEGMENTS`]).
    pub max_photon_segments: u32,
    /// Longest path from lamp to lens, segments; `u32::MAX`: no limit.
    pub max_segments: u32,
}

/// Cap on the segments of an eye path that nobody asked to limit; an eye vertex counts them in 8 bits.
pub const SEGMENT_CAP: u32 = 255;

impl Params {
    /// The normal mode: Russian roulette, direct light sampled, automatic radius.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            size: [width, height],
            crop: [0, 0, width, height],
            seed: 0,
            n_paths: 500_000,
            alpha: 2.0 / 3.0,
            radius: FirstRadius::Automatic,
            kernel: Kernel::default(),
            direct: Direct::default(),
            roulette: true,
            max_eye_segments: SEGMENT_CAP,
            max_photon_segments: layout::MAX_PHOTON_SEGMENTS,
            max_segments: u32::MAX,
        }
    }

    /// Width and height of the film, pixels.
    pub fn film_size(&self) -> [u32; 2] {
        [self.crop[2] - self.crop[0], self.crop[3] - self.crop[1]]
    }

    /// The constants of iteration `i` (0: the pilot).
    pub fn frame(&self, i: u32) -> layout::Frame {
        let [width, height] = self.film_size();
        let mut flags = 0;
        if self.direct == Direct::Sampled {
            flags |= layout::FRAME_SAMPLE_DIRECT;
        }
        if self.roulette {
            flags |= layout::FRAME_ROULETTE;
        }
        if self.kernel == Kernel::Constant {
            flags |= layout::FRAME_CONSTANT_KERNEL;
        }
        layout::Frame {
            width,
            height,
            crop_x: self.crop[0],
            crop_y: self.crop[1],
            full_width: self.size[0],
            full_height: self.size[1],
            iteration: i,
            seed: self.seed,
            n_paths: self.n_paths,
            max_eye_segments: self.max_eye_segments.min(SEGMENT_CAP),
            max_photon_segments: self.max_photon_segments.min(layout::MAX_PHOTON_SEGMENTS),
            max_segments: self.max_segments,
            flags,
            radius_scale: RadiusSchedule::new(self.alpha).scale(i.max(1)),
            pad: [0; 2],
        }
    }
}

/// Of the pixels of a preview, in either direction, one in so many is searched for its first radius.
const PREVIEW_STEP: usize = 3;

/// Chooses the first radii, tells the backend and returns them. Call before the first [`iterate`].
pub fn start<S: Stages + ?Sized>(stages: &mut S, params: &Params) -> Result<FirstRadii, Error> {
    let radii = match params.radius {
        FirstRadius::Fixed(r) => fixed(params, r),
        FirstRadius::Automatic => automatic(stages, &params.frame(0), 1)?,
    };
    stages.set_first_radii(&radii.each)?;
    Ok(radii)
}

/// [`start`] and the first iteration at the price of one iteration: its own photons choose the radii that they are gathered
/// within, and not every pixel is searched. For a look at the scene, not to be averaged over many: within the distance to
/// the k-th of them, points of density ρ have the expected density ρ·k/(k−1). Epanechnikov's kernel, which is 0 for the k-th,
/// makes up for it; the constant one is made a little narrower, so that the k-th is left out.
pub fn start_preview<S: Stages + ?Sized>(stages: &mut S, params: &Params) -> Result<FirstRadii, Error> {
    let frame = params.frame(1);
    let radii = match params.radius {
        FirstRadius::Fixed(r) => {
            stages.trace_eye(&frame)?;
            stages.trace_photons(&frame)?;
            fixed(params, r)
        }
        FirstRadius::Automatic => {
            let mut radii = automatic(stages, &frame, PREVIEW_STEP)?;
            if params.kernel == Kernel::Constant {
                radii.each.iter_mut().for_each(|radius| *radius *= 1.0 - 1e-4);
            }
            radii
        }
    };
    stages.set_first_radii(&radii.each)?;
    stages.build_index(&frame)?;
    stages.gather(&frame)?;
    stages.accumulate(&frame)?;
    Ok(radii)
}

fn fixed(params: &Params, radius: f32) -> FirstRadii {
    let [width, height] = params.film_size();
    FirstRadii::fixed(radius, width as usize * height as usize)
}

/// From the eye paths and photons of `frame`, which the stages have afterwards, in whatever order.
fn automatic<S: Stages + ?Sized>(stages: &mut S, frame: &layout::Frame, step: usize) -> Result<FirstRadii, Error> {
    stages.trace_eye(frame)?;
    stages.trace_photons(frame)?;
    Ok(first_radii(&stages.reaches(frame, step)?, frame.width as usize))
}

/// One iteration: the algorithm on one screen.
pub fn iterate<S: Stages + ?Sized>(stages: &mut S, frame: &layout::Frame) -> Result<(), Error> {
    stages.trace_eye(frame)?; // pixels → EyeVertex[w·h]
    stages.trace_photons(frame)?; // lights → Photon[n]
    stages.build_index(frame)?; // Photon[n] → tree over photons
    stages.gather(frame)?; // EyeVertex, tree → radiance[w·h]
    stages.accumulate(frame) // radiance → film
}
