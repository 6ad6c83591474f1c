//! Mouse and keys on the camera.

use std::sync::Arc;

use eframe::egui;
use egui::{Event, Key, Modifiers, PointerButton, Role};
use egui_kittest::kittest::Queryable;
use sunfleck::inspect;
use sunfleck::scene::Projection;

use super::Window;
use super::panels::bare;

#[test]
fn a_drag_turns_the_camera_and_can_be_undone() {
    let mut window = bare();
    let settings = window.viewer().edits.now().clone();
    let before = window.viewer().camera().unwrap().world_from_camera;
    // To the right and down: the scene comes along, or the camera turns that way.
    for (button, modifiers, stands) in [
        (PointerButton::Primary, Modifiers::NONE, false),
        (PointerButton::Primary, Modifiers::SHIFT, false),
        (PointerButton::Middle, Modifiers::NONE, false),
        (PointerButton::Secondary, Modifiers::NONE, true),
    ] {
        let middle = window.harness.get_by_role_and_label(Role::Image, "Picture").rect().center();
        let events = &mut window.harness.input_mut().events;
        events.extend([Event::ModifiersChanged(modifiers), Event::PointerMoved(middle)]);
        window.step();
        let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers };
        window.harness.input_mut().events.push(press(middle, true));
        window.step();
        for i in 1..=10 {
            let to = middle + egui::vec2(6.0, 2.0) * i as f32;
            window.harness.input_mut().events.push(Event::PointerMoved(to));
            window.step();
        }
        let to = middle + egui::vec2(60.0, 20.0);
        let events = &mut window.harness.input_mut().events;
        events.extend([press(to, false), Event::ModifiersChanged(Modifiers::NONE)]);
        window.step();
        let now = before.inverse() * window.viewer().camera().unwrap().world_from_camera;
        let moved = if stands { -now.matrix3.z_axis } else { -now.translation };
        assert!(moved.x > 1e-3 && moved.y < -1e-3, "{button:?} {modifiers:?}: {now}");
        window.steps(30);
        window.wait_for_picture();
        window.press(Modifiers::COMMAND, Key::Z);
        assert_eq!(*window.viewer().edits.now(), settings, "{button:?} {modifiers:?}: one step");
        window.steps(90);
        window.wait_for_picture();
    }
}

/// Whatever its size in the window.
#[test]
fn the_picture_follows_the_cursor() {
    let mut window = bare();
    for zoom in [None, Some(40.0)] {
        window.viewer().picture.zoom = zoom;
        window.steps(2);
        let shown = window.viewer().picture.rect.unwrap();
        let at = shown.center() + egui::vec2(20.0, 10.0);
        // Where a point of the world is on the screen.
        let place = |window: &mut Window, point: glam::Vec3| {
            let camera = window.viewer().camera().unwrap();
            let Projection::Perspective { yfov } = camera.projection else { unreachable!("perspective") };
            let p = camera.world_from_camera.inverse().transform_point3(point);
            let heights = glam::vec2(p.x, -p.y) / (2.0 * -p.z * (0.5 * yfov).tan());
            shown.center() + egui::vec2(heights.x, heights.y) * shown.height()
        };
        let pivot = window.viewer().rig().unwrap().pivot();
        let press = |pos, pressed| Event::PointerButton {
            pos,
            button: PointerButton::Middle,
            pressed,
            modifiers: Modifiers::NONE,
        };
        window.harness.input_mut().events.extend([Event::PointerMoved(at), press(at, true)]);
        window.step();
        // It is not a drag before some points.
        let mut before = at;
        for i in 1..=10 {
            window.harness.input_mut().events.push(Event::PointerMoved(at + egui::vec2(-4.0, 2.0) * i as f32));
            window.step();
            if i == 3 {
                before = place(&mut window, pivot);
            }
        }
        window.harness.input_mut().events.push(press(at + egui::vec2(-40.0, 20.0), false));
        window.step();
        let after = place(&mut window, pivot);
        assert!((after - before - egui::vec2(-28.0, 14.0)).length() < 0.5, "{zoom:?}: {before} {after}");
        window.steps(60);
        window.wait_for_picture();
        // The wheel approaches what is under the cursor.
        window.harness.input_mut().events.push(Event::PointerMoved(at));
        window.steps(2);
        let painted = Arc::clone(window.viewer().picture.painted().unwrap());
        let film = (at - shown.min) * painted.size[1] as f32 / shown.height();
        let hit = inspect::pick(&painted.snapshot.scene, &painted.snapshot.view(), glam::vec2(film.x, film.y)).unwrap();
        let distance = |window: &mut Window| window.viewer().rig().unwrap().position().distance(hit.position);
        let from = distance(&mut window);
        let wheel = Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta: egui::vec2(0.0, 60.0),
            phase: egui::TouchPhase::Move,
            source: egui::MouseWheelSource::Unknown,
            modifiers: Modifiers::NONE,
        };
        window.harness.input_mut().events.push(wheel);
        window.steps(20);
        assert!(distance(&mut window) < 0.95 * from);
        let now = place(&mut window, hit.position);
        assert!((now - at).length() < 1.0, "{zoom:?}: {now} {at}");
        window.steps(60);
        window.wait_for_picture();
    }
}

