//! Settings that change what a scene has, and settings as text.

use super::{Folder, Glb};
use glam::Vec3;
use proptest::option::of;
use proptest::prelude::*;
use serde_json::json;
use sunfleck::scene::settings::{
    CameraSettings, Count, Direct, EnvironmentSettings, FirstRadius, Index, Kernel, LightKind, LightSettings,
    MaterialSettings, SceneLightSettings, Settings, Size, SphereSettings,
};
use sunfleck::scene::{Accelerator, Camera, Projection, Scene};

/// Materials "floor", "lamp" and two of the name "twin", lights "bulb" and "sun".
fn scene() -> Scene {
    let mut glb = Glb::triangle();
    let material = |name: &str| json!({"name": name, "emissiveFactor": [1, 0.5, 0]});
    glb.json["materials"] = json!([material("floor"), material("lamp"), material("twin"), material("twin")]);
    glb.primitive()["material"] = 0.into();
    let light = |name: &str, kind: &str| json!({"name": name, "type": kind, "intensity": 2, "color": [1, 0.5, 0.5]});
    glb.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [light("bulb", "point"), light("sun", "directional")]}});
    let node = |i: u32| json!({"extensions": {"KHR_lights_punctual": {"light": i}}});
    glb.json["nodes"] = json!([{"mesh": 0}, node(0), node(1)]);
    glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
    let scene = glb.scene();
    assert!(scene.materials.len() >= 4 && scene.lights.len() == 2);
    scene
}

fn parse(text: &str) -> Settings {
    Settings::parse(text, "scene.toml".as_ref()).unwrap()
}

fn apply(settings: &Settings) -> Scene {
    let mut scene = scene();
    settings.apply_to_scene(&mut scene, "".as_ref()).unwrap();
    scene.check().unwrap();
    scene
}

#[test]
fn materials_and_lights_of_the_scene_are_changed() {
    let changed = apply(&parse(
        r#"
        light_scale = 2
        [[material]]
        name = "floor"
        base_color = [0.1, 0.2, 0.3]
        roughness = 0.25
        metallic = 0.5
        transmission = 0.75
        volume = true
        ior = 1.4
        specular = 0.125
        absorption = [1, 2, 3]
        [[material]]
        index = 1
        emission_strength = 3
        [[material]]
        name = "twin"
        emission = [0, 0, 4]
        emission_strength = 0.5
        [[scene_light]]
        name = "bulb"
        on = false
        [[scene_light]]
        index = 1
        strength = 0.5
        color = [0, 0, 1]
        [[sphere]]
        centre = [0, 0, 0]
        radius = 1
        material = "floor"
        "#,
    ));
    let before = scene();
    let floor = &changed.materials[0];
    assert_eq!((floor.base_color, floor.absorption), (Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.0, 2.0, 3.0)));
    assert_eq!((floor.roughness, floor.metallic, floor.transmission), (0.25, 0.5, 0.75));
    assert_eq!((floor.volume, floor.ior, floor.specular), (true, 1.4, 0.125));
    assert_eq!(floor.emission, before.materials[0].emission * 2.0);
    assert_eq!(changed.materials[1].emission, before.materials[1].emission * 6.0);
    assert_eq!(changed.materials[1].base_color, before.materials[1].base_color);
    for twin in &changed.materials[2..4] {
        assert_eq!(twin.emission, Vec3::new(0.0, 0.0, 4.0));
    }
    assert_eq!(changed.spheres[0].material, 0);
    assert_eq!(changed.lights[0].intensity, Vec3::ZERO);
    // Blue, as bright as before, halved by itself and doubled by the factor on all.
    let luminance = |c: Vec3| c.dot(Vec3::new(0.2126, 0.7152, 0.0722));
    let sun = changed.lights[1].intensity;
    assert!(
        sun.x == 0.0 && sun.y == 0.0 && (luminance(sun) / luminance(before.lights[1].intensity) - 1.0).abs() < 1e-6
    );
}

