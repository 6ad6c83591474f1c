//! One suite for every index: the same points as testing them all, and the same squared distances, bit for bit.

mod clouds;
mod costs;
mod exactness;
mod outside;

use clouds::{PLACES, SHAPES, cloud, cube, queries, unit};
use glam::Vec3;
pub use sunfleck::index::Boxes;
use sunfleck::index::{
    BruteForce, Builder, Error, HashGrid, KdBuffered, MAX_K, Nearest, Neighbour, Neighbours, PointBvh, PointKd,
    QueryOrder, Radii, RadiusSearch, SampleBvh, SampleOptions, queries_as_boxes,
};

pub const LBVH: Builder = Builder::Lbvh;
pub const PLOC: Builder = Builder::Ploc { reach: 8 };

pub fn sample_bvh(points: &[Vec3], builder: Builder, boxes: Boxes, leaf_size: usize) -> SampleBvh {
    SampleBvh::new(points, SampleOptions { builder, boxes, leaf_size }).unwrap()
}

pub fn grid(points: &[Vec3], radius: f32, query_order: QueryOrder) -> HashGrid {
    let mut grid = HashGrid::new(points, radius).unwrap();
    grid.query_order = query_order;
    grid
}

/// Calls a generic function with the name of each index, the index over the points, and further arguments.
macro_rules! for_every_index {
    ($points:expr, $built:expr, $check:ident $(, $more:expr)*) => {{
        use $crate::indices::{Boxes, LBVH, PLOC, grid, sample_bvh};
        use sunfleck::index::{BruteForce, KdBuffered, PointKd, PointBvh, PointOrder, QueryOrder};
        let (points, built): (&[glam::Vec3], f32) = ($points, $built);
        $check("brute force", &BruteForce(points) $(, $more)*);
        $check("point BVH", &PointBvh::new(points).unwrap() $(, $more)*);
        $check("point BVH, median", &PointBvh::with_order(points, PointOrder::Median).unwrap() $(, $more)*);
        $check("grid", &grid(points, built, QueryOrder::AsGiven) $(, $more)*);
        $check("grid, queries sorted", &grid(points, built, QueryOrder::Sorted) $(, $more)*);
        $check("kd-tree", &PointKd::new(points).unwrap() $(, $more)*);
        $check("kd-tree, buffered", &KdBuffered::new(points, points.len()).unwrap() $(, $more)*);
        $check("LBVH, tight", &sample_bvh(points, LBVH, Boxes::Tight, 1) $(, $more)*);
        $check("LBVH, inflated", &sample_bvh(points, LBVH, Boxes::Inflated(built), 3) $(, $more)*);
        $check("PLOC, tight", &sample_bvh(points, PLOC, Boxes::Tight, 4) $(, $more)*);
        $check("PLOC, inflated", &sample_bvh(points, PLOC, Boxes::Inflated(built), 1) $(, $more)*);
    }};
}
pub(crate) use for_every_index;

/// What a search is compared by: index and bits of the squared distance, in order of the index.
pub fn bits(row: impl Iterator<Item = Neighbour>) -> Vec<(u32, u32)> {
    let mut row: Vec<(u32, u32)> = row.map(|n| (n.index, n.distance2.to_bits())).collect();
    row.sort_unstable();
    row
}

/// The first k by distance, then by index.
pub fn nearest_of(row: &[(u32, u32)], k: usize) -> Vec<(u32, u32)> {
    // Squared distances are never negative: their bits are in their order.
    let mut row: Vec<(u32, u32)> = row.iter().map(|&(i, d2)| (d2, i)).collect();
    row.sort_unstable();
    row.into_iter().take(k).map(|(d2, i)| (i, d2)).collect()
}

/// Rows of testing every point.
fn oracle(points: &[Vec3], queries: &[Vec3], radii: &[f32]) -> Vec<Vec<(u32, u32)>> {
    let row = |(&q, &radius): (&Vec3, &f32)| {
        let within =
            |(i, d2): (usize, f32)| (d2 <= radius * radius && d2.is_finite()).then_some((i as u32, d2.to_bits()));
        points.iter().map(|&p| sunfleck::index::distance2(p, q)).enumerate().filter_map(within).collect()
    };
    queries.iter().zip(radii).map(row).collect()
}

