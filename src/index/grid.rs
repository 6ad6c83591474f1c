//! A hash grid: cells as long as the radius, points sorted by cell, a query looks into the 3 × 3 × 3 cells about it.
//!
//! Cells are kept in bricks of 8 × 4 × 4; a brick's place in the table is its own where the grid is small enough, and a
//! hash of its coordinates where it is not, so that memory is bounded by the number of points whatever their extent.
//! Bricks that share a place cost time only: no two cells of one query ever share a slot, since a brick is at least as
//! long as the query's window along each axis, and points of other bricks fail the distance test.

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;

use super::batch::fold_each;
use super::blocks::{self, Blocks, Hits, Splat, Walk, bounds, reach, splat};
use super::lanes::Lanes;
use super::stats::{CountVisits, Tally, Visits};
use super::{Error, Nearest, Radii, RadiusSearch, check_points, check_radius, radius2};

/// Cells of a brick along each axis, as powers of two.
const BITS: [u32; 3] = [3, 2, 2];
const BRICK: usize = 1 << (BITS[0] + BITS[1] + BITS[2]);
/// Cells a query's window may span along an axis.
const WINDOW: usize = 4;
/// A cell is at least this part of the largest coordinate, so that rounding cannot widen a query's window past
/// [`WINDOW`].
const FINEST: f32 = 1.0 / (1 << 20) as f32;
/// The inverse of a longer edge is not a normal number.
const LONGEST: f32 = 1e37;
/// Slots of the table are counted in 32 bits.
const MAX_BRICKS: usize = 1 << 23;
/// Fewer queries are not worth sorting.
const FEW: usize = 4096;
/// Queries that are sorted together, by one thread: at most.
const MANY: usize = 1 << 18;

/// Whether `fold_all` and `count_all` sort a batch, by bricks of cells, before they answer it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum QueryOrder {
    /// Sorted where neighbours in the slice are not neighbours in space.
    #[default]
    Auto,
    /// As given.
    AsGiven,
    /// Sorted.
    Sorted,
}

/// See the module.
#[derive(Clone, Debug, Default)]
pub struct HashGrid {
    /// For which it was built.
    radius: f32,
    /// Length of a cell.
    edge: f32,
    /// Cells a unit of length; 0 for one cell that holds all.
    scale: f32,
    /// `scale` · the least corner.
    base: Vec3,
    /// Cells of rounding that a distance between cells may be off by.
    slack: f32,
    /// Last cell along each axis.
    last: [u32; 3],
    hash: BrickHash,
    /// `[slots + 1]`: the points of slot s are `starts[s] .. starts[s + 1]` of the blocks.
    starts: Vec<u32>,
    blocks: Blocks,
    slots: Vec<u32>,
    /// How batches are answered.
    pub query_order: QueryOrder,
}

/// Place of a brick: (x · a + y · b + z · c) >> shift.
#[derive(Clone, Copy, Debug, Default)]
struct BrickHash {
    factors: [u32; 3],
    shift: u32,
}

impl HashGrid {
    /// Over all of `points`, for radii up to `radius`.
    pub fn new(points: &[Vec3], radius: f32) -> Result<Self, Error> {
        let mut grid = Self::default();
        grid.rebuild(points, radius)?;
        Ok(grid)
    }

    /// Over other points, or for another radius, reusing the memory. After an error the grid is what it was.
    pub fn rebuild(&mut self, points: &[Vec3], radius: f32) -> Result<(), Error> {
        check_points(points)?;
        check_radius(radius)?;
        self.radius = radius;
        self.blocks.order.clear();
        self.starts.clear();
        if points.is_empty() {
            self.blocks.fill(points);
            return Ok(());
        }
        let (min, max) = bounds(points);
        let largest = min.abs().max(max.abs()).max_element();
        self.edge = reach(radius2(radius)).max(largest * FINEST).min(f32::MAX);
        self.scale = if self.edge < LONGEST { 1.0 / self.edge } else { 0.0 };
        self.base = min * self.scale;
        self.slack = largest * self.scale / (1 << 21) as f32;
        self.last = [0, 1, 2].map(|axis| self.cell(max[axis], axis));
        let n_bricks = (2 * points.len()).next_power_of_two().div_ceil(BRICK).min(MAX_BRICKS);
        self.hash = BrickHash::new(self.last, n_bricks);
        let n_slots = self.hash.n_bricks(self.last, n_bricks) * BRICK;
        self.sort(points, n_slots);
        self.blocks.fill(points);
        Ok(())
    }

    /// Along an axis; monotonic, and 0 for whatever lies before the first.
    #[inline]
    fn cell(&self, x: f32, axis: usize) -> u32 {
        (x * self.scale - self.base[axis]) as u32
    }

