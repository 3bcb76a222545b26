"""How much chroma there is room for: the boundary of a set of colours, or of pairs of colours, over lightness and hue.

A boundary is a table over even steps along a path of lightnesses and over hue; between its nodes it is bilinear: there
it cuts off ridges, and overshoots the curve of a facet by some thousandths. A table of pairs is lowered by what it
overshoots; with a table of colours each colour is checked by itself, which is cheap in three dimensions.

Hue is counted by a *diamond angle*, which rises with the hue angle from 0 to 4 and needs no trigonometry.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.lab_scalars import cube
from paxel_runtime.model.subgamut import PairGamut, SubGamut
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = [
    "TOLERANCE",
    "boundary_of_pairs",
    "boundary_of_subgamut",
    "colour_slack",
    "diamond_angle",
    "exit_along",
    "look_up",
    "pair_exits",
    "sub_gamut_columns",
    "table_shape",
]

CHROMA_LIMIT = 256.0
TOLERANCE = 1e-7
"""How far outside a half-space a colour may lie, XYZ with Y = 1: what float32 Lab can resolve."""
_ENOUGH = 1e-4
"""Chroma at which the search for the boundary ends."""
_SAFETY = 1.3
"""Factor on what interpolation overshoots in the middle of a cell: beside a ridge it may overshoot more elsewhere."""
_ROUNDING = 2e-5
"""Share taken off for float32: of the table, and of the colours that are scaled by it."""
_LONG = 2000
"""Half-spaces from which on a coarser table is made: 17,136 of them at 100,000 nodes would take a minute."""
_FIELD_NODES = (64, 180)
_FIELD_STEP = 2.0

_INLINED: dict[str, Any] = {"cache": True, "error_model": "numpy", "inline": "always"}


def table_shape(half_spaces: int) -> tuple[int, int]:
    """Nodes over lightness, and steps over hue, of a boundary."""
    return (96, 512) if half_spaces < _LONG else (32, 120)


def boundary_of_subgamut(sub_gamut: SubGamut, L: NDArray[np.float64] | None = None) -> NDArray[np.float32]:
    """Chroma of a sub-gamut's boundary.

    Parameters
    ----------
    sub_gamut : SubGamut
        With a field, the chroma up to which it is left for the first time.
    L : (n,) float64 array, optional
        Lightnesses; by default even steps over ``sub_gamut.gray_range()``.

    Returns
    -------
    (n, m + 1) float32 array
        Over lightness and diamond angle, both ends included.
    """
    nodes, hues = _FIELD_NODES if sub_gamut.field is not None else table_shape(len(sub_gamut.offsets))
    if L is None:
        L = np.linspace(*sub_gamut.gray_range(), nodes)
    if sub_gamut.field is not None:
        return _first_exits(sub_gamut, L, _directions(hues)).astype(np.float32)
    columns = sub_gamut_columns(sub_gamut)
    exits = _exits(columns, sub_gamut.white_point, L, L, np.zeros((2, 2)), _directions(hues))
    return exits.astype(np.float32)


def sub_gamut_columns(sub_gamut: SubGamut) -> NDArray[np.float64]:
    """A sub-gamut's half-spaces as the kernels want them, (7, m): normals over a pair, which do not see the partner."""
    columns = np.zeros((7, len(sub_gamut.offsets)))
    columns[:3], columns[6] = sub_gamut.normals.T, sub_gamut.offsets
    return columns


def boundary_of_pairs(
    pairs: PairGamut, L_own: NDArray[np.float64], L_other: NDArray[np.float64], chroma_scale: float, turn_deg: float
) -> NDArray[np.float32]:
    """Largest chroma C at which (L_own, C, h) and its partner (L_other, chroma_scale C, h + turn) can be shown at once.

    Parameters
    ----------
    pairs : PairGamut
        Its first surface is the colour's, its second the partner's.
    L_own, L_other : (n,) float64 arrays
        Lightness of both along a path, L_own in even steps.
    chroma_scale, turn_deg : float

    Returns
    -------
    (n, m + 1) float32 array
        Over lightness and diamond angle, both ends included.
    """
    hues = table_shape(len(pairs.offsets))[1]
    return _boundary(_pair_columns(pairs), pairs.white_point, L_own, L_other, _turned(chroma_scale, turn_deg), hues)


def pair_exits(
    pairs: PairGamut,
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    chroma_scale: float,
    turn_deg: float,
    hues: int,
) -> NDArray[np.float64]:
    """The same at any pairs of lightness, exact at its nodes, (n, hues + 1); `hues` is a multiple of 4."""
    partner = _turned(chroma_scale, turn_deg)
    return _exits(_pair_columns(pairs), pairs.white_point, L_own, L_other, partner, _directions(hues))


