//! [`PackedScene`]: the only form a backend reads.

mod lights;
mod shapes;

use std::sync::{Arc, Weak};

use glam::Vec3;

use super::{Accelerator, AlphaMode, Image, Scene, SceneKd, Texture, Wrap, albedo};
use crate::index::kd;
use crate::layout::{self, NONE, Primitive, SceneInfo, SceneNode, TextureSlot, Vertex};
use lights::Sky;
use shapes::Object;
pub(super) use shapes::primitive_box;

/// Flat arrays and the tree over the primitives, in leaf order. What is large is shared with the scenes that were made after
/// this one with less than all of it changed ([`PackedScene::new_after`]).
#[derive(Clone, Debug, Default)]
pub struct PackedScene {
    /// Scalars.
    pub info: SceneInfo,
    /// The first is the root; empty without primitives.
    pub nodes: Arc<Vec<SceneNode>>,
    /// In the order in which leaves list them.
    pub primitives: Arc<Vec<Primitive>>,
    /// Triangle corners.
    pub vertices: Arc<Vec<Vertex>>,
    /// As in the scene.
    pub materials: Vec<layout::Material>,
    /// Uses of images.
    pub slots: Vec<TextureSlot>,
    /// RGBA, 8 bits each, R lowest.
    pub texels: Arc<Vec<u32>>,
    /// Ordered; the last `cumulative` is 1.
    pub lights: Vec<layout::Light>,
    /// Radiance without strength and tint and, fourth, the cumulative probability within the row, `[height · width]`.
    pub environment: Arc<Vec<[f32; 4]>>,
    /// Cumulative probability of the rows.
    pub environment_rows: Arc<Vec<f32>>,
    /// Directional albedo of the GGX lobe ([`albedo`]).
    pub albedo: Vec<[f32; 2]>,
    /// What the CPU goes by instead of `nodes`, if it is there.
    pub kd: Option<Arc<SceneKd>>,
    /// What nodes, primitives, vertices and the kd-tree were made from, in the order of the scene.
    objects: Vec<Object>,
    /// What the texels were made from.
    images: Vec<Weak<Image>>,
    /// What the environment was made from.
    sky: Option<Sky>,
}

impl PackedScene {
    /// Packs a scene that [`Scene::check`] has passed.
    pub fn new(scene: &Scene) -> Self {
        Self::pack(scene, &Self::default())
    }

    /// The same. What of the scene is the very same as that which `before` was packed from (the same meshes and images behind
    /// their `Arc`s) is shared with it: materials and lights change at little cost. The arrays of `before` must be as they were
    /// packed.
    pub fn new_after(before: &Self, scene: &Scene) -> Self {
        Self::pack(scene, before)
    }

