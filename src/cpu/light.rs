//! Where light comes from: towards a point, or out into the scene as photons.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::surface;
use super::texture;
use super::trace;
use crate::layout::{
    LIGHT_AREA, LIGHT_DIRECTIONAL, LIGHT_ENVIRONMENT, LIGHT_POINT, LIGHT_SPOT, Light, MATERIAL_DOUBLE_SIDED, NONE,
    PRIMITIVE_SPHERE, Primitive,
};
use crate::math::{basis::Basis, warp};
use crate::scene::{Environment, PackedScene};

/// Light that may arrive at a point.
#[derive(Clone, Copy, Debug)]
pub struct Incoming {
    /// Unit, towards the light.
    pub direction: Vec3,
    /// Metres; infinite for distant lights.
    pub distance: f32,
    /// Radiance, or for lights without extent intensity/d² or irradiance.
    pub light: Vec3,
    /// Density per steradian; for lights without extent the probability of choosing this one.
    pub pdf: f32,
    /// Whether a direction sampled by the BSDF could never have found it.
    pub point_like: bool,
}

/// A photon as it leaves a light.
#[derive(Clone, Copy, Debug)]
pub struct Emission {
    /// Metres, world space.
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    /// Flux, W, as if the whole emission were this one path.
    pub power: Vec3,
}

/// The light that the number in [0, 1) falls on, by binary search.
#[inline]
pub fn choose(scene: &PackedScene, u: f32) -> usize {
    scene.lights.partition_point(|l| l.cumulative <= u).min(scene.lights.len() - 1)
}

/// Whether directions sampled by a BSDF can find any light.
pub fn has_extended(scene: &PackedScene) -> bool {
    scene.lights.iter().any(|l| l.kind == LIGHT_AREA || l.kind == LIGHT_ENVIRONMENT)
}

fn point_on(scene: &PackedScene, p: &Primitive, u: [f32; 2]) -> (Vec3, texture::Attributes) {
    if p.flags & PRIMITIVE_SPHERE != 0 {
        let at = Vec3::from(p.a) + warp::sphere(u) * p.b[0];
        return (at, texture::attributes(scene, p, 0.0, 0.0));
    }
    let w = warp::triangle(u);
    let at = Vec3::from(p.a) * (1.0 - w.x - w.y) + Vec3::from(p.b) * w.x + Vec3::from(p.c) * w.y;
    (at, texture::attributes(scene, p, w.x, w.y))
}

fn double_sided(scene: &PackedScene, p: &Primitive) -> bool {
    scene.materials[p.material as usize].flags & MATERIAL_DOUBLE_SIDED != 0
}

/// Light towards `position` from a light chosen by its power; none if that one does not reach it.
pub fn sample(scene: &PackedScene, position: Vec3, u: [f32; 3]) -> Option<Incoming> {
    if scene.lights.is_empty() {
        return None;
    }
    let light = &scene.lights[choose(scene, u[0])];
    let square = [u[1], u[2]];
    match light.kind {
        LIGHT_AREA => {
            let p = &scene.primitives[light.primitive as usize];
            let (at, attributes) = point_on(scene, p, square);
            let to = at - position;
            let distance2 = to.length_squared();
            let distance = distance2.sqrt();
            if distance == 0.0 {
                return None;
            }
            let direction = to / distance;
            let cos = -trace::geometric_normal(p, at).dot(direction);
            if cos == 0.0 || cos < 0.0 && !double_sided(scene, p) {
                return None;
            }
            Some(Incoming {
                direction,
                distance,
                light: surface::emission(scene, p, &attributes),
                pdf: light.probability * distance2 / (light.area * cos.abs()),
                point_like: false,
            })
        }
        LIGHT_POINT | LIGHT_SPOT => {
            let to = Vec3::from(light.position) - position;
            let distance2 = to.length_squared();
            if distance2 == 0.0 {
                return None;
            }
            let distance = distance2.sqrt();
            let direction = to / distance;
            let falloff = spot(light, -direction);
            (falloff > 0.0).then(|| Incoming {
                direction,
                distance,
                light: Vec3::from(light.intensity) * (falloff / distance2),
                pdf: light.probability,
                point_like: true,
            })
        }
        LIGHT_DIRECTIONAL => Some(Incoming {
            direction: -Vec3::from(light.direction),
            distance: f32::INFINITY,
            light: light.intensity.into(),
            pdf: light.probability,
            point_like: true,
        }),
        _ => {
            let (direction, pdf) = sample_environment(scene, square);
            (pdf > 0.0).then(|| Incoming {
                direction,
                distance: f32::INFINITY,
                light: environment(scene, direction),
                pdf: light.probability * pdf,
                point_like: false,
            })
        }
    }
}

