//! The panel on the right: what is shown, and the numbers behind it.

use eframe::egui;
use egui::{Color32, RichText};
use glam::{Vec2, Vec3};
use sunfleck::inspect::{self, ColorBy, Object};
use sunfleck::output::difference::Measure;
use sunfleck::output::display;
use sunfleck::output::false_colour::{self, NOT_FINITE};
use sunfleck::output::tonemap::srgb_encode;
use sunfleck::ppm::FirstRadii;
use sunfleck::ppm::film::luminance;

use super::app::Viewer;
use super::charts::{bar, bars, bounces, rgb, rgba, short};
use super::engine::{Comparison, Legend, Message, NOTHING, Painted, Values, View};
use super::focus::{list, scrolling};
use crate::progress::{decimals, length};

/// Of what there is nothing to say about.
const NONE: &str = "–";

/// Why there is no view to choose.
const NO_VIEW: &str =
    "A difference is shown in the place of a view, which comes back with Off or Wipe under Compare (C)";

/// Radius of now over the first.
fn shrunk(painted: &Painted) -> f32 {
    painted.snapshot.radius / painted.snapshot.first_radius.max(f32::MIN_POSITIVE)
}

impl Viewer {
    /// The view `by` places further in the list, round its ends; says so if none is shown.
    pub fn next_view(&mut self, ui: &egui::Ui, by: isize) {
        if self.picture.painted().is_some_and(|painted| painted.difference().is_some()) {
            self.say(ui, Message::Warning(NO_VIEW.to_owned()));
            return;
        }
        let view = &mut self.wanted.painting.view;
        let at = View::ALL.iter().position(|v| v == view).unwrap_or(0) as isize;
        *view = View::ALL[(at + by).rem_euclid(View::ALL.len() as isize) as usize];
    }

    /// Photons over the picture: none, by power, by bounce.
    pub fn next_photons(&mut self) {
        let photons = &mut self.wanted.painting.photons;
        *photons = match photons {
            None => Some(ColorBy::Power),
            Some(ColorBy::Power) => Some(ColorBy::Bounce),
            Some(ColorBy::Bounce) => None,
        };
    }
}

pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let painted = viewer.picture.painted().cloned();
    let painted = painted.as_deref();
    // Beside what is in it, not over it.
    let scroll = &mut ui.spacing_mut().scroll;
    scroll.floating_allocated_width = scroll.bar_width;
    scrolling(ui, |ui| {
        section(ui, "View", |ui| view(ui, viewer, painted));
        section(ui, "Under the cursor", |ui| cursor(ui, viewer, painted));
        section(ui, "Whole picture", |ui| whole(ui, viewer, painted));
        section(ui, "Compare", |ui| super::compare::section(ui, viewer));
    });
}

fn section(ui: &mut egui::Ui, name: &str, content: impl FnOnce(&mut egui::Ui)) {
    egui::CollapsingHeader::new(RichText::new(name).strong()).default_open(true).show_unindented(ui, content);
}

