//! What the window does when it or the renderer loses its device: in a process of its own, for it needs a display.

use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use eframe::egui;
use egui::ViewportCommand::Close;
use sunfleck::gpu::Context;

use super::super::app::{First, Viewer};
use super::super::engine::{Choice, Engine, Phase};
use super::super::window::{self, Bell, Drawn, FEWEST_FRAMES, Guest};
use super::PATIENCE;
use crate::devices::Device;

/// Ends the test below with its window.
const INSIDE: &str = "view::tests::window::loses_its_device";

/// When a device breaks.
#[derive(Clone, Copy, PartialEq)]
enum When {
    BetweenFrames,
    /// Something is about to be drawn.
    InFrame,
}

/// Breaks the device of each window and looks at what comes after.
struct Vandal {
    when: When,
    /// Devices to break, frames after which it is done.
    breaks: usize,
    after: usize,
    windows: usize,
    frames: usize,
    /// Estimate and iterations when the device was lost.
    before: Option<(u64, u32)>,
    /// The same in the last window, and what all of them told.
    after_all: Option<(u64, u32)>,
    messages: Vec<String>,
    began: Instant,
    context: Option<egui::Context>,
    device: Option<eframe::wgpu::Device>,
}

impl Vandal {
    fn new(when: When, breaks: usize, after: usize) -> Self {
        Self {
            when,
            breaks,
            after,
            windows: 0,
            frames: 0,
            before: None,
            after_all: None,
            messages: vec![],
            began: Instant::now(),
            context: None,
            device: None,
        }
    }
}

impl Guest for Vandal {
    fn add_input(&mut self, _: &Viewer, _: &mut egui::RawInput) {
        let is_time = self.windows <= self.breaks && self.frames >= self.after && self.before.is_some();
        if let Some(device) = self.device.as_ref().filter(|_| is_time && self.when == When::BetweenFrames) {
            device.destroy();
            // A driver's loss is told at once, this one when somebody asks.
            let _ = device.poll(eframe::wgpu::PollType::Poll);
        }
    }

    fn after_frame(&mut self, viewer: &Viewer, ui: &egui::Ui, drawn: &Drawn<'_>) {
        ui.ctx().request_repaint();
        assert!(self.began.elapsed() < PATIENCE, "{:?}", viewer.now.phase);
        let device = drawn.device.expect("drawn by wgpu");
        if self.context.as_ref() != Some(ui.ctx()) {
            (self.context, self.device) = (Some(ui.ctx().clone()), Some(device.clone()));
            (self.windows, self.frames) = (self.windows + 1, 0);
        }
        self.frames += 1;
        for text in viewer.messages.texts() {
            if !self.messages.iter().any(|said| said == text) {
                self.messages.push(text.to_owned());
            }
        }
        let Some(at) = viewer.now.snapshot.as_ref().map(|snapshot| (snapshot.estimate, snapshot.film.n_iterations))
        else {
            return;
        };
        if self.windows <= self.breaks {
            self.before = Some(at);
            if self.when == When::InFrame {
                device.destroy();
            }
        } else if viewer.picture.painted().is_some() && self.before.is_some_and(|(_, n)| at.1 > n) {
            // It shows what was rendered after the loss.
            self.after_all = Some(at);
            ui.ctx().send_viewport_cmd(Close);
        }
    }
}

/// Breaks the renderer's device, and looks on for some frames; or looks on until there is another picture.
struct Onlooker {
    breaks: Option<Arc<Context>>,
    estimate: u64,
    failed_frames: usize,
    began: Instant,
}

impl Guest for Onlooker {
    fn after_frame(&mut self, viewer: &Viewer, ui: &egui::Ui, _: &Drawn<'_>) {
        ui.ctx().request_repaint();
        assert!(self.began.elapsed() < PATIENCE, "{:?}", viewer.now.phase);
        let Some(snapshot) = &viewer.now.snapshot else { return };
        let is_over = match &self.breaks {
            Some(renderer) => {
                renderer.destroy();
                self.failed_frames += usize::from(matches!(viewer.now.phase, Phase::Failed(_)));
                self.failed_frames >= FEWEST_FRAMES
            }
            None => snapshot.estimate > self.estimate,
        };
        self.estimate = self.estimate.max(snapshot.estimate);
        if is_over {
            ui.ctx().send_viewport_cmd(Close);
        }
    }
}

