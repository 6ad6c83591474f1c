//! Times every stage of an iteration over the shipped scenes, on the CPU with either accelerator and on a GPU.
//!
//! ```text
//! cargo bench --bench iteration -- --scene glass --scene pool --size 512x512 --photons 100000,500000 --json out.json
//! ```
//!
//! Backends take turns (A B A B) within a run; figures are medians over the iterations, the first ones not counted. With
//! `--threads 1` seconds on the CPU are CPU seconds.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context as _, Result, bail};
use clap::Parser;
use serde_json::{Value, json};
use sunfleck::cpu::trace::{self, Ray, Seer};
use sunfleck::cpu::{CpuStages, camera};
use sunfleck::layout;
use sunfleck::math::{rng, warp};
use sunfleck::ppm::{self, Params, StageTimes, Stages};
use sunfleck::scene::{Accelerator, Material, PackedScene, Scene, shipped};

#[derive(Parser)]
#[command(about = "Times every stage of an iteration")]
struct Args {
    /// Shipped scene; repeatable [default: all]
    #[arg(long)]
    scene: Vec<String>,
    /// Pixels
    #[arg(long, default_value = "512x512", value_name = "WxH")]
    size: String,
    /// Photon paths an iteration; several separated by commas
    #[arg(long, default_value = "262144", value_delimiter = ',')]
    photons: Vec<u32>,
    /// `cpu`, `cpu-kd` (its kd-tree), `gpu`; several separated by commas
    #[arg(long, default_value = "cpu,gpu", value_delimiter = ',')]
    backend: Vec<String>,
    /// Iterations counted
    #[arg(long, default_value_t = 10)]
    iterations: u32,
    /// Iterations not counted, first
    #[arg(long, default_value_t = 2)]
    warm_up: u32,
    /// What finds the distances of first radii for a GPU: `device`, `host` [default: as a render does]
    #[arg(long, value_parser = ["device", "host"])]
    reaches: Option<String>,
    /// CPU threads [default: all]
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Write the figures there as JSON
    #[arg(long)]
    json: Option<std::path::PathBuf>,
    /// What cargo adds
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<()> {
    let args = Args::parse();
    rayon::ThreadPoolBuilder::new().num_threads(args.threads).build_global()?;
    let (width, height) = args.size.split_once('x').context("--size is not WxH")?;
    let size = [width.parse()?, height.parse()?];
    let names: Vec<&str> = match args.scene.as_slice() {
        [] => shipped::NAMES.to_vec(),
        some => some.iter().map(String::as_str).collect(),
    };
    let mut rows = Vec::new();
    println!("milliseconds, median (least – most) of {} iterations, {}x{}", args.iterations, size[0], size[1]);
    for name in names {
        let scene = shipped::shipped(name).with_context(|| format!("no scene {name}"))?;
        let camera = scene.cameras.first().context("no camera")?.pack(size[0], size[1]);
        let start = Instant::now();
        let packed = Arc::new(PackedScene::new(&scene));
        let (seconds, bytes) = (start.elapsed().as_secs_f64(), size_of_val(packed.nodes.as_slice()));
        println!("{name}, packed with its BVH in {:.1} ms, nodes {bytes} bytes", 1e3 * seconds);
        rows.push(json!({ "scene": name, "packMilliseconds": 1e3 * seconds, "packAgainMilliseconds": changes(&scene, &packed) }));
        let mut kd = None;
        if args.backend.iter().any(|b| b == "cpu-kd") {
            let unaccelerated = PackedScene::clone(&packed);
            let start = Instant::now();
            let accelerated = Arc::new(unaccelerated.accelerated(Accelerator::Kd)?);
            let (seconds, bytes) = (start.elapsed().as_secs_f64(), accelerated.kd.as_ref().map_or(0, |kd| kd.bytes()));
            println!("{name}, kd-tree in {:.1} ms, {bytes} bytes", 1e3 * seconds);
            rows.push(json!({ "scene": name, "rays": rays([&packed, &accelerated], &camera, size) }));
            kd = Some(accelerated);
        }
        for &n_paths in &args.photons {
            let params = Params { n_paths, ..Params::new(size[0], size[1]) };
            let mut backends = Vec::new();
            for backend in &args.backend {
                let stages: Option<Box<dyn Stages>> = match backend.as_str() {
                    "cpu" => Some(Box::new(CpuStages::new(packed.clone(), camera, size))),
                    "cpu-kd" => {
                        kd.as_ref().map(|kd| Box::new(CpuStages::new(kd.clone(), camera, size)) as Box<dyn Stages>)
                    }
                    "gpu" => gpu(&packed, camera, args.reaches.as_deref()),
                    other => bail!("no backend {other}"),
                };
                backends.extend(stages);
            }
            rows.extend(measure(&args, name, &params, backends)?);
        }
    }
    if let Some(path) = &args.json {
        std::fs::write(path, serde_json::to_string_pretty(&rows)?).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Milliseconds to pack the scene again once a material is rougher, and once it shines; medians.
fn changes(scene: &Scene, packed: &PackedScene) -> [f64; 2] {
    let mut changed = scene.clone();
    let mut time = |change: fn(&mut Material)| {
        changed.materials.iter_mut().take(1).for_each(change);
        let times = (0..9).map(|_| {
            let start = Instant::now();
            black_box(PackedScene::new_after(packed, &changed));
            1e3 * start.elapsed().as_secs_f64()
        });
        median(times.collect())
    };
    let times = [time(|m| m.roughness = 0.5 * m.roughness + 0.25), time(|m| m.emission += 1.0)];
    println!(
        "  packed again with a rougher material in {:.2} ms, with one that shines in {:.2} ms",
        times[0], times[1]
    );
    times
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

#[cfg(feature = "gpu")]
fn gpu(packed: &PackedScene, camera: sunfleck::layout::Camera, reaches: Option<&str>) -> Option<Box<dyn Stages>> {
    use sunfleck::gpu::{Choice, Context, GpuStages};
    let stages = Context::new(&Choice::Any).and_then(|c| GpuStages::new(Arc::new(c), packed, camera));
    let mut stages = stages.map_err(|e| println!("no GPU: {e}")).ok()?;
    if let Some(reaches) = reaches {
        stages.set_reaches_on_device(reaches == "device");
    }
    Some(Box::new(stages))
}

#[cfg(not(feature = "gpu"))]
fn gpu(_: &PackedScene, _: sunfleck::layout::Camera, _: Option<&str>) -> Option<Box<dyn Stages>> {
    println!("built without the GPU backend");
    None
}

/// Nanoseconds a ray, one thread, median of rounds in which the two accelerators take turns: the camera's rays, and rays from
/// where they end into any direction, for the nearest hit and for any.
fn rays(scenes: [&PackedScene; 2], camera: &layout::Camera, size: [u32; 2]) -> Value {
    const ROUNDS: usize = 9;
    let ray = |origin, direction, i| Ray { origin, direction, t_max: f32::INFINITY, alpha_seed: i, seer: Seer::Eye };
    let frame = Params::new(size[0], size[1]).frame(1);
    let random = |i: u32| rng::pcg4d([i, 1, 2, 3]).map(rng::unit);
    let first: Vec<Ray> = (0..size[0] * size[1])
        .map(|i| {
            let (origin, direction) = camera::ray(camera, &frame, i % size[0], i / size[0], random(i));
            ray(origin, direction, i)
        })
        .collect();
    let next = |r: &Ray| {
        let hit = trace::nearest(scenes[0], r)?;
        let u = random(!r.alpha_seed);
        Some(ray(r.origin + (hit.t * 0.9999) * r.direction, warp::sphere([u[0], u[1]]), r.alpha_seed))
    };
    let second: Vec<Ray> = first.iter().filter_map(next).collect();
    type Ask = fn(&PackedScene, &Ray) -> bool;
    let asks: [(&str, &[Ray], Ask); 3] = [
        ("camera, nearest", &first, |scene, ray| trace::nearest(scene, ray).is_some()),
        ("second, nearest", &second, |scene, ray| trace::nearest(scene, ray).is_some()),
        ("second, any", &second, trace::occluded),
    ];
    let mut found = serde_json::Map::new();
    for (what, rays, ask) in asks {
        let mut times = [const { Vec::new() }; 2];
        for _ in 0..ROUNDS {
            for (scene, times) in scenes.iter().zip(&mut times) {
                let start = Instant::now();
                black_box(rays.iter().filter(|ray| ask(scene, ray)).count());
                times.push(1e9 * start.elapsed().as_secs_f64() / rays.len().max(1) as f64);
            }
        }
        let [bvh, kd] = times.map(median);
        println!("  {what:<16} bvh {bvh:7.0} ns, kd {kd:7.0} ns, {:.2}", kd / bvh);
        found.insert(what.into(), json!({ "bvh": bvh, "kd": kd, "rays": rays.len() }));
    }
    found.into()
}

fn measure(args: &Args, scene: &str, params: &Params, mut backends: Vec<Box<dyn Stages>>) -> Result<Vec<Value>> {
    let mut times: Vec<Vec<StageTimes>> = vec![Vec::new(); backends.len()];
    let mut starts = vec![Vec::new(); backends.len()];
    for _ in 0..5 {
        for (stages, starts) in backends.iter_mut().zip(&mut starts) {
            let start = Instant::now();
            ppm::start(stages.as_mut(), params)?;
            starts.push(1e3 * start.elapsed().as_secs_f64());
        }
    }
    for i in 1..=args.warm_up + args.iterations {
        for (stages, times) in backends.iter_mut().zip(&mut times) {
            ppm::iterate(stages.as_mut(), &params.frame(i))?;
            if i > args.warm_up {
                times.push(stages.times()?);
            }
        }
    }
    let mut rows = Vec::new();
    for ((stages, times), starts) in backends.iter().zip(&times).zip(starts) {
        type Of = fn(&StageTimes) -> f64;
        let stage_names: [(&str, Of); 6] = [
            ("eye", |t| t.eye),
            ("photons", |t| t.photons),
            ("build", |t| t.build),
            ("gather", |t| t.gather),
            ("accumulate", |t| t.accumulate),
            ("total", StageTimes::total),
        ];
        println!("{scene}, {} paths, {} photons stored, {}", params.n_paths, stages.n_photons(), stages.device());
        let of_stages = stage_names.map(|(stage, of)| (stage, times.iter().map(|t| 1e3 * of(t)).collect()));
        let mut milliseconds = serde_json::Map::new();
        // The pilot and the first radii, before the first iteration.
        for (stage, mut values) in [("start", starts)].into_iter().chain(of_stages) {
            values.sort_by(f64::total_cmp);
            let median = values.get(values.len() / 2).copied().context("--iterations is 0")?;
            let (least, most) = (values[0], values[values.len() - 1]);
            println!("  {stage:<10} {median:9.2}  ({least:.2} – {most:.2})");
            milliseconds.insert(stage.into(), json!({ "median": median, "least": least, "most": most }));
        }
        rows.push(json!({
            "scene": scene,
            "device": stages.device(),
            "size": params.size,
            "photonPaths": params.n_paths,
            "photonsStored": stages.n_photons(),
            "iterations": args.iterations,
            "milliseconds": milliseconds,
        }));
    }
    Ok(rows)
}
