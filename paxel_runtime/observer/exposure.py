"""Views as pictures for a screen: at a fixed exposure, or exposed as a camera or the eye adapts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_linear_sRGB, linear_sRGB_to_sRGB
from paxel_runtime.observer.eye import eye_blur

__all__ = ["EXPOSURES", "view_to_sRGB"]

EXPOSURES = {"fixed": "", "auto": ".auto"}
"""Exposures of a preview, and what they add to its file's name."""

_AUTO_PERCENTILE = 99.5
_AUTO_LUMINANCE = 0.9
_ROWS_AT_ONCE = 256


def view_to_sRGB(
    XYZ: NDArray[np.floating],
    exposure: str,
    white_point: ArrayLike,
    sigma_px: float = 0.0,
    mask: NDArray[np.bool_] | None = None,
) -> NDArray[np.uint8]:
    """A view as a picture for a screen, the way source pictures came in: their CIELAB as numbers.

    Parameters
    ----------
    XYZ : (H, W, 3) array
        Light, Y = 1 for the white point.
    exposure : "fixed" | "auto"
        ``"fixed"``: the white point becomes white (Y = 1 -> 255), so two surfaces compare truly. ``"auto"``: one gain
        takes the 99.5 percentile of luminance to 0.9, as a camera or the eye adapts to what it sees.
    white_point : (3,) array
        Becomes the white of sRGB, exposure apart.
    sigma_px : float
        The eye's blur first, pixels; 0 keeps the dots.
    mask : (H, W) bool array, optional
        What ``"auto"`` adapts to, such as the picture without the wall around it; all without it.

    Returns
    -------
    (H, W, 3) uint8 array
        sRGB codes; what is beyond sRGB or brighter than white is clipped.

    Raises
    ------
    InputError
        If `exposure` is unknown.
    """
    if exposure not in EXPOSURES:
        raise InputError(f"exposure must be {' or '.join(EXPOSURES)}, got {exposure!r}")
    share = eye_blur(XYZ, sigma_px) / np.asarray(white_point, np.float32)
    if exposure == "auto":
        Y = share[..., 1] if mask is None or not mask.any() else share[mask][:, 1]
        bright = float(np.percentile(Y, _AUTO_PERCENTILE))
        share *= np.float32(_AUTO_LUMINANCE / bright if bright > 0 else 1.0)
    picture = np.empty(share.shape, np.uint8)
    for row in range(0, len(share), _ROWS_AT_ONCE):
        # CIELAB under one white read under another: each of X, Y, Z keeps its share of the white.
        linear = XYZ_to_linear_sRGB(share[row : row + _ROWS_AT_ONCE] * D65_XYZ)
        picture[row : row + _ROWS_AT_ONCE] = np.rint(255 * np.clip(linear_sRGB_to_sRGB(linear), 0, 1))
    return picture
