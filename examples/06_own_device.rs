//! The search on a device that the program has opened itself, over points that lie there already.
//! `cargo run --no-default-features --features gpu --example 06_own_device`

use std::sync::Arc;

use sunfleck::gpu::{Context, PointSearch, Queries, required_limits, wgpu};
use sunfleck::index::Radii;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let Ok(adapter) = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default())) else {
        println!("nothing to run on: no GPU adapter");
        return Ok(());
    };
    let descriptor = wgpu::DeviceDescriptor { required_limits: required_limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;

    // Particles of the program: position and, of no interest here, speed.
    let particles: Vec<[f32; 4]> =
        (0..1000).map(|i| [(i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32, 7.0]).collect();
    let bytes: Vec<u8> = particles.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("particles"),
        size: bytes.len() as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&buffer, 0, &bytes);

    let mut search = PointSearch::new(Arc::new(Context::from_device(device, queue)?))?;
    search.build_from(&buffer, 1000, 4)?;
    // Each particle asks for its own neighbours; nothing has come to the host so far.
    let particles = Queries::Device { buffer: &buffer, n: 1000, words_per_record: 4 };
    let counts = search.count_on_device(particles, Radii::One(1.0).into())?.download()?;
    println!(
        "{}: {} to {} neighbours",
        search.context().info(),
        counts.iter().min().unwrap_or(&0),
        counts.iter().max().unwrap_or(&0)
    );
    Ok(())
}
