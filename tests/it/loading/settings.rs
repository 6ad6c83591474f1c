//! Settings files.

use super::{Folder, Glb};
use crate::not_found;
use glam::Vec3;
use std::f32::consts::PI;
use std::path::Path;
use std::sync::Arc;
use sunfleck::scene::settings::{Count, FirstRadius, Index, Kernel, Settings, Size};
use sunfleck::scene::{Accelerator, AlphaMode, Environment, Material, Projection, PunctualKind, Scene};

const FULL: &str = r#"
scene = "scene.glb"
size = [640, 480]
photons = "1.5M"
alpha = 0.7
radius = "automatic"
kernel = "constant"
direct = "photons"
index = "hardware"
accel = "kd"
iterations = 64
seconds = 30
seed = 7
exposure = -1
max_segments = 10
light_scale = 2

[camera]
position = [0, 1, 5]
look_at = [0, 1, 0]
yfov_degrees = 30
aperture_radius = 0.01

[environment]
color = [0.5, 0.5, 1.0]
rotation_degrees = 90
strength = 3

[[sphere]]
centre = [0, 1, 0]
radius = 0.5
glass = true
ior = 1.6

[[sphere]]
centre = [0, 0, 0]
radius = 100
inward = true
material = "default"

[[light]]
kind = "spot"
position = [0, 4, 0]
direction = [0, -2, 0]
intensity = 100
color = [1, 0.5, 0]
outer_degrees = 30
"#;

#[test]
fn everything_at_once() {
    let folder = Folder::new();
    let settings = Settings::load(&folder.write("scene.toml", FULL)).unwrap();
    assert_eq!((settings.size, settings.photons), (Some(Size([640, 480])), Some(Count(1_500_000))));
    assert_eq!((settings.radius, settings.kernel), (Some(FirstRadius::Automatic), Some(Kernel::Constant)));
    assert_eq!((settings.index, settings.accel), (Some(Index::Hardware), Some(Accelerator::Kd)));
    let mut scene = Glb::triangle().scene();
    let warnings = settings.apply_to_scene(&mut scene, folder.0.path()).unwrap();
    assert!(warnings.is_empty());
    scene.check().unwrap();
    let camera = &scene.cameras[0];
    assert_eq!(camera.projection, Projection::Perspective { yfov: 30_f32.to_radians() });
    assert_eq!((camera.focus_distance, camera.aperture_radius), (5.0, 0.01));
    let glass = &scene.materials[scene.spheres[0].material];
    assert!(glass.volume && glass.ior == 1.6 && glass.alpha == AlphaMode::Opaque);
    assert_eq!(scene.materials[scene.spheres[1].material].name, "default");
    let light = &scene.lights[0];
    assert_eq!((light.direction, light.intensity), (Vec3::NEG_Y, Vec3::new(200.0, 100.0, 0.0)));
    assert_eq!(light.kind, PunctualKind::Spot { inner: 0.0, outer: 30_f32.to_radians() });
    let environment = scene.environment.unwrap();
    assert_eq!((environment.tint, environment.strength), (Vec3::new(0.5, 0.5, 1.0), 6.0));
    assert_eq!(environment.texels[0], Vec3::ONE);
}

