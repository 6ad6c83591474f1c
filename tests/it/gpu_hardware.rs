//! Search by ray queries, against the oracle on the CPU and the tree on the same device.

use std::sync::{Arc, OnceLock};

use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::gpu::{Access, Choice, Context, PointSearch, QueryRadii};
use sunfleck::index::{self, BruteForce, Radii, RadiusSearch};
use sunfleck::math::rng;

use crate::gpu_search::{assert_same_sets, clouds, cube, is_exact, queries, uniform};

/// The device with ray queries that all tests share; `None` without an adapter that has them.
pub fn context() -> Option<Arc<Context>> {
    static CONTEXT: OnceLock<Option<Arc<Context>>> = OnceLock::new();
    let opened = CONTEXT.get_or_init(|| match Context::with_ray_queries(&Choice::Any) {
        Ok(context) => Some(Arc::new(context)),
        Err(error) => {
            let required = std::env::var_os("SUNFLECK_REQUIRE_RAY_QUERY").is_some();
            assert!(!required, "SUNFLECK_REQUIRE_RAY_QUERY is set, but: {error}");
            None
        }
    });
    if opened.is_none() {
        println!("skipped: no GPU adapter with ray queries");
    }
    opened.clone()
}

fn search(max_radius: f32) -> Option<PointSearch> {
    context().map(|context| PointSearch::hardware(context, max_radius).expect("kernels"))
}

/// Boxes just as wide as the largest radius, some queries having it, and points as far as it.
#[test]
fn boxes_are_wide_enough() {
    let Some(mut search) = search(0.0) else { return };
    let exact = is_exact(&search);
    let (mut n_found, mut n_differences) = (0, 0);
    for (name, points) in clouds() {
        let (queries, all_radii) = queries(&points, 150);
        let mut largest: Vec<f32> = all_radii.iter().copied().filter(|r| r.is_finite()).collect();
        largest.sort_unstable_by(f32::total_cmp);
        for built in [0.0, largest[largest.len() / 2], largest[largest.len() * 4 / 5], largest[largest.len() - 1]] {
            search.set_max_radius(built).expect("radius");
            search.build(&points).expect("build");
            assert_eq!(search.max_radius(), built);
            let radii: Vec<f32> = all_radii.iter().map(|r| r.min(built)).collect();
            let found = search.neighbours_all(&queries, Radii::Each(&radii)).expect("search");
            n_differences += assert_same_sets(name, &points, &queries, Radii::Each(&radii), &found, exact);
            n_found += found.indices.len();
        }
    }
    println!("{n_found} neighbours, {n_differences} found by one of both alone");
    assert!(n_found > 1_000_000);
}

#[test]
fn the_same_nearest() {
    let Some(mut search) = search(0.0) else { return };
    for (name, points) in clouds().into_iter().filter(|_| is_exact(&search)).collect::<Vec<_>>() {
        let (queries, mut radii) = queries(&points, 100);
        let largest = radii.iter().copied().filter(|r| r.is_finite()).fold(0.0, f32::max);
        radii.iter_mut().for_each(|r| *r = r.min(largest));
        search.set_max_radius(largest).expect("radius");
        search.build(&points).expect("build");
        for k in [1, 8, 64] {
            let found = search.nearest_all(&queries, Radii::Each(&radii), k).expect("search");
            let expected = BruteForce(&points).nearest_all(&queries, Radii::Each(&radii), k).unwrap();
            assert!(found == expected, "{name}: {k} nearest");
        }
    }
}

/// Memory is kept and grows, and nothing of what was there before is found.
#[test]
fn built_again_with_other_points() {
    let Some(mut search) = search(0.3) else { return };
    let exact = is_exact(&search);
    let queries = uniform(50, 200);
    for n in [10, 4000, 3, 0, 4100, 1, 4250, 9000, 100] {
        let points = uniform(n, n);
        search.build(&points).expect("build");
        let found = search.neighbours_all(&queries, Radii::One(0.3)).expect("search");
        assert_same_sets(&format!("{n} points"), &points, &queries, Radii::One(0.3), &found, exact);
    }
}

