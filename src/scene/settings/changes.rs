//! Changes to the materials and lights that a scene has.

use super::apply::Checks;
use super::{Settings, Wrong};
use crate::scene::{Material, PunctualLight, Scene};
use glam::Vec3;
use serde::{Deserialize, Serialize};

/// Names that a message lists, at most.
const MAX_LISTED: usize = 20;

/// Changes a material of the scene; what is left out stays. Its textures still multiply what is given here.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaterialSettings {
    /// The material's name; every material of that name is changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The material's number in the scene file, from 0; instead of `name`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub index: Option<usize>,
    /// Linear RGB in [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_color: Option<[f32; 3]>,
    /// In [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metallic: Option<f32>,
    /// Perceptual, in [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<f32>,
    /// Share of the light entering a dielectric that is let through, in [0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transmission: Option<f32>,
    /// Whether the surface bounds a solid that refracts and absorbs; otherwise it is infinitely thin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub volume: Option<bool>,
    /// Index of refraction, positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ior: Option<f32>,
    /// Weight of the dielectric reflection, in [0, 1]; 0 is a pure diffuser.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub specular: Option<f32>,
    /// Absorption inside a solid, 1/m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub absorption: Option<[f32; 3]>,
    /// Radiance, linear RGB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emission: Option<[f32; 3]>,
    /// Factor on the radiance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub emission_strength: Option<f32>,
}

/// Changes a punctual light of the scene; what is left out stays.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneLightSettings {
    /// The light's name; every light of that name is changed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The light's number in the scene file, from 0; instead of `name`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub index: Option<usize>,
    /// Whether it shines; default true.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub on: Option<bool>,
    /// Factor on its intensity.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub strength: Option<f32>,
    /// Linear RGB, not black, instead of its own colour; the luminance stays.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub color: Option<[f32; 3]>,
}

impl MaterialSettings {
    pub(super) fn check(&self, c: &mut Checks, place: &str) {
        check_target(c, place, self.name.as_ref(), self.index);
        let within = |v: Vec3| v.min_element() >= 0.0 && v.max_element() <= 1.0;
        c.vector(&format!("{place}.base_color"), self.base_color, within, "between 0 and 1");
        c.unit(&format!("{place}.metallic"), self.metallic);
        c.unit(&format!("{place}.roughness"), self.roughness);
        c.unit(&format!("{place}.transmission"), self.transmission);
        c.positive(&format!("{place}.ior"), self.ior);
        c.unit(&format!("{place}.specular"), self.specular);
        c.color(&format!("{place}.absorption"), self.absorption);
        c.color(&format!("{place}.emission"), self.emission);
        c.not_negative(&format!("{place}.emission_strength"), self.emission_strength);
    }

    pub(super) fn apply(&self, materials: &mut [Material], place: &str) -> Result<(), Wrong> {
        let names = materials.iter().map(|material| material.name.as_str()).collect();
        for i in targets("material", place, self.name.as_deref(), self.index, names)? {
            self.change(&mut materials[i]);
        }
        Ok(())
    }

    fn change(&self, m: &mut Material) {
        m.base_color = self.base_color.map_or(m.base_color, Vec3::from);
        m.metallic = self.metallic.unwrap_or(m.metallic);
        m.roughness = self.roughness.unwrap_or(m.roughness);
        m.transmission = self.transmission.unwrap_or(m.transmission);
        m.volume = self.volume.unwrap_or(m.volume);
        m.ior = self.ior.unwrap_or(m.ior);
        m.specular = self.specular.unwrap_or(m.specular);
        m.absorption = self.absorption.map_or(m.absorption, Vec3::from);
        m.emission = self.emission.map_or(m.emission, Vec3::from) * self.emission_strength.unwrap_or(1.0);
    }
}