/// What is shown, how large, and what its colours mean.
fn view(ui: &mut egui::Ui, viewer: &mut Viewer, painted: Option<&Painted>) {
    let painting = &mut viewer.wanted.painting;
    egui::Grid::new("view").num_columns(2).show(ui, |ui| {
        let label = ui.label("Show");
        let difference = painted.and_then(Painted::difference).map(|of| super::compare::describe(of).0);
        let text = format!("{}. Does not restart the estimate. (V, Shift+V)", painting.view.describe());
        let combo = egui::ComboBox::from_id_salt("view").selected_text(difference.unwrap_or(painting.view.name()));
        let views = |ui: &mut egui::Ui| {
            list(ui, combo.height(400.0), |ui| {
                for view in View::ALL {
                    ui.selectable_value(&mut painting.view, view, view.name()).on_hover_text(view.describe());
                }
            })
        };
        let response = ui.add_enabled_ui(difference.is_none(), views).inner;
        response.on_hover_text(text).on_disabled_hover_text(NO_VIEW).labelled_by(label.id);
        ui.end_row();
        let label = ui.label("Photons");
        let name = |photons| match photons {
            None => "off",
            Some(ColorBy::Power) => "by power",
            Some(ColorBy::Bounce) => "by bounce",
        };
        ui.horizontal(|ui| {
            let combo = egui::ComboBox::from_id_salt("photons").selected_text(name(painting.photons));
            let colours = |ui: &mut egui::Ui| {
                for photons in [None, Some(ColorBy::Power), Some(ColorBy::Bounce)] {
                    ui.selectable_value(&mut painting.photons, photons, name(photons));
                }
            };
            list(ui, combo, colours)
                .on_hover_text(
                    "Photons of the last iteration as points over the picture. Does not restart the estimate. (G)",
                )
                .labelled_by(label.id);
            let hidden = egui::Checkbox::new(&mut painting.hidden_photons, "hidden too");
            ui.add_enabled(painting.photons.is_some(), hidden).on_hover_text(
                "Also those behind glass, under water or behind a wall, drawn where they are. Otherwise only those on \
                 what is seen first.",
            );
        });
        ui.end_row();
        ui.label("Zoom");
        ui.horizontal(|ui| {
            let zoom = &mut viewer.picture.zoom;
            for (value, name, text) in [
                (None, "Fit", "The whole picture in the window (1)"),
                (Some(1.0), "1:1", "One pixel to a pixel of the screen (2)"),
                (
                    Some(4.0),
                    "4:1",
                    "Four pixels of the screen to a pixel (3); Ctrl + wheel for more, until values appear",
                ),
            ] {
                ui.selectable_value(zoom, value, name).on_hover_text(text);
            }
        });
        ui.end_row();
    });
    let Some(painted) = painted else { return };
    let view = Some(painted.painting.view).filter(|_| painted.difference().is_none());
    if painted.lacks() {
        ui.weak("Waiting for an iteration's photons …");
    } else if view == Some(View::Variance) && painted.snapshot.film.n_iterations < 2 {
        ui.weak("One iteration has no variance yet.");
    }
    let needs = view.map(View::needs).filter(|needs| needs.is_any() && !painted.lacks());
    if let (Some(needs), Some(insides)) = (needs, &painted.snapshot.insides) {
        let text = match insides.split.as_ref().filter(|_| needs.split).map(|split| split.n_iterations) {
            None => "Of the last iteration".to_owned(),
            Some(1) => "Of one iteration".to_owned(),
            Some(n) => format!("Mean of {n} iterations"),
        };
        ui.weak(text).on_hover_text("Iterations are looked into while a view that needs it is on");
    }
    if let Some(legend) = &painted.legend {
        let unit = unit(painted);
        let map = |t: f32| match legend.signed {
            true => signed_color(legend, t),
            false => rgba(false_colour::colour(t)),
        };
        bar(ui, "Legend", legend.range, legend.log, unit, map);
        if let Some(Comparison::Difference(measure)) = painted.difference() {
            let whose = if painted.painting.ends[measure as usize].is_some() { "as given" } else { "automatic" };
            ui.weak(format!("to {}, {whose}", short(legend.range[1]))).on_hover_text(super::compare::RANGE);
        }
        let shows_depth = painted.difference().is_none() && painted.painting.view == View::Depth;
        if legend.log || shows_depth {
            ui.horizontal(|ui| {
                ui.label(RichText::new("■").color(rgba(NOTHING)));
                ui.weak(if shows_depth { "nothing met" } else { "0: nothing" });
            });
        }
    }
    // Beside a reference, of either.
    let figures = painted.figures.filter(|_| painted.painting.comparison != Comparison::Off);
    let not_finite = figures.map_or(painted.histogram.luminance.not_finite, |f| f.not_finite as u64);
    if not_finite > 0 {
        ui.horizontal(|ui| {
            ui.label(RichText::new("■").color(rgba(NOT_FINITE)));
            ui.weak("not finite").on_hover_text(
                "Pixels that are NaN or infinite, in the picture or the reference. Only the window has this colour for \
                 them: in a .png they are black or white, in an .exr what they are.",
            );
        });
    }
    if let (Some(color_by), Some(insides)) = (painted.painting.photons, &painted.snapshot.insides) {
        match color_by {
            ColorBy::Power => {
                let per_path = 1.0 / painted.snapshot.params.n_paths.max(1) as f32;
                let range = painted.powers.unwrap_or([1.0; 2]).map(|power| power * per_path);
                let map = |t| rgb(inspect::power_color(t));
                bar(ui, "Power of a photon", range, true, "W a photon", map);
            }
            ColorBy::Bounce => bounces(ui),
        }
        ui.weak(format!("{} photons stored", insides.photons.len()));
    }
}

