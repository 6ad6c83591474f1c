//! What a picture of a scene is of.

use super::defaults::is_lamp;
use super::{Mesh, Scene, Sphere};
use glam::Vec3;

/// A sphere counts as much as a mesh of one: corners of 320 triangles.
const SPHERE: usize = 960;
/// Corners that are looked at, about.
const SAMPLES: usize = 1 << 15;
/// Share of the corners that lie in the core.
const MOST: f64 = 0.9;
/// What lies farther from the middle than so many times the core's reach is far outside.
const FAR: f32 = 4.0;
/// How many times larger than the rest a scene must be for a picture of all to show a speck of it: a room that is not may hold
/// one thing of many triangles.
pub const SPECK: f32 = 50.0;

/// The surfaces of a scene, and the spheres `more`, that a picture is of: all, but for what lies far outside where nearly all of
/// the corners are, lamps' left out, if the whole is so many times larger than the rest. Such are the sky and the wide ground
/// that models are put into, a lamp that stands for the sun, a corner that went astray.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    surfaces: Surfaces<'a>,
    /// About which point and within how many metres it lies.
    within: Option<(Vec3, f32)>,
}

impl<'a> Subject<'a> {
    /// Spheres that are seen from inside do not count unless `with_inward`.
    pub fn new(scene: &'a Scene, more: &'a [Sphere], with_inward: bool) -> Self {
        let whole = Self::whole(scene, more, with_inward);
        let core = || {
            let part = whole.core()?;
            let [(_, of_part), (_, of_whole)] = [part.bounding_sphere()?, whole.bounding_sphere()?];
            (of_part > 0.0 && of_whole > SPECK * of_part).then_some(part)
        };
        core().unwrap_or(whole)
    }

    /// What is not far outside of where nearly all of the corners are, however large the rest is.
    pub fn core(self) -> Option<Self> {
        let (middle, reach) = self.surfaces.core()?;
        Some(Self { within: Some((middle, FAR * reach)), ..self })
    }

    /// All of it.
    pub fn whole(scene: &'a Scene, more: &'a [Sphere], with_inward: bool) -> Self {
        Self { surfaces: Surfaces { scene, more, with_inward }, within: None }
    }

    /// Vertices, and spheres with their radii.
    pub fn points(self) -> impl Iterator<Item = (Vec3, f32)> + 'a {
        let is_in = move |&(p, radius): &(Vec3, f32)| {
            self.within.is_none_or(|(middle, reach)| p.distance(middle) + radius <= reach)
        };
        self.surfaces.points().filter(is_in)
    }

    /// Least and greatest corner; none if there is nothing.
    pub fn bounds(self) -> Option<[Vec3; 2]> {
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for (p, radius) in self.points() {
            low = low.min(p - radius);
            high = high.max(p + radius);
        }
        (low.is_finite() && high.is_finite()).then_some([low, high])
    }

    /// Centre of the bounding box and the radius that reaches every point.
    pub fn bounding_sphere(self) -> Option<(Vec3, f32)> {
        let [low, high] = self.bounds()?;
        let centre = 0.5 * (low + high);
        let reach = self.points().map(|(p, radius)| p.distance(centre) + radius).fold(0.0, f32::max);
        Some((centre, reach))
    }
}

impl Scene {
    /// Least and greatest corner of all surfaces and of the spheres `more`, metres; none if there are none.
    pub fn bounds(&self, more: &[Sphere]) -> Option<[Vec3; 2]> {
        Subject::whole(self, more, true).bounds()
    }

    /// The same without what lies far outside nearly all of it, if it is so much larger with that that the rest would be a
    /// speck in a picture of all: a sky, a wide ground, a lamp that stands for the sun, a corner that went astray.
    pub fn subject_bounds(&self, more: &[Sphere]) -> Option<[Vec3; 2]> {
        Subject::new(self, more, true).bounds()
    }
}

#[derive(Clone, Copy)]
struct Surfaces<'a> {
    scene: &'a Scene,
    more: &'a [Sphere],
    with_inward: bool,
}

impl<'a> Surfaces<'a> {
    fn spheres(self) -> impl Iterator<Item = &'a Sphere> {
        self.scene.spheres.iter().chain(self.more).filter(move |sphere| self.with_inward || !sphere.inward)
    }

    fn points(self) -> impl Iterator<Item = (Vec3, f32)> + 'a {
        let all = self.scene.meshes.iter().flat_map(|mesh| corners(mesh));
        all.map(|p| (p, 0.0)).chain(self.spheres().map(|s| (s.centre, s.radius)))
    }

    /// Where most of the corners are: about their median, and how far that reaches. Lamps are not looked at, nor are `more`,
    /// which may be some.
    fn core(self) -> Option<(Vec3, f32)> {
        let is_lit = |material: usize| !self.scene.materials.get(material).is_some_and(is_lamp);
        let meshes = self.scene.meshes.iter().filter(|mesh| is_lit(mesh.material));
        let spheres = self.scene.spheres.iter().filter(|s| (self.with_inward || !s.inward) && is_lit(s.material));
        let n_triangles: usize = meshes.clone().map(|mesh| mesh.triangles.len()).sum();
        let n = 3 * n_triangles + SPHERE * spheres.clone().count();
        let step = n.div_ceil(SAMPLES).max(1);
        // Not a multiple of three: of every triangle another corner.
        let step = step + usize::from(step.is_multiple_of(3));
        let of_spheres = spheres.flat_map(|s| std::iter::repeat_n((s.centre, s.radius), SPHERE));
        let all = meshes.flat_map(|mesh| corners(mesh)).map(|p| (p, 0.0)).chain(of_spheres);
        let sample: Vec<(Vec3, f32)> = all.step_by(step).filter(|(p, radius)| (p + radius).is_finite()).collect();
        if sample.is_empty() {
            return None;
        }
        let quantile = |share: f64, mut values: Vec<f32>| {
            let at = ((share * values.len() as f64) as usize).min(values.len() - 1);
            *values.select_nth_unstable_by(at, f32::total_cmp).1
        };
        let middle = [0, 1, 2].map(|axis| quantile(0.5, sample.iter().map(|(p, _)| p[axis]).collect())).into();
        let reach = quantile(MOST, sample.iter().map(|(p, radius)| p.distance(middle) + radius).collect());
        Some((middle, reach))
    }
}

