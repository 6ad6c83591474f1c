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
    ("hardware", include_str!("../../shaders/lib/hardware.wgsl")),
    ("search", include_str!("../../shaders/lib/search.wgsl")),
    ("rank", include_str!("../../shaders/lib/rank.wgsl")),
    ("morton_code", include_str!("../../shaders/lib/morton_code.wgsl")),
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
    ("inflate", include_str!("../../shaders/inflate.wgsl")),
    ("points", include_str!("../../shaders/points.wgsl")),
    ("neighbours", include_str!("../../shaders/neighbours.wgsl")),
    ("scan", include_str!("../../shaders/scan.wgsl")),
    ("nearest", include_str!("../../shaders/nearest.wgsl")),
    ("reaches", include_str!("../../shaders/reaches.wgsl")),
    ("gather", include_str!("../../shaders/gather.wgsl")),
    ("accumulate", include_str!("../../shaders/accumulate.wgsl")),
];

/// Modules that walk the tree and can search by ray queries instead: they have a second name, which ends in
/// [`HARDWARE`].
const WITH_HARDWARE: &[&str] = &["gather_hardware", "neighbours_hardware", "nearest_hardware"];

/// How a text begins that uses ray queries.
pub const ENABLE_RAY_QUERIES: &str = "enable wgpu_ray_query; ";

/// What that name ends in.
const HARDWARE: &str = "_hardware";

/// Names of all modules with entry points.
pub fn modules() -> impl Iterator<Item = &'static str> {
    MODULES.iter().map(|(name, _)| *name).chain(WITH_HARDWARE.iter().copied())
}

/// Whether a module needs a device with ray queries.
pub fn needs_ray_queries(module: &str) -> bool {
    WITH_HARDWARE.contains(&module)
}

/// Complete WGSL of a module.
///
/// # Panics
/// If there is no such module, or it imports what does not exist: a mistake in this crate.
pub fn source(module: &str) -> String {
    let base = if needs_ray_queries(module) { module.trim_end_matches(HARDWARE) } else { module };
    let (_, text) = MODULES.iter().find(|(name, _)| *name == base).expect("a module of this crate");
    if base == module { compose(text) } else { ENABLE_RAY_QUERIES.to_owned() + &compose_for_hardware(text) }
}

/// Replaces the imports of a text by what they name, each one once.
///
/// # Panics
/// If it imports what does not exist.
pub fn compose(text: &str) -> String {
    let mut composed = String::new();
    append(text, false, &mut Vec::new(), &mut composed);
    composed
}

/// The same for a text whose `tree` is to be searched by ray queries: that declaration and the import of its walk are
/// exchanged, nothing else, so that whatever visits points runs on either. [`ENABLE_RAY_QUERIES`] has to come first.
///
/// # Panics
/// If it imports what does not exist.
pub fn compose_for_hardware(text: &str) -> String {
    let mut composed = String::new();
    append(text, true, &mut Vec::new(), &mut composed);
    composed.replace("var<storage, read> tree: array<TreeNode>;", "var tree: acceleration_structure;")
}

fn append(text: &str, hardware: bool, seen: &mut Vec<&'static str>, composed: &mut String) {
    for line in text.lines() {
        let wanted = line.strip_prefix("#import ").map(|name| match name.trim() {
            "tree" if hardware => "hardware",
            name => name,
        });
        let Some(wanted) = wanted else {
            composed.push_str(line);
            composed.push('\n');
            continue;
        };
        let (name, imported) = LIBRARY.iter().find(|(name, _)| *name == wanted).expect("a file of the library");
        if !seen.contains(name) {
            seen.push(name);
            append(imported, hardware, seen, composed);
        }
    }
}
