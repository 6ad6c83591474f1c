//! Compute pipelines and the recording of their dispatches.

use std::collections::HashMap;
use std::num::NonZeroU64;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use bytemuck::{Pod, Zeroable};

use super::context::{Context, Scopes};
use super::shaders;
use crate::device::{Error, Interrupt};

/// How a kernel uses a storage buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Reads it.
    Read,
    /// Reads or writes it.
    Write,
}

/// A compute pipeline.
pub(super) struct Kernel {
    name: &'static str,
    pipeline: wgpu::ComputePipeline,
    bindings: wgpu::BindGroupLayout,
    /// How many of [`Shared`]'s further groups it sees.
    n_groups: usize,
}

/// Twin of `Arguments` in `shaders/lib/common.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Arguments {
    pub(super) values: [u32; 4],
    pub(super) levels: [[u32; 2]; 12],
    pub(super) further: [u32; 4],
}

impl From<[u32; 4]> for Arguments {
    fn from(values: [u32; 4]) -> Self {
        Self { values, ..Default::default() }
    }
}

/// Distance of the arguments of two dispatches: the largest alignment any adapter asks for.
const STRIDE: u64 = 256;
/// Dispatches in one submission.
const CAPACITY: u64 = 256;

/// A bind group of several kernels.
pub(super) struct Group {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
}

impl Group {
    /// One binding after the other: how it is used, and what it is.
    pub(super) fn new(
        context: &Context,
        label: &str,
        bindings: &[(wgpu::BindingType, wgpu::BindingResource<'_>)],
    ) -> Self {
        let numbered = || (0..).zip(bindings);
        let entries: Vec<_> = numbered()
            .map(|(binding, &(ty, _))| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty,
                count: None,
            })
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some(label), entries: &entries };
        let layout = context.device.create_bind_group_layout(&descriptor);
        let entries: Vec<_> = numbered()
            .map(|(binding, (_, resource))| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(label), layout: &layout, entries: &entries };
        let group = context.device.create_bind_group(&descriptor);
        Self { layout, group }
    }
}

/// A uniform of `bytes`; `dynamic` when each dispatch sees another part of the buffer.
pub(super) fn uniform(bytes: u64, dynamic: bool) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: dynamic,
        min_binding_size: NonZeroU64::new(bytes),
    }
}

/// A storage buffer.
pub(super) fn storage(access: Access) -> wgpu::BindingType {
    wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Storage { read_only: access == Access::Read },
        has_dynamic_offset: false,
        min_binding_size: None,
    }
}

impl From<Access> for wgpu::BindingType {
    fn from(access: Access) -> Self {
        storage(access)
    }
}

/// What ray queries search.
pub(super) const ACCELERATION_STRUCTURE: wgpu::BindingType =
    wgpu::BindingType::AccelerationStructure { vertex_return: false };

/// What all kernels share. Bind group 0 is a kernel's own, 1 holds the arguments of the dispatch, those after it are the
/// user's: a kernel sees them if its text names `@group(2)`, or `@group(3)`.
pub(super) struct Shared {
    arguments: wgpu::Buffer,
    /// From 1 on.
    groups: Vec<Group>,
    /// What [`Batch::cut`] asks.
    pub(super) interrupt: Interrupt,
    queue: Mutex<Queue>,
}

/// What is known of the device's queue.
struct Queue {
    /// What it was given last.
    last: Option<Submitted>,
    /// When it was last known to have come to the end of something.
    reached: Instant,
}

struct Submitted {
    index: wgpu::SubmissionIndex,
    when: Instant,
    amount: u32,
}

/// How long something that was submitted took.
#[cfg_attr(not(feature = "render"), expect(dead_code, reason = "only the stages of a render learn from it"))]
pub(super) struct Took {
    /// Of what it did, as [`Batch::cut`] was told.
    pub(super) amount: u32,
    pub(super) seconds: f64,
}

impl Shared {
    pub(super) fn new(context: &Context, further: Vec<Group>) -> Self {
        let arguments = context.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("arguments"),
            size: STRIDE * CAPACITY,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let window = wgpu::BufferBinding { buffer: &arguments, offset: 0, size: NonZeroU64::new(STRIDE) };
        let binding = (uniform(size_of::<Arguments>() as u64, true), wgpu::BindingResource::Buffer(window));
        let mut groups = vec![Group::new(context, "arguments", &[binding])];
        groups.extend(further);
        let queue = Mutex::new(Queue { last: None, reached: Instant::now() });
        Self { arguments, groups, interrupt: Interrupt::default(), queue }
    }

