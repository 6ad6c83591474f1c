//! Environment maps: Radiance `.hdr` and OpenEXR, latitude-longitude.

use super::{LoadError, files};
use crate::files::exr;
use crate::scene::Environment;
use glam::Vec3;
use image::{ImageError, ImageFormat, ImageReader, Limits};
use std::f64::consts::PI;
use std::io::{Cursor, ErrorKind};
use std::path::Path;

/// Texels kept, at most: what a renderer can tell apart, and a table to sample from that stays small.
const MAX_SIZE: [usize; 2] = [2048, 1024];
/// Bytes of an environment's file, at most.
const MAX_ENVIRONMENT_BYTES: u64 = 1 << 30;
/// Width and height in the file, at most.
const MAX_SIDE: usize = 32_768;
/// Texels in the file, at most.
const MAX_FILE_TEXELS: usize = 1 << 28;
/// Bytes of decoded Radiance data, at most.
const MAX_HDR_BYTES: u64 = 2 << 30;
/// Bytes of the blocks of an OpenEXR file that are decoded at once, at most.
const MAX_BLOCK_BYTES: usize = 256 << 20;
/// Brighter texels are taken as this bright, so that sums stay finite.
const MAX_RADIANCE: f32 = 1e20;

/// Reads a `.hdr` or `.exr` file, told apart by content; with it come warnings for the user.
///
/// An `.exr` has `R`, `G` and `B`, plain or of a layer, as in `Combined.R`, or `Y` as grey. Its map is the data window, in
/// whatever display window, as OpenEXR's own `LatLongMap` has it.
///
/// Larger maps are averaged down to 2048 × 1024, weighted by solid angle, so that the light they bring stays the same.
pub fn load_environment(path: &Path) -> Result<(Environment, Vec<String>), LoadError> {
    let bytes = files::read_regular(path, MAX_ENVIRONMENT_BYTES)
        .map_err(|problem| LoadError::Unreadable { file: path.into(), problem })?;
    let format = |problem: String| LoadError::Format { file: path.into(), problem };
    let map = if bytes.starts_with(b"#?") {
        read_hdr(&bytes).map_err(format)?
    } else if bytes.starts_with(&exr::MAGIC) {
        read_exr(&bytes).map_err(format)?
    } else {
        return Err(format("is neither Radiance (.hdr) nor OpenEXR (.exr)".into()));
    };
    let mut warnings = Vec::new();
    if map.n_invalid > 0 {
        warnings.push(format!(
            "{}: {} texels that are negative or not finite are taken as black",
            path.display(),
            map.n_invalid
        ));
    }
    let (n_columns, n_rows) = (map.columns.len(), map.rows.len());
    if n_columns * n_rows > 1 && n_columns.abs_diff(2 * n_rows) * 50 > n_columns {
        warnings.push(format!(
            "{}: {n_columns} × {n_rows} texels are stretched over the sphere: a map of all directions is twice as wide as high",
            path.display()
        ));
    }
    let [width, height] = map.size.map(|n| n as u32);
    Ok((
        Environment { width, height, texels: map.texels.into(), rotation: 0.0, strength: 1.0, tint: Vec3::ONE },
        warnings,
    ))
}

fn read_hdr(bytes: &[u8]) -> Result<Downsampled, String> {
    let reader = || {
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_SIDE as u32);
        limits.max_image_height = Some(MAX_SIDE as u32);
        limits.max_alloc = Some(MAX_HDR_BYTES);
        let mut reader = ImageReader::with_format(Cursor::new(bytes), ImageFormat::Hdr);
        reader.limits(limits);
        reader
    };
    let problem = |error: ImageError| match error {
        ImageError::IoError(error) if error.kind() == ErrorKind::UnexpectedEof => "is cut off".to_owned(),
        error => error.to_string(),
    };
    let (width, height) = reader().into_dimensions().map_err(problem)?;
    let mut map = Downsampled::new(width as usize, height as usize)?;
    let decoded = reader().decode().map_err(problem)?.into_rgb32f();
    for (x, y, pixel) in decoded.enumerate_pixels() {
        map.add(x as usize, y as usize, pixel.0);
    }
    Ok(map)
}

fn read_exr(bytes: &[u8]) -> Result<Downsampled, String> {
    let limits = exr::Limits { size: check_size, block_bytes: MAX_BLOCK_BYTES };
    let image = exr::Image::open(Cursor::new(bytes), &limits)?;
    let size = image.header().layer_size;
    let mut map = Downsampled::new(size.0, size.1)?;
    image.decode(|[x, y], rgb| map.add(x, y, rgb))?;
    Ok(map)
}

