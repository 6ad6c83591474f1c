//! Stages that are ended early, and what is left of them; the first picture of a preview.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use sunfleck::cpu::CpuStages;
use sunfleck::gpu::GpuStages;
use sunfleck::ppm::{self, Direct, Error, FirstRadius, Interrupt, Kernel, Params, Stages};
use sunfleck::scene::PackedScene;

use crate::backends::{everything, film_bits};
use crate::gpu::context;

const SIZE: [u32; 2] = [96, 64];

fn params() -> Params {
    Params { n_paths: 40_000, ..Params::new(SIZE[0], SIZE[1]) }
}

fn on_the_cpu() -> CpuStages {
    let scene = everything();
    CpuStages::new(PackedScene::new(&scene).into(), scene.cameras[0].pack(SIZE[0], SIZE[1]), SIZE)
}

/// With dispatches as small as can be.
fn on_the_gpu() -> Option<GpuStages> {
    let scene = everything();
    let camera = scene.cameras[0].pack(SIZE[0], SIZE[1]);
    let mut stages = GpuStages::new(context()?, &PackedScene::new(&scene), camera).expect("stages");
    stages.set_dispatch_seconds(0.0);
    stages.set_reaches_on_device(true);
    Some(stages)
}

/// Trips at the ask after so many; how often it was asked.
fn after(most: u32) -> (Interrupt, Arc<AtomicU32>) {
    let asked = Arc::new(AtomicU32::new(0));
    let count = Arc::clone(&asked);
    (Interrupt::when(move || count.fetch_add(1, Ordering::Relaxed) >= most), asked)
}

fn bits(stages: &mut dyn Stages) -> Vec<u32> {
    stages.film().expect("film").pixels.into_iter().flatten().map(f32::to_bits).collect()
}

/// How often `work` asks if it is let through.
fn asks(stages: &mut dyn Stages, work: impl FnOnce(&mut dyn Stages) -> Result<(), Error>) -> u32 {
    let (interrupt, asked) = after(u32::MAX);
    stages.set_interrupt(interrupt);
    work(stages).expect("nothing trips it");
    asked.load(Ordering::Relaxed)
}

type Stage = fn(&mut dyn Stages, &sunfleck::layout::Frame) -> Result<(), Error>;

/// Each stage, ended at several places: it asks within itself, stops soon, and leaves the film alone. `at_least`: asks of
/// each; `most_more`: asks of others after the one that trips.
fn stages_end_early(stages: &mut dyn Stages, at_least: [u32; 4], most_more: u32) {
    let params = params();
    let n = asks(stages, |stages| ppm::start(stages, &params).map(drop));
    let radii = ppm::start(stages, &params).expect("start");
    for most in [0, n / 4, n / 2, n - 1] {
        stages.set_interrupt(after(most).0);
        assert!(matches!(ppm::start(stages, &params), Err(Error::Interrupted)), "after {most} of {n} asks");
    }
    stages.set_interrupt(Interrupt::default());
    assert!(ppm::start(stages, &params).expect("start") == radii);

    ppm::iterate(stages, &params.frame(1)).expect("iteration");
    stages.times().expect("times");
    let first = bits(stages);
    let order: [(&str, Stage); 4] = [
        ("eye", |stages, frame| stages.trace_eye(frame)),
        ("photons", |stages, frame| stages.trace_photons(frame)),
        ("index", |stages, frame| stages.build_index(frame)),
        ("gather", |stages, frame| stages.gather(frame)),
    ];
    for ((name, stage), at_least) in order.into_iter().zip(at_least) {
        let frame = params.frame(2);
        let n = asks(stages, |stages| stage(stages, &frame));
        assert!(n >= at_least, "{name} asks {n} times");
        for most in [0, n / 3, n / 2, n - 1] {
            let (interrupt, asked) = after(most);
            stages.set_interrupt(interrupt);
            assert!(matches!(stage(stages, &frame), Err(Error::Interrupted)), "{name} after {most} of {n} asks");
            let asked = asked.load(Ordering::Relaxed);
            assert!(asked <= most + 1 + most_more, "{name} went on for {} asks", asked - most);
            assert!(bits(stages) == first, "{name} changed the film after {most} asks");
        }
        // The next one needs it.
        stages.set_interrupt(Interrupt::default());
        stage(stages, &frame).expect(name);
    }
}

