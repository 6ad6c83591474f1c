//! What is lit, and by what: environment, the selected material, lights.

use std::path::Path;

use eframe::egui;
use egui::Ui;
use glam::Vec3;
use sunfleck::scene::settings::{EnvironmentSettings, MaterialSettings, SceneLightSettings, Settings};
use sunfleck::scene::{PunctualKind, PunctualLight, Scene};

use super::color::color;
use super::number::{Number, Scale, drag_sized};
use super::widgets::{Name, back, choice, row};
use super::{Said, setting};
use crate::view::app::Viewer;
use crate::view::files::{self, name_of};

const SOURCE: Name =
    Name { name: "Source", hint: "Where the light from infinitely far away comes from. Restarts the estimate." };
const ROTATION: Name = Name {
    name: "Rotation",
    hint: "Turns the environment about the y axis, counter-clockwise seen from above, degrees. Restarts the estimate.",
};
const STRENGTH: Name = Name { name: "Strength", hint: "Factor on the environment's light. Restarts the estimate." };
const COLOR: Name = Name {
    name: "Colour",
    hint: "Radiance all around, linear RGB of any size ≥ 0; the button shows its hue. Restarts the estimate.",
};
const SCALE: Name = Name {
    name: "Light scale",
    hint: "Factor on every light: lamps, glowing surfaces, environment. Restarts the estimate.",
};
/// What is chosen for it.
#[derive(Clone, Copy, PartialEq)]
enum Source {
    /// As it is.
    Now,
    File,
    Color,
}

/// What shines from all around.
enum Sky {
    File(String),
    Color([f32; 3]),
    Own { rotation: f32, strength: f32 },
    Default,
    None,
}

impl Sky {
    fn new(settings: &Settings, scene: &Scene) -> Self {
        let given = settings.environment.clone().unwrap_or_default();
        match (given.file, given.color, &scene.environment) {
            (Some(file), ..) => Self::File(file),
            (None, Some(color), _) => Self::Color(color),
            (None, None, Some(own)) => Self::Own { rotation: own.rotation.to_degrees(), strength: own.strength },
            (None, None, None) if settings.needs_sky(scene) => Self::Default,
            (None, None, None) => Self::None,
        }
    }
}

pub fn environment(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let now = viewer.settings();
    let sky = Sky::new(&now, &opened.loaded.scene);
    let was = read.environment.clone().unwrap_or_default();
    let given = now.environment.clone().unwrap_or_default();
    let is_other = (&given.file, given.color.is_some()) != (&was.file, was.color.is_some());
    let mut source = Source::Now;
    let reset = row(ui, SOURCE, is_other, |ui| {
        let text = match &sky {
            Sky::File(file) => &name_of(Path::new(file)),
            Sky::Color(_) => "one colour",
            Sky::Own { .. } => "the scene's own",
            Sky::Default => "a soft sky, as the scene comes without light",
            Sky::None => "none",
        };
        let sources = [
            (Source::Now, text, "As it is"),
            (Source::File, "A map …", "Latitude-longitude, .hdr or .exr; an .hdr can be dropped, too"),
            (Source::Color, "One colour", "The same light from everywhere"),
        ];
        let response = choice(ui, "source", &mut source, &sources);
        match &sky {
            Sky::File(file) => response.on_hover_text(file),
            _ => response,
        }
    });
    match source {
        Source::Now => {}
        Source::File => files::ask_environment(viewer),
        Source::Color if matches!(sky, Sky::Color(_)) => {}
        Source::Color => {
            let grey = EnvironmentSettings { color: Some([0.5; 3]), ..EnvironmentSettings::default() };
            viewer.edit_apart(ui, "environment", |s| s.environment = Some(grey));
        }
    }
    if reset {
        viewer.reset(ui, |s| s.environment = read.environment.clone());
    }
    if reset || source != Source::Now || matches!(sky, Sky::None) {
        return;
    }
    if let Sky::Color(mut radiance) = sky {
        let mut changed = false;
        let reset = row(ui, COLOR, was.color.is_some() && given.color != was.color, |ui| {
            let response = color(ui, COLOR.name, &mut radiance, Some(f32::MAX));
            changed = response.changed();
            response
        });
        if changed || reset {
            let color = if reset { was.color } else { Some(radiance) };
            viewer.edit(ui, "environment colour", |s| change_sky(s, read, |sky| sky.color = color));
        }
    }
    let (rotation, strength) = match sky {
        Sky::Own { rotation, strength } => (rotation, strength),
        _ => (0.0, 1.0),
    };
    let properties = [
        Property { name: ROTATION, field: |sky| &mut sky.rotation_degrees, own: rotation, scale: TURN },
        Property { name: STRENGTH, field: |sky| &mut sky.strength, own: strength, scale: Scale::factor(100.0) },
    ];
    for Property { name, field, own, scale } in properties {
        let [now, read_so] = [&given, &was].map(|sky| *field(&mut sky.clone()));
        let said = Said { now, read: read_so, default: own };
        setting(
            ui,
            viewer,
            name,
            said,
            |ui, shown| scale.show(ui, shown),
            |s, value| {
                change_sky(s, read, |sky| *field(sky) = value);
            },
        );
    }
}

