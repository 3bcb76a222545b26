"""Where ink lies in a known print: shares of each ink at points and in areas; edges may spread and inks may slip.

Numba kernels on plain arrays (see `ink_tables`); coordinates are millimetres of the nominal pattern. Knows no light,
no camera and no fit.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.model.pattern import Pattern
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["ink_shares", "ink_tables", "pixel_shares"]

_SUBSAMPLES = 6
"""Subsamples of a projector pixel along each side; their own shares are exact for straight edges."""


def ink_tables(pattern: Pattern, inks: list[int]) -> tuple[NDArray[np.uint16], NDArray[np.float64]]:
    """A pattern as the kernels want it.

    Parameters
    ----------
    pattern : Pattern
    inks : list of int
        Colorants that are ink, the one that decides on overlaps (the darkest) first.

    Returns
    -------
    edges : (L, rows, columns) uint16 array
        For each ink and cell: bit 0, the cell has it; bit 1 + k, the k-th of the 8 cells around it, row by row,
        differs in that.
    frame : (5,) float64 array
        Cosine and sine of the angle over the dot size, dot size, half width and half height of the pattern; mm.
    """
    angle, dot = math.radians(pattern.angle_deg), pattern.dot_size_mm
    frame = np.array([math.cos(angle) / dot, math.sin(angle) / dot, dot, *(0.5 * side for side in pattern.size_mm)])
    return np.stack([_edges(pattern.cells == ink) for ink in inks]), frame


def _edges(inked: NDArray[np.bool_]) -> NDArray[np.uint16]:
    bits = inked.astype(np.uint16)
    around = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right]
    for k, (down, right) in enumerate(around):
        bits |= (np.roll(inked, (-down, -right), (0, 1)) != inked).astype(np.uint16) << np.uint16(k + 1)
    return bits


@njit(**CALLED)
def _depth(x: float, y: float, edges: NDArray[np.uint16], frame: NDArray[np.float64], near_mm: float) -> float:
    """Distance in mm from a point to the edge of an ink, positive inside; right up to `near_mm`, half a dot at most."""
    rows, columns = edges.shape
    i = frame[0] * x + frame[1] * y
    j = frame[0] * y - frame[1] * x
    left, low = i - math.floor(i), j - math.floor(j)
    # the cell on the torus by multiplication: a division of integers takes longer than all the rest
    across, up = i / columns, j / rows
    column = min(int((across - math.floor(across)) * columns), columns - 1)
    row = min(int((up - math.floor(up)) * rows), rows - 1)
    bits = edges[row, column]
    nearest = 0.25  # of squared distances, in cells
    if min(min(left, 1.0 - left), min(low, 1.0 - low)) * frame[2] < near_mm:
        bit = 1
        for down in range(-1, 2):
            fy = low if down < 0 else (1.0 - low if down > 0 else 0.0)
            for right in range(-1, 2):
                if down == 0 and right == 0:
                    continue
                if bits >> bit & 1:
                    fx = left if right < 0 else (1.0 - left if right > 0 else 0.0)
                    nearest = min(nearest, fx * fx + fy * fy)
                bit += 1
    depth = frame[2] * math.sqrt(nearest)
    depth = depth if bits & 1 else -depth
    return min(depth, frame[3] - abs(x), frame[4] - abs(y))


@njit(**CALLED)
def _shares_at(
    x: float,
    y: float,
    edges: NDArray[np.uint16],
    frame: NDArray[np.float64],
    spread_mm: float,
    offsets_mm: NDArray[np.float64],
    width_mm: float,
    shares: NDArray[np.float64],
) -> None:
    """Shares (L,) of a sample `width_mm` wide: each ink takes what the inks before it leave free."""
    free = 1.0
    for k in range(edges.shape[0]):
        depth = _depth(x - offsets_mm[k, 0], y - offsets_mm[k, 1], edges[k], frame, abs(spread_mm) + width_mm)
        share = min(max(0.5 + (depth + spread_mm) / width_mm, 0.0), free)
        shares[k] = share
        free -= share


@njit(**CALLED)
def _quadratic(before: float, middle: float, behind: float, t: float) -> float:
    """Through values at -1, 0 and 1."""
    return middle + t * (0.5 * (behind - before) + t * (0.5 * (behind + before) - middle))


@njit(**KERNEL)
def ink_shares(
    nodes_mm: NDArray[np.float64],
    samples: int,
    edges: NDArray[np.uint16],
    frame: NDArray[np.float64],
    spread_mm: float,
    offsets_mm: NDArray[np.float64],
    width_mm: float,
) -> NDArray[np.float32]:
    """Share of each ink at the samples of square windows.

    Parameters
    ----------
    nodes_mm : (n, 3, 3, 2) float64 array
        Millimetres at the first, middle and last sample of each window, [row, column]; biquadratic between them.
    samples : int
        Samples along each side of a window.
    edges, frame : see `ink_tables`
    spread_mm : float
        Growth of every edge of ink.
    offsets_mm : (L, 2) float64 array
        Displacement of each ink.
    width_mm : float
        Of a sample.

    Returns
    -------
    (n, L, samples, samples) float32 array
    """
    n, inks = nodes_mm.shape[0], edges.shape[0]
    result = np.empty((n, inks, samples, samples), np.float32)
    for w in range(n):
        shares = np.empty(inks)
        line = np.empty((3, 2))
        for row in range(samples):
            t = 2.0 * row / (samples - 1) - 1.0
            for k in range(3):
                for c in range(2):
                    line[k, c] = _quadratic(nodes_mm[w, 0, k, c], nodes_mm[w, 1, k, c], nodes_mm[w, 2, k, c], t)
            for column in range(samples):
                t = 2.0 * column / (samples - 1) - 1.0
                x = _quadratic(line[0, 0], line[1, 0], line[2, 0], t)
                y = _quadratic(line[0, 1], line[1, 1], line[2, 1], t)
                _shares_at(x, y, edges, frame, spread_mm, offsets_mm, width_mm, shares)
                for k in range(inks):
                    result[w, k, row, column] = shares[k]
    return result


@njit(**KERNEL)
def pixel_shares(
    centres_mm: NDArray[np.float64],
    edges: NDArray[np.uint16],
    frame: NDArray[np.float64],
    spread_mm: float,
    offsets_mm: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Share of each ink in the area of each projector pixel.

    Parameters
    ----------
    centres_mm : (H, W, 2) float64 array
        Millimetres of the pixels' centres; a pixel reaches half-way to its neighbours.
    edges, frame, spread_mm, offsets_mm : see `ink_shares`

    Returns
    -------
    (H, W, L) float32 array
    """
    height, width = centres_mm.shape[:2]
    inks = edges.shape[0]
    result = np.empty((height, width, inks), np.float32)
    for row in range(height):
        shares, sums = np.empty(inks), np.empty(inks)
        up, down = max(row - 1, 0), min(row + 1, height - 1)
        for column in range(width):
            left, right = max(column - 1, 0), min(column + 1, width - 1)
            x, y = centres_mm[row, column, 0], centres_mm[row, column, 1]
            xu = (centres_mm[row, right, 0] - centres_mm[row, left, 0]) / (right - left)
            yu = (centres_mm[row, right, 1] - centres_mm[row, left, 1]) / (right - left)
            xv = (centres_mm[down, column, 0] - centres_mm[up, column, 0]) / (down - up)
            yv = (centres_mm[down, column, 1] - centres_mm[up, column, 1]) / (down - up)
            width_mm = math.sqrt(abs(xu * yv - xv * yu)) / _SUBSAMPLES
            sums[:] = 0.0
            for j in range(_SUBSAMPLES):
                dv = (j + 0.5) / _SUBSAMPLES - 0.5
                for i in range(_SUBSAMPLES):
                    du = (i + 0.5) / _SUBSAMPLES - 0.5
                    px, py = x + xu * du + xv * dv, y + yu * du + yv * dv
                    _shares_at(px, py, edges, frame, spread_mm, offsets_mm, width_mm, shares)
                    for k in range(inks):
                        sums[k] += shares[k]
            for k in range(inks):
                result[row, column, k] = sums[k] / _SUBSAMPLES**2
    return result
