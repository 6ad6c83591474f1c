//! Visitors of the caller's own.

use sunfleck::device::Error;
use sunfleck::gpu::{Access, Queries, wgpu};
use sunfleck::index::{BruteForce, Radii, RadiusSearch};

use super::{ALL, search, uniform, upload};

/// Sum over the neighbours of 1 − d²/r², and the farthest neighbour.
pub const KERNEL_SUM: &str = "
@group(0) @binding(4) var<storage, read> weights: array<f32>;
@group(0) @binding(5) var<storage, read_write> sums: array<f32>;

struct Visitor {
    radius2: f32,
    inverse: f32,
    sum: f32,
}

fn begin(query: u32, centre: vec3<f32>, radius2: f32) -> Visitor {
    return Visitor(radius2, 1.0 / radius2, 0.0);
}

fn visit(visitor: ptr<function, Visitor>, slot: u32, delta: vec3<f32>, distance2: f32) {
    (*visitor).sum += weights[index_of(slot)] * (1.0 - distance2 * (*visitor).inverse);
}

fn end(visitor: ptr<function, Visitor>, query: u32) {
    sums[query] = (*visitor).sum;
}
";

#[test]
fn a_visitor_of_ones_own() {
    let Some(mut search) = search() else { return };
    let context = search.context().clone();
    let (points, queries) = (uniform(70, 3000), uniform(71, 200));
    let weights: Vec<f32> = (0..3000).map(|i| (i % 5) as f32).collect();
    search.build(&points).expect("build");
    let visitor = search.compile(KERNEL_SUM, &[Access::Read, Access::Write]).expect("it compiles");
    let given = upload(&context, &weights, wgpu::BufferUsages::STORAGE);
    let sums = upload(&context, &[f32::NAN; 200], wgpu::BufferUsages::STORAGE);
    let radius = 0.4;
    let expected: Vec<f32> = BruteForce(&points)
        .fold_all(
            &queries,
            Radii::One(radius),
            |_| 0.0,
            |sum, i, d2| {
                *sum += weights[i as usize] * (1.0 - d2 / (radius * radius));
            },
        )
        .unwrap();
    for sort in [false, true] {
        search.set_sort_queries(sort);
        search.visit_all(&visitor, Queries::Host(&queries), Radii::One(radius).into(), &[&given, &sums]).expect("run");
        let got: Vec<f32> = context.download(&sums, 0, 200).expect("sums");
        for (got, expected) in got.iter().zip(&expected) {
            assert!((got - expected).abs() <= 1e-4 * expected.abs().max(1.0), "{got} against {expected}");
        }
    }
    let few = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&given]);
    assert!(matches!(few, Err(Error::Shader(_))), "{few:?}");
    let plain = upload(&context, &weights, wgpu::BufferUsages::UNIFORM);
    let unbindable = search.visit_all(&visitor, Queries::Host(&queries), ALL.into(), &[&plain, &sums]);
    assert!(matches!(unbindable, Err(Error::Device { .. })), "{unbindable:?}");
}

#[test]
fn what_does_not_compile_is_an_error_with_its_line() {
    let Some(search) = search() else { return };
    let line = |text: &str| 1 + KERNEL_SUM[..KERNEL_SUM.find(text).expect("there")].matches('\n').count();
    for (from, to) in [("* (*visitor).inverse", "* (*visitor).inverted"), ("(*visitor).sum;\n", "vec3(1.0)\n")] {
        match search.compile(&KERNEL_SUM.replace(from, to), &[Access::Read, Access::Write]) {
            Err(Error::Shader(message)) => {
                // The second is missed only where the next line begins.
                let lines = [line(from), line(from) + 1];
                assert!(lines.iter().any(|line| message.contains(&format!("wgsl:{line}:"))), "{lines:?}: {message}");
            }
            other => panic!("{:?}", other.map(drop)),
        }
    }
    // Right in itself, but not what was said about its buffers, and more buffers than there can be.
    for accesses in [vec![Access::Read], vec![Access::Read; 1 << 20]] {
        let result = search.compile(KERNEL_SUM, &accesses).map(drop);
        assert!(matches!(result, Err(Error::Shader(_))), "{result:?}");
    }
}
