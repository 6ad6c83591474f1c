//! Moving a camera: orbit, pan, zoom, fly, look, frame, focus. Knows nothing of windows.
//!
//! Every move keeps the camera's frame orthonormal, without roll against the up axis, and everything finite: what would
//! leave the numbers that a scene may have is not done.

#[cfg(test)]
mod tests;

use glam::{Affine3A, Mat3, Vec2, Vec3};
use std::f32::consts::FRAC_PI_2;
use sunfleck::scene::{Camera, Projection};

/// The view comes no nearer to the up axis, radians.
const MAX_PITCH: f32 = FRAC_PI_2 - 2e-3;
/// A camera whose right axis rises by more than this (sine) is tilted.
const TILTED: f32 = 1e-3;
/// Metres from the origin, at most, as in scene files.
const MAX_COORDINATE: f32 = 1e9;
/// Share of the picture that [`Rig::frame_all`] fills.
const FILLED: f32 = 0.95;
/// Seconds in which flying crosses the scene's diagonal.
const CROSSING_SECONDS: f32 = 6.0;
/// Longest time between two pictures that flying follows, seconds: no leap after a hiccup.
const MAX_STEP_SECONDS: f32 = 0.1;
/// Vertical fields of view, radians.
const FIELDS_OF_VIEW: [f32; 2] = [0.017, 2.97];

/// How fast to fly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// With Ctrl: a quarter.
    Slow,
    /// The scene's diagonal in some seconds.
    #[default]
    Normal,
    /// With Shift: four times.
    Fast,
}

/// Of cameras whose file has no word for it, metres.
const UNFOCUSED: f32 = 1.0;

/// A camera and what it is moved about.
#[derive(Clone, Debug)]
pub struct Rig {
    camera: Camera,
    pivot: Vec3,
    up: Vec3,
    /// Diagonal of the scene's bounds, metres, positive.
    size: f32,
    /// Whether the distance in focus was chosen by somebody.
    is_focused: bool,
}

impl Rig {
    /// Takes over a camera as it stands. `bounds`: least and greatest corner of the scene, metres.
    ///
    /// The pivot lies in the middle of the picture, as deep as the scene's middle if that is in front.
    pub fn new(camera: &Camera, bounds: [Vec3; 2]) -> Self {
        let is_focused = camera.focus_distance != UNFOCUSED || camera.aperture_radius > 0.0;
        let size = size(bounds);
        let mut rig = Self { camera: camera.clone(), pivot: Vec3::ZERO, up: Vec3::Y, size, is_focused };
        let [right, above, forward] = rig.frame();
        let axis = camera.up_axis();
        rig.up = if right.dot(axis).abs() > TILTED { above } else { along(axis, above) };
        let depth = (0.5 * (bounds[0] + bounds[1]) - rig.position()).dot(forward);
        let in_front = depth.is_finite() && depth > 0.01 * rig.size;
        let depth = if in_front { depth } else { camera.focus_distance };
        rig.pivot = rig.position() + forward * depth.max(rig.nearest());
        rig
    }

    /// About another axis, which is that of cameras before or beside this one, if the camera is level with it.
    pub fn turning_about(mut self, axis: Vec3) -> Self {
        let [right, above, _] = self.frame();
        if right.dot(axis).abs() <= TILTED && above.dot(axis).abs() > TILTED {
            self.up = along(axis, above);
        }
        self
    }

    /// With a distance in focus that somebody chose, if it `is`, or seems, so.
    pub fn focused(mut self, is: bool) -> Self {
        self.is_focused |= is;
        self
    }

    /// What orbiting turns round, unit.
    pub fn up(&self) -> Vec3 {
        self.up
    }

    /// Takes over a camera with another lens that stands as this one; says whether it does. Pivot and up axis stay.
    pub fn change_lens(&mut self, camera: &Camera) -> bool {
        let [was, is] = [&self.camera, camera].map(|camera| camera.world_from_camera);
        // Axes may come back from settings with other roundings.
        let stands = was.translation == is.translation && was.matrix3.abs_diff_eq(is.matrix3, 1e-6);
        if stands {
            self.camera = camera.clone();
        }
        stands
    }

    /// For rendering; name and aspect ratio are those of the camera that was taken over.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// World space, metres.
    pub fn position(&self) -> Vec3 {
        self.camera.world_from_camera.translation.into()
    }

    /// What orbiting turns about and zooming approaches, world space, metres.
    #[cfg(test)]
    pub fn pivot(&self) -> Vec3 {
        self.pivot
    }

    /// Right, up and forward of the camera; orthonormal.
    pub fn frame(&self) -> [Vec3; 3] {
        let m = Mat3::from(self.camera.world_from_camera.matrix3);
        [m.x_axis, m.y_axis, -m.z_axis]
    }

