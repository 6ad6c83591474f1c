//! The engine without a window, on the CPU.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use sunfleck::cpu::CpuStages;
use sunfleck::output::exr;
use sunfleck::ppm::{self, Film, Stages};
use sunfleck::scene::settings::{CameraSettings, Count, Index};
use sunfleck::scene::{Accelerator, PackedScene};

use super::*;
use crate::cli::InputArgs;
use crate::scenes::Source;

const PATIENCE: Duration = Duration::from_secs(60);

struct Bench {
    engine: Engine,
    wanted: Wanted,
    wakes: Arc<AtomicUsize>,
    gate: Arc<Gate>,
}

/// Holds the render thread up, where it has news.
#[derive(Default)]
struct Gate {
    /// While somebody has it, the thread does not go on.
    held: Mutex<()>,
    is_reached: AtomicBool,
}

impl Gate {
    fn pass(&self) {
        if std::thread::current().name() == Some("render") && self.held.try_lock().is_err() {
            self.is_reached.store(true, Ordering::Relaxed);
            drop(self.held.lock());
        }
    }
}

impl Bench {
    /// Opens a small picture of a scene, with limits.
    fn open(name: &str, limits: Limits) -> Self {
        Self::open_on(Device::Cpu(Accelerator::Bvh), name, limits)
    }

    fn open_on(device: Device, name: &str, limits: Limits) -> Self {
        let wakes = Arc::new(AtomicUsize::new(0));
        let gate = Arc::<Gate>::default();
        let (count, barrier) = (Arc::clone(&wakes), Arc::clone(&gate));
        let wake: Wake = Arc::new(move || {
            count.fetch_add(1, Ordering::Relaxed);
            barrier.pass();
        });
        let engine = Engine::start(device, wake).unwrap();
        let mut bench = Self { engine, wanted: Wanted { limits, ..Wanted::default() }, wakes, gate };
        bench.choose(name, &["size=32x32", "photons=2000"]);
        bench
    }

    fn choose(&mut self, name: &str, set: &[&str]) {
        let set = set.iter().map(ToString::to_string).collect();
        self.wanted.scene = Some(Arc::new(Choice { name: name.to_owned(), set }));
        self.send();
    }

    fn send(&mut self) {
        self.engine.want(&self.wanted);
    }

    /// Changes settings, from those that are in use.
    fn set(&mut self, change: impl FnOnce(&mut Settings)) {
        let opened = self.engine.now().opened.expect("a scene");
        let mut settings = self.wanted.settings.as_deref().unwrap_or(&opened.source.settings).clone();
        change(&mut settings);
        self.wanted.settings = Some(Arc::new(settings));
        self.send();
    }

    fn wait(&self, what: &str, mut ready: impl FnMut(&Now) -> bool) -> Now {
        let began = Instant::now();
        loop {
            let now = self.engine.now();
            if ready(&now) {
                return now;
            }
            assert!(began.elapsed() < PATIENCE, "{what}: still {:?} after {PATIENCE:?}", now.phase);
            std::thread::sleep(Duration::from_millis(2));
        }
    }

    fn wait_for(&self, phase: &Phase) -> Now {
        self.wait(&format!("{phase:?}"), |now| now.phase == *phase)
    }

    /// A rest with so many iterations shown.
    fn wait_for_film(&self, phase: &Phase, n: u32) -> Now {
        self.wait(&format!("{phase:?} with {n} iterations"), |now| now.phase == *phase && iterations(now) == Some(n))
    }

    fn save(&self, path: &Path) -> Message {
        self.engine.take_messages();
        let scene = self.wanted.scene.clone();
        self.engine.save(Save { path: path.to_owned(), settings: Arc::default(), scene });
        let mut said = vec![];
        self.wait("saving", |_| {
            said.extend(self.engine.take_messages());
            !said.is_empty()
        });
        said.remove(0)
    }

    fn records(&self) -> Vec<u32> {
        self.engine.history(|h| h.records.sample(usize::MAX).iter().map(|r| r.iteration).collect())
    }
}

fn iterations(now: &Now) -> Option<u32> {
    now.snapshot.as_ref().map(|snapshot| snapshot.film.n_iterations)
}

fn until(n: u32) -> Limits {
    Limits { iterations: Some(n), ..Limits::default() }
}

