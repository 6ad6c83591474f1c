//! The neighbour search against the oracle that tests every point: the same points, the same squared distances, bit for
//! bit.

use glam::Vec3;
use proptest::prelude::*;
use sunfleck::index::{BruteForce, FANOUT, LEAF_SIZE, Nearest, PointBvh, Radii, RadiusSearch, distance2};
use sunfleck::math::{rng, warp};

/// Three numbers in [−1, 1).
fn cube(seed: u32, i: u32) -> Vec3 {
    let [x, y, z, _] = rng::unit4(rng::pcg4d([i, seed, 1, 2]));
    Vec3::new(x, y, z) * 2.0 - 1.0
}

fn uniform(seed: u32, n: u32) -> Vec<Vec3> {
    (0..n).map(|i| cube(seed, i)).collect()
}

/// Clouds that shrink by powers of ten around a few centres.
fn clustered(seed: u32, n: u32) -> Vec<Vec3> {
    (0..n).map(|i| cube(seed, i % 7) + cube(seed + 1, i) * 10f32.powi(-(i as i32 % 6))).collect()
}

/// What a search finds: indices and the bits of squared distances, in order of the index.
fn found(search: &impl RadiusSearch, centre: Vec3, radius: f32) -> Vec<(u32, u32)> {
    let mut all = Vec::new();
    search.within(centre, radius, |i, d2| all.push((i, d2.to_bits())));
    all.sort_unstable();
    all
}

#[track_caller]
fn assert_same(points: &[Vec3], tree: &PointBvh, centre: Vec3, radius: f32) -> usize {
    let expected = found(&BruteForce(points), centre, radius);
    assert_eq!(found(tree, centre, radius), expected, "{} points, {radius} around {centre}", points.len());
    expected.len()
}

#[track_caller]
fn assert_kth(points: &[Vec3], tree: &PointBvh, centre: Vec3, radius: f32) {
    let mut all: Vec<f32> = points.iter().map(|&p| distance2(p, centre)).filter(|&d2| d2 <= radius * radius).collect();
    all.sort_unstable_by(f32::total_cmp);
    for k in [1, 2, 7, 8, 9, 10, 33, 64] {
        let expected = all.get(k - 1).map(|d| d.to_bits());
        let mut nearest = Nearest::new(k);
        tree.nearest(centre, radius, &mut nearest);
        let kth = nearest.kth().map(|last| last.distance2.to_bits());
        assert_eq!(kth, expected, "{k} within {radius} of {centre}");
    }
}

/// Order, boxes and nesting of a tree over `points`.
#[track_caller]
fn assert_sound(points: &[Vec3], tree: &PointBvh) {
    assert_eq!((tree.len(), tree.is_empty()), (points.len(), points.is_empty()));
    let mut order = tree.order().to_vec();
    order.sort_unstable();
    assert!(order.iter().copied().eq(0..points.len() as u32), "the order is no permutation");
    let bounds = |boxes: &[(Vec3, Vec3)]| {
        boxes.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)))
    };
    let mut below: Vec<(Vec3, Vec3)> = tree.order().iter().map(|&i| (points[i as usize], points[i as usize])).collect();
    let boxes = tree.boxes();
    let (mut first, mut width) = (0, LEAF_SIZE as usize);
    while !points.is_empty() && (first == 0 || below.len() > 1) {
        let level: Vec<_> = below.chunks(width).map(bounds).collect();
        assert_eq!(boxes[first..first + level.len()], level, "boxes from {first}");
        (first, width, below) = (first + level.len(), FANOUT as usize, level);
    }
    assert_eq!(boxes.len(), first);
    // Slots ascend, and lead to the point at that distance.
    let (centre, mut last) = (points.first().copied().unwrap_or(Vec3::ZERO), None);
    tree.visit(centre, 0.5, |slot, d2| {
        assert!(last < Some(slot), "{slot} after {last:?}");
        assert_eq!(d2, distance2(points[tree.order()[slot as usize] as usize], centre));
        last = Some(slot);
    });
}

/// 10⁵ queries over points in a cube, and k-th neighbours of some.
#[test]
fn random_points() {
    let (mut n_queries, mut n_found) = (0, 0);
    for (n, queries) in [(1, 500), (2, 500), (7, 500), (8, 500), (9, 500), (63, 5000), (64, 5000), (65, 5000)]
        .into_iter()
        .chain([(100, 40_000), (513, 40_000), (3000, 6000), (40_000, 200)])
    {
        let points = uniform(n, n);
        let tree = PointBvh::new(&points).unwrap();
        assert_sound(&points, &tree);
        for q in 0..queries {
            let u = rng::unit(rng::pcg4d([q, n, 0, 9])[0]);
            n_found += assert_same(&points, &tree, cube(77, q) * 1.2, 1.5 * u * u * u);
            n_queries += 1;
            if q % 50 == 0 {
                assert_kth(&points, &tree, cube(77, q) * 1.2, 1.5 * u);
                assert_kth(&points, &tree, cube(77, q) * 1.2, f32::INFINITY);
            }
        }
    }
    assert!(n_queries >= 100_000 && n_found > n_queries, "{n_queries} queries found {n_found} points");
}

