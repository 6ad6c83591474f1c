//! Lamps, lights and the environment.

use std::sync::{Arc, Weak};

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::PackedScene;
use crate::layout::{self, NONE, Primitive, Vertex};
use crate::scene::{Material, PunctualKind, Scene, environment};

/// What the environment's texels were made from.
#[derive(Clone, Debug)]
pub(super) struct Sky {
    /// Only to tell whether others are these.
    texels: Weak<Vec<Vec3>>,
    size: [u32; 2],
    /// Mean radiance without strength and tint.
    mean: Vec3,
}

/// A primitive that shines.
struct Lamp {
    primitive: u32,
    area: f32,
    /// Watts, were luminance radiance.
    power: f32,
}

impl PackedScene {
    /// The environment without strength and tint, shared with `before` if it is the same; also one that does not shine.
    pub(super) fn pack_environment(&mut self, scene: &Scene, before: &Self) {
        let Some(e) = &scene.environment else { return };
        let (texels, size) = (Arc::downgrade(&e.texels), [e.width, e.height]);
        if let Some(sky) = before.sky.as_ref().filter(|sky| sky.texels.ptr_eq(&texels) && sky.size == size) {
            self.sky = Some(sky.clone());
            self.environment = Arc::clone(&before.environment);
            self.environment_rows = Arc::clone(&before.environment_rows);
        } else {
            let (packed, rows, mean) = environment::pack(e);
            self.sky = Some(Sky { texels, size, mean });
            (self.environment, self.environment_rows) = (packed.into(), rows.into());
        }
    }

    /// Of the photons of far lights that are sent about the subject, the share within its radius. From there on their density
    /// falls with the square of the distance, up to the radius of the scene; with this share it does not leap.
    pub(crate) fn subject_share(&self) -> f32 {
        1.0 / (1.0 + 2.0 * (self.info.radius / self.info.subject_radius).ln())
    }

    /// One over the density of a far light's photons, m²: on the subject, if there is one. By it such a light is weighed against
    /// others.
    fn photon_area(&self) -> f32 {
        let [all, subject] = [self.info.radius, self.info.subject_radius].map(|radius| radius * radius);
        match subject > 0.0 {
            true => std::f32::consts::TAU / (1.0 / all + self.subject_share() / subject),
            false => std::f32::consts::PI * all,
        }
    }

    /// After everything else.
    pub(super) fn pack_lights(&mut self, scene: &Scene) {
        let lamps = self.lamps(scene);
        self.mark(&lamps);
        let light = |lamp: &Lamp| layout::Light {
            kind: layout::LIGHT_AREA,
            primitive: lamp.primitive,
            area: lamp.area,
            ..layout::Light::default()
        };
        self.lights = lamps.iter().map(light).collect();
        let mut powers: Vec<f32> = lamps.iter().map(|lamp| lamp.power).collect();
        let disc = self.photon_area();
        for l in &scene.lights {
            let brightness = luminance(l.intensity);
            if brightness <= 0.0 {
                continue;
            }
            let mut light = layout::Light {
                position: l.position.to_array(),
                direction: l.direction.to_array(),
                intensity: l.intensity.to_array(),
                primitive: NONE,
                ..layout::Light::default()
            };
            let power = match l.kind {
                PunctualKind::Point => {
                    light.kind = layout::LIGHT_POINT;
                    brightness * 4.0 * std::f32::consts::PI
                }
                PunctualKind::Spot { inner, outer } => {
                    light.kind = layout::LIGHT_SPOT;
                    light.cos_inner = inner.cos();
                    light.cos_outer = outer.cos();
                    brightness * std::f32::consts::TAU * (1.0 - 0.5 * (light.cos_inner + light.cos_outer))
                }
                PunctualKind::Directional => {
                    light.kind = layout::LIGHT_DIRECTIONAL;
                    brightness * disc
                }
            };
            self.lights.push(light);
            powers.push(power);
        }
        self.info.environment_light = NONE;
        if let Some((e, sky)) = scene.environment.as_ref().zip(self.sky.as_ref()) {
            let scale = e.tint * e.strength;
            let mean = luminance(sky.mean * scale);
            if mean > 0.0 {
                [self.info.environment_width, self.info.environment_height] = sky.size;
                self.info.environment_rotation = [e.rotation.cos(), e.rotation.sin()];
                self.info.environment_scale = scale.to_array();
                self.info.environment_light = self.lights.len() as u32;
                self.lights.push(layout::Light {
                    kind: layout::LIGHT_ENVIRONMENT,
                    primitive: NONE,
                    ..layout::Light::default()
                });
                powers.push(mean * 4.0 * std::f32::consts::PI * disc);
            }
        }
        let total: f64 = powers.iter().map(|&p| f64::from(p)).sum();
        let mut sum = 0.0;
        for (light, power) in self.lights.iter_mut().zip(&powers) {
            sum += f64::from(*power);
            light.probability = (f64::from(*power) / total) as f32;
            light.cumulative = (sum / total) as f32;
        }
        if let Some(last) = self.lights.last_mut() {
            last.cumulative = 1.0;
        }
        self.info.n_lights = self.lights.len() as u32;
    }

