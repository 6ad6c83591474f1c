//! Pictures of any program: which of a file's pixels are the picture.

use std::fs::File;
use std::io::{BufReader, ErrorKind, Read};
use std::path::Path;

use ::exr::meta::header::Header;

use crate::files::exr::{Image, Limits, MAGIC};
use crate::output::{Error, Picture};

/// Largest picture that [`read`] takes, pixels: 3 GiB of linear RGB.
pub const MAX_READ_PIXELS: u64 = 1 << 28;
const LIMITS: Limits = Limits { size: check_size, block_bytes: 1 << 30 };

/// Reads a picture in full size, whoever wrote it, as far as it is in the display window. Not from a file with deep data,
/// in whichever part.
///
/// It is in the first part with channels `R`, `G` and `B`. If there is none, it is the one layer that has them, as in
/// `Combined.R`, in either case, or `Y` as grey; of several layers, the one whose name ends in "Combined" or "beauty",
/// which renderers call the sum of their passes.
pub fn read(path: &Path) -> Result<Picture, Error> {
    let image = open(path)?;
    let header = image.header();
    let [x, y, right, bottom] = window(header);
    let display = header.shared_attributes.display_window;
    // Counted from the corner of the display window.
    let columns = Visible::new(x - i64::from(display.position.0), header.layer_size.0, display.size.0);
    let rows = Visible::new(y - i64::from(display.position.1), header.layer_size.1, display.size.1);
    let (Some(columns), Some(rows)) = (columns, rows) else {
        let problem = format!(
            "its data window, ({x}, {y}) to ({right}, {bottom}), is outside of its display window, {}x{} from ({}, {})",
            display.size.0, display.size.1, display.position.0, display.position.1
        );
        return Err(Error::read(path, problem));
    };

    let mut plane = Plane::new(columns, rows);
    image.decode(|at, rgb| plane.set(at, rgb)).map_err(|e| Error::read(path, e))?;
    let size = [display.size.0 as u32, display.size.1 as u32];
    Ok(Picture { size, crop: [columns.from, rows.from, columns.to, rows.to], rgb: plane.rgb, variance: None })
}

/// What part of the plane the file has the picture in, in its own coordinates, whether displayed or not: x0, y0, x1, y1
/// (exclusive).
pub fn data_window(path: &Path) -> Result<[i64; 4], Error> {
    Ok(window(open(path)?.header()))
}

fn open(path: &Path) -> Result<Image<BufReader<File>>, Error> {
    let fail = |reason: &dyn std::fmt::Display| Error::read(path, reason);
    // Before it is opened: opening a pipe would wait for a writer.
    if !std::fs::metadata(path).map_err(|e| fail(&e))?.is_file() {
        return Err(fail(&"not a regular file"));
    }
    let mut file = BufReader::new(File::open(path).map_err(|e| fail(&e))?);
    let mut begin = [0; MAGIC.len()];
    match file.read_exact(&mut begin) {
        Err(e) if e.kind() != ErrorKind::UnexpectedEof => return Err(fail(&e)),
        Ok(()) if begin == MAGIC => {}
        _ => return Err(fail(&"not an OpenEXR file")),
    }
    Image::open(file, &LIMITS).map_err(|e| fail(&e))
}

fn check_size(width: usize, height: usize) -> Result<(), String> {
    let pixels = width as u64 * height as u64;
    if pixels > MAX_READ_PIXELS { Err(format!("{pixels} pixels, more than {MAX_READ_PIXELS}")) } else { Ok(()) }
}

/// The data window: x0, y0, x1, y1 (exclusive).
fn window(header: &Header) -> [i64; 4] {
    let [x, y] = [header.own_attributes.layer_position.0, header.own_attributes.layer_position.1].map(i64::from);
    [x, y, x + header.layer_size.0 as i64, y + header.layer_size.1 as i64]
}

/// Which of the rows or columns of the data window are displayed.
#[derive(Clone, Copy)]
struct Visible {
    /// How many come before them.
    skipped: usize,
    /// Where they are in the display window.
    from: u32,
    /// Exclusive.
    to: u32,
}

