"""The largest chroma that a pair of colours of given hues can have: the kernel under hue-change areas.

A pair is (L_P, c u) on the pattern and (L_W, c w) on the white surface, u and w unit directions in (a*, b*). For given
lightness c follows by Newton's rule: the linear programme max c over inputs x, with the pair straightened at the last
c. Over a rectangle of lightness the same programme with L_P and L_W as variables says where to go, within a region of
trust that shrinks where the straight pair misleads.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.boxed_lp import OPTIMAL, maximise
from paxel_runtime.model.lab_scalars import luminance_of, root, root_slope
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["chroma_for_all", "chroma_for_any"]

_LARGEST_CHROMA = 200.0
_NEWTONS = 12
_CLOSE = 1e-6
"""Change of chroma at which Newton's rule ends."""

_STEPS = 60
_SMALLEST_TRUST = 1e-3
"""Region of trust at which the search over lightness ends, L*."""

_Array = NDArray[np.float64]
_Programme = tuple[_Array, _Array, _Array, _Array, _Array, _Array]
"""Columns, right side, cost, lower and upper bounds, as `maximise` takes them; and b, (6,)."""


@njit(**KERNEL)
def chroma_for_all(
    A: NDArray[np.float64], b: NDArray[np.float64], white: NDArray[np.float64], directions: NDArray[np.float64],
    places: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    """Largest chroma at each place (k, 2) = (L_P, L_W) in each pair of directions (h, 4) = (u, w), (h, k).

    A (6, n) and b (6,) of both surfaces.
    """
    programme = _programme(A, b)
    basis, found = np.empty(6, np.int64), np.empty((len(directions), len(places)))
    basis[0] = -1
    for k in range(len(places)):
        c = 0.0
        for h in range(len(directions)):
            c = _chroma_at(programme, basis, white, directions[h], places[k], c)
            found[h, k] = c
    return found


@njit(**KERNEL)
def chroma_for_any(
    A: NDArray[np.float64], b: NDArray[np.float64], white: NDArray[np.float64], directions: NDArray[np.float64],
    rectangle: NDArray[np.float64], places: NDArray[np.float64],
) -> NDArray[np.float64]:  # fmt: skip
    """Largest chroma in each pair of directions (h, 4) that some lightness in `rectangle` (2, 2) has, (h,).

    Rows of `rectangle`: low, high. The search begins at each of `places` (k, 2), and where the last direction ended.
    """
    programme = _programme(A, b)
    basis, best = np.empty(6, np.int64), np.zeros(len(directions))
    basis[0] = -1
    at, last = np.empty(2), np.empty(2)
    for h in range(len(directions)):
        start = last.copy()
        for k in range(0 if h > 0 else 1, len(places) + 1):
            for s in range(2):
                at[s] = start[s] if k == 0 else places[k - 1, s]
            c = _climbed(programme, basis, white, directions[h], rectangle, at)
            if c > best[h]:
                best[h] = c
                last[0], last[1] = at[0], at[1]
    return best


@njit(**CALLED)
def _climbed(
    programme: _Programme,
    basis: NDArray[np.int64],
    white: NDArray[np.float64],
    direction: NDArray[np.float64],
    rectangle: NDArray[np.float64],
    at: NDArray[np.float64],
) -> float:
    """Largest chroma near the lightness `at` (2,), which moves there."""
    columns, rhs, cost, lower, upper, _ = programme
    n = columns.shape[1] - 3
    v, worth, there = np.empty(n + 3), np.empty(6), np.empty(2)
    best = _chroma_at(programme, basis, white, direction, at, 0.0)
    trust = max(rectangle[1, 0] - rectangle[0, 0], rectangle[1, 1] - rectangle[0, 1])
    for _ in range(_STEPS):
        if trust < _SMALLEST_TRUST:
            break
        _straighten(programme, white, direction, at, best)
        for s in range(2):
            lower[n + s] = max(rectangle[0, s], at[s] - trust)
            upper[n + s] = min(rectangle[1, s], at[s] + trust)
        if maximise(columns, rhs, cost, lower, upper, basis, v, worth) != OPTIMAL:
            trust *= 0.25
            continue
        there[0], there[1] = v[n], v[n + 1]
        c = _chroma_at(programme, basis, white, direction, there, best)
        if c > best:
            if c - best < 0.5 * (v[n + 2] - best):
                trust *= 0.5
            best = c
            at[0], at[1] = there[0], there[1]
        else:
            trust *= 0.25
    return best


@njit(**CALLED)
def _chroma_at(
    programme: _Programme,
    basis: NDArray[np.int64],
    white: NDArray[np.float64],
    direction: NDArray[np.float64],
    L: NDArray[np.float64],
    start: float,
) -> float:
    """Largest chroma at one lightness (2,), by Newton's rule from `start`; 0 where the grays are not in reach."""
    columns, rhs, cost, lower, upper, _ = programme
    n = columns.shape[1] - 3
    v, worth = np.empty(n + 3), np.empty(6)
    for s in range(2):
        lower[n + s] = upper[n + s] = L[s]
    c = start
    for _ in range(_NEWTONS):
        _straighten(programme, white, direction, L, c)
        if maximise(columns, rhs, cost, lower, upper, basis, v, worth) != OPTIMAL:
            # The tangent passes the gamut by: begin further in.
            if c < 1e-3:
                return 0.0
            c *= 0.5
            continue
        change = v[n + 2] - c
        c = v[n + 2]
        if abs(change) < _CLOSE:
            break
    return c


@njit(**CALLED)
def _straighten(
    programme: _Programme,
    white: NDArray[np.float64],
    direction: NDArray[np.float64],
    L: NDArray[np.float64],
    chroma: float,
) -> None:
    """Set the columns of L_P, L_W and c, and the right side, to the pair's tangent at a lightness and chroma."""
    columns, rhs, _, _, _, b = programme
    n = columns.shape[1] - 3
    for s in range(2):
        fy = root(luminance_of(L[s]))
        for i in range(3):
            # Change of CIELAB's f with c: a* / 500 for X, none for Y, -b* / 200 for Z.
            turn = direction[2 * s] / 500.0 if i == 0 else 0.0 if i == 1 else -direction[2 * s + 1] / 200.0
            t = luminance_of(116.0 * (fy + chroma * turn) - 16.0)
            slope = white[i] / root_slope(t)
            row = 3 * s + i
            columns[row, n + s] = -slope / 116.0
            columns[row, n + 2] = -slope * turn
            rhs[row] = white[i] * t - b[row] - slope * (L[s] / 116.0 + chroma * turn)


@njit(**CALLED)
def _programme(A: NDArray[np.float64], b: NDArray[np.float64]) -> _Programme:
    """The programme max c, its pair still unset. Variables: inputs x (n), L_P, L_W, c; rows: both colours' XYZ."""
    n = A.shape[1]
    columns, rhs, cost = np.zeros((6, n + 3)), np.zeros(6), np.zeros(n + 3)
    lower, upper = np.zeros(n + 3), np.zeros(n + 3)
    for j in range(n):
        upper[j] = 1.0
        for row in range(6):
            columns[row, j] = A[row, j]
    cost[n + 2], upper[n + 2] = 1.0, _LARGEST_CHROMA
    return columns, rhs, cost, lower, upper, b
