"""Kernels of `refine`: light of every pixel gathered on a coarse raster, its blur, and the correction of the pixels.

Plain float32 arrays; see `refine` for the method. Light is held as 6 values, XYZ on the pattern and on the second
surface. A *cell* of the coarse raster is a square of `step` x `step` projector pixels. Pixels take from the cells by
linear interpolation and give to them by the same weights: plain sums over cells would let the pattern's own high
frequencies pass for low ones. A *block* is a square of pixels that share one response. Knows no models and no pictures.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["correct", "gather_inputs", "gather_rows", "horizontal_blur", "vertical_blur"]

_FAST = {"contract", "reassoc", "nsz"}


@njit(**CALLED)
def _between(place: int, step: int, cells: int) -> tuple[int, int, np.float32]:
    """The two cells that a pixel lies between, and the weight of the second (linear interpolation)."""
    t = (place + 0.5) / step - 0.5
    first = int(np.floor(t))
    weight = np.float32(t - first)
    return min(max(first, 0), cells - 1), min(max(first + 1, 0), cells - 1), weight


@njit(**KERNEL)
def gather_inputs(
    x: NDArray[np.float32],
    inside: NDArray[np.bool_],
    first_row: int,
    first_cell: int,
    size: tuple[int, int, int],
    sums: NDArray[np.float32],
    counts: NDArray[np.float32],
) -> None:
    """Fill a band of the coarse raster: weighted sums of the inputs and of 1 over the pixels inside around each cell.

    Parameters
    ----------
    x : (rows, W, n) float32 array
        The rows of the frame that the band looks at: one step above and below it, where the frame has them.
    inside : (rows, W) bool array
    first_row, first_cell : int
        Row of the frame and row of the coarse raster that the bands begin with.
    size : (int, int, int)
        Rows of the frame, rows of the coarse raster, and step.
    sums : (cells, columns, n) float32 array
    counts : (cells, columns) float32 array
    """
    height, cells_y, step = size
    width, n = inside.shape[1], x.shape[2]
    cells_x = sums.shape[1]
    for i in range(sums.shape[0]):
        sums[i] = 0.0
        counts[i] = 0.0
        own = first_cell + i
        for row in range(max(own * step - step, 0), min(own * step + 2 * step, height)):
            up, down, t = _between(row, step, cells_y)
            weight = (np.float32(1) - t) * (up == own) + t * (down == own)
            if weight == 0:
                continue
            for column in range(width):
                if inside[row - first_row, column]:
                    left, right, s = _between(column, step, cells_x)
                    counts[i, left] += weight * (np.float32(1) - s)
                    counts[i, right] += weight * s
                    for k in range(n):
                        light = weight * x[row - first_row, column, k]
                        sums[i, left, k] += (np.float32(1) - s) * light
                        sums[i, right, k] += s * light


@njit(**KERNEL, fastmath=_FAST)
def correct(
    p: NDArray[np.float32],
    inside: NDArray[np.bool_],
    coverage: NDArray[np.uint8],
    on_colorants: NDArray[np.float32],
    on_second: NDArray[np.float32],
    block: int,
    step: int,
    wanted: NDArray[np.float32],
    light: NDArray[np.float32],
    first: int,
    stop: int,
) -> None:
    """One round: p <- clip(p + A(a)^T w), w interpolated from the coarse raster, then the light A(a) p along each row.

    In the pixels of rows `first` to `stop` of the coarse raster.

    Parameters
    ----------
    p : (H, W, N) float32 array
        Intensities, changed in place where `inside`.
    inside : (H, W) bool array
    coverage : (H, W, C, M) uint8 array
        Share of each colorant in a pixel, 255 = all; C = 1, or N where channels differ.
    on_colorants : (rows, columns, N, M, 3) float32 array
        XYZ on the pattern of a pixel in each channel on each colorant, for every block.
    on_second : (rows, columns, N, 3) float32 array
        The same on the second surface; zeros where there is none.
    block : int
        Pixels along a block.
    step : int
        Pixels along a cell.
    wanted : (h, w, 6) float32 array
        w = Q e on the coarse raster.
    light : (H, w, 6) float32 array
        Filled with the new light of the pixels inside, each shared by the two cells that it lies between.
    """
    height, width, channels = p.shape
    per_channel = 1 if coverage.shape[2] > 1 else 0
    colorants = coverage.shape[3]
    cells_y, cells_x = wanted.shape[:2]
    for i in range(first, stop):
        w, own, share = np.empty(6, np.float32), np.empty(6, np.float32), np.empty(colorants, np.float32)
        total = np.empty(6, np.float32)
        for row in range(i * step, min(i * step + step, height)):
            light[row] = 0.0
            up, down, t = _between(row, step, cells_y)
            for column in range(width):
                if not inside[row, column]:
                    continue
                left, right, s = _between(column, step, cells_x)
                for k in range(6):
                    above = wanted[up, left, k] + s * (wanted[up, right, k] - wanted[up, left, k])
                    below = wanted[down, left, k] + s * (wanted[down, right, k] - wanted[down, left, k])
                    w[k] = above + t * (below - above)
                    total[k] = 0.0
                block_y, block_x = row // block, column // block
                for j in range(channels):
                    if j == 0 or per_channel:
                        for m in range(colorants):
                            share[m] = coverage[row, column, j * per_channel, m] * np.float32(1.0 / 255.0)
                    for k in range(3):
                        own[k] = 0.0
                        own[3 + k] = on_second[block_y, block_x, j, k]
                    for m in range(colorants):
                        for k in range(3):
                            own[k] += share[m] * on_colorants[block_y, block_x, j, m, k]
                    value = p[row, column, j]
                    for k in range(6):
                        value += own[k] * w[k]
                    value = min(max(value, np.float32(0.0)), np.float32(1.0))
                    p[row, column, j] = value
                    for k in range(6):
                        total[k] += own[k] * value
                for k in range(6):
                    light[row, left, k] += (np.float32(1) - s) * total[k]
                    light[row, right, k] += s * total[k]


@njit(**KERNEL, fastmath=_FAST)
def gather_rows(rows: NDArray[np.float32], step: int, cells: NDArray[np.float32], first: int, stop: int) -> None:
    """Rows of light (H, w, c) into rows `first` to `stop` of cells (h, w, c), each shared by the two around it."""
    height, cells_y = rows.shape[0], cells.shape[0]
    for i in range(first, stop):
        out = cells[i].reshape(-1)
        out[:] = 0.0
        for row in range(max(i * step - step, 0), min(i * step + 2 * step, height)):
            up, down, t = _between(row, step, cells_y)
            weight = (np.float32(1) - t) * (up == i) + t * (down == i)
            line = rows[row].reshape(-1)
            for k in range(len(out)):
                out[k] += weight * line[k]


@njit(**KERNEL, fastmath=_FAST)
def horizontal_blur(source: NDArray[np.float32], weights: NDArray[np.float32], result: NDArray[np.float32]) -> None:
    """Blur each row of (h, w, c) along w; beyond the raster is nothing."""
    height, width, planes = source.shape
    reach = len(weights) // 2
    for row in range(height):
        line = np.zeros((width + 2 * reach) * planes, np.float32)
        line[reach * planes : (reach + width) * planes] = source[row].reshape(-1)
        out = result[row].reshape(-1)
        out[:] = 0.0
        for k in range(len(weights)):
            weight = weights[k]
            for c in range(width * planes):
                out[c] += weight * line[c + k * planes]


@njit(**KERNEL, fastmath=_FAST)
def vertical_blur(
    source: NDArray[np.float32], weights: NDArray[np.float32], result: NDArray[np.float32], first: int, stop: int
) -> None:
    """Blur each column of (h, w, c) along h, in rows `first` to `stop`; beyond the raster is nothing."""
    height = source.shape[0]
    reach = len(weights) // 2
    for row in range(first, stop):
        out = result[row].reshape(-1)
        out[:] = 0.0
        for k in range(max(0, reach - row), min(len(weights), height + reach - row)):
            weight = weights[k]
            line = source[row + k - reach].reshape(-1)
            for c in range(len(out)):
                out[c] += weight * line[c]
