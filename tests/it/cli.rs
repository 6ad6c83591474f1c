//! The program as its users meet it: what it prints, what it writes, how it exits.

mod compare;
mod devices;
mod headers;
mod settings;

use std::f32::consts::FRAC_1_SQRT_2;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::time::{Duration, Instant};

use assert_cmd::Command;
use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use serde_json::{Value, json};
use sunfleck::output::{self, VERSION};
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_sunfleck");

/// Small enough that a test takes no time.
const QUICK: [&str; 8] = ["--backend", "cpu", "-r", "32x16", "--photons", "2k", "--iterations", "3"];

fn sunfleck<I: AsRef<std::ffi::OsStr>>(folder: &Path, args: impl IntoIterator<Item = I>) -> Output {
    Command::new(PROGRAM).current_dir(folder).args(args).output().unwrap()
}

fn words(line: &str) -> Vec<&str> {
    line.split_whitespace().collect()
}

fn stderr(output: &Output) -> String {
    String::from_utf8(output.stderr.clone()).unwrap()
}

/// Exactly one line, of the form that all errors have, with each of `parts` in it.
fn assert_error(output: &Output, code: i32, parts: &[&str]) {
    let text = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{text}");
    assert!(
        text.starts_with("sunfleck: error: ") && text.matches('\n').count() == 1 && text.ends_with('\n'),
        "{text:?}"
    );
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in {text:?}");
    }
}

/// A floor of 2×2 m under a point light, seen from above by a camera twice as wide as high.
fn floor() -> Value {
    json!({
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 100.0}]}},
        "scene": 0,
        "scenes": [{"nodes": [0, 1, 2]}],
        "nodes": [
            {"mesh": 0},
            {"translation": [0.0, 2.0, 0.0], "extensions": {"KHR_lights_punctual": {"light": 0}}},
            {"camera": 0, "translation": [0.0, 3.0, 0.0], "rotation": [-FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2]},
        ],
        "cameras": [{"name": "Above", "type": "perspective", "perspective": {"aspectRatio": 2.0, "yfov": 0.5, "znear": 0.1}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": "floor.bin", "byteLength": 60}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
             "min": [-1.0, 0.0, -1.0], "max": [1.0, 0.0, 1.0]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
    })
}

const CORNERS: [f32; 12] = [-1.0, 0.0, -1.0, -1.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0, -1.0];
const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

fn write_scene(folder: &Path, scene: &Value, corners: &[f32], indices: &[u16]) -> PathBuf {
    let mut bytes: Vec<u8> = corners.iter().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend(indices.iter().flat_map(|i| i.to_le_bytes()));
    fs::write(folder.join("floor.bin"), bytes).unwrap();
    let path = folder.join("floor.gltf");
    fs::write(&path, scene.to_string()).unwrap();
    path
}

fn folder_with_floor() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_scene(folder.path(), &floor(), &CORNERS, &INDICES);
    folder
}

