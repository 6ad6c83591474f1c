//! Point cloud files, sound and malformed, and the program that reads them.

use std::fs;
use std::path::Path;
use std::process::Output;

use assert_cmd::Command;
use glam::{DVec3, Vec3};
use sunfleck::points::io::{read, read_obj, read_ply, read_xyz, write_ply};
use sunfleck::points::{Cloud, Error, Match, Precision};

use super::uniform;
use crate::not_found;

fn ply(text: &[u8]) -> Result<Cloud, String> {
    read_ply(text, text.len() as u64)
}

/// With everything, `n` points.
fn full(n: usize, precision: Precision) -> Cloud {
    let mut positions = uniform(n, 6);
    if precision == Precision::Single {
        positions.iter_mut().for_each(|p| *p = p.as_vec3().as_dvec3());
    }
    let normals = positions.iter().map(|p| p.as_vec3().normalize()).collect();
    let colours = (0..n).map(|i| [i as u8, (i / 7) as u8, 255, (255 - i) as u8]).collect();
    Cloud { positions, normals: Some(normals), colours: Some(colours), precision }
}

#[test]
fn what_is_written_is_read() {
    for precision in [Precision::Single, Precision::Double] {
        for n in [0, 1, 100] {
            let cloud = full(n, precision);
            let bare = Cloud { normals: None, colours: None, ..cloud.clone() };
            for cloud in [cloud, bare] {
                let mut bytes = Vec::new();
                write_ply(&mut bytes, &cloud, None).unwrap();
                let back = ply(&bytes).unwrap();
                assert_eq!(back.positions, cloud.positions);
                assert_eq!((&back.colours, back.precision), (&cloud.colours, cloud.precision));
                let (a, b) = (back.normals.unwrap_or_default(), cloud.normals.unwrap_or_default());
                assert!(a.len() == b.len() && a.iter().zip(&b).all(|(a, b)| a.distance(*b) < 1e-6));
            }
        }
    }
}

#[test]
fn matches_are_written_as_properties() {
    let cloud = Cloud::new(vec![DVec3::X, DVec3::Y]);
    let mut bytes = Vec::new();
    write_ply(&mut bytes, &cloud, Some(&[Match { index: 7, distance: 0.5 }, Match::NONE])).unwrap();
    let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
    assert!(header.contains("property int match\nproperty double distance\nend_header"), "{header}");
    let rows = &bytes[end..];
    assert_eq!(rows.len(), 2 * (12 + 4 + 8));
    assert_eq!((&rows[12..16], &rows[16..24]), (&7_i32.to_le_bytes()[..], &0.5_f64.to_le_bytes()[..]));
    assert_eq!((&rows[36..40], &rows[40..48]), (&(-1_i32).to_le_bytes()[..], &(-1.0_f64).to_le_bytes()[..]));
}

#[test]
fn properties_are_written_in_the_stated_order() {
    let mut bytes = Vec::new();
    write_ply(&mut bytes, &full(2, Precision::Double), Some(&[Match::NONE; 2])).unwrap();
    let header = String::from_utf8_lossy(&bytes);
    let lines = header.lines().take_while(|l| *l != "end_header");
    let names: Vec<&str> = lines.filter_map(|l| l.strip_prefix("property ")?.split(' ').nth(1)).collect();
    let expected = "x y z nx ny nz red green blue alpha match distance";
    assert_eq!(names.join(" "), expected);
}

