//! Indices side by side: the same points, the same questions, turn by turn, and every answer checked.

use anyhow::{Result, bail, ensure};
use glam::Vec3;
use rayon::prelude::*;
use sunfleck::index::stats::{Costs, Visits};
use sunfleck::index::{self, BruteForce, PointBvh, PointKd, Radii, RadiusSearch};

use super::measure::{Time, Times, timed};

/// Most bytes that one call may fill with neighbours; beyond, the queries are asked in several calls.
const MOST_STORED: usize = 512 << 20;
/// Bytes of a stored neighbour: index and squared distance.
const NEIGHBOUR: usize = 8;
/// Queries whose counts are compared with those of brute force.
const VERIFIED: usize = 32;

/// What is asked about each query.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Operation {
    /// The sum over the neighbours of 1 − (d/r)²: in place, nothing stored.
    Sum,
    /// All neighbours, stored with their squared distances.
    Store,
    /// The `k` nearest within the radius.
    Nearest(usize),
}

/// Many queries with one radius, and what is known of the answer.
#[derive(Clone, Debug)]
pub struct Question<'a> {
    pub queries: &'a [Vec3],
    pub radius: f32,
    pub operation: Operation,
    /// Neighbours of all queries; for k-NN the found ones.
    pub total: u64,
    /// Most neighbours of one query: the capacity that a buffer needs.
    pub most: usize,
    /// Queries a call.
    batch: usize,
}

impl<'a> Question<'a> {
    /// Finds the right answer with [`PointKd`], the counts of some queries checked by brute force.
    pub fn new(points: &[Vec3], queries: &'a [Vec3], radius: f32, operation: Operation) -> Result<Self> {
        let counts = PointKd::new(points)?.count_all(queries, Radii::One(radius))?;
        let step = (queries.len() / VERIFIED).max(1);
        let oracle = BruteForce(points);
        let wrong = (0..queries.len())
            .into_par_iter()
            .step_by(step)
            .find_any(|&q| oracle.count(queries[q], radius) != counts[q] as usize);
        if let Some(q) = wrong {
            bail!(
                "the reference is wrong: query {q} has {} neighbours by brute force",
                oracle.count(queries[q], radius)
            );
        }
        let most = counts.iter().copied().max().unwrap_or(0) as usize;
        let cap = match operation {
            Operation::Nearest(k) => k,
            Operation::Sum | Operation::Store => usize::MAX,
        };
        let total = counts.iter().map(|&n| cap.min(n as usize) as u64).sum();
        let batch = match operation {
            Operation::Store => (MOST_STORED / (NEIGHBOUR * most.max(1))).clamp(1, queries.len().max(1)),
            Operation::Sum | Operation::Nearest(_) => queries.len().max(1),
        };
        Ok(Self { queries, radius, operation, total, most, batch })
    }

    /// Neighbours a query, on average.
    pub fn mean(&self) -> f64 {
        self.total as f64 / self.queries.len().max(1) as f64
    }

    /// The queries of each call.
    pub fn batches(&self) -> impl Iterator<Item = &'a [Vec3]> {
        self.queries.chunks(self.batch)
    }
}

/// The radius at which the queries find `wanted` points on average, to 1 %; found with some of the queries.
pub fn radius_for(points: &[Vec3], queries: &[Vec3], wanted: f64) -> Result<f32> {
    const ASKED: usize = 20_000;
    let some: Vec<Vec3> = queries.iter().copied().step_by(queries.len().div_ceil(ASKED).max(1)).collect();
    let tree = PointBvh::new(points)?;
    let mean = |radius: f32| -> Result<f64> {
        let counts = tree.count_all(&some, Radii::One(radius))?;
        Ok(counts.iter().map(|&n| f64::from(n)).sum::<f64>() / some.len().max(1) as f64)
    };
    let first = points.first().copied().unwrap_or_default();
    let extent = points.iter().fold(Vec3::ZERO, |most, p| most.max((*p - first).abs())).max_element();
    ensure!(extent > 0.0 && !some.is_empty(), "no radius finds {wanted} of {} points", points.len());
    // From below: large radii take long to ask for.
    let (mut low, mut high) = (0.0, extent * 1e-4);
    while mean(high)? < wanted {
        (low, high) = (high, 1.5 * high);
        ensure!(high < 4.0 * extent, "no radius finds {wanted} of {} points", points.len());
    }
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        let found = mean(middle)?;
        if (found / wanted - 1.0).abs() < 0.01 {
            return Ok(middle);
        }
        (low, high) = if found < wanted { (middle, high) } else { (low, middle) };
    }
    Ok(high)
}

/// What an index found.
#[derive(Clone, Copy, Debug, Default)]
pub struct Answer {
    /// Neighbours of all queries.
    pub neighbours: u64,
    /// [`Operation::Sum`]: over all queries. [`Operation::Nearest`]: of the squared distances.
    pub sum: f64,
}

