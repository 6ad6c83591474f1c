//! The window under observation: how its frames keep up while a scene renders, and while its camera turns.

use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use eframe::egui;
use egui::{Event, Modifiers, PointerButton, Pos2, vec2};

use super::app::{First, Viewer};
use super::engine::{Choice, Engine, Phase};
use super::window::{self, Bell, Drawn, Guest};
use crate::devices::Device;

/// Of the pointer, points a frame, and how long it moves and then rests, seconds.
const SPEED: f32 = 4.0;
const MOVES: f64 = 0.3;
const RESTS: f64 = 0.9;
/// Frames in which the window takes its size.
const SETTLES: u32 = 10;
/// For the first picture.
const PATIENCE: Duration = Duration::from_secs(600);

/// What is shown, and for how long.
pub struct Plan {
    /// File, or name of a shipped scene.
    pub scene: String,
    /// `key=value`, over its settings.
    pub set: Vec<String>,
    /// Of each part, seconds.
    pub seconds: f64,
    /// Of the window, pixels.
    pub size: [u32; 2],
    /// Pixels a point; the display's if none.
    pub scale: Option<f32>,
    /// Into a texture, where there is no display.
    pub offscreen: bool,
}

/// Frames of one part, in their order.
#[derive(Clone, Debug, Default)]
pub struct Frames {
    /// From one to the next: with all that the interface thread waits for.
    pub intervals: Vec<Duration>,
    /// Of the interface thread, without getting the next image of the display, submitting to its queue, and presenting: where
    /// it waits for the display, and for the device.
    pub work: Vec<Duration>,
    /// Iterations that came to their end meanwhile.
    pub iterations: u32,
}

/// What was found.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// What rendered, and what drew the window.
    pub renderer: String,
    pub window: String,
    /// Of the window as it was opened, pixels.
    pub size: [u32; 2],
    /// The camera rests.
    pub resting: Frames,
    /// It is turned by the pointer, again and again.
    pub turning: Frames,
    /// From an input to the first picture of it.
    pub waits: Vec<Duration>,
}

/// Opens a window, or what stands for one, that asks for frames as fast as the display takes them, and closes it by itself.
pub fn run(device: Device, plan: &Plan) -> Result<Figures> {
    let folder = tempfile::tempdir()?;
    let options = || {
        let mut options = window::options();
        // Nothing of it is remembered.
        options.persistence_path = Some(folder.path().join("window.ron"));
        options
    };
    // The device as it was opened, whatever the scene's file says.
    let searched = [format!("index={}", device.index()), format!("accel={}", device.accelerator())];
    let choice = Choice { name: plan.scene.clone(), set: [&searched, &plan.set[..]].concat() };
    let first = First { choice: Some(choice), ..First::default() };
    let bell = Bell::default();
    let engine = Engine::start(device, bell.wake())?;
    let mut viewer = Viewer::new(engine, bell.wake(), first);
    let mut observer = Observer::new(plan);
    match plan.offscreen {
        true => super::offscreen::run(&mut viewer, &bell, &mut observer, plan.size)?,
        false => window::run(&mut viewer, &bell, options, &mut observer)?,
    }
    if let Some(error) = observer.error {
        bail!("{error}");
    }
    if !matches!(observer.part, Part::Done) {
        bail!("the window was closed before its time");
    }
    observer.figures.waits = viewer.timing.waits().collect();
    Ok(observer.figures)
}

#[derive(Clone, Copy, Debug)]
enum Part {
    Opening,
    Resting,
    Turning,
    Done,
}

struct Observer<'a> {
    plan: &'a Plan,
    n_frames: u32,
    part: Part,
    /// Of the part.
    began: Instant,
    last: Option<Instant>,
    /// Where the pointer is, while it is pressed.
    pressed: Option<Pos2>,
    seen: (u64, u32),
    figures: Figures,
    error: Option<String>,
}

impl<'a> Observer<'a> {
    fn new(plan: &'a Plan) -> Self {
        Self {
            plan,
            n_frames: 0,
            part: Part::Opening,
            began: Instant::now(),
            last: None,
            pressed: None,
            seen: (0, 0),
            figures: Figures::default(),
            error: None,
        }
    }

    fn enter(&mut self, part: Part) {
        (self.part, self.began, self.last) = (part, Instant::now(), None);
    }

    /// Opening has no end of its own.
    fn is_over(&self) -> bool {
        self.began.elapsed().as_secs_f64() >= self.plan.seconds
    }

    /// Size and scale that were asked for: a window is opened by the scale of its display, which nobody knows before.
    fn settle(&mut self, ui: &egui::Ui) {
        let context = ui.ctx();
        let scale = context.pixels_per_point();
        let size = context.viewport_rect().size() * scale;
        self.figures.size = [size.x, size.y].map(|side| side.round() as u32);
        if let Some(scale) = self.plan.scale {
            context.set_pixels_per_point(scale);
        }
        if self.figures.size != self.plan.size {
            let points = self.plan.size.map(|side| side as f32 / scale);
            context.send_viewport_cmd(egui::ViewportCommand::InnerSize(points.into()));
        }
    }

