//! Which way normals point: exactly the faces that were flipped, at any unit and offset.

use std::env;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::Mutex;

use sunfleck::index::kd::{Builder, EveryTriangle, Hit, KdOptions, KdTree, Ray, RaySearch, Triangles};
use sunfleck::mesh::orientation::{Facing, by_rays};
use sunfleck::mesh::{self, CheckOptions, Doubt, Mesh, Verdict};

use super::{bumpy, check, placed, random_set, reversed, tetrahedron, together};
use crate::kd::meshes::Random;

/// Scale and offset, that in sizes of the mesh.
const PLACES: [(f64, f64); 9] =
    [(1.0, 0.0), (1e-7, 0.0), (1e7, 0.0), (1e-3, 1.0), (1.0, 1e3), (1.0, 1e6), (1e-7, 1e6), (1e7, 1e6), (0.3, 1e5)];

/// Flips a set of faces; that set has to be found, and everything else as it was.
fn flip_and_check(mesh: &Mesh, set: &[u32]) {
    let mut flipped = mesh.clone();
    flipped.flip(set);
    let report = check(&flipped);
    let verdict = match set.len() {
        0 => Verdict::Outward,
        n if n == mesh.faces.len() => Verdict::Inward,
        _ => Verdict::Mixed,
    };
    assert_eq!((report.verdict, report.inward.as_slice()), (verdict, set));
    assert_eq!(report.clashing_edges.is_empty(), verdict != Verdict::Mixed);
    assert_eq!(report.is_clean(), set.is_empty());
}

fn offset_of(sizes: f64, scale: f64, seed: u32) -> [f64; 3] {
    Random::new(seed).vector().map(|x| x.signum() * (0.5 + 0.5 * x.abs()) * 2.0 * sizes * scale)
}

#[test]
fn exactly_the_flipped_faces_are_reported() {
    for (seed, (scale, sizes)) in (0..).zip(PLACES) {
        let mesh = placed(&bumpy(2, seed), scale, offset_of(sizes, scale, seed));
        let n = mesh.faces.len();
        for (i, share) in (0..).zip([0.0, 0.003, 0.2, 0.5, 0.97, 1.0]) {
            flip_and_check(&mesh, &random_set(n, share, 10 * seed + i));
        }
    }
}

#[test]
fn the_report_does_not_depend_on_the_unit_or_the_way_it_was_made() {
    let mut mesh = bumpy(3, 1);
    mesh.flip(&random_set(mesh.faces.len(), 0.3, 5));
    mesh.faces.push([0, 0, 1]);
    let report = check(&mesh);
    for exponent in -7..=7 {
        assert_eq!(check(&placed(&mesh, 10.0f64.powi(exponent), [0.0; 3])), report, "1e{exponent}");
    }
    for exponent in 0..=6 {
        let offset = offset_of(10.0f64.powi(exponent), 1.0, exponent as u32);
        assert_eq!(check(&placed(&mesh, 1.0, offset)), report, "{offset:?}");
    }
    for builder in [Builder::None, Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce] {
        for (lazy, parallel) in [(false, false), (true, false), (true, true)] {
            let options =
                CheckOptions { kd: KdOptions { builder, parallel, ..KdOptions::default() }, lazy, intersections: true };
            assert_eq!(mesh::check(&mesh, &options).unwrap(), report, "{options:?}");
        }
    }
}

#[test]
fn cavities_point_inward_to_be_outward() {
    let ball = bumpy(2, 3);
    let shell = |scale| placed(&ball, scale, [0.0; 3]);
    let n = ball.faces.len() as u32;
    // A ball in the cavity of a ball.
    let nested = together(&together(&shell(1.0), &reversed(shell(0.5))), &shell(0.2));
    let report = check(&nested);
    assert!(report.is_clean() && report.shells.len() == 3);
    let wrong = together(&together(&shell(1.0), &shell(0.5)), &reversed(shell(0.2)));
    let report = check(&wrong);
    assert_eq!((report.verdict, report.inward), (Verdict::Mixed, (n..3 * n).collect()));
    let facings: Vec<_> = report.shells.iter().map(|shell| (shell.first_face, shell.facing, shell.minority)).collect();
    let [out, inward] = [Facing::Outward, Facing::Inward].map(Some);
    assert_eq!(facings, [(0, out, 0), (n, inward, 0), (2 * n, inward, 0)]);
    // Beside each other.
    let beside = together(&shell(1.0), &placed(&reversed(shell(1.0)), 1.0, [5.0, 0.0, 0.0]));
    assert_eq!(check(&beside).inward, (n..2 * n).collect::<Vec<_>>());
}

