//! Edges collapsed by quadric error (Garland & Heckbert 1997, "Surface Simplification Using Quadric Error Metrics").

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::{DMat3, DVec3};

use super::Mesh;
use super::resize::{edges, stars};

/// Both ends pull by so much of a quadric's trace: decides where planes do not, and keeps edges of like length.
const PULL: f64 = 1e-4;
/// Least cosine between a face's normals before and after.
const TURN: f64 = 0.3;

/// Σ area² of faces × squared distance to their planes: xᵀ·matrix·x + 2·vector·x + constant.
#[derive(Clone, Copy, Debug)]
struct Quadric {
    matrix: DMat3,
    vector: DVec3,
    constant: f64,
}

impl Quadric {
    const ZERO: Self = Self { matrix: DMat3::ZERO, vector: DVec3::ZERO, constant: 0.0 };

    /// Of the plane of a face.
    fn of([a, b, c]: [DVec3; 3]) -> Self {
        let normal = (b - a).cross(c - a);
        let distance = -normal.dot((a + b + c) / 3.0);
        let matrix = DMat3::from_cols(normal * normal.x, normal * normal.y, normal * normal.z);
        Self { matrix, vector: normal * distance, constant: distance * distance }
    }

    fn plus(self, other: Self) -> Self {
        Self {
            matrix: self.matrix + other.matrix,
            vector: self.vector + other.vector,
            constant: self.constant + other.constant,
        }
    }

    fn trace(&self) -> f64 {
        self.matrix.x_axis.x + self.matrix.y_axis.y + self.matrix.z_axis.z
    }

    fn at(&self, x: DVec3) -> f64 {
        (x.dot(self.matrix * x) + 2.0 * self.vector.dot(x) + self.constant).max(0.0)
    }
}

/// An edge to collapse, the cheapest first; of no use once one of its ends has moved.
type Entry = Reverse<(u64, u32, u32, [u32; 2])>;

pub(super) struct Collapse {
    vertices: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    /// Faces at each vertex that are left.
    stars: Vec<Vec<u32>>,
    /// In the frame of `centre`, for precision far from the origin.
    quadrics: Vec<Quadric>,
    centre: DVec3,
    /// How often a vertex has moved.
    moves: Vec<u32>,
    /// Not surrounded by one ring of faces: at a rim, or where surfaces meet.
    fixed: Vec<bool>,
    gone: Vec<bool>,
    left: usize,
    cheapest: BinaryHeap<Entry>,
    /// Faces that look away from here go on to do so.
    middle: Option<DVec3>,
}

impl Collapse {
    pub(super) fn new(mesh: &Mesh, middle: Option<DVec3>) -> Self {
        let Mesh { vertices, faces } = mesh.clone();
        let n = vertices.len();
        let (gone, left) = (vec![false; faces.len()], faces.len());
        let centre = vertices.first().map_or(DVec3::ZERO, |&p| DVec3::from(p));
        let stars = stars(&vertices, &faces);
        let mut new = Self {
            vertices,
            faces,
            stars,
            quadrics: vec![Quadric::ZERO; n],
            centre,
            moves: vec![0; n],
            fixed: vec![false; n],
            gone,
            left,
            cheapest: BinaryHeap::new(),
            middle: middle.map(|p| p - centre),
        };
        for face in 0..new.faces.len() {
            let quadric = Quadric::of(new.faces[face].map(|v| new.place(v)));
            for v in new.faces[face] {
                new.quadrics[v as usize] = new.quadrics[v as usize].plus(quadric);
            }
        }
        for v in 0..n as u32 {
            new.fixed[v as usize] = !new.is_ringed(v);
        }
        new
    }

    fn place(&self, v: u32) -> DVec3 {
        DVec3::from(self.vertices[v as usize]) - self.centre
    }

    /// The other two corners of the faces at `v`.
    fn spokes(&self, v: u32) -> impl Iterator<Item = [u32; 2]> {
        self.stars[v as usize].iter().map(move |&face| match self.faces[face as usize] {
            [a, b, c] if a == v => [b, c],
            [a, b, c] if b == v => [c, a],
            [a, b, _] => [a, b],
        })
    }

