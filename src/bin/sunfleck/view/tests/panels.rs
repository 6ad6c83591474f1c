//! Panels, menus, messages, dropped files.

use std::sync::Arc;

use clap::Parser;
use eframe::egui;
use egui::{Event, Key, Modifiers, PointerButton, Role, ViewportCommand};
use egui_kittest::kittest::{NodeT, Queryable};
use sunfleck::output;
use sunfleck::output::difference::Measure;
use sunfleck::scene::Accelerator;
use sunfleck::scene::shipped::NAMES;

use super::{Window, engine};
use crate::cli::{Cli, Command};
use crate::view::app::{First, Viewer};
use crate::view::dialog::Purpose;
use crate::view::engine::{Choice, Comparison, NOTHING, Phase, View};
use crate::view::keys::SHORTCUTS;

#[test]
fn the_start_page_opens_what_is_clicked() {
    let mut window = Window::new(None);
    let file = window.path("box.toml");
    std::fs::write(&file, "scene = \"cornell\"\nsize = [16, 12]\nphotons = 200\n").unwrap();
    window.viewer().remembered.recent = vec![file.to_string_lossy().into_owned(), "/nowhere/absent.glb".into()];
    window.steps(3);
    for name in NAMES {
        assert!(window.harness.query_by_label(name).is_some(), "{name}");
    }
    window.click("Forget absent.glb");
    assert_eq!(window.viewer().remembered.recent.len(), 1);
    window.click("Open …");
    window.wait("dialog's answer", |viewer| viewer.dialog.is_none());
    assert_eq!(*window.asked.lock().unwrap(), [Purpose::Open]);
    window.press(Modifiers::COMMAND, Key::W);
    window.wait("start page", |viewer| viewer.opened().is_none());
    window.click("box.toml");
    window.wait("picture", |viewer| viewer.now.painted.as_ref().is_some_and(|painted| painted.size == [16, 12]));
    window.press(Modifiers::COMMAND, Key::W);
    window.wait("start page", |viewer| viewer.opened().is_none());
    window.steps(2);
    window.click("cornell");
    window.wait("scene", |viewer| viewer.opened().is_some_and(|opened| opened.source.name == "cornell"));
}

/// With its panels closed, so that a name means one widget.
pub fn bare() -> Window {
    let mut window = Window::with_picture();
    let remembered = &mut window.viewer().remembered;
    (remembered.show_settings, remembered.show_inspect, remembered.show_convergence) = (false, false, false);
    window.steps(2);
    window
}

/// Nobody tells the window that the source of a drag has died.
#[test]
fn a_file_hovers_until_the_pointer_is_back() {
    let mut window = Window::new(None);
    let hover = |window: &mut Window, name: &str| {
        let file = egui::HoveredFile { path: Some(name.into()), ..Default::default() };
        window.harness.input_mut().hovered_files.push(file);
    };
    let moves = |window: &mut Window| {
        window.harness.input_mut().events.push(Event::PointerMoved(egui::pos2(300.0, 20.0)));
        window.steps(2);
    };
    // On the way to where the drag begins, perhaps.
    hover(&mut window, "a.glb");
    moves(&mut window);
    window.steps(100);
    assert!(window.shows("Drop it to open a.glb"));
    moves(&mut window);
    assert!(window.shows("or drop a file here"));
    // The system still names it before another.
    hover(&mut window, "b.glb");
    window.steps(2);
    assert!(window.shows("Drop it to open b.glb"));
    window.harness.input_mut().hovered_files.clear();
    window.steps(2);
    assert!(window.shows("or drop a file here"));
    hover(&mut window, "c.glb");
    window.steps(2);
    assert!(window.shows("Drop it to open c.glb"));
}

fn choose(window: &mut Window, menu: &str, item: &str) {
    window.click(menu);
    window.click(item);
}

