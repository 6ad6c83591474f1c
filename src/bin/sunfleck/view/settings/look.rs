//! The picture's size, and how it is shown.

use eframe::egui;
use egui::{DragValue, Ui};
use sunfleck::output::tonemap::ToneMap;
use sunfleck::scene::settings::{MAX_EXPOSURE, MAX_SIDE, Settings, Size};

use super::number::{Number, slider, whole};
use super::widgets::{Name, choice, named, row};
use super::{Said, setting};
use crate::view::app::Viewer;
use crate::view::focus::menu;

const SIZE: Name = Name { name: "Size", hint: "Width and height of the picture, pixels. Restarts the estimate." };
const EXPOSURE: Name = Name {
    name: "Exposure",
    hint: "Stops (powers of two) that the picture is brightened by: found by itself, or given. Does not restart the \
           estimate.",
};
const STOPS: Name = Name { name: "Stops", hint: "Exposure, stops. Does not restart the estimate." };
const TONE: Name = Name {
    name: "Tone curve",
    hint: "How bright light is fitted into what a screen can show. Does not restart the estimate.",
};

const PRESETS: [([u32; 2], &str); 8] = [
    ([640, 360], "640 × 360"),
    ([1280, 720], "1280 × 720 (HD)"),
    ([1920, 1080], "1920 × 1080 (Full HD)"),
    ([2560, 1440], "2560 × 1440"),
    ([3840, 2160], "3840 × 2160 (4K)"),
    ([512, 512], "512 × 512"),
    ([1024, 1024], "1024 × 1024"),
    ([2048, 1024], "2048 × 1024"),
];

/// What they do.
const TONES: [(ToneMap, &str, &str); 3] = [
    (ToneMap::Neutral, "PBR Neutral", "Khronos PBR Neutral: colours stay as they are, highlights are compressed."),
    (ToneMap::Agx, "AgX", "Film-like: bright saturated colours fade to white."),
    (ToneMap::Srgb, "sRGB", "None: what is too bright is cut off."),
];

pub fn show(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    size(ui, viewer, read);
    exposure(ui, viewer, read);
    let said = tone_of(&viewer.settings(), read);
    setting(ui, viewer, TONE, said, |ui, tone| choice(ui, "tone", tone, &TONES), |s, tone| s.tonemap = tone);
}

fn tone_of(now: &Settings, read: &Settings) -> Said<ToneMap> {
    Said { now: now.tonemap, read: read.tonemap, default: ToneMap::default() }
}

impl Viewer {
    /// The next of the tone curves, after the last the first.
    pub fn next_tone(&mut self, ui: &Ui) {
        let Some(opened) = self.opened().cloned() else { return };
        let said = tone_of(&self.settings(), &opened.read());
        let at = TONES.iter().position(|(tone, ..)| *tone == said.value()).map_or(0, |at| at + 1);
        let next = said.saying(TONES[at % TONES.len()].0);
        self.edit(ui, TONE.name, |s| s.tonemap = next);
    }
}

fn size(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let Some(mut size) = viewer.full_size() else { return };
    let mut chosen = None;
    let now = viewer.settings();
    let reset = row(ui, SIZE, now.size != read.size, |ui| {
        let each = egui::vec2(((ui.available_width() - 18.0) / 2.0).max(20.0), ui.spacing().interact_size.y);
        let [width, height] = &mut size;
        let drag = |side| DragValue::new(side).range(1..=MAX_SIDE).speed(2.0);
        let mut response = named(whole(ui, each, drag(width)), "Width");
        response |= ui.label("×");
        response |= named(whole(ui, each, drag(height)), "Height");
        if response.changed() {
            chosen = Some(size);
        }
        response
    });
    ui.horizontal_wrapped(|ui| {
        let presets = menu(ui, "Presets", |ui| {
            for (preset, name) in PRESETS {
                if ui.button(name).clicked() {
                    chosen = Some(preset);
                }
            }
        });
        presets.on_hover_text("Usual sizes, pixels. Restarts the estimate.");
        let area = viewer.picture.area.map(|area| area.size() * ui.pixels_per_point());
        let hint = "As many pixels as there is room for in the window, now. Restarts the estimate.";
        if ui.add_enabled(area.is_some(), egui::Button::new("As large as the window")).on_hover_text(hint).clicked() {
            chosen = area.map(|area| [area.x, area.y].map(|side| (side as u32).clamp(1, MAX_SIDE)));
        }
    });
    if let Some(size) = chosen {
        viewer.edit(ui, "size", |s| s.size = Some(Size(size)));
    }
    if reset {
        viewer.reset(ui, |s| s.size = read.size);
    }
}

fn exposure(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let shown = viewer.now.painted.as_ref().map_or(0.0, |painted| painted.exposure);
    let mut exposure = viewer.look().exposure;
    let mut is_given = exposure.is_some();
    let mut changed = false;
    let reset = row(ui, EXPOSURE, exposure != read.exposure, |ui| {
        let all = [(false, "Automatic", "From the picture's own brightness."), (true, "Given", "So many stops.")];
        let response = choice(ui, "exposure", &mut is_given, &all);
        changed = response.changed();
        response
    });
    if changed {
        exposure = is_given.then_some((shown * 10.0).round() / 10.0);
    }
    // A picture's own brightness has more digits than anyone wants to see, and changes with the picture: not while another
    // is typed, which would be lost by it.
    let held = ui.scope_id().with("exposure");
    let shown = ui.data(|data| data.get_temp(held)).unwrap_or((shown * 10.0).round() / 10.0);
    let mut stops = f64::from(exposure.unwrap_or(shown));
    row(ui, STOPS, false, |ui| {
        let response = slider(ui, &mut stops, Number::Stops, -10.0..=10.0);
        if response.changed() {
            exposure = Some((stops as f32).clamp(-MAX_EXPOSURE, MAX_EXPOSURE));
            changed = true;
        }
        if response.has_focus() {
            ui.data_mut(|data| data.insert_temp(held, shown));
        } else {
            ui.data_mut(|data| data.remove::<f32>(held));
        }
        response
    });
    if changed {
        viewer.edit(ui, "exposure", |s| s.exposure = exposure);
    }
    if reset {
        viewer.reset(ui, |s| s.exposure = read.exposure);
    }
}
