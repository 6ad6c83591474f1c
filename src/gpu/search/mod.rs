//! Neighbour search over points on a GPU: the implicit tree of [`PointBvh`](crate::index::PointBvh), built and searched
//! there.
//!
//! The predicate is the one of [`crate::index`], |p − q|² ≤ r². A device may fuse a multiplication and an addition, and
//! then the square of a distance differs in its last bit: points that lie on the sphere to within one unit in the last
//! place of r² may fall on the other side than on the host.

mod batch;
mod queries;
mod results;
mod visitor;

use std::sync::Arc;

use glam::Vec3;

use queries::Records;
pub use queries::{Queries, QueryRadii};
pub use results::{DeviceArray, DeviceNearest, DeviceNeighbours};
pub use visitor::Visitor;

use super::Method;
use super::buffers::{Array, Readback};
use super::context::Context;
use super::hardware::Hardware;
use super::index::{Index, Sorted};
use super::kernels::{ACCELERATION_STRUCTURE, Access, Batch, Kernel, Modules, Shared};
use super::timer::Timer;
use crate::device::Error;
use crate::index::{self, check_points};
use crate::layout::{PointBox, TreeNode};

/// Words of a point in the order of the tree: position, index.
const WORDS: u32 = 4;

/// Binding of the tree in `shaders/lib/search.wgsl`.
const TREE: usize = 1;

// The stages that are timed.
const BUILD: usize = 0;
const SEARCH: usize = 1;
const FILL: usize = 2;

/// Seconds on the device, of the last of each; a stage that has not run yet took none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SearchTimes {
    /// The build.
    pub build: f64,
    /// A search, or the counting that comes before the rows of neighbours.
    pub search: f64,
    /// Writing those rows.
    pub fill: f64,
}

/// Points on a device, and the tree to search them by.
///
/// Memory is kept from one build to the next; the number of points may change. Forms over slices return what their
/// namesakes of [`RadiusSearch`](crate::index::RadiusSearch) return; the others leave it on the device.
pub struct PointSearch {
    context: Arc<Context>,
    shared: Arc<Shared>,
    index: Index,
    /// What is searched instead of the index's tree.
    hardware: Option<Hardware>,
    /// Of the next build, and of the last.
    max_radius: [f32; 2],
    neighbours: Arc<Kernel>,
    scan_blocks: Arc<Kernel>,
    scan_sums: Arc<Kernel>,
    scan_offsets: Arc<Kernel>,
    nearest: Arc<Kernel>,
    /// As given, if they came from the host.
    given: Array,
    points: Array,
    n_points: u32,
    queries: Array,
    sorted_queries: Array,
    radii: Array,
    sums: Array,
    sort_queries: bool,
    readback: Readback,
    timer: Timer<3>,
}

impl PointSearch {
    /// Without points.
    pub fn new(context: Arc<Context>) -> Result<Self, Error> {
        Self::with(context, Method::Tree, f32::INFINITY)
    }

    /// Without points, searched by the ray queries of a device that was opened for them
    /// ([`Context::with_ray_queries`]). Queries have radii up to `max_radius`; the smaller that is, the faster they are.
    /// Results are the same but for the order within a row, which the device chooses.
    pub fn hardware(context: Arc<Context>, max_radius: f32) -> Result<Self, Error> {
        Self::with(context, Method::Hardware, max_radius)
    }

    fn with(context: Arc<Context>, method: Method, max_radius: f32) -> Result<Self, Error> {
        check_max_radius(max_radius)?;
        let guard = Arc::clone(&context);
        guard.guarded(|| Self::make(context, method, max_radius))
    }

