//! Rays from the lens.

use glam::Vec3;

use crate::layout::{Camera, Frame};
use crate::math::warp;

/// Through the film pixel (`x`, `y`), at the offset (`u[0]`, `u[1]`) within it and from the lens at (`u[2]`, `u[3]`):
/// origin and unit direction.
pub fn ray(camera: &Camera, frame: &Frame, x: u32, y: u32, u: [f32; 4]) -> (Vec3, Vec3) {
    let sx = ((frame.crop_x + x) as f32 + u[0]) / frame.full_width as f32 * 2.0 - 1.0;
    let sy = 1.0 - ((frame.crop_y + y) as f32 + u[1]) / frame.full_height as f32 * 2.0;
    let (right, up, forward) = (Vec3::from(camera.right), Vec3::from(camera.up), Vec3::from(camera.forward));
    let position = Vec3::from(camera.position);
    let across = right * (sx * camera.half_width) + up * (sy * camera.half_height);
    let lens = if camera.aperture_radius > 0.0 {
        let p = warp::disc([u[2], u[3]]) * camera.aperture_radius;
        right * p.x + up * p.y
    } else {
        Vec3::ZERO
    };
    if camera.orthographic != 0 {
        let focus = position + across + forward * camera.focus_distance;
        let origin = position + across + lens;
        return (origin, (focus - origin).normalize());
    }
    let direction = across + forward;
    if camera.aperture_radius > 0.0 {
        let focus = direction * camera.focus_distance;
        return (position + lens, (focus - lens).normalize());
    }
    (position, direction.normalize())
}
