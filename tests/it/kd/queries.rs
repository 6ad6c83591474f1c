//! Every form of a mesh finds what a test of every triangle finds, bit for bit.

use sunfleck::index::kd::{Builder, EveryTriangle, KdOptions, KdTree, LazyKd, Ray, RaySearch, Scalar, Triangles};

use super::meshes::{N_KINDS, Random, icosphere, mesh, point, random};

/// A ray that is likely to be a hard one.
fn ray<T: Scalar>(triangles: &Triangles<T>, r: &mut Random) -> Ray<T> {
    let corners = triangles.corners(r.below(triangles.len()) as u32);
    let [a, b, c] = corners.map(|p| p.map(Into::<f64>::into));
    let minus = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|i| a[i] - b[i]) };
    let on = |r: &mut Random| match r.below(4) {
        0 => a,
        1 => point(corners, [0.5, 0.5, 0.0]),
        _ => point(corners, r.weights()),
    };
    let target = on(r);
    let axis = r.below(3);
    let (origin, direction): ([f64; 3], [f64; 3]) = match r.below(8) {
        // From anywhere, anywhere.
        0 => (point([r.vector(), a, b], [1.0; 3]), r.vector()),
        // Along an axis, through a corner, an edge or a face.
        1 => {
            let mut origin = target;
            origin[axis] -= 4.0;
            (origin, std::array::from_fn(|i| f64::from(u8::from(i == axis))))
        }
        // In a plane of constant coordinate, which may be one of the tree's.
        2 => {
            let mut direction = r.vector();
            direction[axis] = 0.0;
            (target, direction)
        }
        // Along an edge, and in the triangle's plane.
        3 => (point([a, b, c], [2.0, -1.0, 0.0]), minus(b, a)),
        4 => (point([a, b, c], [-1.0, 1.5, 0.5]), minus(target, point([a, b, c], [-1.0, 1.5, 0.5]))),
        // From far away.
        5 => {
            let far: [f64; 3] = std::array::from_fn(|i| target[i] + 1e4 * r.vector()[i]);
            (far, minus(target, far))
        }
        // From the surface, nearly in it.
        6 => {
            let push = r.vector();
            (target, std::array::from_fn(|i| minus(b, c)[i] + 1e-9 * push[i]))
        }
        _ => {
            let origin = r.vector();
            (origin, minus(target, origin))
        }
    };
    let made = Ray::new(origin.map(T::of), direction.map(T::of));
    let ray = made.unwrap_or_else(|_| Ray::new(origin.map(T::of), [T::ONE, T::ZERO, T::ZERO]).unwrap());
    match r.below(4) {
        0 => ray.within(T::of(-0.5), T::of(1.0)),
        1 => ray.within(T::of(-3.0 * r.unit()), T::of(3.0 * r.unit())),
        2 => ray.within(-T::INFINITY, T::INFINITY),
        _ => ray,
    }
}

fn check<T: Scalar>(triangles: &Triangles<T>, n_rays: usize, r: &mut Random, what: &str) -> usize {
    let options = |builder| KdOptions { builder, ..KdOptions::default() };
    let tree = KdTree::new(triangles.clone(), &options(Builder::SortOnce)).unwrap();
    let none = KdTree::new(triangles.clone(), &options(Builder::None)).unwrap();
    let lazy = LazyKd::new(triangles.clone(), &options(Builder::SortEachNode)).unwrap();
    let oracle = EveryTriangle(triangles);
    let (mut expected, mut hits, mut n_hits) = (Vec::new(), Vec::new(), 0);
    for _ in 0..n_rays {
        let ray = ray(triangles, r);
        oracle.all(&ray, &mut expected);
        n_hits += expected.len();
        macro_rules! same {
            ($search:expr, $name:literal) => {
                $search.all(&ray, &mut hits);
                assert_eq!(hits, expected, "{what}, {}: {ray:?}", $name);
                assert_eq!($search.nearest(&ray), expected.first().copied(), "{what}, {}: {ray:?}", $name);
                assert_eq!($search.any(&ray), !expected.is_empty(), "{what}, {}: {ray:?}", $name);
                assert_eq!($search.count(&ray), expected.len(), "{what}, {}: {ray:?}", $name);
            };
        }
        same!(tree, "tree");
        same!(none, "one leaf");
        same!(lazy, "lazy tree");
        same!(oracle, "every triangle");
        for hit in &expected {
            let (min, max) = ray.range();
            assert!(hit.t >= min && hit.t <= max && hit.u >= T::ZERO && hit.v >= T::ZERO);
            // On the ray and on the triangle at once, however flat it is seen.
            let (t, u, v): (f64, f64, f64) = (hit.t.into(), hit.u.into(), hit.v.into());
            let corners = triangles.corners(hit.face);
            let there = point(corners, [1.0 - u - v, u, v]);
            let (origin, direction) = (ray.origin().map(Into::<f64>::into), ray.direction().map(Into::<f64>::into));
            let longest = |p: [f64; 3]| p.iter().fold(0.0f64, |m, x| m.max(x.abs()));
            let sizes = corners.map(|p| longest(p.map(Into::into)));
            let size = longest(sizes) + longest(origin) + longest(direction) * t.abs();
            for i in 0..3 {
                let off = origin[i] + t * direction[i] - there[i];
                assert!(off.abs() <= 16.0 * T::EPSILON * size, "{what}: {off:e} of {size}, {hit:?}, {ray:?}");
            }
        }
    }
    n_hits
}

