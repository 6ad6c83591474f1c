//! `sunfleck render`: from a scene to saved pictures.

use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Result, anyhow, bail};
use sunfleck::layout::Camera;
use sunfleck::output::{self, Picture};
use sunfleck::ppm::{self, Error, Film, FirstRadii, FirstRadius, Params, Stages};

use crate::cli::RenderArgs;
use crate::devices;
use crate::job::{Input, Job, is_png};
use crate::progress::{self, Progress, Status};
use crate::report::{Device, End, Iteration, Radius, Report, Seconds, Settings};
use crate::stop::Stop;

/// How much of the work a failing device may cost, at most.
const SNAPSHOT_EVERY: Duration = Duration::from_secs(30);

pub fn run(args: &RenderArgs) -> Result<ExitCode> {
    let stop = Stop::install()?;
    let job = Job::resolve(args)?; // what is to be done, and that its outputs can be written
    devices::use_threads(args.device.threads)?;
    let mut seconds = Seconds::default();
    let mut progress = Progress::new(args.quiet);
    let device = timed(&mut seconds.open, || devices::open_for(&args.device, &job.source, &progress))?;
    let input = timed(&mut seconds.load, || job.load(args))?; // file → scene, camera, parameters
    input.warnings.iter().for_each(|warning| progress.say(&format!("sunfleck: warning: {}", crate::one_line(warning))));
    let mut stages = timed(&mut seconds.prepare, || device.stages(&input))?; // scene → device's memory
    let stages = &mut *stages;
    let radii = timed(&mut seconds.start, || start(stages, &input.params, job.one_radius))?; // first photons → radii
    let mut run = Run::new(&job, args, &input, &device, stages, radii.spread(), seconds);
    if args.verbose {
        run.describe(&input, &progress);
    }

    if stop.asked() {
        progress.finish();
        progress.say("interrupted before the first iteration: nothing to save");
        return Ok(ExitCode::from(crate::INTERRUPTED));
    }
    let began = Instant::now();
    let end = loop {
        let i = run.report.iterations.len() as u32 + 1;
        if let Err(error) = run.iterate(stages, i, began) {
            break Err(error);
        }
        let spent = job.budget.spent(i, began.elapsed().as_secs_f64());
        progress.update(&run.status(spent));
        if stop.asked() {
            break Ok(End::Interrupted);
        }
        if spent >= 1.0 {
            break Ok(End::Finished);
        }
        if let Err(error) = run.save_if_due(stages, args.save_every, &progress) {
            break Err(error);
        }
    };
    progress.finish();
    run.finish(stages, end, &progress)
}

/// Runs the pilot; for one radius everywhere, again with the median of what it chose.
pub fn start(stages: &mut dyn Stages, params: &Params, one_radius: bool) -> Result<FirstRadii> {
    let radii = ppm::start(stages, params)?;
    if !one_radius {
        return Ok(radii);
    }
    let [_, median, _] = radii.spread();
    let radius = FirstRadius::Fixed(median);
    Ok(ppm::start(stages, &Params { radius, ..params.clone() })?)
}

/// A render under way: what will be reported, and what is safe already.
struct Run<'a> {
    job: &'a Job,
    args: &'a RenderArgs,
    params: &'a Params,
    camera: Camera,
    /// First ones: the smallest, the median, the largest; metres.
    radii: [f32; 3],
    report: Report,
    /// The last film read back, and when.
    film: Film,
    read: Instant,
    saved: Instant,
}

impl<'a> Run<'a> {
    fn new(
        job: &'a Job,
        args: &'a RenderArgs,
        input: &'a Input,
        device: &devices::Device,
        stages: &dyn Stages,
        radii: [f32; 3],
        seconds: Seconds,
    ) -> Self {
        let (params, now) = (&input.params, Instant::now());
        let report = Report {
            sunfleck: output::VERSION,
            scene: job.scene_name.clone(),
            settings: Settings::new(params, job.budget),
            device: Device {
                backend: device.backend(),
                name: stages.device(),
                index: device.index(),
                accelerator: device.accelerator().to_string(),
                threads: rayon::current_num_threads(),
            },
            end: End::Failed,
            error: None,
            seconds,
            radius: Radius { first: radii[1], last: radii[1] },
            outputs: vec![],
            iterations: vec![],
        };
        let camera = stages.camera();
        Self { job, args, params, camera, radii, report, film: Film::default(), read: now, saved: now }
    }