/// The same two vertices in all encodings: an element and a list before them, types of all sizes.
#[test]
fn all_encodings_of_ply_are_read() {
    let header = |encoding: &str| {
        format!(
            "ply\r\nformat {encoding} 1.0\ncomment a b c\nobj_info x\nelement camera 2\nproperty uchar a\n\
             property list uchar short b\nelement vertex 2\nproperty double x\nproperty short y\nproperty uchar red\n\
             property list uint8 int32 l\nproperty float32 z\nproperty uint8 green\nproperty uint8 blue\n\
             property float nx\nproperty float ny\nproperty float nz\nelement face 1\nproperty list uchar int v\nend_header\n"
        )
    };
    let ascii =
        header("ascii") + "5 2 1 -1\n6 0\n1.25 -3 10 1 77 0.5 20 30 0 2 0\n-1e2 4 11 0 2 21 31 0 0 0\n3 0 1 0\n";
    let mut cases = vec![("ascii", ascii.into_bytes())];
    for big in [false, true] {
        let name = if big { "binary_big_endian" } else { "binary_little_endian" };
        let mut bytes = header(name).into_bytes();
        let mut put = |value: &[u8]| {
            let mut value = value.to_vec();
            if big {
                value.reverse();
            }
            bytes.extend(value);
        };
        for camera in [&[5_i16, 2, 1, -1][..], &[6, 0]] {
            put(&[camera[0] as u8]);
            put(&[camera[1] as u8]);
            camera[2..].iter().for_each(|v| put(&v.to_le_bytes()));
        }
        for (x, y, red, list, z, green, blue, n) in [
            (1.25_f64, -3_i16, 10_u8, &[77_i32][..], 0.5_f32, 20_u8, 30_u8, [0.0_f32, 2.0, 0.0]),
            (-100.0, 4, 11, &[], 2.0, 21, 31, [0.0; 3]),
        ] {
            put(&x.to_le_bytes());
            put(&y.to_le_bytes());
            put(&[red]);
            put(&[list.len() as u8]);
            list.iter().for_each(|v| put(&v.to_le_bytes()));
            put(&z.to_le_bytes());
            put(&[green]);
            put(&[blue]);
            n.iter().for_each(|v| put(&v.to_le_bytes()));
        }
        cases.push((name, bytes));
    }
    for (name, bytes) in cases {
        let cloud = ply(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"));
        let expected = Cloud {
            positions: vec![DVec3::new(1.25, -3.0, 0.5), DVec3::new(-100.0, 4.0, 2.0)],
            normals: Some(vec![Vec3::Y, Vec3::ZERO]),
            colours: Some(vec![[10, 20, 30, 255], [11, 21, 31, 255]]),
            precision: Precision::Double,
        };
        assert_eq!(cloud, expected, "{name}");
    }
}

#[test]
fn text_clouds_are_read() {
    let cloud = read_xyz(&b"\xef\xbb\xbf# head\n1 2 3\n\n 4,5;6 // more\r\n-.5\t1e3 5."[..]).unwrap();
    assert_eq!(cloud.positions, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0), DVec3::new(-0.5, 1e3, 5.0)]);
    assert!(cloud.normals.is_none() && cloud.colours.is_none() && cloud.precision == Precision::Double);
    let normals = read_xyz(&b"1 2 3 0 0 1\n1 2 3 0 0 0\n1 2 3 0 0.99 0\n"[..]).unwrap().normals.unwrap();
    assert_eq!(normals, [Vec3::Z, Vec3::ZERO, Vec3::Y]);
    let colours = read_xyz(&b"1 2 3 255 0 1\n1 2 3 0 1 0\n"[..]).unwrap().colours.unwrap();
    assert_eq!(colours, [[255, 0, 1, 255], [0, 1, 0, 255]]);
    assert!(read_xyz(&b""[..]).unwrap().is_empty());

    let cloud = read_obj(&b"o a\nv 1 2 3\nvn 0 0 1\n v 4 5 6 1\nvt 1 2\nf 1 2 1\n"[..]).unwrap();
    assert_eq!(cloud.positions, [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)]);
    let cloud = read_obj(&b"v 1 2 3 1 0 0.5\n"[..]).unwrap();
    assert_eq!(cloud.colours, Some(vec![[255, 0, 128, 255]]));
}

/// Comments in Latin-1, and lines that nothing is taken from, however long they are.
#[test]
fn what_is_left_out_need_not_be_text() {
    let points = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(4.0, 5.0, 6.0)];
    let long = b" 1".repeat(1 << 16);
    let xyz = [b"# M\xfcller\n1 2 3 // \xe9\n#", &long[..], b"\xff\n4 5 6 #", &long].concat();
    assert_eq!(read_xyz(&xyz[..]).unwrap().positions, points);
    let obj = [
        b"# M\xfcller\r\no caf\xe9\nv 1 2 3 # \xe9\r\nf",
        &long[..],
        b"\nmtllib \xfc.mtl\nv 4 5 6 #",
        &long,
        b"\nf 1 2",
        &long,
    ]
    .concat();
    assert_eq!(read_obj(&obj[..]).unwrap().positions, points);
    let header = b"ply\nformat ascii 1.0\ncomment M\xfcller\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nend_header\n1 2 3\n";
    assert_eq!(ply(header).unwrap().positions, points[..1]);
    // What is wanted must be text, and bounded.
    for (data, says) in [
        (&b"v 1 2 3\nv 1 2 \xe9\n"[..], "line 2: not text"),
        (b"\xff\xfev\0 \x001\0 \x002\0 \x003\0\n\0", "line 1: not text"),
        (&[b"v", &long[..], b"\n"].concat(), "line 1: longer than 65536 bytes"),
        (b"v", "line 1: a vertex of 0 numbers"),
    ] {
        assert_eq!(read_obj(data).unwrap_err(), says);
    }
    assert_eq!(read_xyz(&b"1 2 3\n1 2 3\xe9\n"[..]).unwrap_err(), "line 2: not text");
}

