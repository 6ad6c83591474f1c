//! What is to be rendered: the command line over the settings file over the defaults, checked before anything slow.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use sunfleck::layout::EyeVertex;
use sunfleck::output::atomic;
use sunfleck::output::png::Look;
use sunfleck::ppm::{Direct, FirstRadius, Params};
use sunfleck::scene::load::Loaded;
use sunfleck::scene::{Camera, Scene, Settings};

use crate::cli::{InputArgs, RenderArgs, Usage};
use crate::scenes::{Source, same_file};

/// Where nothing is said: as many iterations as look good on the shipped scenes, but no longer than one waits for.
const DEFAULT_ITERATIONS: u32 = 256;
const DEFAULT_SECONDS: f64 = 60.0;
/// Height of the picture, and its width where neither user nor camera say.
const DEFAULT_SIZE: [u32; 2] = [1280, 720];
/// Segments of an eye path and of a photon path in the setting of the literature.
const PAPER_SEGMENTS: u32 = 5;

/// When to stop: whichever comes first.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    pub iterations: Option<u32>,
    pub seconds: Option<f64>,
}

impl Budget {
    /// How much of it is used up, from 0 to 1.
    pub fn spent(&self, iterations: u32, seconds: f64) -> f64 {
        let by_iterations = self.iterations.map_or(0.0, |n| f64::from(iterations) / f64::from(n));
        let by_time = self.seconds.map_or(0.0, |limit| seconds / limit);
        by_iterations.max(by_time).min(1.0)
    }
}

/// What the command line asks for.
pub struct Job {
    /// As given.
    pub scene_name: String,
    /// Files to write, `.exr` or `.png`.
    pub outputs: Vec<PathBuf>,
    /// How a `.png` looks.
    pub look: Look,
    /// When to stop.
    pub budget: Budget,
    /// One radius for all pixels, the median of the automatic ones.
    pub one_radius: bool,
    /// With what `--camera`, `--env`, `--set`, `--index` and `--accel` say over its settings.
    pub source: Source,
}

/// What the stages read.
pub struct Input {
    pub scene: Scene,
    pub camera: Camera,
    pub params: Params,
    pub warnings: Vec<String>,
}

impl Job {
    /// Reads the settings and makes sure that every output can be written.
    pub fn resolve(args: &RenderArgs) -> Result<Self> {
        let scene_name =
            args.scene.clone().ok_or_else(|| Usage("which scene? sunfleck render SCENE -o out.png".into()))?;
        check_outputs(args)?;
        let mut source = Source::resolve(&scene_name)?;
        source.set(&args.pairs()?)?;
        for path in args.output.iter().chain(&args.json) {
            source.check_not_read(&source.settings, path)?;
        }
        let settings = &source.settings;
        let iterations = args.iterations.or(settings.iterations.map(|n| n.0));
        let budget = match (iterations, args.seconds.or(settings.seconds)) {
            (None, None) => Budget { iterations: Some(DEFAULT_ITERATIONS), seconds: Some(DEFAULT_SECONDS) },
            (iterations, seconds) => Budget { iterations, seconds },
        };
        let radius = args.input.radius.or(settings.radius).unwrap_or_default();
        Ok(Self {
            scene_name,
            outputs: args.output.clone(),
            look: Look {
                exposure: args.exposure.or(settings.exposure),
                tonemap: args.tonemap.or(settings.tonemap).unwrap_or_default(),
            },
            budget,
            one_radius: args.input.paper && radius == FirstRadius::Automatic,
            source,
        })
    }

    /// Reads the scene and chooses the camera and the estimator's parameters, for which there is room.
    pub fn load(&self, args: &RenderArgs) -> Result<Input> {
        let input = prepare(&self.source, &self.source.settings, self.source.scene()?, &args.input)?;
        check_memory(&input.params, None)?;
        check_scene_memory(&input.scene).with_context(|| self.source.name.clone())?;
        Ok(input)
    }
}

