//! How much of what a camera sees is turned to a light: a coarse look, without shadows.

use super::is_lamp;
use crate::scene::{AlphaMode, Camera, Material, Projection, PunctualKind, Scene};
use glam::{Vec2, Vec3};

/// Pixels a side.
const SIDE: usize = 48;
/// Triangles of lamps that are looked at, about.
const MOST_LAMPS: usize = 64;

/// Where light comes from.
pub struct Lamps {
    lamps: Vec<Lamp>,
    /// Radius of the scene, metres: as far away are those that are endlessly far.
    pub reach: f32,
}

enum Lamp {
    /// All round.
    Point(Vec3),
    /// To the side that the second vector, of any length, points to.
    OneSided(Vec3, Vec3),
    /// The way its light travels.
    Directional(Vec3),
}

impl Lamp {
    /// From `p` to it.
    fn offset_from(&self, p: Vec3, reach: f32) -> Vec3 {
        match *self {
            Self::Point(position) | Self::OneSided(position, _) => position - p,
            Self::Directional(direction) => -direction * reach,
        }
    }

    /// Whether it is in front of the surface at `p`, and that in front of it.
    fn faces(&self, p: Vec3, normal: Vec3) -> bool {
        match *self {
            Self::Point(position) => (position - p).dot(normal) > 0.0,
            Self::OneSided(position, side) => (position - p).dot(normal) > 0.0 && (p - position).dot(side) > 0.0,
            Self::Directional(direction) => direction.dot(normal) < 0.0,
        }
    }
}

impl Lamps {
    /// Those that are on in a scene of radius `reach`, metres; none if there are none, or the light comes from everywhere.
    pub fn of(scene: &Scene, reach: f32) -> Option<Self> {
        if scene.environment.is_some() {
            return None;
        }
        let mut lamps = Vec::new();
        for light in scene.lights.iter().filter(|light| light.intensity != Vec3::ZERO) {
            lamps.push(match light.kind {
                PunctualKind::Point => Lamp::Point(light.position),
                PunctualKind::Spot { .. } => Lamp::OneSided(light.position, light.direction),
                PunctualKind::Directional => Lamp::Directional(light.direction),
            });
        }
        let shining = scene.meshes.iter().filter(|mesh| scene.materials.get(mesh.material).is_some_and(is_lamp));
        let n_triangles: usize = shining.clone().map(|mesh| mesh.triangles.len()).sum();
        let triangles = shining.flat_map(|mesh| mesh.triangles.iter().map(move |&triangle| (mesh, triangle)));
        for (mesh, triangle) in triangles.step_by(n_triangles.div_ceil(MOST_LAMPS).max(1)) {
            let Some([a, b, c]) = corners(&mesh.positions, triangle) else { continue };
            let middle = (a + b + c) / 3.0;
            lamps.push(match scene.materials[mesh.material].double_sided {
                true => Lamp::Point(middle),
                false => Lamp::OneSided(middle, (b - a).cross(c - a)),
            });
        }
        (!lamps.is_empty()).then_some(Self { lamps, reach })
    }

    /// Of the pixels of a picture with triangles in them, how many show what shines, lets light through or faces a lamp; and
    /// how many there are. All must be in front of the camera, which has perspective.
    pub fn lit_and_seen(&self, scene: &Scene, camera: &Camera) -> [usize; 2] {
        let seen = seen(scene, camera);
        let eye = Vec3::from(camera.world_from_camera.translation);
        [seen.iter().filter(|seen| self.is_lit(seen, eye, |_| true)).count(), seen.len()]
    }

    /// Whether one of them shines from far outside.
    pub fn is_sunny(&self) -> bool {
        self.lamps.iter().any(|lamp| matches!(lamp, Lamp::Directional(_)))
    }

    /// How much farther towards z than towards y the lamps of a scene around `centre` lie, on average, metres.
    pub fn lean(&self, centre: Vec3) -> f32 {
        let sum: Vec3 = self.lamps.iter().map(|lamp| lamp.offset_from(centre, self.reach)).sum();
        (sum.z - sum.y) / self.lamps.len() as f32
    }