/// What `sunfleck render` makes of the same settings.
fn rendered(settings: &Settings, n: u32) -> Film {
    let source = Source::resolve("cornell").unwrap();
    let input = crate::job::prepare(&source, settings, source.scene().unwrap(), &InputArgs::default()).unwrap();
    let scene = PackedScene::new(&input.scene);
    let [width, height] = input.params.size;
    let mut stages = CpuStages::new(scene.into(), input.camera.pack(width, height), input.params.film_size());
    ppm::start(&mut stages, &input.params).unwrap();
    for i in 1..=n {
        ppm::iterate(&mut stages, &input.params.frame(i)).unwrap();
    }
    stages.film().unwrap()
}

#[test]
fn a_saved_picture_is_that_of_render_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut bench = Bench::open("cornell", until(5));
    let first = bench.wait_for_film(&Phase::Reached, 5);
    let settings = first.opened.as_ref().unwrap().source.settings.clone();
    assert!(matches!(bench.save(&path), Message::Said(_)));
    assert_eq!(exr::read(&path).unwrap().rgb, rendered(&settings, 5).rgb());
    assert_eq!(bench.records(), [1, 2, 3, 4, 5]);

    // Another camera, looked for through a preview; then the same again by a restart.
    let moved = |settings: &mut Settings| {
        let opened = first.opened.as_ref().unwrap();
        let mut camera = settings.camera_of(&opened.loaded.scene.cameras).unwrap();
        camera.world_from_camera.translation.x += 0.05;
        settings.camera = Some(CameraSettings::from(&camera));
    };
    bench.wanted.moving = true;
    bench.set(moved);
    bench.wait("a preview", |now| now.snapshot.as_ref().is_some_and(|f| f.is_preview && f.params.size == [8, 8]));
    bench.wanted.moving = false;
    bench.send();
    let second = bench.wait("the picture", |now| {
        now.phase == Phase::Reached && now.snapshot.as_ref().is_some_and(|f| !f.is_preview && f.film.n_iterations == 5)
    });
    let settings = bench.wanted.settings.as_deref().unwrap().clone();
    let film = rendered(&settings, 5);
    assert_eq!(*second.snapshot.as_ref().unwrap().film, film);
    bench.wanted.restarts += 1;
    bench.send();
    let again = bench.wait("the restart", |now| {
        now.phase == Phase::Reached && iterations(now) == Some(5) && now.estimate > second.estimate
    });
    assert_eq!(*again.snapshot.unwrap().film, film);
    assert!(matches!(bench.save(&path), Message::Said(_)));
    assert_eq!(exr::read(&path).unwrap().rgb, film.rgb());
    let nowhere = folder.path().join("none/a.exr");
    assert!(matches!(bench.save(&nowhere), Message::Error(text) if text.contains("none")));
}

#[test]
fn a_picture_is_saved_while_the_render_thread_is_busy() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut bench = Bench::open("cornell", Limits::default());
    bench.wait("a picture", |now| now.snapshot.is_some());
    let gate = Arc::clone(&bench.gate);
    let held = gate.held.lock().unwrap();
    bench.wait("the gate", |_| gate.is_reached.load(Ordering::Relaxed));
    let shown = bench.engine.now().snapshot.unwrap();
    assert!(matches!(bench.save(&path), Message::Said(_)));
    assert_eq!(exr::read(&path).unwrap().rgb, shown.film.rgb());
    // A scene that has been left is not saved, and of the next one not before there is something.
    let left = bench.wanted.scene.clone();
    let other = folder.path().join("b.exr");
    bench.choose("glass", &["size=8x8", "photons=10"]);
    let late = Save { path: other.clone(), settings: Arc::default(), scene: left };
    bench.engine.save(late);
    let said = |message: &Message, part| matches!(message, Message::Error(text) if text.contains(part));
    bench.wait("refusal", |_| bench.engine.take_messages().iter().any(|m| said(m, "b.exr was not written")));
    assert!(!other.exists());
    drop(held);
    assert!(matches!(bench.save(&path), Message::Said(_)));
    assert_eq!(exr::read(&path).unwrap().size, [8, 8]);
}

