//! `sunfleck bench search`: Figures 3 to 6 of the paper, radius search on random points.
//!
//! **Figures 3 (uniform samples) and 5 (eight spherical Gaussian modes)** are maps of the speed-up over FLANN, samples
//! against queries, one for each radius (given as a share of the side of the samples' box), low density (10⁴ to 10⁵
//! samples) above high density (10⁵ to 10⁶). **Figures 4 and 6** plot the time over the radius for 2¹⁵ queries, low
//! density beside high density. Queries are always uniform. All neighbours of every query are stored, with distances, in
//! rows whose length, the most neighbours of any query, is found beforehand and not timed.
//!
//! Where ours departs:
//! - The text gives no radii, and neither the modes' places nor their width: ours are in [`Plan::new`] and in
//!   [`sunfleck::math::clouds`].
//! - In place of FLANN's kd-tree stands our own with the same buffers, [`RIVAL`]; in place of OptiX our own binary tree
//!   over boxes as wide as the radius, [`METHOD`]. The other indices store compressed rows, found by counting first.
//! - Where the buffers would take more than 512 MiB, the queries come in several calls, for all indices alike.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use glam::Vec3;
use serde_json::json;
use sunfleck::math::clouds;

use super::backends::{self, Backends};
use super::contest::{self, Operation, Question, Score};
use super::entrants::{self, DEFAULT, METHOD, RIVAL};
use super::plot::{self, Curves, Map, Series};
use super::report::{self, Machine, Report, Row};
use super::{Common, Rounds, Where, count, length, paper, short};

const NOTES: &[&str] = &[
    "operation: all neighbours of every query are stored with their squared distances",
    "radius: in sides of the unit cube that holds samples and queries; queries are uniform",
    "the paper's text gives no figures for its plots, so none stand here",
];

#[derive(Debug, Args)]
pub struct SearchArgs {
    #[command(flatten)]
    common: Common,

    #[command(flatten)]
    rounds: Rounds,

    #[command(flatten)]
    place: Where,

    /// Numbers of samples, instead of the paper's low and high density
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = count)]
    samples: Vec<usize>,

    /// Numbers of queries [default: those of the samples]
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = count)]
    queries: Vec<usize>,

    /// Radii, in sides of the unit cube
    #[arg(long, value_name = "R,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = length)]
    radii: Vec<f32>,

    /// Only these distributions of the samples
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = ["uniform", "gaussian"])]
    distribution: Vec<String>,
}

/// How samples are spread.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Distribution {
    Uniform,
    Gaussian,
}

impl Distribution {
    fn name(self) -> &'static str {
        match self {
            Self::Uniform => "uniform",
            Self::Gaussian => "gaussian",
        }
    }

    fn samples(self, n: usize, seed: u32) -> Vec<Vec3> {
        match self {
            Self::Uniform => clouds::uniform(n, seed),
            Self::Gaussian => clouds::gaussian_modes(n, seed),
        }
    }

    /// Of its maps, and of its curves.
    fn figures(self) -> [u32; 2] {
        match self {
            Self::Uniform => [3, 4],
            Self::Gaussian => [5, 6],
        }
    }
}

/// Samples of one density, and what is asked of them.
struct Density {
    name: &'static str,
    samples: Vec<usize>,
    queries: Vec<usize>,
    /// Of the maps.
    radii: Vec<f32>,
    /// Of the curves, which are over the most samples.
    sweep: Vec<f32>,
    /// Queries of the curves.
    sweep_queries: usize,
}

struct Plan {
    distributions: Vec<Distribution>,
    densities: Vec<Density>,
}

