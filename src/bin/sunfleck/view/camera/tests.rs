//! The rig by itself: what each move keeps, whatever the camera.

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
        (number(), proptest::option::of(pair()), proptest::option::of(vector())).prop_map(|(n, at, under)| Move::Zoom(
            n * 10.0,
            at.map(Vec2::from),
            under
        )),
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
    let up =
        |towards: [f32; 3], up: Vec3| Rig::new(&Camera::look_at("", towards.into(), Vec3::ZERO, up, 0.7), BOUNDS).up;
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

#[test]
fn a_lens_is_focused_where_nobody_said() {
    let bounds = [Vec3::splat(-100.0), Vec3::splat(100.0)];
    let mut camera = Camera::look_at("", Vec3::Z * 300.0, Vec3::ZERO, Vec3::Y, 1.0);
    for (said, expected) in [(1.0, 300.0), (7.0, 7.0)] {
        camera.focus_distance = said;
        let mut rig = Rig::new(&camera, bounds);
        rig.set_aperture_radius(0.0);
        assert_eq!(rig.camera().focus_distance, said);
        rig.set_aperture_radius(0.5);
        assert!((rig.camera().focus_distance - expected).abs() < 1e-3);
        // What somebody chose stays, and be it 1 m.
        rig.set_focus_distance(1.0);
        rig.set_aperture_radius(0.0);
        rig.set_aperture_radius(0.6);
        assert_eq!(rig.camera().focus_distance, 1.0);
        let mut rig = Rig::new(&camera, bounds).focused(true);
        rig.set_aperture_radius(0.5);
        assert_eq!(rig.camera().focus_distance, said);
    }
}
