"""What a model has room for: one contrast and one volume, the same for every model that is compared."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from paxel_design.gamut import JointGamut, lightness_rectangle, product_pair, sub_gamut
from paxel_design.gamut.meshes import exact_volume
from paxel_runtime.errors import GamutError
from paxel_runtime.model.effects import Full
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["Room", "common_range", "room_of"]

_EDGE = 16.0
"""Edge of the triangles by which volumes are compared, CIELAB: to a tenth of a percent of them all alike."""


@dataclass(frozen=True)
class Room:
    """What a model has room for.

    Attributes
    ----------
    contrast : float
        L*. Of two surfaces: the side of a square of the area of the largest lightness rectangle, so how much lightness
        two pictures have that know nothing of each other. Of one surface: the range of its grays.
    volume : float
        Cubic CIELAB units. Of two surfaces: the geometric mean of both sides of the product pair. Of one: its gamut.
    """

    contrast: float
    volume: float


def room_of(model: PredictionModel) -> Room:
    """Contrast and volume of a model's linear part; zeros where its surfaces share no grays or colours."""
    try:
        return _of_pairs(JointGamut(model.linear)) if model.white is not None else _of_one(model.linear)
    except GamutError:  # no grays in common, or colours in a plane
        return Room(0.0, 0.0)


def _of_pairs(joint: JointGamut) -> Room:
    lengths = [high - low for low, high in lightness_rectangle(joint)]
    volumes = [exact_volume(side, _EDGE) for side in product_pair(joint, "closure")]
    return Room(float(np.sqrt(np.prod(lengths))), float(np.sqrt(np.prod(volumes))))


def _of_one(model: PredictionModel) -> Room:
    full = sub_gamut(model, Full())
    volume = exact_volume(full, _EDGE)
    low, high = full.gray_range()
    return Room(high - low, volume)


def common_range(model: PredictionModel) -> tuple[float, float] | None:
    """The longest range of L* that both surfaces can have at once; None where there is none."""
    try:
        return lightness_rectangle(JointGamut(model.linear), same_range=True)[0]
    except GamutError:
        return None
