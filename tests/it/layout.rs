//! `shaders/layout.wgsl` says the same as `src/layout.rs`, and every shader is valid, on every system.

use std::collections::BTreeMap;

use naga::back::{glsl, hlsl, msl};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{ScalarKind, TypeInner};
use sunfleck::gpu::shaders;

const RUST: &str = include_str!("../../src/layout.rs");

/// Name, offset and size in bytes, and what it is made of.
type Field = (String, u32, u32, &'static str);

/// Structs of `layout.rs`, read from its text: everything there has 4-byte parts, and `Pod` allows no padding.
fn rust_structs() -> BTreeMap<String, (u32, Vec<Field>)> {
    let mut structs = BTreeMap::new();
    for text in RUST.split("pub struct ").skip(1) {
        let (name, rest) = text.split_once(" {").expect("braces");
        let (body, _) = rest.split_once("\n}").expect("braces");
        let mut fields = Vec::new();
        let mut offset = 0;
        for line in body.lines().map(str::trim) {
            let Some(line) = line.strip_prefix("pub ") else {
                assert!(line.is_empty() || line.starts_with("///"), "{name}: unreadable line {line:?}");
                continue;
            };
            let (field, kind) = line.trim_end_matches(',').split_once(": ").expect("name: type");
            let (scalar, n) = match kind.strip_prefix('[') {
                Some(array) => {
                    let (scalar, n) = array.trim_end_matches(']').split_once("; ").expect("array");
                    (scalar, n.parse().expect("length"))
                }
                None => (kind, 1),
            };
            let scalar = match scalar {
                "f32" => "f32",
                "u32" => "u32",
                other => panic!("{name}.{field}: {other} has no twin in WGSL"),
            };
            fields.push((field.to_owned(), offset, 4 * n, scalar));
            offset += 4 * n;
        }
        structs.insert(name.to_owned(), (offset, fields));
    }
    structs
}

fn wgsl_module(name: &str) -> naga::Module {
    let source = shaders::source(name);
    naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)))
}

fn layout_module() -> naga::Module {
    let source = shaders::compose("#import layout\n");
    naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&source)))
}

fn scalar_of(module: &naga::Module, ty: naga::Handle<naga::Type>) -> &'static str {
    match &module.types[ty].inner {
        TypeInner::Scalar(s) | TypeInner::Vector { scalar: s, .. } => match s.kind {
            ScalarKind::Float => "f32",
            ScalarKind::Uint => "u32",
            other => panic!("{other:?} in the layout"),
        },
        TypeInner::Array { base, .. } => scalar_of(module, *base),
        other => panic!("{other:?} in the layout"),
    }
}

fn wgsl_structs(module: &naga::Module) -> BTreeMap<String, (u32, Vec<Field>)> {
    let mut structs = BTreeMap::new();
    for (_, ty) in module.types.iter() {
        let TypeInner::Struct { members, span } = &ty.inner else { continue };
        let fields = members.iter().map(|member| {
            let size = module.types[member.ty].inner.size(module.to_ctx());
            (member.name.clone().expect("named"), member.offset, size, scalar_of(module, member.ty))
        });
        structs.insert(ty.name.clone().expect("named"), (*span, fields.collect()));
    }
    structs
}

/// Padding may be written differently; what counts is where the rest lies and how long the whole is.
fn without_padding(fields: &[Field]) -> Vec<Field> {
    fields.iter().filter(|(name, ..)| !name.starts_with("pad")).cloned().collect()
}

#[test]
fn structs_agree() {
    let rust = rust_structs();
    let wgsl = wgsl_structs(&layout_module());
    assert!(rust.len() >= 12, "only {} structs were found in layout.rs", rust.len());
    assert_eq!(rust.keys().collect::<Vec<_>>(), wgsl.keys().collect::<Vec<_>>());
    for (name, (size, fields)) in &rust {
        let (span, members) = &wgsl[name];
        assert_eq!(size, span, "size of {name}");
        assert_eq!(without_padding(fields), without_padding(members), "{name}");
    }
    // The text was read rightly.
    assert_eq!(rust["EyeVertex"].0 as usize, size_of::<sunfleck::layout::EyeVertex>());
    assert_eq!(rust["Photon"].0 as usize, size_of::<sunfleck::layout::Photon>());
    assert_eq!(rust["Material"].0 as usize, size_of::<sunfleck::layout::Material>());
    assert_eq!(rust["Camera"].0 as usize, size_of::<sunfleck::layout::Camera>());
}

