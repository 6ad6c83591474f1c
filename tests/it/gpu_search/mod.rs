//! The search on the GPU against the oracle on the CPU that tests every point.

mod buffers;
mod devices;
mod measured;
mod nodes;
mod visitors;

use std::sync::{Arc, OnceLock};

pub use devices::meagre_device;
use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::gpu::{Choice, Context, DeviceKind, PointSearch, Queries, wgpu};
use sunfleck::index::{self, BruteForce, MAX_K, NearestLists, Neighbours, PointBvh, Radii, RadiusSearch};
use sunfleck::math::{rng, warp};

/// The device that all tests share; `None` without an adapter.
pub fn context() -> Option<Arc<Context>> {
    static CONTEXT: OnceLock<Option<Arc<Context>>> = OnceLock::new();
    let opened = CONTEXT.get_or_init(|| match Context::new(&Choice::Any) {
        Ok(context) => Some(Arc::new(context)),
        Err(error) => {
            assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none(), "SUNFLECK_REQUIRE_GPU is set, but: {error}");
            None
        }
    });
    if opened.is_none() {
        println!("skipped: no GPU adapter");
    }
    opened.clone()
}

fn search() -> Option<PointSearch> {
    context().map(|context| PointSearch::new(context).expect("kernels"))
}

/// Three numbers in [−1, 1).
pub fn cube(seed: u32, i: u32) -> Vec3 {
    let [x, y, z, _] = rng::unit4(rng::pcg4d([i, seed, 3, 4]));
    Vec3::new(x, y, z) * 2.0 - 1.0
}

pub fn uniform(seed: u32, n: u32) -> Vec<Vec3> {
    (0..n).map(|i| cube(seed, i)).collect()
}

/// Point sets that have broken trees before.
pub fn clouds() -> Vec<(&'static str, Vec<Vec3>)> {
    let n = 2500;
    let make = |at: &dyn Fn(u32) -> Vec3| (0..n).map(at).collect::<Vec<_>>();
    vec![
        ("none", Vec::new()),
        ("one", vec![Vec3::new(0.5, 0.25, -3.0)]),
        ("eight", uniform(1, 8)),
        ("nine", uniform(2, 9)),
        ("random", uniform(3, 6000)),
        ("clustered", make(&|i| cube(4, i % 7) + cube(5, i) * 10f32.powi(-(i as i32 % 6)))),
        ("coincident", make(&|_| Vec3::new(0.3, -0.7, 0.2))),
        ("ten points, each many times", make(&|i| cube(6, i % 10))),
        ("on an axis", make(&|i| Vec3::Y * cube(7, i).x)),
        ("on a line", make(&|i| Vec3::new(0.3, -0.8, 0.5) * cube(8, i).x)),
        ("on a plane", make(&|i| cube(9, i) * Vec3::new(1.0, 0.0, 1.0))),
        ("lattice", make(&|i| Vec3::new((i % 13) as f32, (i / 13 % 13) as f32, (i / 169) as f32))),
        (
            "on a sphere around the first query",
            make(&|i| {
                let [u, v, ..] = rng::unit4(rng::pcg4d([i, 1, 2, 3]));
                if i == 0 { Vec3::ZERO } else { warp::sphere([u, v]) * 0.37 }
            }),
        ),
        ("far away", make(&|i| cube(10, i) + Vec3::new(1e4, -1e4, 5e3))),
        ("tiny", make(&|i| cube(11, i) * -1e-12)),
        ("huge", make(&|i| cube(12, i) * 1e15)),
        ("squares overflow", make(&|i| cube(13, i) * 1e25)),
        // A step from −1 meets zero, and a leaf begins less below it than the difference to −1 shows.
        (
            "beside a step of a node",
            (0..64u8)
                .map(|i| Vec3::X * if i < 32 { f32::from(i) / 40.0 - 1.0 } else { f32::from(i - 32) / 32.0 - 1e-9 })
                .collect(),
        ),
    ]
}

