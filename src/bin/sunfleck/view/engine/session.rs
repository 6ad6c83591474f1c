//! One scene on one device: an estimate under way.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use anyhow::Result;
use sunfleck::inspect::{self, Split};
use sunfleck::layout::Camera;
use sunfleck::output::Picture;
use sunfleck::ppm::{self, Error, Film, FirstRadii, FirstRadius, Interrupt, Params, StageTimes, Stages};
use sunfleck::scene::PackedScene;
use sunfleck::scene::settings::Settings;

use super::paint::Needs;
use super::{Board, Insides, Opened, Painted, Record, Wanted};
use crate::devices::Device;
use crate::job::Input;

/// Of the picture's width and height, while the camera moves.
const PREVIEW: u32 = 4;
/// Photon paths of a preview.
const PREVIEW_PATHS: u32 = 20_000;
/// Between films that are read back.
const SHOW_EVERY: Duration = Duration::from_millis(80);
/// The same, in times of what reading the last one back took.
const SHOW_EVERY_TIMES: u32 = 10;
/// Iterations that are shown at once.
const SHOW_FIRST: u32 = 3;

/// A film, and what made it.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// Changes with every restart.
    pub estimate: u64,
    pub film: Arc<Film>,
    /// Smaller than wanted, while the camera moves.
    pub is_preview: bool,
    pub params: Params,
    pub camera: Camera,
    pub scene: Arc<PackedScene>,
    /// What it is an estimate of.
    pub opened: Arc<Opened>,
    pub settings: Arc<Settings>,
    pub machine: Arc<Machine>,
    pub first_radii: Arc<FirstRadii>,
    /// Read back only where something shown needs it.
    pub insides: Option<Arc<Insides>>,
    /// Median of the first radii and of those now, metres.
    pub first_radius: f32,
    pub radius: f32,
    /// Mean of those now where something is gathered, metres; none if nothing is.
    pub mean_radius: Option<f32>,
    /// Since the restart, pauses left out.
    pub seconds: f64,
    /// Whether the paint thread has begun with it.
    pub is_taken: Arc<AtomicBool>,
}

/// What renders.
#[derive(Clone, Debug)]
pub struct Machine {
    /// For people.
    pub device: String,
    /// What chooses it on the command line.
    pub flags: String,
    /// What finds photons: `tree` or `hardware`.
    pub index: String,
}

impl Snapshot {
    /// The film as a picture.
    pub fn picture(&self) -> Picture {
        Picture { size: self.params.size, crop: self.params.crop, rgb: self.film.rgb(), variance: None }
    }

    /// What was read back beside the film.
    pub fn has(&self) -> Needs {
        self.insides.as_ref().map_or(Needs::default(), |insides| insides.has())
    }

    /// The camera as a pinhole, and the film behind it.
    pub fn view(&self) -> inspect::View {
        inspect::View::new(self.camera, self.params.size, self.params.crop)
    }
}

/// What was shown last.
struct Shown {
    when: Instant,
    /// For the film, and for the insides.
    took: [Duration; 2],
    is_taken: Arc<AtomicBool>,
    n_iterations: u32,
    /// Beside the film.
    has: Needs,
}

impl Shown {
    /// Whether it is time for the next. Before the paint thread has begun with this one, the next would only take its place.
    fn is_over(&self) -> bool {
        let [film, insides] = self.took;
        self.is_taken.load(Ordering::Relaxed)
            && self.when.elapsed() >= SHOW_EVERY.max(SHOW_EVERY_TIMES * film).max(insides)
    }
}

impl Board {
    /// What of an iteration is needed for what is wanted now.
    pub fn needs(&self) -> Needs {
        let painting = &self.wanted.painting;
        // Whether a difference can be shown, only its painting tells.
        let difference = self.painted.as_deref().and_then(Painted::difference);
        painting.needs(difference == Some(painting.comparison))
    }
}

/// None of nothing.
fn mean(values: impl Iterator<Item = f32>) -> Option<f32> {
    let (sum, n) = values.fold((0.0, 0u32), |(sum, n), value| (sum + f64::from(value), n + 1));
    (n > 0).then(|| (sum / f64::from(n)) as f32)
}