impl Plan {
    fn new(args: &SearchArgs) -> Self {
        let named = |d: &Distribution| args.distribution.is_empty() || args.distribution.iter().any(|n| n == d.name());
        let distributions = [Distribution::Uniform, Distribution::Gaussian].into_iter().filter(named).collect();
        let mut densities = if args.common.quick { quick() } else { full() };
        if !args.samples.is_empty() {
            densities.truncate(1);
            densities[0].name = "given";
            densities[0].samples.clone_from(&args.samples);
            densities[0].queries.clone_from(&args.samples);
        }
        for density in &mut densities {
            if !args.queries.is_empty() {
                density.queries.clone_from(&args.queries);
                density.sweep_queries = args.queries.iter().copied().max().unwrap_or(0);
            }
            if !args.radii.is_empty() {
                density.radii.clone_from(&args.radii);
                density.sweep.clone_from(&args.radii);
            }
            for list in [&mut density.samples, &mut density.queries] {
                list.sort_unstable();
                list.dedup();
            }
            for list in [&mut density.radii, &mut density.sweep] {
                list.sort_unstable_by(f32::total_cmp);
                list.dedup();
            }
        }
        Self { distributions, densities }
    }

    fn figures(&self, common: &Common) -> Vec<PathBuf> {
        let numbers = self.distributions.iter().flat_map(|d| d.figures());
        numbers.map(|n| common.figure(&format!("figure{n}"))).collect()
    }

    fn steps(&self) -> usize {
        let of = |d: &Density| d.samples.len() * d.radii.len() + d.sweep.len();
        self.distributions.len() * self.densities.iter().map(of).sum::<usize>()
    }
}

fn full() -> Vec<Density> {
    let low = [10_000, 25_000, 50_000, 100_000];
    let high = low.map(|n| 10 * n);
    vec![
        Density {
            name: "low",
            samples: low.to_vec(),
            queries: low.to_vec(),
            radii: vec![0.01, 0.03, 0.1],
            sweep: vec![0.005, 0.01, 0.02, 0.05, 0.1, 0.2],
            sweep_queries: 1 << 15,
        },
        Density {
            name: "high",
            samples: high.to_vec(),
            queries: high.to_vec(),
            radii: vec![0.003, 0.01, 0.03],
            sweep: vec![0.002, 0.005, 0.01, 0.02, 0.05],
            sweep_queries: 1 << 15,
        },
    ]
}

fn quick() -> Vec<Density> {
    let small = |name, n: [usize; 2], radii: [f32; 2], sweep: [f32; 3]| Density {
        name,
        samples: n.to_vec(),
        queries: n.map(|n| n.min(20_000)).to_vec(),
        radii: radii.to_vec(),
        sweep: sweep.to_vec(),
        sweep_queries: 1 << 13,
    };
    vec![
        small("low", [10_000, 30_000], [0.02, 0.05], [0.01, 0.03, 0.1]),
        small("high", [100_000, 300_000], [0.005, 0.02], [0.005, 0.01, 0.02]),
    ]
}

/// One index, one number of samples, one radius, one number of queries.
struct Cell {
    distribution: Distribution,
    density: &'static str,
    /// 3 to 6.
    figure: u32,
    index: &'static str,
    samples: usize,
    queries: usize,
    radius: f32,
    mean: f64,
    most: usize,
    calls: usize,
    /// One time for each question.
    score: Score,
}

impl Cell {
    fn search_ms(&self) -> f64 {
        1e3 * self.score.search[0].wall().median
    }

    fn row(&self) -> Row {
        Row::default()
            .with("figure", self.figure)
            .with("distribution", self.distribution.name())
            .with("density", self.density)
            .with("samples", self.samples)
            .with("queries", self.queries)
            .with_length("radius", self.radius)
            .with("index", self.index)
            .with("neighboursPerQuery", self.mean)
            .with("mostNeighbours", self.most)
            .with("calls", self.calls)
            .with_times("build", &self.score.build)
            .with_times("search", &self.score.search[0])
    }
}

