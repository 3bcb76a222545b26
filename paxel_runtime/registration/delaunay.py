"""The paper's lookup table: the mean of each projector pixel's own camera pixels, gaps filled by triangulation.

Kept to compare with, and for sheets that no smooth fit follows (folds, relief). It is pulled by the ink that each
pixel looks at; `table.fit_registration` is not. Knows decoded coordinates; must not know captures.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator
from scipy.ndimage import binary_dilation

from paxel_runtime.errors import CalibrationError
from paxel_runtime.numba_options import KERNEL
from paxel_runtime.structured_light import Decoded

__all__ = ["fill_holes", "pixel_means"]

_LEAST_PIXELS = 100


def pixel_means(decoded: Decoded, width: int, height: int) -> NDArray[np.float32]:
    """Mean camera column and row of the camera pixels that decode to each projector pixel (paper: IV-A).

    Returns
    -------
    (height, width, 2) float32 array
        NaN where no camera pixel does.

    Raises
    ------
    CalibrationError
        If hardly any pixel is hit.
    """
    sums = _sum_places(np.ascontiguousarray(decoded.projector_xy), width, height)
    hit = sums[..., 2] > 0
    if np.count_nonzero(hit) < _LEAST_PIXELS:
        raise CalibrationError(
            f"a per-pixel table needs at least {_LEAST_PIXELS} projector pixels that a camera pixel decoded to, got "
            f"{np.count_nonzero(hit)}: check exposure and focus of the structured-light captures"
        )
    means = sums[..., :2] / np.where(hit, sums[..., 2], np.nan)[..., None]
    return np.asarray(means, np.float32)


def fill_holes(camera_xy: NDArray[np.float32]) -> NDArray[np.float32]:
    """Fill a table's gaps linearly over the Delaunay triangulation of their rims; beyond it by the nearest pixel.

    Only the known pixels around gaps are triangulated: the others cannot be a corner of a triangle that covers one.

    Parameters
    ----------
    camera_xy : (H, W, 2) float32 array
        NaN in the gaps.

    Returns
    -------
    (H, W, 2) float32 array
        Finite everywhere.
    """
    known = np.isfinite(camera_xy).all(axis=-1)
    if known.all():
        return camera_xy.copy()
    rim = known & binary_dilation(~known, np.ones((3, 3), bool))
    at, gaps = np.argwhere(rim), np.argwhere(~known)
    filled = camera_xy.copy()
    values = camera_xy[rim].astype(np.float64)
    if np.linalg.matrix_rank(at - at.mean(axis=0)) == 2:
        filled[~known] = LinearNDInterpolator(at, values)(gaps)
    beyond = ~np.isfinite(filled).all(axis=-1)
    if beyond.any():
        filled[beyond] = NearestNDInterpolator(at, values)(np.argwhere(beyond))
    return filled


@njit(**KERNEL)
def _sum_places(projector_xy: NDArray[np.float32], width: int, height: int) -> NDArray[np.float64]:
    """Sum of camera columns, rows and their number at each projector pixel, (height, width, 3)."""
    sums = np.zeros((height, width, 3))
    for row in range(projector_xy.shape[0]):
        for column in range(projector_xy.shape[1]):
            u, v = projector_xy[row, column, 0], projector_xy[row, column, 1]
            if np.isnan(u):
                continue
            i, j = int(np.floor(v + 0.5)), int(np.floor(u + 0.5))
            if 0 <= i < height and 0 <= j < width:
                sums[i, j, 0] += column
                sums[i, j, 1] += row
                sums[i, j, 2] += 1.0
    return sums
