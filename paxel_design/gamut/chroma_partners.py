"""The partner of scaled chroma that a colour can have, by linear programmes: the kernel under changes of chroma.

The margin asks how often the pair (colour, partner), seen from the middle of the joint gamut, fits into it: maximise k
with k (pair - middle) = A v, v within -1/2..1/2. The partner is the point of its own lightness L on a curve; k and
k (L - L0) are two variables, the curve straightened at L0.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.boxed_lp import OPTIMAL, maximise
from paxel_runtime.model.lab_scalars import ab_of, lightness_of, luminance_of, root, root_slope, slope_in_Lab
from paxel_runtime.numba_options import KERNEL

__all__ = ["chroma_partners"]

_STRAIGHTENINGS = 6

_UNIT = 50.0
"""Margin of a pair that fits in twice: 2 % of the way from the middle count 1."""

_WIDEST = 5e3
"""Bound of k times a difference of lightness."""


@njit(**KERNEL)
def chroma_partners(
    XYZ: NDArray[np.float64],
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    scale: float,
    band: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Margins (k,) of colours XYZ (k, 3), and their slopes (k, 3) along L*, a*, b*."""
    n = A_own.shape[1]
    margins, slopes = np.empty(len(XYZ)), np.zeros((len(XYZ), 3))
    own_middle, other_middle = b_own.copy(), b_other.copy()
    # Variables: v (n), k, k (L - L0), what is left of the band; rows: own colour, partner, band.
    columns, rhs, basis = np.zeros((7, n + 3)), np.zeros(7), np.empty(7, np.int64)
    cost, lower, upper, v = np.zeros(n + 3), np.zeros(n + 3), np.empty(n + 3), np.empty(n + 3)
    worth, partner_slope = np.empty(7), np.empty(3)
    for j in range(n):
        for c in range(3):
            columns[c, j], columns[3 + c, j] = A_own[c, j], A_other[c, j]
            own_middle[c] += 0.5 * A_own[c, j]
            other_middle[c] += 0.5 * A_other[c, j]
        lower[j], upper[j] = -0.5, 0.5
    cost[n], upper[n], upper[n + 2] = 1.0, 50.0, _WIDEST
    basis[0] = -1
    for i in range(len(XYZ)):
        a, b = ab_of(XYZ[i], white)
        a, b = scale * a, scale * b
        L_own = lightness_of(XYZ[i, 1] / white[1])
        low, high = max(L_own - band, 0.0), min(L_own + band, 120.0)
        # From the place in the other surface's range that the colour has in its own, as a first guess.
        share = 0.5 * (XYZ[i, 1] - b_own[1]) / (own_middle[1] - b_own[1])
        L = lightness_of((b_other[1] + 2.0 * share * (other_middle[1] - b_other[1])) / white[1])
        L = min(max(L, low), high)
        best = 0.0
        for _ in range(_STRAIGHTENINGS):
            for c in range(3):
                f = root(luminance_of(L)) + (a / 500.0 if c == 0 else 0.0 if c == 1 else -b / 200.0)
                t = luminance_of(116.0 * f - 16.0)
                partner_slope[c] = white[c] / root_slope(t)
                columns[c, n] = own_middle[c] - XYZ[i, c]
                columns[3 + c, n] = other_middle[c] - white[c] * t
                columns[3 + c, n + 1] = -partner_slope[c] / 116.0
            # low <= L <= high: k (L - L0) + rest = k (high - L0), rest within 0..k (high - low).
            columns[6, n], columns[6, n + 1], columns[6, n + 2] = -(high - L), 1.0, 1.0
            # 1) where on the straightened curve it is best; 2) what that place itself is worth.
            lower[n + 1], upper[n + 1] = -_WIDEST, _WIDEST
            if maximise(columns, rhs, cost, lower, upper, basis, v, worth) != OPTIMAL or v[n] <= 0.0:
                break
            step = float(v[n + 1] / v[n])
            lower[n + 1], upper[n + 1] = 0.0, 0.0
            if maximise(columns, rhs, cost, lower, upper, basis, v, worth) != OPTIMAL:
                break
            gain = float(v[n]) - best
            if gain > 0.0:
                best = float(v[n])
                # With the colour, with the partner's a* and b*, and with its lightness where a limit holds that.
                slope_in_Lab(worth, XYZ[i], white, slopes[i])
                slopes[i, 1] += scale * worth[3] * partner_slope[0] / 500.0
                slopes[i, 2] -= scale * worth[5] * partner_slope[2] / 200.0
                if 0.0 < low == L or L == high < 120.0:
                    slopes[i, 0] += (
                        worth[3] * partner_slope[0] + worth[4] * partner_slope[1] + worth[5] * partner_slope[2]
                    ) / 116.0
                for c in range(3):
                    slopes[i, c] *= _UNIT * best
            L = min(max(L + step, low), high)
            if gain < 1e-5 and abs(step) < 0.1:
                break
        margins[i] = _UNIT * (best - 1.0)
    return margins, slopes
