//! The search on the GPU against the oracle on the CPU that tests every point.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};

use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::gpu::{Access, Choice, Context, DeviceKind, PointSearch, Queries, QueryRadii, required_limits, wgpu};
use sunfleck::index::{self, BruteForce, MAX_K, NearestLists, Neighbours, PointBvh, Radii, RadiusSearch};
use sunfleck::layout::{FANOUT, TreeNode};
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

/// wgpu binds no empty buffer, but a caller who has no queries, or no points, has one.
#[test]
fn empty_buffers_of_the_caller() {
    let Some(mut search) = search() else { return };
    assert_empty_buffers(&mut search);
}

/// The same by ray queries.
#[test]
fn empty_buffers_of_the_caller_for_ray_queries() {
    let Some(context) = crate::gpu_hardware::context() else { return };
    assert_empty_buffers(&mut PointSearch::hardware(context, 1.0).expect("kernels"));
}

fn assert_empty_buffers(search: &mut PointSearch) {
    let context = search.context().clone();
    let empty = upload::<f32>(&context, &[], wgpu::BufferUsages::STORAGE);
    let none = Queries::Device { buffer: &empty, n: 0, words_per_record: 3 };
    let points = uniform(32, 100);
    for n in [100, 0] {
        if n > 0 {
            search.build(&points).expect("build");
        } else {
            search.build_from(&empty, 0, 3).expect("no points");
            assert_eq!(search.count_all(&points[..2], Radii::One(1.0)).expect("no points"), [0, 0]);
        }
        for sort in [false, true] {
            search.set_sort_queries(sort);
            for radii in [QueryRadii::Device(&empty), Radii::One(0.5).into(), Radii::Each(&[]).into()] {
                assert!(search.count_on_device(none, radii).expect("no queries").is_empty());
                let rows = search.neighbours_on_device(none, radii).expect("no queries").download().expect("rows");
                assert_eq!((rows.offsets, rows.indices), (vec![0], vec![]));
                let lists = search.nearest_on_device(none, radii, 4).expect("no queries").download().expect("lists");
                assert!(lists.found.is_empty() && lists.indices.is_empty());
            }
        }
    }
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    search.visit_all(&visitor, none, QueryRadii::Device(&empty), &[&empty, &empty]).expect("nothing to visit");
    // With a query it is too short all the same.
    let one = Queries::Device { buffer: &empty, n: 1, words_per_record: 3 };
    let short = search.count_on_device(one, Radii::One(0.5).into());
    assert!(matches!(short, Err(Error::Buffer { .. })), "{:?}", short.map(drop));
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
fn points_and_queries_on_the_device() {
    let Some(mut search) = search() else { return };
    let context = search.context().clone();
    let (points, exact) = (uniform(40, 2000), is_exact(&search));
    let (queries, radii) = queries(&points, 100);
    let records: Vec<[f32; 5]> = points.iter().map(|p| [p.x, p.y, p.z, f32::NAN, -1.0]).collect();
    let on_device = upload(&context, &records, wgpu::BufferUsages::STORAGE);
    search.build_from(&on_device, points.len() as u32, 5).expect("build");
    let buffer = upload(&context, &queries, wgpu::BufferUsages::STORAGE);
    let asked = Queries::Device { buffer: &buffer, n: 100, words_per_record: 3 };
    let own_radii = upload(&context, &radii, wgpu::BufferUsages::STORAGE);
    for sort in [false, true] {
        search.set_sort_queries(sort);
        for radii_asked in [QueryRadii::Device(&own_radii), Radii::Each(&radii).into()] {
            let found = search.neighbours_on_device(asked, radii_asked).expect("search").download().expect("rows");
            assert_same_sets("on the device", &points, &queries, Radii::Each(&radii), &found, exact);
            let lists = search.nearest_on_device(asked, radii_asked, 7).expect("search").download().expect("lists");
            let expected = BruteForce(&points).nearest_all(&queries, Radii::Each(&radii), 7).unwrap();
            assert_same_lists("on the device", &lists, &expected, exact);
        }
    }
    // Nothing is within such radii.
    let none = upload(&context, &[-1.0f32; 100], wgpu::BufferUsages::STORAGE);
    let counts = search.count_on_device(asked, QueryRadii::Device(&none)).expect("search");
    assert_eq!(counts.download().expect("counts"), [0; 100]);

    let refused = |result: Result<(), Error>, part: &str| match result {
        Err(Error::Buffer { problem, .. }) => assert!(problem.contains(part), "{problem}"),
        other => panic!("{other:?}"),
    };
    refused(search.build_from(&on_device, 2000, 2), "2 words");
    assert!(search.is_empty());
    refused(search.build_from(&on_device, 2001, 5), "40000 bytes, 40020 are needed");
    let plain = upload(&context, &records, wgpu::BufferUsages::UNIFORM);
    refused(search.build_from(&plain, 10, 5), "STORAGE");
    let short = upload(&context, &radii[..99], wgpu::BufferUsages::STORAGE);
    refused(search.count_on_device(asked, QueryRadii::Device(&short)).map(drop), "396 bytes, 400 are needed");
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

/// What a device cannot hold at once is searched in parts where the rows end on the host, and refused where not.
#[test]
fn more_than_fits() {
    if context().is_none() {
        return;
    }
    let mut context = Context::new(&Choice::Any).expect("a second device");
    context.set_budget(4 << 20);
    let mut search = PointSearch::new(Arc::new(context)).expect("kernels");
    let points = uniform(60, 2000);
    search.build(&points).expect("within the budget");
    let (queries, _) = queries(&points, 300);
    let found = search.neighbours_all(&queries, ALL).expect("in parts");
    let exact = is_exact(&search);
    assert_same_sets("in parts", &points, &queries, ALL, &found, exact);
    assert_eq!(found.indices.len(), 600_000);
    match search.neighbours_on_device(Queries::Host(&queries), ALL.into()) {
        Err(Error::TooLarge { needed, allowed, .. }) => assert!((needed, allowed < 4 << 20) == (2_400_000, true)),
        other => panic!("{:?}", other.map(drop)),
    }
    match search.build(&uniform(61, 300_000)) {
        Err(Error::TooLarge { what, needed, .. }) => {
            assert!(what.starts_with("points") && needed > 16 * 300_000, "{what}: {needed}");
        }
        other => panic!("{other:?}"),
    }
    assert!(search.is_empty() && search.count_all(&queries, ALL).expect("no points").iter().all(|n| *n == 0));
}

/// Sum over the neighbours of 1 − d²/r², and the farthest neighbour.
const KERNEL_SUM: &str = "
@group(0) @binding(4) var<storage, read> weights: array<f32>;
@group(0) @binding(5) var<storage, read_write> sums: array<f32>;

struct Visitor {
    radius2: f32,
    inverse: f32,
    sum: f32,
}

fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    return Visitor(radius2, 1.0 / radius2, 0.0);
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    (*visitor).sum += weights[index_of(slot)] * (1.0 - distance2 * (*visitor).inverse);
}

fn end(visitor: ptr<function, Visitor>, query: u32) {
    sums[query] = (*visitor).sum;
}
";

#[test]
fn a_visitor_of_ones_own() {
    let Some(mut search) = search() else { return };
    let context = search.context().clone();
    let (points, queries) = (uniform(70, 3000), uniform(71, 200));
    let weights: Vec<f32> = (0..3000).map(|i| (i % 5) as f32).collect();
    search.build(&points).expect("build");
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    let given = upload(&context, &weights, wgpu::BufferUsages::STORAGE);
    let sums = upload(&context, &[f32::NAN; 200], wgpu::BufferUsages::STORAGE);
    let radius = 0.4;
    let expected: Vec<f32> = BruteForce(&points)
        .fold_all(
            &queries,
            Radii::One(radius),
            |_| 0.0,
            |sum, i, d2| {
                *sum += weights[i as usize] * (1.0 - d2 / (radius * radius));
            },
        )
        .unwrap();
    for sort in [false, true] {
        search.set_sort_queries(sort);
        search.visit_all(&visitor, Queries::Host(&queries), Radii::One(radius).into(), &[&given, &sums]).expect("run");
        let got: Vec<f32> = context.download(&sums, 0, 200).expect("sums");
        for (got, expected) in got.iter().zip(&expected) {
            assert!((got - expected).abs() <= 1e-4 * expected.abs().max(1.0), "{got} against {expected}");
        }
    }
    let few = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&given]);
    assert!(matches!(few, Err(Error::Shader(_))), "{few:?}");
    let plain = upload(&context, &weights, wgpu::BufferUsages::UNIFORM);
    let unbindable = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&plain, &sums]);
    assert!(matches!(unbindable, Err(Error::Device { .. })), "{unbindable:?}");
}

