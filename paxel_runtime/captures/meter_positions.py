"""Where the meter's spot lies on the wall: at the centre, or at 5 or 9 places of the field.

Pure data, as the plan of exposures that it extends; what the readings tell stands in ``calibration/positions.py``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Literal

from paxel_runtime.captures.exposures import Exposure

if TYPE_CHECKING:
    from paxel_runtime.settings import Settings

__all__ = ["Positions", "at_position", "at_positions", "meter_positions_mm"]

Positions = Literal[1, 5, 9]

_CORNERS = ((-1, 1), (1, 1), (1, -1), (-1, -1))
_AROUND = ((-1, 1), (0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0))
_DIRECTIONS: dict[Positions, tuple[tuple[int, int], ...]] = {1: (), 5: _CORNERS, 9: _AROUND}


def meter_positions_mm(settings: Settings) -> list[tuple[float, float]]:
    """Middle of the spot at each position, mm from the centre of the projection, +x right, +y up.

    The centre comes first, the others clockwise from the top left, half way from the centre to the field's rim: of 5
    those towards the corners, of 9 those towards the middles of the sides too (3 x 3). The field is as wide as the
    narrower and as high as the lower of pattern and projection.
    """
    x, y = (side / 4 for side in settings.field_mm)
    return [(0.0, 0.0), *((right * x, up * y) for right, up in _DIRECTIONS[settings.meter.positions])]


def at_position(name: str, position: int) -> str:
    """Name of a reading at a position; at the centre (0) it has no prefix."""
    return f"at-{position}-{name}" if position else name


def at_positions(readings: Iterable[Exposure], count: Positions, K: int) -> list[Exposure]:
    """The plan of readings, and after those of each surface some of them again at every other position.

    Full white, black and the single clusters of the installation's `K` are read everywhere, all at one position before
    the meter is moved. Ramps, test and extra projections, checks of drift and honesty and every other K are read at the
    centre alone: they ask about the projector or test the model, whose colours are those of the centre.

    Parameters
    ----------
    readings : iterable of Exposure
        From `exposures.plan_readings`.
    """
    plan: list[Exposure] = []
    for _, group in groupby(readings, key=lambda e: e.surface):
        here = list(group)
        everywhere = [e for e in here if e.name.startswith("read-") and e.clusters in (0, K)]
        plan += here
        plan += [
            replace(e, name=at_position(e.name, position), position=position)
            for position in range(1, count)
            for e in everywhere
        ]
    return plan
