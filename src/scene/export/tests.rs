//! The file says what the scene says.

use std::path::Path;
use std::sync::Arc;

use glam::{Affine3A, Mat2, Quat, Vec2, Vec3, Vec4};

use super::*;
use crate::scene::shipped::{NAMES, shipped};
use crate::scene::{AlphaMode, Image, Material, Sphere, Texture, Wrap, load};

/// Up to the rounding of 32-bit floats.
fn rounded(a: f32, b: f32) -> bool {
    (a - b).abs() <= 2e-6 * a.abs().max(b.abs()).max(1e-3)
}

/// Up to what a sine that rounds otherwise makes of metres, and of the normals of triangles of millimetres.
fn made_elsewhere(a: f32, b: f32) -> bool {
    (a - b).abs() <= 1e-3
}

fn all(a: &[f32], b: &[f32], are_equal: fn(f32, f32) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| are_equal(*a, *b))
}

fn near(a: &[f32], b: &[f32]) -> bool {
    all(a, b, rounded)
}

fn flat<const N: usize>(values: impl IntoIterator<Item = [f32; N]>) -> Vec<f32> {
    values.into_iter().flatten().collect()
}

fn assert_texture(place: &str, a: &Option<Texture>, b: &Option<Texture>) {
    assert_eq!(a.is_some(), b.is_some(), "{place}");
    let (Some(a), Some(b)) = (a, b) else { return };
    assert!(a.image == b.image && a.uv_set == b.uv_set && a.wrap == b.wrap && a.nearest == b.nearest, "{place}");
    assert!(near(&a.transform.to_cols_array(), &b.transform.to_cols_array()), "{place}: {a:?} {b:?}");
    assert!(near(&a.offset.to_array(), &b.offset.to_array()), "{place}: {a:?} {b:?}");
}

fn assert_material(a: &Material, b: &Material) {
    let numbers = |m: &Material| {
        let mut all = vec![m.opacity, m.metallic, m.roughness, m.normal_scale, m.transmission, m.ior, m.specular];
        all.extend(flat([m.base_color, m.emission, m.specular_color].map(|v| v.to_array())));
        all
    };
    assert!(near(&numbers(a), &numbers(b)), "{a:?}\n{b:?}");
    // By way of a colour and a logarithm.
    assert!((a.absorption - b.absorption).abs().max_element() <= 1e-5 * a.absorption.max_element(), "{a:?}\n{b:?}");
    assert!(
        a.name == b.name && a.alpha == b.alpha && a.volume == b.volume && a.double_sided == b.double_sided,
        "{a:?}"
    );
    assert_texture(&a.name, &a.base_color_texture, &b.base_color_texture);
    assert_texture(&a.name, &a.metallic_roughness_texture, &b.metallic_roughness_texture);
    assert_texture(&a.name, &a.normal_texture, &b.normal_texture);
    assert_texture(&a.name, &a.emission_texture, &b.emission_texture);
    assert_texture(&a.name, &a.transmission_texture, &b.transmission_texture);
}

/// `b` is what was read back of `a`, whose meshes have equal numbers.
fn assert_same(a: &Scene, b: &Scene, are_equal: fn(f32, f32) -> bool) {
    assert_eq!(a.meshes.len() + a.spheres.len(), b.meshes.len());
    for (a, b) in a.meshes.iter().zip(&b.meshes) {
        let (place, near) = (&a.name, |a: &[f32], b: &[f32]| all(a, b, are_equal));
        assert_eq!(a.material, b.material, "{place}");
        assert_eq!(a.triangles, b.triangles, "{place}");
        let vec3 = |v: &[Vec3]| flat(v.iter().map(|v| v.to_array()));
        let vec4 = |v: &[Vec4]| flat(v.iter().map(|v| v.to_array()));
        let vec2 = |v: &[Vec2]| flat(v.iter().map(|v| v.to_array()));
        assert!(near(&vec3(&a.positions), &vec3(&b.positions)), "{place}");
        assert!(near(&vec3(&a.normals), &vec3(&b.normals)), "{place}");
        assert!(near(&vec4(&a.tangents), &vec4(&b.tangents)), "{place}");
        assert!(near(&vec2(&a.uv0), &vec2(&b.uv0)) && near(&vec2(&a.uv1), &vec2(&b.uv1)), "{place}");
        assert!(near(&vec4(&a.colors), &vec4(&b.colors)), "{place}");
    }
    // The reader may add the format's default material.
    assert!(b.materials.len() >= a.materials.len());
    for (a, b) in a.materials.iter().zip(&b.materials) {
        assert_material(a, b);
    }
    assert_eq!(a.images.len(), b.images.len());
    for (a, b) in a.images.iter().zip(&b.images) {
        assert!(a.width == b.width && a.height == b.height && a.texels == b.texels, "{}", a.name);
    }
    assert_eq!(a.lights.len(), b.lights.len());
    for (a, b) in a.lights.iter().zip(&b.lights) {
        assert!(near(&a.intensity.to_array(), &b.intensity.to_array()), "{a:?} {b:?}");
        assert!(a.kind == PunctualKind::Point || a.direction.dot(b.direction) > 1.0 - 1e-6, "{a:?} {b:?}");
        assert!(a.kind == PunctualKind::Directional || a.position.distance(b.position) < 1e-5, "{a:?} {b:?}");
        assert_eq!((&a.name, a.kind), (&b.name, b.kind));
    }
    assert_eq!(a.cameras.len(), b.cameras.len());
    for (a, b) in a.cameras.iter().zip(&b.cameras) {
        assert!(a.name == b.name && a.projection == b.projection && a.aspect == b.aspect, "{a:?} {b:?}");
        assert!(a.world_from_camera.abs_diff_eq(b.world_from_camera, 1e-5), "{a:?} {b:?}");
    }
}

