//! A function of one's own for each neighbour, in WGSL: here a density with a Gaussian weight, with nothing stored between.
//! `cargo run --no-default-features --features gpu --example 05_custom_visitor`

use std::sync::Arc;

use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::gpu::{Access, Choice, Context, PointSearch, Queries, wgpu};
use sunfleck::index::Radii;

/// A bandwidth of a third of the radius.
const DENSITY: &str = "
@group(0) @binding(4) var<storage, read> masses: array<f32>;
@group(0) @binding(5) var<storage, read_write> densities: array<f32>;

struct Visitor {
    radius2: f32,
    bandwidth2: f32,
    sum: f32,
}

fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    return Visitor(radius2, radius2 / 9.0, 0.0);
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    (*visitor).sum += masses[index_of(slot)] * exp(-0.5 * distance2 / (*visitor).bandwidth2);
}

fn end(visitor: ptr<function, Visitor>, query: u32) {
    densities[query] = (*visitor).sum * pow(6.2831853 * (*visitor).bandwidth2, -1.5);
}
";

fn main() -> Result<(), Error> {
    let context = match Context::new(&Choice::Any) {
        Ok(context) => Arc::new(context),
        Err(error) => {
            println!("nothing to run on: {error}");
            return Ok(());
        }
    };
    // One unit of mass in each unit of volume: the density is 1 inside, less at the faces and corners.
    let points: Vec<Vec3> =
        (0..8000).map(|i| Vec3::new((i % 20) as f32, (i / 20 % 20) as f32, (i / 400) as f32)).collect();
    let queries = [Vec3::splat(9.5), Vec3::new(0.0, 9.5, 9.5), Vec3::ZERO];
    let buffer = |n: usize, usage: wgpu::BufferUsages| {
        let size = 4 * n as u64;
        let usage = usage | wgpu::BufferUsages::COPY_DST;
        context.device().create_buffer(&wgpu::BufferDescriptor { label: None, size, usage, mapped_at_creation: false })
    };
    let masses = buffer(points.len(), wgpu::BufferUsages::STORAGE);
    context.queue().write_buffer(&masses, 0, &1f32.to_le_bytes().repeat(points.len()));
    let densities = buffer(queries.len(), wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);

    let mut search = PointSearch::new(context.clone())?;
    search.build(&points)?;
    let visitor = search.compile(DENSITY, &[Access::Read, Access::Write])?;
    search.visit_all(&visitor, Queries::Host(&queries), Radii::One(6.0).into(), &[&masses, &densities])?;

    for (query, density) in queries.iter().zip(context.download::<f32>(&densities, 0, queries.len())?) {
        println!("density at {query}: {density}");
    }
    // A mistake is an error that names the line.
    if let Err(error) = search.compile(&DENSITY.replace("bandwidth2;", "bandwidth;"), &[Access::Read, Access::Write]) {
        println!("{error}");
    }
    Ok(())
}
