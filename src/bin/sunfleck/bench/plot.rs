//! Figures as SVG: lines over logarithmic axes, maps of ratios, stacked bars.

use std::io::Write;
use std::path::Path;

use anyhow::{Result, anyhow, ensure};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use sunfleck::output::atomic;

use super::report::figure;

/// Of a panel, SVG units.
const PANEL: (u32, u32) = (420, 320);
const TITLE: u32 = 30;
/// Dark enough on white, apart for colour-blind eyes (Okabe & Ito 2008).
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(0, 0, 0),
    RGBColor(128, 128, 128),
];

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// One curve.
pub struct Series {
    pub name: String,
    /// Both positive.
    pub points: Vec<(f64, f64)>,
}

/// Curves over common axes.
pub struct Curves {
    pub title: String,
    pub x: &'static str,
    pub y: &'static str,
    pub series: Vec<Series>,
}

/// A map of ratios over two axes of steps.
pub struct Map {
    pub title: String,
    pub x: &'static str,
    pub y: &'static str,
    pub columns: Vec<String>,
    pub rows: Vec<String>,
    /// `[rows][columns]`; NaN where nothing was measured.
    pub ratios: Vec<Vec<f64>>,
}

/// Groups of stacked bars.
pub struct Bars {
    pub title: String,
    pub y: &'static str,
    /// What is stacked, from below.
    pub parts: Vec<&'static str>,
    /// Name, and its bars.
    pub groups: Vec<(String, Vec<Bar>)>,
}

/// Name, and a height for each part.
pub type Bar = (String, Vec<f64>);

/// Panels side by side, `columns` in a row, drawn by `panel`.
fn draw<T>(
    path: &Path,
    title: &str,
    panels: &[T],
    columns: usize,
    panel: impl Fn(&Area<'_>, &T) -> Result<()>,
) -> Result<()> {
    ensure!(!panels.is_empty(), "{title}: nothing to draw");
    let columns = columns.clamp(1, panels.len());
    let rows = panels.len().div_ceil(columns);
    let mut svg = String::new();
    {
        let size = (PANEL.0 * columns as u32, PANEL.1 * rows as u32 + TITLE);
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE).map_err(failed)?;
        let root = root.titled(title, ("sans-serif", 18)).map_err(failed)?;
        for (area, content) in root.split_evenly((rows, columns)).iter().zip(panels) {
            panel(area, content)?;
        }
        root.present().map_err(failed)?;
    }
    Ok(atomic::write(path, |writer| writer.write_all(svg.as_bytes()))?)
}

fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (least, most) = values
        .filter(|v| v.is_finite() && *v > 0.0)
        .fold((f64::INFINITY, 0.0f64), |(least, most), v| (least.min(v), most.max(v)));
    if least > most { (0.1, 10.0) } else { (least / 1.3, most * 1.3) }
}

/// Logarithmic on both axes.
pub fn curves(path: &Path, title: &str, panels: &[Curves], columns: usize) -> Result<()> {
    draw(path, title, panels, columns, |area, panel| {
        let all = || panel.series.iter().flat_map(|s| &s.points);
        let (x, mut y) = (range(all().map(|p| p.0)), range(all().map(|p| p.1)));
        y.1 *= 8.0; // For the legend.
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, ("sans-serif", 14))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(54)
            .build_cartesian_2d((x.0..x.1).log_scale(), (y.0..y.1).log_scale())
            .map_err(failed)?;
        chart
            .configure_mesh()
            .x_desc(panel.x)
            .y_desc(panel.y)
            .light_line_style(WHITE)
            .x_label_formatter(&|x| short(*x))
            .y_label_formatter(&|y| short(*y))
            .draw()
            .map_err(failed)?;
        for (i, series) in panel.series.iter().enumerate() {
            let colour = COLOURS[i % COLOURS.len()];
            let points = || series.points.iter().copied().filter(|p| p.1.is_finite() && p.1 > 0.0);
            chart
                .draw_series(LineSeries::new(points(), colour.stroke_width(2)))
                .map_err(failed)?
                .label(&series.name)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
            chart.draw_series(points().map(|p| Circle::new(p, 3, colour.filled()))).map_err(failed)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 11))
            .draw()
            .map_err(failed)
    })
}

