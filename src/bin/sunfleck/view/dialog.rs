//! The system's dialogs for files.

use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};

use rfd::FileDialog;

use super::app::Viewer;
use super::engine::{Choice, Message};
use super::files::{SCENES, free_name, name_of};

/// What a dialog was for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Purpose {
    Open,
    SavePicture,
    SaveSettings,
    Reference,
    Environment,
}

impl Purpose {
    /// What a file that is saved ends in, if nothing else is said.
    fn extension(self) -> Option<&'static str> {
        match self {
            Self::SavePicture => Some("exr"),
            Self::SaveSettings => Some("toml"),
            Self::Open | Self::Reference | Self::Environment => None,
        }
    }
}

/// What came of a dialog.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Answer {
    File(PathBuf),
    Cancelled,
    /// The system has no dialogs: neither a desktop portal nor zenity.
    NoDialog,
}

/// What a dialog begins with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Request {
    pub purpose: Purpose,
    /// Absolute, if the working folder is known.
    pub folder: PathBuf,
    /// A file that is saved is best called so; empty for one that is read.
    pub name: String,
}

/// Asks for a file; waits for the answer.
pub type Pick = Arc<dyn Fn(&Request) -> Answer + Send + Sync>;

/// A dialog under way, on a thread of its own.
pub struct Dialog {
    pub request: Request,
    /// The scene that it was asked for.
    pub scene: Option<Arc<Choice>>,
    answer: mpsc::Receiver<Answer>,
}

impl Dialog {
    /// What came of it, if it has ended.
    pub fn answer(&self) -> Option<Answer> {
        match self.answer.try_recv() {
            Ok(answer) => Some(answer),
            Err(mpsc::TryRecvError::Empty) => None,
            Err(mpsc::TryRecvError::Disconnected) => Some(Answer::Cancelled),
        }
    }
}

/// The system's dialogs, which continue `blank`: over its window, if it has one. Those of zenity take neither that nor the
/// folder from rfd.
pub fn system(blank: FileDialog) -> Pick {
    Arc::new(move |request| {
        // Fails if there is a logger, which is then this one.
        if log::set_logger(&DIALOG_FAULTS).is_ok() {
            log::set_max_level(log::LevelFilter::Error);
        }
        DIALOG_FAULTS.0.store(false, Ordering::Relaxed);
        let (title, kind, extensions): (_, _, &[&str]) = match request.purpose {
            Purpose::Open => ("Open a scene", "Scenes and settings", SCENES),
            Purpose::SavePicture => ("Save the picture", "OpenEXR, PNG", &["exr", "png"]),
            Purpose::SaveSettings => ("Save the settings", "Settings", &["toml"]),
            Purpose::Reference => ("Open a reference", "OpenEXR", &["exr"]),
            Purpose::Environment => ("Open an environment", "Latitude-longitude maps", &["hdr", "exr"]),
        };
        let dialog = blank.clone().set_directory(&request.folder).set_title(title).add_filter(kind, extensions);
        let path = match request.purpose.extension() {
            Some(_) => dialog.set_file_name(&request.name).save_file(),
            None => dialog.pick_file(),
        };
        match path {
            Some(path) => Answer::File(path),
            None if DIALOG_FAULTS.0.load(Ordering::Relaxed) => Answer::NoDialog,
            None => Answer::Cancelled,
        }
    })
}

/// A name that was typed without an extension gets the usual one; digits are none, as in "radius 0.5", and a dot at the end
/// begins one. It replaces no file then: the dialog asked that of the name it was given.
pub fn with_extension(path: PathBuf, purpose: Purpose) -> PathBuf {
    let said = path.extension().map(OsStr::as_encoded_bytes);
    let Some(usual) = purpose.extension() else { return path };
    let named = match said {
        Some(b"") => path.with_extension(usual),
        Some(said) if !said.iter().all(u8::is_ascii_digit) => return path,
        _ => path.with_added_extension(usual),
    };
    if named.exists() { free_name(&named) } else { named }
}