    /// Adds a frame, which follows one that took `work`.
    fn note(&mut self, viewer: &Viewer, work: Option<f32>) {
        let frames = match self.part {
            Part::Resting => &mut self.figures.resting,
            Part::Turning => &mut self.figures.turning,
            Part::Opening | Part::Done => return,
        };
        let now = Instant::now();
        if let Some(last) = self.last.replace(now) {
            frames.intervals.push(now - last);
            frames.work.extend(work.and_then(|seconds| Duration::try_from_secs_f32(seconds).ok()));
        }
        if let Some(snapshot) = &viewer.now.snapshot {
            let (estimate, n) = (snapshot.estimate, snapshot.film.n_iterations);
            frames.iterations += if estimate == self.seen.0 { n.saturating_sub(self.seen.1) } else { n };
            self.seen = (estimate, n);
        }
    }
}

impl Guest for Observer<'_> {
    fn add_input(&mut self, viewer: &Viewer, input: &mut egui::RawInput) {
        let Some(area) = viewer.picture.area.filter(|_| matches!(self.part, Part::Turning | Part::Done)) else {
            return;
        };
        let time = self.began.elapsed().as_secs_f64() % (MOVES + RESTS);
        let button = |pos, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        match self.pressed {
            Some(pos) if time >= MOVES || matches!(self.part, Part::Done) => {
                input.events.push(button(pos, false));
                self.pressed = None;
            }
            Some(pos) => {
                let pos = pos + vec2(SPEED, 0.0);
                input.events.push(Event::PointerMoved(pos));
                self.pressed = Some(pos);
            }
            None if time < MOVES => {
                let pos = area.center() - vec2(0.2 * area.width(), 0.0);
                input.events.extend([Event::PointerMoved(pos), button(pos, true)]);
                self.pressed = Some(pos);
            }
            None => {}
        }
    }

    fn after_frame(&mut self, viewer: &Viewer, ui: &egui::Ui, drawn: &Drawn<'_>) {
        self.note(viewer, drawn.work);
        self.n_frames += 1;
        if self.n_frames <= SETTLES {
            self.settle(ui);
        }
        match (&viewer.now.phase, self.part) {
            (Phase::Failed(error), _) => self.error = Some(error.clone()),
            (_, Part::Opening) if viewer.now.painted.is_some() && self.n_frames > SETTLES => {
                self.figures.renderer.clone_from(&viewer.now.device);
                if let Some(device) = drawn.device {
                    self.figures.window = device.adapter_info().name;
                }
                self.enter(Part::Resting);
            }
            (_, Part::Opening) if self.began.elapsed() > PATIENCE => self.error = Some("no picture appears".into()),
            (_, Part::Resting) if self.is_over() => self.enter(Part::Turning),
            (_, Part::Turning) if self.is_over() => self.enter(Part::Done),
            _ => {}
        }
        if self.error.is_some() || matches!(self.part, Part::Done) {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
        ui.ctx().request_repaint();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_and_waits_are_counted_without_a_display() {
        if sunfleck::gpu::list_devices().is_empty() {
            assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none(), "SUNFLECK_REQUIRE_GPU is set, but no adapter");
            return;
        }
        let set = ["size=32x24", "photons=500"].map(str::to_owned).to_vec();
        let plan = |scene: &str| Plan {
            scene: scene.into(),
            set: set.clone(),
            seconds: 1.0,
            size: [1500, 900],
            scale: Some(1.25),
            offscreen: true,
        };
        let device = || Device::Cpu(sunfleck::scene::Accelerator::Bvh);
        let figures = run(device(), &plan("cornell")).unwrap();
        assert!(figures.renderer.starts_with("CPU") && !figures.window.is_empty(), "{figures:?}");
        assert_eq!(figures.size, [1500, 900]);
        for Frames { intervals, work, iterations } in [&figures.resting, &figures.turning] {
            assert!(!intervals.is_empty() && *iterations > 0, "{intervals:?}, {iterations}");
            // The work of a frame lies in the time to the next, but for what the first did before the clock began.
            assert_eq!(work.len(), intervals.len());
            let sum = |times: &[Duration]| times.iter().sum::<Duration>();
            assert!(sum(&work[1..]) <= sum(intervals), "{work:?} in {intervals:?}");
            // They fill the part, but for the way to its first frame.
            assert!(sum(intervals) > Duration::from_millis(500), "{intervals:?}");
        }
        assert!(!figures.waits.is_empty());
        let error = run(device(), &plan("nowhere.glb")).unwrap_err().to_string();
        assert!(error.contains("nowhere.glb"), "{error}");
    }
}
