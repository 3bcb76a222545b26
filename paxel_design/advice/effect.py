"""What a layout would give: a prediction model simulated from the design, and the size of its effect.

Projector pixels are sorted by what they light of the print, and every cluster's light is added up colorant by colorant:
the linear model that a calibration would measure on a projector without faults, with the measured primaries of a DLP
projector. Ink spread is left out: it darkens all layouts of one dot size alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib.resources import as_file, files

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut import JointGamut, lightness_area, product_pair
from paxel_design.gamut.meshes import gamut_mesh
from paxel_design.visibility.moire import Partition, sort_pixels
from paxel_design.visibility.passages import passage_reflectances, passages_to_XYZ
from paxel_design.visibility.raster import area_shares, light_met, met_by_light
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.spectral_files import read_spectra

__all__ = ["BLACK", "EffectSize", "effect_size", "simulated_model"]

BLACK = 0.001
"""Light of a projector at code 0, as a share of full: a common contrast of 1000 to 1."""

_PIECE_PX = 96
_SAMPLES = 55


@dataclass(frozen=True)
class EffectSize:
    """How large the effect of a simulated model is.

    Attributes
    ----------
    L_pattern, L_white : float
        Lengths of the largest lightness rectangle on the pattern and on the white surface, L*.
    volume_pattern, volume_white : float or None
        Of the product pair, cubic CIELAB units; None where they were not asked for, 0 where there is none.
    """

    L_pattern: float
    L_white: float
    volume_pattern: float | None = None
    volume_white: float | None = None

    @property
    def lightness(self) -> float:
        """Geometric mean of both ranges of L*: the side of a square of the rectangle's area."""
        return float(np.sqrt(self.L_pattern * self.L_white))


def simulated_model(
    pattern: Pattern,
    pitch_mm: float,
    K: int,
    *,
    partition: Partition = "light",
    offset_px: tuple[float, float] = (0.31, 0.17),
    size_px: int = _PIECE_PX,
    samples: int = _SAMPLES,
) -> PredictionModel:
    """The linear model of a print under an RGB projector without faults.

    Parameters
    ----------
    pattern : Pattern
    pitch_mm : float
        Width of a projector pixel on the wall.
    K : int
        The number of colorants, or one more.
    partition, offset_px, size_px, samples : see `paxel_design.visibility.moire`

    Raises
    ------
    InputError
        If K or a length is out of range.
    """
    palette = pattern.palette
    met = met_by_light(pattern, pitch_mm, size_px, offset_px=offset_px, samples=samples)
    labels = sort_pixels(area_shares(met), passages_to_XYZ(palette), K, partition)
    shares = np.array([light_met((labels == k).astype(np.float64), met) for k in range(K)])  # (K, M, M)
    primaries = _primaries()
    XYZ = spectra_to_XYZ(primaries[:, None, None] * passage_reflectances(palette))  # (N, M, M, 3)
    paper_XYZ = spectra_to_XYZ(primaries * pattern.library["white"].reflectance)  # (N, 3)
    A_pattern = np.einsum("kab,nabc->ckn", shares, XYZ).reshape(3, -1)
    A_white = np.einsum("k,nc->ckn", shares.sum(axis=(1, 2)), paper_XYZ).reshape(3, -1)
    scale = (1 - BLACK) / paper_XYZ[:, 1].sum()
    on_pattern, on_white = (
        SurfaceModel(A * scale, A.sum(axis=1) * BLACK / paper_XYZ[:, 1].sum()) for A in (A_pattern, A_white)
    )
    clusters = (*pattern.colorants, "edges")[:K]
    levels = np.linspace(0, 1, 2)
    response = ProjectorResponse((levels,) * len(_CHANNELS), (levels,) * len(_CHANNELS))
    white_point = paper_XYZ.sum(axis=0) / paper_XYZ[:, 1].sum()
    return PredictionModel(_CHANNELS, clusters, on_pattern, on_white, white_point, response)


def effect_size(model: PredictionModel, *, volumes: bool = True) -> EffectSize:
    """Lightness rectangle and, if asked for, volumes of the product pair; zeros where there are none."""
    joint = JointGamut(model)
    try:
        area = lightness_area(joint)
    except GamutError:
        return EffectSize(0.0, 0.0, 0.0, 0.0) if volumes else EffectSize(0.0, 0.0)
    ranges = [high - low for low, high in (area.L_pattern, area.L_white)]
    if not volumes:
        return EffectSize(ranges[0], ranges[1])
    try:
        sides = [gamut_mesh(side).volume for side in product_pair(joint, "closure")]
    except GamutError:
        sides = [0.0, 0.0]
    return EffectSize(ranges[0], ranges[1], sides[0], sides[1])


_CHANNELS = ("red", "green", "blue")


@cache
def _primaries() -> NDArray[np.float64]:
    """Measured spectra of a DLP projector's primaries, (3, 81), on `WAVELENGTHS_NM`."""
    with as_file(files("paxel_runtime") / "data" / "dlp.csv") as path:
        columns = read_spectra(path, "dlp.csv")
    return np.array([columns[name][1] for name in _CHANNELS])
