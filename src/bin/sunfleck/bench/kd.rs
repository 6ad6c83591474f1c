//! `sunfleck bench kd`: chapter 7 of Frauenknecht 2025, "Efficient Construction of KD-Trees for Spatial Partitioning of
//! Polyhedral Models" (TU München), which speeds up the mesh check of a gravity model.
//!
//! The task is the ray part of the mesh check ([`by_rays`]): one ray through every face, all crossings counted. **Figures 7.2
//! and 7.3** are its time, and that of the build alone, over scaled meshes of Eros, on one thread; **7.4** both over spheres;
//! **7.5, 7.6 and 7.8** the same on all threads; **7.7** how busy those are.
//!
//! Where ours departs:
//! - The asteroid is made by code ([`sunfleck::mesh::generate`]), with as many faces; `--mesh` takes a real one.
//! - The thesis builds only lazily in its checks. Ours are measured both ways: built where rays come, and built first.
//! - The thesis builds in parallel, and asks one ray at a time; our rays take all threads as well. Its algorithms are held
//!   against each other by C++, ours by Rust, on another machine: only ratios and slopes can be compared.
//! - The O(N²) builder of the thesis tries one axis a node; ours all three, so that all builders give one tree.
//! - A ray that comes too near to an edge is cast again, so there are somewhat more rays than faces.
//! - Rays go where the check's do, through a tree of the check's own costs.
//! - Times on one thread are CPU times, where the system tells them: other work on the machine does not lengthen them.

use std::path::PathBuf;

use anyhow::{Context, Result, ensure};
use clap::Args;
use serde_json::json;
use sunfleck::index::kd::{Builder, KdOptions, KdTree, LazyKd, Triangles};
use sunfleck::mesh::generate::{EROS_FACES, asteroid, icosphere};
use sunfleck::mesh::orientation::{Facing, by_rays};
use sunfleck::mesh::resize::resize;
use sunfleck::mesh::{CheckOptions, Mesh};

use super::measure::{Times, timed};
use super::report::{Machine, Report, Row};
use super::{Common, Rounds, count, figures_kd, short, thesis};

const NOTES: &[&str] = &[
    "operation: build: the whole tree; check: that, then a ray from each face; lazy: the same rays, the tree built where they \
     come; rays: through a tree that is there",
    "utilisation: CPU time over wall time × threads",
    "treeBytes: nodes and their lists of faces, without the mesh",
];

/// Algorithms that take quadratic time are measured up to so many faces.
const SLOW_FACES: usize = EROS_FACES;

#[derive(Debug, Args)]
pub struct KdArgs {
    #[command(flatten)]
    common: Common,

    #[command(flatten)]
    rounds: Rounds,

    /// Numbers of faces the asteroid is scaled to [default: 1,000 to the thesis' 140,296]
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = count)]
    faces: Vec<usize>,

    /// How often the sphere's faces are split in four: 20·4^N faces [default: 2,3,4,5,6]
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(0..=9))]
    levels: Vec<u32>,

    /// Scale this mesh in place of the asteroid: any file that mesh-check reads
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,

    /// Also measure no tree and O(N²) on large meshes: they take quadratic time
    #[arg(long)]
    all: bool,
}

/// How a tree is built.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Algorithm {
    pub name: &'static str,
    builder: Builder,
    /// Measured on large meshes only if asked for.
    is_slow: bool,
}

const fn algorithm(name: &'static str, builder: Builder, is_slow: bool) -> Algorithm {
    Algorithm { name, builder, is_slow }
}

pub const NO_TREE: Algorithm = algorithm("no tree", Builder::None, true);
pub const BEST: Algorithm = algorithm("O(N log N)", Builder::SortOnce, false);
pub const TREES: [Algorithm; 3] =
    [algorithm("O(N²)", Builder::Quadratic, true), algorithm("O(N log² N)", Builder::SortEachNode, false), BEST];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Operation {
    Build,
    Check,
    Lazy,
    Rays,
}

impl Operation {
    pub fn name(self) -> &'static str {
        match self {
            Self::Build => "build",
            Self::Check => "check",
            Self::Lazy => "lazy",
            Self::Rays => "rays",
        }
    }
}

