//! The window, driven without a display; the engine behind it is the real one, on the processor.

mod camera;
mod compare;
mod dialogs;
mod fields;
mod files;
mod focus;
mod habits;
mod panels;
mod shortcuts;
mod snapshots;
#[cfg(target_os = "linux")]
mod window;

use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use eframe::egui;
use egui::{Event, Key, Modifiers, ViewportCommand};
use egui_kittest::{Harness, TestRenderer};
use sunfleck::layout::Camera;
use tempfile::TempDir;

use super::app::{First, Viewer};
use super::dialog::{Answer, Purpose, Request};
use super::engine::{Choice, Engine, Limits, Phase};
use crate::devices::Device;

/// For anything that is waited for.
const PATIENCE: Duration = Duration::from_secs(60);
/// After which the engine pauses.
const ITERATIONS: u32 = 3;

/// Where no pixels are looked at.
struct NoPixels;

impl TestRenderer for NoPixels {
    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        delta.set.clear();
        delta.free.clear();
    }

    fn render(&mut self, _: &egui::Context, _: &egui::FullOutput) -> Result<image::RgbaImage, String> {
        Err("nothing is drawn".into())
    }
}

/// A window, what it asked the system for, and a folder for its files.
struct Window {
    harness: Harness<'static, Viewer>,
    commands: Vec<ViewportCommand>,
    copied: Vec<String>,
    /// Dialogs that were opened.
    asked: Arc<Mutex<Vec<Purpose>>>,
    folder: TempDir,
}

fn engine() -> Engine {
    Engine::start(Device::Cpu(sunfleck::scene::Accelerator::Bvh), Arc::new(|| {})).unwrap()
}

impl Window {
    fn new(scene: Option<&str>) -> Self {
        Self::with_renderer(scene, NoPixels)
    }

    fn with_renderer(scene: Option<&str>, renderer: impl TestRenderer + 'static) -> Self {
        Self::with_limits(scene, Limits { iterations: Some(ITERATIONS), ..Limits::default() }, renderer)
    }

    /// Limits as flags give them.
    fn with_limits(scene: Option<&str>, limits: Limits, renderer: impl TestRenderer + 'static) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let set = ["size=32x24", "photons=500"].map(str::to_owned).to_vec();
        let first =
            First { choice: scene.map(|name| Choice { name: name.to_owned(), set }), limits, ..First::default() };
        let mut viewer = Viewer::new(engine(), Arc::new(|| {}), first);
        // However slow the machine.
        viewer.preview_from = f64::INFINITY;
        let asked = Arc::new(Mutex::new(vec![]));
        let (noted, place) = (Arc::clone(&asked), folder.path().to_owned());
        viewer.pick = Arc::new(move |request: &Request| {
            noted.lock().unwrap().push(request.purpose);
            Answer::File(place.join(file_of(request.purpose)))
        });
        let harness = Harness::builder()
            .with_size([1280.0, 720.0])
            .with_step_dt(1.0 / 60.0)
            .with_theme(egui::Theme::Dark)
            .allow_missing_glyphs()
            .with_accessibility_check(false)
            .renderer(renderer)
            .build_ui_state(|ui, viewer: &mut Viewer| viewer.show(ui, None), viewer);
        Self { harness, commands: vec![], copied: vec![], asked, folder }
    }

    /// With a scene, and a picture that is finished.
    fn with_picture() -> Self {
        let mut window = Self::new(Some("cornell"));
        window.wait_for_picture();
        window
    }

    /// Of where the camera is: one of before may be finished while the render thread has not seen what was done.
    fn wait_for_picture(&mut self) {
        self.wait("finished picture", |viewer| {
            let stands = |camera: &Camera| (camera.position, camera.forward, camera.up);
            let camera = viewer.camera().map(|camera| camera.pack(1, 1));
            let n =
                |snapshot: &super::engine::Snapshot| !snapshot.is_preview && snapshot.film.n_iterations == ITERATIONS;
            viewer.now.phase == Phase::Reached
                && !viewer.wanted.moving
                && viewer.picture.painted().is_some_and(|painted| {
                    let snapshot = &painted.snapshot;
                    n(snapshot)
                        && snapshot.estimate == viewer.now.estimate
                        && camera.as_ref().is_none_or(|camera| stands(camera) == stands(&snapshot.camera))
                        && Arc::ptr_eq(&snapshot.opened, viewer.opened().unwrap())
                })
        });
    }

    fn viewer(&mut self) -> &mut Viewer {
        self.harness.state_mut()
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// A frame for each event that waits, or one.
    fn step(&mut self) {
        self.harness.step();
        let output = self.harness.output();
        self.commands.extend(output.viewport_output.values().flat_map(|viewport| viewport.commands.clone()));
        self.copied.extend(output.platform_output.commands.iter().filter_map(|command| match command {
            egui::OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        }));
    }

    fn steps(&mut self, n: usize) {
        (0..n).for_each(|_| self.step());
    }

    fn wait(&mut self, what: &str, until: impl Fn(&Viewer) -> bool) {
        let began = Instant::now();
        while !until(self.harness.state()) {
            assert!(began.elapsed() < PATIENCE, "no {what}: {:?}", self.harness.state().now.phase);
            std::thread::sleep(Duration::from_millis(1));
            self.step();
        }
    }

    /// Down for a frame, then up.
    fn press(&mut self, modifiers: Modifiers, key: Key) {
        let modifiers = if modifiers.command { modifiers | Modifiers::CTRL } else { modifiers };
        let event = |pressed| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        self.harness.input_mut().events.push(Event::ModifiersChanged(modifiers));
        self.step();
        for pressed in [true, false] {
            self.harness.input_mut().events.push(event(pressed));
            self.step();
        }
        self.harness.input_mut().events.push(Event::ModifiersChanged(Modifiers::NONE));
        self.step();
    }

    /// Whether there is a widget with this text in its name.
    fn shows(&self, text: &str) -> bool {
        use egui_kittest::kittest::Queryable;
        self.harness.query_all_by_label_contains(text).next().is_some()
    }

    /// Clicks on the one widget of this name.
    fn click(&mut self, label: &str) {
        use egui_kittest::kittest::Queryable;
        self.harness.get_by_label(label).click();
        self.steps(3);
    }

    /// The same without the mouse: for what may be scrolled out of sight.
    fn activate(&mut self, label: &str) {
        use egui_kittest::kittest::Queryable;
        self.harness.get_by_label(label).click_accesskit();
        self.steps(3);
    }

    /// Drops a file on the window.
    fn drop_file(&mut self, path: PathBuf) {
        self.drop_files([path]);
    }

    /// All at once.
    fn drop_files(&mut self, paths: impl IntoIterator<Item = PathBuf>) {
        for path in paths {
            self.harness.input_mut().dropped_files.push(Arc::new(Dropped(path)));
        }
        self.steps(2);
    }
}

fn file_of(purpose: Purpose) -> &'static str {
    match purpose {
        Purpose::Open => "scene.toml",
        Purpose::SavePicture => "picture.exr",
        Purpose::SaveSettings => "settings.toml",
        Purpose::Reference => "reference.exr",
        Purpose::Environment => "sky.hdr",
    }
}

#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        std::fs::read(&self.0).map_err(|error| error.to_string())
    }
}

impl Window {
    fn wait_for_message(&mut self, text: &str) {
        let began = Instant::now();
        while !self.shows(text) {
            assert!(began.elapsed() < PATIENCE, "no message {text:?}");
            std::thread::sleep(Duration::from_millis(1));
            self.step();
        }
    }
}
