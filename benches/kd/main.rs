//! kd-trees over triangles: builds and rays, over spheres of growing numbers of faces, or over a mesh of the user's.
//! `cargo bench --no-default-features --bench kd -- --help`

mod clock;
mod meshes;
mod together;

use rayon::{ThreadPool, ThreadPoolBuilder};
use sunfleck::index::kd::{Builder, KdOptions, KdTree, LazyKd, Ray, RaySearch, Sah, Triangles};

use clock::{Spent, Summary, clocked};
use meshes::{Mesh, read, sphere};

const HELP: &str = "\
Options: --levels FROM..TO (5..7: spheres of 8·4^level faces)  --mesh FILE.obj  --rounds N (5)  --threads N (1)
         --costs T,I (1,1)  --quadratic up to this many faces (2000)  --only TEXT of what is measured
What is measured: builders, with the slope of their times; `speed-up` of a build by N threads; `rays`; `together`, rays
and builds at once. Prints medians of milliseconds: of CPU, all threads together, and of the wall.";

struct Options {
    levels: (u32, u32),
    mesh: Option<String>,
    rounds: usize,
    threads: usize,
    sah: Sah,
    quadratic: usize,
    only: String,
}

fn main() {
    let mut options = Options {
        levels: (5, 7),
        mesh: None,
        rounds: 5,
        threads: 1,
        sah: Sah::default(),
        quadratic: 2000,
        only: String::new(),
    };
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    while let Some(arg) = args.next() {
        let value = args.next().unwrap_or_default();
        let wrong = || -> ! { panic!("{arg} {value}\n{HELP}") };
        let number = |text: &str| text.parse::<f64>().unwrap_or_else(|_| wrong());
        match arg.as_str() {
            "--levels" => {
                let (from, to) = value.split_once("..").unwrap_or_else(|| wrong());
                options.levels = (number(from) as u32, number(to) as u32);
            }
            "--mesh" => options.mesh = Some(value),
            "--rounds" => options.rounds = (number(&value) as usize).max(1),
            "--threads" => options.threads = (number(&value) as usize).max(1),
            "--quadratic" => options.quadratic = number(&value) as usize,
            "--only" => options.only = value,
            "--costs" => {
                let (traversal, intersection) = value.split_once(',').unwrap_or_else(|| wrong());
                options.sah.traversal = number(traversal);
                options.sah.intersection = number(intersection);
            }
            _ => wrong(),
        }
    }
    let meshes: Vec<Mesh> = match &options.mesh {
        Some(path) => vec![read(path)],
        None => (options.levels.0..=options.levels.1).map(sphere).collect(),
    };
    let mut growth = Vec::new();
    for (vertices, faces) in meshes {
        println!("{} faces, {} threads", faces.len(), options.threads);
        measure(&Triangles::new(vertices, faces).expect("a mesh"), &options, &mut growth);
    }
    print_slopes(&growth);
}

impl Options {
    fn wants(&self, what: &str) -> bool {
        what.contains(self.only.as_str())
    }

    fn pool(&self, threads: usize) -> ThreadPool {
        ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started")
    }

    fn build(&self, triangles: &Triangles<f64>, builder: Builder, parallel: bool) -> (Spent, KdTree<f64>) {
        let (options, triangles) = (KdOptions { builder, sah: self.sah, parallel }, triangles.clone());
        clocked(|| KdTree::new(triangles, &options).expect("a tree"))
    }

    fn time<T>(&self, mut run: impl FnMut() -> T) -> Summary {
        Summary::of(&(0..self.rounds).map(|_| clocked(&mut run).0).collect::<Vec<_>>())
    }
}

