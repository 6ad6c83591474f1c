//! The picture in the middle: shown, zoomed into, and turned by hand.

use std::sync::Arc;

use eframe::egui;
use egui::emath::GuiRounding;
use egui::{Key, PointerButton, Rect, Vec2, pos2, vec2};
use glam::Vec3;
use sunfleck::inspect;
use sunfleck::scene::Camera;
use sunfleck::scene::settings::{CameraSettings, Settings};

use super::app::Viewer;
use super::camera::{Pace, Rig};
use super::charts::short;
use super::engine::{Painted, Phase};
use super::keys::Keyboard;

/// Radians an orbit turns over the picture's height.
const ORBIT: f32 = 3.0;
/// The same for looking about.
const LOOK: f32 = 1.2;
/// Steps of approach a notch of the wheel makes.
const WHEEL: f32 = 1.0 / 50.0;
/// Seconds after the last motion at which the camera counts as resting.
const REST: f64 = 0.15;
/// Points a pixel, from which on its value is written into it.
const VALUES_FROM: f32 = 56.0;
/// Points a pixel, at most.
const MOST_ZOOM: f32 = 128.0;

/// How the picture is shown, and the camera that is moved in it.
#[derive(Default)]
pub struct PictureView {
    texture: Option<egui::TextureHandle>,
    painted: Option<Arc<Painted>>,
    /// Pixels of the screen a pixel; fitting the window if none.
    pub zoom: Option<f32>,
    /// From the window's middle to the picture's, points.
    offset: Vec2,
    rig: Option<(Arc<Settings>, Rig)>,
    /// When the camera last moved.
    moved: Option<f64>,
    /// Whether keys move the camera, or did so since Ctrl is held: Ctrl makes it slow, and none of its keys a shortcut.
    pub flying: bool,
    /// Pixel under the cursor.
    pub hovered: Option<[usize; 2]>,
    /// Where the picture is, points.
    pub rect: Option<Rect>,
    /// The room that there is for it, points.
    pub area: Option<Rect>,
}

impl PictureView {
    /// Whether keys are for flying, by where they lie; else they are shortcuts, by their letters.
    pub fn flies(&self, input: &egui::InputState, keyboard: &Keyboard) -> bool {
        let begins = || [Key::W, Key::A, Key::S, Key::D].into_iter().any(|place| keyboard.begins_flight(place));
        let is_modified = input.modifiers.command || input.modifiers.alt;
        self.flying || input.pointer.secondary_down() || !is_modified && begins()
    }

    /// What is on the screen.
    pub fn painted(&self) -> Option<&Arc<Painted>> {
        self.painted.as_ref()
    }

    /// The whole picture in the window.
    pub fn fit(&mut self) {
        (self.zoom, self.offset) = (None, Vec2::ZERO);
    }

    /// Something moves, at `time`, seconds: previews until it rests.
    pub fn move_on(&mut self, time: f64) {
        self.moved = Some(time);
    }

    /// The picture of a scene that goes: it would keep the scene in memory.
    pub fn forget(&mut self) {
        (self.texture, self.painted, self.hovered) = (None, None, None);
        // The scene may have another camera now.
        self.rig = None;
    }

    /// Whatever moved: in a window with another clock it would rest when that has come as far.
    pub fn rest(&mut self) {
        self.moved = None;
    }

    fn take(&mut self, ctx: &egui::Context, painted: &Arc<Painted>) {
        if self.painted.as_ref().is_some_and(|now| Arc::ptr_eq(now, painted)) {
            return;
        }
        let image = Arc::clone(painted.texture());
        let options = egui::TextureOptions {
            magnification: egui::TextureFilter::Nearest,
            minification: egui::TextureFilter::Linear,
            ..Default::default()
        };
        match &mut self.texture {
            Some(texture) => texture.set(image, options),
            None => self.texture = Some(ctx.load_texture("picture", image, options)),
        }
        self.painted = Some(Arc::clone(painted));
    }
}

