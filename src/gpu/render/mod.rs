//! The stages of an iteration on a GPU.

mod pace;
mod photons;
mod probe;
mod scene;

use std::sync::Arc;

use pace::Pace;
use photons::PhotonPaths;
pub use probe::{BsdfAnswer, BsdfQuery};
use scene::SceneBuffers;

use super::Method;
use super::buffers::{Array, Readback};
use super::context::{Context, DeviceKind};
use super::hardware::Hardware;
use super::index::{Index, Sorted};
use super::kernels::{ACCELERATION_STRUCTURE, Access, Batch, Kernel, Modules, Shared};
use super::timer::Timer;
use crate::device;
use crate::index::PointBvh;
use crate::layout::{Camera, EyeVertex, Frame, Photon, PointBox, Reach};
use crate::ppm::{Error, Film, Interrupt, StageTimes, Stages, reaches};
use crate::scene::PackedScene;

/// Threads a workgroup.
const THREADS: u32 = 64;
/// Words of a photon, whose position comes first.
const PHOTON_WORDS: u32 = (size_of::<Photon>() / 4) as u32;
/// The address of any part of a per-pixel array that begins at a multiple of this many pixels is aligned.
const ALIGNED_PIXELS: u32 = 64;
/// The film is cut at multiples of this many rows: a workgroup's.
const TILE: u32 = 8;
/// Pixels of the largest dispatches, and up to seven rows more: 112 bytes each have to fit a binding.
const MOST_PIXELS: u32 = 1 << 19;
/// Seconds a dispatch may take unless the caller says, well below what watchdogs allow.
const DISPATCH_SECONDS: f64 = 0.1;
/// The same with an interrupt, which takes effect between two; whoever shares the device has a turn there, and two are with
/// the device at a time. Of software a turn is had at any time, and it loses more by each.
const INTERRUPTIBLE_SECONDS: [f64; 2] = [0.004, 0.01];

// The stages that are timed.
const EYE: usize = 0;
const PHOTONS: usize = 1;
const BUILD: usize = 2;
const GATHER: usize = 3;
const ACCUMULATE: usize = 4;
const N_STAGES: usize = 5;

/// The GPU backend.
pub struct GpuStages {
    context: Arc<Context>,
    shared: Shared,
    scene: SceneBuffers,
    camera: Camera,
    trace_eye: Arc<Kernel>,
    paths: PhotonPaths,
    index: Index,
    /// What searches instead of the index's tree; the photons are in its order all the same.
    hardware: Option<Hardware>,
    gather: Arc<Kernel>,
    accumulate: Arc<Kernel>,
    eye_vertices: Array,
    first_radii: Array,
    /// The largest of them, metres, and its pixel.
    largest_radius: (f32, usize),
    radiance: Array,
    film: Array,
    photons: Array,
    /// The other half of a pair: photons before or after sorting.
    other_photons: Array,
    readback: Readback,
    timer: Timer<N_STAGES>,
    n_pixels: u32,
    n_photons: u32,
    film_size: [u32; 2],
    n_iterations: u32,
    /// In pixels.
    eye_pace: Pace,
    reach_pace: Pace,
    reaches_on_device: bool,
    gather_pace: Pace,
    /// A photon takes the device to sort, in each part of that; none before the first.
    photon_seconds: Option<f64>,
    dispatch_seconds: f64,
}

impl GpuStages {
    /// Puts the scene on the device.
    pub fn new(context: Arc<Context>, scene: &PackedScene, camera: Camera) -> Result<Self, Error> {
        Self::with_method(context, scene, camera, Method::Tree)
    }

    /// The same; `method` finds the photons around an eye vertex.
    pub fn with_method(
        context: Arc<Context>,
        scene: &PackedScene,
        camera: Camera,
        method: Method,
    ) -> Result<Self, Error> {
        let guard = Arc::clone(&context);
        guard.guarded(|| Self::make(context, scene, camera, method))
    }

