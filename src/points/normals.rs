//! Normals by principal component analysis of each point's nearest points (Hoppe et al. 1992, section 3.2).

use glam::{DVec3, Vec3};
use nalgebra::{Matrix3, SymmetricEigen};
use rayon::prelude::*;

use super::{Error, Indexed};
use crate::index::MAX_K;

/// Points whose neighbours are held at once.
const BATCH: usize = 1 << 16;
/// Points of a neighbourhood, at least: a plane takes three.
const MIN_K: usize = 3;
/// Width over length of a neighbourhood, below which more points are taken: along one scan line the plane that fits best
/// is the one that the line bends in, square to the surface.
const NARROW: f64 = 0.05;
/// The same, below which points are a line and have no plane.
const LINE: f64 = 1e-4;
const EIGEN_ITERATIONS: usize = 64;

/// What [`estimate`] found.
#[derive(Clone, Debug, PartialEq)]
pub struct Normals {
    /// Of unit length, of either sign; zero where there is none.
    pub normals: Vec<Vec3>,
    /// How many points have none: their 64 nearest lie on a line or in one place.
    pub undefined: usize,
}

/// The normal of each point, from its `k` nearest points, itself included; k from 3 to 64.
///
/// Where they lie next to a line, as the neighbours along one scan line do, 64 are taken.
pub fn estimate(cloud: &Indexed, k: usize) -> Result<Normals, Error> {
    let k = needs(cloud, k)?;
    let mut normals = Vec::with_capacity(cloud.positions().len());
    for queries in cloud.positions().chunks(BATCH) {
        normals.extend(of_batch(cloud, queries, k, NARROW)?);
    }
    let missing: Vec<usize> = (0..normals.len()).filter(|&i| normals[i] == Vec3::ZERO).collect();
    for batch in missing.chunks(BATCH) {
        let queries: Vec<DVec3> = batch.iter().map(|&i| cloud.positions()[i]).collect();
        for (&i, normal) in batch.iter().zip(of_batch(cloud, &queries, MAX_K, LINE)?) {
            normals[i] = normal;
        }
    }
    let undefined = missing.iter().filter(|&&i| normals[i] == Vec3::ZERO).count();
    Ok(Normals { normals, undefined })
}

/// `k`, if it and the cloud suffice for a plane.
fn needs(cloud: &Indexed, k: usize) -> Result<usize, Error> {
    let points = cloud.positions().len();
    if points < MIN_K {
        return Err(Error::TooFew { points, task: "a normal", needed: MIN_K });
    }
    if !(MIN_K..=MAX_K).contains(&k) {
        return Err(Error::Neighbours(k));
    }
    Ok(k)
}

fn of_batch(cloud: &Indexed, queries: &[DVec3], k: usize, width: f64) -> Result<Vec<Vec3>, Error> {
    let lists = cloud.nearest(queries, f64::INFINITY, k)?;
    let normal = |row: &[u32]| {
        let near = row.iter().filter_map(|&i| cloud.positions().get(i as usize)).copied();
        plane_normal(near, width).unwrap_or(Vec3::ZERO)
    };
    Ok(lists.indices.par_chunks(k).with_min_len(256).map(normal).collect())
}

/// Of the plane that fits best; None if the points are not so wide in it, as a share of their length.
fn plane_normal(points: impl Iterator<Item = DVec3> + Clone, width: f64) -> Option<Vec3> {
    let (n, sum) = points.clone().fold((0, DVec3::ZERO), |(n, sum), p| (n + 1, sum + p));
    let mean = sum / f64::from(n);
    let size = points.clone().map(|p| (p - mean).abs().max_element()).fold(0.0, f64::max);
    if size.is_nan() || size <= 0.0 {
        return None;
    }
    let mut m = [0.0; 6];
    for p in points {
        // To size 1: squares of a tiny cloud would vanish.
        let d = (p - mean) / size;
        for (sum, product) in m.iter_mut().zip([d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z]) {
            *sum += product;
        }
    }
    let matrix = Matrix3::new(m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5]);
    let eigen = SymmetricEigen::try_new(matrix, f64::EPSILON, EIGEN_ITERATIONS)?;
    let mut order = [0, 1, 2];
    order.sort_unstable_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    if eigen.eigenvalues[order[1]] <= width * width * eigen.eigenvalues[order[2]] {
        return None;
    }
    let axis = eigen.eigenvectors.column(order[0]);
    DVec3::new(axis[0], axis[1], axis[2]).try_normalize().map(|n| n.as_vec3())
}
