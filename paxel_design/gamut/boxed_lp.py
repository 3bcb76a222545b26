"""Small linear programmes whose variables all have bounds, many thousands a second: the kernel under the level sets.

Maximise ``cost @ v`` over ``columns @ v = rhs``, ``lower <= v <= upper``. Every bound is finite, so any basis can be
made dual feasible by putting each other variable at the bound its reduced cost asks for: the dual simplex starts at
once, without a first phase, and from the basis of a similar programme it ends after a few pivots. Plain linear
programming; nothing here knows colours.

References
----------
I. Maros, *Computational Techniques of the Simplex Method*, Kluwer 2003, chapter 10 (bound flipping ratio test).
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["INFEASIBLE", "OPTIMAL", "STALLED", "maximise", "solve_boxed_lp"]

OPTIMAL, INFEASIBLE, STALLED = 0, 1, 2

_FEASIBLE = 1e-11
"""How far a variable may lie beyond its bound, relative to the largest number in the programme's right side or 1."""

_PIVOT = 1e-9
_MAX_PIVOTS = 400


def solve_boxed_lp(
    columns: NDArray[np.float64],
    rhs: NDArray[np.float64],
    cost: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
) -> tuple[int, NDArray[np.float64], NDArray[np.float64]]:
    """Maximise ``cost @ v`` over ``columns @ v = rhs``, ``lower <= v <= upper``.

    Parameters
    ----------
    columns : (r, m) float64 array
        Of rank r.
    rhs : (r,) float64 array
    cost, lower, upper : (m,) float64 arrays
        Finite.

    Returns
    -------
    status : int
        `OPTIMAL`, `INFEASIBLE`, or `STALLED` (rows that depend on each other, or 400 pivots without an end).
    v : (m,) float64 array
    worth : (r,) float64 array
        How much the optimum grows with the right side of each row, as long as the basis stays. Like `v` meaningful
        where the status is `OPTIMAL`.
    """
    v = np.empty(columns.shape[1])
    basis = np.full(columns.shape[0], -1, np.int64)
    worth = np.empty(columns.shape[0])
    status = maximise(np.ascontiguousarray(columns), rhs, cost, lower, upper, basis, v, worth)
    return int(status), v, worth


@njit(**KERNEL)
def maximise(
    columns: NDArray[np.float64],
    rhs: NDArray[np.float64],
    cost: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    basis: NDArray[np.int64],
    v: NDArray[np.float64],
    worth: NDArray[np.float64],
) -> int:
    """The same for kernels: `basis` (r,) is where to start, -1 where unknown, and where it ended.

    A start that leads nowhere (a basis of other columns) is dropped once for one found anew.
    """
    status = STALLED
    for attempt in range(0 if basis[0] >= 0 else 1, 2):
        if attempt == 0 or (status != OPTIMAL and _find_basis(columns, basis)):
            status = _from_basis(columns, rhs, cost, lower, upper, basis, v, worth)
    if status != OPTIMAL:
        basis[0] = -1
    return status


@njit(**CALLED)
def _from_basis(
    columns: NDArray[np.float64],
    rhs: NDArray[np.float64],
    cost: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    basis: NDArray[np.int64],
    v: NDArray[np.float64],
    worth: NDArray[np.float64],
) -> int:
    r, m = columns.shape
    inverse, values, reduced, row = np.empty((r, r)), np.empty(r), np.empty(m), np.empty(m)
    basic = np.zeros(m, np.bool_)
    scale = 1.0
    for i in range(r):
        basic[basis[i]] = True
        scale = max(scale, abs(rhs[i]))
    for pivot in range(_MAX_PIVOTS):
        if pivot % 32 == 0 and not _invert_basis(columns, basis, inverse):
            return STALLED
        _reduced_costs(columns, cost, basis, inverse, worth, reduced)
        if pivot == 0:
            for j in range(m):
                v[j] = upper[j] if reduced[j] > 0.0 else lower[j]
        _basic_values(columns, rhs, basis, inverse, v, values)
        leaving, excess = -1, _FEASIBLE * scale
        for i in range(r):
            beyond = max(lower[basis[i]] - values[i], values[i] - upper[basis[i]])
            if beyond > excess:
                leaving, excess = i, beyond
        if leaving < 0:
            for i in range(r):
                v[basis[i]] = min(max(values[i], lower[basis[i]]), upper[basis[i]])
            return OPTIMAL
        # Bring the leaving variable to the bound it broke; `sign` is +1 where it has to grow.
        out = basis[leaving]
        sign = 1.0 if values[leaving] < lower[out] else -1.0
        for k in range(r):
            share = inverse[leaving, k]
            for j in range(m):
                row[j] = share * columns[k, j] + (row[j] if k > 0 else 0.0)
        for j in range(m):
            if basic[j] or upper[j] == lower[j]:
                row[j] = 0.0
        entering = _entering(row, reduced, lower, upper, v, sign, excess, _FEASIBLE * scale)
        if entering < 0:
            return INFEASIBLE
        v[out] = lower[out] if sign > 0.0 else upper[out]
        basic[out], basic[entering], basis[leaving] = False, True, entering
        _pivot(columns, inverse, leaving, entering)
    return STALLED


