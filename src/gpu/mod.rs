//! Neighbour search and rendering in WGSL, on any adapter with compute shaders.

mod buffers;
mod context;
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
pub use search::{
    DeviceArray, DeviceNearest, DeviceNeighbours, PointSearch, Queries, QueryRadii, SearchTimes, Visitor,
};