/// A number of the environment: where settings have it, what it is without them, what it may be.
struct Property {
    name: Name,
    field: fn(&mut EnvironmentSettings) -> &mut Option<f32>,
    own: f32,
    scale: Scale,
}

/// Degrees; what is typed may be any number of turns.
const TURN: Scale =
    Scale { number: Number::Degrees, range: [-180.0, 180.0], is_logarithmic: false, allowed: [f32::MIN, f32::MAX] };

/// Nothing is left where nothing is said.
fn change_sky(settings: &mut Settings, read: &Settings, change: impl FnOnce(&mut EnvironmentSettings)) {
    let mut sky = settings.environment.take().unwrap_or_default();
    change(&mut sky);
    let is_empty = sky == EnvironmentSettings::default() && read.environment.is_none();
    settings.environment = (!is_empty).then_some(sky);
}

pub fn lights(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let scene = &opened.loaded.scene;
    let now = viewer.settings();
    let said = Said { now: now.light_scale, read: read.light_scale, default: 1.0 };
    let control = |ui: &mut Ui, scale: &mut f32| Scale::factor(100.0).show(ui, scale);
    setting(ui, viewer, SCALE, said, control, |s, scale| s.light_scale = scale);
    if scene.lights.is_empty() {
        ui.weak("The scene has no point, spot or directional lights.");
        return;
    }
    let height = ui.spacing().interact_size.y;
    let area = egui::ScrollArea::vertical().id_salt("lights").max_height(12.0 * height);
    area.show_rows(ui, height, scene.lights.len(), |ui, range| {
        for i in range {
            light(ui, viewer, read, scene, i);
        }
    });
}

