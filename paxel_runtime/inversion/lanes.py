"""Pixels side by side: rows of a flat workspace, and the small vectors and matrices that lanes hold in registers.

The loops over `LANES` pixels are the inner ones and become SIMD instructions. That needs one flat workspace addressed
by constants (``w[NU + 2 * LANES + lane]``), so that the compiler can see that rows do not overlap. Of a quantity's 6
rows the first 3 belong to the pattern, the others to the white surface.

Inputs, A and black may be those of all pixels or each pixel's own; the compiler keeps the branch that fits. Knows
nothing of colour or of what is solved.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import INLINED

__all__ = [
    "LANES",
    "Floats",
    "Surfaces",
    "Sym3",
    "Vec3",
    "Vec6",
    "along",
    "black_of",
    "clip",
    "column",
    "dot",
    "factor",
    "lane_columns",
    "larger",
    "smaller",
    "solve3",
    "sym3",
    "take_own",
    "times",
    "vec3",
]

LANES = 16
"""Pixels solved side by side."""

Floats: TypeAlias = NDArray[np.float64]
Vec3: TypeAlias = tuple[float, float, float]
Vec6: TypeAlias = tuple[float, float, float, float, float, float]
Sym3: TypeAlias = tuple[float, float, float, float, float, float]
"""00 01 02 11 12 22 of a symmetric matrix."""
Surfaces: TypeAlias = tuple[int, ...]
"""(0,) or (0, 1): its length is part of its type, so kernels are compiled for one surface and for two."""


@njit(**INLINED)
def larger(a: float, b: float) -> float:
    return a if a > b else b  # the built-in max and min are calls, which end vectorisation


@njit(**INLINED)
def smaller(a: float, b: float) -> float:
    return a if a < b else b


@njit(**INLINED)
def clip(t: float) -> float:
    return smaller(larger(t, 0.0), 1.0)


@njit(**INLINED)
def factor(p: Sym3) -> Sym3:
    """L D L^T of a symmetric 3 x 3 matrix: l10, l20, l21, 1/d0, 1/d1, 1/d2."""
    i0 = 1.0 / p[0]
    l10, l20 = p[1] * i0, p[2] * i0
    i1 = 1.0 / (p[3] - l10 * p[1])
    c21 = p[4] - l20 * p[1]
    l21 = c21 * i1
    i2 = 1.0 / (p[5] - l20 * p[2] - l21 * c21)
    return l10, l20, l21, i0, i1, i2


@njit(**INLINED)
def solve3(f: Sym3, r: Vec3) -> Vec3:
    """Solution of a 3 x 3 system from its `factor`."""
    y1 = r[1] - f[0] * r[0]
    y2 = (r[2] - f[1] * r[0] - f[2] * y1) * f[5]
    x1 = y1 * f[4] - f[2] * y2
    return r[0] * f[3] - f[0] * x1 - f[1] * y2, x1, y2


@njit(**INLINED)
def dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INLINED)
def times(s: Sym3, v: Vec3) -> Vec3:
    return (
        s[0] * v[0] + s[1] * v[1] + s[2] * v[2],
        s[1] * v[0] + s[3] * v[1] + s[4] * v[2],
        s[2] * v[0] + s[4] * v[1] + s[5] * v[2],
    )


@njit(**INLINED)
def vec3(w: Floats, row: int) -> Vec3:
    return w[row], w[row + LANES], w[row + 2 * LANES]


@njit(**INLINED)
def sym3(w: Floats, first: int, rest: int) -> Sym3:
    return w[first], w[first + LANES], w[first + 2 * LANES], w[rest], w[rest + LANES], w[rest + 2 * LANES]


@njit(**INLINED)
def column(AT: Floats, j: int, lane: int) -> Vec6:
    """What input j adds at full, on both surfaces."""
    if AT.ndim == 2:
        return AT[j, 0], AT[j, 1], AT[j, 2], AT[j, 3], AT[j, 4], AT[j, 5]
    return AT[j, 0, lane], AT[j, 1, lane], AT[j, 2, lane], AT[j, 3, lane], AT[j, 4, lane], AT[j, 5, lane]


@njit(**INLINED)
def along(a: Vec6, w: Floats, row: int, surfaces: Surfaces) -> float:
    """Product of a column of A with 3 rows of the workspace for each surface."""
    product = a[0] * w[row] + a[1] * w[row + LANES] + a[2] * w[row + 2 * LANES]
    if len(surfaces) == 2:
        product += a[3] * w[row + 3 * LANES] + a[4] * w[row + 4 * LANES] + a[5] * w[row + 5 * LANES]
    return product


@njit(**INLINED)
def lane_columns(AT: Floats) -> Floats:
    """A as the lanes use it: the one of all pixels, or room for one a lane."""
    if AT.ndim == 2:
        return AT
    return np.zeros((AT.shape[1], 6, LANES))


@njit(**INLINED)
def take_own(AT: Floats, pixel: int, lane: int, columns: Floats) -> None:
    """Give a lane the A of its pixel, where each has its own."""
    if AT.ndim == 3:
        for j in range(AT.shape[1]):
            for i in range(6):
                columns[j, i, lane] = AT[pixel, j, i]


@njit(**INLINED)
def black_of(black: Floats, pixel: int, i: int) -> float:
    if black.ndim == 1:
        return black[i]
    return black[pixel, i]
