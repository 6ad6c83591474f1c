//! Fields of the settings: what is typed, what is only visited, dragged, greyed out.

use eframe::egui;
use egui::{Event, Key, Modifiers, PointerButton, Pos2, Rect, Role};
use egui_kittest::Node;
use egui_kittest::kittest::{NodeT, Queryable};
use sunfleck::scene::settings::{CameraSettings, Count, EnvironmentSettings, FirstRadius, Settings};

use super::Window;
use super::panels::bare;
use crate::view::engine::is_asked_anew;
use crate::view::settings::Said;

/// With all groups of the settings open, and nothing beside them.
fn panel(set: impl FnOnce(&mut Settings)) -> Window {
    let mut window = bare();
    window.viewer().remembered.show_settings = true;
    window.viewer().edit_at(0.0, "test", set);
    window.viewer().selected = Some(0);
    window.steps(2);
    for group in ["Environment", "Lights"] {
        // Below what is in sight.
        window.activate(group);
    }
    window
}

/// The fields for numbers in the panel.
fn all_fields(window: &Window) -> Vec<Node<'_>> {
    let all = window.harness.get_all_by_role(Role::SpinButton);
    all.filter(|node| node.rect().max.x < 300.0).collect()
}

/// Those of a row, from the left.
fn fields<'a>(window: &'a Window, row: &str) -> Vec<Node<'a>> {
    let y = window.harness.get_by_role_and_label(Role::Label, row).rect().center().y;
    all_fields(window).into_iter().filter(|node| (node.rect().center().y - y).abs() < 4.0).collect()
}

fn text(window: &Window, row: &str, i: usize) -> String {
    fields(window, row)[i].value().unwrap()
}

/// Types into what has the focus, or only looks at it.
fn end(window: &mut Window, typed: &str, key: Option<Key>) {
    window.steps(2);
    if !typed.is_empty() {
        window.harness.input_mut().events.push(Event::Text(typed.to_owned()));
        window.step();
    }
    match key {
        Some(key) => window.press(Modifiers::NONE, key),
        // On nothing at all.
        None => drag(window, egui::pos2(140.0, 49.0), 0.0),
    }
    window.steps(2);
}

fn enter(window: &mut Window, row: &str, i: usize, typed: &str) {
    fields(window, row)[i].focus();
    end(window, typed, Some(Key::Enter));
}