    /// Moves the pivot alone, to a point clicked on.
    pub fn set_pivot(&mut self, pivot: Vec3) {
        if within(pivot) && pivot.distance(self.position()) > self.nearest() {
            self.pivot = pivot;
        }
    }

    /// Turns the camera about the pivot, radians: positive `yaw` moves it to the left round the up axis, positive
    /// `pitch` downwards. The pivot stays where it is in the picture.
    pub fn orbit(&mut self, yaw: f32, pitch: f32) {
        let Some(frame) = self.turned(yaw, pitch) else { return };
        let to_pivot = self.to_pivot();
        self.stand(self.pivot - frame * to_pivot, frame, self.pivot);
    }

    /// Turns the camera where it stands, radians: positive `yaw` to the right, positive `pitch` upwards. The pivot
    /// stays where it is in the picture.
    pub fn look(&mut self, yaw: f32, pitch: f32) {
        let Some(frame) = self.turned(yaw, pitch) else { return };
        self.stand(self.position(), frame, self.position() + frame * self.to_pivot());
    }

    /// Moves camera and pivot so that what is at the pivot's depth follows the cursor: `by` in heights of the picture,
    /// x to the right, y down.
    pub fn pan(&mut self, by: Vec2) {
        let [right, above, _] = self.frame();
        let by = by * 2.0 * self.half_height(self.depth());
        self.shift(above * by.y - right * by.x);
    }

    /// Approaches the pivot, or with negative `steps` goes away from it: a step is a tenth of the distance. `cursor`,
    /// in heights of the picture from its middle, x right, y down, is the point that stays where it is: that of the world
    /// which is `under` it, or one as deep as the pivot.
    pub fn zoom(&mut self, steps: f32, cursor: Option<Vec2>, under: Option<Vec3>) {
        let scale = 0.9_f32.powf(steps);
        if !(scale.is_finite() && scale > 0.0) {
            return;
        }
        let [right, above, forward] = self.frame();
        let cursor =
            cursor.filter(|cursor| cursor.is_finite()).unwrap_or_default() * 2.0 * self.half_height(self.depth());
        let across = right * cursor.x - above * cursor.y;
        if let Projection::Orthographic { ymag } = self.camera.projection {
            let scale = scale.max((self.nearest() / ymag).min(1.0));
            let wanted = ymag * scale;
            if wanted <= MAX_COORDINATE {
                self.camera.projection = Projection::Orthographic { ymag: wanted };
                self.shift(across * (1.0 - scale));
            }
            return;
        }
        let scale = scale.max((self.nearest() / self.position().distance(self.pivot)).min(1.0));
        let at_pivot = match across == Vec3::ZERO {
            true => self.pivot,
            false => self.position() + forward * self.depth() + across,
        };
        let target = under.unwrap_or(at_pivot);
        let about = |p: Vec3| target + (p - target) * scale;
        self.stand(about(self.position()), self.axes(), about(self.pivot));
    }

    /// Flies for `seconds`: `direction` has x to the right, y along the up axis, z forward, of length 1 at most.
    pub fn fly(&mut self, direction: Vec3, pace: Pace, seconds: f32) {
        let factor = match pace {
            Pace::Slow => 0.25,
            Pace::Normal => 1.0,
            Pace::Fast => 4.0,
        };
        let metres = factor * self.size / CROSSING_SECONDS * seconds.clamp(0.0, MAX_STEP_SECONDS);
        let [right, _, forward] = self.frame();
        let direction = direction.clamp_length_max(1.0);
        self.shift((right * direction.x + self.up * direction.y + forward * direction.z) * metres);
    }

    /// Moves back or forth, and aside, until all eight corners of `bounds` are in a picture of `aspect` (width over
    /// height); the direction stays. The pivot is then the middle of the bounds, and in focus.
    pub fn frame_all(&mut self, bounds: [Vec3; 2], aspect: f32) {
        let centre = 0.5 * (bounds[0] + bounds[1]);
        if !(within(bounds[0]) && within(bounds[1]) && aspect.is_finite() && aspect > 0.0) {
            return;
        }
        let size = size(bounds);
        let [right, above, forward] = self.frame();
        let corners = (0..8).map(|i| {
            let pick = |axis: usize| bounds[i >> axis & 1][axis] - centre[axis];
            let corner = Vec3::new(pick(0), pick(1), pick(2));
            // Half the height of a picture that just holds the corner, and how far behind the middle it is.
            (corner.dot(above).abs().max(corner.dot(right).abs() / aspect), corner.dot(forward))
        });
        let distance = match self.camera.projection {
            Projection::Perspective { yfov } => {
                let slope = FILLED * (0.5 * yfov).tan();
                corners.map(|(half_height, depth)| half_height / slope - depth).fold(0.6 * size, f32::max)
            }
            Projection::Orthographic { .. } => {
                let ymag = corners.map(|(half_height, _)| half_height).fold(0.0, f32::max) / FILLED;
                self.camera.projection = Projection::Orthographic { ymag: ymag.max(1e-3 * size) };
                size
            }
        };
        self.size = size;
        self.stand(centre - forward * distance, self.axes(), centre);
        self.set_focus_distance(distance);
    }

