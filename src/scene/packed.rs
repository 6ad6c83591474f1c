//! [`PackedScene`]: the only form a backend reads.

use std::sync::Arc;

use glam::{Vec2, Vec3, Vec3A, Vec4};
use half::f16;
use obvhs::aabb::Aabb;

use super::{Accelerator, AlphaMode, PunctualKind, Scene, SceneKd, Texture, Wrap, albedo, bvh, environment};
use crate::index::kd;
use crate::layout::{self, NONE, Primitive, SceneInfo, SceneNode, TextureSlot, Vertex};

/// Flat arrays and the tree over the primitives, in leaf order.
#[derive(Clone, Debug, Default)]
pub struct PackedScene {
    /// Scalars.
    pub info: SceneInfo,
    /// The first is the root; empty without primitives.
    pub nodes: Vec<SceneNode>,
    /// In the order in which leaves list them.
    pub primitives: Vec<Primitive>,
    /// Triangle corners.
    pub vertices: Vec<Vertex>,
    /// As in the scene.
    pub materials: Vec<layout::Material>,
    /// Uses of images.
    pub slots: Vec<TextureSlot>,
    /// RGBA, 8 bits each, R lowest.
    pub texels: Vec<u32>,
    /// Ordered; the last `cumulative` is 1.
    pub lights: Vec<layout::Light>,
    /// Radiance and, fourth, the cumulative probability within the row, `[height · width]`.
    pub environment: Vec<[f32; 4]>,
    /// Cumulative probability of the rows.
    pub environment_rows: Vec<f32>,
    /// Directional albedo of the GGX lobe ([`albedo`]).
    pub albedo: Vec<[f32; 2]>,
    /// Of the primitives: where each was among those of the scene.
    pub order: Vec<u32>,
    /// What the CPU goes by instead of `nodes`, if it is there.
    pub kd: Option<Arc<SceneKd>>,
}

impl PackedScene {
    /// Packs a scene that [`Scene::check`] has passed.
    pub fn new(scene: &Scene) -> Self {
        Self::pack(scene, None)
    }

    /// The same. If all primitives are where they were in `before`, its trees are taken over: materials, lights and the
    /// environment can change at little cost.
    pub fn new_after(before: &Self, scene: &Scene) -> Self {
        Self::pack(scene, Some(before))
    }

    fn pack(scene: &Scene, before: Option<&Self>) -> Self {
        let mut packed = Self { albedo: albedo::table().to_vec(), ..Self::default() };
        packed.pack_images(scene);
        packed.pack_materials(scene);
        let unordered = packed.pack_primitives(scene);
        let boxes: Vec<Aabb> = unordered.iter().map(primitive_box).collect();
        (packed.nodes, packed.order) = match before.filter(|before| before.has_boxes(&boxes)) {
            Some(before) => (before.nodes.clone(), before.order.clone()),
            None => bvh::build(&boxes),
        };
        packed.primitives = packed.order.iter().map(|&i| unordered[i as usize]).collect();
        packed.kd = before.filter(|before| before.has_shapes(&packed.primitives)).and_then(|before| before.kd.clone());

        let bounds = bvh::bounds(&boxes);
        if !boxes.is_empty() {
            packed.info.centre = bounds.center().to_array();
            // Larger by more than rounding, so that rays from its surface start outside everything.
            packed.info.radius = bounds.diagonal().length() * 0.5 * 1.001 + f32::MIN_POSITIVE;
        }
        packed.info.epsilon = 4e-6;
        packed.pack_lights(scene);
        packed
    }

    /// With another accelerator for the CPU, unless it has it already; a GPU does not mind. Fails as [`SceneKd::new`] does.
    pub fn accelerated(mut self, by: Accelerator) -> Result<Self, kd::Error> {
        self.kd = match (by, self.kd) {
            (Accelerator::Bvh, _) => None,
            (Accelerator::Kd, Some(kd)) => Some(kd),
            (Accelerator::Kd, None) => Some(Arc::new(SceneKd::new(&self.primitives)?)),
        };
        Ok(self)
    }

    /// What the CPU goes by.
    pub fn accelerator(&self) -> Accelerator {
        if self.kd.is_some() { Accelerator::Kd } else { Accelerator::Bvh }
    }

    /// Whether the primitives are where these are. Equal boxes do not say it of triangles.
    fn has_shapes(&self, primitives: &[Primitive]) -> bool {
        let shape = |p: &Primitive| (p.a, p.b, p.c, p.flags & layout::PRIMITIVE_SPHERE);
        self.primitives.iter().map(shape).eq(primitives.iter().map(shape))
    }

