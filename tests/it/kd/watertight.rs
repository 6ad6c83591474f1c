//! No ray slips through an edge or a corner.

use rayon::prelude::*;
use sunfleck::index::kd::{KdOptions, KdTree, Ray, RaySearch, Scalar};

use super::meshes::{Random, Soup, icosphere, mesh, point};

/// Where Embree tests itself.
const OFFSET: [f64; 3] = [148376.0, 1234.0, -223423.0];

/// A sphere of radius 2 there: in single precision its corners are on a grid of 1/64, and many triangles have no area.
fn sphere(level: u32) -> Soup {
    let (vertices, faces) = icosphere(level);
    (vertices.iter().map(|p| std::array::from_fn(|i| 2.0 * p[i] + OFFSET[i])).collect(), faces)
}

/// Rays from within that find nothing: through corners, through edges, and anywhere, a third of each.
fn misses<T: Scalar>(tree: &KdTree<T>, n: usize, r: &mut Random) -> usize {
    let triangles = tree.triangles();
    (0..n)
        .filter(|i| {
            let origin: [T; 3] = std::array::from_fn(|i| T::of(OFFSET[i] + r.signed()));
            let corners = triangles.corners(r.below(triangles.len()) as u32);
            let part = r.unit();
            let target = match i % 3 {
                0 => corners[0],
                1 => point(corners, [part, 1.0 - part, 0.0]).map(T::of),
                _ => std::array::from_fn(|i| origin[i] + T::of(r.signed())),
            };
            let direction = std::array::from_fn(|i| target[i] - origin[i]);
            !tree.any(&Ray::new(origin, direction).unwrap())
        })
        .count()
}

#[test]
fn no_ray_leaves_a_sphere() {
    let (level, n) = (5, 60_000);
    let double = KdTree::new(mesh::<f64>(&sphere(level)), &KdOptions::default()).unwrap();
    let single = KdTree::new(mesh::<f32>(&sphere(level)), &KdOptions::default()).unwrap();
    assert_eq!(misses(&double, n, &mut Random::new(1)), 0, "double precision");
    assert_eq!(misses(&single, n, &mut Random::new(2)), 0, "single precision");
}

/// Rays of a long test: `SUNFLECK_RAYS`, or `otherwise`.
fn n_rays(otherwise: usize) -> usize {
    std::env::var("SUNFLECK_RAYS").map_or(otherwise, |n| n.parse().expect("SUNFLECK_RAYS is a number"))
}

/// The same with 10⁸ rays in each precision.
#[test]
#[ignore = "minutes"]
fn no_ray_of_many_leaves_a_sphere() {
    let (level, n, part) = (7, n_rays(100_000_000), 10_000);
    let double = KdTree::new(mesh::<f64>(&sphere(level)), &KdOptions::default()).unwrap();
    let single = KdTree::new(mesh::<f32>(&sphere(level)), &KdOptions::default()).unwrap();
    let parts = n.div_ceil(part) as u32;
    let missed = |misses: &(dyn Fn(&mut Random) -> usize + Sync), odd: u32| -> usize {
        (0..parts).into_par_iter().map(|part| misses(&mut Random::new(2 * part + odd))).sum()
    };
    let in_double = missed(&|r| misses(&double, part, r), 0);
    println!("{} rays in double precision: {in_double} missed", parts as usize * part);
    let in_single = missed(&|r| misses(&single, part, r), 1);
    println!("{} rays in single precision: {in_single} missed", parts as usize * part);
    assert_eq!((in_double, in_single), (0, 0));
}

/// The test of the thesis: a ray from anywhere through a point of a face hits that face. Number of misses.
fn missed_faces(level: u32, n: usize, seed: u32) -> usize {
    let tree = KdTree::new(mesh::<f64>(&icosphere(level)), &KdOptions::default()).unwrap();
    let (mut r, mut hits) = (Random::new(seed), Vec::new());
    (0..n)
        .filter(|_| {
            let face = r.below(tree.triangles().len()) as u32;
            let target = point(tree.triangles().corners(face), r.weights());
            let origin = r.vector().map(|x| 3.0 * x);
            let direction = std::array::from_fn(|i| target[i] - origin[i]);
            tree.all(&Ray::new(origin, direction).unwrap(), &mut hits);
            !hits.iter().any(|hit| hit.face == face && (hit.t - 1.0).abs() < 1e-9)
        })
        .count()
}

#[test]
fn a_ray_through_a_point_of_a_face_hits_the_face() {
    assert_eq!(missed_faces(5, 30_000, 1), 0);
}

/// The same with 10⁷ rays.
#[test]
#[ignore = "minutes"]
fn ten_million_rays_through_points_of_faces_hit_them() {
    let n = n_rays(10_000_000);
    let missed = missed_faces(7, n, 2);
    println!("{n} rays through points of faces: {missed} missed");
    assert_eq!(missed, 0);
}
