//! The window: its state, and what is where in it.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Result, bail};
use eframe::egui;
use egui::Color32;
use sunfleck::output::display::Look;
use sunfleck::scene::Camera;
use sunfleck::scene::settings::{MAX_EXPOSURE, Settings};

use super::dialog::{self, Dialog};
use super::engine::{
    Choice, Engine, Limits, Message, Now, Opened, Phase, Save, Wake, Wanted, is_asked_anew, is_other_scene, is_same,
};
use super::files;
use super::messages::Messages;
use super::picture::PictureView;
use super::remembered::{Memory, Remembered};
use super::state::{Edits, LimitsOfScenes};
use crate::cli::{Usage, ViewArgs};
use crate::scenes::Source;

/// Key of what is remembered, where it was in eframe's file.
const REMEMBERED: &str = "remembered";
/// Seconds an iteration takes, from which on whatever changes the picture shows a preview first: a whole one would be waited for.
const PREVIEW_FROM: f64 = 0.25;
/// Width of a window with panels on either side of the picture, points.
const LEAST_FOR_BOTH: f32 = 720.0;
/// Width of the picture between them, points.
const LEAST_PICTURE: f32 = 160.0;

/// What the command line asks for.
#[derive(Clone, Debug, Default)]
pub struct First {
    pub choice: Option<Choice>,
    /// `key=value`, over the settings of every scene.
    pub always: Vec<String>,
    pub limits: Limits,
    /// Where saving goes without asking.
    pub output: Option<PathBuf>,
    /// To compare with.
    pub reference: Option<PathBuf>,
}

impl First {
    pub fn resolve(args: &ViewArgs) -> Result<Self> {
        if let Some(path) = &args.output {
            crate::job::check_output(path)?;
        }
        let set = args.pairs()?;
        let always = args.device.pairs();
        let choice = match &args.scene {
            Some(name) => Some(Choice { name: name.clone(), set: [set, always.clone()].concat() }),
            None if set.is_empty() => None,
            None => bail!(Usage(format!("{}: of which scene? sunfleck view SCENE", set[0]))),
        };
        // What is typed wrong is said where it was typed.
        if let Some(choice) = &choice {
            let mut source = Source::resolve(&choice.name)?;
            source.set(&choice.set)?;
            args.output.iter().try_for_each(|path| source.check_not_read(&source.settings, path))?;
        }
        let limits = Limits { iterations: args.iterations, seconds: args.seconds, noise: args.noise };
        Ok(Self { choice, always, limits, output: args.output.clone(), reference: args.reference.clone() })
    }
}

/// Text that egui draws too faintly, with a contrast of 4.5 and more to the panel (WCAG 2.2, 1.4.3).
fn make_legible(ctx: &egui::Context) {
    for (theme, weak, warning) in [
        (egui::Theme::Dark, Color32::from_gray(140), None),
        (egui::Theme::Light, Color32::from_gray(100), Some(Color32::from_rgb(170, 80, 0))),
    ] {
        if ctx.style_of(theme).visuals.weak_text_color.is_none() {
            ctx.style_mut_of(theme, |style| {
                style.visuals.weak_text_color = Some(weak);
                style.visuals.warn_fg_color = warning.unwrap_or(style.visuals.warn_fg_color);
            });
        }
    }
}

/// Where the picture of a scene goes without asking.
#[derive(Debug)]
pub struct Place {
    /// The first that is opened, if none.
    pub scene: Option<Arc<Choice>>,
    /// Its file, without links, if it has been opened.
    pub file: Option<PathBuf>,
    pub path: PathBuf,
}

/// See [`Viewer::last_save`].
pub type LastSave = Arc<Mutex<Option<Save>>>;

