//! The implicit tree over points: Morton order, radix sort, boxes level by level.

use std::sync::Arc;

use super::buffers::Array;
use super::context::{Context, DeviceKind};
use super::kernels::{Access, Arguments, Batch, Kernel, Modules};
use crate::device::Error;
use crate::layout::{FANOUT, LEAF_SIZE, PointBox, TreeNode};

/// Points a workgroup of `bounds.wgsl` handles: `BLOCK` there.
const BLOCK: u32 = 2048;
/// Keys a thread of `sort.wgsl` takes, at most 1023 for its 16-bit counters: hardware wants many workgroups, software few,
/// for each costs it a pass over its counters.
const KEYS_A_THREAD: [u32; 2] = [32, 128];
/// Bits of a digit in `sort.wgsl`.
const DIGIT_BITS: u32 = 7;
/// Digits of a 63-bit key.
const N_PASSES: u32 = 9;
/// Threads a workgroup.
const THREADS: u32 = 64;

/// First box and number of boxes of each level, leaves first, down to a single box; empty without points.
pub(super) fn levels(n_points: u32) -> Vec<[u32; 2]> {
    let mut levels = Vec::new();
    let mut first = 0;
    let mut n = n_points.div_ceil(LEAF_SIZE);
    while n > 0 {
        levels.push([first, n]);
        first += n;
        n = if n == 1 { 0 } else { n.div_ceil(FANOUT) };
    }
    levels
}

/// What lies in the order of the tree: records whose position comes first.
pub(super) struct Sorted {
    /// Module and entry point of the kernel that moves them there: reads the order and the records, writes them in that
    /// order; its arguments are their number and the words of a record before.
    pub(super) permute: (&'static str, &'static str),
    /// Words of a record there.
    pub(super) words: u32,
}

/// Kernels and memory of the build.
pub(super) struct Index {
    keys_a_thread: u32,
    bounds_of_blocks: Arc<Kernel>,
    bounds_of_all: Arc<Kernel>,
    morton_keys: Arc<Kernel>,
    sort_count: Arc<Kernel>,
    sort_scan: Arc<Kernel>,
    sort_scatter: Arc<Kernel>,
    permute: Arc<Kernel>,
    words: u32,
    tree_leaves: Arc<Kernel>,
    tree_level: Arc<Kernel>,
    blocks: Array,
    pub(super) bounds: Array,
    keys: [Array; 2],
    order: [Array; 2],
    counts: Array,
    totals: Array,
    /// All levels, leaves first.
    pub(super) boxes: Array,
    /// All levels but the leaves.
    pub(super) nodes: Array,
    /// [`levels`] of the last build.
    pub(super) levels: Vec<[u32; 2]>,
    /// Parts of the sort between two chances of an interrupt: passes, and the move of the records.
    pub(super) parts_at_once: u32,
}

impl Index {
    /// Of a sort: each pass over a digit, and the move of the records; the tree besides counts as one.
    #[cfg(feature = "render")]
    pub(super) const N_PARTS: u32 = N_PASSES + 2;

    pub(super) fn new(modules: &Modules<'_>, sorted: &Sorted) -> Result<Self, Error> {
        use Access::{Read, Write};
        let bounds = [Read, Write, Write];
        let sort = [Read, Read, Write, Write, Write, Write];
        let software = modules.context().info().kind == DeviceKind::Cpu;
        Ok(Self {
            keys_a_thread: KEYS_A_THREAD[usize::from(software)],
            bounds_of_blocks: modules.kernel("bounds", "bounds_of_blocks", &bounds)?,
            bounds_of_all: modules.kernel("bounds", "bounds_of_all", &bounds)?,
            morton_keys: modules.kernel("morton", "morton_keys", &[Read, Read, Write, Write])?,
            sort_count: modules.kernel("sort", "sort_count", &sort)?,
            sort_scan: modules.kernel("sort", "sort_scan", &sort)?,
            sort_scatter: modules.kernel("sort", "sort_scatter", &sort)?,
            permute: modules.kernel(sorted.permute.0, sorted.permute.1, &[Read, Read, Write])?,
            words: sorted.words,
            tree_leaves: modules.kernel("tree", "tree_leaves", &[Read, Write, Write])?,
            tree_level: modules.kernel("tree", "tree_level", &[Read, Write, Write])?,
            blocks: Array::new::<PointBox>("bounds of blocks of points"),
            bounds: Array::new::<PointBox>("bounds of the points"),
            keys: [Array::new::<[u32; 2]>("sort keys"), Array::new::<[u32; 2]>("sort keys")],
            order: [Array::new::<u32>("sort order"), Array::new::<u32>("sort order")],
            counts: Array::new::<u32>("sort counts"),
            totals: Array::new::<u32>("sort totals"),
            boxes: Array::new::<PointBox>("boxes of the tree over points"),
            nodes: Array::new::<TreeNode>("tree over points"),
            levels: Vec::new(),
            parts_at_once: 1,
        })
    }

    /// Makes room for the tree over `n` points.
    pub(super) fn reserve(&mut self, context: &Context, n: u32) -> Result<(), Error> {
        self.reserve_sort(context, n)?;
        let (levels_now, roomy_levels) = (levels(n), levels(roomy(n).min(u64::from(u32::MAX)) as u32));
        let n_boxes = |levels: &[[u32; 2]]| levels.iter().map(|l| u64::from(l[1])).sum::<u64>().max(1);
        // Every box but a leaf's is a node.
        let n_nodes = |levels: &[[u32; 2]]| n_boxes(levels.get(1..).unwrap_or_default());
        room(context, &mut self.boxes, n_boxes(&levels_now), n_boxes(&roomy_levels))?;
        room(context, &mut self.nodes, n_nodes(&levels_now), n_nodes(&roomy_levels))
    }

