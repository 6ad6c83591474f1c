//! Files that come from outside, and the picture on the screen.

use std::path::Path;

use eframe::egui;
use egui::{Key, Modifiers};

use sunfleck::scene::Environment;
use sunfleck::scene::export::write_environment_hdr;

use super::Window;
use crate::view::app::Viewer;

const QUAD: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n";

#[test]
fn files_dropped_at_once_are_each_taken_or_named() {
    let mut window = Window::with_picture();
    let [picture, scene, second] = ["picture.exr", "scene.toml", "second.toml"].map(|name| window.path(name));
    window.viewer().save_to(picture.clone());
    window.wait_for_message("saved ");
    std::fs::write(&scene, "scene = \"cornell\"\nsize = [16, 12]\nphotons = 200\n").unwrap();
    window.drop_files(["readme.txt".into(), picture, scene, second]);
    assert!(window.shows("readme.txt: not a scene") && window.shows("second.toml: left out"));
    window.wait("both", |viewer| {
        viewer.now.reference.is_some() && viewer.now.painted.as_ref().is_some_and(|painted| painted.size == [16, 12])
    });
}

/// What the window kept in eframe's file before it had its own.
struct Old;

impl eframe::Storage for Old {
    fn get_string(&self, key: &str) -> Option<String> {
        let text = "(recent:[\"/no/old.obj\"],show_settings:false,show_inspect:true,show_convergence:true)";
        (key == "remembered").then(|| text.to_owned())
    }

    fn set_string(&mut self, _: &str, _: String) {}

    fn remove_string(&mut self, _: &str) {}

    fn flush(&mut self) {}
}

#[test]
fn what_is_remembered_is_in_a_file_as_soon_as_it_changes() {
    let mut window = Window::new(None);
    let folder = tempfile::tempdir().unwrap();
    let place = folder.path().join("remembered.toml");
    let [scene, other] = ["quad.obj", "other.obj"].map(|name| folder.path().join(name));
    for file in [&scene, &other] {
        std::fs::write(file, QUAD).unwrap();
    }
    let full = |path: &Path| std::fs::canonicalize(path).unwrap().to_string_lossy().into_owned();
    let there = |place: &Path| std::fs::read_to_string(place).unwrap_or_default().parse::<toml::Table>().unwrap();
    let recent = |place: &Path, paths: &[String]| {
        let paths: Vec<_> = paths.iter().cloned().map(toml::Value::String).collect();
        there(place).get("recent").and_then(toml::Value::as_array) == Some(&paths)
    };
    window.viewer().enter(Some(&Old), Some(place.clone()));
    let old = "/no/old.obj".to_owned();
    window.wait("what was in the old file", |viewer| {
        viewer.remembered.show_convergence && recent(&place, std::slice::from_ref(&old))
    });
    window.viewer().open(scene.to_string_lossy());
    window.wait("the scene", |_| recent(&place, &[full(&scene), old.clone()]));
    window.press(Modifiers::NONE, Key::F1);
    window.wait("the panel", |_| there(&place).get("show_settings") == Some(&true.into()));
    // Another window: the old file does not count any more.
    let mut second = Window::new(None);
    second.viewer().enter(Some(&Old), Some(place.clone()));
    assert!(second.viewer().remembered.show_settings);
    second.viewer().open(other.to_string_lossy());
    second.wait("the other scene", |_| recent(&place, &[full(&other), full(&scene), old.clone()]));
    second.press(Modifiers::NONE, Key::F2);
    drop(window);
    drop(second);
    assert_eq!(there(&place).get("show_inspect"), Some(&false.into()));
}

/// Writes a sky of one radiance.
fn write_sky(path: &Path, radiance: f32) {
    write_environment_hdr(&Environment::uniform(glam::Vec3::splat(radiance)), path).unwrap();
}

/// The file that the settings name.
fn environment(viewer: &Viewer) -> Option<&Path> {
    viewer.edits.now().environment.as_ref()?.file.as_deref().map(Path::new)
}

