"""Local tone curves: lightness of the target from the pixel's own source lightness and its place in the frame.

M(x) = curve_x(L(x)). A pixel's lightness depends on no other pixel but through the curves, which change slowly over the
frame, so no detail of another picture can get in. Knows lightness; nothing of gamuts.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.sparse import csr_matrix

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping.spline_grid import SplineGrid, spline_value, spline_weights, weighted_rows
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["ToneCurves", "linear_curves"]


@dataclass(frozen=True, eq=False)
class ToneCurves:
    """Tone curves over the frame.

    Attributes
    ----------
    grid : SplineGrid
        Over rows, columns and source lightness.
    control : (rows, columns, bins + 2) float64 array
        Control values, L* of the target; rising along the last axis.
    L_from : (low, high)
        L* of the source at the ends of the third axis; what lies beyond is clipped.
    """

    grid: SplineGrid
    control: NDArray[np.float64]
    L_from: tuple[float, float]

    def __post_init__(self) -> None:
        if self.control.shape != self.grid.shape or not self.grid.bins:
            raise InputError(f"tone curves need control values {self.grid.shape}, got {self.control.shape}")

    @property
    def bin_width(self) -> float:
        """L* of the source from one control value to the next."""
        return (self.L_from[1] - self.L_from[0]) / self.grid.bins

    def share(self, L: NDArray[np.floating]) -> NDArray[np.float64]:
        """Where source lightnesses lie on the third axis, 0..1."""
        return np.clip((L.astype(np.float64) - self.L_from[0]) / (self.L_from[1] - self.L_from[0]), 0, 1)

    def sampled(self, rows: NDArray[np.integer], columns: NDArray[np.integer], L: NDArray[np.floating]) -> csr_matrix:
        """Sparse (n, size): target lightness of n pixels with source lightness L (n,) from the unknowns."""
        return self.grid.at(rows, columns, self.share(L))

    def apply(self, L: NDArray[np.floating]) -> NDArray[np.float32]:
        """Target lightness (H, W) of a source (H, W).

        Raises
        ------
        InputError
            If the picture is not of the grid's frame.
        """
        grid = self.grid
        if L.shape != (grid.height, grid.width):
            raise InputError(f"tone curves are for {grid.height} x {grid.width} pixels, got {L.shape}")
        rows = spline_weights((np.arange(grid.height) + 0.5) / grid.height, grid.cells[0])
        columns = spline_weights((np.arange(grid.width) + 0.5) / grid.width, grid.cells[1])
        # One layout and one type of each argument: the kernel is compiled once.
        source, control = np.ascontiguousarray(L, np.float32), np.array(self.control, np.float64)
        mapped = np.empty(L.shape, np.float32)
        low, high = float(self.L_from[0]), float(self.L_from[1])
        in_bands(partial(_apply, source, control, *rows, *columns, low, high, mapped), len(mapped))
        return mapped


def linear_curves(grid: SplineGrid, L_from: tuple[float, float], L_to: tuple[float, float]) -> ToneCurves:
    """The same straight line everywhere: static mapping."""
    knots = (np.arange(grid.bins + 2) - 0.5) / grid.bins
    line = L_to[0] + (L_to[1] - L_to[0]) * knots
    return ToneCurves(grid, np.broadcast_to(line, grid.shape).copy(), L_from)


@njit(**KERNEL)
def _apply(
    L: NDArray[np.float32],
    control: NDArray[np.float64],
    row_first: NDArray[np.int64],
    row_weights: NDArray[np.float64],
    column_first: NDArray[np.int64],
    column_weights: NDArray[np.float64],
    low: float,
    high: float,
    mapped: NDArray[np.float32],
    first: int,
    stop: int,
) -> None:
    for row in range(first, stop):
        table = weighted_rows(control, row_first[row], row_weights[row])
        _apply_row(L[row], table, column_first, column_weights, low, 1.0 / (high - low), mapped[row])


@njit(**CALLED)
def _apply_row(
    L: NDArray[np.float32],
    table: NDArray[np.float64],
    column_first: NDArray[np.int64],
    column_weights: NDArray[np.float64],
    low: float,
    scale: float,
    mapped: NDArray[np.float32],
) -> None:
    for column in range(len(L)):
        share = (np.float64(L[column]) - low) * scale
        mapped[column] = spline_value(share, table, column_first[column], column_weights[column])
