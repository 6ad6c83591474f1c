//! k-NN on a point cloud: the mean distance to the eight nearest points, and normals from them.
//!
//! `cargo run --release --example 03_normals_of_a_ply [cloud.ply]`; without a file, on a cloud made by code.

use sunfleck::points::generate::{Shape, scan};
use sunfleck::points::{Error, Indexed, estimate, io, orient};

const K: usize = 8;

fn main() -> Result<(), Error> {
    let cloud = match std::env::args_os().nth(1) {
        Some(path) => io::read(path.as_ref())?,
        None => scan(Shape::Bumpy, 100_000, 5e-4, 0),
    };
    let indexed = Indexed::new(&cloud.positions)?;

    // The plain search: indices and distances, [points · (K + 1)]; each point finds itself first.
    let lists = indexed.nearest(&cloud.positions, f64::INFINITY, K + 1)?;
    let mut sum = 0.0;
    for (p, row) in cloud.positions.iter().zip(lists.indices.chunks(K + 1)) {
        let near = row.iter().filter_map(|&i| cloud.positions.get(i as usize));
        sum += near.map(|q| q.distance(*p)).sum::<f64>() / K as f64;
    }
    println!("{} points, mean distance to the {K} nearest {:.6}", cloud.len(), sum / cloud.len().max(1) as f64);

    let mut found = estimate(&indexed, K)?;
    let pieces = orient(&indexed, &mut found.normals)?;
    println!("{} normals, {} without, {pieces} pieces", found.normals.len() - found.undefined, found.undefined);
    for (p, n) in cloud.positions.iter().zip(&found.normals).take(3) {
        println!("{p:.4} has {n:.4}");
    }
    Ok(())
}
