//! What the header of a picture says to other programs.

use std::path::Path;

use exr::meta::MetaData;
use exr::meta::attribute::{AttributeValue, Text};
use serde_json::{Value, json};

use super::{CORNERS, INDICES, floor, render, stderr, write_scene};

/// The screen window's width, and the projection.
fn screen(folder: &Path, extra: &str) -> (f32, String) {
    let output = render(folder, &format!("-o a.exr {extra}"));
    assert!(output.status.success(), "{}", stderr(&output));
    let meta = MetaData::read_from_file(folder.join("a.exr"), true).unwrap();
    let own = &meta.headers[0].own_attributes;
    let Some(AttributeValue::Text(projection)) = own.other.get(&Text::from("projection")) else { panic!("a string") };
    (own.screen_window_width, projection.to_string())
}

/// Of 32×16 pixels, whatever part of them is computed.
#[test]
fn the_screen_window_is_the_whole_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let mut scene = floor();
    let are_near = |scene: &Value, width: f32, name: &str| {
        write_scene(folder.path(), scene, &CORNERS, &INDICES);
        for extra in ["", "--crop 0.25,0.75,0.5,1"] {
            let (found, projection) = screen(folder.path(), extra);
            assert!((found / width - 1.0).abs() < 1e-6 && projection == name, "{found} {projection} {extra}");
        }
    };
    are_near(&scene, 2.0 * 0.25f32.tan() * 2.0, "perspective");
    scene["cameras"][0] = json!({
        "name": "Above", "type": "orthographic",
        "orthographic": {"xmag": 1.0, "ymag": 0.75, "znear": 0.1, "zfar": 10.0},
    });
    are_near(&scene, 2.0 * 0.75 * 2.0, "orthographic");
}
