//! Stages that go on with another camera or another scene; what a device has no room for.

use std::sync::Arc;

use glam::Vec3;
use sunfleck::cpu::CpuStages;
use sunfleck::gpu::{Context, GpuStages};
use sunfleck::layout;
use sunfleck::ppm::{Error, Params, Stages};
use sunfleck::scene::{Camera, Environment, PackedScene, Scene};

use super::{SIZE, everything, film_bits, noise_image};
use crate::gpu::context;

/// A render, then others by the same stages: each the same as by stages of its own.
fn camera_can_be_replaced<S: Stages>(mut make: impl FnMut(layout::Camera, [u32; 2]) -> S) {
    let from = |x: f32| Camera::look_at("", Vec3::new(x, 1.5, 4.0), Vec3::new(0.0, 0.5, 0.0), Vec3::Y, 0.9);
    let first = Params { n_paths: 40_000, ..Params::new(SIZE, SIZE) };
    let mut stages = make(from(0.5).pack(SIZE, SIZE), first.film_size());
    film_bits(&mut stages, &first);
    // Of the last, dispatches begin anywhere in a workgroup's pixels.
    for (x, [width, height]) in [(-1.0, [24, 16]), (1.5, [120, 80]), (1.0, [61, 37])] {
        let params = Params { crop: [3, 2, width, height], n_paths: 40_000, ..Params::new(width, height) };
        let camera = from(x).pack(width, height);
        stages.set_camera(camera, params.film_size()).expect("room");
        assert_eq!(stages.camera(), camera);
        let anew = film_bits(&mut make(camera, params.film_size()), &params);
        assert!(film_bits(&mut stages, &params) == anew, "{width}×{height}");
    }
}

#[test]
fn another_camera_is_as_good_as_new_stages_on_the_cpu() {
    let packed = Arc::new(PackedScene::new(&everything()));
    camera_can_be_replaced(|camera, size| CpuStages::new(packed.clone(), camera, size));
}

/// However long the dispatches: those of the first stages are cut, those they are compared with are not.
#[test]
fn another_camera_is_as_good_as_new_stages_on_the_gpu() {
    let Some(context) = context() else { return };
    let packed = PackedScene::new(&everything());
    let mut seconds = 0.0;
    camera_can_be_replaced(|camera, _| {
        let mut stages = GpuStages::new(context.clone(), &packed, camera).expect("stages");
        stages.set_dispatch_seconds(seconds);
        seconds = 10.0;
        stages
    });
}

/// Scenes that share more or less with the one before: each as by stages of its own. `film` is of those with the scene, made or
/// set.
fn scene_can_be_replaced(mut film: impl FnMut(&Arc<PackedScene>, layout::Camera, &Params, bool) -> Vec<u32>) {
    let params = Params { n_paths: 4_000, ..Params::new(24, 16) };
    let mut scene = everything();
    let camera = scene.cameras[0].pack(24, 16);
    // The ones before are still there, as in a window that shows their pictures.
    let mut all = vec![Arc::new(PackedScene::new(&scene))];
    let mut before = film(&all[0], camera, &params, false);
    let changes: [fn(&mut Scene); 11] = [
        |scene| scene.materials[0].base_color = Vec3::new(0.1, 0.2, 0.9),
        |scene| scene.materials[3].emission = Vec3::splat(2.0),
        |scene| scene.environment.as_mut().expect("it has one").strength = 0.5,
        |scene| scene.environment.as_mut().expect("it has one").tint = Vec3::new(0.2, 1.0, 0.3),
        |scene| scene.environment = Some(Environment::uniform(Vec3::new(0.2, 0.4, 0.1))),
        |scene| scene.images[0] = noise_image("larger", 40, 30).into(),
        |scene| scene.spheres[2].radius = 0.7,
        |scene| Arc::make_mut(&mut scene.meshes[1]).positions.iter_mut().for_each(|at| at.x -= 1.0),
        |scene| scene.lights.clear(),
        |scene| scene.environment = None,
        |scene| scene.images[0] = noise_image("small", 2, 2).into(),
    ];
    for (i, change) in changes.into_iter().enumerate() {
        change(&mut scene);
        let packed = Arc::new(PackedScene::new_after(&all[i], &scene));
        let set = film(&packed, camera, &params, true);
        all.push(packed);
        assert!(set == film(&Arc::new(PackedScene::new(&scene)), camera, &params, false), "change {i}");
        assert!(set != before, "change {i} is not seen");
        before = set;
    }
}

