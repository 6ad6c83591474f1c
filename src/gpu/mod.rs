//! The GPU backend: the stages in WGSL, on any adapter with compute shaders.

mod buffers;
mod context;
mod index;
mod kernels;
mod photons;
mod probe;
mod scene;
pub mod shaders;
mod stages;
mod timer;

pub use context::{Choice, Context, DeviceInfo, DeviceKind, list_devices};
pub use probe::{BsdfAnswer, BsdfQuery};
pub use stages::GpuStages;
