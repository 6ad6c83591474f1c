//! glTF files that are right, and what becomes of them.

use super::{Entry, Folder, Glb, png, push};
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;
use sunfleck::scene::{AlphaMode, Projection, PunctualKind, Wrap};

fn front(scene: &sunfleck::scene::Scene, mesh: usize) -> Vec3 {
    let mesh = &scene.meshes[mesh];
    let [a, b, c] = mesh.triangles[0].map(|i| mesh.positions[i as usize]);
    (b - a).cross(c - a).normalize()
}

#[test]
fn a_triangle() {
    let loaded = Glb::triangle().load();
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let mesh = &loaded.scene.meshes[0];
    assert_eq!((mesh.positions.clone(), mesh.triangles.clone()), (vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]));
    let material = &loaded.scene.materials[mesh.material];
    assert_eq!((material.metallic, material.roughness, material.double_sided), (1.0, 1.0, false));
}

#[test]
fn gltf_with_external_files_and_data_uris() {
    let folder = Folder::new();
    let mut glb = Glb::triangle();
    folder.write("my buffers/b#1.bin", &glb.binary);
    glb.json["buffers"] = json!([{"byteLength": 36, "uri": "my%20buffers/b%231.bin"}]);
    assert_eq!(folder.load("scene.gltf", glb.json.to_string()).scene.meshes.len(), 1);
    glb.json["buffers"][0]["uri"] = json!("my buffers/../my buffers/b#1.bin");
    assert_eq!(folder.load("scene.gltf", format!("\u{feff}{}", glb.json)).scene.meshes.len(), 1);
    let base64: String = "AAAA".repeat(12);
    glb.json["buffers"][0]["uri"] = json!(format!("data:application/octet-stream;base64,{base64}"));
    // Three times the origin.
    let loaded = folder.load("scene.gltf", glb.json.to_string());
    assert!(loaded.scene.meshes.is_empty());
    assert!(loaded.warnings.iter().any(|w| w.contains("1 triangles without area")), "{:?}", loaded.warnings);
}

#[test]
fn sparse_values_replace_dense_ones_and_zeros() {
    let mut glb = Glb::triangle();
    let (indices, value) = (glb.view(&[2, 0]), [0.0_f32, 5.0, 0.0].map(f32::to_le_bytes).concat());
    let values = glb.view(&value);
    let sparse = json!({"count": 1, "indices": {"bufferView": indices, "componentType": 5123},
        "values": {"bufferView": values}});
    glb.json["accessors"][0]["sparse"] = sparse.clone();
    assert_eq!(glb.scene().meshes[0].positions, [Vec3::ZERO, Vec3::X, 5.0 * Vec3::Y]);
    // A morph target over zeros.
    let accessor = json!({"componentType": 5126, "type": "VEC3", "count": 3, "sparse": sparse});
    let target = push(&mut glb.json["accessors"], accessor);
    glb.primitive()["targets"] = json!([{"POSITION": target}]);
    glb.json["meshes"][0]["weights"] = json!([2.0]);
    assert_eq!(glb.scene().meshes[0].positions, [Vec3::ZERO, Vec3::X, 15.0 * Vec3::Y]);
    glb.json["nodes"][0]["weights"] = json!([0.0]);
    assert_eq!(glb.scene().meshes[0].positions, [Vec3::ZERO, Vec3::X, 5.0 * Vec3::Y]);
}

