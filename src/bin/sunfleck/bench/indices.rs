//! `sunfleck bench indices`: what each choice costs, one table for each case.
//!
//! The paper compares two indices, and says why it stores samples rather than queries as boxes (its Section 3.2); this is
//! the comparison that it leaves out. Builder (LBVH, PLOC), boxes (inflated by the radius, tight), width (binary, eight
//! wide), leaves, order of the queries (as they come, sorted first), grid, kd-tree, brute force.
//!
//! Cases: photons on the surfaces of a room with queries as a camera makes them and the same in random order, the radius
//! tuned for [`WANTED`] neighbours a query; and uniform points with uniform queries. Beside the times stand what does not
//! depend on the machine: the costs of the tree by the surface area and the volume heuristic (the paper's Equations 3 and
//! 4, boxes grown by the radius where they are tight), and nodes, boxes and points a query visits.

use anyhow::Result;
use clap::Args;
use glam::Vec3;
use serde_json::json;
use sunfleck::math::clouds;

use super::contest::{self, Anatomy, Operation, Question, Score};
use super::entrants;
use super::plot::{self, Bars};
use super::report::{self, Machine, Report, Row};
use super::{Common, Rounds, count, short};

const NOTES: &[&str] = &[
    "photons: on the walls of a room and a ball in it, the radius finds 50 neighbours a query on average",
    "camera: queries row by row as a camera sees the room; shuffled: the same in random order",
    "sum: a kernel sum in place; nearest: the 8 nearest within the radius",
    "costs: Equations 3 and 4 of the paper with weights 1 (inner node), 0 (leaf) and 1 (point)",
    "visits: means over some of the queries; a node of bvh8 holds eight boxes; of a grid, runs of cells",
];

/// Neighbours a query on average, where the radius is tuned.
const WANTED: f64 = 50.0;
/// Queries whose visits are counted.
const COUNTED: usize = 4096;
/// Neighbours of k-NN.
const K: usize = 8;

#[derive(Debug, Args)]
pub struct IndicesArgs {
    #[command(flatten)]
    common: Common,

    #[command(flatten)]
    rounds: Rounds,

    /// Photons, and uniform points [default: 500k and 1M]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = count)]
    samples: Option<usize>,

    /// Queries [default: 1920x1080 on photons, 32768 on uniform points]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = count)]
    queries: Option<usize>,

    /// Only these cases
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = NAMES)]
    case: Vec<String>,
}

const NAMES: [&str; 4] = ["camera", "shuffled", "uniform", "nearest"];

/// Points and queries.
struct Case {
    name: &'static str,
    points: Vec<Vec3>,
    queries: Vec<Vec3>,
    radius: f32,
    operation: Operation,
}

/// One index in one case.
struct Cell {
    case: &'static str,
    index: &'static str,
    samples: usize,
    queries: usize,
    radius: f32,
    mean: f64,
    score: Score,
    anatomy: Anatomy,
}

impl Cell {
    /// Build and search, wall milliseconds.
    fn ms(&self) -> [f64; 2] {
        [&self.score.build, &self.score.search[0]].map(|times| 1e3 * times.wall().median)
    }

    fn row(&self) -> Row {
        // They are those of a radius search.
        let visits = self.anatomy.visits.filter(|_| self.case != "nearest");
        let costs = self.anatomy.costs;
        Row::default()
            .with("case", self.case)
            .with("index", self.index)
            .with("samples", self.samples)
            .with("queries", self.queries)
            .with_length("radius", self.radius)
            .with("neighboursPerQuery", self.mean)
            .with_times("build", &self.score.build)
            .with_times("search", &self.score.search[0])
            .with("nodesPerQuery", visits.map(|v| v.nodes))
            .with("boxesPerQuery", visits.map(|v| v.boxes))
            .with("pointsPerQuery", visits.map(|v| v.points))
            .with("sah", costs.map(|c| c.sah).filter(|c| c.is_finite()))
            .with("vh", costs.map(|c| c.vh).filter(|c| c.is_finite()))
    }
}

pub fn run(args: &IndicesArgs) -> Result<()> {
    let common = &args.common;
    let figure = [common.figure("indices")];
    common.prepare("indices", &figure)?;
    let wanted = |name: &&str| args.case.is_empty() || args.case.iter().any(|case| case == name);
    let names: Vec<&str> = NAMES.into_iter().filter(wanted).collect();
    let mut steps = common.steps(names.len());
    let mut cells = Vec::new();
    for name in &names {
        let case = Case::new(name, args)?;
        steps.next(&format!(
            "{}, {} samples, {} queries",
            case.name,
            short(case.points.len()),
            short(case.queries.len())
        ));
        let question = Question::new(&case.points, &case.queries, case.radius, case.operation)?;
        let mut entrants = entrants::ablations(&case.points, &question);
        let scores = contest::run(&mut entrants, case.radius, std::slice::from_ref(&question), args.rounds.rounds)?;
        let step = (case.queries.len() / COUNTED).max(1);
        let some: Vec<Vec3> = case.queries.iter().copied().step_by(step).collect();
        for (entrant, score) in entrants.iter_mut().zip(scores) {
            entrant.build(case.radius, question.most)?;
            cells.push(Cell {
                case: case.name,
                index: entrant.name(),
                samples: case.points.len(),
                queries: case.queries.len(),
                radius: case.radius,
                mean: question.mean(),
                score,
                anatomy: entrant.anatomy(&some, case.radius),
            });
            entrant.forget();
        }
    }
    let report = Report {
        name: "indices",
        machine: Machine::here(vec![]),
        settings: json!({
            "quick": common.quick, "rounds": args.rounds.rounds, "seed": common.seed, "cases": names, "k": K,
        }),
        notes: NOTES,
        rows: cells.iter().map(Cell::row).collect(),
    };
    report.write(&common.output)?;
    draw(&figure[0], &names, &cells)?;
    print(&report.machine, &names, &cells);
    common.say_written(&report, &figure);
    Ok(())
}

