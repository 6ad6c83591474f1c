//! `sunfleck compare`.

use std::path::Path;

use exr::meta::attribute::IntegerBounds;
use exr::prelude::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, WritableImage};
use sunfleck::output::Picture;
use sunfleck::output::exr::{Header, write};

use super::{assert_error, stderr, sunfleck, words};

fn save(folder: &Path, name: &str, rgb: Vec<[f32; 3]>) {
    let n = rgb.len() as u32;
    let picture = Picture { size: [n, 1], crop: [0, 0, n, 1], rgb, variance: None };
    write(&folder.join(name), &picture, &Header::default()).unwrap();
}

/// Nothing to compare is no agreement, and a share of 0 is no share.
#[test]
fn what_cannot_be_told_is_not_told_as_0() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save(folder, "grey.exr", vec![[0.5; 3]; 4]);
    save(folder, "black.exr", vec![[0.0; 3]; 4]);
    save(folder, "broken.exr", vec![[f32::NAN; 3]; 4]);
    for line in ["compare grey.exr broken.exr", "compare broken.exr grey.exr --json"] {
        let output = sunfleck(folder, words(line));
        assert_error(&output, 1, &["grey.exr", "broken.exr", "no pixel is finite in both"]);
        assert!(output.stdout.is_empty());
    }
    let output = sunfleck(folder, words("compare grey.exr black.exr"));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("mean difference    0.500000 (–)"), "{text}");
    let output = sunfleck(folder, words("compare grey.exr black.exr --json"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["relativeMeanDifference"].is_null() && json["meanDifference"] == 0.5, "{json} {}", stderr(&output));
}

/// On a full disk; of a reader that goes away nobody hears.
#[test]
#[cfg(target_os = "linux")]
fn what_cannot_be_printed_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    save(folder.path(), "a.exr", vec![[0.5; 3]; 4]);
    for line in ["compare a.exr a.exr", "scenes"] {
        let mut program = std::process::Command::new(super::PROGRAM);
        program.current_dir(folder.path()).args(words(line));
        let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
        assert_error(&program.stdout(full).output().unwrap(), 1, &["standard output: No space left on device"]);
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = program.stdout(writer).output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{}", stderr(&output));
    }
}

/// 20×10 pixels, of which the file has these.
fn save_part(folder: &Path, name: &str, at: (i32, i32), size: (usize, usize)) {
    let channel = |name| AnyChannel::new(name, FlatSamples::F32(vec![0.5; size.0 * size.1]));
    let channels = AnyChannels::sort(["Combined.R", "Combined.G", "Combined.B"].map(channel).into_iter().collect());
    let attributes = LayerAttributes { layer_position: at.into(), ..LayerAttributes::default() };
    let mut image = Image::from_layer(Layer::new(size, attributes, Encoding::default(), channels));
    image.attributes.display_window = IntegerBounds::from_dimensions((20, 10));
    image.write().to_file(folder.join(name)).unwrap();
}

#[test]
fn overscan_is_cut_and_a_part_is_told_as_the_file_has_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    save_part(folder, "whole.exr", (0, 0), (20, 10));
    save_part(folder, "overscan.exr", (-8, -8), (36, 26));
    save_part(folder, "part.exr", (-8, -8), (20, 26));
    let output = sunfleck(folder, words("compare overscan.exr whole.exr"));
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(output.status.success() && text.contains("relMSE             0.000000"), "{text}{}", stderr(&output));
    let windows =
        "the windows differ: 20x10 with data from (0, 0) to (12, 10) and 20x10 with data from (0, 0) to (20, 10)";
    let output = sunfleck(folder, words("compare part.exr whole.exr"));
    assert_error(&output, 1, &[windows, "the file part.exr has data from (-8, -8) to (12, 18)"]);
    assert!(!stderr(&output).contains("the file whole.exr"));
}
