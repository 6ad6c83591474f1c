//! The command line: what may be typed, and what it means.

pub mod mesh;
pub mod points;
pub mod values;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Args, Parser, Subcommand};
use sunfleck::output::VERSION;
use sunfleck::output::tonemap::ToneMap;
use sunfleck::ppm::{Direct, FirstRadius, Kernel};
use sunfleck::scene::Accelerator;
use sunfleck::scene::settings::{Index, parse_count};
use toml::{Table, Value};
#[cfg(feature = "view")]
use values::noise;
use values::{Crop, accelerator, alpha, crop, direct, exposure, index, kernel, positive_f64, radius, size, tonemap};

/// Exit code of a command line that makes no sense.
pub const USAGE: u8 = 2;

/// An error of the command line that only shows once its parts are put together.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Usage(pub String);

const EXAMPLES: &str = "\
Examples:
  sunfleck render glass -o glass.png
  sunfleck render my.glb -o my.exr -o my.png --seconds 300 -r 1920x1080
  sunfleck compare my.exr reference.exr
  sunfleck points normals scan.ply -o normals.ply
  sunfleck mesh-check part.stl";

const RENDER_EXAMPLES: &str = "\
Examples:
  sunfleck render glass -o glass.png
      A scene that comes with sunfleck, for a minute at most.
  sunfleck render my.glb -o my.exr -o my.png --seconds 300 -r 1920x1080 --camera Front
      Five minutes on a file of yours.
  sunfleck render pool -o part.exr --crop 0.25,0.75,0.5,1 --iterations 1000
      The middle half of the picture's width, the lower half of its height.
  sunfleck render my.toml -o my.png --set photons=2M --env sky.hdr
      Settings from a file, two of them overridden.

Exit codes: 0 done, 1 error, 2 wrong usage, 130 interrupted and saved (a second Ctrl-C aborts at once).";

#[cfg(feature = "view")]
const VIEW_EXAMPLES: &str = "\
Examples:
  sunfleck view
      The scenes that come with sunfleck, and recent files.
  sunfleck view my.glb -o my.exr
      A file of yours; Ctrl+S saves my.exr.
  sunfleck view glass -r 960x540 --photons 200k --iterations 100
      A shipped scene with settings of yours; it pauses after 100 iterations.

Keys and mouse: press ? in the window.";

/// Renders scenes by progressive photon mapping: caustics through glass and water converge.
#[derive(Debug, Parser)]
#[command(name = "sunfleck", bin_name = "sunfleck", version = VERSION, after_help = EXAMPLES, max_term_width = 110)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Option<Command>,

    /// List the devices that can be rendered with, and exit
    #[arg(long, global = true, help_heading = "Device")]
    pub list_devices: bool,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene
    Render(Box<RenderArgs>),
    /// Watch a scene converge in a window, and turn it
    #[cfg(feature = "view")]
    View(ViewArgs),
    /// List the scenes that come with sunfleck
    Scenes,
    /// Write a scene as .glb, for other programs
    Export(ExportArgs),
    /// Measure how far a picture is from a reference, both .exr
    #[command(after_help = "relMSE is the mean over pixels and channels of (x - y)² / (y² + 0.01); \
        the trimmed one leaves out the worst 0.1 % of the pixels.")]
    Compare(CompareArgs),
    /// Make the evaluations of the neighbour search and of the kd-tree again: figures and tables
    Bench(crate::bench::BenchArgs),
    /// Geometry tasks on point clouds: normals, correspondence, registration
    Points(points::PointsArgs),
    /// Check a mesh: closed, manifold, normals outward, faces sound
    MeshCheck(mesh::MeshCheckArgs),
}

#[derive(Debug, Args)]
#[command(after_help = RENDER_EXAMPLES)]
pub struct RenderArgs {
    /// .glb, .gltf or .obj file, .toml settings file, or the name of a scene that comes with sunfleck
    #[arg(value_name = "SCENE")]
    pub scene: Option<String>,

    /// Where to put the picture: .exr (scene-linear, everything in its header) or .png (tone-mapped); repeatable
    #[arg(short, long, value_name = "FILE", help_heading = "Output")]
    pub output: Vec<PathBuf>,

    /// Stops by which a .png is brightened [default: automatic, from the log-average]
    #[arg(long, value_name = "STOPS", allow_hyphen_values = true, value_parser = exposure, help_heading = "Output")]
    pub exposure: Option<f32>,

