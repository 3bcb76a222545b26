"""Kernels of the inversion: linear solve, nearest-to-gray solution in the box, Newton on dE00^2, dE00 of the result.

Plain arrays in and out, float64, no checks: `solver.py` makes the arguments and documents the method. Each kernel
releases the interpreter lock and works on the pixels it is given, so threads can share a picture. The answer of a
pixel does not depend on its neighbours.

Two surfaces of 3 values make the 6 rows of A; with one surface the last 3 are zero. A and black are the same for all
pixels, (n, 6) and (6,), or each pixel has its own, (m, n, 6) and (m, 6); the compiler keeps the branch that fits.
"""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.box_qp import (
    DONE,
    LANES,
    NU,
    REG,
    RES,
    ROWS,
    S_FIRST,
    S_REST,
    Z,
    along,
    clip,
    column,
    larger,
    qp_steps,
    smaller,
)
from paxel_runtime.inversion.local_model import (
    BLACK,
    CHANGE,
    LAB,
    MU,
    POINT,
    POINT_ROWS,
    TRIAL,
    VALUE,
    WORKSPACE,
    XYZ,
    Lab_to_t,
    aim_qp,
    expand,
    move_to_trial,
    squared_dE76_jet,
    t_to_Lab,
)
from paxel_runtime.model.delta_e import TRUE_dE00, squared_dE00_jet
from paxel_runtime.numba_options import INLINED

__all__ = ["CAPPED", "EXACT", "OPTIMUM", "PENDING", "evaluate", "newton", "solve_in_box", "solve_linear"]

Floats: TypeAlias = NDArray[np.float64]
Labels: TypeAlias = NDArray[np.uint8]

EXACT, OPTIMUM, CAPPED, PENDING = 0, 1, 2, 255

_KERNEL = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}, "nogil": True}

_IN_BOX = 1e-9  # an input may leave 0..1 by rounding of the linear solve
_COMPLIANCE = 1e-11  # of an exact solution: |A x - z| = compliance * multipliers, below 1e-8 where z can be reached
_DELTA = 2e-4  # the regulariser is delta / 2 |x - 1/2|^2, in dE00^2
_CONVERGED = 1e-6  # decrease the model still promises, in dE00^2
_QP_STEPS = 2  # in a round; a lane that needs more goes on in the next
_ROUNDS = 150  # of a pixel, then it is capped

# Rows of `newton`'s workspace, after those of the QP and of the local model
_NU_HERE = WORKSPACE  # 6: multipliers where the pixel stands
_REG_HERE = _NU_HERE + 6 * LANES  # 1
_FRESH = _REG_HERE + LANES  # 1: 1.0 in a lane that was just filled: its trial point is the wanted colour itself
_ROUND = _FRESH + LANES  # 1: rounds spent on the pixel
_TAKE = _ROUND + LANES  # 1: 1.0 where the trial point is taken
_BACK = _TAKE + LANES  # 1: 1.0 where the pixel goes back
_SIZE = _BACK + LANES
_NO_VALUE = 1e30


@njit(**_KERNEL)
def solve_linear(
    Lab: Floats, AT: Floats, inverse: Floats, black: Floats, white: Floats, x: Floats, status: Labels
) -> None:
    """x = 1/2 + G (XYZ - black - A/2), kept where it lies in the box.

    Parameters
    ----------
    Lab : (m, 6) array
        Wanted colours on both surfaces.
    AT : (n, 6) array
        A transposed.
    inverse : (n, 6) array
        G, a right inverse of A.
    black : (6,) array
        XYZ of both surfaces at x = 0.
    white : (3,) array
        White point.
    x : (m, n) array
        Out.
    status : (m,) uint8 array
        Out: EXACT where x is in the box, else left alone.
    """
    n = AT.shape[0]
    middle = black.copy()
    for j in range(n):
        for i in range(6):
            middle[i] += 0.5 * AT[j, i]
    r = np.empty(6)
    for p in range(Lab.shape[0]):
        for s in range(0, 6, 3):
            tx, ty, tz = Lab_to_t(Lab[p, s], Lab[p, s + 1], Lab[p, s + 2])
            r[s], r[s + 1], r[s + 2] = tx * white[0], ty * white[1], tz * white[2]
        outside = 0.0
        for j in range(n):
            d = 0.0
            for i in range(6):
                d += inverse[j, i] * (r[i] - middle[i])
            outside = max(outside, abs(d))
            x[p, j] = min(max(0.5 + d, 0.0), 1.0)
        if outside <= 0.5 + _IN_BOX:
            status[p] = EXACT


