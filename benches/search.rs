//! The neighbour search on the CPU, on the case of photons: points on the walls of a box and on a ball in it, queries where
//! the rays of a pinhole camera end, in the order of the pixels and shuffled; and k-NN among uniform points.
//! `cargo bench --bench search -- --help`

use std::time::Instant;

use glam::{Vec2, Vec3};
use sunfleck::index::{HashGrid, Nearest, PointBvh, Radii, RadiusSearch};
use sunfleck::math::{rng, warp};

const HELP: &str = "\
Options: --points N (500000)  --size WxH (1920x1080)  --neighbours N (50)  --rounds N (5)  --threads N (1)  --only PART
Prints medians of CPU nanoseconds, all threads together, per query (build: milliseconds), and least and most.";

struct Options {
    points: u32,
    size: [u32; 2],
    neighbours: f32,
    rounds: usize,
    threads: usize,
    only: String,
}

fn main() {
    let mut options =
        Options { points: 500_000, size: [1920, 1080], neighbours: 50.0, rounds: 5, threads: 1, only: String::new() };
    let mut args = std::env::args().skip(1).filter(|arg| arg != "--bench");
    while let Some(arg) = args.next() {
        let value = args.next().unwrap_or_default();
        let number = || value.parse().unwrap_or_else(|_| panic!("{arg} {value}\n{HELP}"));
        match arg.as_str() {
            "--points" => options.points = number() as u32,
            "--size" => {
                let parts: Vec<u32> = value.split('x').filter_map(|n| n.parse().ok()).collect();
                options.size = parts.try_into().unwrap_or_else(|_| panic!("{arg} {value}\n{HELP}"));
            }
            "--neighbours" => options.neighbours = number() as f32,
            "--rounds" => options.rounds = number(),
            "--threads" => options.threads = number(),
            "--only" => options.only = value,
            _ => return println!("{HELP}"),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().unwrap();
    pool.install(|| run(&options));
}

fn run(o: &Options) {
    let points: Vec<Vec3> = (0..o.points).map(photon).collect();
    let camera: Vec<Vec3> = (0..o.size[0] * o.size[1]).map(|i| eye_vertex(i, o.size)).collect();
    let mut shuffled = camera.clone();
    for i in (1..shuffled.len()).rev() {
        shuffled.swap(i, rng::pcg4d([i as u32, 1, 2, 3])[0] as usize % (i + 1));
    }
    let area = 24.0 + 4.0 * std::f32::consts::PI * BALL.1 * BALL.1;
    let radius = (o.neighbours / o.points as f32 * area / std::f32::consts::PI).sqrt();
    println!("{} points, {} queries, radius {radius}, {} threads\n", points.len(), camera.len(), o.threads);
    println!("| what | median | least | most | checksum |\n|---|---|---|---|---|");

    let mut tree = PointBvh::new(&points).unwrap();
    let grid = HashGrid::new(&points, radius).unwrap();
    let mut jobs: Vec<Job<'_>> = Vec::new();
    let (t, g) = (&tree, &grid);
    for (name, queries) in [("camera order", &camera), ("shuffled", &shuffled)] {
        let n = queries.len() as f64;
        let inverse = 1.0 / (radius * radius);
        jobs.push((format!("tree, batch, {name}"), n, Box::new(move || kernel_sum(t, queries, radius))));
        jobs.push((format!("grid, batch, {name}"), n, Box::new(move || kernel_sum(g, queries, radius))));
        jobs.push((
            format!("tree, one by one, {name}"),
            n,
            Box::new(move || {
                let one = |&q: &Vec3| {
                    let mut sum = 0.0f32;
                    t.within(q, radius, |_, d2| sum += 1.0 - d2 * inverse);
                    f64::from(sum)
                };
                queries.iter().map(one).sum()
            }),
        ));
    }
    measure(o, jobs);
    let mut builds = Vec::new();
    for _ in 0..=o.rounds {
        let start = cpu();
        tree.rebuild(points.len(), |i| points[i]);
        builds.push((cpu() - start) / 1e6);
    }
    print("build, ms", &mut builds[1..], 0.0);

    let points: Vec<Vec3> = (0..1_000_000).map(|i| uniform(i, 7)).collect();
    let queries: Vec<Vec3> = (0..32_768).map(|i| uniform(i, 8)).collect();
    let tree = &PointBvh::new(&points).unwrap();
    let (queries, n) = (&queries, queries.len() as f64);
    let mut jobs: Vec<Job<'_>> = Vec::new();
    for (radius, k) in [0.02, f32::INFINITY].into_iter().flat_map(|radius| [1, 4, 8].map(|k| (radius, k))) {
        jobs.push((
            format!("k-NN, k = {k}, within {radius}"),
            n,
            Box::new(move || {
                let lists = tree.nearest_all(queries, Radii::One(radius), k).unwrap();
                lists.distances2.iter().filter(|d| d.is_finite()).map(|&d| f64::from(d)).sum()
            }),
        ));
        jobs.push((
            format!("k-NN, k = {k}, within {radius}, one by one"),
            n,
            Box::new(move || {
                let mut nearest = Nearest::new(k);
                let one = |&q: &Vec3| {
                    tree.nearest(q, radius, &mut nearest);
                    nearest.found().iter().map(|found| f64::from(found.distance2)).sum::<f64>()
                };
                queries.iter().map(one).sum()
            }),
        ));
    }
    for radius in [0.005f32, 0.01, 0.02, 0.05] {
        jobs.push((
            format!("uniform, r = {radius}"),
            n,
            Box::new(move || {
                let sums = tree.fold_all(queries, Radii::One(radius), |_| 0.0f32, |sum, _, d2| *sum += d2);
                sums.unwrap().iter().map(|&s| f64::from(s)).sum()
            }),
        ));
    }
    measure(o, jobs);
}

/// Name, number of queries, and what is measured; it returns a checksum.
type Job<'a> = (String, f64, Box<dyn FnMut() -> f64 + 'a>);

/// The Epanechnikov kernel over the neighbours of each query, nothing stored; summed over the queries.
fn kernel_sum(index: &impl RadiusSearch, queries: &[Vec3], radius: f32) -> f64 {
    let inverse = 1.0 / (radius * radius);
    let sums = index.fold_all(queries, Radii::One(radius), |_| 0.0f32, |sum, _, d2| *sum += 1.0 - d2 * inverse);
    sums.unwrap().iter().map(|&sum| f64::from(sum)).sum()
}

/// Rounds in which the jobs take turns, after one that does not count.
fn measure(o: &Options, mut jobs: Vec<Job<'_>>) {
    jobs.retain(|(name, ..)| name.contains(&o.only));
    let mut times = vec![Vec::new(); jobs.len()];
    let mut sums = vec![0.0; jobs.len()];
    for round in 0..=o.rounds {
        for (i, (_, n, job)) in jobs.iter_mut().enumerate() {
            let start = cpu();
            sums[i] = job();
            let spent = (cpu() - start) / *n;
            if round > 0 {
                times[i].push(spent);
            }
        }
    }
    for ((name, ..), (times, sum)) in jobs.iter().zip(times.iter_mut().zip(sums)) {
        print(name, times, sum);
    }
}

fn print(name: &str, times: &mut [f64], sum: f64) {
    times.sort_unstable_by(f64::total_cmp);
    let (least, median, most) = (times[0], times[times.len() / 2], times[times.len() - 1]);
    println!("| {name} | {median:.1} | {least:.1} | {most:.1} | {sum:.6e} |");
}

/// Nanoseconds all threads have run; of the clock on the wall where the system does not say.
fn cpu() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let on_cpu = tasks.filter_map(|task| {
        let stat = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        stat.split_whitespace().next()?.parse::<f64>().ok()
    });
    let sum: f64 = on_cpu.sum();
    static START: std::sync::LazyLock<Instant> = std::sync::LazyLock::new(Instant::now);
    if sum > 0.0 { sum } else { START.elapsed().as_secs_f64() * 1e9 }
}