#[test]
fn errors_name_file_line_and_field() {
    let folder = Folder::new();
    for (text, expected) in [
        ("\nphotons = \"many\"\n", ["scene.toml:2:", "photons", "many"]),
        ("photons = 0\n", ["scene.toml:1:", "photons", "0"]),
        ("[camera]\nyfov = 40\n", ["scene.toml:2:", "yfov", "unknown field"]),
        ("[camera]\n\nyfov_degrees = 240\n", ["scene.toml:3:", "camera.yfov_degrees", "240"]),
        ("size = [0, 10]\n", ["scene.toml:1:", "size", "0 × 10"]),
        ("size = [1]\n", ["scene.toml:1:", "size", "length"]),
        ("kernel = \"gauss\"\n", ["scene.toml:1:", "kernel", "gauss"]),
        ("index = \"grid\"\n", ["scene.toml:1:", "index", "expected `tree` or `hardware`"]),
        ("accel = \"grid\"\n", ["scene.toml:1:", "accel", "expected `bvh` or `kd`"]),
        ("radius = -1\n", ["scene.toml:1:", "radius", "-1"]),
        ("alpha = 1.0\n", ["scene.toml:1:", "alpha", "1"]),
        ("[camera]\nup = [0, 0, 0]\n", ["scene.toml:2:", "camera.up", "direction"]),
        ("[environment]\nstrength = -1\n", ["scene.toml:2:", "environment.strength", "-1"]),
        ("[[sphere]]\ncentre = [0, 0, 0]\nradius = nan\n", ["scene.toml:3:", "sphere[0].radius", "NaN"]),
        ("[[sphere]]\nradius = 1\n", ["scene.toml:1:", "sphere[0]", "centre"]),
        ("[[light]]\nkind = \"point\"\nintensity = 1\n", ["scene.toml:1:", "light[0]", "position"]),
        ("seed = 1\nseed = 2\n", ["scene.toml:2:", "seed", "duplicate"]),
        ("seed = \n", ["scene.toml:1:", "", ""]),
    ] {
        let message = Settings::load(&folder.write("scene.toml", text)).unwrap_err().to_string();
        for part in expected {
            assert!(message.contains(part), "{text:?}: {message:?} lacks {part:?}");
        }
    }
    let message = Settings::load(&folder.0.path().join("none.toml")).unwrap_err().to_string();
    assert!(message.contains("none.toml") && message.contains(&not_found()), "{message}");
}

