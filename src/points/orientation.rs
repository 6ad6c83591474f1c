//! Consistent orientation of normals: propagation over a minimum spanning tree of the Riemannian graph (Hoppe et al. 1992,
//! "Surface Reconstruction from Unorganized Points", section 3.3).
//!
//! Their edge weight 1 − |nᵢ·nⱼ| takes two parallel sheets for one: it is zero from one to the other. Here an edge also
//! pays for leaving the tangent planes, |nᵢ·e| + |nⱼ·e| with e its direction.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{Error, Indexed};
use crate::index::RadiusSearch;

/// Neighbours in the graph, itself included: with fewer, a surface sampled at random falls into pieces.
const GRAPH_K: usize = 13;
/// Pieces of the graph that come this close are one surface, in spacings.
const GAP: f64 = 4.0;
const BATCH: usize = 1 << 16;
/// Towards the corners and faces of a cube: where a surface is outermost its normal points outward.
const DIRECTIONS: usize = 14;

/// Makes the normals of neighbours agree, and each connected piece point outward at its outermost points. Returns the
/// number of pieces.
///
/// On a closed surface all normals end up pointing outward; on an open one they agree with each other. `normals` are
/// those of `cloud`'s points, zero where there is none.
pub fn orient(cloud: &Indexed, normals: &mut [Vec3]) -> Result<usize, Error> {
    assert_eq!(normals.len(), cloud.positions().len(), "as many normals as points");
    let mut forest = Forest::new(normals.len());
    let mut edges = graph(cloud, normals)?;
    forest.join(&mut edges, normals);
    let mut edges = bridges(cloud, normals, &mut forest);
    forest.join(&mut edges, normals);
    let signs = outward(cloud.positions(), normals, &mut forest);
    for (i, normal) in normals.iter_mut().enumerate() {
        let (root, flipped) = forest.find(i as u32);
        if flipped != signs[root as usize] {
            *normal = -*normal;
        }
    }
    Ok(forest.pieces())
}

/// Weight, and the two points.
type Edge = (u32, u32, u32);

/// Ordered by weight: the bits of a float that is not negative sort as it does.
fn edge(cloud: &Indexed, normals: &[Vec3], i: u32, j: u32) -> Edge {
    let (i, j) = (i.min(j), i.max(j));
    let (a, b) = (normals[i as usize], normals[j as usize]);
    let along = (cloud.positions()[j as usize] - cloud.positions()[i as usize]).normalize_or_zero().as_vec3();
    let bend = (1.0 - a.dot(b).abs()).max(0.0);
    ((bend + a.dot(along).abs() + b.dot(along).abs()).to_bits(), i, j)
}

/// Each point with its nearest ones.
fn graph(cloud: &Indexed, normals: &[Vec3]) -> Result<Vec<Edge>, Error> {
    let mut edges = Vec::new();
    for (batch, queries) in cloud.positions().chunks(BATCH).enumerate() {
        let lists = cloud.nearest(queries, f64::INFINITY, GRAPH_K)?;
        edges.par_extend(lists.indices.par_chunks(GRAPH_K).enumerate().flat_map_iter(|(at, row)| {
            let i = (batch * BATCH + at) as u32;
            let near = row.iter().filter(move |&&j| j != i && j != u32::MAX);
            near.map(move |&j| edge(cloud, normals, i, j))
        }));
    }
    Ok(edges)
}

/// From all pieces but the largest to the others within the gap.
fn bridges(cloud: &Indexed, normals: &[Vec3], forest: &mut Forest) -> Vec<Edge> {
    let roots: Vec<u32> = (0..normals.len() as u32).map(|i| forest.find(i).0).collect();
    let Some(largest) = roots.iter().copied().max_by_key(|&root| (forest.sizes[root as usize], root)) else {
        return Vec::new();
    };
    if forest.sizes[largest as usize] as usize == normals.len() {
        return Vec::new();
    }
    let frame = cloud.frame();
    let gap = frame.length(GAP * cloud.spacing().unwrap_or(0.0)) as f32;
    let lone: Vec<u32> = (0..normals.len() as u32).filter(|&i| roots[i as usize] != largest).collect();
    lone.par_iter()
        .flat_map_iter(|&i| {
            let mut found = Vec::new();
            cloud.tree().within(frame.local(cloud.positions()[i as usize]), gap, |j, _| {
                if roots[j as usize] != roots[i as usize] {
                    found.push(edge(cloud, normals, i, j));
                }
            });
            found
        })
        .collect()
}

