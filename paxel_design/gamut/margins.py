"""How far inside a level set a colour is: the best partner it can have, for hue shifts and for changes of chroma.

For a colour p, the partners {A_other x + b : A_own x + b = p, 0 <= x <= 1} are a convex set, and what an effect asks
of them is that they lie beyond some lines in (a*, b*). Those lines curve a little in XYZ, so each margin is found by a
few linear programmes over x, each straightened at the partner the last one found. A partner found is always one that
can be shown, and the margin is measured at it: never too large; how little too small is measured in the tests.

Hue shift by h: for h <= 90 the allowed hues are two half-planes, and the margin is the larger of two one-line margins;
for h > 90 they are a convex wedge, the smaller of the two (design: section 8). Where the best partner is too gray, the
floor of chroma is asked for in steps of `_FLOOR_STEP_DEG`; tangents that far apart lie within 0.05 of its circle.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.boxed_lp import OPTIMAL, maximise
from paxel_runtime.model.effects import CHROMA_FLOOR, Chroma, HueShift
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.subgamut import SURFACES

__all__ = ["Margins", "chroma_margins", "hue_margins"]

Margins = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""XYZ of colours (k, 3) inside the full gamut -> margins (k,), about CIELAB units, negative outside the set."""

_STRAIGHTENINGS = 6
_ENOUGH = 1e-3
"""Gain of margin below which straightening ends, CIELAB."""

_FLOOR_STEP_DEG = 15.0
_FAR = 1e3
"""Bound of margins and of distances beyond lines: no two colours are so far apart in CIELAB."""

_UNREACHABLE = -100.0
"""Margin of a colour that has no partner at all."""

_CHUNK = 256


def hue_margins(model: PredictionModel, effect: HueShift, shown_on: str) -> Margins:
    """Margins of a hue shift for colours of one surface."""
    own, other, white = _surfaces(model, shown_on)
    angle, band = np.deg2rad(effect.angle_deg), _FAR if effect.lightness_band is None else effect.lightness_band
    return lambda XYZ: _in_threads(
        lambda part: _hue_margins(part, own.A, own.black, other.A, other.black, white, angle, CHROMA_FLOOR, band), XYZ
    )


def chroma_margins(model: PredictionModel, effect: Chroma, shown_on: str) -> Margins:
    """Margins of a change of chroma for colours of one surface; a unit is 2 % of the way from the gamut's middle."""
    own, other, white = _surfaces(model, shown_on)
    band = _FAR if effect.lightness_band is None else effect.lightness_band
    return lambda XYZ: _in_threads(
        lambda part: _chroma_margins(part, own.A, own.black, other.A, other.black, white, effect.scale, band), XYZ
    )


def _surfaces(model: PredictionModel, shown_on: str) -> tuple[SurfaceModel, SurfaceModel, NDArray[np.float64]]:
    other = model.surfaces[SURFACES[1 - SURFACES.index(shown_on)]]
    return model.surfaces[shown_on], other, np.asarray(model.white_point, np.float64)