/// From a point to the right; a click without a way.
fn drag(window: &mut Window, from: Pos2, way: f32) {
    let press = |pos, pressed| Event::PointerButton {
        pos,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    window.harness.input_mut().events.extend([Event::PointerMoved(from), press(from, true)]);
    window.step();
    let n = way.abs().ceil() as usize;
    for i in 1..=n {
        let to = from + egui::vec2(way * i as f32 / n as f32, 0.0);
        window.harness.input_mut().events.push(Event::PointerMoved(to));
        window.step();
    }
    window.harness.input_mut().events.push(press(from + egui::vec2(way, 0.0), false));
    window.steps(2);
}

/// Numbers of more digits than are shown, or outside what a slider has.
fn awkward(settings: &mut Settings) {
    settings.photons = Some(Count(54_321));
    settings.light_scale = Some(0.000_412_3);
    settings.exposure = Some(1.0 / 3.0);
    settings.seed = Some(4_000_000_007);
    settings.max_segments = Some(5000);
    settings.radius = Some(FirstRadius::Fixed(2e-9));
    let sky = settings.environment.insert(EnvironmentSettings::default());
    (sky.color, sky.strength, sky.rotation_degrees) = (Some([2.0, 1.5, 0.5]), Some(123.456_7), Some(-37.123_45));
}

/// As if nothing had been said: nothing to take back, nothing in the command.
#[test]
fn what_is_set_back_by_hand_is_not_said() {
    let mut window = panel(|_| {});
    let before = window.viewer().edits.now().clone();
    for (row, typed, back) in [
        ("Alpha", "0.5", "0.6666667"),
        ("Longest path", "9", "no limit"),
        ("Seed", "7", "0"),
        ("Metallic", "0.5", "0"),
        ("Light scale", "2", "1"),
    ] {
        enter(&mut window, row, 0, typed);
        assert_ne!(*window.viewer().edits.now(), before, "{row}");
        enter(&mut window, row, 0, back);
        assert_eq!(*window.viewer().edits.now(), before, "{row}");
    }
    // But what the file says is said.
    let said = Said { now: Some(7), read: Some(0), default: 0 };
    assert_eq!([said.saying(0), said.saying(4)], [Some(0), Some(4)]);
}

#[test]
fn visiting_a_field_changes_nothing() {
    let mut window = panel(awkward);
    let camera = CameraSettings::from(&window.viewer().camera().unwrap());
    let focus = CameraSettings { focus_distance: Some(0.591_425_36), aperture_radius: Some(0.001_234_567), ..camera };
    window.viewer().edit_at(10.0, "test", |s| s.camera = Some(focus));
    window.steps(2);
    assert_eq!(window.viewer().edits.now().max_segments, Some(5000), "only shown");
    let seen = |window: &mut Window| (window.viewer().edits.now().clone(), window.viewer().wanted.painting);
    let before = seen(&mut window);
    let n = all_fields(&window).len();
    assert!(n > 16, "{n}");
    for i in 0..n {
        for key in [Some(Key::Enter), Some(Key::Tab), Some(Key::Escape), None] {
            let field = all_fields(&window)[i];
            if field.accesskit_node().is_disabled() {
                continue;
            }
            let what = format!("{:?} {:?} {key:?}", field.accesskit_node().label(), field.value());
            field.focus();
            end(&mut window, "", key);
            // Out of the field that is next, too.
            end(&mut window, "", None);
            assert_eq!(seen(&mut window), before, "{what}");
            // Which Escape takes back, too.
            window.viewer().selected = Some(0);
            window.steps(2);
        }
    }
}

#[test]
fn what_is_typed_is_kept_in_full() {
    let mut window = panel(awkward);
    let now = |window: &mut Window| window.viewer().edits.now().clone();
    enter(&mut window, "Light scale", 0, "0.0004");
    assert_eq!(now(&mut window).light_scale, Some(0.0004));
    assert_eq!(text(&window, "Light scale", 0), "0.0004");
    enter(&mut window, "Rotation", 0, "37.25");
    assert_eq!(now(&mut window).environment.clone().unwrap().rotation_degrees, Some(37.25));
    enter(&mut window, "Alpha", 0, "0.12345");
    assert_eq!(now(&mut window).alpha, Some(0.12345));
    enter(&mut window, "Alpha", 0, "0.9995");
    assert_eq!(now(&mut window).alpha, Some(0.9995));
    // What no file may say is not taken.
    enter(&mut window, "Alpha", 0, "1");
    assert_eq!(now(&mut window).alpha, Some(0.9995));
    enter(&mut window, "Photons", 0, "54321");
    assert_eq!(now(&mut window).photons, Some(Count(54_321)));
    enter(&mut window, "Stops", 0, "0.33");
    assert_eq!(window.viewer().wanted.painting.look.exposure, Some(0.33));
    enter(&mut window, "Metallic", 0, "0.56789");
    assert_eq!(now(&mut window).materials[0].metallic, Some(0.56789));
    enter(&mut window, "Position", 1, "-0.123456");
    assert_eq!(now(&mut window).camera.as_ref().unwrap().position.unwrap()[1], -0.123456);
    // Escape takes back, and so does what is no number.
    let before = now(&mut window);
    fields(&window, "Alpha")[0].focus();
    end(&mut window, "0.9", Some(Key::Escape));
    enter(&mut window, "Alpha", 0, "nan");
    enter(&mut window, "Alpha", 0, "much");
    assert_eq!(now(&mut window), before);
}

#[test]
fn units_are_read() {
    let mut window = panel(|_| {});
    let lens = |window: &mut Window| {
        let camera = window.viewer().camera().unwrap();
        (camera.aperture_radius, camera.focus_distance)
    };
    for (typed, metres) in
        [("0.05 m", 0.05), ("5 mm", 0.005), ("2cm", 0.02), ("300 µm", 300e-6), ("0.0001 km", 0.1), ("0.01", 0.01)]
    {
        enter(&mut window, "Aperture", 0, typed);
        assert!((lens(&mut window).0 - metres).abs() < 1e-8, "{typed}: {:?}", lens(&mut window));
        let shown = text(&window, "Aperture", 0);
        assert!(shown.ends_with(" m"), "{shown}");
    }
    enter(&mut window, "Field of view", 0, "20°");
    assert_eq!(text(&window, "Field of view", 0), "20°");
    enter(&mut window, "Stops", 0, "1 EV");
    assert_eq!(window.viewer().wanted.painting.look.exposure, Some(1.0));
    enter(&mut window, "Longest path", 0, "7");
    assert_eq!(window.viewer().edits.now().max_segments, Some(7));
    enter(&mut window, "Longest path", 0, "no limit");
    assert_eq!(window.viewer().edits.now().max_segments, None);
}

#[test]
fn colours_are_linear_and_of_any_size() {
    let sky = |window: &mut Window| window.viewer().edits.now().environment.clone().unwrap().color.unwrap();
    for color in [[2.0, 1.5, 0.5], [8.0, 4.0, 0.25], [0.0; 3]] {
        let mut window = panel(|s| {
            s.environment = Some(EnvironmentSettings { color: Some(color), ..EnvironmentSettings::default() });
        });
        let [r, g, _] = color;
        window.harness.get_by_role_and_label(Role::ColorWell, "Colour").click_accesskit();
        window.steps(5);
        assert_eq!(sky(&mut window), color, "opened");
        let field = |window: &Window, name: &str| -> Rect {
            let field = window.harness.get_by_role_and_label(Role::SpinButton, name);
            field.focus();
            field.rect()
        };
        let at = field(&window, "B");
        end(&mut window, "12.3456", Some(Key::Enter));
        assert_eq!(sky(&mut window), [r, g, 12.3456]);
        // To the left end, red, as bright.
        let left = field(&window, "R").min.x;
        drag(&mut window, egui::pos2(left, at.min.y - 8.0), -30.0);
        let [r, g, b] = sky(&mut window);
        assert!(r == 12.3456 && g == b, "{r} {g} {b}");
        drag(&mut window, egui::pos2(left + 58.0, at.min.y - 100.0), 2.0);
        let [r, g, b] = sky(&mut window);
        assert!(g == 12.3456 && r < 3.0 && b < 3.0, "{r} {g} {b}");
        field(&window, "Largest");
        end(&mut window, "3", Some(Key::Enter));
        assert_eq!(sky(&mut window)[1], 3.0);
    }
    // What a surface reflects is no more than all.
    let mut window = panel(|_| {});
    let before = window.viewer().edits.now().clone();
    window.harness.get_by_role_and_label(Role::ColorWell, "Base colour").click_accesskit();
    window.steps(5);
    assert_eq!(*window.viewer().edits.now(), before);
    window.harness.get_by_role_and_label(Role::SpinButton, "G").focus();
    end(&mut window, "1.5", Some(Key::Enter));
    let base = window.viewer().edits.now().materials[0].base_color.unwrap();
    assert_eq!(base[1], 1.0);
    assert_eq!(base[0], window.viewer().opened().unwrap().loaded.scene.materials[0].base_color.x);
}

/// A triangle, and a lamp without extent.
const LAMP: &str = r#"{"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}],
"nodes": [{"mesh": 0}, {"translation": [0, 0, 2], "extensions": {"KHR_lights_punctual": {"light": 0}}}],
"extensionsUsed": ["KHR_lights_punctual"],
"extensions": {"KHR_lights_punctual": {"lights": [{"name": "bulb", "type": "point", "intensity": 10}]}},
"materials": [{"name": "paint"}],
"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0]}],
"bufferViews": [{"buffer": 0, "byteLength": 36}],
"buffers": [{"byteLength": 36, "uri": "data:application/octet-stream;base64,AACAvwAAgL8AAAAAAACAPwAAgL8AAAAAAAAAAAAAgD8AAAAA"}]}"#;

