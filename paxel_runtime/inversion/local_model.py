"""The local model of dE00^2 + dE00^2 (or dE76^2) in XYZ that one Newton step of the inversion minimises, in SIMD lanes.

On each surface dE00^2 is expanded to second order about the XYZ where the pixel stands. The expansion is kept in
*local Lab coordinates*: Lab along XYZ linearised there, J = dLab/dXYZ, so that its numbers are those of dE00 (0.06 to
2) whatever the darkness of the colour; the curvature of CIELAB itself is added. The Hessian is shifted until it is
positive, and turned into the compliance S and the aim z of `box_qp`.

Lanes and workspace are those of `box_qp`. Functions work on one surface in all lanes; for the second surface they get
the workspace from ``3 * LANES`` on, since every quantity has 3 rows for each surface. This file knows dE00 and CIELAB,
not inputs or clusters.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.inversion.box_qp import NU, RES, ROWS, S_FIRST, S_REST, Z
from paxel_runtime.inversion.lanes import LANES, larger, smaller
from paxel_runtime.model.delta_e import squared_dE00_jet
from paxel_runtime.numba_options import INLINED

__all__ = [
    "BLACK",
    "CHANGE",
    "LAB",
    "MU",
    "POINT",
    "POINT_ROWS",
    "TRIAL",
    "VALUE",
    "WORKSPACE",
    "XYZ",
    "Lab_to_t",
    "aim_qp",
    "expand",
    "move_to_trial",
    "squared_dE76_jet",
    "t_to_Lab",
]

Floats: TypeAlias = NDArray[np.float64]
Vec3: TypeAlias = tuple[float, float, float]
Jet8: TypeAlias = tuple[float, float, float, float, float, float, float, float]

# Rows of the workspace, after those of the QP: 3 for each surface (see box_qp) but for the damping
LAB = ROWS * LANES  # 3: wanted Lab
CHANGE = LAB + 6 * LANES  # 1: change of dE00^2 that the model promises
MU = CHANGE + 6 * LANES  # 1 in all, at both surfaces' places: damping, dE00^2 a Lab unit squared
BLACK = MU + 6 * LANES  # 3: XYZ at x = 0
POINT = BLACK + 6 * LANES  # where the pixel stands, POINT_ROWS rows:
XYZ = POINT  # 3: XYZ there
_FP = XYZ + 6 * LANES  # 3: df/dXYZ, f being CIELAB's cube root
_G = _FP + 6 * LANES  # 3: gradient
_H_FIRST = _G + 6 * LANES  # 3: Hessian, shifted to be positive: LL La Lb
_H_REST = _H_FIRST + 6 * LANES  # 3: aa ab bb
VALUE = _H_REST + 6 * LANES  # 1: dE00^2
POINT_ROWS = 36
TRIAL = POINT_ROWS * LANES  # offset to the same rows of the trial point
WORKSPACE = POINT + 2 * POINT_ROWS * LANES
"""Size of the workspace; a caller's own rows start here."""

_KERNEL = {
    "cache": True,
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}
_EPSILON = (6.0 / 29.0) ** 3
_LINEAR = (29.0 / 6.0) ** 2 / 3.0  # slope of CIELAB's linear branch
_PER_LINEAR = 1.0 / _LINEAR  # a division by a constant would stay one
_PER_116 = 1.0 / 116.0
_SOFTNESS = 1e-10  # dE00^2 is a cone at gray: rounded off within 1e-5 of chroma
_FLOOR = 0.02  # least curvature of the model: a third of the least of dE00^2 itself


@njit(**INLINED)
def _load3(w: Floats, row: int) -> Vec3:
    return w[row], w[row + LANES], w[row + 2 * LANES]


@njit(**INLINED)
def _store3(w: Floats, row: int, a: float, b: float, c: float) -> None:
    w[row], w[row + LANES], w[row + 2 * LANES] = a, b, c