fn check_size(width: usize, height: usize) -> Result<(), String> {
    if width == 0 || height == 0 {
        return Err("the environment is empty".into());
    }
    if width > MAX_SIDE || height > MAX_SIDE || width * height > MAX_FILE_TEXELS {
        return Err(format!("an environment of {width} × {height} is too large: at most {MAX_FILE_TEXELS} texels"));
    }
    Ok(())
}

/// A map that texels are added to in any order.
struct Downsampled {
    size: [usize; 2],
    texels: Vec<Vec3>,
    columns: Vec<Share>,
    rows: Vec<Share>,
    n_invalid: u64,
}

/// Where a row or column of the file goes: what it weighs in the mean at `first`, and at `first + 1`.
#[derive(Clone, Copy)]
struct Share {
    first: usize,
    weights: [f32; 2],
}

impl Downsampled {
    fn new(width: usize, height: usize) -> Result<Self, String> {
        check_size(width, height)?;
        let size = [width.min(MAX_SIZE[0]), height.min(MAX_SIZE[1])];
        Ok(Self {
            size,
            texels: vec![Vec3::ZERO; size[0] * size[1]],
            columns: shares(width, size[0], |u| u),
            // The area of a zone of the sphere goes with the cosine of its polar angle.
            rows: shares(height, size[1], |v| -(v * PI).cos()),
            n_invalid: 0,
        })
    }

    fn add(&mut self, x: usize, y: usize, rgb: [f32; 3]) {
        let (Some(column), Some(row)) = (self.columns.get(x), self.rows.get(y)) else { return };
        let valid = |c: f32| c.is_finite() && c >= 0.0;
        self.n_invalid += u64::from(!rgb.into_iter().all(valid));
        let radiance = Vec3::from(rgb.map(|c| if valid(c) { c.min(MAX_RADIANCE) } else { 0.0 }));
        for (j, row_weight) in row.weights.into_iter().enumerate() {
            for (i, column_weight) in column.weights.into_iter().enumerate() {
                let weight = row_weight * column_weight;
                if weight > 0.0 {
                    self.texels[(row.first + j) * self.size[0] + column.first + i] += radiance * weight;
                }
            }
        }
    }
}

/// The shares of `from` rows or columns in `to` ≤ `from` of them, measured by the increasing function `measure` of
/// [0, 1].
fn shares(from: usize, to: usize, measure: impl Fn(f64) -> f64) -> Vec<Share> {
    let overlap = |i: usize, j: usize| {
        // In units of 1/(from·to), exact.
        let start = (i * to).max(j * from);
        let end = ((i + 1) * to).min((j + 1) * from);
        if j >= to || start >= end {
            return 0.0;
        }
        let measure = |numerator: usize| measure(numerator as f64 / (from * to) as f64);
        let whole = measure((j + 1) * from) - measure(j * from);
        ((measure(end) - measure(start)) / whole) as f32
    };
    (0..from)
        .map(|i| {
            let first = i * to / from;
            Share { first, weights: [overlap(i, first), overlap(i, first + 1)] }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solid_angle(row: usize, height: usize) -> f64 {
        let edge = |row: usize| (row as f64 / height as f64 * PI).cos();
        edge(row) - edge(row + 1)
    }

    #[test]
    fn downsampling_keeps_the_light() {
        let (width, height) = (3000, 1500);
        let mut map = Downsampled::new(width, height).unwrap();
        let value = |x: usize, y: usize| ((x * 7 + y * 13) % 11) as f32;
        let mut before = 0.0;
        for y in 0..height {
            for x in 0..width {
                map.add(x, y, [value(x, y); 3]);
                before += f64::from(value(x, y)) * solid_angle(y, height) / width as f64;
            }
        }
        assert_eq!(map.size, MAX_SIZE);
        let after: f64 = map
            .texels
            .iter()
            .enumerate()
            .map(|(i, texel)| f64::from(texel.x) * solid_angle(i / map.size[0], map.size[1]) / map.size[0] as f64)
            .sum();
        assert!((after / before - 1.0).abs() < 1e-5, "{before} {after}");
    }

    #[test]
    fn a_small_map_is_kept_bit_for_bit_and_bad_texels_are_black() {
        let mut map = Downsampled::new(3, 2).unwrap();
        map.add(0, 0, [0.1, 0.2, 0.3]);
        map.add(2, 1, [f32::NAN, -1.0, 7.0]);
        assert_eq!(map.texels[0], Vec3::new(0.1, 0.2, 0.3));
        assert_eq!((map.texels[5], map.n_invalid), (Vec3::new(0.0, 0.0, 7.0), 1));
    }
}
