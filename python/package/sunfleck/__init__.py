"""Neighbour search over points in three dimensions, rays against triangle meshes, and a check of such meshes.

`Index` searches points, much as `scipy.spatial.cKDTree` does. Its coordinates and distances are in single precision: arrays of
other types are converted, C-contiguous `float32` arrays are read where they lie. A point is within a radius when its distance
is the radius or less.

`KdTree` finds what rays hit, in single or double precision; `mesh_check` says whether a mesh is closed and manifold, and which
of its faces point inward.

All run on all processors (`RAYON_NUM_THREADS` says how many) and let other Python threads run; do not change an array while it
is being searched.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import numbers, triples
from ._mesh import MeshReport, Shell, mesh_check
from ._rays import KdTree
from ._sunfleck import MAX_K, Tree

__all__ = ["MAX_K", "Index", "KdTree", "MeshReport", "Shell", "mesh_check"]


class Index:
    """An index over points, `[n, 3]`; it copies them. `radius` is what a search takes that names none.

    Everything that cannot be searched raises ValueError: a wrong shape, NaN or infinite coordinates, a radius that is NaN
    or negative.
    """

    def __init__(self, points: ArrayLike, radius: float | None = None) -> None:
        self._tree = Tree(_rows(points))
        self.radius = None if radius is None else float(radius)
        if self.radius is not None and not self.radius >= 0:
            raise ValueError(f"radius is {radius}: it is zero or more")

    def __len__(self) -> int:
        return len(self._tree)

    @property
    def n(self) -> int:
        """Number of points."""
        return len(self._tree)

    def count(self, q: ArrayLike, r: ArrayLike | None = None) -> Any:
        """How many points lie within `r` of each query.

        `q` is `[m, 3]`, `r` one radius or one for each, `[m]`. Returns `uint32` `[m]`; of a single query, `[3]`, an int.
        """
        rows, single = _queries(q)
        counts = self._tree.count(rows, *self._radius(r))
        return int(counts[0]) if single else counts

    def query_radius(self, q: ArrayLike, r: ArrayLike | None = None, return_distance: bool = False) -> Any:
        """The points within `r` of each query, in compressed rows: `(offsets, indices)` or `(offsets, indices, distances)`.

        Those of query i are `indices[offsets[i]:offsets[i + 1]]`, in no particular order. `q` is `[m, 3]`, `r` one radius or
        one for each, `[m]`; offsets are `int64` `[m + 1]`, indices `uint32`, distances `float32`. Of a single query,
        `[3]`, there are no offsets: `indices` or `(indices, distances)`.
        """
        rows, single = _queries(q)
        offsets, indices, distances = self._tree.within(rows, *self._radius(r))
        # What lies in memory is below 2^63: the same bits.
        found: list[NDArray[Any]] = [indices] if single else [offsets.view(np.int64), indices]
        if return_distance:
            found.append(distances)
        return found[0] if len(found) == 1 else tuple(found)

    def query(self, q: ArrayLike, k: int = 1, distance_upper_bound: ArrayLike = math.inf) -> Any:
        """The `k` nearest points of each query: `(distances, indices)`, nearest first, of equal ones the lower index first.

        `q` is `[m, 3]`; the arrays are `[m, k]`, `float32` and `uint32`. As in SciPy the axis of `k` is left out for
        k = 1, that of the queries for a single one, `[3]`, and where fewer than `k` are within the bound the distance is
        infinite and the index `n`. Unlike there, a point at exactly the bound counts, there may be a bound for each
        query, `[m]`, and `k` is at most `MAX_K`.
        """
        rows, single = _queries(q)
        distances, indices = self._tree.nearest(rows, *_radii(distance_upper_bound), k)
        if k == 1:
            return (distances[0], int(indices[0])) if single else (distances, indices)
        shape = (k,) if single else (len(rows), k)
        return distances.reshape(shape), indices.reshape(shape)

    def _radius(self, r: ArrayLike | None) -> tuple[NDArray[np.float32], bool]:
        if r is None:
            r = self.radius
        if r is None:
            raise ValueError("no radius: give one here or to Index")
        return _radii(r)


def _rows(points: ArrayLike) -> NDArray[np.float32]:
    """`[n, 3]`, contiguous, in single precision: the same array if it is so already."""
    return triples(numbers(points, np.float32), "coordinates a point")


def _queries(q: ArrayLike) -> tuple[NDArray[np.float32], bool]:
    """As `[m, 3]`, and whether it was a single one."""
    array = numbers(q, np.float32)
    single = array.shape == (3,)
    return _rows(array.reshape(1, 3) if single else array), single


def _radii(r: ArrayLike) -> tuple[NDArray[np.float32], bool]:
    """As an array, and whether there is one for each query."""
    array = numbers(r, np.float32)
    if array.ndim > 1:
        raise ValueError(f"radii of shape {array.shape}: one is needed, or one for each query")
    return array.reshape(-1), array.ndim == 1
