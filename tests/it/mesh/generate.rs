//! Meshes made by a rule, split and simplified.

use std::collections::HashMap;

use glam::DVec3;
use sunfleck::mesh::Mesh;
use sunfleck::mesh::generate::{EROS_FACES, asteroid, icosphere};
use sunfleck::mesh::resize::{decimate, resize, subdivide};

fn corners(mesh: &Mesh, face: [u32; 3]) -> [DVec3; 3] {
    face.map(|v| DVec3::from(mesh.vertices[v as usize]))
}

fn volume(mesh: &Mesh) -> f64 {
    mesh.faces.iter().map(|&face| corners(mesh, face)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// Each edge is used once in each direction, each vertex lies in one ring of faces, and all hangs together; returns the Euler
/// characteristic.
fn closed_manifold(mesh: &Mesh) -> i64 {
    let mut next: HashMap<(u32, u32), u32> = HashMap::new();
    for &[a, b, c] in &mesh.faces {
        assert!(a != b && b != c && c != a);
        for (from, to, apex) in [(a, b, c), (b, c, a), (c, a, b)] {
            assert!(next.insert((from, to), apex).is_none(), "edge {from} {to} twice");
        }
    }
    assert!(next.keys().all(|&(a, b)| next.contains_key(&(b, a))), "a rim");
    let mut degree = vec![0; mesh.vertices.len()];
    let mut first = vec![None; mesh.vertices.len()];
    for &(a, b) in next.keys() {
        degree[a as usize] += 1;
        first[a as usize] = Some(b);
    }
    for (v, (&degree, &first)) in degree.iter().zip(&first).enumerate() {
        let first = first.expect("a vertex without faces");
        let (mut at, mut n) = (first, 0);
        while n == 0 || at != first {
            at = next[&(v as u32, at)];
            n += 1;
        }
        assert_eq!(n, degree, "vertex {v} is in several rings");
    }
    let mut seen = vec![false; mesh.vertices.len()];
    let mut open = vec![mesh.faces[0][0]];
    let mut neighbours = vec![Vec::new(); mesh.vertices.len()];
    next.keys().for_each(|&(a, b)| neighbours[a as usize].push(b));
    while let Some(v) = open.pop() {
        if !std::mem::replace(&mut seen[v as usize], true) {
            open.extend(&neighbours[v as usize]);
        }
    }
    assert!(seen.iter().all(|&s| s), "in several parts");
    mesh.vertices.len() as i64 - next.len() as i64 / 2 + mesh.faces.len() as i64
}

/// A closed manifold whose faces all look away from the origin, and cover its sky once, does not meet itself.
fn is_seen_once_from_the_origin(mesh: &Mesh) {
    let mut sky = 0.0;
    for &face in &mesh.faces {
        let [a, b, c] = corners(mesh, face);
        let [x, y, z] = [a, b, c].map(DVec3::normalize);
        let product = x.dot(y.cross(z));
        assert!(product > 0.0, "face {face:?} looks inward");
        // Van Oosterom & Strackee 1983.
        sky += 2.0 * product.atan2(1.0 + x.dot(y) + y.dot(z) + z.dot(x));
    }
    assert!((sky / std::f64::consts::TAU - 2.0).abs() < 1e-6, "{sky} steradians");
}

/// FNV-1a of all bits.
fn hash(mesh: &Mesh) -> u64 {
    let places = mesh.vertices.iter().flatten().map(|x| x.to_bits());
    let all = places.chain(mesh.faces.iter().flatten().map(|&v| u64::from(v)));
    all.fold(0xcbf2_9ce4_8422_2325, |hash, x| (hash ^ x).wrapping_mul(0x0100_0000_01b3))
}

#[test]
fn spheres_are_closed_and_round() {
    for level in 0..5 {
        let mesh = icosphere(level);
        assert_eq!(mesh.faces.len(), 20 << (2 * level));
        assert_eq!(closed_manifold(&mesh), 2);
        is_seen_once_from_the_origin(&mesh);
        assert!(mesh.vertices.iter().all(|&p| (DVec3::from(p).length() - 1.0).abs() < 1e-15));
    }
    let ball = 4.0 / 3.0 * std::f64::consts::PI;
    assert!((volume(&icosphere(4)) / ball - 1.0).abs() < 3e-3);
}

#[test]
fn asteroids_of_every_size_are_closed_and_of_one_shape() {
    for seed in 0..2 {
        let base = asteroid(EROS_FACES, seed);
        assert_eq!((base.vertices.len(), base.faces.len()), (7374, 14_744));
        let v = volume(&base);
        assert!((1000.0..4000.0).contains(&v), "{v} km³");
        for (asked, got, tolerance) in [(60, 300, 0.1), (1001, 1002, 0.02)] {
            let mesh = asteroid(asked, seed);
            assert_eq!(mesh.faces.len(), got);
            assert_eq!(closed_manifold(&mesh), 2);
            is_seen_once_from_the_origin(&mesh);
            assert!((volume(&mesh) / v - 1.0).abs() < tolerance, "{asked}: {} of {v}", volume(&mesh));
        }
    }
    let largest = asteroid(140_296, 0);
    assert_eq!(largest.faces.len(), 140_296);
    assert_eq!(closed_manifold(&largest), 2);
    is_seen_once_from_the_origin(&largest);
    // Elongated, as Eros.
    let axes = [0, 1, 2].map(|axis| largest.vertices.iter().map(|p| p[axis].abs()).fold(0.0, f64::max));
    assert!((11.0..20.0).contains(&axes[0]) && axes[1..].iter().all(|&a| a < 14.0), "{axes:?}");
}

#[test]
fn a_seed_gives_the_same_asteroid_on_every_machine() {
    assert_eq!([2000, 16_000].map(|n| hash(&asteroid(n, 7))), [12_466_466_697_893_460_836, 10_489_636_338_697_485_324]);
    assert_ne!(hash(&asteroid(2000, 7)), hash(&asteroid(2000, 8)));
}

#[test]
fn splitting_leaves_the_surface_and_the_old_vertices() {
    let mesh = icosphere(1);
    for n in [80, 81, 100, 1234] {
        let finer = subdivide(&mesh, n);
        assert_eq!(finer.faces.len(), n.next_multiple_of(2));
        assert_eq!(finer.vertices[..mesh.vertices.len()], mesh.vertices);
        assert_eq!(closed_manifold(&finer), 2);
        assert!((volume(&finer) / volume(&mesh) - 1.0).abs() < 1e-13);
    }
    // Halving the longest never makes thin faces of good ones.
    let finer = subdivide(&mesh, 5000);
    for &face in &finer.faces {
        let [a, b, c] = corners(&finer, face);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        assert!((b - a).cross(c - a).length() > 0.2 * longest * longest);
    }
}

#[test]
fn simplifying_keeps_holes_handles_and_flat_places() {
    // A torus of 40 × 24 quads.
    let (n, m) = (40, 24);
    let mut torus = Mesh::default();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (std::f64::consts::TAU * f64::from(i) / 40.0, std::f64::consts::TAU * f64::from(j) / 24.0);
            let r = 3.0 + v.cos();
            // Far from the origin.
            torus.vertices.push([1e6 + r * u.cos(), r * u.sin(), v.sin()]);
            let at = |i: u32, j: u32| (i % 40) * 24 + j % 24;
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            torus.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    let small = decimate(&torus, 201);
    assert_eq!(small.faces.len(), 202);
    assert_eq!(closed_manifold(&small), 0);
    let about = |mesh: &Mesh| {
        let vertices = mesh.vertices.iter().map(|&[x, y, z]| [x - 1e6, y, z]).collect();
        volume(&Mesh { vertices, faces: mesh.faces.clone() })
    };
    assert!((about(&small) / about(&torus) - 1.0).abs() < 0.05, "{} of {}", about(&small), about(&torus));
    // It cannot become a sphere, nor vanish.
    let least = decimate(&torus, 0);
    assert_eq!(closed_manifold(&least), 0);
    assert!((14..60).contains(&least.faces.len()), "{}", least.faces.len());

    // A flat square with a rim: its area stays, and so does the rim.
    let mut square = Mesh::default();
    for i in 0..11 {
        for j in 0..11 {
            square.vertices.push([f64::from(i), f64::from(j), 5.0]);
            if i < 10 && j < 10 {
                let a = 11 * i + j;
                square.faces.extend([[a, a + 11, a + 12], [a, a + 12, a + 1]]);
            }
        }
    }
    let area = |mesh: &Mesh| {
        let of = |&face: &[u32; 3]| {
            let [a, b, c] = corners(mesh, face);
            (b - a).cross(c - a)
        };
        mesh.faces.iter().map(of).sum::<DVec3>() / 2.0
    };
    let flat = decimate(&square, 100);
    assert_eq!(flat.faces.len(), 100);
    assert!((area(&flat) - DVec3::Z * 100.0).length() < 1e-9);
    let rim = |mesh: &Mesh| {
        let at_rim = |p: &&[f64; 3]| p[..2].iter().any(|&x| x == 0.0 || x == 10.0);
        let mut all: Vec<[u64; 3]> = mesh.vertices.iter().filter(at_rim).map(|p| p.map(f64::to_bits)).collect();
        all.sort_unstable();
        all
    };
    assert_eq!(rim(&flat), rim(&square));
}

#[test]
fn nothing_to_split_or_to_simplify_is_fine() {
    let none = Mesh::default();
    assert_eq!(resize(&none, 10), none);
    let point = Mesh { vertices: vec![[1.0; 3]], faces: vec![[0, 0, 0]; 3] };
    assert_eq!(resize(&point, 10), point);
    assert_eq!(resize(&point, 1), point);
    let two = Mesh { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: vec![[0, 1, 2], [0, 2, 1]] };
    assert_eq!(decimate(&two, 0), two);
    assert!((10..=13).contains(&subdivide(&two, 10).faces.len()));
}
