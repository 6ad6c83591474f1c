//! Searches for many queries.

use std::time::Instant;

use glam::Vec3;

use super::super::kernels::{Batch, Kernel};
use super::queries::{QuerySet, Records};
use super::{DeviceArray, DeviceNearest, DeviceNeighbours, FILL, PointSearch, Queries, QueryRadii, SEARCH, WORDS};
use crate::device::Error;
use crate::index::{self, MAX_K, NearestLists, Neighbours, Radii};

/// Threads a workgroup.
const THREADS: u32 = 64;
/// Counts a workgroup of `scan.wgsl` handles: `BLOCK` there.
const SCAN_BLOCK: u32 = 2048;
/// Queries of the first dispatch at most, before anything is known about how long they take.
const FIRST_CHUNK: u64 = 32768;
/// Points the first dispatch tests at most, if all of them are within the radius.
const FIRST_TESTS: u64 = 1 << 34;
/// Queries of the smallest dispatch.
const LEAST_CHUNK: u64 = 64;
/// How much larger one dispatch may be than the one before.
const GROWTH: f64 = 16.0;
/// Seconds a dispatch may take, well below what watchdogs allow.
const DISPATCH_SECONDS: f64 = 0.1;

// What `neighbours.wgsl` does.
const COUNT: u32 = 0;
const WRITE: u32 = 1;

impl PointSearch {
    /// Number of neighbours of each query. Many queries are searched in several parts.
    pub fn count_all(&mut self, queries: &[Vec3], radii: Radii<'_>) -> Result<Vec<u32>, Error> {
        radii.check(queries, self.max_radius())?;
        let mut counts = Vec::with_capacity(queries.len());
        for (queries, radii) in parts(queries, radii, self.most_queries(size_of::<Vec3>())) {
            counts.append(&mut self.count_on_device(queries.into(), radii.into())?.download()?);
        }
        Ok(counts)
    }

    /// All neighbours of all queries, sized by counting first. Where there are more than one binding of the device holds,
    /// the queries are searched in several parts.
    pub fn neighbours_all(&mut self, queries: &[Vec3], radii: Radii<'_>) -> Result<Neighbours, Error> {
        radii.check(queries, self.max_radius())?;
        let mut all = Neighbours { offsets: vec![0], ..Neighbours::default() };
        for (queries, radii) in parts(queries, radii, self.most_queries(size_of::<Vec3>())) {
            self.append_neighbours(queries, radii, &mut all)?;
        }
        Ok(all)
    }

    fn append_neighbours(&mut self, queries: &[Vec3], radii: Radii<'_>, all: &mut Neighbours) -> Result<(), Error> {
        let set = self.prepare(queries.into(), radii.into())?;
        let set = self.sort_if_asked(set)?;
        let counts = self.count(&set)?;
        let (offsets, total) = self.offsets(&counts)?;
        // Two arrays of this many elements, the memory they are read through, and some for the queries.
        let most = (self.context.most_bytes_bound() / 4).min(self.context.budget_left() / 16);
        if u64::from(total) <= most && total != u32::MAX {
            append(all, self.fill(&set, &counts, offsets, total)?.download()?);
            return Ok(());
        }
        drop(offsets);
        let n_each = counts.download()?;
        drop(counts);
        let mut begin = 0;
        while begin < queries.len() {
            let mut sum = 0;
            let fits = |n: &&u32| {
                sum += u64::from(**n);
                sum <= most
            };
            // One alone that does not fit is refused.
            let end = begin + n_each[begin..].iter().take_while(fits).count().max(1);
            let part = self.neighbours_on_device(queries[begin..end].into(), radii.part(begin..end).into())?;
            append(all, part.download()?);
            begin = end;
        }
        Ok(())
    }

    /// Truncated k-NN of all queries; `k` from 1 to [`MAX_K`]. Many queries are searched in several parts.
    pub fn nearest_all(&mut self, queries: &[Vec3], radii: Radii<'_>, k: usize) -> Result<NearestLists, Error> {
        check_k(k)?;
        radii.check(queries, self.max_radius())?;
        let mut lists = NearestLists { k, ..NearestLists::default() };
        for (queries, radii) in parts(queries, radii, self.most_queries((8 * k).max(size_of::<Vec3>()))) {
            let mut part = self.nearest_on_device(queries.into(), radii.into(), k)?.download()?;
            lists.found.append(&mut part.found);
            lists.indices.append(&mut part.indices);
            lists.distances2.append(&mut part.distances2);
        }
        Ok(lists)
    }

