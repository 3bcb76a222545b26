"""A small quadratic programme in a box, solved in its dual for eight pixels at a time.

For each pixel (lane), with n inputs x and 6 equations (3 values of XYZ on each of 2 surfaces)::

    minimise  1/2 (A x - z)^T S^-1 (A x - z) + 1/2 |x - 1/2|^2   over 0 <= x <= 1

S (positive definite, one 3 x 3 block a surface) is the *compliance*: 0 asks for A x = z exactly, and the answer is the
solution nearest to mid-gray. With the multipliers nu = S^-1 (z - A x) the minimiser is x = clip(1/2 + A^T nu), so the
only unknowns are 6 numbers, whatever n. They solve

    R(nu) = z - S nu - A clip(1/2 + A^T nu) = 0,

the gradient of a concave, piecewise quadratic function. Newton's matrix is S + A_F A_F^T (F: the inputs strictly
inside the box); an exact line search over the pieces makes it converge from anywhere, in a handful of steps from
nothing and one or two from the previous solution. x is unique and moves continuously with z and S.

A is the same for all pixels, or every lane has its own (the image-based model): the kernels take its transpose as
(n, 6) or (n, 6, LANES), and the compiler keeps the branch that fits.

Lanes: the loops over `LANES` pixels are the inner ones and become SIMD instructions. That needs one flat workspace
addressed by constants (``w[NU + 2 * LANES + lane]``), so that the compiler can see that rows do not overlap.
This file knows nothing of colour.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import INLINED

__all__ = [
    "DONE",
    "LANES",
    "NU",
    "REG",
    "RES",
    "ROWS",
    "S_FIRST",
    "S_REST",
    "Z",
    "along",
    "clip",
    "column",
    "larger",
    "qp_steps",
    "smaller",
]

LANES = 16
"""Pixels solved side by side."""

# Rows of the workspace, in multiples of LANES. Of 6 rows, the first 3 belong to the pattern, the others to the white
# surface: what is at row r of the one is at row r + 3 of the other.
NU = 0 * LANES  # 6: multipliers, in and out
Z = 6 * LANES  # 6: z
S_FIRST = 12 * LANES  # 6: compliance: 00 01 02 of each surface
S_REST = 18 * LANES  # 6: 11 12 22 of each surface
RES = 24 * LANES  # 6: R(nu), out
REG = 30 * LANES  # 1: 1/2 |x - 1/2|^2, out
DONE = 31 * LANES  # 1: 1.0 where |R| is down to rounding, out
_M = 32 * LANES  # 21: Newton's matrix: 6 of the first block, 9 of the coupling, 6 of the second block
_D = 53 * LANES  # 6: direction
_T, _H, _SLOPE, _NEXT, _CURVE = 59 * LANES, 60 * LANES, 61 * LANES, 62 * LANES, 63 * LANES  # line search
ROWS = 64
"""Rows used here; a caller's own rows start at ``ROWS * LANES``."""

Floats: TypeAlias = NDArray[np.float64]
Vec3: TypeAlias = tuple[float, float, float]
Vec6: TypeAlias = tuple[float, float, float, float, float, float]
Sym3: TypeAlias = tuple[float, float, float, float, float, float]

_KERNEL = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}, "nogil": True}
_FAR = 1e300


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
def _factor(p: Sym3) -> Sym3:
    """L D L^T of a symmetric 3 x 3 matrix: l10, l20, l21, 1/d0, 1/d1, 1/d2."""
    i0 = 1.0 / p[0]
    l10, l20 = p[1] * i0, p[2] * i0
    i1 = 1.0 / (p[3] - l10 * p[1])
    c21 = p[4] - l20 * p[1]
    l21 = c21 * i1
    i2 = 1.0 / (p[5] - l20 * p[2] - l21 * c21)
    return l10, l20, l21, i0, i1, i2