/// Rays from the middle of a face along its normal that meet a corner, an edge, a face edge-on, and each other.
#[test]
fn grazing_rays_are_cast_again() {
    // The apex is right above the middle of the base.
    let vertices = vec![[0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 1.0, 2.0]];
    let spire = Mesh { vertices, ..tetrahedron() };
    // A grid of boxes: walls in planes, corners above middles.
    let cube = cube();
    for mesh in [spire, cube] {
        for set in 0..1u32 << mesh.faces.len().min(8) {
            let set: Vec<u32> = (0..8).filter(|face| set >> face & 1 == 1).collect();
            flip_and_check(&mesh, &set);
        }
    }
}

/// Each side a fan of four around its middle, and a step of half its width on top.
fn cube() -> Mesh {
    let mut mesh = Mesh::default();
    let mut quad = |corners: [[f64; 3]; 4]| {
        let first = mesh.vertices.len() as u32;
        mesh.vertices.extend(corners);
        mesh.vertices.push(std::array::from_fn(|axis| corners.iter().map(|p| p[axis]).sum::<f64>() / 4.0));
        mesh.faces.extend((0..4).map(|i| [first + i, first + (i + 1) % 4, first + 4]));
    };
    for axis in 0..3 {
        for side in [0.0, 3.0] {
            let corner = |u: f64, v: f64| {
                let mut p = [side; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (u, v);
                p
            };
            let around = [corner(0.0, 0.0), corner(3.0, 0.0), corner(3.0, 3.0), corner(0.0, 3.0)];
            quad(if side == 0.0 { [around[0], around[3], around[2], around[1]] } else { around });
        }
    }
    mesh
}

/// Most of a shell says how it lies, whichever way its first face looks.
#[test]
fn a_shell_lies_as_most_of_its_faces() {
    let mut mesh = bumpy(1, 6);
    let n = mesh.faces.len();
    for (flipped, facing) in [(vec![0], Facing::Outward), (vec![0, 1, 5], Facing::Outward), (vec![5], Facing::Outward)]
    {
        mesh.flip(&flipped);
        let report = check(&mesh);
        let [shell] = &report.shells[..] else { panic!("{report:?}") };
        assert_eq!((shell.facing, shell.minority, shell.faces), (Some(facing), flipped.len(), n));
        mesh.flip(&flipped);
    }
    let mut mesh = reversed(mesh);
    mesh.flip(&[0]);
    let report = check(&mesh);
    assert_eq!((report.shells[0].facing, report.shells[0].minority), (Some(Facing::Inward), 1));
}

/// A mesh in which rays find nothing, not even where they begin; it writes them down.
struct Blind {
    triangles: Triangles<f64>,
    rays: Mutex<Vec<Ray<f64>>>,
}

impl RaySearch<f64> for Blind {
    fn triangles(&self) -> &Triangles<f64> {
        &self.triangles
    }

    fn try_hits<B>(&self, ray: &Ray<f64>, _: impl FnMut(Hit<f64>) -> ControlFlow<B, f64>) -> ControlFlow<B> {
        self.rays.lock().unwrap().push(*ray);
        ControlFlow::Continue(())
    }
}

/// Those that are cast again leave on the side of the normal, too, each in a way of its own.
#[test]
fn every_ray_leaves_on_the_side_of_the_normal() {
    let mesh = bumpy(1, 8);
    for &[a, b, c] in &mesh.faces {
        let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize]);
        let blind =
            Blind { triangles: Triangles::new(vec![a, b, c], vec![[0, 1, 2]]).unwrap(), rays: Mutex::default() };
        assert_eq!(by_rays(&blind, false), [Facing::Undecided]);
        let rays = blind.rays.into_inner().unwrap();
        assert!(rays.len() > 16, "{} rays", rays.len());
        let outward = |d: [f64; 3]| -> f64 { (0..3).map(|i| d[i] * a[i]).sum() };
        let [ab, ac] = [b, c].map(|p| -> [f64; 3] { std::array::from_fn(|i| p[i] - a[i]) });
        let normal = std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            ab[j] * ac[k] - ab[k] * ac[j]
        });
        assert!(outward(normal) > 0.0);
        for (i, ray) in rays.iter().enumerate() {
            assert!((0..3).map(|i| ray.direction()[i] * normal[i]).sum::<f64>() > 0.0, "{ray:?}");
            assert!(rays[..i].iter().all(|other| other.direction() != ray.direction()));
        }
    }
}

