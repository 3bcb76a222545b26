"""Dual contouring: the zero surface of a field whose crossings of the grid's edges, and normals there, are known.

Marching cubes cuts every edge of a body into saw-teeth as wide as the grid. Here each cell that the surface crosses
gets one vertex, where the planes at its crossings meet best, and each grid edge that it crosses one quadrangle between
the four cells around it: edges and corners of the body come out sharp. Plain geometry on a grid of unit steps; nothing
here knows colours.

References
----------
T. Ju, F. Losasso, S. Schaefer, J. Warren, *Dual contouring of Hermite data*, SIGGRAPH 2002.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Crossings", "crossings_of", "net_faces", "net_vertices"]

_FLAT = 0.1
"""Share of the largest eigenvalue below which the planes of a cell do not say where along a direction they meet."""

_SAME = 0.05
"""Difference of distance, in steps, below which two diagonals fit as well: the shorter is taken."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """Grid edges between nodes of different sign, and the cells around them.

    Attributes
    ----------
    low : (e, 3) int64 array
        Node at the lower end of each edge.
    axis : (e,) int64 array
    low_inside : (e,) bool array
        Whether the lower end is the one inside (> 0).
    cells : (V, 3) int64 array
        All cells with a crossing, by their low node.
    around : (e, 4) int64 array
        The four cells around each edge, indices into `cells`, counter-clockwise seen from its upper end.
    """

    low: NDArray[np.int64]
    axis: NDArray[np.int64]
    low_inside: NDArray[np.bool_]
    cells: NDArray[np.int64]
    around: NDArray[np.int64]

    @property
    def high(self) -> NDArray[np.int64]:
        """Node at the upper end, (e, 3)."""
        return self.low + np.eye(3, dtype=np.int64)[self.axis]

    def points(self, share: NDArray[np.float64]) -> NDArray[np.float64]:
        """Places (e, 3) that lie a share (e,) of the way up the edges."""
        return self.low + share[:, None] * np.eye(3)[self.axis]


def crossings_of(values: NDArray[np.floating]) -> Crossings:
    """The crossings of a field (l, m, n) whose border nodes all lie outside (<= 0)."""
    inside = values > 0
    ends = [np.argwhere(np.diff(inside, axis=axis)) for axis in range(3)]
    low = np.concatenate(ends).astype(np.int64)
    axis = np.repeat(np.arange(3), [len(part) for part in ends])
    unit = np.eye(3, dtype=np.int64)
    second, third = unit[(axis + 1) % 3], unit[(axis + 2) % 3]
    ring = np.array([(-1, -1), (0, -1), (0, 0), (-1, 0)])
    beside = low[:, None] + ring[:, :1] * second[:, None] + ring[:, 1:] * third[:, None]
    keys, around = np.unique(np.ravel_multi_index(tuple(beside.reshape(-1, 3).T), values.shape), return_inverse=True)
    cells = np.stack(np.unravel_index(keys, values.shape), axis=1).astype(np.int64)
    return Crossings(low, axis, inside[tuple(low.T)], cells, around.reshape(-1, 4))


def net_vertices(
    crossings: Crossings, points: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.float64]:
    """One vertex a cell: the place nearest to the planes at its crossings, as near to the crossings' middle as may be.

    Parameters
    ----------
    crossings : Crossings
    points : (e, 3) float64 array
        Where the surface crosses the edges, in steps of the grid.
    normals : (e, 3) float64 array
        Unit normals there; zero where unknown.

    Returns
    -------
    (V, 3) float64 array
        In steps of the grid, each within its cell.
    """
    cell = crossings.around.ravel()
    count = len(crossings.cells)

    def summed(terms: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.bincount(cell, np.repeat(terms, 4), minlength=count), np.float64)

    number = np.bincount(cell, minlength=count)
    middle = np.stack([summed(p) for p in points.T], axis=1) / number[:, None]
    matrix = np.empty((count, 3, 3))
    for i in range(3):
        for j in range(i, 3):
            matrix[:, i, j] = matrix[:, j, i] = summed(normals[:, i] * normals[:, j])
    height = np.einsum("ei,ei->e", normals, points)
    right = np.stack([summed(n * height) for n in normals.T], axis=1) - np.einsum("vij,vj->vi", matrix, middle)
    value, vector = np.linalg.eigh(matrix)
    known = value > np.maximum(_FLAT * value[:, -1:], 1e-12)
    along = np.where(known, np.einsum("vij,vi->vj", vector, right) / np.where(known, value, 1.0), 0.0)
    move = np.einsum("vij,vj->vi", vector, along)
    # Straight back from the meeting of planes towards the middle, as far as it takes to be in the cell.
    room = np.where(move > 0, crossings.cells + 1 - middle, middle - crossings.cells)
    share = np.min(np.where(np.abs(move) > room, room / np.maximum(np.abs(move), 1e-12), 1.0), axis=1)
    return np.asarray(middle + share[:, None] * move, np.float64)


def net_faces(
    crossings: Crossings, vertices: NDArray[np.float64], points: NDArray[np.float64], normals: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Triangles (F, 3) between the vertices (V, 3), wound outwards; for the others see `net_vertices`.

    Each quadrangle is cut along the diagonal that comes nearer to the plane of its crossing: on an edge of the body
    that is the one along it.
    """
    a, b, c, d = np.where(crossings.low_inside[:, None], crossings.around, crossings.around[:, ::-1]).T
    off = [
        np.abs(np.einsum("ei,ei->e", normals, (vertices[i] + vertices[j]) / 2 - points)) for i, j in ((a, c), (b, d))
    ]
    length = [np.linalg.norm(vertices[i] - vertices[j], axis=1) for i, j in ((a, c), (b, d))]
    first = np.where(np.abs(off[0] - off[1]) < _SAME, length[0] <= length[1], off[0] < off[1])
    return np.concatenate(
        (np.stack((a, b, np.where(first, c, d)), axis=1), np.stack((np.where(first, a, b), c, d), axis=1))
    )
