//! What is to be rendered: the command line over the settings file over the defaults, checked before anything slow.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};
use sunfleck::layout::EyeVertex;
use sunfleck::output::atomic;
use sunfleck::output::png::Look;
use sunfleck::ppm::{Direct, FirstRadius, Params};
use sunfleck::scene::{Camera, Scene};

use crate::cli::{RenderArgs, Usage};
use crate::scenes;
use crate::shim::{self, Settings};

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
    pub time: Option<Duration>,
}

impl Budget {
    /// How much of it is used up, from 0 to 1.
    pub fn spent(&self, iterations: u32, time: Duration) -> f64 {
        let by_iterations = self.iterations.map_or(0.0, |n| f64::from(iterations) / f64::from(n));
        let by_time = self.time.map_or(0.0, |t| time.as_secs_f64() / t.as_secs_f64());
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
    settings: Settings,
    file: PathBuf,
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
        let (file, mut settings) = scenes::resolve(&scene_name)?;
        for pair in &args.set {
            settings.set(pair).map_err(|e| Usage(format!("--set {pair}: {e}")))?;
        }
        let budget = match (args.iterations, args.seconds) {
            (None, None) => (Some(DEFAULT_ITERATIONS), Some(DEFAULT_SECONDS)),
            given => given,
        };
        Ok(Self {
            scene_name,
            outputs: args.output.clone(),
            look: Look { exposure: args.exposure.or(settings.exposure), tonemap: args.tonemap.unwrap_or_default() },
            budget: Budget { iterations: budget.0, time: budget.1.map(Duration::from_secs_f64) },
            one_radius: args.paper && args.radius.or(settings.radius).is_none_or(|r| r == FirstRadius::Automatic),
            settings,
            file,
        })
    }

    /// Reads the scene and chooses the camera and the estimator's parameters.
    pub fn load(&self, args: &RenderArgs) -> Result<Input> {
        let (mut scene, warnings) = scenes::load(&self.file)?;
        self.settings.apply_to_scene(&mut scene)?;
        if scene.cameras.is_empty() {
            scene.cameras.push(shim::default_camera(&scene));
        }
        let camera = camera(&scene, args.camera.as_ref().or(self.settings.camera.as_ref()))?;
        let params = self.params(args, &camera)?;
        Ok(Input { scene, camera, params, warnings })
    }

    fn params(&self, args: &RenderArgs, camera: &Camera) -> Result<Params> {
        let [width, height] = args.resolution.or(self.settings.size).unwrap_or_else(|| default_size(camera));
        let mut params = Params::new(width, height);
        if args.paper {
            params.direct = Direct::Photons;
            params.roulette = false;
            params.max_eye_segments = PAPER_SEGMENTS;
            params.max_photon_segments = PAPER_SEGMENTS;
        }
        if let Some(crop) = args.crop {
            params.crop = crop
                .pixels(params.size)
                .ok_or_else(|| Usage(format!("--crop: no pixel of {width}x{height} is left")))?;
        }
        params.seed = args.seed.unwrap_or(params.seed);
        params.n_paths = args.photons.or(self.settings.photons).unwrap_or(params.n_paths);
        params.alpha = args.alpha.or(self.settings.alpha).unwrap_or(params.alpha);
        params.radius = args.radius.or(self.settings.radius).unwrap_or(params.radius);
        params.kernel = args.kernel.unwrap_or(params.kernel);
        params.direct = args.direct.unwrap_or(params.direct);
        if let Some(n) = args.max_segments {
            params.max_segments = n;
            params.max_eye_segments = params.max_eye_segments.min(n);
            params.max_photon_segments = params.max_photon_segments.min(n);
        }
        check_memory(&params)?;
        Ok(params)
    }
}

fn default_size(camera: &Camera) -> [u32; 2] {
    let [width, height] = DEFAULT_SIZE;
    match camera.aspect {
        Some(aspect) => [(aspect * height as f32).round().clamp(1.0, 16_384.0) as u32, height],
        None => [width, height],
    }
}

