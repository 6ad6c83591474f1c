"""KdTree against a test of every triangle in NumPy, and mesh_check against meshes with faults put in."""

import threading
import time

import numpy as np
import pytest
import sunfleck

TYPES = [np.float32, np.float64]


def soup(n, seed, dtype=np.float64):
    """Triangles anywhere, apart from each other."""
    rng = np.random.default_rng(seed)
    corners = rng.normal(0, 1, (n, 1, 3)) + rng.normal(0, 0.2, (n, 3, 3))
    return corners.reshape(-1, 3).astype(dtype), np.arange(3 * n).reshape(n, 3)


def sphere(levels=3):
    """An icosphere, outward."""
    p = (1 + 5**0.5) / 2
    v = [(-1, p, 0), (1, p, 0), (-1, -p, 0), (1, -p, 0), (0, -1, p), (0, 1, p)]
    v += [(0, -1, -p), (0, 1, -p), (p, 0, -1), (p, 0, 1), (-p, 0, -1), (-p, 0, 1)]
    f = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4), (11, 10, 2), (10, 7, 6)]
    f += [(7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8), (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    v, f = [np.array(x, float) for x in v], f
    for _ in range(levels):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(v)
                v.append(v[a] + v[b])
            return middles[key]

        for a, b, c in f:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        v = [x / np.linalg.norm(x) for x in v]
        f = finer
    return np.array(v), np.array(f)


def crossings(vertices, faces, origin, direction):
    """t and weights where the ray's line meets each triangle's plane, and how far inside the triangle: Möller & Trumbore."""
    a, b, c = (vertices[faces[:, i]].astype(np.float64) for i in range(3))
    origin, direction = origin.astype(np.float64), direction.astype(np.float64)
    p = np.cross(direction, c - a)
    determinant = np.einsum("ij,ij->i", b - a, p)
    s = origin - a
    u = np.einsum("ij,ij->i", s, p) / determinant
    q = np.cross(s, b - a)
    v = q @ direction / determinant
    t = np.einsum("ij,ij->i", c - a, q) / determinant
    return t, u, v, np.minimum(np.minimum(u, v), 1 - u - v)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("options", [{}, {"lazy": True}, {"builder": "none"}, {"builder": "sort-each-node", "parallel": False}])
def test_all_queries_agree_with_a_test_of_every_triangle(dtype, options):
    vertices, faces = soup(1500, 1, dtype)
    rng = np.random.default_rng(2)
    origins = rng.normal(0, 2, (300, 3)).astype(dtype)
    directions = rng.normal(0, 1, (300, 3)).astype(dtype)
    t_min, t_max = rng.uniform(0, 0.5, 300).astype(dtype), rng.uniform(0.5, 6, 300).astype(dtype)
    tree = sunfleck.KdTree(vertices, faces, **options)
    assert tree.dtype == dtype and len(tree) == 1500
    assert (tree.nbytes is None) == ("lazy" in options)
    span = {"t_min": t_min, "t_max": t_max}
    t, face, weights = tree.nearest(origins, directions, **span)
    offsets, all_t, all_faces, all_weights = tree.all(origins, directions, **span)
    assert t.dtype == all_t.dtype == weights.dtype == dtype and weights.shape == (300, 2)
    assert face.dtype == all_faces.dtype == np.uint32 and offsets.dtype == np.int64
    assert offsets.shape == (301,) and offsets[-1] == len(all_t) == len(all_faces) == len(all_weights)
    assert np.array_equal(tree.count(origins, directions, **span), np.diff(offsets))
    assert np.array_equal(tree.any(origins, directions, **span), np.diff(offsets) > 0)
    near = 1e-4 if dtype == np.float32 else 1e-9
    compared = 0
    for i in range(300):
        exact, u, v, inside = crossings(vertices, faces, origins[i], directions[i])
        doubtful = (np.abs(inside) < near) | ((inside > 0) & (np.minimum(abs(exact - t_min[i]), abs(exact - t_max[i])) < near))
        if doubtful.any():
            continue
        hit = np.flatnonzero((inside > 0) & (exact >= t_min[i]) & (exact <= t_max[i]))
        hit = hit[np.argsort(exact[hit])]
        row = slice(offsets[i], offsets[i + 1])
        if len(hit) > 1 and np.diff(exact[hit]).min() < near:
            continue
        compared += 1
        assert np.array_equal(all_faces[row], hit)
        np.testing.assert_allclose(all_t[row], exact[hit], rtol=near, atol=near)
        np.testing.assert_allclose(all_weights[row], np.stack([u[hit], v[hit]], 1), atol=100 * near)
        if len(hit):
            assert (t[i], face[i]) == (all_t[offsets[i]], hit[0])
            assert np.array_equal(weights[i], all_weights[offsets[i]])
        else:
            assert (t[i], face[i], *weights[i]) == (np.inf, 1500, 0, 0)
    assert compared > 200 and np.diff(offsets).max() > 1


def test_every_form_of_the_tree_answers_the_same_bits():
    vertices, faces = sphere()
    rng = np.random.default_rng(3)
    origins, directions = rng.normal(0, 2, (500, 3)), rng.normal(0, 1, (500, 3))
    expected = sunfleck.KdTree(vertices, faces, builder="none").all(origins, directions)
    for options in [{}, {"lazy": True}, {"builder": "quadratic"}, {"parallel": False}]:
        for a, b in zip(expected, sunfleck.KdTree(vertices, faces, **options).all(origins, directions)):
            assert np.array_equal(a, b)


def test_one_ray_may_stand_for_all():
    vertices, faces = sphere()
    tree = sunfleck.KdTree(vertices, faces)
    directions = np.random.default_rng(4).normal(0, 1, (50, 3))
    t, _, _ = tree.nearest([0, 0, 0], directions)
    assert t.shape == (50,) and np.all(abs(t * np.linalg.norm(directions, axis=1) - 1) < 0.02)
    assert tree.any([0, 0, 0], directions, t_max=np.where(np.arange(50) < 25, 1e-3, np.inf)).tolist() == [False] * 25 + [True] * 25
    assert tree.count([0.1, 0.2, 0.3], [1, 2, 3]).tolist() == [1]
    assert tree.count(np.empty((0, 3)), np.empty((0, 3))).shape == (0,)
    assert tree.any(directions, [0, 0, 1], t_min=5, t_max=4).sum() == 0


def test_arrays_of_any_layout_and_type_are_taken():
    vertices, faces = sphere(1)
    rays = np.random.default_rng(5).normal(0, 1, (40, 6))
    expected = sunfleck.KdTree(vertices, faces).nearest(rays[:, :3].copy(), rays[:, 3:].copy())
    tree = sunfleck.KdTree(np.asfortranarray(vertices), faces.astype(np.int16)[:, ::-1][:, ::-1])
    for a, b in zip(expected, tree.nearest(rays[:, :3], rays[:, 3:])):
        assert np.array_equal(a, b)
    assert sunfleck.KdTree(np.zeros((3, 3), np.int32), [[0, 1, 2]]).dtype == np.float64


def test_a_tree_of_nothing_is_hit_by_nothing():
    tree = sunfleck.KdTree([], [])
    assert len(tree) == 0 and tree.count([0, 0, 0], [0, 0, 1]).tolist() == [0]


@pytest.mark.parametrize(
    "arguments, part",
    [
        (([[0, 0, 0]], [[0, 0, 1]]), "vertex 1 of 1"),
        (([[0, 0, 0]], [[0, 0, -1]]), "not there"),
        (([[0, 0, 0]], [[0, 0, 2**33]]), "not there"),
        (([[0, 0, 0]], [[0.0, 0.0, 0.0]]), "whole numbers"),
        (([[0, 0, 0]], [[0, 0]]), "three vertices a face"),
        (([[0, 0]], [[0, 0, 0]]), "three coordinates a vertex"),
        (([[0, np.nan, 0]], [[0, 0, 0]]), "vertex 0 is not finite"),
        ((["abc"], [[0, 0, 0]]), "numbers are needed"),
    ],
)
def test_what_is_no_mesh_is_refused(arguments, part):
    for take in (sunfleck.KdTree, sunfleck.mesh_check):
        with pytest.raises(ValueError, match=part):
            take(*arguments)


def test_what_is_no_ray_is_refused():
    vertices, faces = sphere(0)
    tree = sunfleck.KdTree(vertices, faces)
    for origins, directions, part in [
        ([[0, 0, 0], [0, np.inf, 0]], [1, 0, 0], "ray 1: the origin"),
        ([0, 0, 0], [0, 0, 0], "ray 0: the direction"),
        (np.zeros((3, 3)), np.ones((2, 3)), "3, 2 rays"),
        (np.zeros((3, 2)), np.ones((3, 3)), "three coordinates a ray"),
    ]:
        with pytest.raises(ValueError, match=part):
            tree.nearest(origins, directions)
    with pytest.raises(ValueError, match="ranges"):
        tree.nearest([0, 0, 0], [1, 0, 0], t_max=[[1]])
    with pytest.raises(ValueError, match="builder"):
        sunfleck.KdTree(vertices, faces, builder="fast")


def test_other_threads_run_during_a_search():
    vertices, faces = soup(20_000, 6)
    tree = sunfleck.KdTree(vertices, faces)
    rng = np.random.default_rng(7)
    origins, directions = rng.normal(0, 1, (200_000, 3)), rng.normal(0, 1, (200_000, 3))
    began, done = threading.Event(), []

    def search():
        began.set()
        tree.count(origins, directions)
        done.append(time.perf_counter())

    thread = threading.Thread(target=search)
    thread.start()
    began.wait()
    ticks = []
    while thread.is_alive():
        ticks.append(time.perf_counter())
        time.sleep(0.001)
    thread.join()
    # Were the lock held, there would be hardly a tick before the end.
    assert sum(tick < done[0] for tick in ticks) > 5


@pytest.mark.parametrize("scale, offset", [(1, 0), (1e-7, 0), (1e7, 3e6)])
def test_flipped_faces_are_the_ones_reported(scale, offset):
    vertices, faces = sphere()
    vertices = vertices * scale + offset
    clean = sunfleck.mesh_check(vertices, faces)
    assert clean.clean and clean.closed and clean.manifold and (clean.verdict, clean.doubt) == ("outward", None)
    assert (clean.vertices, clean.faces) == (len(vertices), len(faces)) and clean.inward.size == 0
    assert clean.shells == [sunfleck.Shell(0, len(faces), "outward", 0)]
    flipped = np.sort(np.random.default_rng(8).choice(len(faces), 100, replace=False))
    faces[flipped] = faces[flipped][:, [0, 2, 1]]
    for options in [{}, {"lazy": True}, {"parallel": False}, {"intersections": False}]:
        report = sunfleck.mesh_check(vertices, faces, **options)
        assert report.verdict == "mixed" and not report.clean
        assert report.inward.dtype == np.uint32 and np.array_equal(report.inward, flipped)
        assert len(report.clashing_edges) > 0 and report.clashing_edges.shape[1] == 2
    faces[report.inward] = faces[report.inward][:, [0, 2, 1]]
    assert sunfleck.mesh_check(vertices, faces).clean
    assert sunfleck.mesh_check(vertices, faces[:, ::-1]).verdict == "inward"


def test_faults_are_named():
    vertices, faces = sphere(1)
    report = sunfleck.mesh_check(vertices, faces[1:])
    assert not report.closed and (report.verdict, report.doubt) == ("unknown", "open")
    a, b, c = faces[0]
    edges = sorted(sorted(edge) for edge in ([a, b], [b, c], [c, a]))
    assert report.open_edges.tolist() == [[int(i) for i in edge] for edge in edges]

    report = sunfleck.mesh_check(vertices, np.concatenate([faces, faces[:1], [[0, 0, 1]]]))
    assert report.duplicates.tolist() == [[len(faces), 0]] and report.degenerate.tolist() == [len(faces) + 1]

    moved = np.concatenate([vertices, vertices + [0.5, 0.1, 0.2], [[9, 9, 9]]])
    two = np.concatenate([faces, faces + len(vertices)])
    report = sunfleck.mesh_check(moved, two)
    assert report.doubt == "intersecting" and len(report.intersections) > 5 and report.unused_vertices == 1
    assert sunfleck.mesh_check(moved, two, intersections=False).intersections.shape == (0, 2)

    assert sunfleck.mesh_check([], []).doubt == "empty"