/// Share of a spot light's intensity (`KHR_lights_punctual`); 1 for a point light.
fn spot(light: &Light, direction: Vec3) -> f32 {
    if light.kind != LIGHT_SPOT {
        return 1.0;
    }
    let cos = Vec3::from(light.direction).dot(direction);
    let t = ((cos - light.cos_outer) / (light.cos_inner - light.cos_outer).max(1e-4)).clamp(0.0, 1.0);
    t * t
}

/// Density per steradian with which [`sample`] finds a point of an emitting primitive.
pub fn area_pdf(scene: &PackedScene, light: u32, distance: f32, cos: f32) -> f32 {
    if light == NONE || cos == 0.0 {
        return 0.0;
    }
    let l = &scene.lights[light as usize];
    l.probability * distance * distance / (l.area * cos.abs())
}

/// Density per steradian with which [`sample`] finds a direction of the environment.
pub fn environment_pdf(scene: &PackedScene, direction: Vec3) -> f32 {
    if scene.info.environment_light == NONE {
        return 0.0;
    }
    let probability = scene.lights[scene.info.environment_light as usize].probability;
    probability * environment_direction_pdf(scene, direction)
}

fn map_from_world(scene: &PackedScene, d: Vec3) -> Vec3 {
    let [c, s] = scene.info.environment_rotation;
    Vec3::new(c * d.x - s * d.z, d.y, s * d.x + c * d.z)
}

fn world_from_map(scene: &PackedScene, d: Vec3) -> Vec3 {
    let [c, s] = scene.info.environment_rotation;
    Vec3::new(c * d.x + s * d.z, d.y, -s * d.x + c * d.z)
}

fn texel_of(scene: &PackedScene, uv: Vec2) -> (u32, u32) {
    let (w, h) = (scene.info.environment_width, scene.info.environment_height);
    (((uv.x * w as f32) as u32).min(w - 1), ((uv.y * h as f32) as u32).min(h - 1))
}

/// Probability of a texel, and its solid angle over its share of the square.
fn texel_density(scene: &PackedScene, x: u32, y: u32, v: f32) -> f32 {
    let (w, h) = (scene.info.environment_width, scene.info.environment_height);
    let row = |y: u32| scene.environment_rows[y as usize];
    let cell = |x: u32| scene.environment[(y * w + x) as usize][3];
    let in_rows = row(y) - if y > 0 { row(y - 1) } else { 0.0 };
    let in_row = cell(x) - if x > 0 { cell(x - 1) } else { 0.0 };
    let sin = (v * PI).sin().max(1e-6);
    in_rows * in_row * (w * h) as f32 / (2.0 * PI * PI * sin)
}

fn environment_direction_pdf(scene: &PackedScene, direction: Vec3) -> f32 {
    let uv = Environment::uv_of(map_from_world(scene, direction));
    let (x, y) = texel_of(scene, uv);
    texel_density(scene, x, y, uv.y)
}

/// A direction towards the environment and its density per steradian, the choice of the light not counted.
fn sample_environment(scene: &PackedScene, u: [f32; 2]) -> (Vec3, f32) {
    let (w, h) = (scene.info.environment_width, scene.info.environment_height);
    let place = |cumulative: &dyn Fn(u32) -> f32, n: u32, u: f32| {
        let (mut low, mut high) = (0, n - 1);
        while low < high {
            let middle = (low + high) / 2;
            if cumulative(middle) <= u { low = middle + 1 } else { high = middle }
        }
        let before = if low > 0 { cumulative(low - 1) } else { 0.0 };
        let width = cumulative(low) - before;
        (low, if width > 0.0 { ((u - before) / width).clamp(0.0, 0.999_999) } else { 0.5 })
    };
    let (y, fy) = place(&|y| scene.environment_rows[y as usize], h, u[0]);
    let (x, fx) = place(&|x| scene.environment[(y * w + x) as usize][3], w, u[1]);
    let uv = Vec2::new((x as f32 + fx) / w as f32, (y as f32 + fy) / h as f32);
    (world_from_map(scene, Environment::direction_of(uv)), texel_density(scene, x, y, uv.y))
}

