//! What lamps shine on behind walls, and a place in a closed room, of which nothing lit is seen from outside.

use super::view::{Lamps, Seen, hides_from, lets_through};
use crate::index::kd::{Hit, KdOptions, LazyKd, Ray, RaySearch, Triangles};
use crate::scene::{Camera, Material, Scene, Sphere};
use glam::Vec3;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::ops::ControlFlow;

/// Full vertical field of view, radians: of a room one wants to see much.
const YFOV: f32 = 60_f32.to_radians();
/// Rays of a look, across and down.
const LOOK: [usize; 2] = [24, 16];
const N_RAYS: usize = LOOK[0] * LOOK[1];
/// Least share of the rays that must meet something lit.
const LEAST_LIT: f32 = 0.25;
/// How far from the middle towards the walls to stand; from there one can turn about the middle of a square room.
const ASIDE: f32 = 0.7;
/// Heights to look from, as shares of the room's; of a house with several floors one of them is no ceiling.
const HEIGHTS: [f32; 3] = [0.5, 0.3, 0.75];
/// How far from the middle of a sphere to stand, in radii.
const AIR: f32 = 1.5;
/// What rays leave out at either end, as a share of their length.
const GAP: f32 = 1e-3;

/// From beside the walls and from the corners to the middle, and from the middle to the walls.
fn places(low: Vec3, high: Vec3, up: Vec3, height: f32) -> impl Iterator<Item = Camera> {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let right = if up == Vec3::Z { Vec3::X } else { Vec3::Z };
    let ahead = up.cross(right);
    let centre = middle + (2.0 * height - 1.0) * half * up;
    let aside = move |[a, b]: [f32; 2]| half * (a * right + b * ahead);
    let sides = [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
    let from_aside = sides.map(|side| (centre + ASIDE * aside(side), centre));
    let from_middle = sides.map(|side| (centre, centre + ASIDE * aside(side)));
    let stands = from_aside.into_iter().chain(from_middle).filter(|(eye, target)| eye != target);
    stands.map(move |(eye, target)| Camera::look_at("default", eye, target, up, YFOV))
}

/// What a look finds.
#[derive(Default)]
struct Look {
    n_seen: usize,
    n_lit: usize,
    /// Of what is lit, how far it is, in radii of the scene, summed.
    sum_of_distances: f32,
    /// Rays that meet each side, along one of six directions, of each mesh, where it is lit.
    parts: BTreeMap<(u32, (usize, bool)), usize>,
}

impl Look {
    /// How far what is lit is, times the entropy of its parts in the picture: viewpoint entropy (Vázquez et al. 2001,
    /// "Viewpoint selection using viewpoint entropy"), with sides of meshes for faces.
    fn score(&self) -> f32 {
        let shares = self.parts.values().map(|&n| n as f32 / N_RAYS as f32);
        self.sum_of_distances * shares.map(|share| -share * share.log2()).sum::<f32>()
    }
}

/// What rays meet: the triangles of a scene. Of spheres only their places are looked at.
pub struct Room<'a> {
    scene: &'a Scene,
    lamps: &'a Lamps,
    /// Opened only where rays come.
    tree: LazyKd<f32>,
    /// The mesh of each face of the tree.
    mesh_of: Vec<u32>,
}

impl<'a> Room<'a> {
    /// None if its triangles fit into no tree.
    pub fn new(scene: &'a Scene, lamps: &'a Lamps) -> Option<Self> {
        let (mut vertices, mut faces, mut mesh_of) = (Vec::new(), Vec::new(), Vec::new());
        let drawn = scene.meshes.iter().enumerate().filter(|(_, mesh)| mesh.material < scene.materials.len());
        for (i, mesh) in drawn {
            let first = u32::try_from(vertices.len()).ok()?;
            vertices.extend(mesh.positions.iter().map(Vec3::to_array));
            faces.extend(mesh.triangles.iter().map(|triangle| triangle.map(|corner| corner.saturating_add(first))));
            mesh_of.resize(faces.len(), i as u32);
        }
        let options = KdOptions { parallel: true, ..KdOptions::default() };
        let tree = LazyKd::new(Triangles::new(vertices, faces).ok()?, &options).ok()?;
        Some(Self { scene, lamps, tree, mesh_of })
    }

    /// Whether less than `share` of what a camera sees is lit.
    pub fn is_dark(&self, camera: &Camera, share: f32) -> bool {
        let look = self.look(camera);
        (look.n_lit as f32) < share * look.n_seen as f32
    }

