//! The packed scene on the device.

use bytemuck::{Pod, Zeroable};

use super::buffers::Array;
use super::context::Context;
use crate::layout::{Camera, LIGHT_AREA, LIGHT_ENVIRONMENT, Primitive, SceneInfo, SceneNode, Vertex};
use crate::ppm::Error;
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

/// Buffers of a scene; they do not change.
pub(super) struct SceneBuffers {
    pub(super) layout: wgpu::BindGroupLayout,
    pub(super) group: wgpu::BindGroup,
    pub(super) camera: wgpu::Buffer,
    pub(super) info: wgpu::Buffer,
    pub(super) tables: wgpu::Buffer,
    /// Kept for the memory they account for.
    _arrays: [Array; 6],
}

impl SceneBuffers {
    pub(super) fn new(context: &Context, scene: &PackedScene, camera: &Camera) -> Result<Self, Error> {
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

        let entries: Vec<_> = (0..arrays.len() as u32)
            .map(|binding| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Storage { read_only: true },
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            })
            .collect();
        let descriptor = wgpu::BindGroupLayoutDescriptor { label: Some("scene"), entries: &entries };
        let layout = context.device.create_bind_group_layout(&descriptor);
        let entries: Vec<_> = arrays
            .iter()
            .enumerate()
            .map(|(binding, array)| wgpu::BindGroupEntry { binding: binding as u32, resource: array.all() })
            .collect();
        let group = context.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene"),
            layout: &layout,
            entries: &entries,
        });
        Ok(Self {
            layout,
            group,
            camera: uniform(context, "camera", camera),
            info: uniform::<SceneInfo>(context, "scene", &scene.info),
            tables: uniform(context, "tables", &tables),
            _arrays: arrays,
        })
    }
}

fn uniform<T: Pod>(context: &Context, label: &str, value: &T) -> wgpu::Buffer {
    let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<T>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    context.queue.write_buffer(&buffer, 0, bytemuck::bytes_of(value));
    buffer
}
