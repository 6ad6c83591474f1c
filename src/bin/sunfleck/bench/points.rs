//! `sunfleck bench points`: Figure 7 of the paper, the searches under its geometry tasks.
//!
//! **Figure 7** is a table: milliseconds to build and to search, OptiX and FLANN, for four point clouds. With k = 1 a random
//! half of the cloud asks for its nearest neighbours in the other half (registration); with k = 4 and k = 8 every point is
//! query and sample (normals, the point itself among the k). The radius is tuned so that a query has k neighbours on
//! average, and k are stored at most.
//!
//! Where ours departs:
//! - The clouds are made by code as a scanner would see them ([`sunfleck::points::generate`]), with as many points.
//! - In place of FLANN's kd-tree stands our own ([`KD`]), in place of OptiX our own binary tree over boxes as wide as the
//!   radius ([`METHOD`]). All of ours return the k in order of their distance; the paper's are in none.
//! - "One on average" of k = 1 is the mean over the queries of the number of samples within the radius.

use anyhow::Result;
use clap::Args;
use glam::Vec3;
use serde_json::json;
use sunfleck::math::clouds;
use sunfleck::points::generate::{Shape, scan};

use super::backends::{self, Backends};
use super::contest::{self, Operation, Question, Score};
use super::entrants::{self, KD, METHOD};
use super::plot::{self, Bars};
use super::report::{self, Machine, Report, Row};
use super::{Common, Rounds, Where, count, paper, short};

const NOTES: &[&str] = &[
    "operation: the k nearest within the radius, k = 1: one half of the cloud in the other, k = 4 and 8: all in all",
    "radius: finds k neighbours a query on average; the clouds are about 2 across",
];

/// Standard deviation of the scanners' error; the surface is about 2 across.
const NOISE: f64 = 5e-4;

const TASKS: [usize; 3] = [1, 4, 8];

#[derive(Debug, Args)]
pub struct PointsArgs {
    #[command(flatten)]
    common: Common,

    #[command(flatten)]
    rounds: Rounds,

    #[command(flatten)]
    place: Where,

    /// Sizes of the clouds [default: the paper's, 100k,350k,500k,1M]
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = count)]
    points: Vec<usize>,
}

/// One index on one cloud, one k.
struct Cell {
    points: usize,
    samples: usize,
    queries: usize,
    k: usize,
    radius: f32,
    mean: f64,
    index: &'static str,
    score: Score,
}

impl Cell {
    fn row(&self) -> Row {
        Row::default()
            .with("points", self.points)
            .with("k", self.k)
            .with("samples", self.samples)
            .with("queries", self.queries)
            .with_length("radius", self.radius)
            .with("foundPerQuery", self.mean)
            .with("index", self.index)
            .with_times("build", &self.score.build)
            .with_times("search", &self.score.search[0])
    }

    /// Build and search, milliseconds.
    fn ms(&self) -> [f64; 2] {
        [&self.score.build, &self.score.search[0]].map(|times| 1e3 * times.wall().median)
    }
}

pub fn run(args: &PointsArgs) -> Result<()> {
    let common = &args.common;
    let sizes: Vec<usize> = match (args.points.as_slice(), common.quick) {
        ([], true) => vec![50_000, paper::FIGURE_7[0].0],
        ([], false) => paper::FIGURE_7.iter().map(|row| row.0).collect(),
        (some, _) => some.to_vec(),
    };
    let figure = [common.figure("figure7")];
    common.prepare("points", &figure)?;
    let names = backends::names(&args.place.backend);
    let places = Backends::open(&names)?;
    let mut steps = common.steps(sizes.len() * TASKS.len());
    let mut cells = Vec::new();
    for &n in &sizes {
        let cloud = scan(Shape::Bumpy, n, NOISE, common.seed);
        let all: Vec<Vec3> = cloud.positions.iter().map(|p| p.as_vec3()).collect();
        let mut mixed = all.clone();
        clouds::shuffle(&mut mixed, common.seed);
        for k in TASKS {
            steps.next(&format!("{} points, k = {k}", short(n)));
            let (queries, samples) = if k == 1 { mixed.split_at(n / 2) } else { (&all[..], &all[..]) };
            let radius = contest::radius_for(samples, queries, k as f64)?;
            let question = Question::new(samples, queries, radius, Operation::Nearest(k))?;
            let mut entrants = places.entrants(samples, entrants::nearest)?;
            let scores = contest::run(&mut entrants, radius, std::slice::from_ref(&question), args.rounds.rounds)?;
            cells.extend(entrants.iter().zip(scores).map(|(entrant, score)| Cell {
                points: n,
                samples: samples.len(),
                queries: queries.len(),
                k,
                radius,
                mean: question.mean(),
                index: entrant.name(),
                score,
            }));
        }
    }
    let report = Report {
        name: "points",
        machine: Machine::here(places.devices()),
        settings: json!({
            "quick": common.quick, "rounds": args.rounds.rounds, "seed": common.seed, "backends": names, "points": sizes, "noise": NOISE,
        }),
        notes: NOTES,
        rows: cells.iter().map(Cell::row).collect(),
    };
    report.write(&common.output)?;
    draw(&figure[0], &sizes, &cells)?;
    print(&report.machine, &sizes, &cells);
    common.say_written(&report, &figure);
    Ok(())
}

fn draw(path: &std::path::Path, sizes: &[usize], cells: &[Cell]) -> Result<()> {
    let panels = TASKS.map(|k| Bars {
        title: format!("k = {k}"),
        y: "ms",
        parts: vec!["build", "search"],
        groups: sizes
            .iter()
            .map(|&n| {
                let bars = cells.iter().filter(|c| (c.points, c.k) == (n, k));
                (short(n), bars.map(|c| (c.index.to_owned(), c.ms().to_vec())).collect())
            })
            .collect(),
    });
    plot::bars(path, "Figure 7: nearest neighbours in point clouds", &panels, panels.len())
}

fn print(machine: &Machine, sizes: &[usize], cells: &[Cell]) {
    let mut header = vec!["points", "k", "radius"];
    let mut lines = Vec::new();
    for &n in sizes {
        for k in TASKS {
            let mut line = vec![short(n), k.to_string()];
            for cell in cells.iter().filter(|c| (c.points, c.k) == (n, k)) {
                if line.len() == 2 {
                    line.push(report::figure(f64::from(cell.radius)));
                }
                if lines.is_empty() {
                    header.push(cell.index);
                }
                let [build, search] = cell.ms().map(report::figure);
                line.push(format!("{build} / {search}"));
            }
            line.extend(paper::columns(paper::figure_7(n, k)));
            lines.push(line);
        }
    }
    header.extend(paper::HEADINGS);
    crate::print(&format!(
        "\nFigure 7: build / search, wall ms. Ours ({METHOD} is the paper's method, {KD} stands for its rival): {}. The \
         paper's: {}, scans with as many points.\n{}",
        machine.line(),
        paper::DEVICE,
        report::table(&header, 0, lines),
    ));
}
