//! `sunfleck points`.

use std::io::Write;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use glam::{DQuat, DVec3, Vec3};
use serde_json::json;
use sunfleck::output::{VERSION, atomic};
use sunfleck::points::generate::scan;
use sunfleck::points::{
    Cloud, Indexed, Match, Method, Precision, Registration, Rigid, Settings, automatic_outlier, correspond, estimate,
    io, orient, register,
};

use crate::cli::Usage;
use crate::cli::points::{Common, MakeArgs, MatchArgs, NormalsArgs, PointsArgs, RegisterArgs, Task};

/// Points that normals are estimated from where point-to-plane needs them and none were given.
const REGISTRATION_K: usize = 12;

pub fn run(args: &PointsArgs) -> Result<ExitCode> {
    match &args.task {
        Task::Normals(args) => normals(args),
        Task::Match(args) => matches(args),
        Task::Register(args) => registration(args),
        Task::Make(args) => make(args),
    }?;
    Ok(ExitCode::SUCCESS)
}

impl Common {
    /// Before hours of work, not after them.
    fn check(&self) -> Result<()> {
        if !self.output.extension().is_some_and(|e| e.eq_ignore_ascii_case("ply")) {
            bail!(Usage(format!("-o {}: clouds are written as .ply", self.output.display())));
        }
        atomic::check(&self.output)?;
        crate::devices::use_threads(self.threads)
    }

    fn say(&self, text: &str) {
        if !self.quiet {
            eprintln!("{text}");
        }
    }

    fn read(&self, path: &Path) -> Result<Cloud> {
        let cloud = io::read(path)?;
        self.say(&format!("{}: {} points", path.display(), cloud.len()));
        Ok(cloud)
    }

    fn write(&self, cloud: &Cloud, matches: Option<&[Match]>) -> Result<()> {
        atomic::write(&self.output, |writer| io::write_ply(writer, cloud, matches))?;
        self.say(&format!("wrote {}", self.output.display()));
        Ok(())
    }
}

fn normals(args: &NormalsArgs) -> Result<()> {
    args.common.check()?;
    let mut cloud = args.common.read(&args.input)?;
    let name = || args.input.display().to_string();
    let indexed = Indexed::new(&cloud.positions).with_context(name)?;
    let mut found = estimate(&indexed, args.k).with_context(name)?;
    let pieces = orient(&indexed, &mut found.normals).with_context(name)?;
    crate::print(&format!(
        "normals    {}\npieces     {pieces}\nwithout    {}",
        found.normals.len() - found.undefined,
        found.undefined
    ));
    cloud.normals = Some(found.normals);
    args.common.write(&cloud, None)
}

fn matches(args: &MatchArgs) -> Result<()> {
    args.common.check()?;
    let source = args.common.read(&args.source)?;
    let target = args.common.read(&args.target)?;
    let target = Indexed::new(&target.positions).with_context(|| args.target.display().to_string())?;
    let outlier = args.outlier.unwrap_or_else(|| automatic_outlier(&target));
    let found = correspond(&source.positions, &target, outlier).with_context(|| args.source.display().to_string())?;
    let distances: Vec<f64> = found.iter().filter(|m| m.is_some()).map(|m| m.distance).collect();
    let n = distances.len() as f64;
    crate::print(&format!(
        "matched    {} of {}\noutlier    {}\nmean       {}\nrms        {}\nlargest    {}",
        distances.len(),
        source.len(),
        digits(outlier),
        digits(distances.iter().sum::<f64>() / n.max(1.0)),
        digits((distances.iter().map(|d| d * d).sum::<f64>() / n.max(1.0)).sqrt()),
        digits(distances.iter().copied().fold(0.0, f64::max)),
    ));
    args.common.write(&source, Some(&found))
}

