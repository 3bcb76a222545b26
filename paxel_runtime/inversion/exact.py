"""Colours within reach: the linear solve about mid-gray, and the solution in the box nearest to mid-gray.

Plain arrays in and out, no checks: `solver.py` makes the arguments and documents the method. Both kernels release the
interpreter lock; the answer of a pixel does not depend on its neighbours.

Two surfaces of 3 values make the 6 rows of A; with one surface the last 3 are zero.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.box_qp import NU, RES, ROWS, S_FIRST, S_REST, Z, qp_steps
from paxel_runtime.inversion.evaluation import AIM, ERROR, EVALUATION_ROWS, SHOWN, WANTED, aim, compare, show_input
from paxel_runtime.inversion.lanes import (
    LANES,
    Floats,
    Surfaces,
    Vec6,
    black_of,
    clip,
    column,
    lane_columns,
    larger,
    take_own,
)
from paxel_runtime.inversion.local_model import Lab_to_t
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["EXACT", "PENDING", "set_compliance", "solve_in_box", "solve_linear", "write_x"]

Labels: TypeAlias = NDArray[np.uint8]

EXACT, PENDING = 0, 255

_KERNEL: dict[str, Any] = {**KERNEL, "fastmath": {"contract"}}

_IN_BOX = 1e-9  # an input may leave 0..1 by rounding of the linear solve
_COMPLIANCE = 1e-11  # of an exact solution: |A x - z| = compliance * multipliers, below 1e-8 where z can be reached
_STEPS = np.int64(40)  # of the quadratic programme; it takes less than ten; no literal: `qp_steps` is compiled once
_OUTSIDE = EVALUATION_ROWS * LANES  # 1: largest |x - 1/2| before it is clipped


@njit(**_KERNEL)
def solve_linear(
    Lab_pattern: NDArray[np.floating],
    Lab_white: NDArray[np.floating],
    surfaces: Surfaces,
    AT: Floats,
    inverse: Floats,
    black: Floats,
    white: Floats,
    euclidean: bool,
    x: NDArray[np.floating],
    dE_pattern: NDArray[np.floating],
    dE_white: NDArray[np.floating],
    status: Labels,
) -> None:
    """x = 1/2 + G (XYZ - black - A/2), kept where it lies in the box.

    Parameters
    ----------
    Lab_pattern, Lab_white : (m, 3) array
        Wanted colours; the second is not read where there is one surface.
    surfaces : (0,) or (0, 1)
        One or two.
    AT : (n, 6) array
        A transposed.
    inverse : (n, 6) array
        G, a right inverse of A.
    black : (6,) array
        XYZ of both surfaces at x = 0.
    white : (3,) array
        White point.
    euclidean : bool
        dE76 instead of dE00.
    x : (m, n) array
        Out: x where it is in the box, in the array's own precision; else left alone.
    dE_pattern, dE_white : (m,) array
        Out: differences of the colours that this x, as rounded, gives; else left alone.
    status : (m,) uint8 array
        Out: EXACT where x is in the box, PENDING elsewhere.
    """
    n = AT.shape[0]
    w = np.zeros((EVALUATION_ROWS + 1) * LANES)
    second = w[3 * LANES :]
    v = np.empty(n * LANES, x.dtype)
    base = _inputs_of_black(AT, inverse, black)
    white_point = (white[0], white[1], white[2])
    per_white = (1.0 / white[0], 1.0 / white[1], 1.0 / white[2])
    for first in range(0, status.size, LANES):
        count = min(LANES, status.size - first)
        for lane in range(LANES):
            p = first + min(lane, count - 1)
            for i in range(3):
                w[WANTED + i * LANES + lane] = Lab_pattern[p, i]
        aim(w, white_point)
        if len(surfaces) == 2:
            for lane in range(LANES):
                p = first + min(lane, count - 1)
                for i in range(3):
                    second[WANTED + i * LANES + lane] = Lab_white[p, i]
            aim(second, white_point)
        for i in range(6):
            w[SHOWN + i * LANES : SHOWN + (i + 1) * LANES] = black[i]
        w[_OUTSIDE : _OUTSIDE + LANES] = 0.0
        for j in range(n):
            g = column(inverse, j, 0)
            for lane in range(LANES):
                _solve_input(w, v, j, lane, base[j], g)
            a = column(AT, j, 0)
            for lane in range(LANES):
                show_input(w, lane, a, v[j * LANES + lane])
        inside = 0
        for lane in range(LANES):
            inside += 1 if w[_OUTSIDE + lane] <= 0.5 + _IN_BOX else 0
        if inside > 0:
            compare(w, per_white, euclidean)
            if len(surfaces) == 2:
                compare(second, per_white, euclidean)
        for lane in range(count):
            p = first + lane
            status[p] = EXACT if w[_OUTSIDE + lane] <= 0.5 + _IN_BOX else PENDING
            if status[p] == EXACT:
                for j in range(n):
                    x[p, j] = v[j * LANES + lane]
                dE_pattern[p] = w[ERROR + lane]
                if len(surfaces) == 2:
                    dE_white[p] = second[ERROR + lane]


@njit(**INLINED)
def _inputs_of_black(AT: Floats, inverse: Floats, black: Floats) -> Floats:
    """1/2 - G (black + A/2): x at XYZ = 0."""
    base = np.full(AT.shape[0], 0.5)
    for i in range(6):
        middle = black[i]
        for j in range(AT.shape[0]):
            middle += 0.5 * AT[j, i]
        for j in range(AT.shape[0]):
            base[j] -= inverse[j, i] * middle
    return base


@njit(**INLINED)
def _solve_input(
    w: Floats,
    v: NDArray[np.floating],
    j: int,
    lane: int,
    base: float,
    g: Vec6,
) -> None:
    """Input j of `solve_linear`, clipped, in the precision of the answer."""
    pattern = g[0] * w[AIM + lane] + g[1] * w[AIM + LANES + lane] + g[2] * w[AIM + 2 * LANES + lane]
    white = g[3] * w[AIM + 3 * LANES + lane] + g[4] * w[AIM + 4 * LANES + lane] + g[5] * w[AIM + 5 * LANES + lane]
    x = base + (pattern + white)
    w[_OUTSIDE + lane] = larger(w[_OUTSIDE + lane], abs(x - 0.5))
    v[j * LANES + lane] = clip(x)


@njit(**INLINED)
def set_compliance(w: Floats, value: float) -> None:
    """S = value times the identity on both surfaces."""
    for s in (0, 3):
        w[S_FIRST + s * LANES : S_FIRST + (s + 1) * LANES] = value
        w[S_REST + s * LANES : S_REST + (s + 1) * LANES] = value
        w[S_REST + (s + 2) * LANES : S_REST + (s + 3) * LANES] = value


@njit(**INLINED)
def write_x(u: Floats, lane: int, x: Floats, pixel: int) -> None:
    """x of a pixel from the inputs before clipping, in rows of lanes."""
    for j in range(x.shape[1]):
        x[pixel, j] = clip(u[j * LANES + lane])


@njit(**_KERNEL)
def solve_in_box(
    Lab: Floats,
    queue: NDArray[np.int64],
    surfaces: Surfaces,
    AT: Floats,
    black: Floats,
    white: Floats,
    x: Floats,
    status: Labels,
) -> None:
    """The x in the box nearest to 1/2 that gives the wanted colours, where there is one.

    Parameters
    ----------
    Lab : (m, 6) array
        Wanted colours on both surfaces.
    queue : (q,) int64 array
        Pixels to solve.
    surfaces : (0,) or (0, 1)
        One or two.
    AT : (n, 6) or (m, n, 6) array
        A transposed: one of all pixels, or each pixel's own.
    black : (6,) or (m, 6) array
        XYZ of both surfaces at x = 0.
    white : (3,) array
        White point.
    x : (m, n) array
        Out: the solution; of no use where there is none.
    status : (m,) uint8 array
        Out: EXACT where the residual is that of a reachable colour; else left alone.
    """
    n = x.shape[1]
    columns = lane_columns(AT)
    w = np.zeros(ROWS * LANES)
    u = np.empty(n * LANES)
    v = np.empty(n * LANES)
    set_compliance(w, _COMPLIANCE)
    impossible = n / 8 + 0.01  # more than 1/2 |x - 1/2|^2 in the box, and than the compliance where XYZ is 1e-8 off
    for first in range(0, queue.size, LANES):
        count = min(LANES, queue.size - first)
        w[NU : NU + 6 * LANES] = 0.0
        for lane in range(LANES):
            p = queue[first + min(lane, count - 1)]
            take_own(AT, p, lane, columns)
            for s in range(0, 3 * len(surfaces), 3):
                tx, ty, tz = Lab_to_t(Lab[p, s], Lab[p, s + 1], Lab[p, s + 2])
                w[Z + s * LANES + lane] = tx * white[0] - black_of(black, p, s)
                w[Z + (s + 1) * LANES + lane] = ty * white[1] - black_of(black, p, s + 1)
                w[Z + (s + 2) * LANES + lane] = tz * white[2] - black_of(black, p, s + 2)
        qp_steps(w, u, v, columns, surfaces, 1e-12, impossible, _STEPS)
        for lane in range(count):
            p = queue[first + lane]
            write_x(u, lane, x, p)
            largest = 0.0
            for i in range(3 * len(surfaces)):
                missed = _COMPLIANCE * abs(w[NU + i * LANES + lane]) + abs(w[RES + i * LANES + lane])
                largest = max(largest, missed)
            if largest <= 1e-8:
                status[p] = EXACT
