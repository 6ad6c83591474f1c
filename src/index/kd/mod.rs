//! kd-trees over triangles, for rays.
//!
//! Four builders ([`Builder`]) emit one [`KdTree`]; the three real ones emit the same tree, plane by plane. The build takes
//! the surface area heuristic with split candidates from triangles clipped to the cell, and tries planar triangles on both
//! sides (Wald & Havran 2006, "On building fast kd-Trees for Ray Tracing, and on doing that in O(N log N)"). [`LazyKd`]
//! builds what rays reach, or grows beside them. Queries ([`RaySearch`]) are watertight, in single or double precision.
//!
//! # Precision
//!
//! Planes are single precision in either case, in a frame that the mesh's box fills: nodes of eight bytes, one builder,
//! and the same tree at every power of two of the unit. Rays treat planes as thick as that rounding, and test triangles
//! with the corners as given, so a tree finds what a test of every triangle finds ([`EveryTriangle`]); only triangles smaller
//! than some 10⁻⁷ of the mesh cannot be kept apart.
//!
//! ```
//! use sunfleck::index::kd::{KdOptions, KdTree, Ray, RaySearch, Triangles};
//!
//! let corners = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
//! let tree = KdTree::new(Triangles::<f64>::new(corners, vec![[0, 1, 2]])?, &KdOptions::default())?;
//! let hit = tree.nearest(&Ray::new([0.25, 0.25, 0.0], [0.0, 0.0, 2.0])?).expect("it is there");
//! assert_eq!((hit.face, hit.t, hit.u, hit.v), (0, 0.5, 0.25, 0.25));
//! # Ok::<(), sunfleck::index::kd::Error>(())
//! ```

mod cell;
mod clip;
mod events;
mod faces;
mod lazy;
mod mesh;
mod quadratic;
mod query;
mod ray;
mod sah;
mod scalar;
mod tree;
mod walk;

use std::ops::ControlFlow;

pub use faces::FaceTree;
pub use lazy::LazyKd;
pub use mesh::Triangles;
pub use query::{EveryTriangle, RaySearch};
pub use ray::{Hit, Ray};
pub use sah::Sah;
pub use scalar::Scalar;

use cell::Task;
use tree::Tree;
use walk::{Nodes, Opened};

/// Why there is no tree, or no ray.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// NaN, infinite, or beyond [`Scalar::EXPONENT`].
    #[error("vertex {0} is not finite, or too far")]
    Vertex(usize),
    /// A face names a vertex that is not there.
    #[error("face {face} has vertex {corner} of {vertices}")]
    Index {
        /// Which face.
        face: usize,
        /// What it names.
        corner: u32,
        /// How many there are.
        vertices: usize,
    },
    /// Products of its lengths would vanish.
    #[error("a mesh of half-size {0:e} is too small for its precision")]
    TooSmall(f64),
    /// More triangles, or a larger tree, than indices count.
    #[error("{0} triangles are too many")]
    TooMany(usize),
    /// Costs are finite and not negative, the depth is at most [`Sah::MAX_DEPTH`].
    #[error("no tree can be built with {0:?}")]
    Sah(Sah),
    /// NaN, infinite, or beyond [`Scalar::EXPONENT`].
    #[error("the origin of a ray is not finite, or too far")]
    Origin,
    /// NaN, infinite, zero, or beyond [`Scalar::EXPONENT`].
    #[error("the direction of a ray is not finite, or its length is out of range")]
    Direction,
}

/// How a tree is built, from N triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Builder {
    /// No tree: one leaf.
    None,
    /// O(N²): each plane is counted anew. The oracle.
    Quadratic,
    /// O(N log² N): a sweep over events that each node sorts.
    SortEachNode,
    /// O(N log N): the events are sorted once.
    #[default]
    SortOnce,
}

/// What a build takes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KdOptions {
    /// All but [`Builder::None`] give the same tree.
    pub builder: Builder,
    /// What a split costs.
    pub sah: Sah,
    /// Whether to build, or to grow, on all threads of rayon's pool: the same tree, too.
    pub parallel: bool,
}

/// A node of a tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NodeView<'a> {
    /// Split at a plane.
    Inner {
        /// 0, 1 or 2.
        axis: usize,
        /// In the unit of the mesh.
        at: f64,
    },
    /// Triangles, in rising order.
    Leaf(&'a [u32]),
}

/// A finished tree, and its mesh.
#[derive(Clone, Debug)]
pub struct KdTree<T> {
    triangles: Triangles<T>,
    tree: Tree,
}

impl<T: Scalar> KdTree<T> {
    /// Builds the whole tree.
    pub fn new(triangles: Triangles<T>, options: &KdOptions) -> Result<Self, Error> {
        options.sah.check()?;
        let task = Task::new(&triangles, options);
        let tree = Tree::build(task.root(options.builder), &task, options.parallel);
        Self::of(triangles, tree)
    }

    fn of(triangles: Triangles<T>, tree: Tree) -> Result<Self, Error> {
        if tree.fits() { Ok(Self { triangles, tree }) } else { Err(Error::TooMany(triangles.len())) }
    }

    /// All nodes, each before its children, the child below before the one above.
    pub fn nodes(&self) -> impl Iterator<Item = NodeView<'_>> {
        (0..self.tree.len() as u32).map(|node| match (&self.tree).open(node) {
            Opened::Inner { axis, at, .. } => NodeView::Inner { axis, at: self.triangles.frame.back(axis, at) },
            Opened::Leaf(faces) => NodeView::Leaf(faces),
        })
    }

    /// Of the tree alone, without the mesh.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }

    /// The tree alone, its faces called what `name` says.
    pub fn into_faces(self, name: impl Fn(u32) -> u32) -> FaceTree {
        FaceTree::new(self.triangles.frame, self.tree, name)
    }

    /// The mesh again.
    pub fn into_triangles(self) -> Triangles<T> {
        self.triangles
    }
}

impl<T: Scalar> RaySearch<T> for KdTree<T> {
    fn triangles(&self) -> &Triangles<T> {
        &self.triangles
    }

    fn try_hits<B>(&self, ray: &Ray<T>, visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B> {
        walk::hits(&self.tree, &self.triangles, ray, visit)
    }
}
