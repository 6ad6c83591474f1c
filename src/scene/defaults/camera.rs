//! Where to look at a scene from that does not say.

use super::inside::Room;
use super::view::Lamps;
use crate::scene::{Camera, Scene, Sphere, subject::Subject};
use glam::Vec3;
use rayon::prelude::*;

/// Full vertical field of view, radians.
const YFOV: f32 = 40_f32.to_radians();
/// Half the field of view that is filled: a little air is left around the scene.
const FILLED: f32 = 0.93 * 0.5 * YFOV;
/// Azimuth and elevation that are taken unless much more light is seen from elsewhere, degrees: a little from the right,
/// a little from above.
const USUAL: [f32; 2] = [30.0, 20.0];
/// A view is taken instead of one before it if this much more of it faces a lamp.
const CLEARLY_MORE: f32 = 1.25;
/// And that is no speck.
const LEAST_SHARE: f32 = 0.05;
/// Lamps that lie so much farther towards z than towards y, in radii of the scene, hang from a ceiling: z is up.
const LEAN: f32 = 0.25;
/// Views that are tried at the same time.
const VIEWS_AT_ONCE: usize = 5;

/// A camera that has the scene and the spheres `more` in view, in pictures at least as wide as high, and as near as that lets
/// it: a little from the right, a little from above. What lies far outside nearly all of it, and makes it a speck, does not
/// count ([`Scene::subject_bounds`]), nor do rooms made of one inward sphere as long as there is something else.
///
/// Where clearly more of what is seen faces a lamp from another side, as before a room of which a wall is left out, it stands
/// there; so that z is up if the lamps of that room say so. Where nothing lit is seen from any side, as around a closed room,
/// it stands inside, if there is something to be seen.
pub fn default_camera(scene: &Scene, more: &[Sphere]) -> Camera {
    let outside = Subject::new(scene, more, false);
    let subject = if outside.bounds().is_some() { outside } else { Subject::new(scene, more, true) };
    let (centre, radius) = subject.bounding_sphere().unwrap_or_default();
    let radius = if radius > 0.0 { radius } else { 1.0 };
    let framed = |view: View| {
        let points = subject.points().map(|(p, radius)| (p - centre, radius));
        view.framing(points, centre, radius)
    };
    let usual = framed(View::y_up(USUAL));
    let Some(lamps) = Lamps::of(scene, radius) else { return usual };
    let [n_lit, n_usual] = lamps.lit_and_seen(scene, &usual);
    let share = |[n_lit, n_seen]: [usize; 2]| n_lit as f32 / n_seen.max(n_usual).max(1) as f32;
    let mut best = (share([n_lit, n_usual]), usual);
    let is_z_up = lamps.lean(centre) > LEAN * radius;
    for views in View::others(is_z_up).chunks(VIEWS_AT_ONCE) {
        // No other can be clearly better.
        if CLEARLY_MORE * best.0 >= 1.0 {
            break;
        }
        let others: Vec<_> = views
            .par_iter()
            .map(|&view| {
                let camera = framed(view);
                (share(lamps.lit_and_seen(scene, &camera)), camera)
            })
            .collect();
        best = others.into_iter().fold(best, |best, other| match other.0 > (CLEARLY_MORE * best.0).max(LEAST_SHARE) {
            true => other,
            false => best,
        });
    }
    let inside = || {
        if lamps.is_sunny() {
            return None;
        }
        let room = Room::new(scene, &lamps)?;
        let up = if is_z_up { Vec3::Z } else { Vec3::Y };
        let bounds = subject.bounds()?;
        if room.is_dark(&best.1, LEAST_SHARE) { room.camera_inside(bounds, up, more) } else { None }
    };
    inside().unwrap_or(best.1)
}

/// A direction to look from.
#[derive(Clone, Copy)]
struct View {
    /// Unit, from the scene to the camera.
    towards: Vec3,
    /// Unit.
    up: Vec3,
}

impl View {
    /// Azimuth from +z towards +x and elevation, degrees; y is up.
    fn y_up([azimuth, elevation]: [f32; 2]) -> Self {
        let ((sin, cos), (rise, level)) = (azimuth.to_radians().sin_cos(), elevation.to_radians().sin_cos());
        Self { towards: Vec3::new(sin * level, rise, cos * level), up: Vec3::Y }
    }

    /// Azimuth from −y towards +x, degrees; level, and z is up.
    fn z_up(azimuth: f32) -> Self {
        let (sin, cos) = azimuth.to_radians().sin_cos();
        Self { towards: Vec3::new(sin, -cos, 0.0), up: Vec3::Z }
    }

    /// The likelier ones first.
    fn others(is_z_up: bool) -> Vec<Self> {
        let sides = [0.0, 30.0, 90.0, 180.0, 270.0];
        let y_up = [20.0, 0.0, 60.0].into_iter().flat_map(|elevation| sides.map(|side| Self::y_up([side, elevation])));
        let (y_up, z_up) = (y_up.collect(), sides.map(Self::z_up).to_vec());
        if is_z_up { [z_up, y_up].concat() } else { [y_up, z_up].concat() }
    }

