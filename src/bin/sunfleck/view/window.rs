//! The window of the system, and what may befall it.

use std::panic::AssertUnwindSafe;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{panic, thread};

use anyhow::{Result, anyhow};
use eframe::{egui, wgpu};

use super::app::{LastSave, Viewer};
use super::dialog;
use super::engine::{Message, Save, Wake, panic_text};
use super::exit;
use super::files::free_name;
use super::remembered;

/// The folder of what is remembered, and what the window manager knows the window by.
const APP_ID: &str = "sunfleck";
/// A device that fails before it has drawn so many is not opened again.
pub const FEWEST_FRAMES: usize = 10;
/// Nor is one when so many have failed within [`A_WHILE`].
const MOST_FAULTS: usize = 4;
const A_WHILE: Duration = Duration::from_secs(60);

/// The window that there is, for threads that have news for it.
#[derive(Clone, Default)]
pub struct Bell(Arc<Mutex<Option<egui::Context>>>);

impl Bell {
    pub fn hang(&self, context: &egui::Context) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(context.clone());
    }

    /// Asks for another frame, from any thread.
    pub fn wake(&self) -> Wake {
        let bell = self.clone();
        Arc::new(move || {
            // Not while the lock is held: the window may be asking for it.
            let context = bell.0.lock().unwrap_or_else(PoisonError::into_inner).clone();
            if let Some(context) = context {
                context.request_repaint();
            }
        })
    }
}

/// What went wrong with the device that draws the window; nothing while it works.
#[derive(Clone, Default)]
pub struct Fault(Arc<Mutex<Option<String>>>);

impl Fault {
    /// Notes what `device` reports, which wgpu would panic of, and calls `then`.
    pub fn watch(&self, device: &wgpu::Device, then: impl Fn() + Clone + Send + Sync + 'static) {
        let (lost, then_too) = (self.clone(), then.clone());
        device.set_device_lost_callback(move |_, text| {
            lost.set(if text.is_empty() { "lost".to_owned() } else { crate::one_line(&text) });
            then_too();
        });
        let wrong = self.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            wrong.set(crate::one_line(&error.to_string()));
            then();
        }));
    }

    /// The first is told; others follow from it.
    fn set(&self, text: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(text);
    }

    pub fn get(&self) -> Option<String> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Who has a hand in the window beside its user: a benchmark, a test.
pub trait Guest {
    /// Before every frame: what else was typed and pointed at.
    fn add_input(&mut self, _: &Viewer, _: &mut egui::RawInput) {}

    /// After every frame, before it is drawn.
    fn after_frame(&mut self, _: &Viewer, _: &egui::Ui, _: &Drawn<'_>) {}
}

/// What frames are drawn with.
pub struct Drawn<'a> {
    /// What the frame before took the interface thread, waits for the display left out, seconds.
    pub work: Option<f32>,
    pub device: Option<&'a wgpu::Device>,
}

/// How the window is at first.
pub fn options() -> eframe::NativeOptions {
    eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id(APP_ID)
            .with_title("Sunfleck")
            .with_inner_size([1280.0, 720.0])
            .with_min_inner_size([480.0, 320.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    }
}

/// Shows `viewer` until its window is closed. When the window loses its device, another is opened, and what renders goes
/// on; when there can be none any more, the picture is written to a file first.
pub fn run(
    viewer: &mut Viewer,
    bell: &Bell,
    options: impl Fn() -> eframe::NativeOptions,
    guest: &mut impl Guest,
) -> Result<()> {
    let (last, write) = (viewer.last_save(), viewer.engine().writer());
    let _guard = exit::Guard::new(move || {
        let why = anyhow!("the display is gone");
        crate::say_error(&crate::one_line(&crate::chain(&with_picture(why, rescue(&last, write)))));
    });
    let mut faults = vec![];
    loop {
        let (fault, mut n_frames) = (Fault::default(), 0);
        let shown = (&mut *viewer, &mut *guest, &mut n_frames);
        let options = options();
        let place = remembered::place(APP_ID, &options);
        let ended = quietly(|| {
            eframe::run_native(
                APP_ID,
                options,
                Box::new(|creation| {
                    let (viewer, guest, n_frames) = shown;
                    bell.hang(&creation.egui_ctx);
                    if let Some(state) = &creation.wgpu_render_state {
                        let context = creation.egui_ctx.clone();
                        fault.watch(&state.device, move || context.request_repaint());
                    }
                    viewer.enter(creation.storage, place);
                    viewer.pick = dialog::system(rfd::FileDialog::new().set_parent(creation));
                    Ok(Box::new(Window { viewer, guest, n_frames, fault: fault.clone() }))
                }),
            )
        });
        let why = match (ended, fault.get()) {
            (Ok(Ok(())), None) => return Ok(()),
            (Ok(Ok(())), Some(fault)) if n_frames >= FEWEST_FRAMES && !is_often(&mut faults, Instant::now()) => {
                let text = format!("the window's graphics device failed ({fault}); it was opened again");
                eprintln!("sunfleck: warning: {text}");
                viewer.tell(Message::Warning(text));
                continue;
            }
            (_, Some(fault)) => anyhow!("the window's graphics device failed: {fault}"),
            (Ok(Err(error)), None) => anyhow!("no window: {}", without_source(&error.to_string())),
            (Err(panic), None) => anyhow!("the window is gone: {panic}"),
        };
        return Err(with_picture(why, rescue(&viewer.last_save(), viewer.engine().writer())));
    }
}

/// Notes a fault of a moment; whether there are too many of late.
fn is_often(faults: &mut Vec<Instant>, now: Instant) -> bool {
    faults.retain(|then| now - *then < A_WHILE);
    faults.push(now);
    faults.len() >= MOST_FAULTS
}

/// What winit says, without the line of its source that it says first.
fn without_source(text: &str) -> &str {
    let words = text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(text, |(_, words)| words);
    words.trim_end_matches('.')
}

/// A panic of the window's libraries is an error, told in one line that names the library: winit panics when the display goes
/// away, egui-wgpu when the device is lost in the middle of a frame. There can be no other window after one.
fn quietly<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    let is_loud = std::env::var_os("RUST_BACKTRACE").is_some_and(|value| value != "0");
    let (here, usual) = (thread::current().id(), Arc::new(panic::take_hook()));
    let (elsewhere, whose) = (Arc::clone(&usual), Arc::new(Mutex::new(None)));
    let place = Arc::clone(&whose);
    panic::set_hook(Box::new(move |info| {
        let is_here = thread::current().id() == here;
        if is_here {
            *place.lock().unwrap_or_else(PoisonError::into_inner) = info.location().and_then(|l| library(l.file()));
        }
        if is_loud || !is_here {
            elsewhere(info);
        }
    }));
    let done = panic::catch_unwind(AssertUnwindSafe(work));
    panic::set_hook(Box::new(move |info| usual(info)));
    done.map_err(|panic| {
        let whose = whose.lock().unwrap_or_else(PoisonError::into_inner).take();
        format!("{}: {}", whose.as_deref().unwrap_or("a bug in sunfleck"), panic_text(&*panic))
    })
}