@njit(**INLINED)
def _solve(f: Sym3, r: Vec3) -> Vec3:
    y1 = r[1] - f[0] * r[0]
    y2 = (r[2] - f[1] * r[0] - f[2] * y1) * f[5]
    x1 = y1 * f[4] - f[2] * y2
    return r[0] * f[3] - f[0] * x1 - f[1] * y2, x1, y2


@njit(**INLINED)
def _dot(a: Vec3, b: Vec3) -> float:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@njit(**INLINED)
def _times(s: Sym3, v: Vec3) -> Vec3:
    return (
        s[0] * v[0] + s[1] * v[1] + s[2] * v[2],
        s[1] * v[0] + s[3] * v[1] + s[4] * v[2],
        s[2] * v[0] + s[4] * v[1] + s[5] * v[2],
    )


@njit(**INLINED)
def _vec3(w: Floats, row: int) -> Vec3:
    return w[row], w[row + LANES], w[row + 2 * LANES]


@njit(**INLINED)
def _sym3(w: Floats, first: int, rest: int) -> Sym3:
    return w[first], w[first + LANES], w[first + 2 * LANES], w[rest], w[rest + LANES], w[rest + 2 * LANES]


@njit(**INLINED)
def column(AT: Floats, j: int, lane: int) -> Vec6:
    """What input j adds at full, on both surfaces."""
    if AT.ndim == 2:
        return AT[j, 0], AT[j, 1], AT[j, 2], AT[j, 3], AT[j, 4], AT[j, 5]
    return AT[j, 0, lane], AT[j, 1, lane], AT[j, 2, lane], AT[j, 3, lane], AT[j, 4, lane], AT[j, 5, lane]


@njit(**INLINED)
def along(a: Vec6, w: Floats, row: int) -> float:
    """Product of a column of A with six rows of the workspace."""
    return (a[0] * w[row] + a[1] * w[row + LANES] + a[2] * w[row + 2 * LANES]) + (
        a[3] * w[row + 3 * LANES] + a[4] * w[row + 4 * LANES] + a[5] * w[row + 5 * LANES]
    )


@njit(**INLINED)
def _subtract_input(w: Floats, u: Floats, j: int, lane: int, a: Vec6) -> None:
    """Input j of `_residual`."""
    t = 0.5 + along(a, w, NU + lane)
    x = clip(t)
    u[j * LANES + lane] = t
    w[REG + lane] += 0.5 * (x - 0.5) * (x - 0.5)
    w[RES + lane] -= a[0] * x
    w[RES + LANES + lane] -= a[1] * x
    w[RES + 2 * LANES + lane] -= a[2] * x
    w[RES + 3 * LANES + lane] -= a[3] * x
    w[RES + 4 * LANES + lane] -= a[4] * x
    w[RES + 5 * LANES + lane] -= a[5] * x