/// At `t` of a signed legend, in [0, 1].
fn signed_color(legend: &Legend, t: f32) -> Color32 {
    let [low, high] = legend.range;
    let mut bytes = vec![];
    false_colour::signed(&[low + (high - low) * t], high, &mut bytes);
    rgb([bytes[0], bytes[1], bytes[2]])
}

/// Of the numbers that are shown as colours.
fn unit(painted: &Painted) -> &'static str {
    // Without a reference of its size the view is shown all the same.
    match painted.difference() {
        Some(Comparison::Difference(Measure::Absolute | Measure::Signed)) => return "W/(m² sr)",
        Some(Comparison::Difference(Measure::Squared)) => return "(W/(m² sr))²",
        Some(Comparison::Difference(Measure::Relative | Measure::RelativeSquared)) => return "relative",
        Some(Comparison::Flip) => return "FLIP, 0 to 1",
        _ => {}
    }
    match painted.painting.view {
        View::Stops => "stops about mid grey",
        View::Depth | View::Radius => "m",
        View::PhotonCount => "photons a pixel",
        View::NodesVisited => "nodes a pixel",
        View::Variance => "(W/(m² sr))²",
        _ => "",
    }
}

/// A line of a table; `text` says more.
pub fn row(ui: &mut egui::Ui, name: &str, value: Option<String>, text: &str) {
    ui.label(name).on_hover_text(text);
    let value = value.unwrap_or_else(|| NONE.to_owned());
    ui.add(egui::Label::new(RichText::new(value).monospace().size(11.0)).truncate()).on_hover_text(text);
    ui.end_row();
}

pub fn table(ui: &mut egui::Ui, name: &str, rows: impl FnOnce(&mut egui::Ui)) {
    egui::Grid::new(name).num_columns(2).min_row_height(15.0).min_col_width(80.0).spacing([8.0, 2.0]).show(ui, rows);
}

