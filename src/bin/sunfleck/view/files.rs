//! Files: dialogs, dropped files, the clipboard.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;

use eframe::egui;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use sunfleck::scene::settings::EnvironmentSettings;

use super::app::Viewer;
use super::engine::{Choice, Message, Opened, catch, is_same};
use crate::cli::Usage;

/// What a dialog was for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    Open,
    SavePicture,
    SaveSettings,
    Reference,
    Environment,
}

/// What came of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    File(PathBuf),
    Cancelled,
    /// The system has no dialogs: neither a desktop portal nor zenity.
    NoDialog,
}

/// Asks for a file.
pub type Pick = Arc<dyn Fn(Purpose, &str) -> Answer + Send + Sync>;

/// A dialog under way, on a thread of its own.
pub struct Dialog {
    purpose: Purpose,
    /// For a file that is saved, its extension left out.
    name: String,
    /// The scene that it was asked for.
    scene: Option<Arc<Choice>>,
    answer: mpsc::Receiver<Answer>,
}

/// An environment that is being read, for the scene that is open.
pub struct Sky {
    opened: Arc<Opened>,
    /// As the settings name it.
    file: String,
    done: mpsc::Receiver<Result<(), String>>,
}

const SCENES: &[&str] = &["glb", "gltf", "obj", "toml"];

/// The system's dialog, for a file that is best called `name`; waits for the answer.
pub fn pick(purpose: Purpose, name: &str) -> Answer {
    // Fails if there is a logger, which is then this one.
    if log::set_logger(&DIALOG_FAULTS).is_ok() {
        log::set_max_level(log::LevelFilter::Error);
    }
    DIALOG_FAULTS.0.store(false, Ordering::Relaxed);
    let dialog = rfd::FileDialog::new();
    let path = match purpose {
        Purpose::Open => dialog.set_title("Open a scene").add_filter("Scenes and settings", SCENES).pick_file(),
        Purpose::SavePicture => dialog
            .set_title("Save the picture")
            .set_file_name(format!("{name}.exr"))
            .add_filter("OpenEXR, PNG", &["exr", "png"])
            .save_file(),
        Purpose::SaveSettings => dialog
            .set_title("Save the settings")
            .set_file_name(format!("{name}.toml"))
            .add_filter("Settings", &["toml"])
            .save_file(),
        Purpose::Reference => dialog.set_title("Open a reference").add_filter("OpenEXR", &["exr"]).pick_file(),
        Purpose::Environment => {
            dialog.set_title("Open an environment").add_filter("Latitude-longitude maps", &["hdr", "exr"]).pick_file()
        }
    };
    match path {
        Some(path) => Answer::File(path),
        None if DIALOG_FAULTS.0.load(Ordering::Relaxed) => Answer::NoDialog,
        None => Answer::Cancelled,
    }
}

/// Notes that there was no dialog: rfd gives no file then, as if it was cancelled, and only logs why. zenity is the last that
/// it tries.
struct DialogFaults(AtomicBool);

static DIALOG_FAULTS: DialogFaults = DialogFaults(AtomicBool::new(false));

impl log::Log for DialogFaults {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.level() == log::Level::Error && metadata.target().starts_with("rfd::")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) && record.args().to_string().contains("zenity") {
            self.0.store(true, Ordering::Relaxed);
        }
    }

    fn flush(&self) {}
}

fn ask(viewer: &mut Viewer, purpose: Purpose) {
    if viewer.dialog.is_some() {
        // Some systems never answer.
        let text = "a file dialog is open already; sunfleck view SCENE -o FILE saves without one".to_owned();
        return viewer.engine().speaker()(Message::Warning(text));
    }
    let (sender, answer) = mpsc::channel();
    let stem = viewer
        .wanted
        .scene
        .as_ref()
        .map(|choice| Path::new(&choice.name).file_stem().unwrap_or_default().to_string_lossy().into_owned());
    let name = stem.unwrap_or_else(|| "picture".to_owned());
    let (wake, pick) = (viewer.wake(), Arc::clone(&viewer.pick));
    let named = name.clone();
    std::thread::spawn(move || {
        let _ = sender.send(pick(purpose, &named));
        wake();
    });
    viewer.dialog = Some(Dialog { purpose, name, scene: viewer.wanted.scene.clone(), answer });
}

/// Takes what dialogs and threads that read have come to.
pub fn poll(ui: &egui::Ui, viewer: &mut Viewer) {
    poll_dialog(ui, viewer);
    poll_sky(ui, viewer);
}

