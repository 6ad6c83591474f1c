//! Points, queries and radii in buffers of the caller's own.

use sunfleck::device::Error;
use sunfleck::gpu::{Access, PointSearch, Queries, QueryRadii, wgpu};
use sunfleck::index::{BruteForce, Radii, RadiusSearch};

use super::visitors::KERNEL_SUM;
use super::{assert_same_lists, assert_same_sets, is_exact, queries, search, uniform, upload};

#[test]
fn points_and_queries_on_the_device() {
    let Some(mut search) = search() else { return };
    let context = search.context().clone();
    let (points, exact) = (uniform(40, 2000), is_exact(&search));
    let (queries, radii) = queries(&points, 100);
    let records: Vec<[f32; 5]> = points.iter().map(|p| [p.x, p.y, p.z, f32::NAN, -1.0]).collect();
    let on_device = upload(&context, &records, wgpu::BufferUsages::STORAGE);
    search.build_from(&on_device, points.len() as u32, 5).expect("build");
    let buffer = upload(&context, &queries, wgpu::BufferUsages::STORAGE);
    let asked = Queries::Device { buffer: &buffer, n: 100, words_per_record: 3 };
    let own_radii = upload(&context, &radii, wgpu::BufferUsages::STORAGE);
    for sort in [false, true] {
        search.set_sort_queries(sort);
        for radii_asked in [QueryRadii::Device(&own_radii), Radii::Each(&radii).into()] {
            let found = search.neighbours_on_device(asked, radii_asked).expect("search").download().expect("rows");
            assert_same_sets("on the device", &points, &queries, Radii::Each(&radii), &found, exact);
            let lists = search.nearest_on_device(asked, radii_asked, 7).expect("search").download().expect("lists");
            let expected = BruteForce(&points).nearest_all(&queries, Radii::Each(&radii), 7).unwrap();
            assert_same_lists("on the device", &lists, &expected, exact);
        }
    }
    // Nothing is within such radii.
    let none = upload(&context, &[-1.0f32; 100], wgpu::BufferUsages::STORAGE);
    let counts = search.count_on_device(asked, QueryRadii::Device(&none)).expect("search");
    assert_eq!(counts.download().expect("counts"), [0; 100]);

    let refused = |result: Result<(), Error>, part: &str| match result {
        Err(Error::Buffer { problem, .. }) => assert!(problem.contains(part), "{problem}"),
        other => panic!("{other:?}"),
    };
    refused(search.build_from(&on_device, 2000, 2), "2 words");
    assert!(search.is_empty());
    refused(search.build_from(&on_device, 2001, 5), "40000 bytes, 40020 are needed");
    let plain = upload(&context, &records, wgpu::BufferUsages::UNIFORM);
    refused(search.build_from(&plain, 10, 5), "STORAGE");
    let short = upload(&context, &radii[..99], wgpu::BufferUsages::STORAGE);
    refused(search.count_on_device(asked, QueryRadii::Device(&short)).map(drop), "396 bytes, 400 are needed");
}

/// wgpu binds no empty buffer, but a caller who has no queries, or no points, has one.
#[test]
fn empty_buffers_of_the_caller() {
    let Some(mut search) = search() else { return };
    assert_empty_buffers(&mut search);
}

/// The same by ray queries.
#[test]
fn empty_buffers_of_the_caller_for_ray_queries() {
    let Some(context) = crate::gpu_hardware::context() else { return };
    assert_empty_buffers(&mut PointSearch::hardware(context, 1.0).expect("kernels"));
}

fn assert_empty_buffers(search: &mut PointSearch) {
    let context = search.context().clone();
    let empty = upload::<f32>(&context, &[], wgpu::BufferUsages::STORAGE);
    let none = Queries::Device { buffer: &empty, n: 0, words_per_record: 3 };
    let points = uniform(32, 100);
    for n in [100, 0] {
        if n > 0 {
            search.build(&points).expect("build");
        } else {
            search.build_from(&empty, 0, 3).expect("no points");
            assert_eq!(search.count_all(&points[..2], Radii::One(1.0)).expect("no points"), [0, 0]);
        }
        for sort in [false, true] {
            search.set_sort_queries(sort);
            for radii in [QueryRadii::Device(&empty), Radii::One(0.5).into(), Radii::Each(&[]).into()] {
                assert!(search.count_on_device(none, radii).expect("no queries").is_empty());
                let rows = search.neighbours_on_device(none, radii).expect("no queries").download().expect("rows");
                assert_eq!((rows.offsets, rows.indices), (vec![0], vec![]));
                let lists = search.nearest_on_device(none, radii, 4).expect("no queries").download().expect("lists");
                assert!(lists.found.is_empty() && lists.indices.is_empty());
            }
        }
    }
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    search.visit_all(&visitor, none, QueryRadii::Device(&empty), &[&empty, &empty]).expect("nothing to visit");
    // With a query it is too short all the same.
    let one = Queries::Device { buffer: &empty, n: 1, words_per_record: 3 };
    let short = search.count_on_device(one, Radii::One(0.5).into());
    assert!(matches!(short, Err(Error::Buffer { .. })), "{:?}", short.map(drop));
}