#[test]
fn a_preview_is_not_saved_for_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut bench = Bench::open("cornell", until(2));
    bench.wanted.moving = true;
    bench.wait_for_film(&Phase::Reached, 2);
    bench.send();
    bench.wait("a preview", |now| now.snapshot.as_ref().is_some_and(|snapshot| snapshot.is_preview));
    let scene = bench.wanted.scene.clone();
    bench.engine.save(Save { path: path.clone(), settings: Arc::default(), scene });
    bench.wanted.moving = false;
    bench.send();
    bench.wait("saving", |_| path.exists());
    assert_eq!(exr::read(&path).unwrap().size, [32, 32]);
    // Not after a failure either.
    bench.wanted.moving = true;
    bench.wait_for_film(&Phase::Reached, 2);
    bench.send();
    bench.wait("a preview", |now| now.snapshot.as_ref().is_some_and(|snapshot| snapshot.is_preview));
    bench.set(no_such_camera);
    bench.wait("the error", |now| matches!(now.phase, Phase::Failed(_)));
    assert!(matches!(bench.save(&folder.path().join("b.exr")), Message::Error(why) if why.contains("no picture yet")));
}

fn no_such_camera(settings: &mut Settings) {
    settings.camera = Some(CameraSettings { name: Some("no such".to_owned()), ..Default::default() });
}

/// A large one is read slowly.
#[test]
fn the_reference_that_was_chosen_last_stays() {
    let bench = Bench::open("cornell", until(1));
    let reference = |name: &str| {
        let picture = Picture { size: [1; 2], crop: [0, 0, 1, 1], rgb: vec![[1.0; 3]], variance: None };
        Some(Reference { name: name.to_owned(), picture })
    };
    let name = || bench.engine.now().reference.map(|reference| reference.name.clone());
    let (first, second, third) =
        (bench.engine.choose_reference(), bench.engine.choose_reference(), bench.engine.choose_reference());
    first(reference("first"));
    assert_eq!(name().as_deref(), Some("first"));
    third(reference("third"));
    second(reference("second"));
    assert_eq!(name().as_deref(), Some("third"));
    let late = bench.engine.choose_reference();
    bench.engine.choose_reference()(None);
    late(reference("late"));
    assert_eq!(name(), None);
}

#[test]
fn pauses_steps_and_limits_count_exactly() {
    let mut bench = Bench::open("cornell", until(3));
    bench.wait_for_film(&Phase::Reached, 3);
    bench.wanted.limits = until(4);
    bench.send();
    bench.wait_for_film(&Phase::Reached, 4);
    bench.wanted.paused = true;
    bench.send();
    bench.wait_for(&Phase::Paused);
    bench.wanted.steps += 3;
    bench.send();
    bench.wait_for_film(&Phase::Paused, 7);
    // Steps that were not done when it went on are not done after another pause.
    let gate = Arc::clone(&bench.gate);
    let held = gate.held.lock().unwrap();
    bench.wanted.steps += 1;
    bench.send();
    bench.wait("the render thread", |_| bench.gate.is_reached.load(Ordering::Relaxed));
    bench.wanted.steps += 4;
    (bench.wanted.paused, bench.wanted.limits) = (false, until(9));
    bench.send();
    drop(held);
    bench.wait_for_film(&Phase::Reached, 9);
    bench.wanted.paused = true;
    bench.send();
    bench.wait_for_film(&Phase::Paused, 9);
    // A restart in a pause shows the first picture of it.
    bench.wanted.restarts += 1;
    bench.send();
    let now = bench.wait_for_film(&Phase::Paused, 1);
    assert_eq!(bench.records(), [1]);
    bench.wanted.limits = Limits { seconds: Some(1e-9), ..Limits::default() };
    bench.wanted.paused = false;
    bench.send();
    assert_eq!(iterations(&bench.wait_for(&Phase::Reached)), iterations(&now));
    // The noise is known from the second iteration on.
    bench.wanted.limits = Limits { noise: Some(1e9), ..Limits::default() };
    bench.send();
    let now = bench.wait("the noise", |now| now.phase == Phase::Reached && iterations(now).is_some_and(|n| n >= 2));
    let noise = bench.engine.history(|h| h.estimated.last().copied()).unwrap();
    assert!(noise.iteration <= iterations(&now).unwrap() && noise.rel_mse > 0.0);
    // Nothing goes on, nobody is woken.
    bench.wait("the last picture", |now| match (&now.painted, &now.snapshot) {
        (Some(painted), Some(snapshot)) => now.phase == Phase::Reached && Arc::ptr_eq(&painted.snapshot, snapshot),
        _ => false,
    });
    std::thread::sleep(Duration::from_millis(100));
    let wakes = bench.wakes.load(Ordering::Relaxed);
    std::thread::sleep(Duration::from_millis(300));
    assert_eq!(bench.wakes.load(Ordering::Relaxed), wakes);
}

