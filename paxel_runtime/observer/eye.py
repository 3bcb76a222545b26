"""The viewer's eye: how far it stands, what its blur takes away, and what is left of light and of pictures.

Everything the figures compare has gone through the same eye. Knows XYZ on the projector's raster and CIELAB; nothing
of where a view comes from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import minimum_filter1d

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.observer.gaussian import gaussian_blur

__all__ = [
    "EYE_SIGMA_ARCMIN",
    "Viewer",
    "eye_blur",
    "eye_sigma_mm",
    "fall_off",
    "inner_mask",
    "leveled",
    "picture_to_Lab",
    "view_to_Lab",
]

EYE_SIGMA_ARCMIN = 0.5
"""Sigma of the eye's blur, minutes of arc (design: section 10, *Observer*)."""

_BORDER_SIGMAS = 3.0
_ROWS_AT_ONCE = 256


@dataclass(frozen=True)
class Viewer:
    """Who looks at the wall.

    Attributes
    ----------
    distance_mm : float
        From the wall, > 0.
    mm_per_px : float
        Pitch of the projector's raster on the wall, > 0.

    Raises
    ------
    InputError
        If one of them is not positive.
    """

    distance_mm: float
    mm_per_px: float

    def __post_init__(self) -> None:
        eye_sigma_mm(self.distance_mm)
        if not self.mm_per_px > 0:
            raise InputError(f"a pixel's pitch on the wall must be > 0 mm, got {self.mm_per_px}")

    @property
    def sigma_px(self) -> float:
        """Sigma of the eye's blur on the raster, pixels."""
        return eye_sigma_mm(self.distance_mm) / self.mm_per_px

    @property
    def px_per_degree(self) -> float:
        """Pixels in one degree of the field of view."""
        return self.distance_mm * math.tan(math.radians(1.0)) / self.mm_per_px


def eye_sigma_mm(distance_mm: float) -> float:
    """Sigma of the eye's blur on the wall, mm: 0.5 arcmin at `distance_mm` (4 m: 0.58 mm).

    Raises
    ------
    InputError
        If the distance is not positive.
    """
    if not (distance_mm > 0 and math.isfinite(distance_mm)):
        raise InputError(f"viewing.distance_mm must be > 0, got {distance_mm}")
    return distance_mm * math.tan(math.radians(EYE_SIGMA_ARCMIN / 60))


def eye_blur(XYZ: NDArray[np.floating], sigma_px: float) -> NDArray[np.floating]:
    """Gaussian blur of (H, W, ...) light by the eye, float32; the border is repeated; `sigma_px` 0 changes nothing.

    Raises
    ------
    InputError
        If sigma is negative or not finite.
    """
    if not (sigma_px >= 0 and math.isfinite(sigma_px)):
        raise InputError(f"the eye's sigma must be >= 0 pixels, got {sigma_px}")
    blurred = np.asarray(XYZ, np.float32)
    return gaussian_blur(blurred, sigma_px) if sigma_px > 0 else blurred


def fall_off(reference_XYZ: NDArray[np.floating], white_point: ArrayLike, sigma_px: float) -> NDArray[np.float32]:
    """Light of full white on the white sheet (H, W, 3), through the eye, over the white point, in each of X, Y, Z."""
    return np.asarray(eye_blur(reference_XYZ, sigma_px) / np.asarray(white_point, np.float32), np.float32)


def leveled(view_XYZ: NDArray[np.floating], share: NDArray[np.float32]) -> NDArray[np.float32]:
    """A view (H, W, 3) without the `fall_off`, which is no error of a picture; black where there is no light.

    Raises
    ------
    InputError
        If shapes differ.
    """
    if share.shape != view_XYZ.shape:
        raise InputError(f"the white view must have the view's shape {view_XYZ.shape}, got {share.shape}")
    return np.divide(view_XYZ, share, out=np.zeros(view_XYZ.shape, np.float32), where=share > 0)


def view_to_Lab(leveled_XYZ: NDArray[np.floating], white_point: ArrayLike, sigma_px: float) -> NDArray[np.float32]:
    """What the eye sees of a `leveled` view (H, W, 3), as CIELAB under the white point."""
    return _to_Lab(eye_blur(leveled_XYZ, sigma_px), np.asarray(white_point, np.float32))


def picture_to_Lab(Lab: NDArray[np.floating], white_point: ArrayLike, sigma_px: float) -> NDArray[np.float32]:
    """What the eye sees of a picture (H, W, 3) that is shown without an error: its light blurred, CIELAB again."""
    white = np.asarray(white_point, np.float32)
    XYZ = np.empty(Lab.shape, np.float32)
    for row in range(0, len(Lab), _ROWS_AT_ONCE):
        XYZ[row : row + _ROWS_AT_ONCE] = Lab_to_XYZ(Lab[row : row + _ROWS_AT_ONCE], white)
    return _to_Lab(eye_blur(XYZ, sigma_px), white)


def inner_mask(mask: NDArray[np.bool_], sigma_px: float) -> NDArray[np.bool_]:
    """Pixels of (H, W) `mask` farther than 3 sigma (in rows and in columns) from its edges and from the frame's.

    Raises
    ------
    InputError
        If none is left.
    """
    reach = math.ceil(_BORDER_SIGMAS * sigma_px)
    inner = mask.astype(np.uint8)
    for axis in (0, 1):
        inner = minimum_filter1d(inner, 2 * reach + 1, axis=axis, mode="constant", cval=0)
    if not inner.any():
        raise InputError(
            f"no pixel of the picture is farther than {reach} px (3 sigma of the eye) from its edges; "
            "the projection is too small for this viewing.distance_mm"
        )
    return inner > 0


def _to_Lab(XYZ: NDArray[np.floating], white: NDArray[np.float32]) -> NDArray[np.float32]:
    Lab = np.empty(XYZ.shape, np.float32)
    for row in range(0, len(XYZ), _ROWS_AT_ONCE):
        Lab[row : row + _ROWS_AT_ONCE] = XYZ_to_Lab(XYZ[row : row + _ROWS_AT_ONCE], white)
    return Lab
