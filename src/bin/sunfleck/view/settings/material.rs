//! The material of what was clicked on.

use eframe::egui;
use egui::Ui;
use glam::Vec3;
use sunfleck::scene::settings::{MaterialSettings, Settings};
use sunfleck::scene::{Material, Scene};

use super::scene::{logarithmic, tidy};
use super::widgets::{Name, row, slider};
use crate::view::app::Viewer;

const MATERIAL: Name = Name { name: "Material", hint: "Click on an object in the picture, or choose here." };
const BASE_COLOR: Name =
    Name { name: "Base colour", hint: "Linear RGB; a texture multiplies it. Restarts the estimate." };
const ROUGHNESS: Name =
    Name { name: "Roughness", hint: "From 0, a mirror, to 1; a texture multiplies it. Restarts the estimate." };
const METALLIC: Name = Name {
    name: "Metallic",
    hint: "From 0, paint, plastic or glass, to 1, metal; a texture multiplies it. Restarts the estimate.",
};
const TRANSMISSION: Name = Name {
    name: "Transmission",
    hint: "Share of the light that enters and is let through, as in glass, from 0 to 1. Restarts the estimate.",
};
const IOR: Name = Name {
    name: "Refraction",
    hint: "Index of refraction: water 1.33, glass 1.5, diamond 2.4. Restarts the estimate.",
};
const EMISSION: Name =
    Name { name: "Emission", hint: "Factor on the light that the surface gives by itself. Restarts the estimate." };

pub fn show(ui: &mut Ui, viewer: &mut Viewer, read: &Settings) {
    let Some(opened) = viewer.opened().cloned() else { return };
    let scene = &opened.loaded.scene;
    let title = |i: usize| match scene.materials.get(i) {
        Some(material) if !material.name.is_empty() => material.name.clone(),
        Some(_) => format!("material {i}"),
        None => "a sphere of the settings file".to_owned(),
    };
    let mut picked = None;
    row(ui, MATERIAL, false, |ui| {
        let text = viewer.selected.map_or_else(|| "none".to_owned(), title);
        let combo = egui::ComboBox::from_id_salt("material").width(ui.available_width()).selected_text(text).truncate();
        let inside = combo.show_ui(ui, |ui| {
            for i in 0..scene.materials.len() {
                if ui.selectable_label(viewer.selected == Some(i), title(i)).clicked() {
                    picked = Some(i);
                }
            }
        });
        inside.response
    });
    viewer.selected = picked.or(viewer.selected);
    let Some(index) = viewer.selected else {
        ui.weak("Click on an object in the picture.");
        return;
    };
    match scene.materials.get(index) {
        Some(material) => properties(ui, viewer, read, scene, index, material),
        None => {
            ui.weak("The settings file makes this sphere, with a [[sphere]] that says what it is of.");
        }
    }
}

/// A number of a material: where settings have it, what its file says, its range.
struct Number {
    name: Name,
    field: fn(&mut MaterialSettings) -> &mut Option<f32>,
    own: f32,
    range: [f64; 2],
    is_logarithmic: bool,
}

fn properties(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, scene: &Scene, index: usize, own: &Material) {
    let was = read.clone().material_mut(scene, index).clone();
    let before = viewer.settings().as_ref().clone().material_mut(scene, index).clone();
    let mut color = before.base_color.unwrap_or(own.base_color.to_array());
    let mut changed = false;
    let reset = row(ui, BASE_COLOR, before.base_color != was.base_color, |ui| {
        let response = ui.color_edit_button_rgb(&mut color);
        changed = response.changed();
        response
    });
    if changed {
        let color = color.map(|c| c.clamp(0.0, 1.0));
        viewer.edit(ui, "base colour", |s| s.material_mut(scene, index).base_color = Some(color));
    }
    if reset {
        viewer.reset(ui, |s| {
            s.material_mut(scene, index).base_color = was.base_color;
            tidy(s, read);
        });
    }
    let unit = |name, field, own| Number { name, field, own, range: [0.0, 1.0], is_logarithmic: false };
    let numbers = [
        unit(ROUGHNESS, |m| &mut m.roughness, own.roughness),
        unit(METALLIC, |m| &mut m.metallic, own.metallic),
        unit(TRANSMISSION, |m| &mut m.transmission, own.transmission),
        Number { range: [1.0, 2.5], ..unit(IOR, |m| &mut m.ior, own.ior) },
        Number { range: [0.0, 1000.0], is_logarithmic: true, ..unit(EMISSION, |m| &mut m.emission_strength, 1.0) },
    ];
    let shines = before.emission.map_or(own.emission, Vec3::from) != Vec3::ZERO;
    for Number { name, field, own, range: [low, high], is_logarithmic } in numbers {
        if name.name == EMISSION.name && !shines {
            continue;
        }
        let (value, old) = (*field(&mut before.clone()), *field(&mut was.clone()));
        let mut shown = f64::from(value.unwrap_or(own));
        let mut changed = false;
        let reset = row(ui, name, value != old, |ui| {
            let response = slider(ui, &mut shown, low..=high, |slider| match is_logarithmic {
                true => logarithmic(slider),
                false => slider.max_decimals(3),
            });
            changed = response.changed();
            response
        });
        if changed {
            let value = match name.name {
                "Refraction" => (shown as f32).max(0.01),
                "Emission" => (shown as f32).max(0.0),
                _ => (shown as f32).clamp(0.0, 1.0),
            };
            viewer.edit(ui, name.name, |s| *field(s.material_mut(scene, index)) = Some(value));
        }
        if reset {
            viewer.reset(ui, |s| {
                *field(s.material_mut(scene, index)) = old;
                tidy(s, read);
            });
        }
    }
}
