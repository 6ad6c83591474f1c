//! What can be wrong with a mesh, each fault alone.

use sunfleck::index::kd;
use sunfleck::mesh::{self, CheckOptions, Doubt, Error, Mesh, Verdict};

use super::{bumpy, check, placed, tetrahedron, together};

#[test]
fn a_strip_with_one_side() {
    // Möbius: ten quads around, the last joined to the first upside down.
    let n = 10;
    let mut strip = Mesh::default();
    for i in 0..n {
        let (angle, half) = (0.2 * std::f64::consts::PI * f64::from(i), 0.1 * std::f64::consts::PI * f64::from(i));
        for side in [-0.3, 0.3] {
            let radius = 1.0 + side * half.cos();
            strip.vertices.push([radius * angle.cos(), radius * angle.sin(), side * half.sin()]);
        }
    }
    for i in 0..n {
        let (a, b) = (2 * i, 2 * i + 1);
        let (c, d) = if i + 1 < n { (a + 2, b + 2) } else { (1, 0) };
        strip.faces.extend([[a, c, b], [b, c, d]].map(|f| f.map(|v| v as u32)));
    }
    let report = check(&strip);
    assert_eq!((report.one_sided, report.verdict), (vec![0], Verdict::Unknown(Doubt::Open)));
    assert_eq!((report.clashing_edges, report.open_edges.len()), (vec![[0, 1]], 20));
    assert!(report.intersections.is_empty());
}

/// The projective plane on six vertices: closed, and in space it must intersect itself.
#[test]
fn a_closed_surface_with_one_side() {
    let vertices = (0..6).map(f64::from).map(|t| [t, t * t, t * t * t]).collect();
    let triples = "012 023 034 045 051 124 235 341 452 513";
    let corner = |c: u8| u32::from(c - b'0');
    let faces = triples.split(' ').map(|t| std::array::from_fn(|i| corner(t.as_bytes()[i]))).collect();
    let plane = Mesh { vertices, faces };
    let report = check(&plane);
    assert_eq!((report.open_edges.len(), report.one_sided), (0, vec![0]));
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Intersecting));
    let options = CheckOptions { intersections: false, ..CheckOptions::default() };
    assert_eq!(mesh::check(&plane, &options).unwrap().verdict, Verdict::Unknown(Doubt::OneSided));
}

#[test]
fn edges_of_more_than_two_faces() {
    // A second tetrahedron on the other side of an edge: the solid is well defined, the surface no manifold.
    let mut two = tetrahedron();
    two.vertices.extend([[-1.0, -0.1, 0.2], [-0.1, -1.0, 0.2]]);
    two.faces.extend([[0, 5, 4], [0, 3, 5], [5, 3, 4], [3, 0, 4]]);
    let report = check(&two);
    assert_eq!((report.crowded_edges.as_slice(), report.verdict), (&[[0, 3]][..], Verdict::Outward), "{report:?}");
    assert!(report.is_closed() && !report.is_manifold() && !report.is_clean() && report.clashing_edges.is_empty());
    assert_eq!((report.shells.len(), report.pinched_vertices.len()), (2, 0));
    // Whatever order the faces at the edge come in.
    let mut mixed = two.clone();
    mixed.faces = [0, 4, 1, 5, 2, 6, 3, 7].map(|face| two.faces[face]).to_vec();
    let report = check(&mixed);
    assert_eq!((report.shells.len(), report.verdict), (2, Verdict::Outward));
    // One of the four the wrong way round.
    two.flip(&[1]);
    let report = check(&two);
    assert_eq!((report.clashing_edges, report.inward), (vec![[0, 1], [0, 3], [1, 3]], vec![1]));
    // A wall inside.
    let mut wall = bumpy(0, 1);
    wall.vertices.push([0.0; 3]);
    let [a, b, c] = wall.faces[0];
    wall.faces.extend([[a, b, 12], [b, c, 12], [c, a, 12]]);
    let report = check(&wall);
    assert_eq!((report.crowded_edges.len(), report.open_edges.len()), (3, 3));
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Open));
}

#[test]
fn vertices_of_more_than_one_fan() {
    let mut tips = together(&tetrahedron(), &placed(&tetrahedron(), -1.0, [0.0; 3]));
    tips.flip(&[4, 5, 6, 7]);
    let report = check(&tips);
    // The tips are two vertices in one place.
    assert_eq!((report.pinched_vertices.as_slice(), report.merged_vertices), (&[0][..], 1));
    assert_eq!((report.verdict, report.shells.len()), (Verdict::Outward, 2));
    assert!(report.is_closed() && !report.is_manifold() && report.intersections.is_empty());
    assert!(check(&bumpy(1, 1)).pinched_vertices.is_empty());
}

