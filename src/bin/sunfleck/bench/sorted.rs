//! Any index, its queries sorted first: what the order of the queries is worth.

use std::ops::ControlFlow;

use glam::Vec3;
use rayon::prelude::*;
use sunfleck::index::{Error, Nearest, Radii, RadiusSearch};
use sunfleck::math::morton::Grid;

/// Sorts a batch in Morton order, asks the index in that order, and puts the results back.
pub struct Sorted<I>(pub I);

impl<I: RadiusSearch> RadiusSearch for Sorted<I> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn max_radius(&self) -> f32 {
        self.0.max_radius()
    }

    fn try_within<B>(
        &self,
        centre: Vec3,
        radius: f32,
        visit: impl FnMut(u32, f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        self.0.try_within(centre, radius, visit)
    }

    fn nearest(&self, centre: Vec3, radius: f32, nearest: &mut Nearest) {
        self.0.nearest(centre, radius, nearest);
    }

    fn fold_all<T: Send>(
        &self,
        queries: &[Vec3],
        radii: Radii<'_>,
        start: impl Fn(usize) -> T + Sync,
        visit: impl Fn(&mut T, u32, f32) + Sync,
    ) -> Result<Vec<T>, Error> {
        radii.check(queries, self.max_radius())?;
        let order = morton_order(queries);
        let sorted: Vec<Vec3> = order.par_iter().map(|&q| queries[q as usize]).collect();
        let each: Option<Vec<f32>> = match radii {
            Radii::One(_) => None,
            Radii::Each(radii) => Some(order.par_iter().map(|&q| radii[q as usize]).collect()),
        };
        let radii = each.as_deref().map_or(radii, Radii::Each);
        let folded = self.0.fold_all(&sorted, radii, |i| start(order[i] as usize), visit)?;
        let mut places: Vec<Option<T>> = (0..queries.len()).map(|_| None).collect();
        for (&q, result) in order.iter().zip(folded) {
            places[q as usize] = Some(result);
        }
        Ok(places.into_iter().flatten().collect())
    }
}

fn morton_order(points: &[Vec3]) -> Vec<u32> {
    let (min, max) = points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), &p| (a.min(p), b.max(p)));
    let grid = Grid::new(min, max);
    let mut keys: Vec<(u64, u32)> =
        points.par_iter().zip(0..points.len() as u32).map(|(&p, i)| (grid.key(p), i)).collect();
    keys.par_sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sunfleck::index::BruteForce;
    use sunfleck::math::clouds;

    #[test]
    fn results_come_in_the_order_of_the_queries() {
        let (points, queries) = (clouds::uniform(300, 1), clouds::uniform(200, 2));
        let radii: Vec<f32> = (0..200).map(|i| 0.002 * i as f32).collect();
        for radii in [Radii::One(0.2), Radii::Each(&radii)] {
            let plain = BruteForce(&points).count_all(&queries, radii).unwrap();
            assert_eq!(Sorted(BruteForce(&points)).count_all(&queries, radii).unwrap(), plain);
            assert!(plain.iter().any(|&n| n > 0));
        }
    }
}