/// The picture, in all of the room there is.
pub fn show(ui: &mut egui::Ui, viewer: &mut Viewer) {
    let (area, response) = ui.allocate_exact_size(ui.available_size(), egui::Sense::click_and_drag());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, "Picture"));
    ui.painter().rect_filled(area, 0.0, egui::Color32::from_gray(24));
    viewer.picture.area = Some(area);
    if let Some(painted) = viewer.now.painted.clone() {
        viewer.picture.take(ui.ctx(), &painted);
    }
    let line = super::compare::handle(ui, viewer);
    let hand = match line.clone().filter(|line| line.dragged() && !line.dragged_by(PointerButton::Primary)) {
        Some(line) => response.clone() | line,
        None => response.clone(),
    };
    move_camera(ui, viewer, area, &hand);
    super::failure::show(ui, viewer, area);
    let Some(painted) = viewer.picture.painted.clone() else {
        waiting(ui, viewer, area);
        return;
    };
    // A preview fills the place of the picture it stands for.
    let size = painted.snapshot.as_ref().params.size;
    let full = if painted.snapshot.is_preview { viewer.full_size().unwrap_or(size) } else { size };
    let full = vec2(full[0] as f32, full[1] as f32);
    let rect = place(ui, viewer, area, full, &response);
    viewer.picture.rect = Some(rect);
    let painter = ui.painter_at(area);
    if let Some(texture) = &viewer.picture.texture {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        painter.image(texture.id(), rect, uv, egui::Color32::WHITE);
    }
    let reference_from = super::compare::overlay(ui, viewer, &painter, rect, line.as_ref());
    // Beside the reference's line too, which takes the pointer for itself.
    let pointer = ui.input(|i| i.pointer.latest_pos()).filter(|p| response.contains_pointer() && area.contains(*p));
    let at = pointer.and_then(|p| on_film(rect, painted.size, p));
    let hovered = at.map(|at| [at.x as usize, at.y as usize]);
    if viewer.picture.hovered != hovered {
        viewer.picture.hovered = hovered;
        // The panel that tells of it was drawn before.
        ui.ctx().request_repaint();
    }
    click(ui, viewer, &response, rect, &painted);
    if rect.width() / painted.size[0] as f32 >= VALUES_FROM {
        values(&painter, area, rect, &painted, reference_from);
    }
    if matches!(viewer.now.phase, Phase::Loading | Phase::Preparing) {
        waiting(ui, viewer, area);
    }
}

/// A place on the screen in film coordinates; none beside the picture.
fn on_film(rect: Rect, size: [usize; 2], point: egui::Pos2) -> Option<glam::Vec2> {
    let [width, height] = size.map(|n| n as f32);
    let at = (point - rect.min) * vec2(width, height) / rect.size();
    let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width && at.y < height;
    inside.then(|| glam::vec2(at.x, at.y))
}

/// Selects what is clicked on; a double click also turns to it.
fn click(ui: &egui::Ui, viewer: &mut Viewer, response: &egui::Response, rect: Rect, painted: &Painted) {
    if !response.clicked_by(PointerButton::Primary) || viewer.had_popup {
        return;
    }
    let Some(point) = response.interact_pointer_pos() else { return };
    let snapshot = &painted.snapshot;
    // In the middle of the pixel, as the panel that tells of it.
    let at = on_film(rect, painted.size, point).map(|at| at.floor() + 0.5);
    let hit = at.and_then(|at| inspect::pick(&snapshot.scene, &snapshot.view(), at));
    let n_materials = viewer.opened().map_or(0, |opened| opened.loaded.scene.materials.len());
    viewer.selected = hit.map(|hit| hit.material as usize).filter(|&index| index < n_materials);
    if let (true, Some(hit)) = (response.double_clicked_by(PointerButton::Primary), hit) {
        // Nothing moves.
        viewer.change_rig(ui.input(|i| i.time), &mut |rig| {
            rig.set_pivot(hit.position);
            rig.focus_on(hit.position);
        });
    }
}

/// What the camera sees first, as it stands now, where `point` is in a picture shown at `rect`; world space, metres.
fn under(viewer: &mut Viewer, rect: Rect, point: egui::Pos2) -> Option<Vec3> {
    let painted = Arc::clone(viewer.picture.painted()?);
    let (scene, params) = (&painted.snapshot.scene, &painted.snapshot.params);
    let camera = viewer.rig()?.camera().pack(params.size[0], params.size[1]);
    let view = inspect::View::new(camera, params.size, params.crop);
    let hit = inspect::pick(scene, &view, on_film(rect, painted.size, point)?)?;
    Some(hit.position)
}

/// What is being waited for.
fn waiting(ui: &egui::Ui, viewer: &Viewer, area: Rect) {
    let text = match &viewer.now.phase {
        Phase::Loading => "Reading the scene …".to_owned(),
        Phase::Preparing => "Preparing the scene …".to_owned(),
        Phase::Starting => "First photons …".to_owned(),
        Phase::Rendering => "First iteration …".to_owned(),
        _ => return,
    };
    let color = egui::Color32::from_gray(220);
    let font = egui::FontId::proportional(16.0);
    let galley = ui.painter().layout(text, font, color, (area.width() - 48.0).max(50.0));
    let rect = Rect::from_center_size(area.center(), galley.size());
    ui.painter().rect_filled(rect.expand(10.0), 6.0, egui::Color32::from_black_alpha(190));
    ui.painter().galley(rect.min, galley, color);
}