#[test]
fn every_item_of_the_menus() {
    let mut window = bare();
    for (item, purpose) in [
        ("Save picture as …", Purpose::SavePicture),
        ("Save settings as …", Purpose::SaveSettings),
        ("Open reference …", Purpose::Reference),
    ] {
        choose(&mut window, "File", item);
        window.wait("dialog's answer", |viewer| viewer.dialog.is_none());
        assert_eq!(window.asked.lock().unwrap().pop(), Some(purpose), "{item}");
        // What was saved first is the reference, if it is there already.
        let written = window.path(super::file_of(purpose));
        if purpose != Purpose::Reference {
            window.wait(item, move |_| written.exists());
        }
    }
    let text = std::fs::read_to_string(window.path("settings.toml")).unwrap();
    assert!(text.contains("photons = 500") && text.contains("cornell"), "{text}");
    let picture = window.path("picture.exr");
    std::fs::remove_file(&picture).unwrap();
    choose(&mut window, "File", "Save picture");
    window.wait("picture", move |_| picture.exists());
    choose(&mut window, "File", "Copy render command");
    assert!(window.copied.iter().any(|text| text.starts_with("sunfleck render cornell --set ")), "{:?}", window.copied);
    let before = window.viewer().opened().cloned().unwrap();
    choose(&mut window, "File", "Read scene again");
    assert_eq!(window.viewer().wanted.reloads, 1);
    window.wait("scene again", move |viewer| viewer.opened().is_some_and(|opened| !Arc::ptr_eq(opened, &before)));
    window.wait_for_picture();
    choose(&mut window, "File", "Screenshot");
    assert!(window.commands.iter().any(|command| matches!(command, ViewportCommand::Screenshot(_))));
    window.viewer().edit_at(0.0, "alpha", |settings| settings.alpha = Some(0.5));
    window.step();
    choose(&mut window, "Edit", "Undo");
    assert_eq!(window.viewer().edits.now().alpha, None);
    choose(&mut window, "Edit", "Redo");
    assert_eq!(window.viewer().edits.now().alpha, Some(0.5));
    for item in ["Settings", "Inspect", "Convergence"] {
        let before = window.viewer().remembered.clone();
        choose(&mut window, "Window", item);
        assert_ne!(window.viewer().remembered, before, "{item}");
        window.viewer().remembered = before;
        window.press(Modifiers::NONE, Key::Escape);
        window.steps(2);
    }
    for (item, percent) in
        [("Larger interface", 110), ("Smaller interface", 100), ("Smaller interface", 90), ("Usual size", 100)]
    {
        choose(&mut window, "Window", item);
        window.steps(2);
        let zoom = window.harness.ctx.zoom_factor() * 100.0;
        assert!((zoom - percent as f32).abs() < 0.1, "{item}: {zoom} %");
    }
    for button in ["Pause", "Resume", "Step", "Restart", "Help"] {
        let before = (window.viewer().wanted.clone(), window.viewer().show_help);
        window.click(button);
        assert_ne!((window.viewer().wanted.clone(), window.viewer().show_help), before, "{button}");
    }
    window.press(Modifiers::NONE, Key::Escape);
    choose(&mut window, "File", "Close scene");
    window.wait("start page", |viewer| viewer.opened().is_none());
    choose(&mut window, "File", "Quit");
    assert!(window.commands.contains(&ViewportCommand::Close));
}

/// As far as egui goes.
#[test]
fn the_interface_can_be_as_large_or_small_as_can_be() {
    let mut window = Window::with_picture();
    for zoom in [5.0, 0.2, 1.0] {
        window.harness.ctx.set_zoom_factor(zoom);
        window.steps(3);
        assert!(window.viewer().picture.area.is_some_and(|area| area.is_positive()), "{zoom}");
    }
}

#[test]
fn messages_stay_until_dismissed_or_read() {
    let mut window = bare();
    window.drop_file("picture.jpg".into());
    assert!(window.shows("not a scene"));
    window.press(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::C);
    assert!(window.shows("copied the command"));
    // Ten seconds.
    window.steps(600);
    assert!(window.shows("not a scene") && !window.shows("copied the command"));
    window.click("Dismiss");
    assert!(!window.shows("not a scene"));
    window.drop_file("absent.glb".into());
    window.wait_for_message("absent.glb");
}

