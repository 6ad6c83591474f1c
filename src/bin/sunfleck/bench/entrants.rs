//! Which indices take part, and under which names.

use anyhow::{Result, bail};
use glam::Vec3;
use sunfleck::index::{Boxes, Buffers, Builder, HashGrid, KdBuffered, KdTree, PointBvh, Radii, SampleBvh, SampleOptions};

use super::contest::{self, Answer, Entrant, Of, Operation, Question};

/// The library's default.
pub const DEFAULT: &str = "bvh8";
/// The paper's method: a binary tree over boxes as wide as the radius, one sample a leaf.
pub const METHOD: &str = "bvh2-inflated";
/// The paper's rival: a kd-tree that fills buffers.
pub const RIVAL: &str = "kd-buffered";

/// The better of the two builders; the reach is the one that Meister & Bittner 2018 recommend.
pub const PLOC: Builder = Builder::Ploc { reach: 14 };

/// Those of Figures 3 to 6.
pub fn radius_search(points: &[Vec3]) -> Vec<Box<dyn Entrant + '_>> {
    vec![
        default(points),
        samples(METHOD, points, PLOC, true, 1),
        rival(points),
        Box::new(Of::new("kd", |_| KdTree::new(points))),
        Box::new(Of::new("grid", |radius| HashGrid::new(points, radius))),
    ]
}

/// [`DEFAULT`].
pub fn default(points: &[Vec3]) -> Box<dyn Entrant + '_> {
    Box::new(Of::new(DEFAULT, |_| PointBvh::new(points)))
}

/// [`RIVAL`].
pub fn rival(points: &[Vec3]) -> Box<dyn Entrant + '_> {
    Box::new(Buffered { points, tree: None })
}

/// A binary tree over the samples' boxes.
pub fn samples<'a>(
    name: &'static str,
    points: &'a [Vec3],
    builder: Builder,
    inflated: bool,
    leaf_size: usize,
) -> Box<dyn Entrant + 'a> {
    let options = move |radius| SampleOptions {
        builder,
        boxes: if inflated { Boxes::Inflated(radius) } else { Boxes::Tight },
        leaf_size,
    };
    Box::new(Of::new(name, move |radius| SampleBvh::new(points, options(radius))))
}

/// A kd-tree that fills two matrices, as FLANN does: indices and distances, a row each query.
struct Buffered<'a> {
    points: &'a [Vec3],
    tree: Option<KdBuffered>,
}

impl Entrant for Buffered<'_> {
    fn name(&self) -> &'static str {
        RIVAL
    }

    fn build(&mut self, _radius: f32, most: usize) -> Result<()> {
        self.tree = Some(KdBuffered::new(self.points, most)?);
        Ok(())
    }

    fn ask(&self, question: &Question<'_>) -> Result<Answer> {
        let Some(tree) = &self.tree else { bail!("{RIVAL} was asked before it was built") };
        if question.operation != Operation::Store {
            return contest::answer(tree, question);
        }
        let mut answer = Answer::default();
        let mut buffers = Buffers::default();
        for queries in question.batches() {
            tree.fill(queries, Radii::One(question.radius), &mut buffers)?;
            buffers.check()?;
            answer.neighbours += buffers.found().iter().map(|&n| u64::from(n)).sum::<u64>();
        }
        Ok(answer)
    }

    fn forget(&mut self) {
        self.tree = None;
    }
}