fn measure(triangles: &Triangles<f64>, options: &Options, growth: &mut Vec<(Builder, f64, f64)>) {
    let (pool, n) = (options.pool(options.threads), triangles.len());
    let parallel = options.threads > 1;
    for builder in [Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce] {
        if options.wants(&format!("{builder:?}")) && (builder != Builder::Quadratic || n <= options.quadratic) {
            let build = || options.build(triangles, builder, parallel).0;
            let spent: Vec<_> = (0..options.rounds).map(|_| pool.install(build)).collect();
            let summary = Summary::of(&spent);
            println!("  build, {builder:?}: {summary}");
            growth.push((builder, n as f64, summary.cpu));
        }
    }
    if options.wants("speed-up") && parallel {
        speed_up(triangles, options);
    }
    if !(options.wants("rays") || options.wants("together")) {
        return;
    }
    let (_, tree) = pool.install(|| options.build(triangles, Builder::SortOnce, parallel));
    println!("  {:.1} bytes a face, {} nodes", tree.bytes() as f64 / n as f64, tree.nodes().count());
    let rays = rays(triangles);
    let count = |search: &dyn Fn(&Ray<f64>) -> usize| rays.iter().map(search).sum::<usize>();
    if options.wants("rays") {
        println!("  a ray a face: {}", options.time(|| count(&|ray| tree.count(ray))));
        let both = options.time(|| {
            let (_, tree) = pool.install(|| options.build(triangles, Builder::SortOnce, parallel));
            count(&|ray| tree.count(ray))
        });
        println!("  built and a ray a face: {both}");
        let lazily = options.time(|| {
            let with = KdOptions { builder: Builder::SortOnce, sah: options.sah, parallel };
            let tree = pool.install(|| LazyKd::new(triangles.clone(), &with)).expect("a tree");
            count(&|ray| tree.count(ray))
        });
        println!("  built lazily and a ray a face: {lazily}");
    }
    if options.wants("together") && parallel {
        pool.install(|| together::together(triangles, &rays, options.sah, options.rounds));
    }
}

/// One thread and several in turns.
fn speed_up(triangles: &Triangles<f64>, options: &Options) {
    let pools = [options.pool(1), options.pool(options.threads)];
    let mut spent = [Vec::new(), Vec::new()];
    for _ in 0..options.rounds {
        for ((pool, spent), parallel) in pools.iter().zip(&mut spent).zip([false, true]) {
            spent.push(pool.install(|| options.build(triangles, Builder::SortOnce, parallel).0));
        }
    }
    let [one, many] = spent.map(|spent| Summary::of(&spent));
    println!("  one thread: {one}\n  {} threads: {many}", options.threads);
    let ratios = [one.wall / many.wall, one.least_wall / many.least_wall, many.cpu / one.cpu];
    println!("  speed-up {:.2} (of the least {:.2}), at {:.2} times the CPU", ratios[0], ratios[1], ratios[2]);
}

/// The slope of a line through the logarithms of sizes and CPU times, for each builder.
fn print_slopes(growth: &[(Builder, f64, f64)]) {
    for builder in [Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce] {
        let points: Vec<_> =
            growth.iter().filter(|g| g.0 == builder).map(|&(_, n, cpu)| (n.ln(), cpu.ln())).collect();
        if points.len() > 1 {
            let n = points.len() as f64;
            let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
            let up: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
            let along: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
            println!("{builder:?}: time grows as faces to the power of {:.3}", up / along);
        }
    }
}

/// The mesh check's: from each face along its normal. In no order, as they would come from a queue.
fn rays(triangles: &Triangles<f64>) -> Vec<Ray<f64>> {
    let n = triangles.len() as u64;
    // A step without a factor in common with n visits all.
    let gcd = |mut a: u64, mut b: u64| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let step = (0..).map(|i| (n as f64 * 0.618) as u64 + i).find(|&step| gcd(step, n) == 1).unwrap_or(1);
    (0..n)
        .filter_map(|i| {
            let [a, b, c] = triangles.corners((i * step % n) as u32);
            let minus = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
            let (u, v) = (minus(b, a), minus(c, a));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            Ray::new(std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0), normal).ok()
        })
        .collect()
}