#[test]
fn malformed_text_is_refused() {
    for (text, says) in [
        ("1 2 3\n1 2\n", "line 2: 2 columns, not 3 or 6"),
        ("1 2 3\n1 2 3 4 5 6\n", "line 2: 6 columns, unlike"),
        ("1 2 3 4 5 6 7\n", "line 1: more than 6 columns"),
        ("\n1 2 x\n", "line 2: \"x\" is not a number"),
        ("1 2 nan\n", "line 1: z is NaN"),
        ("1 -inf 3\n", "line 1: y is -inf"),
        ("1e200 2 3\n", "line 1: x is 1"),
        ("1 2 3 0.5 7 900\n", "neither unit normals nor colours"),
        ("1 2 3 0 0 0.9\n", "neither unit normals nor colours"),
    ] {
        let error = read_xyz(text.as_bytes()).unwrap_err();
        assert!(error.contains(says), "{text:?}: {error}");
    }
    assert_eq!(read_xyz(&[0xff, 0xfe, 0][..]).unwrap_err(), "line 1: not text");
    assert!(read_xyz(&vec![b'1'; 1 << 20][..]).unwrap_err().contains("longer than 65536 bytes"));
    for (text, says) in [
        ("v 1 2\n", "line 1: a vertex of 2 numbers"),
        ("v 1 2 3 4 5 6 7 8\n", "line 1: a vertex of more than 7"),
        ("#\nv 1 2 a\n", "line 2: \"a\" is not a number"),
        ("v 1 2 inf\n", "line 1: z is inf"),
    ] {
        let error = read_obj(text.as_bytes()).unwrap_err();
        assert!(error.contains(says), "{text:?}: {error}");
    }
}

