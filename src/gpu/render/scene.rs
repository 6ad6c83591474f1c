//! The packed scene on the device.

use bytemuck::{Pod, Zeroable};

use crate::device::Error;
use crate::gpu::buffers::Array;
use crate::gpu::context::Context;
use crate::gpu::kernels::{Access, Batch, Group, storage, uniform};
use crate::layout::{Camera, Frame, LIGHT_AREA, LIGHT_ENVIRONMENT, Primitive, SceneInfo, SceneNode, Vertex};
use crate::scene::PackedScene;

/// Where things lie in the table of small things; twin of `Tables` in `shaders/lib/scene.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub(super) struct Tables {
    n_nodes: u32,
    n_primitives: u32,
    materials: u32,
    slots: u32,
    lights: u32,
    environment_rows: u32,
    albedo: u32,
    has_extended: u32,
}

/// Buffers of a scene, which do not change, and the constants of the camera and the iteration, which do.
pub(super) struct SceneBuffers {
    frame: wgpu::Buffer,
    camera: wgpu::Buffer,
    /// Kept for the memory they account for.
    _arrays: [Array; 6],
}

impl SceneBuffers {
    /// The buffers, and the bind groups 2 and 3 of the kernels.
    pub(super) fn new(context: &Context, scene: &PackedScene, camera: &Camera) -> Result<(Self, Vec<Group>), Error> {
        let mut table: Vec<[u32; 4]> = Vec::new();
        let mut append = |bytes: &[u8]| {
            let first = table.len() as u32;
            table.resize(table.len() + bytes.len().div_ceil(16), [0; 4]);
            bytemuck::cast_slice_mut::<_, u8>(&mut table[first as usize..])[..bytes.len()].copy_from_slice(bytes);
            first
        };
        let tables = Tables {
            n_nodes: scene.nodes.len() as u32,
            n_primitives: scene.primitives.len() as u32,
            materials: append(bytemuck::cast_slice(&scene.materials)),
            slots: append(bytemuck::cast_slice(&scene.slots)),
            lights: append(bytemuck::cast_slice(&scene.lights)),
            environment_rows: append(bytemuck::cast_slice(&scene.environment_rows)),
            albedo: append(bytemuck::cast_slice(&scene.albedo)),
            has_extended: u32::from(scene.lights.iter().any(|l| l.kind == LIGHT_AREA || l.kind == LIGHT_ENVIRONMENT)),
        };
        let mut arrays = [
            Array::new::<SceneNode>("scene tree"),
            Array::new::<Primitive>("primitives"),
            Array::new::<Vertex>("vertices"),
            Array::new::<u32>("texels"),
            Array::new::<[f32; 4]>("environment"),
            Array::new::<[u32; 4]>("materials and lights"),
        ];
        arrays[0].write(context, &scene.nodes)?;
        arrays[1].write(context, &scene.primitives)?;
        arrays[2].write(context, &scene.vertices)?;
        arrays[3].write(context, &scene.texels)?;
        arrays[4].write(context, &scene.environment)?;
        arrays[5].write(context, &table)?;

        let uniforms = [
            constant(context, "frame", &Frame::zeroed()),
            constant(context, "camera", camera),
            constant::<SceneInfo>(context, "scene", &scene.info),
            constant(context, "tables", &tables),
        ];
        let bindings = uniforms.each_ref().map(|buffer| (uniform(buffer.size(), false), buffer.as_entire_binding()));
        let constants = Group::new(context, "constants", &bindings);
        let bindings = arrays.each_ref().map(|array| (storage(Access::Read), array.all()));
        let groups = vec![constants, Group::new(context, "scene", &bindings)];
        let [frame, camera, ..] = uniforms;
        Ok((Self { frame, camera, _arrays: arrays }, groups))
    }

    /// Constants of this batch and those submitted after it.
    pub(super) fn set_frame(&self, batch: &Batch<'_>, frame: &Frame) {
        batch.write(&self.frame, bytemuck::bytes_of(frame));
    }

    /// Of the dispatches submitted from now on.
    pub(super) fn set_camera(&self, context: &Context, camera: &Camera) -> Result<(), Error> {
        context.guarded(|| {
            context.queue.write_buffer(&self.camera, 0, bytemuck::bytes_of(camera));
            Ok(())
        })
    }
}

fn constant<T: Pod>(context: &Context, label: &str, value: &T) -> wgpu::Buffer {
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    context.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(value));
    buffer
}
