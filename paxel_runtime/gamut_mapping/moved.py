"""A picture of what a mapping took: where a picture's colours lay outside, and how much chroma they lost."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import Lab_to_sRGB

__all__ = ["moved_picture"]

_ROWS_AT_ONCE = 256
_LEAST, _PLAIN, _MOST = 0.1, 8.0, 40.0
"""Chroma lost from which on colour is laid over the gray, is laid on in full, and is darkest."""
_COVER = 0.8
_HUES_RGB = np.array([[1.0, 0.9, 0.2], [1.0, 0.45, 0.0], [0.75, 0.0, 0.1]])
"""Of no loss, half of `_MOST`, and that much or more."""


def moved_picture(source: NDArray[np.float32], mapped: NDArray[np.float32]) -> NDArray[np.uint8]:
    """The mapped picture in gray, and over it, from a breath of yellow to dark red, the chroma that was lost.

    Parameters
    ----------
    source, mapped : (H, W, 3) float32 arrays
        CIELAB.

    Returns
    -------
    (H, W, 3) uint8 array
        sRGB; the grays are stretched to the whole range, so that a dark picture can be seen.
    """
    low, high = float(mapped[..., 0].min()), float(mapped[..., 0].max())
    picture = np.empty(mapped.shape, np.uint8)
    for first in range(0, len(mapped), _ROWS_AT_ONCE):
        rows = slice(first, first + _ROWS_AT_ONCE)
        gray = np.zeros_like(mapped[rows])
        gray[..., 0] = 20 + 75 * (mapped[rows, :, 0] - low) / max(high - low, 1.0)
        sRGB = np.clip(Lab_to_sRGB(gray), 0, 1)
        lost = np.hypot(source[rows, :, 1], source[rows, :, 2]) - np.hypot(mapped[rows, :, 1], mapped[rows, :, 2])
        colour = np.stack([np.interp(lost / _MOST, [0, 0.5, 1], _HUES_RGB[:, c]) for c in range(3)], axis=-1)
        cover = np.where(lost > _LEAST, _COVER * np.clip(lost / _PLAIN, 0, 1), 0)[..., None]
        picture[rows] = np.rint(255 * ((1 - cover) * sRGB + cover * colour))
    return picture