#[test]
fn what_is_not_there_is_said() {
    for (text, parts) in [
        ("[[material]]\nname = \"gold\"", ["material[0].name", "no material \"gold\"", "0 \"floor\", 1 \"lamp\""]),
        ("[[material]]\nindex = 99", ["material[0].index", "no material 99", "3 \"twin\""]),
        ("[[scene_light]]\nname = \"moon\"", ["scene_light[0].name", "no light \"moon\"", "0 \"bulb\", 1 \"sun\""]),
        ("[[scene_light]]\nname=\"sun\"\n[[scene_light]]\nindex = 2", ["scene_light[1].index", "no light 2", "bulb"]),
    ] {
        let message = parse(text).apply_to_scene(&mut scene(), "".as_ref()).unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
    let dark = parse("[[scene_light]]\nindex = 0").apply_to_scene(&mut Scene::default(), "".as_ref());
    assert!(dark.unwrap_err().to_string().contains("there is none"));
    let folder = Folder::new();
    for (text, expected) in [
        ("[[material]]\nroughness = 0.5\n", ["scene.toml:1:", "material[0]", "name or an index"]),
        ("[[material]]\nname = \"a\"\nindex = 0\n", ["scene.toml:1:", "material[0]", "not both"]),
        ("[[material]]\nname = \"a\"\nroughness = 2\n", ["scene.toml:3:", "material[0].roughness", "2"]),
        ("[[material]]\nname = \"a\"\nbase_color = [0, 0, 2]\n", ["scene.toml:3:", "material[0].base_color", "1"]),
        ("[[material]]\nname = \"a\"\nior = 0\n", ["scene.toml:3:", "material[0].ior", "positive"]),
        ("[[material]]\nname = \"a\"\nemission = [-1, 0, 0]\n", ["scene.toml:3:", "material[0].emission", "-1"]),
        ("[[material]]\nname = \"a\"\nshine = 2\n", ["scene.toml:3:", "shine", "unknown field"]),
        ("[[scene_light]]\nname = \"a\"\ncolor = [0, 0, 0]\n", ["scene.toml:3:", "scene_light[0].color", "black"]),
        ("[[scene_light]]\nname = \"a\"\nstrength = -1\n", ["scene.toml:3:", "scene_light[0].strength", "-1"]),
        ("[camera]\nyfov_degrees = 40\nymag = 1\n", ["scene.toml:3:", "camera.ymag", "exclude"]),
    ] {
        let message = Settings::load(&folder.write("scene.toml", text)).unwrap_err().to_string();
        assert!(expected.iter().all(|part| message.contains(part)), "{text:?}: {message:?}");
    }
}

#[test]
fn overrides_by_name() {
    let mut settings = Settings::default();
    for assignment in [
        "material.floor.roughness=0.25",
        "material.floor.base_color=[0.5, 0, 0]",
        "material.\"a.b = c\".ior=1.25",
        "material.red wall.metallic=1",
        "material.3={index=7, specular=0}",
        "scene_light.sun.on=false",
        "sphere.0={centre=[0, 1, 0], radius=0.5}",
        "sphere.0.glass=true",
        "seed=3",
        "seed=",
    ] {
        settings.set(assignment).unwrap_or_else(|e| panic!("{assignment}: {e}"));
    }
    let names: Vec<_> = settings.materials.iter().map(|m| m.name.as_deref()).collect();
    assert_eq!(names, [Some("floor"), Some("a.b = c"), Some("red wall"), None]);
    let floor = &settings.materials[0];
    assert_eq!((floor.roughness, floor.base_color), (Some(0.25), Some([0.5, 0.0, 0.0])));
    assert_eq!((settings.materials[1].ior, settings.materials[3].index), (Some(1.25), Some(7)));
    assert_eq!((settings.scene_lights[0].on, settings.seed), (Some(false), None));
    assert_eq!((settings.spheres.len(), settings.spheres[0].glass), (1, Some(true)));
    let before = settings.clone();
    for (assignment, part) in [
        ("material.floor.roughness=2", "material[0].roughness"),
        ("material.9.roughness=0.5", "the settings have 4"),
        ("material.4.roughness=0.5", "name or an index"),
        ("sphere.ball.radius=1", "ball"),
        ("sphere.0.radius=", "radius"),
        ("photons=", "not set"),
        ("material.gold=", "gold"),
        ("camera.name.x=", "not set"),
    ] {
        let message = settings.set(assignment).unwrap_err().to_string();
        assert!(message.contains(part), "{assignment}: {message}");
    }
    assert_eq!(settings, before);
    settings.set("material.floor=").unwrap();
    settings.set("material.2=").unwrap();
    settings.set("sphere.0.glass=").unwrap();
    assert_eq!((settings.materials.len(), settings.spheres[0].glass), (2, None));
}

#[test]
fn changes_are_found_again() {
    let scene = scene();
    let mut settings = Settings::default();
    settings.material_mut(&scene, 0).roughness = Some(0.5);
    settings.material_mut(&scene, 2).roughness = Some(0.25);
    settings.material_mut(&scene, 0).metallic = Some(1.0);
    settings.scene_light_mut(&scene, 1).strength = Some(2.0);
    settings.scene_light_mut(&scene, 1).on = Some(false);
    let [floor, twin] = &settings.materials[..] else { panic!("{settings:?}") };
    assert_eq!((floor.name.as_deref(), floor.roughness, floor.metallic), (Some("floor"), Some(0.5), Some(1.0)));
    assert_eq!((twin.name.as_deref(), twin.index), (None, Some(2)));
    assert_eq!((settings.scene_lights.len(), settings.scene_lights[0].name.as_deref()), (1, Some("sun")));
    let changed = apply(&settings);
    assert_eq!((changed.materials[2].roughness, changed.materials[3].roughness), (0.25, scene.materials[3].roughness));
}

/// What is shown of a thing is what all items do to it, and an edit is over them all.
#[test]
fn several_changes_of_one_thing_become_one() {
    let scene = scene();
    let text = "\
        [[material]]\nindex = 0\nroughness = 0.25\nior = 2\nemission = [1, 2, 3]\nemission_strength = 5\n\
        [[material]]\nindex = 2\nroughness = 0.5\n\
        [[material]]\nname = \"floor\"\nmetallic = 1\nior = 3\nemission_strength = 2\n\
        [[material]]\nindex = 0\nvolume = true\nemission_strength = 0.5\n\
        [[scene_light]]\nname = \"sun\"\nstrength = 4\non = false\n\
        [[scene_light]]\nindex = 1\nstrength = 0.5\non = true\ncolor = [1, 0, 0]\n";
    let file = parse(text);
    let mut settings = file.clone();
    let floor = settings.material_mut(&scene, 0).clone();
    assert_eq!(
        (floor.roughness, floor.metallic, floor.ior, floor.volume),
        (Some(0.25), Some(1.0), Some(3.0), Some(true))
    );
    assert_eq!((floor.emission, floor.emission_strength), (Some([1.0, 2.0, 3.0]), Some(5.0)));
    let sun = settings.scene_light_mut(&scene, 1).clone();
    assert_eq!((sun.strength, sun.on, sun.color), (Some(2.0), Some(false), Some([1.0, 0.0, 0.0])));
    assert_eq!((settings.materials.len(), settings.scene_lights.len()), (2, 1));
    let changed = |settings: &Settings| {
        let Scene { materials, lights, .. } = apply(settings);
        format!("{materials:?} {lights:?}")
    };
    assert_eq!(changed(&settings), changed(&file));
    settings.material_mut(&scene, 0).roughness = Some(0.75);
    assert_eq!(apply(&settings).materials[0].roughness, 0.75);
    // What changes others as well keeps its place among them.
    let name = scene.materials[2].name.clone();
    let text = "[[material]]\nindex = 2\nroughness = 0.25\n[[material]]\nname = NAME\nroughness = 0.5\n\
        [[material]]\nindex = 2\nmetallic = 1\n[[material]]\nindex = 2\nior = 2\n";
    let file = parse(&text.replace("NAME", &format!("{name:?}")));
    let mut settings = file.clone();
    let twin = settings.material_mut(&scene, 2).clone();
    assert_eq!((twin.metallic, twin.ior, settings.materials.len()), (Some(1.0), Some(2.0), 3));
    assert_eq!(changed(&settings), changed(&file));
    // Without its own changes it is as those of all of its name make it.
    let without = settings.material_without(&scene, 2);
    assert_eq!((without.roughness, without.ior), (0.5, scene.materials[2].ior));
    assert_eq!(settings.material_without(&scene, 0).roughness, scene.materials[0].roughness);
    let without = settings.scene_light_without(&scene, 1);
    assert_eq!(without.intensity, scene.lights[1].intensity);
    let mut twins = scene.clone();
    twins.lights[0].name = scene.lights[1].name.clone();
    let text = "[[scene_light]]\nname = \"sun\"\ncolor = [1, 0, 0]\n[[scene_light]]\nindex = 1\ncolor = [0, 1, 0]\n";
    let red = parse(text).scene_light_without(&twins, 1).intensity;
    assert!(red.x > 0.0 && red.y == 0.0, "{red}");
}

#[test]
fn text_is_short() {
    let mut settings = Settings { alpha: Some(0.3), seconds: Some(0.1), ..Settings::default() };
    settings.camera = Some(CameraSettings { position: Some([0.1, 2.0, -1e-3]), ..CameraSettings::default() });
    settings.kernel = Some(Kernel::Constant);
    let text = "alpha = 0.3\nkernel = \"constant\"\nseconds = 0.1\n\n[camera]\nposition = [0.1, 2.0, -0.001]\n";
    assert_eq!(settings.to_toml(), text);
    let pairs = ["alpha=0.3", "camera.position=[0.1, 2.0, -0.001]", "kernel=constant", "seconds=0.1"];
    assert_eq!(settings.difference(&Settings::default()), pairs);
    let back = ["alpha=", "camera=", "kernel=", "seconds="];
    assert_eq!(Settings::default().difference(&settings), back);
    let mut tuned = settings.clone();
    tuned.set("material.red.roughness=0.2").unwrap();
    tuned.set("material.dark red.roughness=0.4").unwrap();
    let pairs = ["material.red.roughness=0.2", "material.\"dark red\".roughness=0.4"];
    assert_eq!(tuned.difference(&settings), pairs);
    // What would be refused on the way goes in one piece.
    let camera = |text| parse(&format!("[camera]\n{text}"));
    let there = camera("position = [0, 0, 1]\nlook_at = [0, 0, 0]");
    let back = camera("position = [0, 0, 0]\nlook_at = [0, 0, 1]");
    assert_eq!(back.difference(&there), ["camera={ look_at = [0.0, 0.0, 1.0], position = [0.0, 0.0, 0.0] }"]);
}

#[test]
fn a_camera_becomes_settings() {
    let tilted = Camera {
        aperture_radius: 0.02,
        ..Camera::look_at("", Vec3::new(900.1, 1.3, 2.7), Vec3::new(899.0, 0.2, 0.9), Vec3::new(0.3, 1.0, 0.1), 0.61)
    };
    let down = Camera::look_at("", Vec3::new(0.3, 5.0, 0.1), Vec3::new(0.3, 0.0, 0.1), Vec3::Z, 1.1);
    let plan = Camera { projection: Projection::Orthographic { ymag: 2.3 }, ..tilted.clone() };
    for camera in [tilted, down, plan] {
        // Over a scene's own camera, and by way of the command line.
        let mut settings = Settings::default();
        for pair in (Settings { camera: Some((&camera).into()), ..Settings::default() }).difference(&settings.clone()) {
            settings.set(&pair).unwrap();
        }
        let mut scene = scene();
        scene.cameras.push(Camera::look_at("own", Vec3::ONE, Vec3::ZERO, Vec3::X, 0.3));
        settings.apply_to_scene(&mut scene, "".as_ref()).unwrap();
        let (a, b) = (scene.cameras[0].pack(40, 30), camera.pack(40, 30));
        assert_eq!((a.position, a.orthographic), (b.position, b.orthographic));
        assert_eq!((a.aperture_radius, a.focus_distance), (b.aperture_radius, b.focus_distance));
        for (a, b) in [(a.right, b.right), (a.up, b.up), (a.forward, b.forward)] {
            assert!(Vec3::from(a).abs_diff_eq(b.into(), 3e-7), "{a:?} {b:?}");
        }
        assert!((a.half_height / b.half_height - 1.0).abs() < 1e-6 && (a.half_width / b.half_width - 1.0).abs() < 1e-6);
    }
}

fn unit() -> impl Strategy<Value = f32> {
    0.0f32..=1.0
}

fn color() -> impl Strategy<Value = [f32; 3]> {
    [0.0f32..1.0, 0.0f32..1.0, 0.001f32..1.0]
}

fn point() -> impl Strategy<Value = [f32; 3]> {
    [-50.0f32..50.0, -1e-3f32..1e-3, 1e3f32..1e9]
}

fn name() -> impl Strategy<Value = String> {
    prop_oneof![
        Just("floor"),
        Just("red wall"),
        Just("a.b"),
        Just("x=\"1\\\""),
        Just("7"),
        Just("true"),
        Just("it's"),
        Just("höher"),
        Just("two\nlines"),
        Just(""),
        Just(" edge "),
        Just("[1]")
    ]
    .prop_map(str::to_owned)
}

/// Name or index.
fn target() -> impl Strategy<Value = (Option<String>, Option<usize>)> {
    prop_oneof![name().prop_map(|name| (Some(name), None)), (0usize..9).prop_map(|index| (None, Some(index)))]
}

fn material() -> impl Strategy<Value = MaterialSettings> {
    (target(), of(color()), of(unit()), of(unit()), of(any::<bool>()), of(0.1f32..3.0), of(color())).prop_map(
        |((name, index), base_color, roughness, transmission, volume, ior, emission)| MaterialSettings {
            name,
            index,
            base_color,
            roughness,
            transmission,
            volume,
            ior,
            emission,
            ..MaterialSettings::default()
        },
    )
}

fn scene_light() -> impl Strategy<Value = SceneLightSettings> {
    (target(), of(any::<bool>()), of(0.0f32..1e6), of(color()))
        .prop_map(|((name, index), on, strength, color)| SceneLightSettings { name, index, on, strength, color })
}

fn camera() -> impl Strategy<Value = CameraSettings> {
    let direction = || [0.1f32..1.0, -1.0f32..1.0, -1.0f32..1.0];
    let aim = prop_oneof![
        Just((None, None)),
        point().prop_map(|at| (Some(at), None)),
        direction().prop_map(|forward| (None, Some(forward))),
    ];
    let view = prop_oneof![
        Just((None, None)),
        (1.0f32..179.0).prop_map(|a| (Some(a), None)),
        unit().prop_map(|a| (None, Some(a + 0.1)))
    ];
    (of(name()), of(point()), aim, of(direction()), view, of(unit()), of(0.1f32..9.0)).prop_map(
        |(name, position, (look_at, forward), up, (yfov_degrees, ymag), aperture_radius, focus_distance)| {
            let look_at = look_at.filter(|at| Some(*at) != position);
            CameraSettings { name, position, look_at, forward, up, yfov_degrees, ymag, aperture_radius, focus_distance }
        },
    )
}

fn environment() -> impl Strategy<Value = EnvironmentSettings> {
    (of(name()), of(-360.0f32..360.0), of(unit()), color(), any::<bool>()).prop_map(
        |(file, rotation_degrees, strength, color, colored)| {
            let color = colored.then_some(color);
            EnvironmentSettings { file, rotation_degrees, strength, color }
        },
    )
}

fn sphere() -> impl Strategy<Value = SphereSettings> {
    (point(), 0.1f32..9.0, any::<bool>(), of(name()), of(any::<bool>()), of(color())).prop_map(
        |(centre, radius, inward, material, glass, base_color)| {
            let own = material.is_none();
            let (glass, base_color) = (glass.filter(|_| own), base_color.filter(|_| own));
            SphereSettings { centre, radius, inward, material, glass, base_color, ..SphereSettings::default() }
        },
    )
}

fn light() -> impl Strategy<Value = LightSettings> {
    let kind = prop_oneof![Just(LightKind::Point), Just(LightKind::Spot), Just(LightKind::Directional)];
    (kind, point(), 0.0f32..1e5, of(color()), of((0.0f32..40.0, 0.5f32..50.0))).prop_map(
        |(kind, at, intensity, color, cone)| LightSettings {
            kind,
            position: Some(at),
            direction: Some(at),
            intensity,
            color,
            inner_degrees: cone.map(|(inner, _)| inner),
            outer_degrees: cone.map(|(inner, more)| inner + more),
        },
    )
}

fn settings() -> impl Strategy<Value = Settings> {
    let radius = prop_oneof![Just(FirstRadius::Automatic), (1e-4f32..1.0).prop_map(FirstRadius::Fixed)];
    let scalars = (
        of(name()),
        of((1u32..9000, 1u32..9000)),
        of(1u32..=u32::MAX),
        of(0.01f32..0.99),
        of(radius),
        of(0.001f64..1e5),
        of(any::<u32>()),
        of(-8.0f32..8.0),
        of(prop_oneof![Just(Direct::Sampled), Just(Direct::Photons)]),
        of(prop_oneof![Just(Index::Tree), Just(Index::Hardware)]),
        of(prop_oneof![Just(Accelerator::Bvh), Just(Accelerator::Kd)]),
    );
    let list = 0..4usize;
    let lists = (
        proptest::collection::vec(material(), list.clone()),
        proptest::collection::vec(scene_light(), list.clone()),
        proptest::collection::vec(sphere(), list.clone()),
        proptest::collection::vec(light(), list),
    );
    (scalars, of(camera()), of(environment()), lists).prop_map(
        |(
            (scene, size, photons, alpha, radius, seconds, seed, exposure, direct, index, accel),
            camera,
            environment,
            (materials, scene_lights, spheres, lights),
        )| Settings {
            scene,
            size: size.map(|(width, height)| Size([width, height])),
            photons: photons.map(Count),
            alpha,
            radius,
            seconds,
            seed,
            exposure,
            direct,
            index,
            accel,
            camera,
            environment,
            materials,
            scene_lights,
            spheres,
            lights,
            ..Settings::default()
        },
    )
}

/// Like `a`, but with some parts of `b`.
fn mixed(a: &Settings, b: &Settings, parts: u32) -> Settings {
    let has = |part: u32| parts >> part & 1 == 1;
    let mut mixed = a.clone();
    if has(0) {
        mixed.camera = b.camera.clone();
    }
    if let (true, Some(ours), Some(theirs)) = (has(1), &mut mixed.camera, &b.camera) {
        ours.position = theirs.position;
        ours.look_at = ours.look_at.filter(|at| Some(*at) != ours.position);
    }
    if let (true, Some(ours), Some(theirs)) = (has(2), mixed.materials.first_mut(), b.materials.first()) {
        *ours = MaterialSettings { name: ours.name.clone(), index: ours.index, ..theirs.clone() };
    }
    if has(3) {
        mixed.materials.extend(b.materials.iter().cloned());
    }
    if has(4) {
        mixed.lights.clone_from(&b.lights);
    }
    if has(5) {
        mixed.environment = b.environment.clone();
    }
    if has(6) {
        mixed.seed = b.seed;
        mixed.scene.clone_from(&b.scene);
    }
    mixed
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(150) })]

    #[test]
    fn a_file_says_it_all(settings in settings()) {
        let text = settings.to_toml();
        prop_assert_eq!(parse(&text), settings, "{}", text);
    }

    #[test]
    fn differences_turn_one_into_the_other(a in settings(), b in settings(), parts in any::<u32>()) {
        for (from, to) in [(&a, &b), (&a, &mixed(&a, &b, parts)), (&a, &a)] {
            let pairs = to.difference(from);
            let mut now = from.clone();
            for pair in &pairs {
                prop_assert!(now.set(pair).is_ok(), "{}: {:?}", pair, pairs);
            }
            prop_assert_eq!(&now, to, "{:?}", pairs);
            prop_assert_eq!(pairs.is_empty(), from == to);
        }
    }
}