    /// Other groups of the same layouts, from 2 on.
    #[cfg(feature = "render")]
    pub(super) fn set_groups(&mut self, further: impl IntoIterator<Item = Group>) {
        self.groups.truncate(1);
        self.groups.extend(further);
    }

    fn queue(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits until the device has done what it was given before the last.
    fn wait_for(&self, context: &Context, before: Submitted) -> Result<Took, Error> {
        context.wait_for(before.index)?;
        let now = Instant::now();
        let began = std::mem::replace(&mut self.queue().reached, now).max(before.when);
        Ok(Took { amount: before.amount, seconds: (now - began).as_secs_f64() })
    }
}

/// The kernels of one device by module and entry point; each is made once.
pub(super) type Cache = Mutex<HashMap<(&'static str, &'static str), Arc<Kernel>>>;

/// Makes kernels.
pub(super) struct Modules<'a> {
    context: &'a Context,
    shared: &'a Shared,
}

impl<'a> Modules<'a> {
    pub(super) fn new(context: &'a Context, shared: &'a Shared) -> Self {
        Self { context, shared }
    }

    /// Where they are made.
    pub(super) fn context(&self) -> &'a Context {
        self.context
    }

    /// The entry point `name` of `module`; `bindings` are those of its group 0, storage buffers by their [`Access`].
    pub(super) fn kernel(
        &self,
        module: &'static str,
        name: &'static str,
        bindings: &[impl Copy + Into<wgpu::BindingType>],
    ) -> Result<Arc<Kernel>, Error> {
        let mut known = self.context.kernels.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(kernel) = known.get(&(module, name)) {
            return Ok(Arc::clone(kernel));
        }
        let built = self.build(module, shaders::source(module), name, bindings, false);
        let kernel = Arc::new(built.map_err(|error| self.context.error(format!("{module}.wgsl: {error}")))?);
        known.insert((module, name), Arc::clone(&kernel));
        Ok(kernel)
    }

    /// The entry point `name` of a text from outside this crate; what is wrong with it is an error that names the line.
    pub(super) fn custom(
        &self,
        source: String,
        name: &'static str,
        bindings: &[impl Copy + Into<wgpu::BindingType>],
    ) -> Result<Kernel, Error> {
        self.build("custom", source, name, bindings, true).map_err(|error| Error::Shader(error.to_string()))
    }

    fn build(
        &self,
        module: &str,
        source: String,
        name: &'static str,
        bindings: &[impl Copy + Into<wgpu::BindingType>],
        zero_workgroup_memory: bool,
    ) -> Result<Kernel, wgpu::Error> {
        let device = &self.context.device;
        let n_groups = (1..4).rev().find(|n| source.contains(&format!("@group({n})"))).unwrap_or(0);
        // A text of the user's own may name a group that there is none of: the pipeline is then refused.
        let n_groups = n_groups.min(self.shared.groups.len());
        let build = || {
            let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(module),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            let entries: Vec<_> = (0..)
                .zip(bindings)
                .map(|(binding, &ty)| wgpu::BindGroupLayoutEntry {
                    binding,
                    visibility: wgpu::ShaderStages::COMPUTE,
                    ty: ty.into(),
                    count: None,
                })
                .collect();
            let bindings = device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries });
            let shared = self.shared.groups[..n_groups].iter().map(|group| Some(&group.layout));
            let groups: Vec<_> = std::iter::once(Some(&bindings)).chain(shared).collect();
            let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(name),
                bind_group_layouts: &groups,
                immediate_size: 0,
            });
            let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&layout),
                module: &shader,
                entry_point: Some(name),
                compilation_options: wgpu::PipelineCompilationOptions {
                    // Nothing of this crate reads workgroup memory that it has not written.
                    zero_initialize_workgroup_memory: zero_workgroup_memory,
                    ..Default::default()
                },
                cache: None,
            });
            Kernel { name, pipeline, bindings, n_groups }
        };
        self.context.scoped(build)
    }
}

/// Dispatches that are submitted together. What goes wrong while they are recorded is returned by [`Batch::submit`], and
/// never reaches the handler of a device's owner; batches of one thread must end in reverse order of their beginning.
pub(super) struct Batch<'a> {
    context: &'a Context,
    shared: &'a Shared,
    label: &'a str,
    scopes: Scopes,
    encoder: wgpu::CommandEncoder,
    arguments: Vec<u8>,
}

