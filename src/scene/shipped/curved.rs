//! Mesh generators of the shipped scenes: surfaces of revolution, spheres, tubes and height fields.

use std::collections::HashMap;
use std::f32::consts::TAU;
use std::ops::RangeInclusive;

use glam::{Quat, Vec2, Vec3};

use super::shape::Shape;

/// A curve in the half plane (r, y) that [`Profile::lathe`] turns about the y axis. The outside is on the right-hand
/// side of its direction: up along the outer wall of a vessel, down along the inner one.
#[derive(Clone, Debug, Default)]
pub struct Profile {
    /// Distance from the axis and height, metres.
    points: Vec<Vec2>,
    /// Whether the surface has a sharp edge at the point.
    creases: Vec<bool>,
}

impl Profile {
    /// A curve that begins at (r, y).
    pub fn start(r: f32, y: f32) -> Self {
        Self { points: vec![Vec2::new(r, y)], creases: vec![false] }
    }

    /// A straight line to (r, y), smooth at its beginning.
    pub fn to(mut self, r: f32, y: f32) -> Self {
        self.points.push(Vec2::new(r, y));
        self.creases.push(false);
        self
    }

    /// Makes the last point a sharp edge.
    pub fn crease(mut self) -> Self {
        if let Some(last) = self.creases.last_mut() {
            *last = true;
        }
        self
    }

    /// A cubic Bézier curve of `n` pieces from the last point with two control points to the end point.
    pub fn curve(mut self, c1: [f32; 2], c2: [f32; 2], end: [f32; 2], n: usize) -> Self {
        let p0 = self.last();
        let (c1, c2, p3) = (Vec2::from(c1), Vec2::from(c2), Vec2::from(end));
        for k in 1..n {
            let t = k as f32 / n as f32;
            let s = 1.0 - t;
            let p = p0 * (s * s * s) + c1 * (3.0 * s * s * t) + c2 * (3.0 * s * t * t) + p3 * (t * t * t);
            self = self.to(p.x, p.y);
        }
        self.to(p3.x, p3.y)
    }

    /// The last point, (r, y) in metres.
    pub fn last(&self) -> Vec2 {
        self.points.last().copied().unwrap_or_default()
    }

    /// The last point's index.
    pub fn last_index(&self) -> usize {
        self.points.len() - 1
    }

    /// Normal at the end (`incoming`) or the beginning of the pieces that meet in point `i`.
    fn normal(&self, i: usize, incoming: bool) -> Vec2 {
        let piece = |i: usize| {
            let d = self.points[i + 1] - self.points[i];
            (Vec2::new(d.y, -d.x).normalize(), 1.0 / d.length())
        };
        let last = self.points.len() - 1;
        let before = (i > 0).then(|| piece(i - 1));
        let after = (i < last).then(|| piece(i));
        let normal = match (before, after) {
            // Weighted by the inverse length: exact to second order on a circle.
            (Some((a, wa)), Some((b, wb))) if !self.creases[i] => a * wa + b * wb,
            (Some((a, _)), Some((b, _))) => {
                if incoming {
                    a
                } else {
                    b
                }
            }
            (Some((a, _)), None) => a,
            (None, Some((b, _))) => b,
            (None, None) => Vec2::X,
        };
        if self.points[i].x == 0.0 { Vec2::new(0.0, normal.y.signum()) } else { normal.normalize() }
    }

    /// The surface of revolution.
    pub fn lathe(&self, segments: usize) -> Shape {
        self.lathe_part(0..=self.points.len() - 1, segments, |_| (1.0, 0.0))
    }

    /// The surface of revolution of the points in `range`, with the normals of the whole. `ribs` gives, for an angle in
    /// radians, a factor on the radius and the factor's derivative.
    pub fn lathe_part(&self, range: RangeInclusive<usize>, segments: usize, ribs: impl Fn(f32) -> (f32, f32)) -> Shape {
        let mut shape = Shape::default();
        let columns: Vec<_> = (0..segments)
            .map(|j| {
                let angle = TAU * j as f32 / segments as f32;
                let (sin, cos) = angle.sin_cos();
                let (scale, slope) = ribs(angle);
                (Vec3::new(cos, 0.0, -sin), Vec3::new(-sin, 0.0, -cos), scale, slope)
            })
            .collect();
        let mut ring = |i: usize, incoming: bool| -> u32 {
            let first = shape.positions.len() as u32;
            let (p, n) = (self.points[i], self.normal(i, incoming));
            if p.x == 0.0 {
                shape.positions.push(Vec3::Y * p.y);
                shape.normals.push(Vec3::Y * n.y);
            } else {
                for &(radial, tangential, scale, slope) in &columns {
                    shape.positions.push(radial * (p.x * scale) + Vec3::Y * p.y);
                    let normal = radial * n.x - tangential * (n.x * slope / scale) + Vec3::Y * (n.y * scale);
                    shape.normals.push(normal.normalize());
                }
            }
            first
        };
        let (from, to) = (*range.start(), *range.end());
        let mut pairs = Vec::new();
        let mut begin = ring(from, false);
        for i in from + 1..=to {
            let end = ring(i, true);
            pairs.push((i, begin, end));
            begin = if self.creases[i] && i < to { ring(i, false) } else { end };
        }
        let n = segments as u32;
        for (i, begin, end) in pairs {
            for j in 0..n {
                let l = (j + 1) % n;
                let below_pole = self.points[i].x == 0.0;
                if self.points[i - 1].x == 0.0 {
                    shape.triangles.push([begin, end + l, end + j]);
                } else if below_pole {
                    shape.triangles.push([begin + j, begin + l, end]);
                } else {
                    shape.triangles.push([begin + j, begin + l, end + j]);
                    shape.triangles.push([begin + l, end + l, end + j]);
                }
            }
        }
        shape
    }
}