#[track_caller]
fn assert_rows(name: &str, rows: &Neighbours, expected: &[Vec<(u32, u32)>]) {
    assert_eq!((rows.len(), rows.offsets[0], rows.offsets.len()), (expected.len(), 0, expected.len() + 1), "{name}");
    assert_eq!((rows.indices.len(), rows.distances2.len()), (rows.offsets[rows.len()], rows.indices.len()), "{name}");
    for (q, expected) in expected.iter().enumerate() {
        assert_eq!(&bits(rows.row(q)), expected, "{name}, query {q}");
    }
}

/// Every form of the search.
#[track_caller]
fn check_answers(name: &str, index: &impl RadiusSearch, what: &str, n: usize, queries: &[Vec3], radii: &[f32]) {
    let name = &format!("{name}, {what}");
    assert_eq!((index.len(), index.is_empty()), (n, n == 0), "{name}");
    let expected = EXPECTED.with_borrow(Vec::clone);
    assert_eq!(expected.len(), queries.len());
    let each = Radii::Each(radii);
    assert_rows(name, &index.neighbours_all(queries, each).unwrap(), &expected);
    let counts: Vec<u32> = expected.iter().map(|row| row.len() as u32).collect();
    assert_eq!(index.count_all(queries, each).unwrap(), counts, "{name}");
    let folded = index.fold_all(queries, each, |q| (q, Vec::new()), |(_, row), i, d2| row.push((i, d2.to_bits())));
    for (at, (q, mut row)) in folded.unwrap().into_iter().enumerate() {
        row.sort_unstable();
        assert_eq!((q, &row), (at, &expected[at]), "{name}, query {at} of a fold");
    }
    for (q, (&centre, &radius)) in queries.iter().zip(radii).enumerate() {
        let mut row = Vec::new();
        index.within(centre, radius, |i, d2| row.push((i, d2.to_bits())));
        row.sort_unstable();
        assert_eq!(row, expected[q], "{name}, query {q}: {radius} around {centre}");
        // Leaving early.
        let (mut seen, stop_at) = (0, row.len() / 2 + 1);
        let left = index.try_within(centre, radius, |_, _| {
            seen += 1;
            if seen == stop_at { std::ops::ControlFlow::Break(seen) } else { std::ops::ControlFlow::Continue(()) }
        });
        assert_eq!((left.break_value(), seen), ((stop_at <= row.len()).then_some(stop_at), stop_at.min(row.len())));
    }
    for k in [1, 2, 8, 33, MAX_K] {
        let lists = index.nearest_all(queries, each, k).unwrap();
        let mut one = Nearest::new(k);
        for (q, row) in expected.iter().enumerate() {
            let mut expected = nearest_of(row, k);
            assert_eq!(lists.found[q] as usize, expected.len(), "{name}, {k} nearest of query {q}");
            index.nearest(queries[q], radii[q], &mut one);
            let alone: Vec<_> = one.found().iter().map(|n| (n.index, n.distance2.to_bits())).collect();
            assert_eq!(alone, expected, "{name}, {k} nearest of query {q}: {} around {}", radii[q], queries[q]);
            expected.resize(k, (Neighbour::NONE.index, Neighbour::NONE.distance2.to_bits()));
            let row = lists.indices[q * k..][..k].iter().zip(&lists.distances2[q * k..][..k]);
            assert!(row.map(|(&i, d2)| (i, d2.to_bits())).eq(expected), "{name}, {k} nearest of query {q} in a list");
        }
    }
}

thread_local! {
    static EXPECTED: std::cell::RefCell<Vec<Vec<(u32, u32)>>> = const { std::cell::RefCell::new(Vec::new()) };
}

/// Every index over one cloud; returns the number of neighbours.
#[track_caller]
fn check_all(what: &str, points: &[Vec3], built: f32, queries: &[Vec3], radii: &[f32]) -> usize {
    let expected = oracle(points, queries, radii);
    let found = expected.iter().map(Vec::len).sum();
    EXPECTED.set(expected.clone());
    for_every_index!(points, built, check_answers, what, points.len(), queries, radii);
    for (builder, leaf_size) in [(LBVH, 1), (PLOC, 2)] {
        let rows = queries_as_boxes(points, queries, Radii::Each(radii), builder, leaf_size).unwrap();
        assert_rows(&format!("queries as boxes, {what}"), &rows, &expected);
    }
    found
}