/// A first photon pass of seconds: what comes instead does not wait for its end. Counted in chunks of paths.
#[test]
fn a_long_stage_is_left_at_once() {
    const CHUNKS: u32 = 800;
    let mut bench = Bench::open("cornell", until(1));
    bench.wait_for_film(&Phase::Reached, 1);
    let shared = Arc::clone(&bench.engine.shared);
    let asks = || shared.asks.load(Ordering::Relaxed);
    // Returns when the photon pass is under way.
    let lengthen = |bench: &mut Bench| {
        let before = asks();
        bench.set(|settings| settings.photons = Some(Count(CHUNKS * 4096)));
        bench.wait("photons", |now| now.phase == Phase::Starting && asks() > before + 20);
        before
    };
    let is_left_early = |before: u32, what: &str| {
        let n = asks() - before;
        assert!(n < CHUNKS / 2, "{what}: {n} of {CHUNKS} chunks were done");
    };

    // A camera that moves gets its preview, and what was left is taken up again.
    let before = lengthen(&mut bench);
    bench.wanted.moving = true;
    bench.send();
    bench.wait("a preview", |now| now.snapshot.as_ref().is_some_and(|snapshot| snapshot.is_preview));
    is_left_early(before, "moving");
    bench.wanted.moving = false;
    let before = asks();
    bench.send();
    bench.wait("photons", |now| now.phase == Phase::Starting && asks() > before + 20);

    // A setting.
    bench.set(|settings| settings.photons = Some(Count(2000)));
    bench.wait_for_film(&Phase::Reached, 1);
    is_left_early(before, "setting");

    // What changes no pixel does not begin it anew.
    let before = lengthen(&mut bench);
    let estimate = bench.engine.now().estimate;
    bench.wanted.painting.look.exposure = Some(1.0);
    bench.set(|settings| settings.exposure = Some(1.0));
    let now = asks();
    bench.wait("more photons", |_| asks() > now + 20);
    assert_eq!(bench.engine.now().estimate, estimate);

    // Another scene, none, and the end of it all.
    let choice = bench.wanted.scene.take();
    bench.send();
    bench.wait_for(&Phase::Empty);
    is_left_early(before, "closing");
    (bench.wanted.scene, bench.wanted.settings) = (choice, None);
    bench.send();
    bench.wait_for_film(&Phase::Reached, 1);
    let before = lengthen(&mut bench);
    drop(bench);
    is_left_early(before, "quitting");
}

#[test]
fn what_fails_can_be_put_right() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    let mut bench = Bench::open(&path.to_string_lossy(), until(2));
    let failed = |now: &Now| matches!(&now.phase, Phase::Failed(text) if text.contains("scene.toml"));
    bench.wait("the error", failed);
    // It is there now.
    std::fs::write(&path, "scene = \"cornell\"\n").unwrap();
    bench.wanted.retries += 1;
    bench.send();
    let good = bench.wait_for_film(&Phase::Reached, 2);
    // Settings that cannot be: the last film stays, and can be saved.
    bench.set(no_such_camera);
    let bad = bench.wait("the error", |now| matches!(&now.phase, Phase::Failed(text) if text.contains("no such")));
    assert_eq!(iterations(&bad), Some(2));
    assert!(matches!(bench.save(&folder.path().join("a.exr")), Message::Said(_)));
    bench.set(|settings| settings.camera = None);
    let again = bench.wait("the picture", |now| now.phase == Phase::Reached && now.estimate > good.estimate);
    let [again, good] = [again, good].map(|now| now.snapshot.unwrap());
    assert_eq!(again.film, good.film);
    // Not packed again for it.
    assert!(Arc::ptr_eq(&again.scene.nodes, &good.scene.nodes));
    // A scene that is not there, and back.
    bench.wanted.settings = None;
    bench.choose("no/such.glb", &[]);
    let now = bench.wait("the error", |now| matches!(&now.phase, Phase::Failed(text) if text.contains("such.glb")));
    assert!(now.opened.is_none() && now.snapshot.is_none());
    bench.wanted.scene = None;
    bench.send();
    bench.wait_for(&Phase::Empty);
}

