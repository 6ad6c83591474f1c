//! `sunfleck mesh-check`, and glTF, which needs the reader of scenes.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use serde_json::Value;
use sunfleck::mesh::Mesh;
use sunfleck::mesh::io::{Format, read, write};
use sunfleck::scene::load::load_gltf_mesh;

use super::{bumpy, check, placed, tetrahedron};
use crate::not_found;

fn sunfleck(args: &[&str]) -> Output {
    Command::cargo_bin("sunfleck").unwrap().arg("mesh-check").args(args).output().unwrap()
}

fn stdout(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

fn put(path: &Path, mesh: &Mesh) {
    let mut bytes = Vec::new();
    write(&mut bytes, mesh, Format::of(path).unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

#[test]
fn the_verdict_is_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    let name = path.to_str().unwrap();
    let expect = |mesh: &Mesh, args: &[&str], code: i32, texts: &[&str]| {
        put(&path, mesh);
        let output = sunfleck(&[&[name], args].concat());
        assert_eq!(output.status.code(), Some(code), "{output:?}");
        let text = stdout(&output);
        texts.iter().for_each(|t| assert!(text.contains(t), "{t} is not in\n{text}"));
    };
    let mut mesh = bumpy(1, 1);
    expect(&mesh, &["--threads", "1"], 0, &["closed        yes", "manifold      yes", "normals       outward\n"]);
    mesh.flip(&(0..12).collect::<Vec<_>>());
    expect(
        &mesh,
        &[],
        1,
        &["mixed: 12 of 80 point inward: 0, 1, 2, 3, 4, 5, 6, 7, 8, 9 and 2 more\n", "run along the same way"],
    );
    mesh.faces.pop();
    expect(
        &mesh,
        &[],
        1,
        &["closed        no: 3 open edges: ", "normals       cannot be said: the mesh is not closed"],
    );
    let mut two = bumpy(1, 1);
    two = super::together(&two, &placed(&two, 1.0, [1.0, 0.0, 0.0]));
    expect(&two, &[], 1, &["cannot be said: faces pass through", "intersecting  "]);
    expect(&two, &["--no-intersections"], 1, &["rays contradict", "not looked for", "disputed"]);
    expect(&Mesh { faces: Vec::new(), ..mesh }, &[], 1, &["closed        no: there is no face"]);
    let unknown = folder.path().join("a.step");
    fs::write(&unknown, b"").unwrap();
    let absent = format!("no.obj: {}", not_found());
    for (args, code, text) in [
        (&[][..], 2, "MESH"),
        (&[unknown.to_str().unwrap()], 1, "a.step: the extension \"step\" is none of .gltf, .glb, .obj, .ply"),
        (&["no.obj"], 1, &*absent),
        (&[name, "--fix"], 2, "--output <OUT>"),
        (&[name, "-o", "b.obj"], 2, "--fix"),
        (&[name, "--fix", "-o", "b.xyz"], 2, "b.xyz: meshes are written as"),
        (&[name, "--fix", "-o", name], 2, "is the mesh itself"),
        (&[name, "--fix", "-o", "/no/such/b.obj"], 1, "there is no folder"),
    ] {
        let output = sunfleck(args);
        let error = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "{args:?}: {error}");
        assert!(error.contains(text) && error.lines().count() == 1, "{args:?}: {error}");
    }
}

#[test]
fn a_fixed_mesh_is_clean() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let whole = bumpy(2, 5);
    let mut wrong = whole.clone();
    wrong.flip(&super::random_set(wrong.faces.len(), 0.3, 1));
    put(Path::new(&at("wrong.ply")), &wrong);
    for name in ["fixed.obj", "fixed.ply", "fixed.off", "fixed.stl"] {
        let output = sunfleck(&[&at("wrong.ply"), "--fix", "-o", &at(name)]);
        assert_eq!(output.status.code(), Some(0), "{output:?}");
        let fixed = read(Path::new(&at(name))).unwrap().mesh;
        assert!(check(&fixed).is_clean(), "{name}");
        if name != "fixed.stl" {
            // The corners of what was flipped come in another order, round the same way.
            let turned = |f: [u32; 3]| (0..3).map(|i| [f[i], f[(i + 1) % 3], f[(i + 2) % 3]]).min();
            assert!(fixed.faces.iter().zip(&whole.faces).all(|(a, b)| turned(*a) == turned(*b)));
        }
        // Again, it changes nothing.
        let again = at(&format!("again-{name}"));
        assert_eq!(sunfleck(&[&at(name), "--fix", "-o", &again]).status.code(), Some(0));
        if name != "fixed.stl" {
            assert_eq!(fs::read(at(name)).unwrap(), fs::read(again).unwrap());
        }
    }
    // STL rounds: what does not survive that is told.
    put(Path::new(&at("far.ply")), &placed(&whole, 1e-3, [1e5; 3]));
    let output = sunfleck(&[&at("far.ply"), "--fix", "-o", &at("far.stl")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("single precision"));
    assert!(!check(&read(Path::new(&at("far.stl"))).unwrap().mesh).is_clean());
    // What is not a matter of flipping stays, and nothing is written where it cannot be said.
    let mut flat = wrong.clone();
    flat.faces.push([0, 0, 1]);
    put(Path::new(&at("flat.obj")), &flat);
    assert_eq!(sunfleck(&[&at("flat.obj"), "--fix", "-o", &at("flat-fixed.obj")]).status.code(), Some(1));
    assert_eq!(read(Path::new(&at("flat-fixed.obj"))).unwrap().mesh.faces.len(), flat.faces.len());
    wrong.faces.pop();
    put(Path::new(&at("open.obj")), &wrong);
    let output = sunfleck(&[&at("open.obj"), "--fix", "-o", &at("none.obj")]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        String::from_utf8(output.stderr)
            .unwrap()
            .contains("nothing is written: which faces point inward cannot be said")
    );
    assert!(!Path::new(&at("none.obj")).exists());
}

/// Faces are the file's: of a cube of six squares, the second and last the wrong way round.
#[test]
fn json_counts_the_faces_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("cube.obj");
    let vertices = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n";
    let faces = "f 4 3 2 1\nf 8 7 6 5\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 1 4 8 5\n";
    fs::write(&path, format!("{vertices}{faces}")).unwrap();
    let output = sunfleck(&[path.to_str().unwrap(), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&json["faces"], &json["triangles"], &json["vertices"]), (&6.into(), &12.into(), &8.into()));
    assert_eq!(json["inward"], serde_json::json!([1, 5]));
    assert_eq!((&json["normals"], &json["doubt"], &json["clean"]), (&"mixed".into(), &Value::Null, &false.into()));
    assert_eq!((&json["closed"], &json["manifold"]), (&true.into(), &true.into()));
    assert_eq!(json["shells"][0]["facing"], "outward");
    assert_eq!(json["clashing_edges"].as_array().unwrap().len(), 6);
    for list in [
        "disputed",
        "degenerate",
        "duplicates",
        "intersections",
        "touching",
        "open_edges",
        "crowded_edges",
        "pinched_vertices",
    ] {
        assert_eq!(json[list], serde_json::json!([]), "{list}");
    }
}