pub fn run(args: &SearchArgs) -> Result<()> {
    let common = &args.common;
    let plan = Plan::new(args);
    let figures = plan.figures(common);
    common.prepare("search", &figures)?;
    let names = backends::names(&args.place.backend);
    let places = Backends::open(&names)?;
    let mut steps = common.steps(plan.steps());
    let mut cells = Vec::new();
    for &distribution in &plan.distributions {
        let [map, curves] = distribution.figures();
        for density in &plan.densities {
            let mut measure = |figure: u32, samples: &[Vec3], queries: &[Vec3], counts: &[usize], radius: f32| {
                steps.next(&format!("{}, {} samples, radius {radius}", distribution.name(), short(samples.len())));
                let questions = counts
                    .iter()
                    .map(|&n| Question::new(samples, &queries[..n], radius, Operation::Store))
                    .collect::<Result<Vec<_>>>()?;
                let mut entrants = places.entrants(samples, entrants::radius_search)?;
                let scores = contest::run(&mut entrants, radius, &questions, args.rounds.rounds)?;
                for (entrant, score) in entrants.iter().zip(scores) {
                    cells.extend(questions.iter().zip(score.search).map(|(question, search)| Cell {
                        distribution,
                        density: density.name,
                        figure,
                        index: entrant.name(),
                        samples: samples.len(),
                        queries: question.queries.len(),
                        radius,
                        mean: question.mean(),
                        most: question.most,
                        calls: question.batches().count(),
                        score: Score { build: score.build.clone(), search: vec![search] },
                    }));
                }
                Ok::<(), anyhow::Error>(())
            };
            let most = density.queries.iter().copied().max().unwrap_or(0).max(density.sweep_queries);
            // Another seed: queries are not samples.
            let queries = clouds::uniform(most, !common.seed);
            for &n in &density.samples {
                let samples = distribution.samples(n, common.seed);
                for &radius in &density.radii {
                    measure(map, &samples, &queries, &density.queries, radius)?;
                }
                if Some(&n) == density.samples.last() {
                    for &radius in &density.sweep {
                        measure(curves, &samples, &queries, &[density.sweep_queries], radius)?;
                    }
                }
            }
        }
    }
    let report = Report {
        name: "search",
        machine: Machine::here(places.devices()),
        settings: json!({
            "quick": common.quick,
            "rounds": args.rounds.rounds,
            "seed": common.seed,
            "backends": names,
            "distributions": plan.distributions.iter().map(|d| d.name()).collect::<Vec<_>>(),
        }),
        notes: NOTES,
        rows: cells.iter().map(Cell::row).collect(),
    };
    report.write(&common.output)?;
    for &distribution in &plan.distributions {
        let [map, curves] = distribution.figures().map(|n| common.figure(&format!("figure{n}")));
        draw_maps(&map, distribution, &plan, &cells)?;
        draw_curves(&curves, distribution, &plan, &cells)?;
    }
    print(&report.machine, &plan, &cells);
    common.say_written(&report, &figures);
    Ok(())
}

/// The one cell of an index that these numbers belong to, milliseconds of search.
fn find(cells: &[Cell], figure: u32, index: &str, density: &str, at: (usize, usize, f32)) -> f64 {
    let fits = |c: &&Cell| {
        c.figure == figure && c.index == index && c.density == density && (c.samples, c.queries, c.radius) == at
    };
    cells.iter().find(fits).map_or(f64::NAN, Cell::search_ms)
}

