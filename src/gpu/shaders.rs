//! The WGSL sources and their composition: a line `#import name` stands for the file of that name, once.

/// Everything that can be imported: name and text.
const LIBRARY: &[(&str, &str)] = &[
    ("layout", include_str!("../../shaders/layout.wgsl")),
    ("common", include_str!("../../shaders/lib/common.wgsl")),
    ("frame", include_str!("../../shaders/lib/frame.wgsl")),
    ("oct", include_str!("../../shaders/lib/oct.wgsl")),
    ("rng", include_str!("../../shaders/lib/rng.wgsl")),
    ("basis", include_str!("../../shaders/lib/basis.wgsl")),
    ("warp", include_str!("../../shaders/lib/warp.wgsl")),
    ("ggx", include_str!("../../shaders/lib/ggx.wgsl")),
    ("scene", include_str!("../../shaders/lib/scene.wgsl")),
    ("albedo", include_str!("../../shaders/lib/albedo.wgsl")),
    ("texture", include_str!("../../shaders/lib/texture.wgsl")),
    ("trace", include_str!("../../shaders/lib/trace.wgsl")),
    ("surface", include_str!("../../shaders/lib/surface.wgsl")),
    ("bsdf", include_str!("../../shaders/lib/bsdf.wgsl")),
    ("bsdf_surface", include_str!("../../shaders/lib/bsdf_surface.wgsl")),
    ("light", include_str!("../../shaders/lib/light.wgsl")),
    ("camera", include_str!("../../shaders/lib/camera.wgsl")),
    ("tree", include_str!("../../shaders/lib/tree.wgsl")),
    ("search", include_str!("../../shaders/lib/search.wgsl")),
    ("photon_paths", include_str!("../../shaders/lib/photon_paths.wgsl")),
];

/// Every module with entry points: name and text before composition.
const MODULES: &[(&str, &str)] = &[
    ("eye", include_str!("../../shaders/eye.wgsl")),
    ("emit", include_str!("../../shaders/emit.wgsl")),
    ("photons", include_str!("../../shaders/photons.wgsl")),
    ("compact", include_str!("../../shaders/compact.wgsl")),
    ("probe", include_str!("../../shaders/probe.wgsl")),
    ("bounds", include_str!("../../shaders/bounds.wgsl")),
    ("morton", include_str!("../../shaders/morton.wgsl")),
    ("sort", include_str!("../../shaders/sort.wgsl")),
    ("permute", include_str!("../../shaders/permute.wgsl")),
    ("tree", include_str!("../../shaders/tree.wgsl")),
    ("points", include_str!("../../shaders/points.wgsl")),
    ("neighbours", include_str!("../../shaders/neighbours.wgsl")),
    ("scan", include_str!("../../shaders/scan.wgsl")),
    ("nearest", include_str!("../../shaders/nearest.wgsl")),
    ("gather", include_str!("../../shaders/gather.wgsl")),
    ("accumulate", include_str!("../../shaders/accumulate.wgsl")),
];

/// Names of all modules with entry points.
pub fn modules() -> impl Iterator<Item = &'static str> {
    MODULES.iter().map(|(name, _)| *name)
}

/// Complete WGSL of a module.
///
/// # Panics
/// If there is no such module, or it imports what does not exist: a mistake in this crate.
pub fn source(module: &str) -> String {
    let (_, text) = MODULES.iter().find(|(name, _)| *name == module).expect("a module of this crate");
    compose(text)
}

/// Replaces the imports of a text by what they name, each one once.
///
/// # Panics
/// If it imports what does not exist.
pub fn compose(text: &str) -> String {
    let mut composed = String::new();
    append(text, &mut Vec::new(), &mut composed);
    composed
}

fn append(text: &str, seen: &mut Vec<&'static str>, composed: &mut String) {
    for line in text.lines() {
        let Some(wanted) = line.strip_prefix("#import ") else {
            composed.push_str(line);
            composed.push('\n');
            continue;
        };
        let (name, imported) = LIBRARY.iter().find(|(name, _)| *name == wanted.trim()).expect("a file of the library");
        if !seen.contains(name) {
            seen.push(name);
            append(imported, seen, composed);
        }
    }
}