    /// Tone curve of a .png [default: neutral]
    #[arg(long, value_name = "CURVE", value_parser = tonemap(), help_heading = "Output")]
    pub tonemap: Option<ToneMap>,

    /// Also write the estimated variance of each pixel's luminance into an .exr, as channel Variance.Y
    #[arg(long, help_heading = "Output")]
    pub variance: bool,

    /// Write settings, device and timings of every iteration to a JSON file
    #[arg(long, value_name = "FILE", help_heading = "Output")]
    pub json: Option<PathBuf>,

    /// Save the pictures every so many seconds on the way
    #[arg(long, value_name = "SECONDS", allow_hyphen_values = true, value_parser = positive_f64, help_heading = "Output")]
    pub save_every: Option<f64>,

    /// Stop after so many iterations [default without --seconds: 256, or after a minute]
    #[arg(long, visible_alias = "spp", value_name = "N", allow_hyphen_values = true, value_parser = parse_count, help_heading = "Budget")]
    pub iterations: Option<u32>,

    /// Stop after so many seconds of iterations; with --iterations, whichever comes first
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = positive_f64, help_heading = "Budget")]
    pub seconds: Option<f64>,

    #[command(flatten)]
    pub input: InputArgs,

    /// Camera, by name or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME|N", help_heading = "Picture")]
    pub camera: Option<String>,

    /// Environment map: .hdr or .exr, latitude-longitude
    #[arg(long, value_name = "FILE", help_heading = "Picture")]
    pub env: Option<PathBuf>,

    /// Override a key of the settings file, such as camera.yfov_degrees=40 or material.NAME.roughness=0.2; repeatable
    #[arg(long, value_name = "KEY=VALUE", help_heading = "Estimator")]
    pub set: Vec<String>,

    #[command(flatten)]
    pub device: DeviceArgs,

    /// Say nothing but errors
    #[arg(short, long, conflicts_with = "verbose", help_heading = "Messages")]
    pub quiet: bool,

    /// Say more: the scene, the radii, where the time went
    #[arg(short, long, help_heading = "Messages")]
    pub verbose: bool,
}

/// What computes.
#[derive(Clone, Debug, Args)]
pub struct DeviceArgs {
    /// Where to compute; auto: a real GPU, else the CPU (software adapters only when named)
    #[arg(long, value_parser = ["auto", "gpu", "cpu"], default_value = "auto", help_heading = "Device")]
    pub backend: String,

    /// GPU, by its number or a part of its name; see --list-devices
    #[arg(long, value_name = "N|NAME", help_heading = "Device")]
    pub device: Option<String>,

    /// How the GPU finds photons; hardware: by ray queries, where the adapter has them (see --list-devices) [default: tree]
    #[arg(long, value_parser = index(), help_heading = "Device")]
    pub index: Option<Index>,

    /// How the CPU finds what a ray meets: boxes or planes, the same picture; kd chooses the CPU [default: bvh]
    #[arg(long, value_parser = accelerator(), help_heading = "Device")]
    pub accel: Option<Accelerator>,

    /// CPU threads [default: all]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = clap::value_parser!(u16).range(1..=1024), help_heading = "Device")]
    pub threads: Option<u16>,
}

impl DeviceArgs {
    /// What the flags say over the settings, as `--set` takes it.
    pub fn pairs(&self) -> Vec<String> {
        let index = self.index.iter().map(|index| format!("index={index}"));
        index.chain(self.accel.iter().map(|accel| format!("accel={accel}"))).collect()
    }
}

#[cfg(feature = "view")]
#[derive(Debug, Args)]
#[command(after_help = VIEW_EXAMPLES)]
pub struct ViewArgs {
    /// .glb, .gltf or .obj file, .toml settings file, or the name of a scene that comes with sunfleck [default: start page]
    #[arg(value_name = "SCENE")]
    pub scene: Option<String>,

    /// Where saving puts the picture of SCENE, or of the first that is opened, without asking: .exr or .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Picture to compare with and to measure errors against, .exr
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Pause after so many iterations [default: as the settings file says, else never]
    #[arg(long, visible_alias = "spp", value_name = "N", allow_hyphen_values = true, value_parser = parse_count)]
    pub iterations: Option<u32>,

    /// Pause after so many seconds of iterations [default: as the settings file says, else never]
    #[arg(long, value_name = "S", allow_hyphen_values = true, value_parser = positive_f64)]
    pub seconds: Option<f64>,

