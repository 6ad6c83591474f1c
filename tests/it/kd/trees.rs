//! The trees themselves: one whatever builds it, and no triangle missing where it is.

use sunfleck::index::kd::{
    Builder, Error, EveryTriangle, KdOptions, KdTree, LazyKd, NodeView, Ray, RaySearch, Sah, Scalar, Triangles,
};

use super::meshes::{N_KINDS, Random, Soup, icosphere, mesh, point, random};

const REAL: [Builder; 3] = [Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce];

/// Checks that all builders give the tree of the O(N²) one, and returns it.
fn one_tree<T: Scalar>(soup: &Soup, sah: Sah, what: &str) -> KdTree<T> {
    let tree = |builder, parallel| KdTree::new(mesh(soup), &KdOptions { builder, sah, parallel }).unwrap();
    let oracle: KdTree<T> = tree(Builder::Quadratic, false);
    let nodes: Vec<_> = oracle.nodes().collect();
    for builder in REAL {
        for parallel in [false, true] {
            let other: KdTree<T> = tree(builder, parallel);
            assert!(other.nodes().eq(nodes.iter().copied()), "{what}: {builder:?}, parallel {parallel}");
        }
        let lazy = LazyKd::<T>::new(mesh(soup), &KdOptions { builder, sah, parallel: false }).unwrap();
        assert!(lazy.finish().unwrap().nodes().eq(nodes.iter().copied()), "{what}: {builder:?}, lazily");
    }
    oracle
}

/// The leaves that have a point, or are nearer to it than `near`: what is in them.
fn found(nodes: &mut dyn Iterator<Item = NodeView<'_>>, p: [f64; 3], near: f64, here: bool, into: &mut Vec<u32>) {
    match nodes.next().expect("a tree is whole") {
        NodeView::Leaf(faces) if here => into.extend(faces),
        NodeView::Leaf(_) => {}
        NodeView::Inner { axis, at } => {
            found(nodes, p, near, here && p[axis] <= at + near, into);
            found(nodes, p, near, here && p[axis] >= at - near, into);
        }
    }
}

/// Every point of a triangle is in a leaf that has the triangle.
fn nothing_is_missing<T: Scalar>(tree: &KdTree<T>, r: &mut Random, n: usize, what: &str) {
    let triangles = tree.triangles();
    let size = triangles.vertices().iter().flatten().map(|&x| x.into().abs()).fold(0.0, f64::max);
    for _ in 0..n {
        let face = r.below(triangles.len()) as u32;
        let p = point(triangles.corners(face), r.weights());
        let mut there = Vec::new();
        found(&mut tree.nodes(), p, 2e-7 * size, true, &mut there);
        assert!(there.contains(&face), "{what}: face {face} at {p:?}");
    }
}

#[test]
fn builders_give_one_tree_and_miss_nothing() {
    let mut inner = 0;
    for seed in 0..24 {
        for kind in 0..N_KINDS {
            let (soup, name) = random(kind, seed, 60);
            let what = format!("{name}, seed {seed}");
            let mut r = Random::new(seed + 1000 * kind);
            // Deep trees, shallow ones, ones that like to cut off space, and the default.
            let sah = match seed % 4 {
                0 => Sah { traversal: 0.1 * r.unit(), ..Sah::default() },
                1 => Sah { traversal: 15.0, intersection: 20.0, ..Sah::default() },
                2 => Sah { empty: 0.3, max_depth: 9, ..Sah::default() },
                _ => Sah::default(),
            };
            let (double, single) = (one_tree::<f64>(&soup, sah, &what), one_tree::<f32>(&soup, sah, &what));
            nothing_is_missing(&double, &mut r, 30, &what);
            nothing_is_missing(&single, &mut r, 30, &what);
            inner += double.nodes().filter(|n| matches!(n, NodeView::Inner { .. })).count();
        }
    }
    assert!(inner > 2000, "only {inner} planes were compared");
}

#[test]
fn builders_give_one_tree_of_an_icosphere() {
    let tree = one_tree::<f64>(&icosphere(4), Sah::default(), "icosphere");
    nothing_is_missing(&tree, &mut Random::new(1), 300, "icosphere");
    // A tenth of the 350 MB of the thesis at 140,296 faces.
    let bytes = tree.bytes() as f64 / tree.triangles().len() as f64;
    assert!(bytes < 249.0, "{bytes} bytes a triangle");
}

