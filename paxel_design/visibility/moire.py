"""Moire: how a layout beats against a projector's raster, before anything is printed.

Pixels are sorted by what they light of the print, the cluster of the brightest colorant is lit (the paper's Fig. 12),
and what the print returns is averaged over each pixel. Whatever of that is slower than the print itself is the moire,
in threshold units of the eye. Shares no code with the virtual bench, which is there to check it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_design.visibility.beats import SLOW_SHARE
from paxel_design.visibility.passages import SCATTERING_MM, passages_to_XYZ
from paxel_design.visibility.raster import BLUR_PX, area_shares, met_by_light, returned
from paxel_design.visibility.sensitivity import cycles_per_degree, luminance_sensitivity
from paxel_runtime.clustering.kmeans import lloyd, nearest
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.pattern import Pattern

__all__ = [
    "Moire",
    "Partition",
    "moire",
    "moire_of_picture",
    "moire_picture",
    "sort_pixels",
    "worst_moire",
]

Partition = Literal["light", "lab"]
"""How pixels are sorted: ``"light"`` by the share of their area on each colorant, as a registered design gives it;
``"lab"`` by k-means in CIELAB of what they return under full light, as in the paper: of two clusters of black and
white, then, all pixels with more than a third of white belong to white."""

_MARGIN_PX = 2
_FITTED = 20_000
"""Pixels that the centres of k-means are fitted to."""


@dataclass(frozen=True)
class Moire:
    """The slow part of what a lit cluster shows.

    Attributes
    ----------
    contrast : float
        Root mean square over the mean, of frequencies below `SLOW_SHARE` cycles a dot.
    visibility : float
        In threshold units at the distance: 1 is just seen.
    period_mm : float
        Of the component that is seen best; infinite where there is none.
    line_share : float
        Of the slow variance, in its strongest line: near 1 stripes, near 0 the noise of a random layout.
    """

    contrast: float
    visibility: float
    period_mm: float
    line_share: float = 0.0


def moire(
    pattern: Pattern,
    pitch_mm: float,
    distance_mm: float,
    *,
    K: int = 2,
    partition: Partition = "light",
    luminance_cd_m2: float = 100.0,
    offset_px: tuple[float, float] = (0.0, 0.0),
    size_px: int = 384,
    samples: int = 89,
    blur_px: float = BLUR_PX,
    scattering_mm: float = SCATTERING_MM,
    ragged_mm: float = 0.0,
    aim: ArrayLike | None = None,
) -> Moire:
    """How much a layout beats against a raster of some pitch.

    Parameters
    ----------
    pattern : Pattern
    pitch_mm : float
        Width of a projector pixel on the wall.
    distance_mm, luminance_cd_m2 : float
        Of the viewer, and of the lit print.
    K : int
        Clusters: as many as colorants, or one more, of pixels on edges (2 or 3 for two colorants).
    partition : "light" or "lab"
        What sorts the pixels, see `Partition`.
    offset_px : (float, float)
        Phase of the raster against the print.
    size_px : int
        Edge of the simulated piece; beats slower than a quarter of it are not resolved.
    samples : int
        Samples of the print in a pixel, 8 to 1597; the next Fibonacci number is taken. The mean over pitches and phases
        is within 5 % of the limit at 89, and 2 % at 233.
    blur_px, scattering_mm, ragged_mm : float
        Sigma of the projector's blur, pixels, of the light's way in the paper, and of the noise of the print's edges.
    aim : (3, 3) array, optional
        How the projector is turned and tilted, see `raster.met_by_light`; None = not at all.

    Raises
    ------
    InputError
        If a length is not positive, K is neither the number of colorants nor one more, the partition is unknown, or the
        aim no homography.
    """
    view = moire_picture(
        pattern,
        pitch_mm,
        K=K,
        partition=partition,
        offset_px=offset_px,
        size_px=size_px,
        samples=samples,
        blur_px=blur_px,
        scattering_mm=scattering_mm,
        ragged_mm=ragged_mm,
        aim=aim,
    )
    return moire_of_picture(view, pattern.dot_size_mm, pitch_mm, distance_mm, luminance_cd_m2)


def moire_of_picture(
    luminance: NDArray[np.floating],
    dot_size_mm: float,
    pitch_mm: float,
    distance_mm: float,
    luminance_cd_m2: float = 100.0,
) -> Moire:
    """The slow part of any picture of a lit print: a simulated one, or a photograph.

    Parameters
    ----------
    luminance : (H, W) array
        Linear, of any unit.
    dot_size_mm : float
        Of the print: slower than `SLOW_SHARE` cycles of it is moire.
    pitch_mm : float
        From one pixel of the picture to the next, on the wall.
    distance_mm, luminance_cd_m2 : float
        Of the viewer.
    """
    window = np.outer(*(np.hanning(size + 2)[1:-1] for size in luminance.shape))
    mean = float((luminance * window).sum() / window.sum())
    if not mean > 0:
        return Moire(0.0, 0.0, np.inf)
    rows, columns = luminance.shape
    spectrum = np.fft.rfft2((luminance / mean - 1.0) * window)
    fx, fy = np.fft.rfftfreq(columns, pitch_mm), np.fft.fftfreq(rows, pitch_mm)
    radius = np.hypot(fy[:, None], fx[None])
    twice = np.where((fx == 0) | (2 * np.arange(len(fx)) == columns), 1.0, 2.0)[None]
    variance = twice * np.abs(spectrum) ** 2 / (window**2).sum() / luminance.size
    slow = (radius < SLOW_SHARE / dot_size_mm) & (radius > 1.5 / (min(rows, columns) * pitch_mm))
    sensitivity = luminance_sensitivity(cycles_per_degree(radius, distance_mm), luminance_cd_m2)
    seen = np.where(slow, variance * sensitivity**2, 0.0)
    peak = np.unravel_index(int(np.argmax(seen)), seen.shape)
    kept = np.where(slow, variance, 0.0)
    row, column = np.unravel_index(int(np.argmax(kept)), kept.shape)
    line = kept[np.arange(row - 1, row + 2) % rows, max(column - 1, 0) : column + 2].sum()
    return Moire(
        float(np.sqrt(variance[slow].sum())),
        float(np.sqrt(2 * seen.sum())),
        float(1 / radius[peak]) if seen[peak] > 0 else np.inf,
        float(line / kept.sum()) if kept.any() else 0.0,
    )


def moire_picture(
    pattern: Pattern,
    pitch_mm: float,
    *,
    K: int = 2,
    partition: Partition = "light",
    offset_px: tuple[float, float] = (0.0, 0.0),
    size_px: int = 384,
    samples: int = 89,
    blur_px: float = BLUR_PX,
    scattering_mm: float = SCATTERING_MM,
    ragged_mm: float = 0.0,
    aim: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """Luminance of the print with the cluster of its brightest colorant lit, averaged over each pixel.

    (size_px, size_px); 1 is a perfect diffuser under full light. Parameters and errors as `moire`.
    """
    XYZ = passages_to_XYZ(pattern.palette)
    met = met_by_light(pattern, pitch_mm, size_px + 2 * _MARGIN_PX, offset_px=offset_px, aim=aim, samples=samples,
                       blur_px=blur_px, scattering_mm=scattering_mm, ragged_mm=ragged_mm)  # fmt: skip
    brightest = int(np.argmax(np.diagonal(XYZ[..., 1])))
    lit = sort_pixels(area_shares(met), XYZ, K, partition) == brightest
    inner = slice(_MARGIN_PX, -_MARGIN_PX)
    return np.ascontiguousarray(returned(lit, met, XYZ[..., 1])[inner, inner])


def sort_pixels(
    shares: NDArray[np.float64], XYZ: NDArray[np.float64], K: int, partition: Partition
) -> NDArray[np.int64]:
    """Cluster of each pixel: index of its colorant, or M for those on edges.

    Parameters
    ----------
    shares : (..., M, M) array
        Of each pixel's area, where light enters and leaves each colorant: `raster.area_shares`.
    XYZ : (M, M, 3) array
        Of light that enters and leaves each colorant, Y = 1 for a perfect diffuser: `passages.passages_to_XYZ`.
    K : int
        M, or M + 1.
    partition : "light" or "lab"

    Raises
    ------
    InputError
        If K is another number, or the partition unknown.
    """
    colorants = len(XYZ)
    if K not in (colorants, colorants + 1):
        raise InputError(
            f"clusters of a layout are K = {colorants} or {colorants + 1} for {colorants} colorants, got {K}"
        )
    if partition not in get_args(Partition):
        raise InputError(f"partition must be one of {', '.join(get_args(Partition))}, got {partition!r}")
    # the colorants alone and, for edges, their even mixture
    centres = np.concatenate([np.eye(colorants), np.full((1, colorants), 1 / colorants)])[:K]
    if partition == "light":
        points = shares.sum(axis=-1)
    else:
        solid_XYZ = np.diagonal(XYZ).T
        brightest_XYZ = solid_XYZ[np.argmax(solid_XYZ[:, 1])]
        seen_XYZ = np.einsum("...ab,abc->...c", shares, XYZ)
        points, starts = (
            np.asarray(XYZ_to_Lab(np.maximum(each, 0.0), brightest_XYZ / brightest_XYZ[1]), np.float64)
            for each in (seen_XYZ, centres @ solid_XYZ)
        )
        centres, _ = lloyd(points.reshape(-1, 3)[:: max(1, points[..., 0].size // _FITTED)], starts)
    flat = np.ascontiguousarray(points.reshape(-1, points.shape[-1]))
    return nearest(flat, centres)[0].reshape(points.shape[:-1])


def worst_moire(
    pattern: Pattern,
    pitches_mm: Iterable[float],
    distance_mm: float,
    *,
    K: int = 2,
    partition: Partition = "light",
    luminance_cd_m2: float = 100.0,
    phases: int = 2,
    size_px: int = 384,
    samples: int = 89,
) -> Moire:
    """The most visible moire over pitches and phases: nobody sets a projector's zoom to a tenth of a percent.

    Parameters
    ----------
    pitches_mm : iterable of float
    phases : int
        Offsets of the raster along the diagonal of a pixel, evenly spaced.
    pattern, distance_mm, K, partition, luminance_cd_m2, size_px, samples : see `moire`
    """
    found = [
        moire(
            pattern,
            pitch,
            distance_mm,
            K=K,
            partition=partition,
            luminance_cd_m2=luminance_cd_m2,
            offset_px=(k / phases, 0.6 * k / phases),
            size_px=size_px,
            samples=samples,
        )
        for pitch in pitches_mm
        for k in range(phases)
    ]
    return max(found, key=lambda m: m.visibility)