    /// Makes room for a sort of `n` points.
    pub(super) fn reserve_sort(&mut self, context: &Context, n: u32) -> Result<(), Error> {
        let (n, roomy) = (u64::from(n), roomy(n));
        let room = |array: &mut Array, needed: u64, roomy: u64| room(context, array, needed, roomy);
        let n_blocks = |n: u64| n.div_ceil(u64::from(BLOCK));
        let n_sorted = |n: u64| n.div_ceil(u64::from(THREADS * self.keys_a_thread));
        room(&mut self.blocks, n_blocks(n), n_blocks(roomy))?;
        room(&mut self.bounds, 1, 1)?;
        for i in 0..2 {
            room(&mut self.keys[i], n, roomy)?;
            room(&mut self.order[i], n, roomy)?;
        }
        let digits = 1 << DIGIT_BITS;
        room(&mut self.counts, digits * n_sorted(n), digits * n_sorted(roomy))?;
        room(&mut self.totals, digits, digits)
    }

    /// Records the sort of `n` records of some words each into `sorted`, and the tree over them. Call [`Index::reserve`]
    /// first.
    pub(super) fn build(
        &mut self,
        batch: &mut Batch<'_>,
        n: u32,
        records: &wgpu::BindingResource<'_>,
        words: u32,
        sorted: &Array,
    ) -> Result<(), Error> {
        self.levels = levels(n);
        if n == 0 {
            return Ok(());
        }
        self.sort(batch, n, records, words, sorted)?;

        let tree = [sorted.all(), self.boxes.all(), self.nodes.all()];
        let [_, n_leaves] = self.levels[0];
        batch.dispatch(&self.tree_leaves, &tree, [n, n_leaves, self.words, 0], n_leaves.div_ceil(THREADS));
        for pair in self.levels.windows(2) {
            let ([below, n_below], [first, n]) = (pair[0], pair[1]);
            let arguments = self.arguments([below, n_below, first, n]);
            batch.dispatch(&self.tree_level, &tree, arguments, n.div_ceil(THREADS));
        }
        Ok(())
    }

    /// Records the sort alone, `n` > 0. Call [`Index::reserve_sort`] first.
    pub(super) fn sort(
        &self,
        batch: &mut Batch<'_>,
        n: u32,
        records: &wgpu::BindingResource<'_>,
        words: u32,
        sorted: &Array,
    ) -> Result<(), Error> {
        let n_blocks = n.div_ceil(BLOCK);
        let n_sorted = n.div_ceil(THREADS * self.keys_a_thread);
        let groups = n.div_ceil(THREADS);
        let bounds = [records.clone(), self.blocks.all(), self.bounds.all()];
        batch.dispatch(&self.bounds_of_blocks, &bounds, [n, words, 0, 0], n_blocks);
        batch.dispatch(&self.bounds_of_all, &bounds, [n, 0, 0, 0], 1);
        let morton = [records.clone(), self.bounds.all(), self.keys[0].all(), self.order[0].all()];
        batch.dispatch(&self.morton_keys, &morton, [n, words, 0, 0], groups);

        for pass in 0..N_PASSES {
            let (from, to) = ((pass % 2) as usize, (1 - pass % 2) as usize);
            let buffers = [
                self.keys[from].all(),
                self.order[from].all(),
                self.keys[to].all(),
                self.order[to].all(),
                self.counts.all(),
                self.totals.all(),
            ];
            let arguments = [n, pass * DIGIT_BITS, n_sorted, self.keys_a_thread];
            self.cut(batch, pass)?;
            batch.dispatch(&self.sort_count, &buffers, arguments, n_sorted);
            batch.dispatch(&self.sort_scan, &buffers, arguments, 1 << DIGIT_BITS);
            batch.dispatch(&self.sort_scatter, &buffers, arguments, n_sorted);
        }
        let last = (N_PASSES % 2) as usize;
        let buffers = [self.order[last].all(), records.clone(), sorted.all()];
        self.cut(batch, N_PASSES)?;
        batch.dispatch(&self.permute, &buffers, [n, words, 0, 0], groups);
        Ok(())
    }

    /// Before a part of the sort, if an interrupt asks for it.
    fn cut(&self, batch: &mut Batch<'_>, part: u32) -> Result<(), Error> {
        if part.is_multiple_of(self.parts_at_once) {
            batch.cut_if_interruptible(0)?;
        }
        Ok(())
    }

    /// With the levels of the tree, which walks and builds of it read.
    pub(super) fn arguments(&self, values: [u32; 4]) -> Arguments {
        let mut arguments = Arguments::from(values);
        for (to, from) in arguments.levels.iter_mut().zip(&self.levels) {
            *to = *from;
        }
        arguments
    }
}

/// A little more than asked, for the number changes from one build to the next.
fn roomy(n: u32) -> u64 {
    u64::from(n) + u64::from(n / 16)
}

fn room(context: &Context, array: &mut Array, needed: u64, roomy: u64) -> Result<(), Error> {
    if array.capacity() >= needed.max(1) { Ok(()) } else { array.reserve(context, roomy.max(1)) }
}