impl<'a> Batch<'a> {
    pub(super) fn new(context: &'a Context, shared: &'a Shared, label: &'a str) -> Self {
        let scopes = Scopes::new(&context.device);
        if let Some(last) = &mut shared.queue().last {
            // Of another batch, which counts something else.
            last.amount = 0;
        }
        Self { context, shared, label, scopes, encoder: encoder(context, label), arguments: Vec::new() }
    }

    /// For copies and timestamps.
    pub(super) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
    }

    /// Writes the beginning of a buffer, before anything in this batch runs.
    #[cfg(feature = "render")]
    pub(super) fn write(&self, buffer: &wgpu::Buffer, bytes: &[u8]) {
        self.context.queue.write_buffer(buffer, 0, bytes);
    }

    /// Records `groups` workgroups.
    pub(super) fn dispatch(
        &mut self,
        kernel: &Kernel,
        buffers: &[wgpu::BindingResource<'_>],
        arguments: impl Into<Arguments>,
        groups: u32,
    ) {
        if groups == 0 {
            return;
        }
        let entries: Vec<_> = buffers
            .iter()
            .enumerate()
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding: binding as u32, resource: resource.clone() })
            .collect();
        let group = self.context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(kernel.name),
            layout: &kernel.bindings,
            entries: &entries,
        });
        let offset = self.arguments.len();
        debug_assert!((offset as u64) < STRIDE * CAPACITY, "too many dispatches in one submission");
        self.arguments.extend_from_slice(bytemuck::bytes_of(&arguments.into()));
        self.arguments.resize(offset + STRIDE as usize, 0);

        let mut pass = self
            .encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor { label: Some(kernel.name), timestamp_writes: None });
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &group, &[]);
        // Without those of a scene that could not be set, that is an error of the dispatch.
        for (i, shared) in self.shared.groups.iter().take(kernel.n_groups).enumerate() {
            let offsets: &[u32] = if i == 0 { &[offset as u32] } else { &[] };
            pass.set_bind_group(i as u32 + 1, &shared.group, offsets);
        }
        // One dimension holds 65535; the kernels put the two together again.
        let most = self.context.limits.max_compute_workgroups_per_dimension.min(65535);
        let rows = groups.div_ceil(most);
        pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
    }

    /// Hands the device what was recorded so far, `amount` of something; more can be recorded. The device is left with no
    /// more than this to do, or [`Error::Interrupted`] returned. Returns how long what was before it took.
    pub(super) fn cut(&mut self, amount: u32) -> Result<Option<Took>, Error> {
        let next = encoder(self.context, self.label);
        let recorded = std::mem::replace(&mut self.encoder, next);
        let before = hand_over(self.context, self.shared, recorded, &self.arguments, amount);
        self.arguments.clear();
        self.context.check()?;
        self.shared.interrupt.check()?;
        let Some(before) = before else { return Ok(None) };
        let took = self.shared.wait_for(self.context, before)?;
        self.shared.interrupt.check()?;
        Ok(Some(took))
    }

    /// [`Batch::cut`] where only an interrupt asks for it.
    pub(super) fn cut_if_interruptible(&mut self, amount: u32) -> Result<Option<Took>, Error> {
        if self.shared.interrupt.is_set() { self.cut(amount) } else { Ok(None) }
    }

    /// Hands it all to the device.
    pub(super) fn submit(self) -> Result<(), Error> {
        hand_over(self.context, self.shared, self.encoder, &self.arguments, 0);
        if let Some(error) = self.scopes.first() {
            return Err(self.context.error(error.to_string()));
        }
        self.context.check()
    }
}

/// Returns what was submitted before.
fn hand_over(
    context: &Context,
    shared: &Shared,
    recorded: wgpu::CommandEncoder,
    arguments: &[u8],
    amount: u32,
) -> Option<Submitted> {
    if !arguments.is_empty() {
        context.queue.write_buffer(&shared.arguments, 0, arguments);
    }
    let when = Instant::now();
    let index = context.queue.submit([recorded.finish()]);
    shared.queue().last.replace(Submitted { index, when, amount })
}

fn encoder(context: &Context, label: &str) -> wgpu::CommandEncoder {
    context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) })
}
