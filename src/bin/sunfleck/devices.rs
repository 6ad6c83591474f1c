//! Where to compute.

use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use sunfleck::ppm::Stages;

use crate::cli::RenderArgs;
use crate::job::Input;
use crate::progress::Progress;

/// A backend ready to render.
pub struct Opened {
    pub stages: Box<dyn Stages>,
    /// `cpu` or `gpu`.
    pub backend: &'static str,
}

/// Limits the CPU's threads.
pub fn use_threads(threads: Option<u16>) -> Result<()> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    builder.build_global().context("cannot start the threads")
}

/// Opens the backend that was asked for.
pub fn open(args: &RenderArgs, input: &Input, _progress: &Progress) -> Result<Opened> {
    if args.backend == "gpu" {
        bail!("no GPU yet");
    }
    Ok(Opened { stages: Box::new(crate::shim::Gradient::new(&input.params)), backend: "cpu" })
}

/// `--list-devices`.
pub fn list() -> Result<ExitCode> {
    Ok(ExitCode::SUCCESS)
}
