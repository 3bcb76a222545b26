"""A print under a projector, before it is made: paths of light followed through raster, dots and paper.

Light leaves a projector pixel, blurred by the lens, meets a dot, wanders in the paper and comes out through a dot that
may be another. Pixels are sorted into clusters by the functions of a calibration, and what each cluster returns is its
columns of a prediction model. Shares no code with the virtual bench, which is there to check it. Only models that were
simulated alike are compared: what is wrong with the simulation then cancels for the most part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import as_file, files
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import erf, ndtri

from paxel_design.visibility.passages import SCATTERING_MM, passage_reflectances, passages_to_XYZ
from paxel_design.visibility.raster import BLUR_PX
from paxel_design.visibility.s_cielab import colorants_to_XYZ
from paxel_runtime.clustering import cluster, cluster_coverages
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.spectral_files import read_spectra

__all__ = ["Lighting", "SortedBy", "simulated_print"]

SortedBy = Literal["kmeans", "design"]
"""What sorts the pixels, as ``clusters.method``: the colours they light, or the known pattern."""

_SIZE_PX = 96
_PATHS = 96
_OFFSET_PX = (0.31, 0.17)
"""Of the raster against the print: no pixel's edge on a dot's."""

_RATIO = 1.16730397826141868
"""Generalised golden ratio in four dimensions, the root of x^5 = x + 1: multiples of its powers fill the cube evenly
(M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018)."""

_Array = NDArray[np.float64]


@dataclass(frozen=True)
class Lighting:
    """How a print is lit, and how pixels are sorted.

    Attributes
    ----------
    pitch_mm : float
        Width of a projector pixel on the wall.
    K : int
        Clusters, at least the number of colorants.
    channels : tuple of str
        ``red``, ``green`` and ``blue`` are those of a DLP projector; any other is white light, or what makes inks that
        fluoresce shine.
    sorted_by : "kmeans" or "design"
    second_surface : bool
        Whether there is a white sheet.
    black : float
        Light of everything at input 0, as a share of full white.
    scattering_mm : float
        Standard deviation of the way of light in the paper, along an axis. It changes the effect of all prints nearly
        alike, and the ratio of two hardly.

    Raises
    ------
    InputError
        If a number is out of range.
    """

    pitch_mm: float
    K: int
    channels: tuple[str, ...] = ("red", "green", "blue")
    sorted_by: SortedBy = "kmeans"
    second_surface: bool = True
    black: float = 0.001
    scattering_mm: float = SCATTERING_MM

    def __post_init__(self) -> None:
        if not (self.pitch_mm > 0 and self.scattering_mm >= 0 and 0 <= self.black < 1):
            raise InputError(
                "a simulated print needs pitch_mm > 0, scattering_mm >= 0 and black in 0..1, got "
                f"{self.pitch_mm}, {self.scattering_mm} and {self.black}"
            )


def simulated_print(
    pattern: Pattern, lighting: Lighting, size_px: int = _SIZE_PX, *, sorted_as: Pattern | None = None
) -> PredictionModel:
    """The linear model that a calibration of a print would find under a projector without faults.

    Parameters
    ----------
    pattern : Pattern
        Its cells everywhere, with its measured scale: the pattern's edge is not looked at.
    lighting : Lighting
    size_px : int
        Edge of the simulated piece of the projection, about the middle of the print.
    sorted_as : Pattern, optional
        A print of the same cells in other inks, by whose colours the pixels are sorted.

    Raises
    ------
    InputError, CalibrationError
        If K is out of range, the colorants look alike, or the dots are too small for so many clusters.
    """
    ways = _ways(pattern, lighting, size_px)
    labels = _labels(sorted_as or pattern, lighting, ways)
    of_ways, of_paper, white = _returned(pattern, lighting, ways)
    lit = np.stack([ways[labels == k].sum(axis=0) for k in range(lighting.K)]) / labels.size  # (K, M, M)
    A_pattern = np.einsum("kab,nabc->ckn", lit, of_ways).reshape(3, -1)
    A_white = np.einsum("kab,nc->ckn", lit, of_paper).reshape(3, -1)
    on_pattern, on_white = (
        SurfaceModel(A * (1 - lighting.black) / white[1], A.sum(axis=1) * lighting.black / white[1])
        for A in (A_pattern, A_white)
    )
    codes = (np.linspace(0, 1, 2),) * len(lighting.channels)
    return PredictionModel(
        lighting.channels,
        tuple(f"cluster {k + 1}" for k in range(lighting.K)),
        on_pattern,
        on_white if lighting.second_surface else None,
        white / white[1],
        ProjectorResponse(codes, codes),
    )


def _ways(pattern: Pattern, lighting: Lighting, size_px: int) -> _Array:
    """Share of each pixel's light by the colorant it enters through and the one it leaves through, (H, W, M, M)."""
    landed, wandered = _paths(_PATHS)
    enters = landed * lighting.pitch_mm
    leaves = enters + wandered * lighting.scattering_mm
    middle_px = np.arange(size_px) - 0.5 * size_px
    x_mm = (middle_px + _OFFSET_PX[0])[None] * lighting.pitch_mm
    y_mm = -(middle_px + _OFFSET_PX[1])[:, None] * lighting.pitch_mm
    endless = replace(pattern, size_mm=(1e9, 1e9))
    M = len(pattern.colorants)
    first = np.arange(size_px**2).reshape(size_px, size_px) * M * M
    counts = np.zeros(size_px**2 * M * M)
    for (x_in, y_in), (x_out, y_out) in zip(enters, leaves, strict=True):
        entered = endless.label(x_mm + x_in, y_mm + y_in).astype(np.int64)
        left = endless.label(x_mm + x_out, y_mm + y_out)
        counts += np.bincount((first + M * entered + left).ravel(), minlength=counts.size)
    return (counts / _PATHS).reshape(size_px, size_px, M, M)


