//! Neighbour search and rendering in WGSL, on any adapter with compute shaders.

mod buffers;
mod context;
mod hardware;
mod index;
mod kernels;
#[cfg(feature = "render")]
mod render;
mod search;
pub mod shaders;
mod timer;

pub use context::{Choice, Context, DeviceInfo, DeviceKind, list_devices, required_limits};
pub use kernels::Access;
#[cfg(feature = "render")]
pub use render::{BsdfAnswer, BsdfQuery, GpuStages};
/// The version of wgpu whose devices and buffers are taken and given here.
pub use wgpu;

pub use search::{
    DeviceArray, DeviceNearest, DeviceNeighbours, PointSearch, Queries, QueryRadii, SearchTimes, Visitor,
};

/// How neighbours are found on the GPU.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// By a walk of our own through a tree of tight boxes, which serves any radius: on every adapter.
    #[default]
    Tree,
    /// By the adapter's ray queries over boxes as wide as the largest radius ([`Context::with_ray_queries`]).
    Hardware,
}

impl std::fmt::Display for Method {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Tree => "tree",
            Self::Hardware => "hardware",
        })
    }
}
