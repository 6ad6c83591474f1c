//! The triangles a tree is built over.

use rayon::prelude::*;

use super::{Error, Scalar};

/// More cannot be numbered in an event.
pub(super) const MAX_FACES: usize = 1 << 28;

/// Vertices, and three of them for each face. Checked: every index is in range, every coordinate finite.
#[derive(Clone, Debug)]
pub struct Triangles<T> {
    vertices: Vec<[T; 3]>,
    faces: Vec<[u32; 3]>,
    pub(super) frame: Frame,
}

/// The space that planes are in: the mesh's box moved to the origin, and scaled by a power of two into −1 … 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Frame {
    pub(super) centre: [f64; 3],
    pub(super) scale: f64,
    /// Half the size of the box along each axis, in the frame.
    pub(super) half: [f64; 3],
}

impl Frame {
    /// A point in the frame, rounded to double precision only.
    #[inline]
    pub(super) fn place<T: Scalar>(&self, p: [T; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| (p[axis].into() - self.centre[axis]) * self.scale)
    }

    /// A coordinate of the frame in the unit of the mesh.
    pub(super) fn back(&self, axis: usize, x: f32) -> f64 {
        f64::from(x) / self.scale + self.centre[axis]
    }
}

impl<T: Scalar> Triangles<T> {
    /// Takes the mesh, or says what is wrong with it. Triangles without area and repeated ones are fine.
    pub fn new(vertices: Vec<[T; 3]>, faces: Vec<[u32; 3]>) -> Result<Self, Error> {
        if faces.len() > MAX_FACES {
            return Err(Error::TooMany(faces.len()));
        }
        let limit = 2.0f64.powi(T::EXPONENT);
        if let Some(at) = vertices.iter().position(|p| !p.iter().all(|&x| x.into().abs() <= limit)) {
            return Err(Error::Vertex(at));
        }
        let (mut min, mut max) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for (face, corners) in faces.iter().enumerate() {
            for &corner in corners {
                let Some(p) = vertices.get(corner as usize) else {
                    return Err(Error::Index { face, corner, vertices: vertices.len() });
                };
                for axis in 0..3 {
                    min[axis] = min[axis].min(p[axis].into());
                    max[axis] = max[axis].max(p[axis].into());
                }
            }
        }
        let mut frame = Frame { centre: [0.0; 3], scale: 1.0, half: [0.0; 3] };
        if !faces.is_empty() {
            frame.centre = std::array::from_fn(|axis| min[axis] + (max[axis] - min[axis]) * 0.5);
            frame.half = [0, 1, 2].map(|axis| (frame.centre[axis] - min[axis]).max(max[axis] - frame.centre[axis]));
            let half = frame.half.iter().fold(0.0, |a: f64, &b| a.max(b));
            if half > 0.0 {
                if half < 1.0 / limit {
                    return Err(Error::TooSmall(half));
                }
                // 2^e ≤ half < 2^(e + 1)
                let e = ((half.to_bits() >> 52) & 0x7ff) as i32 - 1023;
                frame.scale = 2.0f64.powi(-(e + 1));
                frame.half = frame.half.map(|x| x * frame.scale);
            }
        }
        Ok(Self { vertices, faces, frame })
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.faces.is_empty()
    }

    /// As given.
    pub fn vertices(&self) -> &[[T; 3]] {
        &self.vertices
    }

    /// As given.
    pub fn faces(&self) -> &[[u32; 3]] {
        &self.faces
    }

    /// The corners of a face, below [`Triangles::len`].
    #[inline]
    pub fn corners(&self, face: u32) -> [[T; 3]; 3] {
        self.faces[face as usize].map(|v| self.vertices[v as usize])
    }

    /// The corners in the frame, in single precision: what is built over.
    pub(super) fn framed(&self, parallel: bool) -> Vec<[[f32; 3]; 3]> {
        // −0 becomes 0, so that the order of the bits is that of the numbers.
        let place = |p| self.frame.place(p).map(|x| x as f32 + 0.0);
        let corners = |face| self.corners(face).map(place);
        let faces = 0..self.len() as u32;
        if parallel { faces.into_par_iter().map(corners).collect() } else { faces.map(corners).collect() }
    }
}
