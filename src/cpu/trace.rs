//! Rays against the scene.

use std::ops::ControlFlow;

use glam::{Vec3, Vec3A, Vec4};

use super::texture;
use crate::index::kd;
use crate::layout::{
    NONE, PRIMITIVE_ALPHA, PRIMITIVE_INWARD, PRIMITIVE_SINGLE_SIDED, PRIMITIVE_SPHERE, Primitive, SceneNode,
};
use crate::math::rng;
use crate::scene::{PackedScene, SceneKd, bvh::MAX_DEPTH};

/// Who follows a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seer {
    /// Looks through the back of single-sided surfaces.
    Eye,
    /// Is stopped by them.
    Light,
}

/// A ray in world space; t in metres, for `direction` is a unit vector.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Metres.
    pub origin: Vec3,
    /// Unit.
    pub direction: Vec3,
    /// Hits lie in (0, t_max).
    pub t_max: f32,
    /// Decides where a half-transparent surface is there; any number, the same on both backends.
    pub alpha_seed: u32,
    /// Who follows.
    pub seer: Seer,
}

/// The nearest hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Metres along the ray.
    pub t: f32,
    /// Index into the packed primitives.
    pub primitive: u32,
    /// Weight of the second corner.
    pub u: f32,
    /// Weight of the third corner.
    pub v: f32,
}

/// 1/d without infinities, so that 0·(1/d) stays 0.
#[inline]
fn reciprocal(d: f32) -> f32 {
    1.0 / if d.abs() < 1e-20 { 1e-20f32.copysign(d) } else { d }
}

/// Roundings of [`triangle`], for the kd-tree; [`MARGIN`](crate::scene::bvh::MARGIN) is the same for the BVH.
const ROUNDINGS: f64 = 64.0;

/// The nearest hit along the ray, and of several at the same t the one on the first primitive: it does not depend on the
/// accelerator.
pub fn nearest(scene: &PackedScene, ray: &Ray) -> Option<Hit> {
    find::<false>(scene, ray)
}

/// Whether anything is hit at all.
pub fn occluded(scene: &PackedScene, ray: &Ray) -> bool {
    find::<true>(scene, ray).is_some()
}

/// What [`nearest`] finds, by a test of every primitive.
pub fn nearest_of_all(scene: &PackedScene, ray: &Ray) -> Option<Hit> {
    let mut best = Hit::none(ray);
    for index in 0..scene.primitives.len() as u32 {
        meet(scene, ray, index, &mut best);
    }
    best.found()
}

impl Hit {
    fn none(ray: &Ray) -> Self {
        Self { t: ray.t_max, primitive: NONE, u: 0.0, v: 0.0 }
    }

    fn is_some(&self) -> bool {
        self.primitive != NONE
    }

    fn found(self) -> Option<Self> {
        self.is_some().then_some(self)
    }
}

#[inline]
fn find<const ANY: bool>(scene: &PackedScene, ray: &Ray) -> Option<Hit> {
    let mut best = Hit::none(ray);
    match &scene.kd {
        None => walk::<ANY>(&scene.nodes, ray, &mut best, |slot, best| meet(scene, ray, slot, best)),
        Some(kd) => through_planes::<ANY>(scene, kd, ray, &mut best),
    }
    best.found()
}

fn through_planes<const ANY: bool>(scene: &PackedScene, kd: &SceneKd, ray: &Ray, best: &mut Hit) {
    walk::<ANY>(&kd.sphere_nodes, ray, best, |slot, best| {
        if let Some(&index) = kd.spheres.get(slot as usize) {
            meet(scene, ray, index, best);
        }
    });
    if ANY && best.is_some() {
        return;
    }
    // A ray that is not finite meets nothing.
    let Ok(planes) = kd::Ray::new(ray.origin.to_array(), ray.direction.to_array()) else { return };
    let _ = kd.triangles.try_faces(&planes.within(0.0, best.t), ROUNDINGS, |index| {
        meet(scene, ray, index, best);
        if ANY && best.is_some() { ControlFlow::Break(()) } else { ControlFlow::Continue(best.t) }
    });
}

/// Meets what the leaves on the way list, from near to far.
#[inline]
fn walk<const ANY: bool>(nodes: &[SceneNode], ray: &Ray, best: &mut Hit, meet: impl Fn(u32, &mut Hit)) {
    if nodes.is_empty() {
        return;
    }
    let origin = Vec3A::from(ray.origin);
    let inverse = Vec3A::new(reciprocal(ray.direction.x), reciprocal(ray.direction.y), reciprocal(ray.direction.z));
    let leaf = |(first, count): (u32, u32), best: &mut Hit| {
        (first..first.saturating_add(count)).for_each(|slot| meet(slot, best))
    };
    let mut stack = [(0u32, 0f32); MAX_DEPTH];
    let mut height = 0;
    let mut at = 0u32;
    loop {
        let node: &[[f32; 4]; 4] = bytemuck::cast_ref(&nodes[at as usize]);
        let [l0, l1, r0, r1] = node.map(Vec4::from_array);
        let enter = |min: Vec4, max: Vec4| -> f32 {
            let t0 = (Vec3A::from_vec4(min) - origin) * inverse;
            let t1 = (Vec3A::from_vec4(max) - origin) * inverse;
            let near = t0.min(t1).max_element().max(0.0);
            // Two ulps more (Ize 2013), so that rounding never loses a box.
            let far = t0.max(t1).min_element().min(best.t) * (1.0 + 2.4e-7);
            if near <= far { near } else { f32::INFINITY }
        };
        let mut near = enter(l0, l1);
        let mut far = enter(r0, r1);
        let (mut near_child, mut far_child) = ((l0.w.to_bits(), l1.w.to_bits()), (r0.w.to_bits(), r1.w.to_bits()));
        if far < near {
            (near, far) = (far, near);
            (near_child, far_child) = (far_child, near_child);
        }
        let mut next = None;
        if near < f32::INFINITY {
            if near_child.1 > 0 {
                leaf(near_child, best);
            } else {
                next = Some(near_child.0);
            }
        }
        if far < f32::INFINITY {
            if far_child.1 > 0 {
                leaf(far_child, best);
            } else if next.is_some() {
                stack[height] = (far_child.0, far);
                height += 1;
            } else {
                next = Some(far_child.0);
            }
        }
        if ANY && best.is_some() {
            return;
        }
        at = match next {
            Some(node) => node,
            None => loop {
                if height == 0 {
                    return;
                }
                height -= 1;
                if stack[height].1 <= best.t {
                    break stack[height].0;
                }
            },
        };
    }
}

