//! A cell on its way to become a node: its triangles, each with the box of its part in the cell.

use rayon::prelude::*;

use super::clip::{Aabb, clip};
use super::events::Events;
use super::quadratic;
use super::sah::{Cheapest, Plane, Sah};
use super::{Builder, KdOptions, Triangles};

/// What is below cells of so many triangles is built by several threads.
pub const PARALLEL: usize = 4096;
/// Triangles that one thread divides at a time.
const PIECE: usize = 4096;

/// A triangle, and the box of what the cell leaves of it.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    pub face: u32,
    pub bounds: Aabb,
}

/// What all cells of a tree have in common.
#[derive(Debug)]
pub struct Task {
    sah: Sah,
    pub parallel: bool,
    /// In the frame.
    corners: Vec<[[f32; 3]; 3]>,
}

/// How a cell looks for its plane, and what it keeps for that.
#[derive(Debug)]
enum Search {
    None,
    Quadratic,
    SortEachNode,
    SortOnce(Events),
}

/// See the module.
#[derive(Debug)]
pub struct Cell {
    bounds: Aabb,
    depth: u32,
    parts: Vec<Part>,
    search: Search,
}

/// What becomes of a cell.
pub enum Node {
    Inner {
        axis: usize,
        at: f32,
        children: Box<[Cell; 2]>,
    },
    /// Triangles, in rising order.
    Leaf(Vec<u32>),
}

/// What a plane makes of the triangles of a cell.
#[derive(Debug, Default)]
pub struct Halves {
    pub parts: [Vec<Part>; 2],
    /// For each triangle of the cell its place in the half that it is in, or [`CUT`].
    pub places: Vec<Place>,
    /// Places in each half of the triangles that the plane cuts.
    pub cut: [Vec<u32>; 2],
}

/// The half in the uppermost bit, and the index there.
pub type Place = u32;
/// The triangle is cut, and has a new box in the halves that it has points in.
pub const CUT: Place = u32::MAX;
/// Bit of the half above.
pub const ABOVE: Place = 1 << 31;

impl Task {
    pub fn new<T: super::Scalar>(triangles: &Triangles<T>, options: &KdOptions) -> Self {
        let parallel = options.parallel && triangles.len() >= PARALLEL;
        Self { sah: options.sah, parallel, corners: triangles.framed(parallel) }
    }

    /// The whole mesh.
    pub fn root(&self, builder: Builder) -> Cell {
        let part = |(face, corners): (usize, &[[f32; 3]; 3])| Part { face: face as u32, bounds: Aabb::of(corners) };
        let parts: Vec<_> = if self.parallel {
            self.corners.par_iter().enumerate().map(part).collect()
        } else {
            self.corners.iter().enumerate().map(part).collect()
        };
        let bounds = parts.iter().fold(Aabb::NOTHING, |b, part| b.with(part.bounds.min).with(part.bounds.max));
        let search = match builder {
            Builder::None => Search::None,
            Builder::Quadratic => Search::Quadratic,
            Builder::SortEachNode => Search::SortEachNode,
            Builder::SortOnce => Search::SortOnce(Events::of(&parts, self.parallel)),
        };
        Cell { bounds, depth: 0, parts, search }
    }
}

impl Cell {
    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.parts.len()
    }

    /// Whether there are fewer cells like it than threads in rayon's pool, so that several of them should open it.
    pub fn is_wide(&self) -> bool {
        self.len() >= PARALLEL && 1usize << self.depth.min(31) < rayon::current_num_threads()
    }

    /// A triangle, below [`Cell::len`]; they are in rising order.
    pub fn face(&self, index: usize) -> Option<u32> {
        self.parts.get(index).map(|part| part.face)
    }

    /// Splits it, or makes it a leaf: `parallel` on all threads of rayon's pool, with the same outcome.
    pub fn open(&self, task: &Task, parallel: bool) -> Node {
        let Some(plane) = self.plane(&task.sah, parallel) else {
            return Node::Leaf(self.parts.iter().map(|part| part.face).collect());
        };
        let cells = self.bounds.cut(plane.axis, plane.at);
        let halves = if parallel {
            let pieces = self.parts.par_chunks(PIECE).map(|parts| divide(parts, &plane, &cells, &task.corners));
            pieces.reduce(Halves::default, Halves::and)
        } else {
            divide(&self.parts, &plane, &cells, &task.corners)
        };
        let searches = match &self.search {
            Search::None => [Search::None, Search::None],
            Search::Quadratic => [Search::Quadratic, Search::Quadratic],
            Search::SortEachNode => [Search::SortEachNode, Search::SortEachNode],
            Search::SortOnce(events) => events.divide(&halves, parallel).map(Search::SortOnce),
        };
        let [below, above] = halves.parts;
        let child = |bounds, parts, search| Cell { bounds, depth: self.depth + 1, parts, search };
        let ([cell_below, cell_above], [search_below, search_above]) = (cells, searches);
        let children = Box::new([child(cell_below, below, search_below), child(cell_above, above, search_above)]);
        Node::Inner { axis: plane.axis, at: plane.at, children }
    }

    fn plane(&self, sah: &Sah, parallel: bool) -> Option<Plane> {
        if self.depth >= sah.max_depth {
            return None;
        }
        let mut cheapest = Cheapest::new(sah, &self.bounds);
        match &self.search {
            Search::None => {}
            Search::Quadratic => quadratic::offer(&self.parts, &mut cheapest),
            Search::SortEachNode => {
                Events::of(&self.parts, parallel).offer(self.parts.len(), &mut cheapest, parallel);
            }
            Search::SortOnce(events) => events.offer(self.parts.len(), &mut cheapest, parallel),
        }
        cheapest.worth(self.parts.len())
    }
}

/// Who is where. Triangles that the plane cuts are clipped again, to both halves; the others keep their boxes.
fn divide(parts: &[Part], plane: &Plane, cells: &[Aabb; 2], corners: &[[[f32; 3]; 3]]) -> Halves {
    let mut halves = Halves {
        parts: [(); 2].map(|()| Vec::with_capacity(parts.len())),
        places: Vec::with_capacity(parts.len()),
        cut: [Vec::new(), Vec::new()],
    };
    for &part in parts {
        let (min, max) = (part.bounds.min[plane.axis], part.bounds.max[plane.axis]);
        let planar = min == plane.at && max == plane.at;
        if planar || max <= plane.at || min >= plane.at {
            let above = if planar { !plane.planar_below } else { min >= plane.at };
            let half = &mut halves.parts[usize::from(above)];
            halves.places.push(half.len() as u32 | if above { ABOVE } else { 0 });
            half.push(part);
        } else {
            halves.places.push(CUT);
            for ((cell, half), cut) in cells.iter().zip(&mut halves.parts).zip(&mut halves.cut) {
                if let Some(bounds) = clip(&corners[part.face as usize], cell) {
                    cut.push(half.len() as u32);
                    half.push(Part { bounds, ..part });
                }
            }
        }
    }
    halves
}

impl Halves {
    /// Of the triangles of both, these first.
    fn and(mut self, other: Self) -> Self {
        let counts = [0, 1].map(|half| self.parts[half].len() as u32);
        self.places.extend(other.places.iter().map(|&place| match place {
            CUT => CUT,
            _ => place + counts[usize::from(place & ABOVE != 0)],
        }));
        for (half, other) in self.parts.iter_mut().zip(&other.parts) {
            half.extend_from_slice(other);
        }
        for ((half, other), count) in self.cut.iter_mut().zip(&other.cut).zip(counts) {
            half.extend(other.iter().map(|index| index + count));
        }
        self
    }
}
