"""Which gray of the other surface goes with which gray of a picture's own: a path through the lightness area.

The picture's lightnesses run along the path, and each hue's chroma grows from it. Where the partner's lightness is
free, the path is chosen that leaves the most room for chroma, one for all hues, so that no hue shows as a change of
lightness; it rises, so that light stays light on both surfaces.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from paxel_runtime.errors import GamutError
from paxel_runtime.gamut_mapping.boundary import pair_exits
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.effects import Partner
from paxel_runtime.model.prediction import SurfaceModel
from paxel_runtime.model.subgamut import PairGamut

__all__ = ["GrayPath", "gray_path", "luminance_relation"]

Interval = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Own L* (k,) -> lowest and highest L* of the partner."""

_SCAN = 401
_HALVINGS = 20
_NODES = 17
_SHARES = np.linspace(0.05, 0.95, 13)
_HUES = 16
_SMOOTHINGS = 20
_FLATTEST, _STEEPEST = 0.6, 1.8
"""Slopes of the path, over its mean one, between which it need not be smoothed further."""
_ALONG = 1e-9
"""Slope of a half-space below which the gray axis runs along it."""


@dataclass(frozen=True, eq=False)
class GrayPath:
    """Pairs of grays that can be shown at once.

    Attributes
    ----------
    L_own : (n,) float64 array
        In even steps, rising.
    L_other : (n,) float64 array
        Never falling.
    """

    L_own: NDArray[np.float64]
    L_other: NDArray[np.float64]


def luminance_relation(own: SurfaceModel, other: SurfaceModel) -> tuple[float, float]:
    """(slope, base) of the luminance of one surface over that of another: black to black, full white to full white."""
    slope = float(other.A[1].sum() / own.A[1].sum())
    return slope, float(other.black[1] - slope * own.black[1])