/// Renders the floor with `extra`, which may override [`QUICK`]'s values of other flags only.
fn render(folder: &Path, extra: &str) -> Output {
    sunfleck(folder, ["render", "floor.gltf"].into_iter().chain(QUICK).chain(words(extra)))
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn no_arguments_says_what_to_type() {
    let output = sunfleck(Path::new("."), [""; 0]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("sunfleck render ") && output.stdout.is_empty());
}

#[test]
fn help_and_version_go_to_standard_output() {
    for (args, parts) in [
        ("--help", ["render", "compare", "Examples:", "--list-devices"]),
        ("render --help", ["--crop <x0,x1,y0,y1>", "--spp", "--paper", "Exit codes"]),
        ("compare --help", ["relMSE", "REFERENCE.exr", "--json", "0.1 %"]),
    ] {
        let output = sunfleck(Path::new("."), words(args));
        let text = String::from_utf8(output.stdout.clone()).unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{args}");
        for part in parts {
            assert!(text.contains(part), "{part:?} is not in {args}");
        }
    }
    let output = sunfleck(Path::new("."), ["--version"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), format!("sunfleck {VERSION}\n"));
}

#[test]
fn wrong_usage() {
    let folder = folder_with_floor();
    for (args, part) in [
        ("render", "which scene"),
        ("render floor.gltf", "-o"),
        ("rendr floor.gltf -o a.png", "rendr"),
        ("floor.gltf -o a.png", "sunfleck render SCENE"),
        ("render floor.gltf -o a.jpg", "a.jpg"),
        ("render floor.gltf -o a", ".exr or .png"),
        ("render floor.gltf -o a.png -o ./a.png", "twice"),
        ("render floor.gltf -o a.png --json a.png", "twice"),
        ("render floor.gltf --json floor.gltf", "read and to be written"),
        ("render floor.gltf -o a.png -r 0x0", "0x0"),
        ("render floor.gltf -o a.png -r 1000000x1000000", "65535"),
        ("render floor.gltf -o a.png -r 100", "1280x720"),
        ("render floor.gltf -o a.png --crop 0,1,0.5,0.5", "--crop"),
        ("render floor.gltf -o a.png -r 10x10 --crop 0,0.01,0,1", "no pixel"),
        ("render floor.gltf -o a.png --alpha 1", "--alpha"),
        ("render floor.gltf -o a.png --alpha -0.5", "--alpha"),
        ("render floor.gltf -o a.png --alpha NaN", "--alpha"),
        ("render floor.gltf -o a.png --radius 0", "--radius"),
        ("render floor.gltf -o a.png --radius -1", "--radius"),
        ("render floor.gltf -o a.png --radius inf", "--radius"),
        ("render floor.gltf -o a.png --photons 0", "--photons"),
        ("render floor.gltf -o a.png --photons -5", "--photons"),
        ("render floor.gltf -o a.png --photons 9999999999999", "--photons"),
        ("render floor.gltf -o a.png --iterations 0", "--iterations"),
        ("render floor.gltf -o a.png --seconds nan", "--seconds"),
        ("render floor.gltf -o a.png --seconds -1", "--seconds"),
        ("render floor.gltf -o a.png --exposure inf", "--exposure"),
        ("render floor.gltf -o a.png --threads 0", "--threads"),
        ("render floor.gltf -o a.png --kernel gauss", "epanechnikov"),
        ("render floor.gltf -o a.png --backend cpu --device 0", "--device 0"),
        ("render floor.gltf -o a.png --backend cpu --index hardware", "--index hardware"),
        ("render floor.gltf -o a.png --backend gpu --accel kd", "--accel kd needs --backend cpu"),
        ("render floor.gltf -o a.png --accel kd --device 0", "--device 0"),
        ("render floor.gltf -o a.png --accel kd --index hardware", "--index hardware"),
        ("render floor.gltf -o a.png --accel grid", "--accel"),
        ("render floor.gltf -o a.png -q -v", "--verbose"),
        ("render floor.gltf -o a.png --aplha 0.5", "--alpha"),
        ("render floor.gltf -o a.png --set nonsense", "--set nonsense"),
    ] {
        assert_error(&sunfleck(folder.path(), words(args)), 2, &[part]);
    }
    assert_eq!(names(folder.path()), ["floor.bin", "floor.gltf"]);
}

#[test]
fn outputs_are_checked_before_the_scene_is_read() {
    let folder = folder_with_floor();
    fs::create_dir(folder.path().join("dir.png")).unwrap();
    for (output, part) in
        [("no/a.png", "there is no folder no"), ("dir.png", "is a directory"), ("none.png/", "is a directory")]
    {
        assert_error(&sunfleck(folder.path(), ["render", "absent.glb", "-o", output]), 1, &[output, part]);
    }
}

#[test]
fn scenes_that_cannot_be_read() {
    let folder = folder_with_floor();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("text.glb"), "this is no glTF file").unwrap();
    fs::write(at("truncated.glb"), b"glTF\x02\0\0\0\xff\0\0\0\x10\0\0\0JSON{\"asset\"").unwrap();
    fs::write(at("empty.gltf"), "").unwrap();
    fs::write(at("broken.toml"), "scene = [").unwrap();
    fs::create_dir(at("folder.glb")).unwrap();
    for name in [
        "absent.glb",
        "absent.obj",
        "absent.toml",
        "text.glb",
        "truncated.glb",
        "empty.gltf",
        "broken.toml",
        "folder.glb",
    ] {
        assert_error(&sunfleck(folder.path(), ["render", name, "-o", "a.png", "--backend", "cpu"]), 1, &[name]);
        assert!(!at("a.png").exists());
    }
    assert_error(
        &sunfleck(folder.path(), words("render cornel -o a.png")),
        1,
        &["cornel", "did you mean cornell", "glass"],
    );
}

