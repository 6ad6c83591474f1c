//! `mesh write FOLDER` makes the meshes; `mesh run WHAT FILE` measures one thing on one of them, a JSON line.
//!
//! A file of a mesh: numbers of vertices and of faces as u64, coordinates as f64, corners as u32; little-endian.

use std::path::Path;

use anyhow::{Context, Result, bail};
use serde_json::json;
use sunfleck::index::kd::{KdOptions, KdTree, LazyKd, Ray, RaySearch, Triangles};
use sunfleck::mesh::generate::{EROS_FACES, asteroid, icosphere};
use sunfleck::mesh::{CheckOptions, Mesh, check};

use crate::Clock;

pub fn write(folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder)?;
    for (name, mesh) in [("asteroid", asteroid(EROS_FACES, 0)), ("sphere", icosphere(6)), ("small", icosphere(2))] {
        let mut bytes = Vec::new();
        for n in [mesh.vertices.len(), mesh.faces.len()] {
            bytes.extend((n as u64).to_le_bytes());
        }
        bytes.extend(mesh.vertices.iter().flatten().flat_map(|x| x.to_le_bytes()));
        bytes.extend(mesh.faces.iter().flatten().flat_map(|v| v.to_le_bytes()));
        std::fs::write(folder.join(name).with_extension("mesh"), bytes)?;
    }
    Ok(())
}

fn read(path: &str) -> Result<Mesh> {
    let bytes = std::fs::read(path).with_context(|| path.to_owned())?;
    let (head, rest) = bytes.split_at_checked(16).context("too short")?;
    let [n, m] = [0, 8].map(|at| u64::from_le_bytes(std::array::from_fn(|i| head[at + i])) as usize);
    let (places, corners) = rest.split_at_checked(24 * n).context("too short")?;
    let places: Vec<f64> = places.chunks_exact(8).map(|b| f64::from_le_bytes(std::array::from_fn(|i| b[i]))).collect();
    let corners: Vec<u32> =
        corners.chunks_exact(4).map(|b| u32::from_le_bytes(std::array::from_fn(|i| b[i]))).collect();
    anyhow::ensure!(corners.len() == 3 * m, "{path}: {} corners for {m} faces", corners.len());
    let vertices = places.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
    Ok(Mesh { vertices, faces: corners.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect() })
}

/// `check`, `normals`: what faces point inward, with and without all else that is checked. `tree`, `lazy`: crossings of a
/// ray a face, from outside through its middle against its normal.
pub fn run(what: &str, path: &str) -> Result<()> {
    let mesh = read(path)?;
    let (answer, sum, spent) = match what {
        "check" | "normals" => {
            let mut options = CheckOptions { intersections: what == "check", ..CheckOptions::default() };
            options.kd.parallel = false;
            let clock = Clock::start();
            let report = check(&mesh, &options)?;
            let spent = clock.stop();
            (report.inward.len(), report.inward.iter().map(|&face| f64::from(face)).sum(), spent)
        }
        "tree" | "lazy" => {
            let rays = rays(&mesh)?;
            let triangles = mesh.triangles()?;
            let clock = Clock::start();
            let n = if what == "tree" { built(triangles, &rays)? } else { lazy(triangles, &rays)? };
            (n, 0.0, clock.stop())
        }
        _ => bail!("check | normals | tree | lazy"),
    };
    println!("{}", json!({ "cpu_s": spent.cpu, "wall_s": spent.wall, "answer": answer, "sum": sum }));
    Ok(())
}

fn built(triangles: Triangles<f64>, rays: &[Ray<f64>]) -> Result<usize> {
    let tree = KdTree::new(triangles, &KdOptions::default())?;
    Ok(rays.iter().map(|ray| tree.count(ray)).sum())
}

fn lazy(triangles: Triangles<f64>, rays: &[Ray<f64>]) -> Result<usize> {
    let tree = LazyKd::new(triangles, &KdOptions::default())?;
    Ok(rays.iter().map(|ray| tree.count(ray)).sum())
}

/// As `mesh_peer.py` makes them.
fn rays(mesh: &Mesh) -> Result<Vec<Ray<f64>>> {
    let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for p in &mesh.vertices {
        min = std::array::from_fn(|i| min[i].min(p[i]));
        max = std::array::from_fn(|i| max[i].max(p[i]));
    }
    let size = (0..3).map(|i| max[i] - min[i]).fold(0.0, f64::max);
    let ray = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        let minus = |p: [f64; 3], q: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| p[i] - q[i]) };
        let (u, v) = (minus(b, a), minus(c, a));
        let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        let normal = normal.map(|x| x / length);
        let origin = std::array::from_fn(|i| (a[i] + b[i] + c[i]) / 3.0 + size * normal[i]);
        Ok(Ray::new(origin, normal.map(|x| -x))?)
    };
    mesh.faces.iter().map(ray).collect()
}