/// Above one (blue) the rival is slower, below (orange) it is faster; the number is in each cell.
pub fn maps(path: &Path, title: &str, panels: &[Map], columns: usize) -> Result<()> {
    draw(path, title, panels, columns, |area, panel| {
        let (n_x, n_y) = (panel.columns.len() as i32, panel.rows.len() as i32);
        let area = area.titled(&panel.title, ("sans-serif", 14)).map_err(failed)?;
        let (width, height) = (area.dim_in_pixel().0 as i32, area.dim_in_pixel().1 as i32);
        let (left, top, right, bottom) = (70, 6, width - 12, height - 42);
        let font = |size: u32| ("sans-serif", size).into_font().color(&BLACK).pos(Pos::new(HPos::Center, VPos::Center));
        let text = |text: &str, size, at| area.draw(&Text::new(text.to_owned(), at, font(size))).map_err(failed);
        let x = |i: i32| left + (right - left) * i / n_x;
        let y = |j: i32| bottom - (bottom - top) * j / n_y;
        for (j, row) in (0..).zip(&panel.ratios) {
            for (i, &ratio) in (0..).zip(row) {
                let cell = [(x(i), y(j + 1)), (x(i + 1), y(j))];
                area.draw(&Rectangle::new(cell, shade(ratio).filled())).map_err(failed)?;
                area.draw(&Rectangle::new(cell, WHITE.stroke_width(1))).map_err(failed)?;
                text(&figure(ratio), 13, ((cell[0].0 + cell[1].0) / 2, (cell[0].1 + cell[1].1) / 2))?;
            }
        }
        for (i, name) in (0..).zip(&panel.columns) {
            text(name, 12, ((x(i) + x(i + 1)) / 2, bottom + 10))?;
        }
        for (j, name) in (0..).zip(&panel.rows) {
            text(name, 12, (left - 22, (y(j) + y(j + 1)) / 2))?;
        }
        text(panel.x, 13, ((left + right) / 2, bottom + 28))?;
        let turned = font(13).transform(FontTransform::Rotate270);
        area.draw(&Text::new(panel.y, (14, (top + bottom) / 2), turned)).map_err(failed)
    })
}

/// White at one, full colour from sixteen on.
fn shade(ratio: f64) -> RGBColor {
    if !ratio.is_finite() || ratio <= 0.0 {
        return RGBColor(230, 230, 230);
    }
    let strength = (ratio.log2().abs() / 4.0).min(1.0) * 0.75;
    let full = if ratio >= 1.0 { COLOURS[5] } else { COLOURS[1] };
    let mix = |c: u8| (255.0 + (f64::from(c) - 255.0) * strength).round() as u8;
    RGBColor(mix(full.0), mix(full.1), mix(full.2))
}

