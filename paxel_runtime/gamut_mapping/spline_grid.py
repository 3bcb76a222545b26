"""Smooth functions over the frame, and over the frame and lightness: quadratic B-splines on a coarse grid.

A quadratic B-spline has no kinks to be seen as bands, stays between its control values, and rises where they rise.
Knows rasters and degrees of visual angle; nothing of colours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, eye, kron

from paxel_runtime.numba_options import CALLED

__all__ = ["SplineGrid", "spline_grid", "spline_weights"]

_SPACING_DEG = 0.4
_MOST_CELLS = 40
"""Cells along a side at most: nearer viewers get coarser nodes, and the fit stays a matter of seconds."""


@dataclass(frozen=True)
class SplineGrid:
    """Where the control values of a spline over the frame (and over a third axis) lie.

    Attributes
    ----------
    height, width : int
        The frame, pixels.
    cells : (int, int)
        Cells along rows and columns; there are two more control values than cells along each axis.
    bins : int
        Cells along the third axis; 0 = there is none.
    """

    height: int
    width: int
    cells: tuple[int, int]
    bins: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the control values: rows, columns and, with bins, the third axis."""
        return (self.cells[0] + 2, self.cells[1] + 2, *((self.bins + 2,) if self.bins else ()))

    @property
    def size(self) -> int:
        """Number of control values."""
        return math.prod(self.shape)

    def raveled(self, control: NDArray[Any]) -> NDArray[Any]:
        """Control values (or differences along the third axis) in the order of unknowns: the longer side first.

        That order makes narrow bands.
        """
        return control.swapaxes(0, 1).ravel() if self._upright else control.ravel()

    def unraveled(self, unknowns: NDArray[Any]) -> NDArray[Any]:
        """Inverse of `raveled`."""
        if not self._upright:
            return unknowns.reshape(self.shape)
        rows, columns, *rest = self.shape
        return np.ascontiguousarray(unknowns.reshape(columns, rows, *rest).swapaxes(0, 1))

    @property
    def _upright(self) -> bool:
        return self.cells[0] <= self.cells[1]

    def at(
        self, rows: NDArray[np.integer], columns: NDArray[np.integer], share: NDArray[np.floating] | None = None
    ) -> csr_matrix:
        """Sparse (n, size): value of the spline at n pixels (and shares 0..1 of the third axis) from the unknowns."""
        axes = [
            spline_weights((rows + 0.5) / self.height, self.cells[0]),
            spline_weights((columns + 0.5) / self.width, self.cells[1]),
        ]
        if share is not None:
            axes.append(spline_weights(share, self.bins))
        place = self.raveled(np.arange(self.size).reshape(self.shape))
        number = np.empty(self.size, np.int64)
        number[place] = np.arange(self.size)  # unknown of a control value counted in C order
        index, weight = np.zeros((len(rows), 1), np.int64), np.ones((len(rows), 1))
        for (first, weights), length in zip(axes, self.shape, strict=True):
            index = (index[:, :, None] * length + (first[:, None] + np.arange(3))[:, None, :]).reshape(len(rows), -1)
            weight = (weight[:, :, None] * weights[:, None, :]).reshape(len(rows), -1)
        count = index.shape[1]
        starts = np.arange(0, count * len(rows) + 1, count)
        return csr_matrix((weight.ravel(), number[index].ravel(), starts), shape=(len(rows), self.size))

    def differences(self, axis: int, order: int = 1) -> csr_matrix:
        """Sparse (m, size): differences of the unknowns along an axis (0 rows, 1 columns, 2 the third), raveled."""
        lengths = list(self.shape)
        if self._upright:
            lengths[:2] = lengths[1::-1]
            axis = (1, 0, 2)[axis]
        length = lengths[axis]
        pattern = {1: (-1.0, 1.0), 2: (1.0, -2.0, 1.0)}[order]
        step = diags(pattern, range(order + 1), shape=(length - order, length))
        before, after = math.prod(lengths[:axis]), math.prod(lengths[axis + 1 :])
        return csr_matrix(kron(kron(eye(before), step), eye(after)))


def spline_grid(height: int, width: int, px_per_degree: float, bins: int = 0) -> SplineGrid:
    """A grid with nodes about 0.4 degree apart."""
    spacing = max(_SPACING_DEG * px_per_degree, max(height, width) / _MOST_CELLS)
    return SplineGrid(height, width, (max(1, round(height / spacing)), max(1, round(width / spacing))), bins)


def spline_weights(share: NDArray[np.floating], cells: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """First of the three control values at shares 0..1 of an axis (n,), and their weights (n, 3), which sum to 1."""
    place = np.clip(np.asarray(share, np.float64), 0, 1) * cells
    first = np.minimum(place.astype(np.int64), cells - 1)
    t = place - first
    return first, np.stack([0.5 * (1 - t) ** 2, 0.5 + t - t * t, 0.5 * t * t], axis=-1)


@njit(**CALLED)
def weighted_rows(control: NDArray[np.float64], first: int, weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Control values (rows, columns, m) of three rows, weighted: what one raster row needs, (columns, m)."""
    table = np.empty((control.shape[1], control.shape[2]))
    for column in range(table.shape[0]):
        for k in range(table.shape[1]):
            table[column, k] = (
                weights[0] * control[first, column, k]
                + weights[1] * control[first + 1, column, k]
                + weights[2] * control[first + 2, column, k]
            )
    return table


@njit(**CALLED)
def spline_value(share: float, table: NDArray[np.float64], first: int, weights: NDArray[np.float64]) -> float:
    """Value from a raster row's table (columns, bins + 2), three columns of it weighted, at a share of the bins."""
    bins = table.shape[1] - 2
    place = min(max(share, 0.0), 1.0) * bins
    k = min(int(place), bins - 1)
    t = place - k
    w0, w1, w2 = 0.5 * (1.0 - t) * (1.0 - t), 0.5 + t - t * t, 0.5 * t * t
    value = 0.0
    for c in range(3):
        column = first + c
        value += weights[c] * (w0 * table[column, k] + w1 * table[column, k + 1] + w2 * table[column, k + 2])
    return value