impl Visible {
    /// Of `n` from `at` on, in a display window from 0 to `end`.
    fn new(at: i64, n: usize, end: usize) -> Option<Self> {
        let (from, to) = (at.max(0), (at + n as i64).min(end as i64));
        let place = |at: i64| u32::try_from(at).ok();
        (from < to).then_some(Self { skipped: (from - at) as usize, from: place(from)?, to: place(to)? })
    }

    fn len(self) -> usize {
        (self.to - self.from) as usize
    }

    /// Of the data window's `i`-th.
    fn place(self, i: usize) -> Option<usize> {
        i.checked_sub(self.skipped).filter(|&i| i < self.len())
    }
}

struct Plane {
    columns: Visible,
    rows: Visible,
    rgb: Vec<[f32; 3]>,
}

impl Plane {
    fn new(columns: Visible, rows: Visible) -> Self {
        Self { columns, rows, rgb: vec![[0.0; 3]; columns.len() * rows.len()] }
    }

    fn set(&mut self, [x, y]: [usize; 2], rgb: [f32; 3]) {
        if let (Some(x), Some(y)) = (self.columns.place(x), self.rows.place(y)) {
            self.rgb[y * self.columns.len() + x] = rgb;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::meta::attribute::IntegerBounds;
    use ::exr::prelude::{
        AnyChannel, AnyChannels, Compression, Encoding, FlatSamples, Image, ImageAttributes, Layer, LayerAttributes,
        WritableImage, f16,
    };

    type Part = Layer<AnyChannels<FlatSamples>>;

    fn bounds(x: i32, y: i32, width: usize, height: usize) -> IntegerBounds {
        IntegerBounds::new((x, y), (width, height))
    }

    /// What channel number `c` has at a pixel of the plane.
    fn value(c: usize, x: i32, y: i32) -> f32 {
        (1000 * c) as f32 + 30.0 * y as f32 + x as f32
    }

    fn part(name: &str, data: IntegerBounds, channels: &[&str]) -> Part {
        let (right, bottom) = (data.position.0 + data.size.0 as i32, data.position.1 + data.size.1 as i32);
        let channel = |(c, name): (usize, &&str)| {
            let row = |y| (data.position.0..right).map(move |x| value(c, x, y));
            AnyChannel::new(*name, FlatSamples::F32((data.position.1..bottom).flat_map(row).collect()))
        };
        let channels = channels.iter().enumerate().map(channel).collect();
        let attributes = LayerAttributes { layer_position: data.position, ..LayerAttributes::named(name) };
        Layer::new(data.size, attributes, Encoding::FAST_LOSSLESS, AnyChannels::sort(channels))
    }

    fn saved(display: IntegerBounds, parts: impl IntoIterator<Item = Part>) -> tempfile::NamedTempFile {
        let file = tempfile::Builder::new().suffix(".exr").tempfile().unwrap();
        let image = Image::from_layers(ImageAttributes::new(display), parts.into_iter().collect::<Vec<_>>());
        image.write().to_file(file.path()).unwrap();
        file
    }

    /// Of a file whose parts have these channels: the first pixel, or what is wrong.
    fn first(parts: &[&[&str]]) -> Result<[f32; 3], String> {
        let window = bounds(0, 0, 2, 2);
        let parts = parts.iter().enumerate().map(|(i, channels)| part(&format!("part {i}"), window, channels));
        read(saved(window, parts).path()).map(|picture| picture.rgb[0]).map_err(|e| e.to_string())
    }

    #[test]
    fn channels_of_other_renderers() {
        let chosen: [(&[&[&str]], [f32; 3]); 14] = [
            (&[&["R", "G", "B"]], [0.0, 1000.0, 2000.0]),
            (&[&["A", "B", "G", "R", "Z", "diffuse.R", "diffuse.G", "diffuse.B"]], [3000.0, 2000.0, 1000.0]),
            (&[&["r", "g", "b", "a", "albedo.R", "albedo.G", "albedo.B"]], [0.0, 1000.0, 2000.0]),
            // As Blender, Arnold and others name them.
            (
                &[&["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "ViewLayer.Combined.A"]],
                [0.0, 1000.0, 2000.0],
            ),
            (&[&["beauty.r", "beauty.g", "beauty.b", "depth.Z"]], [0.0, 1000.0, 2000.0]),
            (&[&["A.R", "A.G", "A.B", "L.Combined.R", "L.Combined.G", "L.Combined.B"]], [3000.0, 4000.0, 5000.0]),
            (&[&["A.R", "A.G", "A.B", "Main_Beauty.R", "Main_Beauty.G", "Main_Beauty.B"]], [3000.0, 4000.0, 5000.0]),
            (&[&["Y", "Combined.R", "Combined.G", "Combined.B"]], [1000.0, 2000.0, 3000.0]),
            (&[&["Y"]], [0.0; 3]),
            (&[&["A", "y"]], [1000.0; 3]),
            // Parts: the first with the plain names, whatever is before it.
            (&[&["Z"], &["X", "R", "G", "B"]], [1000.0, 2000.0, 3000.0]),
            (&[&["r", "g", "b"], &["X", "R", "G", "B"]], [1000.0, 2000.0, 3000.0]),
            (&[&["N.R", "N.G"], &["Z", "N.R", "N.G", "N.B"], &["N.B", "N.R", "N.G"]], [1000.0, 2000.0, 3000.0]),
            (&[&["R", "G", "B"], &["X", "R", "G", "B"]], [0.0, 1000.0, 2000.0]),
        ];
        for (parts, pixel) in chosen {
            assert_eq!(first(parts), Ok(pixel), "{parts:?}");
        }
        let refused: [(&[&[&str]], &[&str]); 7] = [
            (&[&["Z", "N.X", "N.Y", "N.Z"]], &["no channels R, G and B", "N.X, N.Y, N.Z, Z"]),
            (&[&["R", "G"], &["B"]], &["no channels R, G and B", "G, R, B"]),
            (&[&["BY", "RY", "Y"]], &["no channels R, G and B", "BY, RY, Y"]),
            (&[&["X", "Y", "Z"]], &["no channels R, G and B"]),
            (&[&["b.R", "b.G", "b.B", "a.R", "a.G", "a.B"]], &["several layers", "a, b"]),
            (&[&["Y", "albedo.R", "albedo.G", "albedo.B"]], &["several layers", "Y, albedo"]),
            (
                &[&["1.Combined.R", "1.Combined.G", "1.Combined.B"], &["2.Combined.R", "2.Combined.G", "2.Combined.B"]],
                &["1.Combined, 2.Combined"],
            ),
        ];
        for (parts, words) in refused {
            let error = first(parts).unwrap_err();
            assert!(error.starts_with("cannot read ") && error.contains(".exr: "), "{error}");
            assert!(words.iter().all(|part| error.contains(part)), "{parts:?}: {error}");
        }
        let many: Vec<String> = (0..500).map(|i| format!("{i:0>200}")).collect();
        let error = first(&[&many.iter().map(String::as_str).collect::<Vec<_>>()]).unwrap_err();
        assert!(error.contains("476 more") && error.len() < 1500, "{error}");
    }

    #[test]
    fn only_what_is_displayed_is_read() {
        let display = bounds(0, 0, 20, 10);
        let at = |picture: &Picture, x: i32, y: i32| {
            let [x, y] = [x - picture.crop[0] as i32, y - picture.crop[1] as i32];
            picture.rgb[(y * picture.crop_size()[0] as i32 + x) as usize]
        };
        let windows = [
            (display, bounds(-8, -4, 36, 18), [0, 0, 20, 10]),
            (display, bounds(-8, 0, 36, 10), [0, 0, 20, 10]),
            (display, bounds(-8, -4, 20, 10), [0, 0, 12, 6]),
            (display, bounds(5, 7, 40, 40), [5, 7, 20, 10]),
            (display, bounds(3, 2, 5, 4), [3, 2, 8, 6]),
            // In the display window's own coordinates.
            (bounds(100, -50, 20, 10), bounds(100, -50, 20, 10), [0, 0, 20, 10]),
            (bounds(100, -50, 20, 10), bounds(90, -48, 15, 4), [0, 2, 5, 6]),
        ];
        for (display, data, crop) in windows {
            let file = saved(display, [part("main", data, &["R", "G", "B"])]);
            let picture = read(file.path()).unwrap();
            assert_eq!((picture.size, picture.crop), ([20, 10], crop), "{data:?}");
            let [width, height] = picture.crop_size();
            assert_eq!(picture.rgb.len(), width * height);
            for (x, y) in [(crop[0], crop[1]), (crop[2] - 1, crop[1]), (crop[2] - 1, crop[3] - 1)] {
                let (x, y) = (x as i32, y as i32);
                let expected = [0, 1, 2].map(|c| value(c, x + display.position.0, y + display.position.1));
                assert_eq!(at(&picture, x, y), expected, "{data:?} at ({x}, {y})");
            }
            let [x, y] = [data.position.0, data.position.1].map(i64::from);
            let (right, bottom) = (x + data.size.0 as i64, y + data.size.1 as i64);
            assert_eq!(data_window(file.path()).unwrap(), [x, y, right, bottom]);
        }
        let outside = saved(display, [part("main", bounds(-8, -9, 8, 30), &["R", "G", "B"])]);
        let error = read(outside.path()).unwrap_err().to_string();
        assert!(error.contains("data window, (-8, -9) to (0, 21), is outside of its display window, 20x10"), "{error}");
    }

    #[test]
    fn half_floats_and_compressions() {
        let window = bounds(-3, -3, 40, 40);
        let lossless = [Compression::PIZ, Compression::ZIP16, Compression::PXR24, Compression::RLE].map(|c| (c, 0.0));
        for (compression, error) in lossless.into_iter().chain([(Compression::DWAA(None), 0.02)]) {
            let mut part = part("main", window, &["R", "G", "B", "A"]);
            part.encoding = Encoding { compression, ..Encoding::UNCOMPRESSED };
            for channel in &mut part.channel_data.list {
                let half = |v: f32| f16::from_f32(v / 1024.0);
                channel.sample_data = FlatSamples::F16(channel.sample_data.values_as_f32().map(half).collect());
            }
            let picture = read(saved(bounds(0, 0, 30, 30), [part]).path()).unwrap();
            let expected = [0, 1, 2].map(|c| f16::from_f32(value(c, 7, 1) / 1024.0).to_f32());
            let found = picture.rgb[30 + 7];
            assert!((0..3).all(|c| (found[c] - expected[c]).abs() <= error), "{compression:?}: {found:?}");
        }
    }

    #[test]
    fn other_files_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        assert!(read(&path).unwrap_err().to_string().starts_with("cannot read "));
        std::fs::write(&path, "not an image").unwrap();
        assert!(read(&path).is_err());
    }

    #[test]
    fn damaged_pictures_do_not_panic() {
        let window = bounds(0, 0, 16, 16);
        for channels in [&["R", "G", "B"][..], &["Combined.R", "Combined.G", "Combined.B"], &["Y"]] {
            let file = saved(window, [part("main", window, channels)]);
            let original = std::fs::read(file.path()).unwrap();
            for i in (0..original.len()).step_by(5) {
                let mut bytes = original.clone();
                bytes[i] ^= 0x55;
                std::fs::write(file.path(), bytes).unwrap();
                match read(file.path()) {
                    Ok(picture) => assert_eq!(picture.rgb.len(), picture.crop_size()[0] * picture.crop_size()[1]),
                    Err(e) => {
                        assert!(e.to_string().starts_with("cannot read ") && e.to_string().contains(".exr: "), "{e}")
                    }
                }
            }
        }
    }

    /// A header is a few bytes, and can ask for any amount.
    #[test]
    fn what_does_not_fit_into_memory_is_refused() {
        let file = saved(bounds(0, 0, 2, 2), [part("main", bounds(0, 0, 2, 2), &["R", "G", "B"])]);
        let bytes = std::fs::read(file.path()).unwrap();
        let name = b"dataWindow\0box2i\0";
        let at = bytes.windows(name.len()).position(|part| part == name).unwrap() + name.len() + 4;
        // Left, top, right, bottom, the last two inclusive.
        for (right, bottom) in [(1 << 20, 1 << 20), ((1 << 28) - 1, 0), (0, (1 << 28) - 1)] {
            let mut large = bytes.clone();
            large[at + 8..at + 12].copy_from_slice(&i32::to_le_bytes(right));
            large[at + 12..at + 16].copy_from_slice(&i32::to_le_bytes(bottom));
            std::fs::write(file.path(), large).unwrap();
            let error = read(file.path()).unwrap_err().to_string();
            assert!(error.contains("pixels, more than") || error.contains("blocks"), "{right} {bottom}: {error}");
        }
    }
}