fn poll_dialog(ui: &egui::Ui, viewer: &mut Viewer) {
    let Some(dialog) = &viewer.dialog else { return };
    let answer = match dialog.answer.try_recv() {
        Ok(answer) => answer,
        Err(mpsc::TryRecvError::Empty) => return,
        Err(mpsc::TryRecvError::Disconnected) => Answer::Cancelled,
    };
    let Some(Dialog { purpose, name, scene, .. }) = viewer.dialog.take() else { return };
    let path = match answer {
        Answer::File(path) => path,
        Answer::Cancelled => return,
        Answer::NoDialog => match without_dialog(purpose, &name) {
            Ok((path, why)) => {
                viewer.say(ui, Message::Warning(why));
                path
            }
            Err(why) => return viewer.say(ui, Message::Error(why)),
        },
    };
    let left_undone = match purpose {
        Purpose::SavePicture | Purpose::SaveSettings => Some("written"),
        Purpose::Environment => Some("read"),
        Purpose::Open | Purpose::Reference => None,
    };
    if let (Some(done), true) = (left_undone, scene != viewer.wanted.scene) {
        let text = format!("{} was not {done}: the scene it was for has been left", path.display());
        return viewer.say(ui, Message::Error(text));
    }
    match purpose {
        Purpose::Open => viewer.open(path.to_string_lossy()),
        Purpose::SavePicture => match crate::job::check_format(&path) {
            Ok(()) => {
                viewer.set_place(path.clone());
                viewer.save_to(path);
            }
            Err(why) => viewer.say(ui, Message::Error(why)),
        },
        Purpose::SaveSettings => save_settings(ui, viewer, &path),
        Purpose::Reference => super::compare::load(ui, viewer, &path),
        Purpose::Environment => read_environment(ui, viewer, &path),
    }
}

/// Where a file goes that cannot be asked for, and what is told of it; what else can be done, if it is to be read.
fn without_dialog(purpose: Purpose, name: &str) -> Result<(PathBuf, String), String> {
    let no_dialog = "no file dialog: neither a desktop portal nor zenity answers";
    let extension = match purpose {
        Purpose::Open => return Err(format!("{no_dialog}; drop a scene on the window, or: sunfleck view SCENE")),
        Purpose::Reference => return Err(format!("{no_dialog}; drop an .exr on the window, or use --reference")),
        Purpose::Environment => return Err(format!("{no_dialog}; drop an .hdr on the window, or use --env")),
        Purpose::SavePicture => "exr",
        Purpose::SaveSettings => "toml",
    };
    let path = free_name(Path::new(""), name, extension);
    let why = format!("{no_dialog}; {} goes to the working folder", path.display());
    Ok((path, why))
}

pub fn open(viewer: &mut Viewer) {
    ask(viewer, Purpose::Open);
}

/// Where it went last, else asks.
pub fn save(viewer: &mut Viewer) {
    match viewer.place().cloned() {
        Some(path) => viewer.save_to(path),
        None => save_as(viewer),
    }
}

pub fn save_as(viewer: &mut Viewer) {
    if viewer.opened().is_some() {
        ask(viewer, Purpose::SavePicture);
    }
}

pub fn ask_settings(viewer: &mut Viewer) {
    if viewer.opened().is_some() {
        ask(viewer, Purpose::SaveSettings);
    }
}

pub fn ask_reference(viewer: &mut Viewer) {
    ask(viewer, Purpose::Reference);
}

pub fn ask_environment(viewer: &mut Viewer) {
    if viewer.opened().is_some() {
        ask(viewer, Purpose::Environment);
    }
}

/// Reads an environment on a thread of its own; the scene that is open has it if that goes well.
fn read_environment(ui: &egui::Ui, viewer: &mut Viewer, path: &Path) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let file = match crate::scenes::absolute(path) {
        Ok(file) => file,
        Err(error) => return viewer.say(ui, Message::Error(format!("{error:#}"))),
    };
    let (sender, done) = mpsc::channel();
    let (source, named, wake) = (opened.source.clone(), file.clone(), viewer.wake());
    std::thread::spawn(move || {
        let read = catch(|| source.keep_environment(Path::new(&named)));
        let _ = sender.send(read.and_then(|read| read.map_err(|error| crate::one_line(&crate::chain(&error)))));
        wake();
    });
    viewer.sky = Some(Sky { opened, file, done });
}