    /// One iteration, and its line in the report.
    fn iterate(&mut self, stages: &mut dyn Stages, i: u32, began: Instant) -> Result<(), Error> {
        let this = Instant::now();
        let frame = self.params.frame(i);
        ppm::iterate(stages, &frame)?;
        let stage_times = stages.times()?;
        self.report.radius.last = self.radii[1] * frame.radius_scale;
        self.report.iterations.push(Iteration {
            seconds: this.elapsed().as_secs_f64(),
            stages: stage_times,
            photons_stored: stages.n_photons(),
            radius: self.report.radius.last,
        });
        self.report.seconds.render = began.elapsed().as_secs_f64();
        Ok(())
    }

    fn status(&self, spent: f64) -> Status {
        Status {
            iterations: self.report.iterations.len() as u32,
            seconds: self.report.seconds.render,
            spent,
            n_paths: self.params.n_paths,
            radius: self.report.radius.last,
        }
    }

    /// Between iterations: reads the film back now and then, and saves it if that was asked for. A file that cannot be
    /// written now may be writable at the end.
    fn save_if_due(&mut self, stages: &mut dyn Stages, every: Option<f64>, progress: &Progress) -> Result<(), Error> {
        let save = every.is_some_and(|s| self.saved.elapsed().as_secs_f64() >= s);
        if save || self.read.elapsed() >= SNAPSHOT_EVERY {
            self.film = stages.film()?;
            self.read = Instant::now();
        }
        if save {
            if let Err(error) = self.save_pictures() {
                progress.say(&format!("sunfleck: warning: {}", crate::chain(&error)));
            }
            self.saved = Instant::now();
        }
        Ok(())
    }

    /// Saves pictures and report, says what happened, and with which exit code the program ends.
    fn finish(mut self, stages: &mut dyn Stages, end: Result<End, Error>, progress: &Progress) -> Result<ExitCode> {
        let mut failure = None;
        match end {
            Ok(end) => self.report.end = end,
            Err(error) => failure = Some(anyhow!(error)),
        }
        match stages.film() {
            Ok(film) => self.film = film,
            Err(error) => failure = failure.or(Some(anyhow!(error))), // What was read back last is what there is.
        }
        if self.film.n_iterations > 0
            && let Err(error) = self.save_pictures()
        {
            failure = failure.or(Some(error));
        }
        if let Some(error) = &failure {
            self.report.end = End::Failed;
            self.report.error = Some(crate::chain(error));
        }
        if let Some(path) = &self.args.json
            && let Err(error) = self.report.write(path)
        {
            failure = failure.or(Some(error));
        }
        if let Some(error) = failure {
            bail!("{} ({})", crate::chain(&error), self.summary());
        }
        self.say_result(progress);
        Ok(if self.report.end == End::Interrupted { ExitCode::from(crate::INTERRUPTED) } else { ExitCode::SUCCESS })
    }

    /// Tries every output, and returns the first error.
    fn save_pictures(&mut self) -> Result<()> {
        let params = self.params;
        let picture = Picture {
            size: params.size,
            crop: params.crop,
            rgb: self.film.rgb(),
            variance: self.args.variance.then(|| self.film.variance_of_mean()),
        };
        let header = output::exr::Header {
            scene: self.job.scene_name.clone(),
            command: command_line(),
            adapter: self.report.device.name.clone(),
            index: self.report.device.index.clone(),
            accelerator: self.report.device.accelerator.clone(),
            seconds: self.report.seconds.render,
            camera: self.camera,
            ..output::exr::Header::of(params, self.radii[1], self.film.n_iterations)
        };
        let mut first_error = None;
        for path in &self.job.outputs {
            let written = if is_png(path) {
                output::png::write(path, &picture, &self.job.look)
            } else {
                output::exr::write(path, &picture, &header)
            };
            match written {
                Ok(()) if !self.report.outputs.contains(path) => self.report.outputs.push(path.clone()),
                Ok(()) => {}
                Err(error) => first_error = first_error.or(Some(error)),
            }
        }
        first_error.map_or(Ok(()), |error| Err(error.into()))
    }