#[test]
fn shapes() {
    for (shape, name) in SHAPES.into_iter().enumerate() {
        for (at, place) in PLACES.into_iter().enumerate() {
            let seed = (shape * 100 + at) as u32;
            let points = cloud(shape, seed, 120 + 7 * at as u32, place);
            let scale = place.0.abs();
            let mut found = 0;
            for (built, n) in [(0.0, 20), (0.02, 40), (0.4, 40), (1.0, 40), (5.0, 10), (f32::INFINITY, 10)] {
                let (queries, radii) = queries(&points, seed + 9, n, place.0, scale * built);
                let what = format!("{name} × {} + {}, built for {built}", place.0, place.1);
                found += check_all(&what, &points, scale * built, &queries, &radii);
            }
            assert!(found > 50, "{name} × {} + {}: {found}", place.0, place.1);
        }
    }
}

#[test]
fn sizes() {
    for n in (0..20).chain([31, 32, 33, 63, 64, 65, 127, 128, 129, 511, 512, 513, 1025, 4097]) {
        let points = cloud(n as usize % 2, n, n, (1.0, 0.0));
        for built in [0.0, 0.05, 0.3, f32::INFINITY] {
            let (queries, radii) = queries(&points, n, if n < 600 { 40 } else { 10 }, 1.0, built);
            check_all(&format!("{n} points, built for {built}"), &points, built, &queries, &radii);
        }
    }
}

/// Points at distance r from the query, as nearly as f32 places them, and on which side each falls is decided alike.
#[test]
fn points_on_the_sphere_of_the_query() {
    let (mut found, mut asked) = (0, 0);
    for (seed, (radius, spread)) in
        (0..).zip([(1.0, 0.0), (0.1, 1.0), (0.37, 3.0), (1e-3, 1.0), (12.5, 100.0), (1e4, 1e5)])
    {
        let centre = cube(4, seed) * spread;
        let points: Vec<Vec3> = cloud(10, seed, 600, (1.0, 0.0))
            .into_iter()
            .map(|p| centre + p * radius)
            .chain([centre + Vec3::X * radius])
            .collect();
        for built in [radius, 3.0 * radius] {
            let radii = [radius, radius.next_down(), radius.next_up().min(built)];
            found += check_all("sphere", &points, built, &[centre; 3], &radii);
            asked += 3 * points.len();
        }
    }
    assert!(found > asked / 5 && found < asked * 4 / 5, "{found} of {asked}");
}

/// The same radius for all is the same as a slice of it, and the order of the queries does not matter.
#[test]
fn one_radius_and_any_order() {
    let points = cloud(1, 3, 3000, (1.0, 0.0));
    fn check(name: &str, index: &impl RadiusSearch, queries: &[Vec3]) {
        let radii = vec![0.1; queries.len()];
        let one = index.neighbours_all(queries, Radii::One(0.1)).unwrap();
        let each = index.neighbours_all(queries, Radii::Each(&radii)).unwrap();
        let fold = |queries: &[Vec3]| {
            let key = |h: &mut u64, i: u32, d2: f32| *h = h.wrapping_add(u64::from(i + 1) * u64::from(d2.to_bits()));
            index.fold_all(queries, Radii::One(0.1), |_| 0, key).unwrap()
        };
        let there = fold(queries);
        let back: Vec<Vec3> = queries.iter().rev().copied().collect();
        assert!(there.iter().eq(fold(&back).iter().rev()), "{name}");
        assert!(there.iter().filter(|&&h| h != 0).count() > queries.len() / 20, "{name}");
        for q in 0..queries.len() {
            assert_eq!(bits(one.row(q)), bits(each.row(q)), "{name}, query {q}");
        }
    }
    // Enough that batches are sorted, where they are; first coherent, then not.
    let n = 6000;
    let along: Vec<Vec3> = (0..n).map(|i| Vec3::splat(i as f32 / n as f32 * 2.0 - 1.0) + cube(1, i) * 0.01).collect();
    let about: Vec<Vec3> = (0..n).map(|i| cube(7, i)).collect();
    for queries in [&along, &about] {
        for_every_index!(&points, 0.1, check, queries);
        check("grid, as it thinks best", &HashGrid::new(&points, 0.1).unwrap(), queries);
    }
}