    fn make(context: Arc<Context>, method: Method, max_radius: f32) -> Result<Self, Error> {
        use Access::{Read, Write};
        let shared = Arc::new(Shared::new(&context, Vec::new()));
        let modules = Modules::new(&context, &shared);
        let index = Index::new(&modules, &Sorted { permute: ("points", "sort_points"), words: WORDS })?;
        let mut neighbours = [Read, Read, Read, Read, Write, Read, Write, Write].map(wgpu::BindingType::from);
        let mut nearest = [Read, Read, Read, Read, Write, Write, Write, Read].map(wgpu::BindingType::from);
        let (modules_of_both, hardware) = match method {
            Method::Tree => (["neighbours", "nearest"], None),
            Method::Hardware => {
                neighbours[TREE] = ACCELERATION_STRUCTURE;
                nearest[TREE] = ACCELERATION_STRUCTURE;
                (["neighbours_hardware", "nearest_hardware"], Some(Hardware::new(&context, &modules)?))
            }
        };
        let scan = [Read, Write, Write];
        let mut search = Self {
            neighbours: modules.kernel(modules_of_both[0], "search", &neighbours)?,
            scan_blocks: modules.kernel("scan", "scan_blocks", &scan)?,
            scan_sums: modules.kernel("scan", "scan_sums", &scan)?,
            scan_offsets: modules.kernel("scan", "scan_offsets", &scan)?,
            nearest: modules.kernel(modules_of_both[1], "search", &nearest)?,
            index,
            hardware,
            max_radius: [max_radius; 2],
            given: Array::new::<Vec3>("points"),
            points: Array::new::<[u32; 4]>("points in tree order"),
            n_points: 0,
            queries: Array::new::<Vec3>("queries"),
            sorted_queries: Array::new::<[u32; 4]>("queries in Morton order"),
            radii: Array::new::<f32>("radii"),
            sums: Array::new::<u32>("sums of blocks of counts"),
            sort_queries: false,
            readback: Readback::default(),
            timer: Timer::new(&context),
            shared,
            context,
        };
        search.build(&[])?;
        Ok(search)
    }

