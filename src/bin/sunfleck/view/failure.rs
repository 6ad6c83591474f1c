//! What went wrong, over the picture, and what can be done about it.

use eframe::egui;

use super::app::Viewer;
use super::engine::Phase;
use super::files;

/// Shows it in the middle of `area`, if something has.
pub fn show(ui: &egui::Ui, viewer: &mut Viewer, area: egui::Rect) {
    let Phase::Failed(error) = viewer.now.phase.clone() else { return };
    let place = egui::Area::new(egui::Id::unique("failure"))
        .pivot(egui::Align2::CENTER_CENTER)
        .fixed_pos(area.center())
        .order(egui::Order::Middle);
    place.show(ui.ctx(), |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width((area.width() - 40.0).clamp(160.0, 480.0));
            ui.label(egui::RichText::new(error).color(ui.visuals().error_fg_color));
            ui.horizontal_wrapped(|ui| {
                let again = "Opens the device anew if it was lost, and does again what failed";
                if ui.button("Try again").on_hover_text(again).clicked() {
                    viewer.retry();
                }
                let has_picture = viewer.now.snapshot.as_ref().is_some_and(|snapshot| !snapshot.is_preview);
                let save = ui.add_enabled(has_picture, egui::Button::new("Save picture …"));
                if save.on_hover_text("The last picture that was shown (Ctrl+S)").clicked() {
                    files::save(viewer);
                }
                if let Some((previous, _)) = &viewer.previous {
                    let back = ui.button("Back").on_hover_text(format!("To {}", previous.name));
                    if back.clicked() {
                        viewer.back();
                    }
                }
                if ui.button("Close scene").on_hover_text("Back to the start page (Ctrl+W)").clicked() {
                    viewer.close_scene();
                }
            });
        });
    });
}