#[test]
fn what_is_refused() {
    let points = cloud(0, 1, 100, (1.0, 0.0));
    let at = Vec3::ZERO;
    fn check(name: &str, index: &impl RadiusSearch) {
        let at = Vec3::ZERO;
        let asked = |queries: &[Vec3], radii: Radii| {
            let error = index.count_all(queries, radii).unwrap_err();
            let others = [
                index.neighbours_all(queries, radii).unwrap_err(),
                index.nearest_all(queries, radii, 3).unwrap_err(),
                index.fold_all(queries, radii, |_| 0, |_, _, _| ()).unwrap_err(),
            ];
            others.into_iter().for_each(|other| assert_eq!(format!("{other:?}"), format!("{error:?}"), "{name}"));
            error
        };
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let error = asked(&[at, Vec3::new(0.0, x, 0.0)], Radii::One(0.1));
            assert_eq!(error, Error::NotFinite { what: "query", at: 1 }, "{name}");
        }
        assert_eq!(asked(&[at; 2], Radii::Each(&[0.1, -0.1])), Error::Radius { query: 1, radius: -0.1 }, "{name}");
        assert!(matches!(asked(&[at], Radii::One(f32::NAN)), Error::Radius { query: 0, .. }), "{name}");
        assert_eq!(asked(&[at; 2], Radii::Each(&[0.1])), Error::Lengths { queries: 2, radii: 1 }, "{name}");
        if index.max_radius() < f32::INFINITY {
            assert_eq!(index.max_radius(), 0.5, "{name}");
            let above = 0.5f32.next_up();
            let error = asked(&[at; 2], Radii::Each(&[0.5, above]));
            assert_eq!(error, Error::RadiusAboveBuilt { query: 1, radius: above, built: 0.5 }, "{name}");
        }
        for k in [0, MAX_K + 1] {
            assert_eq!(index.nearest_all(&[at], Radii::One(0.1), k).unwrap_err(), Error::K(k), "{name}");
        }
        assert!(index.count_all(&[], Radii::One(0.1)).unwrap().is_empty(), "{name}");
        assert!(index.neighbours_all(&[], Radii::Each(&[])).unwrap().is_empty(), "{name}");
    }
    for_every_index!(&points, 0.5, check);

    for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut points = points.clone();
        points[7].z = x;
        let error = Error::NotFinite { what: "point", at: 7 };
        assert_eq!(PointBvh::new(&points).unwrap_err(), error);
        assert_eq!(HashGrid::new(&points, 0.1).unwrap_err(), error);
        assert_eq!(PointKd::new(&points).unwrap_err(), error);
        assert_eq!(KdBuffered::new(&points, 9).unwrap_err(), error);
        let options = SampleOptions { builder: LBVH, boxes: Boxes::Tight, leaf_size: 1 };
        assert_eq!(SampleBvh::new(&points, options).unwrap_err(), error);
        assert_eq!(queries_as_boxes(&points, &[at], Radii::One(0.1), LBVH, 1).unwrap_err(), error);
    }
    for radius in [-1.0, f32::NAN, f32::NEG_INFINITY] {
        assert!(matches!(HashGrid::new(&points, radius).unwrap_err(), Error::BuiltRadius(_)));
        let options = SampleOptions { builder: PLOC, boxes: Boxes::Inflated(radius), leaf_size: 1 };
        assert!(matches!(SampleBvh::new(&points, options).unwrap_err(), Error::BuiltRadius(_)));
        let error = queries_as_boxes(&points, &[at], Radii::One(radius), LBVH, 1).unwrap_err();
        assert!(matches!(error, Error::Radius { query: 0, .. }));
    }
}

/// Rebuilt over other points, an index answers as a new one, whatever it held before; and a refused rebuild leaves it.
#[test]
fn rebuilt() {
    let start = [Vec3::ZERO];
    let mut tree = PointBvh::default();
    let mut grid = HashGrid::default();
    let mut kd = PointKd::default();
    let mut buffered = KdBuffered::new(&start, 5000).unwrap();
    let mut boxes = sample_bvh(&start, LBVH, Boxes::Tight, 1);
    for (round, n) in (0..).zip([1000, 3, 0, 64, 65, 5000, 1, 511, 4097, 8]) {
        let points = cloud(round % 2, n, n, (1.0, 0.0));
        let radius = [0.1, 0.4, 0.05][round % 3];
        let options = SampleOptions {
            builder: [LBVH, PLOC][round % 2],
            boxes: if round % 4 < 2 { Boxes::Inflated(radius) } else { Boxes::Tight },
            leaf_size: 1 + round % 3,
        };
        tree.rebuild(points.len(), |i| points[i]);
        grid.rebuild(&points, radius).unwrap();
        kd.rebuild(&points).unwrap();
        buffered.rebuild(&points).unwrap();
        boxes.rebuild(&points, options).unwrap();
        for bad in [f32::NAN, f32::INFINITY] {
            let bad = [Vec3::splat(bad)];
            assert!(grid.rebuild(&bad, radius).is_err() && grid.rebuild(&points, -1.0).is_err());
            assert!(kd.rebuild(&bad).is_err() && buffered.rebuild(&bad).is_err());
            assert!(boxes.rebuild(&bad, options).is_err());
        }
        let (queries, radii) = queries(&points, n, 60, 1.0, radius);
        EXPECTED.set(oracle(&points, &queries, &radii));
        let what = format!("rebuilt with {n}");
        check_answers("point BVH", &tree, &what, points.len(), &queries, &radii);
        check_answers("grid", &grid, &what, points.len(), &queries, &radii);
        check_answers("kd-tree", &kd, &what, points.len(), &queries, &radii);
        check_answers("kd-tree, buffered", &buffered, &what, points.len(), &queries, &radii);
        check_answers("sample boxes", &boxes, &what, points.len(), &queries, &radii);
    }
}

