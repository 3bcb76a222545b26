"""How far inside a level set a colour is: the best partner it can have, for hue shifts and for changes of chroma.

For a colour p, the partners {A_other x + b : A_own x + b = p, 0 <= x <= 1} are a convex set; how the best of them is
found stands in `hue_partners` and `chroma_partners`. A partner found is always one that can be shown, and the margin
is measured at it: never too large; how little too small is measured in the tests. The linear programmes that find it
also tell how its margin grows with the colour, which costs nothing and lets the level set be met in a step or two.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.chroma_partners import chroma_partners
from paxel_design.gamut.hue_partners import hue_partners
from paxel_runtime.model.effects import CHROMA_FLOOR, Chroma, HueShift
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.subgamut import SURFACES

__all__ = ["Margins", "chroma_margins", "hue_margins"]

_ANY_LIGHTNESS = 1e3
"""Band of a partner whose lightness is free, L*."""

_CHUNK = 256
"""Neighbouring colours that one thread takes at once: each begins where the one before has ended."""

_Values = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Margins:
    """A function of colours, >= 0 on the set that it defines.

    Attributes
    ----------
    with_slopes : callable
        XYZ of colours (k, 3) inside the full gamut -> margins (k,), about CIELAB units, negative outside the set; and
        their derivatives along L*, a*, b* (k, 3), right where the margin is smooth.
    """

    with_slopes: Callable[[_Values], tuple[_Values, _Values]]

    def __call__(self, XYZ: _Values) -> _Values:
        """The margins alone."""
        return self.with_slopes(XYZ)[0]


def hue_margins(model: PredictionModel, effect: HueShift, shown_on: str) -> Margins:
    """Margins of a hue shift for colours of one surface."""
    own, other, white = _surfaces(model, shown_on)
    angle, band = float(np.deg2rad(abs(effect.angle_deg))), _band(effect)
    return _in_threads(
        lambda part: hue_partners(part, own.A, own.black, other.A, other.black, white, angle, CHROMA_FLOOR, band)
    )


def chroma_margins(model: PredictionModel, effect: Chroma, shown_on: str) -> Margins:
    """Margins of a change of chroma for colours of one surface; a unit is 2 % of the way from the gamut's middle."""
    own, other, white = _surfaces(model, shown_on)
    scale, band = float(effect.scale), _band(effect)
    return _in_threads(lambda part: chroma_partners(part, own.A, own.black, other.A, other.black, white, scale, band))


def _surfaces(model: PredictionModel, shown_on: str) -> tuple[SurfaceModel, SurfaceModel, _Values]:
    other = model.surfaces[SURFACES[1 - SURFACES.index(shown_on)]]
    return model.surfaces[shown_on], other, np.asarray(model.white_point, np.float64)


def _band(effect: HueShift | Chroma) -> float:
    return _ANY_LIGHTNESS if effect.lightness_band is None else float(effect.lightness_band)


def _in_threads(run: Callable[[_Values], tuple[_Values, _Values]]) -> Margins:
    def with_slopes(XYZ: _Values) -> tuple[_Values, _Values]:
        parts = [np.ascontiguousarray(XYZ[i : i + _CHUNK]) for i in range(0, len(XYZ), _CHUNK)]
        if not parts:
            return np.empty(0), np.empty((0, 3))
        with ThreadPoolExecutor(numba.get_num_threads()) as pool:
            margins, slopes = zip(*pool.map(run, parts), strict=True)
        return np.concatenate(margins), np.concatenate(slopes)

    return Margins(with_slopes)
