//! What has the keys: Escape, lists and menus, shortcuts beside them, what is marked and scrolled to.

use eframe::egui;
use egui::{Event, Key, Modifiers, Role};
use egui_kittest::kittest::Queryable;
use sunfleck::output::tonemap::ToneMap;
use sunfleck::scene::settings::{Count, Size};

use super::Window;
use crate::view::engine::View;

#[test]
fn escape_is_first_for_what_is_open() {
    let mut window = Window::with_picture();
    window.viewer().selected = Some(0);
    window.steps(2);
    // A list.
    window.harness.get_by_role_and_label(Role::ComboBox, "Show").click_accesskit();
    window.steps(3);
    assert!(window.shows("Albedo"));
    window.press(Modifiers::NONE, Key::Escape);
    window.steps(3);
    assert!(!window.shows("Albedo") && window.viewer().selected == Some(0));
    // A field: what was typed is forgotten.
    let before = window.viewer().edits.now().clone();
    window.harness.get_by_role_and_label(Role::SpinButton, "Seed").click();
    window.steps(3);
    for digit in ["7", "7"] {
        window.harness.input_mut().events.push(Event::Text(digit.to_owned()));
        window.step();
    }
    window.press(Modifiers::NONE, Key::Escape);
    window.steps(3);
    assert_eq!(window.viewer().edits.now().difference(&before), [""; 0]);
    assert_eq!(window.viewer().selected, Some(0));
    window.press(Modifiers::NONE, Key::Escape);
    assert_eq!(window.viewer().selected, None);
}

/// In the window of a colour it takes a number back first, then closes it, then selects nothing.
#[test]
fn escape_does_one_thing_at_a_time_to_a_colour() {
    let mut window = Window::with_picture();
    window.viewer().selected = Some(0);
    window.steps(2);
    let before = window.viewer().edits.now().clone();
    window.harness.get_by_role_and_label(Role::ColorWell, "Base colour").click_accesskit();
    window.steps(5);
    for field in ["G", "Largest"] {
        window.harness.get_by_role_and_label(Role::SpinButton, field).click();
        window.steps(3);
        window.harness.input_mut().events.push(Event::Text("0.5".to_owned()));
        window.step();
        window.press(Modifiers::NONE, Key::Escape);
        window.steps(3);
        assert!(window.shows("Largest"), "{field}");
        assert_eq!(*window.viewer().edits.now(), before, "{field}");
        window.press(Modifiers::NONE, Key::Space);
        assert_eq!(window.viewer().wanted.restarts, 0, "{field}");
    }
    window.press(Modifiers::NONE, Key::Escape);
    window.steps(3);
    assert!(!window.shows("Largest") && window.viewer().selected == Some(0));
    window.press(Modifiers::NONE, Key::Escape);
    assert_eq!(window.viewer().selected, None);
}

/// Not typed into: only what a button does with its keys is the button's.
#[test]
fn shortcuts_work_whatever_has_the_focus() {
    let mut window = Window::with_picture();
    let button = window.harness.get_by_label("Step");
    button.focus();
    window.steps(2);
    assert!(window.harness.ctx.memory(|memory| memory.focused().is_some()));
    window.press(Modifiers::NONE, Key::V);
    assert_ne!(window.viewer().wanted.painting.view, View::Picture);
    let (steps, restarts) = (window.viewer().wanted.steps, window.viewer().wanted.restarts);
    window.press(Modifiers::NONE, Key::Space);
    window.steps(2);
    assert_eq!((window.viewer().wanted.steps, window.viewer().wanted.restarts), (steps + 1, restarts));
}