#[test]
fn scenes_with_wrong_fields() {
    let with = |change: &dyn Fn(&mut Value), corners: &[f32], indices: &[u16]| {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = floor();
        change(&mut scene);
        write_scene(folder.path(), &scene, corners, indices);
        render(folder.path(), "-o a.png")
    };
    let textured = |uri: &str| {
        let uri = uri.to_owned();
        move |scene: &mut Value| {
            scene["images"] = json!([{"uri": uri}]);
            scene["textures"] = json!([{"source": 0}]);
            scene["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
            scene["meshes"][0]["primitives"][0]["material"] = json!(0);
        }
    };
    let same = |_: &mut Value| {};
    assert_eq!(with(&same, &CORNERS, &INDICES).status.code(), Some(0));
    assert_error(&with(&same, &CORNERS, &[0, 1, 2, 0, 2, 4]), 1, &["floor.gltf"]);
    let mut corners = CORNERS;
    corners[4] = f32::NAN;
    assert_error(&with(&same, &corners, &INDICES), 1, &["floor.gltf"]);
    assert_error(&with(&textured("absent.png"), &CORNERS, &INDICES), 1, &["floor.gltf", "absent.png"]);
    assert_error(&with(&textured("../secret.png"), &CORNERS, &INDICES), 1, &["floor.gltf", "../secret.png"]);
    assert_error(&with(&|s| s["meshes"] = json!(3), &CORNERS, &INDICES), 1, &["floor.gltf"]);
}

#[test]
fn requests_that_cannot_be_met() {
    let folder = folder_with_floor();
    assert_error(
        &sunfleck(folder.path(), words("render floor.gltf -o a.png -r 65535x65535")),
        1,
        &["65535x65535", "memory"],
    );
    let many = sunfleck(folder.path(), words("render floor.gltf -o a.png -r 8x8 --photons 4000M --backend cpu"));
    assert_error(&many, 1, &["4000000000 photons", "memory"]);
    assert_error(&render(folder.path(), "-o a.png --camera Below"), 1, &["Below", "0 \"Above\""]);
    assert_error(
        &sunfleck(folder.path(), words("render floor.gltf -o a.png --device no-such-gpu")),
        1,
        &["no-such-gpu"],
    );
    assert_error(&sunfleck(folder.path(), words("render floor.gltf -o a.png --device 99")), 1, &["99"]);
    assert_eq!(names(folder.path()), ["floor.bin", "floor.gltf"]);
}

#[test]
fn how_a_picture_is_shown_is_a_setting_too() {
    let folder = folder_with_floor();
    let picture = |flags: &str| {
        let output = render(folder.path(), &format!("-o a.png {flags}"));
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        image::open(folder.path().join("a.png")).unwrap().to_rgb8()
    };
    let by_flags = picture("--exposure 3 --tonemap agx");
    assert!(picture("--set exposure=3 --set tonemap=agx") == by_flags);
    assert!(picture("--set exposure=3 --set tonemap=srgb --tonemap agx") == by_flags);
    assert!(picture("--set exposure=3") != by_flags);
    assert_error(&render(folder.path(), "-o a.png --set tonemap=aces"), 2, &["tonemap", "agx"]);
}

#[test]
fn pictures_and_their_headers() {
    let folder = folder_with_floor();
    let output = render(folder.path(), "-o a.exr -o a.png --seed 7 --alpha 0.5 --radius 0.25 --variance");
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
    assert_eq!(names(folder.path()), ["a.exr", "a.png", "floor.bin", "floor.gltf"]);

    let meta = MetaData::read_from_file(folder.path().join("a.exr"), true).unwrap();
    let [header] = &meta.headers[..] else { panic!("one layer") };
    let channels: Vec<_> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(channels, ["B", "G", "R", "Variance.Y"]);
    let own = &header.own_attributes;
    let get = |name: &str| own.other.get(&Text::from(name)).unwrap_or_else(|| panic!("no {name}")).clone();
    assert_eq!(get("seed"), AttributeValue::I32(7));
    assert_eq!(get("iterations"), AttributeValue::I32(3));
    assert_eq!(get("photonsPerIteration"), AttributeValue::I32(2000));
    assert_eq!(get("alpha"), AttributeValue::F32(0.5));
    assert_eq!(get("firstRadius"), AttributeValue::F32(0.25));
    // r₃² = r₁² · (1+α)/2 · (2+α)/3
    let AttributeValue::F32(last) = get("lastRadius") else { panic!("a float") };
    assert!((last - 0.25 * (0.75f32 * 2.5 / 3.0).sqrt()).abs() < 1e-6, "{last}");
    assert_eq!(get("scene"), AttributeValue::Text(Text::from("floor.gltf")));
    assert!(matches!(get("adapter"), AttributeValue::Text(name) if name.to_string().contains("CPU")));
    assert!(matches!(get("renderTimeSeconds"), AttributeValue::F32(s) if s > 0.0));
    assert_eq!(own.software_name, Some(Text::from(format!("Sunfleck {VERSION}").as_str())));
    let m = glam::Mat4::from_cols_array(&own.world_to_camera.unwrap());
    assert!(m.transform_point3(glam::Vec3::ZERO).abs_diff_eq(glam::vec3(0.0, 0.0, -3.0), 1e-5), "{m}");

    let picture = output::exr::read(&folder.path().join("a.exr")).unwrap();
    assert_eq!((picture.size, picture.crop), ([32, 16], [0, 0, 32, 16]));
    // Straight below the light of 100 cd, 2 m away, on white: L = 100/2²/π, about 8.
    assert!(picture.rgb.iter().all(|rgb| rgb.iter().all(|c| c.is_finite())));
    let middle = picture.rgb[8 * 32 + 16];
    assert!((6.0..9.0).contains(&middle[0]), "{middle:?}");

    let png = png::Decoder::new(std::io::BufReader::new(fs::File::open(folder.path().join("a.png")).unwrap()));
    let info = png.read_info().unwrap();
    assert_eq!((info.info().width, info.info().height), (32, 16));
}

#[test]
fn a_crop_is_a_part_of_the_whole() {
    let folder = folder_with_floor();
    assert!(render(folder.path(), "-o whole.exr --radius 0.2").status.success());
    assert!(render(folder.path(), "-o part.exr -o part.png --radius 0.2 --crop 0.25,0.75,0.5,1").status.success());
    let whole = output::exr::read(&folder.path().join("whole.exr")).unwrap();
    let part = output::exr::read(&folder.path().join("part.exr")).unwrap();
    assert_eq!((part.size, part.crop, part.rgb.len()), ([32, 16], [8, 8, 24, 16], 16 * 8));
    for (i, rgb) in part.rgb.iter().enumerate() {
        let (x, y) = (8 + i % 16, 8 + i / 16);
        let expected = whole.rgb[y * 32 + x];
        let near = |a: f32, b: f32| (a - b).abs() <= 1e-3 * b.abs().max(1e-3);
        assert!((0..3).all(|c| near(rgb[c], expected[c])), "({x}, {y}): {rgb:?} {expected:?}");
    }
    let png = png::Decoder::new(std::io::BufReader::new(fs::File::open(folder.path().join("part.png")).unwrap()));
    assert_eq!(png.read_info().unwrap().info().width, 16);
}

#[test]
fn same_seed_same_bits_at_any_thread_count() {
    let folder = folder_with_floor();
    for (name, extra) in [("a", "--threads 1"), ("b", "--threads 3"), ("c", "--seed 1")] {
        assert!(render(folder.path(), &format!("-o {name}.exr {extra}")).status.success());
    }
    let read = |name: &str| output::exr::read(&folder.path().join(name)).unwrap().rgb;
    assert_eq!(read("a.exr"), read("b.exr"));
    assert_ne!(read("a.exr"), read("c.exr"));
}

#[test]
fn the_report() {
    let folder = folder_with_floor();
    assert!(render(folder.path(), "-o a.exr --json a.json --max-segments 9").status.success());
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    assert_eq!(report["end"], "finished");
    assert_eq!(report["error"], Value::Null);
    assert_eq!(report["settings"]["size"], json!([32, 16]));
    assert_eq!(report["settings"]["photonPaths"], 2000);
    assert_eq!(report["settings"]["maxSegments"], 9);
    assert_eq!(report["settings"]["maxEyeSegments"], 9);
    assert_eq!(report["device"]["backend"], "cpu");
    assert_eq!(report["device"]["index"], "tree");
    assert_eq!(report["outputs"], json!(["a.exr"]));
    let iterations = report["iterations"].as_array().unwrap();
    assert_eq!(iterations.len(), 3);
    for iteration in iterations {
        assert!(iteration["seconds"].as_f64().unwrap() > 0.0);
        assert!(["eye", "photons", "build", "gather", "accumulate"].iter().all(|s| iteration["stages"][s].is_number()));
        assert!(iteration["photonsStored"].is_u64() && iteration["radius"].as_f64().unwrap() > 0.0);
    }
    // A report alone is enough of an output.
    assert!(render(folder.path(), "--json b.json").status.success());
}

#[test]
fn the_setting_of_the_literature() {
    let folder = folder_with_floor();
    assert!(render(folder.path(), "-o a.exr --paper --json a.json").status.success());
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
    let settings = &report["settings"];
    assert_eq!((&settings["maxEyeSegments"], &settings["maxPhotonSegments"]), (&json!(5), &json!(5)));
    assert_eq!((&settings["roulette"], &settings["direct"]), (&json!(false), &json!("photons")));
    assert_eq!((&settings["kernel"], &settings["firstRadius"]), (&json!("epanechnikov"), &json!(null)));
    assert!(report["radius"]["first"].as_f64().unwrap() > 0.0);
}

#[test]
fn the_first_budget_used_up_ends_it() {
    let folder = folder_with_floor();
    let began = Instant::now();
    let args = "render floor.gltf -o a.exr --backend cpu -r 32x16 --photons 2k --seconds 0.5 --iterations 1000000";
    assert!(sunfleck(folder.path(), words(args)).status.success());
    assert!(began.elapsed() < Duration::from_secs(20));
}

#[test]
fn quiet_says_nothing_and_a_pipe_gets_lines() {
    let folder = folder_with_floor();
    let output = render(folder.path(), "-o a.png -q");
    assert!(output.status.success() && output.stderr.is_empty() && output.stdout.is_empty());
    let text = stderr(&render(folder.path(), "-o a.png"));
    assert!(text.contains("it/s") && text.contains("photons/s") && text.contains("radius"), "{text}");
    assert!(text.contains("saved a.png after 3 iterations") && !text.contains('\u{1b}'), "{text}");
}

#[cfg(unix)]
#[test]
fn an_interrupted_render_is_saved() {
    for signal in ["-INT", "-TERM"] {
        let folder = folder_with_floor();
        let args =
            "render floor.gltf -o a.exr -o a.png --json a.json --backend cpu -r 32x16 --photons 2k --seconds 300";
        let child = std::process::Command::new(PROGRAM)
            .current_dir(folder.path())
            .args(words(&format!("{args} --save-every 0.01")))
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        // It renders once there is a picture.
        let began = Instant::now();
        while !folder.path().join("a.exr").exists() && began.elapsed() < Duration::from_secs(60) {
            std::thread::sleep(Duration::from_millis(20));
        }
        let sent = std::process::Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
        assert!(stderr(&output).contains("interrupted: saved a.exr, a.png"), "{}", stderr(&output));
        assert_eq!(names(folder.path()), ["a.exr", "a.json", "a.png", "floor.bin", "floor.gltf"]);
        assert_eq!(output::exr::read(&folder.path().join("a.exr")).unwrap().rgb.len(), 32 * 16);
        let report: Value = serde_json::from_slice(&fs::read(folder.path().join("a.json")).unwrap()).unwrap();
        assert_eq!(report["end"], "interrupted");
        let meta = MetaData::read_from_file(folder.path().join("a.exr"), true).unwrap();
        let saved = meta.headers[0].own_attributes.other[&Text::from("iterations")].clone();
        assert_eq!(saved, AttributeValue::I32(report["iterations"].as_array().unwrap().len() as i32));
    }
}

#[test]
fn comparison() {
    let folder = folder_with_floor();
    for (name, extra) in [("a", ""), ("b", "--seed 1"), ("small", "--crop 0,0.5,0,1")] {
        assert!(render(folder.path(), &format!("-o {name}.exr {extra}")).status.success());
    }
    let output = sunfleck(folder.path(), words("compare a.exr b.exr --json"));
    let difference: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(difference["pixels"], 32 * 16);
    assert!(difference["relMse"].as_f64().unwrap() >= difference["relMseTrimmed"].as_f64().unwrap());
    let same = sunfleck(folder.path(), words("compare a.exr a.exr"));
    assert!(String::from_utf8(same.stdout).unwrap().contains("relMSE             0.000000"));
    assert_error(
        &sunfleck(folder.path(), words("compare a.exr small.exr")),
        1,
        &["a.exr", "small.exr", "windows differ"],
    );
    assert_error(&sunfleck(folder.path(), words("compare a.exr absent.exr")), 1, &["absent.exr"]);
    assert_error(&sunfleck(folder.path(), words("compare a.exr floor.gltf")), 1, &["floor.gltf"]);
}

#[test]
fn the_command_line_overrides_set_and_set_overrides_the_file() {
    let folder = folder_with_floor();
    let settings = "scene = \"floor.gltf\"\nsize = [16, 8]\nphotons = \"1k\"\niterations = 2\nseed = 5\nalpha = 0.5\n\
        [camera]\nposition = [0.0, 6.0, 0.0]\n";
    fs::create_dir(folder.path().join("sub")).unwrap();
    fs::write(folder.path().join("floor.toml"), settings).unwrap();
    let args = "render ../floor.toml -o a.exr --json a.json --backend cpu --set photons=2k --set alpha=0.6 --alpha 0.7";
    let output = sunfleck(&folder.path().join("sub"), words(args));
    assert!(output.status.success(), "{}", stderr(&output));
    let report: Value = serde_json::from_slice(&fs::read(folder.path().join("sub/a.json")).unwrap()).unwrap();
    let settings = &report["settings"];
    assert_eq!(
        (&settings["size"], &settings["seed"], &settings["iterations"]),
        (&json!([16, 8]), &json!(5), &json!(2))
    );
    assert_eq!(settings["photonPaths"], 2000);
    assert!((settings["alpha"].as_f64().unwrap() - 0.7).abs() < 1e-6);
    let meta = MetaData::read_from_file(folder.path().join("sub/a.exr"), true).unwrap();
    let m = glam::Mat4::from_cols_array(&meta.headers[0].own_attributes.world_to_camera.unwrap());
    assert!(m.transform_point3(glam::Vec3::ZERO).abs_diff_eq(glam::vec3(0.0, 0.0, -6.0), 1e-5), "{m}");

    fs::write(folder.path().join("wrong.toml"), "scene = \"floor.gltf\"\nphotons = -1\n").unwrap();
    assert_error(&sunfleck(folder.path(), words("render wrong.toml -o a.png")), 1, &["wrong.toml:2", "photons"]);
    fs::write(folder.path().join("absent.toml"), "scene = \"absent.glb\"\n").unwrap();
    assert_error(&sunfleck(folder.path(), words("render absent.toml -o a.png")), 1, &["absent.glb"]);
}

#[test]
fn a_scene_without_light_gets_some_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = floor();
    scene["scenes"][0]["nodes"] = json!([0, 2]);
    let file = write_scene(folder.path(), &scene, &CORNERS, &INDICES);
    let lit = |flags: &str| {
        let output = render(folder.path(), flags);
        assert!(output.status.success());
        assert_eq!(stderr(&output).starts_with("sunfleck: warning: "), flags == "-o a.exr", "{}", stderr(&output));
        output::exr::read(&folder.path().join("a.exr")).unwrap().rgb[8 * 32 + 16][0]
    };
    assert!(lit("-o a.exr") > 0.01);
    assert_eq!(lit("-o a.exr --set environment.color=[0,0,0]"), 0.0);
    // It is no part of the scene, and nothing is written for it.
    let own = folder.path().join("copy.hdr");
    fs::write(&own, "mine").unwrap();
    let name = file.to_str().unwrap();
    let output = sunfleck(folder.path(), ["export", name, "-o", "copy.glb"]);
    assert!(output.status.success() && stderr(&output) == "wrote copy.glb\n", "{}", stderr(&output));
    assert_eq!(fs::read(own).unwrap(), b"mine");
    // Unless something is changed about light.
    fs::write(folder.path().join("bright.toml"), "scene = \"floor.gltf\"\n[environment]\nstrength = 2\n").unwrap();
    let output = sunfleck(folder.path(), words("export bright.toml -o bright.glb"));
    assert!(output.status.success() && folder.path().join("bright.hdr").exists(), "{}", stderr(&output));
    // Nothing that is read is written over, by whatever flag.
    fs::write(folder.path().join("sky.toml"), "scene = \"floor.gltf\"\n[environment]\nfile = \"bright.hdr\"\n")
        .unwrap();
    for arguments in ["export sky.toml -o bright.glb", "export bright.glb -o ./bright.glb"] {
        assert_error(&sunfleck(folder.path(), words(arguments)), 2, &["bright.", "is read and to be written"]);
    }
    fs::rename(folder.path().join("a.exr"), folder.path().join("sky.exr")).unwrap();
    for read in ["--env sky.exr", "--set environment.file=sky.exr"] {
        let arguments = format!("render floor.gltf -o sky.exr {read}");
        assert_error(&sunfleck(folder.path(), words(&arguments)), 2, &["sky.exr is read and to be written"]);
    }
}

#[test]
fn scenes_and_export() {
    let folder = tempfile::tempdir().unwrap();
    let list = String::from_utf8(sunfleck(folder.path(), ["scenes"]).stdout).unwrap();
    assert_eq!(list.lines().count(), sunfleck::scene::shipped::NAMES.len());
    assert!(sunfleck(folder.path(), words("export cornell -o box.glb")).status.success());
    let args = "render box.glb -o a.exr --backend cpu -r 16x16 --photons 1k --iterations 1 -q";
    let output = sunfleck(folder.path(), words(args));
    assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    assert_error(&sunfleck(folder.path(), words("export cornell -o box.obj")), 2, &[".glb"]);
    assert_error(&sunfleck(folder.path(), words("export absent.glb -o b.glb")), 1, &["absent.glb"]);
}
