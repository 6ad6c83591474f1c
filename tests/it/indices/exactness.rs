//! Ten million queries of each index against testing every point.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glam::Vec3;
use sunfleck::index::{BruteForce, Neighbour, Radii, RadiusSearch};

use super::clouds::{PLACES, SHAPES, cloud, queries};
use super::{bits, for_every_index, nearest_of};

/// Queries of a cloud.
const BATCH: u32 = 2000;

/// Of one index: radius queries, neighbours found, k-NN queries, and differences of either.
type Tally = BTreeMap<String, [u64; 4]>;

struct Case<'a> {
    what: String,
    queries: &'a [Vec3],
    radii: &'a [f32],
    expected: &'a [Vec<(u32, u32)>],
    nearest: &'a [Vec<(u32, u32)>],
    k: usize,
    tally: &'a RefCell<Tally>,
}

fn check(name: &str, index: &impl RadiusSearch, case: &Case) {
    let rows = index.neighbours_all(case.queries, Radii::Each(case.radii)).unwrap();
    let lists = index.nearest_all(case.queries, Radii::Each(case.radii), case.k).unwrap();
    let mut counts = [0; 4];
    for (q, expected) in case.expected.iter().enumerate() {
        let row = bits(rows.row(q));
        let nearest: Vec<(u32, u32)> = (q * case.k..)
            .take(lists.found[q] as usize)
            .map(|at| (lists.indices[at], lists.distances2[at].to_bits()))
            .collect();
        let differs = row != *expected || nearest != case.nearest[q];
        if differs {
            println!("{name}, {}: {} around {}", case.what, case.radii[q], case.queries[q]);
        }
        counts[0] += 1;
        counts[1] += row.len() as u64;
        counts[2] += 1;
        counts[3] += u64::from(differs);
    }
    let mut tally = case.tally.borrow_mut();
    let sums = tally.entry(name.to_string()).or_default();
    (0..4).for_each(|i| sums[i] += counts[i]);
}

fn run(n_queries: u64) -> Tally {
    let tally = RefCell::new(Tally::new());
    let mut seed = 0;
    let (mut asked, mut round) = (0, 0);
    while asked < n_queries {
        for (shape, name) in SHAPES.into_iter().enumerate() {
            for place in PLACES {
                let n = [24, 10, 48, 96, 17, 33, 65, 500][round % 8];
                let built = place.0.abs() * [0.3, 0.05, 1.0, 0.0, f32::INFINITY, 4.0][(round + seed as usize) % 6];
                let points = cloud(shape, seed, n, place);
                let (queries, radii) = queries(&points, seed + 1, BATCH, place.0, built);
                let all = BruteForce(&points);
                let row = |(&centre, &radius): (&Vec3, &f32)| {
                    let mut row = Vec::new();
                    all.within(centre, radius, |index, distance2| row.push(Neighbour { index, distance2 }));
                    bits(row.into_iter())
                };
                let expected: Vec<_> = queries.iter().zip(&radii).map(row).collect();
                let k = 1 + seed as usize * 7 % 64;
                let nearest: Vec<_> = expected.iter().map(|row| nearest_of(row, k)).collect();
                let case = Case {
                    what: format!("seed {seed}, {name} × {} + {}", place.0, place.1),
                    queries: &queries,
                    radii: &radii,
                    expected: &expected,
                    nearest: &nearest,
                    k,
                    tally: &tally,
                };
                for_every_index!(&points, built, check, &case);
                asked += u64::from(BATCH);
                seed += 1;
            }
        }
        round += 1;
    }
    tally.into_inner()
}

/// `cargo test --release --test it -- --ignored exactness_ten_million --nocapture`
#[test]
#[ignore = "a minute or more, in release"]
fn exactness_ten_million() {
    let tally = run(10_000_000);
    println!("{:24} {:>12} {:>14} {:>12} {:>12}", "index", "queries", "neighbours", "k-NN", "differences");
    for (name, [queries, found, knn, differences]) in &tally {
        println!("{name:24} {queries:12} {found:14} {knn:12} {differences:12}");
    }
    assert!(tally.values().all(|t| t[0] >= 10_000_000 && t[1] > t[0] && t[3] == 0));
}