#[test]
fn another_scene_is_as_good_as_new_stages_on_the_cpu() {
    let mut first = None;
    scene_can_be_replaced(|packed, camera, params, set| {
        let made = CpuStages::new(packed.clone(), camera, params.film_size());
        replaced(&mut first, made, packed, params, set)
    });
}

#[test]
fn another_scene_is_as_good_as_new_stages_on_the_gpu() {
    let Some(context) = context() else { return };
    let mut first = None;
    scene_can_be_replaced(|packed, camera, params, set| {
        let made = GpuStages::new(context.clone(), packed, camera).expect("stages");
        replaced(&mut first, made, packed, params, set)
    });
}

/// The film of stages that were made with this scene, or of the `first` that were made, to which it is `set`.
fn replaced<S: Stages>(
    first: &mut Option<S>,
    mut made: S,
    packed: &Arc<PackedScene>,
    params: &Params,
    set: bool,
) -> Vec<u32> {
    match first {
        Some(first) if set => {
            first.set_scene(packed).expect("room");
            first.set_camera(made.camera(), params.film_size()).expect("room");
            film_bits(first, params)
        }
        Some(_) => film_bits(&mut made, params),
        None => film_bits(first.insert(made), params),
    }
}

/// Words that are one more than the adapter binds, if a test can allocate so many.
fn too_many_words(context: &Context) -> Option<u64> {
    let n = context.most_bytes_bound() / 4 + 1;
    if n > 1 << 27 {
        println!("skipped: the adapter binds more than this test wants to allocate");
        return None;
    }
    Some(n)
}

/// And what could not be set does no harm.
#[test]
fn a_scene_that_could_not_be_set_can_be_followed_by_another() {
    let Some(context) = context() else { return };
    let Some(n) = too_many_words(&context) else { return };
    let params = Params { n_paths: 4_000, ..Params::new(24, 16) };
    let scene = everything();
    let camera = scene.cameras[0].pack(24, 16);
    let packed = Arc::new(PackedScene::new(&scene));
    let mut stages = GpuStages::new(context, &packed, camera).expect("stages");
    let before = film_bits(&mut stages, &params);
    let mut too_large = PackedScene::clone(&packed);
    too_large.texels = vec![0; n as usize].into();
    assert!(stages.set_scene(&Arc::new(too_large)).is_err());
    stages.set_camera(camera, params.film_size()).expect("room");
    assert!(stages.trace_eye(&params.frame(1)).is_err(), "there is no scene");
    stages.set_scene(&packed).expect("room");
    stages.set_camera(camera, params.film_size()).expect("room");
    assert!(film_bits(&mut stages, &params) == before);
}

/// A map that does not shine is not taken to the device, which has no room for this one.
#[test]
fn a_dark_environment_takes_no_room() {
    let Some(context) = context() else { return };
    let width = 4096;
    let height = (context.most_bytes_bound() / 16 / width + 1) as u32;
    if height > 4096 {
        println!("skipped: the adapter binds more than this test wants to allocate");
        return;
    }
    let texels = Arc::new(vec![Vec3::ONE; width as usize * height as usize]);
    let map = |strength| Environment {
        width: width as u32,
        height,
        texels: texels.clone(),
        rotation: 0.0,
        strength,
        tint: Vec3::ONE,
    };
    let packed = |strength| PackedScene::new(&Scene { environment: Some(map(strength)), ..everything() });
    let stages = |strength| GpuStages::new(context.clone(), &packed(strength), layout::Camera::default());
    assert!(stages(0.0).is_ok());
    assert!(matches!(stages(1.0), Err(Error::TooLarge { .. })));
}

#[test]
fn textures_larger_than_a_binding_are_refused() {
    let Some(context) = context() else { return };
    let Some(n) = too_many_words(&context) else { return };
    let mut scene = PackedScene::new(&everything());
    scene.texels = vec![0; n as usize].into();
    match GpuStages::new(context, &scene, Default::default()) {
        Err(Error::TooLarge { what, needed, .. }) => assert_eq!((what.as_str(), needed), ("texels", 4 * n)),
        Err(other) => panic!("{other}"),
        Ok(_) => panic!("accepted"),
    }
}
