//! How faces hang together.

use rayon::prelude::*;

/// The faces at an edge, and how they run along it.
#[derive(Clone, Debug, Default)]
pub struct Topology {
    /// Edges of one face, or of another odd number.
    pub open: Vec<[u32; 2]>,
    /// Edges of more than two faces.
    pub crowded: Vec<[u32; 2]>,
    /// Edges along which more faces run one way than the other, by more than one where their number is odd.
    pub clashing: Vec<[u32; 2]>,
    /// Vertices whose faces are not one fan.
    pub pinched: Vec<u32>,
    /// For each face the first face of its shell, or its own number if it is in none: shells are joined across edges of two
    /// faces.
    pub shell: Vec<u32>,
    /// Whether a face runs against the first face of its shell.
    pub against: Vec<bool>,
    /// Shells, by first face, that come back against themselves, as a Möbius strip does.
    pub one_sided: Vec<u32>,
}

/// An edge of a face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Side {
    /// The lower vertex above the higher.
    edge: u64,
    /// Three times the face, and which of its corners it begins at.
    corner: u32,
    /// Whether it runs from the lower vertex to the higher.
    rises: bool,
}

impl Topology {
    /// Of the `faces` for which `is_part`, whose three vertices differ.
    pub fn new(faces: &[[u32; 3]], is_part: impl Fn(usize) -> bool, n_vertices: usize, parallel: bool) -> Self {
        let mut sides = Vec::with_capacity(3 * faces.len());
        for (face, corners) in faces.iter().enumerate().filter(|(face, _)| is_part(*face)) {
            for i in 0..3 {
                let (from, to) = (corners[i], corners[(i + 1) % 3]);
                let edge = u64::from(from.min(to)) << 32 | u64::from(from.max(to));
                sides.push(Side { edge, corner: (3 * face + i) as u32, rises: from < to });
            }
        }
        if parallel {
            sides.par_sort_unstable();
        } else {
            sides.sort_unstable();
        }
        let mut topology = Self::default();
        let mut shells = Union::new(faces.len());
        let mut fans = Union::new(3 * faces.len());
        let mut one_sided = Vec::new();
        for group in sides.chunk_by(|a, b| a.edge == b.edge) {
            let edge = [(group[0].edge >> 32) as u32, group[0].edge as u32];
            let rising = group.iter().filter(|side| side.rises).count();
            if group.len() % 2 == 1 {
                topology.open.push(edge);
            }
            if group.len() > 2 {
                topology.crowded.push(edge);
            }
            if rising.abs_diff(group.len() - rising) > group.len() % 2 {
                topology.clashing.push(edge);
            }
            if let [a, b] = group
                && !shells.join(a.corner / 3, b.corner / 3, a.rises == b.rises)
            {
                one_sided.push(a.corner / 3);
            }
            for two in group.windows(2) {
                for vertex in edge {
                    fans.join(two[0].corner_at(vertex, faces), two[1].corner_at(vertex, faces), false);
                }
            }
        }
        topology.pinched = pinched(faces, is_part, n_vertices, &mut fans);
        (topology.shell, topology.against) = (0..faces.len() as u32).map(|face| shells.find(face)).unzip();
        topology.one_sided = one_sided.iter().map(|&face| topology.shell[face as usize]).collect();
        topology.one_sided.sort_unstable();
        topology.one_sided.dedup();
        topology
    }
}

impl Side {
    /// The corner of its face at an end.
    fn corner_at(&self, vertex: u32, faces: &[[u32; 3]]) -> u32 {
        let (face, i) = (self.corner / 3, self.corner % 3);
        if faces[face as usize][i as usize] == vertex { self.corner } else { 3 * face + (i + 1) % 3 }
    }
}

/// Vertices at which corners are left that no common edge joins.
fn pinched(faces: &[[u32; 3]], is_part: impl Fn(usize) -> bool, n_vertices: usize, fans: &mut Union) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut fan_of = vec![NONE; n_vertices];
    let mut pinched = Vec::new();
    for (face, corners) in faces.iter().enumerate().filter(|(face, _)| is_part(*face)) {
        for (i, &vertex) in corners.iter().enumerate() {
            let fan = fans.find((3 * face + i) as u32).0;
            let known = &mut fan_of[vertex as usize];
            if *known == NONE {
                *known = fan;
            } else if *known != fan {
                pinched.push(vertex);
            }
        }
    }
    pinched.sort_unstable();
    pinched.dedup();
    pinched
}

/// Disjoint sets whose members are each with or against the root, which is the lowest.
struct Union {
    parent: Vec<u32>,
    /// Of a member against its parent.
    against: Vec<bool>,
}

impl Union {
    fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect(), against: vec![false; n] }
    }

    fn find(&mut self, member: u32) -> (u32, bool) {
        let (mut root, mut against) = (member, false);
        while self.parent[root as usize] != root {
            against ^= self.against[root as usize];
            root = self.parent[root as usize];
        }
        let (mut at, mut left) = (member, against);
        while self.parent[at as usize] != root && at != root {
            let (next, step) = (self.parent[at as usize], self.against[at as usize]);
            (self.parent[at as usize], self.against[at as usize]) = (root, left);
            left ^= step;
            at = next;
        }
        (root, against)
    }

    /// Puts `a` with or against `b`; false if they already are the other way.
    fn join(&mut self, a: u32, b: u32, against: bool) -> bool {
        let ((a, a_against), (b, b_against)) = (self.find(a), self.find(b));
        let against = against ^ a_against ^ b_against;
        if a == b {
            return !against;
        }
        // By path compression alone O(log N) a step.
        let (low, high) = (a.min(b), a.max(b));
        self.parent[high as usize] = low;
        self.against[high as usize] = against;
        true
    }
}