#[test]
fn radii_above_the_built_one_are_refused() {
    let Some(mut search) = search(0.25) else { return };
    let (points, queries) = (uniform(1, 100), uniform(2, 3));
    search.build(&points).expect("build");
    search.set_max_radius(0.5).expect("radius");
    assert_eq!(search.max_radius(), 0.25, "boxes are as they were built");
    let above = |result: Result<Vec<u32>, Error>| match result {
        Err(Error::Search(index::Error::RadiusAboveBuilt { query, built, .. })) => Some((query, built)),
        _ => None,
    };
    let radii = [0.1, 0.2, 0.25f32.next_up()];
    assert_eq!(above(search.count_all(&queries, Radii::Each(&radii))), Some((2, 0.25)));
    assert_eq!(above(search.count_all(&queries, Radii::One(f32::INFINITY))), Some((0, 0.25)));
    let on_device = search.count_on_device((&queries[..]).into(), QueryRadii::Host(Radii::One(0.3)));
    assert_eq!(above(on_device.and_then(|counts| counts.download())), Some((0, 0.25)));
    assert!(search.nearest_all(&queries, Radii::One(0.3), 1).is_err());
    search.build(&points).expect("build");
    search.count_all(&queries, Radii::One(0.5)).expect("built for it now");
    for wrong in [-1.0, f32::NAN] {
        assert!(search.set_max_radius(wrong).is_err());
    }
}

/// Half a million points on the walls of a box, by both methods: counts, and in one number whose neighbour each is.
#[test]
fn half_a_million_points() {
    let Some(mut rays) = search(0.01) else { return };
    let mut tree = PointSearch::new(Arc::clone(rays.context())).expect("kernels");
    let wall = |seed: u32, i: u32| {
        let [x, y, z, t] = rng::unit4(rng::pcg4d([i, seed, 3, 4]));
        [Vec3::new(x, y, 0.0), Vec3::new(x, 0.0, z), Vec3::new(0.0, y, z)][(t * 3.0) as usize]
    };
    let points: Vec<Vec3> = (0..500_000).map(|i| wall(60, i)).collect();
    let queries: Vec<Vec3> = (0..8192).map(|i| wall(61, i) + cube(62, i) * 0.002).collect();
    let radii: Vec<f32> = (0..8192).map(|i| 0.01 * rng::unit(rng::pcg4d([i, 63, 3, 4])[0])).collect();
    let mut found = Vec::new();
    for search in [&mut rays, &mut tree] {
        search.build(&points).expect("build");
        let rows = search.neighbours_all(&queries, Radii::Each(&radii)).expect("search");
        let ids = |q: usize| rows.row(q).map(|n| u64::from(n.index)).collect::<Vec<_>>();
        found.push(
            (0..queries.len())
                .map(ids)
                .map(|mut row| {
                    row.sort_unstable();
                    row
                })
                .collect::<Vec<_>>(),
        );
    }
    let n: usize = found[0].iter().map(Vec::len).sum();
    assert!(n > 10 * queries.len(), "{n} neighbours");
    assert!(found[0] == found[1]);
}

/// A visitor is the same text for both.
#[test]
fn visitors_run_on_ray_queries() {
    let Some(mut search) = search(0.2) else { return };
    let points = uniform(70, 3000);
    let queries = uniform(71, 300);
    search.build(&points).expect("build");
    let sum = "@group(0) @binding(4) var<storage, read_write> sums: array<u32>;
        struct Visitor { radius2: f32, sum: u32 }
        fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor { return Visitor(radius2, 0u); }
        fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
            (*visitor).sum += index_of(slot) + 1u;
        }
        fn end(visitor: ptr<function, Visitor>, query: u32) { sums[query] = (*visitor).sum; }";
    let visitor = search.compile(sum, &[Access::Write]).expect("compiles");
    let sums = search.count_on_device((&queries[..]).into(), Radii::One(0.2).into()).expect("room for the sums");
    search.visit_all(&visitor, (&queries[..]).into(), Radii::One(0.2).into(), &[sums.buffer()]).expect("visited");
    let brute = BruteForce(&points);
    let expected: Vec<u32> = brute.fold_all(&queries, Radii::One(0.2), |_| 0, |sum, i, _| *sum += i + 1).unwrap();
    if is_exact(&search) {
        assert_eq!(sums.download().expect("download"), expected);
    }
}
