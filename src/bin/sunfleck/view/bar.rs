//! The bar above and the line below.

use std::sync::Arc;

use eframe::egui;
use egui::{Button, DragValue, gui_zoom};
use sunfleck::scene::settings::parse_count;

use super::app::Viewer;
use super::engine::{Limits, Phase, Snapshot};
use super::files;
use super::focus::{keep_keys, menu};
use crate::progress;

/// Room that the limits need, points; with less they are in a menu.
const LIMITS_WIDTH: f32 = 370.0;
/// Of the button that pauses, points.
const PAUSE_WIDTH: f32 = 64.0;
const PROGRESS_WIDTH: f32 = 150.0;

/// Menus and the controls of the run.
pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    egui::MenuBar::new().ui(ui, |ui| {
        let is_open = viewer.opened().is_some();
        menu(ui, "File", |ui| {
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
                if ui
                    .button("Read scene again")
                    .on_hover_text("What was changed in the window stays (Ctrl+R)")
                    .clicked()
                {
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
        menu(ui, "Edit", |ui| {
            if ui.add_enabled(viewer.edits.can_undo(), Button::new("Undo")).on_hover_text("Ctrl+Z").clicked() {
                viewer.undo();
            }
            if ui.add_enabled(viewer.edits.can_redo(), Button::new("Redo")).on_hover_text("Ctrl+Shift+Z").clicked() {
                viewer.redo();
            }
        });
        menu(ui, "Window", |ui| {
            let width = ui.ctx().content_rect().width();
            let mut shows_inspect = viewer.shows_inspect(width);
            ui.checkbox(&mut viewer.remembered.show_settings, "Settings").on_hover_text("F1");
            let inspect = ui.checkbox(&mut shows_inspect, "Inspect");
            if inspect.on_hover_text("F2; in a narrow window in the place of the settings").changed() {
                viewer.toggle_inspect(width);
            }
            ui.checkbox(&mut viewer.remembered.show_convergence, "Convergence").on_hover_text("F3");
            ui.separator();
            let theme = ui.ctx().options(|options| options.theme_preference);
            for (preference, name) in [
                (egui::ThemePreference::Dark, "Dark"),
                (egui::ThemePreference::Light, "Light"),
                (egui::ThemePreference::System, "As the system"),
            ] {
                if ui.radio(theme == preference, name).on_hover_text("Colours of the window").clicked() {
                    ui.ctx().set_theme(preference);
                }
            }
            ui.separator();
            let zoom = ui.ctx().zoom_factor();
            if ui.button("Larger interface").on_hover_text("Of text and panels (Ctrl and +)").clicked() {
                gui_zoom::zoom_in(ui.ctx());
            }
            if ui.button("Smaller interface").on_hover_text("Of text and panels (Ctrl and −)").clicked() {
                gui_zoom::zoom_out(ui.ctx());
            }
            let usual = ui.add_enabled(zoom != 1.0, Button::new("Usual size"));
            if usual.on_hover_text(format!("It is {:.0} % of that now (Ctrl and 0)", zoom * 100.0)).clicked() {
                ui.ctx().set_zoom_factor(1.0);
            }
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
    let (name, help) = match paused {
        true => ("Resume", "Go on (P)"),
        false => ("Pause", "After the iteration under way; nothing is lost (P)"),
    };
    // As wide either way: what is beside it stays where it is.
    let button = Button::new(name).selected(paused).min_size(egui::vec2(PAUSE_WIDTH, 0.0));
    if ui.add(button).on_hover_text(help).clicked() {
        viewer.wanted.paused = !paused;
    }
    if ui.button("Step").on_hover_text("One iteration, then pause (N)").clicked() {
        viewer.step();
    }
    if ui.button("Restart").on_hover_text("Forget the picture, begin anew (Space)").clicked() {
        viewer.restart();
    }
    ui.separator();
    if ui.available_width() >= LIMITS_WIDTH {
        ui.label("Stop at").on_hover_text("Pauses by itself at whatever comes first. No restart.");
        limits(ui, &mut viewer.wanted.limits);
    } else {
        let outside = egui::PopupCloseBehavior::CloseOnClickOutside;
        let (response, inner) = egui::containers::menu::MenuButton::new("Stop at …")
            .config(egui::containers::menu::MenuConfig::new().close_behavior(outside))
            .ui(ui, |ui| limits(ui, &mut viewer.wanted.limits));
        keep_keys(ui, &response, inner.is_some());
    }
    if ui.available_width() >= PROGRESS_WIDTH + 8.0 {
        progress_bar(ui, viewer);
    }
}

/// When to stop, each on or off. What is off keeps its number.
fn limits(ui: &mut egui::Ui, limits: &mut Limits) {
    let id = egui::Id::unique("limits that are off");
    let off =
        ui.data(|data| data.get_temp::<Numbers>(id)).unwrap_or(Numbers { iterations: 256, seconds: 60.0, noise: 1e-3 });
    let mut numbers = Numbers {
        iterations: limits.iterations.unwrap_or(off.iterations),
        seconds: limits.seconds.unwrap_or(off.seconds),
        noise: limits.noise.unwrap_or(off.noise),
    };
    let is_on = [limits.iterations.is_some(), limits.seconds.is_some(), limits.noise.is_some()];
    // Nothing half typed stops the run, and all digits are shown: what is shown is read when a field is left. What a file or
    // a flag says may lie outside the ranges.
    let whole = |text: &str| parse_count(text.trim()).ok().map(f64::from);
    let n = DragValue::new(&mut numbers.iterations).range(1..=u32::MAX).speed(1.0).suffix(" iterations");
    let n = n.update_while_editing(false).custom_parser(whole);
    let iterations = limit(ui, is_on[0], "iterations", "Stop after so many iterations since the restart", n);
    let s = DragValue::new(&mut numbers.seconds).range(0.1..=1e7).speed(0.5).suffix(" s");
    let s =
        s.clamp_existing_to_range(false).update_while_editing(false).custom_formatter(|seconds, _| seconds.to_string());
    let seconds = limit(ui, is_on[1], "seconds", "Stop after so many seconds since the restart, pauses left out", s);
    let speed = 0.01 * numbers.noise;
    let e = DragValue::new(&mut numbers.noise).range(1e-9..=1.0).speed(speed).prefix("noise ");
    let e =
        e.clamp_existing_to_range(false).update_while_editing(false).custom_formatter(|noise, _| format!("{noise:e}"));
    let help = "Stop when the estimated relMSE is as low as this. In it a single bright pixel (a firefly) counts little, \
                and the blur of the radius nothing.";
    let noise = limit(ui, is_on[2], "noise", help, e);
    limits.iterations = iterations.then_some(numbers.iterations);
    limits.seconds = seconds.then_some(numbers.seconds);
    limits.noise = noise.then_some(numbers.noise);
    ui.data_mut(|data| data.insert_temp(id, numbers));
}

/// Of the limits.
#[derive(Clone, Copy)]
struct Numbers {
    iterations: u32,
    seconds: f64,
    noise: f64,
}

/// Whether it is on. A number that is changed switches it on.
fn limit(ui: &mut egui::Ui, mut is_on: bool, name: &str, help: &str, number: DragValue<'_>) -> bool {
    let check = ui.add(egui::Checkbox::without_text(&mut is_on)).on_hover_text(help);
    check.widget_info(|| egui::WidgetInfo::selected(egui::Role::CheckBox, true, is_on, format!("Stop at {name}")));
    let number = ui.add(number).on_hover_text(help);
    is_on || number.changed()
}

/// How far it is on the way to the limit that comes first.
fn progress_bar(ui: &mut egui::Ui, viewer: &Viewer) {
    let is_of_now = |snapshot: &&Arc<Snapshot>| !snapshot.is_preview && snapshot.estimate == viewer.now.estimate;
    let Some(snapshot) = viewer.now.snapshot.as_ref().filter(is_of_now) else { return };
    let noise = viewer.engine().history(|history| history.estimated.last().map(|measured| measured.rel_mse));
    let alpha = f64::from(snapshot.params.alpha);
    let Some(left) = seconds_left(&viewer.wanted.limits, snapshot.film.n_iterations, snapshot.seconds, noise, alpha)
    else {
        return;
    };
    let done = if left > 0.0 { snapshot.seconds / (snapshot.seconds + left) } else { 1.0 };
    let text = match left > 0.0 {
        true => format!("{:.0} %, {} left", (100.0 * done).floor(), progress::seconds(left)),
        false => "done".to_owned(),
    };
    ui.add(egui::ProgressBar::new(done as f32).desired_width(PROGRESS_WIDTH).text(text))
        .on_hover_text("Towards the limit that comes first; for noise as the theory has it fall, as N^−α");
}

/// Until the first of the limits; none if there is no limit, or nothing known yet.
fn seconds_left(limits: &Limits, iterations: u32, seconds: f64, noise: Option<f64>, alpha: f64) -> Option<f64> {
    // Of the seconds so far, so many more: at one speed, and variance falling as N^-α.
    let n = f64::from(iterations);
    let by_iterations = limits.iterations.filter(|_| n > 0.0).map(|limit| f64::from(limit) / n - 1.0);
    let by_noise = limits.noise.zip(noise).map(|(limit, noise)| (noise / limit).powf(1.0 / alpha) - 1.0);
    let factors = [by_iterations, by_noise].map(|factor| factor.map(|factor| factor * seconds));
    let by_seconds = limits.seconds.map(|limit| limit - seconds);
    factors
        .into_iter()
        .chain([by_seconds])
        .flatten()
        .filter(|left| left.is_finite())
        .reduce(f64::min)
        .map(|s| s.max(0.0))
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
            Phase::Rendering if viewer.wanted.paused => "To the end of an iteration, then paused",
            Phase::Rendering => "Rendering",
            Phase::Paused => "Paused",
            Phase::Reached => "Limit reached",
            Phase::Failed(_) => "Failed",
        };
        ui.label(phase);
        if let Some(snapshot) = &now.snapshot {
            let [width, height] = snapshot.params.size;
            let n = snapshot.film.n_iterations;
            ui.separator();
            ui.label(format!("{}, {}", progress::iterations(n), progress::seconds(snapshot.seconds)));
            ui.separator();
            ui.label(format!("{width}×{height}"));
            ui.separator();
            ui.label(format!("radius {}", progress::length(snapshot.radius)));
            if snapshot.is_preview {
                ui.separator();
                ui.label("preview");
            } else if snapshot.estimate != now.estimate {
                ui.separator();
                ui.label("picture of before");
            }
        }
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            ui.add(egui::Label::new(&now.device).truncate())
                .on_hover_text(format!("What renders.\n{}", viewer.timing.text()));
        });
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_that_comes_first_says_how_long_it_takes() {
        let none = Limits::default();
        let left = |limits: Limits, noise| seconds_left(&limits, 100, 10.0, noise, 0.5);
        assert_eq!(left(none, Some(0.1)), None);
        assert_eq!(left(Limits { iterations: Some(250), ..none }, None), Some(15.0));
        assert_eq!(left(Limits { seconds: Some(12.0), ..none }, None), Some(2.0));
        assert_eq!(left(Limits { iterations: Some(250), seconds: Some(12.0), ..none }, None), Some(2.0));
        assert_eq!(left(Limits { iterations: Some(50), ..none }, None), Some(0.0));
        // Half the noise takes four times as long with α = 1/2.
        let noise = Limits { noise: Some(0.05), ..none };
        assert!(left(noise, Some(0.1)).is_some_and(|left| (left - 30.0).abs() < 1e-9));
        assert_eq!(left(noise, None), None);
        assert_eq!(seconds_left(&Limits { iterations: Some(3), ..none }, 0, 0.0, None, 0.5), None);
    }
}
