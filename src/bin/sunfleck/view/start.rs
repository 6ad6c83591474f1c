//! What is shown while no scene is open: scenes that come with the program, files opened before, a place to drop one.

use std::path::Path;
use std::sync::mpsc;

use eframe::egui;
use egui::{
    Align2, Color32, Event, FontId, Id, Rect, Response, Sense, Stroke, StrokeKind, TextureHandle, Ui, pos2, vec2,
};
use sunfleck::scene::shipped::NAMES;

use super::app::Viewer;
use super::engine::Wake;
use super::files;
use super::focus::scrolling;
use crate::scenes::describe;

/// Of all that is shown, points.
const MOST_WIDTH: f32 = 1720.0;
/// Of a card, points.
const LEAST_CARD: f32 = 190.0;
const MOST_CARD: f32 = 340.0;
const GAP: f32 = 14.0;
/// Of a card, for text.
const TEXT: f32 = 76.0;
/// Seconds between two looks whether recent files are still there.
const LOOK_EVERY: f64 = 2.0;

/// What the page keeps from frame to frame.
#[derive(Default)]
pub struct Page {
    /// Of the shipped scenes, in their order; made when they are first shown.
    thumbnails: Vec<Option<TextureHandle>>,
    absent: Absent,
    pub drag: Drag,
}

/// Files that are dragged over the window. Nobody tells of the death of their source; but then the pointer is back, which
/// moves over the window in no drag.
#[derive(Default)]
pub struct Drag {
    /// Files that hovered over the window in the frame before, as far as the system tells.
    n_told: usize,
    /// The first of them, which do so no more.
    n_gone: usize,
}

impl Drag {
    /// At every frame.
    pub fn update(&mut self, input: &egui::InputState) {
        let is_pointer = |event: &Event| matches!(event, Event::PointerMoved(_) | Event::PointerButton { .. });
        if input.events.iter().any(is_pointer) {
            self.n_gone = self.n_told;
        }
        self.n_told = input.raw.hovered_files.len();
        self.n_gone = self.n_gone.min(self.n_told);
    }

    /// Name of the file that hovers over the window; empty where the system does not tell.
    fn hovering(&self, ui: &Ui) -> Option<String> {
        ui.input(|i| {
            let file = i.raw.hovered_files.get(self.n_gone)?;
            let name = file.path.as_ref().and_then(|path| path.file_name());
            Some(name.map(|name| name.to_string_lossy().into_owned()).unwrap_or_default())
        })
    }
}

/// Which of the recent files are not there any more: those alone that were looked for in vain.
#[derive(Default)]
struct Absent {
    files: Vec<String>,
    /// When they were last looked for.
    when: Option<f64>,
    /// A look under way, on a thread of its own: a disk that is not reached may never answer.
    look: Option<mpsc::Receiver<Vec<String>>>,
}

impl Absent {
    /// Looks for `files` now and then; `time` in seconds. Calls `wake` when it has looked.
    fn update(&mut self, files: &[String], time: f64, wake: Wake) {
        if let Some(look) = &self.look {
            match look.try_recv() {
                Ok(absent) => (self.files, self.when, self.look) = (absent, Some(time), None),
                Err(mpsc::TryRecvError::Empty) => return,
                Err(mpsc::TryRecvError::Disconnected) => self.look = None,
            }
        }
        if self.when.is_some_and(|when| time - when <= LOOK_EVERY) {
            return;
        }
        let (sender, look) = mpsc::channel();
        let files = files.to_vec();
        std::thread::spawn(move || {
            let _ = sender.send(files.into_iter().filter(|path| !Path::new(path).is_file()).collect());
            wake();
        });
        (self.when, self.look) = (Some(time), Some(look));
    }
}

fn thumbnail(name: &str) -> Option<&'static [u8]> {
    Some(match name {
        "bathroom" => include_bytes!("thumbnails/bathroom.png"),
        "cornell" => include_bytes!("thumbnails/cornell.png"),
        "fireplace" => include_bytes!("thumbnails/fireplace.png"),
        "glass" => include_bytes!("thumbnails/glass.png"),
        "pool" => include_bytes!("thumbnails/pool.png"),
        _ => return None,
    })
}

fn decode(name: &str) -> Option<egui::ColorImage> {
    let image = image::load_from_memory(thumbnail(name)?).ok()?.to_rgba8();
    Some(egui::ColorImage::from_rgba_unmultiplied([image.width() as usize, image.height() as usize], &image))
}