const BALL: (Vec3, f32) = (Vec3::new(0.3, -0.5, -0.2), 0.5);

fn uniform(i: u32, seed: u32) -> Vec3 {
    let [x, y, z, _] = rng::unit4(rng::pcg4d([i, seed, 1, 2]));
    Vec3::new(x, y, z)
}

/// Uniform on the faces of the cube from −1 to 1 and on the ball.
fn photon(i: u32) -> Vec3 {
    let [u, v, w, _] = rng::unit4(rng::pcg4d([i, 3, 1, 2]));
    let ball = 4.0 * std::f32::consts::PI * BALL.1 * BALL.1;
    let w = w * (24.0 + ball);
    if w >= 24.0 {
        return BALL.0 + warp::sphere([u, v]) * BALL.1;
    }
    let (face, at) = ((w / 4.0) as usize, Vec2::new(u, v) * 2.0 - 1.0);
    let side = if face % 2 == 0 { -1.0 } else { 1.0 };
    match face / 2 {
        0 => Vec3::new(side, at.x, at.y),
        1 => Vec3::new(at.x, side, at.y),
        _ => Vec3::new(at.x, at.y, side),
    }
}

/// What pixel i sees.
fn eye_vertex(i: u32, [w, h]: [u32; 2]) -> Vec3 {
    let eye = Vec3::new(-0.1, 0.1, 0.95);
    let at = Vec2::new((i % w) as f32 + 0.5, (i / w) as f32 + 0.5) / Vec2::new(w as f32, h as f32) * 2.0 - 1.0;
    let d = Vec3::new(at.x * w as f32 / h as f32 * 0.7, -at.y * 0.7, -1.0).normalize();
    let to = BALL.0 - eye;
    let (b, c) = (to.dot(d), to.length_squared() - BALL.1 * BALL.1);
    let wall = ((d.signum() - eye) / d).min_element();
    let t = if b * b > c { b - (b * b - c).sqrt() } else { wall };
    eye + d * t
}
