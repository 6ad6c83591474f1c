//! `sunfleck bench photons`: Figure 9 and Table 1 of the paper, the photon map of every iteration in four scenes.
//!
//! **Table 1** has the milliseconds of build and gather for 100K, 200K, 500K and 1000K emitted photon paths an iteration,
//! OptiX (in place: the density is summed as photons are found) and FLANN (all neighbours into buffers, whose rows are as
//! long as needed, then summed), 1920×1080, five segments from the eye and from the lamps, no Russian roulette, mean of the
//! first 50 iterations; tracing is not counted. **Figure 9** stacks the same figures, a panel a scene.
//!
//! Where ours departs:
//! - The scenes have the paper's names and kinds of light, not its geometry; its radius is not given, ours is the median of
//!   the automatic ones, the same for all pixels, and shrinks by α = 2/3.
//! - In place means the renderer's own stages, on each backend. On the CPU the paper's method in its own form
//!   (`bvh2-inflated`) and its rival (`kd-buffered`, our kd-tree with FLANN's buffers) get the same photons and eye
//!   vertices in every iteration, and their pictures are compared with the renderer's. Buffers above 512 MiB are filled in
//!   parts.
//! - The rows' length is found before each iteration, not once; that is not counted either.
//! - The renderer's build also puts the photons into the tree's order, from which the other two profit unpaid.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::Args;
use serde_json::json;
use sunfleck::index::Buffers;
use sunfleck::layout::Frame;
use sunfleck::ppm::{FirstRadii, Params, Stages};
use sunfleck::scene::settings::parse_count;
use sunfleck::scene::{PackedScene, shipped};

use super::gathers::{self, Gathered};
use super::measure::{Time, Times, timed};
use super::plot::{self, Bars};
use super::report::{self, Machine, Report, Row};
use super::{Common, Steps, Where, backends, paper, short};
use crate::cli::Usage;
use crate::devices::{self, Device};
use crate::job::{Input, check_memory, use_paper_mode};
use crate::render;

const NOTES: &[&str] = &[
    "build and gather of every iteration; tracing is not part of them, it stands beside in eyeMs and photonsMs",
    "in place: the renderer's stages; kd-buffered: all neighbours into rows as long as needed, then summed",
    "the scenes are not the paper's, only alike",
];

#[derive(Debug, Args)]
pub struct PhotonsArgs {
    #[command(flatten)]
    common: Common,

    /// Shipped scenes [default: the paper's glass,pool,bathroom,fireplace]
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', value_parser = shipped::NAMES)]
    scene: Vec<String>,

    /// Photon paths an iteration [default: the paper's 100k,200k,500k,1M]
    #[arg(long, value_name = "N,…", value_delimiter = ',', allow_hyphen_values = true, value_parser = parse_count)]
    photons: Vec<u32>,

    /// Size of the picture [default: the paper's 1920x1080]
    #[arg(short, long, value_name = "WxH", value_parser = crate::cli::values::size)]
    resolution: Option<[u32; 2]>,

    /// Iterations that count, after one that does not [default: the paper's 50]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    iterations: Option<u32>,

    #[command(flatten)]
    place: Where,

    /// Only the renderer's own gather
    #[arg(long)]
    in_place_only: bool,

    /// The renderer's normal mode (Russian roulette, sampled direct light, a radius each pixel), not the paper's
    #[arg(long)]
    normal_mode: bool,
}

/// What gathers.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Method {
    InPlace,
    Boxes,
    KdBuffered,
}

impl Method {
    fn name(self) -> &'static str {
        match self {
            Self::InPlace => "in place",
            Self::Boxes => super::entrants::METHOD,
            Self::KdBuffered => super::entrants::RIVAL,
        }
    }
}

/// One method in one scene with one number of paths.
struct Cell {
    scene: String,
    paths: u32,
    backend: String,
    device: String,
    method: Method,
    /// Mean.
    stored: f64,
    /// Most neighbours of a query in any iteration.
    most: Option<usize>,
    build: Times,
    gather: Times,
    /// Eye paths, photon paths, accumulation: the renderer's only.
    others: Option<[Times; 3]>,
}

impl Cell {
    fn new(scene: &str, paths: u32, backend: &str, device: String, method: Method) -> Self {
        let others = (method == Method::InPlace).then(Default::default);
        let (build, gather) = Default::default();
        Self {
            scene: scene.to_owned(),
            paths,
            backend: backend.to_owned(),
            device,
            method,
            stored: 0.0,
            most: None,
            build,
            gather,
            others,
        }
    }

    fn name(&self) -> String {
        format!("{} {}", self.backend, self.method.name())
    }

    /// Mean of build and gather, milliseconds.
    fn ms(&self) -> [f64; 2] {
        [&self.build, &self.gather].map(|times| 1e3 * times.wall().mean)
    }

