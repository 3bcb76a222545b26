"""Kernel of the swap optimiser: which two cells to swap on a torus, and what a swap changes.

Plain arrays in and out; the checked function around it is `paxel_design.patterns.swap`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["sweep"]


@njit(**KERNEL)
def sweep(
    cells: NDArray[np.uint8],
    blurred: NDArray[np.float64],
    kernel: NDArray[np.float64],
    weights: NDArray[np.float64],
    order: NDArray[np.int64],
    far: NDArray[np.int64],
    reach: int,
) -> int:
    """Visit every cell once; swap it with the partner that lowers the energy most, if one does.

    Parameters
    ----------
    cells : (H, W) uint8 array
        Classes; changed in place.
    blurred : (n, H, W) float64 array
        The n indicator fields convolved with `kernel` on the torus; kept up to date in place.
    kernel : (2 R + 1, 2 R + 1) float64 array
        Even kernel of the energy, 2 R + 1 <= H, W.
    weights : (n,) float64 array
        Weight of each class in the energy.
    order : (H W,) int64 array
        Order of the visits, flat indices.
    far : (H W, F) int64 array
        Partners anywhere, flat indices, for each visit.
    reach : int
        Partners are also all cells at most `reach` away in row and column, ``reach <= R``.

    Returns
    -------
    int
        Number of swaps.
    """
    height, width = cells.shape
    radius = kernel.shape[0] // 2
    peak = kernel[radius, radius]
    swaps = 0
    near = 2 * reach + 1
    for visit in range(order.size):
        r, c = divmod(order[visit], width)
        a = cells[r, c]
        best, r_best, c_best = -1e-12, -1, -1
        for candidate in range(near * near + far.shape[1]):
            if candidate < near * near:
                dr, dc = candidate // near - reach, candidate % near - reach
                r2, c2 = _wrap(r + dr, height), _wrap(c + dc, width)
            else:
                r2, c2 = divmod(far[visit, candidate - near * near], width)
                dr = _wrap(r2 - r + height // 2, height) - height // 2
                dc = _wrap(c2 - c + width // 2, width) - width // 2
            b = cells[r2, c2]
            if a == b:
                continue
            between = 0.0
            if abs(dr) <= radius and abs(dc) <= radius:
                between = kernel[radius + dr, radius + dc]
            # half of the change of sum_k w_k <b_k, G b_k> when classes a and b change places
            change = weights[a] * (blurred[a, r2, c2] - blurred[a, r, c])
            change += weights[b] * (blurred[b, r, c] - blurred[b, r2, c2])
            change += (weights[a] + weights[b]) * (peak - between)
            if change < best:
                best, r_best, c_best = change, r2, c2
        if r_best < 0:
            continue
        b = cells[r_best, c_best]
        cells[r, c], cells[r_best, c_best] = b, a
        _move(blurred[a], kernel, r, c, r_best, c_best)
        _move(blurred[b], kernel, r_best, c_best, r, c)
        swaps += 1
    return swaps


@njit(**CALLED)
def _wrap(index: int, size: int) -> int:
    """Index on the torus of one that is at most once around it outside: a remainder costs more than the rest."""
    if index < 0:
        return index + size
    if index >= size:
        return index - size
    return index


@njit(**CALLED)
def _move(blurred: NDArray[np.float64], kernel: NDArray[np.float64], r: int, c: int, r_to: int, c_to: int) -> None:
    """Update one blurred field when a cell of its class leaves (r, c) for (r_to, c_to)."""
    height, width = blurred.shape
    radius = kernel.shape[0] // 2
    for dr in range(-radius, radius + 1):
        from_row, to_row = _wrap(r + dr, height), _wrap(r_to + dr, height)
        for dc in range(-radius, radius + 1):
            value = kernel[radius + dr, radius + dc]
            blurred[from_row, _wrap(c + dc, width)] -= value
            blurred[to_row, _wrap(c_to + dc, width)] += value