/// See the module.
pub struct Session {
    pub opened: Arc<Opened>,
    pub input: Input,
    /// What `input` was made with.
    pub settings: Arc<Settings>,
    scene: Arc<PackedScene>,
    pub machine: Arc<Machine>,
    stages: Box<dyn Stages>,
    estimate: u64,
    params: Params,
    is_preview: bool,
    /// None before the pilot.
    radii: Option<Arc<FirstRadii>>,
    split: Split,
    /// The last iteration that is in it.
    split_last: u32,
    first_radius: f32,
    mean_first_radius: Option<f32>,
    /// Done in this estimate.
    pub n_iterations: u32,
    pub seconds: f64,
    /// Of all of them.
    times: StageTimes,
    /// Whether the stages have what the last iteration left: not if the one after it was interrupted.
    is_whole: bool,
    shown: Option<Shown>,
}

impl Session {
    /// What `before` has of the scene is not packed again; `interrupt` ends stages.
    pub fn new(
        device: &Device,
        opened: Arc<Opened>,
        settings: Arc<Settings>,
        input: Input,
        before: &PackedScene,
        interrupt: Interrupt,
    ) -> Result<Self> {
        let scene = device.pack(&input.scene, before)?;
        let mut stages = device.stages_of(Arc::clone(&scene), &input)?;
        stages.set_interrupt(interrupt);
        let params = input.params.clone();
        let machine = Machine { device: stages.device(), flags: device.flags(), index: device.index() };
        Ok(Self {
            opened,
            input,
            settings,
            scene,
            machine: Arc::new(machine),
            stages,
            estimate: 0,
            params,
            is_preview: false,
            radii: None,
            split: Split::default(),
            split_last: 0,
            first_radius: 0.0,
            mean_first_radius: None,
            n_iterations: 0,
            seconds: 0.0,
            times: StageTimes::default(),
            is_whole: false,
            shown: None,
        })
    }

    /// What it renders; the memory of the device is given back.
    pub fn into_scene(self) -> Arc<PackedScene> {
        self.scene
    }

    /// The same scene changed by other settings; [`Session::restart`] comes next. What stays of it is neither packed nor taken to
    /// the device again.
    pub fn change(&mut self, device: &Device, settings: Arc<Settings>, input: Input) -> Result<()> {
        self.scene = device.pack(&input.scene, &self.scene)?;
        self.stages.set_scene(&self.scene)?;
        (self.settings, self.input) = (settings, input);
        Ok(())
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
        (self.n_iterations, self.seconds, self.is_whole, self.shown) = (0, 0.0, false, None);
        self.times = StageTimes::default();
        (self.split, self.split_last, self.radii) = (Split::default(), 0, None);
        Ok(())
    }

    /// The first radii, if there are none yet. A preview chooses them with its first iteration.
    pub fn start(&mut self) -> Result<(), Error> {
        if self.radii.is_none() && !self.is_preview {
            let radii = ppm::start(&mut *self.stages, &self.params)?;
            self.set_radii(radii);
        }
        Ok(())
    }

    fn set_radii(&mut self, radii: FirstRadii) {
        [_, self.first_radius, _] = radii.spread();
        self.mean_first_radius = mean(radii.gathering());
        self.radii = Some(Arc::new(radii));
    }

    /// One iteration, after [`Session::start`].
    pub fn iterate(&mut self) -> Result<Record, Error> {
        let began = Instant::now();
        let frame = self.params.frame(self.n_iterations + 1);
        self.is_whole = false;
        if self.radii.is_none() {
            let radii = ppm::start_preview(&mut *self.stages, &self.params)?;
            self.set_radii(radii);
        } else {
            ppm::iterate(&mut *self.stages, &frame)?;
        }
        if let (0, FirstRadius::Fixed(_), Some(radii)) = (self.n_iterations, self.params.radius, &mut self.radii) {
            let radii = Arc::make_mut(radii);
            radii.look_at(&self.stages.eye_vertices()?);
            self.mean_first_radius = mean(radii.gathering());
        }
        self.is_whole = true;
        self.times += self.stages.times()?;
        self.n_iterations += 1;
        self.seconds += began.elapsed().as_secs_f64();
        Ok(Record {
            iteration: self.n_iterations,
            seconds: self.seconds,
            radius: self.first_radius * frame.radius_scale,
            times: self.times,
            n_photons: self.stages.n_photons(),
            n_paths: self.params.n_paths,
        })
    }