    fn pack(scene: &Scene, before: &Self) -> Self {
        let mut packed = Self { albedo: albedo::table().to_vec(), ..Self::default() };
        packed.info.epsilon = 4e-6;
        packed.pack_images(scene, before);
        packed.pack_materials(scene);
        packed.pack_shapes(scene, before);
        packed.pack_environment(scene, before);
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

    fn pack_images(&mut self, scene: &Scene, before: &Self) {
        self.images = scene.images.iter().map(Arc::downgrade).collect();
        let are_same = before.images.len() == self.images.len()
            && before.images.iter().zip(&self.images).all(|(before, now)| before.ptr_eq(now));
        self.texels = match are_same {
            true => Arc::clone(&before.texels),
            false => {
                let texels = scene.images.iter().flat_map(|image| &image.texels);
                Arc::new(texels.map(|&texel| u32::from_le_bytes(texel)).collect())
            }
        };
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Environment, Material, Mesh, Sphere};

    fn assert_same(a: &PackedScene, b: &PackedScene) {
        assert!(a.nodes == b.nodes && a.primitives == b.primitives && a.vertices == b.vertices);
        assert!(a.materials == b.materials && a.slots == b.slots && a.texels == b.texels);
        assert!(a.lights == b.lights && a.info == b.info);
        assert!(a.environment == b.environment && a.environment_rows == b.environment_rows);
    }

    /// Which of the large arrays are one.
    fn shared(a: &PackedScene, b: &PackedScene) -> [bool; 5] {
        let planes = |of: &PackedScene| of.kd.as_ref().map(Arc::as_ptr);
        [
            Arc::ptr_eq(&a.nodes, &b.nodes) && Arc::ptr_eq(&a.vertices, &b.vertices) && planes(a) == planes(b),
            Arc::ptr_eq(&a.primitives, &b.primitives),
            Arc::ptr_eq(&a.texels, &b.texels),
            Arc::ptr_eq(&a.environment, &b.environment),
            Arc::ptr_eq(&a.environment_rows, &b.environment_rows),
        ]
    }

    /// With some of everything that is shared.
    fn scene() -> Scene {
        let mut scene = crate::scene::shipped::shipped("cornell").expect("it is shipped");
        scene.environment = Some(Environment::uniform(Vec3::ONE));
        scene.images = vec![Image { name: String::new(), width: 1, height: 2, texels: vec![[9; 4]; 2] }.into()];
        scene.spheres.insert(0, Sphere { centre: Vec3::Y, radius: 0.25, inward: false, material: 0 });
        let mesh = Arc::make_mut(&mut scene.meshes[0]);
        mesh.uv0 = mesh.positions.iter().map(|p| p.truncate() + p.z).collect();
        mesh.uv1 = mesh.positions.iter().map(|p| p.truncate() * 2.0 - p.z).collect();
        scene
    }

    #[test]
    fn what_did_not_change_is_shared_and_what_did_is_as_if_packed_anew() {
        let mut scene = scene();
        let before = PackedScene::new(&scene).accelerated(Accelerator::Kd).expect("it has a kd-tree");
        let after = |scene: &Scene| {
            let after = PackedScene::new_after(&before, scene);
            assert_same(&after, &PackedScene::new(scene));
            after
        };
        // Neither strength nor tint nor rotation of the sky is in its texels.
        scene.materials.last_mut().expect("it has some").roughness = 0.5;
        let sky = scene.environment.as_mut().expect("it has one");
        (sky.strength, sky.tint, sky.rotation) = (0.0, Vec3::X, 1.0);
        let look = after(&scene);
        assert_eq!(shared(&look, &before), [true; 5]);
        assert!(look.materials != before.materials && look.lights.len() < before.lights.len());
        // What shines and what is seen from behind is in the primitives; once more, after a scene that itself came after one.
        scene.materials[0].emission = Vec3::ONE;
        let lamp = after(&scene);
        assert_eq!(shared(&lamp, &before), [true, false, true, true, true]);
        assert!(lamp.primitives != before.primitives && lamp.lights.len() > before.lights.len());
        let again = PackedScene::new_after(&lamp, &scene);
        assert_eq!(shared(&again, &lamp), [true; 5]);
        scene.materials[0].emission = Vec3::ZERO;
        for material in &mut scene.materials {
            (material.double_sided, material.transmission) = (false, 0.0);
        }
        let one_sided = after(&scene);
        assert_eq!(shared(&one_sided, &before), [true, false, true, true, true]);
        // Of a sphere too, and of which material it is.
        (scene.spheres[0].inward, scene.spheres[0].material) = (true, 1);
        let turned = after(&scene);
        assert_eq!(shared(&turned, &before), [true, false, true, true, true]);
        let back = PackedScene::new_after(&one_sided, &scene);
        assert_eq!(shared(&back, &one_sided), [true, false, true, true, true]);
        scene.spheres[0] = Sphere { inward: false, material: 0, ..scene.spheres[0] };
        let back = PackedScene::new_after(&one_sided, &scene);
        assert_eq!(shared(&back, &one_sided), [true; 5]);
    }

    #[test]
    fn what_moves_or_vanishes_is_packed_anew() {
        let mut scene = scene();
        let before = PackedScene::new(&scene).accelerated(Accelerator::Kd).expect("it has a kd-tree");
        // Of which mesh 0 is.
        let bumpy = |scene: &mut Scene, uv_set| {
            let of = scene.meshes[0].material;
            scene.materials[of].normal_texture = Some(Texture { uv_set, ..Texture::new(0) });
        };
        for uv_set in [0, 1] {
            let before = PackedScene::new(&scene);
            bumpy(&mut scene, uv_set);
            let after = PackedScene::new_after(&before, &scene);
            assert_same(&after, &PackedScene::new(&scene));
            assert!(!shared(&after, &before)[0]);
        }
        let changes: [fn(&mut Scene); 7] = [
            |scene| scene.materials[0].alpha = AlphaMode::Mask(1.5),
            |scene| Arc::make_mut(&mut scene.meshes[0]).positions[0] += 9.0,
            |scene| Arc::make_mut(&mut scene.meshes[0]).material = 1,
            |scene| scene.meshes.swap(0, 1),
            |scene| scene.spheres.push(Sphere { centre: Vec3::ONE, radius: 0.5, inward: false, material: 0 }),
            |scene| scene.spheres[0].radius = 0.25,
            |scene| drop(scene.meshes.pop()),
        ];
        for change in changes {
            change(&mut scene);
            let after = PackedScene::new_after(&before, &scene);
            assert_same(&after, &PackedScene::new(&scene));
            assert!(!shared(&after, &before)[0] && after.kd.is_none());
        }
        let changes: [fn(&mut Scene); 3] = [
            |scene| Arc::make_mut(&mut scene.images[0]).texels[0] = [1, 2, 3, 4],
            |scene| drop(scene.environment.replace(Environment::uniform(Vec3::ONE))),
            |scene| scene.environment = None,
        ];
        for change in changes {
            change(&mut scene);
            assert_same(&PackedScene::new_after(&before, &scene), &PackedScene::new(&scene));
        }
    }

    #[test]
    fn an_alpha_cutoff_above_one_hides_the_mesh() {
        let mesh =
            Mesh { positions: vec![Vec3::ZERO, Vec3::X, Vec3::Y], triangles: vec![[0, 1, 2]], ..Mesh::default() };
        let masked = |cutoff| Material { alpha: AlphaMode::Mask(cutoff), ..Material::default() };
        let materials = vec![masked(1.0), masked(1.5)];
        let meshes = vec![mesh.clone().into(), Mesh { material: 1, ..mesh }.into()];
        let packed = PackedScene::new(&Scene { meshes, materials, ..Scene::default() });
        assert_eq!(packed.primitives.iter().map(|p| p.material).collect::<Vec<_>>(), [0]);
    }
}
