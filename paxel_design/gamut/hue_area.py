"""How much hue can change: the area of (a*, b*) whose colours can turn by an angle on the other surface (Section VI-B).

The area 'any' holds the colours c for which (L_P, c) on the pattern with (L_W, c turned by the angle) on the white
surface is in the joint gamut for *some* pair (L_P, L_W) of the largest lightness rectangle; the area 'all' those for
which it is for *every* pair of that rectangle halved about its centre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import lightness_area
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.subgamut import TOLERANCE, min_slack

__all__ = ["HueArea", "hue_change_area", "hue_figures"]

_HUES = 180
_GRID = 5
"""Places of the rectangle a side that are tried at first; 'any' then closes in about the best."""

_ROUNDS = 9

_LARGEST_CHROMA = 200.0
_HALVINGS = 24
_BLOCK = 1 << 21


@dataclass(frozen=True, eq=False)
class HueArea:
    """The colours that can turn by an angle, on the pattern; about the gray axis both areas are star-shaped.

    Attributes
    ----------
    angle_deg : float
    area_any, area_all : float
        In a* x b*.
    polygon_any, polygon_all : (180, 2) float64 arrays
        [a*, b*] on the pattern around either area, counter-clockwise.
    """

    angle_deg: float
    area_any: float
    area_all: float
    polygon_any: NDArray[np.float64]
    polygon_all: NDArray[np.float64]


def hue_change_area(joint: JointGamut, angle_deg: float = 180.0) -> HueArea:
    """The hue-change area of a joint gamut at an angle.

    Parameters
    ----------
    joint : JointGamut
    angle_deg : float
        Turn of the hue from the pattern to the white surface, counter-clockwise, -360..360.

    Raises
    ------
    InputError
        If the model has one surface, or the angle is out of range.
    GamutError
        If the two surfaces have no area of grays.
    """
    if not -360 <= angle_deg <= 360:
        raise InputError(f"the angle of a hue-change area must be a number -360..360, got {angle_deg!r}")
    lightness = lightness_area(joint)
    rectangle = np.array([lightness.L_pattern, lightness.L_white]).T  # rows: low, high; columns: pattern, white
    middle, half = rectangle.mean(axis=0), np.ptp(rectangle, axis=0) / 2

    rows = _Rows(joint)
    place = np.broadcast_to(middle, (_HUES, 2))
    chroma_any = np.zeros(_HUES)
    reach = half
    for search in range(_ROUNDS):
        # The neighbouring hues' places are tried too: what one has found helps the next.
        near = place[:, None] + reach * _grid(_GRID if search == 0 else 3)
        near = np.clip(np.concatenate((near, _neighbours(place)), axis=1), *rectangle)
        chroma = _largest_chroma(rows, near, angle_deg)
        best = np.argmax(chroma, axis=1)
        better = chroma[np.arange(_HUES), best] > chroma_any
        chroma_any = np.maximum(chroma_any, chroma[np.arange(_HUES), best])
        place = np.where(better[:, None], near[np.arange(_HUES), best], place)
        reach = reach / 2
    every = np.broadcast_to(middle + half / 2 * _grid(_GRID), (_HUES, _GRID**2, 2))
    chroma_all = np.min(_largest_chroma(rows, every, angle_deg), axis=1)
    polygons = [chroma[:, None] * _directions() for chroma in (chroma_any, chroma_all)]
    return HueArea(float(angle_deg), _area(polygons[0]), _area(polygons[1]), polygons[0], polygons[1])


def hue_figures(area: HueArea) -> dict[str, Any]:
    """The figures of ``gamut/hue-<h>.json`` (design: section 4, *Files*)."""
    return {
        "angle_deg": area.angle_deg,
        "area_any": area.area_any,
        "area_all": area.area_all,
        "polygon_any": area.polygon_any.tolist(),
        "polygon_all": area.polygon_all.tolist(),
    }


def _neighbours(place: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack((np.roll(place, 1, axis=0), np.roll(place, -1, axis=0)), axis=1)


def _grid(count: int) -> NDArray[np.float64]:
    """Places (count^2, 2) in -1..1."""
    side = np.linspace(-1, 1, count)
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def _directions() -> NDArray[np.float64]:
    hue = 2 * np.pi * np.arange(_HUES) / _HUES
    return np.stack((np.cos(hue), np.sin(hue)), axis=1)


def _area(polygon: NDArray[np.float64]) -> float:
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _largest_chroma(rows: _Rows, L: NDArray[np.float64], angle_deg: float) -> NDArray[np.float64]:
    """Largest chroma in each hue direction at places (hues, k, 2) = (L on the pattern, L on white), by halvings."""
    turn = np.deg2rad(angle_deg)
    white_point = rows.joint.model.white_point
    rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])

    def pairs(chroma: NDArray[np.float64], some: slice) -> NDArray[np.float64]:
        ab = chroma[..., None] * _directions()[some, None]
        sides = [
            Lab_to_XYZ(np.concatenate((L[some, :, k : k + 1], color), axis=-1), white_point)
            for k, color in enumerate((ab, ab @ rotation))
        ]
        return np.concatenate(sides, axis=-1).reshape(-1, 6)

    # By halvings against a few of the rows; those that the result breaks join them, until it breaks none. Every
    # sixth hue finds most of the rows first.
    for some in (slice(0, None, 6), slice(None)):
        chroma = np.full(L[some].shape[:2], _LARGEST_CHROMA)
        known = 0
        while known < len(rows.chosen):
            known = len(rows.chosen)
            low, high = np.zeros(chroma.shape), np.full(chroma.shape, _LARGEST_CHROMA)
            for _ in range(_HALVINGS):
                chroma = (low + high) / 2
                inside = rows.slack(pairs(chroma, some)).reshape(chroma.shape) >= 0
                low, high = np.where(inside, chroma, low), np.where(inside, high, chroma)
            chroma = low
            rows.add_broken(pairs(chroma, some))
    return chroma


class _Rows:
    """The rows of a joint gamut that have mattered so far."""

    def __init__(self, joint: JointGamut) -> None:
        self.joint = joint
        corners = 2 * np.vstack((np.eye(6), -np.eye(6)))
        self.chosen = np.unique(np.argmax(corners @ joint.normals.T, axis=1))

    def slack(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        return min_slack(self.joint.normals[self.chosen], self.joint.offsets[self.chosen], points)

    def add_broken(self, points: NDArray[np.float64]) -> None:
        """Take in, for each point (p, 6) that lies outside, the row it breaks most."""
        normals, offsets = self.joint.normals, self.joint.offsets
        step = max(1, _BLOCK // len(offsets))
        for i in range(0, len(points), step):
            block = offsets - points[i : i + step] @ normals.T
            tightest = np.argmin(block, axis=1)
            broken = np.take_along_axis(block, tightest[:, None], axis=1)[:, 0] < -10 * TOLERANCE
            self.chosen = np.union1d(self.chosen, tightest[broken])