#[test]
fn vertices_in_the_same_place_are_one() {
    let whole = bumpy(2, 4);
    for whole in [whole, tetrahedron()] {
        let corners = whole.faces.iter().flatten().map(|&v| whole.vertices[v as usize]);
        let n = whole.faces.len();
        let soup = Mesh {
            // −0 is 0.
            vertices: (0..)
                .zip(corners)
                .map(|(i, p)| p.map(|x| if x == 0.0 && i % 2 == 1 { -0.0 } else { x }))
                .collect(),
            faces: (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        };
        let report = check(&soup);
        assert!(report.is_clean(), "{report:?}");
        assert_eq!((report.merged_vertices, report.unused_vertices), (3 * n - whole.vertices.len(), 0));
    }
}

#[test]
fn faces_without_area() {
    // One with a corner twice changes nothing else. One across an edge is a part of the surface.
    let mut mesh = tetrahedron();
    mesh.faces.push([1, 1, 2]);
    let report = check(&mesh);
    assert_eq!((report.degenerate.as_slice(), report.verdict), (&[4][..], Verdict::Outward));
    assert!(report.is_closed() && !report.is_clean());
    // The middle of edge 0-1 is a vertex of one of its faces only; a flat face fills the gap.
    let mut mesh = tetrahedron();
    mesh.vertices.push([0.5, 0.0, 0.0]);
    mesh.faces[1] = [0, 4, 3];
    mesh.faces.extend([[4, 1, 3], [0, 1, 4]]);
    let report = check(&mesh);
    assert_eq!((report.degenerate.as_slice(), report.open_edges.len()), (&[5][..], 0));
    // They share less than they touch in, and there is an inside all the same.
    assert_eq!((report.touching.as_slice(), report.verdict), (&[[0, 1], [0, 4]][..], Verdict::Outward));
    assert!(report.intersections.is_empty() && !report.is_clean());
    let without =
        |mesh: &Mesh| mesh::check(mesh, &CheckOptions { intersections: false, ..CheckOptions::default() }).unwrap();
    assert_eq!((without(&mesh).verdict, without(&mesh).touching), (Verdict::Outward, vec![]));
    // Its neighbours say which way it runs.
    mesh.flip(&[5]);
    assert_eq!(check(&mesh).inward, [5]);
    mesh.faces.pop();
    assert_eq!(check(&mesh).verdict, Verdict::Unknown(Doubt::Open));
}

#[test]
fn faces_given_twice() {
    let mut mesh = bumpy(1, 2);
    let [a, b, c] = mesh.faces[7];
    mesh.faces.extend([[b, c, a], [c, b, a]]);
    let report = check(&mesh);
    assert_eq!(report.duplicates, [[80, 7], [81, 7]]);
    assert_eq!((report.open_edges.len(), report.crowded_edges.len()), (0, 3));
    assert_eq!((report.intersections.len(), report.verdict), (0, Verdict::Unknown(Doubt::Undecided)));
}

#[test]
fn vertices_of_no_face_do_not_matter() {
    let mut mesh = placed(&bumpy(1, 3), 1e-80, [0.0; 3]);
    mesh.vertices.push([1e89; 3]);
    let report = check(&mesh);
    assert_eq!((report.unused_vertices, report.verdict), (1, Verdict::Outward));
}

#[test]
fn what_is_no_mesh_is_refused() {
    let broken = |mesh: Mesh| mesh::check(&mesh, &CheckOptions::default()).unwrap_err();
    let mut mesh = tetrahedron();
    mesh.faces[2][1] = 4;
    assert_eq!(broken(mesh), Error::Mesh(kd::Error::Index { face: 2, corner: 4, vertices: 4 }));
    let mut mesh = tetrahedron();
    mesh.vertices[3][0] = f64::NAN;
    assert_eq!(broken(mesh), Error::Mesh(kd::Error::Vertex(3)));
    let points = Mesh { vertices: vec![[1e-320; 3]; 3], faces: vec![[0, 1, 2]; 2] };
    assert_eq!(check(&points).degenerate, [0, 1]);
}