/// The same over meshes of one's own: OBJ files named by `SUNFLECK_MESHES`, with spaces between. All their faces by the two fast
/// builders, every so manieth face by all: the O(N²) one has its limits.
#[test]
#[ignore = "needs meshes, and a minute"]
fn builders_give_one_tree_of_meshes_at_hand() {
    const MOST: usize = 20_000;
    let paths = std::env::var("SUNFLECK_MESHES").expect("SUNFLECK_MESHES names OBJ files");
    for path in paths.split_whitespace() {
        let (vertices, faces) = obj(&std::fs::read_to_string(path).unwrap());
        let some = faces.iter().copied().step_by(faces.len().div_ceil(MOST)).collect();
        let tree = one_tree::<f64>(&(vertices.clone(), some), Sah::default(), path);
        println!("{path}: all builders, {} faces, {} nodes", tree.triangles().len(), tree.nodes().count());
        let soup = (vertices, faces);
        for parallel in [false, true] {
            let options = |builder| KdOptions { builder, parallel, ..KdOptions::default() };
            let [once, each] =
                [REAL[2], REAL[1]].map(|builder| KdTree::new(mesh::<f64>(&soup), &options(builder)).unwrap());
            assert!(once.nodes().eq(each.nodes()), "{path}");
            nothing_is_missing(&once, &mut Random::new(8), 200, path);
            println!("{path}: the two fast ones, {} faces, {} nodes", soup.1.len(), once.nodes().count());
        }
    }
}

fn obj(text: &str) -> Soup {
    let mut soup: Soup = (Vec::new(), Vec::new());
    for line in text.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => soup.0.push([(); 3].map(|()| words.next().unwrap().parse().unwrap())),
            Some("f") => soup.1.push([(); 3].map(|()| {
                let index: u32 = words.next().unwrap().split('/').next().unwrap().parse().unwrap();
                index - 1
            })),
            _ => {}
        }
    }
    soup
}

/// The root's plane against a search written from the definition, on whole triangles.
#[test]
fn the_root_is_split_where_it_is_cheapest() {
    let sah = Sah { traversal: 0.7, intersection: 1.3, ..Sah::default() };
    let mut split = 0;
    for seed in 0..60 {
        // On a grid of powers of two nothing is rounded.
        let mut r = Random::new(seed);
        let corners: Vec<[f64; 3]> = (0..20)
            .flat_map(|_| {
                let at: [usize; 3] = std::array::from_fn(|_| r.below(13));
                [(); 3].map(|()| at.map(|x| (x + r.below(4)) as f64))
            })
            .collect();
        let faces = (0..20).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect::<Vec<_>>();
        let soup: Soup = (corners, faces);
        let triangles = mesh::<f64>(&soup);
        let range = |face: u32, axis: usize| {
            let along = triangles.corners(face).map(|p| p[axis]);
            (along.iter().fold(f64::INFINITY, |a, &b| a.min(b)), along.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b)))
        };
        let whole: [(f64, f64); 3] = std::array::from_fn(|axis| {
            (0..20).map(|f| range(f, axis)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))).unwrap()
        });
        let surface = |size: [f64; 3]| 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]);
        let size = whole.map(|(min, max)| max - min);
        let mut best = (sah.intersection * 20.0, None);
        for axis in 0..3 {
            for at in (whole[axis].0 as i32 + 1..whole[axis].1 as i32).map(f64::from) {
                let count = |of: &dyn Fn((f64, f64)) -> bool| (0..20).filter(|&f| of(range(f, axis))).count() as f64;
                let (below, above) = (count(&|(min, _)| min < at), count(&|(_, max)| max > at));
                let planar = count(&|(min, max)| min == at && max == at);
                let (mut size_below, mut size_above) = (size, size);
                size_below[axis] = at - whole[axis].0;
                size_above[axis] = whole[axis].1 - at;
                let (p, q) = (surface(size_below) / surface(size), surface(size_above) / surface(size));
                let bonus = if below == 0.0 || above == 0.0 { 0.8 } else { 1.0 };
                for (b, a) in [(below + planar, above), (below, above + planar)] {
                    let cost = bonus * (sah.traversal + sah.intersection * (p * b + q * a));
                    if cost < best.0 - 1e-9 {
                        best = (cost, Some((axis, at)));
                    }
                }
            }
        }
        let tree = KdTree::new(triangles, &KdOptions { sah, ..KdOptions::default() }).unwrap();
        match (tree.nodes().next().unwrap(), best.1) {
            (NodeView::Inner { axis, at }, Some(expected)) => {
                assert_eq!((axis, at), expected, "seed {seed}");
                split += 1;
            }
            (NodeView::Leaf(_), None) => {}
            other => panic!("seed {seed}: {other:?}"),
        }
    }
    assert!(split > 40, "only {split} were split");
}

