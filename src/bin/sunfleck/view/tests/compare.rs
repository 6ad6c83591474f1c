//! The picture beside a reference.

use std::any::Any;
use std::sync::{Arc, Mutex, Weak};

use eframe::egui;
use egui::{ColorImage, Event, ImageData, Key, Modifiers, PointerButton, Role, TextureId};
use egui_kittest::TestRenderer;
use egui_kittest::kittest::{NodeT, Queryable};
use sunfleck::output::Picture;
use sunfleck::output::difference::Measure;
use sunfleck::output::false_colour::NOT_FINITE;

use super::{NoPixels, Window};
use crate::view::engine::{Comparison, Painted, Reference, View};

/// Compares the picture by FLIP with itself after `change`.
fn compared(window: &mut Window, change: impl FnOnce(&mut Picture)) -> Arc<Painted> {
    let mut picture = window.viewer().now.snapshot.as_ref().unwrap().picture();
    change(&mut picture);
    let name = "changed.exr".to_owned();
    window.viewer().engine().choose_reference()(Some(Reference { name, picture }));
    window.step();
    let reference = window.viewer().now.reference.clone().unwrap();
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
    assert!(window.shows("relMSE, trimmed") && window.shows("Largest difference"));
    assert!(!window.shows("Not finite") && !window.shows("not finite"));

    let painted = compared(&mut window, |picture| picture.rgb[5] = [1.0, f32::NAN, 1.0]);
    assert_eq!(painted.mean, Some(0.0));
    assert!(
        painted.image.pixels[5].to_array() == NOT_FINITE
            && painted.value(5, 0)[0].is_nan()
            && painted.value(6, 0) == [0.0]
    );
    assert!(window.shows("Not finite") && window.shows("1 of 768") && window.shows("not finite"));

    let painted = compared(&mut window, |picture| picture.rgb.fill([f32::NAN; 3]));
    assert!(painted.mean.is_none() && painted.figures.is_none());
    assert!(window.viewer().engine().history(|history| history.against_reference.last().is_none()));

    let painted = compared(&mut window, |picture| picture.rgb.fill([0.0; 3]));
    assert!(painted.figures.is_some_and(|figures| figures.relative_mean_difference.is_none()));
    assert!(!window.shows(" %"));
}

