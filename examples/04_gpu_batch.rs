//! Many queries at once on a GPU: counted, in rows, and the nearest; the results stay on the device until asked for.
//! `cargo run --no-default-features --features gpu --example 04_gpu_batch`

use std::sync::Arc;

use glam::Vec3;
use sunfleck::device::Error;
use sunfleck::gpu::{Choice, Context, PointSearch, Queries};
use sunfleck::index::Radii;

fn main() -> Result<(), Error> {
    let context = match Context::new(&Choice::Any) {
        Ok(context) => context,
        Err(error) => {
            println!("nothing to run on: {error}");
            return Ok(());
        }
    };
    println!("{}", context.info());
    let points: Vec<Vec3> =
        (0..1000).map(|i| Vec3::new((i % 10) as f32, (i / 10 % 10) as f32, (i / 100) as f32)).collect();
    let queries = [Vec3::new(4.5, 4.5, 4.5), Vec3::ZERO, Vec3::splat(-3.0)];
    let mut search = PointSearch::new(Arc::new(context))?;
    search.build(&points)?;

    println!("numbers of neighbours: {:?}", search.count_all(&queries, Radii::One(1.0))?);

    // As many radii as queries; the rows may be bound to another kernel, or downloaded.
    let rows = search.neighbours_on_device(Queries::Host(&queries), Radii::Each(&[1.0, 1.5, 6.0]).into())?;
    println!("{} neighbours lie in a buffer of {} bytes", rows.indices.len(), rows.indices.buffer().size());
    for neighbour in rows.download()?.row(1) {
        println!("point {} at √{} from query 1", neighbour.index, neighbour.distance2);
    }

    let nearest = search.nearest_all(&queries, Radii::One(f32::INFINITY), 2)?;
    println!("the two nearest of each: {:?} at √{:?}", nearest.indices, nearest.distances2);
    Ok(())
}
