//! Mesh files, sound and malformed.

use std::fs;
use std::path::Path;

use sunfleck::mesh::io::{Format, Loaded, read, read_obj, read_off, read_ply, read_stl, read_tetgen, write};
use sunfleck::mesh::{Error, Mesh};

use super::{bumpy, check, placed, tetrahedron};
use crate::kd::meshes::Random;
use crate::not_found;

fn written(mesh: &Mesh, format: Format) -> Vec<u8> {
    let mut bytes = Vec::new();
    write(&mut bytes, mesh, format).unwrap();
    bytes
}

fn ply(bytes: &[u8]) -> Result<Loaded, String> {
    read_ply(bytes, bytes.len() as u64)
}

fn stl(bytes: &[u8]) -> Result<Loaded, String> {
    read_stl(bytes, bytes.len() as u64)
}

/// A unit square of two triangles and its lower half again, as polygons: 4, 3.
fn polygons(loaded: &Loaded) {
    assert_eq!(loaded.mesh.vertices, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(loaded.mesh.faces, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert_eq!((loaded.polygons.as_slice(), loaded.n_polygons), (&[0, 0, 1][..], 2));
}

#[test]
fn what_is_written_is_read() {
    // Digits that single precision has not.
    for mesh in [placed(&bumpy(1, 2), 1e-9 / 3.0, [1e3 / 7.0, -1e-300, 1e20]), Mesh::default(), tetrahedron()] {
        for format in [Format::Obj, Format::Ply, Format::Off] {
            let bytes = written(&mesh, format);
            let back = match format {
                Format::Obj if mesh.vertices.is_empty() => continue,
                Format::Obj => read_obj(&bytes[..]),
                Format::Ply => ply(&bytes),
                _ => read_off(&bytes[..]),
            };
            assert_eq!(back.unwrap(), Loaded::of_triangles(mesh.clone()), "{format:?}");
        }
    }
    let mut single = bumpy(1, 2);
    single.vertices.iter_mut().flatten().for_each(|x| *x = f64::from(*x as f32));
    let back = stl(&written(&single, Format::Stl)).unwrap().mesh;
    assert_eq!(back.faces.len(), single.faces.len());
    for (face, corners) in single.faces.iter().enumerate() {
        assert_eq!(corners.map(|v| single.vertices[v as usize])[..], back.vertices[3 * face..3 * face + 3]);
    }
    assert!(check(&back).is_clean());
}

#[test]
fn text_formats_are_read() {
    let obj = "# \u{e9}\nmtllib a.mtl\nv 0 0 0 1\nv 1. 0 0 0.5 0.5 0.5\nvt 0 0\nv 1 1 0\nvn 0 0 1\n  v\t0 1e0 0 # here\n\
               g x\nf 1/1/1 2//1 -2/1 \\\n 4\nusemtl y\nf -4 -3 -2\nl 1 2\n";
    polygons(&read_obj(obj.as_bytes()).unwrap());
    let off =
        "COFF # and more\n\n# a comment\n4 2 0\n0 0 0 255 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 0.5 0.5 0.5\n3 0 1 2\n\n";
    polygons(&read_off(off.as_bytes()).unwrap());
    polygons(&read_off(off.replace("COFF # and more\n\n# a comment\n", "OFF ").as_bytes()).unwrap());
    let stl_text = "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0.123456789012345\n   VERTEX 1 0 0\n\
                    vertex 0 1 0\n  endloop\n endfacet\nendsolid a b\nsolid\nendsolid\n";
    let loaded = stl(stl_text.as_bytes()).unwrap();
    assert_eq!((loaded.mesh.faces.as_slice(), loaded.mesh.vertices[0][2]), (&[[0, 1, 2]][..], 0.123456789012345));
    for base in [0, 1] {
        let (nodes, faces) = tetgen(base);
        let loaded = read_tetgen(nodes.as_bytes(), faces.as_bytes()).unwrap();
        assert_eq!(loaded.mesh, tetrahedron());
    }
}

fn tetgen(base: u32) -> (String, String) {
    let mesh = tetrahedron();
    let mut nodes = "# made by hand\n4 3 1 1\n".to_string();
    for (i, [x, y, z]) in (base..).zip(&mesh.vertices) {
        nodes += &format!("  {i}  {x} {y} {z}  7.5 1\n");
    }
    let mut faces = "4 1\n".to_string();
    for (i, face) in (base..).zip(&mesh.faces) {
        let [a, b, c] = face.map(|v| v + base);
        faces += &format!("{i} {a} {b} {c} -1 # outer\n");
    }
    (nodes, faces)
}

/// The same in all encodings, with an element and properties that are not wanted, and types of all sizes.
#[test]
fn all_encodings_of_ply_are_read() {
    let header = |encoding: &str| {
        format!(
            "ply\nformat {encoding} 1.0\nelement camera 1\nproperty list uchar double c\nelement face 2\n\
             property uchar flag\nproperty list ushort int vertex_index\nelement vertex 4\nproperty short x\n\
             property double y\nproperty float z\nproperty uchar red\nend_header\n"
        )
    };
    let text = header("ascii") + "2 0.5 0.5\n1 4 0 1 2 3\n0 3 0 1 2\n0 0 0 9\n1 0 0 9\n1 1 0 9\n0 1 0 9\n";
    polygons(&ply(text.as_bytes()).unwrap());
    for little in [true, false] {
        let mut bytes = header(if little { "binary_little_endian" } else { "binary_big_endian" }).into_bytes();
        let mut put = |raw: &[u8]| {
            // Given in little-endian order.
            bytes.extend(if little { raw.to_vec() } else { raw.iter().rev().copied().collect() });
        };
        put(&[2]);
        [0.5f64; 2].iter().for_each(|x| put(&x.to_le_bytes()));
        for (flag, corners) in [(1u8, &[0i32, 1, 2, 3][..]), (0, &[0, 1, 2])] {
            put(&[flag]);
            put(&(corners.len() as u16).to_le_bytes());
            corners.iter().for_each(|v| put(&v.to_le_bytes()));
        }
        for [x, y] in [[0i16, 0], [1, 0], [1, 1], [0, 1]] {
            put(&x.to_le_bytes());
            put(&f64::from(y).to_le_bytes());
            put(&0f32.to_le_bytes());
            put(&[9]);
        }
        polygons(&ply(&bytes).unwrap());
    }
}

#[test]
fn concave_polygons_are_cut_up_inside() {
    // An L, lying anywhere: two fans of it would leave it.
    let obj = "v 0 0 5\nv 2 0 5\nv 2 1 5\nv 1 1 5\nv 1 2 5\nv 0 2 5\nf 3 4 5 6 1 2\n";
    let mesh = read_obj(obj.as_bytes()).unwrap().mesh;
    let mesh = placed(&mesh, 1e-6, [1.0, 1.0, 1.0]);
    let areas = mesh.faces.iter().map(|f| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
        0.5e12 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
    });
    let areas: Vec<f64> = areas.collect();
    assert!(areas.iter().all(|a| *a > 0.0) && (areas.iter().sum::<f64>() - 3.0).abs() < 1e-6, "{areas:?}");
    assert_eq!(check(&mesh).intersections, [[0u32; 2]; 0]);
}

#[test]
fn broken_files_say_where() {
    let v = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, expected) in [
        ("", "no vertices"),
        ("v 0 0 0\rv 1 0 0\r", "line 1: lines end with carriage returns alone"),
        ("v 1 2\n", "line 1: a vertex of 2 numbers"),
        ("v 1 2 x\n", "line 1: \"x\" is not a number"),
        ("v 1 nan 2\n", "line 1: y is NaN"),
        ("v 1 1e999 2\n", "line 1: y is inf"),
        ("f 1 2 3\n", "line 1: vertex 1 of 0"),
        (&format!("{v}f 1 2 4\n"), "line 4: vertex 4 of 3"),
        (&format!("{v}f 0 1 2\n"), "line 4: indices begin with 1"),
        (&format!("{v}f -1 -2 -4\n"), "line 4: vertex -4 of 3"),
        (&format!("{v}f 1 2 -9223372036854775808\n"), "line 4: vertex -9223372036854775808 of 3"),
        (&format!("{v}f 1 2 4294967297\n"), "line 4: vertex 4294967297 of 3"),
        (&format!("{v}f 1 2 99999999999999999999\n"), "line 4: \"99999999999999999999\" is not a number"),
        (&format!("{v}f 1 2\n"), "line 4: a face of 2 corners"),
        (&format!("{v}f //1 2 3\n"), "line 4: \"\" is not a number"),
    ] {
        let problem = read_obj(text.as_bytes()).unwrap_err();
        assert!(problem.contains(expected), "{text}: {problem}");
    }
    for (text, expected) in [
        ("", "ends before the numbers"),
        ("PLY\n", "line 1: does not begin with OFF"),
        ("4OFF\n", "line 1: \"4OFF\" is not read"),
        ("OFF BINARY\n", "line 1: binary OFF"),
        ("OFF\n4\n", "line 2: numbers of vertices and of faces"),
        ("OFF\n18446744073709551615 1\n0 0 0\n", "18446744073709551614 vertices too early"),
        ("OFF\n1 18446744073709551615\n0 0 0\n", "18446744073709551615 faces too early"),
        ("OFF\n1 1\n0 0\n", "line 3: a vertex of 2 numbers"),
        ("OFF\n1 1\n0 0 0\n3 0 0 1\n", "line 4: vertex 1 of 1"),
        ("OFF\n1 1\n0 0 0\n3 0 0 -1\n", "line 4: vertex -1 of 1"),
        ("OFF\n1 1\n0 0 0\n18446744073709551615 0 0\n", "line 4: 2 indices of 18446744073709551615"),
        ("OFF\n1 1\n0 0 0\n3 0 0 0\n3 0 0 0\n", "line 5: the file goes on"),
    ] {
        let problem = read_off(text.as_bytes()).unwrap_err();
        assert!(problem.contains(expected), "{text}: {problem}");
    }
    let head = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
    let list = "element face 1\nproperty list uchar int vertex_indices\n";
    for (text, expected) in [
        ("", "not a PLY"),
        (&format!("{head}end_header\n0 0 0\n"), "no element face"),
        (&format!("{head}element face 1\nproperty int vertex_indices\nend_header\n"), "not one list"),
        (&format!("{head}element face 1\nproperty list uchar float vertex_index\nend_header\n"), "not one list"),
        (&format!("{head}{list}end_header\n0 0 0\n3 0 0 1\n"), "face 0: vertex 1 of 1"),
        (&format!("{head}{list}end_header\n0 0 0\n3 0 0 -1\n"), "face 0: vertex -1 of 1"),
        (&format!("{head}{list}end_header\n0 0 0\n2 0 0\n"), "face 0: a face of 2 corners"),
        (&format!("{head}{list}end_header\n0 0 1e999\n3 0 0 0\n"), "vertex 0: z is inf"),
        (&format!("{head}{list}end_header\n0 0 nan\n3 0 0 0\n"), "line 10: cannot be understood"),
        (&format!("{head}{list}end_header\n0 0 0\n"), "too early"),
        (&format!("{head}{}end_header\n0 0 0\n", list.replace("face 1", "face 4000000000")), "promises 4000000000"),
    ] {
        let problem = ply(text.as_bytes()).unwrap_err();
        assert!(problem.contains(expected), "{text}: {problem}");
    }
    let facet = "solid\nfacet\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    let mut short = written(&tetrahedron(), Format::Stl);
    short.pop();
    let mut large = written(&tetrahedron(), Format::Stl);
    large[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    let mut nan = written(&tetrahedron(), Format::Stl);
    nan[84 + 50 + 16..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    for (bytes, expected) in [
        (&b""[..], "neither begins"),
        (&short, "the head promises 4 facets, which makes 284 bytes, in a file of 283 bytes"),
        (&large, "4294967295 facets"),
        // Some binary heads say "solid".
        (&[b"solid", &large[5..]].concat(), "4294967295 facets"),
        (&facet.replace("vertex 1 0 0\n", "vertex 1 0 0\r").into_bytes(), "carriage returns alone"),
        (&nan, "facet 1: y is NaN"),
        (facet.as_bytes(), "before endsolid"),
        (format!("{facet}endfacet\nvertex 0 0 0\nendsolid\n").as_bytes(), "before endsolid"),
        (facet.replace("vertex 1 0 0\n", "").as_bytes(), "line 6: a facet of 2 corners"),
        (facet.replace("vertex 1 0 0\n", "vertex 1 0\n").as_bytes(), "line 5: a vertex of 2 numbers"),
        (b"solid\n<html>\n", "line 2: \"<html>\" is none of the words"),
    ] {
        let problem = stl(bytes).unwrap_err();
        assert!(problem.contains(expected), "{problem}");
    }
    let (nodes, faces) = tetgen(1);
    for (nodes, faces, file, expected) in [
        (nodes.replace("4 3 1 1", "4 2 1 1"), faces.clone(), "node", "line 2: points of 2 dimensions"),
        (nodes.replace("4 3 1 1", "5 3 1 1"), faces.clone(), "node", "after 4 of 5 points"),
        (nodes.replace("4 3 1 1", "3 3 1 1"), faces.clone(), "node", "line 6: more than the 3 points"),
        (nodes.replace("  3  ", "  7  "), faces.clone(), "node", "line 5: 7 where 3 is expected"),
        (nodes.replace("  1  ", "  5  "), faces.clone(), "node", "line 3: points begin with 5"),
        (nodes.clone(), faces.replace("1 1 3 2", "1 1 3 9"), "face", "line 2: point 9 of 4 from 1 on"),
        (nodes.clone(), faces.replace("1 1 3 2", "1 1 3 0"), "face", "line 2: point 0 of 4 from 1 on"),
        (nodes, String::new(), "face", "no number of faces"),
    ] {
        let (found, problem) = read_tetgen(nodes.as_bytes(), faces.as_bytes()).unwrap_err();
        assert!(found == file && problem.contains(expected), "{problem}");
    }
}

type Reads = Box<dyn Fn(&[u8]) -> Option<Loaded>>;

/// Any bytes changed, cut off or repeated: an answer, and never an index out of range.
#[test]
fn mutated_files_do_no_harm() {
    let mesh = bumpy(0, 1);
    let (nodes, faces) = tetgen(0);
    let text_stl = "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
    let mut files: Vec<(Vec<u8>, Reads)> = vec![
        (written(&mesh, Format::Obj), Box::new(|b| read_obj(b).ok())),
        (written(&mesh, Format::Off), Box::new(|b| read_off(b).ok())),
        (written(&mesh, Format::Ply), Box::new(|b| ply(b).ok())),
        (written(&mesh, Format::Stl), Box::new(|b| stl(b).ok())),
        (text_stl.into(), Box::new(|b| stl(b).ok())),
    ];
    let (n, f) = (nodes.clone(), faces.clone());
    files.push((nodes.into_bytes(), Box::new(move |b| read_tetgen(b, f.as_bytes()).ok())));
    files.push((faces.into_bytes(), Box::new(move |b| read_tetgen(n.as_bytes(), b).ok())));
    let mut r = Random::new(8);
    let mut read = 0;
    for (bytes, reader) in &files {
        assert!(reader(bytes).is_some());
        for _ in 0..400 {
            let mut bytes = bytes.clone();
            for _ in 0..1 + r.below(4) {
                let (at, from) = (r.below(bytes.len()), r.below(bytes.len()));
                match r.below(4) {
                    0 => bytes[at] = r.below(256) as u8,
                    1 => bytes[at] ^= 1 << r.below(8),
                    2 => bytes[at] = bytes[from],
                    _ => bytes.truncate(at.max(1)),
                }
            }
            if let Some(loaded) = reader(&bytes) {
                read += 1;
                assert_eq!(loaded.polygons.len(), loaded.mesh.faces.len());
                assert!(
                    loaded.mesh.triangles().is_ok() || loaded.mesh.vertices.iter().flatten().all(|x| x.abs() < 1e-80)
                );
            }
        }
    }
    assert!(read > 200, "{read}");
}

#[test]
fn files_are_found_and_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let put = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        fs::write(&path, bytes).unwrap();
        path
    };
    let mesh = tetrahedron();
    for (name, format) in [("a.OBJ", Format::Obj), ("b.ply", Format::Ply), ("c.off", Format::Off)] {
        assert_eq!(Format::of(Path::new(name)), Some(format));
        assert_eq!(read(&put(name, &written(&mesh, format))).unwrap().mesh, mesh);
    }
    assert!(check(&read(&put("d.stl", &written(&mesh, Format::Stl))).unwrap().mesh).is_clean());
    let (nodes, faces) = tetgen(1);
    let (node, face) = (put("e.1.node", nodes.as_bytes()), put("e.1.face", faces.as_bytes()));
    assert_eq!(read(&node).unwrap(), read(&face).unwrap());
    fs::remove_file(&face).unwrap();
    // The one that is missing is named.
    assert!(matches!(read(&node), Err(Error::File { path, .. }) if path == face));
    for (name, expected) in [
        ("none.obj", &*not_found()),
        ("x.txt", "is none of .obj, .ply"),
        ("x.glb", "scene::load"),
        (".", "not a regular file"),
    ] {
        if name.starts_with('x') {
            put(name, b"");
        }
        let problem = read(&folder.path().join(name)).unwrap_err().to_string();
        assert!(problem.contains(expected), "{problem}");
    }
}
