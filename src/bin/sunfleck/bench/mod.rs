//! `sunfleck bench`: the evaluation of Evangelou, Papaioannou, Vardis & Vasilakis 2021, "Fast Radius Search Exploiting
//! Ray-Tracing Frameworks" (JCGT 10(1)), made again on the machine at hand; `bench kd` that of a thesis on kd-trees.
//!
//! What each figure and table of the paper shows, and where ours departs from it, is said in the module that makes it.
//! Common to all of them: the paper timed OptiX 7.2 against the GPU version of FLANN on an RTX 2080 Ti; here the library's
//! own indices are timed against each other on what is at hand. A figure of the paper beside ours shows how far two
//! machines and two programs are apart, not which method is better.
//!
//! Every figure is the median of several rounds after one that does not count, in which the indices take turns (A B A B);
//! least and most are written beside it, CPU seconds beside those of the wall clock; a GPU's times are its own timestamps. Every timed answer is compared with
//! the right number of neighbours, which another index and, for some queries, brute force have counted before.

mod backends;
mod contest;
mod entrants;
mod figures_kd;
mod gathers;
mod indices;
mod kd;
mod measure;
mod paper;
mod photons;
mod plot;
mod points;
mod report;
mod search;
mod sorted;
mod thesis;
#[cfg(feature = "view")]
mod view;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use sunfleck::output::atomic;
use sunfleck::scene::settings::parse_count;

use crate::progress;
use report::Report;

const EXAMPLES: &str = "\
Examples:
  sunfleck bench search --quick -o results
      Radius search on uniform and clustered points, in less than a minute.
  sunfleck bench search --threads 1 --rounds 9 -o results
      All of it, which takes its time.
  sunfleck bench photons --iterations 5 -o results
      The paper's Table 1 on this machine; its 50 iterations take hours without a GPU.
  sunfleck bench kd --mesh eros.obj -o results
      Builders of kd-trees in the mesh check, over a mesh split and simplified from 1,000 to 140,296 faces.
  sunfleck bench view --backend gpu -o results
      Whether the window stays smooth; --offscreen where there is no display.

Into the folder go NAME.json, NAME.csv and an .svg for each figure; the tables are printed too.";

#[derive(Debug, Args)]
#[command(after_help = EXAMPLES, arg_required_else_help = false)]
pub struct BenchArgs {
    /// What to measure
    #[command(subcommand)]
    benchmark: Benchmark,
}

#[derive(Debug, Subcommand)]
enum Benchmark {
    /// Radius search on uniform and on clustered points (Figures 3 to 6 of the paper)
    Search(search::SearchArgs),
    /// Nearest neighbours in point clouds (Figure 7 of the paper)
    Points(points::PointsArgs),
    /// Build and gather of photons in four scenes (Figure 9 and Table 1 of the paper)
    Photons(photons::PhotonsArgs),
    /// The library's indices and build options side by side
    Indices(indices::IndicesArgs),
    /// kd-trees over triangles in the mesh check (Figures 7.2 to 7.8 of the thesis on them)
    Kd(kd::KdArgs),
    /// Frames of the window while the heaviest shipped scene renders behind it
    #[cfg(feature = "view")]
    View(view::ViewBenchArgs),
}

/// Of the benchmarks that search on several devices.
#[derive(Debug, Args)]
struct Where {
    /// Where to search, side by side [default: cpu, and gpu where a real one is]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = backends::NAMES)]
    backend: Vec<String>,
}

/// What all benchmarks understand.
#[derive(Debug, Args)]
struct Common {
    /// Folder for the results; made if it is not there
    #[arg(short, long, value_name = "FOLDER", default_value = "bench")]
    output: PathBuf,

    /// Smaller and in less than a minute: to see that it works
    #[arg(long)]
    quick: bool,

    /// CPU threads [default: all]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    /// Of the random numbers
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 0)]
    seed: u32,

    /// Say nothing but errors while measuring
    #[arg(short, long)]
    quiet: bool,
}

#[derive(Debug, Args)]
struct Rounds {
    /// Rounds that count, after one that does not
    #[arg(long, value_name = "N", allow_hyphen_values = true, default_value_t = 5, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    rounds: u32,
}

pub fn run(args: &BenchArgs) -> Result<ExitCode> {
    match &args.benchmark {
        Benchmark::Search(args) => search::run(args)?,
        Benchmark::Points(args) => points::run(args)?,
        Benchmark::Photons(args) => photons::run(args)?,
        Benchmark::Indices(args) => indices::run(args)?,
        Benchmark::Kd(args) => kd::run(args)?,
        #[cfg(feature = "view")]
        Benchmark::View(args) => view::run(args)?,
    }
    Ok(ExitCode::SUCCESS)
}

impl Common {
    /// Makes sure that everything can be written, before anything slow.
    fn prepare(&self, name: &str, figures: &[PathBuf]) -> Result<()> {
        let folder = &self.output;
        std::fs::create_dir_all(folder).with_context(|| format!("cannot make the folder {}", folder.display()))?;
        for path in Report::files(folder, name).iter().chain(figures) {
            atomic::check(path)?;
        }
        crate::devices::use_threads(self.threads)?;
        if cfg!(debug_assertions) && !self.quiet {
            eprintln!("sunfleck: warning: this is not a release build (cargo build --release): it is slower");
        }
        Ok(())
    }

    /// The file of a figure.
    fn figure(&self, name: &str) -> PathBuf {
        self.output.join(format!("{name}.svg"))
    }

    /// Counts to `n` on standard error.
    fn steps(&self, n: usize) -> Steps {
        Steps { done: 0, n, began: Instant::now(), quiet: self.quiet }
    }

    fn say_written(&self, report: &Report, figures: &[PathBuf]) {
        if !self.quiet {
            let [json, csv] = Report::files(&self.output, report.name);
            let files: Vec<_> = [&json, &csv].into_iter().chain(figures).map(|p| p.display().to_string()).collect();
            eprintln!("wrote {}", files.join(", "));
        }
    }
}

/// How far a benchmark is: one line a step on standard error.
struct Steps {
    done: usize,
    n: usize,
    began: Instant,
    quiet: bool,
}

impl Steps {
    /// Before a step.
    fn next(&mut self, what: &str) {
        self.done += 1;
        if self.quiet {
            return;
        }
        let spent = progress::seconds(self.began.elapsed().as_secs_f64());
        eprintln!("[{}/{}, {spent}] {what}", self.done, self.n);
    }
}

/// A positive length.
fn length(text: &str) -> Result<f32, String> {
    match text.trim().parse::<f32>() {
        Ok(r) if r > 0.0 && r.is_finite() => Ok(r),
        Ok(_) => Err("must be above 0".into()),
        Err(_) => Err("not a number".into()),
    }
}

/// Points, queries or faces, at most: every index over as many, side by side, still fits into a large machine.
const MOST: u32 = 20_000_000;

/// How many points.
fn count(text: &str) -> Result<usize, String> {
    match parse_count(text)? {
        n if n <= MOST => Ok(n as usize),
        _ => Err("at most 20M".into()),
    }
}

/// "100K", "2M".
fn short(n: usize) -> String {
    match n {
        0..1000 => n.to_string(),
        1000..100_000 if !n.is_multiple_of(100) => n.to_string(),
        1000..1_000_000 => format!("{}K", n as f64 / 1e3),
        _ => format!("{}M", n as f64 / 1e6),
    }
}
