//! Building a tree and asking it at once: how many rays are answered in each slice of time, by three ways to go about it.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::time::Instant;

use rayon::prelude::*;
use sunfleck::index::kd::{Builder, KdOptions, KdTree, LazyKd, Ray, RaySearch, Sah, Triangles};

use super::clock::{Spent, clocked};

const SLICE_MS: f64 = 10.0;
const SLICES: usize = 1 << 14;
/// Rays that a thread asks between looks at the clock.
const BLOCK: usize = 16;
const WAYS: [&str; 3] = ["all built, then asked", "built where asked", "built beside"];

struct Answers {
    start: Instant,
    slices: Vec<AtomicU32>,
    /// Nanoseconds until the first block was answered.
    first: AtomicU64,
    hits: AtomicU64,
}

impl Answers {
    fn new() -> Self {
        let slices = (0..SLICES).map(|_| AtomicU32::new(0)).collect();
        Self { start: Instant::now(), slices, first: AtomicU64::new(u64::MAX), hits: AtomicU64::new(0) }
    }

    fn ask(&self, search: &impl RaySearch<f64>, rays: &[Ray<f64>]) {
        rays.par_chunks(BLOCK).for_each(|rays| {
            let hits = rays.iter().map(|ray| search.count(ray)).sum::<usize>();
            let elapsed = self.start.elapsed();
            self.hits.fetch_add(hits as u64, Ordering::Relaxed);
            self.first.fetch_min(elapsed.as_nanos() as u64, Ordering::Relaxed);
            let slice = (elapsed.as_secs_f64() * 1e3 / SLICE_MS) as usize;
            self.slices[slice.min(SLICES - 1)].fetch_add(rays.len() as u32, Ordering::Relaxed);
        });
    }
}

/// In the rayon pool it is called in. The ways take turns, `rounds` times; of each the run of median time is printed.
pub fn together(triangles: &Triangles<f64>, rays: &[Ray<f64>], sah: Sah, rounds: usize) {
    let options = KdOptions { builder: Builder::SortOnce, sah, parallel: true };
    let mut runs: [Vec<(Spent, f64, Answers)>; 3] = Default::default();
    for _ in 0..rounds {
        for (way, runs) in runs.iter_mut().enumerate() {
            let triangles = triangles.clone();
            let answers = Answers::new();
            // Until the tree was whole, in milliseconds.
            let (spent, ready) = clocked(|| {
                let since = || answers.start.elapsed().as_secs_f64() * 1e3;
                if way == 0 {
                    let tree = KdTree::new(triangles, &options).expect("a tree");
                    let ready = since();
                    answers.ask(&tree, rays);
                    return ready;
                }
                let tree = LazyKd::new(triangles, &options).expect("a tree");
                if way == 1 {
                    answers.ask(&tree, rays);
                    return f64::NAN;
                }
                let grow = || {
                    tree.grow().expect("a tree");
                    since()
                };
                rayon::join(grow, || answers.ask(&tree, rays)).0
            });
            runs.push((spent, ready, answers));
        }
    }
    let hits = |run: &(Spent, f64, Answers)| run.2.hits.load(Ordering::Relaxed);
    assert!(runs.iter().flatten().all(|run| hits(run) == hits(&runs[0][0])), "all ways find as many hits");
    println!("  rays answered in each {SLICE_MS} ms, of {}:", rays.len());
    for (runs, way) in runs.iter_mut().zip(WAYS) {
        runs.sort_by(|a, b| a.0.wall.total_cmp(&b.0.wall));
        let (spent, ready, answers) = &runs[runs.len() / 2];
        let first = answers.first.load(Ordering::Relaxed) as f64 / 1e6;
        let tree = if ready.is_nan() { String::from("never whole") } else { format!("whole at {ready:.1} ms") };
        let Spent { cpu, wall } = spent;
        println!("    {way}: first {first:.1} ms, all {wall:.1} ms, {cpu:.1} ms of CPU, tree {tree}");
        let slices = &answers.slices[..((wall / SLICE_MS) as usize + 1).min(SLICES)];
        let counts: Vec<_> = slices.iter().map(|slice| slice.load(Ordering::Relaxed).to_string()).collect();
        println!("      {}", counts.join(" "));
    }
}
