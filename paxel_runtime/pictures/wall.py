"""The projector's raster as it lies on the wall: what makes pictures straight there, and circles round.

The lookup table takes the projector's pixels to the camera's; from there millimetres of the pattern are known where its
corners or markers are, and else the camera is taken to look straight at the wall, as the paper asks (section IV-A).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.registration.plane import fit_homography, homography_places

__all__ = ["wall_homography"]

_SAMPLES = 20_000


def wall_homography(
    camera_xy: NDArray[np.float32],
    valid: NDArray[np.bool_],
    to_mm: NDArray[np.float64] | None = None,
    *,
    seed: int = 0,
) -> NDArray[np.float64]:
    """From the raster to upright places on the wall, x right and y down, in pixels of about the projector's size.

    Parameters
    ----------
    camera_xy : (H, W, 2) float32 array
        Camera column and row of each projector pixel, of one channel.
    valid : (H, W) bool array
    to_mm : (3, 3) float64 array, optional
        Homography from the camera's picture to millimetres of the pattern (y up): upright is then what is upright on
        the print. Without it the camera looks straight at the wall, and upright is what is so on the raster on average.

    Returns
    -------
    (3, 3) float64 array
        The middle of the raster stays where it is, and so does its mean scale.

    Raises
    ------
    InputError
        If fewer than four pixels are valid.
    """
    rows, columns = np.nonzero(valid)
    if rows.size < 4:
        raise InputError('mapping.geometry = "wall" needs a registration of at least four pixels; see paxel calibrate')
    chosen = np.random.default_rng(seed).choice(rows.size, min(_SAMPLES, rows.size), replace=False)
    uv = np.column_stack([columns[chosen], rows[chosen]]).astype(np.float64)
    onto = fit_homography(uv, camera_xy[rows[chosen], columns[chosen]].astype(np.float64))
    if to_mm is not None:
        onto = np.diag([1.0, -1.0, 1.0]) @ to_mm @ onto
    height, width = valid.shape
    middle = np.array([0.5 * (width - 1), 0.5 * (height - 1)])
    arms = np.array([[width / 4, 0.0], [0.0, height / 4]])
    right, down = (
        (homography_places(onto, middle + arm) - homography_places(onto, middle - arm)) / (2 * np.hypot(*arm))
        for arm in arms
    )
    scale = np.sqrt(abs(right[0] * down[1] - right[1] * down[0]))
    # Upright on average: half the turn of the raster's rows and half that of its columns.
    turn = 0.0 if to_mm is not None else 0.5 * (np.arctan2(right[1], right[0]) + np.arctan2(-down[0], down[1]))
    cos, sin = np.cos(turn) / scale, np.sin(turn) / scale
    similarity = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    centre = homography_places(similarity @ onto, middle)
    shift = np.eye(3)
    shift[:2, 2] = middle - centre
    both = shift @ similarity @ onto
    return np.asarray(both / both[2, 2], np.float64)
