//! Wavefront OBJ: polygons with positions, texture coordinates, normals and vertex colours (taken as sRGB).
//!
//! Smoothing groups, curves, lines and points are not read; a face without normals is flat.

use super::files::Source;
use super::mtl::Library;
use super::{Budget, LoadError, MAX_MESHES, MAX_VERTICES, Warnings, geometry};
use crate::math::polygon::triangulate;
use crate::scene::{Material, Mesh, Scene};
use glam::{DVec3, Vec2, Vec3, Vec4};
use std::collections::HashMap;
use std::sync::Arc;

/// Read at once, whoever does not want them any more.
const LINES: usize = 4096;

/// Reads a scene; `bytes` is the content of the file.
pub(super) fn load(source: &Source, bytes: &[u8], warnings: &mut Warnings) -> Result<Scene, LoadError> {
    // Names may be in any encoding; numbers are ASCII.
    let text = String::from_utf8_lossy(bytes);
    let mut parser = Parser::new(source, warnings);
    let mut joined = String::new();
    for (i, line) in text.lines().enumerate() {
        if i % LINES == 0 {
            source.go_on()?;
        }
        let place = Place { line: i + 1 };
        // A backslash at the end joins lines.
        if let Some(part) = line.trim_end().strip_suffix('\\') {
            joined.push_str(part);
            joined.push(' ');
        } else if joined.is_empty() {
            parser.line(line.trim(), place)?;
        } else {
            joined.push_str(line);
            parser.line(joined.trim(), place)?;
            joined.clear();
        }
    }
    parser.finish()
}

/// A line of the file, from 1.
#[derive(Clone, Copy)]
struct Place {
    line: usize,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "line {}", self.line)
    }
}

/// Indices of a corner's position, texture coordinates and normal.
type Corner = (u32, Option<u32>, Option<u32>);

/// Faces that become one mesh: object, material, and whether all corners have texture coordinates and normals.
type GroupKey = (usize, usize, bool, bool);

#[derive(Default)]
struct Group {
    vertices: HashMap<Corner, u32>,
    /// The keys of `vertices`, by index.
    corners: Vec<Corner>,
    triangles: Vec<[u32; 3]>,
}

struct Parser<'a> {
    source: &'a Source,
    warnings: &'a mut Warnings,
    library: Library<'a>,
    positions: Vec<Vec3>,
    /// Empty, or linear RGB of every position.
    colors: Vec<Vec3>,
    uvs: Vec<Vec2>,
    normals: Vec<Vec3>,
    objects: Vec<String>,
    /// Names in `usemtl`; the first is that of faces before any.
    materials: Vec<String>,
    material_of_name: HashMap<String, usize>,
    material: usize,
    groups: Vec<(GroupKey, Group)>,
    group_of_key: HashMap<GroupKey, usize>,
    /// Of the face that is read.
    face: Vec<Corner>,
    n_triangles: u64,
}

impl<'a> Parser<'a> {
    fn new(source: &'a Source, warnings: &'a mut Warnings) -> Self {
        Self {
            source,
            warnings,
            library: Library::new(),
            positions: Vec::new(),
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            objects: vec![String::new()],
            materials: vec![String::new()],
            material_of_name: HashMap::new(),
            material: 0,
            groups: Vec::new(),
            group_of_key: HashMap::new(),
            face: Vec::new(),
            n_triangles: 0,
        }
    }