#[test]
fn a_scene_that_is_left_is_freed() {
    let mut bench = Bench::open("cornell", until(1));
    let mut left: Vec<std::sync::Weak<PackedScene>> = vec![];
    for i in 0..20 {
        let name = ["cornell", "bathroom"][i % 2];
        bench.choose(name, &["size=16x16", "photons=500", &format!("seed={i}")]);
        let now = bench.wait(name, |now| {
            let same = now.opened.as_ref().is_some_and(|opened| opened.source.settings.seed == Some(i as u32));
            same && now.phase == Phase::Reached
                && now.painted.as_ref().is_some_and(|p| p.snapshot.film.n_iterations == 1)
        });
        left.push(Arc::downgrade(&now.snapshot.unwrap().scene));
    }
    bench.wanted.scene = None;
    bench.send();
    bench.wait_for(&Phase::Empty);
    bench.wait("memory", |_| left.iter().all(|scene| scene.upgrade().is_none()));
    assert_eq!(left.len(), 20);
}

/// A pinhole has everything in focus.
#[test]
fn the_focus_restarts_what_it_changes() {
    let mut bench = Bench::open("cornell", until(3));
    let before = bench.wait_for_film(&Phase::Reached, 3);
    let mut camera = before.opened.as_ref().unwrap().loaded.scene.cameras[0].clone();
    camera.aperture_radius = 0.0;
    camera.focus_distance *= 1.5;
    bench.set(|settings| settings.camera = Some(CameraSettings::from(&camera)));
    bench.wanted.limits = until(4);
    bench.send();
    assert_eq!(bench.wait_for_film(&Phase::Reached, 4).estimate, before.estimate);
    camera.aperture_radius = 0.1;
    bench.set(|settings| settings.camera = Some(CameraSettings::from(&camera)));
    let open = bench.wait("a lens", |now| now.estimate > before.estimate && now.phase == Phase::Reached);
    assert_eq!(open.snapshot.as_ref().unwrap().camera.focus_distance, camera.focus_distance);
    camera.focus_distance *= 2.0;
    bench.set(|settings| settings.camera = Some(CameraSettings::from(&camera)));
    bench.wait("another focus", |now| now.estimate > open.estimate);
}

#[test]
fn a_lost_device_is_opened_again() {
    let device = match crate::devices::open_backend("gpu") {
        Ok(device) => device,
        Err(error) => {
            assert!(std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none(), "SUNFLECK_REQUIRE_GPU is set, but: {error}");
            return;
        }
    };
    let Device::Gpu { context, .. } = &device else { unreachable!("asked for a GPU") };
    let context = Arc::clone(context);
    let mut bench = Bench::open_on(device, "cornell", until(2));
    let before = bench.wait_for_film(&Phase::Reached, 2);
    context.destroy();
    bench.wanted.limits = until(4);
    bench.send();
    let now = bench.wait("the loss", |now| matches!(now.phase, Phase::Failed(_)));
    assert_eq!(iterations(&now), Some(2));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    assert!(matches!(bench.save(&path), Message::Said(_)));
    assert_eq!(exr::read(&path).unwrap().rgb, before.snapshot.unwrap().film.rgb());
    bench.wanted.retries += 1;
    bench.send();
    bench.wait_for_film(&Phase::Reached, 4);
}

/// Opens the scene on `device`, has it searched in the other way, and returns both films.
fn searched_in_both_ways(device: Device, other: &str) -> [Film; 2] {
    let mut bench = Bench::open_on(device, "cornell", until(2));
    let before = bench.wait_for_film(&Phase::Reached, 2);
    bench.set(|settings| settings.set(other).unwrap());
    let after = bench.wait("another estimate", |now| {
        now.estimate > before.estimate && now.phase == Phase::Reached && iterations(now) == Some(2)
    });
    let snapshot = after.snapshot.unwrap();
    let command =
        snapshot.opened.command(&snapshot.opened.source.name, &snapshot.settings, "--backend x", 2, Path::new("a.exr"));
    assert!(command.contains(" --backend x ") && command.contains(&format!(" --set {other} ")), "{command}");
    [before.snapshot.unwrap(), snapshot].map(|snapshot| snapshot.film.as_ref().clone())
}

#[test]
fn another_way_to_search_finds_the_same_picture() {
    let [bvh, kd] = searched_in_both_ways(Device::Cpu(Accelerator::Bvh), "accel=kd");
    assert_eq!(bvh.pixels, kd.pixels);
}

