"""A small quadratic programme in a box, solved in its dual for `LANES` pixels at a time.

For each pixel (lane), with n inputs x and 6 equations (3 values of XYZ on each of 2 surfaces)::

    minimise  1/2 (A x - z)^T S^-1 (A x - z) + 1/2 |x - 1/2|^2   over 0 <= x <= 1

S (positive definite, one 3 x 3 block a surface) is the *compliance*: 0 asks for A x = z exactly, and the answer is the
solution nearest to mid-gray. With the multipliers nu = S^-1 (z - A x) the minimiser is x = clip(1/2 + A^T nu), so the
only unknowns are 6 numbers, whatever n. They solve

    R(nu) = z - S nu - A clip(1/2 + A^T nu) = 0,

the gradient of a concave, piecewise quadratic function. Newton's matrix is S + A_F A_F^T (F: the inputs strictly
inside the box); an exact line search over the pieces makes it converge from anywhere, in a handful of steps from
nothing and one or two from the previous solution. x is unique and moves continuously with z and S.

The dual's value never passes the minimum, so one beyond n / 8 shows that no x in the box meets z exactly.

A is the same for all pixels, or every lane has its own (the image-based model): the kernels take its transpose as
(n, 6) or (n, 6, LANES), and the compiler keeps the branch that fits.

Workspace and lanes are those of `lanes`. This file knows nothing of colour.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from paxel_runtime.inversion.lanes import (
    LANES,
    Floats,
    Surfaces,
    Vec6,
    along,
    clip,
    column,
    dot,
    factor,
    larger,
    smaller,
    solve3,
    sym3,
    times,
    vec3,
)
from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["DONE", "MATRIX", "NU", "REG", "RES", "ROWS", "S_FIRST", "S_REST", "Z", "qp_steps"]

# Rows of the workspace, in multiples of LANES. Of 6 rows, the first 3 belong to the pattern, the others to the white
# surface: what is at row r of the one is at row r + 3 of the other.
NU = 0 * LANES  # 6: multipliers, in and out
Z = 6 * LANES  # 6: z
S_FIRST = 12 * LANES  # 6: compliance: 00 01 02 of each surface
S_REST = 18 * LANES  # 6: 11 12 22 of each surface
RES = 24 * LANES  # 6: R(nu), out
REG = 30 * LANES  # 1: 1/2 |x - 1/2|^2, out
DONE = 31 * LANES  # 1: 1.0 where |R| is down to rounding, out
MATRIX = 32 * LANES  # 21: Newton's matrix: 6 of the first block, 9 of the coupling, 6 of the second block
_D = 53 * LANES  # 6: direction
_T, _H, _SLOPE, _NEXT, _CURVE = 59 * LANES, 60 * LANES, 61 * LANES, 62 * LANES, 63 * LANES  # line search
ROWS = 64
"""Rows used here; a caller's own rows start at ``ROWS * LANES``."""

_KERNEL: dict[str, Any] = {**KERNEL, "fastmath": {"contract"}}
_FAR = 1e300


@njit(**INLINED)
def _subtract_input(w: Floats, u: Floats, j: int, lane: int, a: Vec6, surfaces: Surfaces) -> None:
    """Input j of `_residual`."""
    t = 0.5 + along(a, w, NU + lane, surfaces)
    x = clip(t)
    u[j * LANES + lane] = t
    w[REG + lane] += 0.5 * (x - 0.5) * (x - 0.5)
    w[RES + lane] -= a[0] * x
    w[RES + LANES + lane] -= a[1] * x
    w[RES + 2 * LANES + lane] -= a[2] * x
    if len(surfaces) == 2:
        w[RES + 3 * LANES + lane] -= a[3] * x
        w[RES + 4 * LANES + lane] -= a[4] * x
        w[RES + 5 * LANES + lane] -= a[5] * x


@njit(**INLINED)
def _subtract_compliance(w: Floats, lane: int, first: int) -> None:
    """R = z - S nu on the surface whose rows are `first` after those of the pattern."""
    s0, s1, s2 = times(sym3(w, S_FIRST + first + lane, S_REST + first + lane), vec3(w, NU + first + lane))
    res, z = RES + first + lane, Z + first + lane
    w[res], w[res + LANES], w[res + 2 * LANES] = w[z] - s0, w[z + LANES] - s1, w[z + 2 * LANES] - s2


