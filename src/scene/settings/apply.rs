//! Checking of settings by themselves, and what they do to a scene.

use super::{
    CameraSettings, EnvironmentSettings, FirstRadius, LightKind, LightSettings, MAX_EXPOSURE, MAX_SIDE,
    ReadEnvironment, Settings, SettingsError, Size, SphereSettings, Wrong, is_alpha,
};
use crate::scene::load::load_environment;
use crate::scene::{
    Camera, Environment, Material, Projection, PunctualKind, PunctualLight, Scene, Sphere,
    defaults::{add_default_light, default_camera, has_light, is_lamp},
};
use glam::{Affine3A, Vec3};
use std::path::Path;

/// Collects the first wrong value.
pub(super) struct Checks(Result<(), Wrong>);

impl Checks {
    pub(super) fn require(&mut self, ok: bool, field: &str, problem: impl FnOnce() -> String) {
        if self.0.is_ok() && !ok {
            self.0 = Err((field.into(), problem()));
        }
    }

    pub(super) fn number(&mut self, field: &str, value: Option<f32>, range: impl Fn(f32) -> bool, expected: &str) {
        if let Some(value) = value {
            self.require(value.is_finite() && range(value), field, || format!("{value} is not {expected}"));
        }
    }

    pub(super) fn vector(
        &mut self,
        field: &str,
        value: Option<[f32; 3]>,
        range: impl Fn(Vec3) -> bool,
        expected: &str,
    ) {
        if let Some(value) = value.map(Vec3::from) {
            self.require(value.is_finite() && range(value), field, || format!("{value} is not {expected}"));
        }
    }

    fn point(&mut self, field: &str, value: Option<[f32; 3]>) {
        self.vector(field, value, |_| true, "finite");
    }

    fn direction(&mut self, field: &str, value: Option<[f32; 3]>) {
        self.vector(field, value, |v| v.try_normalize().is_some(), "a direction");
    }

    pub(super) fn color(&mut self, field: &str, value: Option<[f32; 3]>) {
        self.vector(field, value, |v| v.min_element() >= 0.0, "a colour ≥ 0");
    }

    pub(super) fn positive(&mut self, field: &str, value: Option<f32>) {
        self.number(field, value, |v| v > 0.0, "a positive number");
    }

    pub(super) fn not_negative(&mut self, field: &str, value: Option<f32>) {
        self.number(field, value, |v| v >= 0.0, "a number ≥ 0");
    }

    pub(super) fn unit(&mut self, field: &str, value: Option<f32>) {
        self.number(field, value, |v| (0.0..=1.0).contains(&v), "between 0 and 1");
    }
}

impl Settings {
    /// Whether every value is within its range.
    pub(super) fn check_values(&self) -> Result<(), Wrong> {
        let mut checks = Checks(Ok(()));
        let c = &mut checks;
        if let Some(Size([width, height])) = self.size {
            let ok = |side| (1..=MAX_SIDE).contains(&side);
            c.require(ok(width) && ok(height), "size", || {
                format!("{width} × {height} is not within {MAX_SIDE} × {MAX_SIDE}")
            });
        }
        c.number("alpha", self.alpha, is_alpha, "between 0 and 1");
        if let Some(FirstRadius::Fixed(radius)) = self.radius {
            c.positive("radius", Some(radius));
        }
        c.positive("seconds", self.seconds.map(|s| s as f32));
        let stops = format!("between -{MAX_EXPOSURE} and {MAX_EXPOSURE}");
        c.number("exposure", self.exposure, |v| v.abs() <= MAX_EXPOSURE, &stops);
        c.require(self.max_segments != Some(0), "max_segments", || "0 is not a length".into());
        c.not_negative("light_scale", self.light_scale);
        if let Some(camera) = &self.camera {
            camera.check(c);
        }
        if let Some(environment) = &self.environment {
            c.number("environment.rotation_degrees", environment.rotation_degrees, |_| true, "finite");
            c.not_negative("environment.strength", environment.strength);
            c.color("environment.color", environment.color);
        }
        for (i, material) in self.materials.iter().enumerate() {
            material.check(c, &format!("material[{i}]"));
        }
        for (i, light) in self.scene_lights.iter().enumerate() {
            light.check(c, &format!("scene_light[{i}]"));
        }
        for (i, sphere) in self.spheres.iter().enumerate() {
            sphere.check(c, &format!("sphere[{i}]"));
        }
        for (i, light) in self.lights.iter().enumerate() {
            light.check(c, &format!("light[{i}]"));
        }
        checks.0
    }