#[test]
fn malformed_ply_is_refused() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    let with = |encoding: &str, count: &str, more: &str, data: &str| {
        format!("ply\nformat {encoding} 1.0\nelement vertex {count}\n{xyz}{more}end_header\n{data}")
    };
    let ascii = |count: &str, data: &str| with("ascii", count, "", data);
    let binary = |count: &str, data: &str| with("binary_little_endian", count, "", data);
    for (text, says) in [
        (String::new(), "not a PLY file"),
        ("plx\n".into(), "not a PLY file"),
        ("ply\n".into(), "before end_header"),
        (format!("ply\nelement vertex 1\n{xyz}end_header\n1 2 3\n"), "the header"),
        (with("ascii2", "1", "", "1 2 3\n"), "line 2: cannot be understood: the header"),
        (with("ascii", "1", "property foo bar\n", "1 2 3\n"), "line 7: cannot be understood: the header"),
        (with("ascii", "-1", "", ""), "line 3: cannot be understood: the header"),
        (with("ascii", "99999999999999999999999", "", ""), "line 3: cannot be understood: the header"),
        ("ply\nformat ascii 1.0\nend_header\n".into(), "no element vertex"),
        ("ply\nformat ascii 1.0\nelement vertex 0\nend_header\n".into(), "lacks a property x, y or z"),
        ("ply\nformat ascii 1.0\nproperty float x\nend_header\n".into(), "line 3: cannot be understood: the header"),
        (
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
             property list uchar float z\nend_header\n1 2 1 3\n"
                .into(),
            "lacks a property x, y or z",
        ),
        (with("ascii", "1", "property float x\n", "1 2 3 4\n"), "line 7: a second property vertex x"),
        (with("ascii", "1", "element vertex 1\n", "1 2 3\n"), "line 7: a second element vertex"),
        (ascii("3", "1 2 3\n4 5 6\n"), "line 10: the file ends too early: a vertex of 3 properties"),
        (ascii("2", "1 2 3\n4 5\n"), "line 9: cannot be understood: a vertex of 3 properties"),
        (ascii("2", "1 2 3\n4 b 6\n"), "line 9: cannot be understood"),
        (ascii("1", "1 nan 3\n"), "line 8: cannot be understood"),
        (ascii("1", "1 2 1e99\n"), "vertex 0: z is inf"),
        // Memory bombs.
        (ascii("1000000000000", "1 2 3\n"), "promises 1000000000000 of element vertex, at least 6 bytes each"),
        (binary("1000000000000", "123456789012"), "promises 1000000000000 of element vertex, at least 12 bytes"),
        (binary("18446744073709551615", ""), "promises 18446744073709551615"),
        (binary("2", "123456789012"), "the file ends too early: vertex 1 of 2"),
        (
            format!(
                "ply\nformat binary_little_endian 1.0\nelement a 1000000000000\nproperty list uint double b\nelement vertex 1\n{xyz}end_header\n123456789012"
            ),
            "promises 1000000000000 of element a",
        ),
        (
            format!(
                "ply\nformat binary_little_endian 1.0\nelement a 1\nproperty list uint double b\nelement vertex 1\n{xyz}end_header\n\u{7f}\u{7f}\u{7f}\u{7f}123456789012"
            ),
            "ends too early: element a",
        ),
        (
            format!("ply\nformat ascii 1.0\nelement a 1000000000000\nelement vertex 1\n{xyz}end_header\n\n\n"),
            "promises 1000000000000 of element a",
        ),
        (
            with(
                "binary_little_endian",
                "1",
                "property list uint double b\n",
                "123456789012\u{7f}\u{7f}\u{7f}\u{7f}12345678",
            ),
            "vertex 0 of 1",
        ),
        (format!("ply\n{}", "comment x\n".repeat(200_000)), "a header of more than 1024 KiB"),
        (format!("ply\ncomment {}", "x".repeat(2_000_000)), "a header of more than 1024 KiB"),
    ] {
        let error = ply(text.as_bytes()).unwrap_err();
        assert!(error.contains(says), "{:?}: {error}", &text[..text.len().min(300)]);
        assert!(error.len() < 200 && !error.contains('\n'), "{error:?}");
    }
    // Nothing to read of an element without properties, however many it has.
    let none =
        format!("ply\nformat binary_little_endian 1.0\nelement a 1000000000000\nelement vertex 0\n{xyz}end_header\n");
    assert!(ply(none.as_bytes()).unwrap().is_empty());
    let nan =
        [&with("binary_little_endian", "2", "", "123456789012").into_bytes()[..], &f32::NAN.to_le_bytes(), &[0; 8]]
            .concat();
    assert_eq!(ply(&nan).unwrap_err(), "vertex 1: x is NaN");
    // Cut anywhere, and with any byte changed: a cloud or an error, never a panic.
    let mut sound = Vec::new();
    write_ply(&mut sound, &full(3, Precision::Double), None).unwrap();
    for at in 0..sound.len() {
        assert!(ply(&sound[..at]).is_err(), "cut at {at}");
        let mut changed = sound.clone();
        changed[at] ^= 0x15;
        let _ = ply(&changed);
    }
}

#[test]
fn files_that_cannot_be_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("a.stl"), "x").unwrap();
    fs::write(at("b.xyz"), "1 2\n").unwrap();
    fs::create_dir(at("c.ply")).unwrap();
    for (name, says) in [
        ("a.stl", "none of .ply, .obj, .xyz"),
        ("b.xyz", "line 1: 2 columns"),
        ("c.ply", "is not a regular file"),
        ("d.ply", &*not_found()),
    ] {
        let error = read(&at(name)).unwrap_err();
        assert!(matches!(error, Error::File { .. }));
        let text = error.to_string();
        assert!(text.starts_with(&at(name).display().to_string()) && text.contains(says), "{text}");
    }
}

fn sunfleck(folder: &Path, line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_sunfleck")).current_dir(folder).args(line.split_whitespace()).output().unwrap()
}

fn out(output: &Output) -> (String, String) {
    let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
    (text(&output.stdout), text(&output.stderr))
}

