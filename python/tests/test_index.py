"""Against scipy.spatial.cKDTree, and at the edges."""

import sys
import threading
import time

import numpy as np
import pytest
import sunfleck
from scipy.spatial import cKDTree

CLOUDS = ["uniform", "clustered", "plane", "line", "coincident"]


def cloud(name, n, seed):
    """Single-precision points in the unit cube."""
    rng = np.random.default_rng(seed)
    points = rng.random((n, 3))
    if name == "clustered":
        points = np.clip(0.5 + 0.3 * np.sign(points - 0.5) + rng.normal(0, 0.03, (n, 3)), 0, 1)
    elif name == "plane":
        points[:, 2] = 0.25
    elif name == "line":
        points[:, 1:] = 0.5
    elif name == "coincident":
        points = np.round(points * 4) / 4
    return points.astype(np.float32)


def apart(points, query, r):
    """Whether no point is so near the edge of the ball that single and double precision may differ."""
    d = np.linalg.norm(points.astype(np.float64) - query, axis=1)
    return np.abs(d - r).min(initial=np.inf) > 1e-6


@pytest.mark.parametrize("name", CLOUDS)
def test_radius_search_finds_what_scipy_finds(name):
    points, queries = cloud(name, 3000, 1), cloud("uniform", 400, 2)
    rng = np.random.default_rng(3)
    index, tree = sunfleck.Index(points), cKDTree(points)
    compared = 0
    for r in [0.013, 0.11, rng.uniform(0.0, 0.2, 400)]:
        offsets, indices, distances = index.query_radius(queries, r, return_distance=True)
        counts = index.count(queries, r)
        assert offsets.shape == (401,) and offsets[0] == 0 and offsets[-1] == len(indices) == len(distances)
        assert np.array_equal(counts, np.diff(offsets))
        radii = np.broadcast_to(np.asarray(r, dtype=np.float32), 400)
        for i, q in enumerate(queries):
            if not apart(points, q, radii[i]):
                continue
            row = slice(offsets[i], offsets[i + 1])
            assert sorted(indices[row]) == sorted(tree.query_ball_point(q, radii[i]))
            there = np.linalg.norm(points[indices[row]].astype(np.float64) - q, axis=1)
            np.testing.assert_allclose(distances[row], there, rtol=1e-5, atol=1e-6)
            compared += 1
    assert compared > 1000


@pytest.mark.parametrize("name", CLOUDS)
@pytest.mark.parametrize("k", [1, 2, 8, 64])
def test_nearest_are_as_far_as_scipys(name, k):
    points, queries = cloud(name, 3000, 4), cloud("uniform", 300, 5)
    distances, indices = sunfleck.Index(points).query(queries, k)
    theirs, _ = cKDTree(points).query(queries, k)
    assert distances.shape == indices.shape == theirs.shape
    np.testing.assert_allclose(distances, theirs, rtol=1e-5, atol=1e-6)
    there = np.linalg.norm(points[indices].astype(np.float64) - (queries if k == 1 else queries[:, None]), axis=-1)
    np.testing.assert_allclose(distances, there, rtol=1e-5, atol=1e-6)
    if k > 1:
        assert all(len(set(row)) == k for row in indices)


def test_bound_truncates_as_in_scipy():
    points, queries = cloud("uniform", 2000, 6), cloud("uniform", 500, 7)
    index, tree = sunfleck.Index(points), cKDTree(points)
    distances, indices = index.query(queries, k=5, distance_upper_bound=0.07)
    theirs, their_indices = tree.query(queries, k=5, distance_upper_bound=0.07)
    np.testing.assert_allclose(distances, theirs, rtol=1e-5, atol=1e-6)
    assert np.array_equal(indices == 2000, their_indices == 2000)
    assert (indices == 2000).any() and (indices < 2000).any()
    bounds = np.where(np.arange(500) % 2, np.float32(0.07), np.float32(0))
    each, _ = index.query(queries, k=5, distance_upper_bound=bounds)
    assert np.array_equal(each[1::2], distances[1::2])
    assert np.isinf(each[::2]).all()


def test_more_neighbours_than_points():
    points = cloud("uniform", 3, 8)
    distances, indices = sunfleck.Index(points).query(points, k=5)
    theirs, their_indices = cKDTree(points).query(points, k=5)
    np.testing.assert_allclose(distances, theirs, atol=1e-6)
    assert np.array_equal(indices, their_indices)
    assert (indices[:, 3:] == 3).all() and np.isinf(distances[:, 3:]).all()


def test_ties_come_in_order_of_the_index():
    index = sunfleck.Index(np.zeros((10, 3)))
    _, indices = index.query([0, 0, 0], k=4)
    assert indices.tolist() == [0, 1, 2, 3]


def test_single_query():
    points = np.array([[0, 0, 0], [1, 0, 0], [3, 0, 0]], dtype=np.float32)
    index = sunfleck.Index(points)
    assert index.query([0.9, 0, 0]) == (pytest.approx(0.1, abs=1e-6), 1)
    distances, indices = index.query([0.9, 0, 0], k=2)
    assert indices.tolist() == [1, 0] and distances.shape == (2,)
    assert sorted(index.query_radius([0, 0, 0], 1)) == [0, 1]
    indices, distances = index.query_radius([3, 0, 0], 2, return_distance=True)
    assert dict(zip(indices.tolist(), distances.tolist())) == {1: 2.0, 2: 0.0}
    assert index.count([0, 0, 0], 3) == 3


def test_a_point_at_exactly_the_radius_counts():
    index = sunfleck.Index([[3, 4, 0]])
    assert index.count([0, 0, 0], 5) == 1
    assert index.count([0, 0, 0], np.nextafter(np.float32(5), np.float32(0))) == 0
    assert index.query([0, 0, 0], distance_upper_bound=5) == (5.0, 0)


