"""Kernel of void-and-cluster: the tightest cluster and the largest void of ones on a torus.

Plain arrays in and out; the checked function around it is `paxel_design.patterns.void_and_cluster`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["fill_voids", "relax"]


@njit(**CALLED)
def _scan(
    ones: NDArray[np.uint8], blurred: NDArray[np.float64], best: NDArray[np.float64], at: NDArray[np.int64], r: int
) -> None:
    """The most crowded 1 (``best[1, r]``, in column ``at[1, r]``) and least crowded 0 of a row; the first of equals."""
    best[0, r] = best[1, r] = -np.inf
    at[0, r] = at[1, r] = -1
    for c in range(ones.shape[1]):
        value = ones[r, c]
        crowd = blurred[r, c] if value == 1 else -blurred[r, c]
        if at[value, r] < 0 or crowd > best[value, r] + 1e-12:
            best[value, r], at[value, r] = crowd, c


@njit(**CALLED)
def _scan_all(ones: NDArray[np.uint8], blurred: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    best, at = np.empty((2, ones.shape[0])), np.empty((2, ones.shape[0]), np.int64)
    for r in range(ones.shape[0]):
        _scan(ones, blurred, best, at, r)
    return best, at


@njit(**CALLED)
def _extreme(best: NDArray[np.float64], at: NDArray[np.int64], value: int) -> tuple[int, int]:
    """Row and column of the tightest cluster (1) or the largest void (0); the first of equals."""
    r_best = 0
    for r in range(best.shape[1]):
        if best[value, r] > best[value, r_best] + 1e-12:
            r_best = r
    return r_best, at[value, r_best]


@njit(**CALLED)
def _set(
    ones: NDArray[np.uint8],
    blurred: NDArray[np.float64],
    kernel: NDArray[np.float64],
    best: NDArray[np.float64],
    at: NDArray[np.int64],
    r: int,
    c: int,
    value: int,
) -> None:
    """Set one cell, and bring up to date what depends on it: the rows within the kernel's reach."""
    ones[r, c] = value
    height, width = blurred.shape
    radius = kernel.shape[0] // 2
    sign = 1.0 if value == 1 else -1.0
    for dr in range(-radius, radius + 1):
        row = (r + dr) % height
        for dc in range(-radius, radius + 1):
            blurred[row, (c + dc) % width] += sign * kernel[radius + dr, radius + dc]
        _scan(ones, blurred, best, at, row)


@njit(**KERNEL)
def relax(ones: NDArray[np.uint8], blurred: NDArray[np.float64], kernel: NDArray[np.float64], most: int) -> int:
    """Move the one of the tightest cluster into the largest void until it falls back into its own place.

    Parameters
    ----------
    ones : (H, W) uint8 array
        Changed in place.
    blurred : (H, W) float64 array
        `ones` convolved with `kernel` on the torus; kept up to date in place.
    kernel : (2 R + 1, 2 R + 1) float64 array
        Even kernel, 2 R + 1 <= H, W.
    most : int
        Moves at most.

    Returns
    -------
    int
        Number of moves.
    """
    best, at = _scan_all(ones, blurred)
    for move in range(most):
        cluster = _extreme(best, at, 1)
        _set(ones, blurred, kernel, best, at, cluster[0], cluster[1], 0)
        void = _extreme(best, at, 0)
        _set(ones, blurred, kernel, best, at, void[0], void[1], 1)
        if void == cluster:
            return move
    return most


@njit(**KERNEL)
def fill_voids(ones: NDArray[np.uint8], blurred: NDArray[np.float64], kernel: NDArray[np.float64], count: int) -> None:
    """Set the largest void to one, `count` times; arrays as for `relax`."""
    best, at = _scan_all(ones, blurred)
    for _ in range(count):
        r, c = _extreme(best, at, 0)
        _set(ones, blurred, kernel, best, at, r, c, 1)