    fn make(context: Arc<Context>, scene: &PackedScene, camera: Camera, method: Method) -> Result<Self, device::Error> {
        use Access::{Read, Write};
        let mut buffers = SceneBuffers::new(&context, &camera);
        let shared = Shared::new(&context, buffers.set(&context, scene)?.into());
        let modules = Modules::new(&context, &shared);
        let trace_eye = modules.kernel("eye", "trace_eye", &[Write])?;
        let paths = PhotonPaths::new(&modules)?;
        let index = Index::new(&modules, &Sorted { permute: ("permute", "permute"), words: PHOTON_WORDS })?;
        let (gather, hardware) = match method {
            Method::Tree => (modules.kernel("gather", "gather", &[Read, Read, Read, Read, Write])?, None),
            Method::Hardware => {
                let hardware = Hardware::new(&context, &modules)?;
                let bindings = [Read.into(), Read.into(), Read.into(), ACCELERATION_STRUCTURE, Write.into()];
                (modules.kernel("gather_hardware", "gather", &bindings)?, Some(hardware))
            }
        };
        let accumulate = modules.kernel("accumulate", "accumulate", &[Read, Write])?;
        let timer = Timer::new(&context);
        let reaches_on_device = context.info().kind != DeviceKind::Cpu;
        let mut stages = Self {
            context,
            shared,
            scene: buffers,
            camera,
            trace_eye,
            paths,
            index,
            hardware,
            gather,
            accumulate,
            eye_vertices: Array::in_ranges::<EyeVertex>("eye vertices"),
            first_radii: Array::in_ranges::<f32>("first radii"),
            largest_radius: (0.0, 0),
            radiance: Array::in_ranges::<[f32; 4]>("radiance"),
            film: Array::in_ranges::<[f32; 4]>("film"),
            photons: Array::new::<Photon>("photons"),
            other_photons: Array::new::<Photon>("photons in tree order"),
            readback: Readback::default(),
            timer,
            n_pixels: 0,
            n_photons: 0,
            film_size: [0, 0],
            n_iterations: 0,
            eye_pace: Pace::new(1, MOST_PIXELS),
            reach_pace: Pace::new(1, MOST_PIXELS),
            reaches_on_device,
            gather_pace: Pace::new(1, MOST_PIXELS),
            photon_seconds: None,
            dispatch_seconds: DISPATCH_SECONDS,
        };
        stages.begin_paces();
        Ok(stages)
    }

    /// How long one dispatch of eye paths, photon paths or the gather is to take at most, seconds (if never called 0.1, or
    /// 0.004 with an interrupt, on software 0.01): short ones let whoever shares the device have a turn. It is aimed at from
    /// what those before took, down to a smallest dispatch, and changes no bit of the picture.
    pub fn set_dispatch_seconds(&mut self, seconds: f64) {
        self.dispatch_seconds = seconds.max(0.0);
        self.begin_paces();
    }

    /// Whether the device itself finds what first radii are chosen from; else the processor does, from all that is read back.
    /// If never called it is the device, but for software, which reads back at no cost and takes two and a half times as long.
    /// Where ray queries search, it is the processor in any case. Radii differ by rounding, and those of previews by more: the
    /// processor searches around some of their pixels only.
    pub fn set_reaches_on_device(&mut self, on_device: bool) {
        self.reaches_on_device = on_device;
    }

    /// Nothing is known of what is next.
    fn begin_paces(&mut self) {
        for pace in [&mut self.eye_pace, &mut self.reach_pace, &mut self.gather_pace, &mut self.paths.pace] {
            pace.begin(self.dispatch_seconds);
        }
    }

    /// Room for the film's pixels.
    fn reserve_pixels(&mut self, n: u32) -> Result<(), Error> {
        for array in [&mut self.eye_vertices, &mut self.first_radii, &mut self.radiance, &mut self.film] {
            array.reserve(&self.context, u64::from(n))?;
        }
        self.n_pixels = n;
        Ok(())
    }

    /// The boxes of the tree, all levels, leaves first; none where ray queries search.
    pub fn tree(&mut self) -> Result<Vec<PointBox>, Error> {
        let n = self.index.levels.last().map_or(0, |[first, n]| first + n);
        self.read(Source::Boxes, n)
    }