def _in_threads(run: Margins, XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
    parts = [np.ascontiguousarray(XYZ[i : i + _CHUNK]) for i in range(0, len(XYZ), _CHUNK)]
    if not parts:
        return np.empty(0)
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        return np.concatenate(list(pool.map(run, parts)))


@njit(cache=True, nogil=True, error_model="numpy")
def _root(t: float) -> float:
    """CIELAB's f of a share of the white (CIE 15:2018, section 8.2.1)."""
    return np.cbrt(t) if t > (6.0 / 29.0) ** 3 else ((29.0 / 3.0) ** 3 * t + 16.0) / 116.0


@njit(cache=True, nogil=True, error_model="numpy")
def _root_slope(t: float) -> float:
    return np.cbrt(t) ** -2 / 3.0 if t > (6.0 / 29.0) ** 3 else (29.0 / 3.0) ** 3 / 116.0


@njit(cache=True, nogil=True, error_model="numpy")
def _luminance(L: float) -> float:
    """Y of L*, Y = 1 for white."""
    return ((L + 16.0) / 116.0) ** 3 if L > 8.0 else L * (3.0 / 29.0) ** 3


@njit(cache=True, nogil=True, error_model="numpy")
def _ab(XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> tuple[float, float]:
    fx, fy, fz = _root(XYZ[0] / white[0]), _root(XYZ[1] / white[1]), _root(XYZ[2] / white[2])
    return 500.0 * (fx - fy), 200.0 * (fy - fz)


@njit(cache=True, nogil=True, error_model="numpy")
def _smallest(lines: NDArray[np.float64], XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> float:
    """How far a partner is beyond all lines (k, 3): u_a a + u_b b - offset, the smallest."""
    a, b = _ab(XYZ, white)
    value = _FAR
    for k in range(len(lines)):
        value = min(value, lines[k, 0] * a + lines[k, 1] * b - lines[k, 2])
    return value


@njit(cache=True, nogil=True, error_model="numpy")
def _best_partner(
    lines: NDArray[np.float64],
    columns: NDArray[np.float64],
    rhs: NDArray[np.float64],
    cost: NDArray[np.float64],
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    basis: NDArray[np.int64],
    v: NDArray[np.float64],
    A_other: NDArray[np.float64],
    black: NDArray[np.float64],
    white: NDArray[np.float64],
    partner: NDArray[np.float64],
) -> float:
    """Largest `_smallest` of a partner; begins and ends at `partner` (3,).

    Variables: inputs x (n), luminance of the partner, margin, distance beyond each line; rows: own colour (3),
    luminance, lines. The first four rows are the caller's.
    """
    n, count = A_other.shape[1], len(lines)
    best = -_FAR
    found = np.empty(3)
    at = partner.copy()
    for _ in range(_STRAIGHTENINGS):
        a, b = _ab(at, white)
        sx, sy, sz = (
            _root_slope(at[0] / white[0]) / white[0],
            _root_slope(at[1] / white[1]) / white[1],
            _root_slope(at[2] / white[2]) / white[2],
        )
        for k in range(count):
            ua, ub = lines[k, 0], lines[k, 1]
            gx, gy, gz = 500.0 * ua * sx, (200.0 * ub - 500.0 * ua) * sy, -200.0 * ub * sz
            base = ua * a + ub * b - lines[k, 2]
            base += gx * (black[0] - at[0]) + gy * (black[1] - at[1]) + gz * (black[2] - at[2])
            scale = 1.0 / max(1.0, abs(gx), abs(gy), abs(gz))
            for j in range(n):
                columns[4 + k, j] = scale * (gx * A_other[0, j] + gy * A_other[1, j] + gz * A_other[2, j])
            columns[4 + k, n + 1] = -scale
            rhs[4 + k] = -scale * base
        if maximise(columns, rhs, cost, lower, upper, basis, v) != OPTIMAL:
            basis[0] = -1
            if maximise(columns, rhs, cost, lower, upper, basis, v) != OPTIMAL:
                return best if best > -_FAR else _UNREACHABLE
        for c in range(3):
            found[c] = black[c]
            for j in range(n):
                found[c] += A_other[c, j] * v[j]
        value = _smallest(lines, found, white)
        share = 1.0
        # Both ends can be shown, so all between can: where the straight line misleads, go only a part of the way.
        while value < best and share > 0.1:
            share *= 0.5
            for c in range(3):
                found[c] = partner[c] + 0.5 * (found[c] - partner[c])
            value = _smallest(lines, found, white)
        gain = value - best
        if gain > 0.0:
            best = value
            partner[:] = found
            at[:] = found
        if gain < _ENOUGH:
            break
    return best


@njit(cache=True, nogil=True, error_model="numpy")
def _hue_margins(
    XYZ: NDArray[np.float64],
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    angle: float,
    floor: float,
    band: float,
) -> NDArray[np.float64]:
    margins = np.empty(len(XYZ))
    # Without and with the floor's tangent: 1 or 2 lines, and one more.
    sides = 2 if angle <= 0.5 * np.pi else 1
    count = 3 - sides
    start = np.empty(3)
    bases = np.full((sides, 2, 4 + count + 1), -1)
    for i in range(len(XYZ)):
        a, b = _ab(XYZ[i], white)
        hue = np.arctan2(b, a)
        best = -_FAR
        for side in range(sides):
            if sides == 2:
                # A half-plane: hues from `first` on, or up to it, half a turn wide.
                first = hue + angle if side == 0 else hue - angle - np.pi
                width = np.pi
            else:
                first, width = hue + angle, 2.0 * (np.pi - angle)
            lines = np.zeros((count + 1, 3))
            lines[0, 0], lines[0, 1] = -np.sin(first), np.cos(first)
            if sides == 1:
                lines[1, 0], lines[1, 1] = np.sin(first + width), -np.cos(first + width)
            columns, rhs, cost, lower, upper = _programme(XYZ[i], count, A_own, b_own, A_other, b_other, white, band)
            v = np.empty(columns.shape[1])
            Y = max(b_other[1] + 0.5 * A_other[1].sum(), 1e-4)
            for c in range(3):
                start[c] = Y * white[c]
            value = _best_partner(
                lines[:count], columns, rhs, cost, lower, upper, bases[side, 0, : 4 + count], v, A_other, b_other,
                white, start,
            )  # fmt: skip
            if value >= 0.0:
                pa, pb = _ab(start, white)
                free = np.hypot(pa, pb) - floor
                if free >= 0.0:
                    best = max(best, min(value, free))
                    break
                # Hues are in reach and too gray there: ask for the floor in each direction, the partner's own first.
                columns, rhs, cost, lower, upper = _programme(
                    XYZ[i], count + 1, A_own, b_own, A_other, b_other, white, band
                )
                v = np.empty(columns.shape[1])
                tangents = int(np.ceil(np.rad2deg(width) / _FLOOR_STEP_DEG)) + 1
                own = (np.arctan2(pb, pa) - first) % (2.0 * np.pi) / width * (tangents - 1)
                nearest = min(max(int(np.rint(own)), 0), tangents - 1)
                for k in range(tangents):
                    direction = first + width * ((nearest + k) % tangents) / (tangents - 1)
                    lines[count, 0], lines[count, 1], lines[count, 2] = np.cos(direction), np.sin(direction), floor
                    partner = start.copy()
                    value = _best_partner(
                        lines, columns, rhs, cost, lower, upper, bases[side, 1, : 5 + count], v, A_other, b_other,
                        white, partner,
                    )  # fmt: skip
                    best = max(best, value)
                    if best >= 0.0:
                        break
            else:
                best = max(best, value)
            if best >= 0.0:
                break
        margins[i] = best
    return margins


@njit(cache=True, nogil=True, error_model="numpy")
def _programme(
    XYZ: NDArray[np.float64],
    count: int,
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    band: float,
) -> tuple[
    NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]
]:  # fmt: skip
    """Columns, right side, cost and bounds of the programme for one colour, its lines still empty."""
    n = A_own.shape[1]
    columns, rhs = np.zeros((4 + count, n + 2 + count)), np.empty(4 + count)
    columns[:3, :n] = A_own
    rhs[:3] = XYZ - b_own
    columns[3, :n], columns[3, n] = A_other[1], -1.0
    rhs[3] = -b_other[1]
    for k in range(count):
        columns[4 + k, n + 2 + k] = -1.0
    cost = np.zeros(n + 2 + count)
    cost[n + 1] = 1.0
    lower, upper = np.zeros(n + 2 + count), np.ones(n + 2 + count)
    lower[n], upper[n] = -_FAR, _FAR
    if band < _FAR:
        L = 116.0 * _root(XYZ[1] / white[1]) - 16.0
        lower[n], upper[n] = white[1] * _luminance(L - band), white[1] * _luminance(L + band)
    lower[n + 1], upper[n + 1 :] = -_FAR, _FAR
    return columns, rhs, cost, lower, upper


@njit(cache=True, nogil=True, error_model="numpy")
def _chroma_margins(
    XYZ: NDArray[np.float64],
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    scale: float,
    band: float,
) -> NDArray[np.float64]:
    """How often the pair, seen from the middle of the joint gamut, fits in: maximise k with k (pair - middle) = A v.

    v is within -1/2..1/2. The partner is the point of its own lightness L on a curve; k and k (L - L0) are two
    variables, the curve straightened at L0.
    """
    n = A_own.shape[1]
    margins = np.empty(len(XYZ))
    own_middle, other_middle = b_own + 0.5 * A_own.sum(axis=1), b_other + 0.5 * A_other.sum(axis=1)
    # Variables: v (n), k, k (L - L0), what is left of the band; rows: own colour, partner, band.
    columns = np.zeros((7, n + 3))
    columns[:3, :n], columns[3:6, :n] = A_own, A_other
    rhs, cost = np.zeros(7), np.zeros(n + 3)
    cost[n] = 1.0
    lower, upper, v = np.full(n + 3, -0.5), np.full(n + 3, 0.5), np.empty(n + 3)
    lower[n], upper[n], lower[n + 1], upper[n + 1], lower[n + 2], upper[n + 2] = 0.0, 50.0, -5e3, 5e3, 0.0, 5e3
    basis = np.full(7, -1)
    for i in range(len(XYZ)):
        a, b = _ab(XYZ[i], white)
        a, b = scale * a, scale * b
        L_own: float = 116.0 * _root(XYZ[i, 1] / white[1]) - 16.0
        low: float = max(L_own - band, 0.0)
        high: float = min(L_own + band, 120.0)
        # From the place in the other surface's range that the colour has in its own, as a first guess.
        share = (XYZ[i, 1] - b_own[1]) / A_own[1].sum()
        L = 116.0 * _root((b_other[1] + share * A_other[1].sum()) / white[1]) - 16.0
        L = float(min(max(L, low), high))
        best: float = 0.0
        for _ in range(_STRAIGHTENINGS):
            fy = (L + 16.0) / 116.0
            for c in range(3):
                f = fy + a / 500.0 if c == 0 else (fy if c == 1 else fy - b / 200.0)
                t = f * f * f if f > 6.0 / 29.0 else (116.0 * f - 16.0) * (3.0 / 29.0) ** 3
                slope = 3.0 * f * f if f > 6.0 / 29.0 else 116.0 * (3.0 / 29.0) ** 3
                columns[c, n] = own_middle[c] - XYZ[i, c]
                columns[3 + c, n] = other_middle[c] - white[c] * t
                columns[3 + c, n + 1] = -white[c] * slope / 116.0
            # low <= L <= high: k (L - L0) + rest = k (high - L0), rest within 0..k (high - low).
            columns[6, n], columns[6, n + 1], columns[6, n + 2] = -(high - L), 1.0, 1.0
            # 1) where on the straightened curve it is best; 2) what that place itself is worth.
            lower[n + 1], upper[n + 1] = -5e3, 5e3
            if maximise(columns, rhs, cost, lower, upper, basis, v) != OPTIMAL or v[n] <= 0.0:
                basis[0] = -1
                break
            step = float(v[n + 1]) / float(v[n])
            lower[n + 1], upper[n + 1] = 0.0, 0.0
            if maximise(columns, rhs, cost, lower, upper, basis, v) != OPTIMAL:
                basis[0] = -1
                break
            gain = float(v[n]) - best
            best = max(best, float(v[n]))
            L = low if L + step < low else high if L + step > high else L + step
            if gain < 1e-5 and abs(step) < 0.1:
                break
        margins[i] = 50.0 * (best - 1.0)
    return margins
