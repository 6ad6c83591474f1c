//! Clouds as PLY.

use std::io::{BufRead, Write};

use glam::{DVec3, Vec3};
use ply_rs_bw::ply::{
    Addable, ElementDef, Encoding, Header, PropertyAccess, PropertyAccessResult, PropertyDef, PropertyType, ScalarType,
};
use ply_rs_bw::writer::Writer;

use super::text::position;
use crate::files::ply;
use crate::points::{Cloud, Match, Precision};

const POSITION: [&str; 3] = ["x", "y", "z"];
const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
const COLOUR: [&str; 4] = ["red", "green", "blue", "alpha"];

/// One vertex.
#[derive(Clone, Copy, Default)]
struct Row {
    position: [f64; 3],
    normal: [f32; 3],
    colour: [u8; 4],
    /// Index of the match, −1 for none.
    nearest: i32,
    /// Its distance, −1 for none.
    distance: f64,
}

impl Row {
    /// `full`: the value that stands for a colour of 1.
    fn set(&mut self, name: &str, value: f64, full: f64) -> PropertyAccessResult {
        let byte = |value: f64| (value / full * 255.0).round().clamp(0.0, 255.0) as u8;
        let at = |names: &[&str]| names.iter().position(|n| *n == name);
        if let Some(axis) = at(&POSITION) {
            self.position[axis] = value;
        } else if let Some(axis) = at(&NORMAL) {
            self.normal[axis] = value as f32;
        } else if let Some(channel) = at(&COLOUR) {
            self.colour[channel] = byte(value);
        } else {
            return PropertyAccessResult::Ignored;
        }
        PropertyAccessResult::Set
    }
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self { colour: [0, 0, 0, 255], ..Self::default() }
    }
    fn set_char(&mut self, name: &str, value: i8) -> PropertyAccessResult {
        self.set(name, value.into(), i8::MAX.into())
    }
    fn set_uchar(&mut self, name: &str, value: u8) -> PropertyAccessResult {
        self.set(name, value.into(), u8::MAX.into())
    }
    fn set_short(&mut self, name: &str, value: i16) -> PropertyAccessResult {
        self.set(name, value.into(), i16::MAX.into())
    }
    fn set_ushort(&mut self, name: &str, value: u16) -> PropertyAccessResult {
        self.set(name, value.into(), u16::MAX.into())
    }
    fn set_int(&mut self, name: &str, value: i32) -> PropertyAccessResult {
        self.set(name, value.into(), u8::MAX.into())
    }
    fn set_uint(&mut self, name: &str, value: u32) -> PropertyAccessResult {
        self.set(name, value.into(), u8::MAX.into())
    }
    fn set_float(&mut self, name: &str, value: f32) -> PropertyAccessResult {
        self.set(name, value.into(), 1.0)
    }
    fn set_double(&mut self, name: &str, value: f64) -> PropertyAccessResult {
        self.set(name, value, 1.0)
    }
    fn get_uchar(&self, name: &str) -> Option<u8> {
        COLOUR.iter().position(|n| *n == name).map(|channel| self.colour[channel])
    }
    fn get_int(&self, _: &str) -> Option<i32> {
        Some(self.nearest)
    }
    fn get_float(&self, name: &str) -> Option<f32> {
        match NORMAL.iter().position(|n| *n == name) {
            Some(axis) => Some(self.normal[axis]),
            None => self.get_double(name).map(|value| value as f32),
        }
    }
    fn get_double(&self, name: &str) -> Option<f64> {
        Some(POSITION.iter().position(|n| *n == name).map_or(self.distance, |axis| self.position[axis]))
    }
}

