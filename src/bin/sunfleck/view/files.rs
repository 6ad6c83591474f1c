//! Files: what is done with those that dialogs name or that are dropped; pictures of the window; the clipboard.

use std::borrow::Cow;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::JoinHandle;

use eframe::egui;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use sunfleck::scene::settings::EnvironmentSettings;

use super::app::Viewer;
use super::dialog::{Answer, Dialog, Purpose, ask, with_extension, without_dialog};
use super::engine::{Message, Opened, catch, is_same};
use crate::cli::Usage;

/// An environment that is being read, for the scene that is open.
pub struct Sky {
    opened: Arc<Opened>,
    /// As the settings name it.
    file: String,
    done: mpsc::Receiver<Result<(), String>>,
}

/// What the names of scenes end in, settings among them.
pub const SCENES: &[&str] = &["glb", "gltf", "obj", "toml"];

/// Takes what dialogs and threads that read have come to.
pub fn poll(ui: &egui::Ui, viewer: &mut Viewer) {
    poll_dialog(ui, viewer);
    poll_sky(ui, viewer);
}

fn poll_dialog(ui: &egui::Ui, viewer: &mut Viewer) {
    let Some(answer) = viewer.dialog.as_ref().and_then(Dialog::answer) else { return };
    let Some(Dialog { request, scene, .. }) = viewer.dialog.take() else { return };
    let purpose = request.purpose;
    let path = match answer {
        Answer::File(path) => {
            let path = with_extension(path, purpose);
            viewer.picked.insert(purpose, path.clone());
            path
        }
        Answer::Cancelled => return,
        Answer::NoDialog => match without_dialog(&request) {
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
        Purpose::Reference => super::compare::load(viewer, &path),
        Purpose::Environment => read_environment(ui, viewer, &path),
    }
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
        super::compare::load(viewer, path);
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
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) {
        return viewer.say(ui, Message::Error(format!("{}: settings end in .toml", path.display())));
    }
    let Some(text) = viewer.settings_text(path) else { return };
    let written = sunfleck::output::atomic::write(path, |writer| io::Write::write_all(writer, text.as_bytes()));
    if let Err(error) = written {
        return viewer.say(ui, Message::Error(error.to_string()));
    }
    viewer.say(ui, Message::Said(format!("saved {}", path.display())));
    // What is reset, and what a command has to say, is against what the file says now.
    let is_it = |opened: &&Arc<Opened>| crate::scenes::same_file(Path::new(&opened.source.name), path);
    if let Some(Err(error)) = viewer.opened().filter(is_it).map(|opened| opened.read_settings_again()) {
        viewer.say(ui, Message::Error(crate::one_line(&crate::chain(&error))));
    }
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
                let path = free_name(&folder.join("sunfleck-window.png"));
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

/// `path` with a number before its extension, so that there is no such file yet.
pub fn free_name(path: &Path) -> PathBuf {
    let [stem, extension] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    let name = |i: u32| path.with_file_name(format!("{stem}-{i}.{extension}"));
    (1..).map(name).find(|path| !path.exists()).unwrap_or_else(|| name(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_name_has_the_first_number_that_is_not_taken() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["x.y-1.exr", "x.y-2.exr", "x.y-3.exr"].map(|name| folder.path().join(name)) {
            assert_eq!(free_name(&folder.path().join("x.y.exr")), name);
            std::fs::write(name, "").unwrap();
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
}
