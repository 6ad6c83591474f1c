//! Flags, overrides and settings files together.

use super::*;
use glam::Vec3;
use sunfleck::scene::{Environment, export::write_environment_hdr};

/// What a picture of `scene` holds.
fn pixels(folder: &Path, scene: &str, extra: &[&str]) -> Vec<[f32; 3]> {
    let line = ["render", scene, "-o", "a.exr"].into_iter().chain(QUICK).chain(extra.iter().copied());
    let output = sunfleck(folder, line);
    assert!(output.status.success(), "{extra:?}: {}", stderr(&output));
    output::exr::read(&folder.join("a.exr")).unwrap().rgb
}

fn mean(pixels: &[[f32; 3]]) -> f32 {
    pixels.as_flattened().iter().sum::<f32>() / pixels.as_flattened().len() as f32
}

#[test]
fn a_camera_that_is_named_is_changed_by_set() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = floor();
    // A name that is text to TOML, and no escape of Rust's.
    scene["cameras"][0]["name"] = "Above\u{a0}\"x\"".into();
    write_scene(folder.path(), &scene, &CORNERS, &INDICES);
    let file = "scene = \"floor.gltf\"\n[camera]\nposition = [0.0, 6.0, 0.0]\naperture_radius = 0.1\n";
    fs::write(folder.path().join("far.toml"), file).unwrap();
    let render = |scene, extra: &[&str]| pixels(folder.path(), scene, extra);
    let narrow = ["--set", "camera.yfov_degrees=10"];
    let wide = render("floor.gltf", &[]);
    let expected = render("floor.gltf", &narrow);
    assert!(expected != wide);
    for name in ["Above\u{a0}\"x\"", "0"] {
        let named = ["--camera", name, narrow[0], narrow[1], "--set", "camera.name=other"];
        assert!(render("floor.gltf", &named) == expected, "{name}");
        // In place of all that the file says of its camera.
        assert!(render("far.toml", &named) == expected, "{name}");
        assert!(render("far.toml", &["--camera", name]) == wide, "{name}");
    }
}

#[test]
fn an_environment_that_is_named_is_changed_by_set() {
    let folder = folder_with_floor();
    fs::create_dir(folder.path().join("sub")).unwrap();
    let texels = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vec3::from);
    let sky = Environment {
        width: 4,
        height: 1,
        texels: texels.to_vec().into(),
        rotation: 0.0,
        strength: 1.0,
        tint: Vec3::ONE,
    };
    write_environment_hdr(&sky, &folder.path().join("sky.hdr")).unwrap();
    let file = |name: &str, fields: &str| {
        let text = format!("scene = \"../floor.gltf\"\n[environment]\n{fields}\n");
        fs::write(folder.path().join("sub").join(name), text).unwrap();
    };
    file("turned.toml", "file = \"../sky.hdr\"\nrotation_degrees = 90\nstrength = 3");
    file("red.toml", "color = [9, 0, 0]\nstrength = 5");
    let render = |scene, extra: &[&str]| pixels(folder.path(), scene, extra);
    let expected = render("sub/turned.toml", &[]);
    let env = ["--env", "sky.hdr"];
    let set = ["--set", "environment.rotation_degrees=90", "--set", "environment.strength=3"];
    assert!(render("floor.gltf", &env) != expected);
    for scene in ["floor.gltf", "sub/red.toml"] {
        assert!(render(scene, &[&env[..], &set].concat()) == expected, "{scene}");
    }
}

#[test]
fn turning_lights_off_turns_no_sky_on() {
    let folder = folder_with_floor();
    let mut dark = floor();
    dark["scenes"][0]["nodes"] = json!([0, 2]);
    fs::write(folder.path().join("dark.gltf"), dark.to_string()).unwrap();
    let render = |scene, set: &[&str]| {
        let extra: Vec<_> = set.iter().flat_map(|pair| ["--set", *pair]).collect();
        mean(&pixels(folder.path(), scene, &extra))
    };
    // Lights of the file, or of the settings.
    let lamp = "sphere.0={centre=[0, 2, 0], radius=0.1, emission=[9, 9, 9]}";
    for (scene, set) in [
        ("floor.gltf", vec!["light_scale=0"]),
        ("floor.gltf", vec!["scene_light.0={index=0, on=false}"]),
        ("cornell", vec!["light_scale=0"]),
        ("cornell", vec!["material.lamp.emission=[0, 0, 0]"]),
        ("dark.gltf", vec![lamp, "light_scale=0"]),
        ("dark.gltf", vec!["light_scale=0"]),
    ] {
        assert_eq!(render(scene, &set), 0.0, "{scene} {set:?}");
    }
    assert!(render("dark.gltf", &[lamp]) > 0.0);
    // The sky is scaled as all light is.
    let [whole, half] = ["light_scale=1", "light_scale=0.5"].map(|scale| render("dark.gltf", &[scale]));
    assert!(whole > 0.1 && (half / whole - 0.5).abs() < 1e-3, "{whole} {half}");
    // Nor can there be a sky to change, whether the lamp is on or off.
    let sky = "render cornell -o a.exr --set environment.strength=2 --set material.lamp.emission=[0,0,0]";
    assert_error(&sunfleck(folder.path(), words(sky)), 1, &["environment: neither file nor color is given"]);
}
