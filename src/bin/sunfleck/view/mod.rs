//! `sunfleck view`: the window that shows a render converge.
//!
//! `engine` renders and paints, and knows nothing of the window; `Viewer` is what is in the window, every panel a function
//! of it; `window` opens it.

mod app;
mod bar;
mod camera;
mod charts;
mod compare;
mod convergence;
mod dialog;
mod engine;
mod exit;
mod failure;
mod files;
mod focus;
mod help;
mod inspect;
mod keys;
pub mod measure;
pub mod memory;
mod messages;
mod offscreen;
mod picture;
mod remembered;
mod settings;
mod signals;
mod start;
mod state;
#[cfg(test)]
mod tests;
pub mod timing;
mod window;

use std::process::ExitCode;

use anyhow::Result;

use crate::cli::ViewArgs;
use crate::devices;
use crate::progress::Progress;
use app::Viewer;

pub fn run(args: &ViewArgs) -> Result<ExitCode> {
    memory::give_back_large();
    devices::use_threads(args.device.threads)?;
    let device = devices::open(&args.device, &Progress::new(false))?;
    let first = app::First::resolve(args)?;
    let bell = window::Bell::default();
    let engine = engine::Engine::start(device, bell.wake())?;
    let mut viewer = Viewer::new(engine, bell.wake(), first);
    let mut signals = signals::Signals::install(&viewer, bell.wake())?;
    window::run(&mut viewer, &bell, window::options, &mut signals)?;
    Ok(signals.end())
}