impl SceneLightSettings {
    pub(super) fn check(&self, c: &mut Checks, place: &str) {
        check_target(c, place, self.name.as_ref(), self.index);
        c.not_negative(&format!("{place}.strength"), self.strength);
        let color = |v: Vec3| v.min_element() >= 0.0 && v.max_element() > 0.0;
        c.vector(&format!("{place}.color"), self.color, color, "a colour ≥ 0, and not black");
    }

    pub(super) fn apply(&self, lights: &mut [PunctualLight], place: &str) -> Result<(), Wrong> {
        let names = lights.iter().map(|light| light.name.as_str()).collect();
        for i in targets("light", place, self.name.as_deref(), self.index, names)? {
            self.change(&mut lights[i]);
        }
        Ok(())
    }

    fn change(&self, light: &mut PunctualLight) {
        let intensity = &mut light.intensity;
        if let Some(color) = self.color.map(Vec3::from) {
            *intensity = color * (luminance(*intensity) / luminance(color));
        }
        *intensity *= if self.on == Some(false) { 0.0 } else { self.strength.unwrap_or(1.0) };
    }
}

impl Settings {
    /// The changes to a material of `scene`, the scene as its file has it; an item is added if there is none, and several
    /// are made one that does the same.
    ///
    /// The material is meant by its name, or by its number where it shares its name or has none.
    pub fn material_mut(&mut self, scene: &Scene, index: usize) -> &mut MaterialSettings {
        only_item(&mut self.materials, scene.materials.iter().map(|material| material.name.as_str()), index)
    }

    /// The changes to a punctual light of `scene`; see [`Settings::material_mut`].
    pub fn scene_light_mut(&mut self, scene: &Scene, index: usize) -> &mut SceneLightSettings {
        only_item(&mut self.scene_lights, scene.lights.iter().map(|light| light.name.as_str()), index)
    }

    /// A material of `scene` without the changes of [`Settings::material_mut`]: as its file has it, or as what else means its name
    /// makes it.
    pub fn material_without(&self, scene: &Scene, index: usize) -> Material {
        let mut material = scene.materials[index].clone();
        let names = scene.materials.iter().map(|material| material.name.as_str());
        for item in other_items(&self.materials, names, index) {
            item.change(&mut material);
        }
        material
    }

    /// The same of a punctual light; see [`Settings::scene_light_mut`].
    pub fn scene_light_without(&self, scene: &Scene, index: usize) -> PunctualLight {
        let mut light = scene.lights[index].clone();
        for item in other_items(&self.scene_lights, scene.lights.iter().map(|light| light.name.as_str()), index) {
            item.change(&mut light);
        }
        light
    }
}

/// The items that change the thing of that number, in turn, without the one that [`only_item`] gives.
fn other_items<'n, T: Item + Clone>(list: &[T], names: impl Iterator<Item = &'n str> + Clone, index: usize) -> Vec<T> {
    let name = names.clone().nth(index);
    let mut items = list.to_vec();
    *only_item(&mut items, names, index) = T::new(None, None);
    items.retain(|item| item.index() == Some(index) || item.name().is_some() && item.name() == name);
    items
}

/// An item of a list of changes.
trait Item {
    fn new(name: Option<String>, index: Option<usize>) -> Self;
    fn name(&self) -> Option<&str>;
    fn index(&self) -> Option<usize>;
    /// Becomes what changes a thing as this one does, and then `later`.
    fn join(&mut self, later: Self);
}

impl Item for MaterialSettings {
    fn new(name: Option<String>, index: Option<usize>) -> Self {
        Self { name, index, ..Self::default() }
    }

    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn index(&self) -> Option<usize> {
        self.index
    }

    fn join(&mut self, later: Self) {
        self.base_color = later.base_color.or(self.base_color);
        self.metallic = later.metallic.or(self.metallic);
        self.roughness = later.roughness.or(self.roughness);
        self.transmission = later.transmission.or(self.transmission);
        self.volume = later.volume.or(self.volume);
        self.ior = later.ior.or(self.ior);
        self.specular = later.specular.or(self.specular);
        self.absorption = later.absorption.or(self.absorption);
        // Another radiance comes without the factors on the one before.
        self.emission_strength = match later.emission {
            Some(_) => later.emission_strength,
            None => product(self.emission_strength, later.emission_strength),
        };
        self.emission = later.emission.or(self.emission);
    }
}

