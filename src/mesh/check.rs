//! The check of a mesh.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::crossings::{Contact, are_collinear, contact};
use super::orientation::{Facing, by_rays};
use super::overlaps::{Limits, Overlaps, Pair, TooMany};
use super::report::{Doubt, Report, Shell, Verdict};
use super::topology::Topology;
use super::{Error, Mesh, corners_of_box, largest};
use crate::index::kd::{KdOptions, KdTree, LazyKd, Sah, Triangles};

/// Pairs of faces that intersect or touch and are listed, at most.
const MAX_PAIRS: usize = 1 << 24;
/// Pairs of faces near each other that are tested, at most: more take a quarter of an hour or so.
const MAX_TESTS: usize = 1 << 33;

/// How a mesh is checked. The report does not depend on it, but for what is left out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CheckOptions {
    /// Of the tree that rays go through; `kd.parallel` is for the whole check.
    pub kd: KdOptions,
    /// Whether the tree is built where rays come, not before.
    pub lazy: bool,
    /// Whether to look for faces that intersect or touch. If not, the verdict takes it that there are none.
    pub intersections: bool,
}

impl Default for CheckOptions {
    /// Everything, in parallel. One ray a face does not pay for the best tree: steps are said to cost four times what they
    /// do, which makes the whole check faster.
    fn default() -> Self {
        let sah = Sah { traversal: 4.0, ..Sah::default() };
        Self { kd: KdOptions { sah, parallel: true, ..KdOptions::default() }, lazy: false, intersections: true }
    }
}

/// Checks a mesh. The report is the same on any number of threads, at any unit of length and at any offset, as far as the
/// coordinates remain what they were.
///
/// Rays ([`by_rays`]) and the way neighbours run along their common edge are independent of each other, and have to agree.
pub fn check(mesh: &Mesh, options: &CheckOptions) -> Result<Report, Error> {
    // Refuses what is not a mesh.
    Triangles::new(mesh.vertices.clone(), mesh.faces.clone())?;
    let parallel = options.kd.parallel;
    let solid = Merged::new(mesh);
    let degenerate: Vec<bool> = solid.per_face(parallel, |face| are_collinear(solid.corners(face)));
    let has_edges = |face: usize| has_three(solid.faces[face]);
    let topology = Topology::new(&solid.faces, has_edges, solid.vertices.len(), parallel);
    let duplicates = solid.duplicates();
    let contacts = match options.intersections {
        true => solid.contacts(&degenerate, &duplicates, parallel)?,
        false => Vec::new(),
    };
    let of_kind = |wanted| contacts.iter().filter(|(_, kind)| *kind == wanted).map(|(pair, _)| *pair).collect();
    let mut report = Report {
        vertices: mesh.vertices.len(),
        faces: mesh.faces.len(),
        merged_vertices: solid.n_merged,
        unused_vertices: solid.n_unused,
        degenerate: (0..).zip(&degenerate).filter(|(_, is)| **is).map(|(face, _)| face).collect(),
        duplicates,
        open_edges: topology.open,
        crowded_edges: topology.crowded,
        pinched_vertices: topology.pinched,
        clashing_edges: topology.clashing,
        intersections: of_kind(Contact::Cross),
        touching: of_kind(Contact::Touch),
        shells: Vec::new(),
        one_sided: topology.one_sided,
        verdict: Verdict::Outward,
        inward: Vec::new(),
        disputed: Vec::new(),
    };
    let mut shells =
        Shells::new((0..mesh.faces.len()).filter(|&face| has_edges(face)), &topology.shell, &topology.against);
    let doubt = if shells.members.is_empty() {
        Some(Doubt::Empty)
    } else if !report.open_edges.is_empty() {
        Some(Doubt::Open)
    } else if !report.intersections.is_empty() {
        Some(Doubt::Intersecting)
    } else if !report.one_sided.is_empty() {
        Some(Doubt::OneSided)
    } else {
        let facings = solid.facings(&report.duplicates, options)?;
        report.disputed = shells.vote(&facings);
        if !report.disputed.is_empty() {
            Some(Doubt::Disputed)
        } else if shells.members.iter().any(|shell| shell.first_facing.is_none()) {
            Some(Doubt::Undecided)
        } else {
            None
        }
    };
    (report.shells, report.inward) = shells.finish(doubt.is_none());
    report.verdict = match doubt {
        Some(doubt) => Verdict::Unknown(doubt),
        None if report.inward.is_empty() => Verdict::Outward,
        None if report.inward.len() == shells.n_faces() => Verdict::Inward,
        None => Verdict::Mixed,
    };
    Ok(report)
}