#[test]
fn dropped_files_are_opened_or_compared_with() {
    let mut window = Window::with_picture();
    let [picture, scene] = ["picture.exr", "scene.toml"].map(|name| window.path(name));
    window.viewer().save_to(picture.clone());
    window.wait_for_message("saved ");
    window.drop_file(picture.clone());
    window.wait("reference", |viewer| viewer.now.reference.is_some());
    let saved = output::exr::read(&picture).unwrap();
    let shown = window.viewer().now.reference.as_ref().unwrap().picture.clone();
    assert_eq!((shown.size, shown.rgb), (saved.size, saved.rgb));
    std::fs::write(&scene, "scene = \"cornell\"\nsize = [16, 12]\nphotons = 200\n").unwrap();
    window.drop_file(scene);
    window.wait("picture", |viewer| viewer.now.painted.as_ref().is_some_and(|painted| painted.size == [16, 12]));
}

#[test]
fn help_has_every_shortcut() {
    let mut window = bare();
    assert!(!window.shows("Keys and mouse"));
    window.press(Modifiers::SHIFT, Key::Questionmark);
    for shortcut in SHORTCUTS {
        assert!(window.shows(shortcut.what), "{}", shortcut.what);
    }
}

#[test]
fn each_number_of_the_camera_has_a_way_back() {
    let mut window = Window::with_picture();
    let names = ["Reset position", "Reset field of view", "Reset aperture", "Reset focus"];
    assert!(names.iter().all(|name| !window.shows(name)));
    window.viewer().move_rig(0.0, &mut |rig| rig.pan(glam::vec2(0.1, 0.2)));
    window.steps(2);
    assert!(window.shows(names[0]) && names[1..].iter().all(|name| !window.shows(name)));
    window.viewer().move_rig(0.0, &mut |rig| {
        rig.set_yfov(1.0);
        rig.set_aperture_radius(0.01);
        rig.set_focus_distance(2.0);
    });
    window.steps(2);
    for name in names {
        assert!(window.viewer().edits.now().camera.is_some(), "{name}");
        window.activate(name);
        assert!(!window.shows(name), "{name}");
    }
    // Nothing is left that differs: the camera is the file's again.
    assert_eq!(window.viewer().edits.now().camera, None);
    window.press(Modifiers::COMMAND, Key::Z);
    assert!(window.shows("Reset focus"));
}

#[test]
fn a_reference_that_does_not_fit_is_told() {
    let mut window = bare();
    window.press(Modifiers::NONE, Key::C);
    assert!(window.shows("nothing to compare with"));
    let other = window.path("other.exr");
    window.viewer().save_to(other.clone());
    window.wait_for_message("saved ");
    window.viewer().edit_at(0.0, "size", |settings| settings.set("size=16x12").unwrap());
    window.wait("picture", |viewer| viewer.now.painted.as_ref().is_some_and(|painted| painted.size == [16, 12]));
    window.drop_file(other);
    window.wait_for_message("other.exr has 32×24 pixels, the picture 16×12");
    window.press(Modifiers::NONE, Key::C);
    assert_eq!(window.viewer().wanted.painting.comparison, Comparison::Off);
}

/// Each control of the settings changes them, or how the picture is shown.
#[test]
fn every_control_of_the_settings_does_something() {
    let roles = [Role::Slider, Role::SpinButton];
    let controls = |window: &Window| -> Vec<(Role, String)> {
        let is_control = |role: &Role| roles.contains(role);
        let nodes = window.harness.root().children_recursive();
        let left = |x: f32| x < 300.0;
        let node = |node: egui_kittest::Node<'_>| {
            let inner = node.accesskit_node();
            let is_one = is_control(&inner.role()) && !inner.is_disabled() && left(node.rect().center().x);
            is_one.then(|| (inner.role(), inner.label().unwrap_or_default()))
        };
        nodes.filter_map(node).collect()
    };
    let mut window = Window::with_picture();
    for group in ["Environment", "Lights"] {
        window.click(group);
    }
    window.viewer().selected = Some(0);
    window.steps(3);
    let all = controls(&window);
    assert!(all.len() > 12, "{all:?}");
    for (i, (role, label)) in all.iter().enumerate() {
        let seen = |window: &mut Window| (window.viewer().edits.now().clone(), window.viewer().wanted.painting);
        let before = seen(&mut window);
        for up in [true, false] {
            let nodes = window.harness.root().children_recursive();
            let is_one = |node: &egui_kittest::Node<'_>| {
                let inner = node.accesskit_node();
                roles.contains(&inner.role()) && !inner.is_disabled() && node.rect().center().x < 300.0
            };
            let node = nodes.filter(is_one).nth(i).unwrap();
            if up {
                node.increment_accesskit();
            } else {
                node.decrement_accesskit();
            }
            window.steps(3);
            if seen(&mut window) != before {
                break;
            }
        }
        assert_ne!(seen(&mut window), before, "{role:?} {label:?}");
        window.viewer().edit_at(1e6 * (i + 1) as f64, "test", |settings| *settings = (*before.0).clone());
        window.viewer().wanted.painting = before.1;
        window.steps(2);
    }
}

