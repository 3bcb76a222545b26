"""Readings at several positions of the field: what they have in common, and how far they lie apart.

The light of every projector falls off towards its corners, and an adapted eye sees colours relative to the white around
them. A reading elsewhere is therefore taken relative to the full white at its own position (X, Y and Z each, as CIELAB
relates them), and put into the centre's units by the centre's white. What is left of the spread comes from the print
and from blur: that is how far one spot speaks for the field.

Pure functions of readings by name. Position 0 is the centre.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure, white_reading
from paxel_runtime.captures.meter_positions import at_position
from paxel_runtime.model.colorimetry import XYZ_to_Lab, spectra_to_XYZ
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

__all__ = ["local_white_gain", "moved_to_mean", "position_spread", "positions_of"]

Readings = Mapping[str, NDArray[np.float64]]

_NOTHING = 1e-6
"""Of white's Y: an X or Z below has no light to be relative to (a projector of one narrow channel)."""


def positions_of(plan: Iterable[Exposure], K: int) -> list[int]:
    """Positions at which the single clusters of `K` were read; the centre alone for a K that is only compared."""
    return sorted({0} | {e.position for e in plan if e.clusters == K})


def local_white_gain(readings: Readings, position: int) -> NDArray[np.float64]:
    """Factors (3,) of XYZ from a position's own full white to the centre's; 1 at the centre.

    The white is that of `exposures.white_reading`: of the white sheet, where there is one. With ambient light it holds
    that light too, as the eye does that adapts to it.
    """
    name = white_reading(readings)
    centre = spectra_to_XYZ(readings[name])
    local = spectra_to_XYZ(readings[at_position(name, position)])
    gain = np.full(3, centre[1] / local[1])
    lit = np.minimum(local, centre) > _NOTHING * centre[1]
    gain[lit] = centre[lit] / local[lit]
    return gain


def moved_to_mean(model: PredictionModel, centre: PredictionModel, mean: PredictionModel) -> PredictionModel:
    """A model that was refined and corrected at the centre, moved to the mean of all positions.

    Extra projections are read at the centre, so that A is refined and a correction fitted there; fitted to the mean
    they would take it back to the centre. Both tell about the projector, and what they change is kept.

    Parameters
    ----------
    model : PredictionModel
        `centre`, refined and corrected.
    centre, mean : PredictionModel
        From `fit_model`, with the plan of the centre and with that of all positions.
    """
    moved = {
        name: SurfaceModel(
            A=surface.A + (mean.surfaces[name].A - centre.surfaces[name].A),
            black=surface.black + (mean.surfaces[name].black - centre.surfaces[name].black),
        )
        for name, surface in model.surfaces.items()
    }
    return replace(model, pattern=moved["pattern"], white=moved.get("white"))


def position_spread(
    readings: Readings,
    plan: Iterable[Exposure],
    channels: tuple[str, ...],
    K: int,
    positions_mm: Sequence[tuple[float, float]],
) -> dict[str, Any]:
    """dE00 of the single clusters' colours at each position from their mean (XYZ) over all positions.

    Parameters
    ----------
    positions_mm : sequence of (x, y)
        Of all positions, as `meter_positions.meter_positions_mm` gives them.

    Returns
    -------
    dict
        Empty with one position; otherwise ``{"positions_mm", "white_percent" (Y of full white at each position, of the
        centre's), "surfaces": {surface: {"as_read", "local_white"}}}``, both ``{"dE00_mean", "dE00_max",
        "dE00_by_position"}``: relative to the centre's white, and each to its own.
    """
    plan = list(plan)
    positions = positions_of(plan, K)
    if len(positions) == 1:
        return {}
    gains = np.array([local_white_gain(readings, position) for position in positions])
    white = spectra_to_XYZ(readings[white_reading(readings)])
    surfaces: dict[str, dict[str, Any]] = {}
    for surface in sorted({e.surface for e in plan if e.device == "meter" and e.clusters == K}):
        names = [f"read-{surface}-K{K}-{i}-{channel}" for i in range(K) for channel in channels]
        spectra = [[readings[at_position(name, position)] for name in names] for position in positions]
        XYZ = spectra_to_XYZ(np.array(spectra)) / white[1]
        surfaces[surface] = {
            "as_read": _from_mean(XYZ, white / white[1]),
            "local_white": _from_mean(XYZ * gains[:, None], white / white[1]),
        }
    return {
        "positions_mm": [list(xy) for xy in positions_mm],
        "white_percent": [100 / float(gain) for gain in gains[:, 1]],
        "surfaces": surfaces,
    }


def _from_mean(XYZ: NDArray[np.float64], white_point: NDArray[np.float64]) -> dict[str, Any]:
    """dE00 of colours (positions, T, 3) from their mean over positions."""
    dE = np.asarray(dE00(XYZ_to_Lab(XYZ.mean(axis=0), white_point), XYZ_to_Lab(XYZ, white_point)))
    return {
        "dE00_mean": float(dE.mean()),
        "dE00_max": float(dE.max()),
        "dE00_by_position": [float(mean) for mean in dE.mean(axis=1)],
    }