/// Lights the scene with an environment that has been read.
fn poll_sky(ui: &egui::Ui, viewer: &mut Viewer) {
    let Some(sky) = &viewer.sky else { return };
    let read = match sky.done.try_recv() {
        Ok(read) => read,
        Err(mpsc::TryRecvError::Empty) => return,
        Err(mpsc::TryRecvError::Disconnected) => Err(format!("{}: cannot be read", sky.file)),
    };
    let Some(Sky { opened, file, .. }) = viewer.sky.take() else { return };
    match read {
        Ok(()) if !is_same(Some(&opened), viewer.opened()) => {
            let text = format!("{file} was not taken: the scene it was for has been left, or read again");
            viewer.say(ui, Message::Error(text));
        }
        Ok(()) => {
            let message = format!("{} is the environment", name_of(Path::new(&file)));
            let environment = EnvironmentSettings { file: Some(file), ..EnvironmentSettings::default() };
            viewer.edit_apart(ui, "environment", |s| s.environment = Some(environment));
            viewer.say(ui, Message::Said(message));
        }
        Err(why) => viewer.say(ui, Message::Error(why)),
    }
}

/// Scenes, settings, reference pictures, environments: the first of each kind, the others are named.
pub fn dropped(ui: &egui::Ui, viewer: &mut Viewer, paths: &[PathBuf]) {
    let extension = |path: &Path| path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    let is = |path: &&PathBuf, all: &[&str]| extension(path).is_some_and(|e| all.contains(&e.as_str()));
    let names = |paths: &[&PathBuf]| paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ");
    let (references, rest): (Vec<_>, Vec<_>) = paths.iter().partition(|path| is(path, &["exr"]));
    let (environments, rest): (Vec<_>, Vec<_>) = rest.into_iter().partition(|path| is(path, &["hdr"]));
    let (scenes, unknown): (Vec<_>, Vec<_>) = rest.into_iter().partition(|path| is(path, SCENES));
    if let Some(path) = references.first() {
        super::compare::load(ui, viewer, path);
    }
    let environment = environments.first().map(|path| path.as_path());
    match (scenes.first(), environment) {
        (Some(scene), _) => match crate::cli::over_named(None, environment, &[]) {
            Ok(set) => viewer.open_with(scene.to_string_lossy(), set),
            Err(Usage(why)) => viewer.say(ui, Message::Error(why)),
        },
        (None, Some(path)) if viewer.opened().is_some() => read_environment(ui, viewer, path),
        (None, Some(path)) => {
            let what = match viewer.wanted.scene {
                Some(_) => "the scene is still being read",
                None => "the environment of which scene? open one first",
            };
            viewer.say(ui, Message::Error(format!("{}: {what}", path.display())));
        }
        (None, None) => {}
    }
    for (what, all) in [("reference", &references), ("environment", &environments), ("scene", &scenes)] {
        if all.len() > 1 {
            viewer.say(ui, Message::Warning(format!("{}: left out, one {what} at a time", names(&all[1..]))));
        }
    }
    if !unknown.is_empty() {
        let name = names(&unknown);
        let kinds = "a scene (.glb, .gltf, .obj, .toml), a reference (.exr) or an environment (.hdr)";
        viewer.say(ui, Message::Error(format!("{name}: not {kinds}")));
    }
}

/// The settings as the command line reads them.
fn save_settings(ui: &egui::Ui, viewer: &mut Viewer, path: &Path) {
    let Some(text) = viewer.settings_text(path) else { return };
    let written = sunfleck::output::atomic::write(path, |writer| io::Write::write_all(writer, text.as_bytes()));
    let message = match written {
        Ok(()) => Message::Said(format!("saved {}", path.display())),
        Err(error) => Message::Error(error.to_string()),
    };
    viewer.say(ui, message);
}

pub fn copy_command(ui: &egui::Ui, viewer: &mut Viewer) {
    if let Some(command) = viewer.command() {
        ui.ctx().copy_text(command);
        viewer.say(ui, Message::Said("copied the command".to_owned()));
    }
}

/// Writes a picture of the window into the working folder.
pub fn screenshot(ui: &egui::Ui, viewer: &Viewer) {
    let write = viewer.screenshots.writer(PathBuf::new(), viewer.engine().speaker());
    ui.ctx().send_viewport_cmd(egui::ViewportCommand::Screenshot(egui::ScreenshotCallback::new(write)));
}

/// Pictures of the window on their way to files. Waits for them in the end.
#[derive(Default)]
pub struct Screenshots {
    /// The thread that writes the newest one.
    last: Arc<Mutex<Option<JoinHandle<()>>>>,
}

impl Screenshots {
    /// Writes a picture into `folder`, on a thread of its own: the interface thread has it.
    fn writer(
        &self,
        folder: PathBuf,
        say: impl Fn(Message) + Send + 'static,
    ) -> impl FnOnce(Arc<egui::ColorImage>) + Send + 'static {
        let last = Arc::clone(&self.last);
        move |image| {
            let mut last = last.lock().unwrap_or_else(PoisonError::into_inner);
            let before = last.take();
            *last = Some(std::thread::spawn(move || {
                // Or both would take the same name.
                if let Some(before) = before {
                    let _ = before.join();
                }
                let path = free_name(&folder, "sunfleck-window", "png");
                say(match write_png(&path, &image) {
                    Ok(()) => Message::Said(format!("saved {}", path.display())),
                    Err(error) => Message::Error(error.to_string()),
                });
            }));
        }
    }
}