#[test]
fn how_to_search_is_a_setting_that_can_be_undone() {
    let mut window = Window::with_picture();
    let estimate = window.viewer().now.estimate;
    let accel = |window: &mut Window| window.viewer().edits.now().accel;
    window.harness.get_by_role_and_label(Role::ComboBox, "Accelerator").click_accesskit();
    window.steps(3);
    window.click("Planes (kd)");
    assert_eq!(accel(&mut window), Some(Accelerator::Kd));
    window.wait("another estimate", move |viewer| viewer.now.estimate > estimate);
    window.wait_for_picture();
    let snapshot = window.viewer().now.snapshot.clone().unwrap();
    assert_eq!(snapshot.scene.accelerator(), Accelerator::Kd);
    let command = window.viewer().command().unwrap();
    assert!(command.contains(" --set accel=kd ") && command.matches("accel").count() == 1, "{command}");
    assert!(window.viewer().settings_text("a.toml".as_ref()).unwrap().contains("accel = \"kd\"\n"));
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(accel(&mut window), None);
    window.press(Modifiers::COMMAND, Key::Y);
    assert_eq!(accel(&mut window), Some(Accelerator::Kd));
    window.activate("Reset accelerator");
    assert_eq!(accel(&mut window), None);
    // The processor has but one index.
    assert!(window.harness.get_by_role_and_label(Role::ComboBox, "Index").accesskit_node().is_disabled());
}

#[test]
fn flags_that_say_how_to_search_hold_for_every_scene() {
    let first = |line: &str| match Cli::parse_from(line.split(' ')).command {
        Some(Command::View(args)) => First::resolve(&args).unwrap(),
        other => panic!("{other:?}"),
    };
    let mut viewer = Viewer::new(engine(), Arc::new(|| {}), first("sunfleck view --accel kd"));
    assert_eq!(viewer.wanted.scene, None);
    viewer.open("glass");
    assert_eq!(viewer.wanted.scene.unwrap().set, ["accel=kd"]);
    // Over everything.
    let choice = first("sunfleck view glass --accel kd --set accel=bvh").choice.unwrap();
    assert_eq!(choice.set, ["accel=bvh", "accel=kd"]);
}

#[test]
fn every_view_and_comparison_is_painted() {
    let mut window = Window::with_picture();
    let painted = |window: &mut Window, what: &str| {
        window.wait(what, |viewer| {
            viewer
                .picture
                .painted()
                .is_some_and(|painted| painted.painting == viewer.wanted.painting && !painted.lacks())
        });
        window.steps(2);
        let problem = window.viewer().picture.painted().and_then(|painted| painted.problem.clone());
        assert_eq!(problem, None, "{what}");
    };
    for view in View::ALL {
        window.viewer().wanted.painting.view = view;
        painted(&mut window, view.name());
    }
    window.viewer().wanted.painting.view = View::Picture;
    for _ in 0..2 {
        window.viewer().next_photons();
        painted(&mut window, "photons");
        assert!(window.shows(" photons stored"));
    }
    let few = Arc::clone(&window.viewer().picture.painted().unwrap().image);
    window.activate("hidden too");
    painted(&mut window, "hidden photons");
    assert!(few != window.viewer().picture.painted().unwrap().image);
    window.viewer().next_photons();
    window.activate("Pin");
    window.wait("reference", |viewer| viewer.now.reference.is_some());
    let differences = Measure::ALL.map(Comparison::Difference);
    for comparison in [Comparison::Wipe, Comparison::Flip].into_iter().chain(differences) {
        window.viewer().wanted.painting.comparison = comparison;
        painted(&mut window, "comparison");
        let picture = window.viewer().picture.painted().unwrap().clone();
        // The picture against itself.
        assert_eq!(picture.figures.map(|figures| figures.rel_mse), Some(0.0), "{comparison:?}");
        assert!(picture.mean.is_none_or(|mean| mean == 0.0), "{comparison:?}");
    }
    window.activate("Clear");
    window.wait("no reference", |viewer| viewer.now.reference.is_none());
}