    /// The device.
    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.n_points as usize
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.n_points == 0
    }

    /// The largest radius that may be asked for, infinite unless ray queries search.
    pub fn max_radius(&self) -> f32 {
        self.max_radius[1]
    }

    /// Sets the largest radius from the next build on. Without ray queries any radius may be asked for all the same.
    pub fn set_max_radius(&mut self, max_radius: f32) -> Result<(), Error> {
        check_max_radius(max_radius)?;
        if self.hardware.is_some() {
            self.max_radius[0] = max_radius;
        }
        Ok(())
    }

    /// Most points that fit one binding of this device; its memory may allow fewer.
    pub fn max_points(&self) -> u32 {
        let bytes = self.context.most_bytes_bound() / u64::from(4 * WORDS);
        let most = bytes.min(u64::from(u32::MAX - 1)) as u32;
        if self.hardware.is_some() { most.min(Hardware::max_points(&self.context)) } else { most }
    }

    fn clear(&mut self) {
        self.n_points = 0;
        self.index.levels.clear();
    }

    /// Makes room for `n` points; where there is none, what is bound without points is still there.
    fn reserve_or_keep(&mut self, n: u32) -> Result<(), Error> {
        let result = self.reserve(n);
        if result.is_err() {
            self.reserve(0)?;
            if let Some(hardware) = &mut self.hardware {
                let mut batch = Batch::new(&self.context, &self.shared, "nothing");
                hardware.build(&mut batch, 0, &self.points, WORDS, self.max_radius[1]);
                batch.submit()?;
            }
        }
        result
    }

    fn reserve(&mut self, n: u32) -> Result<(), Error> {
        let roomy = (u64::from(n) + u64::from(n / 16)).min(u64::from(self.max_points()));
        if self.points.capacity() < u64::from(n.max(1)) {
            self.points.reserve(&self.context, roomy.max(u64::from(n)))?;
        }
        match &mut self.hardware {
            None => self.index.reserve(&self.context, n),
            Some(hardware) => {
                self.index.reserve_sort(&self.context, n)?;
                hardware.reserve(&self.context, n)
            }
        }
    }

    /// Replaces the points. They must be finite. After an error there are none.
    pub fn build(&mut self, points: &[Vec3]) -> Result<(), Error> {
        self.clear();
        check_points(points)?;
        self.reserve_or_keep(points.len() as u32)?;
        self.given.write(&self.context, points)?;
        let records = Records { buffer: self.given.raw().clone(), n: points.len() as u32, words: 3 };
        self.build_records(&records)
    }

    /// Replaces the points by `n` records of some 32-bit words each, a position (three `f32`) first in each, in a buffer
    /// with usage `STORAGE`. It is read before anything submitted later, and not needed afterwards. The positions must be
    /// finite; that is not checked: with one that is not, others may be missed. After an error there are no points.
    pub fn build_from(&mut self, buffer: &wgpu::Buffer, n: u32, words_per_record: u32) -> Result<(), Error> {
        self.clear();
        if n == u32::MAX {
            return Err(index::Error::TooMany(n as usize).into());
        }
        let records = Records::check(&self.context, "points", buffer, n, words_per_record)?;
        self.build_records(&records)
    }

    fn build_records(&mut self, records: &Records) -> Result<(), Error> {
        self.reserve_or_keep(records.n)?;
        let mut batch = Batch::new(&self.context, &self.shared, "build");
        self.timer.begin(BUILD, &mut batch);
        let n = records.n;
        match &mut self.hardware {
            None => self.index.build(&mut batch, n, &records.binding(), records.words, &self.points)?,
            Some(hardware) => {
                if n > 0 {
                    self.index.sort(&mut batch, n, &records.binding(), records.words, &self.points)?;
                }
                self.max_radius[1] = self.max_radius[0];
                hardware.build(&mut batch, n, &self.points, WORDS, self.max_radius[1]);
            }
        }
        self.timer.end(BUILD, batch, &self.context)?;
        self.n_points = records.n;
        Ok(())
    }

    /// Whether searches bring their queries into Morton order first (they do not unless told). It pays where neighbouring
    /// queries are far from each other in space and there are many; results come in the caller's order either way.
    pub fn set_sort_queries(&mut self, sort: bool) {
        self.sort_queries = sort;
    }

    /// The boxes of the tree, all levels, leaves first; none where ray queries search.
    pub fn boxes(&mut self) -> Result<Vec<PointBox>, Error> {
        let n = self.index.levels.last().map_or(0, |[first, n]| first + n) as usize;
        if n == 0 {
            return Ok(Vec::new());
        }
        self.readback.read(&self.context, &self.shared, self.index.boxes.raw(), n)
    }

    /// The nodes of the tree: those of all levels but the leaves', in the order of the boxes.
    pub fn nodes(&mut self) -> Result<Vec<TreeNode>, Error> {
        let n = self.index.levels.iter().skip(1).map(|[_, n]| *n as usize).sum();
        if n == 0 {
            return Ok(Vec::new());
        }
        self.readback.read(&self.context, &self.shared, self.index.nodes.raw(), n)
    }

    /// The points in the order of the tree, each with its index.
    pub fn points(&mut self) -> Result<Vec<(Vec3, u32)>, Error> {
        if self.n_points == 0 {
            return Ok(Vec::new());
        }
        let words: Vec<[u32; 4]> =
            self.readback.read(&self.context, &self.shared, self.points.raw(), self.n_points as usize)?;
        let point = |[x, y, z, index]: [u32; 4]| (Vec3::from_array([x, y, z].map(f32::from_bits)), index);
        Ok(words.into_iter().map(point).collect())
    }

    /// Waits for the device; how long the last of each stage took.
    pub fn times(&mut self) -> Result<SearchTimes, Error> {
        let [build, search, fill] = self.timer.read(&self.context, &self.shared, &mut self.readback)?;
        Ok(SearchTimes { build, search, fill })
    }
}

fn check_max_radius(radius: f32) -> Result<(), Error> {
    Ok(index::Radii::One(radius).check(&[], f32::INFINITY)?)
}