    /// The primitives that shine, in their order.
    fn lamps(&self, scene: &Scene) -> Vec<Lamp> {
        let shines: Vec<bool> = scene.materials.iter().map(|m| m.emission.max_element() > 0.0).collect();
        if !shines.contains(&true) {
            return Vec::new();
        }
        let linear = std::array::from_fn(|texel| (texel as f32 / 255.0).powf(2.2));
        let lamp = |(i, p): (usize, &Primitive)| {
            if !shines[p.material as usize] {
                return None;
            }
            let material = &scene.materials[p.material as usize];
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            let area = primitive_area(p);
            let textured = mean_emission(scene, material, p, &self.vertices, &linear);
            let power = luminance(material.emission * textured) * area * std::f32::consts::PI * sides;
            (power > 0.0 && area > 0.0).then_some(Lamp { primitive: i as u32, area, power })
        };
        self.primitives.par_iter().enumerate().filter_map(lamp).collect()
    }

    /// Has the primitives name their lights, unless they do.
    fn mark(&mut self, lamps: &[Lamp]) {
        let mut wanted = lamps.iter().map(|lamp| lamp.primitive).zip(0..).peekable();
        let mut light_of = |i: u32| wanted.next_if(|(primitive, _)| *primitive == i).map_or(NONE, |(_, light)| light);
        if self.primitives.iter().zip(0..).all(|(p, i)| p.light == light_of(i)) {
            return;
        }
        let primitives = Arc::make_mut(&mut self.primitives);
        primitives.iter_mut().for_each(|p| p.light = NONE);
        for (lamp, light) in lamps.iter().zip(0..) {
            primitives[lamp.primitive as usize].light = light;
        }
    }
}

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

fn primitive_area(p: &Primitive) -> f32 {
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        return 4.0 * std::f32::consts::PI * p.b[0] * p.b[0];
    }
    let a = Vec3::from(p.a);
    0.5 * (Vec3::from(p.b) - a).cross(Vec3::from(p.c) - a).length()
}

/// Mean of the emission texture over a primitive, linear; ones without a texture. It only steers which lamp is chosen.
fn mean_emission(scene: &Scene, material: &Material, p: &Primitive, vertices: &[Vertex], linear: &[f32; 256]) -> Vec3 {
    let Some(t) = &material.emission_texture else { return Vec3::ONE };
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        return Vec3::ONE;
    }
    let image = &scene.images[t.image];
    let uv = p.vertices.map(|v| {
        let v = &vertices[v as usize];
        t.transform * if t.uv_set == 1 { Vec2::from(v.uv1) } else { Vec2::new(v.u0, v.v0) } + t.offset
    });
    let mut sum = Vec3::ZERO;
    const N: usize = 8;
    for i in 0..N {
        for j in 0..N {
            let w = crate::math::warp::triangle([(i as f32 + 0.5) / N as f32, (j as f32 + 0.5) / N as f32]);
            let at = uv[0] * (1.0 - w.x - w.y) + uv[1] * w.x + uv[2] * w.y;
            let texel = |f: f32, n: u32| ((f.rem_euclid(1.0) * n as f32) as u32).min(n - 1);
            let [r, g, b, _] =
                image.texels[(texel(at.y, image.height) * image.width + texel(at.x, image.width)) as usize];
            sum += Vec3::from([r, g, b].map(|c| linear[usize::from(c)]));
        }
    }
    // Never zero: a bright texel between the samples must stay possible to sample.
    sum / (N * N) as f32 + 1e-4
}
