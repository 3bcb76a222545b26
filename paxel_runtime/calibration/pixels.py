"""Where every projector pixel lands and which cluster it belongs to: structured light and nodal images -> clusters.

Pure functions of captures (paper: IV-A, IV-B); what is shown stands in ``exposures.py``, files and devices elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from paxel_runtime.clustering import Clusters, cluster
from paxel_runtime.errors import CalibrationError
from paxel_runtime.exposures import exposure_name, guide_channel
from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.registration import ChannelRegistration, fit_registration, verdict, warp_to_nodal
from paxel_runtime.structured_light import Decoded, decode

__all__ = ["SortedPixels", "nodal_reflectance", "pattern_area", "register", "sort_pixels"]

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