/// From a scene as its file has it to what the stages read: changed as `settings` say, and as `args` say over them.
///
/// `source` says where the scene came from; its own settings are not looked at.
pub fn prepare(source: &Source, settings: &Settings, mut loaded: Loaded, args: &InputArgs) -> Result<Input> {
    source.apply(settings, &mut loaded)?;
    let Loaded { scene, warnings } = loaded;
    scene.check().with_context(|| source.name.clone())?;
    let camera = scene.cameras[0].clone();
    let params = params(settings, args, &camera)?;
    Ok(Input { scene, camera, params, warnings })
}

/// The same for settings that change the scene as those did that `input` was made with; `cameras` are the scene's before
/// them. The scene is not looked at: the camera may move at every frame of a window.
#[cfg(feature = "view")]
pub fn prepare_again(input: &mut Input, settings: &Settings, cameras: &[Camera]) -> Result<()> {
    let camera = settings.camera_of(cameras)?;
    camera.check()?;
    input.params = params(settings, &InputArgs::default(), &camera)?;
    input.camera = camera;
    Ok(())
}

/// The command line over the settings over the defaults.
pub fn params(settings: &Settings, args: &InputArgs, camera: &Camera) -> Result<Params> {
    let [width, height] = args.resolution.unwrap_or_else(|| size(settings, camera));
    let mut params = Params::new(width, height);
    if args.paper {
        use_paper_mode(&mut params);
    }
    if let Some(crop) = args.crop {
        let nothing = || Usage(format!("--crop: no pixel of {width}x{height} is left"));
        params.crop = crop.pixels(params.size).ok_or_else(nothing)?;
    }
    params.seed = args.seed.or(settings.seed).unwrap_or(params.seed);
    params.n_paths = args.photons.or(settings.photons.map(|n| n.0)).unwrap_or(params.n_paths);
    params.alpha = args.alpha.or(settings.alpha).unwrap_or(params.alpha);
    params.radius = args.radius.or(settings.radius).unwrap_or(params.radius);
    params.kernel = args.kernel.or(settings.kernel).unwrap_or(params.kernel);
    params.direct = args.direct.or(settings.direct).unwrap_or(params.direct);
    if let Some(n) = args.max_segments.or(settings.max_segments) {
        params.max_segments = n;
        params.max_eye_segments = params.max_eye_segments.min(n);
        params.max_photon_segments = params.max_photon_segments.min(n);
    }
    Ok(params)
}

/// The setting of the literature.
pub fn use_paper_mode(params: &mut Params) {
    params.direct = Direct::Photons;
    params.roulette = false;
    params.max_eye_segments = PAPER_SEGMENTS;
    params.max_photon_segments = PAPER_SEGMENTS;
}

/// Of the picture, pixels: as the settings say, else as the camera.
pub fn size(settings: &Settings, camera: &Camera) -> [u32; 2] {
    if let Some(size) = settings.size {
        return size.0;
    }
    let [width, height] = DEFAULT_SIZE;
    match camera.aspect {
        Some(aspect) => [(aspect * height as f32).round().clamp(1.0, 16_384.0) as u32, height],
        None => [width, height],
    }
}

/// Refuses a picture that could not be written later.
#[cfg(feature = "view")]
pub fn check_output(path: &Path) -> Result<()> {
    check_format(path).map_err(of_flag)?;
    Ok(atomic::check(path)?)
}

/// Refuses a name that says no format.
pub fn check_format(path: &Path) -> Result<(), String> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
    match extension.as_deref() {
        Some("exr" | "png") => Ok(()),
        _ => Err(format!("{}: a picture ends in .exr or .png", path.display())),
    }
}

/// Whether a picture of this name is a PNG, not an EXR.
pub fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
}

fn of_flag(why: String) -> Usage {
    Usage(format!("-o {why}"))
}

/// Refuses what could not be written later.
fn check_outputs(args: &RenderArgs) -> Result<()> {
    if args.output.is_empty() && args.json.is_none() {
        bail!(Usage("nowhere to put the picture: add -o out.png or -o out.exr".into()));
    }
    for path in &args.output {
        check_format(path).map_err(of_flag)?;
    }
    let files: Vec<_> = args.output.iter().chain(&args.json).collect();
    for (i, path) in files.iter().enumerate() {
        if files[..i].iter().any(|other| same_file(other, path)) {
            bail!(Usage(format!("{} is to be written twice", path.display())));
        }
    }
    for path in files {
        atomic::check(path)?;
    }
    Ok(())
}