impl Drop for Screenshots {
    fn drop(&mut self) {
        if let Some(last) = self.last.lock().unwrap_or_else(PoisonError::into_inner).take() {
            let _ = last.join();
        }
    }
}

fn write_png(path: &Path, image: &egui::ColorImage) -> Result<(), sunfleck::output::Error> {
    let [width, height] = image.size.map(|n| n as u32);
    sunfleck::output::atomic::write(path, |writer| {
        let encoder = PngEncoder::new(writer);
        encoder.write_image(image.as_raw(), width, height, ExtendedColorType::Rgba8).map_err(io::Error::other)
    })
}

/// A file's name without its folder.
pub fn name_of(path: &Path) -> Cow<'_, str> {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy()
}

/// In `folder`, not there yet.
pub fn free_name(folder: &Path, stem: &str, extension: &str) -> PathBuf {
    let name = |i: u32| folder.join(format!("{stem}-{i}.{extension}"));
    (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_dialog_pictures_are_written_beside_those_that_are_there() {
        for (purpose, extension) in [(Purpose::SavePicture, "exr"), (Purpose::SaveSettings, "toml")] {
            let (path, why) = without_dialog(purpose, "no such name").unwrap();
            assert_eq!(path, PathBuf::from(format!("no such name-1.{extension}")));
            assert!(why.contains("zenity") && why.contains("no such name-1"), "{why}");
        }
        let folder = tempfile::tempdir().unwrap();
        let names = ["x-1.exr", "x-2.exr", "x-3.exr"].map(|name| folder.path().join(name));
        for name in &names {
            assert_eq!(free_name(folder.path(), "x", "exr"), *name);
            std::fs::write(name, "").unwrap();
        }
        for purpose in [Purpose::Open, Purpose::Reference] {
            assert!(without_dialog(purpose, "x").unwrap_err().contains("drop"));
        }
    }

    #[test]
    fn pictures_of_the_window_are_written_beside_the_interface() {
        let folder = tempfile::tempdir().unwrap();
        let screenshots = Screenshots::default();
        let image = Arc::new(egui::ColorImage::filled([5, 3], egui::Color32::from_rgb(10, 200, 30)));
        let (go_on, waits) = mpsc::channel::<()>();
        let (told, messages) = mpsc::channel();
        let waits = Mutex::new(waits);
        let first = screenshots.writer(folder.path().to_owned(), move |_| waits.lock().unwrap().recv().unwrap());
        let second = screenshots.writer(folder.path().to_owned(), move |message| told.send(message).unwrap());
        first(Arc::clone(&image));
        second(image);
        // The interface has them behind it, while the first is not even told of.
        assert!(messages.try_recv().is_err());
        go_on.send(()).unwrap();
        drop(screenshots);
        let path = folder.path().join("sunfleck-window-2.png");
        assert_eq!(messages.recv().unwrap(), Message::Said(format!("saved {}", path.display())));
        let written = image::open(path).unwrap().to_rgba8();
        assert_eq!((written.dimensions(), written.get_pixel(4, 2).0), ((5, 3), [10, 200, 30, 255]));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
        // What cannot be written is told, and leaves nothing behind.
        let (told, messages) = mpsc::channel();
        let nowhere = Screenshots::default();
        let image = Arc::new(egui::ColorImage::filled([5, 3], egui::Color32::WHITE));
        nowhere.writer(folder.path().join("absent"), move |message| told.send(message).unwrap())(image);
        assert!(matches!(messages.recv().unwrap(), Message::Error(why) if why.contains("there is no folder")));
    }

    #[test]
    fn only_the_last_resort_of_dialogs_is_a_fault() {
        let faults = DialogFaults(AtomicBool::new(false));
        for (target, text, is_fault) in [
            ("wgpu::zenity", "Failed to pick file with zenity: x", false),
            ("rfd::backend", "OpenFile failed: no portal", false),
            ("rfd::backend", "Failed to pick file with zenity: x", true),
        ] {
            let record = |arguments: std::fmt::Arguments<'_>| {
                let record = log::Record::builder().level(log::Level::Error).target(target).args(arguments).build();
                log::Log::log(&faults, &record);
            };
            record(format_args!("{text}"));
            assert_eq!(faults.0.load(Ordering::Relaxed), is_fault, "{target}: {text}");
        }
    }
}
