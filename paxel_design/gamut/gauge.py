"""Gauge and support of convex polytopes, for very many points or directions.

The gauge tells how far out along its own ray a point is, 1 on the surface; the support how far a body reaches.

Plain geometry in three dimensions; nothing here knows colours.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.polytopes import inscribed_ball
from paxel_runtime.numba_options import KERNEL

__all__ = ["Gauge", "support"]

_CHUNK = 1 << 12
"""Points of one thread at once: they and their gauges stay in the cache while all rows pass."""


class Gauge:
    """The gauge of {normals @ p <= offsets} about the middle of its largest ball.

    Parameters
    ----------
    normals : (m, 3) float64 array
        Unit rows.
    offsets : (m,) float64 array

    Attributes
    ----------
    middle : (3,) float64 array
    """

    def __init__(self, normals: NDArray[np.float64], offsets: NDArray[np.float64]) -> None:
        self.middle, _ = inscribed_ball(normals, offsets)
        self._rows = np.ascontiguousarray((normals / (offsets - normals @ self.middle)[:, None]).T)

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Gauges (k,) of points (k, 3): below 1 inside, above 1 outside."""
        return _largest_products(points - self.middle, self._rows)


def support(directions: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest product (k,) of each direction (k, 3) with any of the points (v, 3)."""
    return directions @ points[0] + _largest_products(directions, np.ascontiguousarray((points - points[0]).T))


def _largest_products(points: NDArray[np.float64], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    parts = [np.ascontiguousarray(points[i : i + _CHUNK].T) for i in range(0, len(points), _CHUNK)]
    if not parts:
        return np.empty(0)
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return np.concatenate(list(pool.map(lambda part: _largest(part, rows), parts)))


@njit(**KERNEL)
def _largest(points: NDArray[np.float64], rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Largest product of each point (3, k) with any of the rows (3, m), and 0."""
    found = np.zeros(points.shape[1])
    for j in range(rows.shape[1]):
        x, y, z = rows[0, j], rows[1, j], rows[2, j]
        for i in range(len(found)):
            value = x * points[0, i] + y * points[1, i] + z * points[2, i]
            found[i] = value if value > found[i] else found[i]
    return found
