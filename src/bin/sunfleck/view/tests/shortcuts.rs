//! Every shortcut does something, and nothing else.

use eframe::egui;
use egui::{Key, Modifiers, ViewportCommand};
use sunfleck::output::display::Look;
use sunfleck::output::tonemap::ToneMap;
use sunfleck::scene::settings::Settings;

use super::{ITERATIONS, Window};
use crate::view::dialog::Purpose;
use crate::view::engine::{Choice, Phase, Wanted};
use crate::view::keys::SHORTCUTS;
use crate::view::remembered::Remembered;

/// What a shortcut may change.
#[derive(Clone, Debug, PartialEq)]
struct Seen {
    wanted: Wanted,
    settings: Settings,
    remembered: Remembered,
    zoom: Option<f32>,
    help: bool,
    selected: Option<usize>,
    asked: Vec<Purpose>,
}

impl Seen {
    fn of(window: &mut Window) -> Self {
        let asked = window.asked.lock().unwrap().clone();
        let viewer = window.viewer();
        Self {
            wanted: Wanted { moving: false, ..viewer.wanted.clone() },
            settings: viewer.edits.now().as_ref().clone(),
            remembered: viewer.remembered.clone(),
            zoom: viewer.picture.zoom,
            help: viewer.show_help,
            selected: viewer.selected,
            asked,
        }
    }
}

/// Changes what was before into what has to be after; may look at the window besides.
type Effect = fn(&mut Seen, &mut Window);

/// Before the keys are pressed, and after.
struct Case {
    keys: (Modifiers, Key),
    prepare: fn(&mut Window),
    effect: Effect,
}

const SHIFT: Modifiers = Modifiers::SHIFT;
const COMMAND: Modifiers = Modifiers::COMMAND;
const COMMAND_SHIFT: Modifiers = Modifiers::COMMAND.plus(Modifiers::SHIFT);

fn nothing(_: &mut Window) {}

fn asks(before: &mut Seen, window: &mut Window, purpose: Purpose) {
    window.wait("dialog's answer", |viewer| viewer.dialog.is_none());
    before.asked.push(purpose);
}

fn edit(before: &mut Seen, change: impl FnOnce(&mut Settings)) {
    change(&mut before.settings);
    before.wanted.settings = Some(before.settings.clone().into());
}

/// Changes how the picture is shown; what is rendered is the same.
fn shown(before: &mut Seen, change: impl FnOnce(&mut Settings)) {
    edit(before, change);
    let Settings { exposure, tonemap, .. } = before.settings;
    before.wanted.painting.look = Look { exposure, tonemap: tonemap.unwrap_or_default() };
}

fn exposure(window: &mut Window, stops: f32) {
    window.viewer().edit_at(0.0, "test", |settings| settings.exposure = Some(stops));
    window.step();
}

fn alpha(window: &mut Window, alpha: f32) {
    window.viewer().edit_at(f64::from(alpha) * 1e3, "alpha", |settings| settings.alpha = Some(alpha));
    window.step();
}

fn saved(window: &mut Window) {
    let path = window.path("picture.exr");
    window.wait("file", move |_| path.exists());
    window.steps(2);
    window.wait_for_message("saved ");
}

fn paints_otherwise(seen: &mut Seen, window: &mut Window) {
    let painting = window.viewer().wanted.painting;
    assert_ne!(seen.wanted.painting, painting);
    seen.wanted.painting = painting;
    window.wait("other painting", |viewer| {
        viewer.now.painted.as_ref().is_some_and(|painted| painted.painting == viewer.wanted.painting)
    });
}

const fn case(modifiers: Modifiers, key: Key, effect: Effect) -> Case {
    Case { keys: (modifiers, key), prepare: nothing, effect }
}

const fn after(prepare: fn(&mut Window), modifiers: Modifiers, key: Key, effect: Effect) -> Case {
    Case { keys: (modifiers, key), prepare, effect }
}