/// Linear, from zero.
pub fn bars(path: &Path, title: &str, panels: &[Bars], columns: usize) -> Result<()> {
    draw(path, title, panels, columns, |area, panel| {
        // A gap of one bar after each group.
        let widths: Vec<usize> = panel.groups.iter().map(|g| g.1.len() + 1).collect();
        let n: usize = widths.iter().sum();
        let totals = panel.groups.iter().flat_map(|g| &g.1).map(|b| b.1.iter().filter(|h| h.is_finite()).sum::<f64>());
        let most = totals.fold(0.0, f64::max).max(1e-9) * 1.25;
        let mut chart = ChartBuilder::on(area)
            .caption(&panel.title, ("sans-serif", 14))
            .margin(10)
            .x_label_area_size(36)
            .y_label_area_size(54)
            .build_cartesian_2d(0.0..n as f64, 0.0..most)
            .map_err(failed)?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .x_labels(0)
            .y_desc(panel.y)
            .light_line_style(WHITE)
            .y_label_formatter(&|y| short(*y))
            .draw()
            .map_err(failed)?;
        let mut at = 0.5;
        let mut names: Vec<&str> = Vec::new();
        let anchor = |v| Pos::new(HPos::Center, v);
        let small = ("sans-serif", 11).into_font().color(&BLACK);
        let mut drawn = Vec::new();
        let mut labels = Vec::new();
        for (group, bars) in &panel.groups {
            for (k, (name, heights)) in (0..).zip(bars) {
                let colour = names.iter().position(|n| n == name).unwrap_or_else(|| {
                    names.push(name);
                    names.len() - 1
                });
                let x = at + f64::from(k);
                let mut base = 0.0;
                for (part, &height) in heights.iter().enumerate().filter(|(_, h)| h.is_finite()) {
                    let fade = 1.0 - 0.55 * part as f64 / (panel.parts.len() - 1).max(1) as f64;
                    drawn.push((colour, fade, [(x + 0.05, base), (x + 0.95, base + height)]));
                    base += height;
                }
                labels.push(Text::new(figure(base), (x + 0.5, base), small.pos(anchor(VPos::Bottom))));
            }
            let middle = at + bars.len() as f64 / 2.0;
            labels.push(Text::new(group.clone(), (middle, -0.02 * most), small.pos(anchor(VPos::Top))));
            at += bars.len() as f64 + 1.0;
        }
        for (colour, name) in names.iter().enumerate() {
            let style = COLOURS[colour % COLOURS.len()];
            chart
                .draw_series(
                    drawn.iter().filter(|d| d.0 == colour).map(|d| Rectangle::new(d.2, style.mix(d.1).filled())),
                )
                .map_err(failed)?
                .label(match &panel.parts[..] {
                    [_] => (*name).to_owned(),
                    parts => format!("{name}: {} from below", parts.join(", ")),
                })
                .legend(move |(x, y)| Rectangle::new([(x, y - 5), (x + 12, y + 5)], style.filled()));
        }
        let plane = chart.plotting_area();
        for label in &labels {
            plane.draw(label).map_err(failed)?;
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperLeft)
            .background_style(WHITE.mix(0.85))
            .border_style(BLACK.mix(0.3))
            .label_font(("sans-serif", 11))
            .draw()
            .map_err(failed)
    })
}

/// Horizontal bars, a line for each bar: for long names.
pub fn rows(path: &Path, title: &str, panels: &[Bars]) -> Result<()> {
    draw(path, title, panels, 2, |area, panel| {
        let bars: Vec<(&str, &[f64])> =
            panel.groups.iter().flat_map(|g| g.1.iter().map(|bar| (g.0.as_str(), bar.1.as_slice()))).collect();
        let total = |heights: &[f64]| heights.iter().filter(|h| h.is_finite()).sum::<f64>();
        let most = bars.iter().map(|bar| total(bar.1)).fold(1e-9, f64::max);
        let area = area.titled(&format!("{}, {}", panel.title, panel.y), ("sans-serif", 14)).map_err(failed)?;
        let (width, height) = (area.dim_in_pixel().0 as i32, area.dim_in_pixel().1 as i32);
        let (left, right) = (178, width - 60);
        let pitch = height / (bars.len() as i32 + 1).max(1);
        let font = |h| ("sans-serif", 11).into_font().color(&BLACK).pos(Pos::new(h, VPos::Center));
        for (i, (name, lengths)) in (0..).zip(&bars) {
            let (top, bottom) = (i * pitch + 2, (i + 1) * pitch - 2);
            let middle = (top + bottom) / 2;
            area.draw(&Text::new((*name).to_owned(), (left - 6, middle), font(HPos::Right))).map_err(failed)?;
            let x = |value: f64| left + (f64::from(right - left) * value / most) as i32;
            let mut base = 0.0;
            for (part, &length) in lengths.iter().enumerate().filter(|(_, l)| l.is_finite()) {
                let style = COLOURS[0].mix(if part == 0 { 1.0 } else { 0.45 }).filled();
                let corners = [(x(base), top), (x(base + length), bottom)];
                area.draw(&Rectangle::new(corners, style)).map_err(failed)?;
                base += length;
            }
            area.draw(&Text::new(figure(base), (x(base) + 4, middle), font(HPos::Left))).map_err(failed)?;
        }
        Ok(())
    })
}

/// For an axis.
fn short(x: f64) -> String {
    match x.abs() {
        a if a >= 1e6 => format!("{}M", x / 1e6),
        a if a >= 1e4 => format!("{}k", x / 1e3),
        _ => format!("{}", (x * 1e6).round() / 1e6),
    }
}