/// One algorithm doing one thing with one mesh, on one thread or on all.
pub struct Cell {
    /// "sphere", or what is scaled.
    pub mesh: String,
    pub faces: usize,
    pub algorithm: Algorithm,
    pub operation: Operation,
    pub is_parallel: bool,
    pub threads: usize,
    pub times: Times,
    /// Of the tree; none without one.
    pub bytes: Option<usize>,
}

impl Cell {
    /// Milliseconds: of CPU on one thread, where the system tells them, for other work does not lengthen them; else of the
    /// wall.
    pub fn ms(&self) -> f64 {
        let cpu = self.times.cpu().filter(|_| !self.is_parallel);
        1e3 * cpu.unwrap_or_else(|| self.times.wall()).median
    }

    /// Share of the threads' time that was spent computing, 0 to 1.
    pub fn utilisation(&self) -> Option<f64> {
        Some(self.times.cpu()?.median / (self.times.wall().median * self.threads as f64))
    }

    fn row(&self) -> Row {
        Row::default()
            .with("mesh", self.mesh.clone())
            .with("faces", self.faces)
            .with("algorithm", self.algorithm.name)
            .with("operation", self.operation.name())
            .with("threads", self.threads)
            .with("parallel", self.is_parallel)
            .with_times("time", &self.times)
            .with("utilisation", self.utilisation().map(|share| (share * 1e4).round() / 1e4))
            .with("treeBytes", self.bytes)
    }
}

pub const SPHERE: &str = "sphere";

pub fn run(args: &KdArgs) -> Result<()> {
    let common = &args.common;
    let figures = figures_kd::NAMES.map(|name| common.figure(name));
    let (name, source) = match &args.mesh {
        Some(path) => {
            let stem = path.file_stem().map_or("mesh".into(), |stem| stem.to_string_lossy().into_owned());
            (stem, Some(read(path)?))
        }
        None => ("asteroid".to_owned(), None),
    };
    common.prepare("kd", &figures)?;
    let sizes: Vec<usize> = match (args.faces.as_slice(), common.quick) {
        ([], true) => vec![1000, 4000],
        ([], false) => {
            vec![1000, 2000, 4000, EROS_FACES / 2, EROS_FACES, 2 * EROS_FACES, 4 * EROS_FACES, thesis::FACES]
        }
        (some, _) => some.to_vec(),
    };
    let levels: Vec<u32> = match (args.levels.as_slice(), common.quick) {
        ([], true) => vec![2, 3],
        ([], false) => vec![2, 3, 4, 5, 6],
        (some, _) => some.to_vec(),
    };
    let scaled = |&n: &usize| match &source {
        Some(mesh) => resize(mesh, n),
        None => asteroid(n, common.seed),
    };
    let mut steps = common.steps(2 * (sizes.len() + levels.len()));
    let mut cells = Vec::new();
    let mut is_any_slow = false;
    let asteroids = sizes.iter().map(|n| (name.as_str(), scaled(n)));
    for (name, mesh) in asteroids.chain(levels.iter().map(|&level| (SPHERE, icosphere(level)))) {
        let is_slow = mesh.faces.len() > SLOW_FACES && !args.all;
        is_any_slow |= is_slow;
        let contest = Contest::new(&mesh, is_slow)?;
        if source.is_none() || name == SPHERE {
            ensure!(contest.facings.iter().all(|f| *f == Facing::Outward), "{name}: a face is said to point inward");
        }
        for is_parallel in [false, true] {
            let threads = if is_parallel { rayon::current_num_threads() } else { 1 };
            let s = if threads == 1 { "" } else { "s" };
            steps.next(&format!("{name}, {} faces, {threads} thread{s}", short(mesh.faces.len())));
            cells.extend(contest.run(name, is_parallel, args.rounds.rounds)?);
        }
    }
    let left_out = is_any_slow.then(|| {
        let faces = short(SLOW_FACES);
        format!("No tree and O(N²) take quadratic time: above {faces} faces they are left out (--all measures them).")
    });
    let sah = options(Builder::SortOnce, false).sah;
    let report = Report {
        name: "kd",
        machine: Machine::here(Vec::new()),
        settings: json!({
            "quick": common.quick, "rounds": args.rounds.rounds, "seed": common.seed, "faces": sizes, "levels": levels,
            "mesh": args.mesh.as_ref().map(|path| path.display().to_string()), "all": args.all, "leftOut": left_out,
            "traversalCost": sah.traversal, "intersectionCost": sah.intersection,
        }),
        notes: NOTES,
        rows: cells.iter().map(Cell::row).collect(),
    };
    report.write(&common.output)?;
    figures_kd::draw(&figures, &name, &cells)?;
    figures_kd::print(&report.machine, &name, &cells, left_out.as_deref());
    common.say_written(&report, &figures);
    Ok(())
}

