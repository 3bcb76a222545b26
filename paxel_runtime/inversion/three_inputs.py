"""The quadratic programme of `box_qp` for one surface and three inputs, solved in its primal, for `LANES` pixels.

With three unknowns the box is a cube, and all fits into registers. With H = S^-1, the programme is to minimise
1/2 x^T Q x - c^T x over 0 <= x <= 1, where Q = A^T H A + 1 and c = A^T H z + 1/2. A round of two descents, from the
last solution:

1. each input in turn is set to its best value in 0..1 (Gauss and Seidel); those that end at 0 or 1 are held there;
2. the others are moved to the best point of that face or edge, or towards it as far as the box allows.

Where step 2 gets to that point and the gradient holds the rest at the box, x is the solution. Two rounds suffice as a
rule, and nearly parallel columns of A take more; neither descent can raise the objective, so a round never loses what
was gained, and a pixel that is not done goes on from its x at the next call.

Rows of the workspace, in and out, are those of `box_qp`. This file knows nothing of colour.
"""

from __future__ import annotations

from numba import njit

from paxel_runtime.inversion.box_qp import DONE, MATRIX, NU, REG, RES, S_FIRST, S_REST, Z
from paxel_runtime.inversion.lanes import (
    LANES,
    Floats,
    Sym3,
    Vec3,
    clip,
    dot,
    factor,
    larger,
    smaller,
    solve3,
    sym3,
    times,
    vec3,
)
from paxel_runtime.numba_options import CALLED, INLINED

__all__ = ["solve_three_inputs"]

# Rows of the workspace, in the place of Newton's matrix of `box_qp`
_H = MATRIX  # 6: factors of S
_Q = _H + 6 * LANES  # 6
_C = _Q + 6 * LANES  # 3
_PER_Q = _C + 3 * LANES  # 3: 1 over the diagonal of Q
_ROUNDS = 12  # of a call
_OUTWARD = -1e-7  # a gradient this small, against inputs of 1/2 and more, holds an input at the box too


@njit(**INLINED)
def _store3(w: Floats, row: int, v: Vec3) -> None:
    w[row], w[row + LANES], w[row + 2 * LANES] = v


@njit(**INLINED)
def _store6(w: Floats, row: int, s: Sym3) -> None:
    _store3(w, row, (s[0], s[1], s[2]))
    _store3(w, row + 3 * LANES, (s[3], s[4], s[5]))


@njit(**INLINED)
def _load6(w: Floats, row: int) -> Sym3:
    return sym3(w, row, row + 3 * LANES)


@njit(**INLINED)
def _set_up(w: Floats, lane: int, a0: Vec3, a1: Vec3, a2: Vec3) -> None:
    """Q, c and what is divided by, from the columns of A."""
    H = factor(sym3(w, S_FIRST + lane, S_REST + lane))
    h0, h1, h2 = solve3(H, a0), solve3(H, a1), solve3(H, a2)
    z = vec3(w, Z + lane)
    q00, q11, q22 = 1.0 + dot(a0, h0), 1.0 + dot(a1, h1), 1.0 + dot(a2, h2)
    _store6(w, _H + lane, H)
    _store6(w, _Q + lane, (q00, dot(a0, h1), dot(a0, h2), q11, dot(a1, h2), q22))
    _store3(w, _C + lane, (0.5 + dot(z, h0), 0.5 + dot(z, h1), 0.5 + dot(z, h2)))
    _store3(w, _PER_Q + lane, (1.0 / q00, 1.0 / q11, 1.0 / q22))


@njit(**INLINED)
def _each_in_turn(Q: Sym3, c: Vec3, inverse: Vec3, x: Vec3) -> Vec3:
    """Every input at its best, the others as they are."""
    x0 = clip((c[0] - Q[1] * x[1] - Q[2] * x[2]) * inverse[0])
    x1 = clip((c[1] - Q[1] * x0 - Q[4] * x[2]) * inverse[1])
    return x0, x1, clip((c[2] - Q[2] * x0 - Q[4] * x1) * inverse[2])


@njit(**INLINED)
def _is_inside(x: float) -> float:
    return 1.0 if x > 0.0 and x < 1.0 else 0.0