/// Beside the box is nothing to gather, whoever chose the radius.
#[test]
fn where_nothing_is_gathered_no_radius_is_shown() {
    let mut window = Window::with_picture();
    for radius in ["automatic", "0.05"] {
        window.viewer().edit_at(0.0, "test", |s| {
            s.set("camera.yfov_degrees=120").unwrap();
            s.set(&format!("radius={radius}")).unwrap();
        });
        window.viewer().wanted.painting.view = View::Radius;
        window.wait("radii", |viewer| {
            viewer.picture.painted().is_some_and(|painted| {
                painted.painting.view == View::Radius && *painted.snapshot.settings == **viewer.edits.now()
            })
        });
        let painted = window.viewer().picture.painted().unwrap().clone();
        let pixel = |x: usize, y: usize| painted.image.pixels[32 * y + x].to_array();
        assert!(painted.value(0, 0) == [0.0] && pixel(0, 0) == NOTHING, "{radius}");
        assert!(painted.value(16, 12)[0] > 0.0 && pixel(16, 12) != NOTHING, "{radius}");
    }
}

#[test]
fn what_is_under_the_cursor_is_told_and_selected() {
    let mut window = Window::with_picture();
    let middle = window.harness.get_by_role_and_label(Role::Image, "Picture").rect().center();
    window.harness.input_mut().events.push(Event::PointerMoved(middle));
    window.steps(3);
    let hovered = window.viewer().picture.hovered;
    assert!(hovered.is_some_and(|[x, y]| x.abs_diff(16) <= 1 && y.abs_diff(12) <= 1), "{hovered:?}");
    let [x, y] = hovered.unwrap();
    assert!(window.shows(&format!("{x}, {y}")));
    for pressed in [true, false] {
        let button = PointerButton::Primary;
        let event = Event::PointerButton { pos: middle, button, pressed, modifiers: Modifiers::NONE };
        window.harness.input_mut().events.push(event);
        window.step();
    }
    window.wait("selection", |viewer| viewer.selected.is_some());
    window.steps(2);
    let selected = window.viewer().selected.unwrap();
    let name = window.viewer().opened().unwrap().loaded.scene.materials[selected].name.clone();
    assert!(window.shows(&format!("Selected material: {name}")) && !window.shows("object in the picture"));
}

#[test]
fn convergence_is_plotted() {
    let mut window = Window::with_picture();
    window.press(Modifiers::NONE, Key::F3);
    window.steps(3);
    window.wait_for_message("relMSE");
    for label in ["Seconds", "Iterations"] {
        window.click(label);
    }
    for label in ["Error", "Radius", "Photons/s", "Stages"] {
        let boxes = |window: &Window| window.harness.query_all_by_role_and_label(Role::CheckBox, label).count();
        assert_eq!(boxes(&window), 1, "{label}");
    }
    let n_hidden = |window: &mut Window| window.viewer().convergence.hidden.len();
    window.click("gather");
    assert_eq!(n_hidden(&mut window), 1);
    window.click("gather");
    assert_eq!(n_hidden(&mut window), 0);
}