@njit(**INLINED)
def _residual(w: Floats, u: Floats, AT: Floats) -> None:
    """R(nu), 1/2 |x - 1/2|^2 and u = 1/2 + A^T nu (n rows)."""
    for lane in range(LANES):
        for s in range(2):
            r = _times(
                _sym3(w, S_FIRST + 3 * s * LANES + lane, S_REST + 3 * s * LANES + lane),
                _vec3(w, NU + 3 * s * LANES + lane),
            )
            res, z = RES + 3 * s * LANES + lane, Z + 3 * s * LANES + lane
            w[res], w[res + LANES], w[res + 2 * LANES] = w[z] - r[0], w[z + LANES] - r[1], w[z + 2 * LANES] - r[2]
        w[REG + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _subtract_input(w, u, j, lane, a)
        else:
            for lane in range(LANES):
                _subtract_input(w, u, j, lane, column(AT, j, lane))


@njit(**INLINED)
def _add_free_input(w: Floats, u: Floats, j: int, lane: int, a: Vec6) -> None:
    """Input j of `_matrix`, if it is inside the box."""
    t = u[j * LANES + lane]
    f = 1.0 if t == clip(t) else 0.0
    f0, f1, f2, f3, f4, f5 = f * a[0], f * a[1], f * a[2], f * a[3], f * a[4], f * a[5]
    w[_M + lane] += f0 * a[0]
    w[_M + LANES + lane] += f0 * a[1]
    w[_M + 2 * LANES + lane] += f0 * a[2]
    w[_M + 3 * LANES + lane] += f1 * a[1]
    w[_M + 4 * LANES + lane] += f1 * a[2]
    w[_M + 5 * LANES + lane] += f2 * a[2]
    w[_M + 6 * LANES + lane] += f0 * a[3]
    w[_M + 7 * LANES + lane] += f0 * a[4]
    w[_M + 8 * LANES + lane] += f0 * a[5]
    w[_M + 9 * LANES + lane] += f1 * a[3]
    w[_M + 10 * LANES + lane] += f1 * a[4]
    w[_M + 11 * LANES + lane] += f1 * a[5]
    w[_M + 12 * LANES + lane] += f2 * a[3]
    w[_M + 13 * LANES + lane] += f2 * a[4]
    w[_M + 14 * LANES + lane] += f2 * a[5]
    w[_M + 15 * LANES + lane] += f3 * a[3]
    w[_M + 16 * LANES + lane] += f3 * a[4]
    w[_M + 17 * LANES + lane] += f3 * a[5]
    w[_M + 18 * LANES + lane] += f4 * a[4]
    w[_M + 19 * LANES + lane] += f4 * a[5]
    w[_M + 20 * LANES + lane] += f5 * a[5]


@njit(**INLINED)
def _matrix(w: Floats, u: Floats, AT: Floats) -> None:
    """Newton's matrix S + A_F A_F^T."""
    for lane in range(LANES):
        for i in range(3):
            w[_M + i * LANES + lane] = w[S_FIRST + i * LANES + lane]
            w[_M + (3 + i) * LANES + lane] = w[S_REST + i * LANES + lane]
            w[_M + (15 + i) * LANES + lane] = w[S_FIRST + (3 + i) * LANES + lane]
            w[_M + (18 + i) * LANES + lane] = w[S_REST + (3 + i) * LANES + lane]
        for i in range(6, 15):
            w[_M + i * LANES + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _add_free_input(w, u, j, lane, a)
        else:
            for lane in range(LANES):
                _add_free_input(w, u, j, lane, column(AT, j, lane))


@njit(**INLINED)
def _count_done(w: Floats, tolerance: float) -> int:
    """Mark the lanes whose residual is down to `tolerance` or to rounding (u carries the rounding of A^T nu)."""
    done = 0
    for lane in range(LANES):
        r0, r1, r2 = _vec3(w, RES + lane)
        r3, r4, r5 = _vec3(w, RES + 3 * LANES + lane)
        n0, n1, n2 = _vec3(w, NU + lane)
        n3, n4, n5 = _vec3(w, NU + 3 * LANES + lane)
        largest = larger(larger(larger(abs(r0), abs(r1)), larger(abs(r2), abs(r3))), larger(abs(r4), abs(r5)))
        size = abs(n0) + abs(n1) + abs(n2) + abs(n3) + abs(n4) + abs(n5)
        is_done = largest <= tolerance + 1e-15 * size
        w[DONE + lane] = 1.0 if is_done else 0.0
        done += 1 if is_done else 0
    return done


@njit(**INLINED)
def _direction(w: Floats) -> None:
    """Newton's direction by blocks: (P Q; Q^T T) d = R with the Schur complement of P. Zero in lanes that are done."""
    for lane in range(LANES):
        P = _factor(_sym3(w, _M + lane, _M + 3 * LANES + lane))
        q0, q1, q2 = (
            _vec3(w, _M + 6 * LANES + lane),
            _vec3(w, _M + 9 * LANES + lane),
            _vec3(w, _M + 12 * LANES + lane),
        )
        T = _sym3(w, _M + 15 * LANES + lane, _M + 18 * LANES + lane)
        c0, c1, c2 = (q0[0], q1[0], q2[0]), (q0[1], q1[1], q2[1]), (q0[2], q1[2], q2[2])  # columns of Q
        e0, e1, e2 = _solve(P, c0), _solve(P, c1), _solve(P, c2)
        schur = _factor(
            (
                T[0] - _dot(c0, e0),
                T[1] - _dot(c0, e1),
                T[2] - _dot(c0, e2),
                T[3] - _dot(c1, e1),
                T[4] - _dot(c1, e2),
                T[5] - _dot(c2, e2),
            )
        )
        g, h = _vec3(w, RES + lane), _vec3(w, RES + 3 * LANES + lane)
        e = _solve(P, g)
        d2 = _solve(schur, (h[0] - _dot(c0, e), h[1] - _dot(c1, e), h[2] - _dot(c2, e)))
        moving = 1.0 - w[DONE + lane]
        w[_D + lane] = moving * (e[0] - e0[0] * d2[0] - e1[0] * d2[1] - e2[0] * d2[2])
        w[_D + LANES + lane] = moving * (e[1] - e0[1] * d2[0] - e1[1] * d2[1] - e2[1] * d2[2])
        w[_D + 2 * LANES + lane] = moving * (e[2] - e0[2] * d2[0] - e1[2] * d2[1] - e2[2] * d2[2])
        w[_D + 3 * LANES + lane] = moving * d2[0]
        w[_D + 4 * LANES + lane] = moving * d2[1]
        w[_D + 5 * LANES + lane] = moving * d2[2]


@njit(**INLINED)
def _crossing(u: Floats, v: Floats, j: int, lane: int, slope: float) -> None:
    """Input j of `_crossings`."""
    speed = larger(abs(slope), 1e-200)
    position = u[j * LANES + lane]
    ahead = -position if slope >= 0.0 else position - 1.0  # distance to the near side of the box
    v[j * LANES + lane] = speed
    u[j * LANES + lane] = ahead / speed


@njit(**INLINED)
def _crossings(w: Floats, u: Floats, v: Floats, AT: Floats) -> None:
    """v = A^T d; u becomes the step t at which an input enters the box; the slope of R . d at t = 0 and its own."""
    for lane in range(LANES):
        h, curve = 0.0, 0.0
        for s in range(2):
            d = _vec3(w, _D + 3 * s * LANES + lane)
            h += _dot(d, _vec3(w, RES + 3 * s * LANES + lane))
            S = _sym3(w, S_FIRST + 3 * s * LANES + lane, S_REST + 3 * s * LANES + lane)
            curve += _dot(d, _times(S, d))
        w[_H + lane] = h
        w[_CURVE + lane] = curve
        w[_T + lane] = 0.0
    for j in range(AT.shape[0]):
        if AT.ndim == 2:
            a = column(AT, j, 0)
            for lane in range(LANES):
                _crossing(u, v, j, lane, along(a, w, _D + lane))
        else:
            for lane in range(LANES):
                _crossing(u, v, j, lane, along(column(AT, j, lane), w, _D + lane))


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
    tolerance: float,
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
        The transpose of A; zero columns where there is one surface.
    tolerance : float
        Largest |R| that counts as solved.
    steps : int
        Bound of steps; lanes not done then go on from their multipliers at the next call.

    Returns
    -------
    int
        Steps taken.
    """
    n = AT.shape[0]
    for step in range(steps + 1):
        _residual(w, u, AT)
        if _count_done(w, tolerance) == LANES or step == steps:
            return step
        _matrix(w, u, AT)
        _direction(w)
        _crossings(w, u, v, AT)
        _line_search(w, u, v, n)
        for lane in range(LANES):
            for i in range(6):
                w[NU + i * LANES + lane] += w[_T + lane] * w[_D + i * LANES + lane]
    return steps
