"""The viewer: what the eye sees of a view from its distance, and the figures of it (design: sections 4 and 10).

A *view* is the light of the wall as XYZ on the projector's raster, Y = 1 for the white point; where it comes from
(the virtual bench, a calibrated photograph) is not known here.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import gaussian_filter1d, minimum_filter

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import (
    D65_XYZ,
    Lab_to_XYZ,
    XYZ_to_Lab,
    XYZ_to_linear_sRGB,
    linear_sRGB_to_sRGB,
)
from paxel_runtime.model.delta_e import dE00

__all__ = ["EYE_SIGMA_ARCMIN", "eye_blur", "eye_sigma_mm", "view_figures", "view_to_sRGB"]

EYE_SIGMA_ARCMIN = 0.5
"""Sigma of the eye's blur, minutes of arc (design: section 10, *Observer*)."""

_AUTO_PERCENTILE = 99.5
_AUTO_LUMINANCE = 0.9
_BORDER_SIGMAS = 3.0


def eye_sigma_mm(distance_mm: float) -> float:
    """Sigma of the eye's blur on the wall, mm: 0.5 arcmin at `distance_mm` (4 m: 0.58 mm).

    Raises
    ------
    InputError
        If the distance is not positive.
    """
    if not distance_mm > 0:
        raise InputError(f"viewing.distance_mm must be > 0, got {distance_mm}")
    return distance_mm * math.tan(math.radians(EYE_SIGMA_ARCMIN / 60))


def eye_blur(XYZ: NDArray[np.floating], sigma_px: float) -> NDArray[np.float32]:
    """Gaussian blur of (H, W, ...) light by the eye, float32; the border is repeated; `sigma_px` 0 changes nothing.

    Raises
    ------
    InputError
        If sigma is negative or not finite.
    """
    if not (sigma_px >= 0 and math.isfinite(sigma_px)):
        raise InputError(f"the eye's sigma must be >= 0 pixels, got {sigma_px}")
    blurred = np.asarray(XYZ, np.float32)
    if sigma_px == 0:
        return blurred
    for axis in (0, 1):
        blurred = gaussian_filter1d(blurred, sigma_px, axis=axis, mode="reflect")
    return blurred


def view_figures(
    view_XYZ: NDArray[np.floating],
    white_view_XYZ: NDArray[np.floating],
    mapped_Lab: NDArray[np.floating],
    other_mapped_Lab: NDArray[np.floating] | None,
    white_point: ArrayLike,
    sigma_px: float,
    mask: NDArray[np.bool_],
) -> dict[str, float | None]:
    """How well a view shows its mapped picture, and how much of the other picture is left in it.

    The view is divided by the white sheet's fall-off (the white view, blurred, over the white point, in each of X, Y,
    Z): fall-off is no error of the picture. Then view and mapped picture go through the same eye. Left out are 3
    sigma beside the frame's edge and beside `mask`.

    *Ghosting* (design: section 4): with R = L* of the view - L* of its mapped picture, the least-squares fit
    R ~ 1 + own + other over the pixels gives 100 |coefficient of other|, in percent of the other picture's contrast.
    It means something for static mapping, and for test pairs whose mapped L* correlate below 0.5 (beyond that, own
    and other cannot be told apart).

    Parameters
    ----------
    view_XYZ : (H, W, 3) array
        Light of the projection on one surface, on the projector's raster.
    white_view_XYZ : (H, W, 3) array
        Light of full white on the white sheet.
    mapped_Lab : (H, W, 3) array
        The mapped picture that this surface is to show.
    other_mapped_Lab : (H, W, 3) array or None
        The mapped picture of the other surface; None where there is none.
    white_point : (3,) array
        Reference of CIELAB.
    sigma_px : float
        The eye's sigma on the raster, pixels.
    mask : (H, W) bool array
        Pixels that show the picture (on the pattern, no letterbox).

    Returns
    -------
    dict
        ``dE00_mean``, ``dE00_p95``; ``ghosting_percent``, None without another picture or with one of uniform L*.

    Raises
    ------
    InputError
        If shapes differ, the white sheet is dark, or no pixel is farther than 3 sigma from the edges.
    """
    for name, array in (("white view", white_view_XYZ), ("mapped picture", mapped_Lab), ("other", other_mapped_Lab)):
        if array is not None and array.shape != view_XYZ.shape:
            raise InputError(f"{name} must have the view's shape {view_XYZ.shape}, got {array.shape}")
    inner = _inner_mask(mask, sigma_px)
    white = np.asarray(white_point, np.float64)
    fall_off = eye_blur(white_view_XYZ, sigma_px) / white
    if not np.all(fall_off[inner] > 0):
        raise InputError("the white sheet's view must be > 0 wherever the picture is shown, got pixels without light")
    leveled_XYZ = np.divide(view_XYZ, fall_off, out=np.zeros(view_XYZ.shape), where=fall_off > 0)
    Lab_seen = XYZ_to_Lab(eye_blur(leveled_XYZ, sigma_px)[inner], white)
    Lab_own = _through_the_eye(mapped_Lab, white, sigma_px)[inner]
    dE = dE00(Lab_seen, Lab_own)
    ghosting = None
    if other_mapped_Lab is not None:
        L_other = _through_the_eye(other_mapped_Lab, white, sigma_px)[inner][:, 0]
        ghosting = _ghosting_percent(Lab_seen[:, 0] - Lab_own[:, 0], Lab_own[:, 0], L_other)
    return {
        "dE00_mean": float(np.mean(dE)),
        "dE00_p95": float(np.quantile(dE, 0.95)),
        "ghosting_percent": ghosting,
    }


