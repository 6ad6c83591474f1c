//! Ctrl-C and SIGTERM: the picture is saved, and the window closed; a second one ends the program at once.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use anyhow::Result;
use eframe::egui;

use super::app::{LastSave, Viewer};
use super::engine::{Save, Wake};
use super::exit;
use super::window::{Drawn, Guest, rescue};
use crate::stop::Stop;

/// Between looks at whether one has come.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// A window that nobody sees may draw no frame in which it could close.
const PATIENCE: Duration = Duration::from_secs(3);
/// Of rendering, seconds: what has taken longer is saved, though nobody said where.
const WORTH_KEEPING: f64 = 60.0;

type Write = Box<dyn Fn(&Save) -> Result<()> + Send + Sync>;

/// Closes the window.
pub struct Signals(Arc<Ending>);

struct Ending {
    stop: Stop,
    /// Whether the window is gone.
    is_over: AtomicBool,
    last: LastSave,
    write: Write,
    /// What the picture has taken, seconds.
    spent: Box<dyn Fn() -> f64 + Send + Sync>,
    /// Whether the picture has been seen to.
    is_saved: Mutex<bool>,
}

impl Ending {
    /// Saves what is worth it, once.
    fn save(&self) {
        let mut is_saved = self.is_saved.lock().unwrap_or_else(PoisonError::into_inner);
        if std::mem::replace(&mut *is_saved, true) {
            return;
        }
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let has_place = last.is_some_and(|last| !last.path.as_os_str().is_empty());
        if has_place || (self.spent)() >= WORTH_KEEPING {
            match rescue(&self.last, &self.write) {
                Some(path) => eprintln!("saved the picture as {}", path.display()),
                None => crate::say_error("the picture was not saved: there is none yet, or no place for it"),
            }
        }
    }
}

impl Signals {
    /// Takes them over for the window of `viewer`; `wake` asks for a frame.
    pub fn install(viewer: &Viewer, wake: Wake) -> Result<Self> {
        let ending = Arc::new(Ending {
            stop: Stop::install()?,
            is_over: AtomicBool::new(false),
            last: viewer.last_save(),
            write: Box::new(viewer.engine().writer()),
            spent: Box::new(viewer.engine().clock()),
            is_saved: Mutex::new(false),
        });
        let ours = Arc::clone(&ending);
        Builder::new().name("signals".to_owned()).spawn(move || {
            while !ours.is_over.load(Ordering::Relaxed) {
                if ours.stop.asked() {
                    wake();
                    std::thread::sleep(PATIENCE);
                    if !ours.is_over.load(Ordering::Relaxed) {
                        exit::disarm();
                        ours.save();
                        std::process::exit(i32::from(crate::INTERRUPTED));
                    }
                }
                std::thread::sleep(LOOK_EVERY);
            }
        })?;
        Ok(Self(ending))
    }

    /// After the window: how the program ends.
    pub fn end(&self) -> ExitCode {
        self.0.is_over.store(true, Ordering::Relaxed);
        if !self.0.stop.asked() {
            return ExitCode::SUCCESS;
        }
        self.0.save();
        ExitCode::from(crate::INTERRUPTED)
    }
}

impl Guest for Signals {
    fn after_frame(&mut self, _: &Viewer, ui: &egui::Ui, _: &Drawn<'_>) {
        if self.0.stop.asked() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }
}
