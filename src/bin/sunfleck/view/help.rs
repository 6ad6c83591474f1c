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
    ("W A S D", "fly; with W A S D or the right button held also Q, E: down, up"),
    ("Shift, Ctrl", "fly four times as fast, a quarter as fast"),
    ("Click", "select the object under the cursor"),
    ("Double click", "put it in focus, and turn about it"),
    ("Ctrl + wheel", "zoom into the picture; values appear in the pixels"),
    ("Ctrl + left drag", "shift the zoomed picture"),
    ("Shift held", "show the reference"),
];

/// The window with the help, if it is asked for.
pub fn show(ui: &egui::Ui, viewer: &mut Viewer) {
    let mut open = viewer.show_help;
    egui::Window::new("Keys and mouse").open(&mut open).collapsible(false).vscroll(true).show(ui.ctx(), |ui| {
        egui::Grid::new("keys").num_columns(2).striped(true).show(ui, |ui| {
            for (hand, what) in HAND {
                ui.strong(*hand);
                ui.label(*what);
                ui.end_row();
            }
            for shortcut in SHORTCUTS {
                ui.strong(ui.ctx().format_shortcut(&shortcut.keys));
                ui.label(shortcut.what);
                ui.end_row();
            }
        });
    });
    viewer.show_help = open;
}
