//! Where to compute: which backend, which device.

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context as _, Result, anyhow, bail};
use sunfleck::cpu::CpuStages;
#[cfg(feature = "gpu")]
use sunfleck::gpu::{self, Choice, Context, GpuStages, Method};
use sunfleck::ppm::Stages;
use sunfleck::scene::settings::{Index, Settings};
use sunfleck::scene::{Accelerator, PackedScene, Scene};

use crate::cli::{DeviceArgs, Usage};
use crate::job::Input;
use crate::progress::Progress;
use crate::scenes::Source;

/// What will compute.
pub enum Device {
    Cpu(Accelerator),
    #[cfg(feature = "gpu")]
    Gpu {
        context: Arc<Context>,
        method: Method,
        /// Of `--device`, if it was asked for by that.
        #[cfg_attr(not(feature = "view"), expect(dead_code, reason = "only the window tells how it was chosen"))]
        named: Option<String>,
    },
}

/// Limits the CPU's threads.
pub fn use_threads(threads: Option<u16>) -> Result<()> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    builder.build_global().map_err(|e| anyhow!("--threads: {e}"))
}

/// Opens what the flags ask for, to search as the settings of `source` say.
pub fn open_for(args: &DeviceArgs, source: &Source, progress: &Progress) -> Result<Device> {
    let mut device = open(args, progress)?;
    for warning in device.cannot(source) {
        progress.say(&format!("sunfleck: warning: {}", crate::one_line(&warning)));
    }
    device.follow(&source.settings)?;
    Ok(device)
}

/// Opens what the flags ask for.
pub fn open(args: &DeviceArgs, progress: &Progress) -> Result<Device> {
    let is_hardware = args.index == Some(Index::Hardware);
    let accelerator = args.accel.unwrap_or_default();
    let cpu = match accelerator {
        Accelerator::Kd if args.backend == "gpu" => {
            bail!(Usage("--accel kd needs --backend cpu, a GPU goes by its BVH".into()))
        }
        Accelerator::Kd => "--accel kd",
        Accelerator::Bvh if args.backend == "cpu" => "--backend cpu",
        Accelerator::Bvh => return open_gpu(args, is_hardware, progress),
    };
    if is_hardware {
        bail!(Usage(format!("--index hardware needs a GPU, {cpu} does without")));
    }
    match &args.device {
        Some(device) => bail!(Usage(format!("--device {device} names a GPU, {cpu} does without"))),
        None => Ok(Device::Cpu(accelerator)),
    }
}

/// `cpu`, or the best adapter there is: `gpu`, or `gpu-hardware` for its ray queries.
#[cfg(feature = "gpu")]
pub fn open_backend(name: &str) -> Result<Device> {
    Ok(match name {
        "cpu" => Device::Cpu(Accelerator::Bvh),
        _ => {
            let method = if name == "gpu-hardware" { Method::Hardware } else { Method::Tree };
            let context = Arc::new(context_for(method, &Choice::Any)?);
            Device::Gpu { context, method, named: None }
        }
    })
}

/// `cpu`: there is no other.
#[cfg(not(feature = "gpu"))]
pub fn open_backend(name: &str) -> Result<Device> {
    match name {
        "cpu" => Ok(Device::Cpu(Accelerator::Bvh)),
        _ => bail!("this sunfleck was built without the GPU backend"),
    }
}

/// Whether there is a GPU that is not software.
pub fn has_real_gpu() -> bool {
    #[cfg(feature = "gpu")]
    return gpu::list_devices().iter().any(gpu::DeviceInfo::is_real);
    #[cfg(not(feature = "gpu"))]
    false
}

#[cfg(not(feature = "gpu"))]
fn open_gpu(args: &DeviceArgs, is_hardware: bool, _: &Progress) -> Result<Device> {
    match args.backend == "gpu" || args.device.is_some() || is_hardware {
        true => bail!("this sunfleck was built without the GPU backend"),
        false => Ok(Device::Cpu(Accelerator::Bvh)),
    }
}

#[cfg(feature = "gpu")]
fn open_gpu(args: &DeviceArgs, is_hardware: bool, progress: &Progress) -> Result<Device> {
    let devices = gpu::list_devices();
    let method = if is_hardware { Method::Hardware } else { Method::Tree };
    let choice = match &args.device {
        Some(wanted) => {
            let index = wanted.parse().ok().filter(|&i: &usize| devices.iter().any(|d| d.index == i));
            index.map_or_else(|| Choice::Name(wanted.clone()), Choice::Index)
        }
        None if args.backend == "gpu" => Choice::Any,
        None if devices.iter().any(gpu::DeviceInfo::is_real) || method == Method::Hardware => Choice::Real,
        None => return Ok(Device::Cpu(Accelerator::Bvh)),
    };
    match context_for(method, &choice) {
        Ok(context) => Ok(Device::Gpu { context: Arc::new(context), method, named: args.device.clone() }),
        // Nobody asked for a GPU, and there is something else.
        Err(error) if choice == Choice::Real && method == Method::Tree => {
            progress.say(&format!("sunfleck: warning: {error}; using the CPU"));
            Ok(Device::Cpu(Accelerator::Bvh))
        }
        Err(error) => Err(error.into()),
    }
}

/// How this adapter searches as `settings` say.
#[cfg(feature = "gpu")]
fn method_for(context: &Context, settings: &Settings) -> Method {
    let is_hardware = settings.index == Some(Index::Hardware) && context.info().ray_queries;
    if is_hardware { Method::Hardware } else { Method::Tree }
}

