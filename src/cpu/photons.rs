//! Photon paths: from the lamps, through everything, stored wherever an eye path could gather.

use glam::Vec3;

use super::bsdf::{Bsdf, Lobes, Transport};
use super::trace::{self, Ray, Seer};
use super::{eye, light, surface};
use crate::layout::{FRAME_ROULETTE, FRAME_SAMPLE_DIRECT, Frame, MAX_PHOTON_SEGMENTS, PHOTON_CAUSTIC, Photon};
use crate::math::oct;
use crate::math::rng::{Rng, Stream};
use crate::scene::PackedScene;

/// What happens to the power of a photon path. All that is emitted is reported as one of the others, once.
pub trait Sink {
    /// A photon to gather; its power goes on.
    fn store(&mut self, photon: Photon);
    /// Power that left a lamp.
    fn emitted(&mut self, _power: Vec3) {}
    /// Power that a surface or a medium took; negative where roulette or the sampling gave instead.
    fn absorbed(&mut self, _power: Vec3) {}
    /// Power that left the scene.
    fn escaped(&mut self, _power: Vec3) {}
    /// Power that was still on its way at the longest path allowed.
    fn cut_off(&mut self, _power: Vec3) {}
}

impl Sink for Vec<Photon> {
    fn store(&mut self, photon: Photon) {
        self.push(photon);
    }
}

/// Follows photon path `path` of the frame.
pub fn trace(scene: &PackedScene, frame: &Frame, path: u32, sink: &mut impl Sink) {
    let mut rng = Rng::new(Stream::Photon, path, frame.iteration, frame.seed);
    let (u, v) = (rng.next4(), rng.next4());
    let Some(emission) = light::emit(scene, [u[0], u[1], u[2]], [v[0], v[1], v[2]]) else { return };
    let (mut origin, mut direction, mut power) = (emission.origin, emission.direction, emission.power);
    sink.emitted(power);
    // The eye's side adds at least one segment.
    let longest = frame.max_photon_segments.min(MAX_PHOTON_SEGMENTS).min(frame.max_segments.saturating_sub(1));
    let mut medium = Vec3::ZERO;
    let mut segments = 0;
    let mut caustic = false;
    while segments < longest {
        let ray = Ray { origin, direction, t_max: f32::INFINITY, alpha_seed: rng.alpha_seed(), seer: Seer::Light };
        segments += 1;
        let Some(hit) = trace::nearest(scene, &ray) else {
            sink.escaped(power);
            return;
        };
        let s = surface::at(scene, &hit, origin, direction);
        let arriving = power * eye::absorbed(scene, &s, medium, hit.t);
        sink.absorbed(power - arriving);
        power = arriving;
        let bsdf = Bsdf::new(scene, &s);
        let incoming = -direction;
        let gathered = bsdf.gathered();
        let is_direct = segments == 1;
        if (gathered.diffuse || gathered.specular) && !(is_direct && frame.flags & FRAME_SAMPLE_DIRECT != 0) {
            sink.store(Photon {
                position: s.position.to_array(),
                normal_and_segments: oct::encode24(s.normal)
                    | (segments | if caustic { PHOTON_CAUSTIC } else { 0 }) << 24,
                power: (power * shading(&s, incoming)).to_array(),
                direction: oct::encode(incoming),
            });
        }
        let u = rng.next4();
        let Some(scatter) = bsdf.sample(incoming, Lobes::ALL, Transport::Importance, [u[0], u[1], u[2]]) else {
            sink.absorbed(power);
            return;
        };
        let mut next = power * scatter.weight;
        if frame.flags & FRAME_ROULETTE != 0 {
            // By the change in power: photons stay about as strong as they were emitted.
            let survive = (next.max_element() / power.max_element().max(f32::MIN_POSITIVE)).min(1.0);
            if u[3] >= survive {
                sink.absorbed(power);
                return;
            }
            next /= survive;
        }
        sink.absorbed(power - next);
        power = next;
        if power.max_element() <= 0.0 {
            return;
        }
        caustic = (is_direct || caustic) && scatter.specular && bsdf.traced().specular;
        if scatter.transmitted {
            medium = eye::beyond(scene, &s);
        }
        direction = scatter.direction;
        origin = trace::leave(scene, s.position, s.normal, direction);
    }
    sink.cut_off(power);
}

/// Flux crosses the real surface, but the BSDF weighs it by the shading normal's cosine (Veach 1997, §5.3).
fn shading(s: &surface::Surface, incoming: Vec3) -> f32 {
    if s.normal == s.shading_normal {
        return 1.0;
    }
    (s.shading_normal.dot(incoming) / s.normal.dot(incoming).max(1e-3)).clamp(0.0, 8.0)
}
