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
Options: --faces N,N,… (10000,32000,100000; spheres of about so many)  --mesh FILE.obj  --rounds N (5)  --threads N (1)
         --costs T,I (1,1)  --quadratic up to this many faces (2000)  --only TEXT of what is measured
What is measured: builders, with the slope of their times; `speed-up` of a build by N threads; `rays`; `together`, rays
and builds at once. Prints medians of milliseconds: of CPU, all threads together, and of the wall.";

struct Options {
    faces: Vec<f64>,
    mesh: Option<String>,
    rounds: usize,
    threads: usize,
    sah: Sah,
    quadratic: usize,
    only: String,
}

fn main() {
    let mut options = Options {
        faces: vec![10_000.0, 32_000.0, 100_000.0],
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
        let wrong = || -> ! {
            eprintln!("{arg} {value}\n{HELP}");
            std::process::exit(2)
        };
        let number = |text: &str| text.parse::<f64>().unwrap_or_else(|_| wrong());
        match arg.as_str() {
            "--faces" => options.faces = value.split(',').map(number).collect(),
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
        None => options.faces.iter().map(|n| sphere((n / 8.0).sqrt().round().max(1.0) as i32)).collect(),
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
        let rays = shuffled(rays);
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
        let points: Vec<_> = growth.iter().filter(|g| g.0 == builder).map(|&(_, n, cpu)| (n.ln(), cpu.ln())).collect();
        if points.len() > 1 {
            let n = points.len() as f64;
            let (x, y) = points.iter().fold((0.0, 0.0), |(x, y), p| (x + p.0 / n, y + p.1 / n));
            let up: f64 = points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum();
            let along: f64 = points.iter().map(|p| (p.0 - x).powi(2)).sum();
            println!("{builder:?}: time grows as faces to the power of {:.3}", up / along);
        }
    }
}

/// The mesh check's: from each face along its normal.
fn rays(triangles: &Triangles<f64>) -> Vec<Ray<f64>> {
    (0..triangles.len() as u32)
        .filter_map(|face| {
            let [a, b, c] = triangles.corners(face);
            let minus = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
            let (u, v) = (minus(b, a), minus(c, a));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            Ray::new(std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0), normal).ok()
        })
        .collect()
}

/// In no order, as they would come from users.
fn shuffled(mut rays: Vec<Ray<f64>>) -> Vec<Ray<f64>> {
    let mut state = 1u64;
    for i in (1..rays.len()).rev() {
        // PCG's multiplier and increment; the upper bits are random enough.
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        rays.swap(i, (state >> 33) as usize % (i + 1));
    }
    rays
}