/// See the module. Panels read and change it.
pub struct Viewer {
    engine: Engine,
    /// What is wanted; sent to the engine after every frame.
    pub wanted: Wanted,
    /// What there is; taken from the engine before every frame.
    pub now: Now,
    pub edits: Edits,
    pub remembered: Remembered,
    /// Where that is kept.
    memory: Option<Memory>,
    /// Whether it has been in a window.
    entered: bool,
    pub picture: PictureView,
    pub compare: super::compare::CompareView,
    /// Index into the scene's materials.
    pub selected: Option<usize>,
    /// Whether something was open, when this frame began, that a click beside it closes.
    pub had_popup: bool,
    pub saved_as: Vec<Place>,
    last_save: LastSave,
    pub convergence: super::convergence::Convergence,
    pub timing: super::timing::Timing,
    /// Of the last estimate that was no preview; one that takes this long or longer is preceded by a preview.
    iteration_seconds: f64,
    pub preview_from: f64,
    /// What was open before, and how it was edited.
    pub previous: Option<(Arc<Choice>, Edits)>,
    /// The edits of the scene that is opened again.
    returning: Option<Edits>,
    /// Of [`First`].
    always: Vec<String>,
    limits: LimitsOfScenes,
    /// Of a texture, pixels.
    most_side: usize,
    /// Of the window.
    title: String,
    pub messages: Messages,
    pub show_help: bool,
    pub keyboard: super::keys::Keyboard,
    pub dialog: Option<Dialog>,
    /// What dialogs were answered with last.
    pub picked: HashMap<dialog::Purpose, PathBuf>,
    pub screenshots: files::Screenshots,
    pub sky: Option<files::Sky>,
    /// To be read.
    reference: Option<PathBuf>,
    pub pick: dialog::Pick,
    pub start: super::start::Page,
    wake: Wake,
    /// The scene that `edits` belongs to.
    editing: Option<Arc<Opened>>,
}

impl Viewer {
    pub fn new(engine: Engine, wake: Wake, first: First) -> Self {
        let now = engine.now();
        let scene = first.choice.map(Arc::new);
        let limits_at_first = Some(first.limits);
        let wanted = Wanted { scene, limits: first.limits, limits_at_first, ..Wanted::default() };
        let saved_as = first.output.map(|path| Place { scene: wanted.scene.clone(), file: None, path });
        let saved_as = saved_as.into_iter().collect();
        Self {
            engine,
            wanted,
            now,
            edits: Edits::default(),
            remembered: Remembered::default(),
            memory: None,
            entered: false,
            picture: PictureView::default(),
            compare: Default::default(),
            saved_as,
            last_save: LastSave::default(),
            convergence: Default::default(),
            timing: Default::default(),
            iteration_seconds: 0.0,
            preview_from: PREVIEW_FROM,
            previous: None,
            returning: None,
            always: first.always,
            limits: LimitsOfScenes::new(first.limits),
            most_side: 0,
            title: String::new(),
            messages: Messages::default(),
            show_help: false,
            keyboard: Default::default(),
            dialog: None,
            picked: HashMap::new(),
            screenshots: Default::default(),
            sky: None,
            reference: first.reference,
            pick: dialog::system(rfd::FileDialog::new()),
            selected: None,
            had_popup: false,
            start: Default::default(),
            wake,
            editing: None,
        }
    }

    /// Comes into a window: the first one, or another after that was lost, which has none of the textures and a clock of
    /// its own. What is remembered is kept at `place`.
    pub fn enter(&mut self, storage: Option<&dyn eframe::Storage>, place: Option<PathBuf>) {
        if !std::mem::replace(&mut self.entered, true) {
            let old = || storage.and_then(|storage| eframe::get_value(storage, REMEMBERED));
            if let Some(place) = place {
                let (remembered, memory) = Memory::open(place, old, self.engine.speaker());
                (self.remembered, self.memory) = (remembered, Some(memory));
            }
            return;
        }
        self.picture.forget();
        self.picture.rest();
        self.edits.end_step();
        self.compare.forget();
        (self.start, self.timing, self.title) = (Default::default(), Default::default(), String::new());
        // It sees no key let go that is held now.
        self.keyboard = Default::default();
        self.messages.repeat();
    }

    /// Opens a file, or a shipped scene by its name.
    pub fn open(&mut self, name: impl Into<String>) {
        self.open_with(name, vec![]);
    }