@njit(**INLINED)
def _residual(w: Floats, u: Floats, AT: Floats, surfaces: Surfaces) -> None:
    """R(nu), 1/2 |x - 1/2|^2 and u = 1/2 + A^T nu (n rows)."""
    for lane in range(LANES):
        _subtract_compliance(w, lane, 0)
        if len(surfaces) == 2:
            _subtract_compliance(w, lane, 3 * LANES)
        w[REG + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _subtract_input(w, u, j, lane, a, surfaces)
        else:
            for lane in range(LANES):
                _subtract_input(w, u, j, lane, column(AT, j, lane), surfaces)


@njit(**INLINED)
def _add_free_input(w: Floats, u: Floats, j: int, lane: int, a: Vec6, surfaces: Surfaces) -> None:
    """Input j of `_matrix`, if it is inside the box."""
    t = u[j * LANES + lane]
    f = 1.0 if t == clip(t) else 0.0
    f0, f1, f2 = f * a[0], f * a[1], f * a[2]
    w[MATRIX + lane] += f0 * a[0]
    w[MATRIX + LANES + lane] += f0 * a[1]
    w[MATRIX + 2 * LANES + lane] += f0 * a[2]
    w[MATRIX + 3 * LANES + lane] += f1 * a[1]
    w[MATRIX + 4 * LANES + lane] += f1 * a[2]
    w[MATRIX + 5 * LANES + lane] += f2 * a[2]
    if len(surfaces) == 2:
        f3, f4, f5 = f * a[3], f * a[4], f * a[5]
        w[MATRIX + 6 * LANES + lane] += f0 * a[3]
        w[MATRIX + 7 * LANES + lane] += f0 * a[4]
        w[MATRIX + 8 * LANES + lane] += f0 * a[5]
        w[MATRIX + 9 * LANES + lane] += f1 * a[3]
        w[MATRIX + 10 * LANES + lane] += f1 * a[4]
        w[MATRIX + 11 * LANES + lane] += f1 * a[5]
        w[MATRIX + 12 * LANES + lane] += f2 * a[3]
        w[MATRIX + 13 * LANES + lane] += f2 * a[4]
        w[MATRIX + 14 * LANES + lane] += f2 * a[5]
        w[MATRIX + 15 * LANES + lane] += f3 * a[3]
        w[MATRIX + 16 * LANES + lane] += f3 * a[4]
        w[MATRIX + 17 * LANES + lane] += f3 * a[5]
        w[MATRIX + 18 * LANES + lane] += f4 * a[4]
        w[MATRIX + 19 * LANES + lane] += f4 * a[5]
        w[MATRIX + 20 * LANES + lane] += f5 * a[5]


@njit(**INLINED)
def _matrix(w: Floats, u: Floats, AT: Floats, surfaces: Surfaces) -> None:
    """Newton's matrix S + A_F A_F^T."""
    for lane in range(LANES):
        for i in range(3):
            w[MATRIX + i * LANES + lane] = w[S_FIRST + i * LANES + lane]
            w[MATRIX + (3 + i) * LANES + lane] = w[S_REST + i * LANES + lane]
        if len(surfaces) == 2:
            for i in range(3):
                w[MATRIX + (15 + i) * LANES + lane] = w[S_FIRST + (3 + i) * LANES + lane]
                w[MATRIX + (18 + i) * LANES + lane] = w[S_REST + (3 + i) * LANES + lane]
            for i in range(6, 15):
                w[MATRIX + i * LANES + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _add_free_input(w, u, j, lane, a, surfaces)
        else:
            for lane in range(LANES):
                _add_free_input(w, u, j, lane, column(AT, j, lane), surfaces)


@njit(**INLINED)
def _size3(w: Floats, row: int) -> tuple[float, float]:
    """Largest and summed magnitude of 3 rows."""
    a, b, c = abs(w[row]), abs(w[row + LANES]), abs(w[row + 2 * LANES])
    return larger(larger(a, b), c), a + b + c


@njit(**INLINED)
def _dual(w: Floats, lane: int, first: int) -> float:
    """Part of the dual's value of one surface: nu . (R + S nu / 2)."""
    nu = vec3(w, NU + first + lane)
    s0, s1, s2 = times(sym3(w, S_FIRST + first + lane, S_REST + first + lane), nu)
    r0, r1, r2 = vec3(w, RES + first + lane)
    return nu[0] * (r0 + 0.5 * s0) + nu[1] * (r1 + 0.5 * s1) + nu[2] * (r2 + 0.5 * s2)


@njit(**INLINED)
def _count_done(w: Floats, tolerance: float, bound: float, surfaces: Surfaces) -> int:
    """Mark the lanes that need no further step.

    Their residual is down to `tolerance` or to rounding (u carries the rounding of A^T nu), or the dual's value, which
    the minimum cannot be below, is past `bound`.
    """
    done = 0
    for lane in range(LANES):
        largest, size = _size3(w, RES + lane)[0], _size3(w, NU + lane)[1]
        dual = w[REG + lane] + _dual(w, lane, 0)
        if len(surfaces) == 2:
            largest = larger(largest, _size3(w, RES + 3 * LANES + lane)[0])
            size += _size3(w, NU + 3 * LANES + lane)[1]
            dual += _dual(w, lane, 3 * LANES)
        is_done = largest <= tolerance + 1e-15 * size or dual > bound
        w[DONE + lane] = 1.0 if is_done else 0.0
        done += 1 if is_done else 0
    return done


@njit(**INLINED)
def _direction(w: Floats, surfaces: Surfaces) -> None:
    """Newton's direction, zero in lanes that are done."""
    for lane in range(LANES):
        P = factor(sym3(w, MATRIX + lane, MATRIX + 3 * LANES + lane))
        moving = 1.0 - w[DONE + lane]
        e = solve3(P, vec3(w, RES + lane))
        if len(surfaces) == 2:  # by blocks, (P Q; Q^T T) d = R with the Schur complement of P
            q0, q1 = vec3(w, MATRIX + 6 * LANES + lane), vec3(w, MATRIX + 9 * LANES + lane)
            q2 = vec3(w, MATRIX + 12 * LANES + lane)
            T = sym3(w, MATRIX + 15 * LANES + lane, MATRIX + 18 * LANES + lane)
            c0, c1, c2 = (q0[0], q1[0], q2[0]), (q0[1], q1[1], q2[1]), (q0[2], q1[2], q2[2])  # columns of Q
            e0, e1, e2 = solve3(P, c0), solve3(P, c1), solve3(P, c2)
            schur = factor(
                (
                    T[0] - dot(c0, e0),
                    T[1] - dot(c0, e1),
                    T[2] - dot(c0, e2),
                    T[3] - dot(c1, e1),
                    T[4] - dot(c1, e2),
                    T[5] - dot(c2, e2),
                )
            )
            h = vec3(w, RES + 3 * LANES + lane)
            d = solve3(schur, (h[0] - dot(c0, e), h[1] - dot(c1, e), h[2] - dot(c2, e)))
            e = (
                e[0] - e0[0] * d[0] - e1[0] * d[1] - e2[0] * d[2],
                e[1] - e0[1] * d[0] - e1[1] * d[1] - e2[1] * d[2],
                e[2] - e0[2] * d[0] - e1[2] * d[1] - e2[2] * d[2],
            )
            w[_D + 3 * LANES + lane] = moving * d[0]
            w[_D + 4 * LANES + lane] = moving * d[1]
            w[_D + 5 * LANES + lane] = moving * d[2]
        w[_D + lane] = moving * e[0]
        w[_D + LANES + lane] = moving * e[1]
        w[_D + 2 * LANES + lane] = moving * e[2]


@njit(**INLINED)
def _crossing(u: Floats, v: Floats, j: int, lane: int, slope: float) -> None:
    """Input j of `_crossings`."""
    speed = larger(abs(slope), 1e-200)
    position = u[j * LANES + lane]
    ahead = -position if slope >= 0.0 else position - 1.0  # distance to the near side of the box
    v[j * LANES + lane] = speed
    u[j * LANES + lane] = ahead / speed


@njit(**INLINED)
def _slopes(w: Floats, lane: int, first: int) -> tuple[float, float]:
    """R . d and d . S d of one surface."""
    d = vec3(w, _D + first + lane)
    S = sym3(w, S_FIRST + first + lane, S_REST + first + lane)
    return dot(d, vec3(w, RES + first + lane)), dot(d, times(S, d))


@njit(**INLINED)
def _crossings(w: Floats, u: Floats, v: Floats, AT: Floats, surfaces: Surfaces) -> None:
    """v = A^T d; u becomes the step t at which an input enters the box; the slope of R . d at t = 0 and its own."""
    for lane in range(LANES):
        h, curve = _slopes(w, lane, 0)
        if len(surfaces) == 2:
            h_white, curve_white = _slopes(w, lane, 3 * LANES)
            h, curve = h + h_white, curve + curve_white
        w[_H + lane] = h
        w[_CURVE + lane] = curve
        w[_T + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _crossing(u, v, j, lane, along(a, w, _D + lane, surfaces))
        else:
            for lane in range(LANES):
                _crossing(u, v, j, lane, along(column(AT, j, lane), w, _D + lane, surfaces))


@njit(**INLINED)
def _line_search(w: Floats, u: Floats, v: Floats, n: int) -> None:
    """Exact maximum along d, at most the full step: walk over the pieces until the slope changes sign.

    Within a piece the slope falls by curve + sum of v^2 over the inputs inside the box; an input enters at u and
    leaves at u + 1 / v.
    """
    for _ in range(2 * n + 1):
        for lane in range(LANES):
            w[_NEXT + lane] = 1.0
            w[_SLOPE + lane] = w[_CURVE + lane]
        for j in range(n):
            for lane in range(LANES):
                t = w[_T + lane]
                enter, speed = u[j * LANES + lane], v[j * LANES + lane]
                leave = enter + 1.0 / speed
                following = enter if enter > t else (leave if leave > t else _FAR)
                w[_NEXT + lane] = smaller(w[_NEXT + lane], following)
                w[_SLOPE + lane] += speed * speed if enter <= t and leave > t else 0.0
        walking = 0
        for lane in range(LANES):
            t, h, slope, end = w[_T + lane], w[_H + lane], w[_SLOPE + lane], w[_NEXT + lane]
            h_end = h - slope * (end - t)
            stops = h_end <= 0.0 or end >= 1.0
            root = smaller(t + h / larger(slope, 1e-300), end)
            w[_T + lane] = root if stops else end
            w[_H + lane] = 0.0 if stops else h_end
            walking += 0 if stops else 1
        if walking == 0:
            break


@njit(**_KERNEL)
def qp_steps(
    w: Floats,
    u: Floats,
    v: Floats,
    AT: Floats,
    surfaces: Surfaces,
    tolerance: float,
    bound: float,
    steps: int,
) -> int:
    """At most `steps` Newton steps in every lane, from the multipliers in `w`.

    Parameters
    ----------
    w : (>= ROWS * LANES,) float64 array
        In: NU, Z, S_FIRST, S_REST. Out: NU, RES, REG, DONE.
    u : (n * LANES,) float64 array
        Out: 1/2 + A^T nu; x is its clip to 0..1.
    v : (n * LANES,) float64 array
        Scratch.
    AT : (n, 6) or (n, 6, LANES) float64 array
        The transpose of A.
    surfaces : (0,) or (0, 1)
        One surface or two; the compiler makes a kernel for each.
    tolerance : float
        Largest |R| that counts as solved.
    bound : float
        A programme whose minimum is known to be above this is given up, and counts as done.
    steps : int
        Bound of steps; lanes not done then go on from their multipliers at the next call.

    Returns
    -------
    int
        Steps taken.
    """
    for step in range(steps + 1):
        _residual(w, u, AT, surfaces)
        if _count_done(w, tolerance, bound, surfaces) == LANES or step == steps:
            return step
        _matrix(w, u, AT, surfaces)
        _direction(w, surfaces)
        _crossings(w, u, v, AT, surfaces)
        _line_search(w, u, v, AT.shape[0])
        for lane in range(LANES):
            for i in range(3 * len(surfaces)):
                w[NU + i * LANES + lane] += w[_T + lane] * w[_D + i * LANES + lane]
    return steps
