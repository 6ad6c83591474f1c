//! Eye paths: from the lens through mirrors and glass to the first surface rough enough to gather photons at.

use glam::Vec3;

use super::bsdf::{Bsdf, Lobes, Transport};
use super::surface::{self, Surface};
use super::trace::{self, Ray, Seer};
use super::{camera, light};
use crate::layout::{
    Camera, EYE_GATHER, EYE_GLOSSY, EyeVertex, FRAME_ROULETTE, FRAME_SAMPLE_DIRECT, Frame, MATERIAL_VOLUME,
};
use crate::math::oct;
use crate::math::rng::{Rng, Stream};
use crate::scene::PackedScene;

/// Segments after which roulette may end an eye path.
const ROULETTE_AFTER: u32 = 4;

/// Follows the eye path of the film pixel (`x`, `y`).
pub fn trace(scene: &PackedScene, camera: &Camera, frame: &Frame, x: u32, y: u32) -> EyeVertex {
    let pixel = (frame.crop_y + y) * frame.full_width + frame.crop_x + x;
    let mut rng = Rng::new(Stream::Eye, pixel, frame.iteration, frame.seed);
    let (mut origin, mut direction) = camera::ray(camera, frame, x, y, rng.next4());
    let longest = frame.max_eye_segments.min(frame.max_segments);
    let mut vertex = EyeVertex::default();
    let mut radiance = Vec3::ZERO;
    let mut throughput = Vec3::ONE;
    let mut medium = Vec3::ZERO; // absorption where the path is now, 1/m
    let mut pdf = 0.0; // of the last direction, if light sampling could have found what it hits
    let mut segments = 0;
    while segments < longest {
        let ray = Ray { origin, direction, t_max: f32::INFINITY, alpha_seed: rng.alpha_seed(), seer: Seer::Eye };
        segments += 1;
        let Some(hit) = trace::nearest(scene, &ray) else {
            radiance += throughput
                * light::environment(scene, direction)
                * balance(pdf, || light::environment_pdf(scene, direction));
            break;
        };
        let s = surface::at(scene, &hit, origin, direction);
        throughput *= absorbed(scene, &s, medium, hit.t);
        if s.emission != Vec3::ZERO {
            let cos = s.normal.dot(direction);
            radiance += throughput * s.emission * balance(pdf, || light::area_pdf(scene, s.light, hit.t, cos));
        }
        let bsdf = Bsdf::new(scene, &s);
        let outgoing = -direction;
        let u = rng.next4();
        let follow = bsdf.follow_probability(outgoing);
        if u[0] >= follow {
            throughput /= 1.0 - follow;
            let lobes = bsdf.gathered();
            if frame.flags & FRAME_SAMPLE_DIRECT != 0 && segments < frame.max_segments {
                radiance += throughput * direct(scene, &bsdf, &s, outgoing, medium, lobes, true, &mut rng);
                if !bsdf.is_diffuse() && light::has_extended(scene) {
                    radiance += throughput * found(scene, &bsdf, &s, outgoing, medium, lobes, &mut rng);
                }
            }
            fill(&mut vertex, scene, &bsdf, &s, outgoing);
            vertex.throughput = throughput.to_array();
            break;
        }
        throughput /= follow;
        let lobes = bsdf.traced();
        if !bsdf.is_smooth() && segments < longest {
            radiance += throughput * direct(scene, &bsdf, &s, outgoing, medium, lobes, segments < longest, &mut rng);
        }
        let v = rng.next4();
        let Some(scatter) = bsdf.sample(outgoing, lobes, Transport::Radiance, [v[0], v[1], v[2]]) else { break };
        throughput *= scatter.weight;
        pdf = scatter.pdf;
        if frame.flags & FRAME_ROULETTE != 0 && segments > ROULETTE_AFTER {
            let survive = throughput.max_element().min(0.95);
            if v[3] >= survive {
                break;
            }
            throughput /= survive;
        }
        if scatter.transmitted {
            medium = beyond(scene, &s);
        }
        direction = scatter.direction;
        origin = trace::leave(scene, s.position, s.normal, direction);
    }
    vertex.flags |= segments << 8;
    vertex.radiance = radiance.to_array();
    vertex
}

/// Weight of a direction that the BSDF chose with density `pdf`, where lights are sampled too (balance heuristic, Veach
/// 1997, §9.2.2); 1 where they were not.
fn balance(pdf: f32, light_pdf: impl FnOnce() -> f32) -> f32 {
    if pdf > 0.0 { pdf / (pdf + light_pdf()) } else { 1.0 }
}

/// What is left after `t` metres to the surface `s`. A back face knows what is behind it better than the path does.
pub(super) fn absorbed(scene: &PackedScene, s: &Surface, medium: Vec3, t: f32) -> Vec3 {
    let m = &scene.materials[s.material as usize];
    let sigma = if !s.front && m.flags & MATERIAL_VOLUME != 0 { m.absorption.into() } else { medium };
    if sigma == Vec3::ZERO { Vec3::ONE } else { transmittance(sigma, t) }
}