@njit(**INLINED)
def _to_best_of_face(Q: Sym3, residual: Vec3, free: Vec3) -> Vec3:
    """Newton's step of the free inputs, 0 for the others: their rows and columns are those of the unit matrix."""
    f0, f1, f2 = free
    held = (
        f0 * Q[0] + (1.0 - f0),
        f0 * f1 * Q[1],
        f0 * f2 * Q[2],
        f1 * Q[3] + (1.0 - f1),
        f1 * f2 * Q[4],
        f2 * Q[5] + (1.0 - f2),
    )
    return solve3(factor(held), (f0 * residual[0], f1 * residual[1], f2 * residual[2]))


@njit(**INLINED)
def _room(x: float, step: float) -> float:
    """Share of a step that the box allows, where that is less than all of it."""
    end = x + step
    aim = clip(end)
    return 1.0 if end == aim else (aim - x) / step


@njit(**INLINED)
def _is_held(x: float, free: float, residual: float) -> float:
    """1.0 where the objective does not fall as a held input leaves the side it is at."""
    outward = residual if x > 0.5 else -residual
    return larger(free, 1.0 if outward >= _OUTWARD else 0.0)


@njit(**INLINED)
def _residual(Q: Sym3, c: Vec3, x: Vec3) -> Vec3:
    """c - Q x, downhill."""
    seen = times(Q, x)
    return c[0] - seen[0], c[1] - seen[1], c[2] - seen[2]


@njit(**INLINED)
def _descend(Q: Sym3, c: Vec3, inverse: Vec3, x: Vec3) -> tuple[Vec3, float]:
    """One round: x, and 1.0 where it is the solution."""
    x = _each_in_turn(Q, c, inverse, x)
    free = (_is_inside(x[0]), _is_inside(x[1]), _is_inside(x[2]))
    step = _to_best_of_face(Q, _residual(Q, c, x), free)
    t = smaller(smaller(_room(x[0], step[0]), _room(x[1], step[1])), _room(x[2], step[2]))
    x = (clip(x[0] + t * step[0]), clip(x[1] + t * step[1]), clip(x[2] + t * step[2]))
    r = _residual(Q, c, x)
    held = _is_held(x[0], free[0], r[0]) * _is_held(x[1], free[1], r[1]) * _is_held(x[2], free[2], r[2])
    return x, held if t == 1.0 else 0.0


@njit(**CALLED)
def solve_three_inputs(w: Floats, u: Floats, AT: Floats) -> None:
    """Solve the programme in every lane, or come nearer in those that take more than `_ROUNDS` rounds.

    Parameters
    ----------
    w : (>= ROWS * LANES,) float64 array
        In: Z, S_FIRST, S_REST. Out: NU, RES (zero), REG, DONE (1.0 where x is the solution).
    u : (3 * LANES,) float64 array
        In: where to start, 0..1. Out: x.
    AT : (3, 6) float64 array
        The transpose of A, whose last three columns are not read.
    """
    a0, a1, a2 = (AT[0, 0], AT[0, 1], AT[0, 2]), (AT[1, 0], AT[1, 1], AT[1, 2]), (AT[2, 0], AT[2, 1], AT[2, 2])
    for lane in range(LANES):
        _set_up(w, lane, a0, a1, a2)
    for _ in range(_ROUNDS):
        for lane in range(LANES):
            Q, c, inverse = _load6(w, _Q + lane), vec3(w, _C + lane), vec3(w, _PER_Q + lane)
            x, is_done = _descend(Q, c, inverse, vec3(u, lane))
            _store3(u, lane, x)
            w[DONE + lane] = is_done
        done = 0
        for lane in range(LANES):
            done += 1 if w[DONE + lane] > 0.0 else 0
        if done == LANES:
            break
    for lane in range(LANES):
        x, z = vec3(u, lane), vec3(w, Z + lane)
        missed = (
            z[0] - a0[0] * x[0] - a1[0] * x[1] - a2[0] * x[2],
            z[1] - a0[1] * x[0] - a1[1] * x[1] - a2[1] * x[2],
            z[2] - a0[2] * x[0] - a1[2] * x[1] - a2[2] * x[2],
        )
        _store3(w, NU + lane, solve3(_load6(w, _H + lane), missed))
        _store3(w, RES + lane, (0.0, 0.0, 0.0))
        e0, e1, e2 = x[0] - 0.5, x[1] - 0.5, x[2] - 0.5
        w[REG + lane] = 0.5 * (e0 * e0 + e1 * e1 + e2 * e2)
