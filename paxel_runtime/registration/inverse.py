"""The inverse of a lookup table: which projector place lights each camera pixel.

Knows tables; must not know captures.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import KERNEL

__all__ = ["invert_table"]

_ROUNDS = 6
_NEAR_PX = 1e-4
"""Distance before the last round, camera pixels, from which that round ends within 1e-6."""
_SLACK = 1e-6
"""A pixel on the edge of two quads belongs to either."""


def invert_table(camera_xy: NDArray[np.floating], shape: tuple[int, int]) -> NDArray[np.float32]:
    """Projector column and row that light each camera pixel's centre.

    The exact inverse of the table read bilinearly: each quad of four neighbouring projector pixels is inverted where it
    covers centres of camera pixels.

    Parameters
    ----------
    camera_xy : (H, W, 2) array
        Camera column and row of each projector pixel, H and W at least 2.
    shape : (h, w)
        Of the camera's picture.

    Returns
    -------
    (h, w, 2) float32 array
        NaN beyond the outer projector pixels' centres.

    Raises
    ------
    InputError
        If the table's shape does not fit.
    """
    if camera_xy.ndim != 3 or camera_xy.shape[-1] != 2 or min(camera_xy.shape[:2]) < 2:
        raise InputError(f"a lookup table must be (H, W, 2) with H and W at least 2, got {camera_xy.shape}")
    return _invert(np.ascontiguousarray(camera_xy, np.float64), shape[0], shape[1])


@njit(**KERNEL)
def _invert(table: NDArray[np.float64], h: int, w: int) -> NDArray[np.float32]:
    inverse = np.full((h, w, 2), np.float32(np.nan))
    for row in range(table.shape[0] - 1):
        for column in range(table.shape[1] - 1):
            x0, y0 = table[row, column, 0], table[row, column, 1]
            xu, yu = table[row, column + 1, 0] - x0, table[row, column + 1, 1] - y0
            xv, yv = table[row + 1, column, 0] - x0, table[row + 1, column, 1] - y0
            xw = table[row + 1, column + 1, 0] - x0 - xu - xv
            yw = table[row + 1, column + 1, 1] - y0 - yu - yv
            if not math.isfinite(x0 + y0 + xu + yu + xv + yv + xw + yw):
                continue
            left = x0 + min(0.0, xu, xv, xu + xv + xw)
            right = x0 + max(0.0, xu, xv, xu + xv + xw)
            top = y0 + min(0.0, yu, yv, yu + yv + yw)
            low = y0 + max(0.0, yu, yv, yu + yv + yw)
            for y in range(max(math.ceil(top - _SLACK), 0), min(math.floor(low + _SLACK), h - 1) + 1):
                for x in range(max(math.ceil(left - _SLACK), 0), min(math.floor(right + _SLACK), w - 1) + 1):
                    a = b = 0.5
                    off_x = off_y = math.inf
                    for _ in range(_ROUNDS):  # Newton's method; the quads are all but parallelograms
                        off_x = x0 + a * xu + b * xv + a * b * xw - x
                        off_y = y0 + a * yu + b * yv + a * b * yw - y
                        ju, jv = xu + b * xw, xv + a * xw
                        ku, kv = yu + b * yw, yv + a * yw
                        area = ju * kv - jv * ku
                        a -= (off_x * kv - off_y * jv) / area
                        b -= (off_y * ju - off_x * ku) / area
                    there = -_SLACK <= a <= 1.0 + _SLACK and -_SLACK <= b <= 1.0 + _SLACK
                    # outside of the quad the method may still be under way, and be inside by chance
                    if there and off_x * off_x + off_y * off_y < _NEAR_PX * _NEAR_PX:
                        inverse[y, x, 0] = column + a
                        inverse[y, x, 1] = row + b
    return inverse