    /// A camera between the corners `low` and `high` that sees far, and what lamps shine on, in none of the spheres `more`
    /// and of those of the scene; none if there is no such place.
    pub fn camera_inside(&self, [low, high]: [Vec3; 2], up: Vec3, more: &[Sphere]) -> Option<Camera> {
        let is_free = |camera: &Camera| {
            let eye = Vec3::from(camera.world_from_camera.translation);
            let mut spheres = self.scene.spheres.iter().chain(more).filter(|sphere| !sphere.inward);
            spheres.all(|sphere| sphere.centre.distance(eye) > AIR * sphere.radius)
        };
        let places = HEIGHTS.into_iter().flat_map(|height| places(low, high, up, height));
        let cameras: Vec<_> = places.filter(is_free).collect();
        let looks: Vec<_> = cameras.par_iter().map(|camera| self.look(camera)).collect();
        let is_lit = |look: &Look| look.n_lit as f32 >= LEAST_LIT * N_RAYS as f32;
        let views = cameras.into_iter().zip(looks).filter(|(_, look)| is_lit(look));
        let (mut camera, _) = views.max_by(|(_, a), (_, b)| a.score().total_cmp(&b.score()))?;
        // What is turned about lies half-way to what is ahead at most: the room goes on as far behind it.
        let m = &camera.world_from_camera;
        let (eye, forward) = (Vec3::from(m.translation), -Vec3::from(m.matrix3.z_axis));
        let ahead = self.seen(eye, forward).map_or(f32::INFINITY, |(_, seen)| eye.distance(seen.p));
        camera.focus_distance = camera.focus_distance.min(0.5 * ahead);
        Some(camera)
    }

    fn look(&self, camera: &Camera) -> Look {
        let [width, height] = LOOK;
        let packed = camera.pack(width as u32, height as u32);
        let [right, up, forward, eye] = [packed.right, packed.up, packed.forward, packed.position].map(Vec3::from);
        let mut look = Look::default();
        for i in 0..N_RAYS {
            let x = ((i % width) as f32 + 0.5) / width as f32 * 2.0 - 1.0;
            let y = 1.0 - ((i / width) as f32 + 0.5) / height as f32 * 2.0;
            let direction = (forward + x * packed.half_width * right + y * packed.half_height * up).normalize();
            let Some((hit, seen)) = self.seen(eye, direction) else { continue };
            look.n_seen += 1;
            if self.lamps.is_lit(&seen, eye, |to_lamp| self.is_clear(seen.p, to_lamp)) {
                look.n_lit += 1;
                look.sum_of_distances += (eye.distance(seen.p) / self.lamps.reach).min(1.0);
                *look.parts.entry((self.mesh_of[hit.face as usize], side(seen.normal))).or_default() += 1;
            }
        }
        look
    }

    fn seen(&self, eye: Vec3, direction: Vec3) -> Option<(Hit<f32>, Seen<'a>)> {
        let ray = Ray::new(eye.to_array(), direction.to_array()).ok()?;
        let mut nearest: Option<Hit<f32>> = None;
        let _: ControlFlow<()> = self.tree.try_hits(&ray, |hit| {
            let (normal, material) = self.face(hit);
            if !hides_from(material, normal, direction) && nearest.is_none_or(|n| (hit.t, hit.face) < (n.t, n.face)) {
                nearest = Some(hit);
            }
            ControlFlow::Continue(nearest.map_or(ray.range().1, |nearest| nearest.t))
        });
        let hit = nearest?;
        let (normal, material) = self.face(hit);
        Some((hit, Seen { p: eye + hit.t * direction, normal, material }))
    }

    /// Whether nothing is in the way that `offset` goes from `p`.
    fn is_clear(&self, p: Vec3, offset: Vec3) -> bool {
        let Ok(ray) = Ray::new(p.to_array(), offset.to_array()) else { return false };
        let ray = ray.within(GAP, 1.0 - GAP);
        let blocked = self.tree.try_hits(&ray, |hit| match lets_through(self.face(hit).1) {
            true => ControlFlow::Continue(ray.range().1),
            false => ControlFlow::Break(()),
        });
        blocked.is_continue()
    }

    /// Normal, of any length, and material of what is hit.
    fn face(&self, hit: Hit<f32>) -> (Vec3, &'a Material) {
        let [a, b, c] = self.tree.triangles().corners(hit.face).map(Vec3::from);
        let mesh = &self.scene.meshes[self.mesh_of[hit.face as usize] as usize];
        ((b - a).cross(c - a), &self.scene.materials[mesh.material])
    }
}

/// The axis that a normal is nearest to, and which way it goes along it.
fn side(normal: Vec3) -> (usize, bool) {
    let axis = normal.abs().max_position();
    (axis, normal[axis] > 0.0)
}