#[test]
fn letters_fly() {
    let mut window = bare();
    for key in [Key::W, Key::A, Key::S, Key::D] {
        let before = window.viewer().edits.now().camera.clone();
        window.press(Modifiers::NONE, key);
        assert_ne!(window.viewer().edits.now().camera, before, "{key:?}");
    }
    let before = window.viewer().edits.now().camera.clone();
    for key in [Key::Q, Key::E] {
        window.press(Modifiers::NONE, key);
    }
    window.press(Modifiers::COMMAND, Key::S);
    assert_eq!(window.viewer().edits.now().camera, before);
    // All down at once, and Ctrl let go before the letter: still no more than a shortcut.
    let command = Modifiers::COMMAND | Modifiers::CTRL;
    for key in [Key::S, Key::A] {
        let event = |pressed, modifiers| Event::Key { key, physical_key: None, pressed, repeat: false, modifiers };
        let down = [Event::ModifiersChanged(command), event(true, command), Event::ModifiersChanged(Modifiers::NONE)];
        window.harness.input_mut().events.extend(down);
        window.steps(5);
        assert_eq!(window.viewer().edits.now().camera, before, "{key:?}");
        window.harness.input_mut().events.push(event(false, Modifiers::NONE));
        window.step();
        assert!(!window.viewer().picture.flying);
    }
    window.press(Modifiers::NONE, Key::A);
    assert_ne!(window.viewer().edits.now().camera, before);
}

/// Letter, and the name of its place on a US keyboard; down for some frames. How far the camera went: right, up, forward.
fn hold(window: &mut Window, keys: &[(Key, Key)], modifiers: Modifiers) -> glam::Vec3 {
    let from = window.viewer().camera().unwrap().world_from_camera;
    let event = |&(key, place): &(Key, Key), pressed| Event::Key {
        key,
        physical_key: Some(place),
        pressed,
        repeat: false,
        modifiers,
    };
    window.harness.input_mut().events.push(Event::ModifiersChanged(modifiers));
    // One after the other, as fingers do.
    for key in keys {
        window.harness.input_mut().events.push(event(key, true));
        window.steps(2);
    }
    window.steps(3);
    window.harness.input_mut().events.extend(keys.iter().map(|key| event(key, false)));
    window.harness.input_mut().events.push(Event::ModifiersChanged(Modifiers::NONE));
    window.steps(2);
    let to = window.viewer().camera().unwrap().world_from_camera;
    let [x, y, z] = from.inverse().transform_point3(to.translation.into()).to_array();
    glam::Vec3::new(x, y, -z)
}