    /// Pause once the estimated relMSE is no more than this
    #[arg(long, value_name = "RELMSE", allow_hyphen_values = true, value_parser = noise)]
    pub noise: Option<f64>,

    /// Size of the picture [default: 720 high, as wide as the camera says or 1280]
    #[arg(short, long, value_name = "WxH", value_parser = size)]
    pub resolution: Option<[u32; 2]>,

    /// Camera to begin with, by name or by number from 0 [default: the first]
    #[arg(long, value_name = "NAME|N")]
    pub camera: Option<String>,

    /// Environment map: .hdr or .exr, latitude-longitude
    #[arg(long, value_name = "FILE")]
    pub env: Option<PathBuf>,

    /// Photons emitted an iteration, such as 500k or 2M [default: 500k]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = parse_count)]
    pub photons: Option<u32>,

    /// Override a key of the settings file, such as alpha=0.7 or camera.yfov_degrees=40; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    #[command(flatten)]
    pub device: DeviceArgs,
}

/// What `--camera` and `--env` say, each in place of the file's whole table, and the pairs of `--set`, which change it.
pub fn over_named(camera: Option<&str>, env: Option<&Path>, set: &[String]) -> Result<Vec<String>, Usage> {
    let mut named = vec![];
    named.extend(camera.map(|name| ("camera", "name", Value::from(name))));
    if let Some(path) = env {
        // The settings file may lie elsewhere.
        let file = crate::scenes::absolute(path).map_err(|e| Usage(format!("--env {e:#}")))?;
        named.push(("environment", "file", Value::from(file)));
    }
    let mut pairs = vec![];
    for (table, field, value) in &named {
        let fields = Table::from_iter([((*field).to_owned(), value.clone())]);
        pairs.push(format!("{table}={}", Value::Table(fields)));
    }
    pairs.extend_from_slice(set);
    // Over a pair that says the same, as any flag.
    pairs.extend(named.iter().map(|(table, field, value)| format!("{table}.{field}={value}")));
    Ok(pairs)
}

impl RenderArgs {
    /// What `--camera`, `--env`, `--set` and the flags of the device say over the settings, as `--set` takes it.
    pub fn pairs(&self) -> Result<Vec<String>, Usage> {
        let mut pairs = over_named(self.camera.as_deref(), self.env.as_deref(), &self.set)?;
        pairs.extend(self.device.pairs());
        Ok(pairs)
    }
}

#[cfg(feature = "view")]
impl ViewArgs {
    /// What the flags but those of the device say over the settings, as `--set` takes it.
    pub fn pairs(&self) -> Result<Vec<String>, Usage> {
        let mut pairs = over_named(self.camera.as_deref(), self.env.as_deref(), &self.set)?;
        pairs.extend(self.resolution.map(|[width, height]| format!("size=[{width}, {height}]")));
        pairs.extend(self.photons.map(|n| format!("photons={n}")));
        Ok(pairs)
    }
}

/// What is said over the settings of a scene: picture and estimator.
#[derive(Clone, Debug, Default, Args)]
pub struct InputArgs {
    /// Size of the picture [default: 720 high, as wide as the camera says or 1280]
    #[arg(short, long, value_name = "WxH", value_parser = size, help_heading = "Picture")]
    pub resolution: Option<[u32; 2]>,

    /// Compute a part only: fractions of width and height between 0 and 1, y down
    #[arg(long, value_name = "x0,x1,y0,y1", allow_hyphen_values = true, value_parser = crop, help_heading = "Picture")]
    pub crop: Option<Crop>,

    /// Photons emitted an iteration, such as 500k or 2M [default: 500k]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = parse_count, help_heading = "Estimator")]
    pub photons: Option<u32>,

    /// First radius, metres, or `automatic`: one per pixel from its footprint and a first photon pass
    #[arg(long, value_name = "METRES", allow_hyphen_values = true, value_parser = radius, help_heading = "Estimator")]
    pub radius: Option<FirstRadius>,

    /// How fast the radius shrinks, between 0 and 1 [default: 2/3]
    #[arg(long, allow_hyphen_values = true, value_parser = alpha, help_heading = "Estimator")]
    pub alpha: Option<f32>,

    /// Density estimation kernel [default: epanechnikov]
    #[arg(long, value_parser = kernel(), help_heading = "Estimator")]
    pub kernel: Option<Kernel>,

