//! One implementation of [`Peer`] a library: the operation as a user of that library would write it.

use std::num::NonZero;
use std::time::Duration;

use glam::{Vec3, Vec3A};
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rstar::RTree;
use sunfleck::index::{HashGrid, Nearest, PointBvh, PointOrder, Radii, RadiusSearch, distance2};

/// What a query finds: how many, and the sum over them of the kernel 1 − d²/r², or for k-NN of the squared distances.
#[derive(Clone, Copy, Debug, Default)]
pub struct Found {
    pub n: u32,
    pub sum: f32,
}

impl Found {
    #[inline]
    fn add(&mut self, value: f32) {
        self.n += 1;
        self.sum += value;
    }
}

/// A library, built over points.
pub trait Peer<'a>: Sized {
    /// Whether the index answers one radius only.
    const ONE_RADIUS: bool = false;

    fn build(points: &'a [Vec3], radius: f32) -> Self;

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found>;

    /// `None` where the library does not offer it.
    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>>;
}

fn epanechnikov(radius: f32) -> impl Fn(f32) -> f32 + Sync {
    let scale = 1.0 / (radius * radius);
    move |d2| 1.0 - d2 * scale
}

/// How a [`RadiusSearch`] is built.
pub trait Build {
    type Index: RadiusSearch;
    const ONE_RADIUS: bool = false;
    fn over(points: &[Vec3], radius: f32) -> Self::Index;
}

/// A [`PointBvh`] in Morton order.
pub struct Morton;
/// A [`PointBvh`] in the order of a kd-tree.
pub struct Median;
/// A [`HashGrid`].
pub struct Grid;

impl Build for Morton {
    type Index = PointBvh;
    fn over(points: &[Vec3], _: f32) -> PointBvh {
        PointBvh::new(points).expect("finite points")
    }
}

impl Build for Median {
    type Index = PointBvh;
    fn over(points: &[Vec3], _: f32) -> PointBvh {
        PointBvh::with_order(points, PointOrder::Median).expect("finite points")
    }
}

impl Build for Grid {
    type Index = HashGrid;
    const ONE_RADIUS: bool = true;
    fn over(points: &[Vec3], radius: f32) -> HashGrid {
        HashGrid::new(points, radius).expect("finite points")
    }
}

/// A [`RadiusSearch`] asked in batches.
pub struct Batch<B: Build>(B::Index);
/// A [`RadiusSearch`] asked one query at a time.
pub struct Single<B: Build>(B::Index);

impl<B: Build> Peer<'_> for Batch<B> {
    const ONE_RADIUS: bool = B::ONE_RADIUS;

    fn build(points: &[Vec3], radius: f32) -> Self {
        Self(B::over(points, radius))
    }

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found> {
        let kernel = epanechnikov(radius);
        self.0
            .fold_all(queries, Radii::One(radius), |_| Found::default(), |found, _, d2| found.add(kernel(d2)))
            .expect("valid queries")
    }

    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>> {
        if radius > self.0.max_radius() {
            return None;
        }
        let lists = self.0.nearest_all(queries, Radii::One(radius), k).expect("valid queries");
        let rows = lists.found.iter().zip(lists.distances2.chunks(k));
        Some(rows.map(|(&n, row)| Found { n, sum: row[..n as usize].iter().sum() }).collect())
    }
}

impl<B: Build> Peer<'_> for Single<B> {
    const ONE_RADIUS: bool = B::ONE_RADIUS;

    fn build(points: &[Vec3], radius: f32) -> Self {
        Self(B::over(points, radius))
    }

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found> {
        let kernel = epanechnikov(radius);
        let search = |&q: &Vec3| {
            let mut found = Found::default();
            self.0.within(q, radius, |_, d2| found.add(kernel(d2)));
            found
        };
        queries.iter().map(search).collect()
    }

    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>> {
        if radius > self.0.max_radius() {
            return None;
        }
        let mut nearest = Nearest::new(k);
        let search = |&q: &Vec3| {
            self.0.nearest(q, radius, &mut nearest);
            sum(&nearest)
        };
        Some(queries.iter().map(search).collect())
    }
}

fn sum(nearest: &Nearest) -> Found {
    let mut found = Found::default();
    nearest.found().iter().for_each(|neighbour| found.add(neighbour.distance2));
    found
}

