"""From spectral readings to a `PredictionModel`: response curves, black levels and A (Eqs. 1-3).

Pure functions of readings by name; which readings there are stands in ``exposures.py``.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import isotonic_regression

from paxel_runtime.errors import CalibrationError
from paxel_runtime.exposures import Exposure
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

__all__ = ["fit_model"]


def fit_model(
    readings: Mapping[str, NDArray[np.float64]],
    plan: Iterable[Exposure],
    channels: tuple[str, ...],
    clusters: tuple[str, ...],
) -> PredictionModel:
    """Response curves, black levels and A from spectral readings (Eqs. 1-3, black-subtracted).

    Parameters
    ----------
    readings : dict of exposure name -> (81,) array
        Spectra on ``WAVELENGTHS_NM``, in the meter's unit.
    plan : iterable of Exposure
        What the readings looked at.
    clusters : tuple of str
        Names of the K clusters; the readings of this K are used.

    Raises
    ------
    CalibrationError
        If a reading is missing or a channel gives no light.
    """
    plan = list(plan)
    K, N = len(clusters), len(channels)
    read = {name: spectra_to_XYZ(spectrum) for name, spectrum in readings.items()}
    missing = [e.name for e in plan if e.device == "meter" and e.clusters in (0, K) and e.name not in read]
    if missing:
        raise CalibrationError(f"{len(missing)} readings are missing, the first is {missing[0]}; run: paxel capture")
    Y_white = read["read-white-white"][1]
    surfaces = {}
    for surface in ("pattern", "white"):
        black = read[f"read-{surface}-black"] / Y_white
        columns = [
            read[f"read-{surface}-K{K}-{i}-{channel}"] / Y_white - black for i in range(K) for channel in channels
        ]
        surfaces[surface] = SurfaceModel(A=np.stack(columns, axis=1), black=black)
    assert surfaces["pattern"].A.shape == (3, K * N)
    return PredictionModel(
        channels=channels,
        clusters=clusters,
        pattern=surfaces["pattern"],
        white=surfaces["white"],
        white_point=read["read-white-white"] / Y_white,
        response=_fit_response(readings, plan, channels),
    )


def _fit_response(
    readings: Mapping[str, NDArray[np.float64]], plan: Iterable[Exposure], channels: tuple[str, ...]
) -> ProjectorResponse:
    """Ramp of each channel: black-subtracted, as a share of the full spectrum, made monotone."""
    codes, linears = [], []
    for j, channel in enumerate(channels):
        ramp = [e for e in plan if e.name.startswith("ramp-") and e.channel == channel]
        spectra = np.array([readings[e.name] for e in ramp])
        light = spectra - spectra[0]
        energy = float(light[-1] @ light[-1])
        if not energy > 0:
            raise CalibrationError(f"the {channel} ramp gives no light: is the channel connected and the meter aimed?")
        share = isotonic_regression(light @ light[-1] / energy).x
        share = np.clip(share, 0.0, 1.0)
        share[0], share[-1] = 0.0, 1.0
        codes.append(np.array([e.P[0][j] for e in ramp]))
        linears.append(share)
    return ProjectorResponse(tuple(codes), tuple(linears))
