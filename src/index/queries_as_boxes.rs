//! The alternative that the paper describes and rejects (its Section 3.2): the queries are the boxes, and the samples
//! look for the queries they belong to.

use std::sync::atomic::{AtomicU32, Ordering};

use glam::Vec3;
use rayon::prelude::*;

use super::batch::GRAIN;
use super::blocks::{around, reach};
use super::sample_boxes::{Boxes, Builder, SampleBvh, SampleOptions};
use super::{Error, Neighbours, Radii, check_points, distance2, radius2};

/// All neighbours of all queries. A tree is built over the queries' balls, and every point appends itself atomically to
/// the list of each query whose ball it lies in; once to count, once to store. The order within a row depends on
/// timing.
pub fn queries_as_boxes(
    points: &[Vec3],
    queries: &[Vec3],
    radii: Radii<'_>,
    builder: Builder,
    leaf_size: usize,
) -> Result<Neighbours, Error> {
    check_points(points)?;
    radii.check(queries, f32::INFINITY)?;
    if queries.len() >= u32::MAX as usize {
        return Err(Error::TooMany(queries.len()));
    }
    let options = SampleOptions { builder, boxes: Boxes::Inflated(f32::INFINITY), leaf_size };
    let tree = SampleBvh::over(queries, options, |q| around(queries[q], reach(radius2(radii.of(q)))));
    let for_each = |append: &(dyn Fn(u32, u32, f32) + Sync)| {
        points.par_iter().with_min_len(GRAIN).enumerate().for_each(|(i, &point)| {
            tree.holding(point, |q| {
                let (d2, radius) = (distance2(point, queries[q as usize]), radii.of(q as usize));
                if d2 <= radius2(radius) {
                    append(q, i as u32, d2);
                }
            });
        });
    };

    let counts: Vec<AtomicU32> = queries.iter().map(|_| AtomicU32::new(0)).collect();
    for_each(&|q, _, _| {
        counts[q as usize].fetch_add(1, Ordering::Relaxed);
    });
    let mut offsets = Vec::with_capacity(queries.len() + 1);
    offsets.push(0);
    let mut total = 0;
    offsets.extend(counts.iter().map(|n| {
        total += n.swap(0, Ordering::Relaxed) as usize;
        total
    }));
    let zeros = || (0..total).map(|_| AtomicU32::new(0)).collect();
    let (indices, distances2): (Vec<AtomicU32>, Vec<AtomicU32>) = (zeros(), zeros());
    for_each(&|q, i, d2| {
        let at = offsets[q as usize] + counts[q as usize].fetch_add(1, Ordering::Relaxed) as usize;
        indices[at].store(i, Ordering::Relaxed);
        distances2[at].store(d2.to_bits(), Ordering::Relaxed);
    });
    Ok(Neighbours {
        offsets,
        indices: indices.into_iter().map(AtomicU32::into_inner).collect(),
        distances2: distances2.into_iter().map(|d2| f32::from_bits(d2.into_inner())).collect(),
    })
}