    fn row(&self, iterations: u32) -> Row {
        let other = |i: usize| self.others.as_ref().map(|o| 1e3 * o[i].wall().median);
        Row::default()
            .with("scene", self.scene.as_str())
            .with("photonPaths", self.paths)
            .with("photonsStored", self.stored)
            .with("backend", self.backend.as_str())
            .with("device", self.device.as_str())
            .with("method", self.method.name())
            .with("iterations", iterations)
            .with("mostNeighbours", self.most)
            .with_times("build", &self.build)
            .with_times("gather", &self.gather)
            .with("eyeMs", other(0))
            .with("photonsMs", other(1))
            .with("accumulateMs", other(2))
    }
}

/// What is to be run.
struct Plan {
    scenes: Vec<String>,
    paths: Vec<u32>,
    size: [u32; 2],
    iterations: u32,
    backends: Vec<String>,
}

impl Plan {
    fn new(args: &PhotonsArgs) -> Self {
        let quick = args.common.quick;
        let or = |given: &[String], default: &[&str]| match given {
            [] => default.iter().map(|s| (*s).to_owned()).collect(),
            some => some.to_vec(),
        };
        Self {
            scenes: or(&args.scene, &paper::TABLE_1.map(|row| row.0)),
            paths: match (args.photons.as_slice(), quick) {
                ([], true) => paper::TABLE_1_PATHS[..1].to_vec(),
                ([], false) => paper::TABLE_1_PATHS.to_vec(),
                (some, _) => some.to_vec(),
            },
            size: args.resolution.unwrap_or(if quick { [480, 270] } else { [1920, 1080] }),
            iterations: args.iterations.unwrap_or(if quick { 5 } else { 50 }),
            backends: backends::names(&args.place.backend),
        }
    }
}

pub fn run(args: &PhotonsArgs) -> Result<()> {
    let common = &args.common;
    let plan = Plan::new(args);
    let twice = |list: &[String]| list.iter().enumerate().any(|(i, a)| list[..i].contains(a));
    if twice(&plan.scenes) {
        bail!(Usage("a scene is named twice".into()));
    }
    let figure = [common.figure("figure9")];
    common.prepare("photons", &figure)?;
    let devices = plan.backends.iter().map(|name| devices::open_backend(name)).collect::<Result<Vec<_>>>()?;
    let mut steps = common.steps(plan.scenes.len() * plan.paths.len());
    let mut cells = Vec::new();
    for name in &plan.scenes {
        for &paths in &plan.paths {
            cells.extend(measure(args, &plan, &devices, name, paths, &mut steps)?);
        }
    }
    let mut names: Vec<String> = Vec::new();
    for cell in &cells {
        if !names.contains(&cell.device) {
            names.push(cell.device.clone());
        }
    }
    let report = Report {
        name: "photons",
        machine: Machine::here(names),
        settings: json!({
            "quick": common.quick, "seed": common.seed, "scenes": plan.scenes, "photonPaths": plan.paths,
            "size": plan.size, "iterations": plan.iterations, "backends": plan.backends, "paperMode": !args.normal_mode,
        }),
        notes: NOTES,
        rows: cells.iter().map(|cell| cell.row(plan.iterations)).collect(),
    };
    report.write(&common.output)?;
    draw(&figure[0], &plan, &cells)?;
    print(&report.machine, &plan, &cells);
    common.say_written(&report, &figure as &[PathBuf]);
    Ok(())
}

/// A backend under way in one scene.
struct Runner {
    stages: Box<dyn Stages>,
    /// The renderer's first, then the others.
    cells: Vec<Cell>,
    first_radii: FirstRadii,
    buffers: Buffers,
}

/// All backends and methods on one scene and number of paths, in turns.
fn measure(
    args: &PhotonsArgs,
    plan: &Plan,
    devices: &[Device],
    name: &str,
    paths: u32,
    steps: &mut Steps,
) -> Result<Vec<Cell>> {
    steps.next(&format!("{name}, {} paths, {} iterations", short(paths as usize), plan.iterations));
    let scene = shipped::shipped(name).with_context(|| format!("no scene {name}"))?;
    let camera = scene.cameras.first().with_context(|| format!("{name} has no camera"))?.clone();
    let mut params = Params { n_paths: paths, seed: args.common.seed, ..Params::new(plan.size[0], plan.size[1]) };
    if !args.normal_mode {
        use_paper_mode(&mut params);
    }
    check_memory(&params, None)?;
    let input = Input { scene, camera, params, warnings: vec![] };
    let packed = PackedScene::new(&input.scene);
    let mut runners = Vec::new();
    for (device, backend) in devices.iter().zip(&plan.backends) {
        let mut stages = device.stages(&input)?;
        let first_radii = render::start(stages.as_mut(), &input.params, !args.normal_mode)?;
        let methods: &[Method] = match backend == "cpu" && !args.in_place_only {
            true => &[Method::InPlace, Method::Boxes, Method::KdBuffered],
            false => &[Method::InPlace],
        };
        let cell = |&method: &Method| Cell::new(name, paths, backend, stages.device(), method);
        let cells = methods.iter().map(cell).collect();
        runners.push(Runner { stages, cells, first_radii, buffers: Buffers::default() });
    }
    for i in 0..=plan.iterations {
        // The first one is run twice: once to warm up.
        let frame = input.params.frame(i.max(1));
        for runner in &mut runners {
            runner.iterate(&packed, &frame, i > 0)?;
        }
    }
    for runner in &mut runners {
        runner.cells.iter_mut().for_each(|cell| cell.stored /= f64::from(plan.iterations));
    }
    Ok(runners.into_iter().flat_map(|runner| runner.cells).collect())
}