pub fn show(ui: &mut Ui, viewer: &mut Viewer) {
    if viewer.start.thumbnails.is_empty() {
        let load = |name: &&str| Some(ui.ctx().load_texture(*name, decode(name)?, egui::TextureOptions::LINEAR));
        viewer.start.thumbnails = NAMES.iter().map(load).collect();
    }
    ui.painter().rect_filled(ui.max_rect(), 0.0, ui.visuals().panel_fill);
    scrolling(ui, |ui| {
        let width = (ui.available_width() - 48.0).clamp(200.0, MOST_WIDTH);
        let margin = ((ui.available_width() - width) / 2.0).max(8.0);
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 0.0;
            ui.add_space(margin);
            ui.vertical(|ui| {
                ui.set_width(width);
                ui.add_space(22.0);
                ui.label(egui::RichText::new("Sunfleck").size(30.0).strong());
                ui.weak("Progressive photon mapping: open a scene, watch it converge.");
                ui.add_space(14.0);
                drop_place(ui, viewer);
                ui.add_space(18.0);
                ui.label(egui::RichText::new("Scenes that come with it").size(16.0).strong());
                ui.add_space(6.0);
                cards(ui, viewer);
                recent(ui, viewer);
                ui.add_space(16.0);
            });
        });
    });
}

/// Where to drop a file; lights up while one hovers over the window.
fn drop_place(ui: &mut Ui, viewer: &mut Viewer) {
    let hovering = viewer.start.drag.hovering(ui);
    let visuals = ui.visuals();
    let (fill, stroke) = match hovering {
        Some(_) => (visuals.selection.bg_fill.gamma_multiply(0.35), Stroke::new(2.0, visuals.selection.stroke.color)),
        None => (visuals.faint_bg_color, Stroke::new(1.0, visuals.weak_text_color())),
    };
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), 76.0), Sense::hover());
    ui.painter().rect_filled(rect, 8.0, fill);
    let inner = rect.shrink(1.0);
    let corners = [inner.left_top(), inner.right_top(), inner.right_bottom(), inner.left_bottom(), inner.left_top()];
    ui.painter().extend(egui::Shape::dashed_line(&corners, stroke, 7.0, 5.0));
    let mut inside = ui.new_child(
        egui::UiBuilder::new()
            .max_rect(rect.shrink2(vec2(18.0, 0.0)))
            .layout(egui::Layout::left_to_right(egui::Align::Center)),
    );
    let ui = &mut inside;
    ui.spacing_mut().item_spacing.x = 16.0;
    let button = egui::Button::new(egui::RichText::new("Open …").size(16.0)).min_size(vec2(110.0, 40.0));
    if ui.add(button).on_hover_text("A scene: .glb, .gltf, .obj, or settings: .toml (Ctrl+O)").clicked() {
        files::open(viewer);
    }
    let text = match hovering {
        Some(name) if name.is_empty() => "Drop it to open it".to_owned(),
        Some(name) => format!("Drop it to open {name}"),
        None => "or drop a file here: a scene (.glb, .gltf, .obj) or settings (.toml)".to_owned(),
    };
    ui.add(egui::Label::new(egui::RichText::new(text).size(15.0)).truncate());
}

/// Says over an open scene that a file can be dropped.
pub fn drop_hint(ui: &Ui, viewer: &Viewer) {
    let Some(name) = viewer.start.drag.hovering(ui) else { return };
    let painter = ui.ctx().layer_painter(egui::LayerId::new(egui::Order::Foreground, Id::unique("drop hint")));
    let area = ui.ctx().content_rect();
    painter.rect_filled(area, 0.0, Color32::from_black_alpha(150));
    let stroke = Stroke::new(3.0, ui.visuals().selection.bg_fill);
    painter.rect_stroke(area.shrink(8.0), 8.0, stroke, StrokeKind::Inside);
    let text = if name.is_empty() { "Drop it to open it".to_owned() } else { format!("Drop it to open {name}") };
    painter.text(area.center(), Align2::CENTER_CENTER, text, FontId::proportional(22.0), Color32::WHITE);
}

/// Columns that fit into a width, and how wide a card then is.
fn columns(width: f32, n: usize) -> (usize, f32) {
    let fitting = ((width + GAP) / (LEAST_CARD + GAP)).floor().max(1.0) as usize;
    // Rows of the same length, nearly.
    let n_rows = n.div_ceil(fitting).max(1);
    let n_columns = n.div_ceil(n_rows).max(1);
    let card = (width - GAP * (n_columns - 1) as f32) / n_columns as f32;
    (n_columns, card.min(MOST_CARD).floor())
}

fn cards(ui: &mut Ui, viewer: &mut Viewer) {
    let (n_columns, width) = columns(ui.available_width(), NAMES.len());
    ui.spacing_mut().item_spacing = vec2(GAP, GAP);
    for row in (0..NAMES.len()).collect::<Vec<_>>().chunks(n_columns) {
        ui.horizontal(|ui| {
            for &i in row {
                let texture = viewer.start.thumbnails.get(i).and_then(Option::as_ref);
                if card(ui, NAMES[i], texture, width).clicked() {
                    viewer.open(NAMES[i]);
                }
            }
        });
    }
}