@njit(**CALLED)
def _entering(
    row: NDArray[np.float64],
    reduced: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    v: NDArray[np.float64],
    sign: float,
    excess: float,
    slack: float,
) -> int:
    """The variable that enters the basis, -1 where none can; those it passes move to their other bound (in `v`).

    At its lower bound a variable helps by growing (slope < 0), at its upper bound by shrinking. One whose whole range
    does not mend the excess moves to its other bound and the next is asked; where all do not, nothing does.
    """
    m = len(row)
    while True:
        best, entering = np.inf, -1
        for j in range(m):
            slope = sign * row[j]
            if (v[j] == lower[j] and slope < -_PIVOT) or (v[j] == upper[j] and slope > _PIVOT):
                ratio = abs(reduced[j] / row[j])
                if ratio < best or (ratio == best and abs(row[j]) > abs(row[entering])):
                    best, entering = ratio, j
        if entering < 0:
            return -1
        excess -= abs(row[entering]) * (upper[entering] - lower[entering])
        if excess <= slack:
            return entering
        # At the other bound it no longer helps, so it is not asked again.
        v[entering] = upper[entering] if v[entering] == lower[entering] else lower[entering]


@njit(**CALLED)
def _reduced_costs(
    columns: NDArray[np.float64],
    cost: NDArray[np.float64],
    basis: NDArray[np.int64],
    inverse: NDArray[np.float64],
    worth: NDArray[np.float64],
    reduced: NDArray[np.float64],
) -> None:
    r, m = columns.shape
    for j in range(m):
        reduced[j] = cost[j]
    for k in range(r):
        worth[k] = 0.0
        for i in range(r):
            worth[k] += cost[basis[i]] * inverse[i, k]
        for j in range(m):
            reduced[j] -= worth[k] * columns[k, j]
    for i in range(r):
        reduced[basis[i]] = 0.0


@njit(**CALLED)
def _basic_values(
    columns: NDArray[np.float64],
    rhs: NDArray[np.float64],
    basis: NDArray[np.int64],
    inverse: NDArray[np.float64],
    v: NDArray[np.float64],
    values: NDArray[np.float64],
) -> None:
    """Values of the basic variables, with the others where `v` has them; theirs in `v` are set to 0."""
    r, m = columns.shape
    for i in range(r):
        v[basis[i]] = values[i] = 0.0
    for k in range(r):
        left = rhs[k]
        for j in range(m):
            left -= columns[k, j] * v[j]
        for i in range(r):
            values[i] += inverse[i, k] * left


@njit(**CALLED)
def _pivot(columns: NDArray[np.float64], inverse: NDArray[np.float64], leaving: int, entering: int) -> None:
    """Update the inverse of the basis: column `entering` takes the place `leaving`."""
    r = len(inverse)
    direction = np.zeros(r)
    for i in range(r):
        for k in range(r):
            direction[i] += inverse[i, k] * columns[k, entering]
    for k in range(r):
        inverse[leaving, k] /= direction[leaving]
    for i in range(r):
        if i != leaving:
            for k in range(r):
                inverse[i, k] -= direction[i] * inverse[leaving, k]


@njit(**CALLED)
def _invert_basis(columns: NDArray[np.float64], basis: NDArray[np.int64], inverse: NDArray[np.float64]) -> bool:
    """Inverse of the basis columns by Gauss-Jordan with row pivoting; False where they depend on each other."""
    r = len(basis)
    matrix = np.empty((r, r))
    for i in range(r):
        for k in range(r):
            matrix[k, i] = columns[k, basis[i]]
            inverse[k, i] = 1.0 if k == i else 0.0
    for i in range(r):
        p = i
        for k in range(i + 1, r):
            if abs(matrix[k, i]) > abs(matrix[p, i]):
                p = k
        if abs(matrix[p, i]) < _PIVOT:
            return False
        for k in range(r):
            matrix[i, k], matrix[p, k] = matrix[p, k], matrix[i, k]
            inverse[i, k], inverse[p, k] = inverse[p, k], inverse[i, k]
        factor = 1.0 / matrix[i, i]
        for k in range(r):
            matrix[i, k] *= factor
            inverse[i, k] *= factor
        for p in range(r):
            factor = matrix[p, i]
            if p != i and factor != 0.0:
                for k in range(r):
                    matrix[p, k] -= factor * matrix[i, k]
                    inverse[p, k] -= factor * inverse[i, k]
    return True


@njit(**CALLED)
def _find_basis(columns: NDArray[np.float64], basis: NDArray[np.int64]) -> bool:
    """Independent columns, the largest pivot in each row of the reduced table; False where the rows have less rank."""
    r, m = columns.shape
    table = columns.copy()
    for i in range(r):
        best, at = 0.0, 0
        for j in range(m):
            if abs(table[i, j]) > best:
                best, at = abs(table[i, j]), j
        if best < _PIVOT:
            return False
        basis[i] = at
        for p in range(r):
            factor = table[p, at] / table[i, at]
            if p != i and factor != 0.0:
                for j in range(m):
                    table[p, j] -= factor * table[i, j]
    return True