#[test]
fn rays_alone_see_it_too() {
    let mut mesh = placed(&bumpy(3, 9), 1.0, [2e6, -1e6, 3e5]);
    let set = random_set(mesh.faces.len(), 0.4, 2);
    mesh.flip(&set);
    let expected: Vec<_> = (0..mesh.faces.len() as u32)
        .map(|face| if set.contains(&face) { Facing::Inward } else { Facing::Outward })
        .collect();
    let tree = KdTree::new(mesh.triangles().unwrap(), &KdOptions::default()).unwrap();
    assert_eq!(by_rays(&tree, true), expected);
    assert_eq!(by_rays(&tree, false), expected);
    assert_eq!(by_rays(&EveryTriangle(&mesh.triangles().unwrap()), true), expected);
}

#[test]
fn nothing_is_said_that_is_not_known() {
    let empty = check(&Mesh::default());
    assert_eq!(empty.verdict, Verdict::Unknown(Doubt::Empty));
    let mut open = bumpy(1, 1);
    open.faces.pop();
    let report = check(&open);
    assert_eq!((report.verdict, report.open_edges.len()), (Verdict::Unknown(Doubt::Open), 3));
    assert!(report.inward.is_empty() && report.clashing_edges.is_empty() && !report.is_closed());
    // Two balls that cross.
    let crossing = together(&bumpy(1, 1), &placed(&bumpy(1, 1), 1.0, [1.0, 0.1, 0.2]));
    assert_eq!(check(&crossing).verdict, Verdict::Unknown(Doubt::Intersecting));
    // One face on the back of the other: closed, and nothing inside.
    let mut flat = tetrahedron();
    flat.faces = vec![[0, 1, 2], [0, 2, 1]];
    let report = check(&flat);
    assert_eq!((report.verdict, report.duplicates), (Verdict::Unknown(Doubt::Undecided), vec![[1, 0]]));
    // Two of the same shell: rays cannot tell which is the outer one.
    let report = check(&together(&tetrahedron(), &tetrahedron()));
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Undecided));
}

/// Rays and edges contradict each other where what the check was told not to look for is there.
#[test]
fn contradictions_are_not_silent() {
    let crossing = together(&bumpy(2, 1), &placed(&bumpy(2, 1), 1.0, [1.0, 0.1, 0.2]));
    let options = CheckOptions { intersections: false, ..CheckOptions::default() };
    let report = mesh::check(&crossing, &options).unwrap();
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Disputed));
    assert!(!report.disputed.is_empty() && report.inward.is_empty());
}

/// Prints how many sets of flipped faces of a mesh were found, at each scale and offset. `SUNFLECK_MESH` names an OBJ file of
/// triangles; without it the mesh is made by code.
#[test]
#[ignore = "minutes; see docs/testing.md"]
fn a_hundred_sets_everywhere() {
    let (mesh, name) = match env::var_os("SUNFLECK_MESH").map(PathBuf::from) {
        Some(path) => (mesh::io::read(&path).unwrap().mesh, path.display().to_string()),
        None => (bumpy(4, 7), "bumpy sphere".into()),
    };
    let size = mesh.vertices.iter().flatten().fold(0.0, |m: f64, x| m.max(x.abs()));
    let n = mesh.faces.len();
    let (mut n_sets, mut n_faces) = (0, 0);
    for set in 0..100 {
        let flipped = random_set(n, [0.5, 0.01, 0.9, 0.0001][set as usize % 4], set);
        for exponent in -7..=7 {
            let scale = 10.0f64.powi(exponent);
            let sizes = if set % 2 == 0 { 0.0 } else { 10.0f64.powi(set as i32 % 7) };
            flip_and_check(&placed(&mesh, scale, offset_of(sizes * size, scale, set)), &flipped);
            (n_sets, n_faces) = (n_sets + 1, n_faces + flipped.len());
        }
    }
    println!(
        "{name}: {n} faces, 100 sets at 15 scales, offsets up to 1e6 sizes: {n_sets} of {n_sets} exact, {n_faces} faces"
    );
}