/// An index that takes part, over points it was given before.
pub trait Entrant {
    fn name(&self) -> &'static str;
    /// Makes it ready for questions with `radius`, none of which has a query with more than `most` neighbours.
    fn build(&mut self, radius: f32, most: usize) -> Result<()>;
    fn ask(&mut self, question: &Question<'_>) -> Result<Answer>;
    /// Seconds of the last build and of the last question by the clock of the device that did them, if it is not the CPU.
    fn device_seconds(&mut self) -> Result<Option<[f64; 2]>> {
        Ok(None)
    }
    /// Whether its neighbours are those of the CPU to the last one.
    fn is_exact(&self) -> bool {
        true
    }
    /// What does not depend on the machine, told after building; nothing where the index does not tell.
    fn anatomy(&self, _queries: &[Vec3], _radius: f32) -> Anatomy {
        Anatomy::default()
    }
    /// Frees what was built.
    fn forget(&mut self);
}

/// The cost of a search told without a clock.
#[derive(Clone, Copy, Debug, Default)]
pub struct Anatomy {
    /// Means over queries.
    pub visits: Option<Visited>,
    pub costs: Option<Costs>,
}

/// What one query visits, on average.
#[derive(Clone, Copy, Debug)]
pub struct Visited {
    pub nodes: f64,
    pub boxes: f64,
    pub points: f64,
}

impl Visited {
    /// Of what each query visits.
    pub fn mean(all: impl ExactSizeIterator<Item = Visits>) -> Self {
        let n = all.len().max(1) as f64;
        let sum = all.fold(Visits::default(), |mut sum, visits| {
            sum += visits;
            sum
        });
        Self { nodes: sum.nodes as f64 / n, boxes: sum.boxes as f64 / n, points: sum.points as f64 / n }
    }
}

/// Anything that implements the trait, and how to make it for a radius.
pub struct Of<I, B> {
    name: &'static str,
    build: B,
    index: Option<I>,
    describe: fn(&I, &[Vec3], f32) -> Anatomy,
}

impl<I, B> Of<I, B>
where
    I: RadiusSearch,
    B: Fn(f32) -> Result<I, index::Error>,
{
    pub fn new(name: &'static str, build: B) -> Self {
        Self { name, build, index: None, describe: |_, _, _| Anatomy::default() }
    }

    /// With what tells its anatomy.
    pub fn described(self, describe: fn(&I, &[Vec3], f32) -> Anatomy) -> Self {
        Self { describe, ..self }
    }
}

impl<I, B> Entrant for Of<I, B>
where
    I: RadiusSearch,
    B: Fn(f32) -> Result<I, index::Error>,
{
    fn name(&self) -> &'static str {
        self.name
    }

    fn build(&mut self, radius: f32, _most: usize) -> Result<()> {
        self.index = Some((self.build)(radius)?);
        Ok(())
    }

    fn ask(&mut self, question: &Question<'_>) -> Result<Answer> {
        let Some(index) = &self.index else { bail!("{} was asked before it was built", self.name) };
        answer(index, question)
    }

    fn anatomy(&self, queries: &[Vec3], radius: f32) -> Anatomy {
        self.index.as_ref().map_or(Anatomy::default(), |index| (self.describe)(index, queries, radius))
    }

    fn forget(&mut self) {
        self.index = None;
    }
}

/// What an index says, in as many calls as the question has.
pub fn answer(index: &impl RadiusSearch, question: &Question<'_>) -> Result<Answer> {
    let radii = Radii::One(question.radius);
    let mut answer = Answer::default();
    for queries in question.batches() {
        match question.operation {
            Operation::Sum => {
                let inverse = 1.0 / (question.radius * question.radius);
                let add = |state: &mut (u32, f32), _, d2: f32| *state = (state.0 + 1, state.1 + 1.0 - d2 * inverse);
                for (n, sum) in index.fold_all(queries, radii, |_| (0, 0.0), add)? {
                    answer.neighbours += u64::from(n);
                    answer.sum += f64::from(sum);
                }
            }
            Operation::Store => answer.neighbours += index.neighbours_all(queries, radii)?.indices.len() as u64,
            Operation::Nearest(k) => {
                let lists = index.nearest_all(queries, radii, k)?;
                answer.neighbours += lists.found.iter().map(|&n| u64::from(n)).sum::<u64>();
                answer.sum += lists.distances2.iter().filter(|d| d.is_finite()).map(|&d| f64::from(d)).sum::<f64>();
            }
        }
    }
    Ok(answer)
}

/// What a run found of one entrant.
#[derive(Clone, Debug, Default)]
pub struct Score {
    pub build: Times,
    /// Of each question.
    pub search: Vec<Times>,
}

