//! One scene on one device: an estimate under way.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Result;
use sunfleck::layout::Camera;
use sunfleck::ppm::{self, Error, Film, Params, Stages};
use sunfleck::scene::PackedScene;

use super::{Opened, Record, Wanted};
use crate::devices::Device;
use crate::job::Input;

/// Of the picture's width and height, while the camera moves.
const PREVIEW: u32 = 4;
/// Photon paths of a preview.
const PREVIEW_PATHS: u32 = 20_000;
/// Between films that are read back.
const SHOW_EVERY: Duration = Duration::from_millis(80);
/// Iterations that are shown at once.
const SHOW_FIRST: u32 = 3;

/// A film, and what made it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Changes with every restart.
    pub estimate: u64,
    pub film: Arc<Film>,
    /// Smaller than wanted, while the camera moves.
    pub is_preview: bool,
    pub params: Params,
    pub camera: Camera,
    pub scene: Arc<PackedScene>,
    /// Median of the first radii and of those now, metres.
    pub first_radius: f32,
    pub radius: f32,
    /// Since the restart, pauses left out.
    pub seconds: f64,
}

/// See the module.
pub struct Session {
    pub opened: Arc<Opened>,
    pub input: Input,
    scene: Arc<PackedScene>,
    stages: Box<dyn Stages>,
    estimate: u64,
    params: Params,
    is_preview: bool,
    radii: Vec<f32>,
    first_radius: f32,
    /// Done in this estimate.
    pub n_iterations: u32,
    pub seconds: f64,
    shown: Option<(Instant, u32)>,
}

impl Session {
    pub fn new(device: &Device, opened: Arc<Opened>, input: Input) -> Result<Self> {
        let scene = Arc::new(PackedScene::new(&input.scene));
        let stages = device.stages(Arc::clone(&scene), &input)?;
        let params = input.params.clone();
        Ok(Self {
            opened,
            input,
            scene,
            stages,
            estimate: 0,
            params,
            is_preview: false,
            radii: vec![],
            first_radius: 0.0,
            n_iterations: 0,
            seconds: 0.0,
            shown: None,
        })
    }

    /// Begins anew: another camera perhaps, other parameters, or a preview. `estimate` names it.
    pub fn restart(&mut self, estimate: u64, is_preview: bool) -> Result<(), Error> {
        self.params = self.input.params.clone();
        if is_preview {
            self.params.size = self.params.size.map(|side| side.div_ceil(PREVIEW));
            let [width, height] = self.params.size;
            self.params.crop = [0, 0, width, height];
            self.params.n_paths = self.params.n_paths.min(PREVIEW_PATHS);
        }
        let [width, height] = self.params.size;
        self.stages.set_camera(self.input.camera.pack(width, height), self.params.film_size())?;
        (self.estimate, self.is_preview) = (estimate, is_preview);
        (self.n_iterations, self.seconds, self.shown) = (0, 0.0, None);
        self.radii = ppm::start(&mut *self.stages, &self.params)?;
        let mut radii: Vec<f32> = self.radii.iter().copied().filter(|r| *r > 0.0 && r.is_finite()).collect();
        let middle = radii.len() / 2;
        self.first_radius =
            if radii.is_empty() { 0.0 } else { *radii.select_nth_unstable_by(middle, f32::total_cmp).1 };
        Ok(())
    }

    /// One iteration, its stages in the order of [`ppm::iterate`]; none if `is_stale` says between two of them that its
    /// picture is not wanted any more.
    pub fn iterate(&mut self, mut is_stale: impl FnMut() -> bool) -> Result<Option<Record>, Error> {
        type Stage = fn(&mut dyn Stages, &sunfleck::layout::Frame) -> Result<(), Error>;
        const STAGES: [Stage; 5] = [
            |stages, frame| stages.trace_eye(frame),
            |stages, frame| stages.trace_photons(frame),
            |stages, frame| stages.build_index(frame),
            |stages, frame| stages.gather(frame),
            |stages, frame| stages.accumulate(frame),
        ];
        let began = Instant::now();
        let frame = self.params.frame(self.n_iterations + 1);
        for stage in STAGES {
            if is_stale() {
                return Ok(None);
            }
            stage(&mut *self.stages, &frame)?;
        }
        let times = self.stages.times()?;
        self.n_iterations += 1;
        self.seconds += began.elapsed().as_secs_f64();
        Ok(Some(Record {
            iteration: self.n_iterations,
            seconds: self.seconds,
            radius: self.first_radius * frame.radius_scale,
            times,
            n_photons: self.stages.n_photons(),
            n_paths: self.params.n_paths,
        }))
    }

    /// The film, if it is time to show it, or if there will be no more.
    pub fn frame_if_due(&mut self, is_last: bool) -> Result<Option<Frame>, Error> {
        let is_new = self.n_iterations > self.shown.map_or(0, |s| s.1);
        let is_due = is_last
            || self.n_iterations <= SHOW_FIRST
            || self.shown.is_none_or(|(when, _)| when.elapsed() >= SHOW_EVERY);
        if !is_new || !is_due {
            return Ok(None);
        }
        self.shown = Some((Instant::now(), self.n_iterations));
        self.frame().map(Some)
    }

    /// The film as it is.
    pub fn frame(&mut self) -> Result<Frame, Error> {
        Ok(Frame {
            estimate: self.estimate,
            film: Arc::new(self.stages.film()?),
            is_preview: self.is_preview,
            params: self.params.clone(),
            camera: self.stages.camera(),
            scene: Arc::clone(&self.scene),
            first_radius: self.first_radius,
            radius: self.first_radius * ppm::RadiusSchedule::new(self.params.alpha).scale(self.n_iterations.max(1)),
            seconds: self.seconds,
        })
    }

    /// Whether a limit is reached.
    pub fn is_done(&self, wanted: &Wanted, noise: Option<f64>) -> bool {
        let limits = &wanted.limits;
        !self.is_preview
            && (limits.iterations.is_some_and(|n| self.n_iterations >= n)
                || limits.seconds.is_some_and(|s| self.seconds >= s)
                || limits.noise.zip(noise).is_some_and(|(limit, noise)| noise <= limit))
    }

    pub fn device(&self) -> String {
        self.stages.device()
    }
}
