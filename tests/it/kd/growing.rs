//! Rays while the tree under them grows: nobody waits for another, nothing is opened twice, and the tree is the one there is.

use std::ops::ControlFlow;
use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use sunfleck::index::kd::{Builder, EveryTriangle, KdOptions, KdTree, LazyKd, Ray, RaySearch};

use super::meshes::{N_KINDS, Random, icosphere, mesh, random};

fn options(parallel: bool) -> KdOptions {
    KdOptions { parallel, ..KdOptions::default() }
}

/// From within and without to somewhere near the middle.
fn rays(seed: u32) -> impl Iterator<Item = Ray<f64>> {
    let mut r = Random::new(seed);
    std::iter::repeat_with(move || {
        let origin = r.vector().map(|x| 2.0 * x);
        let target = r.vector();
        Ray::new(origin, std::array::from_fn(|i| target[i] - origin[i])).unwrap()
    })
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// The tree is whole and that of the eager build, and every node of it was opened once.
fn is_whole(tree: LazyKd<f64>, eager: &KdTree<f64>, what: &str) {
    assert!(tree.is_grown(), "{what}");
    assert_eq!(tree.n_opened(), eager.nodes().count(), "{what}");
    let packed = tree.finish().unwrap();
    assert!(packed.nodes().eq(eager.nodes()) && packed.bytes() == eager.bytes(), "{what}");
}

#[test]
fn rays_and_growth_share_a_pool_of_any_size() {
    // Large enough for pieces of the growth to be stolen, and for rays to meet cells that are being opened.
    let soup = icosphere(5);
    let eager = KdTree::new(mesh::<f64>(&soup), &options(false)).unwrap();
    let rays: Vec<_> = rays(5).take(4000).collect();
    let expected: Vec<_> = rays.iter().map(|ray| (eager.nearest(ray), eager.count(ray), eager.any(ray))).collect();
    assert!(expected.iter().filter(|e| e.2).count() > 1000);
    for threads in [1, 2, 5] {
        for parallel in [false, true] {
            let what = format!("{threads} threads, parallel {parallel}");
            let tree = LazyKd::new(mesh::<f64>(&soup), &options(parallel)).unwrap();
            let ask = |ray| (tree.nearest(ray), tree.count(ray), tree.any(ray));
            let (grown, found) =
                pool(threads).install(|| rayon::join(|| tree.grow(), || rays.par_iter().map(ask).collect::<Vec<_>>()));
            grown.unwrap();
            assert_eq!(found, expected, "{what}");
            is_whole(tree, &eager, &what);
        }
    }
}

/// Threads of their own that ask from before the first node is open until after the last, and two that grow.
#[test]
fn threads_ask_until_the_tree_is_grown() {
    let soup = icosphere(5);
    let eager = KdTree::new(mesh::<f64>(&soup), &options(false)).unwrap();
    let tree = LazyKd::new(mesh::<f64>(&soup), &options(true)).unwrap();
    let (grown, start) = (AtomicBool::new(false), Barrier::new(8));
    let asked: usize = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..6)
            .map(|thread| {
                let (tree, eager, grown, start) = (&tree, &eager, &grown, &start);
                scope.spawn(move || {
                    let (mut asked, mut after) = (0, 0);
                    start.wait();
                    for ray in rays(100 + thread) {
                        assert_eq!(tree.nearest(&ray), eager.nearest(&ray));
                        assert_eq!(tree.count(&ray), eager.count(&ray));
                        asked += 1;
                        after += usize::from(grown.load(Ordering::SeqCst));
                        if after == 100 {
                            break;
                        }
                    }
                    asked
                })
            })
            .collect();
        let growers = [pool(2), pool(1)].map(|pool| {
            let (tree, start) = (&tree, &start);
            scope.spawn(move || {
                start.wait();
                pool.install(|| tree.grow())
            })
        });
        for grower in growers {
            grower.join().unwrap().unwrap();
        }
        grown.store(true, Ordering::SeqCst);
        threads.into_iter().map(|thread| thread.join().unwrap()).sum()
    });
    assert!(asked > 600, "only {} were asked before", asked - 600);
    is_whole(tree, &eager, "from two sides");
}

/// No lock is held while the caller has a hit: he may ask, and grow, from within, on a single thread of rayon's too.
#[test]
fn a_visitor_may_ask_and_grow() {
    let soup = icosphere(4);
    let eager = KdTree::new(mesh::<f64>(&soup), &options(false)).unwrap();
    let tree = LazyKd::new(mesh::<f64>(&soup), &options(true)).unwrap();
    let ray = Ray::new([0.1, 0.2, 3.0], [0.0, 0.0, -1.0]).unwrap();
    let mut faces = Vec::new();
    pool(1).install(|| {
        let _: ControlFlow<()> = tree.try_hits(&ray, |hit| {
            assert_eq!(tree.nearest(&ray), eager.nearest(&ray));
            tree.grow().unwrap();
            faces.push(hit.face);
            ControlFlow::Continue(f64::INFINITY)
        });
    });
    faces.sort_unstable();
    faces.dedup();
    assert_eq!(faces.len(), eager.count(&ray));
    is_whole(tree, &eager, "from within");
}

#[test]
fn foul_meshes_grow_beside_rays_too() {
    let pool = pool(3);
    for kind in 0..N_KINDS {
        for builder in [Builder::None, Builder::SortEachNode, Builder::SortOnce] {
            let (soup, name) = random(kind, 900 + kind, 400);
            let with = KdOptions { builder, ..options(true) };
            let eager = KdTree::new(mesh::<f64>(&soup), &with).unwrap();
            let tree = LazyKd::new(mesh::<f64>(&soup), &with).unwrap();
            let triangles = mesh::<f64>(&soup);
            let check = |ray: &Ray<f64>| {
                let mut hits = [Vec::new(), Vec::new()];
                tree.all(ray, &mut hits[0]);
                EveryTriangle(&triangles).all(ray, &mut hits[1]);
                assert_eq!(hits[0], hits[1], "{name}, {builder:?}");
            };
            let rays: Vec<_> = rays(kind).take(200).collect();
            let grown = pool.install(|| rayon::join(|| tree.grow(), || rays.par_iter().for_each(check))).0;
            grown.unwrap();
            is_whole(tree, &eager, name);
        }
    }
}
