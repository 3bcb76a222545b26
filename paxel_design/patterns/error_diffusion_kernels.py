"""Kernel of error diffusion of a constant gray, with a threshold modulated at random (Zhou & Fang 2003).

Plain numbers in, an array out; the checked function around it is `paxel_design.patterns.zhou_fang.zhou_fang_sheet`.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL

__all__ = ["diffuse"]


@njit(**KERNEL)
def diffuse(
    share: float,
    right: float,
    down_left: float,
    down: float,
    modulation: float,
    rows: int,
    columns: int,
    guard: int,
    random_state: np.uint64,
) -> NDArray[np.uint8]:
    """Serpentine error diffusion to three neighbours of a constant gray.

    Parameters
    ----------
    share : float
        Gray, 0..1: the share of ones.
    right, down_left, down : float
        Parts of the error, summing to 1; mirrored in rows that run leftwards. What would leave the sheet at a side
        stays in the neighbour below.
    modulation : float
        Strength m, 0..1: the threshold is 1/2 + m u / 2 with u uniform in [0, 1), drawn anew for each cell.
    rows, columns : int
        Size of the sheet that is kept.
    guard : int
        Rows above and below and columns at the sides that are diffused as well, and dropped.
    random_state : uint64
        Start of u, any number.

    Returns
    -------
    (rows, columns) uint8 array
        Zeros and ones.
    """
    width = columns + 2 * guard
    ones = np.empty((rows, columns), np.uint8)
    this, below = np.full(width, share), np.full(width, share)
    for r in range(rows + 2 * guard):
        step = 1 if r % 2 == 0 else -1
        c = 0 if step == 1 else width - 1
        for _ in range(width):
            # splitmix64 (Steele, Lea & Flood 2014): no array of random numbers as large as a wall
            random_state += np.uint64(0x9E3779B97F4A7C15)
            u = random_state
            u = (u ^ (u >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
            u = (u ^ (u >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
            u = u ^ (u >> np.uint64(31))
            threshold = 0.5 + 0.5 * modulation * float(u >> np.uint64(11)) * 2.0**-53
            value = this[c]
            one = value > threshold
            error = value - 1.0 if one else value
            if guard <= r < rows + guard and guard <= c < columns + guard:
                ones[r - guard, c - guard] = one
            ahead, behind = c + step, c - step
            below[c] += error * down
            if 0 <= ahead < width:
                this[ahead] += error * right
            else:
                below[c] += error * right
            if 0 <= behind < width:
                below[behind] += error * down_left
            else:
                below[c] += error * down_left
            c = ahead
        this, below = below, this
        below[:] = share
    return ones
