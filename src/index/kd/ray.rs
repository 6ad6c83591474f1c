//! Rays, and the watertight test of a ray against a triangle.
//!
//! Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection": the corners are moved and sheared so that the ray is
//! the z axis, and the signs of three edge functions decide. They are differences of two products, and rounding a product
//! can make such a difference zero, but never turn its sign; where that happens, and for every triangle that is hit, the
//! difference is taken again with the products' rounding errors ([`Scalar::difference_of_products`]). So the signs are
//! right for the sheared corners in either precision, both triangles at an edge see the same sign, and a ray through an
//! edge or a corner hits all that share it. The weights, and t with them, are accurate to a few roundings even for
//! triangles seen edge-on.

use super::{Error, Scalar};

/// The points origin + t · direction with t from `min` to `max`, both included.
#[derive(Clone, Copy, Debug)]
pub struct Ray<T> {
    pub(super) origin: [T; 3],
    pub(super) direction: [T; 3],
    pub(super) min: T,
    pub(super) max: T,
    /// The axis along which the direction is longest is last.
    axes: [usize; 3],
    shear: [T; 3],
}

/// Where a ray meets a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<T> {
    /// Index of the triangle.
    pub face: u32,
    /// Along the ray, in lengths of its direction.
    pub t: T,
    /// Barycentric weight of the second corner; 1 − u − v is that of the first.
    pub u: T,
    /// Barycentric weight of the third corner.
    pub v: T,
    /// Whether the corners are seen anticlockwise: the ray comes from the side that the normal (b − a) × (c − a) points to.
    pub front: bool,
}

impl<T: Scalar> Ray<T> {
    /// From `origin` on, to infinity. Refuses what is not finite or out of range ([`Scalar::EXPONENT`]), and a direction
    /// without length.
    pub fn new(origin: [T; 3], direction: [T; 3]) -> Result<Self, Error> {
        let limit = 2.0f64.powi(T::EXPONENT);
        if !origin.iter().all(|&x| x.into().abs() <= limit) {
            return Err(Error::Origin);
        }
        let lengths = direction.map(|x| x.into().abs());
        if !(lengths.iter().all(|&x| x <= limit) && lengths.iter().any(|&x| x >= 1.0 / limit)) {
            return Err(Error::Direction);
        }
        let mut z = 0;
        for axis in 1..3 {
            if lengths[axis] > lengths[z] {
                z = axis;
            }
        }
        let axes = [(z + 1) % 3, (z + 2) % 3, z];
        let [dx, dy, dz] = axes.map(|axis| direction[axis]);
        Ok(Self { origin, direction, min: T::ZERO, max: T::INFINITY, axes, shear: [dx / dz, dy / dz, T::ONE / dz] })
    }

    /// Only hits with `min` ≤ t ≤ `max`; none if that is empty.
    pub fn within(self, min: T, max: T) -> Self {
        Self { min, max, ..self }
    }

    /// Along each axis.
    pub fn origin(&self) -> [T; 3] {
        self.origin
    }

    /// As given: need not be of length 1.
    pub fn direction(&self) -> [T; 3] {
        self.direction
    }

    /// The first and last t.
    pub fn range(&self) -> (T, T) {
        (self.min, self.max)
    }

    /// The hit with one triangle, its edges and corners included. One that the ray lies in the plane of is not hit:
    /// its neighbours at the edges that the ray crosses are.
    #[inline]
    pub fn hit(&self, face: u32, corners: [[T; 3]; 3]) -> Option<Hit<T>> {
        let [x, y, z] = self.axes;
        let sheared = corners.map(|p| {
            let along = p[z] - self.origin[z];
            [(p[x] - self.origin[x]) - self.shear[0] * along, (p[y] - self.origin[y]) - self.shear[1] * along, along]
        });
        let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = sheared;
        let rough = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        if mixed(rough) {
            return None;
        }
        let edges = [
            T::difference_of_products(cx, by, cy, bx),
            T::difference_of_products(ax, cy, ay, cx),
            T::difference_of_products(bx, ay, by, ax),
        ];
        if mixed(edges) {
            return None;
        }
        let sum = edges[0] + edges[1] + edges[2];
        if sum == T::ZERO {
            return None;
        }
        let [w, u, v] = edges.map(|edge| edge / sum);
        let t = (w * sheared[0][2] + u * sheared[1][2] + v * sheared[2][2]) * self.shear[2];
        let front = (sum > T::ZERO) == (self.shear[2] > T::ZERO);
        (t >= self.min && t <= self.max).then_some(Hit { face, t, u, v, front })
    }
}

/// Some below zero and some above: the ray passes outside.
#[inline]
fn mixed<T: Scalar>(edges: [T; 3]) -> bool {
    let [u, v, w] = edges;
    (u < T::ZERO || v < T::ZERO || w < T::ZERO) && (u > T::ZERO || v > T::ZERO || w > T::ZERO)
}
