"""From spectral readings to a `PredictionModel`: response curves, black levels and A (Eqs. 1-3).

Pure functions of readings by name; which readings there are stands in ``captures/exposures.py``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.calibration.checks import check_readings
from paxel_runtime.calibration.positions import local_white_gain, positions_of
from paxel_runtime.calibration.ramps import Curve, fit_curve, picture_shares, spectral_shares
from paxel_runtime.captures.exposures import Exposure, white_reading
from paxel_runtime.captures.meter_positions import at_position
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

__all__ = ["fit_model", "fit_response"]

Readings = Mapping[str, NDArray[np.float64]]
Captures = Callable[[str], NDArray[np.uint16]]


def fit_model(
    readings: Readings,
    plan: Iterable[Exposure],
    channels: tuple[str, ...],
    clusters: tuple[str, ...],
    *,
    curve: Curve = "measured",
    captures: Captures | None = None,
) -> PredictionModel:
    """Response curves, black levels and A from spectral readings (Eqs. 1-3, black-subtracted).

    Where the clusters were read at several positions, A and the black are the mean of all, each relative to the full
    white at its own position (`positions.local_white_gain`). The white point is the centre's, so that the model tells
    colours as they are at the centre, but of the mean print instead of the one spot's.

    Parameters
    ----------
    readings : dict of exposure name -> (81,) array
        Spectra on ``WAVELENGTHS_NM``, in the meter's unit.
    plan : iterable of Exposure
        What the readings looked at.
    clusters : tuple of str
        Names of the K clusters; the readings of this K are used.
    curve : "measured" | "gamma"
        Of the response; see `ramps.fit_curve`.
    captures : callable, optional
        Gives a picture by its name; needed where the camera looked at the ramps.

    Raises
    ------
    CalibrationError
        If a reading is missing or cannot be right (`checks.check_readings`), or a ramp is not one.
    """
    plan = list(plan)
    K = len(clusters)
    check_readings(readings, plan, channels, K)
    white = spectra_to_XYZ(readings[white_reading(readings)])
    gains = {position: local_white_gain(readings, position) for position in positions_of(plan, K)}
    surfaces = {}
    for surface in dict.fromkeys(e.surface for e in plan if e.name.endswith("-black") and e.device == "meter"):
        names = [f"read-{surface}-K{K}-{i}-{channel}" for i in range(K) for channel in channels]
        A, black = [], []
        for position, gain in gains.items():
            dark = readings[at_position(f"read-{surface}-black", position)]
            lit = np.array([readings[at_position(name, position)] - dark for name in names])
            A.append(gain * spectra_to_XYZ(lit))
            black.append(gain * spectra_to_XYZ(dark))
        surfaces[surface] = SurfaceModel(A=np.mean(A, axis=0).T / white[1], black=np.mean(black, axis=0) / white[1])
    return PredictionModel(
        channels=channels,
        clusters=clusters,
        pattern=surfaces["pattern"],
        white=surfaces.get("white"),
        white_point=white / white[1],
        response=fit_response(readings, plan, channels, curve=curve, captures=captures),
    )


def fit_response(
    readings: Readings,
    plan: Iterable[Exposure],
    channels: tuple[str, ...],
    *,
    curve: Curve = "measured",
    captures: Captures | None = None,
) -> ProjectorResponse:
    """Response curves from the ramps of every channel; parameters and errors as `fit_model`."""
    plan = list(plan)
    curves = []
    for j, channel in enumerate(channels):
        ramp = [e for e in plan if e.name.startswith("ramp-") and e.channel == channel]
        names = [e.name for e in ramp]
        if not ramp:
            raise CalibrationError(f"there is no ramp of {channel}: its readings are missing; run: paxel capture")
        if ramp[0].device == "meter":
            shares = spectral_shares(np.array([readings[name] for name in names]))
        elif captures is not None:
            shares = picture_shares(lambda k, names=names: captures(names[k]), len(names))  # type: ignore[misc]
        else:
            raise CalibrationError(f"the {channel} ramp was taken by the camera, and no pictures were given")
        curves.append(fit_curve(np.array([e.P[0][j] for e in ramp]), shares, names, channel, curve))
    return ProjectorResponse(tuple(code for code, _ in curves), tuple(linear for _, linear in curves))