    /// Number of neighbours of each query, `[queries]`.
    pub fn count_on_device(&mut self, queries: Queries<'_>, radii: QueryRadii<'_>) -> Result<DeviceArray<u32>, Error> {
        let set = self.prepare(queries, radii)?;
        let set = self.sort_if_asked(set)?;
        self.count(&set)
    }

    /// All neighbours of all queries, sized by counting first: it waits for the count. More than one binding of the
    /// device holds are an error, [`Error::TooLarge`].
    pub fn neighbours_on_device(
        &mut self,
        queries: Queries<'_>,
        radii: QueryRadii<'_>,
    ) -> Result<DeviceNeighbours, Error> {
        let set = self.prepare(queries, radii)?;
        let set = self.sort_if_asked(set)?;
        let counts = self.count(&set)?;
        let (offsets, total) = self.offsets(&counts)?;
        if total == u32::MAX {
            let total: u64 = counts.download()?.into_iter().map(u64::from).sum();
            return Err(self.context.too_large("neighbours", 4 * total, self.context.most_bytes_bound()));
        }
        self.fill(&set, &counts, offsets, total)
    }

    /// Truncated k-NN of all queries; `k` from 1 to [`MAX_K`].
    pub fn nearest_on_device(
        &mut self,
        queries: Queries<'_>,
        radii: QueryRadii<'_>,
        k: usize,
    ) -> Result<DeviceNearest, Error> {
        check_k(k)?;
        let set = self.prepare(queries, radii)?;
        let set = self.sort_if_asked(set)?;
        let n = u64::from(set.records.n);
        let lists = DeviceNearest {
            k,
            found: self.array("numbers found", n)?,
            indices: self.array("nearest points", n * k as u64)?,
            distances2: self.array("their distances", n * k as u64)?,
        };
        // Ray queries have no boxes to tell; those are not read then.
        let boxes = if self.hardware.is_some() { &self.index.bounds } else { &self.index.boxes }.raw().clone();
        let own = [lists.found.all(), lists.indices.all(), lists.distances2.all(), boxes.as_entire_binding()];
        let kernel = self.nearest.clone();
        self.launch(SEARCH, &kernel, &set, &own, k as u32)?;
        Ok(lists)
    }

    fn array<T: bytemuck::Pod>(&self, what: &'static str, len: u64) -> Result<DeviceArray<T>, Error> {
        DeviceArray::new(&self.context, &self.shared, what, len)
    }

    /// Queries that fit one binding, of some bytes each.
    fn most_queries(&self, bytes: usize) -> usize {
        let bytes = if self.sort_queries { bytes.max(4 * WORDS as usize) } else { bytes };
        (self.context.most_bytes_bound() / bytes as u64).min(1 << 30) as usize
    }

    /// Brings the queries into Morton order, if the user wants that.
    pub(super) fn sort_if_asked(&mut self, set: QuerySet) -> Result<QuerySet, Error> {
        let n = set.records.n;
        if !self.sort_queries || n == 0 {
            return Ok(set);
        }
        self.index.reserve_sort(&self.context, n)?;
        self.sorted_queries.reserve(&self.context, u64::from(n))?;
        let mut batch = Batch::new(&self.context, &self.shared, "sort queries");
        self.index.sort(&mut batch, n, &set.records.binding(), set.records.words, &self.sorted_queries)?;
        batch.submit()?;
        let records = Records { buffer: self.sorted_queries.raw().clone(), n, words: WORDS };
        Ok(QuerySet { records, sorted: true, ..set })
    }

    fn count(&mut self, set: &QuerySet) -> Result<DeviceArray<u32>, Error> {
        let counts = self.array::<u32>("numbers of neighbours", u64::from(set.records.n))?;
        let [offsets, indices] = [self.array::<u32>("no offsets", 0)?, self.array::<u32>("no rows", 0)?];
        let distances2 = self.array::<f32>("no rows", 0)?;
        let own = [counts.all(), offsets.all(), indices.all(), distances2.all()];
        let kernel = self.neighbours.clone();
        self.launch(SEARCH, &kernel, set, &own, COUNT)?;
        Ok(counts)
    }