const CASES: &[Case] = &[
    case(COMMAND_SHIFT, Key::S, |seen, window| {
        asks(seen, window, Purpose::SavePicture);
        saved(window);
    }),
    case(COMMAND_SHIFT, Key::C, |_, window| {
        let expected = "sunfleck render cornell --set photons=500 --set 'size=[32, 24]' --backend cpu --iterations 3 -o picture.exr";
        assert_eq!(window.copied, [expected]);
        window.wait_for_message("copied");
    }),
    after(
        |window| {
            alpha(window, 0.5);
            window.press(COMMAND, Key::Z);
        },
        COMMAND_SHIFT,
        Key::Z,
        |seen, _| edit(seen, |settings| settings.alpha = Some(0.5)),
    ),
    after(
        |window| {
            let text = "scene = \"cornell\"\nsize = [16, 12]\nphotons = 500\n";
            std::fs::write(window.path("scene.toml"), text).unwrap();
        },
        COMMAND,
        Key::O,
        |seen, window| {
            asks(seen, window, Purpose::Open);
            let name = window.path("scene.toml").to_string_lossy().into_owned();
            seen.wanted.scene = Some(Choice { name, set: vec![] }.into());
            window.wait("other scene", |viewer| viewer.now.painted.as_ref().is_some_and(|p| p.size == [16, 12]));
            *seen = Seen { asked: seen.asked.clone(), ..Seen::of(window) };
        },
    ),
    after(
        |window| {
            let path = window.path("picture.exr");
            window.viewer().set_place(path);
        },
        COMMAND,
        Key::S,
        |_, window| saved(window),
    ),
    case(COMMAND, Key::R, |seen, window| {
        seen.wanted.reloads += 1;
        seen.wanted.reads_again = true;
        window.wait_for_picture();
    }),
    case(COMMAND, Key::W, |seen, window| {
        seen.wanted.scene = None;
        window.wait("start page", |viewer| viewer.opened().is_none());
        *seen = Seen { wanted: seen.wanted.clone(), ..Seen::of(window) };
    }),
    case(COMMAND, Key::Q, |_, window| assert!(window.commands.contains(&ViewportCommand::Close))),
    after(
        |window| {
            alpha(window, 0.5);
            alpha(window, 0.6);
        },
        COMMAND,
        Key::Z,
        |seen, _| edit(seen, |settings| settings.alpha = Some(0.5)),
    ),
    after(
        |window| {
            alpha(window, 0.5);
            window.press(COMMAND, Key::Z);
        },
        COMMAND,
        Key::Y,
        |seen, _| edit(seen, |settings| settings.alpha = Some(0.5)),
    ),
    after(
        |window| exposure(window, 1.0),
        SHIFT,
        Key::E,
        |seen, _| shown(seen, |settings| settings.exposure = Some(0.5)),
    ),
    after(
        |window| exposure(window, 1.0),
        Modifiers::NONE,
        Key::E,
        |seen, _| shown(seen, |settings| settings.exposure = Some(1.5)),
    ),
    after(
        |window| exposure(window, 1.0),
        Modifiers::NONE,
        Key::X,
        |seen, _| shown(seen, |settings| settings.exposure = None),
    ),
    case(Modifiers::NONE, Key::T, |seen, _| shown(seen, |settings| settings.tonemap = Some(ToneMap::Agx))),
    after(
        |window| assert_eq!(window.viewer().now.estimate, 1),
        Modifiers::NONE,
        Key::Space,
        |seen, window| {
            seen.wanted.restarts += 1;
            window.wait("new estimate", |viewer| {
                viewer.now.snapshot.as_ref().is_some_and(|snapshot| snapshot.estimate == 2)
            });
        },
    ),
    case(Modifiers::NONE, Key::P, |seen, _| seen.wanted.paused = true),
    case(Modifiers::NONE, Key::N, |seen, window| {
        (seen.wanted.paused, seen.wanted.steps) = (true, 1);
        window.wait("one iteration more", |viewer| {
            viewer.now.phase == Phase::Paused
                && viewer.now.snapshot.as_ref().is_some_and(|snapshot| snapshot.film.n_iterations == ITERATIONS + 1)
        });
    }),
    case(Modifiers::NONE, Key::Plus, |seen, _| edit(seen, |settings| settings.set("photons=1000").unwrap())),
    case(Modifiers::NONE, Key::Minus, |seen, _| edit(seen, |settings| settings.set("photons=250").unwrap())),
    case(Modifiers::NONE, Key::F, |seen, window| {
        assert!(seen.settings.camera.is_none());
        let camera = window.viewer().edits.now().camera.clone();
        assert!(camera.is_some());
        edit(seen, |settings| settings.camera = camera);
    }),
    after(|window| window.viewer().picture.zoom = Some(4.0), Modifiers::NONE, Key::Num1, |seen, _| seen.zoom = None),
    case(Modifiers::NONE, Key::Num2, |seen, _| seen.zoom = Some(1.0)),
    case(Modifiers::NONE, Key::F1, |seen, _| seen.remembered.show_settings = false),
    case(Modifiers::NONE, Key::F2, |seen, _| seen.remembered.show_inspect = false),
    case(Modifiers::NONE, Key::F3, |seen, _| seen.remembered.show_convergence = true),
    case(Modifiers::NONE, Key::F12, |_, window| {
        assert!(window.commands.iter().any(|command| matches!(command, ViewportCommand::Screenshot(_))));
    }),
    case(SHIFT, Key::Questionmark, |seen, window| {
        seen.help = true;
        assert!(window.shows("Keys and mouse") && SHORTCUTS.iter().all(|shortcut| window.shows(shortcut.what)));
    }),
    after(
        |window| (window.viewer().show_help, window.viewer().selected) = (true, Some(0)),
        Modifiers::NONE,
        Key::Escape,
        |seen, window| {
            seen.help = false;
            assert_eq!(Seen::of(window), *seen);
            window.press(Modifiers::NONE, Key::Escape);
            seen.selected = None;
        },
    ),
    case(Modifiers::NONE, Key::V, paints_otherwise),
    case(SHIFT, Key::V, paints_otherwise),
    case(Modifiers::NONE, Key::G, paints_otherwise),
    after(
        |window| {
            window.activate("Pin");
            window.wait("reference", |viewer| viewer.now.reference.is_some());
        },
        Modifiers::NONE,
        Key::C,
        paints_otherwise,
    ),
    case(Modifiers::NONE, Key::Num3, |seen, _| seen.zoom = Some(4.0)),
];

