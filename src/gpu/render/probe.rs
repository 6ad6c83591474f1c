//! The BSDF of the shaders by itself, so that tests can compare it with the CPU's.

use bytemuck::{Pod, Zeroable};

use crate::device::Error;
use crate::gpu::buffers::{Array, Readback};
use crate::gpu::context::Context;
use crate::gpu::kernels::{Access, Batch, Modules, Shared};
use crate::layout::EyeVertex;

/// What to ask. Twin of the struct in `shaders/probe.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct BsdfQuery {
    /// The material; the known direction is its `outgoing`.
    pub vertex: EyeVertex,
    /// The other direction to evaluate, unit, world space.
    pub other: [f32; 3],
    /// 1: the diffuse lobe, 2: the others, 3: all.
    pub lobes: u32,
    /// To sample by.
    pub u: [f32; 3],
    /// 0: the eye's direction is known; 1: the light's.
    pub transport: u32,
}

/// What is answered. Twin of the struct in `shaders/probe.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct BsdfAnswer {
    /// BSDF, 1/sr.
    pub value: [f32; 3],
    /// Density of the other direction, per steradian.
    pub pdf: f32,
    /// Sampled, unit, world space.
    pub direction: [f32; 3],
    /// Its density.
    pub sampled_pdf: f32,
    /// Its weight.
    pub weight: [f32; 3],
    /// Bit 0: there is a direction; bit 1: it goes through.
    pub flags: u32,
}

pub(super) fn ask(
    context: &Context,
    shared: &Shared,
    readback: &mut Readback,
    queries: &[BsdfQuery],
) -> Result<Vec<BsdfAnswer>, Error> {
    let kernel = Modules::new(context, shared).kernel("probe", "probe", &[Access::Read, Access::Write])?;
    let mut asked = Array::new::<BsdfQuery>("queries");
    let mut answered = Array::new::<BsdfAnswer>("answers");
    asked.write(context, queries)?;
    answered.reserve(context, queries.len() as u64)?;
    let n = queries.len() as u32;
    let mut batch = Batch::new(context, shared, "probe");
    batch.dispatch(&kernel, &[asked.all(), answered.all()], [n, 0, 0, 0], n.div_ceil(64));
    batch.submit()?;
    readback.read(context, shared, answered.raw(), queries.len())
}