@njit(**INLINED)
def _f(t: float) -> tuple[float, float, float]:
    """CIELAB's f(t) with f' and f'' / f'^2; t up to 64.

    The cube root is t z^2 with z = t^(-1/3): a rational guess to 2 % in 0.008..1, then two steps of fourth order,
    z (1 - h)^(-1/3) with h = 1 - t z^3, to rounding. One division in all.
    """
    root = larger(t, _EPSILON)
    over, far = root > 1.0, root > 8.0
    r = root * (0.015625 if far else (0.125 if over else 1.0))
    z = (6.45678683 + 90.25077234 * r) / (1.0 + r * (59.37364678 + 38.11441394 * r))
    h = 1.0 - r * z * z * z
    z += z * h * (1.0 / 3.0 + h * (2.0 / 9.0 + h * (14.0 / 81.0)))
    h = 1.0 - r * z * z * z
    z += z * h * (1.0 / 3.0 + h * (2.0 / 9.0 + h * (14.0 / 81.0)))
    z *= 0.25 if far else (0.5 if over else 1.0)
    linear = t <= _EPSILON
    return (
        _LINEAR * t + 16.0 / 116.0 if linear else root * z * z,
        _LINEAR if linear else z * z * (1.0 / 3.0),
        0.0 if linear else -2.0 * z,
    )


@njit(**INLINED)
def t_to_Lab(tx: float, ty: float, tz: float) -> tuple[float, float, float]:
    """CIELAB of XYZ over the white point."""
    fx, fy, fz = _f(tx)[0], _f(ty)[0], _f(tz)[0]
    return 116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)


@njit(**INLINED)
def _inverse_f(f: float) -> float:
    return f * f * f if f > 6.0 / 29.0 else (f - 16.0 / 116.0) * _PER_LINEAR


@njit(**INLINED)
def Lab_to_t(L: float, a: float, b: float) -> tuple[float, float, float]:
    """XYZ over the white point of a CIELAB colour."""
    f = (L + 16.0) * _PER_116
    return _inverse_f(f + a * 0.002), _inverse_f(f), _inverse_f(f - b * 0.005)


@njit(**INLINED)
def _toward_root(z: float, trace: float, minors: float, det: float, slope_floor: float) -> float:
    """One Newton step on z^3 - trace z^2 + minors z - det; none where the slope is down to rounding."""
    value = ((z - trace) * z + minors) * z - det
    slope = (3.0 * z - 2.0 * trace) * z + minors
    step = value / larger(slope, slope_floor)
    return z - step if slope > slope_floor else z


@njit(**INLINED)
def _least_eigenvalue(LL: float, La: float, Lb: float, aa: float, ab: float, bb: float) -> float:
    """A lower bound of the least eigenvalue of a symmetric 3 x 3 matrix, close to it.

    Newton's method on the characteristic polynomial from Gershgorin's bound: from below it never passes the root.
    """
    trace = LL + aa + bb
    minors = LL * aa - La * La + LL * bb - Lb * Lb + aa * bb - ab * ab
    det = LL * (aa * bb - ab * ab) - La * (La * bb - ab * Lb) + Lb * (La * ab - aa * Lb)
    slope_floor = 1e-10 * (LL * LL + aa * aa + bb * bb + La * La + Lb * Lb + ab * ab) + 1e-200
    z = smaller(LL - abs(La) - abs(Lb), smaller(aa - abs(La) - abs(ab), bb - abs(Lb) - abs(ab)))
    z = _toward_root(z, trace, minors, det, slope_floor)
    z = _toward_root(z, trace, minors, det, slope_floor)
    z = _toward_root(z, trace, minors, det, slope_floor)
    return _toward_root(z, trace, minors, det, slope_floor)


