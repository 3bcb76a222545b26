"""Surface nets: the zero surface of a field whose crossings of the grid's edges are known exactly.

Marching cubes cuts every edge of a body into saw-teeth as wide as the grid. Here each cell that the surface crosses
gets one vertex, the middle of its crossings, and each grid edge that it crosses one quadrangle between the four cells
around it: edges of the body come out straight, rounded by a fraction of a step. What is left of the teeth there is
smoothed away. Plain geometry on a grid of unit
steps; nothing here knows colours.

References
----------
S. Gibson, *Constrained elastic surface nets*, MICCAI 1998.
G. Taubin, *A signal processing approach to fair surface design*, SIGGRAPH 1995.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

__all__ = ["Crossings", "crossings_of", "smoothed", "surface_net"]

_SMOOTHINGS = 6
_SHRINK, _GROW = 0.6, -0.64
"""Steps to the mean of the neighbours and back: waves shorter than some ten edges fade, longer ones stay (Taubin)."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """Grid edges between nodes of different sign.

    Attributes
    ----------
    low : (e, 3) int64 array
        Node at the lower end of each edge.
    axis : (e,) int64 array
    low_inside : (e,) bool array
        Whether the lower end is the one inside (> 0).
    """

    low: NDArray[np.int64]
    axis: NDArray[np.int64]
    low_inside: NDArray[np.bool_]

    @property
    def high(self) -> NDArray[np.int64]:
        """Node at the upper end, (e, 3)."""
        return self.low + np.eye(3, dtype=np.int64)[self.axis]


def crossings_of(values: NDArray[np.floating]) -> Crossings:
    """The crossings of a field (l, m, n) whose border nodes all lie outside (<= 0)."""
    inside = values > 0
    low = [np.argwhere(np.diff(inside, axis=axis)) for axis in range(3)]
    nodes = np.concatenate(low).astype(np.int64)
    axis = np.repeat(np.arange(3), [len(part) for part in low])
    return Crossings(nodes, axis, inside[tuple(nodes.T)])


def surface_net(
    crossings: Crossings, share: NDArray[np.float64], shape: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """The closed surface near the crossings.

    Parameters
    ----------
    crossings : Crossings
    share : (e,) float64 array
        Where on its edge each crossing lies, 0..1.
    shape : tuple of 3 ints
        Of the grid.

    Returns
    -------
    vertices : (V, 3) float64 array
        In steps of the grid.
    faces : (F, 3) int64 array
        Wound outwards.
    """
    points = crossings.low + share[:, None] * np.eye(3)[crossings.axis]
    # The four cells around each edge, counter-clockwise seen from its upper end; a cell has the index of its low node.
    second, third = (crossings.axis + 1) % 3, (crossings.axis + 2) % 3
    unit = np.eye(3, dtype=np.int64)
    around = np.array([(-1, -1), (0, -1), (0, 0), (-1, 0)])
    cells = crossings.low[:, None] + around[:, :1] * unit[second][:, None] + around[:, 1:] * unit[third][:, None]
    keys, corner = np.unique(np.ravel_multi_index(tuple(cells.reshape(-1, 3).T), shape), return_inverse=True)
    corner = corner.reshape(-1, 4)
    vertices = np.zeros((len(keys), 3))
    for k in range(4):
        np.add.at(vertices, corner[:, k], points)
    vertices /= np.bincount(corner.ravel())[:, None]
    a, b, c, d = np.where(crossings.low_inside[:, None], corner, corner[:, ::-1]).T
    # Each quadrangle is cut the shorter way.
    first = np.linalg.norm(vertices[a] - vertices[c], axis=1) <= np.linalg.norm(vertices[b] - vertices[d], axis=1)
    return vertices, np.concatenate(
        (np.stack((a, b, np.where(first, c, d)), axis=1), np.stack((np.where(first, a, b), c, d), axis=1))
    )


def smoothed(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.float64]:
    """Vertices (V, 3) of a closed surface without the teeth that a grid leaves on sharp edges, its volume kept."""
    i, j = faces.ravel(), faces[:, [1, 2, 0]].ravel()
    shares = 1 / np.bincount(i, minlength=len(vertices))
    mean_of_neighbours = csr_array((shares[i], (i, j)), shape=(len(vertices), len(vertices)))
    for step in (_SHRINK, _GROW) * _SMOOTHINGS:
        vertices = vertices + step * (mean_of_neighbours @ vertices - vertices)
    return vertices
