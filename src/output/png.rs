//! 8-bit sRGB PNG, to look at.

use std::io::{self, Write};
use std::path::Path;

use super::tonemap::{ToneMap, automatic_exposure, srgb_encode};
use super::{Error, Picture, VERSION, atomic};

/// How a picture is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Look {
    /// Stops; automatic if none ([`automatic_exposure`]).
    pub exposure: Option<f32>,
    /// Tone curve.
    pub tonemap: ToneMap,
}

/// Writes the part of the picture that is there; the file is only as large as that part.
pub fn write(path: &Path, picture: &Picture, look: &Look) -> Result<(), Error> {
    atomic::write(path, |writer| encode(writer, picture, look))
}

fn encode(writer: impl Write, picture: &Picture, look: &Look) -> io::Result<()> {
    let [width, height] = picture.crop_size();
    let exposure = look.exposure.unwrap_or_else(|| automatic_exposure(&picture.rgb));
    let mut encoder = ::png::Encoder::new(writer, width as u32, height as u32);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Software".to_owned(), format!("Sunfleck {VERSION}"))?;
    encoder.add_text_chunk("Comment".to_owned(), format!("exposure {exposure:.3} stops, {:?}", look.tonemap))?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels(picture, exposure, look.tonemap))?;
    writer.finish()?;
    Ok(())
}

/// 8-bit sRGB, three bytes a pixel. An ordered dither of one level breaks up bands; where a pixel falls in its pattern
/// depends on its place in the whole picture, so a crop is the same as the part of the whole.
pub fn pixels(picture: &Picture, exposure: f32, tonemap: ToneMap) -> Vec<u8> {
    let scale = exposure.exp2();
    let [width, _] = picture.crop_size();
    let mut bytes = Vec::with_capacity(picture.rgb.len() * 3);
    for (i, rgb) in picture.rgb.iter().enumerate() {
        let threshold = bayer(picture.crop[0] as usize + i % width, picture.crop[1] as usize + i / width);
        bytes.extend(tonemap.apply(rgb.map(|c| c * scale)).map(|c| (srgb_encode(c) * 255.0 + threshold) as u8));
    }
    bytes
}

/// Bayer's 8×8 matrix, (0, 1), mean ½: bits of x ⊕ y and y, interleaved and reversed.
fn bayer(x: usize, y: usize) -> f32 {
    let mut rank = 0;
    for bit in 0..3 {
        rank = rank << 2 | ((x ^ y) >> bit & 1) << 1 | y >> bit & 1;
    }
    (rank as f32 + 0.5) / 64.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dither_has_each_rank_once() {
        let mut ranks: Vec<_> = (0..64).map(|i| (bayer(i % 8, i / 8) * 64.0) as u32).collect();
        ranks.sort();
        assert_eq!(ranks, (0..64).collect::<Vec<_>>());
    }

    #[test]
    fn levels_average_to_the_value_and_ends_are_exact() {
        for (value, mean) in [(0.0, 0.0), (1.0, 255.0), (0.5, 255.0 * f64::from(srgb_encode(0.5)))] {
            let picture = Picture { size: [8, 8], crop: [0, 0, 8, 8], rgb: vec![[value; 3]; 64], variance: None };
            let bytes = pixels(&picture, 0.0, ToneMap::Srgb);
            let average = bytes.iter().map(|&b| f64::from(b)).sum::<f64>() / bytes.len() as f64;
            assert!((average - mean).abs() < 0.01, "{value}: {average}");
        }
    }

    #[test]
    fn a_file_reads_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        let picture = Picture {
            size: [10, 10],
            crop: [2, 3, 5, 5],
            rgb: (0..6).map(|i| [i as f32 / 5.0, 0.5, 0.0]).collect(),
            variance: None,
        };
        let look = Look { exposure: Some(0.0), tonemap: ToneMap::Srgb };
        write(&path, &picture, &look).unwrap();
        let decoder = ::png::Decoder::new(io::BufReader::new(std::fs::File::open(&path).unwrap()));
        let mut reader = decoder.read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), (3, 2));
        assert!(reader.info().srgb.is_some());
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        assert_eq!(bytes, pixels(&picture, 0.0, ToneMap::Srgb));
    }
}