    fn find_reaches(&mut self, frame: &Frame) -> Result<Vec<Reach>, Error> {
        use Access::{Read, Write};
        // Made when it is first needed: software does without.
        let modules = Modules::new(&self.context, &self.shared);
        let bindings = [Read, Read, Read, Read, Write];
        let kernel = self.context.guarded(|| modules.kernel("reaches", "find_reaches", &bindings))?;
        self.build_index(frame)?;
        let mut reaches = Array::in_ranges::<Reach>("distances to photons");
        reaches.reserve(&self.context, u64::from(self.n_pixels))?;
        let mut batch = Batch::new(&self.context, &self.shared, "distances to photons");
        self.scene.set_frame(&batch, frame);
        Rows::each(frame, &mut batch, &mut self.reach_pace, |batch, rows| {
            let buffers = [
                rows.of(&self.eye_vertices),
                self.photons.all(),
                self.index.nodes.all(),
                self.index.boxes.all(),
                rows.of(&reaches),
            ];
            let n_levels = self.index.levels.len() as u32;
            let arguments = self.index.arguments([rows.n, self.n_photons, n_levels, rows.skipped()]);
            batch.dispatch(&kernel, &buffers, arguments, rows.workgroups());
        })?;
        batch.submit()?;
        self.readback.read(&self.context, &self.shared, reaches.raw(), self.n_pixels as usize)
    }

    /// Asks the BSDF of the shaders: for tests.
    pub fn ask_bsdf(&mut self, queries: &[BsdfQuery]) -> Result<Vec<BsdfAnswer>, Error> {
        probe::ask(&self.context, &self.shared, &mut self.readback, queries)
    }

    fn read<T: bytemuck::Pod>(&mut self, source: Source, n: u32) -> Result<Vec<T>, Error> {
        if n == 0 {
            return Ok(Vec::new());
        }
        let array = match source {
            Source::Eye => &self.eye_vertices,
            Source::Photons => &self.photons,
            Source::Radiance => &self.radiance,
            Source::Film => &self.film,
            Source::Boxes => &self.index.boxes,
        };
        self.readback.read(&self.context, &self.shared, array.raw(), n as usize)
    }

    fn check_pixels(&self, frame: &Frame) -> Result<(), Error> {
        let n = frame.width * frame.height;
        if n == self.n_pixels {
            return Ok(());
        }
        Err(self.context.error(format!("{n} pixels are asked for, {} have eye vertices", self.n_pixels)))
    }
}

/// Some rows of the film.
struct Rows {
    first: u32,
    n: u32,
    width: u32,
}

impl Rows {
    /// Those from `first` on, of some `amount` pixels; none at the end of the film.
    fn new(frame: &Frame, first: u32, amount: u32) -> Option<Self> {
        let n = (amount / frame.width.max(1)).next_multiple_of(TILE).max(TILE);
        (first < frame.height).then(|| Self { first, n: n.min(frame.height - first), width: frame.width })
    }

    /// Has `record` dispatch all of the film, some rows at a time, as many as `pace` says and learns from.
    fn each<'a>(
        frame: &Frame,
        batch: &mut Batch<'a>,
        pace: &mut Pace,
        mut record: impl FnMut(&mut Batch<'a>, &Self),
    ) -> Result<(), Error> {
        let mut next = Self::new(frame, 0, pace.amount());
        while let Some(rows) = next {
            record(batch, &rows);
            if rows.end() < frame.height {
                pace.learn(batch.cut(rows.pixels())?);
            }
            next = Self::new(frame, rows.end(), pace.amount());
        }
        Ok(())
    }

    /// The next ones.
    fn end(&self) -> u32 {
        self.first + self.n
    }

    fn pixels(&self) -> u32 {
        self.n * self.width
    }

    fn workgroups(&self) -> u32 {
        self.width.div_ceil(TILE) * self.n.div_ceil(TILE)
    }

    /// Pixels at the beginning of [`Rows::of`] that are of the rows before.
    fn skipped(&self) -> u32 {
        self.first * self.width % ALIGNED_PIXELS
    }

    /// Their part of a per-pixel array, and what is [`Rows::skipped`].
    fn of<'a>(&self, array: &'a Array) -> wgpu::BindingResource<'a> {
        array.range(self.first * self.width - self.skipped(), self.pixels() + self.skipped())
    }
}

/// What can be read back.
#[derive(Clone, Copy)]
enum Source {
    Eye,
    Photons,
    Radiance,
    Film,
    Boxes,
}

impl Stages for GpuStages {
    fn device(&self) -> String {
        self.context.info().to_string()
    }

    fn camera(&self) -> Camera {
        self.camera
    }

    fn set_camera(&mut self, camera: Camera, film_size: [u32; 2]) -> Result<(), Error> {
        self.camera = camera;
        self.scene.set_camera(&self.context, &camera)?;
        self.reserve_pixels(film_size[0] * film_size[1])?;
        // Nothing of the old film is to be read.
        self.n_pixels = 0;
        self.film_size = [0, 0];
        self.n_iterations = 0;
        self.begin_paces();
        self.context.check()
    }