    /// "saved a.exr, b.png after 64 iterations".
    fn summary(&self) -> String {
        let files: Vec<_> = self.report.outputs.iter().map(|path| path.display().to_string()).collect();
        let files = if files.is_empty() { "no picture".to_owned() } else { files.join(", ") };
        let n = self.film.n_iterations;
        format!("saved {files} after {n} iteration{}", if n == 1 { "" } else { "s" })
    }

    fn say_result(&self, progress: &Progress) {
        let interrupted = if self.report.end == End::Interrupted { "interrupted: " } else { "" };
        let (n, seconds) = (self.report.iterations.len() as f64, self.report.seconds.render);
        progress.say(&format!(
            "{interrupted}{} in {} on {}; radius {} to {}",
            self.summary(),
            progress::seconds(seconds),
            self.report.device.name,
            progress::length(self.report.radius.first),
            progress::length(self.report.radius.last),
        ));
        let broken = self.film.pixels.iter().filter(|p| p[..3].iter().any(|c| !c.is_finite())).count();
        if broken > 0 {
            progress.say(&format!("sunfleck: warning: {broken} pixels are not finite"));
        }
        if self.args.verbose {
            let t = self.report.mean_times();
            let stored = self.report.iterations.iter().map(|i| f64::from(i.photons_stored)).sum::<f64>() / n;
            progress.say(&format!(
                "an iteration: eye {:.3} s, photons {:.3} s ({stored:.0} stored), build {:.3} s, gather {:.3} s, \
                 accumulate {:.3} s; in all {:.3} s",
                t.eye,
                t.photons,
                t.build,
                t.gather,
                t.accumulate,
                seconds / n,
            ));
        }
    }

    /// For `-v`: what is about to be rendered.
    fn describe(&self, input: &Input, progress: &Progress) {
        let (scene, params, seconds) = (&input.scene, self.params, &self.report.seconds);
        let triangles: usize = scene.meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        let [width, height] = params.film_size();
        for line in [
            format!(
                "scene: {} meshes, {triangles} triangles, {} spheres, {} materials, {} images, {} punctual lights{}",
                scene.meshes.len(),
                scene.spheres.len(),
                scene.materials.len(),
                scene.images.len(),
                scene.lights.len(),
                if scene.environment.is_some() { ", environment" } else { "" },
            ),
            format!("camera: {:?}, {width}x{height} pixels", input.camera.name),
            format!(
                "device: {} ({}), index: {}, accelerator: {}",
                self.report.device.name,
                self.report.device.backend,
                self.report.device.index,
                self.report.device.accelerator,
            ),
            format!("photons: {} paths an iteration, alpha {:.4}, {:?}", params.n_paths, params.alpha, params.kernel),
            format!(
                "first radius: {}, from {} to {}",
                progress::length(self.radii[1]),
                progress::length(self.radii[0]),
                progress::length(self.radii[2]),
            ),
            format!(
                "load {:.2} s, prepare {:.2} s, first photons {:.2} s",
                seconds.load, seconds.prepare, seconds.start
            ),
        ] {
            progress.say(&line);
        }
    }
}

/// Does `work` and notes how long it took.
fn timed<T>(seconds: &mut f64, work: impl FnOnce() -> T) -> T {
    let began = Instant::now();
    let done = work();
    *seconds = began.elapsed().as_secs_f64();
    done
}

/// As it could be typed again.
pub fn command_line() -> String {
    let args = std::env::args_os().skip(1).map(|arg| quote(&arg.to_string_lossy()));
    std::iter::once("sunfleck".to_owned()).chain(args).collect::<Vec<_>>().join(" ")
}

/// An argument as a POSIX shell takes it.
pub fn quote(arg: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_=./,:+%@".contains(c);
    match arg.chars().all(plain) && !arg.is_empty() {
        true => arg.to_owned(),
        false => format!("'{}'", arg.replace('\'', r"'\''")),
    }
}
