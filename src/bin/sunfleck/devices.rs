//! Where to compute: which backend, which device.

use std::process::ExitCode;
use std::sync::Arc;

use anyhow::{Context as _, Result, anyhow, bail};
use sunfleck::cpu::CpuStages;
#[cfg(feature = "gpu")]
use sunfleck::gpu::{self, Choice, Context, GpuStages, Method};
use sunfleck::ppm::Stages;
use sunfleck::scene::{Accelerator, PackedScene, Scene};

use crate::cli::{DeviceArgs, Usage};
use crate::job::Input;
use crate::progress::Progress;

/// What will compute.
pub enum Device {
    Cpu(Accelerator),
    #[cfg(feature = "gpu")]
    Gpu(Arc<Context>, Method),
}

/// How an open device searches.
#[cfg(feature = "view")]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Search {
    /// What finds photons; a CPU has but its tree.
    pub index: Method,
    /// What finds what a ray meets; a GPU has but its BVH.
    pub accelerator: Accelerator,
}

#[cfg(feature = "view")]
impl Search {
    /// The command line's flags for what is not the default, each after a space.
    pub fn flags(&self) -> &'static str {
        match (self.index, self.accelerator) {
            (Method::Hardware, _) => " --index hardware",
            (Method::Tree, Accelerator::Kd) => " --accel kd",
            (Method::Tree, Accelerator::Bvh) => "",
        }
    }
}

/// Limits the CPU's threads.
pub fn use_threads(threads: Option<u16>) -> Result<()> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads.map_or(0, usize::from));
    builder.build_global().map_err(|e| anyhow!("--threads: {e}"))
}

/// Opens what was asked for.
pub fn open(args: &DeviceArgs, progress: &Progress) -> Result<Device> {
    let accelerator = if args.accel == "kd" { Accelerator::Kd } else { Accelerator::Bvh };
    let cpu = match accelerator {
        Accelerator::Kd if args.backend == "gpu" => {
            bail!(Usage("--accel kd needs --backend cpu, a GPU goes by its BVH".into()))
        }
        Accelerator::Kd => "--accel kd",
        Accelerator::Bvh if args.backend == "cpu" => "--backend cpu",
        Accelerator::Bvh => return open_gpu(args, progress),
    };
    if args.index != "tree" {
        bail!(Usage(format!("--index {} needs a GPU, {cpu} does without", args.index)));
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
            Device::Gpu(Arc::new(context_for(method, &Choice::Any)?), method)
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
fn open_gpu(args: &DeviceArgs, _: &Progress) -> Result<Device> {
    match args.backend == "gpu" || args.device.is_some() || args.index != "tree" {
        true => bail!("this sunfleck was built without the GPU backend"),
        false => Ok(Device::Cpu(Accelerator::Bvh)),
    }
}

#[cfg(feature = "gpu")]
fn open_gpu(args: &DeviceArgs, progress: &Progress) -> Result<Device> {
    let devices = gpu::list_devices();
    let method = if args.index == "hardware" { Method::Hardware } else { Method::Tree };
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
        Ok(context) => Ok(Device::Gpu(Arc::new(context), method)),
        // Nobody asked for a GPU, and there is something else.
        Err(error) if choice == Choice::Real && method == Method::Tree => {
            progress.say(&format!("sunfleck: warning: {error}; using the CPU"));
            Ok(Device::Cpu(Accelerator::Bvh))
        }
        Err(error) => Err(error.into()),
    }
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
            Self::Gpu(..) => "gpu",
        }
    }

    /// `tree` or `hardware`.
    pub fn index(&self) -> String {
        match self {
            Self::Cpu(_) => "tree".to_owned(),
            #[cfg(feature = "gpu")]
            Self::Gpu(_, method) => method.to_string(),
        }
    }

    /// What finds what a ray meets.
    pub fn accelerator(&self) -> Accelerator {
        match self {
            Self::Cpu(accelerator) => *accelerator,
            #[cfg(feature = "gpu")]
            Self::Gpu(..) => Accelerator::Bvh,
        }
    }

    /// Whether it has failed for good.
    #[cfg(feature = "view")]
    pub fn is_lost(&self) -> bool {
        match self {
            Self::Cpu(_) => false,
            Self::Gpu(context, _) => context.check().is_err(),
        }
    }

    /// How it searches.
    #[cfg(feature = "view")]
    pub fn search(&self) -> Search {
        match self {
            Self::Cpu(accelerator) => Search { accelerator: *accelerator, ..Search::default() },
            Self::Gpu(_, method) => Search { index: *method, ..Search::default() },
        }
    }

    /// All ways in which it can search, the default first.
    #[cfg(feature = "view")]
    pub fn searches(&self) -> Vec<Search> {
        let mut all = vec![Search::default()];
        match self {
            Self::Cpu(_) => all.push(Search { accelerator: Accelerator::Kd, ..Search::default() }),
            Self::Gpu(context, _) if context.info().ray_queries => {
                all.push(Search { index: Method::Hardware, ..Search::default() });
            }
            Self::Gpu(..) => {}
        }
        all
    }

    /// The same adapter, opened once more, to search so.
    #[cfg(feature = "view")]
    pub fn reopen(&self, search: Search) -> Result<Self> {
        Ok(match self {
            Self::Cpu(_) => Self::Cpu(search.accelerator),
            Self::Gpu(context, _) => {
                Self::Gpu(Arc::new(context_for(search.index, &Choice::Index(context.info().index))?), search.index)
            }
        })
    }

    /// What the adapter is called, if this is one.
    pub fn gpu_name(&self) -> Option<String> {
        match self {
            Self::Cpu(_) => None,
            #[cfg(feature = "gpu")]
            Self::Gpu(context, _) => Some(context.info().to_string()),
        }
    }

    /// The scene as it is computed with. `before` is the same with other materials and lights, perhaps.
    pub fn pack(&self, scene: &Scene, before: Option<&PackedScene>) -> Result<Arc<PackedScene>> {
        let packed = match before {
            Some(before) => PackedScene::new_after(before, scene),
            None => PackedScene::new(scene),
        };
        Ok(Arc::new(packed.accelerated(self.accelerator()).context("no kd-tree over this scene")?))
    }

    /// Takes the scene to the device.
    pub fn stages(&self, input: &Input) -> Result<Box<dyn Stages>> {
        self.stages_of(self.pack(&input.scene, None)?, input)
    }

    /// The same with a scene of [`Device::pack`].
    pub fn stages_of(&self, scene: Arc<PackedScene>, input: &Input) -> Result<Box<dyn Stages>> {
        let params = &input.params;
        let camera = input.camera.pack(params.size[0], params.size[1]);
        Ok(match self {
            Self::Cpu(_) => Box::new(CpuStages::new(scene, camera, params.film_size())),
            #[cfg(feature = "gpu")]
            Self::Gpu(context, method) => {
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