/// Whether a change restarts the estimate.
fn restarts(window: &mut Window, change: impl FnOnce(&mut Settings)) -> bool {
    let before = window.viewer().wanted.clone();
    window.viewer().edit_at(0.0, "test", change);
    let viewer = window.viewer();
    assert_ne!(viewer.wanted.settings, before.settings);
    is_asked_anew(viewer.opened().unwrap(), &before, &viewer.wanted)
}

#[test]
fn what_changes_nothing_restarts_nothing() {
    let mut window = Window::new(None);
    let [scene, file] = ["lamp.gltf", "lamp.toml"].map(|name| window.path(name));
    std::fs::write(scene, LAMP).unwrap();
    std::fs::write(&file, "scene = \"lamp.gltf\"\nsize = [16, 12]\nphotons = 200\n").unwrap();
    window.viewer().open(file.to_str().unwrap());
    window.wait_for_picture();
    window.viewer().remembered.show_inspect = false;
    window.steps(2);
    // Typed again, or of no effect.
    window.activate("Lights");
    window.harness.get_by_role_and_label(Role::ColorWell, "Colour of bulb").click_accesskit();
    window.steps(5);
    assert!(!window.shows("Largest"), "only the ratio matters");
    window.harness.get_by_role_and_label(Role::SpinButton, "R").focus();
    end(&mut window, "1.0", Some(Key::Enter));
    window.press(Modifiers::NONE, Key::Escape);
    assert!(!window.viewer().edits.can_undo());
    // Once for the camera, which is the settings' from then on; all is in focus.
    let at = fields(&window, "Focus")[0].rect().center();
    drag(&mut window, at, 20.0);
    window.steps(30);
    window.wait_for_picture();
    let (estimate, before) = (window.viewer().now.estimate, window.viewer().edits.now().clone());
    drag(&mut window, at, 20.0);
    assert!(*window.viewer().edits.now() != before && !window.viewer().wanted.moving);
    // Said otherwise.
    let scene = window.viewer().opened().unwrap().loaded.scene.clone();
    let own = &scene.materials[0];
    assert!(!restarts(&mut window, |s| s.material_mut(&scene, 0).ior = Some(own.ior)));
    assert!(!restarts(&mut window, |s| s.material_mut(&scene, 0).base_color = Some(own.base_color.to_array())));
    assert!(!restarts(&mut window, |s| s.scene_light_mut(&scene, 0).strength = Some(1.0)));
    assert!(!restarts(&mut window, |s| s.set("seed=0").unwrap()));
    assert!(!restarts(&mut window, |s| s.set("light_scale=1").unwrap()));
    assert!(!restarts(&mut window, |s| s.set("radius=automatic").unwrap()));
    window.wait_for_picture();
    assert_eq!(window.viewer().now.estimate, estimate);
    assert!(restarts(&mut window, |s| s.scene_light_mut(&scene, 0).color = Some([1.0, 0.5, 0.5])));
    assert!(!restarts(&mut window, |s| s.scene_light_mut(&scene, 0).color = Some([2.0, 1.0, 1.0])));
    assert!(restarts(&mut window, |s| s.scene_light_mut(&scene, 0).on = Some(false)));
    assert!(!restarts(&mut window, |s| s.scene_light_mut(&scene, 0).strength = Some(3.0)));
    assert!(restarts(&mut window, |s| s.material_mut(&scene, 0).ior = Some(own.ior + 0.1)));
    assert!(restarts(&mut window, |s| s.set("size=16x13").unwrap()));
    assert!(restarts(&mut window, |s| s.set("light_scale=0.5").unwrap()));
}