#[test]
fn the_range_of_a_difference_can_be_given() {
    let mut window = Window::with_picture();
    compared(&mut window, |picture| picture.rgb.iter_mut().for_each(|rgb| rgb[0] += 0.27));
    assert!(window.harness.query_by_role_and_label(Role::ComboBox, "Range").is_none(), "FLIP ends at 1");
    let absolute = Comparison::Difference(Measure::Absolute);
    window.viewer().wanted.painting.comparison = absolute;
    let wait = |window: &mut Window| {
        window.wait("difference", |viewer| {
            viewer.picture.painted().is_some_and(|painted| painted.painting == viewer.wanted.painting)
        });
        window.steps(3);
    };
    wait(&mut window);
    assert!(window.shows("to 0.1, automatic") && window.shows("Legend: 0 to 0.1 "));
    let choose = |window: &mut Window, item: &str| {
        window.harness.get_by_role_and_label(Role::ComboBox, "Range").click_accesskit();
        window.steps(3);
        // Other lists of the window have the same items, closed.
        window
            .harness
            .get_all_by_label(item)
            .find(|node| node.accesskit_node().role() == Role::Button)
            .unwrap()
            .click();
        window.steps(3);
        wait(window);
    };
    let end = |window: &mut Window| window.viewer().wanted.painting.ends[Measure::Absolute as usize];
    choose(&mut window, "Given");
    assert_eq!(end(&mut window), Some(0.1));
    assert!(window.shows("to 0.1, as given"));
    for (typed, expected) in [("0,4", Some(0.4)), ("2.5e-3", Some(0.0025)), ("0", None)] {
        window.harness.get_by_role_and_label(Role::SpinButton, "Range").focus();
        window.steps(2);
        window.harness.input_mut().events.push(Event::Text(typed.to_owned()));
        window.step();
        window.press(Modifiers::NONE, Key::Enter);
        wait(&mut window);
        assert_eq!(end(&mut window), expected, "{typed}");
        if let Some(expected) = expected {
            assert!(window.shows(&format!("to {expected}, as given")), "{typed}");
        }
    }
    assert!(window.shows("to 0.1, automatic"));
    choose(&mut window, "Given");
    choose(&mut window, "Automatic");
    assert_eq!(end(&mut window), None);
    assert!(window.shows("to 0.1, automatic"));
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
            window
                .wait("preview", |viewer| viewer.picture.painted().is_some_and(|painted| painted.snapshot.is_preview));
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

/// Shows the reference, which is there, beside the picture.
fn wipe(window: &mut Window) {
    window.viewer().wanted.painting.comparison = Comparison::Wipe;
    window.wait("wipe", |viewer| {
        viewer.picture.painted().is_some_and(|painted| painted.painting == viewer.wanted.painting)
    });
    window.steps(3);
}

/// Neither a scene that is left nor a reference that is cleared stays in memory.
#[test]
fn what_is_left_is_freed() {
    fn of<T: Any + Send + Sync>(kept: &Arc<T>) -> Weak<dyn Any + Send + Sync> {
        let weak: Weak<T> = Arc::downgrade(kept);
        weak
    }
    let has_texture = |window: &Window| {
        let textures = window.harness.ctx.tex_manager();
        textures.read().allocated().any(|(_, texture)| texture.name == "reference")
    };
    for leave in [(|window| window.viewer().close_scene()) as fn(&mut Window), |window| window.viewer().open("glass")] {
        let mut window = Window::with_picture();
        let painted = compared(&mut window, |_| {});
        wipe(&mut window);
        assert!(has_texture(&window));
        let reference = of(&painted.reference.as_ref().unwrap().0);
        drop(painted);
        window.activate("Clear");
        window.wait("memory of the reference", |_| reference.strong_count() == 0);
        window.step();
        assert!(!has_texture(&window));

        drop(compared(&mut window, |_| {}));
        wipe(&mut window);
        let painted = window.viewer().picture.painted().unwrap().clone();
        let snapshot = &painted.snapshot;
        let kept = [
            of(&painted),
            of(snapshot),
            of(&snapshot.film),
            of(&snapshot.scene),
            of(&snapshot.opened),
            of(&painted.image),
        ];
        drop(painted);
        // A panel that is not drawn keeps nothing either.
        window.viewer().remembered.show_inspect = false;
        window.step();
        leave(&mut window);
        window.wait("memory of the scene", |_| kept.iter().all(|kept| kept.strong_count() == 0));
        assert!(!has_texture(&window));
    }
}

type Images = Vec<(TextureId, Arc<ColorImage>)>;

/// Notes the images of textures.
#[derive(Clone, Default)]
struct Textures(Arc<Mutex<Images>>);

impl TestRenderer for Textures {
    fn handle_delta(&mut self, delta: &mut egui::TexturesDelta) {
        let set = delta.set.drain().flat_map(|(id, deltas)| deltas.into_iter().map(move |delta| (id, delta.image)));
        self.0.lock().unwrap().extend(set.map(|(id, image)| match image {
            ImageData::Color(image) => (id, image),
        }));
        delta.free.clear();
    }

    fn render(&mut self, context: &egui::Context, output: &egui::FullOutput) -> Result<image::RgbaImage, String> {
        NoPixels.render(context, output)
    }
}

/// At 4K a copy takes longer than a frame of the window may.
#[test]
fn pictures_become_textures_without_a_copy() {
    let textures = Textures::default();
    let mut window = Window::with_renderer(Some("cornell"), textures.clone());
    window.wait_for_picture();
    drop(compared(&mut window, |_| {}));
    let id_of = |image: &Arc<ColorImage>| {
        let textures = textures.0.lock().unwrap();
        textures.iter().find(|(_, of)| Arc::ptr_eq(of, image)).map(|(id, _)| *id).expect("the image itself")
    };
    let mut ids = vec![];
    for exposure in [0.0, 1.0] {
        window.viewer().wanted.painting.comparison = Comparison::Wipe;
        window.viewer().edit_at(0.0, "test", |settings| settings.exposure = Some(exposure));
        window.wait("exposure", |viewer| {
            viewer
                .picture
                .painted()
                .is_some_and(|painted| painted.exposure == exposure && painted.difference().is_none())
        });
        window.steps(2);
        let painted = window.viewer().picture.painted().unwrap().clone();
        ids.push([painted.texture(), painted.reference_texture().unwrap()].map(id_of));
    }
    // Nor is a texture made anew.
    assert_eq!(ids[0], ids[1]);
}