@njit(**INLINED)
def _lane_columns(AT: Floats) -> Floats:
    """A as the lanes use it: the one of all pixels, or room for one a lane."""
    if AT.ndim == 2:
        return AT
    return np.zeros((AT.shape[1], 6, LANES))


@njit(**INLINED)
def _take_own(AT: Floats, pixel: int, lane: int, columns: Floats) -> None:
    """Give a lane the A of its pixel, where each has its own."""
    if AT.ndim == 3:
        for j in range(AT.shape[1]):
            for i in range(6):
                columns[j, i, lane] = AT[pixel, j, i]


@njit(**INLINED)
def _black_of(black: Floats, pixel: int, i: int) -> float:
    if black.ndim == 1:
        return black[i]
    return black[pixel, i]


@njit(**INLINED)
def _set_compliance(w: Floats, value: float) -> None:
    """S = value times the identity on both surfaces."""
    for s in (0, 3):
        w[S_FIRST + s * LANES : S_FIRST + (s + 1) * LANES] = value
        w[S_REST + s * LANES : S_REST + (s + 1) * LANES] = value
        w[S_REST + (s + 2) * LANES : S_REST + (s + 3) * LANES] = value


@njit(**INLINED)
def _write_x(u: Floats, lane: int, x: Floats, pixel: int) -> None:
    for j in range(x.shape[1]):
        x[pixel, j] = clip(u[j * LANES + lane])


@njit(**INLINED)
def _write_best(w: Floats, lane: int, columns: Floats, x: Floats, pixel: int) -> None:
    """The x of the last accepted point; of the multipliers so far where none was accepted."""
    row = _NU_HERE if w[VALUE + lane] < _NO_VALUE else NU
    for j in range(x.shape[1]):
        x[pixel, j] = clip(0.5 + along(column(columns, j, lane), w, row + lane))


@njit(**_KERNEL)
def solve_in_box(
    Lab: Floats, queue: NDArray[np.int64], AT: Floats, black: Floats, white: Floats, x: Floats, status: Labels
) -> None:
    """The x in the box nearest to 1/2 that gives the wanted colours, where there is one.

    `queue` lists the pixels to solve; the other arguments are those of `solve_linear`. Status becomes EXACT where the
    residual is that of a reachable colour; else x is the nearest in XYZ and the status is left alone.
    """
    n = x.shape[1]
    columns = _lane_columns(AT)
    w = np.zeros(ROWS * LANES)
    u = np.empty(n * LANES)
    v = np.empty(n * LANES)
    _set_compliance(w, _COMPLIANCE)
    for first in range(0, queue.size, LANES):
        count = min(LANES, queue.size - first)
        w[NU : NU + 6 * LANES] = 0.0
        for lane in range(LANES):
            p = queue[first + min(lane, count - 1)]
            _take_own(AT, p, lane, columns)
            for s in range(0, 6, 3):
                tx, ty, tz = Lab_to_t(Lab[p, s], Lab[p, s + 1], Lab[p, s + 2])
                w[Z + s * LANES + lane] = tx * white[0] - _black_of(black, p, s)
                w[Z + (s + 1) * LANES + lane] = ty * white[1] - _black_of(black, p, s + 1)
                w[Z + (s + 2) * LANES + lane] = tz * white[2] - _black_of(black, p, s + 2)
        qp_steps(w, u, v, columns, 1e-12, 40)
        for lane in range(count):
            p = queue[first + lane]
            _write_x(u, lane, x, p)
            largest = 0.0
            for i in range(6):
                missed = _COMPLIANCE * abs(w[NU + i * LANES + lane]) + abs(w[RES + i * LANES + lane])
                largest = max(largest, missed)
            if largest <= 1e-8:
                status[p] = EXACT