impl Case {
    fn new(name: &str, args: &IndicesArgs) -> Result<Self> {
        let (seed, quick) = (args.common.seed, args.common.quick);
        let on_photons = matches!(name, "camera" | "shuffled");
        let n_points = args.samples.unwrap_or(match (on_photons, quick) {
            (true, false) => 500_000,
            (false, false) => 1_000_000,
            (true, true) => 50_000,
            (false, true) => 100_000,
        });
        let n_queries = args.queries.unwrap_or(match (on_photons, quick) {
            (true, false) => 1920 * 1080,
            (true, true) => 160 * 90,
            (false, false) => 1 << 15,
            (false, true) => 1 << 13,
        });
        if on_photons {
            let points = clouds::room_photons(n_points, seed);
            // 16:9, at least as many pixels as there are to be queries.
            let height = ((n_queries as f64 * 9.0 / 16.0).sqrt().ceil() as u32).max(1);
            let width = (n_queries as u32).div_ceil(height);
            let mut queries = clouds::room_camera([width, height], !seed);
            queries.truncate(n_queries);
            let radius = contest::radius_for(&points, &queries, WANTED.min(0.5 * n_points as f64))?;
            if name == "shuffled" {
                clouds::shuffle(&mut queries, seed);
            }
            let name = if name == "shuffled" { "shuffled" } else { "camera" };
            return Ok(Self { name, points, queries, radius, operation: Operation::Sum });
        }
        let points = clouds::uniform(n_points, seed);
        let queries = clouds::uniform(n_queries, !seed);
        // Of a million points 33 are within it.
        let radius = 0.02 * (1e6 / n_points as f32).cbrt();
        let (name, operation) =
            if name == "nearest" { ("nearest", Operation::Nearest(K)) } else { ("uniform", Operation::Sum) };
        Ok(Self { name, points, queries, radius, operation })
    }
}

fn draw(path: &std::path::Path, names: &[&str], cells: &[Cell]) -> Result<()> {
    let panels: Vec<Bars> = names
        .iter()
        .map(|name| Bars {
            title: (*name).to_owned(),
            y: "ms",
            parts: vec!["build", "search"],
            groups: cells
                .iter()
                .filter(|c| c.case == *name && c.index != "brute")
                .map(|c| (c.index.to_owned(), vec![("time".to_owned(), c.ms().to_vec())]))
                .collect(),
        })
        .collect();
    plot::rows(path, "Indices: build (dark) and search (light)", &panels)
}

fn print(machine: &Machine, names: &[&str], cells: &[Cell]) {
    let header =
        ["index", "build ms", "CPU ms", "search ms", "CPU ms", "ns/query", "nodes", "boxes", "points", "SAH", "VH"];
    for name in names {
        let of = || cells.iter().filter(|c| c.case == *name);
        let Some(first) = of().next() else { continue };
        let cell = |x: Option<f64>| x.map_or("–".to_owned(), report::figure);
        let lines = of().map(|c| {
            let search = &c.score.search[0];
            let cpu = search.cpu().map(|cpu| 1e3 * cpu.median);
            let visits = c.anatomy.visits.filter(|_| c.case != "nearest");
            vec![
                c.index.to_owned(),
                report::milliseconds(&c.score.build),
                cell(c.score.build.cpu().map(|cpu| 1e3 * cpu.median)),
                report::milliseconds(search),
                cell(cpu),
                cell(cpu.map(|ms| 1e6 * ms / c.queries.max(1) as f64)),
                cell(visits.map(|v| v.nodes)),
                cell(visits.map(|v| v.boxes)),
                cell(visits.map(|v| v.points)),
                cell(c.anatomy.costs.map(|c| c.sah)),
                cell(c.anatomy.costs.map(|c| c.vh)),
            ]
        });
        crate::print(&format!(
            "\n{name}: {} samples, {} queries, radius {}, {} neighbours a query, on {}\n{}",
            short(first.samples),
            short(first.queries),
            report::figure(f64::from(first.radius)),
            report::figure(first.mean),
            machine.line(),
            report::table(&header, 1, lines),
        ));
    }
    crate::print(
        "\nMedian (least – most) by the wall clock, and median CPU time; ns/query: CPU. The paper has no such table.",
    );
}