/// Whether the picture or the photons of an iteration need more memory than those of `before`.
#[cfg(feature = "view")]
pub fn needs_more(params: &Params, before: &Params) -> bool {
    needed(params).into_iter().zip(needed(before)).any(|(needs, needed)| needs > needed)
}

/// Refuses a picture or a number of photons that this machine has no room for, beside what is there but for that of `held`,
/// whose place they take.
pub fn check_memory(params: &Params, held: Option<&Params>) -> Result<()> {
    let [width, height] = params.film_size();
    let what = [format!("a picture of {width}x{height} pixels"), format!("{} photons an iteration", params.n_paths)];
    let available = available_memory().saturating_add(held.map_or(0, |held| needed(held).iter().sum()));
    for (bytes, what) in needed(params).into_iter().zip(what) {
        ensure!(
            bytes <= available,
            "{what} would need some {:.1} GiB of memory; {:.1} GiB are free",
            gib(bytes),
            gib(available)
        );
    }
    Ok(())
}

/// Refuses a scene that this machine has no room to build a tree over.
pub fn check_scene_memory(scene: &Scene) -> Result<()> {
    // Measured with two million, flat triangles and tree, while it is built.
    const TRIANGLE: u64 = 250;
    let n: u64 = scene.meshes.iter().map(|mesh| mesh.triangles.len() as u64).sum();
    let (needs, available) = (n.saturating_mul(TRIANGLE), available_memory());
    ensure!(
        needs <= available,
        "the tree over {n} triangles would need some {:.1} GiB of memory; {:.1} GiB are free",
        gib(needs),
        gib(available)
    );
    Ok(())
}

fn gib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 30)
}

/// Bytes for the picture, and for the photons of an iteration.
fn needed(params: &Params) -> [u64; 2] {
    let [width, height] = params.film_size();
    // A pixel: what the eye sees, radiance, film, radius, and two copies on the way to a file.
    let pixel = size_of::<EyeVertex>() + 12 + 16 + 4 + 2 * 16;
    // A path: some four photons of 48 bytes, sorted into a second array, with keys and tree.
    let path = 4 * (2 * 48 + 16);
    [u64::from(width) * u64::from(height) * pixel as u64, u64::from(params.n_paths) * path]
}

