//! glTF meshes: attributes, topology, morph targets.

use super::buffers::{Buffers, lookup};
use super::document::{self, Document, Primitive};
use super::material;
use super::nodes::Placement;
use crate::scene::load::files::Source;
use crate::scene::load::geometry;
use crate::scene::load::{Budget, LoadError, Warnings};
use crate::scene::{Mesh, Scene};
use glam::{Vec2, Vec3, Vec4};
use std::collections::BTreeMap;

const TRIANGLES: u32 = 4;
const TRIANGLE_STRIP: u32 = 5;
const TRIANGLE_FAN: u32 = 6;

/// Appends the placed meshes to `scene`, which must hold the materials.
pub(super) fn load_all(
    source: &Source,
    document: &Document,
    buffers: &Buffers,
    placements: Vec<Placement>,
    scene: &mut Scene,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<(), LoadError> {
    let mut default_material = None;
    // Instances of one mesh are read once, unless a node deforms it in its own way.
    let mut groups: BTreeMap<(usize, Option<usize>), Vec<Placement>> = BTreeMap::new();
    for placement in placements {
        let deforms = document.nodes[placement.node].weights.is_some().then_some(placement.node);
        groups.entry((placement.mesh, deforms)).or_default().push(placement);
    }
    let mut reader = Reader { source, buffers, warnings };
    for ((mesh_index, _), placements) in &groups {
        for (i, primitive) in document.meshes[*mesh_index].primitives.iter().enumerate() {
            reader.reserve(primitive, &format!("meshes[{mesh_index}].primitives[{i}]"), placements.len(), budget)?;
        }
    }
    for ((mesh_index, deforming_node), placements) in groups {
        let mesh = &document.meshes[mesh_index];
        let weights = match deforming_node {
            Some(node) => document.nodes[node].weights.as_deref().unwrap_or(&[]),
            None => &mesh.weights,
        };
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            source.go_on()?;
            let place = format!("meshes[{mesh_index}].primitives[{i}]");
            let name = name(document, mesh, &placements, i);
            let Some(mut local) = reader.primitive(primitive, weights, &place)? else { continue };
            local.name = name;
            local.material = match primitive.material {
                Some(material) => {
                    let place = format!("{place}.material");
                    lookup(source, &document.materials, material, "materials", &place)?;
                    material
                }
                None => *default_material.get_or_insert_with(|| {
                    scene.materials.push(material::default_material());
                    scene.materials.len() - 1
                }),
            };
            let mut placements = placements.iter().peekable();
            while let Some(placement) = placements.next() {
                source.go_on()?;
                // The last instance may have the original.
                let mut world = if placements.peek().is_some() { local.clone() } else { std::mem::take(&mut local) };
                geometry::transform(&mut world, &placement.world_from_mesh);
                let place = format!("{place} at nodes[{}]", placement.node);
                geometry::clean(&mut world, &place, reader.warnings)
                    .map_err(|problem| source.invalid(place, problem))?;
                if !world.triangles.is_empty() {
                    scene.meshes.push(world.into());
                }
            }
        }
    }
    Ok(())
}

/// The placed meshes in one, in double precision: nothing is left out that has no area.
pub(super) fn load_geometry(
    source: &Source,
    document: &Document,
    buffers: &Buffers,
    placements: &[Placement],
    warnings: &mut Warnings,
) -> Result<crate::mesh::Mesh, LoadError> {
    let mut all = crate::mesh::Mesh::default();
    let mut budget = Budget::new();
    let mut reader = Reader { source, buffers, warnings };
    for placement in placements {
        let mesh = &document.meshes[placement.mesh];
        let weights = document.nodes[placement.node].weights.as_deref().unwrap_or(&mesh.weights);
        let mirrored = placement.world_from_mesh.matrix3.determinant() < 0.0;
        for (i, primitive) in mesh.primitives.iter().enumerate() {
            let place = format!("meshes[{}].primitives[{i}]", placement.mesh);
            reader.reserve(primitive, &place, 1, &mut budget)?;
            let Some(local) = reader.primitive(primitive, weights, &place)? else { continue };
            let first = all.vertices.len() as u32;
            for p in &local.positions {
                let p = placement.world_from_mesh.transform_point3(p.as_dvec3());
                if !p.is_finite() {
                    let problem = format!("vertex {} is not finite", all.vertices.len() as u32 - first);
                    return Err(source.invalid(format!("{place} at nodes[{}]", placement.node), problem));
                }
                all.vertices.push(p.to_array());
            }
            // As seen in the world: glTF turns the winding of what is mirrored.
            let turned = |[a, b, c]: [u32; 3]| if mirrored { [a, c, b] } else { [a, b, c] };
            all.faces.extend(local.triangles.iter().map(|corners| turned(*corners).map(|v| first + v)));
        }
    }
    Ok(all)
}

