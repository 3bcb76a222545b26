"""How well a model predicts: its error on random projections (Table I), and how far one spot speaks for the field."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from paxel_runtime.exposures import Exposure, exposure_name
from paxel_runtime.model.colorimetry import XYZ_to_Lab, spectra_to_XYZ
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.registration import warp_to_nodal

__all__ = ["field_ratios", "prediction_error"]

Captures = Callable[[str], NDArray[np.uint16]]

_FIELD_WINDOW_PX = 31
"""Window of `field_ratios`, projector pixels: some periods of the dots."""


def prediction_error(
    model: PredictionModel, readings: Mapping[str, NDArray[np.float64]], plan: Iterable[Exposure]
) -> dict[str, Any]:
    """dE00 between predicted and measured colours of the random projections, on each surface (paper: Table I).

    Returns
    -------
    dict
        ``{"n", "pattern": {"dE00_mean", "dE00_p95", "dE00_max"}, "white": ...}``.
    """
    Y_white = spectra_to_XYZ(readings["read-white-white"])[1]
    K = len(model.clusters)
    errors: dict[str, Any] = {}
    for surface, surface_model in model.surfaces.items():
        tests = [e for e in plan if e.surface == surface and e.clusters == K and e.name.startswith("random-")]
        x = model.response.P_to_x(np.array([e.P for e in tests])).reshape(len(tests), model.n)
        measured = spectra_to_XYZ(np.array([readings[e.name] for e in tests])) / Y_white
        dE = dE00(XYZ_to_Lab(measured, model.white_point), XYZ_to_Lab(surface_model.predict_XYZ(x), model.white_point))
        errors["n"] = len(tests)
        errors[surface] = {
            "dE00_mean": float(dE.mean()),
            "dE00_p95": float(np.quantile(dE, 0.95)),
            "dE00_max": float(dE.max()),
        }
    return errors


def field_ratios(
    captures: Captures,
    plan: Iterable[Exposure],
    channels: tuple[str, ...],
    camera_xy: Mapping[str, NDArray[np.float32]],
    inside: NDArray[np.bool_],
    clusters: tuple[str, ...],
) -> dict[str, dict[str, list[float]]]:
    """How much the pattern returns of each cluster's light, over the whole field as the camera sees it.

    The meter reads one spot; where these shares differ much over the field, that spot does not speak for all of it
    (uneven ink, blur towards the corners, a moved sheet).

    Returns
    -------
    dict of cluster -> dict of channel -> [5 %, 50 %, 95 %]
        Quantiles over the field of (light on the pattern) / (light on the white surface), averaged over some dots.
    """
    K = len(clusters)
    inner = uniform_filter(inside.astype(np.float32), _FIELD_WINDOW_PX, mode="constant") > 0.999
    ratios: dict[str, dict[str, list[float]]] = {name: {} for name in clusters}
    dark = {
        (surface, channel): captures(exposure_name(surface, "dark", channel, channels)).astype(np.float32)
        for surface in ("pattern", "white")
        for channel in channels
    }
    pictures = [e for e in plan if e.device == "camera" and e.clusters == K]
    light: dict[tuple[str, int, str], NDArray[np.float32]] = {}
    for e in pictures:
        i = int(np.argmax(np.max(np.array(e.P), axis=1)))
        nodal = warp_to_nodal(captures(e.name).astype(np.float32) - dark[e.surface, e.channel], camera_xy[e.channel])
        light[e.surface, i, e.channel] = uniform_filter(np.where(inside, nodal, 0), _FIELD_WINDOW_PX)[inner]
    for i, name in enumerate(clusters):
        for channel in channels:
            share = light["pattern", i, channel] / np.maximum(light["white", i, channel], 1e-3)
            ratios[name][channel] = [float(q) for q in np.quantile(share, (0.05, 0.5, 0.95))]
    return ratios