/// The camera of that name or number; the first if none is named.
fn camera(scene: &Scene, wanted: Option<&String>) -> Result<Camera> {
    let Some(wanted) = wanted else { return Ok(scene.cameras[0].clone()) };
    let by_name = scene.cameras.iter().find(|c| &c.name == wanted);
    let by_number = || wanted.parse().ok().and_then(|i: usize| scene.cameras.get(i));
    by_name.or_else(by_number).cloned().with_context(|| {
        let list: Vec<_> = scene.cameras.iter().enumerate().map(|(i, c)| format!("{i} {:?}", c.name)).collect();
        format!("no camera {wanted:?}; there is {}", list.join(", "))
    })
}

/// Refuses what could not be written later, or would overwrite what is read.
fn check_outputs(args: &RenderArgs) -> Result<()> {
    if args.output.is_empty() && args.json.is_none() {
        bail!(Usage("nowhere to put the picture: add -o out.png or -o out.exr".into()));
    }
    for path in &args.output {
        let extension = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        if !matches!(extension.as_deref(), Some("exr" | "png")) {
            bail!(Usage(format!("-o {}: a picture ends in .exr or .png", path.display())));
        }
    }
    let files: Vec<_> = args.output.iter().chain(&args.json).collect();
    for (i, path) in files.iter().enumerate() {
        if files[..i].iter().any(|other| same_file(other, path)) {
            bail!(Usage(format!("{} is to be written twice", path.display())));
        }
        let scene = args.scene.as_ref().map(PathBuf::from);
        if scene.iter().chain(&args.env).any(|input| input.is_file() && same_file(input, path)) {
            bail!(Usage(format!("{} is read and to be written", path.display())));
        }
    }
    for path in files {
        atomic::check(path)?;
    }
    Ok(())
}

fn same_file(a: &Path, b: &Path) -> bool {
    let place = |path: &Path| {
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    a == b || place(a).is_some_and(|a| place(b).is_some_and(|b| a == b))
}

/// Refuses a picture or a number of photons that this machine has no room for.
fn check_memory(params: &Params) -> Result<()> {
    let [width, height] = params.film_size();
    // A pixel: what the eye sees, radiance, film, radius, and two copies on the way to a file.
    let pixel = size_of::<EyeVertex>() + 12 + 16 + 4 + 2 * 16;
    // A path: some four photons of 48 bytes, sorted into a second array, with keys and tree.
    let path = 4 * (2 * 48 + 16);
    let gib = |bytes: u64| bytes as f64 / f64::from(1 << 30);
    let needs = [
        (u64::from(width) * u64::from(height) * pixel as u64, format!("a picture of {width}x{height} pixels")),
        (u64::from(params.n_paths) * path, format!("{} photon paths an iteration", params.n_paths)),
    ];
    let available = available_memory();
    for (bytes, what) in needs {
        ensure!(
            bytes <= available,
            "{what} would need some {:.1} GiB of memory; {:.1} GiB are free",
            gib(bytes),
            gib(available)
        );
    }
    Ok(())
}

/// Bytes, as far as the system tells; else a bound on what anybody has.
fn available_memory() -> u64 {
    const UNKNOWN: u64 = 64 << 30;
    let number = |text: &str| text.split_whitespace().find_map(|word| word.parse::<u64>().ok());
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo")
        .and_then(|text| number(text.lines().find(|line| line.starts_with("MemAvailable:"))?))
        .map_or(UNKNOWN, |kib| kib.saturating_mul(1024));
    let group = |file: &str| read(&format!("/sys/fs/cgroup/{file}")).and_then(|text| number(&text));
    let allowed = group("memory.max").map_or(u64::MAX, |max| max.saturating_sub(group("memory.current").unwrap_or(0)));
    free.min(allowed)
}
