//! kd-trees over triangles: builds and rays, over spheres of growing numbers of faces, or over a mesh of the user's.
//! `cargo bench --no-default-features --bench kd -- --help`

use std::collections::HashMap;
use std::hint::black_box;
use std::time::Instant;

use sunfleck::index::kd::{Builder, KdOptions, KdTree, LazyKd, Ray, RaySearch, Sah, Triangles};

const HELP: &str = "\
Options: --levels FROM..TO (5..7: spheres of 8·4^level faces)  --mesh FILE.obj  --rounds N (5)  --threads N (1)
         --costs T,I (1,1)  --quadratic up to this many faces (2000)
Prints medians of milliseconds: of CPU, all threads together, the least beside, and of the wall.";

type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

struct Options {
    levels: (u32, u32),
    mesh: Option<String>,
    rounds: usize,
    threads: usize,
    sah: Sah,
    quadratic: usize,
}

fn main() {
    let mut options =
        Options { levels: (5, 7), mesh: None, rounds: 5, threads: 1, sah: Sah::default(), quadratic: 2000 };
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
            "--threads" => options.threads = number(&value) as usize,
            "--quadratic" => options.quadratic = number(&value) as usize,
            "--costs" => {
                let (traversal, intersection) = value.split_once(',').unwrap_or_else(|| wrong());
                options.sah.traversal = number(traversal);
                options.sah.intersection = number(intersection);
            }
            _ => wrong(),
        }
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads).build().expect("threads can be started");
    pool.install(|| match &options.mesh {
        Some(path) => measure(&read(path), &options),
        None => {
            for level in options.levels.0..=options.levels.1 {
                measure(&sphere(level), &options);
            }
        }
    });
}

/// Medians of the CPU milliseconds of all threads and of the wall's that `run` takes.
fn time<T>(rounds: usize, mut run: impl FnMut() -> T) -> String {
    let (mut on_cpu, mut wall): (Vec<_>, Vec<_>) = (0..rounds)
        .map(|_| {
            let (start, before) = (Instant::now(), cpu());
            black_box(run());
            (cpu() - before, start.elapsed().as_secs_f64() * 1e3)
        })
        .unzip();
    on_cpu.sort_by(f64::total_cmp);
    wall.sort_by(f64::total_cmp);
    format!("{:.1} ms of CPU (least {:.1}), {:.1} ms", on_cpu[rounds / 2], on_cpu[0], wall[rounds / 2])
}

/// Milliseconds that the threads of this process have been on a core (Linux; elsewhere zero).
fn cpu() -> f64 {
    let tasks = std::fs::read_dir("/proc/self/task").into_iter().flatten().flatten();
    let on_cpu = tasks.filter_map(|task| {
        let text = std::fs::read_to_string(task.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    });
    on_cpu.sum::<f64>() / 1e6
}

fn measure((vertices, faces): &Mesh, options: &Options) {
    let triangles = || Triangles::new(vertices.clone(), faces.clone()).expect("a mesh");
    let parallel = options.threads > 1;
    let with = |builder| KdOptions { builder, sah: options.sah, parallel };
    let build = |builder| KdTree::new(triangles(), &with(builder)).expect("a tree");
    println!("{} faces, {} threads", faces.len(), options.threads);
    for builder in [Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce] {
        if builder != Builder::Quadratic || faces.len() <= options.quadratic {
            println!("  build, {builder:?}: {}", time(options.rounds, || build(builder)));
        }
    }
    let tree = build(Builder::SortOnce);
    println!("  {:.1} bytes a face, {} nodes", tree.bytes() as f64 / faces.len() as f64, tree.nodes().count());
    // The mesh check's rays: from each face along its normal.
    let rays: Vec<_> = (0..faces.len() as u32)
        .filter_map(|face| {
            let [a, b, c] = tree.triangles().corners(face);
            let minus = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
            let (u, v) = (minus(b, a), minus(c, a));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
            Ray::new(std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0), normal).ok()
        })
        .collect();
    let count = |search: &dyn Fn(&Ray<f64>) -> usize| rays.iter().map(search).sum::<usize>();
    println!("  a ray a face: {}", time(options.rounds, || count(&|ray| tree.count(ray))));
    println!(
        "  built and a ray a face: {}",
        time(options.rounds, || {
            let tree = build(Builder::SortOnce);
            count(&|ray| tree.count(ray))
        })
    );
    println!(
        "  built lazily and a ray a face: {}",
        time(options.rounds, || {
            let tree = LazyKd::new(triangles(), &with(Builder::SortOnce)).expect("a tree");
            count(&|ray| tree.count(ray))
        })
    );
}

/// Vertices and triangles of an OBJ file.
fn read(path: &str) -> Mesh {
    let text = std::fs::read_to_string(path).expect("the mesh can be read");
    let mut mesh: Mesh = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => mesh.0.push([(); 3].map(|()| words.next().and_then(|w| w.parse().ok()).expect("a number"))),
            Some("f") => mesh.1.push([(); 3].map(|()| {
                let index: u32 = words.next().and_then(|w| w.split('/').next()?.parse().ok()).expect("an index");
                index - 1
            })),
            _ => {}
        }
    }
    mesh
}

/// An octahedron whose faces are split in four, `level` times: 8·4^level faces.
fn sphere(level: u32) -> Mesh {
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for axis in 0..3 {
        for sign in [1.0, -1.0] {
            let mut p = [0.0; 3];
            p[axis] = sign;
            vertices.push(p);
        }
    }
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for [x, y, z] in [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]] {
        faces.push([x, y, z]);
    }
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut split = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum: [f64; 3] = std::array::from_fn(|i| vertices[a as usize][i] + vertices[b as usize][i]);
                    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                    vertices.push(sum.map(|x| x / length));
                    vertices.len() as u32 - 1
                })
            });
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = split;
    }
    // Turned, so that no edge lies along an axis.
    for p in &mut vertices {
        let (s, c) = 0.5f64.sin_cos();
        let [x, y, z] = *p;
        let [x, y] = [c * x - s * y, s * x + c * y];
        *p = [x, c * y - s * z, s * y + c * z];
    }
    (vertices, faces)
}
