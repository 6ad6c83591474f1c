//! The picture beside a reference: an .exr, or the picture of a moment ago.

use std::path::Path;
use std::sync::{Arc, Weak};

use eframe::egui;
use egui::{Color32, ColorImage, Key, PointerButton, Rect, Response, Stroke, pos2};
use sunfleck::output;
use sunfleck::output::difference::Measure;

use super::app::Viewer;
use super::charts::short;
use super::engine::{Comparison, Message, Reference, View};
use super::files;
use super::focus::list;
use super::inspect::{row, table};
use super::keys::Keyboard;
use super::settings::number::{Number, drag};
use super::settings::widgets::{choice, within};

/// What is said of the range of a difference.
pub const RANGE: &str = "Where the colours of a difference end; what is above has the last of them, and what is not finite is \
                         magenta. Automatic, and 0: at the 99th percentile, rounded up, without what differs by more than ten \
                         times white or ten times the reference.";

/// Half the width of what the line of the wipe is held by, points.
const HOLD: f32 = 6.0;

/// How the reference is shown.
pub struct CompareView {
    /// Where the line is, share of the picture's width.
    wipe: f32,
    /// What the line is held by, as it was last drawn.
    hold: Option<Rect>,
    /// And what it was made from.
    texture: Option<(Weak<ColorImage>, egui::TextureHandle)>,
    /// The reference that was last looked at.
    seen: Option<Weak<Reference>>,
}

impl Default for CompareView {
    fn default() -> Self {
        Self { wipe: 0.5, hold: None, texture: None, seen: None }
    }
}

impl CompareView {
    /// The texture is of a scene or a window that goes.
    pub fn forget(&mut self) {
        self.texture = None;
    }

    /// The texture of `image`.
    fn take(&mut self, ctx: &egui::Context, image: &Arc<ColorImage>) -> egui::TextureId {
        let options = egui::TextureOptions { magnification: egui::TextureFilter::Nearest, ..Default::default() };
        let (of, texture) = self
            .texture
            .get_or_insert_with(|| (Arc::downgrade(image), ctx.load_texture("reference", Arc::clone(image), options)));
        if of.as_ptr() != Arc::as_ptr(image) {
            texture.set(Arc::clone(image), options);
            *of = Arc::downgrade(image);
        }
        texture.id()
    }
}

/// All, in the order they are listed in.
fn comparisons() -> impl Iterator<Item = Comparison> + Clone {
    let differences = Measure::ALL.into_iter().map(Comparison::Difference);
    [Comparison::Off, Comparison::Wipe].into_iter().chain(differences).chain([Comparison::Flip])
}

/// Name, and what it is.
pub fn describe(comparison: Comparison) -> (&'static str, &'static str) {
    match comparison {
        Comparison::Off => ("Off", "The picture alone; hold Shift to see the reference in its place"),
        Comparison::Wipe => ("Wipe", "The picture left of a line, the reference right of it; drag the line"),
        Comparison::Difference(measure) => match measure {
            Measure::Absolute => ("Absolute difference", "|x − y|, mean of the channels"),
            Measure::Squared => ("Squared difference", "(x − y)², mean of the channels"),
            Measure::Relative => ("Relative difference", "|x − y| / (|y| + 0.01), mean of the channels"),
            Measure::RelativeSquared => ("Relative squared", "(x − y)² / (y² + 0.01); its mean is the relMSE"),
            Measure::Signed => ("Signed difference", "x − y: green where the picture is brighter, red where darker"),
        },
        Comparison::Flip => ("FLIP", "The difference as eyes see it, of both as they are shown now"),
    }
}

impl Viewer {
    /// The next of the list, from the last to the first; says so if there is nothing to compare with.
    pub fn next_comparison(&mut self, ui: &egui::Ui) {
        if let Some(why) = self.no_comparison() {
            self.say(ui, Message::Warning(why));
            return;
        }
        let wanted = &mut self.wanted.painting.comparison;
        let mut following = comparisons().cycle().skip_while(|comparison| comparison != wanted).skip(1);
        *wanted = following.next().unwrap_or_default();
    }

    /// Why the picture cannot be compared.
    fn no_comparison(&self) -> Option<String> {
        match &self.now.reference {
            Some(reference) => unfit(reference, self.full_size()?),
            None => Some("nothing to compare with: open or drop an .exr, or pin the picture".to_owned()),
        }
    }

