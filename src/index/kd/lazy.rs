//! A tree that grows where rays go.
//!
//! A node is opened by the first ray that reaches it; others that come meanwhile wait for it, and none opens it again. What
//! comes of it does not depend on who came first, so the tree, as far as it is grown, is that of the eager build.

use std::ops::ControlFlow;
use std::sync::{Mutex, OnceLock, PoisonError};

use super::cell::{Cell, Node, Task};
use super::tree::Tree;
use super::walk::{self, Nodes, Opened};
use super::{Error, Hit, KdOptions, KdTree, Ray, RaySearch, Scalar, Triangles};

/// See the module. It takes more memory than a [`KdTree`]; [`LazyKd::finish`] makes one of it.
#[derive(Debug)]
pub struct LazyKd<T> {
    triangles: Triangles<T>,
    growing: Growing,
}

#[derive(Debug)]
struct Growing {
    task: Task,
    root: Seed,
}

/// A node that may not be there yet.
#[derive(Debug)]
struct Seed {
    cell: Mutex<Option<Box<Cell>>>,
    node: OnceLock<Grown>,
}

#[derive(Debug)]
enum Grown {
    Inner { axis: usize, at: f32, children: Box<[Seed; 2]> },
    Leaf(Box<[u32]>),
}

impl Seed {
    fn new(cell: Cell) -> Self {
        Self { cell: Mutex::new(Some(Box::new(cell))), node: OnceLock::new() }
    }

    /// Opening takes no part in rayon's pool: a thread that waits here must not be given other work that waits here too.
    fn open(&self, task: &Task) -> &Grown {
        self.node.get_or_init(|| {
            let cell = self.cell.lock().unwrap_or_else(PoisonError::into_inner).take();
            match cell.map(|cell| cell.open(task)) {
                Some(Node::Inner { axis, at, children }) => {
                    Grown::Inner { axis, at, children: Box::new((*children).map(Seed::new)) }
                }
                Some(Node::Leaf(faces)) => Grown::Leaf(faces.into_boxed_slice()),
                // Taken once, inside of what runs once.
                None => unreachable!("a cell is opened once"),
            }
        })
    }

    fn n_opened(&self) -> usize {
        match self.node.get() {
            None => 0,
            Some(Grown::Leaf(_)) => 1,
            Some(Grown::Inner { children, .. }) => 1 + children.iter().map(Seed::n_opened).sum::<usize>(),
        }
    }

    fn pack(&self, task: &Task, tree: &mut Tree) {
        match self.open(task) {
            Grown::Leaf(faces) => tree.push_leaf(faces),
            Grown::Inner { axis, at, children } => {
                let node = tree.push_inner(*axis, *at);
                children[0].pack(task, tree);
                tree.set_above(node);
                children[1].pack(task, tree);
            }
        }
    }
}

impl<'a> Nodes for &'a Growing {
    type Id = &'a Seed;
    type Items = &'a [u32];

    fn root(self) -> &'a Seed {
        &self.root
    }

    #[inline]
    fn open(self, node: &'a Seed) -> Opened<&'a Seed, &'a [u32]> {
        match node.open(&self.task) {
            Grown::Inner { axis, at, children } => {
                Opened::Inner { axis: *axis, at: *at, below: &children[0], above: &children[1] }
            }
            Grown::Leaf(faces) => Opened::Leaf(faces),
        }
    }
}

impl<T: Scalar> LazyKd<T> {
    /// Prepares the root only. `options.parallel` has no effect.
    pub fn new(triangles: Triangles<T>, options: &KdOptions) -> Result<Self, Error> {
        options.sah.check()?;
        let task = Task::new(&triangles, options.sah);
        let root = Seed::new(task.root(options.builder));
        Ok(Self { triangles, growing: Growing { task, root } })
    }

    /// Nodes that are there.
    pub fn n_opened(&self) -> usize {
        self.growing.root.n_opened()
    }

    /// Opens what is not, and packs the tree.
    pub fn finish(self) -> Result<KdTree<T>, Error> {
        let mut tree = Tree::default();
        self.growing.root.pack(&self.growing.task, &mut tree);
        KdTree::of(self.triangles, tree)
    }
}

impl<T: Scalar> RaySearch<T> for LazyKd<T> {
    fn triangles(&self) -> &Triangles<T> {
        &self.triangles
    }

    fn try_hits<B>(&self, ray: &Ray<T>, visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B> {
        walk::hits(&self.growing, &self.triangles, ray, visit)
    }
}
