"""scipy.spatial.cKDTree: arguments and output as those of rust/src/main.rs.

It cannot fold neighbours in place. Its nearest operation is timed, query_ball_point with lists of indices, in chunks so
that they fit in memory; the kernel sum is taken from the lists of the first chunk, outside the time, and is given where
that was all.
"""

import itertools
import json
import sys
import time

import numpy
import scipy
from scipy.spatial import cKDTree

CHUNK = 16384


def peak_memory():
    """Bytes, of this process up to now."""
    with open("/proc/self/status") as status:
        return next(1024.0 * float(line.split()[1]) for line in status if line.startswith("VmHWM:"))


class Clock:
    """CPU and wall seconds between start and stop, summed."""

    def __init__(self):
        self.cpu = self.wall = 0.0

    def __enter__(self):
        self.began = time.process_time(), time.perf_counter()

    def __exit__(self, *_):
        self.cpu += time.process_time() - self.began[0]
        self.wall += time.perf_counter() - self.began[1]


def kernel(tree, points, queries, radius, clock):
    neighbours, total = 0, None
    for chunk in numpy.split(queries, range(CHUNK, len(queries), CHUNK)):
        with clock:
            lists = tree.query_ball_point(chunk, radius, workers=1, return_sorted=False)
        lengths = numpy.fromiter(map(len, lists), dtype=numpy.int64, count=len(lists))
        n = int(lengths.sum())
        neighbours += n
        if len(queries) <= CHUNK:
            indices = numpy.fromiter(itertools.chain.from_iterable(lists), dtype=numpy.int64, count=n)
            d = points[indices] - numpy.repeat(chunk, lengths, axis=0)
            total = n - float((d * d).sum(dtype=numpy.float64)) / (radius * radius)
    return neighbours, total


def nearest(tree, queries, radius, k, clock):
    with clock:
        distances, _ = tree.query(queries, k=[*range(1, k + 1)], distance_upper_bound=radius, workers=1)
    found = distances[numpy.isfinite(distances)]
    return int(found.size), float((found * found).sum())


def main(limit, points, *cases):
    limit = int(limit) or None
    points = numpy.fromfile(points, dtype=numpy.float32).reshape(-1, 3)
    jobs = []
    for case in cases:
        name, queries, radius, k = case.split(",")
        jobs.append((name, numpy.fromfile(queries, dtype=numpy.float32).reshape(-1, 3)[:limit], float(radius), int(k)))
    before = peak_memory()
    build = Clock()
    with build:
        tree = cKDTree(points)
    for name, queries, radius, k in jobs:
        warm_up = queries[: len(queries) // 16 + 256]
        if k:
            nearest(tree, warm_up, radius, k, Clock())
        else:
            kernel(tree, points, warm_up, radius, Clock())
        clock = Clock()
        if k:
            neighbours, total = nearest(tree, queries, radius, k, clock)
        else:
            neighbours, total = kernel(tree, points, queries, radius, clock)
        line = {
            "library": "scipy",
            "version": scipy.__version__,
            "case": name,
            "build_ms": 1e3 * build.cpu,
            "build_wall_ms": 1e3 * build.wall,
            "ns_per_query": 1e9 * clock.cpu / len(queries),
            "wall_ns_per_query": 1e9 * clock.wall / len(queries),
            "queries": len(queries),
            "neighbours": neighbours,
            "sum": total,
            "memory_mb": (peak_memory() - before) / 1e6,
        }
        print(json.dumps(line), flush=True)


main(*sys.argv[1:])