/// Rows that are too short are told, and hold what they can.
#[test]
fn truncated_buffers() {
    let points = cloud(0, 5, 500, (1.0, 0.0));
    let queries: Vec<Vec3> = (0..200).map(|i| cube(6, i)).collect();
    let radii: Vec<f32> = (0..200).map(|i| 0.6 * unit(7, i)).collect();
    let all = BruteForce(&points).neighbours_all(&queries, Radii::Each(&radii)).unwrap();
    let mut buffers = Default::default();
    for capacity in [0, 1, 10, 500] {
        let index = KdBuffered::new(&points, capacity).unwrap();
        index.fill(&queries, Radii::Each(&radii), &mut buffers).unwrap();
        let over: Vec<u32> =
            all.offsets.windows(2).map(|w| (w[1] - w[0]) as u32).filter(|&n| n as usize > capacity).collect();
        for q in 0..queries.len() {
            let (row, whole) = (bits(buffers.row(q)), bits(all.row(q)));
            assert_eq!(buffers.found()[q] as usize, whole.len());
            assert_eq!(row.len(), whole.len().min(capacity));
            assert!(row.iter().all(|n| whole.contains(n)));
            assert!(row.windows(2).all(|w| w[0].0 < w[1].0), "twice the same point");
        }
        let folded = index.count_all(&queries, Radii::Each(&radii));
        if capacity == 500 {
            assert_eq!((buffers.check(), folded.unwrap()), (Ok(()), buffers.found().to_vec()));
        } else {
            assert!(over.len() > 20);
            let error = Error::Truncated { queries: over.len(), capacity, most: over.iter().copied().max().unwrap() };
            assert_eq!((buffers.check(), folded), (Err(error.clone()), Err(error)));
        }
    }
}

/// The trees do not depend on the number of threads.
#[test]
fn threads_do_not_change_the_answers() {
    let points = cloud(1, 2, 60_000, (1.0, 0.0));
    let queries: Vec<Vec3> = (0..200).map(|i| cube(3, i)).collect();
    fn in_order(index: &impl RadiusSearch, queries: &[Vec3]) -> Vec<Vec<u32>> {
        index.fold_all(queries, Radii::One(0.2), |_| Vec::new(), |row, i, _| row.push(i)).unwrap()
    }
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            [
                in_order(&grid(&points, 0.2, QueryOrder::Sorted), &queries),
                in_order(&PointKd::new(&points).unwrap(), &queries),
                in_order(&sample_bvh(&points, LBVH, Boxes::Tight, 2), &queries),
                in_order(&sample_bvh(&points, PLOC, Boxes::Inflated(0.2), 1), &queries),
            ]
        })
    };
    assert!(at(1) == at(3));
}

/// Whose inverse extent is no number; and a reach beyond all clusters.
#[test]
fn trees_over_next_to_nothing_are_built() {
    let points = [Vec3::ZERO, Vec3::new(1e-40, 0.0, 0.0), Vec3::splat(2e-40), Vec3::new(0.0, -1e-42, 0.0)];
    for builder in [Builder::Lbvh, PLOC, Builder::Ploc { reach: usize::MAX }] {
        assert_eq!(sample_bvh(&points, builder, Boxes::Tight, 1).count(Vec3::ZERO, 1.0), 4, "{builder:?}");
    }
}