/// Only vertices in use, once for each triangle: files carry stray ones.
fn corners(mesh: &Mesh) -> impl Iterator<Item = Vec3> {
    mesh.triangles.iter().flatten().filter_map(|&i| mesh.positions.get(i as usize).copied())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Material;

    /// A cube of side 2 about `middle`, of so many triangles a side.
    fn cube(middle: Vec3, half: f32, n: u32) -> Mesh {
        let mut mesh = Mesh::default();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            let (a, b) = (axis.any_orthonormal_vector(), axis.cross(axis.any_orthonormal_vector()));
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let at = |i: u32, j: u32| {
                    let [u, v] = [i, j].map(|k| 2.0 * k as f32 / n as f32 - 1.0);
                    middle + half * (axis + u * a + v * b)
                };
                let first = mesh.positions.len() as u32;
                mesh.positions.extend([at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
                mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
            }
        }
        mesh
    }

    fn scene(meshes: Vec<Mesh>) -> Scene {
        Scene { meshes: meshes.into_iter().map(Into::into).collect(), ..Scene::default() }
    }

    const MIDDLE: Vec3 = Vec3::new(40.0, 3.0, -7.0);

    #[test]
    fn what_makes_the_rest_a_speck_is_left_out() {
        let subject = [MIDDLE - 1.0, MIDDLE + 1.0];
        let near = |scene: &Scene, more: &[Sphere]| {
            let [low, high] = scene.subject_bounds(more).unwrap();
            assert!(low.distance(subject[0]) < 1e-4 && high.distance(subject[1]) < 1e-4, "{low} {high}");
            assert_ne!(scene.bounds(more), scene.subject_bounds(more));
        };
        let model = || cube(MIDDLE, 1.0, 8);
        // A sky about it, a lamp far off, and a triangle that went astray.
        near(&scene(vec![cube(MIDDLE, 200.0, 1), model()]), &[]);
        let sun = Sphere { centre: Vec3::new(0.0, 500.0, 0.0), radius: 3.0, inward: false, material: 0 };
        near(&scene(vec![cube(MIDDLE, 1.0, 40)]), &[sun]);
        let positions = [0.0, 1.0, 2.0].map(|x| Vec3::new(1e9, x, x * x)).to_vec();
        near(&scene(vec![model(), Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }]), &[]);
        // A ball on wide ground.
        let ground = cube(MIDDLE - Vec3::Y * 101.0, 100.0, 1);
        let ball = Sphere { centre: MIDDLE, radius: 1.0, inward: false, material: 0 };
        near(&Scene { spheres: vec![ball], ..scene(vec![ground]) }, &[]);
    }

    #[test]
    fn else_all_of_it_is_the_subject() {
        let whole = |scene: &Scene, more: &[Sphere]| assert_eq!(scene.bounds(more), scene.subject_bounds(more));
        whole(&Scene::default(), &[]);
        // A lamp of many triangles in a room of few, and one that settings add.
        let materials = vec![Material::default(), Material::emitter("bulb", Vec3::ONE)];
        let bulb = Mesh { material: 1, ..cube(MIDDLE, 0.05, 8) };
        let lit = Sphere { centre: MIDDLE, radius: 0.05, inward: false, material: 1 };
        let mut room = scene(vec![cube(MIDDLE, 5.0, 1), bulb]);
        (room.materials, room.spheres) = (materials, vec![lit]);
        whole(&room, &[Sphere { material: 0, ..lit }]);
        // Ground that is not so wide; two models far from each other; one that is a point; ground of many triangles.
        whole(&scene(vec![cube(MIDDLE, 45.0, 1), cube(MIDDLE, 1.0, 8)]), &[]);
        whole(&scene(vec![cube(MIDDLE, 1.0, 8), cube(-100.0 * MIDDLE, 1.0, 8)]), &[]);
        whole(&scene(vec![cube(MIDDLE, 0.0, 8), cube(MIDDLE, 1.0, 1)]), &[]);
        whole(&scene(vec![cube(MIDDLE, 1.0, 8), cube(MIDDLE, 1000.0, 8)]), &[]);
        // Coordinates that are none, as of a file whose numbers overflow.
        let mut wrong = cube(MIDDLE, 1.0, 8);
        wrong.positions[0].x = f32::INFINITY;
        whole(&scene(vec![wrong]), &[]);
    }
}
