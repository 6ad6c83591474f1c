//! The material of what was clicked on.

use eframe::egui;
use egui::Ui;
use glam::Vec3;
use sunfleck::scene::settings::{MaterialSettings, Settings};
use sunfleck::scene::{Material, Scene};

use super::color::color;
use super::number::{Number, Scale};
use super::scene::tidy;
use super::widgets::{Name, row};
use super::{Said, setting};
use crate::view::app::Viewer;
use crate::view::focus::list;

const MATERIAL: Name = Name { name: "Material", hint: "Click on a surface in the picture, or choose here." };
const BASE_COLOR: Name =
    Name { name: "Base colour", hint: "Linear RGB from 0 to 1; a texture multiplies it. Restarts the estimate." };
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
const SPECULAR: Name = Name {
    name: "Specular",
    hint: "Weight of the reflection of paint or plastic, from 0, none, to 1. Restarts the estimate.",
};
const IOR: Name = Name {
    name: "Refraction",
    hint: "Index of refraction: water 1.33, glass 1.5, diamond 2.4. Restarts the estimate.",
};
const EMISSION: Name = Name {
    name: "Emission",
    hint: "Radiance that the surface gives by itself, linear RGB of any size ≥ 0; a texture multiplies it. Restarts the \
           estimate.",
};
const EMISSION_FACTOR: Name =
    Name { name: "Emission ×", hint: "Factor on the light that the surface gives by itself. Restarts the estimate." };

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
        list(ui, combo, |ui| {
            // Those in sight alone: a scene may have thousands.
            let area = egui::ScrollArea::vertical().max_height(ui.spacing().combo_height).auto_shrink([false, true]);
            area.show_rows(ui, ui.spacing().interact_size.y, scene.materials.len(), |ui, range| {
                for i in range {
                    if ui.selectable_label(viewer.selected == Some(i), title(i)).clicked() {
                        picked = Some(i);
                    }
                }
            });
        })
    });
    viewer.selected = picked.or(viewer.selected);
    let Some(index) = viewer.selected else {
        ui.weak("Click on a surface in the picture.");
        return;
    };
    match scene.materials.get(index) {
        Some(_) => properties(ui, viewer, read, scene, index),
        None => {
            ui.weak("The settings file makes this sphere, with a [[sphere]] that says what it is of.");
        }
    }
}

/// A number of a material: where settings have it, what its file says, what it may be, why it would change nothing.
struct Property {
    name: Name,
    field: fn(&mut MaterialSettings) -> &mut Option<f32>,
    own: f32,
    scale: Scale,
    idle: Option<&'static str>,
}

/// Of the index of refraction.
const BENDING: Scale =
    Scale { number: Number::Plain, range: [1.0, 2.5], is_logarithmic: false, allowed: [0.01, f32::MAX] };

/// Where settings have a colour of a material.
type ColorField = fn(&mut MaterialSettings) -> &mut Option<[f32; 3]>;

/// Why roughness, transmission, specular and index of refraction would change nothing of a material as it stands now.
fn idle(own: &Material, now: &MaterialSettings) -> [Option<&'static str>; 4] {
    let metallic = now.metallic.unwrap_or(own.metallic);
    let transmission = now.transmission.unwrap_or(own.transmission);
    let specular = now.specular.unwrap_or(own.specular);
    // What a texture multiplies is less than 1 somewhere.
    let metal = (metallic == 1.0 && own.metallic_roughness_texture.is_none()).then_some("A metal: metallic is 1");
    let clear = (transmission == 1.0 && own.transmission_texture.is_none())
        .then_some("Whatever enters is let through: transmission is 1");
    let dull = (specular == 0.0 && transmission == 0.0).then_some(match metallic {
        0.0 => "A diffuse surface: specular, metallic and transmission are 0",
        _ => "Nothing but metal is reflected from: specular and transmission are 0",
    });
    [dull.filter(|_| metallic == 0.0), metal, metal.or(clear), metal.or(dull)]
}

