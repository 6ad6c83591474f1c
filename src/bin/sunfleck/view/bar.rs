//! The bar above and the line below.

use eframe::egui;
use egui::Button;

use super::app::Viewer;
use super::engine::Phase;
use super::files;
use crate::progress;

/// Menus and the controls of the run.
pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    egui::MenuBar::new().ui(ui, |ui| {
        let is_open = viewer.opened().is_some();
        ui.menu_button("File", |ui| {
            if ui.button("Open …").on_hover_text("A scene: .glb, .gltf, .obj, or settings: .toml (Ctrl+O)").clicked()
            {
                files::open(viewer);
            }
            ui.add_enabled_ui(is_open, |ui| {
                if ui.button("Save picture").on_hover_text("Without stopping (Ctrl+S)").clicked() {
                    files::save(viewer);
                }
                if ui.button("Save picture as …").on_hover_text(".exr or .png (Ctrl+Shift+S)").clicked() {
                    files::save_as(viewer);
                }
                if ui.button("Save settings as …").on_hover_text("A .toml that `sunfleck render` reads").clicked() {
                    files::ask_settings(viewer);
                }
                if ui.button("Copy render command").on_hover_text("What renders this picture (Ctrl+Shift+C)").clicked()
                {
                    files::copy_command(ui, viewer);
                }
                if ui.button("Open reference …").on_hover_text("An .exr to compare with").clicked() {
                    files::ask_reference(viewer);
                }
                if ui.button("Read scene again").on_hover_text("Settings stay (Ctrl+R)").clicked() {
                    viewer.reload();
                }
                if ui.button("Close scene").on_hover_text("Back to the start page (Ctrl+W)").clicked() {
                    viewer.close_scene();
                }
            });
            if ui.button("Screenshot").on_hover_text("Of the window, into the working folder (F12)").clicked() {
                files::screenshot(ui, viewer);
            }
            if ui.button("Quit").on_hover_text("Ctrl+Q").clicked() {
                ui.ctx().send_viewport_cmd(egui::ViewportCommand::Close);
            }
        });
        ui.menu_button("Edit", |ui| {
            if ui.add_enabled(viewer.edits.can_undo(), Button::new("Undo")).on_hover_text("Ctrl+Z").clicked() {
                viewer.undo();
            }
            if ui.add_enabled(viewer.edits.can_redo(), Button::new("Redo")).on_hover_text("Ctrl+Shift+Z").clicked() {
                viewer.redo();
            }
        });
        ui.menu_button("Window", |ui| {
            let remembered = &mut viewer.remembered;
            ui.checkbox(&mut remembered.show_settings, "Settings").on_hover_text("F1");
            ui.checkbox(&mut remembered.show_inspect, "Inspect").on_hover_text("F2");
            ui.checkbox(&mut remembered.show_convergence, "Convergence").on_hover_text("F3");
            ui.separator();
            egui::widgets::global_theme_preference_buttons(ui);
        });
        if ui.button("Help").on_hover_text("Keys and mouse (?)").clicked() {
            viewer.show_help ^= true;
        }
        ui.separator();
        ui.add_enabled_ui(is_open, |ui| run(ui, viewer));
    });
}

/// Pause, step, restart, and when to stop.
fn run(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let paused = viewer.wanted.paused;
    if ui.button(if paused { "Resume" } else { "Pause" }).on_hover_text("P").clicked() {
        viewer.wanted.paused = !paused;
    }
    if ui.button("Step").on_hover_text("One iteration, then pause (N)").clicked() {
        viewer.step();
    }
    if ui.button("Restart").on_hover_text("Forget the picture, begin anew (Space)").clicked() {
        viewer.restart();
    }
}

/// What is going on.
pub fn status(ui: &mut egui::Ui, viewer: &Viewer) {
    let now = &viewer.now;
    ui.horizontal(|ui| {
        let phase = match &now.phase {
            Phase::Empty => "No scene",
            Phase::Loading => "Reading",
            Phase::Preparing => "Preparing",
            Phase::Starting => "First photons",
            Phase::Rendering => "Rendering",
            Phase::Paused => "Paused",
            Phase::Reached => "Limit reached",
            Phase::Failed(_) => "Failed",
        };
        ui.label(phase);
        if let Phase::Failed(error) = &now.phase {
            ui.colored_label(ui.visuals().error_fg_color, error);
        }
        if let Some(frame) = &now.frame {
            let [width, height] = frame.params.size;
            let n = frame.film.n_iterations;
            ui.separator();
            ui.label(format!("{n} iterations, {}", progress::seconds(frame.seconds)));
            ui.separator();
            ui.label(format!("{width}×{height}"));
            ui.separator();
            ui.label(format!("radius {}", progress::length(frame.radius)));
            if frame.is_preview {
                ui.separator();
                ui.label("preview");
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.label(&now.device).on_hover_text("What renders");
        });
    });
}