fn has_three([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && c != a
}

/// A mesh whose vertices in the same place are one, of coordinates near 1.
struct Merged {
    /// Scaled by a power of two: as exact as they were.
    vertices: Vec<[f64; 3]>,
    /// By the first vertex in each place.
    faces: Vec<[u32; 3]>,
    n_merged: usize,
    n_unused: usize,
}

impl Merged {
    fn new(mesh: &Mesh) -> Self {
        let mut first = HashMap::with_capacity(mesh.vertices.len());
        let merged: Vec<u32> = (0..)
            .zip(&mesh.vertices)
            // −0 is 0.
            .map(|(i, p)| *first.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(i))
            .collect();
        let mut is_used = vec![false; mesh.vertices.len()];
        mesh.faces.iter().flatten().for_each(|&v| is_used[v as usize] = true);
        let used = || mesh.vertices.iter().zip(&is_used).filter(|(_, is)| **is).map(|(p, _)| *p);
        let greatest = used().fold(0.0, |m: f64, p| m.max(largest(p.into())));
        let scale = if greatest > 0.0 { 2.0f64.powi(-(greatest.log2() as i32).clamp(-1000, 1000)) } else { 1.0 };
        Self {
            // The others may lie anywhere.
            vertices: mesh
                .vertices
                .iter()
                .zip(&is_used)
                .map(|(p, is)| p.map(|x| if *is { x * scale } else { 0.0 }))
                .collect(),
            faces: mesh.faces.iter().map(|corners| corners.map(|v| merged[v as usize])).collect(),
            n_merged: mesh.vertices.len() - first.len(),
            n_unused: is_used.iter().filter(|is| !**is).count(),
        }
    }

    fn corners(&self, face: usize) -> [[f64; 3]; 3] {
        self.faces[face].map(|v| self.vertices[v as usize])
    }

    fn per_face<R: Send>(&self, parallel: bool, of: impl Fn(usize) -> R + Sync + Send) -> Vec<R> {
        if parallel {
            (0..self.faces.len()).into_par_iter().with_min_len(1024).map(of).collect()
        } else {
            (0..self.faces.len()).map(of).collect()
        }
    }

    fn duplicates(&self) -> Vec<[u32; 2]> {
        let mut first = HashMap::with_capacity(self.faces.len());
        let mut duplicates = Vec::new();
        for (face, &corners) in (0..).zip(&self.faces) {
            let mut key = corners;
            key.sort_unstable();
            let before = *first.entry(key).or_insert(face);
            if before != face {
                duplicates.push([face, before]);
            }
        }
        duplicates
    }

    /// Pairs of faces that intersect or touch, in rising order.
    fn contacts(
        &self,
        degenerate: &[bool],
        duplicates: &[[u32; 2]],
        parallel: bool,
    ) -> Result<Vec<Pair<Contact>>, Error> {
        let boxes = self.per_face(parallel, |face| {
            let [a, b, c] = self.corners(face);
            [0, 1].map(|end| {
                std::array::from_fn(|i| if end == 0 { a[i].min(b[i]).min(c[i]) } else { a[i].max(b[i]).max(c[i]) })
            })
        });
        // Of duplicates the first stands for all: they would be so many pairs of boxes that have nothing to tell.
        let mut is_part: Vec<bool> = degenerate.iter().map(|is| !is).collect();
        duplicates.iter().for_each(|&[again, _]| is_part[again as usize] = false);
        let faces = (0..self.faces.len() as u32).filter(|&face| is_part[face as usize]).collect();
        let kind = |a: u32, b: u32| {
            let (a, b) = (a as usize, b as usize);
            contact(self.corners(a), self.faces[a], self.corners(b), self.faces[b])
        };
        let limits = Limits { found: MAX_PAIRS, asked: MAX_TESTS };
        let contacts =
            Overlaps::new(&boxes, faces, parallel).pairs(kind, limits).map_err(|too_many| match too_many {
                TooMany::Found => Error::Tangled(MAX_PAIRS),
                TooMany::Asked => Error::Crowded(MAX_TESTS),
            })?;
        if duplicates.is_empty() {
            return Ok(contacts);
        }
        let mut copies: HashMap<u32, Vec<u32>> = HashMap::new();
        duplicates.iter().for_each(|&[again, first]| copies.entry(first).or_insert(vec![first]).push(again));
        let all = |face: &u32| copies.get(face).cloned().unwrap_or(vec![*face]);
        let mut every = Vec::new();
        for ([a, b], kind) in contacts {
            let (a, b) = (all(&a), all(&b));
            if every.len() + a.len() * b.len() > MAX_PAIRS {
                return Err(Error::Tangled(MAX_PAIRS));
            }
            every.extend(a.iter().flat_map(|&a| b.iter().map(move |&b| ([a.min(b), a.max(b)], kind))));
        }
        every.sort_unstable();
        Ok(every)
    }

    /// By rays, in a frame around the origin: there rays begin where they should.
    ///
    /// No ray decides on a face that has a copy. Through others, two copies are as good as none.
    fn facings(&self, duplicates: &[[u32; 2]], options: &CheckOptions) -> Result<Vec<Facing>, Error> {
        let [min, max] = corners_of_box(self.faces.iter().flatten().map(|&v| self.vertices[v as usize]));
        let centre = 0.5 * (min + max);
        let vertices = self.vertices.iter().map(|&p| (DVec3::from(p) - centre).to_array()).collect();
        let mut n_copies = vec![1u32; self.faces.len()];
        for &[again, first] in duplicates {
            n_copies[first as usize] += 1;
            n_copies[again as usize] = 0;
        }
        let odd: Vec<usize> = (0..self.faces.len()).filter(|&face| n_copies[face] % 2 == 1).collect();
        let triangles = Triangles::new(vertices, odd.iter().map(|&face| self.faces[face]).collect())?;
        let parallel = options.kd.parallel;
        let of_odd = match options.lazy {
            true => by_rays(&LazyKd::new(triangles, &options.kd)?, parallel),
            false => by_rays(&KdTree::new(triangles, &options.kd)?, parallel),
        };
        let mut facings = vec![Facing::Undecided; self.faces.len()];
        for (&face, facing) in odd.iter().zip(of_odd).filter(|(face, _)| n_copies[**face] == 1) {
            facings[face] = facing;
        }
        Ok(facings)
    }
}

struct Member {
    faces: Vec<u32>,
    /// Which way the first face points, once known.
    first_facing: Option<Facing>,
}

/// The shells, and how their faces run.
struct Shells<'a> {
    members: Vec<Member>,
    against: &'a [bool],
}