fn read(path: &std::path::Path) -> Result<Mesh> {
    let mesh = crate::mesh_check::read(path)?.mesh;
    ensure!(!mesh.faces.is_empty(), "{}: there are no faces", path.display());
    mesh.triangles().with_context(|| path.display().to_string())?;
    Ok(mesh)
}

/// As the mesh check builds.
fn options(builder: Builder, parallel: bool) -> KdOptions {
    KdOptions { builder, parallel, ..CheckOptions::default().kd }
}

/// All that is measured on one mesh.
struct Contest {
    triangles: Triangles<f64>,
    /// By the best algorithm.
    tree: KdTree<f64>,
    facings: Vec<Facing>,
    entrants: Vec<(Algorithm, Operation)>,
}

/// What an entrant returns.
enum Answer {
    Tree(KdTree<f64>),
    Facings(Vec<Facing>),
}

impl Contest {
    fn new(mesh: &Mesh, without_slow: bool) -> Result<Self> {
        let triangles = mesh.triangles()?;
        let tree = KdTree::new(triangles.clone(), &options(BEST.builder, true))?;
        let facings = by_rays(&tree, true);
        let mut entrants = vec![(NO_TREE, Operation::Check)];
        for algorithm in TREES {
            entrants.extend([Operation::Build, Operation::Check, Operation::Lazy].map(|o| (algorithm, o)));
        }
        entrants.push((BEST, Operation::Rays));
        entrants.retain(|(algorithm, _)| !(algorithm.is_slow && without_slow));
        Ok(Self { triangles, tree, facings, entrants })
    }

    /// One round in which answers are compared, and `rounds` that are timed, in each of which all take turns.
    fn run(&self, mesh: &str, is_parallel: bool, rounds: u32) -> Result<Vec<Cell>> {
        let cell = |&(algorithm, operation): &(Algorithm, Operation)| Cell {
            mesh: mesh.to_owned(),
            faces: self.triangles.len(),
            algorithm,
            operation,
            is_parallel,
            threads: if is_parallel { rayon::current_num_threads() } else { 1 },
            times: Times::default(),
            bytes: (algorithm != NO_TREE).then(|| self.tree.bytes()),
        };
        let mut cells: Vec<Cell> = self.entrants.iter().map(cell).collect();
        for round in 0..=rounds {
            for cell in &mut cells {
                let triangles = self.triangles.clone();
                let options = options(cell.algorithm.builder, is_parallel);
                // What is made is dropped after the time is taken.
                let (answer, time) = match cell.operation {
                    Operation::Build => {
                        let (tree, time) = timed(|| KdTree::new(triangles, &options));
                        (Answer::Tree(tree?), time)
                    }
                    Operation::Check => {
                        let (made, time) =
                            timed(|| KdTree::new(triangles, &options).map(|tree| (by_rays(&tree, is_parallel), tree)));
                        (Answer::Facings(made?.0), time)
                    }
                    Operation::Lazy => {
                        let (made, time) =
                            timed(|| LazyKd::new(triangles, &options).map(|tree| (by_rays(&tree, is_parallel), tree)));
                        (Answer::Facings(made?.0), time)
                    }
                    Operation::Rays => {
                        let (facings, time) = timed(|| by_rays(&self.tree, is_parallel));
                        (Answer::Facings(facings), time)
                    }
                };
                if round > 0 {
                    cell.times.push(time);
                    continue;
                }
                let is_same = match answer {
                    Answer::Tree(tree) => tree.nodes().eq(self.tree.nodes()),
                    Answer::Facings(facings) => facings == self.facings,
                };
                let (algorithm, operation, faces) = (cell.algorithm.name, cell.operation.name(), cell.faces);
                ensure!(is_same, "{mesh}, {faces} faces: {algorithm} gives another answer ({operation})");
            }
        }
        Ok(cells)
    }
}