    /// The same, with `key=value` over its settings.
    pub fn open_with(&mut self, name: impl Into<String>, set: Vec<String>) {
        if self.editing.is_some() {
            self.previous = self.wanted.scene.clone().map(|scene| (scene, self.edits.clone()));
        }
        self.want(Some(Arc::new(Choice { name: name.into(), set: [set, self.always.clone()].concat() })));
    }

    /// Opens what was open before, as it was edited.
    pub fn back(&mut self) {
        let Some((scene, edits)) = self.previous.take() else { return };
        self.want(Some(scene));
        self.wanted.settings = Some(Arc::clone(edits.now()));
        self.returning = Some(edits);
    }

    /// A scene as its file has it.
    fn want(&mut self, scene: Option<Arc<Choice>>) {
        self.wanted.scene = scene;
        (self.wanted.settings, self.wanted.reads_again, self.returning) = (None, false, None);
        self.wanted.limits_at_first = Some(self.limits.flags());
        self.wanted.reloads += 1;
    }

    /// Does again what failed.
    pub fn retry(&mut self) {
        self.wanted.retries += 1;
    }

    pub fn close_scene(&mut self) {
        (self.wanted.scene, self.wanted.settings) = (None, None);
    }

    /// Reads the scene's file again; what was changed stays changed.
    pub fn reload(&mut self) {
        self.wanted.reads_again = true;
        self.wanted.reloads += 1;
    }

    pub fn restart(&mut self) {
        self.wanted.restarts += 1;
    }

    /// Changes the settings; `what` names what is edited, for undo.
    pub fn edit(&mut self, ui: &egui::Ui, what: &'static str, change: impl FnOnce(&mut Settings)) {
        self.edit_at(ui.input(|i| i.time), what, change);
    }

    /// Changes something at `time`, seconds: previews until it rests, if it changes what is rendered.
    pub fn preview_of(&mut self, time: f64, change: impl FnOnce(&mut Self)) {
        let before = self.wanted.clone();
        change(self);
        if self.editing.as_ref().is_some_and(|opened| is_asked_anew(opened, &before, &self.wanted)) {
            self.picture.move_on(time);
        }
    }

    /// The same at a time in seconds.
    pub fn edit_at(&mut self, time: f64, what: &'static str, change: impl FnOnce(&mut Settings)) {
        if self.editing.is_none() {
            return;
        }
        let mut settings = self.edits.now().as_ref().clone();
        change(&mut settings);
        self.edits.set(what, time, settings);
        self.wanted.settings = Some(Arc::clone(self.edits.now()));
    }

    /// A change that is a step of its own, whatever is edited before and after.
    pub fn edit_apart(&mut self, ui: &egui::Ui, what: &'static str, change: impl FnOnce(&mut Settings)) {
        self.edits.end_step();
        self.edit_at(ui.input(|i| i.time), what, change);
        self.edits.end_step();
    }

    pub fn undo(&mut self) {
        self.change_edits(Edits::undo);
    }

    pub fn redo(&mut self) {
        self.change_edits(Edits::redo);
    }

    /// Not while a scene is being read: the settings are those of no other.
    fn change_edits(&mut self, change: impl FnOnce(&mut Edits)) {
        if self.editing.is_some() {
            change(&mut self.edits);
            self.wanted.settings = Some(Arc::clone(self.edits.now()));
        }
    }

    /// Brightens the picture by so many stops.
    pub fn expose(&mut self, ui: &egui::Ui, stops: f32) {
        let now = self.look().exposure.or(self.now.painted.as_ref().map(|painted| painted.exposure));
        self.edit(ui, "exposure", |s| {
            s.exposure = Some((now.unwrap_or(0.0) + stops).clamp(-MAX_EXPOSURE, MAX_EXPOSURE))
        });
    }

    /// How the picture is shown.
    pub fn look(&self) -> Look {
        Look::of(self.edits.now())
    }

