//! Closed meshes made by a rule, the same on every machine: a sphere, and an asteroid. Outward normals.

use glam::DVec3;

use super::Mesh;
use super::collapse::Collapse;
use super::resize::{quarter, subdivide};
use crate::math::rng::pcg4d;

/// Faces of the mesh of Eros that the literature scales.
pub const EROS_FACES: usize = 14_744;

/// The unit sphere: an icosahedron whose faces are split in four `level` times, 20·4^level faces. `level` is at most 12.
pub fn icosphere(level: u32) -> Mesh {
    let long = (1.0 + 5.0f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for axis in 0..3 {
        for (a, b) in [(1.0, long), (-1.0, long), (1.0, -long), (-1.0, -long)] {
            let mut p = [0.0; 3];
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
            vertices.push(DVec3::from(p).normalize().to_array());
        }
    }
    let mut faces = Vec::new();
    let at = |i: usize| DVec3::from(vertices[i]);
    // Neighbours are 1.05 apart, others at least 1.7.
    let near = |i: usize, j: usize| at(i).distance_squared(at(j)) < 2.0;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let outward = at(a).dot(at(b).cross(at(c))) > 0.0;
                    faces.push(if outward { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    let mut mesh = Mesh { vertices, faces };
    for _ in 0..level.min(12) {
        let old = mesh.vertices.len();
        mesh = quarter(&mesh);
        for p in &mut mesh.vertices[old..] {
            *p = DVec3::from(*p).normalize().to_array();
        }
    }
    mesh
}

/// A bumpy, elongated body with craters, some 34 long and 12 across (kilometres, as Eros), at least 300 faces.
///
/// Made with [`EROS_FACES`], then split or simplified as by [`resize`](super::resize::resize): every size is of the same shape.
/// An odd number becomes the next even one, for a closed mesh has no other. Each ray from the origin meets the surface once,
/// so it does not intersect itself.
pub fn asteroid(n_faces: usize, seed: u32) -> Mesh {
    let mut mesh = icosphere(6);
    let relief = Relief::new(seed);
    for p in &mut mesh.vertices {
        *p = relief.place(DVec3::from(*p)).to_array();
    }
    let simplify = |mesh: &Mesh, n: usize| {
        let mut collapse = Collapse::new(mesh, Some(DVec3::ZERO));
        collapse.run(n);
        collapse.finish()
    };
    let base = simplify(&mesh, EROS_FACES);
    if n_faces < EROS_FACES { simplify(&base, n_faces.max(300)) } else { subdivide(&base, n_faces) }
}

/// Half the axes.
const HALF: DVec3 = DVec3::new(17.0, 6.5, 5.5);
const CRATERS: u32 = 40;

struct Crater {
    middle: DVec3,
    /// As a chord of the unit sphere.
    radius: f64,
    /// As a share of the distance to the origin.
    depth: f64,
}

struct Relief {
    seed: u32,
    craters: Vec<Crater>,
}

impl Relief {
    fn new(seed: u32) -> Self {
        let crater = |i: u32| {
            let mut draws = (0..).map(|k| pcg4d([i, k, 0xc7a7e5, seed]).map(|bits| f64::from(bits) / 2.0f64.powi(32)));
            let mut next = || draws.find(|d| inside(d).is_some()).unwrap_or([1.0, 0.5, 0.5, 0.5]);
            let draw = next();
            // Few are large.
            let radius = 0.1 + 0.45 * draw[3].powi(4);
            Crater { middle: inside(&draw).unwrap_or(DVec3::X), radius, depth: 0.25 * radius }
        };
        Self { seed, craters: (0..CRATERS).map(crater).collect() }
    }

    /// Where the surface is in the direction of a point of the unit sphere, once that is stretched.
    fn place(&self, p: DVec3) -> DVec3 {
        let mut height = 1.0;
        let (mut scale, mut size) = (1.3, 0.22);
        for octave in 0..6 {
            height += size * self.noise(p * scale, octave);
            scale *= 2.1;
            size *= 0.45;
        }
        for crater in &self.craters {
            let s = p.distance_squared(crater.middle) / (crater.radius * crater.radius);
            if s < 1.0 {
                height -= crater.depth * (1.0 - s) * (1.0 - s);
            }
        }
        let q = HALF * p * height;
        // Turned, so that no axis of the body lies along one of space.
        let turn = |a: f64, b: f64| (0.8 * a - 0.6 * b, 0.6 * a + 0.8 * b);
        let (x, y) = turn(q.x, q.y);
        let (y, z) = turn(y, q.z);
        DVec3::new(x, y, z)
    }

    /// Between −1 and 1, smooth: values at the corners of unit cells (Perlin's quintic between them).
    fn noise(&self, p: DVec3, octave: u32) -> f64 {
        let cell = p.floor();
        let t = p - cell;
        let t = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
        let value = |corner: DVec3| {
            let [x, y, z] = corner.to_array().map(|c| c as i32 as u32);
            f64::from(pcg4d([x, y, z, self.seed ^ octave << 24])[0]) / 2.0f64.powi(31) - 1.0
        };
        let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
        let row = |y: f64, z: f64| {
            let corner = cell + DVec3::new(0.0, y, z);
            mix(value(corner), value(corner + DVec3::X), t.x)
        };
        mix(mix(row(0.0, 0.0), row(1.0, 0.0), t.y), mix(row(0.0, 1.0), row(1.0, 1.0), t.y), t.z)
    }
}

/// A direction from three numbers in [0, 1), even over the sphere; none outside of the ball.
fn inside(draw: &[f64; 4]) -> Option<DVec3> {
    let p = DVec3::new(draw[0], draw[1], draw[2]) * 2.0 - 1.0;
    (0.01..=1.0).contains(&p.length_squared()).then(|| p.normalize())
}
