//! What a check finds.

use super::orientation::Facing;

/// Which way the normals point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// All out of the solid.
    Outward,
    /// All into it.
    Inward,
    /// Those of [`Report::inward`] into it.
    Mixed,
    /// There is no telling.
    Unknown(Doubt),
}

/// Why there is no telling which way normals point. The first that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Doubt {
    /// There is no face with three different corners.
    Empty,
    /// An edge has an odd number of faces: nothing is inside.
    Open,
    /// Faces pass through each other.
    Intersecting,
    /// A shell has only one side.
    OneSided,
    /// A shell has no face that rays decide on: it coincides with another, or is smaller than rounding.
    Undecided,
    /// Rays from faces of one shell contradict each other: those of [`Report::disputed`] the others.
    Disputed,
}

/// Faces joined across edges that exactly two share.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shell {
    /// The lowest.
    pub first_face: u32,
    /// Number of faces.
    pub faces: usize,
    /// Which way they point; none if there is no telling, or that was not asked.
    pub facing: Option<Facing>,
    /// Faces that point the other way than most; of the first half if as many do.
    pub minority: usize,
}

/// What is known of a mesh. Faces and vertices are numbers of the mesh as given, each list in rising order; an edge is its two
/// vertices, the lower first.
///
/// Vertices in exactly the same place are taken for one, and named by the first of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Number of vertices, as given.
    pub vertices: usize,
    /// Number of faces, as given.
    pub faces: usize,
    /// Vertices in the place of one before them.
    pub merged_vertices: usize,
    /// Vertices that no face has.
    pub unused_vertices: usize,
    /// Faces of no area: exactly.
    pub degenerate: Vec<u32>,
    /// Faces with the same three vertices as one before: both, that one second.
    pub duplicates: Vec<[u32; 2]>,
    /// Edges with one face, or another odd number.
    pub open_edges: Vec<[u32; 2]>,
    /// Edges with more than two faces.
    pub crowded_edges: Vec<[u32; 2]>,
    /// Vertices around which faces do not form a single fan.
    pub pinched_vertices: Vec<u32>,
    /// Edges along which faces run the same way: the normals on the two sides contradict each other.
    pub clashing_edges: Vec<[u32; 2]>,
    /// Pairs of faces that pass through each other: exactly. Faces of no area are left out.
    pub intersections: Vec<[u32; 2]>,
    /// Pairs of other faces that have more in common than the vertices they share: a corner or an edge of one lies on the
    /// other, or they overlap in one plane. Exactly, and without faces of no area. There may still be an inside and an outside.
    pub touching: Vec<[u32; 2]>,
    /// In the order of their first faces.
    pub shells: Vec<Shell>,
    /// Shells with one side, by first face.
    pub one_sided: Vec<u32>,
    /// Which way the normals point.
    pub verdict: Verdict,
    /// Faces whose normals point inward; empty if there is no telling.
    pub inward: Vec<u32>,
    /// Faces whose rays contradict most of their shell's.
    pub disputed: Vec<u32>,
}

impl Report {
    /// Whether the surface parts inside from outside.
    pub fn is_closed(&self) -> bool {
        self.open_edges.is_empty() && !self.shells.is_empty()
    }

    /// Whether the surface looks like a plane everywhere, or like the edge of one.
    pub fn is_manifold(&self) -> bool {
        self.crowded_edges.is_empty() && self.pinched_vertices.is_empty()
    }

    /// Whether there is nothing to say against the mesh: closed, manifold, outward, and no face that is degenerate, a
    /// duplicate, or intersects or touches another.
    pub fn is_clean(&self) -> bool {
        self.verdict == Verdict::Outward
            && self.is_manifold()
            && self.degenerate.is_empty()
            && self.duplicates.is_empty()
            && self.intersections.is_empty()
            && self.touching.is_empty()
    }
}