def _pair_columns(pairs: PairGamut) -> NDArray[np.float64]:
    """A joint gamut's half-spaces in the layout of `sub_gamut_columns`."""
    columns = np.empty((7, len(pairs.offsets)))
    columns[:6], columns[6] = pairs.normals.T, pairs.offsets
    return columns


def _turned(chroma_scale: float, turn_deg: float) -> NDArray[np.float64]:
    """Matrix (2, 2) from (a*, b*) to the partner's."""
    turn = np.deg2rad(turn_deg)
    return chroma_scale * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def _directions(hues: int) -> NDArray[np.float64]:
    """Unit vectors (hues + 1, 2) in (a*, b*) at even steps of the diamond angle; the last is the first."""
    angle = 4.0 * (np.arange(hues + 1) % hues) / hues
    a = np.where(angle <= 2, 1 - angle, angle - 3)
    b = np.where(angle <= 2, 1 - np.abs(a), np.abs(a) - 1)
    return np.stack([a, b], axis=-1) / np.hypot(a, b)[:, None]


def _boundary(
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    partner: NDArray[np.float64],
    hues: int,
) -> NDArray[np.float32]:
    """Exits at the nodes, each lowered by what the four cells about it ask for."""
    exits = _exits(columns, white, L_own, L_other, partner, _directions(hues))
    shares = np.ones((len(L_own) - 1, hues))
    in_bands(partial(_lower_shares, columns, white, L_own, L_other, partner, exits, shares), len(shares))
    shares = np.clip(shares, 0.0, 1.0)
    shares = np.concatenate([shares[:, -1:], shares, shares[:, :1]], axis=1)
    shares = np.minimum(shares[:, :-1], shares[:, 1:])
    shares = np.concatenate([shares[:1], shares, shares[-1:]])
    return (exits * np.minimum(shares[:-1], shares[1:]) * (1 - _ROUNDING)).astype(np.float32)


def _exits(
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    partner: NDArray[np.float64],
    directions: NDArray[np.float64],
) -> NDArray[np.float64]:
    """`exit_along` each lightness and direction; partner (2, 2) turns and scales a direction."""
    exits = np.zeros((len(L_own), len(directions)))
    in_bands(partial(_fill_exits, columns, white, L_own, L_other, partner, directions, exits), len(exits))
    return exits