#[test]
fn any_material_can_be_made_to_shine() {
    let mut window = panel(|_| {});
    let scene = window.viewer().opened().unwrap().loaded.scene.clone();
    assert_eq!(scene.materials[0].emission, glam::Vec3::ZERO);
    assert!(!window.shows("Emission ×"));
    window.harness.get_by_role_and_label(Role::ColorWell, "Emission").click_accesskit();
    window.steps(5);
    window.harness.get_by_role_and_label(Role::SpinButton, "G").focus();
    end(&mut window, "12.5", Some(Key::Enter));
    window.press(Modifiers::NONE, Key::Escape);
    assert_eq!(window.viewer().edits.now().materials[0].emission, Some([0.0, 12.5, 0.0]));
    enter(&mut window, "Emission ×", 0, "2");
    assert_eq!(window.viewer().edits.now().materials[0].emission_strength, Some(2.0));
    window.wait_for_picture();
    let snapshot = window.viewer().now.snapshot.clone().unwrap();
    let green = |rgb: &[f32; 3]| rgb[1] > 5.0 * rgb[0].max(rgb[2]);
    assert!(snapshot.picture().rgb.iter().filter(|rgb| green(rgb)).count() > 32);
    for name in ["Reset emission ×", "Reset emission"] {
        window.activate(name);
    }
    assert!(window.viewer().edits.now().materials.is_empty() && !window.shows("Emission ×"));
}

