//! The neighbour search alone drags in neither wgpu nor what only the renderer needs.

use std::path::Path;
use std::process::Command;

/// Packages in the tree of a manifest's normal dependencies, as cargo resolves them offline.
fn packages(manifest: &str, arguments: &[&str]) -> Vec<String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--edges", "normal", "--prefix", "none", "--format", "{p}", "--manifest-path"])
        .arg(root.join(manifest))
        .args(arguments)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let name = |line: &str| line.split(' ').next().unwrap_or_default().to_string();
    String::from_utf8(output.stdout).unwrap().lines().map(name).collect()
}

#[test]
fn no_wgpu_in_the_tree_of_the_neighbour_search() {
    let alone = packages("Cargo.toml", &["--no-default-features"]);
    for needed in ["sunfleck", "glam", "rayon"] {
        assert!(alone.iter().any(|name| name == needed), "{needed} is not in {alone:?}");
    }
    for unwanted in ["wgpu", "wgpu-core", "naga", "pollster", "clap", "image", "exr", "serde"] {
        assert!(alone.iter().all(|name| name != unwanted), "{unwanted} is in {alone:?}");
    }
    // The test can see: with the GPU it is there.
    let with_gpu = packages("Cargo.toml", &["--no-default-features", "--features", "gpu"]);
    assert!(with_gpu.iter().any(|name| name == "wgpu"), "{with_gpu:?}");
}
