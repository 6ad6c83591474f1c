//! What is asked, from the host or already on the device.

use glam::Vec3;

use super::super::context::Context;
use super::PointSearch;
use crate::device::Error;
use crate::index::{self, Radii};

/// Centres of the queries.
#[derive(Clone, Copy, Debug)]
pub enum Queries<'a> {
    /// From the host: checked to be finite, and uploaded.
    Host(&'a [Vec3]),
    /// On the device: records of 32-bit words, a position (three `f32`) first in each. They are not checked; a query that
    /// is not finite finds nothing that can be relied on.
    Device {
        /// With usage `STORAGE`.
        buffer: &'a wgpu::Buffer,
        /// Number of queries.
        n: u32,
        /// Distance from one position to the next, 3 or more.
        words_per_record: u32,
    },
}

impl<'a> From<&'a [Vec3]> for Queries<'a> {
    fn from(queries: &'a [Vec3]) -> Self {
        Self::Host(queries)
    }
}

impl Queries<'_> {
    /// Number of queries.
    pub fn len(&self) -> usize {
        match self {
            Self::Host(queries) => queries.len(),
            Self::Device { n, .. } => *n as usize,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Radii of the queries.
#[derive(Clone, Copy, Debug)]
pub enum QueryRadii<'a> {
    /// From the host: checked to be zero or more, and uploaded.
    Host(Radii<'a>),
    /// On the device: one `f32` a query, usage `STORAGE`. They are not checked; within one that is negative or NaN there
    /// is nothing, and within one above [`PointSearch::max_radius`] not all is found.
    Device(&'a wgpu::Buffer),
}

impl<'a> From<Radii<'a>> for QueryRadii<'a> {
    fn from(radii: Radii<'a>) -> Self {
        Self::Host(radii)
    }
}

/// Records with a position first, as a kernel reads them. (Handles of buffers are counted, so a copy is cheap.)
#[derive(Clone)]
pub(super) struct Records {
    pub(super) buffer: wgpu::Buffer,
    pub(super) n: u32,
    pub(super) words: u32,
}

impl Records {
    /// Refuses a buffer that is not what the caller says.
    pub(super) fn check(
        context: &Context,
        what: &'static str,
        buffer: &wgpu::Buffer,
        n: u32,
        words: u32,
    ) -> Result<Self, Error> {
        if words < 3 {
            let problem = format!("has records of {words} words: a position takes 3");
            return Err(Error::Buffer { what, problem });
        }
        check_buffer(context, what, buffer, (4 * u64::from(words)).saturating_mul(u64::from(n)))?;
        Ok(Self { buffer: buffer.clone(), n, words })
    }

    pub(super) fn binding(&self) -> wgpu::BindingResource<'_> {
        part(&self.buffer, 4 * u64::from(self.words) * u64::from(self.n))
    }
}

/// The first bytes of a buffer. Without any it must not be bound.
fn part(buffer: &wgpu::Buffer, bytes: u64) -> wgpu::BindingResource<'_> {
    let size = wgpu::BufferSize::new(bytes);
    wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
}

/// Refuses a buffer that cannot be bound, or has less than `bytes`. One of which nothing is needed may be empty, which
/// cannot be bound: no kernel runs then.
fn check_buffer(context: &Context, what: &'static str, buffer: &wgpu::Buffer, bytes: u64) -> Result<(), Error> {
    let refused = |problem: String| Err(Error::Buffer { what, problem });
    if !buffer.usage().contains(wgpu::BufferUsages::STORAGE) {
        return refused("has no usage STORAGE".to_owned());
    }
    if buffer.size() < bytes {
        return refused(format!("has {} bytes, {bytes} are needed", buffer.size()));
    }
    context.check_bound(what, bytes)
}

/// Queries and radii on the device.
pub(super) struct QuerySet {
    pub(super) records: Records,
    /// Whether the records are in Morton order, and hold the index the query had.
    pub(super) sorted: bool,
    pub(super) radii: wgpu::Buffer,
    /// Whether each has its own.
    pub(super) each: bool,
}

impl QuerySet {
    pub(super) fn radii_binding(&self) -> wgpu::BindingResource<'_> {
        part(&self.radii, if self.each { 4 * u64::from(self.records.n) } else { 4 })
    }
}

impl PointSearch {
    /// Checks the queries and puts them on the device.
    pub(super) fn prepare(&mut self, queries: Queries<'_>, radii: QueryRadii<'_>) -> Result<QuerySet, Error> {
        let n = queries.len();
        let n32 = u32::try_from(n)
            .map_err(|_| Error::from(index::Error::Lengths { queries: n, radii: u32::MAX as usize }))?;
        let max = self.max_radius();
        // Radii without queries, and queries without radii, are checked as well.
        match (queries, radii) {
            (Queries::Host(queries), QueryRadii::Host(radii)) => radii.check(queries, max)?,
            (Queries::Host(queries), QueryRadii::Device(_)) => Radii::One(0.0).check(queries, max)?,
            (Queries::Device { .. }, QueryRadii::Host(Radii::Each(radii))) if radii.len() != n => {
                return Err(index::Error::Lengths { queries: n, radii: radii.len() }.into());
            }
            (Queries::Device { .. }, QueryRadii::Host(Radii::Each(radii))) => {
                for &radius in radii {
                    Radii::One(radius).check(&[], max)?;
                }
            }
            (Queries::Device { .. }, QueryRadii::Host(radii)) => radii.check(&[], max)?,
            (Queries::Device { .. }, QueryRadii::Device(_)) => {}
        }
        let records = match queries {
            Queries::Host(queries) => {
                self.queries.write(&self.context, queries)?;
                Records { buffer: self.queries.raw().clone(), n: n32, words: 3 }
            }
            Queries::Device { buffer, n, words_per_record } => {
                Records::check(&self.context, "queries", buffer, n, words_per_record)?
            }
        };
        let (radii, each) = match radii {
            QueryRadii::Host(Radii::One(radius)) => {
                self.radii.write(&self.context, &[radius])?;
                (self.radii.raw().clone(), false)
            }
            QueryRadii::Host(Radii::Each(radii)) => {
                self.radii.write(&self.context, radii)?;
                (self.radii.raw().clone(), true)
            }
            QueryRadii::Device(buffer) => {
                check_buffer(&self.context, "radii", buffer, 4 * u64::from(n32))?;
                (buffer.clone(), true)
            }
        };
        Ok(QuerySet { records, sorted: false, radii, each })
    }
}