/// A scene may have thousands of materials.
#[test]
fn the_list_of_materials_makes_what_is_in_sight() {
    let mut window = Window::new(None);
    let n = 300;
    let paints = || (0..n).map(|i| format!("paint{i:03}"));
    let faces = paints().map(|name| format!("usemtl {name}\nf 1 2 3\n")).collect::<String>();
    let file = window.path("many.obj");
    std::fs::write(&file, format!("mtllib many.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\n{faces}")).unwrap();
    let materials = paints().map(|name| format!("newmtl {name}\nKd 0.5 0.5 0.5\n")).collect::<String>();
    std::fs::write(window.path("many.mtl"), materials).unwrap();
    let set = ["size=16x12", "photons=100"].map(str::to_owned).to_vec();
    window.viewer().open_with(file.to_string_lossy(), set);
    window.wait("scene", |viewer| viewer.opened().is_some_and(|opened| opened.loaded.scene.materials.len() >= n));
    window.steps(3);
    window.harness.get_by_role_and_label(Role::ComboBox, "Material").click_accesskit();
    window.steps(5);
    let listed = window.harness.query_all_by_label_contains("paint").count();
    assert!((5..40).contains(&listed), "{listed}");
    let first = window.harness.get_by_label("paint003").rect();
    let delta = egui::vec2(0.0, -1e6);
    for event in [
        Event::PointerMoved(first.center()),
        Event::MouseWheel {
            unit: egui::MouseWheelUnit::Point,
            delta,
            source: egui::MouseWheelSource::Unknown,
            phase: egui::TouchPhase::Move,
            modifiers: Modifiers::NONE,
        },
    ] {
        window.harness.input_mut().events.push(event);
        window.step();
    }
    window.steps(30);
    window.click("paint299");
    let chosen = window.viewer().selected.unwrap();
    assert_eq!(window.viewer().opened().unwrap().loaded.scene.materials[chosen].name, "paint299");
}

/// However far the wheel is turned.
#[test]
fn plots_can_be_zoomed_out_for_ever() {
    let mut window = Window::with_picture();
    window.press(Modifiers::NONE, Key::F3);
    window.steps(3);
    let title = window.harness.get_by_label("Error, relMSE").rect();
    window.harness.input_mut().events.push(Event::PointerMoved(title.left_bottom() + egui::vec2(100.0, 60.0)));
    window.steps(2);
    for _ in 0..60 {
        window.harness.input_mut().events.push(Event::Zoom(0.5));
        window.step();
    }
    assert!(window.shows("Error, relMSE"));
}

/// A screen reader finds every control.
#[test]
fn every_control_has_a_name() {
    let mut window = Window::new(None);
    window.steps(3);
    assert_eq!(window.harness.unnamed_widgets(), [""; 0]);
    let mut window = Window::with_picture();
    window.viewer().remembered.show_convergence = true;
    window.viewer().selected = Some(0);
    for group in ["Environment", "Lights"] {
        window.click(group);
    }
    window.steps(3);
    assert_eq!(window.harness.unnamed_widgets(), [""; 0]);
}

/// However long the render thread takes: here it is in the middle of a stage of several seconds.
#[test]
fn a_scene_that_is_left_is_gone_at_once() {
    let mut window = Window::new(None);
    let set = ["size=1400x1400", "photons=1"].map(str::to_owned).to_vec();
    window.viewer().wanted.scene = Some(Choice { name: "glass".to_owned(), set }.into());
    window.wait("first photons", |viewer| matches!(viewer.now.phase, Phase::Starting | Phase::Rendering));
    window.steps(2);
    assert!(window.viewer().opened().is_some());
    window.viewer().close_scene();
    window.steps(2);
    assert!(window.viewer().opened().is_none() && window.viewer().now.phase == Phase::Empty);
    assert!(window.harness.query_by_label("Settings").is_none());
    // Nor do its settings become those of the next one.
    window.viewer().open("cornell");
    window.step();
    let context = window.harness.ctx.clone();
    window.viewer().edit_at(context.input(|i| i.time), "seed", |settings| settings.seed = Some(7));
    window.step();
    let is_next = window.viewer().opened().is_some_and(|opened| opened.source.name == "cornell");
    assert!(is_next || window.viewer().wanted.settings.is_none());
}
