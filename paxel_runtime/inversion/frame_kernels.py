"""Kernels of the frame plan: 8-bit sRGB -> mapped XYZ -> linear inputs -> device codes, in float32 and SIMD lanes.

`frame_plan.py` makes the arguments and documents the method. Loops over `LANES` pixels are the inner ones and become
SIMD instructions: rows of LANES values lie one behind the other in flat arrays, and matrices are walked in blocks of
3 x 3, filled up with zeros, so that a value read serves three products. Plain arrays in and out, no checks.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.table import tetrahedron
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["ROUNDS", "STEP", "fill_codes"]

Floats: TypeAlias = NDArray[np.float32]
Pictures: TypeAlias = tuple[NDArray[np.uint8], NDArray[np.uint8]]

ROUNDS = 16
"""Of clip and correct: the worst of 20,000 reachable pairs is then 0.6 dE00 or better at K = 3."""
STEP = 1.6
"""How far a round corrects, in shares of what is missing."""

LANES = 128  # enough to hide what a loop costs to start, and few enough for the L1 cache
_ONE, _HALF, _ZERO = np.float32(1.0), np.float32(0.5), np.float32(0.0)
_ROUNDING = np.float32(0.5 + 1e-5)
_EPSILON = np.float32((6.0 / 29.0) ** 3)
_SLOPE = np.float32((29.0 / 6.0) ** 2 / 3.0)
_FOOT = np.float32(16.0 / 116.0)
_LANE_LOOPS = {key: value for key, value in INLINED.items() if key != "forceinline"}


@njit(**INLINED)
def _f(t: np.float32) -> np.float32:
    """CIELAB's f(t) for t in 0..1.1: a rational guess of t^(-1/3) and two steps of third order, to float32."""
    r = t if t > _EPSILON else _EPSILON
    z = (np.float32(6.45678683) + np.float32(90.25077234) * r) / (
        _ONE + r * (np.float32(59.37364678) + np.float32(38.11441394) * r)
    )
    h = _ONE - r * z * z * z
    z += z * h * (np.float32(1.0 / 3.0) + h * np.float32(2.0 / 9.0))
    h = _ONE - r * z * z * z
    z += z * h * (np.float32(1.0 / 3.0) + h * np.float32(2.0 / 9.0))
    return r * z * z if t > _EPSILON else _SLOPE * t + _FOOT


@njit(**INLINED)
def _inverse_f(f: np.float32) -> np.float32:
    return f * f * f if f > np.float32(6.0 / 29.0) else (f - _FOOT) / _SLOPE


@njit(**INLINED)
def _clip(t: np.float32) -> np.float32:
    low = t if t > _ZERO else _ZERO
    return low if low < _ONE else _ONE


@njit(**_LANE_LOOPS)
def _affine_f(rgb: Floats, affine: Floats, to_t: Floats, f: Floats) -> None:
    """CIELAB's f of X, Y, Z (3 rows) that an affine mapping makes of linear sRGB (3 rows)."""
    foot, gain, chroma = affine[0], affine[1], affine[2]
    m00, m01, m02 = to_t[0, 0], to_t[0, 1], to_t[0, 2]
    m10, m11, m12 = to_t[1, 0], to_t[1, 1], to_t[1, 2]
    m20, m21, m22 = to_t[2, 0], to_t[2, 1], to_t[2, 2]
    for lane in range(LANES):
        r, g, b = rgb[lane], rgb[LANES + lane], rgb[2 * LANES + lane]
        fx = _f(m00 * r + m01 * g + m02 * b)
        fy = _f(m10 * r + m11 * g + m12 * b)
        fz = _f(m20 * r + m21 * g + m22 * b)
        to = foot + gain * fy
        f[lane] = to + chroma * (fx - fy)
        f[LANES + lane] = to
        f[2 * LANES + lane] = to - chroma * (fy - fz)


@njit(**_LANE_LOOPS)
def _tabled_f(picture: NDArray[np.uint8], first: int, count: int, table: Floats, nodes: int, f: Floats) -> None:
    """The same from a table of f (nodes^3, 3), for `count` pixels of a picture (pixels, 3) from `first` on."""
    for lane in range(count):
        p = first + lane
        (dark, second, third, bright), (w0, w1, w2, w3) = tetrahedron(
            nodes, picture[p, 0], picture[p, 1], picture[p, 2]
        )
        for c in range(3):
            f[c * LANES + lane] = (
                w0 * table[dark, c] + w1 * table[second, c] + w2 * table[third, c] + w3 * table[bright, c]
            )


@njit(**_LANE_LOOPS)
def _f_to_XYZ(f: Floats, white: Floats, y: Floats) -> None:
    """XYZ (3 rows) of f (3 rows)."""
    wx, wy, wz = white[0], white[1], white[2]
    for lane in range(LANES):
        y[lane] = wx * _inverse_f(f[lane])
        y[LANES + lane] = wy * _inverse_f(f[LANES + lane])
        y[2 * LANES + lane] = wz * _inverse_f(f[2 * LANES + lane])


