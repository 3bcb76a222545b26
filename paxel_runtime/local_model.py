"""The local model of dE00^2 + dE00^2 in XYZ that one Newton step of the inversion minimises, in SIMD lanes.

On each surface dE00^2 is expanded to second order about the XYZ where the pixel stands. The expansion is kept in
*local Lab coordinates*: Lab along XYZ linearised there, J = dLab/dXYZ, so that its numbers are those of dE00 (0.06 to
2) whatever the darkness of the colour; the curvature of CIELAB itself is added. The Hessian is shifted until it is
positive, and turned into the compliance S and the aim z of `box_qp`.

Lanes and workspace are those of `box_qp`. This file knows dE00 and CIELAB, not inputs or clusters.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.box_qp import LANES, NU, RES, ROWS, S, Z, larger, smaller
from paxel_runtime.model.delta_e import squared_dE00_jet

__all__ = [
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
    "model_change",
    "t_to_Lab",
]

Floats: TypeAlias = NDArray[np.float64]
Vec3: TypeAlias = tuple[float, float, float]

# Rows of the workspace, after those of the QP
LAB = ROWS * LANES  # 6: wanted Lab
MU = LAB + 6 * LANES  # 1: damping, dE00^2 a Lab unit squared
POINT = MU + LANES  # where the pixel stands, POINT_ROWS rows:
XYZ = POINT  # 6: XYZ there
_FP = XYZ + 6 * LANES  # 6: df/dXYZ, f being CIELAB's cube root
_G = _FP + 6 * LANES  # 6: gradient
_H = _G + 6 * LANES  # 12: Hessian LL La Lb aa ab bb of each surface, shifted to be positive
VALUE = _H + 12 * LANES  # 1: dE00^2 + dE00^2
POINT_ROWS = 31
TRIAL = POINT_ROWS * LANES  # offset to the same rows of the trial point
WORKSPACE = POINT + 2 * POINT_ROWS * LANES
"""Size of the workspace; a caller's own rows start here."""

_SIMD = {"cache": True, "error_model": "numpy", "fastmath": {"contract"}, "forceinline": True}
_EPSILON = (6.0 / 29.0) ** 3
_LINEAR = (29.0 / 6.0) ** 2 / 3.0  # slope of CIELAB's linear branch
_PER_116 = 1.0 / 116.0
_FLOOR = 0.02  # least curvature of the model: a third of the least of dE00^2 itself


@njit(**_SIMD)
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


@njit(**_SIMD)
def t_to_Lab(tx: float, ty: float, tz: float) -> tuple[float, float, float]:
    """CIELAB of XYZ over the white point."""
    fx, fy, fz = _f(tx)[0], _f(ty)[0], _f(tz)[0]
    return 116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)


@njit(**_SIMD)
def _inverse_f(f: float) -> float:
    return f * f * f if f > 6.0 / 29.0 else (f - 16.0 / 116.0) / _LINEAR


@njit(**_SIMD)
def Lab_to_t(L: float, a: float, b: float) -> tuple[float, float, float]:
    """XYZ over the white point of a CIELAB colour."""
    f = (L + 16.0) / 116.0
    return _inverse_f(f + a / 500.0), _inverse_f(f), _inverse_f(f - b / 200.0)


@njit(**_SIMD)
def _toward_root(z: float, trace: float, minors: float, det: float, slope_floor: float) -> float:
    """One Newton step on z^3 - trace z^2 + minors z - det; none where the slope is down to rounding."""
    value = ((z - trace) * z + minors) * z - det
    slope = (3.0 * z - 2.0 * trace) * z + minors
    step = value / larger(slope, slope_floor)
    return z - step if slope > slope_floor else z


@njit(**_SIMD)
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


@njit(**_SIMD)
def expand(w: Floats, lane: int, s: int, per_white: Vec3, weight: float) -> float:
    """Expand dE00^2 of surface s about the trial point: fills its df/dXYZ, gradient and Hessian, returns the value.

    The curvature of CIELAB adds diag(g f'' / f'^2) in the coordinates f(X), f(Y), f(Z). `per_white` is 1 / white point.
    """
    y, wanted = XYZ + TRIAL + 3 * s * LANES + lane, LAB + 3 * s * LANES + lane
    fx, fx1, fx2 = _f(w[y] * per_white[0])
    fy, fy1, fy2 = _f(w[y + LANES] * per_white[1])
    fz, fz1, fz2 = _f(w[y + 2 * LANES] * per_white[2])
    value, gL, ga, gb, LL, aa, ab, bb = squared_dE00_jet(
        w[wanted],
        w[wanted + LANES],
        w[wanted + 2 * LANES],
        116.0 * fy - 16.0,
        500.0 * (fx - fy),
        200.0 * (fy - fz),
    )
    gL, ga, gb = weight * gL, weight * ga, weight * gb
    cx, cy, cz = 500.0 * ga * fx2, (116.0 * gL - 500.0 * ga + 200.0 * gb) * fy2, -200.0 * gb * fz2
    LL = weight * LL + (cx + cy + cz) * _PER_116**2
    La, Lb, ab = cx * (0.002 * _PER_116), cz * (-0.005 * _PER_116), weight * ab
    aa, bb = weight * aa + cx * 0.002**2, weight * bb + cz * 0.005**2
    shift = larger(0.0, weight * _FLOOR - _least_eigenvalue(LL, La, Lb, aa, ab, bb))
    row = _FP + TRIAL + 3 * s * LANES + lane
    w[row], w[row + LANES], w[row + 2 * LANES] = fx1 * per_white[0], fy1 * per_white[1], fz1 * per_white[2]
    row = _G + TRIAL + 3 * s * LANES + lane
    w[row], w[row + LANES], w[row + 2 * LANES] = gL, ga, gb
    row = _H + TRIAL + 6 * s * LANES + lane
    w[row], w[row + LANES], w[row + 2 * LANES] = LL + shift, La, Lb
    w[row + 3 * LANES], w[row + 4 * LANES], w[row + 5 * LANES] = aa + shift, ab, bb + shift
    return weight * value


