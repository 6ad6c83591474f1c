//! Finds neighbours, without renderer and without wgpu.

use glam::Vec3;
use sunfleck::index::{HashGrid, PointKd, PointBvh, Radii, RadiusSearch};

fn main() -> Result<(), sunfleck::index::Error> {
    let points: Vec<Vec3> = (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32)).collect();
    let centre = Vec3::splat(4.0);
    let counts = [
        PointBvh::new(&points)?.count(centre, 1.0),
        PointKd::new(&points)?.count(centre, 1.0),
        HashGrid::new(&points, 1.0)?.count(centre, 1.0),
    ];
    let nearest = PointBvh::new(&points)?.nearest_all(&[centre], Radii::One(0.5), 1)?;
    // The point and its six neighbours on the lattice.
    println!("{counts:?}, nearest {}", nearest.indices[0]);
    assert_eq!((counts, nearest.indices[0]), ([7; 3], 444));
    Ok(())
}
