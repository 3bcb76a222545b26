"""Assembly by name: inputs x of every pixel and cluster -> the projection image in device codes (paper: section V-A3).

The methods are a table; each makes linear intensities from x, which become codes in the same way. Knows no files.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.assembly.codes import intensities_to_codes
from paxel_runtime.assembly.combine import block_px_of, combine
from paxel_runtime.assembly.coverage import coverage_from_labels, spread_coverage
from paxel_runtime.assembly.dither import dither, inside_pattern
from paxel_runtime.assembly.refine import STEPS, refine, sigma_of
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["METHODS", "AssemblyOptions", "assemble"]

_NO_COVERAGE = "what each pixel covers is not known and taken from its cluster: run paxel calibrate --force"

Intensities = NDArray[np.float32]
Figures = dict[str, Any]


@dataclass(frozen=True, eq=False)
class AssemblyOptions:
    """How a projection image is put together.

    Attributes
    ----------
    method : str
        A key of `METHODS`.
    outside : "black" | "white"
        What pixels outside the pattern show.
    dot_px : float
        Edge of a printed dot, projector pixels.
    eye_px : float
        Standard deviation of the viewer's blur, projector pixels.
    coverage : (H, W, 1 or N, M) uint8 array, optional
        Share of each colorant in each projector pixel, 255 = all; without it, labels stand in.
    point_spread : (1 or N, 6) float64 array, optional
        Variance of what the projector's blur adds to a pixel's own area; see `spread_coverage`.
    spot_px : float
        Diameter of the spot in the middle where the model was measured; infinite: everywhere.
    """

    method: str = "refine"
    outside: str = "black"
    dot_px: float = 5.0
    eye_px: float = 4.0
    coverage: NDArray[np.uint8] | None = None
    point_spread: NDArray[np.float64] | None = None
    spot_px: float = math.inf


Method = Callable[
    [NDArray[np.float32], NDArray[np.uint8], PredictionModel, AssemblyOptions], tuple[Intensities, Figures]
]
"""(x, labels, model, options) -> intensities (H, W, N), figures."""


def assemble(
    x: NDArray[np.float32], labels: NDArray[np.uint8], model: PredictionModel, bits: int, options: AssemblyOptions
) -> tuple[NDArray[np.unsignedinteger], Figures]:
    """Projection image that shows the colours of x on both surfaces, as well as its pixels can.

    Parameters
    ----------
    x : (H, W, n) float32 array
        Linear intensities 0..1 that each pixel's neighbourhood should get, n = K N; may be a memory map.
    labels : (H, W) or (H, W, N) uint8 array
        Cluster of each pixel (in each channel), 0..K-1; 255 = outside the pattern.
    model : PredictionModel
        Of the surfaces that have a wanted colour.
    bits : int
        Bits of a device code, 1..16.
    options : AssemblyOptions

    Returns
    -------
    codes : (H, W, N) uint8 (up to 8 bits) or uint16 array
        Codes 0..2**bits - 1, rounded with blue noise.
    figures : dict
        ``method``, what it did, and a ``message`` where something is to be said.

    Raises
    ------
    InputError
        If shapes do not fit, a label names no cluster, the method is unknown, or x is not a number or outside 0..1
        inside the pattern.
    """
    if options.method not in METHODS:
        raise InputError(f"assembly.method must be one of {', '.join(METHODS)}; got {options.method!r}")
    p, figures = METHODS[options.method](x, labels, model, options)
    codes = intensities_to_codes(p, inside_pattern(labels), model.response, bits, outside=options.outside)
    return codes, {"method": options.method, **figures}


def _refine(
    x: NDArray[np.float32], labels: NDArray[np.uint8], model: PredictionModel, options: AssemblyOptions
) -> tuple[Intensities, Figures]:
    coverage = options.coverage
    if coverage is None:
        coverage = coverage_from_labels(labels, model.clusters)
    sigma_px, message = sigma_of(options.eye_px, options.dot_px, coverage.shape[3])
    if options.coverage is None:
        message = "; ".join(text for text in (message, _NO_COVERAGE) if text)
    if options.point_spread is not None:
        coverage = spread_coverage(coverage, options.point_spread)
    p = refine(x, labels, model, coverage, sigma_px, spot_px=options.spot_px)
    return p, {
        "sigma_px": sigma_px,
        "rounds": len(STEPS),
        "coverage": "clusters" if options.coverage is None else "pixels",
        "point_spread_px2": _middle_and_corners(options.point_spread),
    } | ({"message": message} if message else {})


def _middle_and_corners(point_spread: NDArray[np.float64] | None) -> list[float]:
    """Mean variance over the channels in the middle and in the corners of the field."""
    if point_spread is None:
        return [0.0, 0.0]
    middle = point_spread.mean(axis=0)
    return [float(middle[0]), float(middle[0] + middle[3] + middle[5])]


def _dither(
    x: NDArray[np.float32], labels: NDArray[np.uint8], model: PredictionModel, options: AssemblyOptions
) -> tuple[Intensities, Figures]:
    return dither(x, labels, len(model.channels)), {}


def _combine(
    x: NDArray[np.float32], labels: NDArray[np.uint8], model: PredictionModel, options: AssemblyOptions
) -> tuple[Intensities, Figures]:
    block_px = block_px_of(options.dot_px, sum("+" not in name for name in model.clusters))
    return combine(x, labels, len(model.channels), block_px), {"block_px": block_px}


METHODS: dict[str, Method] = {"refine": _refine, "dither": _dither, "combine": _combine}
"""Assembly methods by the name that ``[assembly] method`` has, the default first."""
