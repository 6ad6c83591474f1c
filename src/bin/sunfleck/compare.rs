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
    let relative = d.relative_mean_difference.map(|share| format!("{:+.4} %", 100.0 * share));
    crate::print(&format!(
        "relMSE             {}\nrelMSE, trimmed    {}\nmean difference    {} ({})\nlargest difference {}",
        digits(d.rel_mse),
        digits(d.rel_mse_trimmed),
        digits(d.mean_difference),
        relative.unwrap_or_else(|| "–".into()),
        digits(d.max_difference),
    ));
    if d.not_finite > 0 {
        crate::print(&format!("not finite         {} of {} pixels, left out", d.not_finite, d.not_finite + d.pixels));
    }
    Ok(ExitCode::SUCCESS)
}

/// Small numbers keep their digits.
fn digits(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 { format!("{x:.3e}") } else { format!("{x:.6}") }
}
