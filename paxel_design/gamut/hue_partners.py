"""The partner of another hue that is best for a colour, by linear programmes: the kernel under hue-shift sets.

What is asked of the partner is that it lies beyond some lines in (a*, b*). Those lines curve a little in XYZ, so each
margin is found by a few linear programmes over the inputs x, each straightened at the partner the last one found.

Hue shift by h: for h <= 90 the allowed hues are two half-planes, and the margin is the larger of two one-line margins;
for h > 90 they are a convex wedge, the smaller of the two (design: section 8). Where the best partner is too gray, the
floor of chroma is asked for by its tangents in some directions, each then turned to the hue of the partner it found.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.boxed_lp import OPTIMAL, maximise
from paxel_runtime.model.lab_scalars import ab_of, lightness_of, luminance_of, root_slope, slope_in_Lab
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["hue_partners"]

_STRAIGHTENINGS = 6
_ENOUGH = 1e-3
"""Gain of margin, or error of the straight lines, below which straightening ends, CIELAB."""

_TANGENTS = np.pi / 4
"""Angle between the floor's first tangents, radians."""

_TURNS = 4
"""How often a tangent is turned to its partner's hue."""

_FAR = 1e3
"""Bound of margins and of distances beyond lines: no two colours are so far apart in CIELAB."""

_UNREACHABLE = -100.0
"""Margin of a colour that has no partner at all."""

_Array = NDArray[np.float64]
_Programme = tuple[_Array, _Array, _Array, _Array, _Array]
"""Columns, right side, cost, lower and upper bounds, as `maximise` takes them."""