/// Queries at and beside points, with radii from zero to all, some of which reach another point exactly.
pub fn queries(points: &[Vec3], n: u32) -> (Vec<Vec3>, Vec<f32>) {
    let at = |i: u32| points.get(i as usize % points.len().max(1)).copied().unwrap_or(Vec3::ONE);
    let low = points.iter().copied().reduce(Vec3::min).unwrap_or_default();
    let high = points.iter().copied().reduce(Vec3::max).unwrap_or_default();
    let extent = (high - low).max_element().max(f32::MIN_POSITIVE);
    let query = |i: u32| match i % 4 {
        0 => at(i * 37),
        1 => at(i * 37) + cube(20, i) * extent * 0.01,
        2 => low + (cube(21, i) * 0.6 + 0.5) * (high - low),
        _ => at(i * 37) + cube(22, i) * extent,
    };
    let radius = |i: u32| match i % 7 {
        0 => 0.0,
        1 => query(i).distance(at(i * 91 + 5)),
        2 => query(i).distance(at(i * 91 + 5)).next_up(),
        3 => query(i).distance(at(i * 53 + 1)).next_down().max(0.0),
        4 => extent * 0.02,
        5 => extent * 0.2,
        _ => [extent * 4.0, f32::INFINITY, 0.37 * extent][(i / 7 % 3) as usize],
    };
    ((0..n).map(query).collect(), (0..n).map(radius).collect())
}

/// Differences from the host that fused arithmetic allows: squared distances this near, relatively, to r². A sum of
/// three squares has an error of less than 2 units of 2⁻²³ either way.
const BAND: f32 = 4.0 * f32::EPSILON;

/// Software does as the host does, bit for bit.
pub fn is_exact(search: &PointSearch) -> bool {
    search.context().info().kind == DeviceKind::Cpu
}

/// Compares the rows as sets; returns the neighbours found by one alone, each within the band around r.
#[track_caller]
pub fn assert_same_sets(
    name: &str,
    points: &[Vec3],
    queries: &[Vec3],
    radii: Radii<'_>,
    found: &Neighbours,
    exact: bool,
) -> usize {
    let expected = BruteForce(points).neighbours_all(queries, radii).unwrap();
    assert_eq!(found.len(), queries.len(), "{name}: rows");
    assert_eq!((found.offsets[0], found.offsets[queries.len()]), (0, found.indices.len()), "{name}: offsets");
    assert_eq!(found.distances2.len(), found.indices.len(), "{name}: distances");
    let mut n_differences = 0;
    for (q, &query) in queries.iter().enumerate() {
        let sorted = |all: &Neighbours| {
            let mut row: Vec<_> = all.row(q).map(|n| (n.index, n.distance2)).collect();
            row.sort_unstable_by_key(|n| n.0);
            row
        };
        let (ours, theirs) = (sorted(found), sorted(&expected));
        assert!(ours.windows(2).all(|pair| pair[0].0 < pair[1].0), "{name}, query {q}: a point twice");
        if ours == theirs {
            continue;
        }
        assert!(!exact, "{name}, query {q}: {} found, {} expected, or other distances", ours.len(), theirs.len());
        let radius2 = radii.of(q) * radii.of(q);
        for &(i, d2) in &ours {
            let at_host = index::distance2(points[i as usize], query);
            assert!((d2 - at_host).abs() <= BAND * at_host, "{name}, query {q}, point {i}: {d2} against {at_host}");
        }
        let lacks = |a: &[(u32, f32)], b: &[(u32, f32)]| {
            let missing = a.iter().filter(|(i, _)| b.binary_search_by_key(i, |n| n.0).is_err());
            missing.inspect(|(i, d2)| assert!((d2 - radius2).abs() <= BAND * radius2, "{name}, query {q}: {i}")).count()
        };
        n_differences += lacks(&ours, &theirs) + lacks(&theirs, &ours);
    }
    n_differences
}