    fn line(&mut self, line: &str, place: Place) -> Result<(), LoadError> {
        let (key, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let value = value.trim();
        let result = match key {
            "v" => self.position(value),
            "vt" => numbers(value).map(|([u, v, _, _, _, _], _)| {
                // From the top, as everywhere else here.
                self.uvs.push(Vec2::new(u, 1.0 - v));
            }),
            "vn" => numbers(value).and_then(|([x, y, z, ..], n)| match n {
                3.. => {
                    self.normals.push(Vec3::new(x, y, z));
                    Ok(())
                }
                _ => Err(format!("3 numbers are expected, {n} are there")),
            }),
            "f" | "fo" => return self.polygon(value, place),
            "usemtl" => {
                self.use_material(value);
                Ok(())
            }
            "mtllib" => return self.material_library(value, place),
            "o" | "g" => {
                self.object(key, value);
                Ok(())
            }
            "" | "s" => Ok(()),
            _ if key.starts_with('#') => Ok(()),
            "l" | "p" => {
                self.warnings.push_once("points and lines are not shown", &place);
                Ok(())
            }
            _ => {
                self.warnings.push_once(&format!("{key:.20?} is ignored"), &place);
                Ok(())
            }
        };
        let full = [self.positions.len(), self.uvs.len(), self.normals.len()].into_iter().max().unwrap_or(0);
        if full as u64 > MAX_VERTICES {
            return Err(self.source.too_large(place.to_string(), format!("more than {MAX_VERTICES} vertices")));
        }
        result.map_err(|problem| self.source.invalid(place.to_string(), format!("{key}: {problem}")))
    }

    fn position(&mut self, value: &str) -> Result<(), String> {
        let ([x, y, z, r, g, b], n) = numbers(value)?;
        if n < 3 {
            return Err(format!("3 numbers are expected, {n} are there"));
        }
        if n == 6 {
            self.colors.resize(self.positions.len(), Vec3::ONE);
            self.colors.push(Vec3::new(r, g, b).map(linear_from_srgb));
        } else if !self.colors.is_empty() {
            self.colors.push(Vec3::ONE);
        }
        self.positions.push(Vec3::new(x, y, z));
        Ok(())
    }

    fn object(&mut self, key: &str, name: &str) {
        // Groups only name what has no name: there may be one per face.
        let current = self.objects.len() - 1;
        if key == "o" && !self.groups.is_empty() {
            self.objects.push(name.into());
        } else if key == "o" || self.objects[current].is_empty() {
            self.objects[current] = name.into();
        }
    }

    fn use_material(&mut self, name: &str) {
        let next = self.materials.len();
        self.material = *self.material_of_name.entry(name.into()).or_insert(next);
        if self.material == next {
            self.materials.push(name.into());
        }
    }

    fn material_library(&mut self, value: &str, place: Place) -> Result<(), LoadError> {
        // Several libraries, or one whose name has spaces.
        let names: Vec<&str> = match self.source.is_missing(value) {
            true => value.split_whitespace().collect(),
            false => vec![value],
        };
        let here = format!("{place}: mtllib");
        for name in names {
            if self.source.is_missing(name) {
                self.warnings.push(format!("{here}: {name:.200}: no such file; its materials are grey"));
                continue;
            }
            let bytes = self.source.read(&here, name)?;
            self.library.read(self.source, name, &String::from_utf8_lossy(&bytes), self.warnings)?;
        }
        Ok(())
    }

    fn polygon(&mut self, value: &str, place: Place) -> Result<(), LoadError> {
        let invalid = |problem: String| self.source.invalid(place.to_string(), format!("f: {problem}"));
        self.face.clear();
        for word in value.split_whitespace() {
            let mut indices = word.split('/');
            let mut index = |what: &str, n: usize| match indices.next() {
                None | Some("") => Ok(None),
                Some(text) => resolve(text, what, n).map(Some),
            };
            let position = index("vertex", self.positions.len()).map_err(invalid)?;
            let uv = index("texture coordinate", self.uvs.len()).map_err(invalid)?;
            let normal = index("normal", self.normals.len()).map_err(invalid)?;
            let position = position.ok_or_else(|| invalid(format!("{word:.40?} has no vertex")))?;
            self.face.push((position, uv, normal));
        }
        if self.face.len() < 3 {
            self.warnings.push(format!("{place}: a face with less than 3 corners is left out"));
            return Ok(());
        }
        self.n_triangles += self.face.len() as u64 - 2;
        if self.n_triangles > super::MAX_TRIANGLES {
            let problem = format!("more than {} triangles", super::MAX_TRIANGLES);
            return Err(self.source.too_large(place.to_string(), problem));
        }
        let has_uv = self.face.iter().all(|corner| corner.1.is_some());
        let has_normal = self.face.iter().all(|corner| corner.2.is_some());
        let key = (self.objects.len() - 1, self.material, has_uv, has_normal);
        let next = self.groups.len();
        let index = *self.group_of_key.entry(key).or_insert(next);
        if index == next {
            if next as u64 >= MAX_MESHES {
                return Err(self.source.too_large(place.to_string(), format!("more than {MAX_MESHES} meshes")));
            }
            self.groups.push((key, Group::default()));
        }
        let group = &mut self.groups[index].1;
        let mut vertex = |&(position, uv, normal): &Corner| {
            let corner = (position, uv.filter(|_| has_uv), normal.filter(|_| has_normal));
            *group.vertices.entry(corner).or_insert_with(|| {
                group.corners.push(corner);
                group.corners.len() as u32 - 1
            })
        };
        match &self.face[..] {
            [a, b, c] => {
                let triangle = [vertex(a), vertex(b), vertex(c)];
                group.triangles.push(triangle);
            }
            face => {
                let points: Vec<DVec3> = face.iter().map(|c| self.positions[c.0 as usize].as_dvec3()).collect();
                let vertices: Vec<u32> = face.iter().map(vertex).collect();
                group.triangles.extend(triangulate(&points).map(|triangle| triangle.map(|i| vertices[i])));
            }
        }
        Ok(())
    }

    fn finish(self) -> Result<Scene, LoadError> {
        if self.positions.is_empty() && self.n_triangles == 0 {
            return Err(self.source.format("has neither vertices nor faces: is this an OBJ file?"));
        }
        let (materials, images) = self.library.finish(self.source)?;
        let images = images.into_iter().map(Arc::new).collect();
        let mut scene = Scene { materials, images, ..Scene::default() };
        let mut index_of: HashMap<String, usize> = HashMap::new();
        for (i, material) in scene.materials.iter().enumerate() {
            index_of.entry(material.name.clone()).or_insert(i);
        }
        let mut default = None;
        let mut budget = Budget::new();
        for ((object, material, has_uv, has_normal), group) in self.groups {
            self.source.go_on()?;
            let name = &self.materials[material];
            let material = match index_of.get(name) {
                Some(&index) => index,
                None => {
                    if !name.is_empty() {
                        self.warnings.push(format!("usemtl {name:.80}: there is no such material; grey is used"));
                    }
                    *default.get_or_insert_with(|| {
                        scene.materials.push(Material::diffuse("default", Vec3::splat(0.5)));
                        scene.materials.len() - 1
                    })
                }
            };
            let corners = &group.corners;
            let place = match self.objects[object].as_str() {
                "" => format!("material {name:?}"),
                object => format!("object {object:?}"),
            };
            budget
                .take(corners.len() as u64, group.triangles.len() as u64, 1)
                .map_err(|problem| self.source.too_large(&place, problem))?;
            let mut mesh = Mesh {
                name: if self.objects[object].is_empty() { "mesh".into() } else { self.objects[object].clone() },
                positions: corners.iter().map(|corner| self.positions[corner.0 as usize]).collect(),
                triangles: group.triangles,
                material,
                ..Mesh::default()
            };
            if has_uv {
                mesh.uv0 = corners.iter().filter_map(|corner| Some(self.uvs[corner.1? as usize])).collect();
            }
            if has_normal {
                mesh.normals = corners.iter().filter_map(|corner| Some(self.normals[corner.2? as usize])).collect();
            }
            if !self.colors.is_empty() {
                let color = |corner: &Corner| -> Vec4 { self.colors[corner.0 as usize].extend(1.0) };
                mesh.colors = corners.iter().map(color).collect();
            }
            // In the file's own numbering, before `clean` finds it in the mesh's.
            if let Some(corner) = corners.iter().find(|corner| !self.positions[corner.0 as usize].is_finite()) {
                let n = corner.0 + 1;
                return Err(self.source.invalid(format!("vertex {n}"), "is not finite"));
            }
            geometry::clean(&mut mesh, &place, self.warnings).map_err(|problem| self.source.invalid(place, problem))?;
            if !mesh.triangles.is_empty() {
                scene.meshes.push(mesh.into());
            }
        }
        Ok(scene)
    }
}

/// Up to six numbers, and how many there were.
fn numbers(value: &str) -> Result<([f32; 6], usize), String> {
    let mut numbers = [0.0; 6];
    let mut n = 0;
    for (slot, word) in numbers.iter_mut().zip(value.split_whitespace()) {
        *slot = word.parse().map_err(|_| format!("{word:.40?} is not a number"))?;
        n += 1;
    }
    if n == 0 { Err("no number".into()) } else { Ok((numbers, n)) }
}

/// An index as written, from 1 or from the end, to an index from 0.
fn resolve(text: &str, what: &str, n: usize) -> Result<u32, String> {
    let index: i64 = text.parse().map_err(|_| format!("{text:.40?} is not an index"))?;
    let found = match index {
        1.. => index - 1,
        _ => n as i64 + index,
    };
    match u32::try_from(found) {
        Ok(found) if index != 0 && (found as usize) < n => Ok(found),
        _ => Err(format!("{what} {index} of {n}")),
    }
}

fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}
