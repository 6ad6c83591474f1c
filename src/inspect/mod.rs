//! To look into a render rather than at it: what each pixel sees first, where its light came from, where photons lie.

mod first_hit;
mod photons;
mod split;

use glam::{Vec2, Vec3};

use crate::cpu::camera;
use crate::layout::{Camera, Frame};

pub use first_hit::{FirstHits, Hit, Object, pick};
pub use photons::{ColorBy, Style, bounce_color, draw, power_color, power_range};
pub use split::{Iteration, Parts, Split};

/// A camera as a pinhole, and the film behind it.
///
/// Film coordinates are pixels from the film's upper left corner, y down; a pixel's centre is at a half.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    camera: Camera,
    size: [u32; 2],
    crop: [u32; 4],
}

impl View {
    /// Of a picture of `size` pixels, the part `crop` (x0, y0, x1, y1, exclusive), as in [`crate::ppm::Params`]. The lens
    /// is closed to a point.
    pub fn new(camera: Camera, size: [u32; 2], crop: [u32; 4]) -> Self {
        Self { camera: Camera { aperture_radius: 0.0, ..camera }, size, crop }
    }

    /// Width and height of the film, pixels.
    pub fn film_size(&self) -> [u32; 2] {
        [self.crop[2] - self.crop[0], self.crop[3] - self.crop[1]]
    }

    /// Through the film at `at`: origin, metres, and unit direction, world space.
    pub fn ray(&self, at: Vec2) -> (Vec3, Vec3) {
        let [width, height] = self.film_size();
        let frame = Frame {
            width,
            height,
            crop_x: self.crop[0],
            crop_y: self.crop[1],
            full_width: self.size[0],
            full_height: self.size[1],
            ..Frame::default()
        };
        camera::ray(&self.camera, &frame, 0, 0, [at.x, at.y, 0.0, 0.0])
    }

    /// Where a point, metres, world space, appears on the film, which it may miss, and its depth, metres along the
    /// camera's axis. None behind the camera.
    pub fn project(&self, point: Vec3) -> Option<(Vec2, f32)> {
        let c = &self.camera;
        let from_camera = point - Vec3::from(c.position);
        let depth = from_camera.dot(c.forward.into());
        if depth.is_nan() || depth <= 0.0 {
            return None;
        }
        let across = Vec2::new(from_camera.dot(c.right.into()), from_camera.dot(c.up.into()));
        let scale = if c.orthographic != 0 { 1.0 } else { 1.0 / depth };
        let [sx, sy] = (across * scale / Vec2::new(c.half_width, c.half_height)).to_array();
        let [width, height] = self.size.map(|n| n as f32);
        let whole = Vec2::new((sx + 1.0) * 0.5 * width, (1.0 - sy) * 0.5 * height);
        Some((whole - Vec2::new(self.crop[0] as f32, self.crop[1] as f32), depth))
    }

    /// Height of a pixel on a plane across the axis at `depth`, metres.
    fn pixel_height(&self, depth: f32) -> f32 {
        let scale = if self.camera.orthographic != 0 { 1.0 } else { depth };
        scale * 2.0 * self.camera.half_height / self.size[1] as f32
    }

    /// The film pixel that holds `at`.
    fn pixel(&self, at: Vec2) -> Option<[u32; 2]> {
        let [width, height] = self.film_size();
        let inside = at.x >= 0.0 && at.y >= 0.0 && at.x < width as f32 && at.y < height as f32;
        inside.then_some([at.x as u32, at.y as u32])
    }
}
