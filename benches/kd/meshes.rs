//! The meshes that are built over.

use std::collections::HashMap;

/// Vertices, and three of them for each face.
pub type Mesh = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// Vertices and triangles of an OBJ file.
pub fn read(path: &str) -> Mesh {
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

/// An octahedron whose edges are cut into `n` parts, blown up to a sphere: 8·n² faces, outward.
pub fn sphere(n: i32) -> Mesh {
    let mut mesh: Mesh = (Vec::new(), Vec::new());
    let mut places = HashMap::new();
    let mut vertex = |p: [i32; 3]| {
        *places.entry(p).or_insert_with(|| {
            let length = p.iter().map(|&x| f64::from(x).powi(2)).sum::<f64>().sqrt();
            let [x, y, z] = p.map(|x| f64::from(x) / length);
            // Turned, so that no edge lies along an axis.
            let (s, c) = 0.5f64.sin_cos();
            let [x, y] = [c * x - s * y, s * x + c * y];
            mesh.0.push([x, c * y - s * z, s * y + c * z]);
            mesh.0.len() as u32 - 1
        })
    };
    for octant in 0..8 {
        let sign = [0, 1, 2].map(|axis| 1 - 2 * (octant >> axis & 1));
        let mut at = |i: i32, j: i32| vertex([i * sign[0], j * sign[1], (n - i - j) * sign[2]]);
        let mut face =
            |[a, b, c]: [u32; 3]| mesh.1.push(if sign.iter().product::<i32>() > 0 { [a, b, c] } else { [a, c, b] });
        for i in 0..n {
            for j in 0..n - i {
                let (a, b) = (at(i + 1, j), at(i, j + 1));
                face([a, b, at(i, j)]);
                if i + j + 2 <= n {
                    face([a, at(i + 1, j + 1), b]);
                }
            }
        }
    }
    mesh
}