def _first_exits(sub_gamut: SubGamut, L: NDArray[np.float64], directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Chroma at which a set with a field is left for the first time, by steps of `_FIELD_STEP` and halvings."""

    def inside(chroma: NDArray[np.float64]) -> NDArray[np.bool_]:
        Lab = np.empty((*chroma.shape, 3))
        Lab[..., 0], Lab[..., 1:] = L[:, None], chroma[..., None] * directions
        return np.asarray(sub_gamut.slack(Lab_to_XYZ(Lab, sub_gamut.white_point)) >= 0)

    low = np.zeros((len(L), len(directions)))
    going = inside(low)
    while np.any(going) and low.max() < CHROMA_LIMIT:
        going &= inside(low + _FIELD_STEP)
        low[going] += _FIELD_STEP
    step = _FIELD_STEP
    while step > 1e-3:
        step /= 2
        low[inside(low + step)] += step
    return low


@njit(**_INLINED)
def diamond_angle(a: float, b: float) -> float:
    """0..4, rising with the hue angle of (a, b); 0 for gray."""
    size = abs(a) + abs(b)
    if size == 0.0:
        return 0.0
    return 1.0 - a / size if b >= 0.0 else 3.0 + a / size


@njit(**_INLINED)
def look_up(share: float, angle: float, boundary: NDArray[np.float32]) -> float:
    """Chroma of the boundary, bilinear, at a share 0..1 of the path and a diamond angle 0..4."""
    u, v = share * (boundary.shape[0] - 1), 0.25 * angle * (boundary.shape[1] - 1)
    i, j = min(int(u), boundary.shape[0] - 2), min(int(v), boundary.shape[1] - 2)
    u, v = u - i, v - j
    return (1.0 - u) * ((1.0 - v) * boundary[i, j] + v * boundary[i, j + 1]) + u * (
        (1.0 - v) * boundary[i + 1, j] + v * boundary[i + 1, j + 1]
    )


@njit(**CALLED, fastmath={"nnan", "nsz", "contract", "reassoc"})
def colour_slack(L: float, a: float, b: float, columns: NDArray[np.float64], white: NDArray[np.float64]) -> float:
    """Distance in XYZ of a colour to the nearest plane of `sub_gamut_columns`, negative outside."""
    f = (L + 16.0) / 116.0
    X, Y, Z = white[0] * cube(f + a / 500.0), white[1] * cube(f), white[2] * cube(f - b / 200.0)
    slack = 1e9
    for i in range(columns.shape[1]):
        slack = min(slack, columns[6, i] - (columns[0, i] * X + columns[1, i] * Y + columns[2, i] * Z))
    return slack


@njit(**CALLED, fastmath={"nnan", "nsz", "contract", "reassoc"})
def _pair_slack(
    L: float,
    a: float,
    b: float,
    L_other: float,
    a_other: float,
    b_other: float,
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
) -> float:
    """Distance in XYZ of a pair to the nearest plane, negative outside; columns (7, m) hold normals and offsets."""
    f, g = (L + 16.0) / 116.0, (L_other + 16.0) / 116.0
    X, Y, Z = white[0] * cube(f + a / 500.0), white[1] * cube(f), white[2] * cube(f - b / 200.0)
    X_other = white[0] * cube(g + a_other / 500.0)
    Y_other, Z_other = white[1] * cube(g), white[2] * cube(g - b_other / 200.0)
    slack = 1e9
    for i in range(columns.shape[1]):
        own = columns[0, i] * X + columns[1, i] * Y + columns[2, i] * Z
        other = columns[3, i] * X_other + columns[4, i] * Y_other + columns[5, i] * Z_other
        slack = min(slack, columns[6, i] - own - other)
    return slack


@njit(**CALLED)
def exit_along(
    L_own: float,
    a: float,
    b: float,
    L_other: float,
    a_other: float,
    b_other: float,
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
) -> float:
    """Chroma at which the path C (a, b), C (a_other, b_other) leaves the half-spaces, inside by at most `_ENOUGH`.

    Illinois rule: the end that stays counts half, so that neither sticks; 0 where the path's gray is outside.
    """
    low, high = 0.0, CHROMA_LIMIT
    f_low = _pair_slack(L_own, 0.0, 0.0, L_other, 0.0, 0.0, columns, white)
    if f_low <= 0.0:
        return 0.0
    f_high = _pair_slack(L_own, high * a, high * b, L_other, high * a_other, high * b_other, columns, white)
    if f_high >= 0.0:
        return high
    for _ in range(60):
        if high - low < _ENOUGH:
            break
        C = low + (high - low) * min(max(f_low / (f_low - f_high), 1e-3), 1.0 - 1e-3)
        f = _pair_slack(L_own, C * a, C * b, L_other, C * a_other, C * b_other, columns, white)
        if f >= 0.0:
            low, f_low, f_high = C, f, 0.5 * f_high
        else:
            high, f_high, f_low = C, f, 0.5 * f_low
    return low


@njit(**KERNEL)
def _fill_exits(
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    partner: NDArray[np.float64],
    directions: NDArray[np.float64],
    exits: NDArray[np.float64],
    first: int,
    stop: int,
) -> None:
    for i in range(first, stop):
        for j in range(len(directions)):
            a, b = directions[j, 0], directions[j, 1]
            a_other, b_other = partner[0, 0] * a + partner[0, 1] * b, partner[1, 0] * a + partner[1, 1] * b
            exits[i, j] = exit_along(L_own[i], a, b, L_other[i], a_other, b_other, columns, white)


@njit(**KERNEL)
def _lower_shares(
    columns: NDArray[np.float64],
    white: NDArray[np.float64],
    L_own: NDArray[np.float64],
    L_other: NDArray[np.float64],
    partner: NDArray[np.float64],
    exits: NDArray[np.float64],
    shares: NDArray[np.float64],
    first: int,
    stop: int,
) -> None:
    """By what each cell of a table (n, m + 1) must be multiplied so that what lies between its nodes is inside.

    Asked at the middles of the cell and of its edges, where a chord is farthest from its curve.
    """
    hues = shares.shape[1]
    for i in range(first, stop):
        for j in range(hues):
            for k in range(5):
                u = 0.5 if k < 3 else float(k - 3)
                v = 0.5 if k == 0 or k > 2 else float(k - 1)
                C = (1.0 - u) * ((1.0 - v) * exits[i, j] + v * exits[i, j + 1]) + u * (
                    (1.0 - v) * exits[i + 1, j] + v * exits[i + 1, j + 1]
                )
                if C <= 0.0:
                    continue
                angle = 4.0 * (j + v) / hues
                a = 1.0 - angle if angle <= 2.0 else angle - 3.0
                b = 1.0 - abs(a) if angle <= 2.0 else abs(a) - 1.0
                size = np.sqrt(a * a + b * b)
                a, b = a / size, b / size
                a_other, b_other = partner[0, 0] * a + partner[0, 1] * b, partner[1, 0] * a + partner[1, 1] * b
                own, other = (1.0 - u) * L_own[i] + u * L_own[i + 1], (1.0 - u) * L_other[i] + u * L_other[i + 1]
                if _pair_slack(own, C * a, C * b, other, C * a_other, C * b_other, columns, white) >= 0.0:
                    continue
                inside = exit_along(own, a, b, other, a_other, b_other, columns, white)
                shares[i, j] = min(shares[i, j], 1.0 - _SAFETY * (1.0 - inside / C))
