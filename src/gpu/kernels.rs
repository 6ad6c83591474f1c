//! Compute pipelines and the recording of their dispatches.

use std::collections::HashMap;
use std::num::NonZeroU64;
use std::sync::{Arc, Mutex};

use bytemuck::{Pod, Zeroable};

use super::context::Context;
use super::scene::{SceneBuffers, Tables};
use super::shaders;
use crate::layout::{Camera, Frame, SceneInfo};
use crate::ppm::Error;

/// How a kernel uses a storage buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Access {
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
    /// Whether it reads the scene.
    scene: bool,
}

/// Twin of `Arguments` in `shaders/lib/common.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Arguments {
    pub(super) values: [u32; 4],
    pub(super) levels: [[u32; 2]; 12],
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

/// What all kernels share: the second bind group, and the third for those that read the scene.
pub(super) struct Shared {
    layout: wgpu::BindGroupLayout,
    group: wgpu::BindGroup,
    arguments: wgpu::Buffer,
    frame: wgpu::Buffer,
    scene: SceneBuffers,
}

impl Shared {
    pub(super) fn new(context: &Context, scene: SceneBuffers) -> Self {
        let device = &context.device;
        let entry = |binding, dynamic, bytes: usize| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::COMPUTE,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: dynamic,
                min_binding_size: NonZeroU64::new(bytes as u64),
            },
            count: None,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("shared"),
            entries: &[
                entry(0, true, size_of::<Arguments>()),
                entry(1, false, size_of::<Frame>()),
                entry(2, false, size_of::<Camera>()),
                entry(3, false, size_of::<SceneInfo>()),
                entry(4, false, size_of::<Tables>()),
            ],
        });
        let uniform = |label, size| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let arguments = uniform("arguments", STRIDE * CAPACITY);
        let frame = uniform("frame", size_of::<Frame>() as u64);
        let window = wgpu::BufferBinding { buffer: &arguments, offset: 0, size: NonZeroU64::new(STRIDE) };
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("shared"),
            layout: &layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::Buffer(window) },
                wgpu::BindGroupEntry { binding: 1, resource: frame.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 2, resource: scene.camera.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 3, resource: scene.info.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 4, resource: scene.tables.as_entire_binding() },
            ],
        });
        Self { layout, group, arguments, frame, scene }
    }

    /// Constants of the dispatches submitted from now on.
    pub(super) fn set_frame(&self, context: &Context, frame: &Frame) {
        context.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(frame));
    }
}

/// The kernels of one device; each is made once.
pub(super) type Cache = Mutex<HashMap<&'static str, Arc<Kernel>>>;

/// Makes kernels.
pub(super) struct Modules<'a> {
    context: &'a Context,
    shared: &'a Shared,
}

impl<'a> Modules<'a> {
    pub(super) fn new(context: &'a Context, shared: &'a Shared) -> Self {
        Self { context, shared }
    }

    /// The entry point `name` of `module`, whose storage buffers are used as `accesses` says, in the order of their
    /// bindings; the scene's come besides if the module imports it.
    pub(super) fn kernel(&self, module: &str, name: &'static str, accesses: &[Access]) -> Result<Arc<Kernel>, Error> {
        let mut known = self.context.kernels.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(kernel) = known.get(name) {
            return Ok(Arc::clone(kernel));
        }
        let kernel = Arc::new(self.build(module, name, accesses)?);
        known.insert(name, Arc::clone(&kernel));
        Ok(kernel)
    }

    fn build(&self, module: &str, name: &'static str, accesses: &[Access]) -> Result<Kernel, Error> {
        let device = &self.context.device;
        let source = shaders::source(module);
        let scene = source.contains("@group(2)");
        let build = || {
            let shader = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(module),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            let entries: Vec<_> = accesses
                .iter()
                .enumerate()
                .map(|(binding, access)| wgpu::BindGroupLayoutEntry {
                    binding: binding as u32,
                    visibility: wgpu::ShaderStages::COMPUTE,
                    ty: wgpu::BindingType::Buffer {
                        ty: wgpu::BufferBindingType::Storage { read_only: *access == Access::Read },
                        has_dynamic_offset: false,
                        min_binding_size: None,
                    },
                    count: None,
                })
                .collect();
            let bindings = device
                .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(name), entries: &entries });
            let mut groups = vec![Some(&bindings), Some(&self.shared.layout)];
            if scene {
                groups.push(Some(&self.shared.scene.layout));
            }
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
                    // Nothing here reads workgroup memory that it has not written.
                    zero_initialize_workgroup_memory: false,
                    ..Default::default()
                },
                cache: None,
            });
            Kernel { name, pipeline, bindings, scene }
        };
        self.context.scoped(build).map_err(|error| self.context.error(format!("{module}.wgsl: {error}")))
    }
}

/// Dispatches that are submitted together.
pub(super) struct Batch<'a> {
    context: &'a Context,
    shared: &'a Shared,
    encoder: wgpu::CommandEncoder,
    arguments: Vec<u8>,
}

impl<'a> Batch<'a> {
    pub(super) fn new(context: &'a Context, shared: &'a Shared, label: &str) -> Self {
        let encoder = context.device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some(label) });
        Self { context, shared, encoder, arguments: Vec::new() }
    }

    /// For copies and timestamps.
    pub(super) fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        &mut self.encoder
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
        pass.set_bind_group(1, &self.shared.group, &[offset as u32]);
        if kernel.scene {
            pass.set_bind_group(2, &self.shared.scene.group, &[]);
        }
        // One dimension holds 65535; the kernels put the two together again.
        let most = self.context.limits.max_compute_workgroups_per_dimension.min(65535);
        let rows = groups.div_ceil(most);
        pass.dispatch_workgroups(groups.div_ceil(rows), rows, 1);
    }

    /// Hands it all to the device.
    pub(super) fn submit(self) -> Result<(), Error> {
        if !self.arguments.is_empty() {
            self.context.queue.write_buffer(&self.shared.arguments, 0, &self.arguments);
        }
        self.context.queue.submit([self.encoder.finish()]);
        self.context.check()
    }
}
