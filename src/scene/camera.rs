//! Cameras as backends read them.

use glam::{Affine3A, Mat3A, Vec3};

use super::{Camera, Projection};
use crate::layout;

impl Camera {
    /// For a picture of `width`×`height` pixels. The vertical field of view is kept, the horizontal one follows.
    pub fn pack(&self, width: u32, height: u32) -> layout::Camera {
        let aspect = width as f32 / height as f32;
        let (half_height, orthographic) = match self.projection {
            Projection::Perspective { yfov } => ((0.5 * yfov).tan(), 0),
            Projection::Orthographic { ymag } => (ymag, 1),
        };
        let m = &self.world_from_camera;
        layout::Camera {
            right: Vec3::from(m.matrix3.x_axis).normalize().to_array(),
            half_width: half_height * aspect,
            up: Vec3::from(m.matrix3.y_axis).normalize().to_array(),
            half_height,
            forward: (-Vec3::from(m.matrix3.z_axis)).normalize().to_array(),
            aperture_radius: self.aperture_radius,
            position: Vec3::from(m.translation).to_array(),
            focus_distance: self.focus_distance,
            orthographic,
            pad: [0; 3],
        }
    }

    /// A pinhole at `position` looking at `target` with `up` above; `yfov` in radians, vertical.
    pub fn look_at(name: &str, position: Vec3, target: Vec3, up: Vec3, yfov: f32) -> Self {
        Self {
            name: name.into(),
            world_from_camera: Self::stand(position, target - position, up),
            projection: Projection::Perspective { yfov },
            aperture_radius: 0.0,
            focus_distance: position.distance(target),
            aspect: None,
        }
    }

    /// The axis that is up to it: y, or z for one that is level with z and not with y, or that looks straight along y with z
    /// above. One that looks straight down on a map, −z above, has y.
    pub fn up_axis(&self) -> Vec3 {
        /// Sine of the angle from which on an axis is tilted.
        const TILTED: f32 = 1e-3;
        let m = &self.world_from_camera.matrix3;
        let is_level = |axis: Vec3| Vec3::from(m.x_axis).dot(axis).abs() <= TILTED;
        let looks_along_y = m.y_axis.y.abs() <= TILTED && m.y_axis.z > 0.0;
        let is_z_up = is_level(Vec3::Z) && (looks_along_y || !is_level(Vec3::Y));
        if is_z_up { Vec3::Z } else { Vec3::Y }
    }

    /// World from camera at `position`, metres, looking along `forward` with `up` above, both of any length.
    pub fn stand(position: Vec3, forward: Vec3, up: Vec3) -> Affine3A {
        let back = (-forward).normalize_or(Vec3::Z);
        let right = up.cross(back).try_normalize().unwrap_or_else(|| back.any_orthonormal_vector());
        let axes = Mat3A::from_cols(right.into(), back.cross(right).into(), back.into());
        Affine3A::from_mat3_translation(axes.into(), position)
    }
}