    /// In a narrow window it gives way to the settings, so that the picture does not.
    pub fn shows_inspect(&self, width: f32) -> bool {
        self.remembered.show_inspect && (!self.remembered.show_settings || width >= LEAST_FOR_BOTH)
    }

    /// In a window of this width, points. Where there is room for one panel, it takes that of the settings.
    pub fn toggle_inspect(&mut self, width: f32) {
        self.remembered.show_inspect = !self.shows_inspect(width);
        self.remembered.show_settings &= !self.remembered.show_inspect || width >= LEAST_FOR_BOTH;
    }

    /// One iteration, then a pause.
    pub fn step(&mut self) {
        self.wanted.paused = true;
        self.wanted.steps += 1;
    }

    /// Moves the camera until the whole scene is in the picture; in a closed room, to where it stood in the beginning.
    pub fn frame_all(&mut self, time: f64) {
        let Some(opened) = self.editing.clone() else { return };
        if opened.is_closed {
            let camera = opened.source.settings.camera.clone();
            self.preview_of(time, |viewer| viewer.edit_at(time, "camera", |s| s.camera = camera));
            return;
        }
        let Some([width, height]) = self.full_size() else { return };
        self.move_rig(time, &mut |rig| rig.frame_all(opened.bounds, width as f32 / height as f32));
    }

    /// The settings as `file` is to hold them.
    pub fn settings_text(&self, file: &Path) -> Option<String> {
        Some(self.editing.as_ref()?.source.rooted(self.edits.now(), file).to_toml())
    }

    /// What renders this picture on the command line.
    pub fn command(&self) -> Option<String> {
        let opened = self.editing.as_ref()?;
        let iterations = self.now.snapshot.as_ref().map_or(1, |snapshot| snapshot.film.n_iterations);
        let flags = self.engine.device_flags();
        // It may be pasted anywhere. A shipped scene has no place.
        let Source { name, canonical, folder, .. } = &opened.source;
        let absolute = |path: &str| crate::scenes::absolute(Path::new(path)).ok();
        let there = canonical.as_ref().and_then(|_| absolute(name));
        let scene = there.as_ref().unwrap_or(name);
        let mut settings = self.edits.now().as_ref().clone();
        // Beside a settings file it is named from there, which the command names from the root.
        if folder.as_os_str().is_empty()
            && settings.environment != opened.read().environment
            && let Some(file) = settings.environment.as_mut().and_then(|environment| environment.file.as_mut())
        {
            *file = absolute(file).unwrap_or_else(|| file.clone());
        }
        Some(opened.command(scene, &settings, flags, iterations, Path::new("picture.exr")))
    }

    /// What is open.
    pub fn opened(&self) -> Option<&Arc<Opened>> {
        self.editing.as_ref()
    }

    /// The camera that the settings make.
    pub fn camera(&self) -> Option<Camera> {
        self.edits.now().camera_of(&self.editing.as_ref()?.loaded.scene.cameras).ok()
    }

    /// Writes the picture to `path`, as it looks now.
    pub fn save_to(&mut self, path: PathBuf) {
        self.engine.save(self.saving_to(path));
    }

    /// The picture as it looks now, to be written to `path`.
    pub fn saving_to(&self, path: PathBuf) -> Save {
        Save { path, settings: Arc::clone(self.edits.now()), scene: self.wanted.scene.clone() }
    }

    /// How the picture would be saved now; with an empty path if nobody has said where. Kept right at every frame.
    pub fn last_save(&self) -> LastSave {
        Arc::clone(&self.last_save)
    }

    /// Where saving goes without asking.
    pub fn place(&self) -> Option<&PathBuf> {
        self.saved_as.iter().find(|place| place.scene == self.wanted.scene).map(|place| &place.path)
    }

    /// Where the picture of the scene goes from now on, as long as the program runs.
    pub fn set_place(&mut self, path: PathBuf) {
        let scene = self.wanted.scene.clone();
        let file = self.editing.as_ref().and_then(|opened| opened.source.canonical.clone());
        self.saved_as.retain(|place| place.scene != scene);
        self.saved_as.push(Place { scene, file, path });
    }

