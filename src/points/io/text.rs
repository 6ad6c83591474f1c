//! Clouds as text: XYZ and the vertices of OBJ.

use std::io::BufRead;

use glam::{DVec3, Vec3};

use crate::files::{lines, number};
use crate::points::cloud::MAX_COORDINATE;
use crate::points::{Cloud, Precision};

/// Three columns behind the position are normals if their lengths are this near to 1.
const UNIT_LENGTH: f64 = 0.05;

/// XYZ: a point a line, 3 or 6 columns between blanks, commas or semicolons; `#` and `//` begin comments.
/// They may be in any encoding that keeps ASCII, and of any length.
///
/// Columns 4 to 6 are normals if all are of unit length or zero, colours if all are whole numbers from 0 to 255. The
/// error says which line.
pub fn read_xyz(input: impl BufRead) -> Result<Cloud, String> {
    let (mut positions, mut rest) = (Vec::new(), Vec::new());
    let mut columns = None;
    let data = |line: &[u8]| {
        let comment = |i: &usize| line[*i] == b'#' || line[*i..].starts_with(b"//");
        (0..line.len()).find(comment).unwrap_or(line.len())
    };
    lines(input, data, |line| {
        let words = line.split([' ', '\t', ',', ';', '\r']).filter(|w| !w.is_empty());
        let mut row = [0.0; 6];
        let mut n = 0;
        for word in words {
            *row.get_mut(n).ok_or("more than 6 columns")? = number(word)?;
            n += 1;
        }
        if n == 0 {
            return Ok(());
        }
        if !matches!(n, 3 | 6) {
            return Err(format!("{n} columns, not 3 or 6"));
        }
        if *columns.get_or_insert(n) != n {
            return Err(format!("{n} columns, unlike the lines before"));
        }
        positions.push(position([row[0], row[1], row[2]])?);
        if n == 6 {
            rest.push(DVec3::new(row[3], row[4], row[5]));
        }
        Ok(())
    })?;
    let mut cloud = Cloud { positions, precision: Precision::Double, ..Cloud::default() };
    let is_normal = |v: &DVec3| (v.length() - 1.0).abs() <= UNIT_LENGTH || *v == DVec3::ZERO;
    let is_colour = |v: &DVec3| v.to_array().iter().all(|c| (0.0..=255.0).contains(c) && c.fract() == 0.0);
    if rest.is_empty() {
    } else if rest.iter().all(is_normal) {
        cloud.normals = Some(rest.iter().map(|n| n.normalize_or_zero().as_vec3()).collect());
    } else if rest.iter().all(is_colour) {
        cloud.colours = Some(rest.iter().map(|c| [c.x as u8, c.y as u8, c.z as u8, 255]).collect());
    } else {
        return Err("columns 4 to 6 are neither unit normals nor colours from 0 to 255".into());
    }
    Ok(cloud)
}

/// OBJ: the `v` lines, with their colours (`v x y z r g b`, 0 … 1) if all have them, up to a `#`; nothing else is looked
/// at, so that other lines may be of any length and in any encoding that keeps ASCII.
pub fn read_obj(input: impl BufRead) -> Result<Cloud, String> {
    let (mut positions, mut colours) = (Vec::new(), Vec::new());
    let vertex = |line: &[u8]| match line.trim_ascii_start() {
        [b'v', rest @ ..] if rest.first().is_none_or(u8::is_ascii_whitespace) => {
            line.iter().position(|b| *b == b'#').unwrap_or(line.len())
        }
        _ => 0,
    };
    lines(input, vertex, |line| {
        let mut words = line.split_ascii_whitespace();
        if words.next().is_none() {
            return Ok(());
        }
        let mut row = [0.0; 7];
        let mut n = 0;
        for word in words {
            *row.get_mut(n).ok_or("a vertex of more than 7 numbers")? = number(word)?;
            n += 1;
        }
        if n < 3 {
            return Err(format!("a vertex of {n} numbers"));
        }
        positions.push(position([row[0], row[1], row[2]])?);
        if n >= 6 {
            let byte = |c: f64| (c.clamp(0.0, 1.0) * 255.0).round() as u8;
            colours.push([byte(row[n - 3]), byte(row[n - 2]), byte(row[n - 1]), 255]);
        }
        Ok(())
    })?;
    let colours = (!colours.is_empty() && colours.len() == positions.len()).then_some(colours);
    Ok(Cloud { positions, normals: None::<Vec<Vec3>>, colours, precision: Precision::Double })
}

pub(super) fn position(p: [f64; 3]) -> Result<DVec3, String> {
    match p.iter().position(|c| c.is_nan() || c.abs() > MAX_COORDINATE) {
        Some(axis) => Err(format!("{} is {}", ["x", "y", "z"][axis], p[axis])),
        None => Ok(DVec3::from_array(p)),
    }
}
