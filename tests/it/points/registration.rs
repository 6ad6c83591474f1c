//! Iterative closest points.

use glam::{DQuat, DVec3, Vec3};
use sunfleck::points::generate::{Shape, scan};
use sunfleck::points::{Error, Indexed, Method, Registration, Rigid, Settings, estimate, register};

use super::{STRAY, degenerate, motion, random, uniform};

const METHODS: [Method; 2] = [Method::PointToPoint, Method::PointToPlane];

fn icp(source: &[DVec3], target: &[DVec3], settings: Settings) -> Result<Registration, Error> {
    let indexed = Indexed::new(target)?;
    let normals = estimate(&indexed, 12).map(|found| found.normals);
    register(source, &indexed, normals.ok().as_deref(), &settings, |_, _| {})
}

fn with(method: Method) -> Settings {
    Settings { method, ..Settings::default() }
}

fn with_tolerance(method: Method, tolerance: f64) -> Settings {
    Settings { tolerance, ..with(method) }
}

/// About the middle of the cloud, so that the error of the rotation does not show as one of the translation.
fn displaced(cloud: &[DVec3], scale: f64) -> (Vec<DVec3>, Rigid) {
    let (rotation, translation) = motion();
    let away = Rigid::about(DVec3::ZERO, rotation, translation * scale);
    (away.apply_all(cloud), away.inverse())
}

/// Radians, and the distance at the origin of the moved cloud.
fn difference(a: &Rigid, b: &Rigid) -> (f64, f64) {
    let d = a.after(&b.inverse());
    (d.angle(), d.apply(DVec3::ZERO).length())
}

/// Zero mean, one component, standard deviation 1 (sum of 4 uniforms).
fn noise(i: usize, dimension: u32) -> DVec3 {
    let component = |c: u32| (random(i, dimension + c).iter().sum::<f64>() - 2.0) * 3.0_f64.sqrt();
    DVec3::new(component(0), component(1), component(2))
}

#[test]
fn a_known_motion_of_a_noisy_copy_is_recovered() {
    let n = 6000;
    let target = scan(Shape::Bumpy, n, 0.0, 0).positions;
    let sigma = 5e-4;
    let noisy: Vec<DVec3> = target.iter().enumerate().map(|(i, p)| *p + noise(i, 20) * sigma).collect();
    let (source, truth) = displaced(&noisy, 1.0);
    for method in METHODS {
        let found = icp(&source, &target, with(method)).unwrap();
        let (angle, shift) = difference(&found.motion, &truth);
        // The mean of n points is known to σ/√n a component; 5 standard errors. Matching to a neighbour other than the
        // point's own shrinks the signal along the surface, which only the noise (2 % of the spacing's square) feeds.
        let expected = sigma / (n as f64).sqrt();
        assert!(found.converged && found.free == 0, "{method:?}");
        assert!(shift < 5.0 * 3.0_f64.sqrt() * expected, "{method:?}: shift {shift}, σ/√n {expected}");
        assert!(angle < 5.0 * 3.0_f64.sqrt() * expected / 0.4, "{method:?}: angle {angle}");
        let last = found.iterations.last().unwrap();
        // σ√3 in all; the spacing is some ten times that, so that next to all meet their own point.
        assert!((last.rms / (sigma * 3.0_f64.sqrt()) - 1.0).abs() < 0.05, "{method:?}: rms {}", last.rms);
        if let Some(rms) = last.plane_rms {
            assert!((rms / sigma - 1.0).abs() < 0.05, "{rms}");
        }
    }
}

#[test]
fn another_scan_of_the_surface_is_met() {
    // No point of one is in the other: what limits is the sampling.
    let (target, other) = (scan(Shape::Bumpy, 8000, 2e-4, 0), scan(Shape::Bumpy, 5000, 2e-4, 1));
    let (source, truth) = displaced(&other.positions, 1.0);
    let mut steps = vec![];
    for method in METHODS {
        let found = icp(&source, &target.positions, with(method)).unwrap();
        let (angle, shift) = difference(&found.motion, &truth);
        // Point-to-point creeps along a surface that is nearly round, and gives up before it is there.
        let limit = if method == Method::PointToPlane { 5e-4 } else { 1e-2 };
        let n = found.iterations.len();
        assert!(angle < limit && shift < limit, "{method:?}: {angle} {shift} after {n}");
        let rms: Vec<f64> = found.iterations.iter().map(|i| i.rms).collect();
        assert!(rms.last().unwrap() < &(0.4 * rms[0]), "{method:?}: {rms:?}");
        assert!(found.converged || method == Method::PointToPoint, "{method:?}: {rms:?}");
        assert!(found.iterations.last().unwrap().inliers > 0.98);
        steps.push(found.iterations.len());
    }
    assert!(2 * steps[1] < steps[0], "point-to-plane takes {}, point-to-point {}", steps[1], steps[0]);
}

