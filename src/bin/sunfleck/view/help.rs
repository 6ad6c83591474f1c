//! What keys and mouse do.

use eframe::egui;

use super::app::Viewer;
use super::keys::SHORTCUTS;

/// What is not a shortcut.
const HAND: &[(&str, &str)] = &[
    ("Left drag", "orbit"),
    ("Middle drag, Shift + left drag", "pan"),
    ("Wheel", "approach what is under the cursor"),
    ("Right drag", "look about"),
    ("W A S D", "fly: the keys that lie there on a US keyboard"),
    ("Q, E", "fly down, up, with W A S D or the right button held"),
    ("Shift, Ctrl", "fly four times as fast, a quarter as fast"),
    ("Click", "select the material under the cursor"),
    ("Double click", "put it in focus, and turn about it"),
    ("Ctrl + wheel", "zoom into the picture; values appear in the pixels"),
    ("Ctrl + left drag", "shift the zoomed picture"),
    ("Shift held", "show the reference"),
    ("Ctrl and +, −, 0", "larger, smaller, usual size of the interface"),
];

/// Room that two columns need, points.
const TWO_COLUMNS: f32 = 900.0;

/// Of the window, points: two columns of everything.
const USUAL: egui::Vec2 = egui::vec2(960.0, 580.0);

/// As it is printed on the key.
fn name(ui: &egui::Ui, keys: &egui::KeyboardShortcut) -> String {
    match keys.logical_key {
        egui::Key::Questionmark => "?".to_owned(),
        egui::Key::Plus => "+".to_owned(),
        egui::Key::Minus => "−".to_owned(),
        _ => ui.ctx().format_shortcut(keys),
    }
}

/// The window with the help, if it is asked for.
pub fn show(ui: &egui::Ui, viewer: &mut Viewer) {
    let mut open = viewer.show_help;
    // All of it in sight where the window has room for two columns.
    let room = ui.ctx().content_rect().shrink(48.0);
    let window = egui::Window::new("Keys and mouse").open(&mut open).collapsible(false).scroll(true);
    let window = window.default_size(room.size().min(USUAL)).max_size(room.size()).default_pos(room.left_top());
    window.show(ui.ctx(), |ui| {
        let hand = HAND.iter().map(|(hand, what)| ((*hand).to_owned(), *what));
        let keys = SHORTCUTS.iter().map(|shortcut| (name(ui, &shortcut.keys), shortcut.what));
        let lines: Vec<_> = hand.chain(keys).collect();
        let n_columns = if room.width() >= TWO_COLUMNS { 2 } else { 1 };
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 20.0;
            for (i, part) in lines.chunks(lines.len().div_ceil(n_columns)).enumerate() {
                egui::Grid::new(("keys", i)).num_columns(2).striped(true).show(ui, |ui| {
                    for (keys, what) in part {
                        ui.strong(keys);
                        ui.label(*what);
                        ui.end_row();
                    }
                });
            }
        });
    });
    viewer.show_help = open;
}