@njit(**INLINED)
def _fill(
    w: Floats, lane: int, Lab: Floats, pixel: int, AT: Floats, columns: Floats, black: Floats, white: Floats
) -> None:
    """Give a lane a new pixel: no multipliers, and the wanted colour itself as the first point to expand about."""
    _take_own(AT, pixel, lane, columns)
    for s in range(0, 6, 3):
        L, a, b = Lab[pixel, s], Lab[pixel, s + 1], Lab[pixel, s + 2]
        tx, ty, tz = Lab_to_t(L, a, b)
        row = LAB + s * LANES + lane
        w[row], w[row + LANES], w[row + 2 * LANES] = L, a, b
        row = XYZ + TRIAL + s * LANES + lane
        w[row] = smaller(larger(tx, 0.0), 1.5) * white[0]
        w[row + LANES] = smaller(larger(ty, 0.0), 1.5) * white[1]
        w[row + 2 * LANES] = smaller(larger(tz, 0.0), 1.5) * white[2]
    for i in range(6):
        w[NU + i * LANES + lane] = 0.0
        w[BLACK + i * LANES + lane] = _black_of(black, pixel, i)
    w[MU + lane] = 0.0
    w[MU + 3 * LANES + lane] = 0.0
    w[_FRESH + lane] = 1.0
    w[_ROUND + lane] = 0.0


@njit(**INLINED)
def _choose(w: Floats, row: int, other: int, take: float) -> None:
    """Three rows: row <- other where `take`. Written out, for a loop over rows would end vectorisation."""
    h0, h1, h2 = w[row], w[row + LANES], w[row + 2 * LANES]
    t0, t1, t2 = w[other], w[other + LANES], w[other + 2 * LANES]
    w[row] = t0 if take > 0.0 else h0
    w[row + LANES] = t1 if take > 0.0 else h1
    w[row + 2 * LANES] = t2 if take > 0.0 else h2


@njit(**INLINED)
def _objective(w: Floats, lane: int, offset: int, reg: int) -> float:
    return w[VALUE + offset + lane] + w[VALUE + offset + 3 * LANES + lane] + _DELTA * w[reg + lane]


@njit(**INLINED)
def _promise(w: Floats, lane: int) -> float:
    """Change of the objective that the local model expects at the trial point, <= 0."""
    return w[CHANGE + lane] + w[CHANGE + 3 * LANES + lane] + _DELTA * (w[REG + lane] - w[_REG_HERE + lane])


@njit(**INLINED)
def _judge(w: Floats) -> None:
    """Take the trial points or go back, and set the damping: Levenberg and Marquardt's rule on gain / promise."""
    for lane in range(LANES):
        fresh, solved, mu = w[_FRESH + lane], w[DONE + lane], w[MU + lane]
        promise, change = _promise(w, lane), _objective(w, lane, TRIAL, REG) - _objective(w, lane, 0, _REG_HERE)
        better = 1.0 if change < 1e-4 * promise else 0.0
        weaker = mu * 0.2 if mu > 1e-3 else 0.0
        judged = larger(4.0 * mu, 0.05) if change > 0.25 * promise else mu
        judged = weaker if change < 0.75 * promise else judged
        mu = (1.0 - fresh) * (judged if solved > 0.0 else mu)
        w[MU + lane] = mu
        w[MU + 3 * LANES + lane] = mu
        w[_TAKE + lane] = larger(fresh, solved * better)
        w[_BACK + lane] = (1.0 - fresh) * solved * (1.0 - better)
    for lane in range(LANES):
        take, back = w[_TAKE + lane], w[_BACK + lane]
        for i in range(0, POINT_ROWS, 3):
            _choose(w, POINT + i * LANES + lane, POINT + TRIAL + i * LANES + lane, take)
        _choose(w, NU + lane, _NU_HERE + lane, back)
        _choose(w, NU + 3 * LANES + lane, _NU_HERE + 3 * LANES + lane, back)
        _choose(w, _NU_HERE + lane, NU + lane, take)
        _choose(w, _NU_HERE + 3 * LANES + lane, NU + 3 * LANES + lane, take)
        value, reg_here, reg = w[VALUE + lane], w[_REG_HERE + lane], w[REG + lane]
        # the wanted colour is no solution: whatever comes next is better
        w[VALUE + lane] = _NO_VALUE if w[_FRESH + lane] > 0.0 else value
        w[_REG_HERE + lane] = reg if take > 0.0 else reg_here
        w[_FRESH + lane] = 0.0