fn through_a_file(scene: &Scene) -> Scene {
    let folder = tempfile::tempdir().expect("a folder for temporary files");
    let path = folder.path().join("scene.glb");
    write_glb(scene, &path).expect("a scene that can be written");
    load::load(&path).expect("a file that can be read").scene
}

#[test]
fn shipped_scenes_come_back() {
    for name in NAMES {
        let scene = shipped(name).expect("a shipped name");
        let mut expected = scene.clone();
        expected.environment = None;
        assert_same(&expected, &through_a_file(&scene), rounded);
    }
}

#[test]
fn same_scene_same_bytes() {
    let bytes = || glb_bytes(&shipped("fireplace").expect("a shipped name")).expect("a scene that can be written");
    assert!(bytes() == bytes());
}

/// A scene with a bit of everything.
fn everything() -> Scene {
    let mut texture = Texture::new(0);
    texture.transform = Mat2::from_angle(0.4) * Mat2::from_diagonal(Vec2::new(2.0, -3.0));
    texture.offset = Vec2::new(0.25, -0.5);
    texture.wrap = [Wrap::Mirror, Wrap::Clamp];
    texture.nearest = true;
    texture.uv_set = 1;
    let material = Material {
        name: "everything".into(),
        base_color: Vec3::new(0.1, 0.2, 0.3),
        opacity: 0.5,
        base_color_texture: Some(texture),
        alpha: AlphaMode::Mask(0.25),
        metallic: 0.125,
        roughness: 0.7,
        metallic_roughness_texture: Some(Texture::new(1)),
        normal_texture: Some(Texture::new(1)),
        normal_scale: 0.75,
        emission: Vec3::new(0.5, 120.0, 3.0),
        emission_texture: Some(Texture::new(0)),
        transmission: 0.875,
        transmission_texture: Some(Texture::new(1)),
        ior: 1.345 / 1.5,
        specular: 0.5,
        specular_color: Vec3::new(1.0, 0.5, 0.25),
        volume: true,
        absorption: Vec3::new(0.0, 4.5, 115.0),
        double_sided: false,
    };
    let image = |name: &str, alpha: u8| Image {
        name: name.into(),
        width: 2,
        height: 3,
        texels: (0..6).map(|i| [i, 2 * i, 255 - i, alpha.saturating_add(i)]).collect(),
    };
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh {
        name: "triangle".into(),
        positions: corners.to_vec(),
        normals: vec![Vec3::Z; 3],
        tangents: vec![Vec4::new(1.0, 0.0, 0.0, -1.0); 3],
        uv0: corners.map(Vec3::truncate).to_vec(),
        uv1: corners.map(|c| c.truncate() * 2.0).to_vec(),
        colors: vec![Vec4::new(0.5, 0.25, 1.0, 0.75); 3],
        triangles: vec![[0, 1, 2]],
        material: 0,
    };
    let light = |kind| PunctualLight {
        name: format!("a {kind:?}"),
        position: Vec3::new(1.0, 2.0, 3.0),
        direction: Vec3::new(1.0, -2.0, 0.5).normalize(),
        intensity: Vec3::new(10.0, 5.0, 2.5),
        kind,
    };
    let camera = |name: &str, projection| Camera {
        name: name.into(),
        world_from_camera: Affine3A::from_rotation_translation(Quat::from_rotation_x(0.4), Vec3::new(0.0, 1.0, 5.0)),
        projection,
        aperture_radius: 0.0,
        focus_distance: 1.0,
        aspect: Some(1.5),
    };
    Scene {
        meshes: vec![mesh.into()],
        spheres: Vec::new(),
        materials: vec![material, Material::diffuse("plain", Vec3::splat(0.5))],
        images: vec![image("opaque", 255).into(), image("seen through", 40).into()],
        lights: vec![
            light(PunctualKind::Point),
            light(PunctualKind::Spot { inner: 0.25, outer: 0.5 }),
            light(PunctualKind::Directional),
        ],
        environment: None,
        cameras: vec![
            camera("perspective", Projection::Perspective { yfov: 0.75 }),
            camera("parallel", Projection::Orthographic { ymag: 2.0 }),
        ],
    }
}