/// Zooms and shifts; where the picture is.
fn place(ui: &egui::Ui, viewer: &mut Viewer, area: Rect, size: Vec2, response: &egui::Response) -> Rect {
    let view = &mut viewer.picture;
    let scale = ui.pixels_per_point();
    let fitting = scale * (area.size() / size).min_elem();
    let rect_at = |zoom: f32, offset: Vec2| Rect::from_center_size(area.center() + offset, size * zoom / scale);
    // Ctrl and the wheel, or two fingers.
    let factor = if response.contains_pointer() { ui.input(egui::InputState::zoom_delta) } else { 1.0 };
    if factor != 1.0
        && let Some(cursor) = ui.input(|i| i.pointer.latest_pos())
    {
        let before = view.zoom.unwrap_or(fitting);
        let after = (before * factor).clamp(fitting.min(1.0), MOST_ZOOM);
        // What is under the cursor stays there.
        let from_cursor = rect_at(before, view.offset).center() - cursor;
        view.offset = cursor + from_cursor * (after / before) - area.center();
        view.zoom = (after != fitting).then_some(after);
    }
    if view.zoom.is_none() {
        view.offset = Vec2::ZERO;
    }
    if response.dragged_by(PointerButton::Primary) && ui.input(|i| i.modifiers.command) && view.zoom.is_some() {
        view.offset += response.drag_delta();
    }
    let rect = rect_at(view.zoom.unwrap_or(fitting), view.offset);
    // From half a pixel of the screen on, rounding would double some of the picture's pixels and leave others out.
    Rect::from_min_size(rect.min.round_to_pixels(scale), rect.size())
}

/// Numbers in pixels large enough; those of the reference where their middle is right of `reference_from`, points.
fn values(painter: &egui::Painter, area: Rect, rect: Rect, painted: &Painted, reference_from: Option<f32>) {
    let side = rect.width() / painted.size[0] as f32;
    let visible = area.intersect(rect);
    let range = |min: f32, max: f32, n: usize| (min / side).max(0.0) as usize..((max / side).ceil() as usize).min(n);
    for y in range(visible.min.y - rect.min.y, visible.max.y - rect.min.y, painted.size[1]) {
        for x in range(visible.min.x - rect.min.x, visible.max.x - rect.min.x, painted.size[0]) {
            let i = y * painted.size[0] + x;
            let corner = rect.min + vec2(x as f32, y as f32) * side;
            let middle = corner + Vec2::splat(0.5 * side);
            let reference = painted.reference.as_ref().filter(|_| reference_from.is_some_and(|from| middle.x > from));
            let (image, value) = match reference {
                Some((_, image)) => (image, painted.reference_value(x, y)),
                None => (&painted.image, painted.value(x, y)),
            };
            let [r, g, b, _] = image.pixels[i].to_array();
            let shade = [r, g, b].map(u32::from).iter().sum::<u32>();
            let color = if shade > 384 { egui::Color32::BLACK } else { egui::Color32::WHITE };
            let lines: Vec<String> = value.iter().map(|&v| short(v)).collect();
            painter.text(
                middle,
                egui::Align2::CENTER_CENTER,
                lines.join("\n"),
                egui::FontId::monospace((side / 5.5).min(14.0)),
                color,
            );
        }
    }
}

/// Mouse and keys on the camera.
fn move_camera(ui: &egui::Ui, viewer: &mut Viewer, area: Rect, response: &egui::Response) {
    let time = ui.input(|i| i.time);
    if viewer.rig().is_none() {
        return;
    }
    let turn = response.drag_delta() / area.height().max(1.0);
    // What is shown follows the cursor, however large it is shown.
    let shown = viewer.picture.rect.unwrap_or(area);
    let height = shown.height().max(1.0);
    // What the pointer moved before the press, perhaps in the same frame, is no drag.
    let is_new = ui.input(|i| i.pointer.any_pressed());
    let drag = if is_new { Vec2::ZERO } else { response.drag_delta() / height };
    let (shift, command) = ui.input(|i| (i.modifiers.shift, i.modifiers.command));
    if drag != Vec2::ZERO && !command {
        let is_pan = response.dragged_by(PointerButton::Middle) || shift && response.dragged_by(PointerButton::Primary);
        if is_pan {
            viewer.move_rig(time, &mut |rig| rig.pan(glam::vec2(drag.x, drag.y)));
        } else if response.dragged_by(PointerButton::Primary) {
            // What is in front of the pivot follows the cursor.
            viewer.move_rig(time, &mut |rig| rig.orbit(ORBIT * turn.x, -ORBIT * turn.y));
        } else if response.dragged_by(PointerButton::Secondary) {
            viewer.move_rig(time, &mut |rig| rig.look(LOOK * turn.x, -LOOK * turn.y));
        }
    }
    // On the reference's line too, which takes the pointer for itself.
    if response.contains_pointer() && !command {
        let wheel = ui.input(|i| i.smooth_scroll_delta().y);
        if wheel != 0.0 {
            let pointer = ui.input(|i| i.pointer.latest_pos());
            let under = pointer.and_then(|p| under(viewer, shown, p));
            let cursor = pointer.map(|p| (p - shown.center()) / height).map(|p| glam::vec2(p.x, p.y));
            viewer.move_rig(time, &mut |rig| rig.zoom(wheel * WHEEL, cursor, under));
        }
    }
    let typing = ui.ctx().text_edit_focused();
    let was_flying = viewer.picture.flying;
    let flies = !typing && ui.input(|i| !i.modifiers.alt && viewer.picture.flies(i, &viewer.keyboard));
    let direction = if flies { flight(&viewer.keyboard) } else { Vec3::ZERO };
    viewer.picture.flying = direction != Vec3::ZERO || was_flying && command;
    if direction != Vec3::ZERO {
        let (pace, seconds) = ui.input(|i| {
            let pace = if i.modifiers.shift {
                Pace::Fast
            } else if i.modifiers.ctrl {
                Pace::Slow
            } else {
                Pace::Normal
            };
            (pace, i.stable_dt)
        });
        viewer.move_rig(time, &mut |rig| rig.fly(direction.normalize(), pace, seconds));
    }
    let rests = viewer.picture.moved.is_none_or(|moved| time - moved > REST) && direction == Vec3::ZERO;
    viewer.wanted.moving = !rests;
    if !rests {
        // Again soon, to see that it rests.
        ui.ctx().request_repaint_after_secs(0.03);
    }
}