#[test]
fn stray_points_neither_stop_it_nor_keep_it_going() {
    let target = scan(Shape::Bumpy, 3000, 0.0, 0).positions;
    let (source, truth) = displaced(&target, 1.0);
    for far in STRAY {
        let with = |cloud: &[DVec3], stray: DVec3| cloud.iter().copied().chain([stray]).collect::<Vec<_>>();
        for method in METHODS {
            let (source, target) = (with(&source, DVec3::Y * far), with(&target, DVec3::X * far));
            let found = icp(&source, &target, with_tolerance(method, 1e-9)).unwrap();
            let (angle, shift) = difference(&found.motion, &truth);
            assert!(found.converged && angle < 1e-6 && shift < 1e-6, "{method:?} {far}: {angle} {shift}");
        }
    }
}

#[test]
fn scans_that_overlap_in_part_are_registered() {
    let cloud = scan(Shape::Bumpy, 12_000, 2e-4, 0).positions;
    let target: Vec<DVec3> = cloud.iter().copied().filter(|p| p.z < 0.3).collect();
    let other: Vec<DVec3> = scan(Shape::Bumpy, 12_000, 2e-4, 1).positions.into_iter().filter(|p| p.z > -0.4).collect();
    let (source, truth) = displaced(&other, 0.5);
    let found = icp(&source, &target, with(Method::PointToPlane)).unwrap();
    let (angle, shift) = difference(&found.motion, &truth);
    assert!(angle < 2e-3 && shift < 2e-3, "{angle} {shift}");
    assert!((0.5..0.85).contains(&found.iterations.last().unwrap().inliers));
}

#[test]
fn the_unit_and_the_origin_do_not_matter() {
    let target = scan(Shape::Bumpy, 1500, 0.0, 0).positions;
    let (source, _) = displaced(&scan(Shape::Bumpy, 1000, 0.0, 1).positions, 1.0);
    for method in METHODS {
        let reference = icp(&source, &target, with(method)).unwrap();
        let rms = reference.iterations.last().unwrap().rms;
        for (scale, origin) in [(1e-3, DVec3::ZERO), (1e3, DVec3::ZERO), (1.0, DVec3::new(5e5, -4e6, 100.0))] {
            let moved = |cloud: &[DVec3]| cloud.iter().map(|p| *p * scale + origin).collect::<Vec<_>>();
            let found = icp(&moved(&source), &moved(&target), with(method)).unwrap();
            for (p, q) in source.iter().zip(moved(&source)) {
                let (a, b) = (reference.motion.apply(*p), (found.motion.apply(q) - origin) / scale);
                assert!(a.distance(b) < 2e-5, "{method:?} {scale} {origin}: {a} {b}");
            }
            let fit = found.iterations.last().unwrap();
            assert!((fit.rms / scale / rms - 1.0).abs() < 1e-3, "{method:?} {scale}");
        }
    }
}

#[test]
fn a_fixed_outlier_distance_is_kept() {
    let target = uniform(2000, 0);
    let source: Vec<DVec3> = target.iter().map(|p| *p + DVec3::X * 0.01).chain([DVec3::splat(3.0); 500]).collect();
    let settings = Settings { outlier: Some(0.05), ..Settings::default() };
    let found = icp(&source, &target, settings).unwrap();
    assert!(difference(&found.motion, &Rigid { rotation: DQuat::IDENTITY, translation: -DVec3::X * 0.01 }).1 < 1e-9);
    assert!(found.iterations.iter().all(|i| i.outlier == 0.05) && found.iterations.last().unwrap().inliers == 0.8);
    let far: Vec<DVec3> = target.iter().map(|p| *p + DVec3::X * 10.0).collect();
    let error = icp(&far, &target, settings).unwrap_err();
    assert_eq!(error, Error::Apart { iteration: 0, matches: 0, distance: 0.05 });
    let two = [&target[..2], &far[2..]].concat();
    let error = icp(&two, &target, settings).unwrap_err();
    assert_eq!(error, Error::Apart { iteration: 0, matches: 2, distance: 0.05 });
    // To a plane only where there is a normal.
    let normals: Vec<Vec3> = (0..2000).map(|i| if i % 2 == 0 { Vec3::ZERO } else { Vec3::Z }).collect();
    let plane = Settings { method: Method::PointToPlane, ..settings };
    let found = register(&target, &Indexed::new(&target).unwrap(), Some(&normals), &plane, |_, _| {}).unwrap();
    assert_eq!(found.iterations[0].inliers, 0.5);
    let none = icp(&source, &target, Settings { iterations: 0, ..settings }).unwrap();
    assert!(none.motion == Rigid::IDENTITY && none.iterations.len() == 1 && !none.converged);
}