    /// Says it of a reference that is new.
    pub fn look_at_reference(&mut self, ui: &egui::Ui) {
        let reference = self.now.reference.clone();
        let seen = self.compare.seen.as_ref().map(Weak::as_ptr);
        let is_same = seen == reference.as_ref().map(Arc::as_ptr);
        // The picture's size is known once there is a scene.
        if is_same || reference.is_some() && self.full_size().is_none() {
            return;
        }
        if let (Some(_), Some(why)) = (&reference, self.no_comparison()) {
            self.say(ui, Message::Warning(why));
        }
        self.compare.seen = reference.as_ref().map(Arc::downgrade);
    }
}

/// Why a reference cannot be compared with a picture of `size`.
fn unfit(reference: &Reference, size: [u32; 2]) -> Option<String> {
    let [width, height] = size;
    let picture = &reference.picture;
    let name = &reference.name;
    if picture.size != size {
        let [w, h] = picture.size;
        let hint = if w == 2 * h { "; is it an environment? Settings, Environment, Source" } else { "" };
        return Some(format!("{name} has {w}×{h} pixels, the picture {width}×{height}: they cannot be compared{hint}"));
    }
    let is_whole = picture.crop == [0, 0, width, height];
    (!is_whole).then(|| format!("{name} has only a part of the picture: they cannot be compared"))
}

/// Of the panel.
pub fn section(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let reference = viewer.now.reference.clone();
    ui.horizontal(|ui| {
        if ui.button("Open …").on_hover_text("An .exr as the reference").clicked() {
            files::ask_reference(viewer);
        }
        let snapshot = viewer.now.snapshot.clone().filter(|snapshot| !snapshot.is_preview);
        let pin = ui.add_enabled(snapshot.is_some(), egui::Button::new("Pin"));
        if let (true, Some(snapshot)) =
            (pin.on_hover_text("The picture as it is now as the reference").clicked(), snapshot)
        {
            let name = format!("picture after {}", crate::progress::iterations(snapshot.film.n_iterations));
            let set = viewer.engine().choose_reference();
            // Of a large one the copy takes longer than a frame.
            std::thread::spawn(move || set(Some(Reference { name, picture: snapshot.picture() })));
        }
        let clear = ui.add_enabled(reference.is_some(), egui::Button::new("Clear"));
        if clear.on_hover_text("Without a reference again").clicked() {
            viewer.engine().choose_reference()(None);
        }
    });
    let Some(reference) = reference else {
        ui.weak("No reference. Open or drop an .exr, or pin the picture.");
        return;
    };
    ui.add(egui::Label::new(&reference.name).truncate()).on_hover_text("The reference");
    if let Some(why) = viewer.full_size().and_then(|size| unfit(&reference, size)) {
        ui.colored_label(ui.visuals().warn_fg_color, why);
        return;
    }
    let wanted = &mut viewer.wanted.painting.comparison;
    let (name, text) = describe(*wanted);
    let combo = egui::ComboBox::from_id_salt("comparison").selected_text(name).width(160.0).height(400.0);
    let response = list(ui, combo, |ui| {
        for comparison in comparisons() {
            let (name, text) = describe(comparison);
            ui.selectable_value(wanted, comparison, name).on_hover_text(text);
        }
    });
    response.on_hover_text(format!("{text}. Does not restart the estimate."));
    if let Comparison::Difference(measure) = *wanted {
        range(ui, viewer, measure);
    }
    let painted = viewer.picture.painted();
    if let Some(problem) = painted.and_then(|painted| painted.problem.as_ref()) {
        ui.colored_label(ui.visuals().error_fg_color, problem);
    }
    let figures = painted.and_then(|painted| painted.figures);
    table(ui, "figures", |ui| {
        let number = |v: f64| short(v as f32);
        row(ui, "relMSE", figures.map(|f| number(f.rel_mse)), "Mean of (x − y)² / (y² + 0.01)");
        let trimmed = figures.map(|f| number(f.rel_mse_trimmed));
        row(
            ui,
            "relMSE, trimmed",
            trimmed,
            "The same without the worst 0.1 % of the pixels: what is left when fireflies are",
        );
        row(
            ui,
            "Mean x − y",
            figures.map(|f| number(f.mean_difference)),
            "Above 0: the picture is brighter, W/(m² sr)",
        );
        let share = figures.and_then(|f| f.relative_mean_difference);
        let relative = share.map(|share| format!("{} %", number(100.0 * share)));
        row(ui, "Relative to y", relative, "Mean of x − y over the mean of y");
        row(ui, "Largest difference", figures.map(|f| number(f.max_difference)), "Largest |x − y|, W/(m² sr)");
        if let Some(f) = figures.filter(|f| f.not_finite > 0) {
            let text = format!("{} of {}", f.not_finite, f.not_finite + f.pixels);
            row(ui, "Not finite", Some(text), "Left out, not finite in the picture or the reference: magenta");
        }
        let shown = painted.and_then(|painted| Some((painted.painting.comparison, painted.mean?)));
        let flip = shown.filter(|(comparison, _)| *comparison == Comparison::Flip);
        row(ui, "FLIP", flip.map(|(_, mean)| number(mean)), "Mean; measured while FLIP is shown");
        let difference = shown.filter(|(comparison, _)| *comparison != Comparison::Flip);
        row(ui, "Mean shown", difference.map(|(_, mean)| number(mean)), "Of the difference that is shown");
    });
}

