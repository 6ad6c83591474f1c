//! `sunfleck mesh-check`.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, bail};
use serde_json::{Value, json};
use sunfleck::mesh::io::{self, Format, Loaded};
use sunfleck::mesh::orientation::Facing;
use sunfleck::mesh::{CheckOptions, Doubt, Report, Verdict, check};
use sunfleck::output::{VERSION, atomic};
use sunfleck::scene::load;

use crate::cli::Usage;
use crate::cli::mesh::MeshCheckArgs;

/// Of a list, what is shown without `--json`.
const SHOWN: usize = 10;

pub fn run(args: &MeshCheckArgs) -> Result<ExitCode> {
    let output = args.output.as_deref().map(|path| Ok::<_, anyhow::Error>((path, format(args, path)?))).transpose()?;
    crate::devices::use_threads(args.threads)?;
    let loaded = read(&args.mesh)?;
    let options = CheckOptions { intersections: !args.no_intersections, ..CheckOptions::default() };
    let report = check(&loaded.mesh, &options).with_context(|| args.mesh.display().to_string())?;
    let file = InFile { args, loaded: &loaded, report: &report };
    if args.json {
        crate::print(&serde_json::to_string_pretty(&file.json())?);
    } else {
        crate::print(&file.text());
    }
    let Some((path, format)) = output else {
        return Ok(if report.is_clean() { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    };
    if let Verdict::Unknown(doubt) = report.verdict {
        bail!("nothing is written: which faces point inward cannot be said: {}", words(doubt));
    }
    let mut fixed = loaded.mesh.clone();
    fixed.flip(&report.inward);
    if format == Format::Stl {
        // As the file will have it.
        fixed.vertices.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
    }
    let written = check(&fixed, &options).with_context(|| path.display().to_string())?;
    atomic::write(path, |writer| io::write(writer, &fixed, format))?;
    eprintln!("{} faces turned round; wrote {}", file.faces(&report.inward).len(), path.display());
    if written.verdict != Verdict::Outward {
        eprintln!(
            "sunfleck: warning: {}: rounding to STL's single precision spoils the mesh; .obj, .ply and .off do not round",
            path.display()
        );
    }
    Ok(if written.is_clean() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Before the work: whether and how `path` can be written.
fn format(args: &MeshCheckArgs, path: &Path) -> Result<Format> {
    let Some(format) = Format::of(path) else {
        bail!(Usage(format!("-o {}: meshes are written as .obj, .ply, .stl and .off", path.display())));
    };
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if same(path, &args.mesh) {
        bail!(Usage(format!("-o {} is the mesh itself: name another file", path.display())));
    }
    atomic::check(path)?;
    Ok(format)
}

/// The mesh of a file in any format; warnings go to the error stream.
pub fn read(path: &Path) -> Result<Loaded> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    match extension.as_str() {
        "gltf" | "glb" => {
            let (loaded, warnings) = load::load_gltf_mesh(path)?;
            warnings.iter().for_each(|warning| eprintln!("sunfleck: warning: {warning}"));
            Ok(loaded)
        }
        known if io::EXTENSIONS.contains(&known) => Ok(io::read(path)?),
        _ => {
            let known = io::EXTENSIONS.join(", .");
            bail!("{}: the extension {extension:?} is none of .gltf, .glb, .{known}", path.display())
        }
    }
}

/// Why there is no telling.
fn words(doubt: Doubt) -> &'static str {
    match doubt {
        Doubt::Empty => "there is no face with three different corners",
        Doubt::Open => "the mesh is not closed",
        Doubt::Intersecting => "faces pass through each other (--no-intersections judges as if they did not)",
        Doubt::OneSided => "the surface has only one side",
        Doubt::Undecided => "faces coincide, or are smaller than rounding",
        Doubt::Disputed => "rays contradict each other",
    }
}

/// The report in the numbers of the file.
struct InFile<'a> {
    args: &'a MeshCheckArgs,
    loaded: &'a Loaded,
    report: &'a Report,
}

impl InFile<'_> {
    /// Polygons of triangles, each once.
    fn faces(&self, triangles: &[u32]) -> Vec<u32> {
        let mut faces: Vec<u32> = triangles.iter().map(|&t| self.loaded.polygons[t as usize]).collect();
        faces.dedup();
        faces
    }

    fn pairs(&self, triangles: &[[u32; 2]]) -> Vec<[u32; 2]> {
        let mut pairs: Vec<_> = triangles.iter().map(|p| p.map(|t| self.loaded.polygons[t as usize])).collect();
        pairs.sort_unstable();
        pairs.dedup();
        pairs
    }

    fn normals(&self) -> String {
        match self.report.verdict {
            Verdict::Outward => "outward".into(),
            Verdict::Inward => "inward, all".into(),
            Verdict::Mixed => {
                let faces = self.faces(&self.report.inward);
                format!("mixed: {} of {} point inward: {}", faces.len(), self.loaded.n_polygons, some(&faces))
            }
            Verdict::Unknown(doubt) => format!("cannot be said: {}", words(doubt)),
        }
    }

    fn text(&self) -> String {
        let Self { report, loaded, .. } = self;
        let plural = |n: usize, what: &str| if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") };
        let fault = |n: usize, what: &str, list: String| format!("no: {}: {list}", plural(n, what));
        let mut manifold = Vec::new();
        if !report.crowded_edges.is_empty() {
            let n = report.crowded_edges.len();
            manifold.push(format!(
                "{} of more than two faces: {}",
                plural(n, "edge"),
                some_pairs(&report.crowded_edges)
            ));
        }
        if !report.pinched_vertices.is_empty() {
            let n = report.pinched_vertices.len();
            let what = if n == 1 { "vertex".into() } else { format!("{n} vertices") };
            manifold.push(format!("{what} of more than one fan: {}", some(&report.pinched_vertices)));
        }
        let of_faces = |faces: &[u32]| match faces.len() {
            0 => "none".into(),
            n => format!("{n}: {}", some(faces)),
        };
        let of_pairs = |pairs: &[[u32; 2]]| match pairs.len() {
            0 => "none".into(),
            n => format!("{}: {}", plural(n, "pair"), some_pairs(pairs)),
        };
        let of_contacts = |pairs: &[[u32; 2]]| match self.args.no_intersections {
            true => "not looked for".into(),
            false => of_pairs(&self.pairs(pairs)),
        };
        let mut rows = vec![
            (
                "vertices",
                format!(
                    "{}{}",
                    report.vertices,
                    match report.merged_vertices {
                        0 => String::new(),
                        n => format!(", {n} in the place of another: taken for one"),
                    }
                ),
            ),
            ("faces", format!("{}, in {}", loaded.n_polygons, plural(report.shells.len(), "shell"))),
            (
                "closed",
                match report.open_edges.len() {
                    _ if report.is_closed() => "yes".into(),
                    0 => "no: there is no face with three different corners".into(),
                    n => fault(n, "open edge", some_pairs(&report.open_edges)),
                },
            ),
            ("manifold", if manifold.is_empty() { "yes".into() } else { format!("no: {}", manifold.join("; ")) }),
            (
                "winding",
                match report.clashing_edges.len() {
                    0 if report.one_sided.is_empty() => "consistent".into(),
                    0 => "consistent, with one side".into(),
                    n => format!(
                        "{} run along the same way by both faces: {}",
                        plural(n, "edge"),
                        some_pairs(&report.clashing_edges)
                    ),
                },
            ),
            ("normals", self.normals()),
            ("degenerate", of_faces(&self.faces(&report.degenerate))),
            ("duplicate", of_pairs(&self.pairs(&report.duplicates))),
            ("intersecting", of_contacts(&report.intersections)),
            ("touching", of_contacts(&report.touching)),
        ];
        if !report.disputed.is_empty() {
            rows.push(("disputed", of_faces(&self.faces(&report.disputed))));
        }
        let lines: Vec<String> = rows.iter().map(|(name, value)| format!("{name:<12}  {value}")).collect();
        lines.join("\n")
    }

    fn json(&self) -> Value {
        let report = self.report;
        let facing = |facing: Option<Facing>| match facing {
            Some(Facing::Outward) => Some("outward"),
            Some(Facing::Inward) => Some("inward"),
            Some(Facing::Undecided) | None => None,
        };
        let shells: Vec<Value> = report
            .shells
            .iter()
            .map(|shell| {
                let first = self.loaded.polygons[shell.first_face as usize];
                json!({
                    "first_face": first,
                    "triangles": shell.faces,
                    "facing": facing(shell.facing),
                    "minority_triangles": shell.minority,
                    "one_sided": report.one_sided.contains(&shell.first_face),
                })
            })
            .collect();
        let (normals, doubt) = match report.verdict {
            Verdict::Outward => ("outward", None),
            Verdict::Inward => ("inward", None),
            Verdict::Mixed => ("mixed", None),
            Verdict::Unknown(doubt) => ("unknown", Some(words(doubt))),
        };
        json!({
            "version": VERSION,
            "mesh": self.args.mesh,
            "vertices": report.vertices,
            "merged_vertices": report.merged_vertices,
            "unused_vertices": report.unused_vertices,
            "faces": self.loaded.n_polygons,
            "triangles": report.faces,
            "clean": report.is_clean(),
            "closed": report.is_closed(),
            "manifold": report.is_manifold(),
            "normals": normals,
            "doubt": doubt,
            "inward": self.faces(&report.inward),
            "disputed": self.faces(&report.disputed),
            "degenerate": self.faces(&report.degenerate),
            "duplicates": self.pairs(&report.duplicates),
            "intersections": (!self.args.no_intersections).then(|| self.pairs(&report.intersections)),
            "touching": (!self.args.no_intersections).then(|| self.pairs(&report.touching)),
            "open_edges": report.open_edges,
            "crowded_edges": report.crowded_edges,
            "clashing_edges": report.clashing_edges,
            "pinched_vertices": report.pinched_vertices,
            "shells": shells,
        })
    }
}

fn some(numbers: &[u32]) -> String {
    listed(numbers.iter().map(u32::to_string), numbers.len())
}

fn some_pairs(pairs: &[[u32; 2]]) -> String {
    listed(pairs.iter().map(|[a, b]| format!("{a}-{b}")), pairs.len())
}

fn listed(items: impl Iterator<Item = String>, n: usize) -> String {
    let text = items.take(SHOWN).collect::<Vec<_>>().join(", ");
    if n > SHOWN { format!("{text} and {} more", n - SHOWN) } else { text }
}