    /// In order, each once.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let mut all: Vec<u32> = self.spokes(v).flatten().collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    fn is_ringed(&self, v: u32) -> bool {
        let spokes: Vec<[u32; 2]> = self.spokes(v).collect();
        let Some(&[first, mut at]) = spokes.first() else { return false };
        let mut used = vec![false; spokes.len()];
        used[0] = true;
        let mut n = 1;
        while at != first {
            let mut next = (0..spokes.len()).filter(|&i| !used[i] && spokes[i].contains(&at));
            let (Some(i), None) = (next.next(), next.next()) else { return false };
            used[i] = true;
            at = if spokes[i][0] == at { spokes[i][1] } else { spokes[i][0] };
            n += 1;
        }
        n == spokes.len() && n == self.neighbours(v).len() && n >= 3
    }

    /// Where the ends of an edge go, and what that costs.
    fn aim(&self, a: u32, b: u32) -> (DVec3, f64) {
        let q = self.quadrics[a as usize].plus(self.quadrics[b as usize]);
        let (p, r) = (self.place(a), self.place(b));
        let pull = PULL * q.trace();
        let to = if self.fixed[a as usize] {
            p
        } else if self.fixed[b as usize] {
            r
        } else {
            let middle = p.midpoint(r);
            let matrix = q.matrix + DMat3::from_diagonal(DVec3::splat(2.0 * pull));
            let best = matrix.inverse() * (middle * (2.0 * pull) - q.vector);
            // Singular without area; nothing of use lies farther than the edge is long.
            if best.distance_squared(middle) <= p.distance_squared(r) { best } else { middle }
        };
        (to, q.at(to) + pull * (to.distance_squared(p) + to.distance_squared(r)))
    }

    fn push(&mut self, a: u32, b: u32) {
        let (a, b) = (a.min(b), a.max(b));
        if !(self.fixed[a as usize] && self.fixed[b as usize]) {
            let (_, cost) = self.aim(a, b);
            if cost.is_finite() {
                let moves = [a, b].map(|v| self.moves[v as usize]);
                self.cheapest.push(Reverse((cost.to_bits(), a, b, moves)));
            }
        }
    }

    /// Until `n_faces` are left, or none can go.
    pub(super) fn run(&mut self, n_faces: usize) {
        // A collapse takes two faces.
        while self.left >= n_faces + 2 {
            let before = self.left;
            let faces = self.faces.iter().zip(&self.gone).filter(|(_, gone)| !**gone).map(|(face, _)| *face);
            for (a, b) in edges(&faces.collect::<Vec<_>>()) {
                self.push(a, b);
            }
            while self.left >= n_faces + 2
                && let Some(Reverse((_, a, b, moves))) = self.cheapest.pop()
            {
                if moves == [a, b].map(|v| self.moves[v as usize]) {
                    self.collapse(a, b);
                }
            }
            // An edge that was refused may be allowed after others.
            if self.left == before {
                break;
            }
        }
    }

    fn collapse(&mut self, a: u32, b: u32) {
        // The one that may be fixed stays.
        let (a, b) = if self.fixed[b as usize] { (b, a) } else { (a, b) };
        let (to, _) = self.aim(a, b);
        if !self.keeps_topology(a, b) || self.turns(a, b, to) || self.turns(b, a, to) {
            return;
        }
        for face in std::mem::take(&mut self.stars[b as usize]) {
            if self.faces[face as usize].contains(&a) {
                self.gone[face as usize] = true;
                self.left -= 1;
                for v in self.faces[face as usize] {
                    self.stars[v as usize].retain(|&f| f != face);
                }
            } else {
                self.faces[face as usize] = self.faces[face as usize].map(|v| if v == b { a } else { v });
                self.stars[a as usize].push(face);
            }
        }
        if !self.fixed[a as usize] {
            self.vertices[a as usize] = (to + self.centre).to_array();
        }
        self.quadrics[a as usize] = self.quadrics[a as usize].plus(self.quadrics[b as usize]);
        self.moves[a as usize] += 1;
        self.moves[b as usize] += 1;
        for v in self.neighbours(a) {
            self.push(a, v);
        }
    }

    /// The link condition (Dey et al. 1999): the ends share the two vertices opposite to the edge, and nothing else.
    fn keeps_topology(&self, a: u32, b: u32) -> bool {
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let common: Vec<u32> = of_a.into_iter().filter(|v| of_b.binary_search(v).is_ok()).collect();
        let opposite = self.spokes(a).filter(|spoke| spoke.contains(&b)).count();
        let &[c, d] = &common[..] else { return false };
        // Else four faces are all there are.
        opposite == 2 && !self.spokes(a).any(|spoke| spoke == [c, d] || spoke == [d, c])
    }

    /// Whether a face at `v` that stays would turn by much, or vanish, if `v` went `to`.
    fn turns(&self, v: u32, other: u32, to: DVec3) -> bool {
        self.spokes(v).filter(|spoke| !spoke.contains(&other)).any(|spoke| {
            let [p, q] = spoke.map(|v| self.place(v));
            let normal = |x: DVec3| (p - x).cross(q - x);
            let (before, after) = (normal(self.place(v)), normal(to));
            let least = TURN * before.length() * after.length();
            // One without area may get some.
            before != DVec3::ZERO && (after == DVec3::ZERO || before.dot(after) < least)
                || self.middle.is_some_and(|middle| (to - middle).dot(after) <= 0.0)
        })
    }

    /// What is left, in the old order, without vertices that no face has.
    pub(super) fn finish(self) -> Mesh {
        let mut place = vec![u32::MAX; self.vertices.len()];
        let mut mesh = Mesh::default();
        for v in self.faces.iter().zip(&self.gone).filter(|(_, gone)| !**gone).flat_map(|(face, _)| face) {
            place[*v as usize] = 0;
        }
        for (v, new) in place.iter_mut().enumerate().filter(|(_, new)| **new == 0) {
            *new = mesh.vertices.len() as u32;
            mesh.vertices.push(self.vertices[v]);
        }
        let left = self.faces.iter().zip(&self.gone).filter(|(_, gone)| !**gone);
        mesh.faces = left.map(|(face, _)| face.map(|v| place[v as usize])).collect();
        mesh
    }
}