    /// Puts the plane in focus through a point in front of the camera; says whether it could.
    pub fn focus_on(&mut self, point: Vec3) -> bool {
        let [_, _, forward] = self.frame();
        let distance = (point - self.position()).dot(forward);
        let can = distance > 0.0 && distance.is_finite();
        if can {
            self.set_focus_distance(distance);
        }
        can
    }

    /// Metres along the view; kept within what a scene may have.
    pub fn set_focus_distance(&mut self, metres: f32) {
        if metres.is_finite() {
            self.camera.focus_distance = metres.clamp(self.nearest(), MAX_COORDINATE);
            self.is_focused = true;
        }
    }

    /// Radius of the lens, metres; 0 is a pinhole. A pinhole that nobody has focused has the pivot in focus as a lens.
    pub fn set_aperture_radius(&mut self, metres: f32) {
        if !metres.is_finite() {
            return;
        }
        let before = std::mem::replace(&mut self.camera.aperture_radius, metres.clamp(0.0, self.size));
        if before == 0.0 && metres > 0.0 && !self.is_focused {
            self.set_focus_distance(self.depth());
        }
    }

    /// Vertical, full, radians; of an orthographic camera it has no meaning, and nothing happens.
    pub fn set_yfov(&mut self, radians: f32) {
        if let (Projection::Perspective { yfov }, true) = (&mut self.camera.projection, radians.is_finite()) {
            *yfov = radians.clamp(FIELDS_OF_VIEW[0], FIELDS_OF_VIEW[1]);
        }
    }

    /// Nearest distance to anything, metres; f32 tells it from nothing.
    fn nearest(&self) -> f32 {
        1e-5 * self.size.max(self.pivot.length())
    }

    fn axes(&self) -> Mat3 {
        self.camera.world_from_camera.matrix3.into()
    }

    /// The pivot seen from the camera.
    fn to_pivot(&self) -> Vec3 {
        self.axes().transpose() * (self.pivot - self.position())
    }

    /// Of the pivot, metres; its distance if it is behind the camera.
    fn depth(&self) -> f32 {
        let [_, _, forward] = self.frame();
        let away = self.pivot - self.position();
        let depth = away.dot(forward);
        if depth > self.nearest() { depth } else { away.length() }
    }

    /// Half the height of the picture at a depth, metres.
    fn half_height(&self, depth: f32) -> f32 {
        match self.camera.projection {
            Projection::Perspective { yfov } => depth * (0.5 * yfov).tan(),
            Projection::Orthographic { ymag } => ymag,
        }
    }

    /// The camera's axes after turning right by `yaw` and up by `pitch`, short of the up axis.
    fn turned(&self, yaw: f32, pitch: f32) -> Option<Mat3> {
        if !(yaw.is_finite() && pitch.is_finite()) {
            return None;
        }
        let [right, _, forward] = self.frame();
        // Level and of unit length, whatever rounding has done.
        let right = (right - self.up * right.dot(self.up)).try_normalize()?;
        let ahead = self.up.cross(right);
        let now = forward.dot(self.up).atan2(forward.dot(ahead));
        let pitch = (now + pitch).clamp(-MAX_PITCH, MAX_PITCH);
        let (sin, cos) = yaw.sin_cos();
        let (right, ahead) = (right * cos - ahead * sin, ahead * cos + right * sin);
        let forward = ahead * pitch.cos() + self.up * pitch.sin();
        Some(Camera::stand(Vec3::ZERO, forward, right.cross(forward)).matrix3.into())
    }

    fn shift(&mut self, by: Vec3) {
        self.stand(self.position() + by, self.axes(), self.pivot + by);
    }

    /// Unless that is too far away, or the pivot too near.
    fn stand(&mut self, position: Vec3, axes: Mat3, pivot: Vec3) {
        if within(position) && within(pivot) && position.distance(pivot) > 0.0 {
            self.camera.world_from_camera = Affine3A::from_mat3_translation(axes, position);
            self.pivot = pivot;
        }
    }
}

/// The axis, turned so that it is not below.
fn along(axis: Vec3, above: Vec3) -> Vec3 {
    axis * if above.dot(axis) < -TILTED { -1.0 } else { 1.0 }
}

fn within(p: Vec3) -> bool {
    p.abs().max_element() <= MAX_COORDINATE && p.is_finite()
}

/// Diagonal of bounds; 1 for what has none.
fn size(bounds: [Vec3; 2]) -> f32 {
    let size = bounds[0].distance(bounds[1]);
    if size.is_finite() && size > 0.0 { size.min(MAX_COORDINATE) } else { 1.0 }
}