    fn set_scene(&mut self, scene: &Arc<PackedScene>) -> Result<(), Error> {
        let context = Arc::clone(&self.context);
        // They hold the memory of what they bind.
        self.shared.set_groups([]);
        context.guarded(|| {
            self.shared.set_groups(self.scene.set(&context, scene)?);
            Ok(())
        })
    }

    fn set_interrupt(&mut self, interrupt: Interrupt) {
        if interrupt.is_set() {
            let is_software = self.context.info().kind == DeviceKind::Cpu;
            let most = INTERRUPTIBLE_SECONDS[usize::from(is_software)];
            self.set_dispatch_seconds(self.dispatch_seconds.min(most));
        }
        self.shared.interrupt = interrupt;
    }

    fn interrupt(&self) -> &Interrupt {
        &self.shared.interrupt
    }

    fn trace_eye(&mut self, frame: &Frame) -> Result<(), Error> {
        self.shared.interrupt.check()?;
        let n_pixels = frame.width * frame.height;
        self.reserve_pixels(n_pixels)?;
        let mut batch = Batch::new(&self.context, &self.shared, "eye");
        self.scene.set_frame(&batch, frame);
        self.timer.begin(EYE, &mut batch);
        Rows::each(frame, &mut batch, &mut self.eye_pace, |batch, rows| {
            let buffers = [rows.of(&self.eye_vertices)];
            let arguments = [rows.n, rows.first, rows.skipped(), 0];
            batch.dispatch(&self.trace_eye, &buffers, arguments, rows.workgroups());
        })?;
        self.timer.end(EYE, batch, &self.context)
    }

    fn trace_photons(&mut self, frame: &Frame) -> Result<(), Error> {
        self.shared.interrupt.check()?;
        self.n_photons = self.paths.trace(
            &self.context,
            &self.shared,
            &self.scene,
            frame,
            &mut self.photons,
            &mut self.readback,
            &mut self.timer,
        )?;
        Ok(())
    }

    fn build_index(&mut self, frame: &Frame) -> Result<(), Error> {
        self.shared.interrupt.check()?;
        let n = self.n_photons;
        self.photons.reserve(&self.context, u64::from(n))?;
        self.other_photons.reserve(&self.context, self.photons.capacity())?;
        match &mut self.hardware {
            None => self.index.reserve(&self.context, n)?,
            Some(hardware) => {
                self.index.reserve_sort(&self.context, n)?;
                hardware.reserve(&self.context, n)?;
            }
        }
        let mut batch = Batch::new(&self.context, &self.shared, "build");
        self.scene.set_frame(&batch, frame);
        self.timer.begin(BUILD, &mut batch);
        let photons = self.photons.all();
        let part_seconds = self.photon_seconds.map(|seconds| seconds * f64::from(n));
        self.index.parts_at_once = part_seconds.map_or(1, |part| ((self.dispatch_seconds / part) as u32).max(1));
        match &mut self.hardware {
            None => self.index.build(&mut batch, n, &photons, PHOTON_WORDS, &self.other_photons)?,
            Some(hardware) => {
                if n > 0 {
                    self.index.sort(&mut batch, n, &photons, PHOTON_WORDS, &self.other_photons)?;
                }
                let radius = self.largest_radius.0 * frame.radius_scale;
                hardware.build(&mut batch, n, &self.other_photons, PHOTON_WORDS, radius);
            }
        }
        self.timer.end(BUILD, batch, &self.context)?;
        std::mem::swap(&mut self.photons, &mut self.other_photons);
        Ok(())
    }

    fn gather(&mut self, frame: &Frame) -> Result<(), Error> {
        self.shared.interrupt.check()?;
        self.check_pixels(frame)?;
        self.photons.reserve(&self.context, 0)?;
        let tree = match &self.hardware {
            None => {
                self.index.reserve(&self.context, 0)?;
                self.index.nodes.all()
            }
            Some(hardware) => {
                let (largest, query) = self.largest_radius;
                hardware.tree(&self.context, query, largest * frame.radius_scale)?
            }
        };
        let mut batch = Batch::new(&self.context, &self.shared, "gather");
        self.scene.set_frame(&batch, frame);
        self.timer.begin(GATHER, &mut batch);
        Rows::each(frame, &mut batch, &mut self.gather_pace, |batch, rows| {
            let buffers = [
                rows.of(&self.eye_vertices),
                rows.of(&self.first_radii),
                self.photons.all(),
                tree.clone(),
                rows.of(&self.radiance),
            ];
            let n_levels = self.index.levels.len() as u32;
            let arguments = self.index.arguments([rows.n, self.n_photons, n_levels, rows.skipped()]);
            batch.dispatch(&self.gather, &buffers, arguments, rows.workgroups());
        })?;
        self.timer.end(GATHER, batch, &self.context)
    }