@cache
def _paths(count: int) -> tuple[_Array, _Array]:
    """Where light meets the paper, in pixels from its own pixel's middle, and how far it wanders, in sigmas; (n, 2)."""
    points = (0.5 + np.arange(1, count + 1)[:, None] * _RATIO ** -np.arange(1.0, 5.0)) % 1.0
    t = np.linspace(-3, 3, 6001)
    width = np.sqrt(2) * BLUR_PX
    light = np.cumsum(erf((t + 0.5) / width) - erf((t - 0.5) / width))
    return np.interp(points[:, :2], light / light[-1], t), np.asarray(ndtri(points[:, 2:]), np.float64)


def _labels(pattern: Pattern, lighting: Lighting, ways: _Array) -> NDArray[np.uint8]:
    """Cluster of each pixel, as a calibration would sort them."""
    of_ways, _, white = _returned(pattern, lighting, ways)
    full = of_ways.sum(axis=0) / white[1]
    nodal_XYZ = np.einsum("hwab,abc->hwc", ways, full).astype(np.float32)
    valid = np.ones(nodal_XYZ.shape[:2], bool)
    if lighting.sorted_by == "design":
        coverage = ways.sum(axis=3).astype(np.float32)
        return cluster_coverages(coverage, valid, pattern.colorants, lighting.K, nodal_XYZ, white / white[1]).labels
    solids_XYZ = full[np.diag_indices(len(full))]
    expected = dict(zip(pattern.colorants, solids_XYZ, strict=True))
    return cluster(nodal_XYZ, valid, expected, lighting.K, white / white[1]).labels


def _returned(pattern: Pattern, lighting: Lighting, ways: _Array) -> tuple[_Array, _Array, _Array]:
    """What comes back of each channel's light.

    Returns
    -------
    of_ways : (N, M, M, 3) array
        XYZ where it enters through one colorant and leaves through another.
    of_paper : (N, 3) array
        On bare paper.
    white : (3,) array
        Of all channels on the white sheet or, without one, on the print.
    """
    passed, passed_XYZ = passage_reflectances(pattern.palette), passages_to_XYZ(pattern.palette)
    paper = pattern.library["white"]
    primaries = _primaries()
    of_ways, of_paper = [], []
    for channel in lighting.channels:
        if channel in primaries:
            of_ways.append(spectra_to_XYZ(primaries[channel] * passed))
            of_paper.append(spectra_to_XYZ(primaries[channel] * paper.reflectance))
        else:
            of_ways.append(passed_XYZ)
            of_paper.append(colorants_to_XYZ([paper])[0])
    if lighting.second_surface:
        white = np.sum(of_paper, axis=0)
    else:
        white = np.einsum("hwab,nabc->c", ways, of_ways) / (ways.shape[0] * ways.shape[1])
    return np.array(of_ways), np.array(of_paper), white


@cache
def _primaries() -> dict[str, _Array]:
    """Measured spectra of a DLP projector's primaries, each (81,), on `WAVELENGTHS_NM`."""
    with as_file(files("paxel_runtime") / "data" / "dlp.csv") as path:
        columns = read_spectra(path, "dlp.csv")
    return {name: columns[name][1] for name in ("red", "green", "blue")}