/// For each root, whether its piece must be turned round to point outward.
fn outward(positions: &[DVec3], normals: &[Vec3], forest: &mut Forest) -> Vec<bool> {
    let directions: [DVec3; DIRECTIONS] = std::array::from_fn(|i| match i {
        0..8 => DVec3::from_array(std::array::from_fn(|axis| if i >> axis & 1 == 0 { 1.0 } else { -1.0 })).normalize(),
        _ => DVec3::AXES[(i - 8) / 2] * if i % 2 == 0 { 1.0 } else { -1.0 },
    });
    // The outermost point of each piece in each direction, at the slot of its root.
    let mut slots = vec![u32::MAX; positions.len()];
    let mut extremes: Vec<[u32; DIRECTIONS]> = Vec::new();
    for i in (0..positions.len() as u32).filter(|&i| normals[i as usize] != Vec3::ZERO) {
        let slot = &mut slots[forest.find(i).0 as usize];
        if *slot == u32::MAX {
            *slot = extremes.len() as u32;
            extremes.push([i; DIRECTIONS]);
        }
        for (best, direction) in extremes[*slot as usize].iter_mut().zip(directions) {
            if positions[i as usize].dot(direction) > positions[*best as usize].dot(direction) {
                *best = i;
            }
        }
    }
    slots
        .iter()
        .map(|&slot| {
            let Some(extreme) = extremes.get(slot as usize) else { return false };
            let vote = |(&i, direction): (&u32, DVec3)| {
                let facing = normals[i as usize].as_dvec3().dot(direction);
                if forest.find(i).1 { -facing } else { facing }
            };
            extreme.iter().zip(directions).map(vote).sum::<f64>() < 0.0
        })
        .collect()
}

/// The trees joined so far (union-find), and of each point whether its normal is to be flipped against its root's.
struct Forest {
    parents: Vec<u32>,
    /// Against the parent.
    flipped: Vec<bool>,
    /// At roots: number of points.
    sizes: Vec<u32>,
}

impl Forest {
    fn new(n: usize) -> Self {
        Self { parents: (0..n as u32).collect(), flipped: vec![false; n], sizes: vec![1; n] }
    }

    /// Root, and whether flipped against it. Halves the path.
    fn find(&mut self, mut i: u32) -> (u32, bool) {
        let mut flipped = false;
        loop {
            let parent = self.parents[i as usize];
            if parent == i {
                return (i, flipped);
            }
            self.flipped[i as usize] ^= self.flipped[parent as usize];
            self.parents[i as usize] = self.parents[parent as usize];
            flipped ^= self.flipped[i as usize];
            i = self.parents[i as usize];
        }
    }

    /// Kruskal: the edges of the minimum spanning forest, each making its two trees agree.
    fn join(&mut self, edges: &mut [Edge], normals: &[Vec3]) {
        edges.par_sort_unstable();
        for &(_, i, j) in edges.iter() {
            let ((a, flipped_a), (b, flipped_b)) = (self.find(i), self.find(j));
            if a == b {
                continue;
            }
            let (small, large) = if self.sizes[a as usize] < self.sizes[b as usize] { (a, b) } else { (b, a) };
            let opposed = normals[i as usize].dot(normals[j as usize]) < 0.0;
            self.parents[small as usize] = large;
            self.flipped[small as usize] = opposed ^ flipped_a ^ flipped_b;
            self.sizes[large as usize] += self.sizes[small as usize];
        }
    }

    fn pieces(&self) -> usize {
        self.parents.iter().enumerate().filter(|&(i, &parent)| i == parent as usize).count()
    }
}
