//! Meshes and spheres to primitives and a tree.

use std::sync::{Arc, Weak};

use glam::{Vec2, Vec3, Vec3A, Vec4};
use half::f16;
use obvhs::aabb::Aabb;

use super::PackedScene;
use crate::layout::{self, NONE, Primitive, Vertex};
use crate::scene::subject::Subject;
use crate::scene::{AlphaMode, Material, Mesh, Scene, Sphere, Texture, bvh};

/// How many times larger than its subject a scene must be for far lights to send photons about that.
const SMALL: f32 = 10.0;

/// What the primitives of a mesh or of a sphere were made from, but for lamps.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Object {
    shape: Shape,
    material: usize,
    /// Of all its primitives; none if it is not there.
    flags: Option<u32>,
}

#[derive(Clone, Debug)]
enum Shape {
    Mesh {
        /// Only to tell whether another is this one.
        mesh: Weak<Mesh>,
        /// Texture coordinates by which tangents are made.
        tangents: Option<u32>,
    },
    Sphere {
        centre: Vec3,
        radius: f32,
    },
}

impl PartialEq for Shape {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Mesh { mesh: a, tangents: t }, Self::Mesh { mesh: b, tangents: u }) => a.ptr_eq(b) && t == u,
            (Self::Sphere { centre: a, radius: r }, Self::Sphere { centre: b, radius: s }) => a == b && r == s,
            _ => false,
        }
    }
}

impl Object {
    /// In the order in which primitives number them.
    fn all(scene: &Scene) -> Vec<Self> {
        let meshes = scene.meshes.iter().map(|mesh| Self::of_mesh(mesh, &scene.materials[mesh.material]));
        let spheres = scene.spheres.iter().map(|sphere| Self::of_sphere(sphere, &scene.materials[sphere.material]));
        meshes.chain(spheres).collect()
    }

    fn of_mesh(mesh: &Arc<Mesh>, material: &Material) -> Self {
        let tangents = material.normal_texture.as_ref().map(|map| map.uv_set);
        let shape = Shape::Mesh { mesh: Arc::downgrade(mesh), tangents };
        // No opacity reaches such a cut-off: glTF has the mesh vanish.
        if matches!(material.alpha, AlphaMode::Mask(cutoff) if cutoff > 1.0) {
            return Self { shape, material: mesh.material, flags: None };
        }
        let mut flags = side_flags(material);
        let vertex_alpha = mesh.colors.iter().any(|c| c.w < 1.0);
        if material.alpha != AlphaMode::Opaque
            && (material.opacity < 1.0 || material.base_color_texture.is_some() || vertex_alpha)
        {
            flags |= layout::PRIMITIVE_ALPHA;
        }
        if mesh.normals.is_empty() && material.normal_texture.is_none() {
            flags |= layout::PRIMITIVE_FLAT;
        }
        if mesh.colors.is_empty() && !material.is_textured() {
            flags |= layout::PRIMITIVE_PLAIN;
        }
        Self { shape, material: mesh.material, flags: Some(flags) }
    }

    fn of_sphere(sphere: &Sphere, material: &Material) -> Self {
        let mut flags = side_flags(material) | layout::PRIMITIVE_SPHERE;
        if sphere.inward {
            flags |= layout::PRIMITIVE_INWARD;
        }
        let shape = Shape::Sphere { centre: sphere.centre, radius: sphere.radius };
        Self { shape, material: sphere.material, flags: Some(flags) }
    }
}

fn side_flags(material: &Material) -> u32 {
    if !material.double_sided && material.transmission == 0.0 { layout::PRIMITIVE_SINGLE_SIDED } else { 0 }
}

impl PackedScene {
    /// Vertices, primitives, their tree and their bounds, shared with `before` where they are the same.
    pub(super) fn pack_shapes(&mut self, scene: &Scene, before: &Self) {
        self.objects = Object::all(scene);
        let is_alike = |(a, b): (&Object, &Object)| a.shape == b.shape && a.flags.is_some() == b.flags.is_some();
        let are_alike =
            before.objects.len() == self.objects.len() && before.objects.iter().zip(&self.objects).all(is_alike);
        if are_alike { self.take_shapes(before) } else { self.make_shapes(scene) }
    }

    fn take_shapes(&mut self, before: &Self) {
        let of = &before.info;
        (self.info.centre, self.info.radius) = (of.centre, of.radius);
        (self.info.subject_centre, self.info.subject_radius) = (of.subject_centre, of.subject_radius);
        (self.nodes, self.vertices) = (Arc::clone(&before.nodes), Arc::clone(&before.vertices));
        (self.primitives, self.kd) = (Arc::clone(&before.primitives), before.kd.clone());
        if self.objects != before.objects {
            for p in Arc::make_mut(&mut self.primitives) {
                let object = &self.objects[p.object as usize];
                p.material = object.material as u32;
                p.flags = object.flags.unwrap_or(p.flags) | p.flags & layout::PRIMITIVE_MIRRORED_UV;
            }
        }
    }

