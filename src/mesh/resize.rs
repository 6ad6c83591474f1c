//! The same shape with more faces, or with fewer.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use glam::DVec3;

use super::Mesh;
use super::collapse::Collapse;

/// Splits ([`subdivide`]) or simplifies ([`decimate`]) a mesh to `n_faces`, or as near as those can.
pub fn resize(mesh: &Mesh, n_faces: usize) -> Mesh {
    if n_faces < mesh.faces.len() { decimate(mesh, n_faces) } else { subdivide(mesh, n_faces) }
}

/// Halves the longest edge until there are `n_faces` (Rivara 1984), or one more: an edge halved inside of a surface gives two
/// faces. The surface stays where it is.
///
/// Edges without length are not halved, so a mesh of nothing else is returned as it is. Indices must be in range.
pub fn subdivide(mesh: &Mesh, n_faces: usize) -> Mesh {
    let Mesh { mut vertices, mut faces } = mesh.clone();
    let mut stars = stars(&vertices, &faces);
    let entry = |vertices: &[[f64; 3]], a: u32, b: u32| {
        let length = DVec3::from(vertices[a as usize]).distance_squared(DVec3::from(vertices[b as usize]));
        // Positive numbers are in the order of their bits.
        (length.to_bits(), Reverse((a.min(b), a.max(b))))
    };
    let mut longest: BinaryHeap<_> = edges(&faces).into_iter().map(|(a, b)| entry(&vertices, a, b)).collect();
    while faces.len() < n_faces
        && let Some((length, Reverse((a, b)))) = longest.pop()
    {
        let around: Vec<u32> = stars[a as usize].iter().copied().filter(|&f| faces[f as usize].contains(&b)).collect();
        let length = f64::from_bits(length);
        if around.is_empty() || !(length > 0.0 && length.is_finite()) {
            continue;
        }
        let middle = vertices.len() as u32;
        vertices.push(DVec3::from(vertices[a as usize]).midpoint(DVec3::from(vertices[b as usize])).to_array());
        stars.push(around.clone());
        stars[b as usize].retain(|f| !around.contains(f));
        longest.extend([entry(&vertices, a, middle), entry(&vertices, middle, b)]);
        for face in around {
            let other = faces.len() as u32;
            let with = |old: u32, new: u32, of: [u32; 3]| of.map(|v| if v == old { new } else { v });
            let corners = faces[face as usize];
            faces[face as usize] = with(b, middle, corners);
            faces.push(with(a, middle, corners));
            stars[b as usize].push(other);
            stars[middle as usize].push(other);
            for apex in corners.into_iter().filter(|&v| v != a && v != b) {
                stars[apex as usize].push(other);
                longest.push(entry(&vertices, apex, middle));
            }
        }
    }
    Mesh { vertices, faces }
}

/// Collapses edges, those first that move the surface least (Garland & Heckbert 1997), until there are `n_faces`; one more if
/// `n_faces` is odd and the mesh closed. It stays as closed and as manifold as it was, with all its holes and handles; where
/// this forbids going on there are more faces than asked. Vertices at a rim stay. Indices must be in range.
pub fn decimate(mesh: &Mesh, n_faces: usize) -> Mesh {
    let mut collapse = Collapse::new(mesh, None);
    collapse.run(n_faces);
    collapse.finish()
}

/// Each face split in four at the middles of its edges; new vertices come after the old.
pub(super) fn quarter(mesh: &Mesh) -> Mesh {
    let mut vertices = mesh.vertices.clone();
    let mut middles = HashMap::new();
    let mut faces = Vec::with_capacity(4 * mesh.faces.len());
    for &[a, b, c] in &mesh.faces {
        let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let [p, q] = [a.min(b), a.max(b)].map(|v| DVec3::from(vertices[v as usize]));
                vertices.push(p.midpoint(q).to_array());
                vertices.len() as u32 - 1
            })
        });
        faces.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    Mesh { vertices, faces }
}

/// Faces at each vertex.
pub(super) fn stars(vertices: &[[f64; 3]], faces: &[[u32; 3]]) -> Vec<Vec<u32>> {
    let mut stars = vec![Vec::new(); vertices.len()];
    for (face, corners) in (0..).zip(faces) {
        for (i, &corner) in corners.iter().enumerate() {
            if !corners[..i].contains(&corner) {
                stars[corner as usize].push(face);
            }
        }
    }
    stars
}

/// Each edge once, the lower vertex first, in order.
pub(super) fn edges(faces: &[[u32; 3]]) -> Vec<(u32, u32)> {
    let all = faces.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).filter(|(a, b)| a != b);
    let mut edges: Vec<_> = all.map(|(a, b)| (a.min(b), a.max(b))).collect();
    edges.sort_unstable();
    edges.dedup();
    edges
}
