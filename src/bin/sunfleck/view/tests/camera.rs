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
        let hit = inspect::pick(&painted.frame.scene, &painted.frame.view(), glam::vec2(film.x, film.y)).unwrap();
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
