//! Files: dialogs, dropped files, the clipboard.

use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};

use eframe::egui;

use super::app::Viewer;
use super::engine::Message;

/// What a dialog was for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    Open,
    SavePicture,
    SaveSettings,
    Reference,
}

/// Asks for a file.
pub type Pick = Arc<dyn Fn(Purpose, &str) -> Option<PathBuf> + Send + Sync>;

/// A dialog under way, on a thread of its own.
pub struct Dialog {
    purpose: Purpose,
    answer: mpsc::Receiver<Option<PathBuf>>,
}

const SCENES: &[&str] = &["glb", "gltf", "obj", "toml"];

/// The system's dialog, for a file that is best called `name`; waits for the answer.
pub fn pick(purpose: Purpose, name: &str) -> Option<PathBuf> {
    let dialog = rfd::FileDialog::new();
    match purpose {
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
    }
}

fn ask(viewer: &mut Viewer, purpose: Purpose) {
    if viewer.dialog.is_some() {
        return;
    }
    let (sender, answer) = mpsc::channel();
    let stem = viewer
        .wanted
        .scene
        .as_ref()
        .map(|choice| Path::new(&choice.name).file_stem().unwrap_or_default().to_string_lossy().into_owned());
    let name = stem.unwrap_or_else(|| "picture".to_owned());
    let (wake, pick) = (viewer.wake(), Arc::clone(&viewer.pick));
    std::thread::spawn(move || {
        let path = pick(purpose, &name);
        let _ = sender.send(path);
        wake();
    });
    viewer.dialog = Some(Dialog { purpose, answer });
}

/// Takes the answer of a dialog, if there is one.
pub fn poll(ui: &egui::Ui, viewer: &mut Viewer) {
    let Some(dialog) = &viewer.dialog else { return };
    let answer = match dialog.answer.try_recv() {
        Ok(answer) => answer,
        Err(mpsc::TryRecvError::Empty) => return,
        Err(mpsc::TryRecvError::Disconnected) => None,
    };
    let purpose = dialog.purpose;
    viewer.dialog = None;
    let Some(path) = answer else { return };
    match purpose {
        Purpose::Open => viewer.open(path.to_string_lossy()),
        Purpose::SavePicture => {
            viewer.output = Some(path.clone());
            viewer.save_to(path);
        }
        Purpose::SaveSettings => save_settings(ui, viewer, &path),
        Purpose::Reference => super::compare::load(ui, viewer, &path),
    }
}

pub fn open(viewer: &mut Viewer) {
    ask(viewer, Purpose::Open);
}

/// Where it went last, else asks.
pub fn save(viewer: &mut Viewer) {
    match viewer.output.clone() {
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

/// A scene, settings, or a reference picture.
pub fn dropped(ui: &egui::Ui, viewer: &mut Viewer, path: &Path) {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("exr") => super::compare::load(ui, viewer, path),
        Some(e) if SCENES.contains(&e) => viewer.open(path.to_string_lossy()),
        _ => {
            let text = format!("{}: neither a scene (.glb, .gltf, .obj, .toml) nor a reference (.exr)", path.display());
            viewer.say(ui, Message::Error(text));
        }
    }
}

/// The settings as the command line reads them.
fn save_settings(ui: &egui::Ui, viewer: &mut Viewer, path: &Path) {
    let Some(text) = viewer.settings_text() else { return };
    let written = sunfleck::output::atomic::write(path, |writer| std::io::Write::write_all(writer, text.as_bytes()));
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
    let say = viewer.engine().speaker();
    let write = move |image: std::sync::Arc<egui::ColorImage>| {
        let path = free_name("sunfleck-window", "png");
        let [width, height] = image.size.map(|n| n as u32);
        let written = image::save_buffer(&path, image.as_raw(), width, height, image::ColorType::Rgba8);
        say(match written {
            Ok(()) => Message::Said(format!("saved {}", path.display())),
            Err(error) => Message::Error(format!("{}: {error}", path.display())),
        });
    };
    ui.ctx().send_viewport_cmd(egui::ViewportCommand::Screenshot(egui::ScreenshotCallback::new(write)));
}

/// In the working folder, not there yet.
fn free_name(stem: &str, extension: &str) -> PathBuf {
    let name = |i: u32| PathBuf::from(format!("{stem}-{i}.{extension}"));
    (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0))
}