    /// Shows a message.
    pub fn say(&mut self, ui: &egui::Ui, message: Message) {
        self.messages.say(ui.input(|i| i.time), message);
    }

    /// The same in the next window.
    pub fn tell(&mut self, message: Message) {
        self.messages.say(0.0, message);
    }

    /// Asks for another frame, from any thread.
    pub fn wake(&self) -> Wake {
        Arc::clone(&self.wake)
    }

    pub fn engine(&self) -> &Engine {
        &self.engine
    }

    /// One frame. `last` is what the one before took the interface thread, seconds.
    pub fn show(&mut self, ui: &mut egui::Ui, last: Option<f32>) {
        if let Some(took) = last.and_then(|seconds| Duration::try_from_secs_f32(seconds).ok()) {
            self.timing.frame(took);
        }
        let began = Instant::now();
        make_legible(ui.ctx());
        self.look_at_engine(ui);
        ui.input(|i| self.start.drag.update(i));
        let wanted = self.wanted.clone();
        self.had_popup = egui::Popup::is_any_open(ui.ctx());
        // What is done with a button held is one step, however long it rests.
        ui.input(|i| self.edits.pointer(i.time, i.pointer.any_pressed(), i.pointer.any_down()));
        files::poll(ui, self);
        if let Some(path) = self.reference.take() {
            super::compare::load(self, &path);
        }
        self.look_at_reference(ui);
        super::keys::handle(ui, self);
        egui::Panel::top("bar").show(ui, |ui| super::bar::show(ui, self));
        egui::Panel::bottom("status").show(ui, |ui| super::bar::status(ui, self));
        if self.editing.is_some() {
            let width = ui.content_rect().width();
            // Of a panel, so that the picture keeps some room between two.
            let n_beside = f32::from(self.remembered.show_settings) + f32::from(self.shows_inspect(width));
            let most = ((width - LEAST_PICTURE) / n_beside.max(1.0)).clamp(200.0, 500.0);
            if self.remembered.show_convergence {
                let panel =
                    egui::Panel::bottom("convergence").resizable(true).default_size(220.0).size_range(120.0..=600.0);
                panel.show(ui, |ui| super::convergence::show(ui, self));
            }
            if self.remembered.show_settings {
                let panel = egui::Panel::left("settings").resizable(true).default_size(270.0).size_range(200.0..=most);
                panel.show(ui, |ui| super::settings::show(ui, self));
            }
            if self.shows_inspect(width) {
                let panel = egui::Panel::right("inspect").resizable(true).default_size(264.0).size_range(180.0..=most);
                panel.show(ui, |ui| super::inspect::show(ui, self));
            }
        }
        egui::CentralPanel::default().frame(egui::Frame::NONE).show(ui, |ui| match self.wanted.scene {
            Some(_) => super::picture::show(ui, self),
            None => super::start::show(ui, self),
        });
        if self.wanted.scene.is_some() {
            super::start::drop_hint(ui, self);
        }
        super::help::show(ui, self);
        self.messages.show(ui);
        super::focus::mark(ui.ctx());
        self.wanted.painting.look = self.look();
        let asks_anew = self.editing.as_ref().is_some_and(|opened| is_asked_anew(opened, &wanted, &self.wanted));
        let (time, is_dragging) = ui.input(|i| (i.time, i.pointer.is_decidedly_dragging()));
        let is_slow = self.iteration_seconds >= self.preview_from;
        if asks_anew && wanted.restarts == self.wanted.restarts && (is_dragging || is_slow) {
            // Soon, and again to see that it rests.
            self.picture.move_on(time);
            self.wanted.moving = true;
            ui.ctx().request_repaint_after_secs(0.03);
        }
        if self.wanted.scene.is_none() {
            self.timing.give_up();
        } else if is_other_scene(&wanted, &self.wanted) || asks_anew {
            self.timing.ask(began, self.now.estimate);
        }
        self.engine.want(&self.wanted);
        if let Some(memory) = &mut self.memory {
            memory.keep(&self.remembered);
        }
        let last = self.saving_to(self.place().cloned().unwrap_or_default());
        *self.last_save.lock().unwrap_or_else(PoisonError::into_inner) = Some(last);
    }

