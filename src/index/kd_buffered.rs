//! The paper's rival: a kd-tree whose queries fill result buffers, which are read afterwards.
//!
//! FLANN's form of radius search: two matrices, indices and squared distances, [queries · capacity]. A query with more
//! neighbours than a row holds keeps the first found, and the number found tells.

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;

use super::batch::GRAIN;
use super::stats::{CountVisits, Hierarchy, Node, Visits};
use super::{Error, Nearest, Neighbour, PointKd, Radii, RadiusSearch};

/// Queries answered before their buffers are read and filled anew, in [`KdBuffered`]'s `fold_all`, at most.
const BATCH: usize = 1 << 16;
/// Results that these buffers hold, at most, if a row is not longer.
const MAX_RESULTS: usize = 1 << 23;

/// Results of radius queries, a row each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Buffers {
    capacity: usize,
    found: Vec<u32>,
    indices: Vec<u32>,
    distances2: Vec<f32>,
}

impl Buffers {
    /// Length of a row.
    pub fn capacity(&self) -> usize {
        self.capacity
    }

    /// `[queries]`: neighbours there are, also where the row did not hold them all.
    pub fn found(&self) -> &[u32] {
        &self.found
    }

    /// What is stored for one query: all its neighbours, or `capacity` of them, in no particular order.
    pub fn row(&self, query: usize) -> impl ExactSizeIterator<Item = Neighbour> + '_ {
        let first = query * self.capacity;
        let range = first..first + (self.found[query] as usize).min(self.capacity);
        let pairs = self.indices[range.clone()].iter().zip(&self.distances2[range]);
        pairs.map(|(&index, &distance2)| Neighbour { index, distance2 })
    }

    /// [`Error::Truncated`] if some query has more neighbours than its row holds.
    pub fn check(&self) -> Result<(), Error> {
        let over = |&&n: &&u32| n as usize > self.capacity;
        match self.found.iter().filter(over).max() {
            Some(&most) => {
                let queries = self.found.iter().filter(over).count();
                Err(Error::Truncated { queries, capacity: self.capacity, most })
            }
            None => Ok(()),
        }
    }
}

/// See the module. Single queries are those of the [`PointKd`]; `fold_all` goes through buffers, and is an error where
/// they truncate.
#[derive(Clone, Debug, Default)]
pub struct KdBuffered {
    tree: PointKd,
    capacity: usize,
}

impl KdBuffered {
    /// Over all of `points`, with rows for `capacity` neighbours.
    pub fn new(points: &[Vec3], capacity: usize) -> Result<Self, Error> {
        Ok(Self { tree: PointKd::new(points)?, capacity })
    }

    /// Over other points, reusing the memory. After an error the tree is what it was.
    pub fn rebuild(&mut self, points: &[Vec3]) -> Result<(), Error> {
        self.tree.rebuild(points)
    }

    /// Answers all queries into `buffers`, reusing their memory. Rows that are too short are no error here:
    /// [`Buffers::check`] tells.
    pub fn fill(&self, queries: &[Vec3], radii: Radii<'_>, buffers: &mut Buffers) -> Result<(), Error> {
        radii.check(queries, self.max_radius())?;
        self.fill_from(queries, 0, radii, buffers);
        Ok(())
    }

    /// For the queries of a batch that begins with query `first`.
    fn fill_from(&self, queries: &[Vec3], first: usize, radii: Radii<'_>, buffers: &mut Buffers) {
        let capacity = self.capacity;
        buffers.capacity = capacity;
        buffers.found.resize(queries.len(), 0);
        buffers.indices.resize(queries.len() * capacity, 0);
        buffers.distances2.resize(queries.len() * capacity, 0.0);
        let answer = |query: usize, found: &mut u32, indices: &mut [u32], distances2: &mut [f32]| {
            let mut n = 0;
            self.tree.within(queries[query], radii.of(first + query), |i, d2| {
                if n < capacity {
                    (indices[n], distances2[n]) = (i, d2);
                }
                n += 1;
            });
            *found = n as u32;
        };
        if capacity == 0 {
            buffers.found.par_iter_mut().enumerate().for_each(|(q, found)| answer(q, found, &mut [], &mut []));
            return;
        }
        let rows = buffers.indices.par_chunks_mut(capacity).zip(buffers.distances2.par_chunks_mut(capacity));
        let rows = rows.zip(&mut buffers.found).enumerate().with_min_len(GRAIN);
        rows.for_each(|(q, ((indices, distances2), found))| answer(q, found, indices, distances2));
    }
}

impl RadiusSearch for KdBuffered {
    fn len(&self) -> usize {
        self.tree.len()
    }

    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.tree.try_within(centre, radius, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        self.tree.nearest(centre, radius, nearest);
    }

    fn fold_all<T: Send>(
        &self,
        queries: &[Vec3],
        radii: Radii<'_>,
        start: impl Fn(usize) -> T + Sync,
        visit: impl Fn(&mut T, u32, f32) + Sync,
    ) -> Result<Vec<T>, Error> {
        radii.check(queries, self.max_radius())?;
        let mut folded = Vec::with_capacity(queries.len());
        let mut buffers = Buffers::default();
        let size = (MAX_RESULTS / self.capacity.max(1)).clamp(1, BATCH);
        for (batch, queries) in queries.chunks(size).enumerate() {
            let first = batch * size;
            self.fill_from(queries, first, radii, &mut buffers);
            buffers.check()?;
            let fold = |q: usize| {
                let mut state = start(first + q);
                buffers.row(q).for_each(|n| visit(&mut state, n.index, n.distance2));
                state
            };
            folded.par_extend((0..queries.len()).into_par_iter().with_min_len(GRAIN).map(fold));
        }
        Ok(folded)
    }
}

impl CountVisits for KdBuffered {
    fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        self.tree.visits(centre, radius)
    }
}

impl Hierarchy for KdBuffered {
    fn for_each_node(&self, visit: impl FnMut(Node)) {
        self.tree.for_each_node(visit);
    }
}