/// Radiance from the environment, bilinear; black without one.
pub fn environment(scene: &PackedScene, direction: Vec3) -> Vec3 {
    if scene.info.environment_light == NONE {
        return Vec3::ZERO;
    }
    let (w, h) = (scene.info.environment_width as i32, scene.info.environment_height as i32);
    let uv = Environment::uv_of(map_from_world(scene, direction));
    let (x, y) = (uv.x * w as f32 - 0.5, uv.y * h as f32 - 0.5);
    let (x0, y0) = (x.floor(), y.floor());
    let (fx, fy) = (x - x0, y - y0);
    let fetch = |x: i32, y: i32| {
        let [r, g, b, _] = scene.environment[(y.clamp(0, h - 1) * w + x.rem_euclid(w)) as usize];
        Vec3::new(r, g, b)
    };
    let (i, j) = (x0 as i32, y0 as i32);
    let low = fetch(i, j) * (1.0 - fx) + fetch(i + 1, j) * fx;
    let high = fetch(i, j + 1) * (1.0 - fx) + fetch(i + 1, j + 1) * fx;
    (low * (1.0 - fy) + high * fy) * Vec3::from(scene.info.environment_scale)
}

/// Sends out a photon: `u` chooses the light and where, `v` the direction and the side.
pub fn emit(scene: &PackedScene, u: [f32; 3], v: [f32; 3]) -> Option<Emission> {
    if scene.lights.is_empty() {
        return None;
    }
    let light = &scene.lights[choose(scene, u[0])];
    let chosen = 1.0 / light.probability;
    let square = [u[1], u[2]];
    let angle = [v[0], v[1]];
    match light.kind {
        LIGHT_AREA => {
            let p = &scene.primitives[light.primitive as usize];
            let (at, attributes) = point_on(scene, p, square);
            let mut normal = trace::geometric_normal(p, at);
            let mut sides = 1.0;
            if double_sided(scene, p) {
                sides = 2.0;
                if v[2] < 0.5 {
                    normal = -normal;
                }
            }
            let direction = Basis::around(normal).world(warp::cosine(angle));
            let power = surface::emission(scene, p, &attributes) * (PI * light.area * sides * chosen);
            Some(Emission { origin: trace::leave(scene, at, normal, direction), direction, power })
        }
        LIGHT_POINT => Some(Emission {
            origin: light.position.into(),
            direction: warp::sphere(angle),
            power: Vec3::from(light.intensity) * (4.0 * PI * chosen),
        }),
        LIGHT_SPOT => {
            let local = warp::cone(angle, light.cos_outer);
            let direction = Basis::around(light.direction.into()).world(local);
            let power = Vec3::from(light.intensity) * (spot(light, direction) * TAU * (1.0 - light.cos_outer) * chosen);
            (power.max_element() > 0.0).then(|| Emission { origin: light.position.into(), direction, power })
        }
        LIGHT_DIRECTIONAL => {
            let direction = Vec3::from(light.direction);
            let (origin, area) = on_disc(scene, direction, square);
            Some(Emission { origin, direction, power: Vec3::from(light.intensity) * (area * chosen) })
        }
        _ => {
            let (from, pdf) = sample_environment(scene, angle);
            if pdf <= 0.0 {
                return None;
            }
            let (origin, area) = on_disc(scene, -from, square);
            let power = environment(scene, from) * (area * chosen / pdf);
            Some(Emission { origin, direction: -from, power })
        }
    }
}

/// On the disc that the scene's bounding sphere shows to light travelling along `direction`, before the scene; and one over
/// the density of that place, m².
///
/// Where the subject is a speck in the scene, half of the photons lie about it: evenly as far as it reaches, ever sparser from
/// there on, in every octave of distances as many. So those beside it, whose light it reflects, have little more power.
fn on_disc(scene: &PackedScene, direction: Vec3, u: [f32; 2]) -> (Vec3, f32) {
    let (radius, subject_radius) = (scene.info.radius, scene.info.subject_radius);
    let (centre, basis) = (Vec3::from(scene.info.centre), Basis::around(direction));
    let at = |p: Vec2| centre + basis.x * p.x + basis.y * p.y - direction * radius;
    if subject_radius == 0.0 {
        return (at(warp::disc(u) * radius), PI * radius * radius);
    }
    let to = Vec3::from(scene.info.subject_centre) - centre;
    let middle = Vec2::new(to.dot(basis.x), to.dot(basis.y));
    let share = scene.subject_share();
    let is_about = u[0] < 0.5;
    let unit = warp::disc([2.0 * u[0] - f32::from(!is_about), u[1]]);
    let p = if is_about {
        let t = unit.length_squared();
        let distance = if t < share {
            subject_radius * (t / share).sqrt()
        } else {
            subject_radius * ((t - share) / (1.0 - share) * (radius / subject_radius).ln()).exp()
        };
        middle + unit.normalize_or_zero() * distance
    } else {
        unit * radius
    };
    let distance = p.distance(middle);
    // Rounding puts no sample outside of where it is from.
    let about = if is_about || distance <= radius { share / distance.max(subject_radius).powi(2) } else { 0.0 };
    let evenly = if !is_about || p.length() <= radius { 1.0 / (radius * radius) } else { 0.0 };
    (at(p), TAU / (about + evenly))
}