#[test]
fn overrides() {
    let mut settings = Settings::default();
    for assignment in [
        "camera.yfov_degrees=40",
        "photons = 2M",
        "size=800x600",
        "camera.position=[1, 2, 3]",
        "radius=0.01",
        "kernel=constant",
        "index=hardware",
        "accel=bvh",
        "scene=my scene.glb",
    ] {
        settings.set(assignment).unwrap();
    }
    let camera = settings.camera.clone().unwrap();
    assert_eq!((camera.yfov_degrees, camera.position), (Some(40.0), Some([1.0, 2.0, 3.0])));
    assert_eq!((settings.photons, settings.size), (Some(Count(2_000_000)), Some(Size([800, 600]))));
    assert_eq!(settings.radius, Some(FirstRadius::Fixed(0.01)));
    assert_eq!((settings.index, settings.accel), (Some(Index::Hardware), Some(Accelerator::Bvh)));
    assert_eq!(settings.scene.as_deref(), Some("my scene.glb"));
    let before = settings.clone();
    for (assignment, part) in [
        ("photons", "field=value"),
        ("photons=few", "few"),
        ("index=grid", "index: unknown variant `grid`, expected `tree` or `hardware`"),
        ("accel=grid", "accel: unknown variant `grid`, expected `bvh` or `kd`"),
        ("camera.fov=40", "fov"),
        ("camera.yfov_degrees=0", "camera.yfov_degrees"),
        ("sphere.0.radius=1", "sphere"),
        ("scene.x=1", "x"),
    ] {
        let message = settings.set(assignment).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(settings, before);
    let mut settings = Settings::parse(FULL, "scene.toml".as_ref()).unwrap();
    settings.set("sphere.1.radius=5").unwrap();
    assert_eq!(settings.spheres[1].radius, 5.0);
}

/// Its own environment, the sky that a dark scene gets, or none.
#[test]
fn the_scenes_environment_is_changed() {
    let folder = Folder::new();
    let settings = Settings::parse("[environment]\nrotation_degrees = 180", "scene.toml".as_ref()).unwrap();
    let turned = |scene: &Scene| {
        let mut scene = scene.clone();
        settings
            .apply_to_scene(&mut scene, folder.0.path())
            .map(|warnings| (scene.environment.unwrap(), warnings.len()))
    };
    let mut scene = Glb::triangle().scene();
    let (sky, n_warnings) = turned(&scene).unwrap();
    assert_eq!((sky.rotation, sky.strength, n_warnings), (PI, 1.0, 1));
    scene.environment = Some(Environment { strength: 3.0, ..Environment::uniform(Vec3::ONE) });
    let (own, n_warnings) = turned(&scene).unwrap();
    assert_eq!((own.rotation, own.strength, own.texels[0], n_warnings), (PI, 3.0, Vec3::ONE, 0));
    scene.environment = None;
    scene.materials.push(Material::emitter("lamp", Vec3::ONE));
    Arc::make_mut(&mut scene.meshes[0]).material = scene.materials.len() - 1;
    assert!(turned(&scene).unwrap_err().to_string().contains("environment: neither file nor color"));
}

/// Of a scene that comes without light: it stays when a material begins to shine, and gives way to light that is added.
#[test]
fn who_takes_the_place_of_the_sky() {
    let mut scene = Glb::triangle().scene();
    scene.materials.push(Material::emitter("lamp", Vec3::ONE));
    let has_sky = |text: &str| {
        let settings = Settings::parse(text, "scene.toml".as_ref()).unwrap();
        let mut changed = scene.clone();
        let warnings = settings.apply_to_scene(&mut changed, Path::new("")).unwrap();
        let needs_sky = settings.needs_sky(&scene);
        assert_eq!(warnings.iter().any(|w| w.contains("sky")), needs_sky, "{text}");
        assert_eq!(changed.environment.is_some_and(|sky| sky.width > 8), needs_sky, "{text}");
        needs_sky
    };
    let shines = "[[material]]\nname = \"default\"\nemission = [2, 2, 2]\n";
    let sphere = "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\n";
    for text in ["", shines, &format!("{shines}[environment]\nstrength = 2"), sphere] {
        assert!(has_sky(text), "{text}");
    }
    let light = "[[light]]\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = 1";
    let [glow, named] = ["emission = [1, 1, 1]", "material = \"lamp\""].map(|line| format!("{sphere}{line}"));
    for text in [light, &glow, &named, "[environment]\ncolor = [1, 1, 1]"] {
        assert!(!has_sky(text), "{text}");
    }
}

#[test]
fn cameras_and_materials_by_name() {
    let settings = |text: &str| Settings::parse(text, "scene.toml".as_ref()).unwrap();
    let folder = Folder::new();
    let mut scene = Glb::triangle().scene();
    let message = settings("[camera]\nname = \"side\"").apply_to_scene(&mut scene, folder.0.path());
    assert!(message.unwrap_err().to_string().contains("camera.name: there is no camera \"side\""));
    scene.cameras = vec![sunfleck::scene::Camera::look_at("front", Vec3::Z, Vec3::ZERO, Vec3::Y, 1.0)];
    let message = settings("[camera]\nname = \"7\"").apply_to_scene(&mut scene, folder.0.path());
    assert!(message.unwrap_err().to_string().contains("there is no camera \"7\"; there is 0 \"front\""));
    settings("[camera]\nname = \"0\"").apply_to_scene(&mut scene, folder.0.path()).unwrap();
    let text = "[[sphere]]\ncentre = [0, 0, 0]\nradius = 1\nmaterial = \"gold\"";
    let message = settings(text).apply_to_scene(&mut scene, folder.0.path()).unwrap_err().to_string();
    assert!(message.contains("sphere[0].material") && message.contains("\"default\""), "{message}");
    let message = settings("[environment]\nfile = \"none.hdr\"").apply_to_scene(&mut scene, folder.0.path());
    let message = message.unwrap_err().to_string();
    assert!(message.contains("environment.file") && message.contains("none.hdr"), "{message}");
    // A sphere alone is a scene.
    let mut scene = Scene::default();
    let text = "[camera]\n[[sphere]]\ncentre = [0, 0, 0]\nradius = 1";
    settings(text).apply_to_scene(&mut scene, folder.0.path()).unwrap();
    scene.check().unwrap();
    assert_eq!(scene.cameras.len(), 1);
}
