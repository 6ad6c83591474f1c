//! What people do without thinking: keys let go in any order, reading a file again, going back.

use std::path::Path;
use std::time::Duration;

use clap::Parser;
use eframe::egui;
use egui::{Event, Key, Modifiers, Role, ViewportCommand};
use egui_kittest::kittest::{NodeT, Queryable};
use sunfleck::output::difference::Measure;
use sunfleck::scene::settings::{Count, EnvironmentSettings, Settings};

use super::{NoPixels, Window};
use crate::cli::{Cli, Command};
use crate::job::Job;
use crate::view::app::Place;
use crate::view::dialog::Answer;
use crate::view::engine::{Comparison, Limits, Phase, View, is_same};

/// A press or a release of a key that has another name with Shift.
fn key(key: Key, physical: Key, pressed: bool, modifiers: Modifiers) -> [Event; 2] {
    let event = Event::Key { key, physical_key: Some(physical), pressed, repeat: false, modifiers };
    [Event::ModifiersChanged(modifiers), event]
}

/// A scene in a file of its own.
pub fn with_file(text: &str) -> (Window, std::path::PathBuf) {
    let mut window = Window::new(None);
    let file = window.path("own.toml");
    std::fs::write(&file, text).unwrap();
    window.viewer().open(file.to_string_lossy());
    window.wait_for_picture();
    (window, file)
}

pub const OWN: &str = "scene = \"cornell\"\nsize = [16, 12]\nphotons = 200\nalpha = 0.6\n";