/// Iterations that are ended anywhere and done again add up to the film of those that never were.
fn going_on_gives_the_same_film(mut make: impl FnMut() -> Box<dyn Stages>) {
    let params = params();
    let whole = film_bits(&mut *make(), &params);
    let mut stages = make();
    let stages = &mut *stages;
    ppm::start(stages, &params).expect("start");
    for i in 1..=2 {
        let frame = params.frame(i);
        for most in [0, 5, 9, 14, 20] {
            stages.set_interrupt(after(most).0);
            assert!(matches!(ppm::iterate(stages, &frame), Err(Error::Interrupted)), "{i}, {most}");
        }
        stages.set_interrupt(Interrupt::default());
        ppm::iterate(stages, &frame).expect("iteration");
        stages.times().expect("times");
    }
    assert!(bits(stages) == whole);
}

#[test]
fn a_stage_on_the_cpu_ends_early() {
    // Chunks that other threads begin before they see it.
    let threads = rayon::current_num_threads() as u32;
    stages_end_early(&mut on_the_cpu(), [12, 10, 1, 8], threads);
}

#[test]
fn a_stage_on_the_gpu_ends_early() {
    let Some(mut stages) = on_the_gpu() else { return };
    stages_end_early(&mut stages, [8, 3, 10, 8], 0);
}

#[test]
fn an_interrupted_estimate_goes_on_as_if_it_had_not_been_on_the_cpu() {
    going_on_gives_the_same_film(|| Box::new(on_the_cpu()));
}

#[test]
fn an_interrupted_estimate_goes_on_as_if_it_had_not_been_on_the_gpu() {
    if context().is_some() {
        going_on_gives_the_same_film(|| Box::new(on_the_gpu().expect("there was an adapter")));
    }
}

/// With a radius that is given there is nothing to choose: the first picture is that of the first iteration.
fn a_preview_is_the_first_iteration(stages: &mut dyn Stages) {
    let params = Params { radius: FirstRadius::Fixed(0.1), ..params() };
    ppm::start(stages, &params).expect("start");
    ppm::iterate(stages, &params.frame(1)).expect("iteration");
    let film = stages.film().expect("film");
    stages.set_camera(stages.camera(), SIZE).expect("room");
    let radii = ppm::start_preview(stages, &params).expect("preview");
    assert_eq!(radii.spread(), [0.1; 3]);
    assert_eq!(radii.each, [0.1].repeat(film.pixels.len()));
    assert_eq!(stages.film().expect("film"), film);
    // And the second goes on from there.
    ppm::iterate(stages, &params.frame(2)).expect("iteration");
    assert_eq!(stages.film().expect("film").n_iterations, 2);
}

#[test]
fn a_preview_is_the_first_iteration_on_both() {
    a_preview_is_the_first_iteration(&mut on_the_cpu());
    if let Some(mut stages) = on_the_gpu() {
        a_preview_is_the_first_iteration(&mut stages);
    }
}

/// All light by photons: the radii that a preview's own photons choose make it neither brighter nor darker.
#[test]
fn a_preview_is_as_bright_as_the_picture() {
    let mut stages = on_the_cpu();
    let mean = |stages: &mut CpuStages| {
        let rgb = stages.film().expect("film").rgb();
        rgb.iter().flatten().map(|&c| f64::from(c)).sum::<f64>() / (3 * rgb.len()) as f64
    };
    for kernel in [Kernel::Epanechnikov, Kernel::Constant] {
        let (mut previews, mut pictures) = (0.0, 0.0);
        for seed in 0..8 {
            let params = Params { seed, n_paths: 20_000, direct: Direct::Photons, kernel, ..params() };
            let coarse = ppm::start_preview(&mut stages, &params).expect("preview");
            previews += mean(&mut stages);
            stages.set_camera(stages.camera(), SIZE).expect("room");
            let fine = ppm::start(&mut stages, &params).expect("start");
            ppm::iterate(&mut stages, &params.frame(1)).expect("iteration");
            pictures += mean(&mut stages);
            stages.set_camera(stages.camera(), SIZE).expect("room");
            let [coarse, fine] = [coarse, fine].map(|radii| radii.each.iter().map(|r| f64::from(r.ln())).sum::<f64>());
            let ratio = ((coarse - fine) / f64::from(SIZE[0] * SIZE[1])).exp();
            assert!((0.95..1.05).contains(&ratio), "seed {seed}: radii {ratio} times as large");
        }
        println!("{kernel:?}: brightness {}", previews / pictures);
        assert!((previews / pictures - 1.0).abs() < 0.03, "{kernel:?}: {previews} against {pictures}");
    }
}