#[test]
fn triangles_in_a_plane_go_to_the_side_where_they_cost_less() {
    // A wall of many triangles between two sparse halves, of which one is smaller: whichever axis, whichever way.
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let mut soup: Soup = (Vec::new(), Vec::new());
            let mut r = Random::new(3);
            for i in 0..40 {
                let (at, bend) = if i < 36 { (0.3, 0.0) } else { ([-1.0, -0.9, 1.0, 0.95][i - 36], 0.01) };
                let n = soup.0.len() as u32;
                for k in 0..3 {
                    let mut p = [r.signed(), r.signed(), r.signed()];
                    p[axis] = side * (at + bend * f64::from(k));
                    soup.0.push(p);
                }
                soup.1.push([n, n + 1, n + 2]);
            }
            let tree = one_tree::<f64>(&soup, Sah { max_depth: 1, ..Sah::default() }, "wall");
            let nodes: Vec<_> = tree.nodes().collect();
            let [NodeView::Inner { axis: split, at }, NodeView::Leaf(below), NodeView::Leaf(above)] = nodes[..] else {
                panic!("{nodes:?}");
            };
            assert!(split == axis && (at - side * 0.3).abs() < 1e-7, "axis {axis}, side {side}: {split}, {at}");
            assert_eq!((below.len(), above.len()), if side > 0.0 { (2, 38) } else { (38, 2) });
        }
    }
}

#[test]
fn a_power_of_two_is_the_same_tree_in_another_unit() {
    let (soup, _) = random(0, 5, 200);
    let tree = KdTree::new(mesh::<f64>(&soup), &KdOptions::default()).unwrap();
    for exponent in [-40, 3, 60] {
        let unit = 2.0f64.powi(exponent);
        let scaled = (soup.0.iter().map(|p| p.map(|x| x * unit)).collect(), soup.1.clone());
        let other = KdTree::new(mesh::<f64>(&scaled), &KdOptions::default()).unwrap();
        for (a, b) in tree.nodes().zip(other.nodes()) {
            match (a, b) {
                (NodeView::Inner { axis: a, at: x }, NodeView::Inner { axis: b, at: y }) => {
                    assert_eq!((a, x * unit), (b, y))
                }
                (a, b) => assert_eq!(a, b),
            }
        }
        let ray =
            |scale: f64| Ray::new([0.1, 0.2, -3.0].map(|x| x * scale), [0.01, 0.02, 1.0].map(|x| x * scale)).unwrap();
        let (mut here, mut there) = (Vec::new(), Vec::new());
        tree.all(&ray(1.0), &mut here);
        other.all(&ray(unit), &mut there);
        assert!(!here.is_empty());
        assert_eq!(here, there);
    }
}

#[test]
fn a_lazy_tree_grows_where_rays_go_and_only_once() {
    let soup = icosphere(4);
    let options = KdOptions::default();
    let eager = KdTree::new(mesh::<f64>(&soup), &options).unwrap();
    let lazy = LazyKd::new(mesh::<f64>(&soup), &options).unwrap();
    assert_eq!(lazy.n_opened(), 0);
    let ray = |r: &mut Random| Ray::new(r.vector().map(|x| 3.0 * x), r.vector()).unwrap();
    lazy.nearest(&Ray::new([0.1, 0.2, 3.0], [0.0, 0.0, -1.0]).unwrap()).unwrap();
    let first = lazy.n_opened();
    assert!(first > 5 && first < eager.nodes().count() / 10, "{first}");
    // The same rays from all threads at once, so that they meet at the nodes.
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                let mut r = Random::new(9);
                for _ in 0..2000 {
                    let ray = ray(&mut r);
                    assert_eq!(lazy.nearest(&ray), eager.nearest(&ray));
                    assert_eq!(lazy.count(&ray), eager.count(&ray));
                }
            });
        }
    });
    let grown = lazy.n_opened();
    assert!(grown > first && grown <= eager.nodes().count());
    lazy.grow().unwrap();
    assert_eq!(lazy.n_opened(), eager.nodes().count());
    assert!(lazy.finish().unwrap().nodes().eq(eager.nodes()));
}