/// Of the pixel under the cursor.
fn cursor(ui: &mut egui::Ui, viewer: &mut Viewer, painted: Option<&Painted>) {
    let at = painted.zip(viewer.picture.hovered);
    let film = at.and_then(|(painted, [x, y])| {
        let i = y * painted.size[0] + x;
        let pixel = painted.snapshot.film.pixels.get(i).filter(|_| x < painted.size[0])?;
        Some((painted, i, [pixel[0], pixel[1], pixel[2]], pixel[3]))
    });
    let three = |rgb: [f32; 3]| rgb.map(short).join(" ");
    table(ui, "cursor", |ui| {
        let pixel = at.map(|(painted, [x, y])| match painted.snapshot.is_preview {
            true => format!("{x}, {y} of {}×{}", painted.size[0], painted.size[1]),
            false => format!("{x}, {y}"),
        });
        row(ui, "Pixel", pixel, "Column and row from the upper left corner");
        let radiance = film.map(|(_, _, rgb, _)| rgb);
        row(ui, "Radiance", radiance.map(three), "Red, green, blue: linear, W/(m² sr)");
        row(ui, "Luminance", radiance.map(|rgb| short(luminance(rgb))), "Weighted mean of the radiance");
        if let Some((reference, _)) = painted.and_then(|painted| painted.reference.as_ref()) {
            let rgb = film.and_then(|(_, i, ..)| reference.picture.rgb.get(i).copied());
            row(ui, "Reference", rgb.map(three), "Radiance of the reference here");
        }
        let exposed = film.map(|(painted, _, rgb, _)| rgb.map(|c| c * painted.exposure.exp2()));
        row(ui, "Exposed", exposed.map(three), "Radiance after exposure; 0.18 is mid grey");
        let finite = film.filter(|(_, _, rgb, _)| rgb.iter().all(|c| c.is_finite()));
        let shown = finite.map(|(painted, _, rgb, _)| on_display(rgb, painted));
        row(
            ui,
            "Display",
            shown.map(|rgb| rgb.map(|c| c.to_string()).join("  ")),
            "After the tone curve: sRGB, 0 to 255",
        );
        let value = at.and_then(|(painted, [x, y])| match &painted.values {
            Values::Scalar(_) => painted.value(x, y).first().map(|v| short(*v)),
            Values::Rgb(_) if painted.painting.view == View::Picture => None,
            Values::Rgb(_) => <[f32; 3]>::try_from(painted.value(x, y)).ok().map(three),
        });
        row(ui, "Shown", value, "What the view or the comparison shows here");
    });
    ui.separator();
    let hit = at.and_then(|(painted, [x, y])| {
        let centre = Vec2::new(x as f32, y as f32) + 0.5;
        inspect::pick(&painted.snapshot.scene, &painted.snapshot.view(), centre)
    });
    table(ui, "hit", |ui| {
        row(ui, "Depth", hit.map(|hit| length(hit.depth)), "Of what is seen first, along the view");
        let position = hit.map(|hit| vector(hit.position, decimals(hit.depth.into()).max(3)));
        row(ui, "Position", position, "Of what is seen first: x, y, z, metres, world space");
        let normal = hit.map(|hit| vector(hit.normal, 3));
        row(ui, "Normal", normal, "For shading, on the camera's side, world space");
        let names = hit.and_then(|hit| Some((hit, viewer.opened()?)));
        let material = names.map(|(hit, opened)| material(&opened.loaded.scene, hit.material as usize));
        row(ui, "Material", material, "Of what is seen first; a click selects it");
        let object = names.map(|(hit, opened)| object(&opened.loaded.scene, hit.object(&opened.loaded.scene)));
        row(ui, "Object", object, "What is seen first");
    });
    ui.separator();
    table(ui, "photons", |ui| {
        let insides = film.and_then(|(painted, i, ..)| Some((painted.snapshot.insides.as_ref()?, i)));
        let gathered =
            insides.and_then(|(insides, i)| insides.split.as_ref()?.pixels.get(i)).map(|parts| short(parts.gathered));
        row(
            ui,
            "Photons",
            gathered,
            "Gathered by an iteration, on average, while the view is of gathered photons or of a kind of light",
        );
        let radius = film.filter(|_| hit.is_some()).and_then(|(painted, i, ..)| {
            let FirstRadii { each, gathers } = &*painted.snapshot.first_radii;
            gathers.get(i)?.then(|| each[i] * shrunk(painted))
        });
        row(ui, "Radius", radius.map(length), "Of the estimate, now");
        let variance = film.and_then(|(painted, _, _, m2)| variance(m2, painted.snapshot.film.n_iterations));
        row(ui, "Variance", variance.map(short), "Of the mean luminance, estimated");
        let error = variance.zip(radiance_of(film)).filter(|(_, y)| *y > 0.0).map(|(v, y)| v.sqrt() / y);
        let error = error.map(|e| format!("{} %", short(100.0 * e)));
        row(ui, "Relative error", error, "Standard deviation of the mean luminance over it");
        let nodes = insides.and_then(|(insides, i)| insides.nodes_visited.as_ref()?.get(i)).map(u32::to_string);
        row(ui, "Nodes visited", nodes, "Of the tree, by this pixel's last search, while the view is of them");
    });
    ui.separator();
    selection(ui, viewer);
}

type OnFilm<'a> = (&'a Painted, usize, [f32; 3], f32);

fn radiance_of(film: Option<OnFilm>) -> Option<f32> {
    film.map(|(_, _, rgb, _)| luminance(rgb))
}

/// Of a pixel's mean, from the sum of the squares of the deviations; none before two iterations.
fn variance(m2: f32, n_iterations: u32) -> Option<f32> {
    let n = n_iterations as f32;
    (n_iterations >= 2).then(|| m2.max(0.0) / (n * (n - 1.0)))
}

