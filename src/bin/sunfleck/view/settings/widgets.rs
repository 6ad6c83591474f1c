//! Rows of the panel: a name, a control, and a way back.

use std::ops::RangeInclusive;

use eframe::egui;
use egui::{DragValue, Response, Slider, SliderClamping, Ui};
use sunfleck::scene::settings::parse_count;

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
        ui.allocate_ui_with_layout(egui::vec2(room, height), layout, |ui| {
            ui.set_min_width(room);
            ui.set_max_width(room);
            control(ui).labelled_by(label.id).on_hover_text(name.hint)
        });
        if is_changed {
            reset = back(ui, name.name);
        }
    });
    reset
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

/// A slider with its value beside it, in all of the room. What is typed may lie outside the range.
pub fn slider(
    ui: &mut Ui,
    value: &mut f64,
    range: RangeInclusive<f64>,
    adjust: impl FnOnce(Slider) -> Slider,
) -> Response {
    const VALUE: f32 = 58.0;
    ui.spacing_mut().slider_width = (ui.available_width() - VALUE - ui.spacing().item_spacing.x).max(24.0);
    ui.spacing_mut().interact_size.x = VALUE;
    let slider =
        Slider::new(value, range).clamping(SliderClamping::Never).update_while_editing(false).trailing_fill(true);
    ui.add(adjust(slider))
}

/// One of several numbers in a row, which only the first takes its name from: says its own.
pub fn named(response: Response, name: &str) -> Response {
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::SpinButton, true, name));
    response
}

/// A length in metres, at least `least`; dragging changes it in proportion.
pub fn metres(ui: &mut Ui, value: &mut f32, least: f32) -> Response {
    let speed = f64::from(value.abs()).max(1e-3) * 0.01;
    let drag = DragValue::new(value).speed(speed).range(least..=f32::MAX).suffix(" m").update_while_editing(false);
    ui.add_sized(
        egui::vec2(ui.available_width(), ui.spacing().interact_size.y),
        drag.custom_formatter(|x, _| length_text(x)),
    )
}

/// To four significant digits.
fn length_text(metres: f64) -> String {
    if metres == 0.0 || !metres.is_finite() {
        return metres.to_string();
    }
    let digits = (3 - metres.abs().log10().floor() as i32).clamp(0, 9) as usize;
    let text = format!("{metres:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// One of a list; says whether another was chosen.
pub fn choice<T: Copy + PartialEq>(ui: &mut Ui, id: &str, value: &mut T, all: &[(T, &str, &str)]) -> Response {
    let text = all.iter().find(|(of, ..)| of == value).map_or("", |(_, text, _)| text);
    let mut changed = false;
    let mut response = egui::ComboBox::from_id_salt(id)
        .width(ui.available_width())
        .selected_text(text)
        .truncate()
        .show_ui(ui, |ui| {
            for (of, text, hint) in all {
                changed |= ui.selectable_value(value, *of, *text).on_hover_text(*hint).changed();
            }
        })
        .response;
    if changed {
        response.mark_changed();
    }
    response
}

/// A count as people write it: 500k, 1.5M.
pub fn count_text(n: f64) -> String {
    let (n, unit) = match n {
        n if n >= 999_500.0 => (n / 1e6, "M"),
        n if n >= 1000.0 => (n / 1e3, "k"),
        n => (n, ""),
    };
    let digits = match n {
        _ if unit.is_empty() => 0,
        n if n < 9.995 => 2,
        n if n < 99.95 => 1,
        _ => 0,
    };
    let text = format!("{n:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text}{unit}")
}

/// The other way.
pub fn count_of(text: &str) -> Option<f64> {
    parse_count(text).ok().map(f64::from)
}

/// To two significant digits: a count that a slider gave.
pub fn rounded(n: f64) -> f64 {
    let unit = 10_f64.powf(n.max(1.0).log10().floor() - 1.0).max(1.0);
    (n / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_short() {
        for (n, text) in [
            (1.0, "1"),
            (999.0, "999"),
            (1000.0, "1k"),
            (1500.0, "1.5k"),
            (500_000.0, "500k"),
            (999_600.0, "1M"),
            (1_250_000.0, "1.25M"),
            (20e6, "20M"),
            (12.5e6, "12.5M"),
        ] {
            assert_eq!(count_text(n), text);
        }
        for n in [1.0, 700.0, 1000.0, 250_000.0, 1.5e6, 20e6] {
            assert_eq!(count_of(&count_text(n)), Some(n));
        }
        assert_eq!(count_of("many"), None);
    }

    #[test]
    fn lengths_are_short() {
        for (metres, text) in
            [(0.0, "0"), (0.591_425, "0.5914"), (0.002, "0.002"), (12.5, "12.5"), (123_456.7, "123457")]
        {
            assert_eq!(length_text(metres), text);
        }
    }

    #[test]
    fn sliders_give_round_counts() {
        for (n, round) in [(1.0, 1.0), (12.4, 12.0), (123_456.0, 120_000.0), (987.0, 990.0), (1.26e6, 1.3e6)] {
            assert_eq!(rounded(n), round);
        }
    }
}