/// The same adapter, opened once more.
#[cfg(feature = "gpu")]
fn reopened(context: &Context, method: Method) -> Result<Arc<Context>, sunfleck::ppm::Error> {
    context_for(method, &Choice::Index(context.info().index)).map(Arc::new)
}

/// An adapter opened with what the method needs.
#[cfg(feature = "gpu")]
fn context_for(method: Method, choice: &Choice) -> Result<Context, sunfleck::ppm::Error> {
    match method {
        Method::Tree => Context::new(choice),
        Method::Hardware => Context::with_ray_queries(choice),
    }
}

impl Device {
    /// `cpu` or `gpu`.
    pub fn backend(&self) -> &'static str {
        match self {
            Self::Cpu(_) => "cpu",
            #[cfg(feature = "gpu")]
            Self::Gpu { .. } => "gpu",
        }
    }

    /// The flags that choose it on a command line; how it searches is for the settings to say.
    #[cfg(feature = "view")]
    pub fn flags(&self) -> String {
        match self {
            #[cfg(feature = "gpu")]
            Self::Gpu { named: Some(name), .. } => format!("--backend gpu --device {}", crate::render::quote(name)),
            _ => format!("--backend {}", self.backend()),
        }
    }

    /// `tree` or `hardware`.
    pub fn index(&self) -> String {
        match self {
            Self::Cpu(_) => "tree".to_owned(),
            #[cfg(feature = "gpu")]
            Self::Gpu { method, .. } => method.to_string(),
        }
    }

    /// What finds what a ray meets.
    pub fn accelerator(&self) -> Accelerator {
        match self {
            Self::Cpu(accelerator) => *accelerator,
            #[cfg(feature = "gpu")]
            Self::Gpu { .. } => Accelerator::Bvh,
        }
    }

    /// Whether it can find photons by ray queries.
    pub fn has_ray_queries(&self) -> bool {
        match self {
            Self::Cpu(_) => false,
            #[cfg(feature = "gpu")]
            Self::Gpu { context, .. } => context.info().ray_queries,
        }
    }

    /// What the settings of `source` ask for and this device cannot do, a line each.
    pub fn cannot(&self, source: &Source) -> Vec<String> {
        let (settings, name) = (&source.settings, &source.name);
        let index = settings.index == Some(Index::Hardware) && !self.has_ray_queries();
        let accel = settings.accel == Some(Accelerator::Kd) && self.backend() != "cpu";
        let index = index
            .then(|| format!("{name}: index: hardware needs ray queries, which this device has not; going by tree"));
        let accel = accel.then(|| format!("{name}: accel: kd is for the CPU; a GPU goes by bvh"));
        index.into_iter().chain(accel).collect()
    }

    /// Whether it need not be opened anew to search as `settings` say.
    #[cfg(feature = "view")]
    pub fn can_follow(&self, settings: &Settings) -> bool {
        match self {
            Self::Cpu(_) => true,
            #[cfg(feature = "gpu")]
            Self::Gpu { context, method, .. } => *method == method_for(context, settings),
        }
    }

    /// Searches as `settings` say from now on, by the default where it cannot; opened anew, if it must be.
    pub fn follow(&mut self, settings: &Settings) -> Result<()> {
        match self {
            Self::Cpu(accelerator) => *accelerator = settings.accel.unwrap_or_default(),
            #[cfg(feature = "gpu")]
            Self::Gpu { context, method, .. } => {
                let wanted = method_for(context, settings);
                if *method != wanted {
                    *context = reopened(context, wanted).context("index")?;
                    *method = wanted;
                }
            }
        }
        Ok(())
    }

    /// Opens the adapter again, if this is one, and has failed for good.
    #[cfg(feature = "view")]
    pub fn recover(&mut self) -> Result<()> {
        if let Self::Gpu { context, method, .. } = self
            && context.check().is_err()
        {
            *context = reopened(context, *method)?;
        }
        Ok(())
    }

    /// What the adapter is called, if this is one.
    pub fn gpu_name(&self) -> Option<String> {
        match self {
            Self::Cpu(_) => None,
            #[cfg(feature = "gpu")]
            Self::Gpu { context, .. } => Some(context.info().to_string()),
        }
    }

    /// The scene as it is computed with; what it has of the one before is shared ([`PackedScene::new_after`]).
    pub fn pack(&self, scene: &Scene, before: &PackedScene) -> Result<Arc<PackedScene>> {
        let packed = PackedScene::new_after(before, scene);
        Ok(Arc::new(packed.accelerated(self.accelerator()).context("accel: no kd-tree over this scene")?))
    }

    /// Takes the scene to the device.
    pub fn stages(&self, input: &Input) -> Result<Box<dyn Stages>> {
        self.stages_of(self.pack(&input.scene, &PackedScene::default())?, input)
    }

    /// The same with a scene of [`Device::pack`].
    pub fn stages_of(&self, scene: Arc<PackedScene>, input: &Input) -> Result<Box<dyn Stages>> {
        let params = &input.params;
        let camera = input.camera.pack(params.size[0], params.size[1]);
        Ok(match self {
            Self::Cpu(_) => Box::new(CpuStages::new(scene, camera, params.film_size())),
            #[cfg(feature = "gpu")]
            Self::Gpu { context, method, .. } => {
                Box::new(GpuStages::with_method(Arc::clone(context), &scene, camera, *method)?)
            }
        })
    }
}

/// `--list-devices`.
pub fn list() -> Result<ExitCode> {
    #[cfg(feature = "gpu")]
    for device in gpu::list_devices() {
        crate::print(&format!("{:<4} {device}", device.index));
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    crate::print(&format!("cpu  {threads} threads (--backend cpu)"));
    Ok(ExitCode::SUCCESS)
}