    /// Whether these are the boxes of the primitives, as they come from the scene.
    fn has_boxes(&self, boxes: &[Aabb]) -> bool {
        let mut pairs = self.order.iter().zip(&self.primitives);
        self.order.len() == boxes.len() && pairs.all(|(&i, p)| primitive_box(p) == boxes[i as usize])
    }

    fn pack_images(&mut self, scene: &Scene) {
        for image in &scene.images {
            self.texels.extend(image.texels.iter().map(|&t| u32::from_le_bytes(t)));
        }
    }

    fn slot(&mut self, scene: &Scene, texture: Option<&Texture>, srgb: bool) -> u32 {
        let Some(t) = texture else { return NONE };
        let first_texel: usize = scene.images[..t.image].iter().map(|i| i.texels.len()).sum();
        let image = &scene.images[t.image];
        let wrap = |w| match w {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        };
        let mut flags = wrap(t.wrap[0]) << 4 | wrap(t.wrap[1]) << 6;
        for (set, bit) in
            [(srgb, layout::TEXTURE_SRGB), (t.uv_set == 1, layout::TEXTURE_UV1), (t.nearest, layout::TEXTURE_NEAREST)]
        {
            if set {
                flags |= bit;
            }
        }
        self.slots.push(TextureSlot {
            transform: t.transform.to_cols_array(),
            offset: t.offset.to_array(),
            first_texel: first_texel as u32,
            size: image.width | image.height << 16,
            flags,
            pad: [0; 3],
        });
        self.slots.len() as u32 - 1
    }

    fn pack_materials(&mut self, scene: &Scene) {
        for m in &scene.materials {
            let reflectance = ((m.ior - 1.0) / (m.ior + 1.0)).powi(2);
            let mut flags = 0;
            if m.volume {
                flags |= layout::MATERIAL_VOLUME;
            }
            if m.double_sided {
                flags |= layout::MATERIAL_DOUBLE_SIDED;
            }
            let packed = layout::Material {
                base_color: m.base_color.to_array(),
                opacity: m.opacity,
                emission: m.emission.to_array(),
                alpha_cutoff: match m.alpha {
                    AlphaMode::Opaque => -1.0,
                    AlphaMode::Mask(cutoff) => cutoff.min(1.0),
                    AlphaMode::Blend => 2.0,
                },
                absorption: m.absorption.to_array(),
                roughness: m.roughness,
                f0: (m.specular_color * reflectance).min(Vec3::ONE).map(|c| c * m.specular).to_array(),
                metallic: m.metallic,
                transmission: m.transmission,
                ior: m.ior,
                normal_scale: m.normal_scale,
                flags,
                base_color_slot: self.slot(scene, m.base_color_texture.as_ref(), true),
                metallic_roughness_slot: self.slot(scene, m.metallic_roughness_texture.as_ref(), false),
                normal_slot: self.slot(scene, m.normal_texture.as_ref(), false),
                emission_slot: self.slot(scene, m.emission_texture.as_ref(), true),
                transmission_slot: self.slot(scene, m.transmission_texture.as_ref(), false),
                f90: m.specular,
                pad: [0; 2],
            };
            self.materials.push(packed);
        }
    }

