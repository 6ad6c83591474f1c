//! The k nearest points of each query, and what they tell of a surface: the spacing of a cloud on a sphere.
//! `cargo run --no-default-features --example 02_nearest_neighbours`

use glam::Vec3;
use sunfleck::index::{PointBvh, Radii, RadiusSearch};

/// Points spread evenly over the unit sphere, along a spiral of the golden angle.
fn sphere(n: usize) -> Vec<Vec3> {
    let golden = std::f32::consts::PI * (3.0 - 5f32.sqrt());
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f32 / n as f32;
        let (sin, cos) = (golden * i as f32).sin_cos();
        Vec3::new(cos, sin, 0.0) * (1.0 - z * z).sqrt() + Vec3::Z * z
    };
    (0..n).map(point).collect()
}

fn main() -> Result<(), sunfleck::index::Error> {
    let points = sphere(20_000);
    let index = PointBvh::new(&points)?;

    // The nearest of each point is the point itself; nothing beyond 0.1 is looked at.
    let k = 9;
    let nearest = index.nearest_all(&points, Radii::One(0.1), k)?;
    let spacing = nearest.distances2.chunks(k).map(|row| f64::from(row[1].sqrt())).sum::<f64>() / points.len() as f64;
    println!("{} points, on average {spacing:.5} apart", points.len());

    let row = &nearest.indices[..nearest.found[0] as usize];
    println!("nearest of point 0: {row:?}");
    Ok(())
}