impl Peer<'_> for ImmutableKdTree<f32, 3> {
    fn build(points: &[Vec3], _: f32) -> Self {
        Self::new_from_slice(bytemuck::cast_slice::<Vec3, [f32; 3]>(points)).expect("finite points")
    }

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found> {
        let kernel = epanechnikov(radius);
        let mut scratch = self.create_scratch::<SquaredEuclidean<f32>>();
        let search = |q: &Vec3| {
            let mut found = Found::default();
            self.query(q.as_ref())
                .within::<SquaredEuclidean<f32>>(radius * radius)
                .unsorted()
                .with_scratch(&mut scratch)
                .visit(|neighbour| found.add(kernel(neighbour.distance)));
            found
        };
        queries.iter().map(search).collect()
    }

    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>> {
        let k = NonZero::new(k)?;
        let mut scratch = self.create_scratch::<SquaredEuclidean<f32>>();
        let search = |q: &Vec3| {
            let query = self.query(q.as_ref()).nearest_n::<SquaredEuclidean<f32>>(k);
            let list = if radius == f32::INFINITY {
                query.with_scratch(&mut scratch).execute()
            } else {
                query.within(radius * radius).with_scratch(&mut scratch).execute()
            };
            Found { n: list.len() as u32, sum: list.iter().map(|neighbour| neighbour.distance).sum() }
        };
        Some(queries.iter().map(search).collect())
    }
}

impl Peer<'_> for RTree<[f32; 3]> {
    fn build(points: &[Vec3], _: f32) -> Self {
        Self::bulk_load(bytemuck::cast_slice(points).to_vec())
    }

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found> {
        let kernel = epanechnikov(radius);
        let search = |&q: &Vec3| {
            let mut found = Found::default();
            for p in self.locate_within_distance(q.to_array(), radius * radius) {
                found.add(kernel(distance2(q, Vec3::from_array(*p))));
            }
            found
        };
        queries.iter().map(search).collect()
    }

    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>> {
        let search = |q: &Vec3| {
            let mut found = Found::default();
            for (_, d2) in self.nearest_neighbor_iter_with_distance_2(q.to_array()).take(k) {
                if d2 > radius * radius {
                    break;
                }
                found.add(d2);
            }
            found
        };
        Some(queries.iter().map(search).collect())
    }
}

/// Boxes grown by the radius, a query a point in them; `MEDIUM` for the slower build of a better tree.
pub struct Obvhs<const MEDIUM: bool> {
    bvh: Bvh2,
    /// In the order of the leaves.
    points: Vec<Vec3>,
}

impl<const MEDIUM: bool> Obvhs<MEDIUM> {
    #[inline]
    fn visit(&self, q: Vec3, radius: f32, mut visit: impl FnMut(usize, f32)) {
        self.bvh.point_traverse(q.into(), |bvh, node| {
            let node = &bvh.nodes[node as usize];
            let first = node.first_index as usize;
            for (i, &p) in self.points[first..first + node.prim_count as usize].iter().enumerate() {
                let d2 = distance2(p, q);
                if d2 <= radius * radius {
                    visit(first + i, d2);
                }
            }
            true
        });
    }
}

impl<const MEDIUM: bool> Peer<'_> for Obvhs<MEDIUM> {
    const ONE_RADIUS: bool = true;

    fn build(points: &[Vec3], radius: f32) -> Self {
        let grown = |p: &Vec3| {
            let p = Vec3A::from(*p);
            Aabb::new(p - radius, p + radius)
        };
        let boxes: Vec<Aabb> = points.iter().map(grown).collect();
        let params = if MEDIUM { BvhBuildParams::medium_build() } else { BvhBuildParams::fastest_build() };
        let bvh = build_bvh2(&boxes, params, &mut Duration::default());
        let points = bvh.primitive_indices.iter().map(|&i| points[i as usize]).collect();
        Self { bvh, points }
    }

    fn kernel(&self, queries: &[Vec3], radius: f32) -> Vec<Found> {
        let kernel = epanechnikov(radius);
        let search = |&q: &Vec3| {
            let mut found = Found::default();
            self.visit(q, radius, |_, d2| found.add(kernel(d2)));
            found
        };
        queries.iter().map(search).collect()
    }

    fn nearest(&self, queries: &[Vec3], radius: f32, k: usize) -> Option<Vec<Found>> {
        if radius == f32::INFINITY {
            return None;
        }
        let mut nearest = Nearest::new(k);
        let search = |&q: &Vec3| {
            nearest.clear();
            self.visit(q, radius, |i, d2| nearest.insert(i as u32, d2));
            sum(&nearest)
        };
        Some(queries.iter().map(search).collect())
    }
}
