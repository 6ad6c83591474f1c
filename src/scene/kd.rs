//! The other accelerator of the CPU: a kd-tree over the triangles, and a small BVH over the spheres beside it.

use obvhs::aabb::Aabb;

use super::bvh;
use super::packed::primitive_box;
use crate::index::kd::{Error, FaceTree, KdOptions, KdTree, Sah, Triangles};
use crate::layout::{PRIMITIVE_SPHERE, Primitive, SceneNode};

/// κ_T for κ_I = 1: what a step down the tree costs beside a test of a triangle, measured (docs/performance.md).
const TRAVERSAL: f64 = 4.0;

/// What finds the primitives along a ray, on the CPU. The picture is the same with either.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Accelerator {
    /// Boxes around primitives.
    #[default]
    Bvh,
    /// Planes between triangles.
    Kd,
}

impl std::fmt::Display for Accelerator {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::Bvh => "bvh",
            Self::Kd => "kd",
        })
    }
}

/// See the module. Both parts name primitives by their index in the packed scene.
#[derive(Clone, Debug)]
pub struct SceneKd {
    /// Over the triangles.
    pub triangles: FaceTree,
    /// Over the spheres; the first is the root, empty without spheres.
    pub sphere_nodes: Vec<SceneNode>,
    /// In the order in which leaves of `sphere_nodes` list them.
    pub spheres: Vec<u32>,
}

impl SceneKd {
    /// On all threads of rayon's pool. Fails if triangles lie 2⁴⁰ m from the origin, or are all within 2⁻⁴⁰ m.
    pub fn new(primitives: &[Primitive]) -> Result<Self, Error> {
        let is_sphere = |&i: &u32| primitives[i as usize].flags & PRIMITIVE_SPHERE != 0;
        let (spheres, triangles): (Vec<u32>, Vec<u32>) = (0..primitives.len() as u32).partition(is_sphere);
        let corners = |&i: &u32| {
            let p = &primitives[i as usize];
            [p.a, p.b, p.c]
        };
        let vertices: Vec<[f32; 3]> = triangles.iter().flat_map(corners).collect();
        let faces = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let sah = Sah { traversal: TRAVERSAL, ..Sah::default() };
        let options = KdOptions { parallel: true, sah, ..KdOptions::default() };
        let tree = KdTree::new(Triangles::new(vertices, faces)?, &options)?;
        let boxes: Vec<Aabb> = spheres.iter().map(|&i| primitive_box(&primitives[i as usize])).collect();
        let (sphere_nodes, order) = bvh::build(&boxes);
        let spheres = order.iter().map(|&i| spheres[i as usize]).collect();
        Ok(Self { triangles: tree.into_faces(|face| triangles[face as usize]), sphere_nodes, spheres })
    }

    /// Of both trees.
    pub fn bytes(&self) -> usize {
        self.triangles.bytes() + size_of_val(&*self.sphere_nodes) + size_of_val(&*self.spheres)
    }
}
