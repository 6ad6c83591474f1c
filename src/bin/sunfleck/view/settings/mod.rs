//! The panel on the left: everything that settings can say, each with its way back to what the file says.

mod camera;
mod color;
mod estimator;
mod look;
mod material;
pub mod number;
mod scene;
pub mod widgets;

use std::sync::Arc;

use eframe::egui;
use egui::{Response, Ui};
use sunfleck::scene::settings::Settings;

use super::app::Viewer;
use super::focus::scrolling;
use widgets::{Name, row};

type Group = fn(&mut Ui, &mut Viewer, &Settings);

const GROUPS: [(&str, &str, bool, Group); 6] = [
    ("Estimator", "How the light is computed", true, estimator::show),
    ("Picture", "Its size, and how it is shown", true, look::show),
    ("Camera", "What the picture is taken with", true, camera::show),
    ("Environment", "Light from infinitely far away", false, scene::environment),
    ("Selected material", "Of the surface that was clicked on in the picture", true, material::show),
    ("Lights", "The strength of all lights, and the lamps without extent", false, scene::lights),
];

pub fn show(ui: &mut Ui, viewer: &mut Viewer) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let read = &*opened.read();
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.strong("Settings");
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
            let is_changed = **viewer.edits.now() != *read;
            let button = ui.add_enabled(is_changed, egui::Button::new("Reset all").small());
            if button
                .on_hover_text("Back to what the file says. Restarts the estimate if it changes what is rendered.")
                .clicked()
            {
                viewer.reset(ui, |s| *s = read.clone());
            }
        });
    });
    ui.separator();
    // Beside the ways back, not over them.
    let scroll = &mut ui.spacing_mut().scroll;
    scroll.floating_allocated_width = scroll.bar_width;
    scrolling(ui, |ui| {
        for (title, hint, is_open, group) in GROUPS {
            let header = egui::CollapsingHeader::new(egui::RichText::new(title).strong()).default_open(is_open);
            let response = header.show_unindented(ui, |ui| group(ui, viewer, read));
            response.header_response.on_hover_text(hint);
            ui.add_space(2.0);
        }
    });
}

/// What settings say of something now, what the file says, and what it is where nothing is said.
pub struct Said<T> {
    pub now: Option<T>,
    pub read: Option<T>,
    pub default: T,
}

impl<T: Clone + PartialEq> Said<T> {
    fn value(&self) -> T {
        self.now.as_ref().unwrap_or(&self.default).clone()
    }

    /// How settings say another `value`: not at all, if that does and the file does not either.
    pub fn saying(&self, value: T) -> Option<T> {
        (self.read.is_some() || value != self.default).then_some(value)
    }
}

/// A row for something that settings say: its control, and its way back.
fn setting<T: Clone + PartialEq>(
    ui: &mut Ui,
    viewer: &mut Viewer,
    name: Name,
    said: Said<T>,
    control: impl FnOnce(&mut Ui, &mut T) -> Response,
    set: impl Fn(&mut Settings, Option<T>),
) {
    let mut value = said.value();
    let mut changed = false;
    let reset = row(ui, name, said.now != said.read, |ui| {
        let response = control(ui, &mut value);
        changed = response.changed();
        response
    });
    if changed {
        let value = said.saying(value);
        viewer.edit(ui, name.name, |s| set(s, value));
    }
    if reset {
        viewer.reset(ui, |s| set(s, said.read));
    }
}

impl Viewer {
    /// Changes settings back.
    fn reset(&mut self, ui: &Ui, change: impl FnOnce(&mut Settings)) {
        self.edit_apart(ui, "reset", change);
    }

    /// The settings, for a panel to look at while it changes them.
    fn settings(&self) -> Arc<Settings> {
        Arc::clone(self.edits.now())
    }

    /// Diagonal of the scene's bounds, metres; 1 of one that has none. What lengths are dragged in proportion to.
    fn scene_size(&self) -> f32 {
        let size = self.opened().map_or(1.0, |opened| opened.bounds[0].distance(opened.bounds[1]));
        if size.is_finite() && size > 0.0 { size } else { 1.0 }
    }
}
