//! `generate FOLDER` writes the data; `run LIBRARY LIMIT POINTS CASE...` measures one library, a JSON line a case.
//! A case is `name,queries,radius,k`, k = 0 for the kernel sum; `LIMIT` cuts the queries, 0 does not. `mesh`: see mesh.rs.

mod data;
mod mesh;
mod peers;

use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use glam::Vec3;
use kiddo::ImmutableKdTree;
use peers::{Batch, Found, Grid, Median, Morton, Obvhs, Peer, Single};
use rustix::time::{ClockId, clock_gettime};
use serde_json::json;

fn main() -> Result<()> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["generate", folder] => data::generate(Path::new(folder)),
        ["run", library, limit, points, ref cases @ ..] => {
            let job = Job::read(limit.parse()?, points, cases)?;
            match library {
                "sunfleck" => job.run::<Batch<Morton>>(library),
                "sunfleck-single" => job.run::<Single<Morton>>(library),
                "sunfleck-median" => job.run::<Batch<Median>>(library),
                "sunfleck-median-single" => job.run::<Single<Median>>(library),
                "sunfleck-grid" => job.run::<Batch<Grid>>(library),
                "kiddo" => job.run::<ImmutableKdTree<f32, 3>>(library),
                "obvhs-ploc" => job.run::<Obvhs<false>>(library),
                "obvhs-medium" => job.run::<Obvhs<true>>(library),
                "rstar" => job.run::<rstar::RTree<[f32; 3]>>(library),
                _ => bail!("no library {library}"),
            }
        }
        ["mesh", "write", folder] => mesh::write(Path::new(folder)),
        ["mesh", "run", what, path] => mesh::run(what, path),
        _ => bail!("generate FOLDER | run LIBRARY LIMIT POINTS CASE... | mesh write FOLDER | mesh run WHAT FILE"),
    }
}

struct Case {
    name: String,
    queries: Vec<Vec3>,
    radius: f32,
    /// 0 for the kernel sum.
    k: usize,
}

struct Job {
    points: Vec<Vec3>,
    cases: Vec<Case>,
}

impl Job {
    fn read(limit: usize, points: &str, cases: &[&str]) -> Result<Self> {
        let case = |text: &&str| {
            let [name, queries, radius, k] = text.split(',').collect::<Vec<_>>()[..] else { bail!("case {text}") };
            let mut queries = read(queries)?;
            if limit > 0 {
                queries.truncate(limit);
            }
            Ok(Case { name: name.into(), queries, radius: radius.parse()?, k: k.parse()? })
        };
        Ok(Self { points: read(points)?, cases: cases.iter().map(case).collect::<Result<_>>()? })
    }

    fn run<'a, P: Peer<'a>>(&'a self, library: &str) -> Result<()> {
        let before = peak_memory()?;
        let mut built: Option<(P, f32, Spent)> = None;
        for case in &self.cases {
            if built.as_ref().is_some_and(|b| P::ONE_RADIUS && b.1 != case.radius) {
                built = None;
            }
            if P::ONE_RADIUS && case.radius == f32::INFINITY {
                continue;
            }
            let (peer, _, build) = built.get_or_insert_with(|| {
                let clock = Clock::start();
                let peer = P::build(&self.points, case.radius);
                (peer, case.radius, clock.stop())
            });
            let ask = |queries: &[Vec3]| match case.k {
                0 => Some(peer.kernel(queries, case.radius)),
                k => peer.nearest(queries, case.radius, k),
            };
            let warm_up = &case.queries[..case.queries.len().min(case.queries.len() / 16 + 256)];
            if ask(warm_up).is_none() {
                continue;
            }
            let clock = Clock::start();
            let Some(found) = ask(&case.queries) else { continue };
            let search = clock.stop();
            let line = json!({
                "library": library,
                "case": case.name,
                "build_ms": 1e3 * build.cpu,
                "build_wall_ms": 1e3 * build.wall,
                "ns_per_query": 1e9 * search.cpu / case.queries.len() as f64,
                "wall_ns_per_query": 1e9 * search.wall / case.queries.len() as f64,
                "queries": case.queries.len(),
                "neighbours": found.iter().map(|f: &Found| u64::from(f.n)).sum::<u64>(),
                "sum": found.iter().map(|f| f64::from(f.sum)).sum::<f64>(),
                "memory_mb": (peak_memory()? - before) / 1e6,
            });
            println!("{line}");
        }
        Ok(())
    }
}

fn read(path: &str) -> Result<Vec<Vec3>> {
    let bytes = std::fs::metadata(path).with_context(|| path.to_owned())?.len() as usize;
    let mut points = vec![Vec3::ZERO; bytes / size_of::<Vec3>()];
    std::io::Read::read_exact(&mut std::fs::File::open(path)?, bytemuck::cast_slice_mut(&mut points))?;
    Ok(points)
}

/// Bytes, of this process up to now.
fn peak_memory() -> Result<f64> {
    let status = std::fs::read_to_string("/proc/self/status")?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).context("no VmHWM")?;
    let kib: f64 = line.trim().trim_end_matches("kB").trim().parse()?;
    Ok(kib * 1024.0)
}

/// Seconds.
struct Spent {
    cpu: f64,
    wall: f64,
}

struct Clock {
    cpu: f64,
    wall: Instant,
}

impl Clock {
    fn start() -> Self {
        Self { cpu: cpu_seconds(), wall: Instant::now() }
    }

    fn stop(self) -> Spent {
        Spent { cpu: cpu_seconds() - self.cpu, wall: self.wall.elapsed().as_secs_f64() }
    }
}

/// Of all threads of this process.
fn cpu_seconds() -> f64 {
    let t = clock_gettime(ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
