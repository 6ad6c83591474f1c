//! Pictures of the window, beside those that were looked at: `UPDATE_SNAPSHOTS=1 cargo test` makes them again.

use eframe::egui;
use egui::{Key, Modifiers, Rect, pos2};
use egui_kittest::SnapshotOptions;
use egui_kittest::kittest::Queryable;
use egui_kittest::wgpu::WgpuTestRenderer;

use super::Window;
use crate::view::engine::Comparison;

/// Where software Vulkan has to be; anything else may draw letters otherwise.
fn window(scene: Option<&str>) -> Option<Window> {
    if std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none() {
        println!("skipped: pictures of the window are compared where SUNFLECK_REQUIRE_GPU is set");
        return None;
    }
    let mut window = Window::with_renderer(scene, WgpuTestRenderer::new());
    match scene {
        Some(_) => window.wait_for_picture(),
        None => window.steps(3),
    }
    Some(window)
}

/// `hidden`: what differs from run to run.
fn compare(window: &mut Window, name: &str, hidden: &[Rect]) {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/src/bin/sunfleck/view/tests/snapshots");
    window.harness.remove_cursor();
    window.steps(4);
    // Times, and the device's name.
    let status = Rect::from_min_max(pos2(0.0, 694.0), pos2(1280.0, 720.0));
    let time = window.harness.query_by_label("Help").map(|help| help.rect());
    // Right of the menus: progress towards the limit, in seconds.
    let bar =
        time.map(|help| Rect::from_min_max(help.right_top() + egui::vec2(8.0, -4.0), pos2(1280.0, help.max.y + 4.0)));
    for rect in hidden.iter().copied().chain([status]).chain(bar) {
        window.harness.mask(rect);
    }
    let options = SnapshotOptions::new().output_path(folder).threshold(1.0).max_failed_pixels(60);
    window.harness.snapshot_options(name, &options);
}

#[test]
fn start_page() {
    let Some(mut window) = window(None) else { return };
    compare(&mut window, "start", &[]);
}

#[test]
fn main_window_and_help() {
    let Some(mut window) = window(Some("cornell")) else { return };
    compare(&mut window, "window", &[]);
    window.press(Modifiers::SHIFT, Key::Questionmark);
    compare(&mut window, "help", &[]);
}

#[test]
fn compared_with_a_reference() {
    let Some(mut window) = window(Some("cornell")) else { return };
    window.activate("Pin");
    window.wait("reference", |viewer| viewer.now.reference.is_some());
    window.press(Modifiers::NONE, Key::Minus);
    window.steps(30);
    window.viewer().wanted.painting.comparison = Comparison::Wipe;
    window.wait("comparison", |viewer| {
        viewer.picture.painted().is_some_and(|painted| {
            painted.painting.comparison == Comparison::Wipe && painted.snapshot.params.n_paths == 250
        })
    });
    window.wait_for_picture();
    compare(&mut window, "compare", &[]);
}

#[test]
fn convergence() {
    let Some(mut window) = window(Some("cornell")) else { return };
    window.press(Modifiers::NONE, Key::F3);
    window.steps(3);
    // Their plots are of times.
    for label in ["Photons/s", "Stages"] {
        window.click(label);
    }
    // Which films an error was estimated from depends on time.
    let error = Rect::from_min_max(pos2(8.0, 492.0), pos2(640.0, 694.0));
    let figure = Rect::from_min_max(pos2(1040.0, 472.0), pos2(1272.0, 490.0));
    compare(&mut window, "convergence", &[error, figure]);
}