@njit(**_KERNEL)
def newton(
    Lab: Floats,
    queue: NDArray[np.int64],
    surfaces: int,
    AT: Floats,
    black: Floats,
    white: Floats,
    weights: Floats,
    euclidean: bool,
    x: Floats,
    status: Labels,
) -> None:
    """Minimise the weighted dE00^2 + dE00^2 over the box for the pixels of `queue` (Eqs. 5 and 7); dE76 if `euclidean`.

    Each round expands dE00^2 about the point where a pixel stands, minimises that over the box, and judges the trial
    point. The first expansion is about the wanted colour itself. A lane that finishes takes the next pixel.

    `surfaces` is 1 or 2 and `weights` (2,); the other arguments are those of `solve_linear`. Status becomes OPTIMUM,
    or CAPPED where the bound of rounds was met.
    """
    w = np.zeros(_SIZE)
    second = w[3 * LANES :]  # the workspace as the second surface sees it
    columns = _lane_columns(AT)
    u = np.empty(x.shape[1] * LANES)
    v = np.empty(x.shape[1] * LANES)
    # what a surface that is not there contributes: S = 1 and z = 0, so its multipliers stay 0
    _set_compliance(w, 1.0)
    per_white = (1.0 / white[0], 1.0 / white[1], 1.0 / white[2])
    pixels = np.full(LANES, -1)
    following, running = 0, 0
    for lane in range(min(LANES, queue.size)):
        pixels[lane] = queue[following]
        _fill(w, lane, Lab, pixels[lane], AT, columns, black, white)
        following += 1
        running += 1
    for lane in range(running, LANES):
        _fill(w, lane, Lab, pixels[0], AT, columns, black, white)
    while running > 0:
        expand(w, per_white, weights[0], euclidean)
        if surfaces == 2:
            expand(second, per_white, weights[1], euclidean)
        _judge(w)
        aim_qp(w, _DELTA)
        if surfaces == 2:
            aim_qp(second, _DELTA)
        qp_steps(w, u, v, columns, 1e-10, _QP_STEPS)
        move_to_trial(w)
        if surfaces == 2:
            move_to_trial(second)
        for lane in range(LANES):
            p = pixels[lane]
            arrived = w[DONE + lane] > 0.0 and _promise(w, lane) > -_CONVERGED and w[VALUE + lane] < _NO_VALUE
            w[_ROUND + lane] += 1.0
            if p < 0 or not (arrived or w[_ROUND + lane] >= _ROUNDS):
                continue
            if arrived:
                _write_x(u, lane, x, p)
            else:
                _write_best(w, lane, columns, x, p)
            status[p] = OPTIMUM if arrived else CAPPED
            if following < queue.size:
                pixels[lane] = queue[following]
                _fill(w, lane, Lab, pixels[lane], AT, columns, black, white)
                following += 1
            else:
                pixels[lane] = -1
                running -= 1


@njit(**INLINED)
def _entry(AT: Floats, pixel: int, j: int, i: int) -> float:
    if AT.ndim == 2:
        return AT[j, i]
    return AT[pixel, j, i]


@njit(**_KERNEL)
def evaluate(
    x: Floats, Lab: Floats, surfaces: int, AT: Floats, black: Floats, white: Floats, euclidean: bool, dE: Floats
) -> None:
    """dE00 between the wanted colours (m, 6) and those that x (m, n) gives, on each surface: `dE` (m, 2), out.

    dE76 where `euclidean`.
    """
    y = np.empty(6 * LANES)
    wanted = np.empty(6 * LANES)
    out = np.empty(LANES)
    for first in range(0, x.shape[0], LANES):
        count = min(LANES, x.shape[0] - first)
        for lane in range(LANES):
            p = first + min(lane, count - 1)
            for i in range(6):
                value = _black_of(black, p, i)
                for j in range(x.shape[1]):
                    value += _entry(AT, p, j, i) * x[p, j]
                y[i * LANES + lane] = value / white[i % 3]
                wanted[i * LANES + lane] = Lab[p, i]
        for s in range(surfaces):
            row = 3 * s * LANES
            if euclidean:
                for lane in range(LANES):
                    L, a, b = t_to_Lab(y[row + lane], y[row + LANES + lane], y[row + 2 * LANES + lane])
                    L1, a1, b1 = wanted[row + lane], wanted[row + LANES + lane], wanted[row + 2 * LANES + lane]
                    out[lane] = squared_dE76_jet(L1, a1, b1, L, a, b)[0]
            else:
                for lane in range(LANES):
                    L, a, b = t_to_Lab(y[row + lane], y[row + LANES + lane], y[row + 2 * LANES + lane])
                    L1, a1, b1 = wanted[row + lane], wanted[row + LANES + lane], wanted[row + 2 * LANES + lane]
                    out[lane] = squared_dE00_jet(L1, a1, b1, L, a, b, TRUE_dE00)[0]
            for lane in range(count):
                dE[first + lane, s] = math.sqrt(out[lane])