#[test]
fn the_same_sets_as_on_the_host() {
    let Some(mut search) = search() else { return };
    assert_sets(&mut search);
}

/// In boxes that contain every query.
#[test]
fn ray_queries_find_the_same_sets() {
    let Some(context) = crate::gpu_hardware::context() else { return };
    assert_sets(&mut PointSearch::hardware(context, f32::INFINITY).expect("kernels"));
}

fn assert_sets(search: &mut PointSearch) {
    let exact = is_exact(search);
    let (mut n_queries, mut n_found, mut n_differences) = (0, 0, 0);
    for (name, points) in clouds() {
        search.build(&points).expect("build");
        assert_eq!((search.len(), search.is_empty()), (points.len(), points.is_empty()), "{name}");
        let (queries, radii) = queries(&points, 147);
        let few = &queries[..7];
        let cases =
            [(&queries[..], Radii::Each(&radii)), (few, Radii::One(radii[5])), (few, Radii::One(0.0)), (few, ALL)];
        for (queries, radii) in cases {
            let found = search.neighbours_all(queries, radii).expect("search");
            n_differences += assert_same_sets(name, &points, queries, radii, &found, exact);
            let counts = search.count_all(queries, radii).expect("count");
            let rows: Vec<u32> = found.offsets.windows(2).map(|pair| (pair[1] - pair[0]) as u32).collect();
            assert_eq!(counts, rows, "{name}");
            (n_queries, n_found) = (n_queries + queries.len(), n_found + found.indices.len());
        }
    }
    println!("{n_queries} queries, {n_found} neighbours, {n_differences} found by one of both alone");
    assert!(n_found > 100 * n_queries);
}

const ALL: Radii<'static> = Radii::One(f32::INFINITY);

#[track_caller]
fn assert_same_lists(name: &str, found: &NearestLists, expected: &NearestLists, exact: bool) {
    assert_eq!(found.k, expected.k);
    if exact {
        assert!(found == expected, "{name}, k = {}", found.k);
        return;
    }
    // A point on the sphere may be in or out; nearly equal distances may change places.
    assert_eq!(found.found.len(), expected.found.len(), "{name}");
    for q in 0..found.found.len() {
        let n = found.found[q].min(expected.found[q]) as usize;
        for at in q * found.k..q * found.k + n {
            let (ours, theirs) = (found.distances2[at], expected.distances2[at]);
            assert!((ours - theirs).abs() <= BAND * theirs, "{name}, query {q}: {ours} against {theirs}");
        }
    }
}

#[test]
fn the_same_nearest_as_on_the_host() {
    let Some(mut search) = search() else { return };
    let exact = is_exact(&search);
    for (name, points) in clouds() {
        search.build(&points).expect("build");
        let (queries, radii) = queries(&points, 70);
        for k in [1, 8, 33, MAX_K] {
            for radii in [Radii::Each(&radii), ALL] {
                let found = search.nearest_all(&queries, radii, k).expect("search");
                let expected = BruteForce(&points).nearest_all(&queries, radii, k).unwrap();
                assert_same_lists(name, &found, &expected, exact);
            }
        }
    }
}