#[test]
fn normalised_integers() {
    let mut glb = Glb::triangle();
    let uv = glb.accessor(5123, "VEC2", 3, &[0, 0, 255, 255, 0, 128, 0, 0, 51, 51, 0, 0]);
    glb.json["accessors"][uv]["normalized"] = json!(true);
    let normals = glb.accessor(5120, "VEC3", 3, &[0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 128, 0]);
    glb.json["accessors"][normals]["normalized"] = json!(true);
    glb.json["bufferViews"][2]["byteStride"] = json!(4);
    let color = glb.accessor(5121, "VEC3", 3, &[255, 0, 51, 0, 0, 0, 255, 255, 255]);
    let attributes = &mut glb.primitive()["attributes"];
    attributes["TEXCOORD_0"] = uv.into();
    attributes["COLOR_0"] = color.into();
    glb.json["bufferViews"][2]["byteLength"] = json!(12);
    glb.primitive()["attributes"]["NORMAL"] = normals.into();
    let mesh = glb.scene().meshes.remove(0);
    assert_eq!(mesh.uv0, [Vec2::new(0.0, 1.0), Vec2::new(32768.0 / 65535.0, 0.0), Vec2::new(13107.0 / 65535.0, 0.0)]);
    assert_eq!(mesh.colors[0], Vec4::new(1.0, 0.0, 0.2, 1.0));
    // −128 is −1, as is −127.
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::NEG_Z]);
}

#[test]
fn quantised_positions_are_whole_numbers() {
    let mut glb = Glb::triangle();
    let bytes: Vec<u8> = [0_i16, 0, 0, 0, 100, 0, 0, 0, 0, -200, 0, 0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let positions = glb.accessor(5122, "VEC3", 3, &bytes);
    glb.json["bufferViews"][1]["byteStride"] = json!(8);
    glb.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    glb.primitive()["attributes"]["POSITION"] = positions.into();
    glb.json["nodes"][0]["scale"] = json!([0.01, 0.01, 0.01]);
    let mesh = glb.scene().meshes.remove(0);
    assert!(mesh.positions[2].abs_diff_eq(Vec3::new(0.0, -2.0, 0.0), 1e-6), "{:?}", mesh.positions);
}

#[test]
fn strips_fans_and_lists() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    for (mode, indices, triangles) in [
        (4, vec![0, 1, 2, 2, 1, 3], vec![[0, 1, 2], [2, 1, 3]]),
        (5, vec![0, 1, 2, 3], vec![[0, 1, 2], [2, 1, 3]]),
        (6, vec![0, 1, 3, 2], vec![[0, 1, 3], [0, 3, 2]]),
    ] {
        let mut glb = Glb::triangle();
        let positions = glb.floats("VEC3", &square);
        glb.primitive()["attributes"]["POSITION"] = positions.into();
        glb.primitive()["mode"] = json!(mode);
        glb.indices(&indices);
        let scene = glb.scene();
        assert_eq!(scene.meshes[0].triangles, triangles, "mode {mode}");
        for [a, b, c] in &scene.meshes[0].triangles {
            let p = |i: &u32| scene.meshes[0].positions[*i as usize];
            assert!((p(b) - p(a)).cross(p(c) - p(a)).z > 0.0, "mode {mode}");
        }
    }
    let mut glb = Glb::triangle();
    glb.primitive()["mode"] = json!(1);
    let loaded = glb.load();
    assert!(loaded.scene.meshes.is_empty());
    assert!(loaded.warnings[0].contains("meshes[0].primitives[0]") && loaded.warnings[0].contains("lines"));
}

#[test]
fn the_front_stays_in_front() {
    let mut glb = Glb::triangle();
    let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0]);
    glb.primitive()["attributes"]["NORMAL"] = normals.into();
    glb.json["nodes"] = json!([
        {"mesh": 0, "scale": [-1, 2, 1], "translation": [3, 0, 0]},
        {"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0, 0, 0, 4, 1]},
        {"children": [3], "rotation": [0, 1, 0, 0]},
        {"mesh": 0},
    ]);
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    let scene = glb.scene();
    for (mesh, normal) in [(0, Vec3::Z), (1, -Vec3::Z), (2, -Vec3::Z)] {
        assert!(front(&scene, mesh).abs_diff_eq(normal, 1e-6), "mesh {mesh}");
        assert!(scene.meshes[mesh].normals[0].abs_diff_eq(normal, 1e-6), "mesh {mesh}");
    }
    assert_eq!(scene.meshes[0].positions[1], Vec3::new(2.0, 0.0, 0.0));
    assert_eq!(scene.meshes[1].positions[0], Vec3::new(0.0, 0.0, 4.0));
}

