//! Where the CPU and the GPU meet: the stages of an iteration.

use std::sync::Arc;

pub use crate::device::{Error, Interrupt};
use crate::layout::{Camera, EyeVertex, Frame, Photon, Reach};
use crate::scene::PackedScene;

use super::Film;

/// Seconds each stage of the last iteration took; on a GPU from timestamps where the adapter has them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "render", derive(serde::Serialize))]
pub struct StageTimes {
    /// Eye paths.
    pub eye: f64,
    /// Photon paths, storing included.
    pub photons: f64,
    /// Sort and tree.
    pub build: f64,
    /// Gather.
    pub gather: f64,
    /// Accumulation.
    pub accumulate: f64,
}

impl std::ops::AddAssign for StageTimes {
    fn add_assign(&mut self, other: Self) {
        self.eye += other.eye;
        self.photons += other.photons;
        self.build += other.build;
        self.gather += other.gather;
        self.accumulate += other.accumulate;
    }
}

impl StageTimes {
    /// Of the whole iteration.
    pub fn total(&self) -> f64 {
        self.eye + self.photons + self.build + self.gather + self.accumulate
    }
}

/// A backend. Each stage reads what the stages before it left in the backend's memory; the getters read it back, so
/// that tests compare backends stage by stage.
///
/// All stages but [`Stages::accumulate`] can end with [`Error::Interrupted`], within a few milliseconds on a CPU and two
/// dispatches on a GPU. What they write is then anything; the film is as it was, and goes on with an iteration anew.
pub trait Stages {
    /// For people.
    fn device(&self) -> String;

    /// The camera of this render.
    fn camera(&self) -> Camera;

    /// Another camera and film, pixels (width, height), for the same scene: [`super::start`] comes next, and then the film
    /// is that of stages made anew.
    fn set_camera(&mut self, camera: Camera, film_size: [u32; 2]) -> Result<(), Error>;

    /// Another scene: [`Stages::set_camera`] comes next. What it shares with the last one stays where it is. After an error, stages
    /// fail until one could be set.
    fn set_scene(&mut self, scene: &Arc<PackedScene>) -> Result<(), Error>;

    /// What ends a stage early from now on.
    fn set_interrupt(&mut self, interrupt: Interrupt);

    /// What was set.
    fn interrupt(&self) -> &Interrupt;

    /// One eye path per film pixel, to the vertex where photons are gathered; direct light included.
    fn trace_eye(&mut self, frame: &Frame) -> Result<(), Error>;

    /// `frame.n_paths` photon paths; every vertex that can be gathered at is stored, or an error returned.
    fn trace_photons(&mut self, frame: &Frame) -> Result<(), Error>;

    /// The tree over the stored photons.
    fn build_index(&mut self, frame: &Frame) -> Result<(), Error>;

    /// Radiance of every pixel: what the eye path found plus the photons within its radius.
    fn gather(&mut self, frame: &Frame) -> Result<(), Error>;

    /// Adds the gathered radiance to the film.
    fn accumulate(&mut self, frame: &Frame) -> Result<(), Error>;

    /// What the first radius of every film pixel is chosen from, `[h·w]`; the photons are in any order afterwards. One pixel of each
    /// square of `step` by `step` may be searched around for all of them.
    fn reaches(&mut self, frame: &Frame, step: usize) -> Result<Vec<Reach>, Error>;

    /// First radius of every film pixel, metres, `[h·w]`, row-major.
    fn set_first_radii(&mut self, radii: &[f32]) -> Result<(), Error>;

    /// What [`Stages::trace_eye`] left, `[h·w]`.
    fn eye_vertices(&mut self) -> Result<Vec<EyeVertex>, Error>;

    /// Replaces what [`Stages::trace_eye`] left, `[h·w]`: tests feed two backends the same input.
    fn set_eye_vertices(&mut self, vertices: &[EyeVertex]) -> Result<(), Error>;

    /// The stored photons: in tree order after [`Stages::build_index`].
    fn photons(&mut self) -> Result<Vec<Photon>, Error>;

    /// Replaces the stored photons.
    fn set_photons(&mut self, photons: &[Photon]) -> Result<(), Error>;

    /// What [`Stages::gather`] left: radiance, linear RGB, `[h·w]`.
    fn radiance(&mut self) -> Result<Vec<[f32; 3]>, Error>;

    /// Mean and spread so far.
    fn film(&mut self) -> Result<Film, Error>;

    /// Photons stored by the last [`Stages::trace_photons`].
    fn n_photons(&self) -> u32;

    /// Of the last iteration.
    fn times(&mut self) -> Result<StageTimes, Error>;
}