/// Asks for a file with a dialog.
pub fn ask(viewer: &mut Viewer, purpose: Purpose) {
    if viewer.dialog.is_some() {
        // Some systems never answer.
        let text = "a file dialog is open already; sunfleck view SCENE -o FILE saves without one".to_owned();
        return viewer.engine().speaker()(Message::Warning(text));
    }
    let request = request(viewer, purpose);
    let (sender, answer) = mpsc::channel();
    let (wake, pick, asked) = (viewer.wake(), Arc::clone(&viewer.pick), request.clone());
    std::thread::spawn(move || {
        let _ = sender.send(pick(&asked));
        wake();
    });
    viewer.dialog = Some(Dialog { request, scene: viewer.wanted.scene.clone(), answer });
}

/// Begins where the scene's picture goes, if it is for that; else where the last one for the same ended; the first one beside
/// the scene's file, for pictures in the working folder.
fn request(viewer: &Viewer, purpose: Purpose) -> Request {
    let scene = viewer.wanted.scene.as_ref().map(|choice| Path::new(&choice.name));
    let picked = viewer.picked.get(&purpose).map(PathBuf::as_path);
    let stem = scene.and_then(Path::file_stem).map_or("picture".into(), |stem| stem.to_string_lossy());
    let usual = purpose.extension().map_or(String::new(), |extension| format!("{stem}.{extension}"));
    let (last, name) = match (purpose, viewer.place()) {
        (Purpose::SavePicture, Some(place)) => (Some(place.as_path()), name_of(place).into_owned()),
        (Purpose::SavePicture, None) => (picked, usual),
        _ => (picked.or(scene), usual),
    };
    let folder = last.and_then(|path| path.parent()).unwrap_or(Path::new(""));
    // "" is none, to `std::path::absolute`.
    let folder = std::path::absolute(Path::new(".").join(folder)).unwrap_or_default();
    Request { purpose, folder, name }
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

/// Where a file goes that cannot be asked for, and what is told of it; what else can be done, if it is to be read.
pub fn without_dialog(request: &Request) -> Result<(PathBuf, String), String> {
    let no_dialog = "no file dialog: neither a desktop portal nor zenity answers";
    match request.purpose {
        Purpose::Open => return Err(format!("{no_dialog}; drop a scene on the window, or: sunfleck view SCENE")),
        Purpose::Reference => return Err(format!("{no_dialog}; drop an .exr on the window, or use --reference")),
        Purpose::Environment => return Err(format!("{no_dialog}; drop an .hdr on the window, or use --env")),
        Purpose::SavePicture | Purpose::SaveSettings => {}
    }
    let path = free_name(Path::new(&request.name));
    let why = format!("{no_dialog}; {} goes to the working folder", path.display());
    Ok((path, why))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_dialog_pictures_are_written_beside_those_that_are_there() {
        let request = |purpose, name: &str| Request { purpose, folder: PathBuf::new(), name: name.to_owned() };
        for (purpose, extension) in [(Purpose::SavePicture, "exr"), (Purpose::SaveSettings, "toml")] {
            let (path, why) = without_dialog(&request(purpose, &format!("no such name.{extension}"))).unwrap();
            assert_eq!(path, PathBuf::from(format!("no such name-1.{extension}")));
            assert!(why.contains("zenity") && why.contains("no such name-1"), "{why}");
        }
        for purpose in [Purpose::Open, Purpose::Reference, Purpose::Environment] {
            assert!(without_dialog(&request(purpose, "x")).unwrap_err().contains("drop"));
        }
    }

    #[test]
    fn numbers_are_no_extension() {
        for (name, picture, settings) in [
            ("x", "x.exr", "x.toml"),
            ("x.", "x.exr", "x.toml"),
            ("radius 0.5", "radius 0.5.exr", "radius 0.5.toml"),
            ("x.png", "x.png", "x.png"),
            ("x.mp4", "x.mp4", "x.mp4"),
        ] {
            let with_extension = |purpose| with_extension(Path::new("/no such folder").join(name), purpose);
            assert_eq!(name_of(&with_extension(Purpose::SavePicture)), picture);
            assert_eq!(name_of(&with_extension(Purpose::SaveSettings)), settings);
            assert_eq!(name_of(&with_extension(Purpose::Open)), name);
        }
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
