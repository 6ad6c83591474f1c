//! What can be asked of a mesh: nearest hit, any hit, all hits, how many.

use std::ops::ControlFlow;

use super::{Hit, Ray, Scalar, Triangles};

/// What every form of a mesh answers, for one ray at a time, from any number of threads. All find the same hits, bit for
/// bit: those that [`Ray::hit`] finds.
pub trait RaySearch<T: Scalar>: Sync {
    /// What is searched.
    fn triangles(&self) -> &Triangles<T>;

    /// Calls `visit` with each hit, perhaps several times with the same, until it breaks. It returns the largest t that
    /// it still wants; of farther hits none need come.
    fn try_hits<B>(&self, ray: &Ray<T>, visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B>;

    /// The hit of smallest t, and of those the one of the lowest face.
    fn nearest(&self, ray: &Ray<T>) -> Option<Hit<T>> {
        let mut best: Option<Hit<T>> = None;
        let _: ControlFlow<()> = self.try_hits(ray, |hit| {
            let nearest = match best {
                Some(b) if !(hit.t < b.t || hit.t == b.t && hit.face < b.face) => b,
                _ => hit,
            };
            best = Some(nearest);
            ControlFlow::Continue(nearest.t)
        });
        best
    }

    /// Whether there is a hit.
    fn any(&self, ray: &Ray<T>) -> bool {
        self.try_hits(ray, |_| ControlFlow::Break(())).is_break()
    }

    /// All hits in place of what is in `hits`: each triangle once, in order of t, and at the same t of the face.
    fn all(&self, ray: &Ray<T>, hits: &mut Vec<Hit<T>>) {
        let max = ray.max;
        hits.clear();
        let _: ControlFlow<()> = self.try_hits(ray, |hit| {
            hits.push(hit);
            ControlFlow::Continue(max)
        });
        // No t is NaN: a hit's t is within the range.
        hits.sort_unstable_by(|a, b| {
            a.t.partial_cmp(&b.t).unwrap_or(std::cmp::Ordering::Equal).then(a.face.cmp(&b.face))
        });
        hits.dedup_by_key(|hit| hit.face);
    }

    /// Number of triangles that are hit. A ray through an edge hits both triangles at it.
    fn count(&self, ray: &Ray<T>) -> usize {
        let max = ray.max;
        let mut faces = Vec::new();
        let _: ControlFlow<()> = self.try_hits(ray, |hit| {
            faces.push(hit.face);
            ControlFlow::Continue(max)
        });
        faces.sort_unstable();
        faces.dedup();
        faces.len()
    }
}

/// Tests every triangle: the oracle of the others.
#[derive(Clone, Copy, Debug)]
pub struct EveryTriangle<'a, T>(pub &'a Triangles<T>);

impl<T: Scalar> RaySearch<T> for EveryTriangle<'_, T> {
    fn triangles(&self) -> &Triangles<T> {
        self.0
    }

    fn try_hits<B>(&self, ray: &Ray<T>, mut visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B> {
        for face in 0..self.0.len() as u32 {
            if let Some(hit) = ray.hit(face, self.0.corners(face)) {
                visit(hit)?;
            }
        }
        ControlFlow::Continue(())
    }
}