/// Name and version of the library that a source file of Cargo's registry is of; none for a file of this program.
fn library(file: &str) -> Option<String> {
    let path = file.replace('\\', "/");
    let (_, rest) = path.split_once("/registry/src/")?;
    rest.split('/').nth(1).map(str::to_owned)
}

/// Writes the newest picture as the last frame would have, or wherever it can be written, but over no file; where that is.
pub fn rescue(last: &LastSave, write: impl Fn(&Save) -> Result<()>) -> Option<PathBuf> {
    let last = last.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
    let name = format!("sunfleck-{}.exr", std::process::id());
    let places = [last.path.clone(), PathBuf::from(&name), std::env::temp_dir().join(&name)];
    let wanted = places.into_iter().filter(|path| !path.as_os_str().is_empty()).map(beside);
    wanted.map(|path| Save { path, ..last.clone() }).find(|save| write(save).is_ok()).map(|save| save.path)
}

/// Where a picture goes whose place may be taken: by one of another view perhaps, which was saved on purpose.
fn beside(path: PathBuf) -> PathBuf {
    if !path.exists() {
        return path;
    }
    let [stem, extension] = [path.file_stem(), path.extension()].map(|part| part.unwrap_or_default().to_string_lossy());
    free_name(&path.with_file_name(format!("{stem}-rescued.{extension}")))
}

fn with_picture(why: anyhow::Error, saved: Option<PathBuf>) -> anyhow::Error {
    match saved {
        Some(path) => why.context(format!("saved the picture as {}", path.display())),
        None => why,
    }
}

struct Window<'a, G> {
    viewer: &'a mut Viewer,
    guest: &'a mut G,
    n_frames: &'a mut usize,
    fault: Fault,
}

impl<G: Guest> eframe::App for Window<'_, G> {
    fn raw_input_hook(&mut self, _: &egui::Context, input: &mut egui::RawInput) {
        self.guest.add_input(self.viewer, input);
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        if self.fault.get().is_some() {
            // Nothing can be drawn here; `run` sees to it.
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            return;
        }
        self.viewer.show(ui, frame.info().cpu_usage);
        *self.n_frames += 1;
        let state = frame.wgpu_render_state();
        let device = state.map(|state| &state.device);
        self.guest.after_frame(self.viewer, ui, &Drawn { work: frame.info().cpu_usage, device });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_that_fails_again_and_again_is_given_up() {
        let (mut faults, began) = (vec![], Instant::now());
        let at = |seconds: u64| began + Duration::from_secs(seconds);
        assert_eq!([0, 20, 40, 59].map(|s| is_often(&mut faults, at(s))), [false, false, false, true]);
        assert_eq!([200, 300, 400, 500].map(|s| is_often(&mut faults, at(s))), [false; 4]);
    }

    #[test]
    fn a_panic_is_told_in_one_line_and_names_whose_it_is() {
        assert_eq!(quietly(|| 3), Ok(3));
        let text = quietly(|| -> u32 { panic!("at {}\nof", 7) }).unwrap_err();
        assert_eq!(text, "a bug in sunfleck: at 7 of");
        let text = quietly(|| egui::ColorImage::from_rgba_unmultiplied([2, 2], &[])).unwrap_err();
        assert!(text.starts_with("epaint-"), "{text}");
        assert_eq!(
            library(r"C:\cargo\registry\src\index.crates.io-1\winit-0.30.13\src\lib.rs").as_deref(),
            Some("winit-0.30.13")
        );
        assert_eq!(library("src/bin/sunfleck/view/app.rs"), None);
    }
}
