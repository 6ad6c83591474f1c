//! The node hierarchy: where meshes, cameras and lights stand in the world.

use super::buffers::{Buffers, lookup};
use super::document::{self, Document, Instancing, Node};
use crate::scene::load::files::Source;
use crate::scene::load::{LoadError, MAX_MESHES, Warnings};
use crate::scene::{Camera, Projection, PunctualKind, PunctualLight};
use glam::{Affine3A, DAffine3, DMat3, DMat4, DQuat, DVec3, Vec3};
use std::f32::consts::{FRAC_PI_2, PI};

/// A mesh at a place in the world.
pub(super) struct Placement {
    pub mesh: usize,
    /// Node, for messages and for its morph weights.
    pub node: usize,
    pub world_from_mesh: DAffine3,
}

/// What stands at the nodes of the default scene.
#[derive(Default)]
pub(super) struct Nodes {
    pub placements: Vec<Placement>,
    pub cameras: Vec<Camera>,
    pub lights: Vec<PunctualLight>,
}

/// Walks the default scene, else the first, else all nodes without a parent.
pub(super) fn place(
    source: &Source,
    document: &Document,
    buffers: &Buffers,
    warnings: &mut Warnings,
) -> Result<Nodes, LoadError> {
    let mut walk = Walk { source, document, buffers, warnings, found: Nodes::default() };
    let (roots, place) = roots(source, document)?;
    let mut reached = vec![false; document.nodes.len()];
    let mut stack: Vec<(usize, DAffine3, String)> =
        roots.into_iter().rev().map(|root| (root, DAffine3::IDENTITY, place.clone())).collect();
    while let Some((index, world_from_parent, place)) = stack.pop() {
        let node = lookup(source, &document.nodes, index, "nodes", &place)?;
        if std::mem::replace(&mut reached[index], true) {
            let problem = format!("node {index} is reached twice: the nodes are not a tree");
            return Err(source.invalid(place, problem));
        }
        let here = format!("nodes[{index}]");
        let world = world_from_parent * local_transform(source, node, &here)?;
        if !world.is_finite() {
            return Err(source.invalid(here, "the transform is not finite"));
        }
        walk.visit(index, node, world, &here)?;
        let place = format!("{here}.children");
        stack.extend(node.children.iter().rev().map(|&child| (child, world, place.clone())));
    }
    Ok(walk.found)
}

fn roots(source: &Source, document: &Document) -> Result<(Vec<usize>, String), LoadError> {
    if document.scenes.is_empty() {
        let mut is_root = vec![true; document.nodes.len()];
        for child in document.nodes.iter().flat_map(|node| &node.children) {
            // Out of range: reported where the child is visited.
            if let Some(flag) = is_root.get_mut(*child) {
                *flag = false;
            }
        }
        return Ok(((0..is_root.len()).filter(|&i| is_root[i]).collect(), "nodes".into()));
    }
    let index = document.scene.unwrap_or(0);
    let scene = lookup(source, &document.scenes, index, "scenes", "scene")?;
    Ok((scene.nodes.clone(), format!("scenes[{index}].nodes")))
}

fn local_transform(source: &Source, node: &Node, place: &str) -> Result<DAffine3, LoadError> {
    if let Some(matrix) = &node.matrix {
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(matrix)));
    }
    let translation = node.translation.map_or(DVec3::ZERO, DVec3::from);
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    let rotation = match node.rotation.map(DQuat::from_array) {
        None => DQuat::IDENTITY,
        Some(q) if q.is_finite() && q.length_squared() > 0.0 => q.normalize(),
        Some(_) => return Err(source.invalid(format!("{place}.rotation"), "is not a rotation")),
    };
    Ok(DAffine3::from_scale_rotation_translation(scale, rotation, translation))
}

struct Walk<'a> {
    source: &'a Source,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    warnings: &'a mut Warnings,
    found: Nodes,
}