@njit(**_LANE_LOOPS)
def _add_products(M: Floats, y: Floats, x: Floats) -> None:
    """x += M y in every lane; x and y are as many rows of lanes as M has rows and columns, multiples of 3."""
    for i in range(0, M.shape[0], 3):
        xi = x[i * LANES : (i + 3) * LANES]
        for k in range(0, M.shape[1], 3):
            yk = y[k * LANES : (k + 3) * LANES]
            m00, m01, m02 = M[i, k], M[i, k + 1], M[i, k + 2]
            m10, m11, m12 = M[i + 1, k], M[i + 1, k + 1], M[i + 1, k + 2]
            m20, m21, m22 = M[i + 2, k], M[i + 2, k + 1], M[i + 2, k + 2]
            for lane in range(LANES):
                y0, y1, y2 = yk[lane], yk[LANES + lane], yk[2 * LANES + lane]
                xi[lane] += m00 * y0 + m01 * y1 + m02 * y2
                xi[LANES + lane] += m10 * y0 + m11 * y1 + m12 * y2
                xi[2 * LANES + lane] += m20 * y0 + m21 * y1 + m22 * y2


@njit(**_LANE_LOOPS)
def _is_in_box(x: Floats) -> bool:
    outside = 0
    for i in range(x.size):
        outside += 1 if abs(x[i] - _HALF) > _ROUNDING else 0
    return outside == 0


@njit(**_LANE_LOOPS)
def _clip_and_correct(keep: np.float32, U: Floats, V: Floats, rest: Floats, g: Floats, t: Floats, x: Floats) -> None:
    """x <- g + keep clip(x) + U (V clip(x)), with g = STEP (x - rest) at first: until all lanes are in the box."""
    for i in range(rest.size):
        for lane in range(i * LANES, (i + 1) * LANES):
            g[lane] = np.float32(STEP) * (x[lane] - rest[i])
    for k in range(ROUNDS):
        if k % 4 == 0 and _is_in_box(x):
            return
        for i in range(x.size):
            x[i] = _clip(x[i])
        for i in range(t.size):
            t[i] = _ZERO
        _add_products(V, x, t)
        for i in range(x.size):
            x[i] = g[i] + keep * x[i]
        _add_products(U, t, x)


@njit(**_LANE_LOOPS)
def _write_codes(
    x: Floats, labels: NDArray[np.uint8], table: Floats, outside: int, out: NDArray[np.unsignedinteger]
) -> None:
    """Codes (pixels, N) of the pixels' own clusters, by a table over the square root of x."""
    channels = table.shape[0]
    last = table.shape[1] - 1
    for lane in range(labels.size):
        label = np.int64(labels[lane])
        for j in range(channels):
            if label == 255:
                out[lane, j] = outside
            else:
                place = np.sqrt(_clip(x[(label * channels + j) * LANES + lane])) * np.float32(last)
                i = min(np.int64(place), last - 1)
                value = table[j, i] + (place - np.float32(i)) * (table[j, i + 1] - table[j, i])
                out[lane, j] = np.int64(value + _HALF)


@njit(**KERNEL, fastmath={"contract"})
def fill_codes(
    pictures: Pictures,
    labels: NDArray[np.uint8],
    light: Floats,
    affine: Floats,
    tables: tuple[Floats, Floats],
    nodes: tuple[int, int],
    to_t: Floats,
    white: Floats,
    G: Floats,
    base: Floats,
    keep: np.float32,
    U: Floats,
    V: Floats,
    rest: Floats,
    codes: Floats,
    outside: int,
    out: NDArray[np.unsignedinteger],
) -> None:
    """Codes `out` (pixels, N) of pixels with sRGB colours (pixels, 3) on each surface; see `FramePlan`."""
    n, equations = G.shape
    rgb = np.empty(3 * LANES, np.float32)
    f = np.empty(3 * LANES, np.float32)
    y = np.empty(equations * LANES, np.float32)
    x = np.empty(n * LANES, np.float32)
    g = np.empty(n * LANES, np.float32)
    t = np.empty(V.shape[0] * LANES, np.float32)
    for first in range(0, labels.size, LANES):
        count = min(LANES, labels.size - first)
        for s in range(equations // 3):
            picture = pictures[0] if s == 0 else pictures[1]
            if nodes[s] > 0:
                _tabled_f(picture, first, count, tables[0] if s == 0 else tables[1], nodes[s], f)
                for lane in range(count, LANES):
                    f[lane], f[LANES + lane], f[2 * LANES + lane] = f[0], f[LANES], f[2 * LANES]
            else:
                for lane in range(LANES):
                    p = first + min(lane, count - 1)
                    rgb[lane] = light[picture[p, 0]]
                    rgb[LANES + lane] = light[picture[p, 1]]
                    rgb[2 * LANES + lane] = light[picture[p, 2]]
                _affine_f(rgb, affine[s], to_t, f)
            _f_to_XYZ(f, white, y[3 * s * LANES : 3 * (s + 1) * LANES])
        for j in range(n):
            for lane in range(j * LANES, (j + 1) * LANES):
                x[lane] = base[j]
        _add_products(G, y, x)
        if V.shape[0] > 0:
            _clip_and_correct(keep, U, V, rest, g, t, x)
        _write_codes(x, labels[first : first + count], codes, outside, out[first : first + count])
