//! Rows of the panel: a name, a control, and a way back.

use eframe::egui;
use egui::{Response, Ui};

use crate::view::focus::list;

/// Of the panel's width, for names.
const NAMES: f32 = 0.36;
/// For the way back, points.
const RESET: f32 = 18.0;

/// A setting's name, and what is said about it.
#[derive(Clone, Copy)]
pub struct Name {
    pub name: &'static str,
    /// What it does, its unit, and whether it restarts the estimate.
    pub hint: &'static str,
}

/// A row with a control; says whether to go back to what the file says, which is offered where it `is_changed`.
pub fn row(ui: &mut Ui, name: Name, is_changed: bool, control: impl FnOnce(&mut Ui) -> Response) -> bool {
    let mut reset = false;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let width = ui.available_width();
        let height = ui.spacing().interact_size.y;
        let layout = egui::Layout::left_to_right(egui::Align::Center);
        let label = ui
            .allocate_ui_with_layout(egui::vec2((width * NAMES).floor(), height), layout, |ui| {
                ui.set_min_width((width * NAMES).floor());
                ui.add(egui::Label::new(name.name).truncate()).on_hover_text(name.hint)
            })
            .inner;
        let room = (ui.available_width() - RESET - 4.0).max(40.0);
        let mut inside = within(ui, egui::vec2(room, height), layout);
        control(&mut inside).labelled_by(label.id).on_hover_text(name.hint);
        if is_changed {
            reset = back(ui, name.name);
        }
    });
    reset
}

/// Room of this size, which nothing in it makes larger: a long number does not widen the panel.
pub fn within(ui: &mut Ui, size: egui::Vec2, layout: egui::Layout) -> Ui {
    let (_, rect) = ui.allocate_space(size);
    let mut inside = ui.new_child(egui::UiBuilder::new().max_rect(rect).layout(layout));
    // Highlights reach a little beyond.
    inside.shrink_clip_rect(rect.expand(2.0));
    inside
}

/// The way back, of something with a name; says whether it is taken.
pub fn back(ui: &mut Ui, name: &str) -> bool {
    let size = egui::vec2(RESET, ui.spacing().interact_size.y);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click());
    let label = format!("Reset {}", name.to_lowercase());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, &label));
    let visuals = ui.style().interact(&response);
    // Three quarters of a turn, and the head of an arrow; no font that comes with egui has it.
    let (middle, radius, stroke) = (rect.center(), 4.5, egui::Stroke::new(1.5, visuals.fg_stroke.color));
    let at = |turn: f32, radius: f32| middle + radius * egui::Vec2::angled(turn * std::f32::consts::TAU);
    let arc = (0..=16).map(|i| at(-0.4 + 0.75 * i as f32 / 16.0, radius)).collect();
    ui.painter().add(egui::Shape::line(arc, stroke));
    let head = vec![at(-0.4, radius - 3.5), at(-0.4, radius + 3.5), at(-0.55, radius)];
    ui.painter().add(egui::Shape::convex_polygon(head, stroke.color, egui::Stroke::NONE));
    response.on_hover_text("Back to what the file says").clicked()
}

/// One of several numbers in a row, which only the first takes its name from: says its own.
pub fn named(response: Response, name: &str) -> Response {
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, name));
    response
}

/// One of a list; says whether another was chosen.
pub fn choice<T: Copy + PartialEq>(ui: &mut Ui, id: &str, value: &mut T, all: &[(T, &str, &str)]) -> Response {
    let text = all.iter().find(|(of, ..)| of == value).map_or("", |(_, text, _)| text);
    let mut changed = false;
    let combo = egui::ComboBox::from_id_salt(id).width(ui.available_width()).selected_text(text).truncate();
    let mut response = list(ui, combo, |ui| {
        for (of, text, hint) in all {
            changed |= ui.selectable_value(value, *of, *text).on_hover_text(*hint).changed();
        }
    });
    if changed {
        response.mark_changed();
    }
    response
}
