"""Pictures under the light that each place of the wall gets: an image-based model has its own white at every pixel.

What is mapped holds for the median of the model over the pattern (design: section 7); where the projector is dimmer,
the picture is dimmed as much, so that it keeps its room in the local gamut and fades as the light on the wall does.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["local_white", "under_light"]

_ROWS_AT_ONCE = 64
_LEAST, _MOST = 0.05, 20.0
"""Bounds of the local white over the median one: beyond them the camera saw no wall."""


def local_white(local: PredictionModel, median: PredictionModel) -> NDArray[np.float32]:
    """Full white at every pixel over that of the median model, in X, Y and Z, (H, W, 3).

    Parameters
    ----------
    local : PredictionModel
        Image-based; of its white surface, or of its only one.
    median : PredictionModel
        Its spectral form.
    """
    name = list(local.surfaces)[-1]
    surface, whole = local.surfaces[name], median.surfaces[name]
    white = whole.A.sum(axis=1) + whole.black
    shares = np.ones((*surface.A.shape[:2], 3), np.float32)
    for first in range(0, len(shares), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        tile = (np.asarray(surface.A[rows], np.float32).sum(axis=-1) + np.asarray(surface.black[rows])) / white
        shares[rows] = np.where((tile > _LEAST) & (tile < _MOST), tile, 1.0)
    return shares


def under_light(
    Lab: NDArray[np.float32], shares: NDArray[np.floating], white_point: NDArray[np.float64]
) -> NDArray[np.float32]:
    """A picture's CIELAB (H, W, 3) with its XYZ multiplied, pixel by pixel."""
    lit = np.empty_like(Lab)
    for first in range(0, len(Lab), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        lit[rows] = XYZ_to_Lab(Lab_to_XYZ(Lab[rows], white_point) * shares[rows], white_point)
    return lit