    /// Whether something wanted is not in what was shown last.
    pub fn owes(&self, needs: Needs) -> bool {
        let owes = |s: &Shown| s.n_iterations < self.n_iterations || self.is_whole && !needs.are_met_by(s.has);
        self.n_iterations > 0 && self.shown.as_ref().is_none_or(owes)
    }

    /// The film, if it is time to show it, or if there will be no more; with as much of the iteration as `needs` says.
    pub fn snapshot_if_due(&mut self, is_last: bool, needs: Needs) -> Result<Option<Snapshot>, Error> {
        let is_awaited = |s: &Shown| !needs.are_met_by(s.has) || s.is_over();
        let is_due = is_last || self.n_iterations <= SHOW_FIRST || self.shown.as_ref().is_none_or(is_awaited);
        if !is_due || !self.owes(needs) {
            return Ok(None);
        }
        let began = Instant::now();
        let mut snapshot = self.snapshot()?;
        let film = began.elapsed();
        if needs.is_any() && self.is_whole {
            snapshot.insides = Some(Arc::new(self.insides(needs)?));
        }
        self.shown = Some(Shown {
            when: Instant::now(),
            took: [film, began.elapsed() - film],
            is_taken: Arc::clone(&snapshot.is_taken),
            n_iterations: self.n_iterations,
            has: snapshot.has(),
        });
        Ok(Some(snapshot))
    }

    /// The film as it is.
    pub fn snapshot(&mut self) -> Result<Snapshot, Error> {
        let scale = ppm::RadiusSchedule::new(self.params.alpha).scale(self.n_iterations.max(1));
        Ok(Snapshot {
            estimate: self.estimate,
            film: Arc::new(self.stages.film()?),
            is_preview: self.is_preview,
            params: self.params.clone(),
            camera: self.stages.camera(),
            scene: Arc::clone(&self.scene),
            opened: Arc::clone(&self.opened),
            settings: Arc::clone(&self.settings),
            machine: Arc::clone(&self.machine),
            first_radii: self.radii.clone().unwrap_or_default(),
            insides: None,
            first_radius: self.first_radius,
            radius: self.first_radius * scale,
            mean_radius: self.mean_first_radius.map(|radius| radius * scale),
            seconds: self.seconds,
            is_taken: Arc::default(),
        })
    }

    /// Of the last iteration; its light is added to the mean of those looked into before.
    fn insides(&mut self, needs: Needs) -> Result<Insides, Error> {
        let photons = self.stages.photons()?;
        if !(needs.split || needs.nodes_visited) {
            return Ok(Insides { photons, ..Insides::default() });
        }
        let (frame, vertices) = (self.params.frame(self.n_iterations), self.stages.eye_vertices()?);
        let radii = self.radii.as_deref().map_or(&[][..], |radii| &radii.each);
        let iteration = inspect::Iteration::new(&self.scene, &frame, &vertices, radii, &photons);
        let interrupt = self.stages.interrupt();
        let nodes_visited = needs.nodes_visited.then(|| iteration.nodes_visited(interrupt)).transpose()?;
        if needs.split && self.split_last != self.n_iterations {
            self.split.add(&iteration.split(interrupt)?);
            self.split_last = self.n_iterations;
        }
        let split = needs.split.then(|| self.split.clone());
        Ok(Insides { photons, split, nodes_visited })
    }

    /// Whether a limit is reached.
    pub fn is_done(&self, wanted: &Wanted, noise: Option<f64>) -> bool {
        let limits = wanted.limits_with(&self.opened.source.settings);
        !self.is_preview
            && (limits.iterations.is_some_and(|n| self.n_iterations >= n)
                || limits.seconds.is_some_and(|s| self.seconds >= s)
                || limits.noise.zip(noise).is_some_and(|(limit, noise)| noise <= limit))
    }
}

#[cfg(test)]
pub mod tests {
    use sunfleck::scene::Accelerator;

    use super::super::{Choice, reading};
    use super::*;
    use crate::cli::InputArgs;
    use crate::job;