impl Walk<'_> {
    fn visit(&mut self, index: usize, node: &Node, world: DAffine3, place: &str) -> Result<(), LoadError> {
        if let Some(mesh) = node.mesh {
            lookup(self.source, &self.document.meshes, mesh, "meshes", &format!("{place}.mesh"))?;
            if node.skin.is_some() {
                self.warnings.push(format!("{place}.skin: skinning is ignored; the mesh is shown as its node stands"));
            }
            match &node.extensions.instancing {
                Some(instancing) => self.instances(index, mesh, instancing, world, place)?,
                None => self.found.placements.push(Placement { mesh, node: index, world_from_mesh: world }),
            }
        }
        if let Some(camera) = node.camera {
            let camera = lookup(self.source, &self.document.cameras, camera, "cameras", &format!("{place}.camera"))?;
            self.camera(camera, node, world, place)?;
        }
        if let Some(light) = &node.extensions.light {
            let place = format!("{place}.extensions.KHR_lights_punctual.light");
            let lights = &self.document.extensions.lights.lights;
            let from = lookup(self.source, lights, light.light, "lights", &place)?;
            self.light(from, node, world, &format!("extensions.KHR_lights_punctual.lights[{}]", light.light))?;
        }
        Ok(())
    }

    /// `EXT_mesh_gpu_instancing`.
    fn instances(
        &mut self,
        node: usize,
        mesh: usize,
        instancing: &Instancing,
        world: DAffine3,
        place: &str,
    ) -> Result<(), LoadError> {
        let place = format!("{place}.extensions.EXT_mesh_gpu_instancing.attributes");
        let mut count = None;
        for (name, &accessor) in &instancing.attributes {
            let n = self.buffers.accessor(accessor, &format!("{place}.{name}"))?.count;
            if *count.get_or_insert(n) != n {
                return Err(self.source.invalid(place, "the accessors differ in length"));
            }
        }
        let count = count.unwrap_or(0);
        if count + self.found.placements.len() as u64 > MAX_MESHES {
            return Err(self.source.too_large(place, format!("more than {MAX_MESHES} meshes in the scene")));
        }
        let attribute = |name: &str| instancing.attributes.get(name).map(|&i| (i, format!("{place}.{name}")));
        let read3 = |name: &str| match attribute(name) {
            Some((i, place)) => self.buffers.floats::<3>(i, &place),
            None => Ok(Vec::new()),
        };
        let (translations, scales) = (read3("TRANSLATION")?, read3("SCALE")?);
        let rotations = match attribute("ROTATION") {
            Some((i, place)) => self.buffers.floats::<4>(i, &place)?,
            None => Vec::new(),
        };
        for i in 0..count as usize {
            let vector = |list: &[[f32; 3]], default| list.get(i).map_or(default, |&v| Vec3::from(v).as_dvec3());
            let rotation = rotations
                .get(i)
                .map_or(DQuat::IDENTITY, |&[x, y, z, w]| DQuat::from_xyzw(x.into(), y.into(), z.into(), w.into()));
            let translation = vector(&translations, DVec3::ZERO);
            let scale = vector(&scales, DVec3::ONE);
            if !(rotation.length_squared() > 0.0
                && rotation.is_finite()
                && translation.is_finite()
                && scale.is_finite())
            {
                return Err(self.source.invalid(place, format!("the transform of instance {i} is not finite")));
            }
            let local = DAffine3::from_scale_rotation_translation(scale, rotation.normalize(), translation);
            self.found.placements.push(Placement { mesh, node, world_from_mesh: world * local });
        }
        Ok(())
    }

    fn camera(&mut self, from: &document::Camera, node: &Node, world: DAffine3, place: &str) -> Result<(), LoadError> {
        let place = format!("{place}.camera");
        let (projection, aspect) = if let Some(lens) = &from.perspective {
            if !(lens.yfov > 0.0 && lens.yfov < PI) {
                let problem = format!("yfov of {} is not between 0 and π", lens.yfov);
                return Err(self.source.invalid(place, problem));
            }
            (Projection::Perspective { yfov: lens.yfov }, lens.aspect_ratio)
        } else if let Some(lens) = &from.orthographic {
            let (xmag, ymag) = (lens.xmag.abs(), lens.ymag.abs());
            if !(ymag > 0.0 && ymag.is_finite()) {
                return Err(self.source.invalid(place, format!("ymag of {} is not positive", lens.ymag)));
            }
            (Projection::Orthographic { ymag }, Some(xmag / ymag))
        } else {
            return Err(self.source.invalid(place, "the camera is neither perspective nor orthographic"));
        };
        let Some(world_from_camera) = rigid(world) else {
            self.warnings.push(format!("{place}: the node's scale is 0; the camera is left out"));
            return Ok(());
        };
        let n = self.found.cameras.len();
        let mut name = from.name.clone().or_else(|| node.name.clone()).unwrap_or_else(|| format!("camera {n}"));
        if self.found.cameras.iter().any(|camera| camera.name == name) {
            name = format!("{name} {n}");
        }
        self.found.cameras.push(Camera {
            name,
            world_from_camera,
            projection,
            aperture_radius: 0.0,
            focus_distance: 1.0,
            aspect: aspect.filter(|aspect| aspect.is_finite() && *aspect > 0.0),
        });
        Ok(())
    }

    fn light(&mut self, from: &document::Light, node: &Node, world: DAffine3, place: &str) -> Result<(), LoadError> {
        let kind = match from.kind.as_str() {
            "point" => PunctualKind::Point,
            "directional" => PunctualKind::Directional,
            "spot" => self.spot(&from.spot, place)?,
            other => {
                self.warnings.push(format!("{place}.type: {other:?} is unknown; the light is left out"));
                return Ok(());
            }
        };
        let intensity = Vec3::from(from.color) * from.intensity;
        if !intensity.is_finite() || intensity.min_element() < 0.0 {
            return Err(self.source.invalid(place, format!("an intensity of {intensity} is not finite and ≥ 0")));
        }
        let direction = (world.matrix3 * DVec3::NEG_Z).try_normalize();
        if kind != PunctualKind::Point && direction.is_none() {
            self.warnings.push(format!("{place}: the node's scale is 0; the light is left out"));
            return Ok(());
        }
        let (position, direction) =
            (world.translation.as_vec3(), direction.unwrap_or(DVec3::NEG_Z).as_vec3().normalize());
        let n = self.found.lights.len();
        let mut name = from.name.clone().or_else(|| node.name.clone()).unwrap_or_else(|| format!("light {n}"));
        if self.found.lights.iter().any(|light| light.name == name) {
            name = format!("{name} {n}");
        }
        self.found.lights.push(PunctualLight { name, position, direction, intensity, kind });
        Ok(())
    }

    fn spot(&mut self, from: &document::Spot, place: &str) -> Result<PunctualKind, LoadError> {
        let place = format!("{place}.spot");
        let (inner, outer) = (from.inner_cone_angle, from.outer_cone_angle);
        if !(inner >= 0.0 && outer > 0.0 && outer.is_finite()) {
            return Err(self.source.invalid(place, format!("a cone from {inner} to {outer} radians is empty")));
        }
        let limited = outer.min(FRAC_PI_2);
        // A hard edge still needs inner < outer.
        let inside = inner.min(limited * 0.9999);
        if limited != outer || inner > outer {
            self.warnings.push(format!("{place}: {inner} to {outer} radians is taken as {inside} to {limited}"));
        }
        Ok(PunctualKind::Spot { inner: inside, outer: limited })
    }
}