/// x to the right, y up, z forward.
fn flight(keyboard: &Keyboard) -> Vec3 {
    let axis = |plus, minus| f32::from(keyboard.flies(plus)) - f32::from(keyboard.flies(minus));
    Vec3::new(axis(Key::D, Key::A), axis(Key::E, Key::Q), axis(Key::W, Key::S))
}

impl Viewer {
    /// The camera that is moved: that of the settings.
    pub fn rig(&mut self) -> Option<&mut Rig> {
        let settings = Arc::clone(self.edits.now());
        let known = self.picture.rig.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, &settings));
        if !known {
            let (camera, bounds) = (self.camera()?, self.opened()?.bounds);
            // Perhaps a lens or a colour was changed, not the place.
            let rig = match self.picture.rig.take() {
                Some((_, mut rig)) => match rig.change_lens(&camera) {
                    true => rig,
                    false => Rig::new(&camera, bounds).turning_about(rig.up()),
                },
                None => {
                    let opened = self.opened()?;
                    let axis = opened.loaded.scene.cameras.first().map_or(Vec3::Y, Camera::up_axis);
                    let says_focus =
                        opened.read().camera.as_ref().is_some_and(|camera| camera.focus_distance.is_some());
                    Rig::new(&camera, bounds).turning_about(axis).focused(says_focus)
                }
            };
            self.picture.rig = Some((settings, rig));
        }
        self.picture.rig.as_mut().map(|(_, rig)| rig)
    }

    /// Moves the camera, and with it the settings; previews until it rests, if it shows another picture.
    pub fn move_rig(&mut self, time: f64, change: &mut dyn FnMut(&mut Rig)) {
        self.preview_of(time, |viewer| viewer.change_rig(time, change));
    }

    fn change_rig(&mut self, time: f64, change: &mut dyn FnMut(&mut Rig)) {
        let Some(rig) = self.rig() else { return };
        let before = CameraSettings::from(rig.camera());
        change(rig);
        let camera = CameraSettings::from(rig.camera());
        if camera == before {
            return;
        }
        self.edit_at(time, "camera", |settings| settings.camera = Some(camera));
        if let Some((of, _)) = &mut self.picture.rig {
            *of = Arc::clone(self.edits.now());
        }
    }

    /// Of the picture that is wanted, pixels.
    pub fn full_size(&self) -> Option<[u32; 2]> {
        Some(crate::job::size(self.edits.now(), &self.camera()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_film_is_where_the_picture_is() {
        let rect = Rect::from_min_size(pos2(100.0, 50.0), vec2(400.0, 200.0));
        for size in [[400, 200], [100, 50], [1, 1]] {
            let [width, height] = size.map(|n| n as f32);
            let middle = on_film(rect, size, rect.center()).unwrap();
            assert_eq!(middle, glam::vec2(0.5 * width, 0.5 * height));
            assert_eq!(on_film(rect, size, rect.min), Some(glam::Vec2::ZERO));
            for outside in [rect.max, pos2(99.0, 100.0), pos2(300.0, 49.9), pos2(300.0, 250.0)] {
                assert_eq!(on_film(rect, size, outside), None);
            }
        }
        assert_eq!(on_film(Rect::NOTHING, [4, 4], pos2(1.0, 1.0)), None);
    }
}