def gray_path(
    pairs: PairGamut,
    partner: Partner,
    relation: tuple[float, float],
    nodes: int,
    marks: tuple[float, float] = (0.0, 0.0),
) -> GrayPath:
    """The path of a picture's grays and of their partners.

    Parameters
    ----------
    pairs : PairGamut
        Its first surface is the picture's.
    partner : Partner
    relation : (slope, base)
        Of `luminance_relation`, for lightness relative.
    nodes : int
        Number of points.
    marks : (lowest, highest)
        What a mark adds to the partner's L*: room for it is left; at most 0 and at least 0.

    Raises
    ------
    GamutError
        If there are no such pairs of grays, or they are all of one lightness.
    """

    def interval(L: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        low, high = _partner_grays(pairs, L)
        low, high = low - marks[0], high - marks[1]
        if partner.lightness_band is not None:
            low, high = np.maximum(low, L - partner.lightness_band), np.minimum(high, L + partner.lightness_band)
        if partner.lightness != "free":
            wanted = L if partner.lightness == "same" else _related(L, relation, pairs.white_point)
            inside = (low <= wanted) & (wanted <= high)
            low, high = np.where(inside, wanted, np.inf), np.where(inside, wanted, -np.inf)
        return low, high

    L_own = np.linspace(*_longest_run(interval), nodes)
    low, high = interval(L_own)
    low, high = np.minimum(low, high), np.maximum(low, high)  # at the very ends rounding may cross them
    L_other = _roomiest(pairs, partner, L_own, low, high, marks) if partner.lightness == "free" else low
    return GrayPath(L_own, np.clip(np.maximum.accumulate(L_other), low, high))


def _partner_grays(pairs: PairGamut, L: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest L* of the grays that go with each gray (k,); low > high where there is none."""
    white = pairs.white_point
    own, slope = pairs.normals[:, :3] @ white, pairs.normals[:, 3:] @ white
    rising, falling, along = slope > _ALONG, slope < -_ALONG, np.abs(slope) <= _ALONG
    low, high = np.full(len(L), -np.inf), np.full(len(L), np.inf)
    for k, Y in enumerate(Lab_to_XYZ(_grays(L), white)[:, 1] / white[1]):
        left = pairs.offsets - Y * own
        low[k] = np.max(left[falling] / slope[falling], initial=-np.inf)
        high[k] = np.min(left[rising] / slope[rising], initial=np.inf)
        if np.any(left[along] < -_ALONG):
            low[k], high[k] = np.inf, -np.inf
    empty = low > high
    ends = [XYZ_to_Lab(np.clip(t, -1, 2)[:, None] * white, white)[:, 0] for t in (low, high)]
    return np.where(empty, np.inf, ends[0]), np.where(empty, -np.inf, ends[1])


def _grays(L: NDArray[np.float64]) -> NDArray[np.float64]:
    return L[:, None] * np.array([1.0, 0.0, 0.0])


def _related(L: NDArray[np.float64], relation: tuple[float, float], white: NDArray[np.float64]) -> NDArray[np.float64]:
    slope, base = relation
    Y = slope * Lab_to_XYZ(_grays(L), white)[:, 1] + base
    return np.asarray(XYZ_to_Lab((Y / white[1])[:, None] * white, white)[:, 0])


def _longest_run(interval: Interval) -> tuple[float, float]:
    """Ends of the longest stretch of own lightness that has partners."""
    L = np.linspace(0.0, 110.0, _SCAN)
    low, high = interval(L)
    has = np.concatenate(([False], low <= high, [False]))
    begins, ends = np.flatnonzero(has[1:] & ~has[:-1]), np.flatnonzero(has[:-1] & ~has[1:]) - 1
    if not len(begins) or np.max(ends - begins) < 2:
        raise GamutError(
            "no stretch of grays on the picture's surface has such partners on the other one; allow more: a weaker "
            "mark, lightness free, no lightness band, or the other surface with --shown-on"
        )
    longest = np.argmax(ends - begins)
    return _last_with(interval, L[begins[longest]], -1), _last_with(interval, L[ends[longest]], 1)


def _last_with(interval: Interval, L: float, sign: int) -> float:
    """The last lightness with partners on one side of `L`, within a step of the scan, by halvings."""
    step = 110.0 / (_SCAN - 1)
    for _ in range(_HALVINGS):
        step /= 2
        low, high = interval(np.array([L + sign * step]))
        if low[0] <= high[0] and L + sign * step >= 0:
            L += sign * step
    return float(L)


def _roomiest(
    pairs: PairGamut,
    partner: Partner,
    L_own: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    marks: tuple[float, float],
) -> NDArray[np.float64]:
    """Partner's lightness along the path, inside low..high, with the largest mean chroma over hue; smoothed."""
    at = np.linspace(0, len(L_own) - 1, _NODES).astype(int)
    own = np.repeat(L_own[at], len(_SHARES))
    other = (low[at, None] + (high - low)[at, None] * _SHARES).ravel()
    room = [
        pair_exits(pairs, own, other + mark, partner.chroma_scale, partner.turn_deg, _HUES)[:, :-1].mean(axis=1)
        for mark in sorted(set(marks))
    ]
    room_at = np.minimum.reduce(room).reshape(_NODES, len(_SHARES))
    best = (low + (high - low) * 0.5)[at]
    for k in range(1, _NODES - 1):
        best[k] = low[at[k]] + (high - low)[at[k]] * _top(room_at[k])
    for _ in range(_SMOOTHINGS):
        best[1:-1] = (best[:-2] + 2 * best[1:-1] + best[2:]) / 4
        slopes = np.diff(best) / np.mean(np.diff(best))
        if slopes.min() > _FLATTEST and slopes.max() < _STEEPEST:
            break
    return np.asarray(PchipInterpolator(L_own[at], np.maximum.accumulate(best))(L_own))


def _top(values: NDArray[np.float64]) -> float:
    """Share at which values over `_SHARES` are largest, by the parabola through the three about the largest."""
    k = int(np.clip(np.argmax(values), 1, len(values) - 2))
    left, middle, right = values[k - 1 : k + 2]
    bend = left - 2 * middle + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float(_SHARES[k] + np.clip(shift, -1, 1) * (_SHARES[1] - _SHARES[0]))