#[test]
fn what_does_not_compile_is_an_error_with_its_line() {
    let Some(search) = search() else { return };
    let line = |text: &str| 1 + KERNEL_SUM[..KERNEL_SUM.find(text).expect("there")].matches('\n').count();
    for (from, to) in [("* (*visitor).inverse", "* (*visitor).inverted"), ("(*visitor).sum;\n", "vec3(1.0)\n")] {
        match search.compile(&KERNEL_SUM.replace(from, to), &[Access::Read, Access::Write]) {
            Err(Error::Shader(message)) => {
                // The second is missed only where the next line begins.
                let lines = [line(from), line(from) + 1];
                assert!(lines.iter().any(|line| message.contains(&format!("wgsl:{line}:"))), "{lines:?}: {message}");
            }
            other => panic!("{:?}", other.map(drop)),
        }
    }
    // Right in itself, but not what was said about its buffers, and more buffers than there can be.
    for accesses in [vec![Access::Read], vec![Access::Read; 1 << 20]] {
        let result = search.compile(KERNEL_SUM, &accesses).map(drop);
        assert!(matches!(result, Err(Error::Shader(_))), "{result:?}");
    }
}

/// A device that this test has opened itself, with the limits that are asked for; its handler counts what reaches it.
fn own_device() -> Option<(wgpu::Device, wgpu::Queue, Arc<AtomicUsize>)> {
    context()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).ok()?;
    let descriptor = wgpu::DeviceDescriptor { required_limits: required_limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    let n_errors = Arc::new(AtomicUsize::new(0));
    let counter = Arc::clone(&n_errors);
    device.on_uncaptured_error(Arc::new(move |_| {
        counter.fetch_add(1, Ordering::Relaxed);
    }));
    Some((device, queue, n_errors))
}