    fn accumulate(&mut self, frame: &Frame) -> Result<(), Error> {
        self.check_pixels(frame)?;
        let mut batch = Batch::new(&self.context, &self.shared, "accumulate");
        self.scene.set_frame(&batch, frame);
        self.timer.begin(ACCUMULATE, &mut batch);
        if frame.iteration <= 1 {
            batch.encoder().clear_buffer(self.film.raw(), 0, None);
        }
        let n_pixels = frame.width * frame.height;
        for first in (0..n_pixels).step_by(MOST_PIXELS as usize) {
            let n = MOST_PIXELS.min(n_pixels - first);
            let buffers = [self.radiance.range(first, n), self.film.range(first, n)];
            batch.dispatch(&self.accumulate, &buffers, [n, 0, 0, 0], n.div_ceil(THREADS));
        }
        self.timer.end(ACCUMULATE, batch, &self.context)?;
        self.film_size = [frame.width, frame.height];
        self.n_iterations = frame.iteration;
        Ok(())
    }

    fn reaches(&mut self, frame: &Frame, step: usize) -> Result<Vec<Reach>, Error> {
        self.check_pixels(frame)?;
        // Ray queries have one radius for all, and no order.
        if self.reaches_on_device && self.hardware.is_none() {
            return self.find_reaches(frame);
        }
        let (eye, photons) = (self.eye_vertices()?, self.photons()?);
        let mut tree = PointBvh::default();
        tree.rebuild(photons.len(), |i| photons[i].position.into());
        reaches(frame, &self.camera, &eye, &tree, step, &self.shared.interrupt)
    }

    fn set_first_radii(&mut self, radii: &[f32]) -> Result<(), Error> {
        self.reserve_pixels(radii.len() as u32)?;
        let larger = |a: (f32, usize), b: (f32, usize)| if b.0 > a.0 { b } else { a };
        self.largest_radius = radii.iter().copied().zip(0..).fold((0.0, 0), larger);
        self.first_radii.write(&self.context, radii)
    }

    fn eye_vertices(&mut self) -> Result<Vec<EyeVertex>, Error> {
        self.read(Source::Eye, self.n_pixels)
    }

    fn set_eye_vertices(&mut self, vertices: &[EyeVertex]) -> Result<(), Error> {
        self.reserve_pixels(vertices.len() as u32)?;
        self.eye_vertices.write(&self.context, vertices)
    }

    fn photons(&mut self) -> Result<Vec<Photon>, Error> {
        self.read(Source::Photons, self.n_photons)
    }

    fn set_photons(&mut self, photons: &[Photon]) -> Result<(), Error> {
        self.photons.write(&self.context, photons)?;
        self.n_photons = photons.len() as u32;
        Ok(())
    }

    fn radiance(&mut self) -> Result<Vec<[f32; 3]>, Error> {
        let pixels = self.read::<[f32; 4]>(Source::Radiance, self.n_pixels)?;
        Ok(pixels.iter().map(|p| [p[0], p[1], p[2]]).collect())
    }

    fn film(&mut self) -> Result<Film, Error> {
        let [width, height] = self.film_size;
        let pixels = self.read(Source::Film, width * height)?;
        Ok(Film { width, height, n_iterations: self.n_iterations, pixels })
    }

    fn n_photons(&self) -> u32 {
        self.n_photons
    }

    fn times(&mut self) -> Result<StageTimes, Error> {
        let [eye, photons, build, gather, accumulate] =
            self.timer.read(&self.context, &self.shared, &mut self.readback)?;
        let times = StageTimes { eye, photons, build, gather, accumulate };
        if self.n_photons > 0 && times.build > 0.0 {
            self.photon_seconds = Some(times.build / f64::from(self.n_photons) / f64::from(Index::N_PARTS));
        }
        Ok(times)
    }
}