/// Memory is used again, whatever it held before; the order of the queries changes nothing.
#[test]
fn rebuilt_with_other_sizes() {
    let Some(mut search) = search() else { return };
    let exact = is_exact(&search);
    // 470 then 513, 3900 then 4097: what was reserved for the first is all but enough for the second.
    for n in [470, 513, 1000, 3, 0, 64, 65, 3900, 4097, 1, 511, 5000, 8] {
        let points = uniform(n, n);
        search.build(&points).expect("build");
        search.set_sort_queries(n % 2 == 1);
        let mut indices: Vec<u32> = search.points().expect("points").iter().map(|(_, index)| *index).collect();
        indices.sort_unstable();
        assert!(indices.into_iter().eq(0..n), "{n} points: the order is no permutation");
        let (queries, radii) = queries(&points, 60);
        let found = search.neighbours_all(&queries, Radii::Each(&radii)).expect("search");
        assert_same_sets("rebuilt", &points, &queries, Radii::Each(&radii), &found, exact);
        let lists = search.nearest_all(&queries, Radii::Each(&radii), 5).expect("search");
        let expected = BruteForce(&points).nearest_all(&queries, Radii::Each(&radii), 5).unwrap();
        assert_same_lists("rebuilt", &lists, &expected, exact);
    }
    for sort in [false, true] {
        search.set_sort_queries(sort);
        assert_eq!(search.neighbours_all(&[], ALL).expect("no queries").offsets, [0]);
        assert!(search.count_all(&[], Radii::Each(&[])).expect("no queries").is_empty());
        assert!(search.nearest_all(&[], ALL, 3).expect("no queries").found.is_empty());
    }
}

/// More queries than one dispatch takes, and more than a block of the prefix sum.
#[test]
fn many_queries() {
    let Some(mut search) = search() else { return };
    let points = uniform(30, 300);
    let queries = uniform(31, 150_001);
    search.build(&points).expect("build");
    let found = search.neighbours_on_device(Queries::Host(&queries), Radii::One(0.3).into()).expect("search");
    let offsets = found.offsets.download().expect("offsets");
    let expected = PointBvh::new(&points).unwrap().count_all(&queries, Radii::One(0.3)).unwrap();
    let counts: Vec<u32> = offsets.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let n_differences = counts.iter().zip(&expected).filter(|(a, b)| a != b).count();
    assert!(n_differences == 0 || (!is_exact(&search) && n_differences < 10), "{n_differences} counts differ");
    assert_eq!((offsets[0], offsets.len(), found.indices.len()), (0, 150_002, offsets[150_001] as usize));
    let times = search.times().expect("times");
    assert!(times.build > 0.0 && times.search > 0.0 && times.fill > 0.0, "{times:?}");
}

fn upload<T: bytemuck::Pod>(context: &Context, data: &[T], usage: wgpu::BufferUsages) -> wgpu::Buffer {
    let buffer = context.device().create_buffer(&wgpu::BufferDescriptor {
        label: Some("test"),
        size: size_of_val(data) as u64,
        usage: usage | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    context.queue().write_buffer(&buffer, 0, bytemuck::cast_slice(data));
    buffer
}

#[test]
fn what_makes_no_sense_is_refused() {
    let Some(mut search) = search() else { return };
    let points = uniform(50, 20);
    search.build(&points).expect("build");
    for bad in [f32::NAN, f32::INFINITY] {
        let expected = |what| index::Error::NotFinite { what, at: 1 };
        let bad = [Vec3::ZERO, Vec3::new(0.0, bad, 0.0)];
        assert!(matches!(search.count_all(&bad, ALL), Err(Error::Search(e)) if e == expected("query")));
        let on_device = search.count_on_device(Queries::Host(&bad), ALL.into());
        assert!(matches!(on_device, Err(Error::Search(e)) if e == expected("query")));
        assert!(matches!(search.build(&bad), Err(Error::Search(e)) if e == expected("point")));
        assert!(search.is_empty());
    }
    for radius in [f32::NAN, -1.0, f32::NEG_INFINITY] {
        let radii = [1.0, radius];
        for radii in [Radii::One(radius), Radii::Each(&radii)] {
            let result = search.neighbours_all(&points[..2], radii);
            assert!(matches!(result, Err(Error::Search(index::Error::Radius { .. }))), "{radius}");
        }
    }
    for k in [0, MAX_K + 1] {
        assert!(matches!(search.nearest_all(&points, ALL, k), Err(Error::Search(index::Error::K(n))) if n == k));
    }
    let result = search.count_all(&points, Radii::Each(&[1.0; 19]));
    assert!(matches!(result, Err(Error::Search(index::Error::Lengths { queries: 20, radii: 19 }))));
}