/// The end of a difference's colours: automatic, or a number.
fn range(ui: &mut egui::Ui, viewer: &mut Viewer, measure: Measure) {
    let shown = viewer.picture.painted().filter(|p| p.difference() == Some(Comparison::Difference(measure)));
    let automatic = shown.and_then(|painted| painted.legend.as_ref()).map_or(1.0, |legend| legend.range[1]);
    let end = &mut viewer.wanted.painting.ends[measure as usize];
    ui.horizontal(|ui| {
        let label = ui.label("Range").on_hover_text(RANGE);
        let mut is_given = end.is_some();
        let all = [(false, "Automatic", "By the differences that there are."), (true, "Given", "Up to a number.")];
        let size = egui::vec2(100.0, ui.spacing().interact_size.y);
        let mut inside = within(ui, size, egui::Layout::left_to_right(egui::Align::Center));
        let response = choice(&mut inside, "range", &mut is_given, &all);
        if response.labelled_by(label.id).on_hover_text(RANGE).changed() {
            *end = is_given.then_some(automatic);
        }
        if let Some(end) = end {
            let (speed, mut typed) = (0.01 * f64::from(*end), *end);
            let field = drag(ui, &mut typed, Number::Plain, speed, 0.0..=f32::MAX);
            // A drag comes near to 0, which is automatic, and not there.
            if typed > 0.0 || !field.dragged() {
                *end = typed;
            }
            field.labelled_by(label.id).on_hover_text(RANGE);
        }
        *end = end.filter(|&end| end > 0.0);
    });
}

/// The line of the wipe, if the last frame had one; this one has it if [`overlay`] draws it. Only the left button moves it;
/// drags with another are for the camera.
pub fn handle(ui: &egui::Ui, viewer: &mut Viewer) -> Option<Response> {
    let response = ui.interact(viewer.compare.hold.take()?, egui::Id::unique("wipe"), egui::Sense::drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Slider, true, "Wipe"));
    Some(response)
}

/// Over the picture at `rect`; right of which place, points, the reference is seen. `handle` is that of the line.
pub fn overlay(
    ui: &egui::Ui,
    viewer: &mut Viewer,
    painter: &egui::Painter,
    rect: Rect,
    handle: Option<&Response>,
) -> Option<f32> {
    let held_before = handle.map(|handle| handle.rect);
    if handle.is_some_and(Response::dragged) {
        // The camera is turned by it, and its previews have no line.
        viewer.compare.hold = held_before;
    }
    let painted = viewer.picture.painted().cloned()?;
    let (Some((reference, _)), Some(image)) = (&painted.reference, painted.reference_texture()) else {
        if viewer.now.reference.is_none() {
            viewer.compare.forget();
        }
        return None;
    };
    let visible = rect.intersect(painter.clip_rect());
    let is_asked = is_asked_for(ui, &viewer.keyboard, visible);
    let is_wiped = painted.painting.comparison == Comparison::Wipe;
    if !(is_asked || is_wiped) || !visible.is_positive() {
        return None;
    }
    let view = &mut viewer.compare;
    let texture = view.take(ui.ctx(), image);
    if is_asked {
        painter.image(texture, rect, uv(0.0), Color32::WHITE);
        name(painter, visible.left_top(), egui::Align2::LEFT_TOP, &reference.name);
        return Some(f32::NEG_INFINITY);
    }
    let (x, from) = line(view.wipe, rect, visible);
    let hold = Rect::from_x_y_ranges(x - HOLD..=x + HOLD, visible.y_range());
    view.hold = Some(hold);
    if view.hold != held_before {
        // Which takes the pointer from the next frame on.
        ui.ctx().request_repaint();
    }
    let is_held = handle.is_some_and(|handle| handle.dragged_by(PointerButton::Primary));
    let is_marked = is_held || handle.is_some_and(|handle| handle.hovered() && !handle.dragged());
    let right = Rect::from_min_max(pos2(x, rect.top()), rect.max);
    painter.image(texture, right, uv(from), Color32::WHITE);
    let (width, color) = if is_marked { (2.5, Color32::WHITE) } else { (1.5, Color32::LIGHT_GRAY) };
    painter.vline(x + 1.0, visible.y_range(), Stroke::new(width + 1.0, Color32::from_black_alpha(140)));
    painter.vline(x, visible.y_range(), Stroke::new(width, color));
    let left = match painted.painting.view {
        View::Picture => "picture",
        view => view.name(),
    };
    name(painter, pos2(x - HOLD, visible.top()), egui::Align2::RIGHT_TOP, left);
    name(painter, pos2(x + HOLD, visible.top()), egui::Align2::LEFT_TOP, &reference.name);
    if is_marked {
        ui.ctx().set_cursor_icon(egui::CursorIcon::ResizeHorizontal);
    }
    if let (true, Some(pointer)) = (is_held, handle.and_then(Response::interact_pointer_pos)) {
        view.wipe = ((pointer.x - rect.left()) / rect.width()).clamp(0.0, 1.0);
        ui.ctx().request_repaint();
    }
    Some(x)
}

