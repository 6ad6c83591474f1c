//! TODO

use std::path::Path;

use eframe::egui;

use super::app::Viewer;

/// Over the picture at `rect`.
pub fn overlay(ui: &egui::Ui, viewer: &mut Viewer, painter: &egui::Painter, rect: egui::Rect) {
    let _ = (ui, viewer, painter, rect);
}

/// Reads a reference.
pub fn load(ui: &egui::Ui, viewer: &mut Viewer, path: &Path) {
    let _ = (ui, viewer, path);
}
