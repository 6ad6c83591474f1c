//! 8-bit sRGB PNG, to look at.

use std::io::{self, Write};
use std::path::Path;

use super::display::rgb8;
use super::{Error, Picture, VERSION, atomic};

pub use super::display::Look;

/// Writes the part of the picture that is there; the file is only as large as that part.
pub fn write(path: &Path, picture: &Picture, look: &Look) -> Result<(), Error> {
    atomic::write(path, |writer| encode(writer, picture, look))
}

fn encode(writer: impl Write, picture: &Picture, look: &Look) -> io::Result<()> {
    let [width, height] = picture.crop_size();
    let exposure = look.exposure_of(&picture.rgb);
    let mut encoder = ::png::Encoder::new(writer, width as u32, height as u32);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Software".to_owned(), format!("Sunfleck {VERSION}"))?;
    encoder.add_text_chunk("Comment".to_owned(), format!("exposure {exposure:.3} stops, {:?}", look.tonemap))?;
    let mut writer = encoder.write_header()?;
    let mut bytes = Vec::new();
    rgb8(picture, exposure, look.tonemap, &mut bytes);
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::super::tonemap::ToneMap;
    use super::*;

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
        let mut expected = Vec::new();
        rgb8(&picture, 0.0, ToneMap::Srgb, &mut expected);
        assert_eq!(bytes, expected);
    }
}
