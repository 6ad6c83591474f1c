//! Faces that intersect: every pair of small soups, against separating axes in integers.

use sunfleck::mesh::{Doubt, Mesh, Verdict};

use super::{check, reversed, tetrahedron, together};
use crate::kd::meshes::Random;

type Point = [i64; 3];

fn minus(a: Point, b: Point) -> Point {
    std::array::from_fn(|i| a[i] - b[i])
}

fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: Point, b: Point) -> i64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// Whether two convex hulls have no point in common: one of the axes below parts them, or none does.
fn are_disjoint(a: &[Point], b: &[Point]) -> bool {
    let edges = |p: &[Point]| -> Vec<Point> {
        (0..p.len()).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| minus(p[i], p[j])).collect()
    };
    let edges = [edges(a), edges(b)].concat();
    let crosses: Vec<Point> = edges.iter().flat_map(|&d| edges.iter().map(move |&e| cross(d, e))).collect();
    let in_planes = crosses.iter().flat_map(|&n| edges.iter().map(move |&e| cross(n, e)));
    crosses.iter().copied().chain(edges.iter().copied()).chain(in_planes).any(|axis| {
        let range = |p: &[Point]| {
            let along = p.iter().map(|&q| dot(axis, q));
            along.fold((i64::MAX, i64::MIN), |(min, max), x| (min.min(x), max.max(x)))
        };
        let ((a_min, a_max), (b_min, b_max)) = (range(a), range(b));
        a_max < b_min || b_max < a_min
    })
}

/// Whether triangles have more in common than their common corners: the first is cut off a little before those.
fn intersect(a: [Point; 3], b: [Point; 3]) -> bool {
    const FINE: i64 = 1000;
    let b = b.map(|p| p.map(|x| FINE * x));
    let corners = a.map(|p| p.map(|x| FINE * x));
    let (shared, alone): (Vec<Point>, Vec<Point>) = corners.iter().partition(|p| b.contains(p));
    if shared.len() == 3 {
        return false;
    }
    let mut hull = alone.clone();
    for &p in &shared {
        hull.extend(alone.iter().map(|&q| -> Point { std::array::from_fn(|i| p[i] + (q[i] - p[i]) / FINE) }));
    }
    !are_disjoint(&hull, &b)
}

/// Whether triangles in two planes have points of their insides in common: no axis keeps those apart.
fn insides_meet(a: [Point; 3], b: [Point; 3]) -> bool {
    let edges = |p: [Point; 3]| [0, 1, 2].map(|i| minus(p[(i + 1) % 3], p[i]));
    let normal = |p: [Point; 3]| cross(minus(p[1], p[0]), minus(p[2], p[0]));
    let are_parallel = cross(normal(a), normal(b)) == [0; 3];
    let crosses = edges(a).into_iter().flat_map(|d| edges(b).map(|e| cross(d, e)));
    let mut axes = crosses.chain([normal(a), normal(b)]).filter(|axis| *axis != [0; 3]);
    !are_parallel
        && axes.all(|axis| {
            let range = |p: [Point; 3]| {
                let along = p.map(|q| dot(axis, q));
                (along[0].min(along[1]).min(along[2]), along[0].max(along[1]).max(along[2]))
            };
            let ((a_min, a_max), (b_min, b_max)) = (range(a), range(b));
            a_max > b_min && b_max > a_min
        })
}

