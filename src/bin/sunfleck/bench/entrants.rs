//! Which indices take part, and under which names.

use std::ops::ControlFlow;

use anyhow::{Result, bail};
use glam::Vec3;
use rayon::prelude::*;
use sunfleck::index::stats::{Costs, CountVisits, CountedPointBvh, Weights};
use sunfleck::index::{
    Boxes, BruteForce, Buffers, Builder, HashGrid, KdBuffered, Nearest, PointBvh, PointKd, PointOrder, QueryOrder,
    Radii, RadiusSearch, SampleBvh, SampleOptions, queries_as_boxes,
};

use super::contest::{self, Anatomy, Answer, Entrant, Of, Operation, Question, Visited};
use super::sorted::Sorted;

/// The library's default.
pub const DEFAULT: &str = "bvh8";
/// The paper's method: a binary tree over boxes as wide as the radius, one sample a leaf.
pub const METHOD: &str = "bvh2-inflated";
/// The paper's rival: a kd-tree that fills buffers.
pub const RIVAL: &str = "kd-buffered";

/// The better of the two builders; the reach is the one that Meister & Bittner 2018 recommend.
const PLOC: Builder = Builder::Ploc { reach: 14 };

/// A kd-tree searched in place.
pub const KD: &str = "kd";

/// Products of points and queries above which brute force is left out.
const MOST_BRUTE: usize = 2_000_000_000;
/// Neighbours above which queries are not stored as boxes: all would be in memory at once.
const MOST_LISTED: usize = 1 << 27;

type Boxed<'a> = Box<dyn Entrant + 'a>;

/// Those of Figures 3 to 6.
pub fn radius_search(points: &[Vec3]) -> Vec<Boxed<'_>> {
    vec![
        default(points),
        samples(METHOD, points, PLOC, true, 1),
        rival(points),
        kd(points),
        grid("grid", points, QueryOrder::Auto),
    ]
}

/// Those of Figure 7.
pub fn nearest(points: &[Vec3]) -> Vec<Boxed<'_>> {
    vec![
        default(points),
        median(points),
        samples(METHOD, points, PLOC, true, 1),
        kd(points),
        grid("grid", points, QueryOrder::Auto),
    ]
}

/// All, and every build option, for so many neighbours of so many queries.
pub fn ablations<'a>(points: &'a [Vec3], question: &Question<'_>) -> Vec<Boxed<'a>> {
    let mut all = vec![
        default(points),
        median(points),
        Box::new(Of::new("bvh8, one by one", |_| Ok(OneByOne(PointBvh::new(points)?)))),
        samples("bvh2-inflated, LBVH", points, Builder::Lbvh, true, 1),
        samples(METHOD, points, PLOC, true, 1),
        samples("bvh2-inflated, leaves of 8", points, PLOC, true, 8),
        samples("bvh2-tight, LBVH", points, Builder::Lbvh, false, 1),
        samples("bvh2-tight", points, PLOC, false, 1),
        samples("bvh2-tight, leaves of 8", points, PLOC, false, 8),
        kd(points),
        grid("grid", points, QueryOrder::AsGiven),
    ];
    // Sorting and buffers are forms of the sum: their k-NN is that of the index alone.
    if question.operation == Operation::Sum {
        all.push(sorted_samples("bvh2-tight, leaves of 8, sorted", points));
        all.push(Box::new(Of::new("kd, sorted", |_| Ok(Sorted(PointKd::new(points)?)))));
        all.push(rival(points));
        all.push(grid("grid, sorted", points, QueryOrder::Sorted));
    }
    if question.operation == Operation::Sum && question.total < MOST_LISTED as u64 {
        all.push(Box::new(QueriesAsBoxes { points }));
    }
    if points.len() * question.queries.len() <= MOST_BRUTE {
        all.push(Box::new(Of::new("brute", |_| Ok(BruteForce(points))).described(visits)));
    }
    all
}

/// [`DEFAULT`].
fn default(points: &[Vec3]) -> Boxed<'_> {
    point_bvh(DEFAULT, points, PointOrder::Morton)
}

/// The default's form over points in the order of a kd-tree.
fn median(points: &[Vec3]) -> Boxed<'_> {
    point_bvh("bvh8, median", points, PointOrder::Median)
}

fn point_bvh<'a>(name: &'static str, points: &'a [Vec3], order: PointOrder) -> Boxed<'a> {
    let describe = |tree: &PointBvh, queries: &[Vec3], radius: f32| {
        let counted = CountedPointBvh::new(tree);
        Anatomy {
            visits: Some(Visited::mean(queries.iter().map(|&q| counted.visits(q, radius)))),
            costs: Some(Costs::of(tree, radius, Weights::default())),
        }
    };
    Box::new(Of::new(name, move |_| PointBvh::with_order(points, order)).described(describe))
}

