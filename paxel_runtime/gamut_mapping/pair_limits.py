"""What the joint gamut leaves to two numbers of a pixel pair: half-planes about where they are now.

Each pixel pair has one free number on each surface (its lightness, or how far its chroma goes). The half-spaces of the
joint gamut bound the two together; about a point they are half-planes, and nearest points in those are exact. Knows
CIELAB and half-spaces; nothing of pictures.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.model.lab_scalars import cube, cube_slope
from paxel_runtime.model.subgamut import PairGamut
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["half_planes", "nearest_inside", "pair_to_XYZ", "relevant_rows"]

_PLANES = 8
"""Half-planes kept for each pair: the nearest of each eighth of all directions."""
_FAR = 1e9
_PROBES = 400
_REACH_L = (0.0, 12.0, 30.0)
"""How far around the probes `relevant_rows` looks, L*."""
_FEW = 60
_TOUCHING = 1e-9


def relevant_rows(pairs: PairGamut, Lab: NDArray[np.float64]) -> PairGamut:
    """The half-spaces that bound pairs near those given, where there are many: those hit first from some of them.

    What is left out for the fit is looked at again when pairs are pulled inside.

    Parameters
    ----------
    pairs : PairGamut
    Lab : (n, 6) float64 array
        Lab on the pattern, then on the white surface.
    """
    if len(pairs.offsets) <= _FEW:
        return pairs
    probes = Lab[:: max(1, len(Lab) // _PROBES)]
    angles = np.arange(12) * (np.pi / 6)
    moved = []
    for reach in _REACH_L:
        for angle in angles:
            shifted = probes.copy()
            shifted[:, 0] = np.clip(shifted[:, 0] + reach * np.cos(angle), 0, 100)
            shifted[:, 3] = np.clip(shifted[:, 3] + reach * np.sin(angle), 0, 100)
            moved.append(shifted)
    nearest = np.empty(len(moved) * len(probes), np.int64)
    in_bands(partial(_nearest_rows, np.concatenate(moved), *_arrays(pairs), nearest), len(nearest))
    kept = np.unique(nearest)
    return PairGamut(pairs.normals[kept], pairs.offsets[kept], pairs.white_point)


def _arrays(pairs: PairGamut) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Normals, offsets and white point in one layout: kernels are compiled once."""
    first, second, third = (np.array(a, np.float64) for a in (pairs.normals, pairs.offsets, pairs.white_point))
    return first, second, third