/// Bytes, as far as the system tells; else a bound on what anybody has.
fn available_memory() -> u64 {
    const UNKNOWN: u64 = 64 << 30;
    let number = |text: &str| text.split_whitespace().find_map(|word| word.parse::<u64>().ok());
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo")
        .and_then(|text| number(text.lines().find(|line| line.starts_with("MemAvailable:"))?))
        .map_or(UNKNOWN, |kib| kib.saturating_mul(1024));
    let group = |file: &str| read(&format!("/sys/fs/cgroup/{file}"));
    let bytes = |file: &str| group(file).and_then(|text| number(&text));
    // What files have left in memory is given back when it is asked for.
    let files = group("memory.stat")
        .and_then(|text| number(text.lines().find(|line| line.starts_with("inactive_file "))?))
        .unwrap_or(0);
    let used = bytes("memory.current").unwrap_or(0).saturating_sub(files);
    free.min(bytes("memory.max").map_or(u64::MAX, |max| max.saturating_sub(used)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::scene::settings::{CameraSettings, Count, Size};

    /// As a window needs it: the file is read once, the settings change.
    #[test]
    fn a_scene_is_prepared_again_with_other_settings() {
        let source = Source::resolve("cornell").unwrap();
        let loaded = source.scene().unwrap();
        let args = InputArgs::default();
        let cameras = loaded.scene.cameras.clone();
        let first = prepare(&source, &source.settings, loaded.clone(), &args).unwrap();
        let mut settings = source.settings.clone();
        settings.size = Some(Size([32, 16]));
        settings.photons = Some(Count(77));
        settings.camera = Some((&first.camera).into());
        settings.material_mut(&loaded.scene, 0).roughness = Some(0.125);
        let second = prepare(&source, &settings, loaded.clone(), &args).unwrap();
        assert_eq!((second.params.size, second.params.n_paths), ([32, 16], 77));
        assert_eq!(second.scene.materials[0].roughness, 0.125);
        let position = |input: &Input| input.camera.world_from_camera.translation;
        assert_eq!(position(&first), position(&second));
        // Back again, and the command line over all.
        let args = InputArgs { photons: Some(5), ..InputArgs::default() };
        let third = prepare(&source, &source.settings, loaded, &args).unwrap();
        assert_eq!((third.params.size, third.params.n_paths), (first.params.size, 5));
        assert_eq!(third.scene.materials[0].roughness, first.scene.materials[0].roughness);
        // Without the scene, and as if with it.
        let args = InputArgs::default();
        let mut again = prepare(&source, &source.settings, source.scene().unwrap(), &args).unwrap();
        settings.camera = Some(CameraSettings { position: Some([0.5, 1.0, 3.0]), ..CameraSettings::default() });
        for _ in 0..2 {
            prepare_again(&mut again, &settings, &cameras).unwrap();
            let whole = prepare(&source, &settings, source.scene().unwrap(), &args).unwrap();
            assert_eq!((again.params.size, again.params.n_paths), (whole.params.size, whole.params.n_paths));
            assert_eq!(again.camera.pack(4, 3), whole.camera.pack(4, 3));
            settings.camera = None;
        }
        settings.alpha = Some(2.0);
        assert!(prepare_again(&mut again, &settings, &cameras).is_err());
        settings.alpha = None;
        settings.set("material.none.ior=2").unwrap();
        let error = prepare(&source, &settings, source.scene().unwrap(), &args).err().map(|e| crate::chain(&e));
        assert!(
            error.as_ref().is_some_and(|e| e.contains("cornell: material[1].name: there is no material")),
            "{error:?}"
        );
    }

    /// The camera that is made for a scene without one is the same to all, and is not moved by edits of the light.
    #[test]
    fn the_window_and_the_command_line_frame_a_scene_alike() {
        let source = Source::resolve("cornell").unwrap();
        let mut read = source.scene().unwrap();
        read.scene.cameras.clear();
        let mut settings = Settings::default();
        settings.set("sphere.0={centre = [0, 9, 0], radius = 2}").unwrap();
        let mut framed = read.clone();
        settings.add_default_camera(&mut framed.scene);
        let cameras = framed.scene.cameras.clone();
        assert_eq!(cameras.len(), 1);
        let args = InputArgs::default();
        let mut input = prepare(&source, &settings, read.clone(), &args).unwrap();
        assert_eq!(input.camera.pack(4, 3), cameras[0].pack(4, 3));
        let folder = tempfile::tempdir().unwrap();
        let sky = folder.path().join("sky.hdr");
        let pixels = image::ImageBuffer::from_pixel(2, 1, image::Rgb([1.0f32; 3]));
        image::DynamicImage::ImageRgb32F(pixels).save(&sky).unwrap();
        let mut lit = settings.clone();
        lit.set(&format!("environment.file={}", sky.display())).unwrap();
        let lit = prepare(&source, &lit, read.clone(), &args).unwrap();
        assert_eq!(lit.camera.pack(4, 3), cameras[0].pack(4, 3));
        let without = prepare(&source, &Settings::default(), read.clone(), &args).unwrap();
        assert_ne!(without.camera.pack(4, 3), cameras[0].pack(4, 3));
        settings.light_scale = Some(0.0);
        settings.set("environment.color=[1, 1, 1]").unwrap();
        let other = prepare(&source, &settings, read, &args).unwrap();
        prepare_again(&mut input, &settings, &cameras).unwrap();
        assert_eq!(other.camera.pack(4, 3), input.camera.pack(4, 3));
        assert_eq!(other.camera.pack(4, 3), cameras[0].pack(4, 3));
    }
}
