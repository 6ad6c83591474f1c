//! A tree that grows where rays go, and beside them.
//!
//! A node is opened by the first who reaches it, a small one with all that is below it. Nobody waits for that: a ray that
//! comes meanwhile tests the triangles of the cell instead, which takes less time than opening it, and goes on. What
//! becomes of a node does not depend on who came first, so the tree, as far as it is grown, is that of the eager build.
//!
//! Opening a node takes no part in rayon's pool. A thread that waits in the pool is given other work, which may be all the
//! rays there are; the node that it was at would stay closed until they are through.
//! See ADR 10.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError, TryLockError};

use super::cell::{Cell, Node, PARALLEL, Task};
use super::tree::Tree;
use super::walk::{self, Nodes, Opened};
use super::{Error, Hit, KdOptions, KdTree, Ray, RaySearch, Scalar, Triangles};

/// See the module. It takes more memory than a [`KdTree`], until [`LazyKd::finish`] makes one of it.
#[derive(Debug)]
pub struct LazyKd<T> {
    triangles: Triangles<T>,
    growing: Growing,
    /// All of the tree, once it is grown.
    packed: OnceLock<Tree>,
}

#[derive(Debug)]
struct Growing {
    task: Task,
    root: Seed,
    n_opened: AtomicUsize,
}

/// A node that may not be there yet: first it has a bud, then both, then a node.
#[derive(Debug)]
struct Seed {
    bud: Mutex<Option<Arc<Bud>>>,
    node: OnceLock<Grown>,
}

/// A closed cell.
#[derive(Debug)]
struct Bud {
    cell: Cell,
    /// Held by who opens it.
    opening: Mutex<()>,
}

#[derive(Debug)]
enum Grown {
    Inner {
        axis: u8,
        /// Whether it is worth the while of two threads to grow its children.
        large: bool,
        at: f32,
        children: Box<[Seed; 2]>,
    },
    /// All that is below.
    Packed(Tree),
}

/// Cells of so many triangles are opened with all that is below: keeping nodes that may come takes longer than making them.
const SMALL: usize = 64;

/// Where a ray is.
#[derive(Clone, Copy)]
enum Place<'a> {
    Seed(&'a Seed),
    Packed(&'a Tree, u32),
}

/// What a ray has to test.
enum Faces<'a> {
    Leaf(std::slice::Iter<'a, u32>),
    /// From this index on.
    Closed(Arc<Bud>, usize),
}

impl Iterator for Faces<'_> {
    type Item = u32;

    fn next(&mut self) -> Option<u32> {
        match self {
            Self::Leaf(faces) => faces.next().copied(),
            Self::Closed(bud, index) => {
                *index += 1;
                bud.cell.face(*index - 1)
            }
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Seed {
    fn new(cell: Cell) -> Self {
        Self { bud: Mutex::new(Some(Arc::new(Bud { cell, opening: Mutex::new(()) }))), node: OnceLock::new() }
    }
}

impl Growing {
    /// The node, opened now if nobody is at it; else the closed cell.
    fn reach<'a>(&self, seed: &'a Seed) -> Result<&'a Grown, Arc<Bud>> {
        loop {
            if let Some(node) = seed.node.get() {
                return Ok(node);
            }
            // None: opened meanwhile.
            let Some(bud) = lock(&seed.bud).clone() else { continue };
            let opening = match bud.opening.try_lock() {
                Ok(guard) => guard,
                Err(TryLockError::Poisoned(error)) => error.into_inner(),
                Err(TryLockError::WouldBlock) => return Err(Arc::clone(&bud)),
            };
            return Ok(self.open(seed, &bud, opening));
        }
    }

    /// The node, at once or when who opens it now has done so. He never waits, and is never this thread.
    fn wait<'a>(&self, seed: &'a Seed) -> &'a Grown {
        loop {
            match self.reach(seed) {
                Ok(node) => return node,
                Err(bud) => drop(lock(&bud.opening)),
            }
        }
    }

    fn open<'a>(&self, seed: &'a Seed, bud: &Bud, opening: MutexGuard<'_, ()>) -> &'a Grown {
        let node = seed.node.get_or_init(|| {
            let n_faces = bud.cell.len();
            let (n, grown) = match bud.cell.open(&self.task, false) {
                Node::Inner { axis, at, children } if n_faces > SMALL => {
                    let (axis, large) = (axis as u8, n_faces >= PARALLEL);
                    (1, Grown::Inner { axis, large, at, children: Box::new((*children).map(Seed::new)) })
                }
                node => {
                    let tree = Tree::of(node, &self.task);
                    (tree.len(), Grown::Packed(tree))
                }
            };
            self.n_opened.fetch_add(n, Ordering::Relaxed);
            grown
        });
        lock(&seed.bud).take();
        drop(opening);
        node
    }

    fn pack(&self, seed: &Seed, tree: &mut Tree) {
        match self.wait(seed) {
            Grown::Packed(below) => tree.append(below),
            &Grown::Inner { axis, large, at, ref children } => {
                let parallel = large && self.task.parallel;
                let pack = |child| move |tree: &mut Tree| self.pack(child, tree);
                tree.push_both((axis.into(), at), parallel, pack(&children[0]), pack(&children[1]));
            }
        }
    }
}