@pytest.mark.parametrize("points", [[], np.zeros((0, 3)), np.zeros((0, 3), dtype=np.float32)])
def test_no_points(points):
    index = sunfleck.Index(points)
    assert len(index) == index.n == 0
    assert index.count([[0, 0, 0]], 1).tolist() == [0]
    offsets, indices = index.query_radius([[0, 0, 0]], 1)
    assert offsets.tolist() == [0, 0] and len(indices) == 0
    distances, indices = index.query([[0, 0, 0]], k=2)
    assert np.isinf(distances).all() and indices.tolist() == [[0, 0]]


def test_no_queries():
    index = sunfleck.Index(cloud("uniform", 10, 9))
    offsets, indices = index.query_radius(np.zeros((0, 3)), 1)
    assert offsets.tolist() == [0] and len(indices) == 0
    distances, indices = index.query(np.zeros((0, 3)), k=4)
    assert distances.shape == indices.shape == (0, 4)
    assert index.count(np.zeros((0, 3)), np.zeros(0)).shape == (0,)


def test_one_point():
    index = sunfleck.Index([[1, 2, 3]])
    assert len(index) == 1
    assert index.query([1, 2, 5]) == (2.0, 0)


def test_default_radius():
    index = sunfleck.Index([[0, 0, 0], [0.5, 0, 0]], radius=0.6)
    assert index.radius == pytest.approx(0.6)
    assert index.count([0, 0, 0]) == 2
    assert index.count([0, 0, 0], 0.4) == 1
    with pytest.raises(ValueError, match="no radius"):
        sunfleck.Index([[0, 0, 0]]).count([0, 0, 0])


@pytest.mark.parametrize("layout", ["float64", "fortran", "strided", "integer", "read-only", "unaligned"])
def test_layouts(layout):
    points = (cloud("uniform", 500, 10) * 16).astype(np.float32)
    expected = sunfleck.Index(points).count(points, 3)
    if layout == "float64":
        points = points.astype(np.float64)
    elif layout == "fortran":
        points = np.asfortranarray(points)
    elif layout == "strided":
        points = np.repeat(points, 2, axis=0)[::2]
    elif layout == "integer":
        points = np.round(points).astype(np.int64)
        expected = sunfleck.Index(points.astype(np.float32)).count(points.astype(np.float32), 3)
    elif layout == "read-only":
        points.flags.writeable = False
    else:
        raw = np.zeros(points.nbytes + 1, dtype=np.uint8)
        raw[1:] = points.view(np.uint8).reshape(-1)
        points = raw[1:].view(np.float32).reshape(-1, 3)
        assert not points.flags.aligned
    assert np.array_equal(sunfleck.Index(points).count(points, 3), expected)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e60])
def test_what_is_not_finite_is_refused(bad):
    with pytest.raises(ValueError, match="point 1 is not finite"):
        sunfleck.Index([[0, 0, 0], [0, bad, 0]])
    index = sunfleck.Index([[0, 0, 0]])
    for search in [index.count, index.query_radius, lambda q, r: index.query(q, 1, r)]:
        with pytest.raises(ValueError, match="query 2 is not finite"):
            search([[0, 0, 0], [0, 0, 0], [bad, 0, 0]], 1)


@pytest.mark.parametrize("shape", [(3,), (4,), (5, 2), (2, 4), (2, 3, 3), ()])
def test_wrong_shapes_are_refused(shape):
    with pytest.raises(ValueError, match="three coordinates"):
        sunfleck.Index(np.zeros(shape))
    if shape != (3,):
        with pytest.raises(ValueError, match="three coordinates"):
            sunfleck.Index([[0, 0, 0]]).count(np.zeros(shape), 1)


def test_wrong_radii_and_k_are_refused():
    index = sunfleck.Index([[0, 0, 0]])
    queries = np.zeros((2, 3))
    for bad in [-1, np.nan, [0, -1], [np.nan, 0]]:
        with pytest.raises(ValueError, match="not zero or more"):
            index.query_radius(queries, bad)
    for bad in [[1], [1, 1, 1]]:
        with pytest.raises(ValueError, match="for 2 queries"):
            index.count(queries, bad)
    with pytest.raises(ValueError, match="shape"):
        index.count(queries, [[1, 1]])
    for k in [0, -1, sunfleck.MAX_K + 1]:
        with pytest.raises(ValueError, match=f"k is {k}: 1 to 64"):
            index.query(queries, k)
    with pytest.raises(ValueError, match="numbers"):
        sunfleck.Index([["a", "b", "c"]])


def test_single_precision_arrays_are_not_copied():
    points = cloud("uniform", 10, 11)
    assert sunfleck._rows(points) is points
    assert not np.shares_memory(sunfleck._rows(points.astype(np.float64)), points)


def test_other_threads_run_during_a_search():
    points = cloud("uniform", 50_000, 12)
    index = sunfleck.Index(points)
    ticks, over = [0], threading.Event()

    def tick():
        while not over.is_set():
            ticks[0] += 1
            time.sleep(0)

    def ticks_during(work):
        before = ticks[0]
        work()
        return ticks[0] - before

    interval = sys.getswitchinterval()
    thread = threading.Thread(target=tick)
    thread.start()
    # No thread is made to give up the lock: this one keeps it unless the work itself lets go.
    sys.setswitchinterval(1000)
    try:
        assert ticks_during(lambda: sum(range(1_000_000))) == 0
        assert any(ticks_during(lambda: index.count(points, 0.05)) > 0 for _ in range(20))
    finally:
        sys.setswitchinterval(interval)
        over.set()
        thread.join()