impl Shape {
    /// A sphere: the icosahedron with each triangle cut into four `levels` times, 20 · 4^levels triangles.
    pub fn icosphere(centre: Vec3, radius: f32, levels: u32) -> Self {
        let g = (1.0 + 5.0f32.sqrt()) / 2.0;
        let mut directions: Vec<Vec3> = [
            [-1.0, g, 0.0],
            [1.0, g, 0.0],
            [-1.0, -g, 0.0],
            [1.0, -g, 0.0],
            [0.0, -1.0, g],
            [0.0, 1.0, g],
            [0.0, -1.0, -g],
            [0.0, 1.0, -g],
            [g, 0.0, -1.0],
            [g, 0.0, 1.0],
            [-g, 0.0, -1.0],
            [-g, 0.0, 1.0],
        ]
        .map(|v| Vec3::from(v).normalize())
        .to_vec();
        let mut triangles: Vec<[u32; 3]> = vec![
            [0, 11, 5],
            [0, 5, 1],
            [0, 1, 7],
            [0, 7, 10],
            [0, 10, 11],
            [1, 5, 9],
            [5, 11, 4],
            [11, 10, 2],
            [10, 7, 6],
            [7, 1, 8],
            [3, 9, 4],
            [3, 4, 2],
            [3, 2, 6],
            [3, 6, 8],
            [3, 8, 9],
            [4, 9, 5],
            [2, 4, 11],
            [6, 2, 10],
            [8, 6, 7],
            [9, 8, 1],
        ];
        for _ in 0..levels {
            let mut middles = HashMap::new();
            let mut next = Vec::with_capacity(triangles.len() * 4);
            for [a, b, c] in triangles {
                let mut middle = |i: u32, j: u32| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        directions.push((directions[i as usize] + directions[j as usize]).normalize());
                        directions.len() as u32 - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            triangles = next;
        }
        Self {
            positions: directions.iter().map(|d| centre + *d * radius).collect(),
            normals: directions,
            triangles,
            ..Self::default()
        }
    }

    /// A torus about the y axis.
    pub fn torus(centre: Vec3, major: f32, minor: f32, n_major: usize, n_minor: usize) -> Self {
        let ring: Vec<Vec3> = (0..n_major)
            .map(|j| {
                let (sin, cos) = (TAU * j as f32 / n_major as f32).sin_cos();
                centre + Vec3::new(cos, 0.0, -sin) * major
            })
            .collect();
        Self::tube_frames(&ring, |_| minor, n_minor, true, |_, d| (Vec3::Y.cross(d).normalize(), Vec3::Y))
    }

    /// A tube with flat ends along a path; `radius` in metres, as a function of the share of the path's points passed.
    pub fn tube(path: &[Vec3], radius: impl Fn(f32) -> f32, sides: usize) -> Self {
        let mut frame = None;
        Self::tube_frames(path, radius, sides, false, move |_, d| {
            // Parallel transport: the frame turns no more than the path does.
            let (side, before) = frame.unwrap_or_else(|| (d.any_orthonormal_vector(), d));
            let side: Vec3 = Quat::from_rotation_arc(before, d) * side;
            let side = (side - d * side.dot(d)).normalize();
            frame = Some((side, d));
            (side, d.cross(side))
        })
    }

    fn tube_frames(
        path: &[Vec3],
        radius: impl Fn(f32) -> f32,
        sides: usize,
        closed: bool,
        mut frame: impl FnMut(usize, Vec3) -> (Vec3, Vec3),
    ) -> Self {
        let mut shape = Self::default();
        let n = path.len();
        let radius_at = |i: usize| radius(i as f32 / (n - 1).max(1) as f32);
        let mut ends = Vec::new();
        for i in 0..n {
            let (before, after) =
                if closed { ((i + n - 1) % n, (i + 1) % n) } else { (i.saturating_sub(1), (i + 1).min(n - 1)) };
            let along = path[after] - path[before];
            let d = along.normalize();
            let (x, y) = frame(i, d);
            let slope = if closed { 0.0 } else { (radius_at(after) - radius_at(before)) / along.length() };
            for k in 0..sides {
                let (sin, cos) = (TAU * k as f32 / sides as f32).sin_cos();
                let out = x * cos + y * sin;
                shape.positions.push(path[i] + out * radius_at(i));
                shape.normals.push((out - d * slope).normalize());
            }
            if !closed && (i == 0 || i == n - 1) {
                ends.push((i, if i == 0 { -d } else { d }));
            }
        }
        let sides = sides as u32;
        let n_rings = if closed { n } else { n - 1 } as u32;
        for i in 0..n_rings {
            let (a, b) = (i * sides, (i + 1) % n as u32 * sides);
            for k in 0..sides {
                let l = (k + 1) % sides;
                shape.triangles.extend([[a + k, a + l, b + l], [a + k, b + l, b + k]]);
            }
        }
        for (i, normal) in ends {
            let centre = shape.positions.len() as u32;
            shape.positions.push(path[i]);
            shape.normals.push(normal);
            for k in 0..sides {
                shape.positions.push(shape.positions[i * sides as usize + k as usize]);
                shape.normals.push(normal);
            }
            for k in 0..sides {
                let (p, q) = (centre + 1 + k, centre + 1 + (k + 1) % sides);
                shape.triangles.push(if i == 0 { [centre, q, p] } else { [centre, p, q] });
            }
        }
        shape
    }

    /// A straight round rod with flat ends.
    pub fn rod(from: Vec3, to: Vec3, radius: f32, sides: usize) -> Self {
        Self::tube(&[from, to], |_| radius, sides)
    }

    /// A sheet of `nu × nv` cells: `surface` gives position and unit normal for (u, v) in [0, 1]²; the front is where
    /// ∂u × ∂v points. Texture coordinates are (u, v).
    pub fn sheet(nu: usize, nv: usize, surface: impl Fn(f32, f32) -> (Vec3, Vec3)) -> Self {
        let mut shape = Self::default();
        for j in 0..=nv {
            for i in 0..=nu {
                let (u, v) = (i as f32 / nu as f32, j as f32 / nv as f32);
                let (p, n) = surface(u, v);
                shape.positions.push(p);
                shape.normals.push(n);
                shape.uvs.push(Vec2::new(u, v));
            }
        }
        shape.grid_triangles(0, nu, nv, false);
        shape
    }
}

/// Unit normal of a parametric surface, by central differences.
pub fn normal_of(surface: impl Fn(f32, f32) -> Vec3, u: f32, v: f32) -> Vec3 {
    let e = 1e-3;
    let du = surface(u + e, v) - surface(u - e, v);
    let dv = surface(u, v + e) - surface(u, v - e);
    du.cross(dv).normalize()
}

/// A smooth curve through `points`, `n` pieces from each to the next: cubics whose directions at the points are those of
/// parabolas through three of them by chord length (Bessel), so uneven spacing makes no loops.
pub fn spline(points: &[Vec3], n: usize) -> Vec<Vec3> {
    let last = points.len() - 1;
    // Direction and length of each piece.
    let chords: Vec<(Vec3, f32)> = points
        .windows(2)
        .map(|p| {
            let length = p[0].distance(p[1]);
            ((p[1] - p[0]) / length, length)
        })
        .collect();
    let inner = |i: usize| {
        let ((a, before), (b, after)) = (chords[i - 1], chords[i]);
        (a * after + b * before) / (before + after)
    };
    let tangent = |i: usize| match i {
        0 if last == 1 => chords[0].0,
        0 => 2.0 * chords[0].0 - inner(1),
        i if i == last => 2.0 * chords[last - 1].0 - inner(last - 1),
        i => inner(i),
    };
    let mut path = Vec::with_capacity(last * n + 1);
    for i in 0..last {
        let (p, q, length) = (points[i], points[i + 1], chords[i].1);
        let (dp, dq) = (tangent(i) * length, tangent(i + 1) * length);
        for k in 0..n {
            let t = k as f32 / n as f32;
            let (t2, t3) = (t * t, t * t * t);
            path.push(
                p * (2.0 * t3 - 3.0 * t2 + 1.0) + dp * (t3 - 2.0 * t2 + t) + q * (3.0 * t2 - 2.0 * t3) + dq * (t3 - t2),
            );
        }
    }
    path.push(points[last]);
    path
}
