//! Triangle meshes: how they are made, and their check.

mod faults;
mod files;
mod generate;
mod intersections;
mod orientation;
#[cfg(feature = "render")]
mod program;

use sunfleck::mesh::{CheckOptions, Mesh, Report};

use crate::kd::meshes::{Random, icosphere};

/// Closed, outward, bumpy, with no symmetry; 20 · 4^level faces.
fn bumpy(level: u32, seed: u32) -> Mesh {
    let (mut vertices, faces) = icosphere(level);
    let mut r = Random::new(seed);
    let waves: Vec<_> = (0..6).map(|_| (r.vector().map(|x| 5.0 * x), r.unit() * 6.0)).collect();
    for p in &mut vertices {
        let wave = |(k, phase): &([f64; 3], f64)| (k[0] * p[0] + k[1] * p[1] + k[2] * p[2] + phase).sin();
        let radius = 1.0 + 0.08 * waves.iter().map(wave).sum::<f64>();
        *p = p.map(|x| x * radius);
    }
    Mesh { vertices, faces }
}

/// Each face is in it with that probability.
fn random_set(n: usize, share: f64, seed: u32) -> Vec<u32> {
    let mut r = Random::new(seed);
    (0..n as u32).filter(|_| r.unit() < share).collect()
}

/// Scaled, then moved.
fn placed(mesh: &Mesh, scale: f64, offset: [f64; 3]) -> Mesh {
    let place = |p: &[f64; 3]| std::array::from_fn(|axis| p[axis] * scale + offset[axis]);
    Mesh { vertices: mesh.vertices.iter().map(place).collect(), faces: mesh.faces.clone() }
}

fn reversed(mut mesh: Mesh) -> Mesh {
    mesh.flip(&(0..mesh.faces.len() as u32).collect::<Vec<_>>());
    mesh
}

/// Both in one.
fn together(a: &Mesh, b: &Mesh) -> Mesh {
    let mut both = a.clone();
    let n = a.vertices.len() as u32;
    both.vertices.extend(&b.vertices);
    both.faces.extend(b.faces.iter().map(|corners| corners.map(|v| v + n)));
    both
}

/// Outward.
fn tetrahedron() -> Mesh {
    let vertices = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    Mesh { vertices, faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]] }
}

fn check(mesh: &Mesh) -> Report {
    sunfleck::mesh::check(mesh, &CheckOptions::default()).unwrap()
}
