"""Rays against triangles."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import faces as _faces
from ._arrays import numbers, triples
from ._sunfleck import KdTree32, KdTree64


class KdTree:
    """A kd-tree over triangles; it copies them.

    `vertices` is `[n, 3]`, `faces` `[m, 3]`, three indices of vertices each. A `float32` array of vertices makes a tree in single
    precision, any other one in double precision; rays and results are of that type, `dtype`.

    `builder` is "sort-once" (O(N log N)), "sort-each-node" (O(N log² N)), "quadratic" (O(N²)), which all make the same tree, or
    "none" for a test of every triangle. `lazy`: nodes are built when the first ray comes there. `parallel`: built on all
    processors, unless lazily.

    A ray is the points origin + t · direction with `t_min` ≤ t ≤ `t_max`, 0 and infinity unless given; directions need not be
    of length 1. Origins and directions are `[k, 3]`, the range of t two numbers or arrays `[k]`; one of the four may also stand
    for all rays. A ray through an edge or a corner hits all triangles that share it; a triangle that a ray lies in the plane of
    is not hit. All forms of the tree find the same hits.

    What is no mesh or no ray raises ValueError: a wrong shape, an index out of range, NaN, infinite numbers, a direction
    without length.
    """

    def __init__(
        self,
        vertices: ArrayLike,
        faces: ArrayLike,
        *,
        builder: str = "sort-once",
        lazy: bool = False,
        parallel: bool = True,
    ) -> None:
        vertices = np.asarray(vertices)
        single = vertices.dtype == np.float32
        self.dtype: np.dtype[Any] = np.dtype(np.float32 if single else np.float64)
        rows = triples(numbers(vertices, self.dtype), "coordinates a vertex")
        build = KdTree32 if single else KdTree64
        self._tree: KdTree32 | KdTree64 = build(rows, _faces(faces), builder, lazy, parallel)

    def __len__(self) -> int:
        return len(self._tree)

    @property
    def nbytes(self) -> int | None:
        """Memory of the tree without the mesh, bytes; None of a lazy one."""
        return self._tree.nbytes

    def nearest(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = math.inf
    ) -> tuple[NDArray[Any], NDArray[np.uint32], NDArray[Any]]:
        """The first hit of each ray: `(t, faces, weights)`, `[k]`, `[k]` and `[k, 2]`.

        Weights are the barycentric ones of the second and third corner; that of the first is what they lack of 1. Of hits at
        the same t it is the one of the lowest face. Where nothing is hit, t is infinite, the face `len(tree)`, weights 0.
        """
        t, faces, weights = self._tree.nearest(self._rays(origins, directions, t_min, t_max))
        return t, faces, weights.reshape(-1, 2)

    def any(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = math.inf
    ) -> NDArray[np.bool_]:
        """Whether each ray hits anything, `[k]`."""
        return self._tree.any(self._rays(origins, directions, t_min, t_max))

    def count(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = math.inf
    ) -> NDArray[np.uint32]:
        """How many triangles each ray hits, `[k]`."""
        return self._tree.count(self._rays(origins, directions, t_min, t_max))

    def all(
        self, origins: ArrayLike, directions: ArrayLike, *, t_min: ArrayLike = 0.0, t_max: ArrayLike = math.inf
    ) -> tuple[NDArray[np.int64], NDArray[Any], NDArray[np.uint32], NDArray[Any]]:
        """All hits, in compressed rows: `(offsets, t, faces, weights)`.

        Those of ray i are `t[offsets[i]:offsets[i + 1]]` and so on, in order of t, and at the same t of the face.
        """
        offsets, t, faces, weights = self._tree.all(self._rays(origins, directions, t_min, t_max))
        # What lies in memory is below 2^63: the same bits.
        return offsets.view(np.int64), t, faces, weights.reshape(-1, 2)

    def _rays(
        self, origins: ArrayLike, directions: ArrayLike, t_min: ArrayLike, t_max: ArrayLike
    ) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any], NDArray[Any]]:
        ends = [numbers(values, self.dtype) for values in (origins, directions)]
        limits = [numbers(values, self.dtype) for values in (t_min, t_max)]
        rows = [triples(end.reshape(1, 3) if end.shape == (3,) else end, "coordinates a ray") for end in ends]
        if any(limit.ndim > 1 for limit in limits):
            raise ValueError("ranges of t are two numbers, or two for each ray")
        lengths = [len(row) for row in rows] + [len(limit) for limit in limits if limit.ndim]
        n = next((length for length in lengths if length != 1), 1)
        if any(length not in (1, n) for length in lengths):
            raise ValueError(f"origins, directions and ranges are of {', '.join(map(str, lengths))} rays: not as many")
        spread = [np.broadcast_to(row, (n, 3)) for row in rows] + [np.broadcast_to(limit, (n,)) for limit in limits]
        origin, direction, least, most = (np.require(array, requirements=["C", "A"]) for array in spread)
        return origin, direction, least, most
