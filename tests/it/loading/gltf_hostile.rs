//! glTF files that are wrong: each is refused with a message that says where.

use super::{Entry, Folder, Glb, png, push};
use crate::not_found;
use proptest::prelude::*;
use serde_json::{Value, json};
use sunfleck::scene::load::load;

/// Refuses the triangle as changed by `edit`, with all of `expected` in the message.
fn refuse(edit: impl FnOnce(&mut Glb), expected: &[&str]) {
    let mut glb = Glb::triangle();
    edit(&mut glb);
    let message = Folder::new().refuse("scene.glb", glb.bytes());
    for part in expected {
        assert!(message.contains(part), "{message:?} lacks {part:?}");
    }
}

#[test]
fn not_a_gltf_file() {
    let folder = Folder::new();
    let missing = load(&folder.0.path().join("none.glb")).unwrap_err().to_string();
    assert!(missing.contains("none.glb") && missing.contains(&not_found()), "{missing}");
    assert!(folder.refuse("text.glb", "hello").contains("neither glTF"));
    assert!(folder.refuse("empty.gltf", "").contains("neither glTF"));
    assert!(folder.refuse("no-asset.gltf", "{}").contains("asset.version"));
    assert!(folder.refuse("old.gltf", r#"{"asset": {"version": "1.0"}}"#).contains("1.0"));
    assert!(folder.refuse("cut.gltf", r#"{"asset": {"version": "2.0"}"#).contains("line 1"));
    assert!(folder.refuse("scene.blend", "BLENDER").contains(".gltf"));
    let bytes = Glb::triangle().bytes();
    for length in [4, 8, 12, 20, 40, bytes.len() / 2, bytes.len() - 1] {
        assert!(folder.refuse("cut.glb", &bytes[..length]).contains("truncated"));
    }
    assert!(folder.refuse("folder.glb/inner.glb", "x").contains("neither"));
    let message = load(&folder.0.path().join("folder.glb")).unwrap_err().to_string();
    assert!(message.contains("regular file"), "{message}");
    let deep = format!("{}{}", "[".repeat(100_000), "]".repeat(100_000));
    folder.refuse("deep.gltf", format!(r#"{{"asset": {{"version": "2.0"}}, "extras": {deep}, "nodes": {deep}}}"#));
}

#[test]
fn wrong_types_are_named() {
    refuse(|glb| glb.json["accessors"][0]["count"] = json!(-3), &["accessors[0].count"]);
    refuse(|glb| glb.json["accessors"][0]["count"] = json!(1e300), &["accessors[0].count"]);
    refuse(|glb| glb.json["nodes"][0]["mesh"] = json!("0"), &["nodes[0].mesh"]);
    refuse(|glb| glb.json["nodes"][0]["matrix"] = json!([1, 0]), &["nodes[0].matrix"]);
}

#[test]
fn indices_out_of_range_are_named() {
    refuse(|glb| glb.json["scene"] = json!(1), &["scene:", "1 is out of range"]);
    refuse(|glb| glb.json["scenes"][0]["nodes"] = json!([7]), &["scenes[0].nodes", "7"]);
    refuse(|glb| glb.json["nodes"][0]["children"] = json!([9]), &["nodes[0].children", "9"]);
    refuse(|glb| glb.json["nodes"][0]["mesh"] = json!(2), &["nodes[0].mesh", "1 meshes"]);
    refuse(|glb| glb.json["nodes"][0]["camera"] = json!(0), &["nodes[0].camera"]);
    refuse(
        |glb| glb.json["nodes"][0]["extensions"] = json!({"KHR_lights_punctual": {"light": 3}}),
        &["nodes[0].extensions.KHR_lights_punctual.light"],
    );
    refuse(|glb| glb.primitive()["attributes"]["POSITION"] = json!(1), &["primitives[0].attributes.POSITION", "1"]);
    refuse(|glb| glb.primitive()["material"] = json!(0), &["meshes[0].primitives[0].material"]);
    refuse(|glb| glb.primitive()["indices"] = json!(99), &["meshes[0].primitives[0].indices"]);
    refuse(|glb| glb.primitive()["mode"] = json!(7), &["meshes[0].primitives[0].mode"]);
    refuse(|glb| glb.indices(&[0, 1, 3]), &["meshes[0].primitives[0].indices", "index 2 is 3", "3 vertices"]);
    refuse(|glb| glb.json["accessors"][0]["bufferView"] = json!(5), &["accessors[0].bufferView", "5"]);
    refuse(|glb| glb.json["bufferViews"][0]["buffer"] = json!(1), &["bufferViews[0].buffer", "1"]);
    let material = |textures: Value| {
        move |glb: &mut Glb| {
            glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
            glb.json["textures"] = textures;
        }
    };
    refuse(material(json!([])), &["materials[0].pbrMetallicRoughness.baseColorTexture.index"]);
    refuse(material(json!([{"source": 4}])), &["textures[0].source", "4"]);
}

#[test]
fn ranges_outside_buffers_are_named() {
    let huge = u64::MAX;
    refuse(|glb| glb.json["accessors"][0]["count"] = json!(4), &["accessors[0]", "exceed buffer view 0"]);
    for count in [1_u64 << 30, 1 << 40, huge / 12, huge / 2, huge] {
        refuse(|glb| glb.json["accessors"][0]["count"] = json!(count), &["meshes[0].primitives[0]", "more than"]);
    }
    refuse(|glb| glb.json["accessors"][0]["byteOffset"] = json!(1), &["accessors[0]"]);
    refuse(|glb| glb.json["accessors"][0]["byteOffset"] = json!(huge), &["accessors[0]"]);
    refuse(|glb| glb.json["bufferViews"][0]["byteOffset"] = json!(huge), &["bufferViews[0]"]);
    refuse(|glb| glb.json["bufferViews"][0]["byteLength"] = json!(37), &["bufferViews[0]", "buffer 0"]);
    refuse(|glb| glb.json["bufferViews"][0]["byteStride"] = json!(huge), &["accessors[0]"]);
    refuse(|glb| glb.json["bufferViews"][0]["byteStride"] = json!(0), &["bufferViews[0].byteStride"]);
    refuse(|glb| glb.json["bufferViews"][0]["byteStride"] = json!(4), &["bufferViews[0].byteStride"]);
    refuse(|glb| glb.json["buffers"] = json!([{"byteLength": 1000}]), &["buffers[0].byteLength", "1000"]);
    refuse(|glb| glb.json["accessors"][0]["type"] = json!("VEC2"), &["attributes.POSITION", "2 components"]);
    refuse(|glb| glb.json["accessors"][0]["type"] = json!("VEC9"), &["accessors[0].type"]);
    refuse(|glb| glb.json["accessors"][0]["componentType"] = json!(5124), &["accessors[0].componentType", "5124"]);
    refuse(
        |glb| {
            glb.json["accessors"][0]["bufferView"].take();
            glb.json["accessors"][0]["count"] = json!(200_000_000);
        },
        &["accessors[0].count", "without a buffer view"],
    );
    refuse(
        |glb| {
            let normals = glb.floats("VEC3", &[0.0; 6]);
            glb.primitive()["attributes"]["NORMAL"] = normals.into();
        },
        &["attributes.NORMAL", "2 elements", "3"],
    );
    refuse(
        |glb| {
            let (indices, values) = (glb.view(&[5]), glb.view(&[0; 12]));
            glb.json["accessors"][0]["sparse"] = json!({"count": 1,
                "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
        },
        &["accessors[0].sparse.indices", "index 5"],
    );
}

#[test]
fn coordinates_that_are_no_numbers_are_named() {
    for bad in [f32::NAN, f32::INFINITY, 2e9] {
        refuse(
            |glb| {
                let bytes: Vec<u8> =
                    [0.0, 0.0, 0.0, 1.0, bad, 0.0].iter().flat_map(|v: &f32| v.to_le_bytes()).collect();
                glb.binary[..24].copy_from_slice(&bytes);
            },
            &["meshes[0].primitives[0]", "vertex 1", "\"triangle\""],
        );
    }
    refuse(|glb| glb.json["nodes"][0]["scale"] = json!([1e300, 1e300, 1e300]), &["vertex"]);
    refuse(|glb| glb.json["nodes"][0]["rotation"] = json!([0, 0, 0, 0]), &["nodes[0].rotation"]);
}

#[test]
fn cycles_and_shared_nodes_are_refused() {
    refuse(|glb| glb.json["nodes"][0]["children"] = json!([0]), &["nodes[0].children", "reached twice"]);
    refuse(
        |glb| glb.json["nodes"] = json!([{"children": [1]}, {"children": [2]}, {"children": [0], "mesh": 0}]),
        &["nodes[2].children", "node 0"],
    );
    // Doubling at every step: 2^30 ways to the last node.
    let mut nodes: Vec<_> = (0..30).map(|i| json!({"children": [i + 1, i + 1]})).collect();
    nodes.push(json!({"mesh": 0}));
    refuse(|glb| glb.json["nodes"] = json!(nodes), &["reached twice"]);
    // A chain is no crime.
    let mut nodes: Vec<_> = (0..100_000).map(|i| json!({"children": [i + 1]})).collect();
    nodes.push(json!({"mesh": 0}));
    let mut glb = Glb::triangle();
    glb.json["nodes"] = json!(nodes);
    assert_eq!(glb.scene().meshes.len(), 1);
}

#[test]
fn instances_are_bounded() {
    refuse(
        |glb| {
            // 3 vertices in the file, 5,000 accessors' worth of primitives, 1,000 nodes.
            let primitive = glb.primitive().clone();
            glb.json["meshes"][0]["primitives"] = json!(vec![primitive; 5000]);
            glb.json["nodes"] = json!(vec![json!({"mesh": 0}); 1000]);
            glb.json["scenes"][0]["nodes"] = json!((0..1000).collect::<Vec<_>>());
        },
        &["meshes[0].primitives", "more than 4194304 meshes"],
    );
}

#[test]
fn required_extensions_are_named() {
    refuse(
        |glb| glb.json["extensionsRequired"] = json!(["KHR_texture_transform", "KHR_draco_mesh_compression"]),
        &["extensionsRequired", "KHR_draco_mesh_compression", "without Draco"],
    );
}

#[test]
fn material_values_are_checked() {
    let material = |material: Value| move |glb: &mut Glb| glb.json["materials"] = json!([material]);
    refuse(material(json!({"pbrMetallicRoughness": {"roughnessFactor": -1}})), &["materials[0]", "roughnessFactor"]);
    refuse(material(json!({"emissiveFactor": [1e39, 0, 0]})), &["materials[0].emissiveFactor"]);
    refuse(material(json!({"alphaMode": "SOMETIMES"})), &["materials[0].alphaMode", "SOMETIMES"]);
    refuse(
        material(json!({"extensions": {"KHR_materials_volume": {"attenuationDistance": -1}}})),
        &["KHR_materials_volume.attenuationDistance"],
    );
    refuse(material(json!({"extensions": {"KHR_materials_ior": {"ior": -1.5}}})), &["KHR_materials_ior.ior"]);
}

fn with_uri(uri: &str) -> impl FnOnce(&mut Glb) {
    let uri = uri.to_string();
    move |glb| glb.json["buffers"] = json!([{"byteLength": 36, "uri": uri}])
}

fn with_image(image: Value) -> impl FnOnce(&mut Glb) {
    move |glb| {
        push(glb.json.entry("images"), image);
        glb.json["textures"] = json!([{"source": 0}]);
        glb.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
    }
}

#[test]
fn external_files_are_named() {
    refuse(with_uri("none.bin"), &["buffers[0].uri", "none.bin", &not_found()]);
    refuse(with_uri("%FF.bin"), &["buffers[0].uri", "%FF.bin", "UTF-8"]);
    refuse(with_uri("a%00b"), &["buffers[0].uri", "not a file name"]);
    refuse(with_uri(""), &["buffers[0].uri"]);
    refuse(with_uri("http://example.com/a.bin"), &["buffers[0].uri", "http://example.com/a.bin"]);
    refuse(with_uri("data:application/octet-stream;base64,!!"), &["buffers[0].uri", "base64"]);
    refuse(with_uri("data:nothing"), &["buffers[0].uri", "comma"]);
    refuse(with_image(json!({"uri": "none.png"})), &["images[0].uri", "none.png", &not_found()]);
    refuse(with_image(json!({"uri": "data:,x"})), &["images[0].uri", "not an image"]);
    refuse(with_image(json!({"bufferView": 0})), &["images[0].bufferView", "not an image"]);
    refuse(with_image(json!({})), &["images[0]", "neither uri nor bufferView"]);
}

#[test]
fn nothing_outside_the_folder_is_read() {
    for uri in ["../secret.bin", "%2e%2e/secret.bin", "a/../../secret.bin", "/etc/passwd", "..\\secret.bin"] {
        refuse(with_uri(uri), &["buffers[0].uri", "outside"]);
        refuse(with_image(json!({"uri": uri})), &["images[0].uri", "outside"]);
    }
}

#[cfg(unix)]
#[test]
fn links_devices_and_pipes_are_not_read() {
    let outside = Folder::new();
    let secret = outside.write("secret.bin", [0; 36]);
    let folder = Folder::new();
    std::os::unix::fs::symlink(&secret, folder.0.path().join("link.bin")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.0.path().join("zero.bin")).unwrap();
    std::fs::create_dir(folder.0.path().join("directory.bin")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(folder.0.path().join("pipe.bin")).status();
    let mut files = vec![("link.bin", "outside"), ("zero.bin", "outside"), ("directory.bin", "regular file")];
    if made.is_ok_and(|status| status.success()) {
        files.push(("pipe.bin", "regular file"));
    }
    for (uri, problem) in files {
        let mut glb = Glb::triangle();
        with_uri(uri)(&mut glb);
        let message = folder.refuse("scene.glb", glb.bytes());
        assert!(message.contains("buffers[0].uri") && message.contains(uri) && message.contains(problem), "{message}");
    }
    let message = load(std::path::Path::new("/dev/zero")).unwrap_err().to_string();
    assert!(message.contains("regular file"), "{message}");
}

#[test]
fn images_that_lie_are_refused() {
    // The header says 60000 × 60000; nothing of the kind follows.
    let mut image = png(1, 1, &[[1, 2, 3, 4]]);
    image[16..20].copy_from_slice(&60_000_u32.to_be_bytes());
    image[20..24].copy_from_slice(&60_000_u32.to_be_bytes());
    refuse(
        |glb| {
            let texture = glb.texture(&image);
            glb.json["materials"] = json!([{"emissiveTexture": {"index": texture}, "emissiveFactor": [1, 1, 1]}]);
        },
        &["images[0].bufferView"],
    );
}

/// A file with most of what is read in it.
fn rich() -> Vec<u8> {
    let mut glb = Glb::triangle();
    let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let uv = glb.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    let target = glb.floats("VEC3", &[0.5; 9]);
    let texture = glb.texture(&png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 128]]));
    let (indices, values) = (glb.view(&[2]), glb.view(&[0; 12]));
    glb.json["accessors"][1]["sparse"] = json!({"count": 1,
        "indices": {"bufferView": indices, "componentType": 5121}, "values": {"bufferView": values}});
    glb.indices(&[0, 1, 2]);
    let primitive = glb.primitive();
    primitive["attributes"]["NORMAL"] = normals.into();
    primitive["attributes"]["TEXCOORD_0"] = uv.into();
    primitive["targets"] = json!([{"POSITION": target}]);
    primitive["material"] = json!(0);
    glb.json["meshes"][0]["weights"] = json!([0.5]);
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 0.5}}}]);
    glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]);
    glb.json["nodes"] = json!([{"mesh": 0, "children": [1], "scale": [1, -2, 1]}, {"camera": 0}]);
    glb.bytes()
}

/// No change of a few bytes may cause a panic; whatever still loads holds its promises.
fn survives(changes: &[(usize, u8)]) {
    let mut bytes = rich();
    for &(at, value) in changes {
        let at = at % bytes.len();
        bytes[at] = value;
    }
    if let Ok(loaded) = load(&Folder::new().write("scene.glb", bytes)) {
        match loaded.scene.check() {
            Err(e) if e.place != "scene" => panic!("{e}"),
            _ => {}
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(300) })]

    #[test]
    fn damaged_files_do_not_panic(changes in prop::collection::vec((any::<usize>(), any::<u8>()), 1..4)) {
        survives(&changes);
    }

    #[test]
    fn changed_digits_do_not_panic(changes in prop::collection::vec((any::<usize>(), b'0'..=b'9'), 1..4)) {
        survives(&changes);
    }
}