/// [`RIVAL`].
fn rival(points: &[Vec3]) -> Boxed<'_> {
    Box::new(Buffered { points, tree: None, buffers: Buffers::default() })
}

/// [`KD`].
fn kd(points: &[Vec3]) -> Boxed<'_> {
    let describe = |tree: &PointKd, queries: &[Vec3], radius: f32| Anatomy {
        costs: Some(Costs::of(tree, radius, Weights::default())),
        ..visits(tree, queries, radius)
    };
    Box::new(Of::new(KD, |_| PointKd::new(points)).described(describe))
}

fn grid<'a>(name: &'static str, points: &'a [Vec3], query_order: QueryOrder) -> Boxed<'a> {
    let build = move |radius| {
        let mut grid = HashGrid::new(points, radius)?;
        grid.query_order = query_order;
        Ok(grid)
    };
    Box::new(Of::new(name, build).described(visits))
}

/// A binary tree over the samples' boxes.
fn samples<'a>(
    name: &'static str,
    points: &'a [Vec3],
    builder: Builder,
    inflated: bool,
    leaf_size: usize,
) -> Boxed<'a> {
    let describe = |tree: &SampleBvh, queries: &[Vec3], radius: f32| {
        // Inflated boxes have grown already.
        let grow = if tree.max_radius().is_finite() { 0.0 } else { radius };
        Anatomy { costs: Some(Costs::of(tree, grow, Weights::default())), ..visits(tree, queries, radius) }
    };
    let build = move |radius| {
        let boxes = if inflated { Boxes::Inflated(radius) } else { Boxes::Tight };
        SampleBvh::new(points, SampleOptions { builder, boxes, leaf_size })
    };
    Box::new(Of::new(name, build).described(describe))
}

fn sorted_samples<'a>(name: &'static str, points: &'a [Vec3]) -> Boxed<'a> {
    let options = SampleOptions { builder: PLOC, boxes: Boxes::Tight, leaf_size: 8 };
    Box::new(Of::new(name, move |_| Ok(Sorted(SampleBvh::new(points, options)?))))
}

fn visits<I: CountVisits>(index: &I, queries: &[Vec3], radius: f32) -> Anatomy {
    Anatomy { visits: Some(Visited::mean(queries.iter().map(|&q| index.visits(q, radius)))), costs: None }
}

/// The default's tree without what it does for batches.
struct OneByOne(PointBvh);

impl RadiusSearch for OneByOne {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.0.try_within(centre, radius, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        self.0.nearest(centre, radius, nearest);
    }
}

/// The alternative that the paper rejects: there is nothing to build before the queries are known.
struct QueriesAsBoxes<'a> {
    points: &'a [Vec3],
}

impl Entrant for QueriesAsBoxes<'_> {
    fn name(&self) -> &'static str {
        "queries as boxes"
    }

    fn build(&mut self, _radius: f32, _most: usize) -> Result<()> {
        Ok(())
    }

    fn ask(&mut self, question: &Question<'_>) -> Result<Answer> {
        let radii = Radii::One(question.radius);
        let lists = queries_as_boxes(self.points, question.queries, radii, Builder::Lbvh, 1)?;
        let inverse = 1.0 / (question.radius * question.radius);
        let sum = lists.distances2.par_iter().map(|d2| f64::from(1.0 - d2 * inverse)).sum();
        Ok(Answer { neighbours: lists.indices.len() as u64, sum })
    }

    fn forget(&mut self) {}
}

/// A kd-tree that fills two matrices, as FLANN does: indices and distances, a row each query.
struct Buffered<'a> {
    points: &'a [Vec3],
    tree: Option<KdBuffered>,
    /// Kept from round to round: a program that asks again and again would.
    buffers: Buffers,
}

impl Entrant for Buffered<'_> {
    fn name(&self) -> &'static str {
        RIVAL
    }

    fn build(&mut self, _radius: f32, most: usize) -> Result<()> {
        self.tree = Some(KdBuffered::new(self.points, most)?);
        Ok(())
    }

    fn ask(&mut self, question: &Question<'_>) -> Result<Answer> {
        let Some(tree) = &self.tree else { bail!("{RIVAL} was asked before it was built") };
        if question.operation != Operation::Store {
            return contest::answer(tree, question);
        }
        let mut answer = Answer::default();
        let buffers = &mut self.buffers;
        for queries in question.batches() {
            tree.fill(queries, Radii::One(question.radius), buffers)?;
            buffers.check()?;
            answer.neighbours += buffers.found().iter().map(|&n| u64::from(n)).sum::<u64>();
        }
        Ok(answer)
    }

    fn forget(&mut self) {
        self.tree = None;
    }
}