impl Runner {
    fn iterate(&mut self, scene: &PackedScene, frame: &Frame, counts: bool) -> Result<()> {
        let Self { stages, cells, first_radii, buffers } = self;
        stages.trace_eye(frame)?;
        stages.trace_photons(frame)?;
        let (built, build) = timed(|| stages.build_index(frame));
        built?;
        let (gathered, gather) = timed(|| stages.gather(frame));
        gathered?;
        stages.accumulate(frame)?;
        let times = stages.times()?;
        // The stages' own clocks; the GPU works after the call has returned, and its CPU seconds say nothing.
        let cpu = |time: Time| time.cpu.filter(|_| cells[0].backend == "cpu");
        let own = |wall: f64, cpu: Option<f64>| Time { wall, cpu };
        let (build, gather) = (own(times.build, cpu(build)), own(times.gather, cpu(gather)));
        let stored = f64::from(stages.n_photons());
        if counts {
            cells.iter_mut().for_each(|cell| cell.stored += stored);
            cells[0].build.push(build);
            cells[0].gather.push(gather);
            if let Some(others) = &mut cells[0].others {
                for (into, wall) in others.iter_mut().zip([times.eye, times.photons, times.accumulate]) {
                    into.push(own(wall, None));
                }
            }
        }
        if cells.len() == 1 {
            return Ok(());
        }
        let (photons, vertices, right) = (stages.photons()?, stages.eye_vertices()?, stages.radiance()?);
        let input = gathers::Input::new(scene, frame, &photons, &vertices, &first_radii.each)?;
        for cell in &mut cells[1..] {
            let Gathered { build, gather, radiance } = match cell.method {
                Method::KdBuffered => input.kd_buffered(buffers)?,
                _ => input.boxes_in_place()?,
            };
            gathers::check(cell.method.name(), &radiance, &right)?;
            if counts {
                cell.build.push(build);
                cell.gather.push(gather);
                cell.most = cell.most.max(Some(input.most()));
            }
        }
        Ok(())
    }
}

fn draw(path: &std::path::Path, plan: &Plan, cells: &[Cell]) -> Result<()> {
    let panels: Vec<Bars> = plan
        .scenes
        .iter()
        .map(|scene| Bars {
            title: scene.clone(),
            y: "ms an iteration, mean",
            parts: vec!["build", "gather"],
            groups: plan
                .paths
                .iter()
                .map(|&paths| {
                    let bars = cells.iter().filter(|c| c.scene == *scene && c.paths == paths);
                    (short(paths as usize), bars.map(|c| (c.name(), c.ms().to_vec())).collect())
                })
                .collect(),
        })
        .collect();
    plot::bars(path, "Figure 9: build and gather over the photon paths an iteration", &panels, 2)
}

fn print(machine: &Machine, plan: &Plan, cells: &[Cell]) {
    let mut header = vec!["scene".to_owned(), "paths".to_owned(), "stored".to_owned()];
    let mut lines = Vec::new();
    for scene in &plan.scenes {
        for &paths in &plan.paths {
            let mut line = vec![scene.clone(), short(paths as usize)];
            for cell in cells.iter().filter(|c| c.scene == *scene && c.paths == paths) {
                if line.len() == 2 {
                    line.push(short(100 * (cell.stored / 100.0).round() as usize));
                }
                if lines.is_empty() {
                    header.push(cell.name());
                }
                let [build, gather] = cell.ms().map(report::figure);
                line.push(format!("{build} / {gather}"));
            }
            line.extend(paper::columns(paper::table_1(scene, paths)));
            lines.push(line);
        }
    }
    header.extend(paper::HEADINGS.map(str::to_owned));
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    let [width, height] = plan.size;
    crate::print(&format!(
        "\nTable 1: build / gather, ms an iteration, mean of {} iterations. Ours, {width}x{height}: {}. The paper's, \
         1920x1080: {}, other scenes of the same names.\n{}",
        plan.iterations,
        machine.line(),
        paper::DEVICE,
        report::table(&header, 2, lines),
    ));
}
