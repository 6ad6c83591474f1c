//! Point clouds: files, correspondence, registration, normals.

mod files;
mod normals;
mod registration;

use glam::{DQuat, DVec3};
use sunfleck::index::{BruteForce, Radii, RadiusSearch};
use sunfleck::math::rng::{pcg4d, unit4};
use sunfleck::points::generate::{SHAPES, Shape, scan};
use sunfleck::points::{Error, Indexed, Match, automatic_outlier, correspond};

/// Four numbers in [0, 1).
fn random(i: usize, dimension: u32) -> [f64; 4] {
    unit4(pcg4d([i as u32, dimension, 77, 5])).map(f64::from)
}

/// In a cube of side 2.
fn uniform(n: usize, dimension: u32) -> Vec<DVec3> {
    let point = |i| {
        let [x, y, z, _] = random(i, dimension);
        2.0 * DVec3::new(x, y, z) - DVec3::ONE
    };
    (0..n).map(point).collect()
}

/// Evenly over the unit sphere (a Fibonacci spiral).
fn sphere(n: usize) -> Vec<DVec3> {
    let point = |i: usize| {
        let z = 1.0 - (2 * i + 1) as f64 / n as f64;
        let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        DVec3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    };
    (0..n).map(point).collect()
}

/// The clouds that have broken such code before.
fn degenerate() -> [(&'static str, Vec<DVec3>); 5] {
    let t = |i: usize| i as f64 / 100.0;
    [
        ("empty", vec![]),
        ("one", vec![DVec3::new(1.0, 2.0, 3.0)]),
        ("equal", vec![DVec3::splat(0.3); 100]),
        ("collinear", (0..100).map(|i| DVec3::new(1.0, 2.0, -0.5) * t(i)).collect()),
        ("coplanar", (0..100).map(|i| DVec3::new(random(i, 3)[0], random(i, 3)[1], 0.25)).collect()),
    ]
}

#[test]
fn correspondence_equals_brute_force() {
    let target = uniform(3000, 0);
    let indexed = Indexed::new(&target).unwrap();
    let source = uniform(2000, 1);
    for outlier in [f64::INFINITY, 0.1, 0.02, 0.0] {
        let found = correspond(&source, &indexed, outlier).unwrap();
        let (mut some, mut none) = (0, 0);
        for (p, m) in source.iter().zip(&found) {
            let (best, distance) =
                (0..target.len()).map(|i| (i, target[i].distance(*p))).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            if distance <= outlier {
                assert_eq!((m.index as usize, m.distance), (best, distance), "{outlier}");
                some += 1;
            } else {
                assert_eq!(*m, Match::NONE, "{outlier}");
                none += 1;
            }
        }
        let (all_some, all_none) = (outlier == f64::INFINITY, outlier == 0.0);
        assert!((all_none || some > 10) && (all_some || none > 100), "{outlier}: {some} {none}");
    }
    // Ties and coincident points: bit for bit as the oracle over the same frame.
    let lattice: Vec<DVec3> =
        (0..1000).map(|i| DVec3::new((i % 10) as f64, (i / 10 % 10) as f64, (i / 100) as f64)).collect();
    let twice = [lattice.clone(), lattice].concat();
    let indexed = Indexed::new(&twice).unwrap();
    let local: Vec<_> = twice.iter().map(|&p| indexed.frame().local(p)).collect();
    let queries: Vec<DVec3> =
        (0..500).map(|i| DVec3::from_slice(&random(i, 9)).floor() + 0.5 * (i % 18) as f64).collect();
    let asked: Vec<_> = queries.iter().map(|&p| indexed.frame().local(p)).collect();
    let oracle = BruteForce(&local).nearest_all(&asked, Radii::One(f32::INFINITY), 1).unwrap();
    let found = correspond(&queries, &indexed, f64::INFINITY).unwrap();
    assert!(found.iter().map(|m| m.index).eq(oracle.indices), "ties");
}

#[test]
fn an_outlier_distance_is_inclusive() {
    let target = [DVec3::ZERO, DVec3::X * 10.0];
    let indexed = Indexed::new(&target).unwrap();
    let at = |outlier| correspond(&[DVec3::X * 3.0], &indexed, outlier).unwrap()[0];
    assert_eq!(at(3.0), Match { index: 0, distance: 3.0 });
    assert_eq!(at(3.0_f64.next_down()), Match::NONE);
}

#[test]
fn the_automatic_outlier_distance_suits_the_sampling() {
    for (name, shape) in SHAPES {
        let (a, b) = (scan(shape, 6000, 1e-4, 0), scan(shape, 6000, 1e-4, 1));
        let indexed = Indexed::new(&a.positions).unwrap();
        let outlier = automatic_outlier(&indexed);
        let found = correspond(&b.positions, &indexed, outlier).unwrap();
        let share = found.iter().filter(|m| m.is_some()).count() as f64 / b.len() as f64;
        assert!(share > 0.98, "{name}: {share}");
        // Away from the surface nothing is matched.
        let away: Vec<DVec3> = b.positions.iter().map(|p| *p + shape.normal(*p) * 0.2).collect();
        let found = correspond(&away, &indexed, outlier).unwrap();
        assert!(!found.iter().any(|m| m.is_some()), "{name}");
    }
    let once = automatic_outlier(&Indexed::new(&uniform(500, 0)).unwrap());
    for times in [2, 10, 50] {
        let outlier = automatic_outlier(&Indexed::new(&uniform(500, 0).repeat(times)).unwrap());
        assert!(
            (outlier / once - 1.0).abs() < 0.05,
            "{times}: coincident points hide the spacing, {outlier} for {once}"
        );
    }
}

/// Distances of a stray point from a cloud of size 2.
const STRAY: [f64; 4] = [1e3, 1e6, 1e12, 1e30];

#[test]
fn a_stray_point_costs_the_others_nothing() {
    let (target, source) = (uniform(3000, 0), uniform(1000, 1));
    let expected = correspond(&source, &Indexed::new(&target).unwrap(), 0.1).unwrap();
    for far in STRAY {
        // The stray points match too, where the search's rounding may exceed the outlier distance.
        let mut target = target.clone();
        target.extend([DVec3::new(far, -0.5 * far, 0.0), DVec3::new(0.0, far, far) * 0.9]);
        let mut source = source.clone();
        source.extend([target[3000] + DVec3::Z * 0.01, target[3001] - DVec3::X * 0.01]);
        let found = correspond(&source, &Indexed::new(&target).unwrap(), 0.1).unwrap();
        assert!(found[..1000] == expected, "{far}");
        assert_eq!((found[1000].index, found[1001].index), (3000, 3001), "{far}");
    }
}

#[test]
fn stray_points_are_matched_too() {
    // Where 32 bits are 1/16 apart, counterparts 0.09 away may look farther than 0.1.
    let far = |i: usize| DVec3::X * (1e6 + i as f64);
    let target: Vec<DVec3> = uniform(3000, 0).into_iter().chain((0..100).map(far)).collect();
    let source: Vec<DVec3> = (0..100).map(|i| far(i) + DVec3::X * (0.05 + 0.0004 * i as f64)).collect();
    let found = correspond(&source, &Indexed::new(&target).unwrap(), 0.1).unwrap();
    assert!(found.iter().map(|m| m.index).eq(3000..3100), "{found:?}");
    // Most of the points in one place, in a small unit.
    let target: Vec<DVec3> =
        [vec![DVec3::ZERO; 600], uniform(500, 0)].concat().into_iter().map(|p| p * 1e-40).collect();
    let found = correspond(&target[600..], &Indexed::new(&target).unwrap(), f64::INFINITY).unwrap();
    assert!(found.iter().map(|m| m.index).eq(600..1100), "{found:?}");
}

#[test]
fn degenerate_clouds_are_matched() {
    for (name, cloud) in degenerate() {
        let indexed = Indexed::new(&cloud).unwrap();
        let found = correspond(&cloud, &indexed, 0.0).unwrap();
        assert!(found.iter().all(|m| m.is_some() && m.distance == 0.0), "{name}");
        let far = [DVec3::splat(1e30)];
        let found = correspond(&far, &indexed, f64::INFINITY);
        assert!(matches!(found, Ok(_) | Err(Error::Search(_))), "{name}: {found:?}");
        assert!(automatic_outlier(&indexed).is_finite(), "{name}");
    }
    let indexed = Indexed::new(&[DVec3::ZERO]).unwrap();
    for wrong in [f64::NAN, f64::INFINITY, 1e101] {
        assert_eq!(Indexed::new(&[DVec3::ZERO, DVec3::Y * wrong]).unwrap_err(), Error::Coordinate(1));
        assert_eq!(correspond(&[DVec3::X * wrong], &indexed, 1.0).unwrap_err(), Error::Coordinate(0));
    }
    assert!(matches!(correspond(&[DVec3::X], &indexed, -1.0), Err(Error::Search(_))));
}

#[test]
fn clouds_made_by_code_lie_on_their_surface() {
    for (name, shape) in SHAPES {
        for n in [1, 1000] {
            let cloud = scan(shape, n, 0.0, 3);
            assert_eq!(cloud.len(), n, "{name}");
            for p in &cloud.positions {
                assert!(shape.distance(*p).abs() < 1e-6, "{name} {p}");
            }
            assert_eq!(cloud, scan(shape, n, 0.0, 3));
            assert_ne!(cloud, scan(shape, n, 0.0, 4));
        }
        // On all sides, and only by the noise away from it.
        let cloud = scan(shape, 3000, 0.01, 3);
        for axis in DVec3::AXES {
            let reach = |sign: f64| cloud.positions.iter().map(|p| sign * p.dot(axis)).fold(0.0, f64::max);
            assert!(reach(1.0) > 0.29 && reach(-1.0) > 0.29, "{name} {axis}");
        }
        let off = cloud.positions.iter().map(|p| shape.distance(*p).powi(2)).sum::<f64>() / 3000.0;
        assert!((0.003..0.01).contains(&off.sqrt()), "{name}: {}", off.sqrt());
    }
    let p = DVec3::new(0.3, -0.8, 0.1);
    assert!(Shape::Sphere.normal(p).distance(p.normalize()) < 1e-6);
}

/// Turned and moved, by some.
fn motion() -> (DQuat, DVec3) {
    (DQuat::from_axis_angle(DVec3::new(1.0, -2.0, 0.5).normalize(), 0.15), DVec3::new(0.05, -0.08, 0.03))
}
