//! `sunfleck compare`.

use std::path::Path;

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