    fn pack_primitives(&mut self, scene: &Scene) -> Vec<Primitive> {
        let mut primitives = Vec::new();
        for (object, mesh) in (0..).zip(&scene.meshes) {
            let material = &scene.materials[mesh.material];
            // No opacity reaches such a cut-off: glTF has the mesh vanish.
            if matches!(material.alpha, AlphaMode::Mask(cutoff) if cutoff > 1.0) {
                continue;
            }
            let first = self.vertices.len() as u32;
            let tangents = mesh_tangents(mesh, material.normal_texture.as_ref());
            let no_normals = mesh.normals.is_empty();
            for i in 0..mesh.positions.len() {
                let uv0 = mesh.uv0.get(i).copied().unwrap_or(Vec2::ZERO);
                let uv1 = mesh.uv1.get(i).copied().unwrap_or(uv0);
                let color = mesh.colors.get(i).copied().unwrap_or(Vec4::ONE);
                self.vertices.push(Vertex {
                    // The zero vector asks for the geometric normal.
                    normal: if no_normals { [0.0; 3] } else { mesh.normals[i].to_array() },
                    u0: uv0.x,
                    tangent: tangents.get(i).map_or([0.0; 3], |t| t.truncate().to_array()),
                    v0: uv0.y,
                    uv1: uv1.to_array(),
                    color: [pack_halves(color.x, color.y), pack_halves(color.z, color.w)],
                });
            }
            let mut flags = 0;
            let vertex_alpha = mesh.colors.iter().any(|c| c.w < 1.0);
            if material.alpha != AlphaMode::Opaque
                && (material.opacity < 1.0 || material.base_color_texture.is_some() || vertex_alpha)
            {
                flags |= layout::PRIMITIVE_ALPHA;
            }
            if !material.double_sided && material.transmission == 0.0 {
                flags |= layout::PRIMITIVE_SINGLE_SIDED;
            }
            if no_normals && material.normal_texture.is_none() {
                flags |= layout::PRIMITIVE_FLAT;
            }
            if mesh.colors.is_empty() && !material.is_textured() {
                flags |= layout::PRIMITIVE_PLAIN;
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
        for (object, s) in (scene.meshes.len() as u32..).zip(&scene.spheres) {
            let material = &scene.materials[s.material];
            let mut flags = layout::PRIMITIVE_SPHERE;
            if s.inward {
                flags |= layout::PRIMITIVE_INWARD;
            }
            if !material.double_sided && material.transmission == 0.0 {
                flags |= layout::PRIMITIVE_SINGLE_SIDED;
            }
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
        primitives
    }

    fn pack_lights(&mut self, scene: &Scene) {
        let mut powers = Vec::new();
        for i in 0..self.primitives.len() {
            let p = self.primitives[i];
            let material = &scene.materials[p.material as usize];
            if material.emission.max_element() <= 0.0 {
                continue;
            }
            let sides = if material.double_sided { 2.0 } else { 1.0 };
            let area = primitive_area(&p);
            let textured = mean_emission(scene, material, &p, &self.vertices);
            let power = luminance(material.emission * textured) * area * std::f32::consts::PI * sides;
            if !(power > 0.0 && area > 0.0) {
                continue;
            }
            self.primitives[i].light = self.lights.len() as u32;
            self.lights.push(layout::Light {
                kind: layout::LIGHT_AREA,
                primitive: i as u32,
                area,
                ..layout::Light::default()
            });
            powers.push(power);
        }
        let disc = std::f32::consts::PI * self.info.radius * self.info.radius;
        for l in &scene.lights {
            let brightness = luminance(l.intensity);
            if brightness <= 0.0 {
                continue;
            }
            let mut light = layout::Light {
                position: l.position.to_array(),
                direction: l.direction.to_array(),
                intensity: l.intensity.to_array(),
                primitive: NONE,
                ..layout::Light::default()
            };
            let power = match l.kind {
                PunctualKind::Point => {
                    light.kind = layout::LIGHT_POINT;
                    brightness * 4.0 * std::f32::consts::PI
                }
                PunctualKind::Spot { inner, outer } => {
                    light.kind = layout::LIGHT_SPOT;
                    light.cos_inner = inner.cos();
                    light.cos_outer = outer.cos();
                    brightness * std::f32::consts::TAU * (1.0 - 0.5 * (light.cos_inner + light.cos_outer))
                }
                PunctualKind::Directional => {
                    light.kind = layout::LIGHT_DIRECTIONAL;
                    brightness * disc
                }
            };
            self.lights.push(light);
            powers.push(power);
        }
        self.info.environment_light = NONE;
        if let Some(e) = &scene.environment {
            let (texels, rows, mean) = environment::pack(e);
            if mean > 0.0 {
                self.info.environment_width = e.width;
                self.info.environment_height = e.height;
                self.info.environment_rotation = [e.rotation.cos(), e.rotation.sin()];
                self.info.environment_light = self.lights.len() as u32;
                self.environment = texels;
                self.environment_rows = rows;
                self.lights.push(layout::Light {
                    kind: layout::LIGHT_ENVIRONMENT,
                    primitive: NONE,
                    ..layout::Light::default()
                });
                powers.push(mean * 4.0 * std::f32::consts::PI * disc);
            }
        }
        let total: f64 = powers.iter().map(|&p| f64::from(p)).sum();
        let mut sum = 0.0;
        for (light, power) in self.lights.iter_mut().zip(&powers) {
            sum += f64::from(*power);
            light.probability = (f64::from(*power) / total) as f32;
            light.cumulative = (sum / total) as f32;
        }
        if let Some(last) = self.lights.last_mut() {
            last.cumulative = 1.0;
        }
        self.info.n_lights = self.lights.len() as u32;
    }
}

fn luminance(c: Vec3) -> f32 {
    c.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

fn pack_halves(a: f32, b: f32) -> u32 {
    u32::from(f16::from_f32(a).to_bits()) | u32::from(f16::from_f32(b).to_bits()) << 16
}

pub(super) fn primitive_box(p: &Primitive) -> Aabb {
    let (a, b, c) = (Vec3A::from(p.a), Vec3A::from(p.b), Vec3A::from(p.c));
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        // A little larger: the surface that intersection finds is rounded.
        let r = Vec3A::splat(p.b[0] * (1.0 + 1e-6));
        Aabb::new(a - r, a + r)
    } else {
        Aabb::new(a.min(b).min(c), a.max(b).max(c))
    }
}

fn primitive_area(p: &Primitive) -> f32 {
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        return 4.0 * std::f32::consts::PI * p.b[0] * p.b[0];
    }
    let a = Vec3::from(p.a);
    0.5 * (Vec3::from(p.b) - a).cross(Vec3::from(p.c) - a).length()
}

/// Mean of the emission texture over a primitive, linear; ones without a texture. It only steers which lamp is chosen.
fn mean_emission(scene: &Scene, material: &super::Material, p: &Primitive, vertices: &[Vertex]) -> Vec3 {
    let Some(t) = &material.emission_texture else { return Vec3::ONE };
    if p.flags & layout::PRIMITIVE_SPHERE != 0 {
        return Vec3::ONE;
    }
    let image = &scene.images[t.image];
    let uv = p.vertices.map(|v| {
        let v = &vertices[v as usize];
        t.transform * if t.uv_set == 1 { Vec2::from(v.uv1) } else { Vec2::new(v.u0, v.v0) } + t.offset
    });
    let mut sum = Vec3::ZERO;
    const N: usize = 8;
    for i in 0..N {
        for j in 0..N {
            let w = crate::math::warp::triangle([(i as f32 + 0.5) / N as f32, (j as f32 + 0.5) / N as f32]);
            let at = uv[0] * (1.0 - w.x - w.y) + uv[1] * w.x + uv[2] * w.y;
            let texel = |f: f32, n: u32| ((f.rem_euclid(1.0) * n as f32) as u32).min(n - 1);
            let [r, g, b, _] =
                image.texels[(texel(at.y, image.height) * image.width + texel(at.x, image.width)) as usize];
            sum += Vec3::new(f32::from(r), f32::from(g), f32::from(b)).map(|c| (c / 255.0).powf(2.2));
        }
    }
    // Never zero: a bright texel between the samples must stay possible to sample.
    sum / (N * N) as f32 + 1e-4
}

/// Tangents for a normal map: the file's, else from the texture coordinates, summed over the triangles of a vertex.
fn mesh_tangents(mesh: &super::Mesh, map: Option<&Texture>) -> Vec<Vec4> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Mesh};

