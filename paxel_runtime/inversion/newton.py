"""Colours out of reach: Newton's method on the weighted dE00^2 + dE00^2 over the box (Eqs. 5 and 7).

Plain arrays in and out, no checks: `solver.py` makes the arguments and documents the method. The kernel releases the
interpreter lock; the answer of a pixel does not depend on its neighbours.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.box_qp import DONE, NU, REG, qp_steps
from paxel_runtime.inversion.exact import set_compliance, write_x
from paxel_runtime.inversion.lanes import (
    LANES,
    Floats,
    Surfaces,
    along,
    black_of,
    clip,
    column,
    lane_columns,
    larger,
    smaller,
    take_own,
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
)
from paxel_runtime.inversion.three_inputs import solve_three_inputs
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["CAPPED", "OPTIMUM", "newton"]

Labels: TypeAlias = NDArray[np.uint8]

OPTIMUM, CAPPED = 1, 2

_KERNEL: dict[str, Any] = {**KERNEL, "fastmath": {"contract"}}

_DELTA = 2e-4  # the regulariser is delta / 2 |x - 1/2|^2, in dE00^2
_CONVERGED = 3e-3  # decrease the last step promises, in dE00^2; convergence is quadratic: 2e-4 at most was left
_QP_STEPS = np.int64(2)  # in a round; a lane that needs more goes on in the next; a literal would be its own type
_ROUNDS = 150  # of a pixel, then it is capped

# Rows of `newton`'s workspace, after those of the QP and of the local model
_NU_HERE = WORKSPACE  # 6: multipliers where the pixel stands
_REG_HERE = _NU_HERE + 6 * LANES  # 1
_FRESH = _REG_HERE + LANES  # 1: 1.0 in a lane that was just filled: its trial point is its start
_ROUND = _FRESH + LANES  # 1: rounds spent on the pixel
_TAKE = _ROUND + LANES  # 1: 1.0 where the trial point is taken
_BACK = _TAKE + LANES  # 1: 1.0 where the pixel goes back
_SIZE = _BACK + LANES
_NO_VALUE = 1e30


@njit(**INLINED)
def _write_best(w: Floats, lane: int, columns: Floats, surfaces: Surfaces, x: Floats, pixel: int) -> None:
    """The x of the last accepted point; of the multipliers so far where none was accepted."""
    row = _NU_HERE if w[VALUE + lane] < _NO_VALUE else NU
    for j in range(x.shape[1]):
        x[pixel, j] = clip(0.5 + along(column(columns, j, lane), w, row + lane, surfaces))


@njit(**INLINED)
def _fill(
    w: Floats,
    lane: int,
    Lab: Floats,
    start: Floats,
    pixel: int,
    AT: Floats,
    columns: Floats,
    black: Floats,
    white: Floats,
) -> None:
    """Give a lane a new pixel: no multipliers, and its start as the first point to expand about."""
    take_own(AT, pixel, lane, columns)
    for s in range(0, 6, 3):
        L, a, b = Lab[pixel, s], Lab[pixel, s + 1], Lab[pixel, s + 2]
        row = LAB + s * LANES + lane
        w[row], w[row + LANES], w[row + 2 * LANES] = L, a, b
        row = XYZ + TRIAL + s * LANES + lane
        if start.shape[0] > 0:
            for i in range(3):
                w[row + i * LANES] = start[pixel, s + i]
        else:
            t = Lab_to_t(L, a, b)
            for i in range(3):
                w[row + i * LANES] = smaller(larger(t[i], 0.0), 1.5) * white[i]
    for i in range(6):
        w[NU + i * LANES + lane] = 0.0
        w[BLACK + i * LANES + lane] = black_of(black, pixel, i)
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
        # the start is no solution: whatever comes next is better
        w[VALUE + lane] = _NO_VALUE if w[_FRESH + lane] > 0.0 else value
        w[_REG_HERE + lane] = reg if take > 0.0 else reg_here
        w[_FRESH + lane] = 0.0


@njit(**_KERNEL)
def newton(
    Lab: Floats,
    start: Floats,
    queue: NDArray[np.int64],
    surfaces: Surfaces,
    AT: Floats,
    black: Floats,
    white: Floats,
    weights: Floats,
    euclidean: bool,
    x: Floats,
    value: Floats,
    status: Labels,
) -> None:
    """Minimise the weighted dE00^2 + dE00^2 over the box, from one start.

    Each round expands dE00^2 about the point where a pixel stands, minimises that over the box, and judges the trial
    point. A lane that finishes takes the next pixel.

    Parameters
    ----------
    Lab : (m, 6) array
        Wanted colours on both surfaces.
    start : (m, 6) or (0, 6) array
        XYZ to expand about first, on both surfaces; need not be reachable. None: the wanted colours.
    queue : (q,) int64 array
        Pixels to solve.
    surfaces : (0,) or (0, 1)
        One or two.
    AT, black, white
        As in `solve_in_box`.
    weights : (2,) array
        Of the two surfaces.
    euclidean : bool
        dE76 instead of dE00.
    x : (m, n) array
        Out.
    value : (m,) array
        Out: weighted dE^2 of x, as the last step's local model has it.
    status : (m,) uint8 array
        Out: OPTIMUM, or CAPPED where the bound of rounds was met.
    """
    w = np.zeros(_SIZE)
    second = w[3 * LANES :]  # the workspace as the second surface sees it
    columns = lane_columns(AT)
    u = np.full(x.shape[1] * LANES, 0.5)
    v = np.empty(x.shape[1] * LANES)
    # what a surface that is not there contributes: S = 1 and z = 0, so its multipliers stay 0
    set_compliance(w, 1.0)
    per_white = (1.0 / white[0], 1.0 / white[1], 1.0 / white[2])
    pixels = np.full(LANES, -1)
    following, running = 0, 0
    for lane in range(min(LANES, queue.size)):
        pixels[lane] = queue[following]
        _fill(w, lane, Lab, start, pixels[lane], AT, columns, black, white)
        following += 1
        running += 1
    for lane in range(running, LANES):
        _fill(w, lane, Lab, start, pixels[0], AT, columns, black, white)
    while running > 0:
        expand(w, per_white, weights[0], euclidean)
        if len(surfaces) == 2:
            expand(second, per_white, weights[1], euclidean)
        _judge(w)
        aim_qp(w, _DELTA)
        if len(surfaces) == 2:
            aim_qp(second, _DELTA)
        if len(surfaces) == 1 and AT.ndim == 2 and AT.shape[0] == 3:
            solve_three_inputs(w, u, AT)
        else:
            qp_steps(w, u, v, columns, surfaces, 1e-10, 1e300, _QP_STEPS)
        move_to_trial(w)
        if len(surfaces) == 2:
            move_to_trial(second)
        for lane in range(LANES):
            p = pixels[lane]
            arrived = w[DONE + lane] > 0.0 and _promise(w, lane) > -_CONVERGED and w[VALUE + lane] < _NO_VALUE
            w[_ROUND + lane] += 1.0
            if p < 0 or not (arrived or w[_ROUND + lane] >= _ROUNDS):
                continue
            if arrived:
                write_x(u, lane, x, p)
            else:
                _write_best(w, lane, columns, surfaces, x, p)
            status[p] = OPTIMUM if arrived else CAPPED
            value[p] = w[VALUE + lane] + w[VALUE + 3 * LANES + lane]
            value[p] += w[CHANGE + lane] + w[CHANGE + 3 * LANES + lane] if arrived else 0.0
            if following < queue.size:
                pixels[lane] = queue[following]
                for j in range(x.shape[1]):
                    u[j * LANES + lane] = 0.5
                _fill(w, lane, Lab, start, pixels[lane], AT, columns, black, white)
                following += 1
            else:
                pixels[lane] = -1
                running -= 1
