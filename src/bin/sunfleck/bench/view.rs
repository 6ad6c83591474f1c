//! `sunfleck bench view`: whether the window stays smooth while the heaviest of the shipped scenes renders behind it.
//!
//! A real window is opened, on the display there is, and closed again. It draws as often as the display lets it; the
//! figures are of all its frames, first while the camera rests, then while the pointer turns it for 0.3 s in every 1.2 s.
//! Without a display the same is drawn into a texture, at the pace of one of 60 Hz.
//!
//! Whether the window is smooth is judged by the time from one frame to the next, which has all. What a frame costs the
//! interface thread is what eframe measures: it leaves out where that waits for an image of the display, for the queue
//! and for presenting, and so does not tell when the renderer starves the window there.

use std::time::Duration;

use anyhow::Result;
use clap::Args;
use serde_json::json;

use super::report::{self, Machine, Report, Row};
use super::{Common, Where, backends};
use crate::cli::values::{number, size};
use crate::devices;
use crate::view::measure::{self, Figures, Frames, Plan};
use crate::view::memory;
use crate::view::timing::percentile;

const NOTES: &[&str] = &[
    "interval: from one frame of the window to the next, all waits included: what tells whether the window is smooth",
    "work: of the interface thread, without getting an image of the display, submitting and presenting, where it may be blocked",
    "wait: from an input to the first frame that shows a picture of it, a preview or a whole one",
];

#[derive(Debug, Args)]
pub struct ViewBenchArgs {
    #[command(flatten)]
    common: Common,

    /// File, or name of a shipped scene
    #[arg(long, value_name = "SCENE", default_value = "pool")]
    scene: String,

    /// Change a setting of the scene, as in `sunfleck view`; may be repeated
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,

    /// Of each part, at rest and turning [default: 20]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<f64>,

    /// Size of the window, pixels; that of the picture is changed by `--set size=WxH`
    #[arg(long, value_name = "WxH", value_parser = size, default_value = "1280x720")]
    window: [u32; 2],

    /// Pixels a point: how large the interface is drawn [default: the display's, without one 1]
    #[arg(long, value_name = "FACTOR", value_parser = scale)]
    scale: Option<f32>,

    /// Draw into a texture at 60 Hz: for a machine without a display
    #[arg(long)]
    offscreen: bool,

    #[command(flatten)]
    place: Where,
}

fn seconds(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(s) if (0.1..=3600.0).contains(&s) => Ok(s),
        Ok(_) => Err("must be from 0.1 to 3600".into()),
        Err(_) => Err("not a number".into()),
    }
}

fn scale(text: &str) -> Result<f32, String> {
    match number(text)? {
        s if (0.5..=4.0).contains(&s) => Ok(s),
        _ => Err("must be from 0.5 to 4".into()),
    }
}

pub fn run(args: &ViewBenchArgs) -> Result<()> {
    memory::give_back_large();
    let common = &args.common;
    common.prepare("view", &[])?;
    let backends = backends::names(&args.place.backend);
    let seconds = args.seconds.unwrap_or(if common.quick { 3.0 } else { 20.0 });
    let set = [vec![format!("seed={}", common.seed)], args.set.clone()].concat();
    let plan = Plan {
        scene: args.scene.clone(),
        set,
        seconds,
        size: args.window,
        scale: args.scale,
        offscreen: args.offscreen,
    };
    let mut steps = common.steps(backends.len());
    let mut found = Vec::new();
    for backend in &backends {
        steps.next(&format!("{} on {backend}", plan.scene));
        found.push((backend.as_str(), measure::run(devices::open_backend(backend)?, &plan)?));
    }
    let report = Report {
        name: "view",
        machine: Machine::here(found.iter().map(|(_, figures)| figures.renderer.clone()).collect()),
        settings: json!({
            "quick": common.quick, "scene": plan.scene, "set": plan.set, "seconds": seconds, "window": plan.size,
            "scale": plan.scale, "offscreen": plan.offscreen, "backends": backends,
        }),
        notes: NOTES,
        rows: found.iter().flat_map(|(backend, figures)| rows(backend, figures)).collect(),
    };
    report.write(&common.output)?;
    print(&report.machine, &plan, &found);
    common.say_written(&report, &[]);
    Ok(())
}

/// The two parts and what they are called.
fn parts(figures: &Figures) -> [(&'static str, &Frames, &[Duration]); 2] {
    [("resting", &figures.resting, &[]), ("turning", &figures.turning, &figures.waits)]
}

/// Median, 95th percentile and most, milliseconds; none of nothing.
fn percentiles(times: &[Duration]) -> [Option<f64>; 3] {
    [0.5, 0.95, 1.0].map(|part| {
        let time = percentile(times.iter().copied(), part)?;
        Some((time.as_secs_f64() * 1e6).round() / 1e3)
    })
}

fn rows(backend: &str, figures: &Figures) -> Vec<Row> {
    let of_part = |(part, frames, waits): (&str, &Frames, &[Duration])| {
        let mut row = Row::default()
            .with("backend", backend)
            .with("renderer", figures.renderer.as_str())
            .with("window", figures.window.as_str())
            .with("windowSize", figures.size.map(|side| side.to_string()).join("x"))
            .with("camera", part)
            .with("frames", frames.intervals.len())
            .with("iterations", frames.iterations);
        for (name, times) in [("interval", frames.intervals.as_slice()), ("work", &frames.work), ("wait", waits)] {
            for (suffix, ms) in ["Ms", "Ms95", "MsMost"].iter().zip(percentiles(times)) {
                row = row.with(&format!("{name}{suffix}"), ms);
            }
        }
        row.with("waits", waits.len())
    };
    parts(figures).map(of_part).into()
}

fn print(machine: &Machine, plan: &Plan, found: &[(&str, Figures)]) {
    let header =
        ["renderer", "camera", "frames", "iterations", "frame to frame", "interface thread", "input to picture"];
    let cell = |times: &[Duration]| match percentiles(times).map(|ms| ms.map(report::figure)) {
        [Some(median), Some(most_of), Some(most)] => format!("{median} / {most_of} / {most}"),
        _ => "–".into(),
    };
    let lines = found.iter().flat_map(|(backend, figures)| {
        parts(figures).map(|(part, frames, waits)| {
            let (n, iterations) = (frames.intervals.len().to_string(), frames.iterations.to_string());
            let times = [&frames.intervals, &frames.work, waits].map(cell);
            [(*backend).to_owned(), part.to_owned(), n, iterations].into_iter().chain(times).collect()
        })
    });
    let table = report::table(&header, 2, lines);
    let drawn = found.first().map(|(_, figures)| {
        let [width, height] = figures.size;
        format!("{width}×{height} pixels drawn by {}", figures.window)
    });
    crate::print(&format!(
        "{}\nThe window, {}, while {} renders; milliseconds: median / 95 % within / most\n{table}\n\
         The window is as smooth as “frame to frame” says; “interface thread” leaves out where that waits for the display.",
        machine.line(),
        drawn.unwrap_or_default(),
        plan.scene
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_in_milliseconds() {
        let times: Vec<Duration> = (1..=100).rev().map(Duration::from_millis).collect();
        assert_eq!(percentiles(&times), [Some(50.0), Some(95.0), Some(100.0)]);
        assert_eq!(percentiles(&[]), [None; 3]);
        assert_eq!(percentiles(&[Duration::from_micros(2000)]), [Some(2.0); 3]);
    }
}
