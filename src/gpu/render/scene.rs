//! The packed scene on the device.

use std::sync::{Arc, Weak};

use bytemuck::{Pod, Zeroable};

use crate::device::Error;
use crate::gpu::buffers::Array;
use crate::gpu::context::Context;
use crate::gpu::kernels::{Access, Batch, Group, storage, uniform};
use crate::layout::{Camera, Frame, LIGHT_AREA, LIGHT_ENVIRONMENT, NONE, Primitive, SceneInfo, SceneNode, Vertex};
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

/// Buffers of a scene, and the constants of the scene, the camera and the iteration.
pub(super) struct SceneBuffers {
    frame: wgpu::Buffer,
    camera: wgpu::Buffer,
    info: wgpu::Buffer,
    tables: wgpu::Buffer,
    nodes: Uploaded<SceneNode>,
    primitives: Uploaded<Primitive>,
    vertices: Uploaded<Vertex>,
    texels: Uploaded<u32>,
    environment: Uploaded<[f32; 4]>,
    table: Array,
}

/// An array of the scene on the device.
struct Uploaded<T> {
    array: Array,
    /// What it is a copy of, only to tell whether another is this one.
    of: Weak<Vec<T>>,
}

impl<T: Pod> Uploaded<T> {
    fn new(what: &'static str) -> Self {
        Self { array: Array::new::<T>(what), of: Weak::new() }
    }

    /// Makes it one of `values`, if it is not; in no more than twice the memory that they need.
    fn set(&mut self, context: &Context, values: &Arc<Vec<T>>) -> Result<(), Error> {
        let of = Arc::downgrade(values);
        if !self.of.ptr_eq(&of) {
            self.of = Weak::new();
            if self.array.capacity() > 2 * values.len() as u64 {
                self.array.free();
            }
            self.array.write(context, values)?;
            self.of = of;
        }
        Ok(())
    }
}

impl SceneBuffers {
    /// Of nothing yet.
    pub(super) fn new(context: &Context, camera: &Camera) -> Self {
        Self {
            frame: constant(context, "frame", &Frame::zeroed()),
            camera: constant(context, "camera", camera),
            info: constant(context, "scene", &SceneInfo::zeroed()),
            tables: constant(context, "tables", &Tables::zeroed()),
            nodes: Uploaded::new("scene tree"),
            primitives: Uploaded::new("primitives"),
            vertices: Uploaded::new("vertices"),
            texels: Uploaded::new("texels"),
            environment: Uploaded::new("environment"),
            table: Array::new::<[u32; 4]>("materials and lights"),
        }
    }

    /// Takes to the device what it has not, and returns the bind groups 2 and 3 of the kernels.
    pub(super) fn set(&mut self, context: &Context, scene: &PackedScene) -> Result<[Group; 2], Error> {
        let mut table: Vec<[u32; 4]> = Vec::new();
        let mut append = |bytes: &[u8]| {
            let first = table.len() as u32;
            table.resize(table.len() + bytes.len().div_ceil(16), [0; 4]);
            bytemuck::cast_slice_mut::<_, u8>(&mut table[first as usize..])[..bytes.len()].copy_from_slice(bytes);
            first
        };
        // One that does not shine is not looked at.
        let none = (Arc::default(), Arc::default());
        let shines = scene.info.environment_light != NONE;
        let (environment, rows) =
            if shines { (&scene.environment, &scene.environment_rows) } else { (&none.0, &none.1) };
        let tables = Tables {
            n_nodes: scene.nodes.len() as u32,
            n_primitives: scene.primitives.len() as u32,
            materials: append(bytemuck::cast_slice(&scene.materials)),
            slots: append(bytemuck::cast_slice(&scene.slots)),
            lights: append(bytemuck::cast_slice(&scene.lights)),
            environment_rows: append(bytemuck::cast_slice(rows)),
            albedo: append(bytemuck::cast_slice(&scene.albedo)),
            has_extended: u32::from(scene.lights.iter().any(|l| l.kind == LIGHT_AREA || l.kind == LIGHT_ENVIRONMENT)),
        };
        self.nodes.set(context, &scene.nodes)?;
        self.primitives.set(context, &scene.primitives)?;
        self.vertices.set(context, &scene.vertices)?;
        self.texels.set(context, &scene.texels)?;
        self.environment.set(context, environment)?;
        self.table.write(context, &table)?;
        context.queue.write_buffer(&self.info, 0, bytemuck::bytes_of(&scene.info));
        context.queue.write_buffer(&self.tables, 0, bytemuck::bytes_of(&tables));

        let uniforms = [&self.frame, &self.camera, &self.info, &self.tables];
        let constants = uniforms.map(|buffer| (uniform(buffer.size(), false), buffer.as_entire_binding()));
        let arrays = [
            &self.nodes.array,
            &self.primitives.array,
            &self.vertices.array,
            &self.texels.array,
            &self.environment.array,
            &self.table,
        ];
        let arrays = arrays.map(|array| (storage(Access::Read), array.all()));
        Ok([Group::new(context, "constants", &constants), Group::new(context, "scene", &arrays)])
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