impl Item for SceneLightSettings {
    fn new(name: Option<String>, index: Option<usize>) -> Self {
        Self { name, index, ..Self::default() }
    }

    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }

    fn index(&self) -> Option<usize> {
        self.index
    }

    fn join(&mut self, later: Self) {
        // What is off stays off.
        self.on = if self.on == Some(false) { self.on } else { later.on.or(self.on) };
        self.strength = product(self.strength, later.strength);
        self.color = later.color.or(self.color);
    }
}

fn product(a: Option<f32>, b: Option<f32>) -> Option<f32> {
    a.zip(b).map(|(a, b)| a * b).or(a).or(b)
}

/// The item that changes the thing of that number and no other.
///
/// Several are joined as far back as there is none between them that changes this thing among others of its name.
fn only_item<'n, T: Item>(list: &mut Vec<T>, names: impl Iterator<Item = &'n str> + Clone, index: usize) -> &mut T {
    let name = names.clone().nth(index);
    let own = own_name(names, index);
    let is_own = |item: &T| item.index() == Some(index) || (own.is_some() && item.name() == own.as_deref());
    let is_shared = |item: &T| item.name().is_some() && item.name() == name;
    // What changes this thing among others last is not changed by what comes before it.
    let last = list.iter().rposition(|item| is_own(item) || is_shared(item));
    let Some(mut at) = last.filter(|&at| is_own(&list[at])) else {
        let number = own.is_none().then_some(index);
        list.push(T::new(own, number));
        let last = list.len() - 1;
        return &mut list[last];
    };
    for i in (0..at).rev() {
        if is_own(&list[i]) {
            let later = list.remove(at);
            list[i].join(later);
            at = i;
        } else if is_shared(&list[i]) {
            break;
        }
    }
    &mut list[at]
}

/// The name of that number, if there is one and no other has it.
fn own_name<'n>(names: impl Iterator<Item = &'n str> + Clone, index: usize) -> Option<String> {
    let name = names.clone().nth(index).filter(|name| !name.is_empty())?;
    (names.filter(|other| *other == name).count() == 1).then(|| name.to_owned())
}

fn check_target(c: &mut Checks, place: &str, name: Option<&String>, index: Option<usize>) {
    c.require(name.is_some() != index.is_some(), place, || {
        let list = place.split('[').next().unwrap_or(place);
        format!("needs a name or an index, and not both (--set {list}.NAME.… takes one of the scene's by its name)")
    });
}

/// The things that `name` or `index` mean, at least one.
fn targets(
    kind: &str,
    place: &str,
    name: Option<&str>,
    index: Option<usize>,
    names: Vec<&str>,
) -> Result<Vec<usize>, Wrong> {
    let n = names.len();
    let found: Vec<usize> = match name {
        Some(name) => (0..n).filter(|&i| names[i] == name).collect(),
        None => index.into_iter().filter(|&i| i < n).collect(),
    };
    if !found.is_empty() {
        return Ok(found);
    }
    let listed: Vec<String> =
        names.iter().enumerate().take(MAX_LISTED).map(|(i, name)| format!("{i} {name:?}")).collect();
    let more = if n > MAX_LISTED { format!(" and {} more", n - MAX_LISTED) } else { String::new() };
    let there = if n == 0 { "none".into() } else { listed.join(", ") + &more };
    let (field, wanted) = match name {
        Some(name) => ("name", format!("{name:?}")),
        None => ("index", index.map_or(String::new(), |index| index.to_string())),
    };
    Err((format!("{place}.{field}"), format!("there is no {kind} {wanted} in the scene; there is {there}")))
}

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
