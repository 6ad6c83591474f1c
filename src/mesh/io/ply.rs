//! Meshes as PLY.

use std::io::BufRead;

use ply_rs_bw::ply::{Encoding, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType};

use super::{Loaded, check_index};
use crate::files::ply;

const POSITION: [&str; 3] = ["x", "y", "z"];
/// Both are in use.
const CORNERS: [&str; 2] = ["vertex_indices", "vertex_index"];

#[derive(Default)]
struct Vertex([f64; 3]);

impl Vertex {
    fn set(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        match POSITION.iter().position(|n| *n == name) {
            Some(axis) => self.0[axis] = value,
            None => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into())
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value)
    }
}

#[derive(Default)]
struct Face(Vec<i64>);

impl Face {
    fn set<T: Into<i64>>(&mut self, name: &str, value: Vec<T>) -> PropertyAccessResult {
        if !CORNERS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = value.into_iter().map(T::into).collect();
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }
    fn set_list_char(&mut self, name: &str, value: Vec<i8>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_uchar(&mut self, name: &str, value: Vec<u8>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_short(&mut self, name: &str, value: Vec<i16>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_ushort(&mut self, name: &str, value: Vec<u16>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_int(&mut self, name: &str, value: Vec<i32>) -> PropertyAccessResult {
        self.set(name, value)
    }
    fn set_list_uint(&mut self, name: &str, value: Vec<u32>) -> PropertyAccessResult {
        self.set(name, value)
    }
}

/// Reads the elements `vertex` (x, y, z) and `face` (a list `vertex_indices` or `vertex_index`) of a PLY of `size` bytes, as
/// text or binary of either byte order. Other properties and elements are passed over. The error says which line, vertex or
/// face.
pub fn read_ply(input: impl BufRead, size: u64) -> Result<Loaded, String> {
    let (header, mut reader) = ply::read_header(input)?;
    let element = |name: &str| header.elements.get(name).ok_or(format!("the header has no element {name}"));
    let (vertex, face) = (element("vertex")?, element("face")?);
    if !POSITION.iter().all(|n| matches!(vertex.properties.get(*n), Some(p) if ply::is_scalar(p))) {
        return Err("the header's element vertex lacks a property x, y or z".into());
    }
    let is_list = |name: &&&str| {
        let property = face.properties.get(**name as &str).map(|p| &p.data_type);
        matches!(property, Some(PropertyType::List(_, t)) if !matches!(t, ScalarType::Float | ScalarType::Double))
    };
    if CORNERS.iter().filter(is_list).count() != 1 {
        return Err("the header's element face has not one list of whole numbers vertex_indices or vertex_index".into());
    }
    let mut loaded = Loaded::default();
    let mut faces: Vec<Face> = Vec::new();
    for element in header.elements.values() {
        ply::check_count(element, header.encoding == Encoding::Ascii, size)?;
        match element.name.as_str() {
            "vertex" => {
                let vertices: Vec<Vertex> = ply::rows(&mut reader, element, &header, "vertex")?;
                for (i, Vertex(p)) in vertices.into_iter().enumerate() {
                    loaded.vertex(p).map_err(|problem| format!("vertex {i}: {problem}"))?;
                }
            }
            "face" => faces = ply::rows(&mut reader, element, &header, "face")?,
            _ => ply::skip(&mut reader, element, &header)?,
        }
    }
    let n = loaded.mesh.vertices.len();
    for (i, Face(corners)) in faces.into_iter().enumerate() {
        let corners: Result<Vec<u32>, String> = corners.into_iter().map(|index| check_index(index, n)).collect();
        corners.and_then(|corners| loaded.polygon(&corners)).map_err(|problem| format!("face {i}: {problem}"))?;
    }
    Ok(loaded)
}
