//! The picture beside a reference.

use std::sync::Arc;

use eframe::egui;
use egui::{Event, Key, Modifiers, PointerButton, Role};
use egui_kittest::kittest::{NodeT, Queryable};
use sunfleck::output::Picture;
use sunfleck::output::false_colour::NOT_FINITE;

use super::Window;
use crate::view::engine::{Comparison, Painted, Reference, View};

/// Compares the picture by FLIP with itself after `change`.
fn compared(window: &mut Window, change: impl FnOnce(&mut Picture)) -> Arc<Painted> {
    let mut picture = window.viewer().now.frame.as_ref().unwrap().picture();
    change(&mut picture);
    let reference = Arc::new(Reference { name: "changed.exr".into(), picture });
    window.viewer().engine().set_reference(Some(Arc::clone(&reference)));
    window.viewer().wanted.painting.comparison = Comparison::Flip;
    window.wait("comparison", |viewer| {
        viewer.picture.painted().is_some_and(|painted| {
            painted.painting == viewer.wanted.painting
                && painted.reference.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, &reference))
        })
    });
    window.steps(2);
    window.viewer().picture.painted().unwrap().clone()
}

#[test]
fn what_is_not_finite_is_left_out_and_told() {
    let mut window = Window::with_picture();
    let painted = compared(&mut window, |_| {});
    assert_eq!(painted.mean, Some(0.0));
    assert!(window.shows("relMSE, trimmed") && window.shows("Largest difference") && !window.shows("Not finite"));

    let painted = compared(&mut window, |picture| picture.rgb[5] = [1.0, f32::NAN, 1.0]);
    assert_eq!(painted.mean, Some(0.0));
    assert!(painted.rgba[20..24] == NOT_FINITE && painted.value(5, 0)[0].is_nan() && painted.value(6, 0) == [0.0]);
    assert!(window.shows("Not finite") && window.shows("1 of 768"));

    let painted = compared(&mut window, |picture| picture.rgb.fill([f32::NAN; 3]));
    assert!(painted.mean.is_none() && painted.figures.is_none());
    assert!(window.viewer().engine().history(|history| history.against_reference.last().is_none()));

    let painted = compared(&mut window, |picture| picture.rgb.fill([0.0; 3]));
    assert!(painted.figures.is_some_and(|figures| figures.relative_mean_difference.is_none()));
    assert!(!window.shows(" %"));
}

/// Only the left button is for the line of the wipe.
#[test]
fn the_camera_turns_on_the_line_as_beside_it() {
    let mut window = Window::with_picture();
    compared(&mut window, |_| {});
    window.viewer().wanted.painting.comparison = Comparison::Wipe;
    window.wait("wipe", |viewer| {
        viewer.picture.painted().is_some_and(|painted| painted.painting.comparison == Comparison::Wipe)
    });
    window.steps(3);
    let line = |window: &Window| window.harness.get_by_role_and_label(Role::Slider, "Wipe").rect().center();
    for button in [PointerButton::Middle, PointerButton::Secondary, PointerButton::Primary] {
        let (before, at) = (window.viewer().edits.now().camera.clone(), line(&window));
        let press = |pos, pressed| Event::PointerButton { pos, button, pressed, modifiers: Modifiers::NONE };
        window.harness.input_mut().events.extend([Event::PointerMoved(at), press(at, true)]);
        window.steps(2);
        for i in 1..=10 {
            window.harness.input_mut().events.push(Event::PointerMoved(at + egui::vec2(6.0, 2.0) * i as f32));
            window.step();
        }
        if button != PointerButton::Primary {
            window.wait("preview", |viewer| viewer.picture.painted().is_some_and(|painted| painted.frame.is_preview));
        }
        let way = window.viewer().edits.now().camera.clone();
        window.step();
        let to = at + egui::vec2(66.0, 22.0);
        window.harness.input_mut().events.push(Event::PointerMoved(to));
        window.step();
        assert_eq!(window.viewer().edits.now().camera == way, button == PointerButton::Primary, "{button:?}");
        window.harness.input_mut().events.push(press(to, false));
        window.steps(3);
        let is_line = button == PointerButton::Primary;
        assert_eq!(window.viewer().edits.now().camera == before, is_line, "{button:?}");
        // Previews have none.
        window.steps(30);
        window.wait_for_picture();
        window.steps(3);
        assert!((line(&window).x - at.x - if is_line { 66.0 } else { 0.0 }).abs() < 1.0, "{button:?}");
    }
}

#[test]
fn what_is_shown_is_named() {
    let mut window = Window::with_picture();
    let shown = |window: &Window| {
        let node = window.harness.get_by_role_and_label(Role::ComboBox, "Show");
        (node.value().unwrap_or_default(), node.accesskit_node().is_disabled())
    };
    window.viewer().wanted.painting.view = View::Albedo;
    compared(&mut window, |_| {});
    assert_eq!(shown(&window), ("FLIP".to_owned(), true));
    window.press(Modifiers::NONE, Key::V);
    assert!(window.shows("A difference is shown in the place of a view"));
    assert_eq!(window.viewer().wanted.painting.view, View::Albedo);
    // Beside the reference the view is seen, and alone.
    for comparison in [Comparison::Wipe, Comparison::Off] {
        window.viewer().wanted.painting.comparison = comparison;
        window.wait("view", |viewer| viewer.picture.painted().is_some_and(|p| p.painting.comparison == comparison));
        window.steps(2);
        assert_eq!(shown(&window), ("Albedo".to_owned(), false));
    }
}