/// Else Space, meant for a list or a menu, would restart.
#[test]
fn what_opens_by_keyboard_keeps_the_keys() {
    let mut window = Window::with_picture();
    let focused = |window: &Window| window.harness.ctx.memory(|memory| memory.focused());
    for label in ["Kernel", "Show"] {
        window.harness.get_by_role_and_label(Role::ComboBox, label).focus();
        window.steps(2);
        let list = focused(&window);
        assert!(list.is_some(), "{label}");
        for last in [Key::Space, Key::Escape] {
            window.press(Modifiers::NONE, Key::Space);
            window.steps(3);
            assert!(egui::Popup::is_any_open(&window.harness.ctx), "{label}");
            window.press(Modifiers::NONE, Key::ArrowDown);
            window.steps(2);
            assert_ne!(focused(&window), list, "{label}");
            window.press(Modifiers::NONE, last);
            window.steps(4);
            assert!(!egui::Popup::is_any_open(&window.harness.ctx), "{label}");
            assert_eq!(focused(&window), list, "{label} {last:?}");
        }
    }
    // A menu: its items do what they do, once.
    window.press(Modifiers::NONE, Key::T);
    window.press(Modifiers::NONE, Key::Minus);
    for (name, label) in [("Edit", "Undo"), ("Presets", "640 × 360")] {
        window.harness.get_by_role_and_label(Role::Button, name).focus();
        window.steps(2);
        let opener = focused(&window);
        window.press(Modifiers::NONE, Key::Space);
        window.steps(3);
        assert!(window.shows(label), "{name}");
        window.press(Modifiers::NONE, Key::ArrowDown);
        window.steps(2);
        window.press(Modifiers::NONE, Key::Enter);
        window.steps(4);
        assert_eq!((window.shows(label), focused(&window)), (false, opener), "{name}");
    }
    let now = window.viewer().edits.now().clone();
    let expected = (Some(ToneMap::Agx), Some(Count(500)), Some(Size([640, 360])));
    assert_eq!((now.tonemap, now.photons, now.size), expected);
    assert_eq!(window.viewer().wanted.restarts, 0);
    // Something else has got them by Tab, and may open.
    let lists = ["Kernel", "Direct light"].map(|label| {
        window.harness.get_by_role_and_label(Role::ComboBox, label).focus();
        window.steps(2);
        focused(&window)
    });
    for (key, after) in [(Key::Escape, None), (Key::Space, lists[1])] {
        window.harness.get_by_role_and_label(Role::ComboBox, "Kernel").focus();
        window.steps(2);
        window.press(Modifiers::NONE, Key::Space);
        window.steps(3);
        for _ in 0..9 {
            if focused(&window) != lists[1] {
                window.press(Modifiers::NONE, Key::Tab);
                window.steps(2);
            }
        }
        window.press(Modifiers::NONE, key);
        window.steps(4);
        assert_eq!(focused(&window), after, "{key:?}");
    }
    // They go with what was open, and do not come back with it.
    window.press(Modifiers::NONE, Key::F1);
    window.steps(4);
    window.press(Modifiers::NONE, Key::F1);
    window.steps(4);
    assert_eq!((egui::Popup::is_any_open(&window.harness.ctx), focused(&window)), (false, None));
    // By the mouse, nothing has them.
    window.press(Modifiers::NONE, Key::Escape);
    window.harness.get_by_role_and_label(Role::ComboBox, "Kernel").click();
    window.steps(4);
    window.harness.get_by_label("Constant").click();
    window.steps(4);
    assert_eq!((egui::Popup::is_any_open(&window.harness.ctx), focused(&window)), (false, None));
}

#[test]
fn a_panel_shows_what_has_the_keys() {
    let mut window = Window::with_picture();
    window.viewer().selected = Some(0);
    window.steps(2);
    let sights = [(Role::SpinButton, "Metallic"), (Role::ComboBox, "Kernel"), (Role::Button, "Pin")];
    let is_seen = |window: &Window, (role, label)| {
        let rect = window.harness.get_by_role_and_label(role, label).rect();
        rect.min.y > 30.0 && rect.max.y < 695.0
    };
    assert_eq!(sights.map(|sight| is_seen(&window, sight)), [false, true, false]);
    for (role, label) in sights {
        window.harness.get_by_role_and_label(role, label).focus();
        // The panel glides there.
        window.steps(40);
        assert!(is_seen(&window, (role, label)), "{label}");
    }
    // It can be scrolled away.
    window.harness.get_by_role_and_label(Role::ComboBox, "Kernel").focus();
    window.steps(40);
    window.harness.input_mut().events.push(Event::PointerMoved(egui::pos2(140.0, 400.0)));
    let (unit, delta) = (egui::MouseWheelUnit::Point, egui::vec2(0.0, -900.0));
    let (source, phase, modifiers) = (egui::MouseWheelSource::Wheel, egui::TouchPhase::Move, Modifiers::NONE);
    window.harness.input_mut().events.push(Event::MouseWheel { unit, delta, source, phase, modifiers });
    window.steps(40);
    assert!(!is_seen(&window, sights[1]));
}

#[test]
fn what_has_the_keys_is_marked() {
    let mut window = Window::with_picture();
    let marked = |window: &Window, rect: egui::Rect| {
        let color = window.harness.ctx.global_style().visuals.selection.stroke.color;
        window.harness.output().shapes.iter().any(|clipped| match &clipped.shape {
            egui::Shape::Rect(shape) => shape.stroke.color == color && shape.rect == rect.expand(1.0),
            _ => false,
        })
    };
    for (role, label) in [(Role::CheckBox, "Stop at seconds"), (Role::Button, "Step"), (Role::ComboBox, "Kernel")] {
        let node = window.harness.get_by_role_and_label(role, label);
        let rect = node.rect();
        assert!(!marked(&window, rect), "{label}");
        node.focus();
        window.steps(2);
        assert!(marked(&window, rect), "{label}");
    }
}
