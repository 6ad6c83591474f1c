//! Meshes by code, fair and foul.

use std::collections::HashMap;

use sunfleck::index::kd::{Scalar, Triangles};
use sunfleck::math::rng::pcg4d;

/// Random numbers by counting.
pub struct Random {
    seed: u32,
    drawn: u32,
}

impl Random {
    pub fn new(seed: u32) -> Self {
        Self { seed, drawn: 0 }
    }

    fn words(&mut self) -> [u32; 4] {
        self.drawn += 1;
        pcg4d([self.seed, self.drawn, 0x6b64, 7])
    }

    /// In [0, 1), of 53 bits.
    pub fn unit(&mut self) -> f64 {
        let [a, b, ..] = self.words();
        (u64::from(a) << 21 ^ u64::from(b) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [−1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub fn below(&mut self, n: usize) -> usize {
        self.words()[2] as usize % n
    }

    pub fn vector(&mut self) -> [f64; 3] {
        std::array::from_fn(|_| self.signed())
    }

    /// Weights of a random point of a triangle.
    pub fn weights(&mut self) -> [f64; 3] {
        let (root, v) = (self.unit().sqrt(), self.unit());
        [1.0 - root, root * (1.0 - v), root * v]
    }
}

pub type Soup = (Vec<[f64; 3]>, Vec<[u32; 3]>);

/// In precision `T`.
pub fn mesh<T: Scalar>((vertices, faces): &Soup) -> Triangles<T> {
    Triangles::new(vertices.iter().map(|p| p.map(T::of)).collect(), faces.clone()).unwrap()
}

/// The point of these weights.
pub fn point<T: Scalar>(corners: [[T; 3]; 3], weights: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| (0..3).map(|i| corners[i][axis].into() * weights[i]).sum())
}

fn soup(corners: Vec<[[f64; 3]; 3]>) -> Soup {
    let faces = (0..corners.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    (corners.concat(), faces)
}

fn add(a: [f64; 3], b: [f64; 3], scale: f64) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] + scale * b[axis])
}

pub const N_KINDS: u32 = 9;

/// A random mesh of one of the kinds, up to `most` triangles.
pub fn random(kind: u32, seed: u32, most: usize) -> (Soup, &'static str) {
    let mut r = Random::new(seed * 31 + kind);
    let n = 1 + r.below(most);
    let on_grid = |r: &mut Random| std::array::from_fn(|_| r.below(5) as f64);
    let mut of =
        |corners: &mut dyn FnMut(&mut Random) -> [[f64; 3]; 3]| soup((0..n).map(|_| corners(&mut r)).collect());
    let small = |r: &mut Random| {
        let (at, size) = (r.vector(), 0.5 * r.unit());
        std::array::from_fn(|_| add(at, r.vector(), size))
    };
    match kind % N_KINDS {
        0 => (of(&mut |r| small(r)), "small triangles"),
        1 => (of(&mut |r| std::array::from_fn(|_| r.vector())), "large triangles"),
        2 => (of(&mut |r| std::array::from_fn(|_| on_grid(r))), "corners on a grid: planar, coincident, without area"),
        3 => {
            // Axis-aligned walls, at places that single precision rounds.
            let mut wall = |r: &mut Random| {
                let (axis, at) = (r.below(3), 0.1 * r.below(4) as f64);
                std::array::from_fn(|_| {
                    let mut p = r.vector();
                    p[axis] = at;
                    p
                })
            };
            (of(&mut wall), "walls")
        }
        4 => {
            let some: Vec<[[f64; 3]; 3]> = (0..3).map(|i| small(&mut Random::new(seed ^ i << 20))).collect();
            (of(&mut |r| some[r.below(3)]), "copies of three")
        }
        5 => {
            let mut sliver = |r: &mut Random| {
                let (a, b) = (r.vector(), r.vector());
                let c = add(add(a, b, r.unit()), r.vector(), 1e-7 * r.unit());
                [a, add(a, b, 1.0), c]
            };
            (of(&mut sliver), "slivers")
        }
        6 => {
            let mut none = |r: &mut Random| {
                let (a, b) = (r.vector(), r.vector());
                match r.below(3) {
                    0 => [a; 3],
                    1 => [a, b, a],
                    _ => small(r),
                }
            };
            (of(&mut none), "points and lines between triangles")
        }
        7 => {
            let mut flat = |r: &mut Random| std::array::from_fn(|_| [r.signed(), r.signed(), 0.25]);
            (of(&mut flat), "all in one plane")
        }
        _ => {
            let (mut sphere, offset) = (icosphere(1 + (seed % 2)), r.vector());
            sphere.0.iter_mut().for_each(|p| *p = add(*p, offset, 1000.0));
            (sphere, "icosphere")
        }
    }
}

/// Radius 1, outward, 20 · 4^level faces.
pub fn icosphere(level: u32) -> Soup {
    let g = (1.0 + 5.0f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push([a, b, 0.0]);
    }
    for (a, b) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        vertices.push([0.0, a, b]);
    }
    for (a, b) in [(g, -1.0), (g, 1.0), (-g, -1.0), (-g, 1.0)] {
        vertices.push([a, 0.0, b]);
    }
    let round = |p: [f64; 3]| {
        let length = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.map(|x| x / length)
    };
    vertices.iter_mut().for_each(|p| *p = round(*p));
    // The faces of the hull: three vertices an edge apart, outward.
    let edge2 = |a: usize, b: usize| (0..3).map(|i| (vertices[a][i] - vertices[b][i]).powi(2)).sum::<f64>();
    let near = |a, b| edge2(a, b) < 1.2;
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    let [p, q, s] = [vertices[a], vertices[b], vertices[c]];
                    let det = p[0] * (q[1] * s[2] - q[2] * s[1]) - p[1] * (q[0] * s[2] - q[2] * s[0])
                        + p[2] * (q[0] * s[1] - q[1] * s[0]);
                    faces.push(if det > 0.0 { [a, b, c] } else { [a, c, b] }.map(|v| v as u32));
                }
            }
        }
    }
    assert_eq!(faces.len(), 20);
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut split = Vec::new();
        for [a, b, c] in faces {
            let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    vertices.push(round(add(vertices[a as usize], vertices[b as usize], 1.0)));
                    vertices.len() as u32 - 1
                })
            });
            split.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        faces = split;
    }
    (vertices, faces)
}
