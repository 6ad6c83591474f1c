//! The tree as it is kept: eight bytes a node, no pointers.
//!
//! Nodes are in the order of a walk that goes below first: the child below stands behind its parent, and the parent says
//! where the one above is. A parallel build makes parts of that order and joins them, so it gives the same tree.

use super::cell::{Cell, Node, PARALLEL, Task};
use super::walk::{Nodes, Opened};

const LEAF: u32 = 3;

/// An inner node has the plane's place and, above two bits of axis, the child above. A leaf has its first item and, above
/// two bits that are 3, how many.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Packed {
    at: u32,
    link: u32,
}

const _: () = assert!(size_of::<Packed>() == 8);

/// See the module.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tree {
    nodes: Vec<Packed>,
    /// Triangles of the leaves.
    items: Vec<u32>,
}

impl Tree {
    /// Of all that is below a cell.
    pub fn build(cell: Cell, task: &Task, parallel: bool) -> Self {
        let mut tree = Self::default();
        tree.push(cell, task, parallel);
        tree.shrunk()
    }

    /// Without room for more.
    pub(super) fn shrunk(mut self) -> Self {
        self.nodes.shrink_to_fit();
        self.items.shrink_to_fit();
        self
    }

    /// The same, of a cell that is open.
    pub(super) fn of(node: Node, task: &Task) -> Self {
        let mut tree = Self::default();
        tree.push_node(node, task, false);
        tree.shrunk()
    }

    fn push(&mut self, cell: Cell, task: &Task, parallel: bool) {
        let parallel = parallel && cell.len() >= PARALLEL;
        let node = cell.open(task, parallel && cell.is_wide());
        drop(cell);
        self.push_node(node, task, parallel);
    }

    fn push_node(&mut self, node: Node, task: &Task, parallel: bool) {
        match node {
            Node::Leaf(faces) => {
                self.nodes.push(Packed { at: self.items.len() as u32, link: (faces.len() as u32) << 2 | LEAF });
                self.items.extend(faces);
            }
            Node::Inner { axis, at, children } => {
                let [below, above] = *children;
                self.push_both(
                    (axis, at),
                    parallel,
                    |tree| tree.push(below, task, parallel),
                    |tree| tree.push(above, task, parallel),
                );
            }
        }
    }

    /// An inner node with what is below its plane and above it, `parallel` beside each other.
    pub(super) fn push_both(
        &mut self,
        (axis, at): (usize, f32),
        parallel: bool,
        below: impl FnOnce(&mut Self) + Send,
        above: impl FnOnce(&mut Self) + Send,
    ) {
        let node = self.nodes.len();
        self.nodes.push(Packed { at: at.to_bits(), link: axis as u32 });
        if parallel {
            let mut other = Self::default();
            rayon::join(|| below(self), || above(&mut other));
            self.set_above(node);
            self.append(&other);
        } else {
            below(self);
            self.set_above(node);
            above(self);
        }
    }

    /// The next node is the child above of this one.
    fn set_above(&mut self, node: usize) {
        let next = self.nodes.len() as u32;
        self.nodes[node].link |= next << 2;
    }

    /// Puts another behind this, whose next node is its root.
    pub(super) fn append(&mut self, other: &Self) {
        let (nodes, items) = (self.nodes.len() as u32, self.items.len() as u32);
        self.nodes.extend(other.nodes.iter().map(|&Packed { at, link }| match link & 3 {
            LEAF => Packed { at: at + items, link },
            _ => Packed { at, link: link + (nodes << 2) },
        }));
        self.items.extend_from_slice(&other.items);
    }

    /// Calls each triangle what `name` says.
    pub(super) fn rename(&mut self, name: impl Fn(u32) -> u32) {
        self.items.iter_mut().for_each(|face| *face = name(*face));
    }

    /// Whether indices fit into a node.
    pub(super) fn fits(&self) -> bool {
        self.nodes.len() < 1 << 30 && u32::try_from(self.items.len()).is_ok()
    }

    pub(super) fn len(&self) -> usize {
        self.nodes.len()
    }

    pub(super) fn bytes(&self) -> usize {
        self.nodes.len() * size_of::<Packed>() + self.items.len() * size_of::<u32>()
    }
}

impl<'a> Nodes for &'a Tree {
    type Id = u32;
    type Items = &'a [u32];

    #[inline]
    fn root(self) -> u32 {
        0
    }

    #[inline]
    fn open(self, node: u32) -> Opened<u32, &'a [u32]> {
        let Packed { at, link } = self.nodes[node as usize];
        let (axis, rest) = (link & 3, link >> 2);
        if axis == LEAF {
            Opened::Leaf(&self.items[at as usize..][..rest as usize])
        } else {
            Opened::Inner { axis: axis as usize, at: f32::from_bits(at), below: node + 1, above: rest }
        }
    }
}