    /// Where the row of each query begins, and their sum; `u32::MAX`: that, or more.
    fn offsets(&mut self, counts: &DeviceArray<u32>) -> Result<(DeviceArray<u32>, u32), Error> {
        let n = counts.len() as u32;
        let offsets = self.array::<u32>("offsets of neighbours", u64::from(n) + 1)?;
        let n_blocks = n.div_ceil(SCAN_BLOCK);
        self.sums.reserve(&self.context, u64::from(n_blocks))?;
        let mut batch = Batch::new(&self.context, &self.shared, "offsets");
        let buffers = [counts.all(), self.sums.all(), offsets.all()];
        if n > 0 {
            for (kernel, groups) in
                [(&self.scan_blocks, n_blocks), (&self.scan_sums, 1), (&self.scan_offsets, n_blocks)]
            {
                batch.dispatch(kernel, &buffers, [n, n_blocks, 0, 0], groups);
            }
        }
        batch.submit()?;
        let total = offsets.last(&mut self.readback)?;
        Ok((offsets, total))
    }

    fn fill(
        &mut self,
        set: &QuerySet,
        counts: &DeviceArray<u32>,
        offsets: DeviceArray<u32>,
        total: u32,
    ) -> Result<DeviceNeighbours, Error> {
        let indices = self.array::<u32>("neighbours", u64::from(total))?;
        let distances2 = self.array::<f32>("distances of neighbours", u64::from(total))?;
        let own = [counts.all(), offsets.all(), indices.all(), distances2.all()];
        let kernel = self.neighbours.clone();
        self.launch(FILL, &kernel, set, &own, WRITE)?;
        Ok(DeviceNeighbours { offsets, indices, distances2 })
    }

    /// Runs a kernel that imports `search` for all queries, in dispatches that aim at a tenth of a second, well below what watchdogs allow. One
    /// query is never split: a radius that holds tens of millions of points may take longer.
    pub(super) fn launch(
        &mut self,
        stage: usize,
        kernel: &Kernel,
        set: &QuerySet,
        own: &[wgpu::BindingResource<'_>],
        option: u32,
    ) -> Result<(), Error> {
        let n = set.records.n;
        // Radii have been checked, as far as they can be.
        let tree = match &self.hardware {
            None => self.index.nodes.all(),
            Some(hardware) => hardware.tree(&self.context, 0, 0.0)?,
        };
        let mut buffers = vec![self.points.all(), tree, set.records.binding(), set.radii_binding()];
        buffers.extend_from_slice(own);
        let levels = self.index.levels.len() as u32;
        let mut batch = Batch::new(&self.context, &self.shared, "search");
        self.timer.begin(stage, &mut batch);
        let most = FIRST_TESTS / u64::from(self.n_points.max(1));
        let (mut first, mut chunk) = (0, most.clamp(LEAST_CHUNK, FIRST_CHUNK) as u32);
        while first < n {
            let end = n.min(first.saturating_add(chunk));
            let mut arguments = self.index.arguments([first, end, set.records.words, u32::from(set.each)]);
            arguments.further = [self.n_points, levels, option, u32::from(set.sorted)];
            batch.dispatch(kernel, &buffers, arguments, (end - first).div_ceil(THREADS));
            if end < n {
                let begun = Instant::now();
                batch.submit()?;
                self.context.wait()?;
                let factor = (DISPATCH_SECONDS / begun.elapsed().as_secs_f64()).min(GROWTH);
                chunk = (f64::from(chunk) * factor).clamp(LEAST_CHUNK as f64, f64::from(1u32 << 30)) as u32;
                batch = Batch::new(&self.context, &self.shared, "search");
            }
            first = end;
        }
        self.timer.end(stage, batch, &self.context)
    }
}

fn check_k(k: usize) -> Result<(), Error> {
    if (1..=MAX_K).contains(&k) { Ok(()) } else { Err(index::Error::K(k).into()) }
}

/// At most `most` queries with their radii at a time.
fn parts<'a>(queries: &'a [Vec3], radii: Radii<'a>, most: usize) -> impl Iterator<Item = (&'a [Vec3], Radii<'a>)> {
    let starts = (0..queries.len()).step_by(most.max(1));
    starts.map(move |begin| {
        let end = queries.len().min(begin + most.max(1));
        (&queries[begin..end], radii.part(begin..end))
    })
}

/// Rows behind rows.
fn append(all: &mut Neighbours, part: Neighbours) {
    let first = all.indices.len();
    all.offsets.extend(part.offsets[1..].iter().map(|offset| first + offset));
    all.indices.extend(part.indices);
    all.distances2.extend(part.distances2);
}
