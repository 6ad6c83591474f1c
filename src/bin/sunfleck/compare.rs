//! `sunfleck compare`.

use std::process::ExitCode;

use anyhow::{Result, anyhow};
use sunfleck::output;

use crate::cli::CompareArgs;

pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    let picture = output::exr::read(&args.picture)?;
    let reference = output::exr::read(&args.reference)?;
    let d = output::compare::compare(&picture, &reference)
        .map_err(|e| anyhow!("{} and {}: {e}", args.picture.display(), args.reference.display()))?;
    if args.json {
        crate::print(&serde_json::to_string_pretty(&d)?);
        return Ok(ExitCode::SUCCESS);
    }
    crate::print(&format!(
        "relMSE             {:.6}\nrelMSE, trimmed    {:.6}\nmean difference    {:+.6} ({:+.3} %)\nlargest difference {:.6}",
        d.rel_mse,
        d.rel_mse_trimmed,
        d.mean_difference,
        100.0 * d.relative_mean_difference,
        d.max_difference,
    ));
    if d.not_finite > 0 {
        crate::print(&format!("not finite         {} of {} pixels, left out", d.not_finite, d.not_finite + d.pixels));
    }
    Ok(ExitCode::SUCCESS)
}
