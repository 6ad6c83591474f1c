//! The forms of the search over many queries: checked first, then on all threads.

use glam::Vec3;
use rayon::prelude::*;

use super::{Error, MAX_K, Nearest, Neighbour, RadiusSearch};

/// Queries a thread takes at once.
pub(super) const GRAIN: usize = 256;

/// The radius of each query, from 0 to the index's [`RadiusSearch::max_radius`]; infinite finds all
/// whose squared distance is a finite number.
#[derive(Clone, Copy, Debug)]
pub enum Radii<'a> {
    /// The same for all.
    One(f32),
    /// One for each.
    Each(&'a [f32]),
}

impl Radii<'_> {
    /// Of a query.
    #[inline]
    pub fn of(&self, query: usize) -> f32 {
        match self {
            Self::One(radius) => *radius,
            Self::Each(radii) => radii[query],
        }
    }

    /// Those of some of the queries.
    pub fn part(&self, queries: std::ops::Range<usize>) -> Self {
        match self {
            Self::One(radius) => Self::One(*radius),
            Self::Each(radii) => Self::Each(&radii[queries]),
        }
    }

    /// Refuses queries and radii that an index built for `built` cannot answer.
    pub fn check(&self, queries: &[Vec3], built: f32) -> Result<(), Error> {
        let check = |query: usize, radius: f32| {
            if radius.is_nan() || radius < 0.0 {
                return Err(Error::Radius { query, radius });
            }
            if radius > built { Err(Error::RadiusAboveBuilt { query, radius, built }) } else { Ok(()) }
        };
        match self {
            Self::One(radius) => check(0, *radius)?,
            Self::Each(radii) if radii.len() != queries.len() => {
                return Err(Error::Lengths { queries: queries.len(), radii: radii.len() });
            }
            Self::Each(radii) => radii.iter().enumerate().try_for_each(|(query, &radius)| check(query, radius))?,
        }
        match queries.iter().position(|q| !q.is_finite()) {
            Some(at) => Err(Error::NotFinite { what: "query", at }),
            None => Ok(()),
        }
    }
}

/// All neighbours of all queries, in compressed rows: those of query q are at `offsets[q] .. offsets[q + 1]`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Neighbours {
    /// `[queries + 1]`, from 0 on, ascending.
    pub offsets: Vec<usize>,
    /// Points, `[offsets[queries]]`; within a row in no particular order.
    pub indices: Vec<u32>,
    /// Their squared distances.
    pub distances2: Vec<f32>,
}

impl Neighbours {
    /// Number of queries.
    pub fn len(&self) -> usize {
        self.offsets.len().saturating_sub(1)
    }

    /// Whether there were no queries.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Of one query.
    pub fn row(&self, query: usize) -> impl ExactSizeIterator<Item = Neighbour> + '_ {
        let range = self.offsets[query]..self.offsets[query + 1];
        let pairs = self.indices[range.clone()].iter().zip(&self.distances2[range]);
        pairs.map(|(&index, &distance2)| Neighbour { index, distance2 })
    }
}

/// The k nearest of all queries, row-major `[queries · k]`, nearest first; [`Neighbour::NONE`] where fewer were found.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NearestLists {
    /// Length of a row.
    pub k: usize,
    /// `[queries]`: how many were found.
    pub found: Vec<u32>,
    /// Points, `u32::MAX` for none.
    pub indices: Vec<u32>,
    /// Their squared distances, infinite for none.
    pub distances2: Vec<f32>,
}

impl NearestLists {
    /// For as many queries, which are checked, none found yet.
    pub(super) fn none(queries: &[Vec3], radii: Radii<'_>, built: f32, k: usize) -> Result<Self, Error> {
        if !(1..=MAX_K).contains(&k) {
            return Err(Error::K(k));
        }
        radii.check(queries, built)?;
        Ok(Self {
            k,
            found: vec![0; queries.len()],
            indices: vec![Neighbour::NONE.index; queries.len() * k],
            distances2: vec![Neighbour::NONE.distance2; queries.len() * k],
        })
    }
}

pub(super) fn fold_each<S: RadiusSearch, T: Send>(
    index: &S,
    queries: &[Vec3],
    radii: Radii<'_>,
    start: impl Fn(usize) -> T + Sync,
    visit: impl Fn(&mut T, u32, f32) + Sync,
) -> Result<Vec<T>, Error> {
    radii.check(queries, index.max_radius())?;
    let fold = |(query, &centre): (usize, &Vec3)| {
        let mut state = start(query);
        index.within(centre, radii.of(query), |i, d2| visit(&mut state, i, d2));
        state
    };
    Ok(queries.par_iter().with_min_len(GRAIN).enumerate().map(fold).collect())
}

pub(super) fn neighbours<S: RadiusSearch>(index: &S, queries: &[Vec3], radii: Radii<'_>) -> Result<Neighbours, Error> {
    let counts = index.count_all(queries, radii)?;
    let mut offsets = Vec::with_capacity(queries.len() + 1);
    offsets.push(0);
    let mut total = 0;
    offsets.extend(counts.iter().map(|&n| {
        total += n as usize;
        total
    }));
    let mut indices = vec![0; total];
    let mut distances2 = vec![0.0; total];
    // Each thread gets the rows of its queries.
    let mut jobs = Vec::new();
    let (mut rest_i, mut rest_d) = (&mut indices[..], &mut distances2[..]);
    for first in (0..queries.len()).step_by(GRAIN) {
        let last = (first + GRAIN).min(queries.len());
        let n = offsets[last] - offsets[first];
        let (rows_i, after_i) = rest_i.split_at_mut(n);
        let (rows_d, after_d) = rest_d.split_at_mut(n);
        (rest_i, rest_d) = (after_i, after_d);
        jobs.push((first..last, rows_i, rows_d));
    }
    jobs.into_par_iter().for_each(|(range, rows_i, rows_d)| {
        let mut at = 0;
        for query in range {
            index.within(queries[query], radii.of(query), |i, d2| {
                (rows_i[at], rows_d[at]) = (i, d2);
                at += 1;
            });
        }
    });
    Ok(Neighbours { offsets, indices, distances2 })
}

pub(super) fn nearest<S: RadiusSearch>(
    index: &S,
    queries: &[Vec3],
    radii: Radii<'_>,
    k: usize,
) -> Result<NearestLists, Error> {
    let mut lists = NearestLists::none(queries, radii, index.max_radius(), k)?;
    let rows = lists.indices.par_chunks_mut(k).zip(lists.distances2.par_chunks_mut(k)).zip(&mut lists.found);
    rows.zip(queries).enumerate().with_min_len(GRAIN).for_each_init(
        || Nearest::new(k),
        |nearest, (query, (((indices, distances2), found), &centre))| {
            index.nearest(centre, radii.of(query), nearest);
            *found = nearest.found().len() as u32;
            for (at, neighbour) in nearest.found().iter().enumerate() {
                (indices[at], distances2[at]) = (neighbour.index, neighbour.distance2);
            }
        },
    );
    Ok(lists)
}