fn registration(args: &RegisterArgs) -> Result<()> {
    args.common.check()?;
    if let Some(path) = &args.json {
        if *path == args.common.output {
            bail!(Usage(format!("{} is named twice", path.display())));
        }
        atomic::check(path)?;
    }
    let mut source = args.common.read(&args.source)?;
    let target = args.common.read(&args.target)?;
    let name = || args.target.display().to_string();
    let indexed = Indexed::new(&target.positions).with_context(name)?;
    let normals = match (args.method, target.normals) {
        (Method::PointToPoint, _) => None,
        (_, Some(normals)) => Some(normals),
        (_, None) => Some(estimate(&indexed, REGISTRATION_K).with_context(name)?.normals),
    };
    let settings = Settings {
        method: args.method,
        outlier: args.outlier,
        iterations: args.iterations as usize,
        ..Settings::default()
    };
    let found = register(&source.positions, &indexed, normals.as_deref(), &settings, |i, fit| {
        args.common.say(&format!(
            "iteration {i:<4} rms {:<13} inliers {:6.2} %  outlier {}",
            digits(fit.rms),
            100.0 * fit.inliers,
            digits(fit.outlier)
        ));
    })
    .with_context(|| format!("{} and {}", args.source.display(), args.target.display()))?;
    report(&found);
    if let Some(path) = &args.json {
        let text = serde_json::to_vec_pretty(&json_of(args, &found))?;
        atomic::write(path, |writer| writer.write_all(&text))?;
        args.common.say(&format!("wrote {}", path.display()));
    }
    source.positions = found.motion.apply_all(&source.positions);
    let rotation = found.motion.rotation.as_quat();
    source.normals.iter_mut().flatten().for_each(|normal: &mut Vec3| *normal = rotation * *normal);
    source.precision = Precision::Double;
    args.common.write(&source, None)
}

fn report(found: &Registration) {
    for row in found.motion.rows() {
        crate::print(&row.map(|x| format!("{x:>23.16e}")).join(" "));
    }
    let Some(last) = found.iterations.last() else { return };
    let plane = last.plane_rms.map_or(String::new(), |rms| format!("\nplane rms  {}", digits(rms)));
    crate::print(&format!(
        "rms        {}{plane}\ninliers    {:.2} %\niterations {}, {}",
        digits(last.rms),
        100.0 * last.inliers,
        found.iterations.len() - 1,
        if found.converged { "converged" } else { "not converged" }
    ));
    if found.free > 0 {
        let n = found.free;
        eprintln!("sunfleck: warning: the surface leaves {n} of 6 motions undetermined (it slides or turns on itself)");
    }
}

fn json_of(args: &RegisterArgs, found: &Registration) -> serde_json::Value {
    let iterations: Vec<_> = found
        .iterations
        .iter()
        .map(|i| json!({"rms": i.rms, "plane_rms": i.plane_rms, "inliers": i.inliers, "outlier": i.outlier}))
        .collect();
    json!({
        "version": VERSION,
        "source": args.source,
        "target": args.target,
        "method": if args.method == Method::PointToPlane { "plane" } else { "point" },
        "matrix": found.motion.rows(),
        "converged": found.converged,
        "undetermined_motions": found.free,
        "iterations": iterations,
    })
}

fn make(args: &MakeArgs) -> Result<()> {
    args.common.check()?;
    let mut cloud = scan(args.shape, args.points as usize, args.noise, args.seed);
    let axis = DVec3::new(1.0, 2.0, 3.0).normalize();
    let turn = DQuat::from_axis_angle(axis, args.turn.to_radians());
    let motion = Rigid { rotation: turn, translation: DVec3::from_array(args.shift.0) };
    if motion != Rigid::IDENTITY {
        cloud.positions = motion.apply_all(&cloud.positions);
        // What was moved far off would be rounded there.
        cloud.precision = Precision::Double;
    }
    crate::print(&format!("points     {}", cloud.len()));
    args.common.write(&cloud, None)
}

/// Six significant ones, whatever the unit.
fn digits(x: f64) -> String {
    if x == 0.0 || (1e-3..1e6).contains(&x.abs()) {
        let places = if x == 0.0 { 0 } else { (5 - x.abs().log10().floor() as i32).max(0) as usize };
        format!("{x:.places$}")
    } else {
        format!("{x:.5e}")
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn digits_do_not_depend_on_the_unit() {
        for (x, text) in [(0.0, "0"), (1.0, "1.00000"), (0.001_234_567, "0.00123457"), (1.5e-9, "1.50000e-9")] {
            assert_eq!(super::digits(x), text);
        }
    }
}