/// A warning that has passed does not come back with every change.
#[test]
fn what_was_said_of_a_scene_is_not_said_again() {
    let mut window = Window::new(None);
    let file = window.path("dark.obj");
    std::fs::write(&file, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    window.viewer().open(file.to_string_lossy());
    window.wait_for_message("a soft sky is added");
    window.wait_for_picture();
    window.steps(400);
    assert!(!window.shows("a soft sky is added"));
    let estimate = window.viewer().picture.painted().unwrap().snapshot.estimate;
    window.viewer().edit_at(0.0, "light scale", |s| s.light_scale = Some(2.0));
    window.wait("picture", move |viewer| {
        assert!(viewer.messages.texts().all(|text| !text.contains("sky")));
        viewer.picture.painted().is_some_and(|painted| painted.snapshot.estimate > estimate)
    });
}

/// A room that is closed on all sides, its lamp inside, and no camera.
#[test]
fn all_of_a_closed_room_is_seen_from_inside() {
    let mut window = Window::new(None);
    let file = window.path("room.obj");
    let corner = |i: usize| [0, 1, 2].map(|axis| if i >> axis & 1 == 1 { 1.0 } else { -1.0 });
    let lamp = [[-0.2, 0.9, -0.2], [0.2, 0.9, -0.2], [0.2, 0.9, 0.2], [-0.2, 0.9, 0.2]];
    let vertices = (0..8).map(corner).chain(lamp).map(|[x, y, z]| format!("v {x} {y} {z}\n"));
    let sides = "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n";
    let text = vertices.collect::<String>() + "usemtl wall\n" + sides + "usemtl lamp\nf 9 10 11 12\n";
    std::fs::write(&file, format!("mtllib room.mtl\n{text}")).unwrap();
    std::fs::write(window.path("room.mtl"), "newmtl wall\nKd 0.8 0.8 0.8\nnewmtl lamp\nKd 0 0 0\nKe 9 9 9\n").unwrap();
    window.viewer().open_with(file.to_string_lossy(), ["size=32x24", "photons=500"].map(str::to_owned).to_vec());
    window.wait_for_picture();
    let at = |window: &mut Window| window.viewer().rig().unwrap().camera().world_from_camera.translation;
    let opened_at = at(&mut window);
    assert!(opened_at.abs().max_element() < 1.0, "{opened_at}");
    window.viewer().move_rig(0.0, &mut |rig| rig.orbit(0.5, 0.1));
    assert_ne!(at(&mut window), opened_at);
    window.press(Modifiers::NONE, Key::F);
    assert_eq!(at(&mut window), opened_at);
}

#[test]
fn shift_may_be_let_go_first() {
    let mut window = Window::with_picture();
    for n in 1..=3 {
        window.harness.input_mut().events.extend(key(Key::Plus, Key::Equals, true, Modifiers::SHIFT));
        window.step();
        window.harness.input_mut().events.extend(key(Key::Equals, Key::Equals, false, Modifiers::NONE));
        window.step();
        assert_eq!(window.viewer().edits.now().photons, Some(Count(500 << n)), "{n} presses");
    }
    for n in 1..=3 {
        window.harness.input_mut().events.extend(key(Key::Questionmark, Key::Slash, true, Modifiers::SHIFT));
        window.step();
        window.harness.input_mut().events.extend(key(Key::Slash, Key::Slash, false, Modifiers::NONE));
        window.step();
        assert_eq!(window.viewer().show_help, n % 2 == 1, "{n} presses");
    }
}

/// Ctrl slows a flight down: none of its keys closes the scene, or the window, before Ctrl has been let go.
#[test]
fn a_slow_flight_is_no_shortcut() {
    let mut window = Window::with_picture();
    let command = Modifiers::COMMAND | Modifiers::CTRL;
    let send = |window: &mut Window, events: &[Event]| {
        window.harness.input_mut().events.extend_from_slice(events);
        window.step();
    };
    send(&mut window, &key(Key::W, Key::W, true, Modifiers::NONE));
    send(&mut window, &[Event::ModifiersChanged(command)]);
    send(&mut window, &key(Key::W, Key::W, false, command));
    send(&mut window, &key(Key::W, Key::W, true, command));
    send(&mut window, &key(Key::Q, Key::Q, true, command));
    window.steps(3);
    assert!(window.viewer().wanted.scene.is_some());
    assert!(!window.commands.contains(&ViewportCommand::Close));
    send(&mut window, &key(Key::W, Key::W, false, command));
    send(&mut window, &key(Key::Q, Key::Q, false, command));
    send(&mut window, &[Event::ModifiersChanged(Modifiers::NONE)]);
    // With the right button down Ctrl may come first.
    let at = window.viewer().picture.area.unwrap().center();
    let button = |pressed| Event::PointerButton {
        pos: at,
        button: egui::PointerButton::Secondary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    send(&mut window, &[Event::PointerMoved(at), button(true), Event::ModifiersChanged(command)]);
    window.steps(3);
    let position = |window: &mut Window| window.viewer().rig().unwrap().position();
    let before = position(&mut window);
    send(&mut window, &key(Key::W, Key::W, true, command));
    window.steps(3);
    assert!(window.viewer().wanted.scene.is_some() && position(&mut window) != before);
    send(&mut window, &key(Key::W, Key::W, false, command));
    send(&mut window, &[Event::ModifiersChanged(Modifiers::NONE), button(false)]);
    window.steps(3);
    window.press(Modifiers::COMMAND, Key::W);
    assert!(window.viewer().wanted.scene.is_none());
}

/// Rising with a letter of its own begins together with the flight.
#[test]
fn a_flight_that_begins_brightens_nothing() {
    let mut window = Window::with_picture();
    let events = [key(Key::W, Key::W, true, Modifiers::NONE), key(Key::E, Key::E, true, Modifiers::NONE)];
    window.harness.input_mut().events.extend(events.into_iter().flatten());
    window.steps(3);
    assert_eq!(window.viewer().edits.now().exposure, None);
    assert!(window.viewer().edits.now().camera.is_some());
}

#[test]
fn what_is_changed_by_hand_outlives_a_file_that_is_read_again() {
    let (mut window, file) = with_file(OWN);
    window.viewer().edit_at(0.0, "seed", |s| s.seed = Some(5));
    window.viewer().edit_at(9.0, "exposure", |s| s.exposure = Some(1.5));
    // Changed and changed back: as if it had never been.
    window.viewer().edit_at(18.0, "alpha", |s| s.alpha = Some(0.7));
    window.viewer().edit_at(27.0, "alpha", |s| s.alpha = Some(0.6));
    std::fs::write(&file, OWN.replace("0.6", "0.8").replace("200", "300")).unwrap();
    window.press(Modifiers::COMMAND, Key::R);
    window.wait("the file as it is now", |viewer| viewer.opened().is_some_and(|o| o.read().alpha == Some(0.8)));
    window.wait_for_picture();
    let now = window.viewer().edits.now().clone();
    assert_eq!((now.alpha, now.photons, now.seed, now.exposure), (Some(0.8), Some(Count(300)), Some(5), Some(1.5)));
    assert_eq!(window.viewer().now.snapshot.as_ref().unwrap().params.n_paths, 300);
    // The steps that led there can still be undone.
    for expected in [Some(0.7), Some(0.8)] {
        window.press(Modifiers::COMMAND, Key::Z);
        assert_eq!(window.viewer().edits.now().alpha, expected);
    }
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!((window.viewer().edits.now().exposure, window.viewer().edits.now().seed), (None, Some(5)));
    // Opening it anew begins anew.
    window.viewer().open(file.to_string_lossy());
    window.wait("the file alone", |viewer| viewer.edits.now().seed.is_none() && viewer.now.phase == Phase::Reached);
}

/// A flag's word is for every scene, a file's for its own.
#[test]
fn a_file_says_when_its_scene_stops() {
    let flags = Limits { seconds: Some(600.0), ..Limits::default() };
    let mut window = Window::with_limits(None, flags, NoPixels);
    let [own, bare] = ["own.toml", "bare.toml"].map(|name| window.path(name));
    let of_file = |n: u32| format!("{OWN}iterations = {n}\nseconds = 0.05\n");
    std::fs::write(&own, of_file(2)).unwrap();
    std::fs::write(&bare, OWN).unwrap();
    let open = |window: &mut Window, file: &Path, set: &[&str]| {
        let before = window.viewer().opened().cloned();
        window.viewer().open_with(file.to_string_lossy(), set.iter().map(|&pair| pair.to_owned()).collect());
        window.wait("scene", |viewer| viewer.opened().is_some() && !is_same(viewer.opened(), before.as_ref()));
        window.viewer().wanted.limits
    };
    // Also before the window has seen the file: it may be hidden.
    window.viewer().open(own.to_string_lossy());
    window.step();
    std::thread::sleep(Duration::from_millis(300));
    window.wait("limit", |viewer| viewer.now.phase == Phase::Reached);
    assert_eq!(window.viewer().wanted.limits, Limits { iterations: Some(2), ..flags });
    assert_eq!(window.viewer().now.snapshot.as_ref().unwrap().film.n_iterations, 2);
    let text = window.viewer().settings_text("a.toml".as_ref()).unwrap();
    assert!(text.contains("iterations = 2\n") && text.contains("seconds = 0.05\n"), "{text}");
    assert_eq!(open(&mut window, &bare, &[]), flags);
    // What is chosen by hand waits while a file has the word.
    window.viewer().wanted.limits.iterations = Some(7);
    assert_eq!(open(&mut window, &own, &["iterations=9"]).iterations, Some(9));
    window.viewer().wanted.limits.noise = Some(1e-6);
    assert_eq!(open(&mut window, &bare, &[]), Limits { iterations: Some(7), noise: Some(1e-6), ..flags });
    // Read again, the file has it if it says something else.
    open(&mut window, &own, &[]);
    window.viewer().wanted.limits.iterations = Some(5);
    for (says, expected) in [(2, 5), (4, 4)] {
        std::fs::write(&own, of_file(says)).unwrap();
        let before = window.viewer().opened().cloned();
        window.press(Modifiers::COMMAND, Key::R);
        window.wait("file", |viewer| !is_same(viewer.opened(), before.as_ref()));
        assert_eq!(window.viewer().wanted.limits.iterations, Some(expected));
    }
    // Less than the field goes down to.
    let mut window = Window::with_limits(None, Limits::default(), NoPixels);
    open(&mut window, &own, &[]);
    window.steps(3);
    assert_eq!(window.viewer().wanted.limits.seconds, Some(0.05));
}

#[test]
fn a_broken_file_leaves_the_picture() {
    let (mut window, file) = with_file(OWN);
    for (i, text) in [Some("scene = "), None].into_iter().enumerate() {
        match text {
            Some(text) => std::fs::write(&file, text).unwrap(),
            None => std::fs::remove_file(&file).unwrap(),
        }
        window.press(Modifiers::COMMAND, Key::R);
        window.wait("failure", |viewer| matches!(viewer.now.phase, Phase::Failed(_)));
        assert!(window.viewer().picture.painted().is_some() && window.viewer().opened().is_some());
        let name = format!("saved-{i}.exr");
        let saved = window.path(&name);
        window.viewer().save_to(saved.clone());
        window.wait_for_message(&name);
        assert_eq!(sunfleck::output::exr::read(&saved).unwrap().size, [16, 12]);
        std::fs::write(&file, OWN).unwrap();
        window.press(Modifiers::COMMAND, Key::R);
        window.wait_for_picture();
    }
}

/// What a command says, and what is reset, is against what the file says now.
#[test]
fn settings_are_saved_over_the_file_they_are_from() {
    let (mut window, file) = with_file(&format!("{OWN}exposure = 1.0\nseconds = 1000.0\niterations = 3\n"));
    let settings_of = |command: &str| {
        let Some(Command::Render(args)) = Cli::parse_from(command.split(' ')).command else { panic!("{command}") };
        let job = Job::resolve(&args).unwrap();
        assert!(job.budget.iterations.is_some() && job.budget.seconds.is_none(), "{command}");
        Settings { iterations: Some(Count(3)), seconds: Some(1000.0), ..job.source.settings }
    };
    window.viewer().edit_at(0.0, "exposure", |s| s.exposure = None);
    window.viewer().edit_at(9.0, "seed", |s| s.seed = Some(5));
    window.wait_for_picture();
    let command = |window: &mut Window| window.viewer().command().unwrap();
    let before = command(&mut window);
    assert!(before.contains("--set exposure= ") && before.contains("--set seed=5 "), "{before}");
    assert_eq!(settings_of(&before), **window.viewer().edits.now());
    let place = file.clone();
    window.viewer().pick = std::sync::Arc::new(move |_| Answer::File(place.clone()));
    crate::view::files::ask_settings(window.viewer());
    window.wait_for_message("saved ");
    let after = command(&mut window);
    assert!(!after.contains("exposure") && !after.contains("seed"), "{after}");
    assert_eq!(settings_of(&after).seed, Some(5));
    assert!(window.harness.get_by_label("Reset all").accesskit_node().is_disabled());
}

/// A file that cannot be read costs the scene before it its picture, not what was changed about it.
#[test]
fn the_way_back_from_a_broken_file_keeps_what_was_edited() {
    let (mut window, _) = with_file(OWN);
    window.viewer().edit_at(0.0, "seed", |s| s.seed = Some(5));
    window.viewer().edit_at(9.0, "alpha", |s| s.alpha = Some(0.7));
    window.viewer().open("no such scene");
    window.wait("failure", |viewer| matches!(viewer.now.phase, Phase::Failed(_)));
    window.steps(3);
    window.click("Back");
    window.wait_for_picture();
    let settings = window.viewer().now.snapshot.as_ref().unwrap().settings.clone();
    assert_eq!((settings.seed, settings.alpha), (Some(5), Some(0.7)));
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!((window.viewer().edits.now().seed, window.viewer().edits.now().alpha), (Some(5), Some(0.6)));
}

/// A command may be run in another folder.
#[test]
fn a_copied_command_names_files_from_the_root() {
    let mut window = Window::with_picture();
    let sky = || Some(EnvironmentSettings { file: Some("sky.hdr".to_owned()), ..Default::default() });
    window.viewer().edit_at(0.0, "environment", |s| s.environment = sky());
    let command = window.viewer().command().unwrap();
    let there = std::path::absolute("sky.hdr").unwrap();
    assert!(command.contains(&format!("environment.file={}", there.display())), "{command}");
    // Beside a settings file it is named from that.
    let (mut window, _) = with_file(OWN);
    window.viewer().edit_at(0.0, "environment", |s| s.environment = sky());
    assert!(window.viewer().command().unwrap().contains("environment.file=sky.hdr"));
}

/// `-o` names a place for the scene it is given with, not for one that is opened later.
#[test]
fn a_picture_is_not_saved_over_that_of_another_scene() {
    let (mut window, _) = with_file(OWN);
    let place = window.path("place.exr");
    window.viewer().set_place(place.clone());
    assert_eq!(window.viewer().place(), Some(&place));
    window.viewer().open("glass");
    assert_eq!(window.viewer().place(), None);
    // Without a scene it is for the first that is opened.
    let mut window = Window::new(None);
    window.viewer().saved_as = vec![Place { scene: None, file: None, path: place.clone() }];
    window.viewer().open("no such scene");
    window.wait("failure", |viewer| matches!(viewer.now.phase, Phase::Failed(_)));
    for (scene, expected) in [("cornell", Some(&place)), ("glass", None)] {
        window.viewer().open(scene);
        window.wait("scene", |viewer| viewer.opened().is_some_and(|opened| opened.source.name == scene));
        assert_eq!(window.viewer().place(), expected);
    }
}

#[test]
fn each_scene_keeps_the_name_of_its_picture() {
    let (mut window, file) = with_file(OWN);
    let folder = window.path("");
    window.viewer().pick = std::sync::Arc::new(move |request| Answer::File(folder.join(&request.name)));
    let save = |window: &mut Window, name: &str| {
        let path = window.path(name);
        let _ = std::fs::remove_file(&path);
        window.press(Modifiers::COMMAND, Key::S);
        window.wait(name, |_| path.exists());
        window.wait("dialog's answer", |viewer| viewer.dialog.is_none());
    };
    save(&mut window, "own.exr");
    window.viewer().open("glass");
    window.wait("scene", |viewer| viewer.opened().is_some_and(|opened| opened.source.name == "glass"));
    assert_eq!(window.viewer().place(), None);
    window.viewer().edit_at(0.0, "size", |s| s.set("size=16x12").unwrap());
    window.wait_for_picture();
    save(&mut window, "glass.exr");
    // Without asking, by whatever path it is opened.
    window.viewer().pick = std::sync::Arc::new(|_| panic!("asked"));
    let folder = file.parent().unwrap();
    for file in [file.clone(), folder.join(".").join("own.toml")] {
        window.viewer().open(file.to_string_lossy());
        assert_ne!(window.viewer().place(), Some(&folder.join("glass.exr")));
        let expected = folder.join("own.exr");
        window.wait("name of the picture", move |viewer| viewer.place() == Some(&expected));
        save(&mut window, "own.exr");
    }
    window.viewer().open("glass");
    window.wait("scene", |viewer| viewer.opened().is_some_and(|opened| opened.source.name == "glass"));
    assert_eq!(window.viewer().place(), Some(&folder.join("glass.exr")));
}

#[test]
fn how_the_picture_is_shown_can_be_undone_and_is_told() {
    let mut window = Window::with_picture();
    let estimate = window.viewer().now.estimate;
    window.press(Modifiers::NONE, Key::T);
    window.press(Modifiers::SHIFT, Key::E);
    window.press(Modifiers::NONE, Key::X);
    window.viewer().edit_at(99.0, "exposure", |s| s.exposure = Some(1.25));
    window.step();
    let command = window.viewer().command().unwrap();
    assert!(command.contains(" --set exposure=1.25 ") && command.contains(" --set tonemap=agx "), "{command}");
    let text = window.viewer().settings_text("a.toml".as_ref()).unwrap();
    assert!(text.contains("exposure = 1.25\n") && text.contains("tonemap = \"agx\"\n"), "{text}");
    window.wait("shown", |viewer| viewer.picture.painted().is_some_and(|painted| painted.exposure == 1.25));
    while window.viewer().edits.can_undo() {
        window.press(Modifiers::COMMAND, Key::Z);
    }
    window.step();
    assert_eq!(window.viewer().wanted.painting.look, Default::default());
    window.press(Modifiers::NONE, Key::T);
    window.activate("Reset tone curve");
    assert_eq!(window.viewer().edits.now().tonemap, None);
    // And nothing was rendered for it.
    assert_eq!(window.viewer().now.estimate, estimate);
}

#[test]
fn the_plots_keep_their_height() {
    let mut window = Window::with_picture();
    window.viewer().remembered.show_convergence = true;
    window.steps(4);
    let height = |window: &mut Window| window.viewer().picture.area.unwrap().height();
    let before = height(&mut window);
    window.viewer().wanted.paused = true;
    for _ in 0..3 {
        window.press(Modifiers::NONE, Key::Space);
        for _ in 0..10 {
            window.step();
            assert_eq!(height(&mut window), before);
        }
    }
}

#[test]
fn a_menu_shows_the_inspection_where_there_is_room_for_one_panel() {
    let mut window = Window::with_picture();
    window.harness.set_size([480.0, 320.0].into());
    window.steps(3);
    assert!(!window.shows("Under the cursor"));
    window.click("Window");
    window.click("Inspect");
    assert!(window.shows("Under the cursor") && !window.shows("Estimator"));
}

/// Values and the inspection are those of what is seen.
#[test]
fn the_reference_has_numbers_of_its_own() {
    let mut window = Window::with_picture();
    window.activate("Pin");
    window.wait("reference", |viewer| viewer.now.reference.is_some());
    let estimate = window.viewer().now.estimate;
    window.viewer().edit_at(0.0, "light", |s| s.light_scale = Some(2.0));
    window.viewer().wanted.painting.comparison = Comparison::Wipe;
    window.wait("another estimate", |viewer| viewer.now.estimate > estimate);
    window.wait_for_picture();
    window.wait("both", |viewer| viewer.picture.painted().is_some_and(|p| p.reference.is_some()));
    let painted = window.viewer().picture.painted().unwrap().clone();
    let middle = |value: Vec<f32>| value.iter().sum::<f32>();
    let ratio = middle(painted.value(16, 20)) / middle(painted.reference_value(16, 20));
    assert!((ratio - 2.0).abs() < 1e-3, "{ratio}");
    let at = window.viewer().picture.area.unwrap().center();
    window.harness.input_mut().events.push(Event::PointerMoved(at));
    window.steps(3);
    assert!(window.shows("Reference"));
    window.viewer().wanted.painting.view = View::Stops;
    window.wait("stops", |viewer| viewer.picture.painted().is_some_and(|p| p.painting.view == View::Stops));
    let painted = window.viewer().picture.painted().unwrap().clone();
    let [a, b] = [painted.value(16, 20), painted.reference_value(16, 20)].map(|v| <[f32; 1]>::try_from(v).unwrap()[0]);
    assert!((a - b - 1.0).abs() < 1e-3, "{a} and {b} stops");
    // As does the difference, which is of both.
    window.viewer().wanted.painting.comparison = Comparison::Difference(Measure::Absolute);
    window.wait("difference", |viewer| viewer.picture.painted().is_some_and(|p| p.mean.is_some_and(|mean| mean > 0.0)));
}

#[test]
fn a_change_shows_a_preview_first_where_iterations_are_slow() {
    let mut window = Window::with_picture();
    let changes = [(Modifiers::NONE, Key::Plus), (Modifiers::COMMAND, Key::Z), (Modifiers::COMMAND, Key::Y)];
    for (modifiers, key) in changes {
        window.press(modifiers, key);
        assert!(!window.viewer().wanted.moving, "{key:?}");
    }
    window.wait_for_picture();
    window.viewer().preview_from = 0.0;
    for (modifiers, key) in changes {
        let estimate = window.viewer().now.estimate;
        window.press(modifiers, key);
        assert!(window.viewer().wanted.moving, "{key:?}");
        window.wait("preview", |viewer| {
            viewer.picture.painted().is_some_and(|p| p.snapshot.is_preview && p.snapshot.estimate > estimate)
        });
        window.wait_for_picture();
    }
    // What changes nothing, or asks for the same once more.
    for key in [Key::E, Key::Space, Key::V] {
        window.press(Modifiers::NONE, key);
        assert!(!window.viewer().wanted.moving, "{key:?}");
    }
}

#[test]
fn limits_wait_for_the_whole_number() {
    let mut window = Window::with_picture();
    let before = window.viewer().wanted.limits;
    let field = |window: &mut Window, text: &str, end: Key| {
        window.harness.get_all_by_role(Role::SpinButton).find(|node| node.rect().top() < 30.0).unwrap().click();
        window.steps(3);
        for letter in text.chars() {
            window.harness.input_mut().events.push(Event::Text(letter.to_string()));
            window.step();
        }
        window.press(Modifiers::NONE, end);
        window.steps(3);
    };
    field(&mut window, "1000", Key::Escape);
    assert_eq!(window.viewer().wanted.limits, before);
    field(&mut window, "20k", Key::Enter);
    assert_eq!(window.viewer().wanted.limits.iterations, Some(20_000));
}