fn name(document: &Document, mesh: &document::Mesh, placements: &[Placement], primitive: usize) -> String {
    let of_node = || placements.first().and_then(|placement| document.nodes[placement.node].name.clone());
    let name = mesh.name.clone().or_else(of_node).unwrap_or_else(|| "mesh".into());
    if mesh.primitives.len() > 1 { format!("{name}[{primitive}]") } else { name }
}

struct Reader<'a> {
    source: &'a Source,
    buffers: &'a Buffers<'a>,
    warnings: &'a mut Warnings,
}

impl Reader<'_> {
    /// Counts a primitive against the limits before anything is allocated for it.
    fn reserve(
        &mut self,
        primitive: &Primitive,
        place: &str,
        copies: usize,
        budget: &mut Budget,
    ) -> Result<(), LoadError> {
        let Some(&positions) = primitive.attributes.get("POSITION") else { return Ok(()) };
        let n_vertices = self.buffers.accessor(positions, &format!("{place}.attributes.POSITION"))?.count;
        let n_corners = match primitive.indices {
            Some(indices) => self.buffers.accessor(indices, &format!("{place}.indices"))?.count,
            None => n_vertices,
        };
        let n_triangles = if primitive.mode == TRIANGLES { n_corners / 3 } else { n_corners };
        budget.take(n_vertices, n_triangles, copies as u64).map_err(|problem| self.source.too_large(place, problem))
    }

    /// A primitive in the space of its mesh; `None` if it shows nothing.
    fn primitive(&mut self, primitive: &Primitive, weights: &[f32], place: &str) -> Result<Option<Mesh>, LoadError> {
        match primitive.mode {
            TRIANGLES | TRIANGLE_STRIP | TRIANGLE_FAN => {}
            0..=3 => {
                self.warnings.push(format!("{place}: points and lines are not shown"));
                return Ok(None);
            }
            mode => return Err(self.source.invalid(format!("{place}.mode"), format!("{mode} is unknown"))),
        }
        let attribute =
            |name: &str| primitive.attributes.get(name).map(|&index| (index, format!("{place}.attributes.{name}")));
        let Some((positions, here)) = attribute("POSITION") else {
            self.warnings.push(format!("{place}: without POSITION nothing is shown"));
            return Ok(None);
        };
        let mut mesh = Mesh { positions: vec3(self.buffers.floats(positions, &here)?), ..Mesh::default() };
        let n = mesh.positions.len();
        if let Some((index, here)) = attribute("NORMAL") {
            self.check_length(index, n, &here)?;
            mesh.normals = vec3(self.buffers.floats(index, &here)?);
        }
        // Without normals glTF has tangents ignored.
        if let Some((index, here)) = attribute("TANGENT").filter(|_| !mesh.normals.is_empty()) {
            self.check_length(index, n, &here)?;
            mesh.tangents = self.buffers.floats(index, &here)?.into_iter().map(Vec4::from_array).collect();
        }
        let uv = |name| match attribute(name) {
            Some((index, here)) => {
                self.check_length(index, n, &here)?;
                Ok(self.buffers.floats(index, &here)?.into_iter().map(Vec2::from_array).collect())
            }
            None => Ok(Vec::new()),
        };
        (mesh.uv0, mesh.uv1) = (uv("TEXCOORD_0")?, uv("TEXCOORD_1")?);
        if let Some((index, here)) = attribute("COLOR_0") {
            self.check_length(index, n, &here)?;
            mesh.colors = self.colors(index, &here)?;
        }
        self.morph(&mut mesh, primitive, weights, place)?;
        mesh.triangles = self.triangles(primitive, n, place)?;
        Ok(Some(mesh))
    }

    /// Before reading: an attribute of another length is useless, and may be large.
    fn check_length(&self, accessor: usize, n_vertices: usize, place: &str) -> Result<(), LoadError> {
        let count = self.buffers.accessor(accessor, place)?.count;
        if count == n_vertices as u64 {
            Ok(())
        } else {
            let problem = format!("{count} elements, but POSITION has {n_vertices}");
            Err(self.source.invalid(place, problem))
        }
    }

    fn colors(&self, index: usize, place: &str) -> Result<Vec<Vec4>, LoadError> {
        // Integer colours are always normalised, though some writers forget to say so.
        if self.buffers.accessor(index, place)?.shape == "VEC3" {
            let colors = self.buffers.floats_as(index, place, true)?;
            Ok(colors.into_iter().map(|[r, g, b]| Vec4::new(r, g, b, 1.0)).collect())
        } else {
            Ok(self.buffers.floats_as(index, place, true)?.into_iter().map(Vec4::from_array).collect())
        }
    }

    /// Adds the morph targets by their weights.
    fn morph(&mut self, mesh: &mut Mesh, primitive: &Primitive, weights: &[f32], place: &str) -> Result<(), LoadError> {
        /// Targets in use, at most: each costs a pass over the vertices.
        const MAX_TARGETS: usize = 1024;
        let n = mesh.positions.len();
        let used = |weight: &f32| *weight != 0.0;
        if weights.iter().filter(|w| used(w)).count() > MAX_TARGETS {
            return Err(self.source.too_large(place, format!("more than {MAX_TARGETS} morph targets have a weight")));
        }
        let targets = primitive.targets.iter().zip(weights).enumerate();
        for (i, (target, &weight)) in targets.filter(|(_, (_, weight))| used(weight)) {
            for (name, &index) in target {
                let here = format!("{place}.targets[{i}].{name}");
                if !matches!(name.as_str(), "POSITION" | "NORMAL" | "TANGENT") {
                    continue;
                }
                self.check_length(index, n, &here)?;
                let deltas = vec3(self.buffers.floats(index, &here)?);
                match name.as_str() {
                    "POSITION" => add(&mut mesh.positions, &deltas, weight),
                    "NORMAL" => add(&mut mesh.normals, &deltas, weight),
                    _ => {
                        for (tangent, delta) in mesh.tangents.iter_mut().zip(deltas) {
                            *tangent += (delta * weight).extend(0.0);
                        }
                    }
                }
            }
        }
        // Blended tangents are no longer of unit length.
        for tangent in &mut mesh.tangents {
            *tangent = tangent.truncate().normalize_or_zero().extend(tangent.w);
        }
        Ok(())
    }

    fn triangles(&mut self, primitive: &Primitive, n_vertices: usize, place: &str) -> Result<Vec<[u32; 3]>, LoadError> {
        let corners = match primitive.indices {
            Some(index) => {
                let place = format!("{place}.indices");
                let corners = self.buffers.indices(index, &place)?;
                if let Some(at) = corners.iter().position(|&corner| corner as usize >= n_vertices) {
                    let problem = format!("index {at} is {}, but there are {n_vertices} vertices", corners[at]);
                    return Err(self.source.invalid(place, problem));
                }
                corners
            }
            None => (0..n_vertices as u32).collect(),
        };
        let n = corners.len();
        match primitive.mode {
            TRIANGLES if n % 3 != 0 => {
                self.warnings.push(format!("{place}: {n} corners are not a multiple of 3; the rest is left out"));
            }
            _ if n < 3 => self.warnings.push(format!("{place}: {n} corners are not a triangle")),
            _ => {}
        }
        Ok(match primitive.mode {
            TRIANGLES => corners.as_chunks().0.to_vec(),
            TRIANGLE_STRIP => {
                // Every other one is the wrong way round.
                let flip = |(i, t): (usize, &[u32])| if i % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
                corners.windows(3).enumerate().map(flip).collect()
            }
            _ => corners.get(1..).unwrap_or(&[]).windows(2).map(|pair| [corners[0], pair[0], pair[1]]).collect(),
        })
    }
}

fn vec3(elements: Vec<[f32; 3]>) -> Vec<Vec3> {
    elements.into_iter().map(Vec3::from_array).collect()
}

fn add(values: &mut [Vec3], deltas: &[Vec3], weight: f32) {
    for (value, delta) in values.iter_mut().zip(deltas) {
        *value += *delta * weight;
    }
}