#[test]
fn the_program_does_what_its_help_says() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = |line: &str| {
        let output = sunfleck(at, line);
        assert!(output.status.success(), "{line}: {}", out(&output).1);
        out(&output)
    };
    run("points make torus --points 4k -o t.ply");
    run("points make torus --points 3k --seed 1 --turn 5 --shift 0.02,0,-0.03 --noise 0 -o s.ply");
    assert_eq!(read(&at.join("s.ply")).unwrap().len(), 3000);
    let (result, progress) = run("points normals t.ply -o n.ply -k 10");
    assert!(result.contains("normals    4000") && progress.contains("wrote n.ply"), "{result} {progress}");
    let normals = read(&at.join("n.ply")).unwrap().normals.unwrap();
    assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    for target in ["t.ply", "n.ply"] {
        let (result, progress) =
            run(&format!("points register s.ply {target} --method plane -o m.ply --json r.json -q"));
        assert!(progress.is_empty() && result.contains("converged") && !result.contains("not converged"), "{result}");
        let matrix: Vec<f64> =
            result.lines().take(4).flat_map(|l| l.split_whitespace().map(|w| w.parse().unwrap())).collect();
        let json: serde_json::Value = serde_json::from_slice(&fs::read(at.join("r.json")).unwrap()).unwrap();
        let in_file: Vec<f64> = json["matrix"]
            .as_array()
            .unwrap()
            .iter()
            .flat_map(|r| r.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()))
            .collect();
        assert!(in_file.len() == 16 && matrix.iter().zip(&in_file).all(|(a, b)| (a - b).abs() < 1e-15), "{in_file:?}");
        assert!(json["iterations"].as_array().unwrap().len() > 2 && json["converged"] == true);
        // The matrix takes the one file to the other.
        let (s, m) = (read(&at.join("s.ply")).unwrap(), read(&at.join("m.ply")).unwrap());
        for (p, q) in s.positions.iter().zip(&m.positions) {
            let moved: [f64; 3] =
                std::array::from_fn(|i| DVec3::from_slice(&matrix[4 * i..]).dot(*p) + matrix[4 * i + 3]);
            assert!(DVec3::from_array(moved).distance(*q) < 1e-12);
        }
    }
    let (result, _) = run("points match m.ply t.ply -o x.ply");
    let matched: usize = result.lines().next().unwrap().split_whitespace().nth(1).unwrap().parse().unwrap();
    assert!(matched > 2900, "{result}");
    let (result, _) = run("points match s.ply t.ply -o x.ply --outlier 0");
    assert!(result.contains("matched    0 of 3000"), "{result}");
    for line in [
        "points --help",
        "points normals --help",
        "points match --help",
        "points register --help",
        "points make --help",
    ] {
        assert!(run(line).0.contains("Usage: sunfleck points"), "{line}");
    }
}

#[test]
fn the_program_refuses_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("two.xyz"), "0 0 0\n1 1 1\n").unwrap();
    fs::write(at.join("line.xyz"), "0 0 0\n1 1 1\n2 2 2\n3 3 3\n").unwrap();
    fs::write(at.join("bad.ply"), "ply\nformat ascii 1.0\nelement vertex 1\nend_header\n").unwrap();
    let absent = format!("none.ply: {}", not_found());
    for (line, code, says) in [
        ("normals two.xyz -o o.ply", 1, "two.xyz: 2 points: a normal needs at least 3"),
        ("normals bad.ply -o o.ply", 1, "bad.ply: the header's element vertex lacks"),
        ("normals none.ply -o o.ply", 1, &*absent),
        ("normals two.xyz -o o.obj", 2, "clouds are written as .ply"),
        ("normals two.xyz -o no/o.ply", 1, "there is no folder no"),
        ("normals two.xyz -o o.ply -k 65", 2, "must be 3 to 64"),
        ("normals two.xyz", 2, "--output"),
        ("match two.xyz line.xyz -o o.ply --outlier -1", 2, "must be 0 or more"),
        ("register line.xyz line.xyz -o o.ply", 1, "on a line"),
        ("register two.xyz line.xyz -o o.ply", 1, "2 points: registration needs at least 3"),
        ("register line.xyz two.xyz -o o.ply --method plane", 1, "two.xyz: 2 points"),
        ("register line.xyz line.xyz -o o.ply --json o.ply", 2, "named twice"),
        ("register line.xyz line.xyz -o o.ply --method surface", 2, "invalid value 'surface'"),
        ("make cube -o o.ply", 2, "invalid value 'cube'"),
        ("make -o o.ply --points 200M", 2, "at most 100M"),
        ("make -o o.ply --noise 1e39", 2, "for '--noise <LENGTH>': must be 0 to 1e6"),
        ("make -o o.ply --noise -1", 2, "for '--noise <LENGTH>': must be 0 to 1e6"),
        ("", 2, "subcommand"),
    ] {
        let output = sunfleck(at, &format!("points {line}"));
        let (result, error) = out(&output);
        assert_eq!(output.status.code(), Some(code), "{line}: {error}");
        let lines: Vec<&str> = error.lines().filter(|l| l.starts_with("sunfleck: error: ")).collect();
        assert!(lines.len() == 1 && lines[0].contains(says) && result.is_empty(), "{line}: {error}");
        assert!(!at.join("o.ply").exists() && !at.join("o.obj").exists(), "{line}");
    }
}