fn draw_maps(path: &std::path::Path, distribution: Distribution, plan: &Plan, cells: &[Cell]) -> Result<()> {
    let [figure, _] = distribution.figures();
    let mut panels = Vec::new();
    let columns = plan.densities.iter().map(|d| d.radii.len()).max().unwrap_or(1);
    let taking_part = |index: &&str| cells.iter().any(|c| c.index == *index);
    for index in [METHOD, DEFAULT, "gpu-hardware", "gpu"].into_iter().filter(taking_part) {
        for density in &plan.densities {
            let of =
                |samples, queries, radius, index| find(cells, figure, index, density.name, (samples, queries, radius));
            panels.extend(density.radii.iter().map(|&radius| {
                Map {
                    title: format!("{index}, {} density, radius {radius}", density.name),
                    x: "samples",
                    y: "queries",
                    columns: density.samples.iter().copied().map(short).collect(),
                    rows: density.queries.iter().copied().map(short).collect(),
                    ratios: density
                        .queries
                        .iter()
                        .map(|&q| {
                            density.samples.iter().map(|&s| of(s, q, radius, RIVAL) / of(s, q, radius, index)).collect()
                        })
                        .collect(),
                }
            }));
        }
    }
    let title = format!("Figure {figure}: search time of {RIVAL} over that of …, {} samples", distribution.name());
    plot::maps(path, &title, &panels, columns)
}

fn draw_curves(path: &std::path::Path, distribution: Distribution, plan: &Plan, cells: &[Cell]) -> Result<()> {
    let [_, figure] = distribution.figures();
    let panel = |density: &Density| {
        let of = |c: &&Cell| c.figure == figure && c.distribution == distribution && c.density == density.name;
        let mut series: Vec<Series> = Vec::new();
        for cell in cells.iter().filter(of) {
            let point = (f64::from(cell.radius), cell.search_ms());
            match series.iter_mut().find(|s| s.name == cell.index) {
                Some(series) => series.points.push(point),
                None => series.push(Series { name: cell.index.to_owned(), points: vec![point] }),
            }
        }
        let samples = short(density.samples.last().copied().unwrap_or(0));
        Curves {
            title: format!("{samples} samples, {} queries", density.sweep_queries),
            x: "radius / side",
            y: "search, ms",
            series,
        }
    };
    let panels: Vec<Curves> = plan.densities.iter().map(panel).collect();
    let title = format!("Figure {figure}: search over the radius, {} samples", distribution.name());
    plot::curves(path, &title, &panels, panels.len())
}

/// Maps: of the numbers that are both of samples and of queries, only as many queries as samples; the rest is in the files.
fn print(machine: &Machine, plan: &Plan, cells: &[Cell]) {
    for &distribution in &plan.distributions {
        for figure in distribution.figures() {
            let mut indices: Vec<&str> = Vec::new();
            let mut rows: Vec<(&Cell, Vec<String>)> = Vec::new();
            for cell in cells.iter().filter(|c| c.figure == figure) {
                if !indices.contains(&cell.index) {
                    indices.push(cell.index);
                }
                let same = |c: &Cell| {
                    (c.density, c.samples, c.queries, c.radius)
                        == (cell.density, cell.samples, cell.queries, cell.radius)
                };
                let times = format!("{} / {}", build(cell), report::figure(cell.search_ms()));
                match rows.iter_mut().find(|(c, _)| same(c)) {
                    Some((_, columns)) => columns.push(times),
                    None => rows.push((cell, vec![times])),
                }
            }
            let is_map = figure % 2 == 1;
            let other = |c: &Cell| c.queries != c.samples && cells.iter().any(|d| d.samples == c.queries);
            let shown = rows.into_iter().filter(|(c, _)| !is_map || !other(c));
            let lines = shown.map(|(cell, columns)| {
                let mut line = vec![short(cell.samples), short(cell.queries), cell.radius.to_string()];
                line.push(report::figure(cell.mean));
                line.extend(columns);
                line
            });
            let mut header = vec!["samples", "queries", "radius", "neighbours"];
            header.extend(&indices);
            crate::print(&format!(
                "\nFigure {figure}, {} samples: build / search, wall ms, on {}\n{}\n{}\nThe paper's device: {}. \
                 Its text gives no times for this figure.",
                distribution.name(),
                machine.line(),
                report::table(&header, 0, lines),
                paper::claim(figure),
                paper::DEVICE,
            ));
        }
    }
}

fn build(cell: &Cell) -> String {
    report::figure(1e3 * cell.score.build.wall().median)
}