#[test]
fn everything_comes_back() {
    let scene = everything();
    assert_same(&scene, &through_a_file(&scene), rounded);
}

#[test]
fn spheres_become_meshes() {
    let mut scene = everything();
    let sphere = |inward| Sphere { centre: Vec3::Y, radius: 0.5, inward, material: 1 };
    scene.spheres = vec![sphere(false), sphere(true)];
    let back = through_a_file(&scene);
    assert_eq!(back.meshes.len(), 3);
    for (mesh, sign) in back.meshes[1..].iter().zip([1.0, -1.0]) {
        for (p, n) in mesh.positions.iter().zip(&mesh.normals) {
            assert!(((*p - Vec3::Y) * 2.0 * sign).distance(*n) < 1e-4);
        }
    }
}

#[test]
fn what_cannot_be_said_is_an_error() {
    let mut sheared = everything();
    sheared.materials[0].emission_texture.as_mut().expect("set above").transform =
        Mat2::from_cols(Vec2::new(1.0, 0.0), Vec2::new(0.5, 1.0));
    assert!(matches!(glb_bytes(&sheared), Err(ExportError::ShearedTexture { .. })));
    let mut dangling = everything();
    Arc::make_mut(&mut dangling.meshes[0]).triangles[0][1] = 3;
    assert!(matches!(glb_bytes(&dangling), Err(ExportError::Dangling { .. })));
    let mut dangling = everything();
    Arc::make_mut(&mut dangling.meshes[0]).material = 2;
    assert!(matches!(glb_bytes(&dangling), Err(ExportError::Dangling { .. })));
    let mut infinite = everything();
    Arc::make_mut(&mut infinite.meshes[0]).positions[1].x = f32::NAN;
    assert!(matches!(glb_bytes(&infinite), Err(ExportError::NotFinite { .. })));
    let nowhere = Path::new("no such folder/scene.glb");
    assert!(matches!(write_glb(&everything(), nowhere), Err(ExportError::Io { .. })));
}

#[test]
fn an_empty_scene_is_a_file() {
    assert!(glb_bytes(&Scene::default()).is_ok_and(|bytes| bytes.starts_with(b"glTF")));
}

/// The files in `scenes/` are what the code makes. Another system's sine may round otherwise: then the contents count.
#[test]
fn committed_files_are_up_to_date() {
    for name in NAMES {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(name);
        let path = folder.join(name).with_extension("glb");
        let mut scene = shipped(name).expect("a shipped name");
        let committed = std::fs::read(&path).expect("a file in the repository");
        assert!(committed.len() < 12_000_000, "{} bytes", committed.len());
        let advice = format!("run: sunfleck export {name} -o {}", path.display());
        let environment = scene.environment.take();
        if committed != glb_bytes(&scene).expect("a scene that can be written") {
            println!("{advice}");
            assert_same(&scene, &load::load(&path).expect("a file that can be read").scene, made_elsewhere);
        }
        let Some(environment) = environment else { continue };
        let beside = tempfile::NamedTempFile::with_suffix(".hdr").expect("a temporary file");
        write_environment_hdr(&environment, beside.path()).expect("an environment that can be written");
        let (made, committed) = (std::fs::read(beside.path()), std::fs::read(path.with_extension("hdr")));
        assert!(made.expect("just written") == committed.expect("a file in the repository"), "{advice}");
    }
}

#[test]
fn nodes_have_names_of_their_own() {
    let mut scene = everything();
    scene.meshes.push(scene.meshes[0].clone());
    Arc::make_mut(&mut scene.meshes[0]).name = "parallel".into();
    let bytes = glb_bytes(&scene).expect("a scene that can be written");
    let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
    let document: Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    let nodes = document["nodes"].as_array().expect("nodes");
    let names: BTreeSet<_> = nodes.iter().map(|n| n["name"].to_string()).collect();
    assert_eq!(names.len(), nodes.len());
    assert!(names.contains("\"perspective\"") && names.contains("\"parallel\"") && names.contains("\"parallel 2\""));
}