    #[test]
    fn a_tree_is_taken_over_where_it_is_the_same() {
        let mut scene = crate::scene::shipped::shipped("glass").expect("it is shipped");
        let before = PackedScene::new(&scene).accelerated(Accelerator::Kd).expect("it has a kd-tree");
        let planes = |of: &PackedScene| of.kd.as_ref().map(Arc::as_ptr);
        let same = |a: &PackedScene, b: &PackedScene| {
            assert!(a.nodes == b.nodes && a.primitives == b.primitives && a.materials == b.materials);
            assert!(a.lights == b.lights && a.info == b.info);
        };
        scene.materials[0].emission = Vec3::ONE;
        scene.materials.last_mut().expect("it has some").roughness = 0.5;
        let after = PackedScene::new_after(&before, &scene);
        same(&after, &PackedScene::new(&scene));
        assert_eq!(planes(&after), planes(&before));
        assert!(after.lights.len() > before.lights.len());
        // Something vanishes, something moves.
        scene.materials[0].alpha = AlphaMode::Mask(1.5);
        same(&PackedScene::new_after(&before, &scene), &PackedScene::new(&scene));
        scene.materials[0].alpha = AlphaMode::Opaque;
        scene.meshes[0].positions[0] += 9.0;
        let moved = PackedScene::new_after(&before, &scene);
        same(&moved, &PackedScene::new(&scene));
        assert!(moved.nodes != before.nodes && moved.kd.is_none());
    }

    #[test]
    fn an_alpha_cutoff_above_one_hides_the_mesh() {
        let mesh =
            Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let masked = |cutoff| Material { alpha: AlphaMode::Mask(cutoff), ..Material::default() };
        let materials = vec![masked(1.0), masked(1.5)];
        let scene = Scene { meshes: vec![mesh.clone(), Mesh { material: 1, ..mesh }], materials, ..Scene::default() };
        let packed = PackedScene::new(&scene);
        assert_eq!(packed.primitives.iter().map(|p| p.material).collect::<Vec<_>>(), [0]);
    }
}