#[test]
fn a_device_of_ones_own() {
    let Some((device, queue, n_errors)) = own_device() else { return };
    let context = Arc::new(Context::from_device(device.clone(), queue).expect("enough"));
    assert_eq!(context.info().name, device.adapter_info().name);
    let mut search = PointSearch::new(context.clone()).expect("kernels");
    let (points, exact) = (uniform(80, 1000), is_exact(&search));
    search.build(&points).expect("build");
    let (queries, radii) = queries(&points, 100);
    let found = search.neighbours_all(&queries, Radii::Each(&radii)).expect("search");
    assert_same_sets("own device", &points, &queries, Radii::Each(&radii), &found, exact);

    // Errors come back here, and only here.
    assert!(matches!(search.compile("fn begin(", &[]), Err(Error::Shader(_))));
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    let plain = upload(&context, &radii, wgpu::BufferUsages::UNIFORM);
    let unbindable = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&plain, &plain]);
    assert!(matches!(unbindable, Err(Error::Device { .. })), "{unbindable:?}");
    search.count_all(&queries, ALL).expect("it goes on");
    assert_eq!(n_errors.load(Ordering::Relaxed), 0);

    device.destroy();
    let lost = search.build(&points).and_then(|()| search.count_all(&queries, ALL));
    assert!(matches!(lost, Err(Error::Device { .. })), "{lost:?}");
}