/// Lets all entrants build and answer, in turns, `rounds` times after a first one that does not count.
pub fn run(
    entrants: &mut [Box<dyn Entrant + '_>],
    radius: f32,
    questions: &[Question<'_>],
    rounds: u32,
) -> Result<Vec<Score>> {
    let most = questions.iter().map(|q| q.most).max().unwrap_or(0);
    let blank = Score { build: Times::default(), search: vec![Times::default(); questions.len()] };
    let mut scores = vec![blank; entrants.len()];
    // What the first entrant said, to compare the sums with.
    let mut first: Vec<Option<Answer>> = vec![None; questions.len()];
    for round in 0..=rounds {
        for (entrant, score) in entrants.iter_mut().zip(&mut scores) {
            let (built, build) = timed(|| entrant.build(radius, most));
            built?;
            let build = by_device(entrant.as_mut(), 0, build)?;
            if round > 0 {
                score.build.push(build);
            }
            for ((question, times), first) in questions.iter().zip(&mut score.search).zip(&mut first) {
                let (answer, time) = timed(|| entrant.ask(question));
                check(entrant.as_ref(), question, answer?, first)?;
                let time = by_device(entrant.as_mut(), 1, time)?;
                if round > 0 {
                    times.push(time);
                }
            }
            entrant.forget();
        }
    }
    Ok(scores)
}

fn by_device(entrant: &mut dyn Entrant, stage: usize, time: Time) -> Result<Time> {
    Ok(entrant.device_seconds()?.map_or(time, |seconds| Time { wall: seconds[stage], cpu: None }))
}

/// Of the neighbours, those that an entrant which is not exact may have more or less.
const SLACK: f64 = 1e-5;

fn check(entrant: &dyn Entrant, question: &Question<'_>, answer: Answer, first: &mut Option<Answer>) -> Result<()> {
    let (name, found, right) = (entrant.name(), answer.neighbours, question.total);
    let allowed = if entrant.is_exact() { 0.0 } else { 2.0 + SLACK * right as f64 };
    ensure!(
        found.abs_diff(right) as f64 <= allowed,
        "{name} found {found} neighbours instead of {right}: it was timed wrongly"
    );
    let first = first.get_or_insert(answer);
    let slack = 1e-4 * first.sum.abs().max(1e-30);
    let (a, b) = (answer.sum, first.sum);
    ensure!((a - b).abs() <= slack, "{name} summed to {a} instead of {b}: it was timed wrongly");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::math::clouds;

    /// Loses the last point.
    struct Lossy<'a>(&'a [Vec3]);

    impl RadiusSearch for Lossy<'_> {
        fn len(&self) -> usize {
            self.0.len()
        }

        fn try_within<B>(
            &self,
            centre: Vec3,
            radius: f32,
            visit: impl FnMut(u32, f32) -> std::ops::ControlFlow<B>,
        ) -> std::ops::ControlFlow<B> {
            BruteForce(&self.0[1..]).try_within(centre, radius, visit)
        }
    }

    #[test]
    fn a_wrong_index_is_not_timed() {
        let points = clouds::uniform(200, 1);
        for operation in [Operation::Sum, Operation::Store, Operation::Nearest(64)] {
            let question = Question::new(&points, &points, 0.1, operation).unwrap();
            let tree = || Box::new(Of::new("tree", |_| PointBvh::new(&points))) as Box<dyn Entrant + '_>;
            let brute = Box::new(Of::new("brute", |_| Ok(BruteForce(&points))));
            let scores = run(&mut [tree(), brute], 0.1, std::slice::from_ref(&question), 3).unwrap();
            assert_eq!(scores.len(), 2);
            assert!(scores.iter().all(|s| s.search.len() == 1 && s.search[0].wall().median > 0.0));
            let lossy = Box::new(Of::new("lossy", |_| Ok(Lossy(&points))));
            let error = run(&mut [tree(), lossy], 0.1, &[question], 1).unwrap_err().to_string();
            assert!(error.contains("lossy found"), "{error}");
        }
    }

    #[test]
    fn radii_are_tuned() {
        let points = clouds::uniform(4000, 2);
        for wanted in [1.0, 8.0, 50.0] {
            let radius = radius_for(&points, &points, wanted).unwrap();
            let question = Question::new(&points, &points, radius, Operation::Sum).unwrap();
            assert!((question.mean() / wanted - 1.0).abs() < 0.02, "{}", question.mean());
        }
        assert!(radius_for(&points, &points, 5000.0).is_err());
        assert!(radius_for(&points[..1], &points, 1.0).is_err());
    }

    #[test]
    fn large_answers_come_in_several_calls() {
        let points = vec![Vec3::ZERO; 3000];
        let queries = vec![Vec3::ZERO; 100_000];
        let question = Question::new(&points, &queries[..40], 1.0, Operation::Store).unwrap();
        assert_eq!((question.total, question.most), (120_000, 3000));
        assert_eq!(question.batches().count(), 1);
        let batch = MOST_STORED / (NEIGHBOUR * 3000);
        let many = Question { queries: &queries, batch, ..question };
        assert_eq!(many.batches().map(<[Vec3]>::len).sum::<usize>(), queries.len());
        assert_eq!(many.batches().count(), queries.len().div_ceil(batch));
    }
}
