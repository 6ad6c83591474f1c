"""Arrays as the native half takes them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray


def numbers(values: ArrayLike, dtype: DTypeLike) -> NDArray[Any]:
    """Contiguous, of that floating type: the same array if it is so already."""
    # What is too large becomes infinite, and is refused as such.
    with np.errstate(over="ignore"):
        array = np.asarray(values)
        if array.dtype.kind not in "fiu" and array.size:
            raise ValueError(f"numbers are needed, not {array.dtype}")
        return np.require(array, dtype=dtype, requirements=["C", "A"])


def triples(array: NDArray[Any], what: str) -> NDArray[Any]:
    """The array, if it is `[n, 3]`; of nothing, `[0, 3]`."""
    if array.ndim == 1 and array.size == 0:
        array = array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"shape {array.shape}: three {what} are needed, [n, 3]")
    return array


def faces(values: ArrayLike) -> NDArray[np.uint32]:
    """`[m, 3]`, contiguous, of indices."""
    array = triples(np.asarray(values), "vertices a face")
    if array.size == 0:
        array = array.astype(np.uint32)
    if array.dtype.kind not in "iu":
        raise ValueError(f"faces are whole numbers, not {array.dtype}")
    if array.size and (int(array.min()) < 0 or int(array.max()) > 0xFFFF_FFFF):
        raise ValueError("a face has a vertex that is not there")
    return np.require(array, dtype=np.uint32, requirements=["C", "A"])
