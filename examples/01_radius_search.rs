//! All points within a radius of each query. Needs no features: `cargo run --no-default-features --example 01_radius_search`.

use glam::Vec3;
use sunfleck::index::{PointBvh, Radii, RadiusSearch};

fn main() -> Result<(), sunfleck::index::Error> {
    let points: Vec<Vec3> =
        (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32)).collect();
    let queries = [Vec3::new(4.5, 4.5, 4.5), Vec3::ZERO, Vec3::splat(-3.0)];
    let index = PointBvh::new(&points)?;

    // One query, in place: nothing is stored.
    index.within(queries[1], 1.0, |point, distance2| println!("point {point} at √{distance2}"));

    // All queries, on all threads, stored.
    let found = index.neighbours_all(&queries, Radii::One(1.0))?;
    for (query, centre) in queries.iter().enumerate() {
        println!("{centre}: {} neighbours", found.row(query).len());
    }
    Ok(())
}