/// Whether the reference is to be seen in the place of the picture: Shift, and nothing else.
fn is_asked_for(ui: &egui::Ui, keyboard: &Keyboard, visible: Rect) -> bool {
    if ui.ctx().text_edit_focused() {
        return false;
    }
    ui.input(|i| {
        i.modifiers.shift_only()
            && keyboard.holds_only(&[Key::ShiftLeft, Key::ShiftRight])
            && !i.pointer.any_down()
            && i.pointer.latest_pos().is_some_and(|p| visible.contains(p))
    })
}

/// Where the line at `share` of the picture is drawn, kept in sight, and which share that is.
fn line(share: f32, rect: Rect, visible: Rect) -> (f32, f32) {
    let x = egui::lerp(rect.x_range(), share).clamp(visible.left(), visible.right());
    (x, (x - rect.left()) / rect.width())
}

/// The part of a texture right of `from`.
fn uv(from: f32) -> Rect {
    Rect::from_min_max(pos2(from, 0.0), pos2(1.0, 1.0))
}

fn name(painter: &egui::Painter, at: egui::Pos2, anchor: egui::Align2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), egui::FontId::proportional(12.0), Color32::WHITE);
    let rect = anchor.anchor_size(at, galley.size() + egui::vec2(12.0, 8.0)).shrink2(egui::vec2(2.0, 2.0));
    painter.rect_filled(rect, 3.0, Color32::from_black_alpha(150));
    painter.galley(rect.min + egui::vec2(4.0, 2.0), galley, Color32::WHITE);
}

/// Reads a reference, on a thread of its own.
pub fn load(viewer: &Viewer, path: &Path) {
    let (path, set, say) = (path.to_owned(), viewer.engine().choose_reference(), viewer.engine().speaker());
    std::thread::spawn(move || match output::exr::read(&path) {
        Ok(picture) => {
            let name = files::name_of(&path).into_owned();
            say(Message::Said(format!("{name} is the reference")));
            set(Some(Reference { name, picture }));
        }
        Err(error) => say(Message::Error(crate::one_line(&error.to_string()))),
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::output::Picture;

    #[test]
    fn the_line_stays_in_sight() {
        let rect = Rect::from_min_max(pos2(-100.0, 0.0), pos2(300.0, 100.0));
        let visible = Rect::from_min_max(pos2(0.0, 0.0), pos2(200.0, 100.0));
        assert_eq!(line(0.5, rect, visible), (100.0, 0.5));
        assert_eq!(line(0.0, rect, visible), (0.0, 0.25));
        assert_eq!(line(1.0, rect, visible), (200.0, 0.75));
    }

    #[test]
    fn references_of_other_sizes_are_named_and_refused() {
        let picture = |size: [u32; 2], crop| Picture { size, crop, rgb: vec![], variance: None };
        let reference = |size, crop| Reference { name: "far.exr".into(), picture: picture(size, crop) };
        assert_eq!(unfit(&reference([8, 6], [0, 0, 8, 6]), [8, 6]), None);
        let why = unfit(&reference([8, 6], [0, 0, 8, 6]), [9, 6]).unwrap();
        assert!(why.contains("far.exr") && why.contains("8×6") && why.contains("9×6"), "{why}");
        assert!(unfit(&reference([8, 6], [1, 0, 8, 6]), [8, 6]).unwrap().contains("part"));
        assert!(!why.contains("environment"));
        assert!(unfit(&reference([8, 4], [0, 0, 8, 4]), [8, 6]).unwrap().contains("environment"));
    }

    #[test]
    fn every_comparison_has_a_name_of_its_own() {
        let names: std::collections::BTreeSet<_> = comparisons().map(|c| describe(c).0).collect();
        assert_eq!(names.len(), comparisons().count());
    }
}