def half_planes(
    Lab: NDArray[np.float64],
    direction: NDArray[np.float64],
    at: NDArray[np.float64],
    pairs: PairGamut,
    margin: float = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Half-planes ``normals @ u <= offsets`` over the two free numbers u of each pair.

    Parameters
    ----------
    Lab : (n, 6) float64 array
        The pairs at ``u = at``: Lab on the pattern, then on the white surface.
    direction : (n, 6) float64 array
        d Lab / d u: columns 0 to 2 by the number of the pattern, 3 to 5 by that of the white surface.
    at : (n, 2) float64 array
    pairs : PairGamut
    margin : float
        How far inside the boundary to stay, in units of u.

    Returns
    -------
    normals : (n, 8, 2) float64 array
        Unit rows, the nearest of each eighth of all directions; zero where there is none.
    offsets : (n, 8) float64 array
    """
    normals, offsets = np.zeros((len(Lab), _PLANES, 2)), np.full((len(Lab), _PLANES), _FAR)
    points = (np.ascontiguousarray(a) for a in (Lab, direction, at))
    in_bands(partial(_half_planes, *points, *_arrays(pairs), normals, offsets), len(Lab))
    return normals, offsets - margin


@njit(**CALLED)
def pair_to_XYZ(Lab: NDArray[np.float64], white: NDArray[np.float64], XYZ: NDArray[np.float64]) -> None:
    """XYZ (6,) of a pair's Lab (6,), into `XYZ`."""
    for s in range(0, 6, 3):
        f = (Lab[s] + 16.0) / 116.0
        XYZ[s] = white[0] * cube(f + Lab[s + 1] / 500.0)
        XYZ[s + 1] = white[1] * cube(f)
        XYZ[s + 2] = white[2] * cube(f - Lab[s + 2] / 200.0)


@njit(**CALLED)
def _pair_derivative(
    Lab: NDArray[np.float64], step: NDArray[np.float64], white: NDArray[np.float64], dXYZ: NDArray[np.float64]
) -> None:
    for s in range(0, 6, 3):
        f, df = (Lab[s] + 16.0) / 116.0, step[s] / 116.0
        dXYZ[s] = white[0] * cube_slope(f + Lab[s + 1] / 500.0) * (df + step[s + 1] / 500.0)
        dXYZ[s + 1] = white[1] * cube_slope(f) * df
        dXYZ[s + 2] = white[2] * cube_slope(f - Lab[s + 2] / 200.0) * (df - step[s + 2] / 200.0)


@njit(**KERNEL)
def _half_planes(
    Lab: NDArray[np.float64],
    direction: NDArray[np.float64],
    at: NDArray[np.float64],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    white: NDArray[np.float64],
    normals: NDArray[np.float64],
    offsets: NDArray[np.float64],
    first: int,
    stop: int,
) -> None:
    for i in range(first, stop):
        _planes_of_pair(Lab[i], direction[i], at[i], rows, row_offsets, white, normals[i], offsets[i])


@njit(**CALLED)
def _planes_of_pair(
    Lab: NDArray[np.float64],
    direction: NDArray[np.float64],
    at: NDArray[np.float64],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    white: NDArray[np.float64],
    normals: NDArray[np.float64],
    offsets: NDArray[np.float64],
) -> None:
    XYZ, dXYZ = np.empty(6), np.empty(6)
    pair_to_XYZ(Lab, white, XYZ)
    _pair_derivative(Lab, direction, white, dXYZ)
    for r in range(len(row_offsets)):
        u, v, slack = 0.0, 0.0, row_offsets[r]
        for c in range(3):
            u += rows[r, c] * dXYZ[c]
            v += rows[r, c + 3] * dXYZ[c + 3]
            slack -= rows[r, c] * XYZ[c] + rows[r, c + 3] * XYZ[c + 3]
        size = np.sqrt(u * u + v * v)
        if size < 1e-9:
            continue
        distance = slack / size
        k = (4 if u > 0.0 else 0) + (2 if v > 0.0 else 0) + (1 if abs(u) > abs(v) else 0)
        if distance < offsets[k]:
            offsets[k], normals[k, 0], normals[k, 1] = distance, u / size, v / size
    for k in range(_PLANES):
        offsets[k] += normals[k, 0] * at[0] + normals[k, 1] * at[1]


@njit(**KERNEL)
def _nearest_rows(
    Lab: NDArray[np.float64],
    rows: NDArray[np.float64],
    row_offsets: NDArray[np.float64],
    white: NDArray[np.float64],
    nearest: NDArray[np.int64],
    first: int,
    stop: int,
) -> None:
    for i in range(first, stop):
        nearest[i] = _nearest_row(Lab[i], rows, row_offsets, white)


@njit(**CALLED)
def _nearest_row(
    Lab: NDArray[np.float64], rows: NDArray[np.float64], row_offsets: NDArray[np.float64], white: NDArray[np.float64]
) -> int:
    XYZ = np.empty(6)
    pair_to_XYZ(Lab, white, XYZ)
    least, nearest = _FAR, 0
    for r in range(len(row_offsets)):
        slack = row_offsets[r]
        for c in range(6):
            slack -= rows[r, c] * XYZ[c]
        if slack < least:
            least, nearest = slack, r
    return nearest


def nearest_inside(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    offsets: NDArray[np.float64],
    otherwise: NDArray[np.float64],
) -> NDArray[np.float64]:
    """The point nearest to each of `points` (n, 2) in its half-planes; `otherwise` (n, 2) where these leave nothing.

    The nearest point of a convex polygon lies on one edge or on a corner of two; all are tried.
    """
    nearest = np.array(otherwise, np.float64)
    in_bands(partial(_nearest_inside, np.ascontiguousarray(points), normals, offsets, nearest), len(points))
    return nearest


@njit(**KERNEL)
def _nearest_inside(
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    offsets: NDArray[np.float64],
    nearest: NDArray[np.float64],
    first: int,
    stop: int,
) -> None:
    for i in range(first, stop):
        _nearest_point(points[i, 0], points[i, 1], normals[i], offsets[i], nearest[i])


@njit(**CALLED)
def _nearest_point(
    x: float, y: float, normals: NDArray[np.float64], offsets: NDArray[np.float64], nearest: NDArray[np.float64]
) -> None:
    if _worst(x, y, normals, offsets) <= 0.0:
        nearest[0], nearest[1] = x, y
        return
    best = _FAR
    for k in range(len(offsets)):
        beyond = normals[k, 0] * x + normals[k, 1] * y - offsets[k]
        if beyond > 0.0 and beyond * beyond < best:
            px, py = x - beyond * normals[k, 0], y - beyond * normals[k, 1]
            if _worst(px, py, normals, offsets) <= _TOUCHING:
                best, nearest[0], nearest[1] = beyond * beyond, px, py
    if best < _FAR:
        return
    for k in range(len(offsets)):
        for m in range(k):
            a, b, c, d = normals[k, 0], normals[k, 1], normals[m, 0], normals[m, 1]
            determinant = a * d - b * c
            if abs(determinant) < 1e-6:
                continue
            px = (offsets[k] * d - offsets[m] * b) / determinant
            py = (a * offsets[m] - c * offsets[k]) / determinant
            distance = (px - x) ** 2 + (py - y) ** 2
            if distance < best and _worst(px, py, normals, offsets) <= _TOUCHING:
                best, nearest[0], nearest[1] = distance, px, py


@njit(**CALLED)
def _worst(x: float, y: float, normals: NDArray[np.float64], offsets: NDArray[np.float64]) -> float:
    """How far a point lies beyond the plane it breaks most; negative inside."""
    worst = -_FAR
    for k in range(len(offsets)):
        worst = max(worst, normals[k, 0] * x + normals[k, 1] * y - offsets[k])
    return worst