/// The rotation and translation nearest to what a camera with this transform sees: it looks along −z, y is up.
fn rigid(world: DAffine3) -> Option<Affine3A> {
    let z = world.matrix3.z_axis.try_normalize()?;
    let up = world.matrix3.y_axis;
    let y = (up - z * up.dot(z)).try_normalize()?;
    let rotation = DMat3::from_cols(y.cross(z), y, z).as_mat3();
    Some(Affine3A::from_mat3_translation(rotation, world.translation.as_vec3()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_stays_rigid_under_scale_and_mirror() {
        let world = DAffine3::from_scale_rotation_translation(
            DVec3::new(-2.0, 3.0, 0.5),
            DQuat::from_rotation_y(1.0),
            DVec3::X,
        );
        let camera = rigid(world).unwrap();
        let m = camera.matrix3;
        assert!((m.transpose() * m).abs_diff_eq(glam::Mat3A::IDENTITY, 1e-6) && m.determinant() > 0.0);
        let forward = DQuat::from_rotation_y(1.0) * DVec3::NEG_Z;
        assert!((m * glam::Vec3A::NEG_Z).abs_diff_eq(forward.as_vec3().into(), 1e-6));
        assert_eq!(rigid(DAffine3::from_scale(DVec3::ZERO)), None);
    }
}
