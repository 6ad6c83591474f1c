//! Legends and the histogram of the panel on the right.

use eframe::egui;
use egui::{Align2, Color32, FontId, Rect, Stroke, pos2, vec2};
use sunfleck::inspect;
use sunfleck::output::false_colour::{self, MID_GREY};
use sunfleck::output::histogram::{self, Histogram};

/// Height of a bar of colours, points.
const BAR: f32 = 14.0;
/// Height of the histogram, points.
const HISTOGRAM: f32 = 80.0;
pub fn rgb([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

pub fn rgba([r, g, b, _]: [u8; 4]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// Colours from the least to the greatest value, with ticks; that of the greatest, if all are the same.
pub fn bar(ui: &mut egui::Ui, name: &str, range: [f32; 2], log: bool, unit: &str, map: impl Fn(f32) -> Color32) {
    const STEPS: usize = 64;
    let font = FontId::proportional(11.0);
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), BAR + 4.0 + font.size + 4.0), egui::Sense::hover());
    let label = format!("{name}: {} to {} {unit}", short(range[0]), short(range[1]));
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, &label));
    let colors = Rect::from_min_size(rect.min, vec2(rect.width(), BAR));
    let is_range = range[0] < range[1];
    let mut mesh = egui::Mesh::default();
    for i in 0..=STEPS {
        let t = i as f32 / STEPS as f32;
        let x = egui::lerp(colors.x_range(), t);
        let t = if is_range { t } else { 1.0 };
        mesh.colored_vertex(pos2(x, colors.top()), map(t));
        mesh.colored_vertex(pos2(x, colors.bottom()), map(t));
        if i > 0 {
            let k = 2 * i as u32;
            mesh.add_triangle(k - 2, k - 1, k);
            mesh.add_triangle(k - 1, k, k + 1);
        }
    }
    let painter = ui.painter();
    painter.add(mesh);
    let ink = ui.visuals().text_color();
    painter.rect_stroke(colors, 0.0, Stroke::new(1.0, ui.visuals().weak_text_color()), egui::StrokeKind::Outside);
    let mut free_from = f32::NEG_INFINITY;
    let ticks = if is_range { false_colour::ticks(range, log) } else { vec![range[0]] };
    for tick in ticks {
        let at = if is_range { place(tick, range, log).clamp(0.0, 1.0) } else { 0.5 };
        let x = egui::lerp(colors.x_range(), at);
        painter.vline(x, colors.bottom()..=colors.bottom() + 3.0, Stroke::new(1.0, ink));
        let galley = painter.layout_no_wrap(short(tick), font.clone(), ink);
        let half = 0.5 * galley.size().x;
        let left = (x - half).clamp(rect.left(), (rect.right() - 2.0 * half).max(rect.left()));
        if left >= free_from {
            free_from = left + 2.0 * half + 4.0;
            painter.galley(pos2(left, colors.bottom() + 3.0), galley, ink);
        }
    }
    response.on_hover_text(label);
    if !unit.is_empty() {
        ui.weak(format!("{unit}{}", if log { ", logarithmic" } else { "" }));
    }
}

/// Where a value is on a bar: 0 at the least, 1 at the greatest.
fn place(value: f32, [low, high]: [f32; 2], log: bool) -> f32 {
    let at = |v: f32| if log { v.ln() } else { v };
    (at(value) - at(low)) / (at(high) - at(low))
}

/// Colours of photons by the segments of their paths.
pub fn bounces(ui: &mut egui::Ui) {
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        for segments in 1..=8 {
            let (rect, _) = ui.allocate_exact_size(vec2(BAR, BAR), egui::Sense::hover());
            ui.painter().rect_filled(rect, 2.0, rgb(inspect::bounce_color(segments)));
            ui.label(if segments < 8 { segments.to_string() } else { "8+".to_owned() });
        }
    })
    .response
    .on_hover_text("Segments of the photon's path: 1 comes straight from a lamp");
}