#[test]
fn the_same_pairs_as_by_testing_all() {
    let (mut n_crossing, mut n_touching) = (0, 0);
    for seed in 0..24 {
        let mut r = Random::new(seed);
        // Few corners: most triangles share some. Many: few do. Flat ones in between.
        let size = [3, 4, 9, 20][seed as usize % 4];
        let n = 20 + r.below(30);
        let mut corner = || -> Point { [r.below(size), r.below(size), r.below(1 + size / 2)].map(|x| x as i64) };
        let soup: Vec<[Point; 3]> = (0..n).map(|_| std::array::from_fn(|_| corner())).collect();
        let has_area = |t: &[Point; 3]| cross(minus(t[1], t[0]), minus(t[2], t[0])) != [0; 3];
        let (mut crossing, mut touching) = (Vec::new(), Vec::new());
        for i in 0..n {
            for j in i + 1..n {
                if has_area(&soup[i]) && has_area(&soup[j]) && intersect(soup[i], soup[j]) {
                    let list = if insides_meet(soup[i], soup[j]) { &mut crossing } else { &mut touching };
                    list.push([i as u32, j as u32]);
                }
            }
        }
        n_crossing += crossing.len();
        n_touching += touching.len();
        let mesh = |scale: f64, offset: f64| Mesh {
            vertices: soup.iter().flatten().map(|p| p.map(|x| x as f64 * scale + offset)).collect(),
            faces: (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        };
        let report = check(&mesh(1.0, 0.0));
        let flat: Vec<u32> = (0..n as u32).filter(|&i| !has_area(&soup[i as usize])).collect();
        assert_eq!((&report.intersections, &report.touching), (&crossing, &touching), "{seed}");
        assert_eq!(report.degenerate, flat, "{seed}");
        let report = check(&mesh(2.0f64.powi(-30), 1048576.0));
        assert_eq!((report.intersections, report.touching), (crossing, touching), "{seed}");
    }
    assert!(n_crossing > 1000 && n_touching > 1000, "{n_crossing} cross, {n_touching} touch");
}

/// Outward, between two corners.
fn cuboid(min: [f64; 3], max: [f64; 3]) -> Mesh {
    let vertices = (0..8).map(|i| std::array::from_fn(|axis| if i >> axis & 1 == 0 { min[axis] } else { max[axis] }));
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { vertices: vertices.collect(), faces }
}

/// One box on another: their faces lie on each other, and which way they look can be said all the same.
#[test]
fn solids_that_stand_on_each_other() {
    let below = cuboid([0.0; 3], [2.0, 2.0, 1.0]);
    assert!(check(&below).is_clean());
    // In the middle of a face, and over its edges.
    for above in [cuboid([0.5, 0.5, 1.0], [1.5, 1.5, 2.0]), cuboid([-0.5, 0.5, 1.0], [1.5, 3.5, 2.0])] {
        let report = check(&together(&below, &above));
        assert_eq!((report.verdict, &report.intersections[..]), (Verdict::Outward, &[][..]));
        assert!(!report.is_clean() && report.is_closed() && report.is_manifold() && !report.touching.is_empty());
        let report = check(&together(&below, &reversed(above)));
        assert_eq!((report.verdict, report.inward), (Verdict::Mixed, (12..24).collect()));
    }
    // Face to face: a wall of two faces, which have the solid on both sides.
    let report = check(&together(&below, &cuboid([0.0, 0.0, 1.0], [2.0, 2.0, 2.0])));
    assert_eq!((report.duplicates.len(), report.verdict), (2, Verdict::Unknown(Doubt::Undecided)));
}

/// Surfaces that pass through each other along edges of theirs: no two faces do. The rays notice.
#[test]
fn what_crosses_along_edges_gets_no_verdict() {
    // An octahedron half way in: the corners around its middle lie in a face of the box.
    let slab = cuboid([-9.0, -9.0, -9.0], [9.0, 9.0, 0.0]);
    let mut vertices = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let mut p = [0.0; 3];
            p[axis] = side;
            // Away from the diagonal of the box's face.
            vertices.push([p[0] + 3.0, p[1] - 3.0, p[2]]);
        }
    }
    let triples = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    let octahedron = Mesh { vertices, faces: triples.to_vec() };
    assert!(check(&octahedron).is_clean());
    let report = check(&together(&slab, &octahedron));
    assert!(report.intersections.is_empty() && report.touching.len() >= 8, "{report:?}");
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Disputed));
    // Two boxes of the same height and depth, one in the other's end.
    let report = check(&together(&slab, &cuboid([0.0, -9.0, -9.0], [20.0, 9.0, 0.0])));
    assert!(report.intersections.is_empty() && !report.touching.is_empty(), "{report:?}");
    assert_eq!(report.verdict, Verdict::Unknown(Doubt::Disputed));
}

/// A fan of many faces, whose boxes all overlap, and a face given many times: no time is spent on what they share.
#[test]
fn fans_and_copies_are_no_intersections() {
    let n = 400;
    let around = |z: f64| (0..n).map(move |i| (f64::from(i) * std::f64::consts::TAU / f64::from(n), z));
    let rim =
        around(0.0).chain(around(1.0)).map(|(angle, z)| [angle.cos(), angle.sin() + 0.3 * z, z + 0.2 * angle.cos()]);
    let mut drum = Mesh { vertices: rim.chain([[0.0; 3], [0.0, 0.3, 1.0]]).collect(), faces: Vec::new() };
    for i in 0..n as u32 {
        let (j, n) = ((i + 1) % n as u32, n as u32);
        drum.faces.extend([[i, j, n + j], [i, n + j, n + i], [2 * n, j, i], [2 * n + 1, n + i, n + j]]);
    }
    assert!(check(&drum).is_clean());
    // Copies meet what the first meets.
    let mut pierced = tetrahedron();
    pierced.vertices.extend([[0.2, 0.2, -1.0], [0.3, 0.2, 1.0], [3.0, 3.0, 0.0]]);
    pierced.faces.extend([[4, 5, 6], [5, 6, 4], [0, 1, 2]]);
    let report = check(&pierced);
    assert_eq!(report.duplicates, [[5, 4], [6, 0]]);
    assert_eq!(report.intersections, [[0, 4], [0, 5], [2, 4], [2, 5], [4, 6], [5, 6]]);
    // Rays go through two copies as if there were none.
    let mut roofed = tetrahedron();
    roofed.vertices.extend([[-9.0, -9.0, 2.0], [9.0, -9.0, 2.0], [0.0, 20.0, 2.0]]);
    roofed.faces.extend([[4, 5, 6], [4, 6, 5]]);
    assert_eq!(check(&roofed).verdict, Verdict::Unknown(Doubt::Undecided));
    let mut copies = tetrahedron();
    copies.faces = vec![[0, 1, 2]; 100_000];
    let report = check(&copies);
    assert_eq!((report.duplicates.len(), report.intersections.len(), report.touching.len()), (99_999, 0, 0));
}