/// On a GPU where there is one, too.
#[test]
fn a_file_of_another_machine_is_searched_by_the_default() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("other.toml");
    let gpu = crate::devices::open_backend("gpu").ok();
    assert!(gpu.is_some() || std::env::var_os("SUNFLECK_REQUIRE_GPU").is_none_or(|v| v != "1"), "no GPU adapter");
    for device in [Some(Device::Cpu(Accelerator::Bvh)), gpu].into_iter().flatten() {
        let (is_cpu, has_ray_queries) = (device.backend() == "cpu", device.has_ray_queries());
        std::fs::write(&path, "scene = \"cornell\"\naccel = \"kd\"\nindex = \"hardware\"\n").unwrap();
        let mut bench = Bench::open_on(device, &path.to_string_lossy(), until(2));
        let now = bench.wait_for_film(&Phase::Reached, 2);
        let accelerator = now.snapshot.unwrap().scene.accelerator();
        assert_eq!(accelerator, if is_cpu { Accelerator::Kd } else { Accelerator::Bvh });
        // Said once, whatever else is changed.
        bench.set(|settings| settings.light_scale = Some(2.0));
        bench.wait("another estimate", |later| later.estimate > now.estimate && later.phase == Phase::Reached);
        let warnings = bench.engine.take_messages();
        for (key, is_missed) in [("other.toml: index:", !has_ray_queries), ("other.toml: accel:", !is_cpu)] {
            let is_it = |message: &&Message| matches!(message, Message::Warning(text) if text.contains(key));
            assert_eq!(warnings.iter().filter(is_it).count(), usize::from(is_missed), "{key} {warnings:?}");
        }
        // Another scene has nothing of it.
        bench.wanted.settings = None;
        bench.choose("cornell", &["size=32x32", "photons=2000"]);
        let next = bench.wait("another scene", |now| {
            now.opened.as_ref().is_some_and(|opened| opened.source.name == "cornell") && now.phase == Phase::Reached
        });
        assert_eq!(next.snapshot.unwrap().scene.accelerator(), Accelerator::Bvh);
        assert!(bench.engine.take_messages().is_empty());
    }
}

#[test]
fn ray_queries_find_the_same_picture() {
    let device = crate::devices::open_backend("gpu").ok().filter(Device::has_ray_queries);
    let Some(mut device) = device else {
        let required = std::env::var_os("SUNFLECK_REQUIRE_RAY_QUERY").is_some();
        assert!(!required, "SUNFLECK_REQUIRE_RAY_QUERY is set, but there are none");
        return;
    };
    for index in [Index::Hardware, Index::Tree] {
        device.follow(&Settings { index: Some(index), ..Settings::default() }).unwrap();
        assert_eq!(device.index() == "hardware", index == Index::Hardware);
    }
    let [tree, hardware] = searched_in_both_ways(device, "index=hardware").map(|film| film.rgb());
    let sum = |of: &[[f32; 3]]| of.as_flattened().iter().map(|x| f64::from(x.abs())).sum::<f64>();
    let apart: Vec<[f32; 3]> = tree.iter().zip(&hardware).map(|(a, b)| [0, 1, 2].map(|i| a[i] - b[i])).collect();
    assert!(sum(&apart) < 1e-5 * sum(&tree), "{} of {}", sum(&apart), sum(&tree));
}

#[test]
fn a_panic_is_an_error() {
    assert_eq!(catch(|| 3), Ok(3));
    let text = catch(|| -> u32 { panic!("at {}\nof", 7) }).unwrap_err();
    assert_eq!(text, "a bug in sunfleck: at 7 of");
}

/// Meshes and arrays, whatever was changed meanwhile.
#[test]
fn what_scenes_share_is_freed_with_the_last() {
    let mut bench = Bench::open("cornell", until(2));
    let now = bench.wait_for_film(&Phase::Reached, 2);
    let scene = &now.opened.as_ref().unwrap().loaded.scene;
    let (mesh, before) = (Arc::downgrade(&scene.meshes[0]), now.estimate);
    let first = Arc::downgrade(&now.snapshot.as_ref().unwrap().scene.nodes);
    bench.set(|settings| settings.material_mut(scene, 0).emission = Some([1.0; 3]));
    drop(now);
    let now = bench.wait("the change", |now| now.phase == Phase::Reached && now.estimate > before);
    let second = Arc::downgrade(&now.snapshot.as_ref().unwrap().scene.primitives);
    drop(now);
    bench.wanted.scene = None;
    bench.send();
    bench.wait("memory", |_| mesh.strong_count() + first.strong_count() + second.strong_count() == 0);
}