/// Luminance as bars, channels as lines, against stops about mid grey.
pub fn bars(ui: &mut egui::Ui, of: &Histogram) {
    let font = FontId::proportional(11.0);
    let (whole, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), HISTOGRAM + font.size + 4.0), egui::Sense::hover());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Histogram"));
    let rect = Rect::from_min_size(whole.min, vec2(whole.width(), HISTOGRAM));
    let painter = ui.painter_at(whole);
    let visuals = ui.visuals();
    painter.rect_filled(rect, 2.0, visuals.extreme_bg_color);
    let most = of.channels.iter().chain([&of.luminance]).flat_map(|c| c.bins).max().unwrap_or(0).max(1) as f32;
    let x_of = |stops: f32| {
        let share = (stops - histogram::LOWEST as f32) / (histogram::HIGHEST - histogram::LOWEST) as f32;
        egui::lerp(rect.x_range(), share)
    };
    let y_of = |n: u64| rect.bottom() - (rect.height() - 3.0) * n as f32 / most;
    for (i, &n) in of.luminance.bins.iter().enumerate().filter(|(_, n)| **n > 0) {
        let bin = Rect::from_x_y_ranges(
            x_of(histogram::stop_of(i))..=x_of(histogram::stop_of(i + 1)),
            y_of(n)..=rect.bottom(),
        );
        painter.rect_filled(bin, 0.0, visuals.weak_text_color().gamma_multiply(0.6));
    }
    let inks = [Color32::from_rgb(220, 60, 60), Color32::from_rgb(50, 165, 70), Color32::from_rgb(75, 120, 235)];
    for (counts, ink) in of.channels.iter().zip(inks) {
        let point =
            |(i, &n): (usize, &u64)| pos2(x_of(histogram::stop_of(i) + 0.5 / histogram::PER_STOP as f32), y_of(n));
        painter.line(counts.bins.iter().enumerate().map(point).collect(), Stroke::new(1.0, ink));
    }
    let white = -MID_GREY.log2();
    painter.vline(x_of(white), rect.y_range(), Stroke::new(1.0, visuals.text_color().gamma_multiply(0.5)));
    for stops in [-8, -4, 0, 4, 8] {
        let at = pos2(x_of(stops as f32), rect.bottom() + 1.0);
        painter.text(at, Align2::CENTER_TOP, format!("{stops}"), font.clone(), visuals.text_color());
    }
    let pointed = response.hover_pos().map(|p| {
        let i = ((p.x - rect.left()) / rect.width() * histogram::BINS as f32) as usize;
        i.min(histogram::BINS - 1)
    });
    response.on_hover_ui_at_pointer(|ui| {
        if let Some(i) = pointed {
            let [r, g, b] = of.channels.each_ref().map(|counts| counts.bins[i]);
            ui.label(format!("{:+} to {:+} stops", histogram::stop_of(i), histogram::stop_of(i + 1)));
            ui.label(format!("luminance {}, red {r}, green {g}, blue {b} pixels", of.luminance.bins[i]));
        }
        ui.weak("Stops about mid grey after exposure; grey: luminance; the line: white without a tone curve");
    });
    let rest = [("below", of.luminance.below), ("above", of.luminance.above), ("not finite", of.luminance.not_finite)];
    let rest: Vec<_> = rest.iter().filter(|(_, n)| *n > 0).map(|(name, n)| format!("{n} {name}")).collect();
    if !rest.is_empty() {
        ui.weak(rest.join(", ")).on_hover_text("Pixels whose luminance the histogram does not hold");
    }
}

/// A number in few characters: about four digits.
pub fn short(value: f32) -> String {
    let size = value.abs();
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    if !(1e-3..1e5).contains(&size) {
        let text = format!("{value:.2e}");
        let (digits, power) = text.split_once('e').unwrap_or((&text, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        return format!("{digits}e{power}");
    }
    let decimals = (3 - size.log10().floor() as i32).clamp(0, 5) as usize;
    let text = format!("{value:.decimals$}");
    if decimals == 0 { text } else { text.trim_end_matches('0').trim_end_matches('.').to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (-8.0, "-8"),
            (0.2, "0.2"),
            (0.012_345, "0.01235"),
            (0.001, "0.001"),
            (123.456, "123.5"),
            (20_000.0, "20000"),
            (1e-5, "1e-5"),
            (2.5e7, "2.5e7"),
            (f32::NAN, "NaN"),
            (f32::INFINITY, "inf"),
        ] {
            assert_eq!(short(value), text);
        }
    }

    #[test]
    fn ticks_have_their_places() {
        assert_eq!(place(-8.0, [-8.0, 8.0], false), 0.0);
        assert_eq!(place(4.0, [-8.0, 8.0], false), 0.75);
        assert!((place(1.0, [0.01, 100.0], true) - 0.5).abs() < 1e-6);
    }
}
