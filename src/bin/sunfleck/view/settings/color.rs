//! Colours: what is met by the eye, and linear numbers of any size.

use eframe::egui;
use egui::ecolor::Hsva;
use egui::{
    Color32, Key, Mesh, Modifiers, Popup, PopupCloseBehavior, RectAlign, Response, Rgba, Role, Sense, Stroke, Tooltip,
    Ui, WidgetInfo, vec2,
};

use super::number::{Number, drag_sized};
use super::widgets::named;
use crate::view::focus::keep_keys;

/// Of what is in the window that opens, points.
const WIDTH: f32 = 210.0;
/// Cells of the field of hues and saturations, along each side: hues bend at every sixth of it.
const CELLS: [usize; 2] = [24, 8];

/// A button of the colour, which opens a field of hues and the three numbers, linear and at most `most`; of any size if only
/// their ratio matters.
///
/// Not egui's picker: that one keeps colours as hues, and with a largest component of 1.
pub fn color(ui: &mut Ui, name: &str, color: &mut [f32; 3], most: Option<f32>) -> Response {
    let old = *color;
    let (rect, mut response) = ui.allocate_exact_size(ui.spacing().interact_size, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::ColorWell, ui.is_enabled(), name));
    let visuals = ui.style().interact(&response);
    ui.painter().rect(
        rect,
        visuals.corner_radius,
        shown(*color),
        Stroke::new(1.0, visuals.fg_stroke.color.gamma_multiply(0.4)),
        egui::StrokeKind::Inside,
    );
    // That of menus has no frames around fields.
    let style = ui.style().clone();
    let popup = Popup::menu(&response).close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    let shown = popup.width(WIDTH).show(|ui| {
        ui.set_style(style);
        ui.set_width(WIDTH);
        ui.style_mut().interaction.selectable_labels = false;
        beside(&hues(ui, color), "Hue, and upwards how strong it is. The largest of the three numbers stays.");
        let mut is_left = false;
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            for (i, (value, name)) in color.iter_mut().zip(["R", "G", "B"]).enumerate() {
                ui.label(name);
                let each = ((ui.available_width() - 16.0 * (2 - i) as f32) / (3 - i) as f32).floor();
                let each = vec2(each, ui.spacing().interact_size.y);
                let speed = f64::from(value.clamp(0.1, 1e3)) * 0.01;
                let number = drag_sized(ui, each, value, Number::Plain, speed, 0.0..=most.unwrap_or(f32::MAX));
                is_left |= named(number, name).on_hover_text(format!("{name}, linear")).lost_focus();
            }
        });
        if let Some(most) = most {
            is_left |= scale(ui, color, most).lost_focus();
        }
        if is_left {
            // It took the number back, which is enough for one press: else it would close the popup, too.
            ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Escape));
        }
    });
    keep_keys(ui, &response, shown.is_some());
    if *color != old {
        response.mark_changed();
    }
    response
}

/// All three numbers at once.
fn scale(ui: &mut Ui, color: &mut [f32; 3], most: f32) -> Response {
    let largest = color.iter().copied().fold(0.0, f32::max);
    let mut next = largest;
    let response = ui.horizontal(|ui| {
        ui.label("Largest").on_hover_text("Multiplies all three.");
        let speed = f64::from(largest.clamp(1e-2, 1e6)) * 0.01;
        let size = vec2(ui.available_width(), ui.spacing().interact_size.y);
        // Above 0, where the ratio of the three would be lost.
        named(drag_sized(ui, size, &mut next, Number::Plain, speed, 1e-6..=most), "Largest")
    });
    if next != largest {
        *color = color.map(|c| if c == largest { next } else { c * (next / largest) });
    }
    response.inner
}

/// A tooltip to one side, not over what is below.
fn beside(response: &Response, text: &str) {
    let mut tooltip = Tooltip::for_enabled(response).width(WIDTH);
    let others = &[RectAlign::LEFT_START, RectAlign::TOP];
    tooltip.popup = tooltip.popup.align(RectAlign::RIGHT_START).align_alternatives(others);
    tooltip.show(|ui| ui.label(text));
}

/// As a screen shows it; what is too bright keeps its hue.
fn shown([r, g, b]: [f32; 3]) -> Color32 {
    let scale = 1.0 / r.max(g).max(b).max(1.0);
    Rgba::from_rgb(r * scale, g * scale, b * scale).into()
}

/// Hue to the right, saturation upwards.
fn hues(ui: &mut Ui, color: &mut [f32; 3]) -> Response {
    let (rect, response) = ui.allocate_exact_size(vec2(WIDTH, 110.0), Sense::click_and_drag());
    if let Some(at) = response.interact_pointer_pos() {
        let at = ((at - rect.min) / rect.size()).clamp(vec2(0.0, 0.0), vec2(1.0, 1.0));
        *color = with_hue(*color, at.x, 1.0 - at.y);
    }
    let mut mesh = Mesh::default();
    let [columns, rows] = CELLS;
    for row in 0..=rows {
        for column in 0..=columns {
            let at = vec2(column as f32 / columns as f32, row as f32 / rows as f32);
            mesh.colored_vertex(rect.min + at * rect.size(), shown(with_hue([1.0; 3], at.x, 1.0 - at.y)));
            if row < rows && column < columns {
                let corner = (row * (columns + 1) + column) as u32;
                let below = corner + columns as u32 + 1;
                mesh.add_triangle(corner, corner + 1, below);
                mesh.add_triangle(below, corner + 1, below + 1);
            }
        }
    }
    ui.painter().add(mesh);
    let Hsva { h, s, .. } = Hsva::from_rgb(shown_linear(*color));
    let place = rect.min + vec2(h, 1.0 - s) * rect.size();
    ui.painter().circle(place, 5.0, shown(*color), Stroke::new(1.5, Color32::BLACK));
    ui.painter().circle_stroke(place, 6.5, Stroke::new(1.0, Color32::WHITE));
    response
}

/// Of a largest component of 1.
fn shown_linear(color: [f32; 3]) -> [f32; 3] {
    let most = color.iter().copied().fold(0.0, f32::max);
    if most > 0.0 { color.map(|c| c / most) } else { [1.0; 3] }
}

/// Another hue and saturation in [0, 1], as bright: with the same largest component, or 1 of black.
fn with_hue(color: [f32; 3], h: f32, s: f32) -> [f32; 3] {
    let most = color.iter().copied().fold(0.0, f32::max);
    let scale = if most > 0.0 { most } else { 1.0 };
    Hsva::new(h, s, 1.0, 1.0).to_rgb().map(|c| c.clamp(0.0, 1.0) * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_hue_is_as_bright() {
        assert_eq!(with_hue([2.0, 1.5, 0.5], 0.0, 1.0), [2.0, 0.0, 0.0]);
        assert_eq!(with_hue([8.0, 4.0, 0.25], 0.0, 0.0), [8.0; 3]);
        assert_eq!(with_hue([0.0; 3], 0.0, 1.0), [1.0, 0.0, 0.0]);
        assert_eq!(shown([4.0, 0.0, 0.0]), Color32::from_rgb(255, 0, 0));
    }
}