/// A tetrahedron twice: mirrored, and far away, where only double precision keeps its shape.
#[test]
fn gltf_is_read_with_its_nodes() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = tetrahedron();
    let mut bytes: Vec<u8> = mesh.faces.iter().flatten().map(|&v| v as u8).collect();
    bytes.extend(mesh.vertices.iter().flatten().flat_map(|&x| (x as f32).to_le_bytes()));
    fs::write(folder.path().join("a.bin"), bytes).unwrap();
    let gltf = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,2]}],
        "nodes":[{"translation":[1e7,0.1,0],"children":[1]},{"mesh":0,"scale":[1e-3,1e-3,1e-3]},{"mesh":0,"scale":[-1,1,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":1},"indices":0}]}],
        "accessors":[{"bufferView":0,"componentType":5121,"count":12,"type":"SCALAR"},
            {"bufferView":1,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}],
        "bufferViews":[{"buffer":0,"byteLength":12},{"buffer":0,"byteOffset":12,"byteLength":48}],
        "buffers":[{"uri":"a.bin","byteLength":60}]}"#;
    let path = folder.path().join("a.gltf");
    fs::write(&path, gltf).unwrap();
    let (loaded, warnings) = load_gltf_mesh(&path).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!(loaded.mesh.vertices[0], [1e7, 0.1, 0.0]);
    assert_eq!(loaded.mesh.vertices[1], [1e7 + 1e-3, 0.1, 0.0]);
    assert_eq!(loaded.mesh.vertices[5], [-1.0, 0.0, 0.0]);
    assert!(check(&loaded.mesh).is_clean());
    assert_eq!(sunfleck(&[path.to_str().unwrap()]).status.code(), Some(0));
    fs::write(&path, gltf.replace(r#""count":12"#, r#""count":9"#)).unwrap();
    assert!(stdout(&sunfleck(&[path.to_str().unwrap()])).contains("closed        no: 6 open edges"));
    fs::write(&path, gltf.replace(r#""count":4,"#, r#""count":3,"#)).unwrap();
    let output = sunfleck(&[path.to_str().unwrap()]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.code() == Some(1) && error.contains("meshes[0].primitives[0].indices"), "{error}");
}
