//! Ctrl-C and SIGTERM: the picture is saved, and the window closed; a second one ends the program at once.

use std::process::ExitCode;
use std::sync::Arc;
use std::thread::Builder;
use std::time::Duration;

use anyhow::Result;
use eframe::egui;

use super::app::Viewer;
use super::engine::Wake;
use super::window::{Drawn, Guest, rescue};
use crate::stop::Stop;

/// Between looks at whether one has come.
const LOOK_EVERY: Duration = Duration::from_millis(100);
/// A window that nobody sees may draw no frame in which it could close.
const PATIENCE: Duration = Duration::from_secs(3);
/// Of rendering, seconds: what has taken longer is saved, though nobody said where.
const WORTH_KEEPING: f64 = 60.0;

/// Closes the window.
pub struct Signals(Arc<Stop>);

impl Signals {
    /// Takes them over; `wake` asks for a frame.
    pub fn install(wake: Wake) -> Result<Self> {
        let stop = Arc::new(Stop::install()?);
        let asked = Arc::downgrade(&stop);
        Builder::new().name("signals".to_owned()).spawn(move || {
            while let Some(stop) = asked.upgrade() {
                if stop.asked() {
                    wake();
                    std::thread::sleep(PATIENCE);
                    if asked.strong_count() > 1 {
                        // The picture is saved on the way out, as when the display is gone.
                        std::process::exit(i32::from(crate::INTERRUPTED));
                    }
                }
                drop(stop);
                std::thread::sleep(LOOK_EVERY);
            }
        })?;
        Ok(Self(stop))
    }

    /// After the window: saves what was worth it, if it was closed by a signal.
    pub fn end(&self, viewer: &Viewer) -> ExitCode {
        if !self.0.asked() {
            return ExitCode::SUCCESS;
        }
        let spent = viewer.now.frame.as_ref().map_or(0.0, |frame| frame.seconds);
        if viewer.place().is_some() || spent >= WORTH_KEEPING {
            match rescue(&viewer.last_save(), viewer.engine().writer()) {
                Some(path) => eprintln!("saved the picture as {}", path.display()),
                None => crate::say_error("the picture was not saved: there is none yet, or no place for it"),
            }
        }
        ExitCode::from(crate::INTERRUPTED)
    }
}

impl Guest for Signals {
    fn after_frame(&mut self, _: &Viewer, ui: &egui::Ui, _: &Drawn<'_>) {
        if self.0.asked() {
            ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
        }
    }
}