    /// The camera of this view that shows all points, relative to `centre`, with their radii; they lie within `radius` of
    /// it.
    fn framing(self, points: impl Iterator<Item = (Vec3, f32)>, centre: Vec3, radius: f32) -> Camera {
        let towards = self.towards;
        let right = self.up.cross(towards).normalize();
        let up = towards.cross(right);
        // A point stays inside a side of the frustum if distance·tan ≥ depth·tan ± (offset along the axis); the two sides
        // of an axis together give the distance, and what differs between them is where the middle of the picture should
        // be.
        let (tan, secant) = (FILLED.tan(), 1.0 / FILLED.cos());
        let mut sides = [f32::NEG_INFINITY; 4];
        for (q, radius) in points {
            let base = q.dot(towards) * tan + radius * secant;
            let (x, y) = (q.dot(right), q.dot(up));
            for (side, offset) in sides.iter_mut().zip([x, -x, y, -y]) {
                *side = side.max(base + offset);
            }
        }
        let [right_side, left_side, top, bottom] = if sides[0].is_finite() { sides } else { [radius; 4] };
        // A speck has no size of its own.
        let distance = ((right_side + left_side).max(top + bottom) * 0.5 / tan).max(1e-3 * radius);
        let target = centre + right * (0.5 * (right_side - left_side)) + up * (0.5 * (top - bottom));
        Camera::look_at("default", target + towards * distance, target, self.up, YFOV)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    use crate::scene::{Environment, Material, Mesh, Projection, PunctualKind, PunctualLight};

    #[test]
    fn the_camera_sees_every_vertex() {
        let positions: Vec<Vec3> = (0..8)
            .map(|i| Vec3::new((i & 1) as f32 * 5.0, (i >> 1 & 1) as f32, (i >> 2) as f32 * 3.0) + 10.0)
            .collect();
        let mesh = Mesh { positions, triangles: vec![[0, 1, 2], [3, 4, 5], [5, 6, 7]], ..Mesh::default() };
        let dome = Sphere { centre: Vec3::ZERO, radius: 1000.0, inward: true, material: 0 };
        let scene = Scene { meshes: vec![mesh.into()], spheres: vec![dome], ..Scene::default() };
        let camera = default_camera(&scene, &[]);
        let widest = widest(&camera, &scene.meshes[0].positions);
        // And it comes near: the scene is wider than high.
        assert!((0.9..=1.0).contains(&widest), "{widest}");
        assert!(camera.focus_distance < 20.0);
    }

    /// How far from the middle of the picture the outermost point is; 1 is the edge.
    fn widest(camera: &Camera, points: &[Vec3]) -> f32 {
        let Projection::Perspective { yfov } = camera.projection else { panic!("a perspective camera") };
        let inverse = camera.world_from_camera.inverse();
        let at = points.iter().map(|&p| {
            let [x, y, z] = inverse.transform_point3(p).to_array();
            assert!(z < 0.0, "{p}");
            x.abs().max(y.abs()) / (-z * (0.5 * yfov).tan())
        });
        at.fold(0.0, f32::max)
    }

    /// A box from −1 to 1 without its side towards `open`, and a lamp in it that shines away from `up`.
    fn room(open: Vec3, up: Vec3) -> Scene {
        let mut walls = Mesh::default();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]).filter(|&axis| axis != open)
        {
            let (a, b) = (axis.any_orthonormal_vector(), axis.cross(axis.any_orthonormal_vector()));
            add_quad(&mut walls, [axis - a - b, axis + a - b, axis + a + b, axis - a + b]);
        }
        let (a, b, top) = (0.2 * open, 0.2 * open.cross(up), 0.95 * up);
        let mut lamp = Mesh { material: 1, ..Mesh::default() };
        add_quad(&mut lamp, [top - a - b, top + a - b, top + a + b, top - a + b]);
        let [p, q, r] = lamp.triangles[0].map(|i| lamp.positions[i as usize]);
        if (q - p).cross(r - p).dot(up) > 0.0 {
            lamp.triangles.iter_mut().for_each(|triangle| triangle.swap(0, 1));
        }
        let materials = vec![Material::default(), Material::emitter("lamp", Vec3::ONE)];
        Scene { meshes: vec![walls.into(), lamp.into()], materials, ..Scene::default() }
    }

    fn add_quad(mesh: &mut Mesh, corners: [Vec3; 4]) {
        let n = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.triangles.extend([[n, n + 1, n + 2], [n, n + 2, n + 3]]);
    }

    /// From the scene's middle to the camera, unit, and the camera's up.
    fn stands(camera: &Camera) -> [Vec3; 2] {
        [camera.world_from_camera.translation.into(), camera.world_from_camera.matrix3.y_axis.into()]
            .map(|v: Vec3| v.normalize())
    }

    #[test]
    fn a_room_is_looked_at_through_its_open_side() {
        for open in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
            let scene = room(open, Vec3::Y);
            let camera = default_camera(&scene, &[]);
            let [towards, up] = stands(&camera);
            assert!(towards.dot(open) > 0.9 && up.y > 0.9, "{open}: {towards} {up}");
            assert!(widest(&camera, &scene.meshes[0].positions) <= 1.0);
        }
        for open in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y] {
            let [towards, up] = stands(&default_camera(&room(open, Vec3::Z), &[]));
            assert!(towards.dot(open) > 0.9 && up.z > 0.9, "{open}: {towards} {up}");
        }
    }

    /// Not from where a wall is a line that is all lit.
    #[test]
    fn a_wall_is_looked_at_from_its_lit_side() {
        let mut scene = room(Vec3::Z, Vec3::Y);
        scene.meshes[0] = Arc::default();
        add_quad(Arc::make_mut(&mut scene.meshes[0]), SQUARE.map(|[x, y]| Vec3::new(x, y, 1.0)));
        let [towards, up] = stands(&default_camera(&scene, &[]));
        assert!(towards.z < -0.8 && up.y > 0.9, "{towards} {up}");
    }

    #[test]
    fn elsewhere_it_stands_where_it_always_does() {
        let usual = stands(&default_camera(&Scene::default(), &[]));
        let same = |scene: &Scene| {
            let camera = default_camera(scene, &[]);
            assert!(stands(&camera)[1].distance(usual[1]) < 1e-5, "{camera:?}");
        };
        // No light but the sky that is added; a sky of its own.
        let mut scene = room(Vec3::NEG_Z, Vec3::Y);
        scene.meshes.truncate(1);
        same(&scene);
        let mut scene = room(Vec3::NEG_Z, Vec3::Y);
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        same(&scene);
        // The sun stands behind the camera, or above it: the half of what is seen is enough.
        let sun = |direction: Vec3| PunctualLight {
            name: String::new(),
            position: Vec3::ZERO,
            direction: direction.normalize(),
            intensity: Vec3::ONE,
            kind: PunctualKind::Directional,
        };
        let mut scene = room(Vec3::NEG_Z, Vec3::Y);
        scene.meshes.truncate(1);
        scene.lights = vec![sun(Vec3::new(-0.5, -1.0, -0.5))];
        same(&scene);
        // The lamp of a closed room is covered: there is nothing to be seen inside.
        let mut covered = closed_room(Vec3::Y);
        add_quad(Arc::make_mut(&mut covered.meshes[0]), SQUARE.map(|[x, z]| Vec3::new(x, 0.9, z)));
        same(&covered);
        // A lamp that is off lights nothing.
        covered.meshes.truncate(1);
        covered.lights = vec![PunctualLight { intensity: Vec3::ZERO, kind: PunctualKind::Point, ..sun(Vec3::Y) }];
        same(&covered);
    }

    const SQUARE: [[f32; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    fn closed_room(up: Vec3) -> Scene {
        let mut scene = room(Vec3::X, up);
        add_quad(Arc::make_mut(&mut scene.meshes[0]), SQUARE.map(|[y, z]| Vec3::new(1.0, y, z)));
        scene
    }

    /// Also if a speck shines outside, and beside a dark one that the lamp would light without the wall between.
    #[test]
    fn a_closed_room_is_looked_at_from_inside() {
        for up in [Vec3::Y, Vec3::Z] {
            let room = closed_room(up);
            let mut with_speck = room.clone();
            let speck = SQUARE.map(|[y, z]| Vec3::new(-1.01, -0.02 * y, 0.02 * z));
            add_quad(Arc::make_mut(&mut with_speck.meshes[1]), speck);
            let mut beside_dark = room.clone();
            let mut dark = Mesh::clone(&room.meshes[0]);
            dark.positions.iter_mut().for_each(|p| p.x += 2.5);
            beside_dark.meshes.push(dark.into());
            for scene in [room, with_speck, beside_dark] {
                let camera = default_camera(&scene, &[]);
                let at = Vec3::from(camera.world_from_camera.translation);
                assert!(at.abs().max_element() < 1.0 && camera.focus_distance > 0.5, "{up}: {camera:?}");
                assert!(stands(&camera)[1].dot(up) > 0.9, "{up}: {camera:?}");
                // A ball where it stood.
                let ball = Sphere { centre: at, radius: 0.2, inward: false, material: 0 };
                let aside = Vec3::from(default_camera(&scene, &[ball]).world_from_camera.translation);
                assert!(aside.distance(at) > 0.2 && aside.abs().max_element() < 1.0, "{up}: {aside}");
            }
        }
    }
}