@njit(**KERNEL)
def hue_partners(
    XYZ: NDArray[np.float64],
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    angle: float,
    floor: float,
    band: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Margins (k,) of colours XYZ (k, 3), and their slopes (k, 3) along L*, a*, b*.

    `angle` in radians, `floor` of the partner's chroma, `band` of its lightness (1e3 and above: free).
    """
    sides = 2 if angle <= 0.5 * np.pi else 1
    count = 3 - sides
    margins, slopes = np.empty(len(XYZ)), np.zeros((len(XYZ), 3))
    plain = _programme(count, A_own, A_other, b_other)
    floored = _programme(count + 1, A_own, A_other, b_other)
    plain_bases, floored_bases = np.empty((sides, 4 + count), np.int64), np.empty((sides, 5 + count), np.int64)
    lines = np.zeros((count + 1, 3))
    # Linear programmes begin at the partner that the last colour has found, on each side.
    partners = np.empty((sides, 3))
    Y = b_other[1]
    for j in range(A_other.shape[1]):
        Y += 0.5 * A_other[1, j]
    for side in range(sides):
        plain_bases[side, 0] = floored_bases[side, 0] = -1
        for c in range(3):
            partners[side, c] = white[c] * max(Y, 1e-4)
    slope = np.zeros(5)
    for i in range(len(XYZ)):
        margins[i] = -_FAR
        a, b = ab_of(XYZ[i], white)
        hue, L = np.arctan2(b, a), lightness_of(XYZ[i, 1] / white[1])
        for side in range(sides):
            if sides == 2:
                # A half-plane: hues from `first` on, or up to it, half a turn wide.
                first = hue + angle if side == 0 else hue - angle - np.pi
                width = np.pi
            else:
                first, width = hue + angle, 2.0 * (np.pi - angle)
            lines[0, 0], lines[0, 1] = -np.sin(first), np.cos(first)
            if sides == 1:
                lines[1, 0], lines[1, 1] = np.sin(first + width), -np.cos(first + width)
            _set_colour(plain, XYZ[i], b_own, L, band, white)
            found = partners[side]
            value = _best_partner(lines, plain, plain_bases[side], A_other, b_other, white, found, slope)
            pa, pb = ab_of(found, white)
            free = np.hypot(pa, pb) - floor
            if value >= 0.0 and free < value:
                # The floor of chroma is what limits it, or stands in the way.
                _set_colour(floored, XYZ[i], b_own, L, band, white)
                value = _beyond_floor(
                    lines, floored, floored_bases[side], A_other, b_other, white, found, slope, first, width, floor
                )
            if value > margins[i]:
                margins[i] = value
                slope_in_Lab(slope, XYZ[i], white, slopes[i])
                # The lines turn with the colour's hue; the band moves with its lightness.
                turn = slope[3] / max(a * a + b * b, 1e-6)
                slopes[i, 1] -= b * turn
                slopes[i, 2] += a * turn
                slopes[i, 0] += slope[4]
            if value >= 0.0:
                break
    return margins, slopes


@njit(**CALLED)
def _beyond_floor(
    lines: NDArray[np.float64],
    programme: _Programme,
    basis: NDArray[np.int64],
    A_other: NDArray[np.float64],
    black: NDArray[np.float64],
    white: NDArray[np.float64],
    partner: NDArray[np.float64],
    slope: NDArray[np.float64],
    first: float,
    width: float,
    floor: float,
) -> float:
    """Best margin of a partner beyond a tangent of the floor of chroma; stops at the first >= 0.

    Tangents over the hues first..first + width, that of `partner`'s own hue before all; each is turned to the hue of
    the partner that it finds, as long as that gains.
    """
    last = len(lines) - 1
    tangents = int(np.ceil(width / _TANGENTS - 1e-9)) + 1
    best, kept, found = -_FAR, slope.copy(), partner.copy()
    for k in range(-1, tangents):
        for c in range(3):
            found[c] = partner[c]
        pa, pb = ab_of(partner, white)
        at = min((np.arctan2(pb, pa) - first) % (2.0 * np.pi), width) if k < 0 else width * k / (tangents - 1)
        value = -_FAR
        for _ in range(_TURNS):
            before = value
            lines[last, 0], lines[last, 1], lines[last, 2] = np.cos(first + at), np.sin(first + at), floor
            value = _best_partner(lines, programme, basis, A_other, black, white, found, slope)
            if value > best:
                best = value
                for c in range(5):
                    kept[c] = slope[c]
            if best >= 0.0 or value < best or value < before + _ENOUGH:
                break
            pa, pb = ab_of(found, white)
            at = min((np.arctan2(pb, pa) - first) % (2.0 * np.pi), width)
        if best >= 0.0:
            break
    for c in range(5):
        slope[c] = kept[c]
    return best


@njit(**CALLED)
def _best_partner(
    lines: NDArray[np.float64],
    programme: _Programme,
    basis: NDArray[np.int64],
    A_other: NDArray[np.float64],
    black: NDArray[np.float64],
    white: NDArray[np.float64],
    partner: NDArray[np.float64],
    slope: NDArray[np.float64],
) -> float:
    """Largest `_smallest` of a partner; begins and ends at `partner` (3,).

    `slope` (5,) becomes its derivatives along the colour's X, Y, Z, its hue in radians, and its lightness by the band.
    """
    columns, rhs, cost, lower, upper = programme
    n, count = A_other.shape[1], len(rhs) - 4
    best = -_FAR
    found, v, worth, scale = np.empty(3), np.empty(columns.shape[1]), np.empty(len(rhs)), np.empty(count)
    for _ in range(_STRAIGHTENINGS):
        a, b = ab_of(partner, white)
        sx = root_slope(partner[0] / white[0]) / white[0]
        sy = root_slope(partner[1] / white[1]) / white[1]
        sz = root_slope(partner[2] / white[2]) / white[2]
        for k in range(count):
            ua, ub = lines[k, 0], lines[k, 1]
            gx, gy, gz = 500.0 * ua * sx, (200.0 * ub - 500.0 * ua) * sy, -200.0 * ub * sz
            base = ua * a + ub * b - lines[k, 2]
            base += gx * (black[0] - partner[0]) + gy * (black[1] - partner[1]) + gz * (black[2] - partner[2])
            scale[k] = 1.0 / max(1.0, abs(gx), abs(gy), abs(gz))
            for j in range(n):
                columns[4 + k, j] = scale[k] * (gx * A_other[0, j] + gy * A_other[1, j] + gz * A_other[2, j])
            columns[4 + k, n + 1] = -scale[k]
            rhs[4 + k] = -scale[k] * base
        if maximise(columns, rhs, cost, lower, upper, basis, v, worth) != OPTIMAL:
            for c in range(5):
                slope[c] = 0.0
            return best if best > -_FAR else _UNREACHABLE
        for c in range(3):
            found[c] = black[c]
            for j in range(n):
                found[c] += A_other[c, j] * v[j]
        value, share = _smallest(lines, count, found, white), 1.0
        # Both ends can be shown, so all between can: where the straight line misleads, go only a part of the way.
        while value < best and share > 0.1:
            share *= 0.5
            for c in range(3):
                found[c] = partner[c] + 0.5 * (found[c] - partner[c])
            value = _smallest(lines, count, found, white)
        gain = value - best
        if gain > 0.0:
            best = value
            for c in range(3):
                partner[c] = found[c]
        # Where the straight lines have told the truth, another round would find the same.
        if gain < _ENOUGH or (share == 1.0 and abs(v[n + 1] - value) < _ENOUGH):
            break
    for c in range(4):
        slope[c] = worth[c] if c < 3 else 0.0
    a, b = ab_of(partner, white)
    for k in range(count):
        # Share of a line in the margin, by its row; and how a line that turns counter-clockwise moves from a partner.
        slope[3] -= scale[k] * worth[4 + k] * (lines[k, 0] * b - lines[k, 1] * a)
    # The luminance is free or at a bound of the band, which moves with L*.
    edge = upper[n] if v[n] > 0.5 * (lower[n] + upper[n]) else lower[n]
    slope[4] = worth[3] * white[1] / (116.0 * root_slope(edge / white[1])) if upper[n] < _FAR else 0.0
    return best


@njit(**CALLED)
def _smallest(lines: NDArray[np.float64], count: int, XYZ: NDArray[np.float64], white: NDArray[np.float64]) -> float:
    """How far a partner is beyond the first lines of (k, 3): u_a a + u_b b - offset, the smallest."""
    a, b = ab_of(XYZ, white)
    value = _FAR
    for k in range(count):
        value = min(value, lines[k, 0] * a + lines[k, 1] * b - lines[k, 2])
    return value


@njit(**CALLED)
def _programme(
    count: int, A_own: NDArray[np.float64], A_other: NDArray[np.float64], b_other: NDArray[np.float64]
) -> _Programme:
    """The programme with some lines, still empty, and without a colour.

    Variables: inputs x (n), luminance of the partner, margin, distance beyond each line; rows: own colour (3),
    luminance, lines.
    """
    n = A_own.shape[1]
    columns, rhs = np.zeros((4 + count, n + 2 + count)), np.zeros(4 + count)
    cost, lower, upper = np.zeros(n + 2 + count), np.zeros(n + 2 + count), np.zeros(n + 2 + count)
    for j in range(n):
        for c in range(3):
            columns[c, j] = A_own[c, j]
        columns[3, j] = A_other[1, j]
        upper[j] = 1.0
    for k in range(count):
        columns[4 + k, n + 2 + k] = -1.0
        upper[n + 2 + k] = _FAR
    columns[3, n], rhs[3], cost[n + 1] = -1.0, -b_other[1], 1.0
    lower[n] = lower[n + 1] = -_FAR
    upper[n] = upper[n + 1] = _FAR
    return columns, rhs, cost, lower, upper


@njit(**CALLED)
def _set_colour(
    programme: _Programme,
    XYZ: NDArray[np.float64],
    b_own: NDArray[np.float64],
    L: float,
    band: float,
    white: NDArray[np.float64],
) -> None:
    """Ask a programme for the partners of a colour of lightness L."""
    columns, rhs, _, lower, upper = programme
    n = columns.shape[1] - 2 - (len(rhs) - 4)
    for c in range(3):
        rhs[c] = XYZ[c] - b_own[c]
    if band < _FAR:
        lower[n], upper[n] = white[1] * luminance_of(L - band), white[1] * luminance_of(L + band)
