//! Keyboard shortcuts: one table, from which the help is made.

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use eframe::egui;
use egui::{Key, KeyboardShortcut, Modifiers};

use super::app::Viewer;
use super::files;

/// What a shortcut does.
type Action = fn(&mut egui::Ui, &mut Viewer);

/// A line of the help.
pub struct Shortcut {
    pub keys: KeyboardShortcut,
    pub what: &'static str,
    action: Action,
}

const fn key(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::NONE, key), what, action }
}

const fn shift(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::SHIFT, key), what, action }
}

const fn command(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND, key), what, action }
}

const fn command_shift(key: Key, what: &'static str, action: Action) -> Shortcut {
    Shortcut { keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), key), what, action }
}

/// Those with more modifiers first: a shortcut also fires when further modifiers are held.
pub const SHORTCUTS: &[Shortcut] = &[
    command_shift(Key::S, "save the picture under another name", |_, v| files::save_as(v)),
    command_shift(Key::C, "copy the command that renders this picture", |ui, v| files::copy_command(ui, v)),
    command_shift(Key::Z, "redo", |_, v| v.redo()),
    command(Key::O, "open a scene", |_, v| files::open(v)),
    command(Key::S, "save the picture", |_, v| files::save(v)),
    command(Key::R, "read the scene again; what was changed stays", |_, v| v.reload()),
    command(Key::W, "close the scene", |_, v| v.close_scene()),
    command(Key::Q, "quit", |ui, _| ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close)),
    command(Key::Z, "undo", |_, v| v.undo()),
    command(Key::Y, "redo", |_, v| v.redo()),
    shift(Key::E, "half a stop darker", |ui, v| v.expose(ui, -0.5)),
    shift(Key::V, "view before", |ui, v| v.next_view(ui, -1)),
    key(Key::V, "next view", |ui, v| v.next_view(ui, 1)),
    key(Key::G, "photons over the picture: by power, by bounce, none", |_, v| v.next_photons()),
    key(Key::E, "half a stop brighter", |ui, v| v.expose(ui, 0.5)),
    key(Key::X, "automatic exposure", |ui, v| v.edit(ui, "exposure", |s| s.exposure = None)),
    key(Key::T, "next tone curve", |ui, v| v.next_tone(ui)),
    key(Key::C, "next comparison with the reference", |ui, v| v.next_comparison(ui)),
    key(Key::Space, "restart", |_, v| v.restart()),
    key(Key::P, "pause, go on", |_, v| v.wanted.paused = !v.wanted.paused),
    key(Key::N, "one iteration, then pause", |_, v| v.step()),
    key(Key::Plus, "twice the photons an iteration", |ui, v| v.scale_photons(ui, 2.0)),
    key(Key::Minus, "half the photons an iteration", |ui, v| v.scale_photons(ui, 0.5)),
    key(Key::F, "frame all", |ui, v| v.frame_all(ui.input(|i| i.time))),
    key(Key::Num1, "picture as large as the window", |_, v| v.picture.fit()),
    key(Key::Num2, "one pixel to a pixel of the screen", |_, v| v.picture.zoom = Some(1.0)),
    key(Key::Num3, "four pixels of the screen to a pixel", |_, v| v.picture.zoom = Some(4.0)),
    key(Key::F1, "settings, shown or hidden", |_, v| v.remembered.show_settings ^= true),
    key(Key::F2, "inspection, shown or hidden", |ui, v| v.toggle_inspect(ui.content_rect().width())),
    key(Key::F3, "convergence, shown or hidden", |_, v| v.remembered.show_convergence ^= true),
    key(Key::F12, "save a picture of the window", |ui, v| files::screenshot(ui, v)),
    key(Key::Questionmark, "this help", |_, v| v.show_help ^= true),
    key(Key::Escape, "close the help, else select no material", |_, v| match v.show_help {
        true => v.show_help = false,
        false => v.selected = None,
    }),
];

/// A key that is down.
struct Held {
    /// By its name in the layout of the keyboard.
    letter: Key,
    /// With Ctrl or Alt: it does not move the camera though these are let go first.
    is_modified: bool,
}

/// What keys did in the frames before.
#[derive(Default)]
pub struct Keyboard {
    /// Keys as they lie under the fingers, by their names on a US keyboard; by their own where the system does not tell. Of a
    /// sign that needs Shift egui never sees the end, if Shift is let go first: the key has another name then.
    held: BTreeMap<Key, Held>,
    /// Whether a field, a button or the like had the keys in the frame before.
    had_focus: bool,
    /// Whether it was left by Escape then.
    escaped: bool,
}

