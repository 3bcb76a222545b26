"""Where every projector pixel lands and which cluster it belongs to: structured light and nodal images -> clusters.

Pure functions of captures (paper: IV-A, IV-B); what is shown stands in ``captures/exposures.py``, files elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.calibration.coverage import channels_differ
from paxel_runtime.calibration.nodal import (
    Captures,
    Normalise,
    nodal_reflectance,
    nodal_to_linear_sRGB,
    pattern_area,
    reflectance_picture,
)
from paxel_runtime.captures.exposures import exposure_name, guide_channel
from paxel_runtime.clustering import Agreement, Clusters, agreement, cluster, cluster_coverages
from paxel_runtime.clustering.clusters import Space
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_linear_sRGB, linear_sRGB_to_XYZ
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.registration import TABLES, ChannelRegistration, verdict
from paxel_runtime.registration.design import register_design
from paxel_runtime.registration.print_start import homography_from_corners, homography_from_fiducials
from paxel_runtime.structured_light import Decoded, Method, decode

__all__ = ["SortedPixels", "register", "sort_by_design", "sort_pixels"]

Progress = Callable[[str], None]
Fiducials = tuple[Mapping[int, ArrayLike], str]

_OUTSIDE_SHARE = 0.5
"""Share of a pixel that may lie beyond the pattern."""


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
    design : dict
        Figures of the registration of the known pattern, where pixels were sorted by it; else empty.
    cross_check : dict of K -> Agreement
        Then also how clusters by k-means agree with them.
    coverage : (H, W, 1 or N, M) uint8 array, optional
        Then also the share of each colorant in each pixel, 255 = all; for every channel where they differ.
    """

    registration: dict[str, ChannelRegistration]
    verdicts: dict[str, tuple[str, str]]
    nodal: NDArray[np.float32]
    valid: NDArray[np.bool_]
    clusters: dict[int, Clusters]
    design: dict[str, Any] = field(default_factory=dict)
    cross_check: dict[int, Agreement] = field(default_factory=dict)
    coverage: NDArray[np.uint8] | None = None


def register(
    captures: Captures,
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    progress: Progress = lambda message: None,
    method: Method = "lines",
    table: str = "fit",
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
    method : "lines" | "phase"
        What refines the Gray code.
    table : str
        A key of `registration.TABLES`.

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
            method=method,
        )
        progress(f"fit the lookup table, {channel}")
        tables[channel] = TABLES[table](decoded[channel], *resolution)
    return {name: tables[name] for name in channels}, {name: decoded[name] for name in channels}


