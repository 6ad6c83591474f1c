//! The tree without its mesh.

use std::ops::ControlFlow;

use super::mesh::Frame;
use super::tree::Tree;
use super::{Ray, Scalar, walk};

/// Which triangles a ray may meet, for whoever keeps them elsewhere and has a test of his own.
#[derive(Clone, Debug)]
pub struct FaceTree {
    frame: Frame,
    tree: Tree,
}

impl FaceTree {
    pub(super) fn new(frame: Frame, mut tree: Tree, name: impl Fn(u32) -> u32) -> Self {
        tree.rename(name);
        Self { frame, tree }
    }

    /// Calls `visit` with the triangles near the ray, cell by cell from near to far, until it breaks: most are not hit, and
    /// some come several times. It returns the largest t that it still wants.
    ///
    /// `roundings` says how wide to look: none is missed that the ray passes within so many units in the last place of `T`,
    /// taken at the distance of the ray's origin from the mesh's centre plus the mesh's size.
    #[inline]
    pub fn try_faces<T: Scalar, B>(
        &self,
        ray: &Ray<T>,
        roundings: f64,
        visit: impl FnMut(u32) -> ControlFlow<B, T>,
    ) -> ControlFlow<B> {
        walk::faces(&self.tree, &self.frame, roundings, ray, visit)
    }

    /// Inner nodes and leaves.
    pub fn n_nodes(&self) -> usize {
        self.tree.len()
    }

    /// Of nodes and lists of triangles.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
    }
}
