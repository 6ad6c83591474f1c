//! The way of a ray through a tree.
//!
//! Triangles are tested with the corners as given, cells are made of corners rounded to single precision, and the test of a
//! triangle rounds as well: it is exact for corners moved by so much. Every plane is therefore taken to be thick, by more
//! than all of these together, and a ray visits both sides where it is that near. So every triangle that [`Ray::hit`]
//! finds is found, and rays in a plane, along one or with zero components are no special case.

use std::borrow::Borrow;
use std::ops::ControlFlow;

use super::mesh::Frame;
use super::{Hit, Ray, Scalar, Triangles};

/// How nodes are reached.
pub trait Nodes: Copy {
    type Id: Copy;
    type Items: IntoIterator<Item: Borrow<u32>>;
    fn root(self) -> Self::Id;
    fn open(self, node: Self::Id) -> Opened<Self::Id, Self::Items>;
}

/// A node.
pub enum Opened<Id, Items> {
    Inner { axis: usize, at: f32, below: Id, above: Id },
    Leaf(Items),
}

/// Rounding of the corners to single precision, in the frame: half of this a coordinate.
const ROUNDING: f64 = 1.0 / (1u64 << 23) as f64;
/// Roundings that [`Ray::hit`] makes, at most: half of this.
const ROUNDINGS: f64 = 16.0;
/// What is shorter, against the longest, moves a ray by nothing while it is in the box.
const STILL: f64 = 1.0 / (1u128 << 80) as f64;

/// A ray in the frame of a tree.
struct Framed {
    origin: [f64; 3],
    /// 1 / direction; 0 where it does not move.
    inverse: [f64; 3],
    /// Half the thickness of a plane.
    near: f64,
    /// `near` in t.
    pad: [f64; 3],
}

impl Framed {
    fn new<T: Scalar>(ray: &Ray<T>, frame: &Frame, roundings: f64) -> Self {
        let origin = frame.place(ray.origin);
        let direction = ray.direction.map(|x| x.into() * frame.scale);
        let longest = direction.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let far = origin.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        let near = ROUNDING + roundings * T::EPSILON * (1.0 + far);
        let inverse = direction.map(|x| if x.abs() <= longest * STILL { 0.0 } else { 1.0 / x });
        Self { origin, inverse, near, pad: inverse.map(|x| x.abs() * near) }
    }

    /// Where the ray is in the box of the mesh.
    fn range(&self, half: [f64; 3]) -> Option<(f64, f64)> {
        let (mut from, mut to) = (f64::NEG_INFINITY, f64::INFINITY);
        for (axis, half) in half.into_iter().enumerate() {
            if self.inverse[axis] == 0.0 {
                if self.origin[axis].abs() > half + self.near {
                    return None;
                }
            } else {
                let [a, b] = [-half, half].map(|face| (face - self.origin[axis]) * self.inverse[axis]);
                from = from.max(a.min(b) - self.pad[axis]);
                to = to.min(a.max(b) + self.pad[axis]);
            }
        }
        Some((from, to))
    }
}

/// Calls `visit` with every hit from near to far, cell by cell: several times with a triangle that is in several, and in no
/// order within a cell. It says up to which t it wants more.
pub fn hits<T: Scalar, N: Nodes, B>(
    nodes: N,
    triangles: &Triangles<T>,
    ray: &Ray<T>,
    mut visit: impl FnMut(Hit<T>) -> ControlFlow<B, T>,
) -> ControlFlow<B> {
    let mut limit = ray.max;
    faces(nodes, &triangles.frame, ROUNDINGS, ray, |face| {
        if let Some(hit) = ray.hit(face, triangles.corners(face)) {
            limit = visit(hit)?;
        }
        ControlFlow::Continue(limit)
    })
}

/// Calls `visit` with every triangle that a test making up to `roundings` / 2 roundings can find hit, from near to far, cell by
/// cell; with most of them in vain, and several times with one that is in several cells. It says up to which t it wants more.
#[inline]
pub fn faces<T: Scalar, N: Nodes, B>(
    nodes: N,
    frame: &Frame,
    roundings: f64,
    ray: &Ray<T>,
    mut visit: impl FnMut(u32) -> ControlFlow<B, T>,
) -> ControlFlow<B> {
    let framed = Framed::new(ray, frame, roundings);
    let Some((from, to)) = framed.range(frame.half) else {
        return ControlFlow::Continue(());
    };
    let mut limit: f64 = ray.max.into();
    let mut pending = [(nodes.root(), from.max(ray.min.into()), to.min(limit)); super::Sah::MAX_DEPTH as usize + 1];
    let mut n_pending = 1;
    while n_pending > 0 {
        n_pending -= 1;
        let (mut node, from, mut to) = pending[n_pending];
        // A hit may lie before its cell by as much as planes are thick, which `from` allows for.
        if from > to.min(limit) {
            continue;
        }
        loop {
            match nodes.open(node) {
                Opened::Inner { axis, at, below, above } => {
                    let distance = f64::from(at) - framed.origin[axis];
                    let inverse = framed.inverse[axis];
                    if inverse == 0.0 {
                        if distance.abs() <= framed.near {
                            pending[n_pending] = (above, from, to);
                            n_pending += 1;
                        }
                        node = if distance < -framed.near { above } else { below };
                        continue;
                    }
                    let t = distance * inverse;
                    let (leave, enter) = (t + framed.pad[axis], t - framed.pad[axis]);
                    let (first, second) = if inverse > 0.0 { (below, above) } else { (above, below) };
                    if leave < from {
                        node = second;
                    } else if enter > to {
                        node = first;
                    } else {
                        pending[n_pending] = (second, from.max(enter), to);
                        n_pending += 1;
                        (node, to) = (first, to.min(leave));
                    }
                }
                Opened::Leaf(faces) => {
                    for face in faces {
                        limit = visit(*face.borrow())?.into();
                    }
                    break;
                }
            }
        }
    }
    ControlFlow::Continue(())
}