fn transmittance(sigma: Vec3, t: f32) -> Vec3 {
    (-sigma * t).exp()
}

/// Absorption on the other side of a surface.
pub(super) fn beyond(scene: &PackedScene, s: &Surface) -> Vec3 {
    let m = &scene.materials[s.material as usize];
    if m.flags & MATERIAL_VOLUME != 0 && s.front { m.absorption.into() } else { Vec3::ZERO }
}

/// Light sampled towards the surface `s`, through the `lobes`. `found_too`: directions the BSDF samples are followed as
/// well, and the two share the light between them.
fn direct(
    scene: &PackedScene,
    bsdf: &Bsdf,
    s: &Surface,
    outgoing: Vec3,
    medium: Vec3,
    lobes: Lobes,
    found_too: bool,
    rng: &mut Rng,
) -> Vec3 {
    let alpha_seed = rng.alpha_seed();
    let u = rng.next4();
    let Some(incoming) = light::sample(scene, s.position, [u[0], u[1], u[2]]) else { return Vec3::ZERO };
    let f = bsdf.evaluate(outgoing, incoming.direction, lobes, Transport::Radiance);
    if f == Vec3::ZERO || incoming.light == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let cos = bsdf.basis.z.dot(incoming.direction).abs();
    let share = if incoming.point_like || !found_too || bsdf.is_diffuse() {
        1.0
    } else {
        incoming.pdf / (incoming.pdf + bsdf.pdf(outgoing, incoming.direction, lobes))
    };
    let origin = trace::leave(scene, s.position, s.normal, incoming.direction);
    // A little short of the light itself.
    let t_max = incoming.distance * (1.0 - 1e-4);
    let ray = Ray { origin, direction: incoming.direction, t_max, alpha_seed, seer: Seer::Light };
    if trace::occluded(scene, &ray) {
        return Vec3::ZERO;
    }
    let mut arriving = f * incoming.light * (cos * share / incoming.pdf);
    if medium != Vec3::ZERO {
        arriving *= transmittance(medium, incoming.distance);
    }
    arriving
}

/// The other half of [`direct`]: a direction sampled by the BSDF, if it leads straight to a light.
fn found(
    scene: &PackedScene,
    bsdf: &Bsdf,
    s: &Surface,
    outgoing: Vec3,
    medium: Vec3,
    lobes: Lobes,
    rng: &mut Rng,
) -> Vec3 {
    let alpha_seed = rng.alpha_seed();
    let u = rng.next4();
    let Some(scatter) = bsdf.sample(outgoing, lobes, Transport::Radiance, [u[0], u[1], u[2]]) else {
        return Vec3::ZERO;
    };
    let direction = scatter.direction;
    let origin = trace::leave(scene, s.position, s.normal, direction);
    let ray = Ray { origin, direction, t_max: f32::INFINITY, alpha_seed, seer: Seer::Light };
    let Some(hit) = trace::nearest(scene, &ray) else {
        let share = scatter.pdf / (scatter.pdf + light::environment_pdf(scene, direction));
        return scatter.weight * light::environment(scene, direction) * share;
    };
    let lamp = surface::at(scene, &hit, origin, direction);
    if lamp.emission == Vec3::ZERO {
        return Vec3::ZERO;
    }
    let cos = lamp.normal.dot(direction);
    let share = scatter.pdf / (scatter.pdf + light::area_pdf(scene, lamp.light, hit.t, cos));
    let medium = if scatter.transmitted { beyond(scene, s) } else { medium };
    scatter.weight * lamp.emission * absorbed(scene, &lamp, medium, hit.t) * share
}

fn fill(vertex: &mut EyeVertex, scene: &PackedScene, bsdf: &Bsdf, s: &Surface, outgoing: Vec3) {
    let m = &scene.materials[s.material as usize];
    let gathered = bsdf.gathered();
    vertex.position = s.position.to_array();
    vertex.flags = EYE_GATHER | if gathered.specular { EYE_GLOSSY } else { 0 };
    vertex.normal = oct::encode(s.normal);
    vertex.diffuse = bsdf.diffuse(bsdf.basis.z.dot(outgoing)).to_array();
    vertex.shading_normal = oct::encode(s.shading_normal);
    vertex.base_color = s.base_color.to_array();
    vertex.outgoing = oct::encode(outgoing);
    vertex.roughness = s.roughness;
    vertex.f0 = m.f0;
    vertex.metallic = s.metallic;
    vertex.transmission = s.transmission;
    vertex.eta = bsdf.eta();
    vertex.f90 = m.f90;
    vertex.material_flags = m.flags;
}