@njit(**_SIMD)
def aim_qp(w: Floats, lane: int, s: int, black: Vec3, delta: float) -> None:
    """S = delta J^-1 H^-1 J^-T and z = XYZ - black - J^-1 H^-1 g of the QP of one step, for surface s."""
    row = _H + 6 * s * LANES + lane
    La, Lb, ab = w[row + LANES], w[row + 2 * LANES], w[row + 4 * LANES]
    LL, aa, bb = w[row] + w[MU + lane], w[row + 3 * LANES] + w[MU + lane], w[row + 5 * LANES] + w[MU + lane]
    # the adjugate of H + mu
    m00, m01, m02 = aa * bb - ab * ab, ab * Lb - La * bb, La * ab - aa * Lb
    m11, m12, m22 = LL * bb - Lb * Lb, La * Lb - LL * ab, LL * aa - La * La
    d = 1.0 / (LL * m00 + La * m01 + Lb * m02)
    row = _FP + 3 * s * LANES + lane
    x1, y1, z1 = 1.0 / w[row], 1.0 / w[row + LANES], 1.0 / w[row + 2 * LANES]
    row = _G + 3 * s * LANES + lane
    gL, ga, gb = w[row], w[row + LANES], w[row + 2 * LANES]
    # rows of J^-1: dX = x1 (dL / 116 + da / 500), dY = y1 dL / 116, dZ = z1 (dL / 116 - db / 200)
    L, a, b = _PER_116, 0.002, -0.005
    X0, X1, X2 = L * m00 + a * m01, L * m01 + a * m11, L * m02 + a * m12
    Y0, Y1, Y2 = L * m00, L * m01, L * m02
    Z0, Z1, Z2 = L * m00 + b * m02, L * m01 + b * m12, L * m02 + b * m22
    e = delta * d
    row = S + 6 * s * LANES + lane
    w[row] = e * x1 * x1 * (X0 * L + X1 * a)
    w[row + LANES] = e * x1 * y1 * (X0 * L)
    w[row + 2 * LANES] = e * x1 * z1 * (X0 * L + X2 * b)
    w[row + 3 * LANES] = e * y1 * y1 * (Y0 * L)
    w[row + 4 * LANES] = e * y1 * z1 * (Y0 * L + Y2 * b)
    w[row + 5 * LANES] = e * z1 * z1 * (Z0 * L + Z2 * b)
    row, y = Z + 3 * s * LANES + lane, XYZ + 3 * s * LANES + lane
    w[row] = w[y] - black[0] - d * x1 * (X0 * gL + X1 * ga + X2 * gb)
    w[row + LANES] = w[y + LANES] - black[1] - d * y1 * (Y0 * gL + Y1 * ga + Y2 * gb)
    w[row + 2 * LANES] = w[y + 2 * LANES] - black[2] - d * z1 * (Z0 * gL + Z1 * ga + Z2 * gb)


@njit(**_SIMD)
def model_change(w: Floats, lane: int, s: int, black: Vec3) -> float:
    """Set the trial XYZ of surface s from the QP (A x = z - S nu - R); the change of dE00^2 the model promises."""
    nu, c, z, r = (
        NU + 3 * s * LANES + lane,
        S + 6 * s * LANES + lane,
        Z + 3 * s * LANES + lane,
        RES + 3 * s * LANES + lane,
    )
    n0, n1, n2 = w[nu], w[nu + LANES], w[nu + 2 * LANES]
    tx = black[0] + w[z] - w[r] - (w[c] * n0 + w[c + LANES] * n1 + w[c + 2 * LANES] * n2)
    ty = black[1] + w[z + LANES] - w[r + LANES] - (w[c + LANES] * n0 + w[c + 3 * LANES] * n1 + w[c + 4 * LANES] * n2)
    tz = (
        black[2]
        + w[z + 2 * LANES]
        - w[r + 2 * LANES]
        - (w[c + 2 * LANES] * n0 + w[c + 4 * LANES] * n1 + w[c + 5 * LANES] * n2)
    )
    y = XYZ + 3 * s * LANES + lane
    row = _FP + 3 * s * LANES + lane
    dx = w[row] * (tx - w[y])
    dy = w[row + LANES] * (ty - w[y + LANES])
    dz = w[row + 2 * LANES] * (tz - w[y + 2 * LANES])
    w[y + TRIAL], w[y + TRIAL + LANES], w[y + TRIAL + 2 * LANES] = tx, ty, tz
    L, a, b = 116.0 * dy, 500.0 * (dx - dy), 200.0 * (dy - dz)
    row = _H + 6 * s * LANES + lane
    LL, La, Lb = w[row] + w[MU + lane], w[row + LANES], w[row + 2 * LANES]
    aa, ab, bb = w[row + 3 * LANES] + w[MU + lane], w[row + 4 * LANES], w[row + 5 * LANES] + w[MU + lane]
    row = _G + 3 * s * LANES + lane
    linear = w[row] * L + w[row + LANES] * a + w[row + 2 * LANES] * b
    return linear + 0.5 * (LL * L * L + aa * a * a + bb * b * b) + La * L * a + Lb * L * b + ab * a * b