#[test]
fn two_iterations_are_one_after_the_other() {
    let target = scan(Shape::Bumpy, 2000, 0.0, 0).positions;
    let (source, _) = displaced(&target, 1.0);
    for method in METHODS {
        let after = |source: &[DVec3], iterations| {
            let settings = Settings { iterations, outlier: Some(1.0), ..with(method) };
            icp(source, &target, settings).unwrap().motion
        };
        let first = after(&source, 1);
        let second = after(&first.apply_all(&source), 1);
        let (angle, shift) = difference(&after(&source, 2), &second.after(&first));
        assert!(angle < 1e-9 && shift < 1e-9, "{method:?}: {angle} {shift}");
        let p = DVec3::new(0.3, 0.5, -0.9);
        assert!(second.after(&first).apply(p).distance(second.apply(first.apply(p))) < 1e-12);
    }
}

#[test]
fn a_reflection_is_never_taken() {
    // Flat, so that each point is matched to its own mirror image: the best orthogonal map is the mirror.
    let flat: Vec<DVec3> =
        (0..49).map(|i| DVec3::new((i % 7) as f64, (i / 7) as f64, 0.1 * random(i, 8)[0] - 0.05)).collect();
    let mirrored: Vec<DVec3> = flat.iter().map(|p| DVec3::new(p.x, p.y, -p.z)).collect();
    let found = icp(&mirrored, &flat, with(Method::PointToPoint)).unwrap();
    assert!(found.converged && found.motion.angle() < 0.05, "{}", found.motion.angle());
    let last = found.iterations.last().unwrap();
    assert!(last.inliers == 1.0 && last.rms > 0.01, "{last:?}");
    // And where it locks in anywhere.
    let target = uniform(50, 2);
    let mirrored: Vec<DVec3> = target.iter().map(|p| DVec3::new(p.x, p.y, -p.z)).collect();
    let found = icp(&mirrored, &target, Settings { outlier: Some(1e9), ..Settings::default() }).unwrap();
    let rows = found.motion.rows();
    let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
    let determinant = column(0).cross(column(1)).dot(column(2));
    assert!((determinant - 1.0).abs() < 1e-9, "{determinant}");
    assert_eq!(rows[3], [0.0, 0.0, 0.0, 1.0]);
    let p = DVec3::new(0.2, 0.5, -0.7);
    let by_rows =
        DVec3::from_array(std::array::from_fn(|i| rows[i][0] * p.x + rows[i][1] * p.y + rows[i][2] * p.z + rows[i][3]));
    assert!(by_rows.distance(found.motion.apply(p)) < 1e-12);
}

#[test]
fn what_a_surface_leaves_free_is_said_and_left_alone() {
    let target: Vec<DVec3> = (0..3000).map(|i| DVec3::new(random(i, 1)[0], random(i, 1)[1], 0.0)).collect();
    let source: Vec<DVec3> = target.iter().map(|p| DVec3::new(p.x, p.y, 0.02 + 0.01 * p.x)).collect();
    let found = icp(&source, &target, with(Method::PointToPlane)).unwrap();
    assert_eq!(found.free, 3, "a plane slides two ways and turns one");
    assert!(found.converged && found.iterations.last().unwrap().plane_rms.unwrap() < 1e-6);
    let middle = DVec3::new(0.5, 0.5, 0.025);
    assert!((found.motion.apply(middle) - middle).truncate().length() < 1e-3, "it did not slide");
}

#[test]
fn degenerate_clouds_give_an_answer_or_an_error() {
    let other = uniform(200, 4);
    for (name, cloud) in degenerate() {
        for method in METHODS {
            for (source, target) in [(&cloud, &cloud), (&cloud, &other), (&other, &cloud)] {
                let indexed = Indexed::new(target).unwrap();
                let normals = vec![Vec3::Z; target.len()];
                match register(source, &indexed, Some(&normals), &with(method), |_, _| {}) {
                    Ok(found) => assert!(found.motion.apply(DVec3::ONE).is_finite(), "{name} {method:?}"),
                    Err(Error::TooFew { points, .. }) => assert!(points < 3, "{name} {method:?}"),
                    Err(Error::Undetermined) => assert!(["equal", "collinear"].contains(&name), "{name} {method:?}"),
                    Err(error) => panic!("{name} {method:?}: {error}"),
                }
            }
        }
    }
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let target = scan(Shape::Torus, 4000, 1e-3, 0).positions;
    let (source, _) = displaced(&scan(Shape::Torus, 4000, 1e-3, 1).positions, 0.5);
    for method in METHODS {
        let at = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| icp(&source, &target, Settings { iterations: 8, ..with(method) }).unwrap())
        };
        assert_eq!(at(1), at(5), "{method:?}");
    }
}
