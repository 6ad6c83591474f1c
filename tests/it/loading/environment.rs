//! Environment maps.

use super::Folder;
use glam::Vec3;
use sunfleck::scene::load::load_environment;

/// Radiance of 4 × 2 texels, uncompressed.
fn hdr(texels: [[u8; 4]; 8]) -> Vec<u8> {
    [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n", texels.as_flattened()].concat()
}

fn exr_bytes(width: usize, height: usize, value: impl Fn(usize, usize) -> [f32; 3] + Sync) -> Vec<u8> {
    use exr::prelude::*;
    let channels = SpecificChannels::rgb(|at: Vec2<usize>| {
        let [r, g, b] = value(at.0, at.1);
        (r, g, b)
    });
    let mut bytes = std::io::Cursor::new(Vec::new());
    Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// Each channel of 8 × 4 texels has its number.
fn exr_channels(names: &[&str]) -> Vec<u8> {
    use exr::prelude::*;
    let channel = |(i, name): (usize, &&str)| AnyChannel::new(*name, FlatSamples::F32(vec![i as f32 + 0.5; 32]));
    let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
    let attributes = LayerAttributes { layer_position: Vec2(-3, 7), ..LayerAttributes::default() };
    let mut image = Image::from_layer(Layer::new((8, 4), attributes, Encoding::SMALL_LOSSLESS, channels));
    image.attributes.display_window = IntegerBounds::from_dimensions((100, 50));
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

#[test]
fn hdr_and_exr_are_read() {
    let folder = Folder::new();
    // Mantissa 128 with exponent 129 is 1.
    let path = folder.write("sky.hdr", hdr([[128, 64, 0, 129]; 8]));
    let (map, warnings) = load_environment(&path).unwrap();
    assert_eq!((map.width, map.height, warnings.len()), (4, 2, 0));
    assert!(map.texels[3].abs_diff_eq(Vec3::new(1.0, 0.5, 0.0), 0.01), "{}", map.texels[3]);
    let bytes = exr_bytes(3, 2, |x, y| [x as f32, y as f32, if x == 2 { f32::NAN } else { -0.0 }]);
    let (map, warnings) = load_environment(&folder.write("sky.exr", bytes)).unwrap();
    assert_eq!((map.width, map.height), (3, 2));
    assert_eq!(map.texels[5], Vec3::new(2.0, 1.0, 0.0));
    assert!(warnings[0].contains("2 texels") && warnings[0].contains("sky.exr"), "{warnings:?}");
    assert!(warnings[1].contains("3 × 2 texels are stretched") && warnings.len() == 2, "{warnings:?}");
}

/// The map is the data window, wherever it is.
#[test]
fn layers_and_grey_are_read() {
    let folder = Folder::new();
    let combined = ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B", "ViewLayer.Combined.A"];
    let beside = ["Combined.R", "Combined.G", "Combined.B", "Depth.Z", "Diffuse.R", "Diffuse.G", "Diffuse.B"];
    for (names, texel) in [(&combined[..], [0.5, 1.5, 2.5]), (&beside, [0.5, 1.5, 2.5]), (&["A", "Y"], [1.5; 3])] {
        let (map, warnings) = load_environment(&folder.write("sky.exr", exr_channels(names))).unwrap();
        assert_eq!((map.width, map.height, warnings.len()), (8, 4, 0));
        assert!(map.texels.iter().all(|&found| found == Vec3::from(texel)), "{names:?}: {}", map.texels[0]);
    }
    let refused = [(&["Z"][..], "no channels R, G and B"), (&["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"], "layers")];
    for (names, word) in refused {
        let error = load_environment(&folder.write("sky.exr", exr_channels(names))).unwrap_err().to_string();
        assert!(error.contains("sky.exr: ") && error.contains(word), "{error}");
    }
}

#[test]
fn large_maps_are_averaged() {
    let bytes = exr_bytes(4096, 16, |x, _| [x as f32, 3.0, 0.0]);
    let (map, _) = load_environment(&Folder::new().write("sky.exr", bytes)).unwrap();
    assert_eq!((map.width, map.height), (2048, 16));
    assert!(map.texels[5].abs_diff_eq(Vec3::new(10.5, 3.0, 0.0), 1e-3), "{}", map.texels[5]);
}

#[test]
fn lies_are_refused() {
    let folder = Folder::new();
    let refuse = |name: &str, bytes: &[u8]| {
        let message = load_environment(&folder.write(name, bytes)).unwrap_err().to_string();
        assert!(message.contains(name), "{message}");
        message
    };
    refuse("a.hdr", b"");
    assert!(refuse("text.hdr", b"hello").contains("neither"));
    refuse("big.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n");
    refuse("short.hdr", &hdr([[1; 4]; 8])[..60]);
    let cut = refuse("cut.hdr", &hdr([[128; 4]; 8])[..60]);
    assert!(cut.contains("is cut off"), "{cut}");
    let bytes = exr_bytes(8, 8, |_, _| [1.0; 3]);
    refuse("cut.exr", &bytes[..bytes.len() / 2]);
    refuse("header.exr", &bytes[..20]);
    // A data window of 2^30 × 2^30 (xMax, yMax follow the name, the type and the size of the attribute).
    let window = bytes.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + "box2i\0".len() + 4;
    let mut huge = bytes.clone();
    for field in [2, 3] {
        huge[window + 4 * field..][..4].copy_from_slice(&(1_i32 << 30).to_le_bytes());
    }
    refuse("huge.exr", &huge);
}

/// With one byte changed: what is read has its size, and what is not names the file.
#[test]
fn damaged_maps_do_not_panic() {
    let folder = Folder::new();
    let plain = exr_bytes(16, 8, |x, y| [x as f32, y as f32, 1.0]);
    for original in [plain, exr_channels(&["Combined.R", "Combined.G", "Combined.B"]), exr_channels(&["Y"])] {
        for i in (0..original.len().min(600)).step_by(2) {
            for value in [0, 255] {
                let mut bytes = original.clone();
                bytes[i] = value;
                match load_environment(&folder.write("sky.exr", bytes)) {
                    Ok((map, _)) => assert_eq!(map.texels.len(), (map.width * map.height) as usize),
                    Err(e) => assert!(e.to_string().contains("sky.exr"), "{e}"),
                }
            }
        }
    }
}