#[test]
fn constants_agree() {
    // The two that come from the search.
    let mut rust = BTreeMap::from([
        ("LEAF_SIZE".to_owned(), sunfleck::layout::LEAF_SIZE),
        ("FANOUT".to_owned(), sunfleck::layout::FANOUT),
    ]);
    for line in RUST.lines().filter_map(|line| line.strip_prefix("pub const ")) {
        let (name, value) = line.trim_end_matches(';').split_once(": u32 = ").expect("a u32");
        let value = if value == "u32::MAX" { u32::MAX } else { value.parse().expect("a number") };
        rust.insert(name.to_owned(), value);
    }
    assert!(rust.len() >= 20, "only {} constants were found in layout.rs", rust.len());
    let module = layout_module();
    let mut wgsl = BTreeMap::new();
    for (_, constant) in module.constants.iter() {
        let naga::Expression::Literal(naga::Literal::U32(value)) = module.global_expressions[constant.init] else {
            panic!("{:?} is not a u32", constant.name)
        };
        wgsl.insert(constant.name.clone().expect("named"), value);
    }
    assert_eq!(rust, wgsl);
}

fn validated(name: &str) -> (naga::Module, ModuleInfo) {
    let module = wgsl_module(name);
    let allowed = match shaders::needs_ray_queries(name) {
        true => Capabilities::RAY_QUERY,
        false => Capabilities::empty(),
    };
    match Validator::new(ValidationFlags::all(), allowed).validate(&module) {
        Ok(info) => (module, info),
        Err(error) => panic!("{name}: {}", error.emit_to_string(&shaders::source(name))),
    }
}

/// In the languages of Metal, Direct3D 12 and OpenGL ES too, which no machine that runs these tests may have: old
/// versions of each, 2.4 and 6.5 where ray queries need them.
#[test]
fn every_shader_can_be_translated() {
    for name in shaders::modules() {
        let (module, info) = validated(name);
        let has_ray_queries = shaders::needs_ray_queries(name);
        for entry in &module.entry_points {
            let (stage, called) = (naga::ShaderStage::Compute, entry.name.clone());

            let lang_version = if has_ray_queries { (2, 4) } else { (1, 2) };
            let options = msl::Options { lang_version, fake_missing_bindings: true, ..Default::default() };
            let pipeline = msl::PipelineOptions { entry_point: Some((stage, called.clone())), ..Default::default() };
            let (_, translated) = msl::write_string(&module, &info, &options, &pipeline)
                .unwrap_or_else(|error| panic!("{name}, {called}, Metal: {error}"));
            assert!(translated.entry_point_names[0].is_ok(), "{name}, {called}, Metal");

            let shader_model = if has_ray_queries { hlsl::ShaderModel::V6_5 } else { hlsl::ShaderModel::V5_1 };
            let options = hlsl::Options { shader_model, fake_missing_bindings: true, ..Default::default() };
            let pipeline = hlsl::PipelineOptions { entry_point: Some((stage, called.clone())) };
            let mut text = String::new();
            let translated = hlsl::Writer::new(&mut text, &options, &pipeline)
                .write(&module, &info, None)
                .unwrap_or_else(|error| panic!("{name}, {called}, Direct3D: {error}"));
            assert!(translated.entry_point_names[0].is_ok(), "{name}, {called}, Direct3D");

            if !has_ray_queries {
                let version = glsl::Version::Embedded { version: 310, is_webgl: false };
                let options = glsl::Options { version, ..Default::default() };
                let pipeline =
                    glsl::PipelineOptions { shader_stage: stage, entry_point: called.clone(), multiview: None };
                glsl::Writer::new(&mut String::new(), &module, &info, &options, &pipeline, Default::default())
                    .and_then(|mut writer| writer.write())
                    .unwrap_or_else(|error| panic!("{name}, {called}, OpenGL: {error}"));
            }
        }
    }
}

#[test]
fn every_shader_is_valid() {
    for name in shaders::modules() {
        let (module, _) = validated(name);
        assert!(!module.entry_points.is_empty(), "{name} has no entry point");
        for entry in &module.entry_points {
            let threads: u32 = entry.workgroup_size.iter().product();
            assert_eq!(threads, 64, "{name}: {}", entry.name);
        }
    }
}
