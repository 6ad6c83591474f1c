//! Larger and timed: not in the normal run.

use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::index::{BruteForce, PointBvh, Radii, RadiusSearch};

use super::{is_exact, search, uniform};

/// Not in the normal run for its memory and time: `cargo test --release --test it gpu_search::measured::large -- --ignored`.
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

/// Not a test: `cargo test --release --test it gpu_search::measured::speed -- --ignored --nocapture`.
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