impl Keyboard {
    /// Takes an event in; whether it is more than the repetition of a press. Ctrl and Alt make it no shortcut while `flying`.
    fn take(&mut self, event: &egui::Event, flying: bool) -> bool {
        match event {
            egui::Event::Key { key, physical_key, pressed: true, modifiers, .. } => {
                let is_modified = !flying && (modifiers.command || modifiers.alt);
                let place = self.held.entry(physical_key.unwrap_or(*key));
                let is_new = matches!(place, Entry::Vacant(_));
                place.or_insert(Held { letter: *key, is_modified });
                is_new
            }
            egui::Event::Key { key, physical_key, pressed: false, .. } => {
                self.held.remove(&physical_key.unwrap_or(*key));
                true
            }
            egui::Event::WindowFocused(false) => {
                self.held.clear();
                true
            }
            _ => true,
        }
    }

    /// Whether no key is held but these.
    pub fn holds_only(&self, keys: &[Key]) -> bool {
        self.held.keys().all(|key| keys.contains(key))
    }

    /// Whether the key at a place of a US keyboard is held, to fly.
    pub fn flies(&self, place: Key) -> bool {
        self.held.get(&place).is_some_and(|key| !key.is_modified)
    }

    /// Whether it begins a flight: not by a letter that is a shortcut by itself, as E is, which lies at D on some keyboards.
    pub fn begins_flight(&self, place: Key) -> bool {
        let is_shortcut = |letter| SHORTCUTS.iter().any(|s| s.keys.logical_key == letter && !s.keys.modifiers.command);
        self.flies(place) && !is_shortcut(self.held[&place].letter)
    }
}

/// Does what was asked for by keys, unless they are typed into a field.
pub fn handle(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let typing = ui.ctx().text_edit_focused();
    // What has the focus, a field or a menu does with Escape comes first. egui has taken the focus by now.
    let has_focus = ui.ctx().egui_wants_keyboard_input();
    let had_focus = std::mem::replace(&mut viewer.keyboard.had_focus, has_focus);
    let escaped = had_focus && !has_focus && ui.input(|i| i.key_pressed(Key::Escape));
    // In the next frame, too: there a number field of egui 0.37 still counts as just left, and would take what was typed.
    let escaped_before = std::mem::replace(&mut viewer.keyboard.escaped, escaped);
    let escapes = !had_focus && !escaped_before && !egui::Popup::is_any_open(ui.ctx());
    let flying = typing || viewer.picture.flying || ui.input(|i| i.pointer.secondary_down());
    // In a field, and with Ctrl, undo among it, a held key does again what it does.
    let repeats =
        |event: &egui::Event| typing || matches!(event, egui::Event::Key { modifiers, .. } if modifiers.command);
    ui.input_mut(|i| i.events.retain(|event| viewer.keyboard.take(event, flying) || repeats(event)));
    if escaped_before {
        let (key, modifiers) = (Key::Escape, Modifiers::NONE);
        let again = egui::Event::Key { key, physical_key: None, pressed: true, repeat: true, modifiers };
        ui.input_mut(|i| i.events.push(again));
    }
    if typing {
        return;
    }
    if ui.input(|i| viewer.picture.flies(i, &viewer.keyboard)) {
        // Ctrl is for the pace; egui itself would quit.
        let is_modified =
            |event: &egui::Event| matches!(event, egui::Event::Key { modifiers, .. } if modifiers.command);
        return ui.input_mut(|i| i.events.retain(|event| !is_modified(event)));
    }
    for shortcut in SHORTCUTS {
        // A question mark needs Shift on most keyboards.
        let keys = shortcut.keys;
        let n_presses = match keys.logical_key {
            Key::Questionmark => ui.input(|i| i.num_presses(Key::Questionmark)),
            Key::Escape if !escapes => 0,
            // Presses the button that has the focus, or is meant for what is open.
            Key::Space if has_focus || egui::Popup::is_any_open(ui.ctx()) => 0,
            key => ui.input_mut(|i| i.count_and_consume_key(keys.modifiers, key)),
        };
        // A frame may take longer than two presses.
        for _ in 0..n_presses {
            (shortcut.action)(ui, viewer);
        }
    }
}
