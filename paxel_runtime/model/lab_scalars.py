"""CIELAB of one colour at a time, with derivatives, for kernels (CIE 15:2018, section 8.2.1).

The formulas of ``colorimetry``, which is checked against them; arrays belong there. Kernels that work in SIMD lanes or
in float32 have their own, for speed (``inversion/local_model.py``, ``inversion/frame_kernels.py``).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, INLINED

__all__ = [
    "ab_of",
    "cube",
    "cube_slope",
    "lightness_of",
    "luminance_of",
    "root",
    "root_slope",
    "slope_in_Lab",
]

_BEND = 6.0 / 29.0
_LINEAR = 116.0 * (3.0 / 29.0) ** 3
"""Inverse of the slope of CIELAB's f near black."""


@njit(**CALLED)
def root(t: float) -> float:
    """CIELAB's f of a share of the white."""
    return np.cbrt(t) if t > _BEND**3 else t / _LINEAR + 16.0 / 116.0


@njit(**CALLED)
def root_slope(t: float) -> float:
    """Derivative of `root`."""
    return np.cbrt(t) ** -2 / 3.0 if t > _BEND**3 else 1.0 / _LINEAR


@njit(**INLINED)
def cube(f: float) -> float:
    """Inverse of `root`: the share of the white."""
    return f * f * f if f > _BEND else (f - 16.0 / 116.0) * _LINEAR


@njit(**INLINED)
def cube_slope(f: float) -> float:
    """Derivative of `cube`."""
    return 3.0 * f * f if f > _BEND else _LINEAR


@njit(**CALLED)
def lightness_of(Y: float) -> float:
    """L* of a share Y of the white."""
    return 116.0 * root(Y) - 16.0


@njit(**CALLED)
def luminance_of(L: float) -> float:
    """Inverse of `lightness_of`."""
    return cube((L + 16.0) / 116.0)


@njit(**CALLED)
def ab_of(XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> tuple[float, float]:
    """a* and b* of a colour (3,)."""
    fx, fy, fz = root(XYZ[0] / white[0]), root(XYZ[1] / white[1]), root(XYZ[2] / white[2])
    return 500.0 * (fx - fy), 200.0 * (fy - fz)


@njit(**CALLED)
def slope_in_Lab(
    slope: NDArray[np.float64], XYZ: NDArray[np.float64], white: NDArray[np.float64], found: NDArray[np.float64]
) -> None:
    """Turn derivatives along X, Y, Z at a colour (3,), the first 3 of `slope`, into those along L*, a*, b*, (3,)."""
    x = slope[0] * white[0] / root_slope(XYZ[0] / white[0])
    y = slope[1] * white[1] / root_slope(XYZ[1] / white[1])
    z = slope[2] * white[2] / root_slope(XYZ[2] / white[2])
    found[0], found[1], found[2] = (x + y + z) / 116.0, x / 500.0, -z / 200.0