    /// Changes and adds to a scene, in this order, as the settings say; the first camera is then the one to use. A scene
    /// without a camera gets the default one ([`Settings::add_default_camera`]), and one without light a sky
    /// ([`Settings::needs_sky`]).
    ///
    /// `folder` is where the settings file lies. Returns warnings.
    pub fn apply_to_scene(&self, scene: &mut Scene, folder: &Path) -> Result<Vec<String>, SettingsError> {
        self.apply_with(scene, folder, &mut load_environment)
    }

    /// The same, with environments from `read` instead of their files: for one who has read them before.
    pub fn apply_with(
        &self,
        scene: &mut Scene,
        folder: &Path,
        read: &mut ReadEnvironment<'_>,
    ) -> Result<Vec<String>, SettingsError> {
        let wrong = |(field, problem): Wrong| SettingsError::Field { field, problem };
        self.check_values().map_err(wrong)?;
        self.add_default_camera(scene);
        let mut warnings = Vec::new();
        if self.needs_sky(scene) {
            warnings.push(add_default_light(scene));
        }
        self.change_materials_and_lights(&mut scene.materials, &mut scene.lights)?;
        for (i, sphere) in self.spheres.iter().enumerate() {
            sphere.apply(scene, i).map_err(wrong)?;
        }
        scene.lights.extend(self.lights.iter().enumerate().map(|(i, light)| light.light(i)));
        if let Some(environment) = &self.environment {
            warnings.extend(environment.apply(scene, folder, read)?);
        }
        if let Some(factor) = self.light_scale {
            scale_lights(scene, factor);
        }
        if let Some(camera) = &self.camera {
            camera.apply(&mut scene.cameras).map_err(wrong)?;
        }
        Ok(warnings)
    }

    /// Changes those of a scene's materials and lights that the settings name, as applying them does, and nothing else.
    pub fn change_materials_and_lights(
        &self,
        materials: &mut [Material],
        lights: &mut [PunctualLight],
    ) -> Result<(), SettingsError> {
        let wrong = |(field, problem): Wrong| SettingsError::Field { field, problem };
        for (i, material) in self.materials.iter().enumerate() {
            material.apply(materials, &format!("material[{i}]")).map_err(wrong)?;
        }
        for (i, light) in self.scene_lights.iter().enumerate() {
            light.apply(lights, &format!("scene_light[{i}]")).map_err(wrong)?;
        }
        Ok(())
    }
}

fn scale_lights(scene: &mut Scene, factor: f32) {
    for material in &mut scene.materials {
        material.emission *= factor;
    }
    for light in &mut scene.lights {
        light.intensity *= factor;
    }
    if let Some(environment) = &mut scene.environment {
        environment.strength *= factor;
    }
}

impl Settings {
    /// Gives a scene without a camera, which is as its file has it, the default one, as applying these settings does. It
    /// has their spheres in view, and depends on nothing else in them: it stays where it is while they are edited.
    pub fn add_default_camera(&self, scene: &mut Scene) {
        if scene.cameras.is_empty() {
            scene.cameras.push(default_camera(scene, &self.added_spheres()));
        }
    }

    /// Whether a scene, as its file has it, gets a soft sky ([`add_default_light`]): it comes without light, and these
    /// settings bring none, neither an environment nor lights nor spheres that shine. What they change of its materials and
    /// lights does not count: one whose lights are turned off is black, and one that a material begins to light keeps its
    /// sky.
    pub fn needs_sky(&self, scene: &Scene) -> bool {
        let glows = |emission: Option<[f32; 3]>| emission.is_some_and(|emission| emission != [0.0; 3]);
        let shines = |sphere: &SphereSettings| {
            let named = || scene.materials.iter().any(|m| Some(&m.name) == sphere.material.as_ref() && is_lamp(m));
            let made =
                || self.materials.iter().any(|m| m.name.is_some() && m.name == sphere.material && glows(m.emission));
            glows(sphere.emission) || named() || made()
        };
        let brings_sky = self.environment.as_ref().is_some_and(|e| e.file.is_some() || e.color.is_some());
        !has_light(scene) && !brings_sky && self.lights.is_empty() && !self.spheres.iter().any(shines)
    }

    /// Where spheres are added; all of material 0.
    pub fn added_spheres(&self) -> Vec<Sphere> {
        let sphere =
            |s: &SphereSettings| Sphere { centre: s.centre.into(), radius: s.radius, inward: s.inward, material: 0 };
        self.spheres.iter().map(sphere).collect()
    }

    /// The camera that these settings make of those of a scene.
    pub fn camera_of(&self, cameras: &[Camera]) -> Result<Camera, SettingsError> {
        let wrong = |(field, problem): Wrong| SettingsError::Field { field, problem };
        self.check_values().map_err(wrong)?;
        let mut cameras = cameras.to_vec();
        self.camera.clone().unwrap_or_default().apply(&mut cameras).map_err(wrong)?;
        Ok(cameras.swap_remove(0))
    }
}