def view_to_sRGB(
    XYZ: NDArray[np.floating], exposure: str, white_point: ArrayLike, sigma_px: float = 0.0
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

    Returns
    -------
    (H, W, 3) uint8 array
        sRGB codes; what is beyond sRGB or brighter than white is clipped.

    Raises
    ------
    InputError
        If `exposure` is unknown.
    """
    if exposure not in ("fixed", "auto"):
        raise InputError(f"exposure must be fixed or auto, got {exposure!r}")
    share = eye_blur(XYZ, sigma_px) / np.asarray(white_point, np.float32)
    if exposure == "auto":
        bright = float(np.percentile(share[..., 1], _AUTO_PERCENTILE))
        share = share * (_AUTO_LUMINANCE / bright if bright > 0 else 1.0)
    # CIELAB under one white read under another: each of X, Y, Z keeps its share of the white.
    linear = XYZ_to_linear_sRGB(share * D65_XYZ)
    return np.rint(255 * np.clip(linear_sRGB_to_sRGB(linear), 0, 1)).astype(np.uint8)


def _through_the_eye(Lab: NDArray[np.floating], white: NDArray[np.float64], sigma_px: float) -> NDArray[np.floating]:
    return XYZ_to_Lab(eye_blur(Lab_to_XYZ(Lab, white), sigma_px), white)


def _inner_mask(mask: NDArray[np.bool_], sigma_px: float) -> NDArray[np.bool_]:
    """Pixels of `mask` farther than 3 sigma (in rows and in columns) from its edges and from the frame's."""
    reach = math.ceil(_BORDER_SIGMAS * sigma_px)
    inner = minimum_filter(mask.astype(np.uint8), size=2 * reach + 1, mode="constant", cval=0) > 0
    if not inner.any():
        raise InputError(
            f"no pixel of the picture is farther than {reach} px (3 sigma of the eye) from its edges; "
            "the projection is too small for this viewing.distance_mm"
        )
    return inner


def _ghosting_percent(
    R: NDArray[np.floating], L_own: NDArray[np.floating], L_other: NDArray[np.floating]
) -> float | None:
    """100 |coefficient of other| in the least-squares fit R ~ 1 + own + other; None if other is uniform."""
    if np.ptp(L_other) < 1e-3:
        return None
    columns = np.stack([np.ones_like(R), L_own - np.mean(L_own), L_other - np.mean(L_other)], axis=1)
    coefficients = np.linalg.lstsq(columns.astype(np.float64), R.astype(np.float64), rcond=None)[0]
    return float(100 * abs(coefficients[2]))
