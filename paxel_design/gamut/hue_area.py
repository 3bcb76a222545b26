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

from paxel_design.gamut.chroma_reach import chroma_for_all, chroma_for_any
from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.lightness import lightness_area
from paxel_runtime.errors import InputError

__all__ = ["HueArea", "hue_change_area", "hue_figures"]

_HUES = 180
_GRID = 5
"""Places of the halved rectangle a side at which 'all' asks."""


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

    model = joint.model
    assert model.white is not None
    A, b = np.concatenate((model.pattern.A, model.white.A)), np.concatenate((model.pattern.black, model.white.black))
    directions = np.concatenate((_directions(), _directions(angle_deg)), axis=1)
    white_point = np.asarray(model.white_point, np.float64)
    chroma_any = chroma_for_any(A, b, white_point, directions, rectangle, middle + half / 2 * _grid(2))
    chroma_all = np.min(chroma_for_all(A, b, white_point, directions, middle + half / 2 * _grid(_GRID)), axis=1)
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


def _grid(count: int) -> NDArray[np.float64]:
    """Places (count^2, 2) in -1..1."""
    side = np.linspace(-1, 1, count)
    return np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)


def _directions(turn_deg: float = 0.0) -> NDArray[np.float64]:
    """Directions (180, 2) of all hues, turned."""
    hue = 2 * np.pi * np.arange(_HUES) / _HUES + np.deg2rad(turn_deg)
    return np.stack((np.cos(hue), np.sin(hue)), axis=1)


def _area(polygon: NDArray[np.float64]) -> float:
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