/// sRGB without the dither.
fn on_display(rgb: [f32; 3], painted: &Painted) -> [u8; 3] {
    let shown = display::linear(&[rgb], painted.exposure, painted.painting.look.tonemap);
    shown.first().map_or([0; 3], |rgb| rgb.map(|c| (255.0 * srgb_encode(c) + 0.5) as u8))
}

/// With so many decimals; no zero is negative.
fn vector(v: Vec3, decimals: usize) -> String {
    let unit = 10f64.powi(decimals as i32);
    let rounded = v.to_array().map(|c| (f64::from(c) * unit).round() / unit + 0.0);
    rounded.map(|c| format!("{c:.decimals$}")).join(" ")
}

fn material(scene: &sunfleck::scene::Scene, index: usize) -> String {
    match scene.materials.get(index) {
        Some(material) if !material.name.is_empty() => material.name.clone(),
        Some(_) => format!("material {index}"),
        None => "of the settings".to_owned(),
    }
}

fn object(scene: &sunfleck::scene::Scene, object: Object) -> String {
    match object {
        Object::Mesh(i) => match scene.meshes.get(i).map(|mesh| mesh.name.as_str()) {
            Some("") | None => format!("mesh {i}"),
            Some(name) => name.to_owned(),
        },
        Object::Sphere(i) => format!("sphere {i}"),
    }
}

/// What a click selected.
fn selection(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let name = viewer.opened().zip(viewer.selected).map(|(opened, index)| material(&opened.loaded.scene, index));
    match name {
        None => {
            ui.weak("Click on the picture to select a material")
                .on_hover_text("A double click puts it in focus, to turn about it");
        }
        Some(name) => {
            ui.horizontal(|ui| {
                if ui.small_button("Deselect").on_hover_text("Escape").clicked() {
                    viewer.selected = None;
                }
                ui.add(egui::Label::new(format!("Selected material: {name}")).truncate());
            });
        }
    }
}

/// Of all pixels and photons.
fn whole(ui: &mut egui::Ui, viewer: &mut Viewer, painted: Option<&Painted>) {
    let mean_radius = painted.and_then(|painted| painted.snapshot.mean_radius);
    table(ui, "whole", |ui| {
        let last = viewer.engine().history(|history| history.records.last().copied());
        let count = |n: u32| n.to_string();
        row(ui, "Photons emitted", last.map(|l| count(l.n_paths)), "By the lamps, an iteration");
        row(ui, "Photons stored", last.map(|l| count(l.n_photons)), "In the last iteration");
        let each =
            last.filter(|l| l.n_paths > 0).map(|l| format!("{:.3}", f64::from(l.n_photons) / f64::from(l.n_paths)));
        row(ui, "Stored of each", each, "Photons stored for one that is emitted, on average");
        row(ui, "Mean radius", mean_radius.map(length), "Of the pixels' estimates, now");
    });
    if let Some(painted) = painted {
        ui.add_space(4.0);
        bars(ui, &painted.histogram);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_show_what_there_is() {
        assert_eq!(vector(Vec3::new(-1e-4, 0.5, -2.0), 3), "0.000 0.500 -2.000");
        assert_eq!(vector(Vec3::new(0.001_234, -0.000_01, 0.0), decimals(0.003_888)), "0.00123 -0.00001 0.00000");
    }

    #[test]
    fn a_signed_legend_goes_from_red_to_green() {
        let legend = Legend { range: [-0.3, 0.3], log: false, signed: true };
        assert_eq!(signed_color(&legend, 0.0), Color32::from_rgb(255, 0, 0));
        assert_eq!(signed_color(&legend, 0.5), Color32::BLACK);
        assert_eq!(signed_color(&legend, 1.0), Color32::from_rgb(0, 255, 0));
    }

    #[test]
    fn a_mean_has_a_variance_from_two_iterations_on() {
        assert_eq!(variance(6.0, 1), None);
        assert_eq!(variance(6.0, 3), Some(1.0));
    }
}