    fn make_shapes(&mut self, scene: &Scene) {
        let unordered = self.make_primitives(scene);
        let boxes: Vec<Aabb> = unordered.iter().map(primitive_box).collect();
        let (nodes, order) = bvh::build(&boxes);
        self.nodes = nodes.into();
        self.primitives = Arc::new(order.iter().map(|&i| unordered[i as usize]).collect());
        let bounds = bvh::bounds(&boxes);
        if !boxes.is_empty() {
            self.info.centre = bounds.center().to_array();
            // Larger by more than rounding, so that rays from its surface start outside everything.
            self.info.radius = bounds.diagonal().length() * 0.5 * 1.001 + f32::MIN_POSITIVE;
            let subject = Subject::whole(scene, &[], false).core().and_then(Subject::bounding_sphere);
            let is_small = |&(_, radius): &(Vec3, f32)| radius > 0.0 && self.info.radius > SMALL * radius;
            if let Some((centre, radius)) = subject.filter(is_small) {
                (self.info.subject_centre, self.info.subject_radius) = (centre.to_array(), radius);
            }
        }
    }

    /// In the order of the scene.
    fn make_primitives(&mut self, scene: &Scene) -> Vec<Primitive> {
        let (mut primitives, mut vertices) = (Vec::new(), Vec::new());
        let objects = (0..).zip(&self.objects);
        for ((object, of), mesh) in objects.clone().zip(&scene.meshes) {
            let Some(flags) = of.flags else { continue };
            let first = vertices.len() as u32;
            let tangents = mesh_tangents(mesh, scene.materials[mesh.material].normal_texture.as_ref());
            for i in 0..mesh.positions.len() {
                let uv0 = mesh.uv0.get(i).copied().unwrap_or(Vec2::ZERO);
                let uv1 = mesh.uv1.get(i).copied().unwrap_or(uv0);
                let color = mesh.colors.get(i).copied().unwrap_or(Vec4::ONE);
                vertices.push(Vertex {
                    // The zero vector asks for the geometric normal.
                    normal: mesh.normals.get(i).copied().unwrap_or(Vec3::ZERO).to_array(),
                    u0: uv0.x,
                    tangent: tangents.get(i).map_or([0.0; 3], |t| t.truncate().to_array()),
                    v0: uv0.y,
                    uv1: uv1.to_array(),
                    color: [pack_halves(color.x, color.y), pack_halves(color.z, color.w)],
                });
            }
            for t in &mesh.triangles {
                let [a, b, c] = t.map(|i| mesh.positions[i as usize].to_array());
                let mirrored = tangents.get(t[0] as usize).is_some_and(|t| t.w < 0.0);
                primitives.push(Primitive {
                    a,
                    material: mesh.material as u32,
                    b,
                    light: NONE,
                    c,
                    flags: flags | if mirrored { layout::PRIMITIVE_MIRRORED_UV } else { 0 },
                    vertices: t.map(|i| first + i),
                    object,
                });
            }
        }
        for ((object, of), s) in objects.skip(scene.meshes.len()).zip(&scene.spheres) {
            let Some(flags) = of.flags else { continue };
            primitives.push(Primitive {
                a: s.centre.to_array(),
                material: s.material as u32,
                b: [s.radius, 0.0, 0.0],
                light: NONE,
                flags,
                object,
                ..Primitive::default()
            });
        }
        self.vertices = vertices.into();
        primitives
    }
}

fn pack_halves(a: f32, b: f32) -> u32 {
    u32::from(f16::from_f32(a).to_bits()) | u32::from(f16::from_f32(b).to_bits()) << 16
}

pub fn primitive_box(p: &Primitive) -> Aabb {
    let (a, b, c) = (Vec3A::from(p.a), Vec3A::from(p.b), Vec3A::from(p.c));
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        // A little larger: the surface that intersection finds is rounded.
        let r = Vec3A::splat(p.b[0] * (1.0 + 1e-6));
        Aabb::new(a - r, a + r)
    } else {
        Aabb::new(a.min(b).min(c), a.max(b).max(c))
    }
}

/// Tangents for a normal map: the file's, else from the texture coordinates, summed over the triangles of a vertex.
fn mesh_tangents(mesh: &Mesh, map: Option<&Texture>) -> Vec<Vec4> {
    let Some(map) = map else { return Vec::new() };
    if !mesh.tangents.is_empty() {
        return mesh.tangents.clone();
    }
    let uv = if map.uv_set == 1 && !mesh.uv1.is_empty() { &mesh.uv1 } else { &mesh.uv0 };
    if uv.is_empty() {
        return Vec::new();
    }
    let mut sums = vec![(Vec3::ZERO, Vec3::ZERO); mesh.positions.len()];
    let mut geometric = vec![Vec3::ZERO; mesh.positions.len()];
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|i| i as usize);
        let (e1, e2) = (mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
        let (d1, d2) = (uv[b] - uv[a], uv[c] - uv[a]);
        let det = d1.x * d2.y - d1.y * d2.x;
        for i in [a, b, c] {
            geometric[i] += e1.cross(e2);
        }
        if det == 0.0 {
            continue;
        }
        let along_u = (e1 * d2.y - e2 * d1.y) * det.signum();
        let along_v = (e2 * d1.x - e1 * d2.x) * det.signum();
        for i in [a, b, c] {
            sums[i].0 += along_u;
            sums[i].1 += along_v;
        }
    }
    let tangent = |i: usize| {
        let normal = mesh.normals.get(i).copied().unwrap_or_else(|| geometric[i].normalize_or_zero());
        let (u, v) = sums[i];
        let t = (u - normal * normal.dot(u)).normalize_or_zero();
        // Texture v runs down, glTF's bitangent runs up.
        let handedness = if normal.cross(t).dot(v) > 0.0 { -1.0 } else { 1.0 };
        t.extend(handedness)
    };
    (0..mesh.positions.len()).map(tangent).collect()
}
