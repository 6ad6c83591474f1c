//! The check of a mesh.

use ::sunfleck::mesh::orientation::Facing;
use ::sunfleck::mesh::{CheckOptions, Doubt, Mesh, Report, Verdict, check};
use numpy::{IntoPyArray, PyReadonlyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::triples;

/// What is known of the mesh, by the names of `MeshReport`; pairs as `[n · 2]`.
#[pyfunction]
pub fn mesh_check<'py>(
    py: Python<'py>,
    vertices: PyReadonlyArray2<'py, f64>,
    faces: PyReadonlyArray2<'py, u32>,
    intersections: bool,
    lazy: bool,
    parallel: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (vertices, faces) = (triples(&vertices)?, triples(&faces)?);
    let report = py.detach(|| {
        let mut options = CheckOptions { lazy, intersections, ..CheckOptions::default() };
        options.kd.parallel = parallel;
        check(&Mesh { vertices: vertices.to_vec(), faces: faces.to_vec() }, &options)
    });
    let report = report.map_err(|error| PyValueError::new_err(error.to_string()))?;
    let closed = report.is_closed();
    let manifold = report.is_manifold();
    let clean = report.is_clean();
    let Report {
        vertices,
        faces,
        merged_vertices,
        unused_vertices,
        degenerate,
        duplicates,
        open_edges,
        crowded_edges,
        pinched_vertices,
        clashing_edges,
        intersections,
        touching,
        shells,
        one_sided,
        verdict,
        inward,
        disputed,
    } = report;
    let found = PyDict::new(py);
    for (name, is) in [("closed", closed), ("manifold", manifold), ("clean", clean)] {
        found.set_item(name, is)?;
    }
    for (name, number) in [
        ("vertices", vertices),
        ("faces", faces),
        ("merged_vertices", merged_vertices),
        ("unused_vertices", unused_vertices),
    ] {
        found.set_item(name, number)?;
    }
    for (name, list) in [
        ("degenerate", degenerate),
        ("pinched_vertices", pinched_vertices),
        ("one_sided", one_sided),
        ("inward", inward),
        ("disputed", disputed),
    ] {
        found.set_item(name, list.into_pyarray(py))?;
    }
    for (name, pairs) in [
        ("duplicates", duplicates),
        ("open_edges", open_edges),
        ("crowded_edges", crowded_edges),
        ("clashing_edges", clashing_edges),
        ("intersections", intersections),
        ("touching", touching),
    ] {
        found.set_item(name, pairs.into_flattened().into_pyarray(py))?;
    }
    let shells: Vec<_> = shells
        .into_iter()
        .map(|shell| (shell.first_face, shell.faces, shell.facing.map(facing), shell.minority))
        .collect();
    found.set_item("shells", shells)?;
    let (verdict, doubt) = match verdict {
        Verdict::Outward => ("outward", None),
        Verdict::Inward => ("inward", None),
        Verdict::Mixed => ("mixed", None),
        Verdict::Unknown(why) => ("unknown", Some(because(why))),
    };
    found.set_item("verdict", verdict)?;
    found.set_item("doubt", doubt)?;
    Ok(found)
}

fn facing(facing: Facing) -> &'static str {
    match facing {
        Facing::Outward => "outward",
        Facing::Inward => "inward",
        Facing::Undecided => "undecided",
    }
}

fn because(doubt: Doubt) -> &'static str {
    match doubt {
        Doubt::Empty => "empty",
        Doubt::Open => "open",
        Doubt::Intersecting => "intersecting",
        Doubt::OneSided => "one-sided",
        Doubt::Undecided => "undecided",
        Doubt::Disputed => "disputed",
    }
}