/// One line: on, colour, strength.
fn light(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, scene: &Scene, i: usize) {
    let light = &viewer.settings().scene_light_without(scene, i);
    let was = read.clone().scene_light_mut(scene, i).clone();
    let mut now = viewer.settings().as_ref().clone().scene_light_mut(scene, i).clone();
    let before = now.clone();
    let mut reset = false;
    ui.push_id(i, |ui| {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            let mut on = now.on != Some(false);
            let name = if light.name.is_empty() { format!("light {i}") } else { light.name.clone() };
            let width = (ui.available_width() - 140.0).max(40.0);
            let height = ui.spacing().interact_size.y;
            ui.allocate_ui_with_layout(
                egui::vec2(width, height),
                egui::Layout::left_to_right(egui::Align::Center),
                |ui| {
                    ui.set_min_width(width);
                    ui.set_max_width(width);
                    let hint = format!("{name}, {}: whether it shines. Restarts the estimate.", kind(light));
                    let title = egui::WidgetText::from(&name).into_galley(
                        ui,
                        Some(egui::TextWrapMode::Truncate),
                        (width - ui.spacing().icon_width - ui.spacing().icon_spacing).max(0.0),
                        egui::TextStyle::Button,
                    );
                    if ui.add(egui::Checkbox::new(&mut on, title)).on_hover_text(hint).changed() {
                        now.on = Said { now: now.on, read: was.on, default: true }.saying(on);
                    }
                },
            );
            let mut rgb = now.color.unwrap_or_else(|| hue(light.intensity));
            let hint =
                "Its colour, linear RGB, of which only the ratio matters: it stays as bright. Restarts the estimate.";
            let response = color(ui, &format!("Colour of {name}"), &mut rgb, None).on_hover_text(hint);
            if response.changed() && rgb != [0.0; 3] {
                now.color = Said { now: now.color, read: was.color, default: hue(light.intensity) }.saying(rgb);
            }
            let mut strength = now.strength.unwrap_or(1.0);
            let speed = f64::from(0.01 * strength.max(0.1));
            let size = egui::vec2(62.0, height);
            let response = drag_sized(ui, size, &mut strength, Number::Factor, speed, 0.0..=1e6);
            let hint =
                format!("Factor on its {:.4} {}. Restarts the estimate.", light.intensity.max_element(), unit(light));
            if response.on_hover_text(hint).changed() {
                now.strength = Said { now: now.strength, read: was.strength, default: 1.0 }.saying(strength);
            }
            if before != was {
                reset = back(ui, &name);
            }
        });
    });
    if reset {
        viewer.reset(ui, |s| {
            *s.scene_light_mut(scene, i) = was;
            tidy(s, read);
        });
    } else if now != before {
        viewer.edit(ui, "light", |s| {
            *s.scene_light_mut(scene, i) = now;
            tidy(s, read);
        });
    }
}

fn kind(light: &PunctualLight) -> &'static str {
    match light.kind {
        PunctualKind::Point => "a point light",
        PunctualKind::Spot { .. } => "a spot light",
        PunctualKind::Directional => "a directional light",
    }
}

fn unit(light: &PunctualLight) -> &'static str {
    match light.kind {
        PunctualKind::Point | PunctualKind::Spot { .. } => "cd",
        PunctualKind::Directional => "lx",
    }
}

/// The colour of light of any strength.
fn hue(intensity: Vec3) -> [f32; 3] {
    let most = intensity.max_element();
    if most > 0.0 { (intensity / most).to_array() } else { [1.0; 3] }
}

/// Takes away changes that change nothing and that the file does not have.
pub fn tidy(settings: &mut Settings, read: &Settings) {
    settings.materials.retain(|m| {
        let target = MaterialSettings { name: m.name.clone(), index: m.index, ..MaterialSettings::default() };
        *m != target || read.materials.contains(m)
    });
    settings.scene_lights.retain(|l| {
        let target = SceneLightSettings { name: l.name.clone(), index: l.index, ..SceneLightSettings::default() };
        *l != target || read.scene_lights.contains(l)
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::scene::Material;

    #[test]
    fn changes_of_nothing_are_tidied_away() {
        let scene = Scene {
            materials: vec![Material::diffuse("a", Vec3::ONE), Material::diffuse("b", Vec3::ONE)],
            ..Scene::default()
        };
        let mut read = Settings::default();
        read.material_mut(&scene, 0);
        let mut now = read.clone();
        now.material_mut(&scene, 1).ior = Some(2.0);
        let changed = now.clone();
        tidy(&mut now, &read);
        assert_eq!(now, changed);
        now.material_mut(&scene, 1).ior = None;
        tidy(&mut now, &read);
        assert_eq!(now, read);
    }

    #[test]
    fn hues_have_no_strength() {
        assert_eq!(hue(Vec3::new(4.0, 2.0, 0.0)), [1.0, 0.5, 0.0]);
        assert_eq!(hue(Vec3::ZERO), [1.0; 3]);
    }
}
