//! TODO

use eframe::egui;

use super::app::Viewer;

pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let _ = (ui, viewer);
}
