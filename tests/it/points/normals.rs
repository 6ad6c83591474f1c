//! Normals and their orientation.

use glam::{DVec3, Vec3};
use sunfleck::points::generate::{SHAPES, Shape, scan};
use sunfleck::points::{Error, Indexed, estimate, orient};

use super::{STRAY, degenerate, random, sphere, uniform};

/// Estimated and oriented, with the number of pieces.
fn normals(cloud: &[DVec3], k: usize) -> (Vec<Vec3>, usize) {
    let indexed = Indexed::new(cloud).unwrap();
    let mut found = estimate(&indexed, k).unwrap();
    assert_eq!(found.undefined, found.normals.iter().filter(|n| **n == Vec3::ZERO).count());
    let pieces = orient(&indexed, &mut found.normals).unwrap();
    (found.normals, pieces)
}

/// Degrees, against the true outward normals: the mean, the largest, and how many are more than 90.
fn errors(found: &[Vec3], truth: impl Iterator<Item = DVec3>) -> (f64, f64, usize) {
    let angles: Vec<f64> = found.iter().zip(truth).map(|(n, t)| n.as_dvec3().angle_between(t).to_degrees()).collect();
    let mean = angles.iter().sum::<f64>() / angles.len() as f64;
    let wrong = angles.iter().filter(|a| a.is_nan() || **a >= 90.0).count();
    (mean, angles.into_iter().fold(0.0, f64::max), wrong)
}