#[test]
fn an_environment_lights_the_scene_that_is_open() {
    let mut window = Window::new(None);
    let [dropped, chosen, broken] = ["a sky.hdr", "sky.hdr", "broken.hdr"].map(|name| window.path(name));
    write_sky(&dropped, 1.0);
    write_sky(&chosen, 8.0);
    std::fs::write(&broken, "#?RADIANCE\n").unwrap();
    window.drop_file(dropped.clone());
    assert!(window.shows("a sky.hdr: the environment of which scene?"));
    let scene = window.path("quad.toml");
    std::fs::write(window.path("quad.obj"), QUAD).unwrap();
    std::fs::write(&scene, "scene = \"quad.obj\"\nsize = [32, 24]\nphotons = 500\n").unwrap();
    window.drop_file(scene.clone());
    window.wait_for_picture();
    let mean = |window: &mut Window| {
        window.wait("picture in this light", |viewer| {
            viewer
                .now
                .snapshot
                .as_ref()
                .is_some_and(|snapshot| snapshot.settings.environment == viewer.edits.now().environment)
        });
        window.wait_for_picture();
        let picture = window.viewer().now.snapshot.as_ref().unwrap().picture();
        picture.rgb.iter().map(|rgb| rgb[0]).sum::<f32>() / picture.rgb.len() as f32
    };
    let before = mean(&mut window);
    window.drop_file(dropped.clone());
    window.wait("environment", |viewer| environment(viewer) == Some(&dropped));
    let lit = mean(&mut window);
    // It is not written over.
    window.viewer().save_to(dropped.clone());
    window.wait_for_message("a sky.hdr is read and to be written");
    // What cannot be read changes nothing.
    window.drop_file(broken);
    window.wait_for_message("broken.hdr");
    assert_eq!(environment(window.viewer()), Some(dropped.as_path()));
    window.activate("Environment");
    window.activate("Source");
    window.click("A map …");
    window.wait("other environment", |viewer| environment(viewer) == Some(&chosen));
    let brighter = mean(&mut window);
    assert!((brighter / lit - 8.0).abs() < 0.1, "{brighter} {lit}");
    for expected in [Some(dropped.as_path()), None] {
        window.press(Modifiers::COMMAND, Key::Z);
        assert_eq!(environment(window.viewer()), expected);
    }
    assert_eq!(mean(&mut window), before);
    // Both at once.
    window.viewer().close_scene();
    window.drop_files([dropped.clone(), scene]);
    window.wait("scene and environment", |viewer| environment(viewer) == Some(&dropped));
    assert_eq!(mean(&mut window), lit);
}

#[test]
fn a_narrow_window_keeps_the_picture() {
    let mut window = Window::with_picture();
    for (width, both) in [(1280.0, true), (480.0, false), (800.0, true)] {
        window.harness.set_size([width, 320.0].into());
        window.steps(3);
        assert_eq!((window.shows("Estimator"), window.shows("Under the cursor")), (true, both), "{width}");
        assert!(window.viewer().picture.area.is_some_and(|area| area.width() >= 160.0), "{width}");
    }
    window.harness.set_size([480.0, 320.0].into());
    for shown in [(false, true), (false, false), (false, true)] {
        window.press(Modifiers::NONE, Key::F2);
        window.steps(2);
        assert_eq!((window.shows("Estimator"), window.shows("Under the cursor")), shown);
    }
}

#[test]
fn a_pixel_of_the_picture_is_a_pixel_of_the_screen() {
    let mut window = Window::with_picture();
    window.viewer().remembered.show_inspect = false;
    for (scale, size) in
        [(1.0, [1280.0, 720.0]), (1.0, [1281.0, 721.0]), (1.5, [1279.0, 720.0]), (2.0, [1281.5, 721.0])]
    {
        window.harness.set_pixels_per_point(scale);
        window.harness.set_size(size.into());
        window.press(Modifiers::NONE, Key::Num2);
        window.steps(2);
        let rect = window.viewer().picture.rect.unwrap() * scale;
        assert!((rect.size() - egui::vec2(32.0, 24.0)).abs().max_elem() < 1e-3, "{scale}: {rect}");
        assert!((rect.min - rect.min.round()).abs().max_elem() < 1e-3, "{scale}: {rect}");
    }
}