#[test]
fn instances_of_the_gpu_extension() {
    let mut glb = Glb::triangle();
    let translations = glb.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 7.0]);
    glb.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": translations}}});
    let scene = glb.scene();
    assert_eq!(scene.meshes.len(), 2);
    assert_eq!(scene.meshes[1].positions[1], Vec3::new(1.0, 0.0, 7.0));
}

#[test]
fn textures_with_transform_and_sampler() {
    let mut glb = Glb::triangle();
    let texture = glb.texture(&png(2, 1, &[[255, 0, 0, 255], [0, 255, 0, 128]]));
    glb.json["samplers"] = json!([{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]);
    glb.json["textures"][0]["sampler"] = json!(0);
    let quarter = std::f32::consts::FRAC_PI_2;
    glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": texture, "extensions": {
        "KHR_texture_transform": {"offset": [0, 1], "rotation": quarter, "scale": [0.5, 0.5], "texCoord": 1}}}},
        "normalTexture": {"index": texture, "scale": 0.3}}]);
    let scene = glb.scene();
    assert_eq!(scene.images.len(), 1);
    assert_eq!(scene.images[0].texels, [[255, 0, 0, 255], [0, 255, 0, 128]]);
    let texture = scene.materials[0].base_color_texture.unwrap();
    assert_eq!((texture.uv_set, texture.nearest, texture.wrap), (1, true, [Wrap::Clamp, Wrap::Mirror]));
    // The extension's example: the lower left quadrant, turned clockwise by 90°.
    for (uv, expected) in [((0.0, 0.0), (0.0, 1.0)), ((1.0, 0.0), (0.0, 0.5)), ((0.0, 1.0), (0.5, 1.0))] {
        let found = texture.transform * Vec2::from(uv) + texture.offset;
        assert!(found.abs_diff_eq(Vec2::from(expected), 1e-6), "{uv:?}: {found}");
    }
    assert_eq!(scene.materials[0].normal_scale, 0.3);
}

#[test]
fn sixteen_bit_images_are_reduced() {
    let mut bytes = Vec::new();
    let mut encoder = ::png::Encoder::new(&mut bytes, 1, 1);
    encoder.set_color(::png::ColorType::Rgb);
    encoder.set_depth(::png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[255, 255, 0, 0, 128, 0]).unwrap();
    let mut glb = Glb::triangle();
    let texture = glb.texture(&bytes);
    glb.json["materials"] = json!([{"emissiveFactor": [1, 1, 1], "emissiveTexture": {"index": texture}}]);
    let [r, g, b, a] = glb.scene().images[0].texels[0];
    assert_eq!((r, g, a), (255, 0, 255));
    assert!((127..=128).contains(&b));
}