impl<'a> Shells<'a> {
    fn new(faces: impl Iterator<Item = usize>, shell: &[u32], against: &'a [bool]) -> Self {
        let mut members: Vec<Member> = Vec::new();
        let mut place = HashMap::new();
        for face in faces {
            let at = *place.entry(shell[face]).or_insert(members.len());
            if at == members.len() {
                members.push(Member { faces: Vec::new(), first_facing: None });
            }
            members[at].faces.push(face as u32);
        }
        Self { members, against }
    }

    fn n_faces(&self) -> usize {
        self.members.iter().map(|shell| shell.faces.len()).sum()
    }

    /// Lets the rays of each shell say how it lies; the faces that say otherwise than most.
    fn vote(&mut self, facings: &[Facing]) -> Vec<u32> {
        let mut disputed = Vec::new();
        for shell in &mut self.members {
            // What each says of the first.
            let says = |face: u32, of_first: Facing| {
                let turned = self.against[face as usize];
                match (facings[face as usize], of_first) {
                    (Facing::Undecided, _) | (_, Facing::Undecided) => false,
                    (a, b) => (a == b) != turned,
                }
            };
            let count = |facing| shell.faces.iter().filter(|&&face| says(face, facing)).count();
            let (outward, inward) = (count(Facing::Outward), count(Facing::Inward));
            shell.first_facing = match () {
                () if outward == 0 && inward == 0 => None,
                () if outward >= inward => Some(Facing::Outward),
                () => Some(Facing::Inward),
            };
            let fewer = if outward >= inward { Facing::Inward } else { Facing::Outward };
            disputed.extend(shell.faces.iter().copied().filter(|&face| says(face, fewer)));
        }
        disputed.sort_unstable();
        disputed
    }

    /// The shells for the report, and the faces that point inward.
    fn finish(&self, is_known: bool) -> (Vec<Shell>, Vec<u32>) {
        let mut inward = Vec::new();
        let mut shells = Vec::new();
        for shell in &self.members {
            let against = shell.faces.iter().filter(|&&face| self.against[face as usize]).count();
            let minority = against.min(shell.faces.len() - against);
            let most_against = 2 * against > shell.faces.len();
            let facing = shell.first_facing.filter(|_| is_known);
            if let Some(first) = facing {
                let is_inward = |face: &u32| (first == Facing::Inward) != self.against[*face as usize];
                inward.extend(shell.faces.iter().copied().filter(is_inward));
            }
            let facing = facing.map(|first| match (first, most_against) {
                (Facing::Outward, true) => Facing::Inward,
                (Facing::Inward, true) => Facing::Outward,
                (facing, _) => facing,
            });
            shells.push(Shell { first_face: shell.faces[0], faces: shell.faces.len(), facing, minority });
        }
        inward.sort_unstable();
        (shells, inward)
    }
}
