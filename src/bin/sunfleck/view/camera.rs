//! Moving a camera: orbit, pan, zoom, fly, look, frame, focus. Knows nothing of windows.
//!
//! Every move keeps the camera's frame orthonormal, without roll against the up axis, and everything finite: what would
//! leave the numbers that a scene may have is not done.

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

/// A camera and what it is moved about.
#[derive(Clone, Debug)]
pub struct Rig {
    camera: Camera,
    pivot: Vec3,
    up: Vec3,
    /// Diagonal of the scene's bounds, metres, positive.
    size: f32,
}

impl Rig {
    /// Takes over a camera as it stands. `bounds`: least and greatest corner of the scene, metres.
    ///
    /// The pivot lies in the middle of the picture, as deep as the scene's middle if that is in front.
    pub fn new(camera: &Camera, bounds: [Vec3; 2]) -> Self {
        let mut rig = Self { camera: camera.clone(), pivot: Vec3::ZERO, up: Vec3::Y, size: size(bounds) };
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
        }
    }

    /// Radius of the lens, metres; 0 is a pinhole.
    pub fn set_aperture_radius(&mut self, metres: f32) {
        if metres.is_finite() {
            self.camera.aperture_radius = metres.clamp(0.0, self.size);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BOUNDS: [Vec3; 2] = [Vec3::new(-1.0, 0.0, -2.0), Vec3::new(3.0, 2.0, 1.0)];

    #[derive(Clone, Debug)]
    enum Move {
        Orbit(f32, f32),
        Look(f32, f32),
        Pan(Vec2),
        Zoom(f32, Option<Vec2>, Option<Vec3>),
        Fly(Vec3, Pace, f32),
        FrameAll(f32),
        Fov(f32),
        Pivot(Vec3),
    }

    fn make(rig: &mut Rig, step: &Move) {
        match *step {
            Move::Orbit(yaw, pitch) => rig.orbit(yaw, pitch),
            Move::Look(yaw, pitch) => rig.look(yaw, pitch),
            Move::Pan(by) => rig.pan(by),
            Move::Zoom(steps, cursor, under) => rig.zoom(steps, cursor, under),
            Move::Fly(direction, pace, seconds) => rig.fly(direction, pace, seconds),
            Move::FrameAll(aspect) => rig.frame_all(BOUNDS, aspect),
            Move::Fov(radians) => rig.set_yfov(radians),
            Move::Pivot(point) => rig.set_pivot(point),
        }
    }

    /// Sensible, huge and not a number.
    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![8 => -4.0f32..4.0, 1 => Just(1e30f32), 1 => Just(f32::NAN), 1 => Just(f32::NEG_INFINITY)]
    }

    fn vector() -> impl Strategy<Value = Vec3> {
        [number(), number(), number()].prop_map(Vec3::from)
    }

    fn step() -> impl Strategy<Value = Move> {
        let pair = || (number(), number());
        prop_oneof![
            pair().prop_map(|(a, b)| Move::Orbit(a, b)),
            pair().prop_map(|(a, b)| Move::Look(a, b)),
            pair().prop_map(|(a, b)| Move::Pan(Vec2::new(a, b))),
            (number(), proptest::option::of(pair()), proptest::option::of(vector()))
                .prop_map(|(n, at, under)| Move::Zoom(n * 10.0, at.map(Vec2::from), under)),
            (vector(), number()).prop_map(|(v, s)| Move::Fly(v, Pace::Fast, s)),
            number().prop_map(Move::FrameAll),
            number().prop_map(Move::Fov),
            vector().prop_map(Move::Pivot),
        ]
    }

    /// Any camera: tilted, upside down, orthographic.
    fn camera() -> impl Strategy<Value = Camera> {
        let axis = || [-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0].prop_map(Vec3::from);
        let projection = prop_oneof![
            (0.2f32..2.0).prop_map(|yfov| Projection::Perspective { yfov }),
            (0.1f32..5.0).prop_map(|ymag| Projection::Orthographic { ymag }),
        ];
        let up = prop_oneof![Just(Vec3::Y), Just(Vec3::NEG_Y), axis()];
        (axis(), axis(), up, projection, 0.0f32..0.1, 0.1f32..10.0).prop_map(
            |(position, forward, up, projection, aperture_radius, focus_distance)| Camera {
                name: "any".into(),
                world_from_camera: Camera::stand(position * 5.0, forward, up),
                projection,
                aperture_radius,
                focus_distance,
                aspect: Some(1.5),
            },
        )
    }

    fn is_sound(rig: &Rig) -> bool {
        let m = rig.axes();
        let camera = rig.camera();
        (m.transpose() * m).abs_diff_eq(Mat3::IDENTITY, 1e-4)
            && m.determinant() > 0.0
            && within(rig.position())
            && within(rig.pivot())
            && camera.focus_distance > 0.0
            && camera.focus_distance.is_finite()
            && match camera.projection {
                Projection::Perspective { yfov } => yfov > 0.0 && yfov < std::f32::consts::PI,
                Projection::Orthographic { ymag } => ymag > 0.0 && ymag.is_finite(),
            }
    }

    /// x, y in the picture, both in [−1, 1] if it is in there.
    fn seen(camera: &Camera, point: Vec3, aspect: f32) -> Option<Vec2> {
        let p = camera.world_from_camera.inverse().transform_point3(point);
        let half_height = match camera.projection {
            Projection::Perspective { yfov } => -p.z * (0.5 * yfov).tan(),
            Projection::Orthographic { ymag } => ymag,
        };
        (p.z < 0.0).then(|| Vec2::new(p.x / (half_height * aspect), p.y / half_height))
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

        #[test]
        fn nothing_is_lost_on_the_way(camera in camera()) {
            let rig = Rig::new(&camera, BOUNDS);
            prop_assert_eq!(rig.camera().world_from_camera, camera.world_from_camera);
            prop_assert_eq!(rig.camera().pack(30, 20), camera.pack(30, 20));
            let again = Rig::new(rig.camera(), BOUNDS);
            prop_assert_eq!((again.pivot(), again.up), (rig.pivot(), rig.up));
        }

        #[test]
        fn any_moves_leave_it_sound(camera in camera(), steps in proptest::collection::vec(step(), 0..60)) {
            let mut rig = Rig::new(&camera, BOUNDS);
            for step in &steps {
                make(&mut rig, step);
                prop_assert!(is_sound(&rig), "{:?}: {:?}", step, rig);
            }
        }

        #[test]
        fn orbiting_keeps_the_distance_and_the_horizon(
            camera in camera(),
            pivot in [-3.0f32..3.0, -3.0f32..3.0, -3.0f32..3.0],
            steps in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0), 1..40),
        ) {
            let mut rig = Rig::new(&camera, BOUNDS);
            rig.set_pivot(pivot.into());
            let distance = rig.position().distance(rig.pivot());
            let pivot = rig.pivot();
            for (yaw, pitch) in steps {
                rig.orbit(yaw, pitch);
                let [right, above, forward] = rig.frame();
                prop_assert!((rig.position().distance(pivot) - distance).abs() < 1e-4 * (1.0 + distance));
                prop_assert_eq!(rig.pivot(), pivot);
                prop_assert!(right.dot(rig.up).abs() < 1e-4 && above.dot(rig.up) > 0.0);
                prop_assert!(forward.dot(rig.up).abs() < MAX_PITCH.sin() + 1e-6);
            }
        }

        /// A tilted camera keeps its tilt; only straight up and down is given up.
        #[test]
        fn orbiting_begins_without_a_jump(camera in camera()) {
            let mut rig = Rig::new(&camera, BOUNDS);
            let before = rig.frame();
            rig.orbit(1e-4, 1e-4);
            for (a, b) in before.into_iter().zip(rig.frame()) {
                prop_assert!(a.distance(b) < 5e-3, "{a} {b}");
            }
        }

        #[test]
        fn framing_shows_all_corners(
            camera in camera(),
            low in [-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0],
            extent in [0.0f32..9.0, 0.0f32..9.0, 0.0f32..9.0],
            aspect in 0.3f32..3.0,
        ) {
            let (low, extent) = (Vec3::from(low), Vec3::from(extent));
            let bounds = [low, low + extent];
            let mut rig = Rig::new(&camera, BOUNDS);
            rig.frame_all(bounds, aspect);
            for i in 0..8 {
                let pick = Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
                let at = seen(rig.camera(), low + extent * pick, aspect);
                prop_assert!(at.is_some_and(|at| at.abs().max_element() <= 1.0), "{:?} {:?}", at, rig);
            }
            let middle = seen(rig.camera(), rig.pivot(), aspect).unwrap();
            prop_assert!(middle.length() < 1e-3);
        }

        /// What is under the cursor at the pivot's depth follows it, and stays there when zooming.
        #[test]
        fn the_cursor_holds_on(camera in camera(), by in [-0.4f32..0.4, -0.4f32..0.4], steps in -5.0f32..5.0) {
            let mut rig = Rig::new(&camera, BOUNDS);
            let by = Vec2::from(by);
            let (pivot, aspect) = (rig.pivot(), 1.0);
            rig.pan(by);
            let at = seen(rig.camera(), pivot, aspect).unwrap();
            prop_assert!((at - Vec2::new(2.0 * by.x, -2.0 * by.y)).length() < 1e-3, "{at} {by}");
            let distance = rig.position().distance(rig.pivot());
            rig.zoom(steps, Some(by), None);
            let at = seen(rig.camera(), pivot, aspect).unwrap();
            prop_assert!((at - Vec2::new(2.0 * by.x, -2.0 * by.y)).length() < 2e-3, "{at} {by}");
            if let Projection::Perspective { yfov } = camera.projection {
                let wanted = distance * 0.9_f32.powf(steps);
                prop_assert!((rig.position().distance(rig.pivot()) - wanted).abs() < 1e-3 * wanted);
                // Something nearer or farther than the pivot.
                let [right, above, forward] = rig.frame();
                let depth = rig.depth() * (1.5 + by.x);
                let half = 2.0 * depth * (0.5 * yfov).tan();
                let point = rig.position() + forward * depth + (right * by.x - above * by.y) * half;
                let before = seen(rig.camera(), point, aspect).unwrap();
                rig.zoom(steps, Some(by), Some(point));
                let at = seen(rig.camera(), point, aspect).unwrap();
                prop_assert!((at - before).length() < 2e-3 && (at.x - 2.0 * by.x).abs() < 2e-3, "{at} {before} {by}");
            }
        }
    }

    #[test]
    fn what_is_up() {
        let up = |towards: [f32; 3], up: Vec3| {
            Rig::new(&Camera::look_at("", towards.into(), Vec3::ZERO, up, 0.7), BOUNDS).up
        };
        for towards in [[0.0, 0.0, 5.0], [1.0, 2.0, 3.0], [0.0, 1e3, 2.0], [4.0, -1.0, 0.0]] {
            assert_eq!(up(towards, Vec3::Y), Vec3::Y);
            assert_eq!(up(towards, Vec3::NEG_Y), Vec3::NEG_Y);
        }
        // A map of the floor, and rooms in which z is up, from before them and from the side.
        assert_eq!(up([0.0, 5.0, 0.0], Vec3::NEG_Z), Vec3::Y);
        for towards in [[0.0, -5.0, 0.0], [0.0, 5.0, 0.0], [5.0, 0.0, 0.0], [3.0, 1.0, 2.0]] {
            assert_eq!(up(towards, Vec3::Z), Vec3::Z, "{towards:?}");
        }
        let tilted = up([1.0, 2.0, 3.0], Vec3::new(0.3, 1.0, 0.2));
        assert!(tilted.y > 0.5 && tilted.y < 0.999 && tilted.z.abs() > 0.01, "{tilted}");
    }

    /// As after undo, or of a file that was saved.
    #[test]
    fn the_axis_stays_where_the_camera_does_not_say_it() {
        let camera = Camera::look_at("", Vec3::new(0.0, -5.0, 0.0), Vec3::ZERO, Vec3::Z, 0.7);
        let mut rig = Rig::new(&camera, BOUNDS);
        rig.orbit(0.0, -0.3);
        let again = Rig::new(rig.camera(), BOUNDS);
        assert_eq!(again.up(), Vec3::Y);
        assert_eq!(again.turning_about(rig.up()).up(), Vec3::Z);
        // One that says it is left alone.
        let other = Camera::look_at("", Vec3::new(1.0, 2.0, 5.0), Vec3::ZERO, Vec3::Y, 0.7);
        assert_eq!(Rig::new(&other, BOUNDS).turning_about(Vec3::Z).up(), Vec3::Y);
    }

    #[test]
    fn another_lens_leaves_pivot_and_axis() {
        let camera = Camera::look_at("", Vec3::new(0.0, -5.0, 0.0), Vec3::ZERO, Vec3::Z, 0.7);
        let mut rig = Rig::new(&camera, BOUNDS);
        rig.orbit(0.0, 0.3);
        rig.set_pivot(Vec3::ONE);
        let mut wider = rig.camera().clone();
        wider.projection = Projection::Perspective { yfov: 0.9 };
        assert!(rig.change_lens(&wider));
        assert_eq!((rig.pivot(), rig.up), (Vec3::ONE, Vec3::Z));
        assert_eq!(rig.camera().projection, wider.projection);
        wider.world_from_camera.translation.x += 1.0;
        assert!(!rig.change_lens(&wider));
    }

    #[test]
    fn zooming_stops_before_the_pivot() {
        let camera = Camera::look_at("", Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 0.7);
        let mut rig = Rig::new(&camera, BOUNDS);
        let forward = rig.frame()[2];
        for _ in 0..1000 {
            rig.zoom(3.0, None, None);
            assert!((rig.pivot() - rig.position()).dot(forward) > 0.0, "{rig:?}");
        }
        assert!(rig.position().distance(rig.pivot()) < 1e-3);
        rig.zoom(-20.0, None, None);
        assert!((rig.pivot() - rig.position()).normalize().dot(forward) > 0.9);
    }

    #[test]
    fn keys_and_buttons() {
        let camera = Camera::look_at("", Vec3::new(0.0, 1.0, 5.0), Vec3::new(0.0, 1.0, 0.0), Vec3::Y, 0.7);
        let start = Rig::new(&camera, BOUNDS);
        let size = BOUNDS[0].distance(BOUNDS[1]);
        let flown = |direction, pace| {
            let mut rig = start.clone();
            rig.fly(direction, pace, 0.06);
            rig.position() - start.position()
        };
        let step = size * 0.06 / CROSSING_SECONDS;
        assert!(flown(Vec3::Z, Pace::Normal).abs_diff_eq(Vec3::NEG_Z * step, 1e-5));
        assert!(flown(Vec3::X, Pace::Fast).abs_diff_eq(Vec3::X * step * 4.0, 1e-5));
        assert!(flown(Vec3::Y, Pace::Slow).abs_diff_eq(Vec3::Y * step / 4.0, 1e-5));
        let mut rig = start.clone();
        rig.look(0.5, 0.0);
        assert!(rig.position() == start.position() && rig.frame()[2].x > 0.4, "{rig:?}");
        let mut rig = start.clone();
        rig.orbit(0.5, -0.2);
        assert!(rig.position().x < -0.1 && rig.position().y > 1.1, "{rig:?}");
        let mut rig = start.clone();
        assert!(rig.focus_on(Vec3::new(1.0, 0.0, 2.0)) && !rig.focus_on(Vec3::new(0.0, 0.0, 9.0)));
        assert!((rig.camera().focus_distance - 3.0).abs() < 1e-5);
        rig.set_yfov(9.0);
        assert_eq!(rig.camera().projection, Projection::Perspective { yfov: FIELDS_OF_VIEW[1] });
        rig.set_aperture_radius(0.02);
        rig.set_aperture_radius(f32::NAN);
        assert_eq!(rig.camera().aperture_radius, 0.02);
    }
}