#[test]
fn a_device_of_ones_own_with_too_little() {
    if context().is_none() {
        return;
    }
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("an adapter");
    let limits = wgpu::Limits { max_storage_buffers_per_shader_stage: 4, ..wgpu::Limits::downlevel_defaults() };
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    match Context::from_device(device, queue) {
        Err(Error::NoDevice(message)) => assert!(message.contains("4 storage buffers"), "{message}"),
        other => panic!("{:?}", other.map(drop)),
    }
}

/// A device of one's own whose limits are `change`d for the worse. It has no handler: what reaches it panics.
pub fn meagre_device(change: impl FnOnce(&mut wgpu::Limits)) -> Option<Arc<Context>> {
    context()?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default())).expect("an adapter");
    let mut required_limits = required_limits();
    change(&mut required_limits);
    let descriptor = wgpu::DeviceDescriptor { required_limits, ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).expect("a device");
    Some(Arc::new(Context::from_device(device, queue).expect("what is checked there is enough")))
}

/// Not even the small things that every search has can be made.
#[test]
fn what_a_device_of_ones_own_refuses_is_an_error() {
    let no_buffers = |limits: &mut wgpu::Limits| limits.max_buffer_size = 4096;
    let no_uniforms = |limits: &mut wgpu::Limits| limits.max_uniform_buffer_binding_size = 64;
    let changes: [&dyn Fn(&mut wgpu::Limits); 2] = [&no_buffers, &no_uniforms];
    for change in changes {
        let Some(context) = meagre_device(change) else { return };
        let made = PointSearch::new(Arc::clone(&context)).map(drop);
        assert!(matches!(made, Err(Error::Device { .. })), "{made:?}");
        let data = upload(&context, &[1.0f32; 4], wgpu::BufferUsages::STORAGE);
        let read = context.download::<f32>(&data, 0, 4);
        assert!(matches!(read, Err(Error::Device { .. })), "{read:?}");
    }
}

/// Steps of a node's child along an axis: low and high.
fn steps(node: &TreeNode, axis: usize, child: usize) -> [f32; 2] {
    let words = [node.x, node.y, node.z][axis];
    [0, 2].map(|first| (words[first + child / 4] >> (8 * (child % 4)) & 255) as f32)
}

/// What a node says of its children's boxes holds, and is little more than they are.
#[test]
fn nodes_hold_their_children_closely() {
    let Some(mut search) = search() else { return };
    let mut n_children = 0;
    for (name, points) in clouds() {
        search.build(&points).expect("build");
        let (boxes, nodes) = (search.boxes().expect("boxes"), search.nodes().expect("nodes"));
        // First box of the level below, of the level, and the number of boxes of each.
        let (mut below, mut n_below) = (0, points.len().div_ceil(8));
        let mut nodes = nodes.iter();
        while n_below > 1 {
            let n = n_below.div_ceil(FANOUT as usize);
            for k in 0..n {
                let (node, parent) = (nodes.next().expect("a node for each box"), &boxes[below + n_below + k]);
                let children = &boxes[below + 8 * k..below + n_below.min(8 * k + 8)];
                assert_eq!((node.exponents >> 24) as usize, children.len(), "{name}");
                for (axis, (i, child)) in (0..3).flat_map(|axis| children.iter().enumerate().map(move |c| (axis, c))) {
                    let scale = f32::from_bits((node.exponents >> (8 * axis) & 255) << 23);
                    let [low, high] = steps(node, axis, i).map(|steps| node.origin[axis] + steps * scale);
                    assert!(low <= child.min[axis] && child.max[axis] <= high, "{name}, node {k}, child {i}");
                    let extent = f64::from(parent.max[axis]) - f64::from(parent.min[axis]);
                    // Beside that a rounding of the coordinate, and the least step there is.
                    let rounding = f64::from(parent.max[axis].abs().max(parent.min[axis].abs()) * f32::EPSILON);
                    let most = extent / 127.0 + 2.0 * rounding + f64::from(f32::MIN_POSITIVE);
                    let looseness = [child.min[axis] - low, high - child.max[axis]].map(f64::from);
                    assert!(looseness.iter().all(|l| *l <= most), "{name}: {looseness:?}, at most {most}");
                    n_children += 1;
                }
            }
            (below, n_below) = (below + n_below, n);
        }
        assert!(nodes.next().is_none(), "{name}: more nodes than boxes above the leaves");
    }
    assert!(n_children > 10_000, "{n_children}");
}

