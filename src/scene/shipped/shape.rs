//! Mesh generators of the shipped scenes: flat and boxy shapes, and what puts shapes together.
//!
//! Every generator winds its triangles counter-clockwise seen from outside and gives unit normals that point outside.

use std::collections::HashMap;

use glam::{Affine3A, Mat3, Vec2, Vec3};

use crate::scene::Mesh;

/// A mesh under construction. `uvs` and `colors` are empty or as long as `positions`.
#[derive(Clone, Debug, Default)]
pub struct Shape {
    /// Metres.
    pub positions: Vec<Vec3>,
    /// Unit.
    pub normals: Vec<Vec3>,
    /// Metres along the surface where a generator gives them; v runs down, as in images.
    pub uvs: Vec<Vec2>,
    /// Linear RGB factors on the base colour.
    pub colors: Vec<Vec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// A parallelogram from `corner` along `u` and `v`; its front is where `u × v` points.
    pub fn quad(corner: Vec3, u: Vec3, v: Vec3) -> Self {
        let normal = u.cross(v).normalize();
        let (w, h) = (u.length(), v.length());
        Self {
            positions: vec![corner, corner + u, corner + u + v, corner + v],
            normals: vec![normal; 4],
            uvs: vec![Vec2::new(0.0, h), Vec2::new(w, h), Vec2::new(w, 0.0), Vec2::ZERO],
            colors: Vec::new(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    /// A box with sharp edges.
    pub fn cuboid(min: Vec3, max: Vec3) -> Self {
        let d = max - min;
        let (x, y, z) = (Vec3::X * d.x, Vec3::Y * d.y, Vec3::Z * d.z);
        let mut shape = Self::quad(min + z, x, y);
        for (corner, u, v) in [(min + x + z, -z, y), (min + x, -x, y), (min, z, y), (min + y + z, x, -z), (min, x, z)] {
            shape.append(Self::quad(corner, u, v));
        }
        shape
    }

    /// A box whose edges and corners are rounded with `radius` in `steps` steps per eighth of a turn.
    pub fn rounded_cuboid(min: Vec3, max: Vec3, radius: f32, steps: usize) -> Self {
        Self::padded_cuboid(min, max, radius, steps, [1; 3])
    }

    /// The same with the flat parts cut into `inner` pieces along x, y and z, for bending.
    pub fn padded_cuboid(min: Vec3, max: Vec3, radius: f32, steps: usize, inner: [usize; 3]) -> Self {
        let (inner_min, inner_max) = (min + radius, max - radius);
        let ticks = |axis: usize| -> Vec<f32> {
            let reach = |k: usize| radius * (std::f32::consts::FRAC_PI_4 * k as f32 / steps as f32).tan();
            let mut ticks = vec![min[axis]];
            ticks.extend((0..steps).rev().map(|k| inner_min[axis] - reach(k)));
            let n = inner[axis];
            ticks.extend((1..n).map(|k| inner_min[axis] + (inner_max[axis] - inner_min[axis]) * k as f32 / n as f32));
            ticks.extend((0..steps).map(|k| inner_max[axis] + reach(k)));
            ticks.push(max[axis]);
            ticks
        };
        let mut shape = Self::default();
        for axis in 0..3 {
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let (ticks_a, ticks_b) = (ticks(a), ticks(b));
            for side in [min[axis], max[axis]] {
                let first = shape.positions.len() as u32;
                for &tb in &ticks_b {
                    for &ta in &ticks_a {
                        let mut q = Vec3::ZERO;
                        (q[axis], q[a], q[b]) = (side, ta, tb);
                        let core = q.clamp(inner_min, inner_max);
                        let normal = (q - core).normalize();
                        shape.positions.push(core + normal * radius);
                        shape.normals.push(normal);
                    }
                }
                shape.grid_triangles(first, ticks_a.len() - 1, ticks_b.len() - 1, side == min[axis]);
            }
        }
        shape.welded()
    }

    /// The triangles of a grid of `(nu + 1) × (nv + 1)` vertices that starts at `first`, u running fastest.
    pub(super) fn grid_triangles(&mut self, first: u32, nu: usize, nv: usize, flip: bool) {
        let row = nu as u32 + 1;
        for j in 0..nv as u32 {
            for i in 0..nu as u32 {
                let a = first + j * row + i;
                let (b, c, d) = (a + 1, a + row + 1, a + row);
                let pair = if flip { [[a, c, b], [a, d, c]] } else { [[a, b, c], [a, c, d]] };
                self.triangles.extend(pair);
            }
        }
    }

    /// Adds another shape. Coordinates or colours that only one of them has are filled in with zero and white.
    pub fn append(&mut self, other: Self) {
        let first = self.positions.len() as u32;
        let total = self.positions.len() + other.positions.len();
        if !self.uvs.is_empty() || !other.uvs.is_empty() {
            self.uvs.resize(first as usize, Vec2::ZERO);
            self.uvs.extend(other.uvs);
            self.uvs.resize(total, Vec2::ZERO);
        }
        if !self.colors.is_empty() || !other.colors.is_empty() {
            self.colors.resize(first as usize, Vec3::ONE);
            self.colors.extend(other.colors);
            self.colors.resize(total, Vec3::ONE);
        }
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.triangles.extend(other.triangles.into_iter().map(|t| t.map(|i| i + first)));
    }

    /// The sum of shapes.
    pub fn union(shapes: impl IntoIterator<Item = Self>) -> Self {
        let mut sum = Self::default();
        for shape in shapes {
            sum.append(shape);
        }
        sum
    }

    /// Moved by an affine transform; one that mirrors keeps the outside outside.
    pub fn transformed(mut self, transform: Affine3A) -> Self {
        let linear = Mat3::from(transform.matrix3);
        let normals = linear.inverse().transpose();
        for p in &mut self.positions {
            *p = transform.transform_point3(*p);
        }
        for n in &mut self.normals {
            *n = (normals * *n).normalize();
        }
        if linear.determinant() < 0.0 {
            for t in &mut self.triangles {
                t.swap(1, 2);
            }
        }
        self
    }

    /// Moved by `offset`.
    pub fn moved(self, offset: Vec3) -> Self {
        self.transformed(Affine3A::from_translation(offset))
    }

    /// Turned about +y by `angle` radians, then moved by `offset`.
    pub fn placed(self, angle: f32, offset: Vec3) -> Self {
        self.transformed(Affine3A::from_translation(offset) * Affine3A::from_rotation_y(angle))
    }

    /// Inside out.
    pub fn inverted(mut self) -> Self {
        for n in &mut self.normals {
            *n = -*n;
        }
        for t in &mut self.triangles {
            t.swap(1, 2);
        }
        self
    }

    /// Computes the normals of the first `n` vertices anew from the triangles around them, weighted by area.
    pub fn smooth(&mut self, n: usize) {
        let mut sums = vec![Vec3::ZERO; self.positions.len()];
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            for &i in t {
                sums[i as usize] += (b - a).cross(c - a);
            }
        }
        for (normal, sum) in self.normals.iter_mut().zip(sums).take(n) {
            *normal = sum.normalize_or(*normal);
        }
    }

    /// With one colour on all vertices.
    pub fn colored(mut self, color: Vec3) -> Self {
        self.colors = vec![color; self.positions.len()];
        self
    }

    /// Without texture coordinates.
    pub fn without_uvs(mut self) -> Self {
        self.uvs.clear();
        self
    }

    /// With vertices that agree in every attribute made one.
    pub fn welded(self) -> Self {
        let mut out = Self::default();
        let mut seen = HashMap::new();
        let mut renamed = Vec::with_capacity(self.positions.len());
        for i in 0..self.positions.len() {
            let uv = self.uvs.get(i);
            let color = self.colors.get(i);
            // Adding zero makes −0 and +0 alike.
            let bits = |v: Vec3| (v + Vec3::ZERO).to_array().map(f32::to_bits);
            let key = (
                bits(self.positions[i]),
                bits(self.normals[i]),
                uv.map(|v| v.to_array().map(f32::to_bits)),
                color.map(|c| bits(*c)),
            );
            let next = out.positions.len() as u32;
            let index = *seen.entry(key).or_insert(next);
            if index == next {
                out.positions.push(self.positions[i]);
                out.normals.push(self.normals[i]);
                out.uvs.extend(uv);
                out.colors.extend(color);
            }
            renamed.push(index);
        }
        out.triangles = self.triangles.iter().map(|t| t.map(|i| renamed[i as usize])).collect();
        out
    }

    /// As a mesh of the scene.
    pub fn into_mesh(self, name: &str, material: usize) -> Mesh {
        Mesh {
            name: name.into(),
            positions: self.positions,
            normals: self.normals,
            uv0: self.uvs,
            colors: self.colors.iter().map(|c| c.extend(1.0)).collect(),
            triangles: self.triangles,
            material,
            ..Mesh::default()
        }
    }
}

/// A wall of separate tiles or bricks.
#[derive(Clone, Copy, Debug)]
pub struct Tiling {
    /// Width and height of a tile with its joint, metres.
    pub pitch: Vec2,
    /// Width of the joint, metres.
    pub joint: f32,
    /// How far a tile stands out of the joint, metres.
    pub height: f32,
    /// Width of the slope around a tile, metres.
    pub bevel: f32,
    /// Shift of every other row, in tiles.
    pub bond: f32,
    /// Largest tilt of a tile, radians: what makes reflections in real tiles lively.
    pub tilt: f32,
    /// Largest deviation of a tile's brightness from 1.
    pub variation: f32,
    /// Of the deviations.
    pub seed: u32,
}

impl Tiling {
    /// Tiles over the parallelogram that [`Shape::quad`] would make; the joint's ground is not included. Only tiles
    /// whose centre (metres along u and v) `keep` accepts are laid.
    pub fn over(&self, corner: Vec3, u: Vec3, v: Vec3, keep: impl Fn(Vec2) -> bool) -> Shape {
        let (w, h) = (u.length(), v.length());
        let (u, v) = (u / w, v / h);
        let n = u.cross(v);
        let mut shape = Shape::default();
        let n_rows = (h / self.pitch.y).ceil() as i32;
        let n_columns = (w / self.pitch.x).ceil() as i32;
        for row in 0..n_rows {
            let shift = if row % 2 == 1 { self.bond } else { 0.0 };
            for column in -1..=n_columns {
                let x0 = ((column as f32 + shift) * self.pitch.x + 0.5 * self.joint).max(0.0);
                let x1 = ((column as f32 + shift + 1.0) * self.pitch.x - 0.5 * self.joint).min(w);
                let y0 = row as f32 * self.pitch.y + 0.5 * self.joint;
                let y1 = ((row + 1) as f32 * self.pitch.y - 0.5 * self.joint).min(h);
                let smallest = 4.0 * self.bevel;
                if x1 - x0 < smallest || y1 - y0 < smallest || !keep(0.5 * Vec2::new(x0 + x1, y0 + y1)) {
                    continue;
                }
                let mut random = Random::new(self.seed ^ (row * 1009 + column + 7) as u32);
                let size = Vec2::new(x1 - x0, y1 - y0);
                let tint = 1.0 + self.variation * random.between(-1.0, 1.0);
                let slope = [random.between(-1.0, 1.0), random.between(-1.0, 1.0)].map(|t| t * self.tilt);
                let lift = |x: f32, y: f32| self.height + slope[0] * (x - 0.5 * size.x) + slope[1] * (y - 0.5 * size.y);
                let at = |x: f32, y: f32, z: f32| corner + u * (x0 + x) + v * (y0 + y) + n * z;
                let b = self.bevel;
                let ring = |inset: f32, ground: bool| {
                    [(inset, inset), (size.x - inset, inset), (size.x - inset, size.y - inset), (inset, size.y - inset)]
                        .map(|(x, y)| at(x, y, if ground { -0.001 } else { lift(x, y) }))
                };
                let (top, foot) = (ring(b, false), ring(0.0, true));
                let mut tile = Shape::default();
                tile.flat(top);
                for k in 0..4 {
                    let l = (k + 1) % 4;
                    tile.flat([foot[k], foot[l], top[l], top[k]]);
                }
                shape.append(tile.colored(Vec3::splat(tint)));
            }
        }
        shape
    }
}

impl Shape {
    /// Adds a flat face: triangles from the first corner to each of the sides away from it, wound so that `normal` is in
    /// front.
    pub fn fan(&mut self, corners: &[Vec3], normal: Vec3) {
        let first = self.positions.len() as u32;
        let turned = (corners[1] - corners[0]).cross(corners[2] - corners[0]).dot(normal) < 0.0;
        self.positions.extend(corners);
        self.normals.extend(corners.iter().map(|_| normal));
        for k in 1..corners.len() as u32 - 1 {
            let (b, c) = if turned { (k + 1, k) } else { (k, k + 1) };
            self.triangles.push([first, first + b, first + c]);
        }
    }

    /// Adds a flat face of four corners, without texture coordinates.
    fn flat(&mut self, corners: [Vec3; 4]) {
        let first = self.positions.len() as u32;
        let normal = (corners[2] - corners[0]).cross(corners[3] - corners[1]).normalize();
        self.positions.extend(corners);
        self.normals.extend([normal; 4]);
        self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
}

/// A small deterministic generator of random numbers (PCG output hash over a counter).
#[derive(Clone, Debug)]
pub struct Random {
    seed: u32,
    counter: u32,
}

impl Random {
    /// The same seed gives the same numbers.
    pub fn new(seed: u32) -> Self {
        Self { seed: hash(seed), counter: 0 }
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.counter += 1;
        (hash(self.seed.wrapping_add(self.counter.wrapping_mul(0x9E37_79B9))) >> 8) as f32 / (1 << 24) as f32
    }

    /// Uniform in [low, high).
    pub fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.unit()
    }
}

/// PCG's output permutation of 32 bits.
pub fn hash(x: u32) -> u32 {
    let state = x.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}