    #[inline]
    fn slot(&self, p: Vec3) -> usize {
        let [x, y, z] = [0, 1, 2].map(|axis| self.cell(p[axis], axis).min(self.last[axis]));
        self.hash.row(y, z).slot(x)
    }

    /// Counting sort; points of a slot in order of the index.
    fn sort(&mut self, points: &[Vec3], n_slots: usize) {
        let mut slots = std::mem::take(&mut self.slots);
        points.par_iter().with_min_len(8192).map(|&p| self.slot(p) as u32).collect_into_vec(&mut slots);
        counting_sort(&slots, n_slots, &mut self.starts, &mut self.blocks.order);
        self.slots = slots;
    }

    #[inline(always)]
    fn scan_row<L: Lanes, S, B>(
        &self,
        on: L,
        row: Row,
        (mut x, last): (u32, u32),
        splat: &Splat<L>,
        state: &mut S,
        tally: &mut impl Tally,
        bound: &impl Fn(&S) -> f32,
        visit: &mut impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        // Cells of a row lie side by side, up to the end of the brick.
        while x <= last {
            let end = (x | ((1 << BITS[0]) - 1)).min(last);
            let slot = row.slot(x);
            let (from, to) = (self.starts[slot], self.starts[slot + (end - x) as usize + 1]);
            tally.node();
            self.blocks.scan(on, from as usize..to as usize, splat, state, tally, bound, visit)?;
            x = end + 1;
        }
        ControlFlow::Continue(())
    }

    /// First and last cell within the reach along an axis.
    #[inline]
    fn window(&self, x: f32, reach: f32, axis: usize) -> Option<(u32, u32)> {
        let (from, to) = ((x - reach).max(f32::MIN), (x + reach).min(f32::MAX));
        let to_cell = to * self.scale - self.base[axis];
        let (from, to) = (self.cell(from, axis), (to_cell as u32).min(self.last[axis]));
        (to_cell >= 0.0 && from <= to).then(|| {
            debug_assert!(((to - from) as usize) < WINDOW, "window {from} to {to}");
            (from, to)
        })
    }

    /// Cells of a window, nearest first, each with a square that no point of it comes nearer than along this axis.
    #[inline]
    fn rows(&self, x: f32, (from, to): (u32, u32), axis: usize) -> [(u32, f32); WINDOW] {
        let at = x * self.scale - self.base[axis];
        let mut rows = [(u32::MAX, f32::INFINITY); WINDOW];
        for cell in from..=to {
            let below = cell as f32;
            let cells = (below - at).max(at - (below + 1.0)) - self.slack;
            let distance = cells.max(0.0) * (1.0 - 1e-6) * self.edge;
            let row = (cell, distance * distance);
            let mut place = (cell - from) as usize;
            while place > 0 && row.1 < rows[place - 1].1 {
                rows[place] = rows[place - 1];
                place -= 1;
            }
            rows[place] = row;
        }
        rows
    }

    /// Whether most queries lie within a few cells of the one before.
    fn is_coherent(&self, queries: &[Vec3]) -> bool {
        let step = (queries.len() / 512).max(1);
        let pairs = queries.windows(2).step_by(step);
        let n = pairs.len();
        let near = pairs.filter(|pair| ((pair[0] - pair[1]) * self.scale).abs().max_element() < 2.0).count();
        2 * near >= n
    }
}

impl Walk for HashGrid {
    /// Visits what is within the reach, nearest rows of cells first; `bound` of the state may shrink as `visit` changes it.
    #[inline(always)]
    fn walk<L: Lanes, S, B>(
        &self,
        on: L,
        centre: Vec3,
        radius: f32,
        state: &mut S,
        tally: &mut impl Tally,
        bound: impl Fn(&S) -> f32,
        mut visit: impl FnMut(&mut S, Hits<L>) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        if self.is_empty() {
            return ControlFlow::Continue(());
        }
        let reach = reach(radius2(radius));
        let Some(x) = self.window(centre.x, reach, 0) else { return ControlFlow::Continue(()) };
        let Some(y) = self.window(centre.y, reach, 1) else { return ControlFlow::Continue(()) };
        let Some(z) = self.window(centre.z, reach, 2) else { return ControlFlow::Continue(()) };
        let (ys, zs) = (self.rows(centre.y, y, 1), self.rows(centre.z, z, 2));
        let splat = splat(on, centre);
        for &(z, z2) in &zs[..=(z.1 - z.0) as usize] {
            for &(y, y2) in &ys[..=(y.1 - y.0) as usize] {
                if y2 + z2 <= bound(state) {
                    self.scan_row(on, self.hash.row(y, z), x, &splat, state, tally, &bound, &mut visit)?;
                }
            }
        }
        ControlFlow::Continue(())
    }
}

impl RadiusSearch for HashGrid {
    fn len(&self) -> usize {
        self.blocks.len()
    }