    /// Whether what is seen from `eye` is lit: shines, lets light through, or faces a lamp of which `is_clear` says, given how far
    /// it is from there, that nothing is between.
    pub fn is_lit(&self, seen: &Seen, eye: Vec3, is_clear: impl Fn(Vec3) -> bool) -> bool {
        let Seen { p, normal, material } = *seen;
        let normal = if normal.dot(eye - p) < 0.0 { -normal } else { normal };
        let shines = |lamp: &Lamp| lamp.faces(p, normal) && is_clear(lamp.offset_from(p, self.reach));
        is_lamp(material) || lets_through(material) || self.lamps.iter().any(shines)
    }
}

/// Whether light goes on behind a surface, some of it at least.
pub fn lets_through(material: &Material) -> bool {
    material.transmission > 0.0 || material.alpha == AlphaMode::Blend
}

/// Whether a triangle of this normal is not seen by one who looks along `direction`: it has one side only.
pub fn hides_from(material: &Material, normal: Vec3, direction: Vec3) -> bool {
    !material.double_sided && material.transmission == 0.0 && normal.dot(direction) >= 0.0
}

/// What is nearest in a pixel.
pub struct Seen<'a> {
    pub p: Vec3,
    /// Of any length.
    pub normal: Vec3,
    pub material: &'a Material,
}

/// What is nearest in every pixel where there is something.
fn seen<'a>(scene: &'a Scene, camera: &Camera) -> Vec<Seen<'a>> {
    let Projection::Perspective { yfov } = camera.projection else { return Vec::new() };
    let eye = Vec3::from(camera.world_from_camera.translation);
    let camera_from_world = camera.world_from_camera.inverse();
    let half = 0.5 * SIDE as f32;
    let scale = half / (0.5 * yfov).tan();
    // One over the depth, which is linear in the picture, and the triangle.
    let mut pixels = vec![(0.0, None); SIDE * SIDE];
    for mesh in &scene.meshes {
        let Some(material) = scene.materials.get(mesh.material) else { continue };
        for &triangle in &mesh.triangles {
            let Some([a, b, c]) = corners(&mesh.positions, triangle) else { continue };
            let normal = (b - a).cross(c - a);
            if hides_from(material, normal, a - eye) {
                continue;
            }
            let places = [a, b, c].map(|p| {
                let [x, y, z] = camera_from_world.transform_point3(p).to_array();
                (Vec2::new(half + x * scale / -z, half - y * scale / -z), -1.0 / z)
            });
            rasterise(places, |pixel, nearness| {
                if nearness > pixels[pixel].0 {
                    pixels[pixel] = (nearness, Some((normal, material)));
                }
            });
        }
    }
    let world = |pixel: usize, nearness: f32| {
        let at = Vec2::new((pixel % SIDE) as f32 + 0.5 - half, half - (pixel / SIDE) as f32 - 0.5) / scale;
        camera.world_from_camera.transform_point3(at.extend(-1.0) / nearness)
    };
    let found = pixels.iter().enumerate().filter_map(|(i, &(nearness, triangle))| {
        triangle.map(|(normal, material)| Seen { p: world(i, nearness), normal, material })
    });
    found.collect()
}

fn corners(positions: &[Vec3], triangle: [u32; 3]) -> Option<[Vec3; 3]> {
    let [a, b, c] = triangle.map(|i| positions.get(i as usize).copied());
    Some([a?, b?, c?])
}

/// Calls `draw` with the pixels whose middles a triangle covers, and with what is linear in it there.
fn rasterise([(a, at_a), (b, at_b), (c, at_c)]: [(Vec2, f32); 3], mut draw: impl FnMut(usize, f32)) {
    let area = (b - a).perp_dot(c - a);
    if at_a.min(at_b).min(at_c) <= 0.0 || area == 0.0 || !area.is_finite() {
        return;
    }
    let (low, high) = (a.min(b).min(c), a.max(b).max(c));
    // Conversions stop at the ends of the range.
    let range = |low: f32, high: f32| ((low - 0.5).ceil() as usize)..((high + 0.5).floor() as usize).min(SIDE);
    for y in range(low.y, high.y) {
        for x in range(low.x, high.x) {
            let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
            let (u, v) = ((p - a).perp_dot(c - a) / area, (b - a).perp_dot(p - a) / area);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 {
                draw(y * SIDE + x, at_a + u * (at_b - at_a) + v * (at_c - at_a));
            }
        }
    }
}
