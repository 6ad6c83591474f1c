//! Seeded point sets for tests, examples and benchmarks: the same points on every machine.

use std::f32::consts::TAU;

use glam::Vec3;

use super::rng::{pcg4d, unit4};
use super::warp;

/// Standard deviation of a mode of [`gaussian_modes`], per axis.
pub const MODE_SIGMA: f32 = 0.05;
/// Centre of a mode is at a quarter or three quarters of the unit cube's side, per axis.
const MODE_CENTRES: [f32; 2] = [0.25, 0.75];

/// Keeps the numbers of the sets apart.
#[derive(Clone, Copy)]
enum Set {
    Uniform,
    Modes,
    Room,
    Camera,
    Order,
}

fn draw(set: Set, i: usize, dimension: u32, seed: u32) -> [u32; 4] {
    pcg4d([i as u32, dimension, set as u32, seed])
}

/// Uniform in the unit cube.
pub fn uniform(n: usize, seed: u32) -> Vec<Vec3> {
    let point = |i| {
        let [x, y, z, _] = unit4(draw(Set::Uniform, i, 0, seed));
        Vec3::new(x, y, z)
    };
    (0..n).map(point).collect()
}

/// Centre of mode `k` (0 … 7) of [`gaussian_modes`].
pub fn mode_centre(k: usize) -> Vec3 {
    Vec3::from_array([0, 1, 2].map(|axis| MODE_CENTRES[k >> axis & 1]))
}

/// Eight spherical normal distributions of equal weight, [`MODE_SIGMA`] wide, in the unit cube: nearly all points are
/// inside it, none is moved there.
pub fn gaussian_modes(n: usize, seed: u32) -> Vec<Vec3> {
    let point = |i| {
        let [mode, ..] = draw(Set::Modes, i, 0, seed);
        let [u, v, w, t] = unit4(draw(Set::Modes, i, 1, seed));
        // Box & Muller 1958; 1 − u is in (0, 1].
        let radius = |u: f32| (-2.0 * (1.0 - u).ln()).sqrt();
        let normal = Vec3::new(radius(u) * (TAU * v).cos(), radius(u) * (TAU * v).sin(), radius(w) * (TAU * t).cos());
        mode_centre((mode >> 29) as usize) + MODE_SIGMA * normal
    };
    (0..n).map(point).collect()
}

/// The room of [`room_photons`], metres: from the origin to here.
pub const ROOM: Vec3 = Vec3::new(4.0, 2.5, 6.0);
/// Centre of the ball in it.
pub const BALL_CENTRE: Vec3 = Vec3::new(2.1, 0.8, 2.2);
/// Radius of the ball in it.
pub const BALL_RADIUS: f32 = 0.6;
const EYE: Vec3 = Vec3::new(1.9, 1.4, 5.8);
/// Tangent of half the vertical field of view.
const HALF_HEIGHT: f32 = 0.6;

/// Points as photons lie: on surfaces, here evenly on the walls of a room and on a ball in it.
pub fn room_photons(n: usize, seed: u32) -> Vec<Vec3> {
    let sides = [ROOM.y * ROOM.z, ROOM.z * ROOM.x, ROOM.x * ROOM.y];
    let ball = 2.0 * TAU * BALL_RADIUS * BALL_RADIUS;
    let total = 2.0 * (sides[0] + sides[1] + sides[2]) + ball;
    let point = |i| {
        let [choice, u, v, _] = unit4(draw(Set::Room, i, 0, seed));
        let mut left = choice * total;
        for (axis, area) in sides.into_iter().enumerate() {
            if left < 2.0 * area {
                let mut p = Vec3::ZERO;
                p[axis] = if left < area { 0.0 } else { ROOM[axis] };
                p[(axis + 1) % 3] = u * ROOM[(axis + 1) % 3];
                p[(axis + 2) % 3] = v * ROOM[(axis + 2) % 3];
                return p;
            }
            left -= 2.0 * area;
        }
        BALL_CENTRE + BALL_RADIUS * warp::sphere([u, v])
    };
    (0..n).map(point).collect()
}

/// What a camera in the room sees, one jittered ray a pixel, row by row: queries as a gather makes them.
pub fn room_camera(size: [u32; 2], seed: u32) -> Vec<Vec3> {
    let [width, height] = size.map(|side| side as f32);
    let hit = |i: u32| {
        let [jx, jy, ..] = unit4(draw(Set::Camera, i as usize, 0, seed));
        let x = ((i % size[0]) as f32 + jx) / width * 2.0 - 1.0;
        let y = 1.0 - ((i / size[0]) as f32 + jy) / height * 2.0;
        let direction = Vec3::new(x * HALF_HEIGHT * width / height, y * HALF_HEIGHT, -1.0).normalize();
        EYE + direction * ball(direction).unwrap_or_else(|| wall(direction))
    };
    (0..size[0] * size[1]).map(hit).collect()
}

/// Distance from the eye to the ball.
fn ball(direction: Vec3) -> Option<f32> {
    let to = BALL_CENTRE - EYE;
    let along = to.dot(direction);
    let discriminant = along * along - to.length_squared() + BALL_RADIUS * BALL_RADIUS;
    (along > 0.0 && discriminant >= 0.0).then(|| along - discriminant.sqrt())
}

/// Distance from the eye to the wall.
fn wall(direction: Vec3) -> f32 {
    let to = |axis: usize| {
        let end = if direction[axis] > 0.0 { ROOM[axis] } else { 0.0 };
        if direction[axis] == 0.0 { f32::INFINITY } else { (end - EYE[axis]) / direction[axis] }
    };
    to(0).min(to(1)).min(to(2))
}

/// Puts `items` into a random order (Fisher & Yates).
pub fn shuffle<T>(items: &mut [T], seed: u32) {
    for i in (1..items.len()).rev() {
        let [bits, ..] = draw(Set::Order, i, 0, seed);
        items.swap(i, ((u64::from(bits) * (i as u64 + 1)) >> 32) as usize);
    }
}