    fn max_radius(&self) -> f32 {
        self.radius
    }

    #[inline]
    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        blocks::within(self, centre, radius, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        blocks::nearest(self, centre, radius, nearest);
    }

    fn fold_all<T: Send>(
        &self,
        queries: &[Vec3],
        radii: Radii<'_>,
        start: impl Fn(usize) -> T + Sync,
        visit: impl Fn(&mut T, u32, f32) + Sync,
    ) -> Result<Vec<T>, Error> {
        let sorted = match self.query_order {
            QueryOrder::AsGiven => false,
            QueryOrder::Sorted => true,
            QueryOrder::Auto => queries.len() >= FEW && !self.is_coherent(queries),
        };
        if !sorted || self.is_empty() {
            return fold_each(self, queries, radii, start, visit);
        }
        radii.check(queries, self.max_radius())?;
        let mut states: Vec<T> = (0..queries.len()).into_par_iter().with_min_len(FEW).map(&start).collect();
        let size = queries.len().div_ceil(2 * rayon::current_num_threads()).clamp(FEW, MANY);
        states.par_chunks_mut(size).zip(queries.par_chunks(size)).enumerate().for_each(|(block, (states, queries))| {
            let bricks: Vec<u32> = queries.iter().map(|&q| (self.slot(q) / BRICK) as u32).collect();
            let (mut starts, mut order) = (Vec::new(), Vec::new());
            counting_sort(&bricks, self.starts.len() / BRICK, &mut starts, &mut order);
            for query in order.into_iter().map(|query| query as usize) {
                let radius = radii.of(block * size + query);
                self.within(queries[query], radius, |i, d2| visit(&mut states[query], i, d2));
            }
        });
        Ok(states)
    }
}

impl CountVisits for HashGrid {
    /// A node is a run of cells that lie side by side.
    fn visits(&self, centre: Vec3, radius: f32) -> Visits {
        blocks::visits(self, centre, radius)
    }
}

/// Indices in order of their slot, then of themselves; those of slot s are `starts[s] .. starts[s + 1]`.
fn counting_sort(slots: &[u32], n_slots: usize, starts: &mut Vec<u32>, order: &mut Vec<u32>) {
    starts.clear();
    starts.resize(n_slots + 1, 0);
    for &slot in slots {
        starts[slot as usize] += 1;
    }
    let mut end = 0;
    for start in starts.iter_mut() {
        end += *start;
        *start = end;
    }
    order.clear();
    order.resize(slots.len(), 0);
    for (i, &slot) in slots.iter().enumerate().rev() {
        let start = &mut starts[slot as usize];
        *start -= 1;
        order[*start as usize] = i as u32;
    }
}

/// Cells that differ in x alone.
#[derive(Clone, Copy)]
struct Row {
    hash: BrickHash,
    brick: u32,
    cell: usize,
}

impl Row {
    #[inline]
    fn slot(self, x: u32) -> usize {
        let brick = (x >> BITS[0]).wrapping_mul(self.hash.factors[0]).wrapping_add(self.brick);
        let brick = (u64::from(brick) >> self.hash.shift) as usize;
        brick * BRICK + self.cell + (x as usize & ((1 << BITS[0]) - 1))
    }
}

impl BrickHash {
    /// Over cells 0 … last, for a table of `n_bricks`, a power of two.
    fn new(last: [u32; 3], n_bricks: usize) -> Self {
        let [nx, ny, nz] = bricks(last);
        if nx * ny * nz <= 2 * n_bricks as u64 {
            return Self { factors: [1, nx as u32, (nx * ny) as u32], shift: 0 };
        }
        // A lattice: 2^32 times the fractional parts of 1/ρ, 1/ρ², 1/ρ³, ρ the root of ρ⁴ = ρ + 1.
        Self { factors: [0xd1b5_4a33, 0xabc9_8389, 0x8cb9_2ba7], shift: 32 - n_bricks.trailing_zeros() }
    }

    /// Bricks the table needs.
    fn n_bricks(&self, last: [u32; 3], n_bricks: usize) -> usize {
        let [nx, ny, nz] = bricks(last);
        if self.shift == 0 { (nx * ny * nz) as usize } else { n_bricks }
    }

    #[inline]
    fn row(self, y: u32, z: u32) -> Row {
        let brick =
            (y >> BITS[1]).wrapping_mul(self.factors[1]).wrapping_add((z >> BITS[2]).wrapping_mul(self.factors[2]));
        let (y, z) = (y as usize & ((1 << BITS[1]) - 1), z as usize & ((1 << BITS[2]) - 1));
        Row { hash: self, brick, cell: (z << BITS[1] | y) << BITS[0] }
    }
}

fn bricks(last: [u32; 3]) -> [u64; 3] {
    [0, 1, 2].map(|axis| u64::from(last[axis] >> BITS[axis]) + 1)
}