/// Reads the `vertex` element of a PLY of `size` bytes: x, y, z, and nx, ny, nz and red, green, blue, alpha if they are
/// there. Other properties and elements are left out. The error says which line or vertex.
pub fn read_ply(input: impl BufRead, size: u64) -> Result<Cloud, String> {
    let (header, mut reader) = ply::read_header(input)?;
    let vertex = header.elements.get("vertex").ok_or("the header has no element vertex")?;
    let has = |names: &[&str]| names.iter().all(|n| matches!(vertex.properties.get(*n), Some(p) if ply::is_scalar(p)));
    if !has(&POSITION) {
        return Err("the header's element vertex lacks a property x, y or z".into());
    }
    let is_ascii = header.encoding == Encoding::Ascii;
    for element in header.elements.values() {
        ply::check_count(element, is_ascii, size)?;
        if element.name == "vertex" {
            break;
        }
        ply::skip(&mut reader, element, &header)?;
    }
    let rows: Vec<Row> = ply::rows(&mut reader, vertex, &header, "vertex")?;
    let mut positions = Vec::with_capacity(rows.len());
    for (i, row) in rows.iter().enumerate() {
        positions.push(position(row.position).map_err(|problem| format!("vertex {i}: {problem}"))?);
    }
    let unit = |row: &Row| Vec3::from_array(row.normal).normalize_or_zero();
    let is_double = |n: &str| matches!(vertex.properties.get(n), Some(p) if !is_exact_in_f32(p));
    Ok(Cloud {
        positions,
        normals: has(&NORMAL).then(|| rows.iter().map(unit).collect()),
        colours: has(&COLOUR[..3]).then(|| rows.iter().map(|row| row.colour).collect()),
        precision: if POSITION.iter().any(|n| is_double(n)) { Precision::Double } else { Precision::Single },
    })
}

fn is_exact_in_f32(property: &PropertyDef) -> bool {
    use ScalarType::{Double, Int, UInt};
    !matches!(property.data_type, PropertyType::Scalar(Double | Int | UInt))
}

/// Writes binary little-endian PLY: positions as the cloud's precision says, then normals and colours if it has them, and
/// `matches`, one for each point, as `int match` and `double distance`, −1 both for none.
///
/// # Panics
/// If there are not as many normals, colours or matches as points.
pub fn write_ply(out: &mut impl Write, cloud: &Cloud, matches: Option<&[Match]>) -> std::io::Result<()> {
    let lengths = [cloud.normals.as_ref().map(Vec::len), cloud.colours.as_ref().map(Vec::len), matches.map(<[_]>::len)];
    assert!(lengths.into_iter().flatten().all(|n| n == cloud.len()), "{lengths:?} of {} points", cloud.len());
    let mut vertex = ElementDef::new("vertex".into());
    vertex.count = cloud.len();
    let mut add = |names: &[&str], scalar: ScalarType| {
        for name in names {
            vertex.properties.add(PropertyDef::new((*name).into(), PropertyType::Scalar(scalar.clone())));
        }
    };
    match cloud.precision {
        Precision::Single => add(&POSITION, ScalarType::Float),
        Precision::Double => add(&POSITION, ScalarType::Double),
    }
    if cloud.normals.is_some() {
        add(&NORMAL, ScalarType::Float);
    }
    let alpha = cloud.colours.iter().flatten().any(|c| c[3] != 255);
    if cloud.colours.is_some() {
        add(if alpha { &COLOUR } else { &COLOUR[..3] }, ScalarType::UChar);
    }
    if matches.is_some() {
        add(&["match"], ScalarType::Int);
        add(&["distance"], ScalarType::Double);
    }
    let mut header = Header::new();
    header.encoding = Encoding::BinaryLittleEndian;
    header.comments.push("written by sunfleck".into());
    header.elements.add(vertex.clone());
    let writer = Writer::<Row>::new();
    writer.write_header(out, &header)?;
    let at = |position: &DVec3| position.to_array();
    for (i, position) in cloud.positions.iter().enumerate() {
        let found = matches.map(|m| m[i]).filter(Match::is_some);
        let row = Row {
            position: at(position),
            normal: cloud.normals.as_ref().map_or([0.0; 3], |n| n[i].to_array()),
            colour: cloud.colours.as_ref().map_or([0; 4], |c| c[i]),
            nearest: found.map_or(-1, |m| m.index as i32),
            distance: found.map_or(-1.0, |m| m.distance),
        };
        writer.write_little_endian_element(out, &row, &vertex)?;
    }
    Ok(())
}