    fn look_at_engine(&mut self, ui: &egui::Ui) {
        self.now = self.engine.now();
        if self.now.opened.as_ref().is_some_and(|opened| Some(&opened.choice) != self.wanted.scene.as_ref()) {
            // Left of a scene that is not wanted any more, until a stage of it comes to its end.
            (self.now.opened, self.now.snapshot, self.now.painted) = (None, None, None);
            self.now.phase = if self.wanted.scene.is_some() { Phase::Loading } else { Phase::Empty };
        }
        if let Some(snapshot) = self.now.snapshot.as_ref().filter(|snapshot| !snapshot.is_preview) {
            self.iteration_seconds = snapshot.seconds / f64::from(snapshot.film.n_iterations.max(1));
        }
        if let Some(painted) = &self.now.painted {
            self.timing.see(Instant::now(), painted.snapshot.estimate);
        }
        let most_side = ui.input(|i| i.max_texture_side);
        if self.most_side != most_side {
            self.most_side = most_side;
            self.engine.set_most_side(most_side);
        }
        let time = ui.input(|i| i.time);
        self.engine.take_messages().into_iter().for_each(|message| self.messages.say(time, message));
        if !is_same(self.editing.as_ref(), self.now.opened.as_ref()) {
            let before = std::mem::replace(&mut self.editing, self.now.opened.clone());
            let selected = self.selected.take().zip(before.clone());
            self.picture.forget();
            self.compare.forget();
            if let Some(opened) = self.editing.clone() {
                if let Some(path) = &opened.source.canonical {
                    self.remembered.opened(path);
                }
                let settings = &opened.source.settings;
                match before.filter(|before| self.wanted.reads_again && before.choice == opened.choice) {
                    Some(before) => {
                        self.selected = selected.and_then(|(i, before)| opened.material_as(&before, i));
                        let limits = |settings: &Settings| (settings.iterations, settings.seconds);
                        if limits(&before.source.settings) != limits(settings) {
                            self.wanted.limits = self.limits.of_next(self.wanted.limits, settings);
                        }
                        self.edits.map(|edited| edited.rebased(&before.source.settings, settings));
                        self.wanted.settings = self.wanted.settings.take().map(|_| Arc::clone(self.edits.now()));
                    }
                    None => {
                        self.wanted.limits = self.limits.of_next(self.wanted.limits, settings);
                        self.wanted.limits_at_first = None;
                        let returning = self.returning.take();
                        self.wanted.settings = returning.as_ref().map(|edits| Arc::clone(edits.now()));
                        self.edits = returning.unwrap_or_else(|| Edits::new(settings.clone()));
                        self.picture = PictureView::default();
                    }
                }
                // It may have been saved under another path to the same file, or with other settings.
                let file = &opened.source.canonical;
                let is_it = |place: &&mut Place| match &place.scene {
                    Some(scene) => scene.name == opened.choice.name || file.is_some() && place.file == *file,
                    None => true,
                };
                if let Some(place) = self.saved_as.iter_mut().find(is_it) {
                    (place.scene, place.file) = (Some(Arc::clone(&opened.choice)), file.clone());
                }
            }
        }
        let title = match &self.wanted.scene {
            Some(choice) => {
                let n = self.now.snapshot.as_ref().map_or(0, |snapshot| snapshot.film.n_iterations);
                format!("{} – {} – Sunfleck", choice.name, crate::progress::iterations(n))
            }
            None => "Sunfleck".to_owned(),
        };
        // Under X11 the window cannot be asked for its title, and each of these makes another frame.
        if self.title != title {
            self.title.clone_from(&title);
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
        let dropped: Vec<_> = ui.input(|i| i.raw.dropped_files.iter().map(|file| file.path().to_path_buf()).collect());
        files::dropped(ui, self, &dropped);
    }
}
