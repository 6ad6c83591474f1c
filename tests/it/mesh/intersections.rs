//! Faces that intersect: every pair of small soups, against separating axes in integers.

use sunfleck::mesh::Mesh;

use super::check;
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

#[test]
fn the_same_pairs_as_by_testing_all() {
    let mut n_pairs = 0;
    for seed in 0..24 {
        let mut r = Random::new(seed);
        // Few corners: most triangles share some. Many: few do. Flat ones in between.
        let size = [3, 4, 9, 20][seed as usize % 4];
        let n = 20 + r.below(30);
        let mut corner = || -> Point { [r.below(size), r.below(size), r.below(1 + size / 2)].map(|x| x as i64) };
        let soup: Vec<[Point; 3]> = (0..n).map(|_| std::array::from_fn(|_| corner())).collect();
        let has_area = |t: &[Point; 3]| cross(minus(t[1], t[0]), minus(t[2], t[0])) != [0; 3];
        let mut expected = Vec::new();
        for i in 0..n {
            for j in i + 1..n {
                if has_area(&soup[i]) && has_area(&soup[j]) && intersect(soup[i], soup[j]) {
                    expected.push([i as u32, j as u32]);
                }
            }
        }
        n_pairs += expected.len();
        let mesh = |scale: f64, offset: f64| Mesh {
            vertices: soup.iter().flatten().map(|p| p.map(|x| x as f64 * scale + offset)).collect(),
            faces: (0..n as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        };
        let report = check(&mesh(1.0, 0.0));
        let flat: Vec<u32> = (0..n as u32).filter(|&i| !has_area(&soup[i as usize])).collect();
        assert_eq!((&report.intersections, report.degenerate), (&expected, flat), "{seed}");
        assert_eq!(check(&mesh(2.0f64.powi(-30), 1048576.0)).intersections, expected, "{seed}");
    }
    assert!(n_pairs > 3000, "{n_pairs}");
}
