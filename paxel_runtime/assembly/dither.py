"""Assembly: inputs x of every pixel and cluster -> the projection image (paper: section V-A3, Eq. 6).

Each projector pixel lights one cluster, so it takes that cluster's N inputs and drops the others (the paper's
*simplified dithering*); the inverse response then gives device codes. Knows nothing of colours or pictures.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.response import ProjectorResponse

__all__ = ["assemble"]

_OUTSIDE_P = {"black": 0.0, "white": 1.0}
_ROWS_AT_ONCE = 256
_SLACK = 1e-4
"""How far x may leave [0, 1] and still be rounding: below a tenth of a code of 10 bits."""


def assemble(
    x: NDArray[np.float32],
    labels: NDArray[np.uint8],
    response: ProjectorResponse,
    bits: int,
    outside: str = "black",
) -> NDArray[np.unsignedinteger]:
    """Projection image of Eq. 6: each pixel takes its own cluster's inputs, as device codes.

    Parameters
    ----------
    x : (H, W, n) float32 array
        Linear intensities 0..1 that each pixel's neighbourhood should get, n = K N; may be a memory map, it is read
        in tiles of rows.
    labels : (H, W) uint8 array
        Cluster of each pixel, 0..K-1; 255 = outside the pattern.
    response : ProjectorResponse
        N curves; the inverse gives P from x.
    bits : int
        Bits of a device code, 1..16.
    outside : "black" | "white"
        What pixels outside the pattern show: no light, or all channels at full.

    Returns
    -------
    (H, W, N) uint8 (up to 8 bits) or uint16 array
        Codes 0..2**bits - 1, rounded to the nearest.

    Raises
    ------
    InputError
        If shapes do not fit, a label names no cluster, or x is not a number or outside 0..1 inside the pattern.
    """
    channels = len(response.code)
    clusters = _check(x, labels, channels, bits, outside)
    x_points, P_points = response.inverse_tables
    full = 2**bits - 1
    codes = np.full((*labels.shape, channels), round(_OUTSIDE_P[outside] * full), np.uint8 if bits <= 8 else np.uint16)
    bad = 0
    for row in range(0, len(labels), _ROWS_AT_ONCE):
        tile = slice(row, row + _ROWS_AT_ONCE)
        x_tile = np.ascontiguousarray(x[tile], np.float32)
        bad += int(
            _assemble_rows(x_tile, np.ascontiguousarray(labels[tile]), x_points, P_points, full, clusters, codes[tile])
        )
    if bad:
        raise InputError(f"x must be numbers in 0..1 inside the pattern, got {bad} that are not: was it inverted?")
    return codes


def _check(x: NDArray[np.float32], labels: NDArray[np.uint8], channels: int, bits: int, outside: str) -> int:
    """Number of clusters K; raises where the rules are broken."""
    if x.ndim != 3 or labels.shape != x.shape[:2] or labels.dtype != np.uint8:
        raise InputError(f"assembly needs x (H, W, n) and labels (H, W) uint8, got {x.shape} and {labels.shape}")
    clusters, rest = divmod(x.shape[2], channels)
    if rest or not clusters:
        raise InputError(f"x must have K times {channels} inputs a pixel (clusters times channels), got {x.shape[2]}")
    if not 1 <= bits <= 16:
        raise InputError(f"projector.bits must be 1..16, got {bits}")
    if outside not in _OUTSIDE_P:
        raise InputError(f"assembly.outside must be one of {', '.join(_OUTSIDE_P)}; got {outside!r}")
    unknown = labels[(labels >= clusters) & (labels != 255)]
    if unknown.size:
        raise InputError(
            f"cluster labels must be below {clusters} (x has {x.shape[2]} inputs) or 255, got {int(unknown.max())}; "
            "model.json and clusters.png must come from the same calibration"
        )
    return clusters


@njit(cache=True, error_model="numpy")
def _interpolate(x: float, x_points: NDArray[np.float64], P_points: NDArray[np.float64]) -> float:
    """P at x by bisection, as the inverse response has it: a table on a uniform grid of x is too coarse near black."""
    low, high = 0, len(x_points) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if x_points[middle] <= x:
            low = middle
        else:
            high = middle
    if not x_points[high] < np.inf:
        return P_points[low]  # the end of a shorter table
    t = min((x - x_points[low]) / (x_points[high] - x_points[low]), 1.0)
    return P_points[low] + t * (P_points[high] - P_points[low])


@njit(cache=True, parallel=True, error_model="numpy")
def _assemble_rows(
    x: NDArray[np.float32],
    labels: NDArray[np.uint8],
    x_points: NDArray[np.float64],
    P_points: NDArray[np.float64],
    full: int,
    clusters: int,
    codes: NDArray[np.unsignedinteger],
) -> int:
    """Fill `codes` where `labels` names a cluster; returns how many inputs were no intensities."""
    height, width = labels.shape
    channels = x_points.shape[0]
    bad = 0
    for row in prange(height):
        for column in range(width):
            label = labels[row, column]
            if label >= clusters:
                continue
            for j in range(channels):
                value = np.float64(x[row, column, label * channels + j])
                if not (value >= -_SLACK and value <= 1.0 + _SLACK):  # also true of NaN
                    bad += 1
                    continue
                P = _interpolate(min(max(value, 0.0), 1.0), x_points[j], P_points[j])
                codes[row, column, j] = int(P * full + 0.5)
    return bad