#[test]
fn the_hint_of_the_hues_leaves_the_numbers_in_sight() {
    let mut window = panel(|_| {});
    window.harness.get_by_role_and_label(Role::ColorWell, "Base colour").click_accesskit();
    window.steps(5);
    let field = |window: &Window, name: &str| window.harness.get_by_role_and_label(Role::SpinButton, name).rect();
    let [red, largest] = ["R", "Largest"].map(|name| field(&window, name));
    window.harness.input_mut().events.push(Event::PointerMoved(red.left_top() + egui::vec2(40.0, -60.0)));
    window.steps(60);
    let hint = window.harness.get_by_label_contains("The largest of the three numbers stays").rect();
    assert!(!hint.intersects(red.union(largest)), "{hint} {red} {largest}");
}

#[test]
fn rows_that_cannot_matter_are_greyed_out() {
    let mut window = panel(|_| {});
    let idle = |window: &Window| {
        let rows = ["Roughness", "Metallic", "Transmission", "Specular", "Refraction"];
        rows.map(|row| fields(window, row)[0].accesskit_node().is_disabled())
    };
    // A wall of the box.
    assert_eq!(idle(&window), [true, false, false, false, true]);
    fields(&window, "Roughness")[0].scroll_to_me();
    window.steps(60);
    fields(&window, "Roughness")[0].hover();
    window.steps(60);
    assert!(window.shows("specular, metallic and transmission are 0"));
    enter(&mut window, "Specular", 0, "0.5");
    assert_eq!(window.viewer().edits.now().materials[0].specular, Some(0.5));
    assert_eq!(idle(&window), [false; 5]);
    enter(&mut window, "Metallic", 0, "1");
    assert_eq!(idle(&window), [false, false, true, true, true]);
}

#[test]
fn lengths_are_dragged_by_the_size_of_the_scene() {
    for size in [6e-4_f32, 1.0, 250e3] {
        let mut window = Window::new(None);
        let file = window.path("quad.obj");
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| {
            let side = size / 2_f32.sqrt();
            format!("v {} {} 0\n", x as f32 * side, y as f32 * side)
        });
        std::fs::write(&file, corners.concat() + "f 1 2 3 4\n").unwrap();
        window.viewer().open(file.to_str().unwrap());
        window.wait("scene", |viewer| viewer.opened().is_some());
        window.viewer().remembered.show_inspect = false;
        window.viewer().wanted.paused = true;
        // As of a glTF file, which does not say what is in focus.
        let camera = CameraSettings {
            position: Some([0.3 * size, 0.4 * size, 2.0 * size]),
            focus_distance: Some(1.0),
            ..CameraSettings::from(&window.viewer().camera().unwrap())
        };
        window.viewer().edit_at(0.0, "test", |s| s.camera = Some(camera));
        window.steps(3);
        let shown: f32 = text(&window, "Position", 0).parse().unwrap();
        assert!((shown / size - 0.3).abs() < 0.01, "{shown} of {size}");
        let camera = |window: &mut Window| window.viewer().camera().unwrap();
        let from = camera(&mut window).world_from_camera.translation.x;
        let at = fields(&window, "Position")[0].rect().center();
        drag(&mut window, at, 20.0);
        let moved = (camera(&mut window).world_from_camera.translation.x - from) / size;
        assert!((0.005..0.2).contains(&moved), "{moved} of {size}");
        let at = fields(&window, "Aperture")[0].rect().center();
        drag(&mut window, at, 20.0);
        let radius = camera(&mut window).aperture_radius / size;
        assert!((1e-5..1e-2).contains(&radius), "{radius} of {size}");
    }
}

#[test]
fn long_numbers_do_not_widen_the_panel() {
    let mut window = panel(|_| {});
    let left = |window: &mut Window| {
        window.steps(4);
        window.viewer().picture.area.unwrap().min.x
    };
    let before = left(&mut window);
    let mut camera = CameraSettings::from(&window.viewer().camera().unwrap());
    camera.position = Some([-123_456.78, 234_567.8, -345_678.9]);
    camera.focus_distance = Some(456_789.1);
    window.viewer().edit_at(10.0, "test", |s| {
        s.camera = Some(camera);
        s.light_scale = Some(123_456_790.0);
    });
    assert_eq!(left(&mut window), before);
    for row in ["Position", "Focus", "Alpha"] {
        fields(&window, row)[0].focus();
        window.steps(2);
        window.harness.input_mut().events.push(Event::Text("123456789.123456789".to_owned()));
        assert_eq!(left(&mut window), before, "{row}");
        window.press(Modifiers::NONE, Key::Escape);
    }
}
