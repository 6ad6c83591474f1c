//! OBJ and MTL.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::{Folder, png};
use crate::not_found;
use glam::{Vec2, Vec3, Vec4};
use sunfleck::ppm::Interrupt;
use sunfleck::scene::AlphaMode;
use sunfleck::scene::load::{LoadError, load_unless};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

/// Refuses an OBJ file with all of `expected` in the message.
fn refuse(text: &str, expected: &[&str]) {
    let message = Folder::new().refuse("scene.obj", text);
    for part in expected {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

#[test]
fn faces_of_all_kinds() {
    let text = format!(
        "{SQUARE}vt 0 0\nvt 1 0.25\nvn 0 0 1\nvn 0 0 2\n\
         # a comment\no quad\nf 1 2 3 4\nf -4 -3 -2\no mapped\nf 1/1/1 2/2/2 \\\n3/1/1\nf 1//1 2//1 3//2\n"
    );
    let loaded = Folder::new().load("scene.obj", text);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let [quad, mapped, smooth] = &loaded.scene.meshes[..] else { panic!("three meshes") };
    assert_eq!(quad.name, "quad");
    assert_eq!(quad.triangles, [[0, 1, 2], [0, 2, 3], [0, 1, 2]]);
    assert!(quad.normals.is_empty() && quad.uv0.is_empty());
    // v counts from the bottom in OBJ, from the top here.
    assert_eq!(mapped.uv0, [Vec2::new(0.0, 1.0), Vec2::new(1.0, 0.75), Vec2::new(0.0, 1.0)]);
    assert_eq!(mapped.normals, [Vec3::Z; 3]);
    assert!(smooth.uv0.is_empty() && smooth.normals == [Vec3::Z; 3]);
    let grey = &loaded.scene.materials[quad.material];
    assert_eq!((grey.base_color, grey.specular), (Vec3::splat(0.5), 0.0));
}

#[test]
fn wrong_lines_are_named() {
    refuse("hello\n", &["neither vertices nor faces"]);
    refuse("v 0 0\n", &["line 1", "v:", "3 numbers"]);
    refuse("v 0 zero 0\n", &["line 1", "zero"]);
    refuse(&format!("{SQUARE}f 1 2 5\n"), &["line 5", "vertex 5 of 4"]);
    refuse(&format!("{SQUARE}f 1 2 0\n"), &["line 5", "vertex 0 of 4"]);
    refuse(&format!("{SQUARE}f 1 2 -5\n"), &["line 5", "vertex -5 of 4"]);
    refuse(&format!("{SQUARE}f 1 2 99999999999999999999\n"), &["line 5"]);
    refuse(&format!("{SQUARE}f 1 2 -9223372036854775808\n"), &["line 5"]);
    refuse(&format!("{SQUARE}f 1/1 2/1 3/1\n"), &["line 5", "texture coordinate 1 of 0"]);
    refuse(&format!("{SQUARE}f /1 2 3\n"), &["line 5"]);
    refuse("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", &["vertex 2", "not finite"]);
    refuse("v 0 0 0\nv 1 0 0\nv 0 1e30 0\nf 1 2 3\n", &["vertex 2", "origin"]);
    let loaded = Folder::new().load("scene.obj", [SQUARE, "f 1 2\nl 1 2\nf 1 1 2\nf 1 2 3\ncurv 1\n"].concat());
    assert_eq!(loaded.scene.meshes[0].triangles.len(), 1);
    assert_eq!(loaded.warnings.len(), 4, "{:?}", loaded.warnings);
}

#[test]
fn material_libraries_are_read_with_care() {
    let folder = Folder::new();
    let scene = |library: &str| format!("mtllib {library}\n{SQUARE}usemtl a\nf 1 2 3\n");
    let loaded = folder.load("scene.obj", scene("none.mtl"));
    assert!(loaded.warnings[0].contains("line 1: mtllib") && loaded.warnings[0].contains("none.mtl"));
    assert!(loaded.warnings[1].contains("usemtl a"));
    for outside in ["/dev/zero", "../secret.mtl", "/etc/passwd"] {
        let message = folder.refuse("scene.obj", scene(outside));
        assert!(message.contains("line 1: mtllib") && message.contains(outside), "{message}");
        assert!(message.contains("outside") || message.contains("no such"), "{message}");
    }
    for (text, problem) in [
        ("newmtl a\nKe 1 1\n", "scene.mtl:2: Ke: a colour has 3 numbers"),
        ("newmtl a\nKd 1 1 x\n", "scene.mtl:2: Kd: \"x\""),
        ("newmtl a\n\nNs\n", "scene.mtl:3: Ns"),
        ("newmtl a\nillum 2.5\n", "scene.mtl:2: illum"),
        ("newmtl a\nKd -1 0 0\n", "negative"),
        ("newmtl a\nmap_Kd\n", "scene.mtl:2: map_Kd: no file"),
        ("newmtl a\nmap_Kd none.png\n", &*format!("scene.mtl:2: none.png: {}", not_found())),
        ("newmtl a\nmap_Kd ../x.png\n", "scene.mtl:2: ../x.png: lies outside"),
    ] {
        folder.write("scene.mtl", text);
        let message = folder.refuse("scene.obj", scene("scene.mtl"));
        assert!(message.contains(problem), "{message:?} lacks {problem:?}");
    }
    folder.write("my scene.mtl", "newmtl a\nKd 1 0 0\n");
    let loaded = folder.load("scene.obj", scene("my scene.mtl"));
    assert_eq!(loaded.scene.materials[0].base_color, Vec3::X);
}

#[test]
fn phong_becomes_physical() {
    let folder = Folder::new();
    let text = "newmtl matte\nKd 0.8 0.6 0.4\nKa 1 1 1\n\
                newmtl shiny\nKd 0.5 0.5 0.5\nKs 0.5 0.25 0\nNs 198\nillum 2\n\
                newmtl flat\nKs 1 1 1\nillum 1\n\
                newmtl mirror\nKs 0.9 0.8 0.7\nillum 3\n\
                newmtl glass\nKd 0 0 0\nNi 1.6\nillum 7\nTf 1 0.5 1\nd 0.2\n\
                newmtl lamp\nKd 0 0 0\nKe 5 6 7\n\
                newmtl veil\nKd 1 1 1\nd 0.25\n\
                newmtl old\nTr 0.25\n\
                newmtl modern\nKd 0.2 0.2 0.2\nPr 0.3\nPm 1\n";
    folder.write("scene.mtl", text);
    let loaded = folder.load("scene.obj", format!("mtllib scene.mtl\n{SQUARE}usemtl matte\nf 1 2 3\n"));
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let named = |name: &str| loaded.scene.materials.iter().find(|m| m.name == name).unwrap();
    assert_eq!((named("matte").base_color, named("matte").specular), (Vec3::new(0.8, 0.6, 0.4), 0.0));
    let shiny = named("shiny");
    assert_eq!((shiny.specular, shiny.specular_color), (0.5, Vec3::new(1.0, 0.5, 0.0)));
    assert!((shiny.roughness.powi(2) - 0.1).abs() < 1e-6);
    assert_eq!(named("flat").specular, 0.0);
    let mirror = named("mirror");
    assert_eq!((mirror.metallic, mirror.roughness, mirror.base_color), (1.0, 0.0, Vec3::new(0.9, 0.8, 0.7)));
    let glass = named("glass");
    assert!(glass.volume && glass.transmission == 1.0 && glass.ior == 1.6 && glass.alpha == AlphaMode::Opaque);
    assert_eq!((glass.base_color, glass.roughness), (Vec3::new(1.0, 0.5, 1.0), 0.0));
    assert_eq!((named("lamp").emission, named("lamp").double_sided), (Vec3::new(5.0, 6.0, 7.0), false));
    assert_eq!((named("veil").alpha, named("veil").opacity), (AlphaMode::Blend, 0.25));
    assert_eq!(named("old").opacity, 0.75);
    assert_eq!((named("modern").roughness, named("modern").metallic), (0.3, 1.0));
}

#[test]
fn maps_spread_over_files_become_one_image() {
    let folder = Folder::new();
    folder.write("maps/color.png", png(2, 1, &[[10, 20, 30, 255], [40, 50, 60, 255]]));
    folder.write("maps/mask.png", png(1, 1, &[[77, 77, 77, 255]]));
    folder.write("maps/rough.png", png(1, 2, &[[100, 0, 0, 255], [200, 0, 0, 255]]));
    folder.write(
        "maps/scene.mtl",
        "newmtl a\nKd 0 0 0\nmap_Kd -s 2 2 color.png\nmap_d mask.png\nmap_Pr rough.png\nnewmtl b\nmap_Kd color.png\n",
    );
    let loaded = folder.load("scene.obj", format!("mtllib maps/scene.mtl\n{SQUARE}usemtl a\nf 1 2 3\n"));
    let (scene, a) = (&loaded.scene, &loaded.scene.materials[0]);
    let color = a.base_color_texture.unwrap();
    assert_eq!(scene.images[color.image].texels, [[10, 20, 30, 77], [40, 50, 60, 77]]);
    assert_eq!((color.transform * Vec2::ONE, a.alpha, a.base_color), (Vec2::splat(2.0), AlphaMode::Blend, Vec3::ONE));
    let rough = &scene.images[a.metallic_roughness_texture.unwrap().image];
    assert_eq!((rough.texels[0][1], rough.texels[1][1], a.roughness), (100, 200, 1.0));
    let plain = &scene.images[scene.materials[1].base_color_texture.unwrap().image];
    assert_eq!(plain.texels[0], [10, 20, 30, 255]);
    // Parts that nothing shows by themselves are not kept.
    assert_eq!(scene.images.len(), 3);
}

#[test]
fn vertex_colours_are_srgb() {
    let text = "v 0 0 0 1 0 0.5\nv 1 0 0\nv 0 1 0 0 0 0\nf 1 2 3\n";
    let loaded = Folder::new().load("scene.obj", text);
    let colors = &loaded.scene.meshes[0].colors;
    assert!(colors[0].abs_diff_eq(Vec4::new(1.0, 0.0, 0.21404, 1.0), 1e-4));
    assert_eq!((colors[1], colors[2]), (Vec4::ONE, Vec4::new(0.0, 0.0, 0.0, 1.0)));
}

#[test]
fn reading_ends_when_nobody_wants_the_scene() {
    let folder = Folder::new();
    let file = folder.write("scene.obj", SQUARE.repeat(5000) + "f 1 2 3\n");
    let asked = Arc::new(AtomicU32::new(0));
    for most in 0..5 {
        let count = Arc::clone(&asked);
        let interrupt = Interrupt::when(move || count.fetch_add(1, Ordering::Relaxed) >= most);
        assert!(matches!(load_unless(&file, &interrupt), Err(LoadError::Interrupted)), "{most}");
        assert_eq!(asked.swap(0, Ordering::Relaxed), most + 1);
    }
    assert_eq!(load_unless(&file, &Interrupt::default()).unwrap().scene.meshes.len(), 1);
}

#[test]
fn a_scene_too_far_away_for_its_size_is_told() {
    for (offset, is_told) in [(0.0, false), (1e3, false), (1e5, true)] {
        let text = format!("v {offset} 0 0\nv {0} 0 0\nv {0} 10 0\nf 1 2 3\n", offset + 10.0);
        let warnings = Folder::new().load("scene.obj", text).warnings;
        assert_eq!(
            warnings.iter().any(|warning| warning.contains("from the origin")),
            is_told,
            "{offset}: {warnings:?}"
        );
    }
}