/// A picture, a name, a line: all of it a button.
fn card(ui: &mut Ui, name: &str, texture: Option<&TextureHandle>, width: f32) -> Response {
    let height = (width * 9.0 / 16.0).round();
    let (rect, response) = ui.allocate_exact_size(vec2(width, height + TEXT), Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, name));
    let response = response.on_hover_cursor(egui::CursorIcon::PointingHand);
    let visuals = ui.style().interact(&response);
    let is_lit = response.hovered() || response.has_focus();
    let fill = if is_lit { visuals.weak_bg_fill } else { ui.visuals().faint_bg_color };
    ui.painter().rect_filled(rect, 8.0, fill);
    let picture = Rect::from_min_size(rect.min, vec2(width, height));
    if let Some(texture) = texture {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let round = egui::CornerRadius { nw: 8, ne: 8, sw: 0, se: 0 };
        let image = egui::epaint::RectShape::filled(picture, round, Color32::WHITE).with_texture(texture.id(), uv);
        ui.painter().add(image);
    }
    let (strong, weak) = (ui.visuals().strong_text_color(), ui.visuals().text_color());
    let at = picture.left_bottom() + vec2(10.0, 7.0);
    let title = ui.painter().text(at, Align2::LEFT_TOP, name, FontId::proportional(14.5), strong);
    let galley = ui.painter().layout(describe(name).to_owned(), FontId::proportional(12.0), weak, width - 20.0);
    ui.painter().with_clip_rect(rect).galley(pos2(at.x, title.max.y + 2.0), galley, weak);
    if is_lit {
        let stroke = Stroke::new(1.5, ui.visuals().selection.bg_fill);
        ui.painter().rect_stroke(rect, 8.0, stroke, StrokeKind::Inside);
    }
    response
}

fn recent(ui: &mut Ui, viewer: &mut Viewer) {
    if viewer.remembered.recent.is_empty() {
        return;
    }
    let wake = viewer.wake();
    viewer.start.absent.update(&viewer.remembered.recent, ui.input(|i| i.time), wake);
    ui.add_space(4.0);
    ui.label(egui::RichText::new("Opened before").size(16.0).strong());
    ui.spacing_mut().item_spacing = vec2(8.0, 4.0);
    let (mut open, mut remove) = (None, None);
    for path in &viewer.remembered.recent {
        let is_there = !viewer.start.absent.files.contains(path);
        let file = Path::new(path);
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let folder = file.parent().map(|folder| folder.to_string_lossy()).unwrap_or_default();
        ui.push_id(path, |ui| {
            ui.horizontal(|ui| {
                let forget = ui.add(egui::Button::new("×").frame(false)).on_hover_text("Forget this file");
                forget.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, true, format!("Forget {name}")));
                if forget.clicked() {
                    remove = Some(path.clone());
                }
                let button = egui::Button::new(name.as_ref()).min_size(vec2(180.0, 0.0)).truncate();
                let response = ui.add_enabled(is_there, button);
                let response =
                    response.on_hover_text(path).on_disabled_hover_text(format!("{path}: not there any more"));
                if response.clicked() {
                    open = Some(path.clone());
                }
                let text = if is_there { folder.to_string() } else { format!("{folder} (missing)") };
                ui.add(egui::Label::new(egui::RichText::new(text).weak()).truncate());
            });
        });
    }
    if let Some(path) = remove {
        viewer.remembered.recent.retain(|other| *other != path);
    }
    if let Some(path) = open {
        viewer.open(path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_has_a_thumbnail() {
        for name in NAMES {
            assert_eq!(decode(name).map(|image| image.size), Some([320, 180]), "{name}");
            assert!(thumbnail(name).is_some_and(|bytes| bytes.len() < 50_000), "{name}");
        }
    }

    /// A look that does not come to its end holds nothing up.
    #[test]
    fn files_are_there_until_it_is_known_that_they_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let [there, gone] = ["there.obj", "gone.obj"].map(|name| folder.path().join(name));
        std::fs::write(&there, "").unwrap();
        let files = [there, gone.clone()].map(|path| path.to_string_lossy().into_owned());
        let (woken, wakes) = mpsc::channel();
        let wake: Wake = std::sync::Arc::new(move || woken.send(()).unwrap());
        let mut absent = Absent::default();
        let (never, look) = mpsc::channel();
        absent.look = Some(look);
        for time in 0..100 {
            absent.update(&files, f64::from(time), wake.clone());
        }
        assert!(absent.files.is_empty() && wakes.try_recv().is_err());
        drop(never);
        absent.update(&files, 100.0, wake.clone());
        assert!(absent.files.is_empty());
        wakes.recv().unwrap();
        absent.update(&files, 100.1, wake.clone());
        assert_eq!(absent.files, files[1..]);
        std::fs::write(gone, "").unwrap();
        absent.update(&files, 102.0, wake.clone());
        assert!(absent.look.is_none());
        absent.update(&files, 102.2, wake.clone());
        wakes.recv().unwrap();
        absent.update(&files, 102.3, wake);
        assert!(absent.files.is_empty());
    }

    #[test]
    fn cards_fill_the_width() {
        assert_eq!(columns(1232.0, 5), (5, 235.0));
        assert_eq!(columns(1720.0, 5), (5, 332.0));
        assert_eq!(columns(700.0, 5).0, 3);
        assert_eq!(columns(100.0, 5), (1, 100.0));
        assert_eq!(columns(3000.0, 5), (5, MOST_CARD));
    }
}
