//! Decoding of textures, bounded in size and in total.

use super::files::Source;
use super::{LoadError, MAX_DECODE_BYTES, MAX_FILE_BYTES, MAX_IMAGE_SIDE, MAX_TEXELS};
use crate::scene::Image;
use image::{ImageFormat, ImageReader, Limits};
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Cursor;

/// Images to decode, in the order of the scene's.
pub(super) struct ImageTable<'a> {
    entries: Vec<Entry<'a>>,
    indices: HashMap<String, usize>,
    bytes_left: u64,
}

/// An encoded image.
pub(super) struct Entry<'a> {
    /// For messages.
    pub(super) name: String,
    /// Field or line that names the image.
    pub(super) place: String,
    /// File, if any: says the format where the content does not (TGA).
    pub(super) file: String,
    pub(super) bytes: Cow<'a, [u8]>,
}

impl<'a> ImageTable<'a> {
    pub(super) fn new() -> Self {
        Self { entries: Vec::new(), indices: HashMap::new(), bytes_left: MAX_FILE_BYTES }
    }

    /// The index of the image entered under `key`.
    pub(super) fn find(&self, key: &str) -> Option<usize> {
        self.indices.get(key).copied()
    }

    /// Enters an image under `key` and returns its index.
    pub(super) fn insert(&mut self, source: &Source, key: String, entry: Entry<'a>) -> Result<usize, LoadError> {
        self.bytes_left = self.bytes_left.checked_sub(entry.bytes.len() as u64).ok_or_else(|| {
            source.too_large(&entry.place, format!("the image files exceed {} MiB together", MAX_FILE_BYTES >> 20))
        })?;
        self.indices.insert(key, self.entries.len());
        self.entries.push(entry);
        Ok(self.entries.len() - 1)
    }

    /// Decodes all images.
    pub(super) fn decode(self, source: &Source) -> Result<Vec<Image>, LoadError> {
        let mut left = MAX_TEXELS;
        for entry in &self.entries {
            let (width, height) = entry.size().map_err(|problem| entry.error(source, problem))?;
            left = left.checked_sub(u64::from(width) * u64::from(height)).ok_or_else(|| {
                source.too_large(&entry.place, format!("the images have more than {MAX_TEXELS} texels together"))
            })?;
        }
        // The bytes of an image are dropped as soon as it is decoded.
        let decode = |entry: Entry| {
            source.go_on()?;
            entry.decode().map_err(|problem| entry.error(source, problem))
        };
        self.entries.into_par_iter().map(decode).collect()
    }
}

impl Entry<'_> {
    fn error(&self, source: &Source, problem: String) -> LoadError {
        if self.file.is_empty() {
            source.invalid(&self.place, problem)
        } else {
            source.external(&self.place, &self.file, problem)
        }
    }

    fn reader(&self) -> Result<ImageReader<Cursor<&[u8]>>, String> {
        let mut reader = ImageReader::new(Cursor::new(&self.bytes[..]));
        // By content, and by name only for the format that cannot be told by its content.
        let format = image::guess_format(&self.bytes)
            .ok()
            .or_else(|| ImageFormat::from_path(&self.file).ok().filter(|&format| format == ImageFormat::Tga));
        match format {
            Some(
                f @ (ImageFormat::Png | ImageFormat::Jpeg | ImageFormat::WebP | ImageFormat::Bmp | ImageFormat::Tga),
            ) => reader.set_format(f),
            _ => return Err("is not an image in PNG, JPEG, WebP, BMP or TGA format".into()),
        }
        let mut limits = Limits::default();
        limits.max_image_width = Some(MAX_IMAGE_SIDE);
        limits.max_image_height = Some(MAX_IMAGE_SIDE);
        limits.max_alloc = Some(MAX_DECODE_BYTES);
        reader.limits(limits);
        Ok(reader)
    }

    fn size(&self) -> Result<(u32, u32), String> {
        let (width, height) = self.reader()?.into_dimensions().map_err(|e| e.to_string())?;
        if width == 0 || height == 0 || width > MAX_IMAGE_SIDE || height > MAX_IMAGE_SIDE {
            return Err(format!("an image of {width} × {height} is not within {MAX_IMAGE_SIDE} × {MAX_IMAGE_SIDE}"));
        }
        Ok((width, height))
    }

    fn decode(&self) -> Result<Image, String> {
        let decoded = self.reader()?.decode().map_err(|e| e.to_string())?.into_rgba8();
        let (width, height) = decoded.dimensions();
        let texels = decoded.into_raw().as_chunks().0.to_vec();
        Ok(Image { name: self.name.clone(), width, height, texels })
    }
}