#[test]
fn a_sphere_has_its_radii() {
    let cloud = sphere(5000);
    for k in [4, 8, 16, 64] {
        let (found, pieces) = normals(&cloud, k);
        let (mean, largest, wrong) = errors(&found, cloud.iter().copied());
        assert_eq!((pieces, wrong), (1, 0), "k {k}");
        assert!(mean < 1.0 && largest < 3.0, "k {k}: mean {mean}, largest {largest}");
        assert!(found.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
    }
}

#[test]
fn a_normal_is_of_the_k_nearest_points() {
    let cloud = uniform(60, 12);
    let found = estimate(&Indexed::new(&cloud).unwrap(), 3).unwrap().normals;
    for (n, p) in found.iter().zip(&cloud) {
        let mut near = cloud.clone();
        near.sort_by(|a, b| a.distance(*p).total_cmp(&b.distance(*p)));
        let plane = (near[1] - *p).cross(near[2] - *p).normalize();
        assert!(n.as_dvec3().dot(plane).abs() > 1.0 - 1e-6, "{n} {plane}");
    }
}

#[test]
fn scans_are_oriented_outward() {
    for (name, shape) in SHAPES {
        for k in [4, 8, 12] {
            // Noise tilts the plane of four points by any angle.
            let noise = if k == 4 { 0.0 } else { 2e-4 };
            let cloud = scan(shape, 12_000, noise, 1).positions;
            let (found, pieces) = normals(&cloud, k);
            let (mean, _, wrong) = errors(&found, cloud.iter().map(|p| shape.normal(*p)));
            let limit = 4.0;
            assert!(
                pieces == 1 && mean < limit && wrong == 0,
                "{name}, k {k}: {pieces} pieces, mean {mean}, {wrong} wrong"
            );
        }
    }
}

#[test]
fn each_piece_is_oriented_by_itself() {
    // Three balls apart; one is small and sparse.
    let balls = [(DVec3::ZERO, 1.0, 3000), (DVec3::X * 5.0, 0.5, 2000), (DVec3::Y * 9.0, 2.0, 300)];
    let (mut cloud, mut truth) = (vec![], vec![]);
    for (centre, radius, n) in balls {
        cloud.extend(sphere(n).iter().map(|p| centre + *p * radius));
        truth.extend(sphere(n));
    }
    let (found, pieces) = normals(&cloud, 8);
    assert_eq!((pieces, errors(&found, truth.into_iter()).2), (3, 0));
}

#[test]
fn a_narrow_gap_does_not_part_a_surface() {
    // Wider than a point's 13 nearest reach, and less than four spacings.
    let cloud: Vec<DVec3> = sphere(5000).into_iter().filter(|p| p.z.abs() > 0.085).collect();
    let (found, pieces) = normals(&cloud, 8);
    assert_eq!((pieces, errors(&found, cloud.iter().copied()).2), (1, 0));
}

#[test]
fn two_sides_of_a_thin_shell_stay_apart() {
    // Shells 0.06 apart, samples some 0.05: the other side is among the nearest of many points.
    let (outer, inner) = (sphere(5000), sphere(4700));
    let cloud: Vec<DVec3> = outer.iter().copied().chain(inner.iter().map(|p| *p * 0.94)).collect();
    let (found, _) = normals(&cloud, 6);
    let agree = |range: std::ops::Range<usize>| {
        let side = |i: &usize| found[*i].as_dvec3().dot(cloud[*i]) > 0.0;
        range.clone().filter(side).count() as f64 / range.len() as f64
    };
    assert_eq!(agree(0..5000), 1.0, "the outer shell points outward");
    let inside = agree(5000..cloud.len());
    assert!(inside == 0.0 || inside == 1.0, "the inner shell agrees with itself: {inside}");
}

#[test]
fn two_sides_of_a_plate_stay_apart() {
    // A round plate 0.08 thick with a round rim. On its sides the samples are 0.05 apart, so that each has some of the
    // other side among its nearest 13, and its normal is parallel to theirs.
    let (mut cloud, mut truth) = (vec![], vec![]);
    for i in -24_i32..=24 {
        for j in -24_i32..=24 {
            let (x, y) = (0.05 * (f64::from(i) + 0.5 * f64::from(j)), 0.05 * 0.75_f64.sqrt() * f64::from(j));
            for side in [1.0, -1.0] {
                if x.hypot(y) < 0.48 {
                    cloud.push(DVec3::new(x, y, 0.04 * side));
                    truth.push(DVec3::Z * side);
                }
            }
        }
    }
    for i in 0..160 {
        let (sin, cos) = (f64::from(i) / 160.0 * std::f64::consts::TAU).sin_cos();
        for step in -3..=3 {
            let (up, out) = (f64::from(step) / 6.0 * std::f64::consts::PI).sin_cos();
            let normal = DVec3::new(out * cos, out * sin, up);
            cloud.push(DVec3::new(0.5 * cos, 0.5 * sin, 0.0) + normal * 0.04);
            truth.push(normal);
        }
    }
    let (found, pieces) = normals(&cloud, 6);
    assert_eq!((pieces, errors(&found, truth.into_iter()).2), (1, 0));
}

#[test]
fn a_stray_point_costs_the_others_nothing() {
    let cloud = sphere(5000);
    for far in STRAY {
        let with: Vec<DVec3> = cloud.iter().copied().chain([DVec3::X * far]).collect();
        let found = estimate(&Indexed::new(&with).unwrap(), 8).unwrap().normals;
        let angle = |(n, p): (&Vec3, &DVec3)| n.as_dvec3().dot(*p).abs().min(1.0).acos().to_degrees();
        let largest = found.iter().zip(&cloud).map(angle).fold(0.0, f64::max);
        assert!(largest < 3.0, "{far}: {largest}");
    }
}

#[test]
fn an_open_surface_agrees_with_itself() {
    let cloud: Vec<DVec3> = (0..4000)
        .map(|i| {
            let [x, y, ..] = random(i, 11);
            DVec3::new(x, y, 0.1 * (6.0 * x).sin() * (5.0 * y).cos())
        })
        .collect();
    let (found, _) = normals(&cloud, 8);
    let up = found.iter().filter(|n| n.z > 0.0).count();
    assert!(up == 0 || up == cloud.len(), "{up} of {} point up", cloud.len());
}

#[test]
fn the_unit_does_not_matter() {
    let cloud = scan(Shape::Bumpy, 2500, 1e-4, 0).positions;
    let (reference, _) = normals(&cloud, 8);
    for scale in [1e-3, 1e3, 1e-30, 1e30] {
        let (found, _) = normals(&cloud.iter().map(|p| *p * scale).collect::<Vec<_>>(), 8);
        let (_, largest, wrong) = errors(&found, reference.iter().map(|n| n.as_dvec3()));
        // At a tie of distances another neighbour may be taken.
        assert!(wrong == 0 && largest < 5.0, "{scale}: {largest}");
    }
    // Far from the origin, as surveys are.
    let (found, _) = normals(&cloud.iter().map(|p| *p + DVec3::new(5e5, 4e6, 0.0)).collect::<Vec<_>>(), 8);
    assert_eq!(errors(&found, reference.iter().map(|n| n.as_dvec3())).2, 0);
}

#[test]
fn degenerate_clouds() {
    for (name, cloud) in degenerate() {
        let indexed = Indexed::new(&cloud).unwrap();
        if cloud.len() < 3 {
            let error = estimate(&indexed, 8).unwrap_err();
            assert_eq!(error, Error::TooFew { points: cloud.len(), task: "a normal", needed: 3 });
            continue;
        }
        let (found, _) = normals(&cloud, 8);
        let expected = if name == "coplanar" { 1.0 } else { 0.0 };
        for n in &found {
            assert!((n.length() - expected).abs() < 1e-6 && n.truncate().length() < 1e-6, "{name}: {n}");
        }
        assert!(name != "coplanar" || found.iter().all(|n| n.z == found[0].z));
    }
    // Fewer than k points: all of them.
    let few = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)];
    assert!(normals(&few, 64).0.iter().all(|n| n.z.abs() == 1.0));
    for k in [0, 2, 65] {
        assert_eq!(estimate(&Indexed::new(&few).unwrap(), k), Err(Error::Neighbours(k)));
    }
    // Scan lines: the nearest 8 lie on the line, the 64 nearest do not.
    let lines: Vec<DVec3> =
        (0..2000).map(|i| DVec3::new((i % 100) as f64 * 0.01, (i / 100) as f64 * 0.1, 0.0)).collect();
    let (found, _) = normals(&lines, 8);
    assert!(found.iter().all(|n| n.z.abs() == 1.0 && n.z == found[0].z), "scan lines");
    // A ribbon, narrow among 64 points too.
    let ribbon: Vec<DVec3> = (0..500).map(|i| DVec3::new(i as f64 * 0.01, (i % 2) as f64 * 0.001, 0.0)).collect();
    assert!(normals(&ribbon, 8).0.iter().all(|n| n.z.abs() == 1.0), "ribbon");
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let cloud = scan(Shape::Torus, 5000, 1e-3, 0).positions;
    let at = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| normals(&cloud, 8))
    };
    assert_eq!(at(1), at(5));
}
