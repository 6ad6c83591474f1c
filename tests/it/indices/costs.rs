//! The cost models, and what queries visit.

use glam::Vec3;
use sunfleck::index::stats::{Costs, CountVisits, CountedPointBvh, Hierarchy, Node, Weights};
use sunfleck::index::{BruteForce, HashGrid, PointBvh, PointKd, QueryOrder, RadiusSearch};

use super::clouds::{cloud, cube};
use super::{Boxes, LBVH, PLOC, grid, sample_bvh};

struct Nodes(Vec<Node>);

impl Hierarchy for Nodes {
    fn for_each_node(&self, visit: impl FnMut(Node)) {
        self.0.iter().copied().for_each(visit);
    }
}

/// Eqs. 3 and 4 by hand: a box of 1 × 2 × 4 with a leaf of five points that is half of it, and one of a point.
#[test]
fn costs_of_three_nodes() {
    let node = |max: [f32; 3], leaf| Node { min: Vec3::ZERO, max: Vec3::from(max), leaf };
    let tree = Nodes(vec![node([1.0, 2.0, 4.0], None), node([1.0, 2.0, 2.0], Some(5)), node([0.0, 0.0, 0.0], Some(1))]);
    let weights = Weights { inner: 3.0, leaf: 0.5, point: 2.0 };
    // Half areas 14, 8, 0; volumes 8, 4, 0.
    let costs = Costs::of(&tree, 0.0, weights);
    assert!((costs.sah - (3.0 + 10.5 * 8.0 / 14.0)).abs() < 1e-12, "{costs:?}");
    assert!((costs.vh - (3.0 + 10.5 * 0.5)).abs() < 1e-12, "{costs:?}");
    assert_eq!((costs.n_inner, costs.n_leaves), (1, 2));
    // Grown by 1/2: half areas 31, 21, 3; volumes 30, 18, 1.
    let costs = Costs::of(&tree, 0.5, weights);
    assert!((costs.sah - (3.0 + (10.5 * 21.0 + 2.5 * 3.0) / 31.0)).abs() < 1e-12, "{costs:?}");
    assert!((costs.vh - (3.0 + (10.5 * 18.0 + 2.5) / 30.0)).abs() < 1e-12, "{costs:?}");
}

fn check_bound(what: &str, tree: &impl Hierarchy, n: usize, radius: f32) -> Costs {
    let mut leaves = 0;
    let mut boxes = Vec::new();
    tree.for_each_node(|node| {
        leaves += node.leaf.unwrap_or(0);
        boxes.push((node.min, node.max));
    });
    assert_eq!(leaves, n, "{what}: points in leaves");
    assert!(
        boxes.iter().all(|b| b.0.cmpge(boxes[0].0).all() && b.1.cmple(boxes[0].1).all()),
        "{what}: not in the root"
    );
    for weights in [Weights::default(), Weights { inner: 1.2, leaf: 0.0, point: 3.0 }] {
        let costs = Costs::of(tree, radius, weights);
        assert!(costs.sah >= costs.vh && costs.vh > 0.0, "{what}: {costs:?}");
    }
    Costs::of(tree, radius, Weights::default())
}

/// The proof in the paper's appendix: the surface area heuristic bounds the volume heuristic, for every tree.
#[test]
fn the_surface_area_bounds_the_volume() {
    for shape in [0, 1, 3, 7, 8, 10] {
        let points = cloud(shape, 1, 3000, (1.0, 0.0));
        let n = points.len();
        for radius in [1e-3, 0.05, 0.5] {
            check_bound("point BVH", &PointBvh::new(&points).unwrap(), n, radius);
            check_bound("kd-tree", &PointKd::new(&points).unwrap(), n, radius);
            for builder in [LBVH, PLOC] {
                let tight = check_bound("tight", &sample_bvh(&points, builder, Boxes::Tight, 1), n, radius);
                let inflated = sample_bvh(&points, builder, Boxes::Inflated(radius), 1);
                let inflated = check_bound("inflated", &inflated, n, 0.0);
                assert_eq!((tight.n_leaves, tight.n_inner), (n, n - 1));
                assert_eq!((inflated.n_leaves, inflated.n_inner), (n, n - 1));
            }
        }
    }
}

/// The volume heuristic is what queries uniform in the root box cost: nodes entered and points tested, on average.
#[test]
fn the_volume_heuristic_is_the_mean_of_uniform_queries() {
    let points = cloud(1, 8, 2000, (1.0, 0.0));
    let radius = 0.1;
    for (builder, leaf_size) in [(LBVH, 1), (PLOC, 4)] {
        let tree = sample_bvh(&points, builder, Boxes::Inflated(radius), leaf_size);
        let costs = Costs::of(&tree, 0.0, Weights { inner: 1.0, leaf: 1.0, point: 1.0 });
        let mut root = None;
        tree.for_each_node(|node| {
            root.get_or_insert(node);
        });
        let Node { min, max, .. } = root.unwrap();
        let n = 40_000;
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in 0..n {
            let visits = tree.visits(min + (cube(11, i) * 0.5 + 0.5) * (max - min), radius);
            let cost = (visits.nodes + visits.points) as f64;
            sum += cost;
            squares += cost * cost;
        }
        let mean = sum / f64::from(n);
        let error = ((squares / f64::from(n) - mean * mean) / f64::from(n)).sqrt();
        assert!((mean - costs.vh).abs() < 4.0 * error, "{mean} ± {error}, {costs:?}");
        assert!(error < 0.02 * mean && costs.vh < costs.sah);
    }
}

/// Counting changes no answer, every index tests at least what it finds, and fewer points than there are.
#[test]
fn visits() {
    let points = cloud(0, 4, 4000, (1.0, 0.0));
    let queries: Vec<Vec3> = (0..200).map(|i| cube(5, i)).collect();
    let radius = 0.1;
    let all = BruteForce(&points).visits_of(&queries, radius);
    assert_eq!(all.points, 200 * 4000);
    fn check(name: &str, index: &impl CountVisits, queries: &[Vec3], radius: f32) {
        for &q in queries {
            let visits = index.visits(q, radius);
            assert_eq!(visits.found, index.count(q, radius) as u64, "{name}");
            assert!(visits.found <= visits.points, "{name}: {visits:?}");
        }
        let sum = index.visits_of(queries, radius);
        assert!(sum.found > 300 && sum.points < 200 * 500 && sum.nodes > 200, "{name}: {sum:?}");
    }
    check("grid", &grid(&points, radius, QueryOrder::Auto), &queries, radius);
    check("kd-tree", &PointKd::new(&points).unwrap(), &queries, radius);
    for builder in [LBVH, PLOC] {
        check("tight", &sample_bvh(&points, builder, Boxes::Tight, 1), &queries, radius);
        check("inflated", &sample_bvh(&points, builder, Boxes::Inflated(radius), 1), &queries, radius);
    }
    let tree = PointBvh::new(&points).unwrap();
    let counted = CountedPointBvh::new(&tree);
    for &q in &queries {
        let visits = counted.visits(q, radius);
        assert_eq!(visits.found, tree.count(q, radius) as u64);
        assert!(visits.found <= visits.points && visits.points <= 8 * visits.nodes && visits.boxes >= visits.nodes - 1);
    }
    // Of one cell, everything is tested; of none, nothing.
    assert_eq!(HashGrid::new(&points, 10.0).unwrap().visits(Vec3::ZERO, 10.0).points, 4000);
    assert_eq!(HashGrid::new(&[], 10.0).unwrap().visits(Vec3::ZERO, 10.0), Default::default());
}
