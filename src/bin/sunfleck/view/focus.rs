//! What has the keys: it is seen, and what opens by them gives them back. egui 0.37 leaves that to those who use it.

use eframe::egui;
use egui::{Response, Ui};

/// A line around what has the keys, which egui itself hardly marks; a field that is typed into has a cursor.
pub fn mark(ctx: &egui::Context) {
    let focused = ctx.memory(|memory| memory.focused()).and_then(|id| ctx.read_response(id));
    let is_seen = |response: &Response| response.interact_rect.is_positive() && !ctx.text_edit_focused();
    let Some(response) = focused.filter(is_seen) else { return };
    let stroke = egui::Stroke::new(1.5, ctx.global_style().visuals.selection.stroke.color);
    let rect = response.interact_rect.expand(1.0);
    ctx.layer_painter(response.layer_id).rect_stroke(rect, 3.0, stroke, egui::StrokeKind::Outside);
}

/// A list that opens.
pub fn list(ui: &mut Ui, combo: egui::ComboBox, items: impl FnOnce(&mut Ui)) -> Response {
    let shown = combo.show_ui(ui, |ui| close_on_choice(ui, items));
    keep_keys(ui, &shown.response, shown.inner.is_some());
    shown.response
}

/// A menu that opens.
pub fn menu(ui: &mut Ui, name: &str, items: impl FnOnce(&mut Ui)) -> Response {
    let shown = ui.menu_button(name, |ui| close_on_choice(ui, items));
    keep_keys(ui, &shown.response, shown.inner.is_some());
    shown.response
}

/// Choosing by keyboard closes what is open, as by the mouse.
fn close_on_choice(ui: &mut Ui, items: impl FnOnce(&mut Ui)) {
    items(ui);
    let focused = ui.memory(|memory| memory.focused()).and_then(|id| ui.ctx().read_response(id));
    if focused.is_some_and(|item| item.layer_id == ui.layer_id() && item.clicked()) {
        ui.close();
    }
}

/// What was opened by keyboard has the keys again when it closes, however it does: they are no shortcuts then. Not if the mouse
/// was used meanwhile, or something else has got them.
pub fn keep_keys(ui: &Ui, opener: &Response, is_open: bool) {
    let id = opener.id.with("has the keys");
    let pass = ui.ctx().cumulative_pass_nr();
    // A panel that was hidden while a list was open has none to close.
    let noted = ui.data_mut(|data| data.remove_temp::<(u64, bool)>(id)).filter(|(last, _)| last + 1 == pass);
    let is_clicked = ui.input(|i| i.pointer.any_pressed() || i.pointer.any_released());
    let focused = ui.memory(|memory| memory.focused()).and_then(|id| ui.ctx().read_response(id));
    let is_elsewhere = focused.is_some_and(|other| other.layer_id == opener.layer_id && other.id != opener.id);
    let had_keys = noted.map_or_else(|| opener.has_focus(), |(_, had_keys)| had_keys);
    let has_keys = had_keys && !is_clicked && !is_elsewhere;
    if is_open {
        ui.data_mut(|data| data.insert_temp(id, (pass, has_keys)));
    } else if noted.is_some() && has_keys && !egui::Popup::is_any_open(ui.ctx()) {
        opener.request_focus();
    }
}

/// What is higher than its panel, scrolled to what gets the keys.
pub fn scrolling(ui: &mut Ui, content: impl FnOnce(&mut Ui)) {
    egui::ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        content(ui);
        let id = ui.scope_id().with("has the keys");
        let focused = ui.memory(|memory| memory.focused());
        let before =
            ui.data_mut(|data| std::mem::replace(data.get_temp_mut_or_default::<Option<egui::Id>>(id), focused));
        let new = focused.filter(|_| focused != before).and_then(|id| ui.ctx().read_response(id));
        // Of another panel it is all to be seen.
        let is_hidden = |one: &Response| one.interact_rect != one.rect && ui.min_rect().contains(one.rect.center());
        if let Some(new) = new.filter(|new| new.layer_id == ui.layer_id() && is_hidden(new)) {
            ui.scroll_to_rect(new.rect, None);
        }
    });
}