#[test]
fn any_number_of_threads_builds_the_same_tree() {
    // Large enough for several parallel levels.
    let soup = icosphere(5);
    let alone = KdTree::new(mesh::<f32>(&soup), &KdOptions::default()).unwrap();
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = KdOptions { parallel: true, ..KdOptions::default() };
        let tree = pool.install(|| KdTree::new(mesh::<f32>(&soup), &options)).unwrap();
        assert!(tree.nodes().eq(alone.nodes()), "{threads} threads");
        assert_eq!(tree.bytes(), alone.bytes());
    }
}

/// A cell knows only its part of a triangle: where a diagonal one leaves it, space is cut off.
#[test]
fn a_triangle_that_is_cut_is_clipped() {
    let p =
        vec![[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0, 1.0, 0.01], [0.5, 0.1, 0.0], [0.5, 0.2, 0.0], [0.5, 0.1, 0.01]];
    let sah = Sah { traversal: 0.01, ..Sah::default() };
    for builder in REAL {
        let options = KdOptions { builder, sah, ..KdOptions::default() };
        let tree =
            KdTree::new(Triangles::<f64>::new(p.clone(), vec![[0, 1, 2], [3, 4, 5]]).unwrap(), &options).unwrap();
        let is_new = |node: NodeView| match node {
            NodeView::Inner { axis, at } => p.iter().all(|q| (q[axis] - at).abs() > 1e-6),
            NodeView::Leaf(_) => false,
        };
        // At no corner's coordinate: where the diagonal leaves a cell.
        assert!(tree.nodes().any(is_new), "{builder:?}");
    }
}

#[test]
fn what_is_wrong_is_an_error() {
    let p = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0f32]];
    let mut bad = p.to_vec();
    bad[1][2] = f32::NAN;
    assert_eq!(Triangles::new(bad.clone(), vec![]).unwrap_err(), Error::Vertex(1));
    bad[1][2] = 1e20;
    assert_eq!(Triangles::new(bad, vec![]).unwrap_err(), Error::Vertex(1));
    let index = Error::Index { face: 1, corner: 3, vertices: 3 };
    assert_eq!(Triangles::new(p.to_vec(), vec![[0, 1, 2], [0, 3, 1]]).unwrap_err(), index);
    let tiny = p.map(|p| p.map(|x| x * 1e-30)).to_vec();
    assert!(matches!(Triangles::new(tiny, vec![[0, 1, 2]]).unwrap_err(), Error::TooSmall(_)));
    for sah in [
        Sah { traversal: f64::NAN, ..Sah::default() },
        Sah { intersection: -1.0, ..Sah::default() },
        Sah { max_depth: 65, ..Sah::default() },
    ] {
        let triangles = || Triangles::new(p.to_vec(), vec![[0, 1, 2]]).unwrap();
        let options = KdOptions { sah, ..KdOptions::default() };
        assert!(matches!(KdTree::new(triangles(), &options).unwrap_err(), Error::Sah(_)));
        assert!(matches!(LazyKd::new(triangles(), &options).unwrap_err(), Error::Sah(_)));
    }
    assert_eq!(Ray::new([f32::NAN, 0.0, 0.0], [1.0; 3]).unwrap_err(), Error::Origin);
    for direction in [[0.0; 3], [f32::INFINITY, 0.0, 0.0], [f32::NAN, 1.0, 0.0], [1e-30; 3]] {
        assert_eq!(Ray::new([0.0f32; 3], direction).unwrap_err(), Error::Direction);
    }
}

#[test]
fn no_triangles_are_a_tree_too() {
    let ray = Ray::new([0.0; 3], [1.0, 0.0, 0.0f64]).unwrap();
    for builder in [Builder::None, Builder::Quadratic, Builder::SortEachNode, Builder::SortOnce] {
        let none = || Triangles::<f64>::new(vec![[1.0; 3]], vec![]).unwrap();
        let options = KdOptions { builder, parallel: true, ..KdOptions::default() };
        let tree = KdTree::new(none(), &options).unwrap();
        assert_eq!(tree.nodes().collect::<Vec<_>>(), [NodeView::Leaf(&[])]);
        assert!(tree.nearest(&ray).is_none() && !tree.any(&ray) && tree.count(&ray) == 0);
        assert!(LazyKd::new(none(), &options).unwrap().nearest(&ray).is_none());
        assert!(EveryTriangle(&none()).nearest(&ray).is_none());
    }
}
