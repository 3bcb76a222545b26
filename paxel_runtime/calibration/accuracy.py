"""How well a model predicts: its error on test projections (Tables I and II), and how far one spot speaks for all.

Test projections are the readings ``random-...`` (Table I) or ``grid-...`` (the 5^n grid of Table II); nothing is ever
fitted to them.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

from paxel_runtime.captures.exposures import Exposure, exposure_name, white_reading
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import XYZ_to_Lab, spectra_to_XYZ
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.registration import warp_to_nodal

__all__ = [
    "ComparedColors",
    "compare_colors",
    "error_by_input",
    "error_figures",
    "field_ratios",
    "noise_floor",
    "prediction_error",
    "relative_XYZ",
]

Captures = Callable[[str], NDArray[np.uint16]]

_TESTS = ("random-", "grid-")
_FIELD_WINDOW_PX = 31
"""Window of `field_ratios`, projector pixels: some periods of the dots."""


@dataclass(frozen=True, eq=False)
class ComparedColors:
    """Measured and predicted colours of the test projections on one surface.

    Attributes
    ----------
    x : (T, n) float64 array
        Linear inputs.
    measured_Lab, predicted_Lab : (T, 3) float64 array
    dE00 : (T,) float64 array
    """

    x: NDArray[np.float64]
    measured_Lab: NDArray[np.float64]
    predicted_Lab: NDArray[np.float64]
    dE00: NDArray[np.float64]


def relative_XYZ(readings: Mapping[str, NDArray[np.float64]], names: Sequence[str]) -> NDArray[np.float64]:
    """(T, 3) XYZ of some readings, Y = 1 for full white on white paper."""
    Y_white = spectra_to_XYZ(readings[white_reading(readings)])[1]
    return spectra_to_XYZ(np.array([readings[name] for name in names])) / Y_white


def compare_colors(
    model: PredictionModel,
    readings: Mapping[str, NDArray[np.float64]],
    plan: Iterable[Exposure],
    measured_white: NDArray[np.float64] | None = None,
) -> dict[str, ComparedColors]:
    """Measured and predicted colours of this K's test projections, by surface.

    Parameters
    ----------
    measured_white : (3,) array, optional
        White point of the measured colours, where it is not the model's (a camera taken for an sRGB camera).

    Raises
    ------
    CalibrationError
        If a surface has no test projection, or a reading is missing.
    """
    plan, K = list(plan), len(model.clusters)
    white = model.white_point if measured_white is None else measured_white
    tested = {}
    for place, surface in enumerate(model.surfaces):
        tests = [e for e in plan if e.surface == surface and e.clusters == K and e.name.startswith(_TESTS)]
        missing = [e.name for e in tests if e.name not in readings]
        if missing or not tests:
            what = f"the reading {missing[0]} is missing" if missing else f"no test projection of K = {K} on {surface}"
            raise CalibrationError(f"the model cannot be tested: {what}; run: paxel capture")
        x = model.response.P_to_x(np.array([e.P for e in tests])).reshape(len(tests), model.n)
        measured = np.asarray(XYZ_to_Lab(relative_XYZ(readings, [e.name for e in tests]), white), np.float64)
        predicted = np.asarray(model.predict(x)[place], np.float64)
        tested[surface] = ComparedColors(x, measured, predicted, np.asarray(dE00(measured, predicted)))
    return tested


def error_figures(dE: NDArray[np.floating]) -> dict[str, float]:
    """``{"dE00_mean", "dE00_p95", "dE00_max"}`` of errors (T,), as Tables I and II give them."""
    return {
        "dE00_mean": float(dE.mean()),
        "dE00_p95": float(np.quantile(dE, 0.95)),
        "dE00_max": float(dE.max()),
    }


def prediction_error(
    model: PredictionModel,
    readings: Mapping[str, NDArray[np.float64]],
    plan: Iterable[Exposure],
    measured_white: NDArray[np.float64] | None = None,
) -> dict[str, Any]:
    """dE00 between predicted and measured colours of the test projections, on each surface (paper: Tables I and II).

    The arguments are those of `compare_colors`.

    Returns
    -------
    dict
        ``{"n", "pattern": {"dE00_mean", "dE00_p95", "dE00_max"}, "white": ...}``.
    """
    tested = compare_colors(model, readings, plan, measured_white)
    count = len(next(iter(tested.values())).dE00)
    return {"n": count, **{surface: error_figures(colors.dE00) for surface, colors in tested.items()}}


def error_by_input(
    model: PredictionModel, tested: Mapping[str, ComparedColors]
) -> dict[str, dict[str, dict[str, float]]]:
    """Mean dE00 for each cluster and each channel: where one stands out, its readings or its response are to blame.

    Each projection is weighed by the share of its light (Y) that comes from there.

    Returns
    -------
    dict of surface -> {"per_cluster": {name: dE00}, "per_channel": {name: dE00}}
    """
    result = {}
    for surface, colors in tested.items():
        light = colors.x * np.abs(model.surfaces[surface].A[1]) + 1e-9
        shares = (light / light.sum(axis=1, keepdims=True)).reshape(-1, len(model.clusters), len(model.channels))
        result[surface] = {
            f"per_{kind}": {
                name: float(np.average(colors.dE00, weights=share))
                for name, share in zip(names, shares.sum(axis=axis).T, strict=True)
            }
            for kind, names, axis in (("cluster", model.clusters, 2), ("channel", model.channels, 1))
        }
    return result


def noise_floor(
    model: PredictionModel, readings: Mapping[str, NDArray[np.float64]], plan: Iterable[Exposure]
) -> dict[str, dict[str, float]]:
    """How well a reading repeats itself: dE00 from the mean of all readings of the same lit frame on one surface.

    It holds the meter's noise and what drift is left; no model can be better.

    Returns
    -------
    dict of surface -> {"readings", "dE00_mean", "dE00_max"}
        Without the surfaces on which no lit frame was read twice. A mean of m readings follows each of them, which is
        undone by sqrt(m / (m - 1)).
    """
    frames: dict[tuple[str, int, Any], list[str]] = defaultdict(list)
    for e in plan:
        if e.device == "meter" and e.position == 0 and not e.mask and e.name in readings and np.any(e.P):
            frames[e.surface, e.clusters, e.P].append(e.name)
    floors: dict[str, dict[str, float]] = {}
    for surface in model.surfaces:
        repeated = [names for (where, _, _), names in frames.items() if where == surface and len(names) > 1]
        if repeated:
            dE = np.concatenate([_from_mean(relative_XYZ(readings, names), model.white_point) for names in repeated])
            floors[surface] = {
                "readings": len(dE),
                "dE00_mean": float(dE.mean()),
                "dE00_max": float(dE.max()),
            }
    return floors


def _from_mean(XYZ: NDArray[np.float64], white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    apart = dE00(XYZ_to_Lab(XYZ.mean(axis=0), white_point), XYZ_to_Lab(XYZ, white_point))
    return np.asarray(apart) * np.sqrt(len(XYZ) / (len(XYZ) - 1))


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
        Quantiles over the field of (light on the pattern) / (light on the white surface), averaged over some dots; with
        one surface, of (light of this cluster) / (light of all clusters under this channel).
    """
    K = len(clusters)
    inner = uniform_filter(inside.astype(np.float32), _FIELD_WINDOW_PX, mode="constant") > 0.999
    ratios: dict[str, dict[str, list[float]]] = {name: {} for name in clusters}
    pictures = [e for e in plan if e.device == "camera" and e.clusters == K]
    dark = {
        (surface, channel): captures(exposure_name(surface, "dark", channel, channels)).astype(np.float32)
        for surface in dict.fromkeys(e.surface for e in pictures)
        for channel in channels
    }
    light: dict[tuple[str, int, str], NDArray[np.float32]] = {}
    for e in pictures:
        i = int(np.argmax(np.max(np.array(e.P), axis=1)))
        nodal = warp_to_nodal(captures(e.name).astype(np.float32) - dark[e.surface, e.channel], camera_xy[e.channel])
        light[e.surface, i, e.channel] = uniform_filter(np.where(inside, nodal, 0), _FIELD_WINDOW_PX)[inner]
    for i, name in enumerate(clusters):
        for channel in channels:
            whole = light.get(("white", i, channel))
            if whole is None:
                whole = np.sum([light["pattern", k, channel] for k in range(K)], axis=0)
            share = light["pattern", i, channel] / np.maximum(whole, 1e-3)
            ratios[name][channel] = [float(q) for q in np.quantile(share, (0.05, 0.5, 0.95))]
    return ratios