impl CameraSettings {
    fn check(&self, c: &mut Checks) {
        c.point("camera.position", self.position);
        c.point("camera.look_at", self.look_at);
        c.direction("camera.forward", self.forward);
        c.direction("camera.up", self.up);
        c.require(self.look_at.is_none() || self.forward.is_none(), "camera.forward", || {
            "look_at and forward exclude each other".into()
        });
        c.number("camera.yfov_degrees", self.yfov_degrees, |v| v > 0.0 && v < 180.0, "between 0 and 180 degrees");
        c.positive("camera.ymag", self.ymag);
        c.require(self.yfov_degrees.is_none() || self.ymag.is_none(), "camera.ymag", || {
            "yfov_degrees and ymag exclude each other".into()
        });
        c.not_negative("camera.aperture_radius", self.aperture_radius);
        c.positive("camera.focus_distance", self.focus_distance);
        if let (Some(position), Some(target)) = (self.position, self.look_at) {
            c.require(position != target, "camera.look_at", || "is where the camera is".into());
        }
    }

    /// Puts the camera first.
    fn apply(&self, cameras: &mut Vec<Camera>) -> Result<(), Wrong> {
        let missing = |name: &str| {
            let list: Vec<_> = cameras.iter().enumerate().map(|(i, c)| format!("{i} {:?}", c.name)).collect();
            let list = if list.is_empty() { "none".to_owned() } else { list.join(", ") };
            ("camera.name".to_owned(), format!("there is no camera {name:?}; there is {list}"))
        };
        let name = self.name.as_deref().unwrap_or("0");
        let chosen = match self.name {
            None => (!cameras.is_empty()).then_some(0),
            Some(_) => position(cameras, name),
        };
        let mut camera = cameras.remove(chosen.ok_or_else(|| missing(name))?);
        if let Some(position) = self.position {
            camera.world_from_camera.translation = position.into();
        }
        if self.look_at.is_some() || self.forward.is_some() || self.up.is_some() {
            let position = Vec3::from(camera.world_from_camera.translation);
            let forward = match (self.look_at, self.forward) {
                (Some(target), _) => Vec3::from(target) - position,
                (None, Some(forward)) => Vec3::from(forward),
                (None, None) => -Vec3::from(camera.world_from_camera.matrix3.z_axis),
            };
            let forward = forward.try_normalize().ok_or(("camera.look_at".into(), "is where the camera is".into()))?;
            let up = self.up.map_or(camera.up_axis(), Vec3::from).normalize_or(Vec3::Y);
            if let Some(target) = self.look_at {
                camera.focus_distance = position.distance(target.into());
            }
            camera.world_from_camera = orient(position, forward, up);
        }
        if let Some(yfov) = self.yfov_degrees {
            camera.projection = Projection::Perspective { yfov: yfov.to_radians() };
        }
        if let Some(ymag) = self.ymag {
            camera.projection = Projection::Orthographic { ymag };
        }
        camera.aperture_radius = self.aperture_radius.unwrap_or(camera.aperture_radius);
        camera.focus_distance = self.focus_distance.unwrap_or(camera.focus_distance);
        cameras.insert(0, camera);
        Ok(())
    }
}

/// The camera of that name, else of that number.
fn position(cameras: &[Camera], name: &str) -> Option<usize> {
    let by_name = cameras.iter().position(|camera| camera.name == name);
    by_name.or_else(|| name.parse().ok().filter(|index| *index < cameras.len()))
}

fn orient(position: Vec3, forward: Vec3, up: Vec3) -> Affine3A {
    // A camera may look straight up.
    let up = if up.cross(forward).length() > 1e-4 { up } else { forward.any_orthonormal_vector() };
    Camera::stand(position, forward, up)
}

impl EnvironmentSettings {
    /// Returns warnings.
    fn apply(
        &self,
        scene: &mut Scene,
        folder: &Path,
        read: &mut ReadEnvironment<'_>,
    ) -> Result<Vec<String>, SettingsError> {
        let mut warnings = Vec::new();
        let mut environment = match (&self.file, self.color) {
            (Some(file), _) => {
                let (environment, more) = read(&folder.join(file))?;
                warnings.extend(more);
                environment
            }
            (None, Some(_)) => Environment::uniform(Vec3::ONE),
            (None, None) => scene.environment.take().ok_or_else(|| SettingsError::Field {
                field: "environment".into(),
                problem: "neither file nor color is given, and the scene has no environment of its own".into(),
            })?,
        };
        environment.tint *= self.color.map_or(Vec3::ONE, Vec3::from);
        environment.rotation = self.rotation_degrees.map_or(environment.rotation, f32::to_radians);
        environment.strength = self.strength.unwrap_or(environment.strength);
        scene.environment = Some(environment);
        Ok(warnings)
    }
}

