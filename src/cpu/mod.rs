//! The CPU backend: the reference the GPU is tested against, and the machine without a GPU.

pub mod bsdf;
pub mod camera;
pub mod eye;
pub mod gather;
pub mod light;
pub mod photons;
pub mod surface;
pub mod texture;
pub mod trace;

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;

use crate::index::PointBvh;
use crate::layout::{Camera, EyeVertex, Frame, Photon, Reach};
use crate::ppm::{Error, Film, Interrupt, StageTimes, Stages, film, reaches};
use crate::scene::PackedScene;

/// Paths a task takes at once: enough to hide its cost, few enough to spread.
const CHUNK: u32 = 4096;
/// The same of pixels.
const PIXELS: usize = 512;

/// Runs the stages with rayon, in the thread pool it is called from.
pub struct CpuStages {
    scene: Arc<PackedScene>,
    camera: Camera,
    width: u32,
    height: u32,
    first_radii: Vec<f32>,
    vertices: Vec<EyeVertex>,
    photons: Vec<Photon>,
    tree: PointBvh,
    radiance: Vec<[f32; 3]>,
    film: Vec<[f32; 4]>,
    n_iterations: u32,
    times: StageTimes,
    interrupt: Interrupt,
}

impl CpuStages {
    /// For a film of `size` pixels.
    pub fn new(scene: Arc<PackedScene>, camera: Camera, size: [u32; 2]) -> Self {
        let mut stages = Self {
            scene,
            camera,
            width: 0,
            height: 0,
            first_radii: Vec::new(),
            vertices: Vec::new(),
            photons: Vec::new(),
            tree: PointBvh::default(),
            radiance: Vec::new(),
            film: Vec::new(),
            n_iterations: 0,
            times: StageTimes::default(),
            interrupt: Interrupt::default(),
        };
        stages.set_size(size);
        stages
    }

    /// A black film, and nothing of what belonged to another.
    fn set_size(&mut self, [width, height]: [u32; 2]) {
        let n = width as usize * height as usize;
        (self.width, self.height) = (width, height);
        self.vertices.clear();
        self.first_radii = vec![0.0; n];
        self.radiance = vec![[0.0; 3]; n];
        self.film = vec![[0.0; 4]; n];
        self.n_iterations = 0;
    }
}

impl Stages for CpuStages {
    fn device(&self) -> String {
        let threads = rayon::current_num_threads();
        format!("CPU, {threads} thread{}", if threads == 1 { "" } else { "s" })
    }

    fn camera(&self) -> Camera {
        self.camera
    }

    fn set_camera(&mut self, camera: Camera, film_size: [u32; 2]) -> Result<(), Error> {
        self.camera = camera;
        self.set_size(film_size);
        Ok(())
    }

    fn set_scene(&mut self, scene: &Arc<PackedScene>) -> Result<(), Error> {
        self.scene = Arc::clone(scene);
        Ok(())
    }

    fn set_interrupt(&mut self, interrupt: Interrupt) {
        self.interrupt = interrupt;
    }

    fn interrupt(&self) -> &Interrupt {
        &self.interrupt
    }

    fn trace_eye(&mut self, frame: &Frame) -> Result<(), Error> {
        let start = Instant::now();
        let (scene, camera, interrupt) = (&*self.scene, &self.camera, &self.interrupt);
        self.vertices.resize(self.radiance.len(), EyeVertex::default());
        self.vertices.par_chunks_mut(PIXELS).enumerate().try_for_each(|(chunk, vertices)| {
            interrupt.check()?;
            for (i, vertex) in ((chunk * PIXELS) as u32..).zip(vertices) {
                *vertex = eye::trace(scene, camera, frame, i % frame.width, i / frame.width);
            }
            Ok::<_, Error>(())
        })?;
        self.times.eye = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn trace_photons(&mut self, frame: &Frame) -> Result<(), Error> {
        let start = Instant::now();
        let (scene, interrupt) = (&*self.scene, &self.interrupt);
        // In order of the paths, whatever the threads.
        let parts: Result<Vec<Vec<Photon>>, Error> = (0..frame.n_paths.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                interrupt.check()?;
                let mut stored = Vec::with_capacity(2 * CHUNK as usize);
                for path in chunk * CHUNK..((chunk + 1) * CHUNK).min(frame.n_paths) {
                    photons::trace(scene, frame, path, &mut stored);
                }
                Ok(stored)
            })
            .collect();
        let parts = parts?;
        self.photons.clear();
        self.photons.reserve(parts.iter().map(Vec::len).sum());
        for part in &parts {
            self.photons.extend_from_slice(part);
        }
        self.times.photons = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn build_index(&mut self, _frame: &Frame) -> Result<(), Error> {
        let start = Instant::now();
        self.interrupt.check()?;
        let position = |i: usize| Vec3::from(self.photons[i].position);
        self.tree.rebuild(self.photons.len(), position);
        let photons = &self.photons;
        self.photons = self.tree.order().par_iter().with_min_len(4096).map(|&i| photons[i as usize]).collect();
        self.times.build = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn gather(&mut self, frame: &Frame) -> Result<(), Error> {
        let start = Instant::now();
        gather::gather(
            &self.scene,
            &self.tree,
            &self.photons,
            frame,
            self.width as usize,
            &self.vertices,
            &self.first_radii,
            &mut self.radiance,
            &self.interrupt,
        )?;
        self.times.gather = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn accumulate(&mut self, _frame: &Frame) -> Result<(), Error> {
        let start = Instant::now();
        self.n_iterations += 1;
        let n = self.n_iterations;
        self.film.par_iter_mut().with_min_len(4096).zip(&self.radiance).for_each(|(pixel, &radiance)| {
            film::add(pixel, n, radiance);
        });
        self.times.accumulate = start.elapsed().as_secs_f64();
        Ok(())
    }

    fn reaches(&mut self, frame: &Frame, step: usize) -> Result<Vec<Reach>, Error> {
        self.tree.rebuild(self.photons.len(), |i| self.photons[i].position.into());
        reaches(frame, &self.camera, &self.vertices, &self.tree, step, &self.interrupt)
    }

    fn set_first_radii(&mut self, radii: &[f32]) -> Result<(), Error> {
        self.first_radii.copy_from_slice(radii);
        Ok(())
    }

    fn eye_vertices(&mut self) -> Result<Vec<EyeVertex>, Error> {
        Ok(self.vertices.clone())
    }

    fn set_eye_vertices(&mut self, vertices: &[EyeVertex]) -> Result<(), Error> {
        self.vertices = vertices.to_vec();
        Ok(())
    }

    fn photons(&mut self) -> Result<Vec<Photon>, Error> {
        Ok(self.photons.clone())
    }

    fn set_photons(&mut self, photons: &[Photon]) -> Result<(), Error> {
        self.photons = photons.to_vec();
        Ok(())
    }

    fn radiance(&mut self) -> Result<Vec<[f32; 3]>, Error> {
        Ok(self.radiance.clone())
    }

    fn film(&mut self) -> Result<Film, Error> {
        Ok(Film { width: self.width, height: self.height, n_iterations: self.n_iterations, pixels: self.film.clone() })
    }

    fn n_photons(&self) -> u32 {
        self.photons.len() as u32
    }

    fn times(&mut self) -> Result<StageTimes, Error> {
        Ok(self.times)
    }
}