    /// Who brings light straight from a lamp: sampling at the hit, or photons [default: sampled]
    #[arg(long, value_name = "BY", value_parser = direct(), help_heading = "Estimator")]
    pub direct: Option<Direct>,

    /// Longest path from lamp to lens, segments [default: no limit, Russian roulette ends paths]
    #[arg(long, value_name = "N", allow_hyphen_values = true, value_parser = parse_count, help_heading = "Estimator")]
    pub max_segments: Option<u32>,

    /// The setting of the literature: five segments a side, no Russian roulette, photons carry everything, one radius
    #[arg(long, help_heading = "Estimator")]
    pub paper: bool,

    /// Of the random numbers: same seed, backend and device, same picture [default: 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true, help_heading = "Estimator")]
    pub seed: Option<u32>,
}

#[derive(Debug, Args)]
pub struct ExportArgs {
    /// Scene file, settings file or the name of a scene that comes with sunfleck
    #[arg(value_name = "SCENE")]
    pub scene: String,
    /// The .glb file
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
}

#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The picture
    #[arg(value_name = "PICTURE.exr")]
    pub picture: PathBuf,
    /// What it should be
    #[arg(value_name = "REFERENCE.exr")]
    pub reference: PathBuf,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}

impl Cli {
    /// The parsed command line, or the exit code after having said what is wrong with it.
    pub fn read() -> Result<Self, ExitCode> {
        Self::try_parse().map_err(|error| match error.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
                let _ = error.print();
                ExitCode::SUCCESS
            }
            kind => {
                let first = std::env::args().nth(1).map(ContextValue::String);
                let is_first = error.get(ContextKind::InvalidSubcommand) == first.as_ref();
                crate::say_error(&usage_line(&error.to_string(), kind, is_first));
                ExitCode::from(USAGE)
            }
        })
    }
}

/// clap's error in one line: what is wrong, its tips, where to read on; without its usage text. `is_first` says that the
/// first word of the command line is wrong.
fn usage_line(text: &str, kind: ErrorKind, is_first: bool) -> String {
    let wrong = text.split("\nUsage:").next().unwrap_or(text);
    let wrong = wrong.split("\nFor more information").next().unwrap_or(wrong);
    let mut line = crate::one_line(wrong.trim_start_matches("error: ")).replace(" tip: ", "; ");
    if kind == ErrorKind::InvalidSubcommand && is_first {
        line += "; to render a scene: sunfleck render SCENE -o out.png";
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    #[cfg(feature = "view")]
    use sunfleck::scene::settings::{CameraSettings, EnvironmentSettings};

    #[test]
    fn the_declaration_is_sound() {
        Cli::command().debug_assert();
    }

    #[cfg(feature = "view")]
    #[test]
    fn flags_of_the_window_are_settings() {
        let line = [
            "sunfleck",
            "view",
            "glass",
            "-r",
            "64x48",
            "--photons",
            "2k",
            "--camera",
            "a \"b\"\u{a0}'c'\n",
            "--env",
            "/x\u{a0}y.hdr",
            "--set",
            "camera.forward=[0, 0, 1]",
            "--set",
            "camera.name=another",
            "--set",
            "environment.rotation_degrees=90",
            "--index",
            "hardware",
        ];
        let Some(Command::View(args)) = Cli::parse_from(line).command else { panic!("another command") };
        let mut settings = sunfleck::scene::settings::Settings::default();
        // Of a file: what is named takes the place of the whole table.
        settings.set("camera={name=\"c\", yfov_degrees=10}").unwrap();
        settings.set("environment={color=[1, 0, 0], strength=7}").unwrap();
        for pair in args.pairs().unwrap().into_iter().chain(args.device.pairs()) {
            settings.set(&pair).unwrap();
        }
        assert_eq!(settings.to_toml().matches("index = \"hardware\"").count(), 1);
        assert_eq!(settings.size.map(|size| size.0), Some([64, 48]));
        assert_eq!(settings.photons.map(|n| n.0), Some(2000));
        let name = Some("a \"b\"\u{a0}'c'\n".to_owned());
        assert_eq!(
            settings.camera,
            Some(CameraSettings { name, forward: Some([0.0, 0.0, 1.0]), ..Default::default() })
        );
        let file = Some(crate::scenes::absolute(Path::new("/x\u{a0}y.hdr")).unwrap());
        assert_eq!(
            settings.environment,
            Some(EnvironmentSettings { file, rotation_degrees: Some(90.0), ..Default::default() })
        );
    }
}