/// Runs the test below under Xvfb.
#[test]
fn a_window_that_loses_its_device_is_opened_again() {
    let is_required = std::env::var_os("SUNFLECK_REQUIRE_GPU").is_some();
    let has_adapter = !sunfleck::gpu::list_devices().is_empty();
    let has_display = Command::new("Xvfb").arg("-help").output().is_ok();
    if !has_adapter || !has_display {
        assert!(!is_required, "SUNFLECK_REQUIRE_GPU is set, but there is no adapter or no Xvfb");
        println!("skipped: no adapter or no Xvfb");
        return;
    }
    let script = r#". "$1"; start_display 1280x720; "$2" "$3" --exact --ignored --nocapture"#;
    let display = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/display.sh");
    let mut command = Command::new("bash");
    command.args(["-euc", script, "bash", display]).arg(std::env::current_exe().unwrap()).arg(INSIDE);
    let output = command.env_remove("RUST_BACKTRACE").output().unwrap();
    let text = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
    assert!(output.status.success() && text.contains("1 passed"), "{text}");
}

#[test]
#[ignore = "the test above runs it, on a display of its own"]
fn loses_its_device() {
    use winit::platform::x11::EventLoopBuilderExtX11;
    let folder = tempfile::tempdir().unwrap();
    let rescued = folder.path().join("rescued.exr");
    let options = || {
        let mut options = window::options();
        options.event_loop_builder = Some(Box::new(|builder| {
            builder.with_any_thread(true);
        }));
        options.persistence_path = Some(folder.path().join("window.ron"));
        options
    };
    let bell = Bell::default();
    let device = crate::devices::open_backend("gpu").unwrap();
    let Device::Gpu { context: renderer, .. } = &device else { unreachable!("asked for a GPU") };
    let renderer = Arc::clone(renderer);
    let engine = Engine::start(device, bell.wake()).unwrap();
    let set = ["size=32x24", "photons=500"].map(str::to_owned).to_vec();
    let choice = Some(Choice { name: "cornell".into(), set });
    let first = First { choice, output: Some(rescued.clone()), ..First::default() };
    let mut viewer = Viewer::new(engine, bell.wake(), first);

    // The renderer's: the window stays, with the picture, and it can be tried again.
    let look_on = |breaks, estimate| Onlooker { breaks, estimate, failed_frames: 0, began: Instant::now() };
    let mut onlooker = look_on(Some(renderer), 0);
    window::run(&mut viewer, &bell, options, &mut onlooker).unwrap();
    assert!(matches!(viewer.now.phase, Phase::Failed(_)) && viewer.picture.painted().is_some());
    // An edit does so, too. What moved by the clock of the window before does not move in the next.
    viewer.edit_at(1e6, "seed", |settings| settings.seed = Some(7));
    viewer.picture.move_on(1e6);
    viewer.remembered.show_convergence = true;
    window::run(&mut viewer, &bell, options, &mut look_on(None, onlooker.estimate)).unwrap();

    // The window's, twice: what was rendered is kept, and grows.
    assert!(viewer.now.snapshot.as_ref().is_some_and(|snapshot| !snapshot.is_preview));
    let mut vandal = Vandal::new(When::BetweenFrames, 2, FEWEST_FRAMES);
    window::run(&mut viewer, &bell, options, &mut vandal).unwrap();
    let ((estimate, before), (same, after)) = (vandal.before.unwrap(), vandal.after_all.unwrap());
    assert_eq!((vandal.windows, estimate), (3, same));
    assert!(after > before, "{before} {after}");
    let told = vandal.messages.iter().filter(|text| text.contains("graphics device")).count();
    assert_eq!(told, 1, "{:?}", vandal.messages);
    assert!(!rescued.exists());

    // A device that breaks at once is not opened for ever: the picture is saved.
    let mut vandal = Vandal::new(When::BetweenFrames, usize::MAX, 1);
    let error = window::run(&mut viewer, &bell, options, &mut vandal).unwrap_err();
    let text = crate::chain(&error);
    assert!(text.contains("graphics device failed") && text.contains("rescued.exr"), "{text}");
    assert_eq!(vandal.windows, 1);
    assert_eq!(sunfleck::output::exr::read(&rescued).unwrap().size, [32, 24]);

    // What draws the window panics: the picture is saved all the same.
    std::fs::remove_file(&rescued).unwrap();
    let error = window::run(&mut viewer, &bell, options, &mut Vandal::new(When::InFrame, usize::MAX, 1)).unwrap_err();
    assert!(crate::chain(&error).contains("rescued.exr"), "{error:#}");
    assert_eq!(sunfleck::output::exr::read(&rescued).unwrap().size, [32, 24]);

    // What is remembered is where eframe was told to keep its own.
    drop(viewer);
    let remembered = std::fs::read_to_string(folder.path().join("remembered.toml")).unwrap();
    assert!(remembered.contains("show_convergence = true"), "{remembered}");
}
