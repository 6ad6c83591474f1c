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

/// An octahedron whose faces are split in four, `level` times: 8·4^level faces.
pub fn sphere(level: u32) -> Mesh {
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