/// Tests one primitive.
#[inline]
fn meet(scene: &PackedScene, ray: &Ray, index: u32, best: &mut Hit) {
    let Some(primitive) = scene.primitives.get(index as usize) else { return };
    let hit = if primitive.flags & PRIMITIVE_SPHERE == 0 {
        triangle(primitive, ray, best.t)
    } else {
        sphere(primitive, ray, best.t)
    };
    let Some((t, u, v)) = hit else { return };
    // At the same t no order of the primitives but their own decides.
    if t == best.t && (best.primitive == NONE || best.primitive <= index) {
        return;
    }
    let hit = Hit { t, primitive: index, u, v };
    if primitive.flags & (PRIMITIVE_ALPHA | PRIMITIVE_SINGLE_SIDED) == 0 || is_there(scene, primitive, ray, &hit) {
        *best = hit;
    }
}

/// Edge functions of the ray against the edges as seen from the origin: two triangles that share an edge compute the
/// same number with opposite sign, so no ray passes between them.
#[inline]
fn triangle(p: &Primitive, ray: &Ray, t_max: f32) -> Option<(f32, f32, f32)> {
    let a = Vec3A::from(p.a) - Vec3A::from(ray.origin);
    let b = Vec3A::from(p.b) - Vec3A::from(ray.origin);
    let c = Vec3A::from(p.c) - Vec3A::from(ray.origin);
    let d = Vec3A::from(ray.direction);
    let (ca, ab, bc) = (c - a, a - b, b - c);
    let u = ca.cross(c + a).dot(d);
    let v = ab.cross(a + b).dot(d);
    let w = bc.cross(b + c).dot(d);
    if u.min(v).min(w) < 0.0 && u.max(v).max(w) > 0.0 {
        return None;
    }
    let normal = ab.cross(ca);
    let slope = normal.dot(d);
    let sum = u + v + w;
    if slope == 0.0 || sum == 0.0 {
        return None;
    }
    let t = a.dot(normal) / slope;
    (t > 0.0 && t <= t_max).then(|| (t, u / sum, v / sum))
}

/// With the discriminant from the distance of the centre to the ray (Haines et al. 2019, "Precision Improvements for
/// Ray/Sphere Intersection").
#[inline]
fn sphere(p: &Primitive, ray: &Ray, t_max: f32) -> Option<(f32, f32, f32)> {
    let radius = p.b[0];
    let f = ray.origin - Vec3::from(p.a);
    let b = -f.dot(ray.direction);
    let apart = f + b * ray.direction;
    let discriminant = radius * radius - apart.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let q = b + discriminant.sqrt().copysign(b);
    let c = f.length_squared() - radius * radius;
    let (mut t0, mut t1) = if q == 0.0 { (0.0, 0.0) } else { (c / q, q) };
    if t0 > t1 {
        std::mem::swap(&mut t0, &mut t1);
    }
    [t0, t1].into_iter().find(|&t| t > 0.0 && t <= t_max).map(|t| (t, 0.0, 0.0))
}

#[cold]
fn is_there(scene: &PackedScene, p: &Primitive, ray: &Ray, hit: &Hit) -> bool {
    if p.flags & PRIMITIVE_SINGLE_SIDED != 0
        && ray.seer == Seer::Eye
        && geometric_normal(p, ray.origin + hit.t * ray.direction).dot(ray.direction) > 0.0
    {
        return false;
    }
    if p.flags & PRIMITIVE_ALPHA == 0 {
        return true;
    }
    let material = &scene.materials[p.material as usize];
    let opacity = texture::opacity(scene, p, material, hit.u, hit.v);
    if material.alpha_cutoff <= 1.0 {
        return opacity >= material.alpha_cutoff;
    }
    rng::unit(rng::pcg4d([ray.alpha_seed, hit.primitive, 0, 0])[0]) < opacity
}

/// Of the front; unit, world space.
#[inline]
pub fn geometric_normal(p: &Primitive, position: Vec3) -> Vec3 {
    if p.flags & PRIMITIVE_SPHERE != 0 {
        let outward = (position - Vec3::from(p.a)).normalize();
        return if p.flags & PRIMITIVE_INWARD != 0 { -outward } else { outward };
    }
    let a = Vec3::from(p.a);
    (Vec3::from(p.b) - a).cross(Vec3::from(p.c) - a).normalize_or(Vec3::Y)
}

/// Where a ray may start so that it does not meet the surface it leaves: off along `normal`, by a share of the largest
/// coordinate.
#[inline]
pub fn leave(scene: &PackedScene, position: Vec3, normal: Vec3, direction: Vec3) -> Vec3 {
    let scale = position.abs().max_element().max(scene.info.radius * 0.05);
    let side = 1f32.copysign(normal.dot(direction));
    position + normal * (side * scene.info.epsilon * scale)
}