impl<'a> Nodes for &'a Growing {
    type Id = Place<'a>;
    type Items = Faces<'a>;

    fn root(self) -> Place<'a> {
        Place::Seed(&self.root)
    }

    #[inline]
    fn open(self, node: Place<'a>) -> Opened<Place<'a>, Faces<'a>> {
        let (tree, node) = match node {
            Place::Packed(tree, node) => (tree, node),
            Place::Seed(seed) => match self.reach(seed) {
                Ok(Grown::Packed(tree)) => (tree, tree.root()),
                Ok(Grown::Inner { axis, at, children, .. }) => {
                    let [below, above] = [&children[0], &children[1]].map(Place::Seed);
                    return Opened::Inner { axis: usize::from(*axis), at: *at, below, above };
                }
                Err(bud) => return Opened::Leaf(Faces::Closed(bud, 0)),
            },
        };
        match tree.open(node) {
            Opened::Inner { axis, at, below, above } => {
                let [below, above] = [below, above].map(|node| Place::Packed(tree, node));
                Opened::Inner { axis, at, below, above }
            }
            Opened::Leaf(faces) => Opened::Leaf(Faces::Leaf(faces.iter())),
        }
    }
}

impl<T: Scalar> LazyKd<T> {
    /// Prepares the root only.
    pub fn new(triangles: Triangles<T>, options: &KdOptions) -> Result<Self, Error> {
        options.sah.check()?;
        let task = Task::new(&triangles, options);
        let root = Seed::new(task.root(options.builder));
        let growing = Growing { task, root, n_opened: AtomicUsize::new(0) };
        Ok(Self { triangles, growing, packed: OnceLock::new() })
    }

    /// Nodes that have been opened.
    pub fn n_opened(&self) -> usize {
        self.growing.n_opened.load(Ordering::Relaxed)
    }

    /// Opens what is not open, beside the rays of other threads, which from then on go through a packed tree. With
    /// [`KdOptions::parallel`] it is work for all threads of the rayon pool it is called in, in pieces; a thread that has none
    /// left goes on with other work of the pool. So rays and growth share one pool, and neither keeps the other from a core:
    ///
    /// ```
    /// # use rayon::prelude::*;
    /// # use sunfleck::index::kd::{KdOptions, LazyKd, Ray, RaySearch, Triangles};
    /// # let corners = vec![[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]];
    /// # let triangles = Triangles::<f64>::new(corners, vec![[0, 1, 2]])?;
    /// # let rays = vec![Ray::new([0.25, 0.25, 0.0], [0.0, 0.0, 2.0])?];
    /// let tree = LazyKd::new(triangles, &KdOptions { parallel: true, ..KdOptions::default() })?;
    /// let (grown, hits) = rayon::join(|| tree.grow(), || rays.par_iter().map(|ray| tree.nearest(ray)).collect::<Vec<_>>());
    /// # grown?; assert!(hits[0].is_some());
    /// # Ok::<(), sunfleck::index::kd::Error>(())
    /// ```
    pub fn grow(&self) -> Result<(), Error> {
        if self.packed.get().is_none() {
            let mut tree = Tree::default();
            self.growing.pack(&self.growing.root, &mut tree);
            if !tree.fits() {
                return Err(Error::TooMany(self.triangles.len()));
            }
            // Another thread may have been first, with the same.
            let _ = self.packed.set(tree.shrunk());
        }
        Ok(())
    }

    /// Whether all of it is grown and packed.
    pub fn is_grown(&self) -> bool {
        self.packed.get().is_some()
    }

    /// Opens what is not open, and leaves the packed tree.
    pub fn finish(self) -> Result<KdTree<T>, Error> {
        self.grow()?;
        let tree = self.packed.into_inner().unwrap_or_default();
        Ok(KdTree { triangles: self.triangles, tree })
    }
}

impl<T: Scalar> RaySearch<T> for LazyKd<T> {
    fn triangles(&self) -> &Triangles<T> {
        &self.triangles
    }

    fn try_hits<B>(&self, ray: &Ray<T>, visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>) -> ControlFlow<B> {
        match self.packed.get() {
            Some(tree) => walk::hits(tree, &self.triangles, ray, visit),
            None => walk::hits(&self.growing, &self.triangles, ray, visit),
        }
    }
}