#[test]
fn materials() {
    let mut glb = Glb::triangle();
    glb.json["extensionsRequired"] = json!(["KHR_materials_volume", "KHR_materials_specular"]);
    glb.json["materials"] = json!([
        {"name": "glass", "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1},
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0]}}},
        {"name": "pane", "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 0}}},
        {"name": "clear", "extensions": {
            "KHR_materials_transmission": {"transmissionFactor": 1}, "KHR_materials_volume": {"thicknessFactor": 1}}},
        {"name": "lamp", "emissiveFactor": [1, 0.5, 0], "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 20}}},
        {"name": "leaf", "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
         "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0}},
        {"name": "coat", "extensions": {
            "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1, 0, 0]}}},
        {"name": "unlit", "extensions": {"KHR_materials_unlit": {}}},
    ]);
    let materials = glb.scene().materials;
    let glass = &materials[0];
    assert!(glass.volume && glass.transmission == 1.0 && glass.ior == 1.33);
    // Transmittance over the distance is the colour.
    let transmittance = (-glass.absorption * 2.0).map(f32::exp);
    assert!(transmittance.abs_diff_eq(Vec3::new(1.0, 0.5, 0.0), 1e-6) && glass.absorption.is_finite());
    assert!(!materials[1].volume && materials[2].volume && materials[2].absorption == Vec3::ZERO);
    assert_eq!(materials[3].emission, Vec3::new(20.0, 10.0, 0.0));
    let leaf = &materials[4];
    assert_eq!((leaf.alpha, leaf.opacity, leaf.double_sided), (AlphaMode::Mask(0.25), 0.4, true));
    assert_eq!((materials[5].specular, materials[5].specular_color), (0.5, Vec3::X));
    assert_eq!((materials[6].metallic, materials[6].specular), (0.0, 0.0));
}

#[test]
fn cameras_and_lights() {
    let mut glb = Glb::triangle();
    glb.json["cameras"] = json!([
        {"name": "main", "type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5, "znear": 0.01}},
        {"type": "orthographic", "orthographic": {"xmag": 3, "ymag": 2, "znear": 0, "zfar": 10}},
    ]);
    glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"name": "bulb", "type": "point", "intensity": 100, "color": [1, 0.5, 0]},
        {"type": "spot", "intensity": 10, "spot": {"innerConeAngle": 0.2, "outerConeAngle": 0.4}},
        {"type": "directional", "intensity": 5},
    ]}});
    let light = |i: u32| json!({"KHR_lights_punctual": {"light": i}});
    let half = std::f32::consts::FRAC_1_SQRT_2;
    // −z turned about x by −90° is −y.
    let down = json!([-half, 0, 0, half]);
    let nodes = json!([
        {"mesh": 0},
        {"camera": 0, "translation": [0, 1, 5], "scale": [2, 2, 2]},
        {"camera": 1, "rotation": down},
        {"extensions": light(0), "translation": [0, 3, 0]},
        {"name": "bulb", "extensions": light(1), "rotation": down},
        {"extensions": light(2), "rotation": down, "scale": [3, 3, 3]},
    ]);
    glb.json["nodes"] = nodes;
    glb.json.as_object_mut().unwrap().remove("scenes");
    let scene = glb.scene();
    let [main, plan] = &scene.cameras[..] else { panic!("two cameras") };
    assert_eq!((main.name.as_str(), main.aspect), ("main", Some(1.5)));
    assert_eq!(main.projection, Projection::Perspective { yfov: 0.7 });
    assert_eq!(Vec3::from(main.world_from_camera.translation), Vec3::new(0.0, 1.0, 5.0));
    assert_eq!((plan.projection, plan.aspect), (Projection::Orthographic { ymag: 2.0 }, Some(1.5)));
    assert!((-Vec3::from(plan.world_from_camera.matrix3.z_axis)).abs_diff_eq(Vec3::NEG_Y, 1e-6));
    let [point, spot, sun] = &scene.lights[..] else { panic!("three lights") };
    assert_eq!((point.kind, point.intensity), (PunctualKind::Point, Vec3::new(100.0, 50.0, 0.0)));
    assert_eq!(point.position, Vec3::new(0.0, 3.0, 0.0));
    assert_eq!([&point.name, &spot.name, &sun.name], ["bulb", "bulb 1", "light 2"]);
    assert_eq!(spot.kind, PunctualKind::Spot { inner: 0.2, outer: 0.4 });
    assert_eq!((sun.kind, sun.intensity), (PunctualKind::Directional, Vec3::splat(5.0)));
    for light in [spot, sun] {
        assert!(light.direction.abs_diff_eq(Vec3::NEG_Y, 1e-6));
    }
}

#[test]
fn warnings_name_what_is_ignored() {
    let mut glb = Glb::triangle();
    glb.json["extensionsUsed"] = json!(["KHR_materials_clearcoat", "VENDOR_magic"]);
    glb.json["nodes"][0]["skin"] = json!(0);
    push(glb.json.entry("skins"), json!({"joints": [0]}));
    let warnings = glb.load().warnings.join("\n");
    for part in ["KHR_materials_clearcoat", "VENDOR_magic", "nodes[0].skin"] {
        assert!(warnings.contains(part), "{warnings}");
    }
}