/// Not in the normal run for its memory and time: `cargo test --release --test it gpu_search::large -- --ignored`.
#[test]
#[ignore = "some GB and a minute"]
fn large_sets() {
    let n = 16_000_000;
    let queries = uniform(91, 2000);
    let points = uniform(90, n);
    let expected = BruteForce(&points).count_all(&queries[..20], Radii::One(0.01)).unwrap();
    let tree = PointBvh::new(&points).unwrap();
    let counts = tree.count_all(&queries, Radii::One(0.01)).unwrap();
    assert_eq!(counts[..20], expected);
    drop(tree);

    let Some(mut search) = search() else { return };
    let most = search.max_points().min(n) as usize;
    search.build(&points[..most]).expect("what one binding holds");
    let tree = PointBvh::new(&points[..most]).unwrap();
    let expected = tree.count_all(&queries, Radii::One(0.01)).unwrap();
    let counts = search.count_all(&queries, Radii::One(0.01)).expect("search");
    let n_differences = counts.iter().zip(&expected).filter(|(a, b)| a != b).count();
    println!("{most} points on {}: {n_differences} of 2000 counts differ", search.context().info());
    assert!(n_differences == 0 || (!is_exact(&search) && n_differences < 10));
    if most < n as usize {
        match search.build(&points[..most + 1]) {
            Err(Error::TooLarge { what, needed, .. }) => {
                assert_eq!((what.as_str(), needed), ("points in tree order", 16 * (most as u64 + 1)));
            }
            other => panic!("{other:?}"),
        }
    }
}

/// Not a test: `cargo test --release --test it gpu_search::speed -- --ignored --nocapture`.
#[test]
#[ignore = "prints times"]
fn speed() {
    let Some(mut search) = search() else { return };
    println!("{}", search.context().info());
    let points = uniform(92, 200_000);
    search.build(&points).expect("build");
    let side = 24;
    let ordered: Vec<Vec3> = (0..side * side * side)
        .map(|i| Vec3::new((i % side) as f32, (i / side % side) as f32, (i / side / side) as f32) / 12.0 - 1.0)
        .collect();
    let shuffled = uniform(93, side * side * side);
    // About 6.5 and 52 neighbours each.
    for (order, queries) in [("in order", &ordered), ("shuffled", &shuffled)] {
        for sort in [false, true, false, true] {
            search.set_sort_queries(sort);
            for radius in [0.04, 0.08] {
                search.neighbours_all(queries, Radii::One(radius)).expect("search");
                let times = search.times().expect("times");
                println!("{order}, sorted first: {sort}, radius {radius}: {times:?}");
            }
            for (k, radius) in [(1, f32::INFINITY), (8, 0.08), (8, f32::INFINITY), (64, f32::INFINITY)] {
                search.nearest_all(queries, Radii::One(radius), k).expect("search");
                let seconds = search.times().expect("times").search;
                println!("{order}, sorted first: {sort}, {k} within {radius}: {seconds} s");
            }
        }
    }
}
