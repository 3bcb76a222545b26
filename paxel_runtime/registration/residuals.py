"""What a lookup table leaves of the measured points: their distances, as a histogram and over the projection.

Knows decoded coordinates and a table; must not know how the table was made.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL
from paxel_runtime.registration.fit import point_residual

__all__ = ["BIN_PX", "BLOCK_PX", "Residuals", "measure_residuals", "no_residuals"]

BIN_PX = 0.02
"""Width of the histogram's bins, camera pixels."""
_BINS = 75
BLOCK_PX = 8
"""Edge of the map's blocks, projector pixels."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Distances of measured points from the table, camera pixels.

    Attributes
    ----------
    histogram : (76,) int64 array
        Points in bins of `BIN_PX`; the last holds all beyond.
    rms_px : (rows, columns) float32 array
        Rms over blocks of `BLOCK_PX` projector pixels, without outliers; NaN where nothing was measured.
    """

    histogram: NDArray[np.int64]
    rms_px: NDArray[np.float32]


def measure_residuals(
    projector_xy: NDArray[np.float32],
    signal: NDArray[np.float32],
    table: NDArray[np.float64],
    ink_px2: float,
    outlier_px: float,
) -> Residuals:
    """Residuals of all decoded camera pixels.

    Parameters
    ----------
    projector_xy : (h, w, 2) float32 array
        NaN where not decoded.
    signal : (h, w) float32 array
    table : (2, H, W) float64 array
        Camera coordinates of the projector's pixels.
    ink_px2 : float
        See `start.Start`.
    outlier_px : float
        Camera pixels from which on a point does not count in the map.
    """
    histogram = np.zeros(_BINS + 1, np.int64)
    squares = np.zeros(tuple(-(-size // BLOCK_PX) for size in table.shape[1:]))
    counts = np.zeros_like(squares)
    _collect(projector_xy, signal, table, ink_px2, outlier_px, histogram, squares, counts)
    with np.errstate(invalid="ignore"):
        return Residuals(histogram, np.sqrt(squares / counts).astype(np.float32))


def no_residuals() -> Residuals:
    """Of a table that no points were measured for."""
    return Residuals(np.zeros(_BINS + 1, np.int64), np.full((1, 1), np.nan, np.float32))


@njit(**KERNEL)
def _collect(
    projector_xy: NDArray[np.float32],
    signal: NDArray[np.float32],
    table: NDArray[np.float64],
    ink_px2: float,
    outlier_px: float,
    histogram: NDArray[np.int64],
    squares: NDArray[np.float64],
    counts: NDArray[np.float64],
) -> None:
    height, width = table.shape[1], table.shape[2]
    for row in range(signal.shape[0]):
        for column in range(signal.shape[1]):
            u = float(projector_xy[row, column, 0])
            v = float(projector_xy[row, column, 1])
            if np.isnan(u):
                continue
            off_x, off_y = point_residual(u, v, signal, row, column, table, ink_px2)
            off = np.hypot(off_x, off_y)
            histogram[min(int(off / BIN_PX), _BINS)] += 1
            if off < outlier_px:
                i = min(max(int(v + 0.5), 0), height - 1) // BLOCK_PX
                j = min(max(int(u + 0.5), 0), width - 1) // BLOCK_PX
                squares[i, j] += off * off
                counts[i, j] += 1.0
