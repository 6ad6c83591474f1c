//! What may be typed after `sunfleck mesh-check`.

use std::path::PathBuf;

use clap::Args;

const HELP: &str = "\
A line is printed for each question, with the first ten faces, edges (a-b, by their vertices) or
pairs of faces (a-b) at fault:
  closed        every edge has two faces, or another even number
  manifold      no edge has more than two, and the faces around a vertex form one fan
  winding       neighbours run opposite ways along their common edge
  normals       outward, inward, or mixed: which faces point inward
  degenerate    faces of no area
  duplicate     faces of the same three corners as an earlier one
  intersecting  faces that pass through each other
  touching      faces that lie on each other with a corner, an edge or a part of their area

Normals are judged where the mesh is closed and no faces pass through each other: by a ray from each
face, which must agree with the way that neighbours run along their common edge. There is no
tolerance, and nothing depends on the unit of length. Vertices in exactly the same place are one.
Faces and vertices are counted from 0, in the order of the file; an OBJ's own indices are one more.

Read are .obj, .ply, .stl, .off, .gltf, .glb, and .node with .face beside it (TetGen); written are
.obj, .ply, .stl (in single precision) and .off.

Examples:
  sunfleck mesh-check eros.obj
  sunfleck mesh-check scan.ply --json
  sunfleck mesh-check part.stl --fix -o fixed.obj

Exit codes: 0 closed, manifold, all normals outward, no degenerate, duplicate, intersecting or
touching faces (with --fix: so is what was written); 1 not so, or an error; 2 wrong usage.";

#[derive(Debug, Args)]
#[command(after_help = HELP)]
pub struct MeshCheckArgs {
    /// The file of the mesh
    #[arg(value_name = "MESH")]
    pub mesh: PathBuf,
    /// Turn round the faces that point inward; needs -o
    #[arg(long, requires = "output")]
    pub fix: bool,
    /// Where to put the mesh with --fix: .obj, .ply, .stl or .off, in triangles
    #[arg(short, long, value_name = "OUT", requires = "fix")]
    pub output: Option<PathBuf>,
    /// Print JSON, with all faces
    #[arg(long)]
    pub json: bool,
    /// Do not look for faces that intersect or touch, and judge as if there were none
    #[arg(long)]
    pub no_intersections: bool,
    /// CPU threads [default: all]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
}
