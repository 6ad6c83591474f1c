//! `sunfleck compare`.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use sunfleck::output::{self, Picture};

use crate::cli::CompareArgs;

pub fn run(args: &CompareArgs) -> Result<ExitCode> {
    let picture = output::exr::read(&args.picture)?;
    let reference = output::exr::read(&args.reference)?;
    let d = output::compare::compare(&picture, &reference).map_err(|e| {
        let files = [(&args.picture, &picture), (&args.reference, &reference)];
        let windows: String = match picture.crop == reference.crop {
            true => String::new(),
            false => files.iter().map(|(path, picture)| in_file(path, picture)).collect(),
        };
        anyhow!("{} and {}: {e}{windows}", args.picture.display(), args.reference.display())
    })?;
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

/// The data window as the file has it, if not all of it is displayed, or the picture begins elsewhere.
fn in_file(path: &Path, picture: &Picture) -> String {
    match output::exr::data_window(path) {
        Ok([x0, y0, x1, y1]) if [x0, y0, x1, y1] != picture.crop.map(i64::from) => {
            format!("; the file {} has data from ({x0}, {y0}) to ({x1}, {y1})", path.display())
        }
        _ => String::new(),
    }
}

/// Small numbers keep their digits.
fn digits(x: f64) -> String {
    if x != 0.0 && x.abs() < 1e-3 { format!("{x:.3e}") } else { format!("{x:.6}") }
}