#[test]
fn trees_find_what_a_test_of_every_triangle_finds() {
    let mut n_hits = 0;
    for seed in 0..16 {
        for kind in 0..N_KINDS {
            let (soup, name) = random(kind, 500 + seed, 150);
            let mut r = Random::new(seed + 77 * kind);
            let what = format!("{name}, seed {seed}");
            n_hits += check(&mesh::<f64>(&soup), 60, &mut r, &what);
            n_hits += check(&mesh::<f32>(&soup), 60, &mut r, &what);
        }
    }
    assert!(n_hits > 20_000, "only {n_hits} hits were compared");
}

#[test]
fn far_from_the_origin_and_at_any_scale() {
    let sphere = icosphere(2);
    for scale in [1e-7, 1.0, 1e7] {
        for offset in [0.0, 1e6] {
            let at = |p: &[f64; 3]| p.map(|x| scale * (x + offset));
            let soup = (sphere.0.iter().map(at).collect(), sphere.1.clone());
            let what = format!("{scale} · (x + {offset})");
            let n = check(&mesh::<f64>(&soup), 100, &mut Random::new(4), &what);
            assert!(n > 50, "{what}: {n} hits");
        }
    }
}

/// Where the hit says it is, on the ray and on the triangle; and which side it came from.
#[test]
fn a_hit_is_where_it_says() {
    let tree = KdTree::new(mesh::<f64>(&icosphere(3)), &KdOptions::default()).unwrap();
    let mut r = Random::new(2);
    let mut hits = Vec::new();
    for _ in 0..2000 {
        let origin: [f64; 3] = r.vector().map(|x| 0.5 * x);
        let direction = r.vector();
        let outside = std::array::from_fn(|i| origin[i] - 10.0 * direction[i]);
        let hit = tree.nearest(&Ray::new(origin, direction).unwrap()).unwrap();
        assert!(!hit.front, "from within the back is seen");
        let on_face = point(tree.triangles().corners(hit.face), [1.0 - hit.u - hit.v, hit.u, hit.v]);
        for i in 0..3 {
            assert!((origin[i] + hit.t * direction[i] - on_face[i]).abs() < 1e-13);
        }
        if outside.iter().map(|x: &f64| x * x).sum::<f64>() > 1.1 {
            tree.all(&Ray::new(outside, direction).unwrap(), &mut hits);
            assert!(hits.len() >= 2 && hits[0].front && !hits[hits.len() - 1].front);
            assert!((hits[hits.len() - 1].t - 10.0 - hit.t).abs() < 1e-12);
        }
    }
}

/// An edge past which a ray goes nearer than products of its corners are rounded: one of the two triangles at it is hit.
#[test]
fn one_of_two_triangles_is_hit_beside_their_edge() {
    fn check<T: Scalar>(e: f64) {
        // (1 + e)² and 1 + 2e differ by e².
        let edge = [[1.0 + 2.0 * e, 1.0 + e, 1.0], [-1.0 - e, -1.0, 1.0]];
        for sign in [1.0, -1.0] {
            let vertices =
                [edge[0], edge[1], [-1.0, 1.0, 1.0], [1.0, -1.0, 1.0]].map(|[x, y, z]| [x, sign * y, z].map(T::of));
            let triangles = Triangles::new(vertices.to_vec(), vec![[2, 0, 1], [3, 1, 0]]).unwrap();
            let ray = Ray::new([T::ZERO; 3], [T::ZERO, T::ZERO, T::ONE]).unwrap();
            assert_eq!(EveryTriangle(&triangles).nearest(&ray).unwrap().face, 1);
            assert_eq!(EveryTriangle(&triangles).count(&ray), 1);
        }
    }
    check::<f32>(2.0f64.powi(-13));
    check::<f64>(2.0f64.powi(-27));
}

#[test]
fn of_hits_at_one_place_the_lowest_face_is_nearest() {
    let p = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0f32]];
    let triangles = Triangles::new(p, vec![[1, 3, 2], [0, 1, 2], [0, 1, 2]]).unwrap();
    let tree = KdTree::new(triangles, &KdOptions::default()).unwrap();
    let through = |x, y| Ray::new([x, y, 0.0], [0.0, 0.0, 1.0f32]).unwrap();
    // On the edge that all three share, in the two that coincide, in the other, on an outer corner.
    for ((x, y), nearest, n) in [((0.5, 0.5), 0, 3), ((0.25, 0.25), 1, 2), ((0.75, 0.75), 0, 1), ((0.0, 0.0), 1, 2)] {
        let hit = tree.nearest(&through(x, y)).unwrap();
        assert_eq!((hit.face, hit.t, tree.count(&through(x, y))), (nearest, 1.0, n));
    }
    assert!(!tree.any(&through(1.0, -1e-7)));
}
