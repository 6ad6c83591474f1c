//! `sunfleck view`: the window that shows a render converge.
//!
//! `engine` renders and paints, and knows nothing of the window; `Viewer` is the window; every panel is a function of it.

mod app;
mod bar;
mod camera;
mod charts;
mod compare;
mod convergence;
mod engine;
mod failure;
mod files;
mod help;
mod inspect;
mod keys;
mod picture;
mod settings;
mod start;
mod state;
#[cfg(test)]
mod tests;
mod timing;

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Result, anyhow};
use eframe::egui;

use crate::cli::ViewArgs;
use crate::devices;
use crate::progress::Progress;
use app::Viewer;

/// Where eframe keeps what is remembered, and what the window manager knows the window by.
const APP_ID: &str = "sunfleck";

/// What the windowing library says, without the line of its source that it says first.
fn no_window(error: &eframe::Error) -> anyhow::Error {
    let text = error.to_string();
    let words =
        text.rsplit_once(".rs:").and_then(|(_, rest)| rest.split_once(": ")).map_or(text.as_str(), |(_, words)| words);
    anyhow!("no window: {}", words.trim_end_matches('.'))
}

pub fn run(args: &ViewArgs) -> Result<ExitCode> {
    devices::use_threads(args.device.threads)?;
    let device = devices::open(&args.device, &Progress::new(false))?;
    let first = app::First::resolve(args)?;
    let options = eframe::NativeOptions {
        viewport: egui::ViewportBuilder::default()
            .with_app_id(APP_ID)
            .with_title("Sunfleck")
            .with_inner_size([1280.0, 720.0])
            .with_min_inner_size([480.0, 320.0])
            .with_drag_and_drop(true),
        renderer: eframe::Renderer::Wgpu,
        ..Default::default()
    };
    eframe::run_native(
        APP_ID,
        options,
        Box::new(|creation| {
            let context = creation.egui_ctx.clone();
            let wake: engine::Wake = Arc::new(move || context.request_repaint());
            let engine = engine::Engine::start(device, Arc::clone(&wake))?;
            Ok(Box::new(Viewer::new(creation.storage, engine, wake, first)))
        }),
    )
    .map_err(|error| no_window(&error))?;
    Ok(ExitCode::SUCCESS)
}