/// Degenerate shapes, each also far from the origin, tiny and huge.
#[test]
fn shapes() {
    let n = 700;
    let line = |axis: Vec3| (0..n).map(|i| axis * cube(1, i).x).collect::<Vec<_>>();
    let lattice = (0..n).map(|i| Vec3::new((i % 9) as f32, (i / 9 % 9) as f32, (i / 81) as f32)).collect();
    let doubled = (0..n).map(|i| cube(3, i % 10)).collect();
    let shapes: [(&str, Vec<Vec3>); 9] = [
        ("clustered", clustered(5, n)),
        ("equal", vec![Vec3::new(0.3, -0.7, 0.2); n as usize]),
        ("zeros of both signs", (0..n).map(|i| Vec3::splat(if i % 2 == 0 { 0.0 } else { -0.0 })).collect()),
        ("on an axis", line(Vec3::Y)),
        ("on a line", line(Vec3::new(0.3, -0.8, 0.5))),
        ("on a plane", (0..n).map(|i| cube(2, i) * Vec3::new(1.0, 0.0, 1.0)).collect()),
        ("on a tilted plane", (0..n).map(|i| cube(2, i)).map(|p| Vec3::new(p.x, 0.5 * p.x - p.z, p.z)).collect()),
        ("lattice", lattice),
        ("ten points, each many times", doubled),
    ];
    for (name, shape) in shapes {
        for (scale, offset) in [(1.0, 0.0), (1.0, 1e4), (-1e-12, 0.0), (1e-3, -1e6), (1e15, 0.0)] {
            let points: Vec<Vec3> =
                shape.iter().map(|&p| p * scale + Vec3::new(offset, -offset, 0.5 * offset)).collect();
            let tree = PointBvh::new(&points).unwrap();
            assert_sound(&points, &tree);
            let mut n_found = 0;
            for q in 0..60 {
                let at_a_point = points[(q as usize * 37) % points.len()];
                let beside = at_a_point + cube(8, q) * scale;
                // A radius that reaches a certain point exactly, or as nearly as its square in f32 does.
                let reach = at_a_point.distance(points[(q as usize * 91 + 5) % points.len()]);
                for centre in [at_a_point, beside] {
                    for radius in
                        [0.0, 1e-3 * scale.abs(), 0.3 * scale.abs(), reach, reach.next_down(), reach.next_up()]
                    {
                        n_found += assert_same(&points, &tree, centre, radius.max(0.0));
                    }
                }
                if q % 6 == 0 {
                    assert_kth(&points, &tree, beside, f32::INFINITY);
                    assert_kth(&points, &tree, at_a_point, 0.4 * scale.abs());
                }
            }
            assert!(n_found >= 60, "{name} × {scale} + {offset}: {n_found}");
        }
    }
}

/// Points at distance r from the query, as nearly as f32 places them: some just in, some just out, and on which side
/// each falls is decided alike.
#[test]
fn points_on_the_sphere_of_the_query() {
    let (mut inside, mut outside) = (0, 0);
    for (q, (radius, spread)) in [(1.0, 0.0), (0.1, 1.0), (0.37, 3.0), (1e-3, 1.0), (12.5, 100.0), (1e4, 1e5)]
        .into_iter()
        .cycle()
        .take(120)
        .enumerate()
    {
        let centre = cube(4, q as u32) * spread;
        let points: Vec<Vec3> = (0..500)
            .map(|i| {
                let [u, v, ..] = rng::unit4(rng::pcg4d([i, q as u32, 5, 6]));
                centre + warp::sphere([u, v]) * radius
            })
            .collect();
        let tree = PointBvh::new(&points).unwrap();
        let n = assert_same(&points, &tree, centre, radius);
        assert_kth(&points, &tree, centre, radius);
        inside += n;
        outside += points.len() - n;
        // On an axis the distance is exact, and r itself belongs to the ball.
        for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
            let exact = PointBvh::new(&[axis * radius]).unwrap();
            assert_eq!(found(&exact, Vec3::ZERO, radius).len(), 1);
            assert_eq!(found(&exact, Vec3::ZERO, radius.next_down()).len(), 0);
        }
    }
    assert!(inside > 10_000 && outside > 10_000, "{inside} inside, {outside} outside");
}