fn properties(ui: &mut Ui, viewer: &mut Viewer, read: &Settings, scene: &Scene, index: usize) {
    let was = read.clone().material_mut(scene, index).clone();
    let before = viewer.settings().as_ref().clone().material_mut(scene, index).clone();
    let own = &viewer.settings().material_without(scene, index);
    let color_row = |ui: &mut Ui, viewer: &mut Viewer, name: Name, field: ColorField, own: Vec3, most: f32| {
        let [now, read_so] = [&before, &was].map(|settings| *field(&mut settings.clone()));
        let said = Said { now, read: read_so, default: own.to_array() };
        let control = |ui: &mut Ui, shown: &mut [f32; 3]| {
            let response = color(ui, name.name, shown, Some(most));
            *shown = shown.map(|c| c.clamp(0.0, most));
            response
        };
        setting(ui, viewer, name, said, control, |s, color| {
            *field(s.material_mut(scene, index)) = color;
            tidy(s, read);
        });
    };
    let number_row = |ui: &mut Ui, viewer: &mut Viewer, property: Property| {
        let Property { name, field, own, scale, idle } = property;
        let [now, read_so] = [&before, &was].map(|settings| *field(&mut settings.clone()));
        let control = |ui: &mut Ui, shown: &mut f32| {
            let response = ui.add_enabled_ui(idle.is_none(), |ui| scale.show(ui, shown)).inner;
            response.on_disabled_hover_text(idle.unwrap_or_default())
        };
        setting(ui, viewer, name, Said { now, read: read_so, default: own }, control, |s, number| {
            *field(s.material_mut(scene, index)) = number;
            tidy(s, read);
        });
    };
    color_row(ui, viewer, BASE_COLOR, |m| &mut m.base_color, own.base_color, 1.0);
    let unit = |name, field, own| Property { name, field, own, scale: Scale::UNIT, idle: None };
    let [rough, through, shiny, bent] = idle(own, &before);
    for property in [
        Property { idle: rough, ..unit(ROUGHNESS, |m| &mut m.roughness, own.roughness) },
        unit(METALLIC, |m| &mut m.metallic, own.metallic),
        Property { idle: through, ..unit(TRANSMISSION, |m| &mut m.transmission, own.transmission) },
        Property { idle: shiny, ..unit(SPECULAR, |m| &mut m.specular, own.specular) },
        Property { scale: BENDING, idle: bent, ..unit(IOR, |m| &mut m.ior, own.ior) },
    ] {
        number_row(ui, viewer, property);
    }
    color_row(ui, viewer, EMISSION, |m| &mut m.emission, own.emission, f32::MAX);
    let shines = before.emission.map_or(own.emission, Vec3::from) != Vec3::ZERO;
    if shines || before.emission_strength != was.emission_strength {
        let factor = unit(EMISSION_FACTOR, |m| &mut m.emission_strength, 1.0);
        number_row(ui, viewer, Property { scale: Scale::factor(1000.0), ..factor });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changes_nothing_is_told() {
        let asks = |own: &Material, change: &str| {
            let mut now = MaterialSettings::default();
            match change {
                "specular" => now.specular = Some(0.5),
                "metallic" => now.metallic = Some(0.5),
                _ => {}
            }
            idle(own, &now).map(|why| why.is_none())
        };
        let wall = Material::diffuse("wall", Vec3::ONE);
        assert_eq!(asks(&wall, ""), [false, true, true, false]);
        assert_eq!(asks(&wall, "specular"), [true; 4]);
        assert_eq!(asks(&wall, "metallic"), [true, true, true, false]);
        let metal = Material::metal("metal", Vec3::ONE, 0.1);
        assert_eq!(asks(&metal, ""), [true, false, false, false]);
        assert_eq!(asks(&metal, "metallic"), [true; 4]);
        assert_eq!(asks(&Material::glass("glass", 1.5), ""), [true, true, false, true]);
    }
}