    const NOTHING: Needs = Needs { photons: false, split: false, nodes_visited: false };
    const PHOTONS: Needs = Needs { photons: true, ..NOTHING };
    const SPLIT: Needs = Needs { split: true, ..NOTHING };
    const NODES: Needs = Needs { nodes_visited: true, ..NOTHING };

    /// A small one, of estimate 1, on the processor.
    pub fn session(interrupt: Interrupt) -> Session {
        let set = ["size=32x24", "photons=500"].map(str::to_owned).to_vec();
        let choice = Arc::new(Choice { name: "cornell".to_owned(), set });
        let (opened, packed) = reading::open(&choice, true, &Interrupt::default()).unwrap();
        let settings = opened.source.settings.clone();
        let input = job::prepare(&opened.source, &settings, opened.loaded.clone(), &InputArgs::default()).unwrap();
        let device = Device::Cpu(Accelerator::Bvh);
        let mut session = Session::new(&device, opened.into(), settings.into(), input, &packed, interrupt).unwrap();
        session.restart(1, false).unwrap();
        session.start().unwrap();
        session
    }

    #[test]
    fn a_film_is_read_back_when_the_last_is_taken_and_that_leaves_time_to_render() {
        let mut session = session(Interrupt::default());
        let mut snapshot = None;
        for _ in 0..SHOW_FIRST {
            session.iterate().unwrap();
            snapshot = session.snapshot_if_due(false, NOTHING).unwrap();
            assert!(snapshot.is_some());
        }
        session.iterate().unwrap();
        let long_ago = |session: &mut Session, film: u64, insides: u64| {
            let shown = session.shown.as_mut().unwrap();
            shown.when = Instant::now() - Duration::from_secs(1);
            shown.took = [film, insides].map(Duration::from_millis);
        };
        long_ago(&mut session, 1, 0);
        assert!(session.snapshot_if_due(false, NOTHING).unwrap().is_none());
        snapshot.unwrap().is_taken.store(true, Ordering::Relaxed);
        for (film, insides) in [(20_000, 0), (1, 200_000)] {
            long_ago(&mut session, film, insides);
            assert!(session.snapshot_if_due(false, NOTHING).unwrap().is_none());
        }
        long_ago(&mut session, 50, 500);
        assert!(session.snapshot_if_due(false, NOTHING).unwrap().is_some());
        // What was asked for since is shown at once, and the last in any case.
        session.iterate().unwrap();
        assert!(session.snapshot_if_due(false, NOTHING).unwrap().is_none());
        assert!(session.snapshot_if_due(false, PHOTONS).unwrap().is_some());
        session.iterate().unwrap();
        assert!(session.snapshot_if_due(false, PHOTONS).unwrap().is_none());
        assert!(session.snapshot_if_due(true, PHOTONS).unwrap().is_some());
    }

    #[test]
    fn no_more_is_read_back_than_is_needed() {
        let is_unwanted = Arc::new(AtomicBool::new(false));
        let asked = Arc::clone(&is_unwanted);
        let mut session = session(Interrupt::when(move || asked.load(Ordering::Relaxed)));
        session.iterate().unwrap();
        for needs in [NOTHING, PHOTONS, SPLIT, NODES] {
            assert!(session.owes(needs), "{needs:?}");
            let has = session.snapshot_if_due(true, needs).unwrap().unwrap().has();
            assert_eq!(has, Needs { photons: needs.is_any(), ..needs });
            assert!(!session.owes(needs) && !session.owes(NOTHING), "{needs:?}");
        }
        // An iteration is in the mean of its light once, however often it is looked at.
        let split = |snapshot: Option<Snapshot>| snapshot.unwrap().insides.as_ref().unwrap().split.clone().unwrap();
        let first = split(session.snapshot_if_due(true, SPLIT).unwrap());
        assert_eq!((first.n_iterations, &first), (1, &session.split));
        session.iterate().unwrap();
        assert_eq!(split(session.snapshot_if_due(true, SPLIT).unwrap()).n_iterations, 2);
        // What gathers again can be left.
        session.iterate().unwrap();
        is_unwanted.store(true, Ordering::Relaxed);
        assert!(matches!(session.snapshot_if_due(true, SPLIT), Err(Error::Interrupted)));
        assert!(session.snapshot_if_due(true, PHOTONS).unwrap().is_some());
        assert_eq!(session.split.n_iterations, 2);
    }
}