#[test]
fn none_one_and_all() {
    let empty = PointBvh::new(&[]).unwrap();
    assert_sound(&[], &empty);
    assert_same(&[], &empty, Vec3::ZERO, f32::INFINITY);
    assert_kth(&[], &empty, Vec3::ZERO, 1.0);

    let one = [Vec3::new(1.0, 2.0, 3.0)];
    let tree = PointBvh::new(&one).unwrap();
    assert_sound(&one, &tree);
    for (centre, radius, n) in [
        (one[0], 0.0, 1),
        (Vec3::ZERO, 3.0, 0),
        (Vec3::ZERO, 4.0, 1),
        (Vec3::ZERO, f32::INFINITY, 1),
        (Vec3::splat(1e18), f32::MAX, 1),
    ] {
        assert_eq!(assert_same(&one, &tree, centre, radius), n, "{radius} around {centre}");
    }

    for n in [8, 9, 500, 513] {
        let points = clustered(9, n);
        let tree = PointBvh::new(&points).unwrap();
        for radius in [10.0, 1e18, 1e25, f32::MAX, f32::INFINITY] {
            assert_eq!(assert_same(&points, &tree, Vec3::splat(0.5), radius), n as usize);
        }
    }
}

/// A tree used again answers as a new one, whatever it held before.
#[test]
fn rebuilt_with_other_sizes() {
    let mut tree = PointBvh::default();
    for n in [1000, 3, 0, 64, 65, 5000, 1, 511, 4097, 8] {
        let points = if n % 2 == 0 { uniform(n, n) } else { clustered(n, n) };
        tree.rebuild(points.len(), |i| points[i]);
        assert_sound(&points, &tree);
        let fresh = PointBvh::new(&points).unwrap();
        assert_eq!((tree.order(), tree.boxes()), (fresh.order(), fresh.boxes()));
        for q in 0..50 {
            assert_same(&points, &tree, cube(6, q), 0.4);
        }
    }
}

/// The same tree, whatever the number of threads.
#[test]
fn threads_do_not_change_the_tree() {
    let points = clustered(2, 100_000);
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tree = pool.install(|| PointBvh::new(&points).unwrap());
        (tree.order().to_vec(), tree.boxes())
    };
    let one = at(1);
    assert!(one == at(3));
    assert_sound(&points, &PointBvh::new(&points).unwrap());
}

/// A batch meets the neighbours of each query in the order that a single query does, bit for bit: whatever the packets, the
/// sorting and the number of threads, and where a packet's points are too many to be gathered at once.
#[test]
fn batches_meet_neighbours_in_the_order_of_single_queries() {
    let points = clustered(3, 20_000);
    let tree = PointBvh::new(&points).unwrap();
    let along: Vec<Vec3> = (0..9000).map(|i| cube(1, 0) + Vec3::new(i as f32 * 2e-5, 0.0, 0.0)).collect();
    let about: Vec<Vec3> = (0..9000).map(|i| cube(11, i)).collect();
    let together = vec![points[17]; 70];
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let (one, three) = (pool(1), pool(3));
    let mut most = 0;
    for (queries, radius) in
        [(&along, 0.05), (&about, 0.05), (&along, 0.0), (&together, 0.3), (&together, f32::INFINITY)]
    {
        let radii: Vec<f32> = (0..queries.len() as u32).map(|i| radius * (0.3 + cube(12, i).x.abs())).collect();
        for radii in [Radii::One(radius), Radii::Each(&radii)] {
            let fold = || {
                let push = |row: &mut Vec<(u32, u32)>, i: u32, d2: f32| row.push((i, d2.to_bits()));
                tree.fold_all(queries, radii, |_| Vec::new(), push).unwrap()
            };
            let rows = one.install(fold);
            assert!(rows == three.install(fold), "threads change the rows");
            for (q, row) in rows.iter().enumerate() {
                let mut single = Vec::new();
                tree.within(queries[q], radii.of(q), |i, d2| single.push((i, d2.to_bits())));
                assert!(*row == single, "query {q}, {} around {}", radii.of(q), queries[q]);
                most = most.max(row.len());
            }
        }
    }
    assert_eq!(most, points.len());
}

fn coordinate() -> impl Strategy<Value = f32> {
    // Few distinct values, so that points coincide and distances tie; then all orders of magnitude.
    prop_oneof![(-4i8..5).prop_map(|i| f32::from(i) * 0.25), -1.0f32..1.0, (-12i32..13).prop_map(|e| 10f32.powi(e))]
}

fn point() -> impl Strategy<Value = Vec3> {
    (coordinate(), coordinate(), coordinate()).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_points_any_ball(
        points in prop::collection::vec(point(), 0..150),
        centre in point(),
        radius in prop_oneof![Just(0.0f32), 0.0f32..2.0, (-12i32..13).prop_map(|e| 10f32.powi(e)), Just(f32::INFINITY)],
    ) {
        let tree = PointBvh::new(&points).unwrap();
        assert_sound(&points, &tree);
        assert_same(&points, &tree, centre, radius);
        assert_kth(&points, &tree, centre, radius);
        for &p in points.iter().take(3) {
            assert_same(&points, &tree, p, radius);
            assert_same(&points, &tree, centre, p.distance(centre));
        }
    }
}
