//! What `--json` writes.

use std::path::{Path, PathBuf};

use anyhow::Result;
use serde::Serialize;
use sunfleck::output::atomic;
use sunfleck::ppm::{Direct, FirstRadius, Kernel, Params, StageTimes};

use crate::job::Budget;

/// The whole file: one JSON object. Times are in seconds, lengths in metres. Written at the end, also after Ctrl-C or a
/// failure of the device.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Report {
    /// Version and commit.
    pub sunfleck: &'static str,
    /// SCENE as given.
    pub scene: String,
    /// What was asked for, with the defaults filled in.
    pub settings: Settings,
    /// What computed it.
    pub device: Device,
    /// How it ended: `finished`, `interrupted` or `failed`.
    pub end: End,
    /// What failed, if something did.
    pub error: Option<String>,
    /// Before the first iteration, and all iterations together, by the wall clock.
    pub seconds: Seconds,
    /// Radius of the first and of the last iteration; the median over the pixels.
    pub radius: Radius,
    /// The pictures written.
    pub outputs: Vec<PathBuf>,
    /// In order.
    pub iterations: Vec<Iteration>,
}

/// How a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "camelCase")]
pub enum End {
    /// The budget is used up.
    Finished,
    /// Ctrl-C or SIGTERM.
    Interrupted,
    /// The device failed; what there was has been saved.
    Failed,
}

/// The parameters of the estimator.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Settings {
    /// Pixels: width, height.
    pub size: [u32; 2],
    /// Pixels: x0, y0, x1, y1 (exclusive).
    pub crop: [u32; 4],
    /// Of the random numbers.
    pub seed: u32,
    /// Photon paths an iteration.
    pub photon_paths: u32,
    /// Of the radius schedule.
    pub alpha: f32,
    /// Metres; null: automatic.
    pub first_radius: Option<f32>,
    /// `epanechnikov` or `constant`.
    pub kernel: Kernel,
    /// `sampled` or `photons`.
    pub direct: Direct,
    /// Russian roulette.
    pub roulette: bool,
    /// Of an eye path.
    pub max_eye_segments: u32,
    /// Of a photon path.
    pub max_photon_segments: u32,
    /// From lamp to lens; null: no limit.
    pub max_segments: Option<u32>,
    /// Most iterations; null: no limit.
    pub iterations: Option<u32>,
    /// Most seconds; null: no limit.
    pub seconds: Option<f64>,
}

/// What computed it.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Device {
    /// `cpu` or `gpu`.
    pub backend: &'static str,
    /// As the backend names it.
    pub name: String,
    /// What finds the photons: `tree` or `hardware`.
    pub index: String,
    /// What finds what a ray meets: `bvh` or `kd`.
    pub accelerator: String,
    /// Threads of the CPU.
    pub threads: usize,
}

/// Wall clock.
#[derive(Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Seconds {
    /// Opening the device.
    pub open: f64,
    /// Reading the scene.
    pub load: f64,
    /// Building its tree, and taking it to the device.
    pub prepare: f64,
    /// Choosing the first radii.
    pub start: f64,
    /// All iterations, saving on the way included.
    pub render: f64,
}

/// Metres.
#[derive(Debug, Default, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Radius {
    /// Of the first iteration.
    pub first: f32,
    /// Of the last iteration.
    pub last: f32,
}

/// One iteration.
#[derive(Debug, Serialize)]
#[serde(rename_all = "camelCase")]
pub struct Iteration {
    /// By the wall clock.
    pub seconds: f64,
    /// By the backend: `eye`, `photons`, `build`, `gather`, `accumulate`.
    pub stages: StageTimes,
    /// Photons stored.
    pub photons_stored: u32,
    /// Median over the pixels.
    pub radius: f32,
}

impl Settings {
    pub fn new(params: &Params, budget: Budget) -> Self {
        Self {
            size: params.size,
            crop: params.crop,
            seed: params.seed,
            photon_paths: params.n_paths,
            alpha: params.alpha,
            first_radius: match params.radius {
                FirstRadius::Automatic => None,
                FirstRadius::Fixed(r) => Some(r),
            },
            kernel: params.kernel,
            direct: params.direct,
            roulette: params.roulette,
            max_eye_segments: params.max_eye_segments,
            max_photon_segments: params.max_photon_segments,
            max_segments: (params.max_segments != u32::MAX).then_some(params.max_segments),
            iterations: budget.iterations,
            seconds: budget.seconds,
        }
    }
}

impl Report {
    /// Mean over the iterations, seconds.
    pub fn mean_times(&self) -> StageTimes {
        let mean = |stage: fn(&StageTimes) -> f64| {
            self.iterations.iter().map(|i| stage(&i.stages)).sum::<f64>() / self.iterations.len().max(1) as f64
        };
        StageTimes {
            eye: mean(|t| t.eye),
            photons: mean(|t| t.photons),
            build: mean(|t| t.build),
            gather: mean(|t| t.gather),
            accumulate: mean(|t| t.accumulate),
        }
    }

    pub fn write(&self, path: &Path) -> Result<()> {
        let mut text = serde_json::to_vec_pretty(self)?;
        text.push(b'\n');
        Ok(atomic::write(path, |writer| std::io::Write::write_all(writer, &text))?)
    }
}
