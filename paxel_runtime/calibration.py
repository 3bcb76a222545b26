"""Calibration: pure functions from captures and readings to pixels that are sorted and a colour that is predicted.

`sort_pixels` turns structured light and nodal images into one lookup table a channel and into clusters;
`fit_model` turns readings into a `PredictionModel`; `prediction_error` tests it (Table I). What is shown and measured
stands in ``exposures.py``; files and devices are elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, uniform_filter
from scipy.optimize import isotonic_regression

from paxel_runtime.clustering import Clusters, cluster
from paxel_runtime.errors import CalibrationError
from paxel_runtime.exposures import Exposure, exposure_name, guide_channel
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab, linear_sRGB_to_XYZ, spectra_to_XYZ
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.registration import ChannelRegistration, fit_registration, verdict, warp_to_nodal
from paxel_runtime.structured_light import Decoded, decode

__all__ = [
    "SortedPixels",
    "field_ratios",
    "fit_model",
    "nodal_reflectance",
    "pattern_area",
    "prediction_error",
    "register",
    "sort_pixels",
]

_FIELD_WINDOW_PX = 31
"""Window of `field_ratios`, projector pixels: some periods of the dots."""

Captures = Callable[[str], NDArray[np.uint16]]
Progress = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class SortedPixels:
    """Where every projector pixel lands and which cluster it belongs to.

    Attributes
    ----------
    registration : dict of channel name -> ChannelRegistration
    verdicts : dict of channel name -> (word, reason)
        "good" or "usable", and why.
    nodal : (H, W, N) float32 array
        Nodal images: reflectance factor of what each pixel lights under each channel, 1 on the white surface.
    valid : (H, W) bool array
        Pixels registered in every channel.
    clusters : dict of K -> Clusters
    """

    registration: dict[str, ChannelRegistration]
    verdicts: dict[str, tuple[str, str]]
    nodal: NDArray[np.float32]
    valid: NDArray[np.bool_]
    clusters: dict[int, Clusters]


def register(
    captures: Captures,
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    progress: Progress = lambda message: None,
) -> tuple[dict[str, ChannelRegistration], dict[str, Decoded]]:
    """Decode the structured light of every channel and fit one lookup table a channel (paper: IV-A).

    Parameters
    ----------
    captures : callable
        Gives the picture of an exposure by its name; asked for one at a time.
    channels : tuple of str
    resolution : (int, int)
        Width and height of the projector.
    progress : callable, optional
        Told what is being done.

    Raises
    ------
    CalibrationError
        If a channel cannot be decoded.
    """
    guide_name = guide_channel(channels)
    tables: dict[str, ChannelRegistration] = {}
    decoded: dict[str, Decoded] = {}
    for channel in sorted(channels, key=lambda name: name != guide_name):
        progress(f"decode structured light, {channel}")
        decoded[channel] = decode(
            lambda name, channel=channel: captures(f"light-{channel}-{name}"),  # type: ignore[misc]
            *resolution,
            guide=decoded.get(guide_name),
        )
        progress(f"fit the lookup table, {channel}")
        tables[channel] = fit_registration(decoded[channel], *resolution)
    return {name: tables[name] for name in channels}, {name: decoded[name] for name in channels}


def nodal_reflectance(
    captures: Captures, channels: tuple[str, ...], registration: Mapping[str, ChannelRegistration]
) -> NDArray[np.float32]:
    """Nodal images normalised by the white surface, black-subtracted, (H, W, N) float32 (paper: IV-B)."""
    nodal = []
    for channel in channels:
        table = registration[channel].camera_xy
        on = {}
        for surface in ("pattern", "white"):
            full = captures(exposure_name(surface, "full", channel, channels)).astype(np.float32)
            full -= captures(exposure_name(surface, "dark", channel, channels))
            on[surface] = warp_to_nodal(full, table)
        floor = 0.01 * float(np.nanmax(on["white"]))
        with np.errstate(invalid="ignore", divide="ignore"):
            nodal.append(np.where(on["white"] > floor, on["pattern"] / on["white"], np.nan).astype(np.float32))
    return np.stack(nodal, axis=-1)


def sort_pixels(
    captures: Captures,
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    colorants: Mapping[str, NDArray[np.float64]],
    counts: Iterable[int],
    dot_px: float,
    progress: Progress = lambda message: None,
) -> SortedPixels:
    """Register every channel, make the nodal images and sort the pixels into clusters (paper: IV-A and IV-B).

    Parameters
    ----------
    colorants : dict of name -> (3,) array
        Expected XYZ of each colorant, Y = 1 for the white surface.
    counts : iterable of int
        Every K to sort into.
    dot_px : float
        Edge of a dot in projector pixels.

    Raises
    ------
    CalibrationError
        If the structured light cannot be decoded, has to be captured again, or no pixel is registered.
    """
    registration, decoded = register(captures, channels, resolution, progress)
    verdicts = {name: verdict(decoded[name], registration[name]) for name in channels}
    for name, (word, reason) in verdicts.items():
        if word == "repeat":
            raise CalibrationError(
                f"the structured light in {name} has to be captured again: {reason}. Mend that, then run: "
                "paxel capture --force"
            )
    progress("make nodal images")
    nodal = nodal_reflectance(captures, channels, registration)
    valid = np.logical_and.reduce([registration[name].valid for name in channels])
    valid &= np.all(np.isfinite(nodal), axis=-1)
    if not valid.any():
        raise CalibrationError(
            "no projector pixel is registered in every channel: is the whole projection in the camera's picture, "
            "in focus and well exposed? Then run: paxel capture --force"
        )
    nodal_XYZ = linear_sRGB_to_XYZ(nodal).astype(np.float32)  # paper IV-C2: the camera's values taken as sRGB
    inside = valid
    if "white" in colorants and len(colorants) > 1:
        progress("find the pattern's area")
        paper = list(colorants).index("white")
        labels = cluster(nodal_XYZ, valid, colorants, len(colorants), D65_XYZ).labels
        inside = valid & pattern_area(valid & (labels != paper), dot_px)
    clusters = {}
    for K in counts:
        progress(f"sort pixels into {K} clusters")
        clusters[K] = cluster(nodal_XYZ, inside, colorants, K, D65_XYZ)
    return SortedPixels(registration, verdicts, nodal, valid, clusters)


def pattern_area(ink: NDArray[np.bool_], dot_px: float) -> NDArray[np.bool_]:
    """Projector pixels inside the printed area: what a disc of 1.5 dots that touches no ink cannot cover.

    Beside the pattern lies bare paper, which would be taken for its white dots. The area is found to about half a dot.

    Parameters
    ----------
    ink : (H, W) bool array
        Pixels that light any colorant but the paper.
    dot_px : float
        Edge of a dot in projector pixels.

    Raises
    ------
    CalibrationError
        If there is no ink at all.
    """
    if not ink.any():
        raise CalibrationError(
            "no projector pixel lights an inked dot: is the pattern under the projection, and in focus? "
            "Then run: paxel capture --force"
        )
    radius_px = 1.5 * dot_px
    near_ink = distance_transform_edt(~ink) <= radius_px
    if near_ink.all():
        return near_ink
    return np.asarray(distance_transform_edt(near_ink) > radius_px)


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
