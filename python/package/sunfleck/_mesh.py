"""The check of a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _sunfleck
from ._arrays import faces as _faces
from ._arrays import numbers, triples


@dataclass(frozen=True)
class Shell:
    """Faces joined across edges that exactly two share."""

    first_face: int
    faces: int
    """Number of faces."""
    facing: Literal["outward", "inward", "undecided"] | None
    """Which way most point; None if there is no telling, or that was not asked."""
    minority: int
    """Faces that point the other way than most; of the first half if as many do."""


@dataclass(frozen=True, eq=False)
class MeshReport:
    """What is known of a mesh. Lists are of `uint32`, in rising order; an edge is its two vertices, the lower first.

    Vertices in exactly the same place are taken for one, and named by the first of them.
    """

    vertices: int
    faces: int
    merged_vertices: int
    """Vertices in the place of one before them."""
    unused_vertices: int
    closed: bool
    """Whether the surface parts inside from outside."""
    manifold: bool
    """Whether the surface looks like a plane everywhere, or like the edge of one."""
    clean: bool
    """Closed, manifold, all faces outward, none degenerate, a duplicate, or intersecting or touching another."""
    verdict: Literal["outward", "inward", "mixed", "unknown"]
    """Which way the normals point."""
    doubt: Literal["empty", "open", "intersecting", "one-sided", "undecided", "disputed"] | None
    """Why the verdict is unknown."""
    inward: NDArray[np.uint32]
    """Faces whose normals point inward; empty if there is no telling."""
    degenerate: NDArray[np.uint32]
    """Faces without area."""
    duplicates: NDArray[np.uint32]
    """`[n, 2]`: a face, and the earlier one with the same three vertices."""
    open_edges: NDArray[np.uint32]
    """`[n, 2]`: edges with one face, or another odd number."""
    crowded_edges: NDArray[np.uint32]
    """`[n, 2]`: edges with more than two faces."""
    pinched_vertices: NDArray[np.uint32]
    """Vertices around which faces do not form a single fan."""
    clashing_edges: NDArray[np.uint32]
    """`[n, 2]`: edges along which faces run the same way."""
    intersections: NDArray[np.uint32]
    """`[n, 2]`: pairs of faces that pass through each other."""
    touching: NDArray[np.uint32]
    """`[n, 2]`: pairs of other faces that have more in common than the vertices they share: a corner or an edge of one lies on
    the other, or they overlap in one plane."""
    one_sided: NDArray[np.uint32]
    """Shells with one side, by first face."""
    disputed: NDArray[np.uint32]
    """Faces whose rays contradict most of their shell's."""
    shells: list[Shell]
    """In the order of their first faces."""


def mesh_check(
    vertices: ArrayLike, faces: ArrayLike, *, intersections: bool = True, lazy: bool = False, parallel: bool = True
) -> MeshReport:
    """Whether a mesh is closed, manifold and free of intersections, and which of its faces point inward.

    `vertices` is `[n, 3]`, taken in double precision, `faces` `[m, 3]`, anticlockwise as seen from outside. Without
    `intersections` faces are taken neither to intersect nor to touch. The report does not depend on `lazy` (build the tree where rays come),
    `parallel`, or the unit of length.

    To turn faces round: `faces[report.inward] = faces[report.inward][:, [0, 2, 1]]`.

    Raises ValueError for what is no mesh: a wrong shape, an index out of range, NaN, infinite coordinates.
    """
    rows = triples(numbers(vertices, np.float64), "coordinates a vertex")
    found = _sunfleck.mesh_check(rows, _faces(faces), intersections, lazy, parallel)
    for name in ("duplicates", "open_edges", "crowded_edges", "clashing_edges", "intersections", "touching"):
        found[name] = found[name].reshape(-1, 2)
    found["shells"] = [Shell(*shell) for shell in found["shells"]]
    return MeshReport(**found)