#[test]
fn every_shortcut_does_what_it_says() {
    for case in CASES {
        let (modifiers, key) = case.keys;
        let mut window = Window::with_picture();
        (case.prepare)(&mut window);
        window.step();
        let mut expected = Seen::of(&mut window);
        window.press(modifiers, key);
        (case.effect)(&mut expected, &mut window);
        let found = Seen::of(&mut window);
        assert_eq!(found, expected, "{modifiers:?} {key:?}");
    }
}

#[test]
fn every_shortcut_is_tested() {
    for shortcut in SHORTCUTS {
        let is_this = |case: &&Case| {
            let (modifiers, key) = case.keys;
            // A question mark needs Shift on most keyboards.
            let modifiers = if key == Key::Questionmark { Modifiers::NONE } else { modifiers };
            (modifiers, key) == (shortcut.keys.modifiers, shortcut.keys.logical_key)
        };
        assert_eq!(CASES.iter().filter(is_this).count(), 1, "{}", shortcut.what);
    }
    assert_eq!(CASES.len(), SHORTCUTS.len());
}

/// However long a frame takes, and however long a key is held.
#[test]
fn each_press_counts_once() {
    let mut window = Window::with_picture();
    exposure(&mut window, 1.0);
    let event = |pressed, repeat| egui::Event::Key {
        key: Key::E,
        physical_key: None,
        pressed,
        repeat,
        modifiers: Modifiers::NONE,
    };
    let presses = [event(true, false), event(true, true), event(false, false), event(true, false), event(true, true)];
    window.harness.input_mut().events.extend(presses);
    window.step();
    window.harness.input_mut().events.extend([event(true, true), event(false, false)]);
    window.step();
    assert_eq!(window.viewer().edits.now().exposure, Some(2.0));
}
