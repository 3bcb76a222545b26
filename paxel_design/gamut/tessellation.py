"""Flat triangles in XYZ -> short ones in CIELAB, without tearing: the conforming split of a closed surface.

Nothing here knows gamuts; it knows that straight lines in XYZ become curves in CIELAB.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import XYZ_to_Lab

__all__ = ["edges_of", "tessellate"]


def tessellate(
    XYZ: NDArray[np.float64], faces: NDArray[np.int64], white_point: NDArray[np.float64], max_edge: float
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Split the edges of flat triangles in XYZ until none is longer than `max_edge` in CIELAB.

    Parameters
    ----------
    XYZ : (v, 3) float64 array
    faces : (f, 3) int64 array
    white_point : (3,) float64 array
    max_edge : float

    Returns
    -------
    XYZ : (V, 3) float64 array
        The given points first.
    faces : (F, 3) int64 array
        Wound as given.
    """
    while True:
        ends, edge_of = edges_of(faces, len(XYZ))
        Lab = XYZ_to_Lab(XYZ, white_point)
        long = np.linalg.norm(Lab[ends[:, 0]] - Lab[ends[:, 1]], axis=1) > max_edge
        if not np.any(long):
            return XYZ, faces
        middle = np.where(long, len(XYZ) + np.cumsum(long) - 1, -1)
        XYZ = np.concatenate((XYZ, _perceptual_middle(XYZ[ends[long, 0]], XYZ[ends[long, 1]], white_point)))
        faces = _split(faces, middle[edge_of], XYZ_to_Lab(XYZ, white_point))


def edges_of(faces: NDArray[np.int64], count: int) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """The edges as pairs of vertices (E, 2), and of each face its edges 0-1, 1-2, 2-0 (F, 3)."""
    halves = np.sort(np.stack((faces, np.roll(faces, -1, axis=1)), axis=-1), axis=-1)
    keys, edge_of = np.unique(halves[..., 0] * count + halves[..., 1], return_inverse=True)
    return np.stack(np.divmod(keys, count), axis=-1), edge_of.reshape(faces.shape)


def _perceptual_middle(
    a: NDArray[np.float64], b: NDArray[np.float64], white_point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """The point of each straight line a-b (E, 3) where the cube root of its light is half-way.

    The middle in XYZ would lie far up in CIELAB near black, and cost many more splits.
    """
    light = np.stack(((a / white_point).sum(axis=1), (b / white_point).sum(axis=1)))
    low, high = np.cbrt(np.maximum(light, 0) + 0.01)  # + 0.01: finite slope at black, as CIELAB has
    difference = high**3 - low**3
    even = np.abs(difference) < 1e-3 * high**3
    t = np.where(even, 0.5, (((low + high) / 2) ** 3 - low**3) / np.where(even, 1, difference))
    return a + t[:, None] * (b - a)


def _split(faces: NDArray[np.int64], middle: NDArray[np.int64], Lab: NDArray[np.floating]) -> NDArray[np.int64]:
    """Triangles (F, 3) cut at the middles (F, 3) of their edges 0-1, 1-2, 2-0; -1 where an edge stays whole."""
    count = np.sum(middle >= 0, axis=1)
    pieces = [faces[count == 0]]

    one, two, three = (count == k for k in (1, 2, 3))

    # One middle: turn the triangle so that it is on edge 0-1.
    (v0, v1, v2), (m, _, _) = _turned(faces[one], middle[one], np.argmax(middle[one] >= 0, axis=1))
    pieces += [_triangles(v0, m, v2), _triangles(m, v1, v2)]

    # Two middles: the whole edge becomes 2-0; the quadrangle left is cut along its shorter diagonal.
    (v0, v1, v2), (m, k, _) = _turned(faces[two], middle[two], np.argmin(middle[two], axis=1) + 1)
    pieces.append(_triangles(m, v1, k))
    first = np.linalg.norm(Lab[m] - Lab[v2], axis=1) <= np.linalg.norm(Lab[v0] - Lab[k], axis=1)
    pieces += [_triangles(v0, m, np.where(first, v2, k)), _triangles(np.where(first, m, v0), k, v2)]

    (v0, v1, v2), (m, k, j) = faces[three].T, middle[three].T
    pieces += [_triangles(v0, m, j), _triangles(m, v1, k), _triangles(j, k, v2), _triangles(m, k, j)]
    return np.concatenate(pieces)


def _turned(
    faces: NDArray[np.int64], middle: NDArray[np.int64], start: NDArray[np.intp]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Vertices and middles, (3, F) each, of faces turned to begin at their vertex number `start` (F,)."""
    order = (start[:, None] + np.arange(3)) % 3
    return np.take_along_axis(faces, order, axis=1).T, np.take_along_axis(middle, order, axis=1).T


def _triangles(a: NDArray[np.int64], b: NDArray[np.int64], c: NDArray[np.int64]) -> NDArray[np.int64]:
    return np.stack((a, b, c), axis=1)
