"""Signed distances to a closed mesh on the nodes of an even grid, in steps of the grid: plain geometry.

How far a node is comes from the triangles near it; on which side it lies from how often the ray up to it meets the
mesh, so that a sliver's uncertain normal decides nothing.

References
----------
C. Ericson, *Real-Time Collision Detection*, 2005, section 5.1.5: the nearest point of a triangle.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["signed_distances"]

_BESIDE = (1.4e-7, 2.3e-7)
"""How far beside a row of nodes its ray runs, steps: a vertex may lie on a node, and not on a ray."""


def signed_distances(
    vertices: NDArray[np.float64], faces: NDArray[np.integer], shape: tuple[int, ...], reach: float
) -> NDArray[np.float32]:
    """Distance of each node of a grid to a closed mesh, positive inside, cut off at `reach`.

    Parameters
    ----------
    vertices : (V, 3) float64 array
        In steps of the grid, from node [0, 0, 0].
    faces : (F, 3) integer array
    shape : (int, int, int)
        Nodes along each axis.
    reach : float
        In steps.

    Returns
    -------
    (l, m, n) float32 array
    """
    distance = np.full(shape, reach, np.float32)
    crossed = np.zeros(shape, np.uint8)
    _mark(np.ascontiguousarray(vertices, np.float64), np.ascontiguousarray(faces, np.int64), reach, distance, crossed)
    inside = np.bitwise_xor.accumulate(crossed, axis=2).astype(bool)
    np.negative(distance, out=distance, where=~inside)
    return distance


@njit(**KERNEL)
def _mark(
    vertices: NDArray[np.float64],
    faces: NDArray[np.int64],
    reach: float,
    distance: NDArray[np.float32],
    crossed: NDArray[np.uint8],
) -> None:
    """Lower `distance` to that of each triangle; flip `crossed` at the first node above each crossing of a ray."""
    low, high = np.empty(3, np.int64), np.empty(3, np.int64)
    for f in range(len(faces)):
        a, b, c = vertices[faces[f, 0]], vertices[faces[f, 1]], vertices[faces[f, 2]]
        for d in range(3):
            low[d] = max(int(np.ceil(min(a[d], b[d], c[d]) - reach)), 0)
            high[d] = min(int(np.floor(max(a[d], b[d], c[d]) + reach)), distance.shape[d] - 1)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                for k in range(low[2], high[2] + 1):
                    square = _square_distance(a, b, c, float(i), float(j), float(k))
                    if square < distance[i, j, k] * distance[i, j, k]:
                        distance[i, j, k] = np.sqrt(square)
                x, y = i + _BESIDE[0], j + _BESIDE[1]
                u = _side(vertices, faces[f, 1], faces[f, 2], x, y)
                v = _side(vertices, faces[f, 2], faces[f, 0], x, y)
                w = _side(vertices, faces[f, 0], faces[f, 1], x, y)
                if (u > 0.0 and v > 0.0 and w > 0.0) or (u < 0.0 and v < 0.0 and w < 0.0):
                    z = (u * a[2] + v * b[2] + w * c[2]) / (u + v + w)
                    k = max(int(np.ceil(z)), 0)
                    if k < distance.shape[2]:
                        crossed[i, j, k] ^= 1


@njit(**CALLED)
def _side(vertices: NDArray[np.float64], first: int, second: int, x: float, y: float) -> float:
    """Twice the area between an edge and a place of the floor; for both triangles of an edge to the last bit alike."""
    p, q, sign = (first, second, 1.0) if first < second else (second, first, -1.0)
    px, py = vertices[p, 0] - x, vertices[p, 1] - y
    qx, qy = vertices[q, 0] - x, vertices[q, 1] - y
    return sign * (px * qy - py * qx)


@njit(**CALLED)
def _square_distance(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], x: float, y: float, z: float
) -> float:
    """Squared distance of a place to a triangle: to its plane, an edge or a corner."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    px, py, pz = x - a[0], y - a[1], z - a[2]
    d1, d2 = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    s, t, whole = vv * d1 - uv * d2, uu * d2 - uv * d1, uu * vv - uv * uv
    if whole > 0.0 and s >= 0.0 and t >= 0.0 and s + t <= whole:
        s, t = s / whole, t / whole
        return (px - s * ux - t * vx) ** 2 + (py - s * uy - t * vy) ** 2 + (pz - s * uz - t * vz) ** 2
    found = _square_to_edge(px, py, pz, ux, uy, uz, d1, uu)
    found = min(found, _square_to_edge(px, py, pz, vx, vy, vz, d2, vv))
    wx, wy, wz, qx, qy, qz = vx - ux, vy - uy, vz - uz, px - ux, py - uy, pz - uz
    along, ww = wx * qx + wy * qy + wz * qz, wx * wx + wy * wy + wz * wz
    return min(found, _square_to_edge(qx, qy, qz, wx, wy, wz, along, ww))


@njit(**CALLED)
def _square_to_edge(
    px: float, py: float, pz: float, ux: float, uy: float, uz: float, along: float, length: float
) -> float:
    """Squared distance of p to the edge from 0 to u; `along` is p . u, `length` u . u."""
    t = min(max(along / length, 0.0), 1.0) if length > 0.0 else 0.0
    return (px - t * ux) ** 2 + (py - t * uy) ** 2 + (pz - t * uz) ** 2