def sort_pixels(
    captures: Captures,
    channels: tuple[str, ...],
    resolution: tuple[int, int],
    colorants: Mapping[str, NDArray[np.float64]],
    counts: Iterable[int],
    dot_px: float,
    progress: Progress = lambda message: None,
    *,
    normalise: Normalise = "white",
    space: Space = "lab",
    pattern: Pattern | None = None,
    method: Method = "lines",
    table: str = "fit",
    corners_px: ArrayLike = (),
    fiducials: Fiducials | None = None,
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
    normalise : "white" | "paper" | "field"
        Of the nodal images; see `nodal_reflectance`.
    space : "lab" | "linear"
        Of k-means; see `clustering.cluster`.
    pattern : Pattern, optional
        The printed pattern: pixels are then sorted by what it covers of them (method ``"design"``), and by colour only
        for a cross-check.
    method : "lines" | "phase"
        What refines the Gray code of the structured light.
    table : str
        Of the registration; see `register`.
    corners_px : (4, 2) array, optional
        The printed pattern's corners in the camera's picture, where its own lattice does not suffice to find it.
    fiducials : (dict of id -> (4, 2) array, dictionary), optional
        The sheet's markers, millimetres of the pattern, and the name of their dictionary: looked for where no corners
        are given; the lattice does where the camera sees none of them.

    Raises
    ------
    CalibrationError
        If the structured light cannot be decoded, has to be captured again, or no pixel is registered.
    """
    registration, decoded = register(captures, channels, resolution, progress, method, table)
    verdicts = {name: verdict(decoded[name], registration[name]) for name in channels}
    for name, (word, reason) in verdicts.items():
        if word == "repeat":
            raise CalibrationError(
                f"the structured light in {name} has to be captured again: {reason}. Mend that, then run: "
                "paxel capture --force"
            )
    del decoded
    progress("make nodal images")
    nodal = nodal_reflectance(captures, channels, registration, normalise=normalise, dot_px=dot_px)
    valid = np.logical_and.reduce([registration[name].valid for name in channels])
    valid &= np.all(np.isfinite(nodal), axis=-1)
    if not valid.any():
        raise CalibrationError(
            "no projector pixel is registered in every channel: is the whole projection in the camera's picture, "
            "in focus and well exposed? Then run: paxel capture --force"
        )
    nodal_XYZ = linear_sRGB_to_XYZ(nodal_to_linear_sRGB(nodal, channels)).astype(np.float32)
    inside = valid
    if "white" in colorants and len(colorants) > 1:
        progress("find the pattern's area")
        paper = list(colorants).index("white")
        labels = cluster(nodal_XYZ, valid, colorants, len(colorants), D65_XYZ, space=space).labels
        inside = valid & pattern_area(valid & (labels != paper), dot_px)
    clusters = {}
    for K in counts:
        progress(f"sort pixels into {K} clusters")
        clusters[K] = cluster(nodal_XYZ, inside, colorants, K, D65_XYZ, space=space)
    if pattern is None:
        return SortedPixels(registration, verdicts, nodal, valid, clusters)
    progress("find the printed pattern in the picture")
    by_design, figures, coverage = sort_by_design(
        captures,
        registration[guide_channel(channels)],
        valid,
        nodal_XYZ,
        colorants,
        tuple(clusters),
        dot_px,
        pattern,
        normalise=normalise,
        corners_px=corners_px,
        fiducials=fiducials,
        lit=captures(exposure_name("pattern", "full", guide_channel(channels), channels)),
        tables=[registration[name].camera_xy for name in channels],
    )
    check = {K: agreement(by_design[K].labels, clusters[K].labels, K) for K in clusters}
    return SortedPixels(registration, verdicts, nodal, valid, by_design, figures, check, coverage)


def _camera_px_per_px(guide: ChannelRegistration) -> float:
    """Pixels of the camera a pixel of the projector, the median over the field."""
    steps = np.diff(guide.camera_xy.astype(np.float64), axis=1)
    return float(np.nanmedian(np.hypot(steps[..., 0], steps[..., 1])))


def sort_by_design(
    captures: Captures,
    guide: ChannelRegistration,
    valid: NDArray[np.bool_],
    nodal_XYZ: NDArray[np.float32],
    colorants: Mapping[str, NDArray[np.float64]],
    counts: Iterable[int],
    dot_px: float,
    pattern: Pattern,
    *,
    normalise: Normalise = "white",
    corners_px: ArrayLike = (),
    fiducials: Fiducials | None = None,
    lit: NDArray[np.uint16] | None = None,
    tables: Sequence[NDArray[np.float32]] = (),
) -> tuple[dict[int, Clusters], dict[str, Any], NDArray[np.uint8]]:
    """Sort registered pixels by what the known pattern covers of them.

    Parameters
    ----------
    guide : ChannelRegistration
        Of the guide channel, whose pixels' areas are taken.
    valid : (H, W) bool array
    nodal_XYZ : (H, W, 3) float32 array
        Names clusters that no colorant stands for.
    captures, colorants, counts, dot_px, pattern, normalise, corners_px, fiducials : see `sort_pixels`
    lit : (h, w) array, optional
        A picture in which the fiducials are looked for.
    tables : sequence of (H, W, 2) float32 arrays
        Lookup tables of all channels: where they differ, each has a coverage of its own.

    Returns
    -------
    clusters : dict of K -> Clusters
    figures : dict
        See `registration.DesignRegistration`.
    coverage : (H, W, 1 or N, M) uint8 array
        Share of each colorant in each pixel, 255 = all.
    """
    colors = np.array([XYZ_to_linear_sRGB(colorants[name]) for name in pattern.colorants])
    picture = reflectance_picture(captures, normalise, dot_px * _camera_px_per_px(guide))
    mm_per_px = pattern.dot_size_mm * float(np.mean(pattern.print_scale)) / dot_px
    to_mm = None
    if np.size(corners_px):
        to_mm = homography_from_corners(corners_px, pattern.size_mm)
    elif fiducials is not None and lit is not None:
        to_mm = homography_from_fiducials(lit, *fiducials)
    apart = tables if len(tables) > 1 and channels_differ(tables, valid) else ()
    design = register_design(
        picture, guide.camera_xy, guide.valid, pattern, mm_per_px, colors, to_mm=to_mm, channel_xy=apart
    )
    covered = valid & (design.coverage.sum(axis=-1) > 1.0 - _OUTSIDE_SHARE)
    by_design = {
        K: cluster_coverages(design.coverage, covered, pattern.colorants, K, nodal_XYZ, D65_XYZ) for K in counts
    }
    return by_design, design.figures, design.of_channels