#[test]
fn changes_by_hand_are_taken_over_to_another_file() {
    let parse = |text: &str| Settings::parse(text, "a.toml".as_ref()).unwrap();
    let before = parse(
        "alpha = 0.6\nphotons = 200\nseed = 3\n[camera]\nyfov_degrees = 40\n\
         [[material]]\nname = \"a\"\nroughness = 0.1\n[[material]]\nname = \"b\"\nior = 1.2\n\
         [[scene_light]]\nindex = 3\nstrength = 2\n",
    );
    let now = parse(
        "alpha = 0.8\nphotons = 300\nseed = 3\n[camera]\nyfov_degrees = 50\n\
         [[material]]\nname = \"new\"\nmetallic = 1\n[[material]]\nname = \"a\"\nroughness = 0.2\n\
         [[scene_light]]\nindex = 1\non = false\n[[scene_light]]\nindex = 3\nstrength = 2\n",
    );
    assert_eq!(before.rebased(&before, &now), now);
    let mut mine = before.clone();
    for pair in ["photons=7", "seed=", "material.b.ior=1.4", "material.c.roughness=0.5", "scene_light.0.strength=5"] {
        mine.set(pair).unwrap();
    }
    let rebased = mine.rebased(&before, &now);
    let expected = parse(
        "alpha = 0.8\nphotons = 7\n[camera]\nyfov_degrees = 50\n\
         [[material]]\nname = \"new\"\nmetallic = 1\n[[material]]\nname = \"a\"\nroughness = 0.2\n\
         [[material]]\nname = \"b\"\nior = 1.4\n[[material]]\nname = \"c\"\nroughness = 0.5\n\
         [[scene_light]]\nindex = 1\non = false\n[[scene_light]]\nindex = 3\nstrength = 5\n",
    );
    assert_eq!(rebased, expected, "{}", rebased.to_toml());
    // Taken out by hand, and changed in the file meanwhile.
    mine.set("material.0=").unwrap();
    assert!(mine.rebased(&before, &now).materials.iter().all(|m| m.name.as_deref() != Some("a")));
}