@njit(**INLINED)
def squared_dE76_jet(
    L1: float, a1: float, b1: float, L2: float, a2: float, b2: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Squared distance in CIELAB, in the form of `squared_dE00_jet`."""
    dL, da, db = L2 - L1, a2 - a1, b2 - b1
    return dL * dL + da * da + db * db, 2.0 * dL, 2.0 * da, 2.0 * db, 2.0, 2.0, 0.0, 2.0


@njit(**INLINED)
def _cube_roots(w: Floats, per_white: Vec3, lane: int) -> tuple[Vec3, Vec3, Vec3]:
    """f' and f'' / f'^2 of X, Y, Z at the trial point, and its Lab."""
    y = XYZ + TRIAL + lane
    fx, fx1, fx2 = _f(w[y] * per_white[0])
    fy, fy1, fy2 = _f(w[y + LANES] * per_white[1])
    fz, fz1, fz2 = _f(w[y + 2 * LANES] * per_white[2])
    return (fx1, fy1, fz1), (fx2, fy2, fz2), (116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz))


@njit(**INLINED)
def _keep(w: Floats, lane: int, per_white: Vec3, weight: float, slope: Vec3, curve: Vec3, jet: Jet8) -> None:
    """Write down the expansion; the curvature of CIELAB adds diag(g f'' / f'^2) in f(X), f(Y), f(Z)."""
    value, gL, ga, gb, LL, aa, ab, bb = jet
    gL, ga, gb = weight * gL, weight * ga, weight * gb
    cx, cy, cz = 500.0 * ga * curve[0], (116.0 * gL - 500.0 * ga + 200.0 * gb) * curve[1], -200.0 * gb * curve[2]
    LL = weight * LL + (cx + cy + cz) * _PER_116**2
    La, Lb, ab = cx * (0.002 * _PER_116), cz * (-0.005 * _PER_116), weight * ab
    aa, bb = weight * aa + cx * 0.002**2, weight * bb + cz * 0.005**2
    shift = larger(0.0, weight * _FLOOR - _least_eigenvalue(LL, La, Lb, aa, ab, bb))
    _store3(w, _FP + TRIAL + lane, slope[0] * per_white[0], slope[1] * per_white[1], slope[2] * per_white[2])
    _store3(w, _G + TRIAL + lane, gL, ga, gb)
    _store3(w, _H_FIRST + TRIAL + lane, LL + shift, La, Lb)
    _store3(w, _H_REST + TRIAL + lane, aa + shift, ab, bb + shift)
    w[VALUE + TRIAL + lane] = weight * value


@njit(**_KERNEL)
def expand(w: Floats, per_white: Vec3, weight: float, euclidean: bool) -> None:
    """Expand weight dE^2 of one surface about its trial points: value, gradient, Hessian, df/dXYZ.

    `per_white` is 1 / white point; `euclidean` takes dE76 instead of dE00.
    """
    if euclidean:
        for lane in range(LANES):
            slope, curve, seen = _cube_roots(w, per_white, lane)
            row = LAB + lane
            jet = squared_dE76_jet(w[row], w[row + LANES], w[row + 2 * LANES], seen[0], seen[1], seen[2])
            _keep(w, lane, per_white, weight, slope, curve, jet)
    else:
        for lane in range(LANES):
            slope, curve, seen = _cube_roots(w, per_white, lane)
            row = LAB + lane
            jet = squared_dE00_jet(w[row], w[row + LANES], w[row + 2 * LANES], seen[0], seen[1], seen[2], _SOFTNESS)
            _keep(w, lane, per_white, weight, slope, curve, jet)


@njit(**_KERNEL)
def aim_qp(w: Floats, delta: float) -> None:
    """S = delta J^-1 H^-1 J^-T and z = XYZ - black - J^-1 H^-1 g of the QP of one step, for one surface."""
    for lane in range(LANES):
        mu = w[MU + lane]
        LL, La, Lb = _load3(w, _H_FIRST + lane)
        aa, ab, bb = _load3(w, _H_REST + lane)
        LL, aa, bb = LL + mu, aa + mu, bb + mu
        # the adjugate of H + mu
        m00, m01, m02 = aa * bb - ab * ab, ab * Lb - La * bb, La * ab - aa * Lb
        m11, m12, m22 = LL * bb - Lb * Lb, La * Lb - LL * ab, LL * aa - La * La
        d = 1.0 / (LL * m00 + La * m01 + Lb * m02)
        fx1, fy1, fz1 = _load3(w, _FP + lane)
        x1, y1, z1 = 1.0 / fx1, 1.0 / fy1, 1.0 / fz1
        gL, ga, gb = _load3(w, _G + lane)
        # rows of J^-1: dX = x1 (dL / 116 + da / 500), dY = y1 dL / 116, dZ = z1 (dL / 116 - db / 200)
        L, a, b = _PER_116, 0.002, -0.005
        X0, X1, X2 = L * m00 + a * m01, L * m01 + a * m11, L * m02 + a * m12
        Y0, Y1, Y2 = L * m00, L * m01, L * m02
        Z0, Z1, Z2 = L * m00 + b * m02, L * m01 + b * m12, L * m02 + b * m22
        e = delta * d
        _store3(
            w, S_FIRST + lane, e * x1 * x1 * (X0 * L + X1 * a), e * x1 * y1 * X0 * L, e * x1 * z1 * (X0 * L + X2 * b)
        )
        _store3(
            w, S_REST + lane, e * y1 * y1 * Y0 * L, e * y1 * z1 * (Y0 * L + Y2 * b), e * z1 * z1 * (Z0 * L + Z2 * b)
        )
        tx, ty, tz = _load3(w, XYZ + lane)
        bx, by, bz = _load3(w, BLACK + lane)
        _store3(
            w,
            Z + lane,
            tx - bx - d * x1 * (X0 * gL + X1 * ga + X2 * gb),
            ty - by - d * y1 * (Y0 * gL + Y1 * ga + Y2 * gb),
            tz - bz - d * z1 * (Z0 * gL + Z1 * ga + Z2 * gb),
        )


@njit(**_KERNEL)
def move_to_trial(w: Floats) -> None:
    """Trial XYZ of one surface from the QP (A x = z - S nu - R), and the change of dE00^2 that the model promises."""
    for lane in range(LANES):
        s00, s01, s02 = _load3(w, S_FIRST + lane)
        s11, s12, s22 = _load3(w, S_REST + lane)
        n0, n1, n2 = _load3(w, NU + lane)
        z0, z1, z2 = _load3(w, Z + lane)
        r0, r1, r2 = _load3(w, RES + lane)
        bx, by, bz = _load3(w, BLACK + lane)
        tx = bx + z0 - r0 - (s00 * n0 + s01 * n1 + s02 * n2)
        ty = by + z1 - r1 - (s01 * n0 + s11 * n1 + s12 * n2)
        tz = bz + z2 - r2 - (s02 * n0 + s12 * n1 + s22 * n2)
        _store3(w, XYZ + TRIAL + lane, tx, ty, tz)
        hx, hy, hz = _load3(w, XYZ + lane)
        fx1, fy1, fz1 = _load3(w, _FP + lane)
        dx, dy, dz = fx1 * (tx - hx), fy1 * (ty - hy), fz1 * (tz - hz)
        L, a, b = 116.0 * dy, 500.0 * (dx - dy), 200.0 * (dy - dz)
        mu = w[MU + lane]
        gL, ga, gb = _load3(w, _G + lane)
        LL, La, Lb = _load3(w, _H_FIRST + lane)
        aa, ab, bb = _load3(w, _H_REST + lane)
        diagonal = 0.5 * ((LL + mu) * L * L + (aa + mu) * a * a + (bb + mu) * b * b)
        w[CHANGE + lane] = gL * L + ga * a + gb * b + diagonal + La * L * a + Lb * L * b + ab * a * b