impl SphereSettings {
    fn check(&self, c: &mut Checks, place: &str) {
        c.point(&format!("{place}.centre"), Some(self.centre));
        c.positive(&format!("{place}.radius"), Some(self.radius));
        let own = self.base_color.is_some()
            || self.glass.is_some()
            || self.ior.is_some()
            || self.metallic.is_some()
            || self.roughness.is_some()
            || self.absorption.is_some()
            || self.emission.is_some();
        c.require(self.material.is_none() || !own, &format!("{place}.material"), || {
            "a sphere has a named material or one of its own, not both".into()
        });
        let within = |v: Vec3| v.min_element() >= 0.0 && v.max_element() <= 1.0;
        c.vector(&format!("{place}.base_color"), self.base_color, within, "between 0 and 1");
        c.positive(&format!("{place}.ior"), self.ior);
        c.unit(&format!("{place}.metallic"), self.metallic);
        c.unit(&format!("{place}.roughness"), self.roughness);
        c.color(&format!("{place}.absorption"), self.absorption);
        c.color(&format!("{place}.emission"), self.emission);
    }

    fn apply(&self, scene: &mut Scene, index: usize) -> Result<(), Wrong> {
        let material = match &self.material {
            Some(name) => scene.materials.iter().position(|material| material.name == *name).ok_or_else(|| {
                let names: Vec<&str> = scene.materials.iter().map(|m| m.name.as_str()).take(20).collect();
                (format!("sphere[{index}].material"), format!("there is no material {name:?}; there are {names:?}"))
            })?,
            None => {
                scene.materials.push(self.own_material(index));
                scene.materials.len() - 1
            }
        };
        let (centre, radius, inward) = (self.centre.into(), self.radius, self.inward);
        scene.spheres.push(Sphere { centre, radius, inward, material });
        Ok(())
    }

    fn own_material(&self, index: usize) -> Material {
        let name = format!("sphere {index}");
        let metallic = self.metallic.unwrap_or(0.0);
        let emission = self.emission.map_or(Vec3::ZERO, Vec3::from);
        let grey = if emission == Vec3::ZERO { Vec3::splat(0.5) } else { Vec3::ZERO };
        let mut material = match self.glass {
            Some(true) => Material::glass(&name, self.ior.unwrap_or(1.5)),
            _ => Material {
                roughness: if metallic > 0.0 { 0.0 } else { 1.0 },
                specular: if self.ior.is_some() { 1.0 } else { 0.0 },
                ior: self.ior.unwrap_or(1.5),
                ..Material::diffuse(&name, grey)
            },
        };
        material.base_color = self.base_color.map_or(material.base_color, Vec3::from);
        material.metallic = metallic;
        material.roughness = self.roughness.unwrap_or(material.roughness);
        material.absorption = self.absorption.map_or(Vec3::ZERO, Vec3::from);
        material.emission = emission;
        // A lamp with two bright sides would light its own inside.
        material.double_sided = emission == Vec3::ZERO;
        material
    }
}

impl LightSettings {
    fn check(&self, c: &mut Checks, place: &str) {
        let kind = self.kind;
        c.require(kind == LightKind::Directional || self.position.is_some(), place, || "position is missing".into());
        c.require(kind == LightKind::Point || self.direction.is_some(), place, || "direction is missing".into());
        c.point(&format!("{place}.position"), self.position);
        c.direction(&format!("{place}.direction"), self.direction);
        c.not_negative(&format!("{place}.intensity"), Some(self.intensity));
        c.color(&format!("{place}.color"), self.color);
        let (inner, outer) = self.cone();
        c.require(
            kind != LightKind::Spot || (0.0 <= inner && inner < outer && outer <= 90.0),
            &format!("{place}.outer_degrees"),
            || format!("{inner} and {outer} degrees are not 0 ≤ inner < outer ≤ 90"),
        );
    }

    fn cone(&self) -> (f32, f32) {
        (self.inner_degrees.unwrap_or(0.0), self.outer_degrees.unwrap_or(45.0))
    }

    fn light(&self, index: usize) -> PunctualLight {
        let (inner, outer) = self.cone();
        PunctualLight {
            name: format!("light {index}"),
            position: self.position.map_or(Vec3::ZERO, Vec3::from),
            direction: self.direction.map_or(Vec3::NEG_Y, Vec3::from).normalize_or(Vec3::NEG_Y),
            intensity: self.color.map_or(Vec3::ONE, Vec3::from) * self.intensity,
            kind: match self.kind {
                LightKind::Point => PunctualKind::Point,
                LightKind::Spot => PunctualKind::Spot { inner: inner.to_radians(), outer: outer.to_radians() },
                LightKind::Directional => PunctualKind::Directional,
            },
        }
    }
}