/// What a key is called does not matter; where the system does not tell where it lies, its name does, as above.
#[test]
fn keys_fly_by_where_they_lie() {
    let mut window = bare();
    // AZERTY, Dvorak, the Turkish F.
    for (letter, place, to) in [
        (Key::Z, Key::W, glam::Vec3::Z),
        (Key::Q, Key::A, -glam::Vec3::X),
        (Key::O, Key::S, -glam::Vec3::Z),
        (Key::Comma, Key::W, glam::Vec3::Z),
        (Key::I, Key::S, -glam::Vec3::Z),
    ] {
        for modifiers in [Modifiers::NONE, Modifiers::SHIFT] {
            let moved = hold(&mut window, &[(letter, place)], modifiers);
            assert!(moved.normalize_or_zero().abs_diff_eq(to, 1e-3), "{letter:?} at {place:?}: {moved}");
        }
    }
    for (letter, place) in [(Key::W, Key::Z), (Key::A, Key::Q), (Key::W, Key::Comma), (Key::S, Key::Semicolon)] {
        assert_eq!(hold(&mut window, &[(letter, place)], Modifiers::NONE), glam::Vec3::ZERO, "{letter:?} at {place:?}");
    }
    // With Ctrl the letter counts: undo takes the flights back, and flies nowhere though Ctrl is let go first.
    let command = Modifiers::COMMAND | Modifiers::CTRL;
    let before = window.viewer().edits.now().camera.clone();
    let event =
        |pressed, modifiers| Event::Key { key: Key::Z, physical_key: Some(Key::W), pressed, repeat: false, modifiers };
    let down = [Event::ModifiersChanged(command), event(true, command), Event::ModifiersChanged(Modifiers::NONE)];
    window.harness.input_mut().events.extend(down);
    window.step();
    let undone = window.viewer().edits.now().camera.clone();
    assert_ne!(undone, before);
    window.steps(5);
    window.harness.input_mut().events.push(event(false, Modifiers::NONE));
    window.steps(2);
    assert_eq!(window.viewer().edits.now().camera, undone);
    // What is held when the window goes flies nowhere in the next.
    window.viewer().enter(None, None);
    window.harness.input_mut().events.push(event(true, Modifiers::NONE));
    window.step();
    let before = window.viewer().edits.now().camera.clone();
    assert_ne!(before, undone);
    window.viewer().enter(None, None);
    window.steps(5);
    assert_eq!(window.viewer().edits.now().camera, before);
}

/// By itself, as E has always been; not in a flight, nor with the right button held.
#[test]
fn a_shortcut_where_keys_fly_is_one_by_itself() {
    let mut window = bare();
    window.viewer().edit_at(0.0, "test", |settings| settings.exposure = Some(1.0));
    let exposure = |window: &mut Window| window.viewer().edits.now().exposure;
    // Dvorak: E lies at D, a comma at W.
    let (e, comma) = ((Key::E, Key::D), (Key::Comma, Key::W));
    assert_eq!(hold(&mut window, &[e], Modifiers::NONE), glam::Vec3::ZERO);
    assert_eq!(exposure(&mut window), Some(1.5));
    assert_eq!(hold(&mut window, &[e], Modifiers::SHIFT), glam::Vec3::ZERO);
    assert_eq!(exposure(&mut window), Some(1.0));
    let moved = hold(&mut window, &[comma, e], Modifiers::NONE);
    assert!(moved.x > 1e-3 && moved.z > moved.x, "{moved}");
    let middle = window.harness.get_by_role_and_label(Role::Image, "Picture").rect().center();
    let (button, modifiers) = (PointerButton::Secondary, Modifiers::NONE);
    let press = |pressed| Event::PointerButton { pos: middle, button, pressed, modifiers };
    window.harness.input_mut().events.extend([Event::PointerMoved(middle), press(true)]);
    window.step();
    let moved = hold(&mut window, &[e], Modifiers::NONE);
    assert!(moved.normalize_or_zero().abs_diff_eq(glam::Vec3::X, 1e-3), "{moved}");
    // A period, at E: up in the world, to which the camera leans a little.
    let moved = hold(&mut window, &[(Key::Period, Key::E)], Modifiers::NONE);
    assert!(moved.normalize_or_zero().abs_diff_eq(glam::Vec3::Y, 0.02), "{moved}");
    window.harness.input_mut().events.push(press(false));
    window.step();
    assert_eq!(exposure(&mut window), Some(1.0));
}
