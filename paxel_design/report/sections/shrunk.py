"""Pictures at the size of a report: shrunk in linear light, cropped, from codes or CIELAB to sRGB. Knows no figure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import Lab_to_sRGB, linear_sRGB_to_sRGB, sRGB_to_linear_sRGB
from paxel_runtime.pictures import resample

__all__ = ["WIDTH_PX", "Lab_picture", "block_means", "codes_picture", "middle", "shrunk"]

WIDTH_PX = 640
"""Of a picture a third of a page wide: 280 dots an inch."""

_CROP_PX = (144, 81)


def shrunk(sRGB: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """A picture (H, W, 3) or (H, W) as (h, w, 3), at most `WIDTH_PX` wide."""
    if sRGB.ndim == 2:
        sRGB = np.repeat(sRGB[..., None], 3, axis=-1)
    height, width = sRGB.shape[:2]
    if width <= WIDTH_PX:
        return np.ascontiguousarray(sRGB)
    levels = sRGB_to_linear_sRGB(np.arange(256) / 255).astype(np.float32)
    small = resample(levels[sRGB], WIDTH_PX, max(1, round(height * WIDTH_PX / width)))
    return _to_uint8(linear_sRGB_to_sRGB(small))


def Lab_picture(Lab: NDArray[np.floating]) -> NDArray[np.uint8]:
    """CIELAB (H, W, 3) as a picture at most `WIDTH_PX` wide; what a screen cannot show is clipped."""
    return shrunk(_to_uint8(Lab_to_sRGB(block_means(Lab))))


def codes_picture(codes: NDArray[np.unsignedinteger], bits: int) -> NDArray[np.uint8]:
    """A frame of device codes (H, W, N) as (H, W, 3): three channels as red, green and blue, others as their mean."""
    share = codes.astype(np.float32) / (2**bits - 1)
    if share.shape[2] != 3:
        share = np.repeat(share.mean(axis=-1, keepdims=True), 3, axis=-1)
    return _to_uint8(share)


def middle(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The middle of a picture, some hundred pixels wide, to be shown enlarged with its pixels kept."""
    width, height = (min(part, whole) for part, whole in zip(_CROP_PX, picture.shape[1::-1], strict=True))
    top, left = (picture.shape[0] - height) // 2, (picture.shape[1] - width) // 2
    return np.ascontiguousarray(picture[top : top + height, left : left + width])


def block_means(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Means over whole blocks of pixels (H, W, ...), so that the result is not twice as wide as a picture here."""
    block = values.shape[1] // WIDTH_PX
    if block < 2:
        return values
    rows, columns = (size - size % block for size in values.shape[:2])
    parts = values[:rows, :columns].reshape(rows // block, block, columns // block, block, *values.shape[2:])
    return np.asarray(parts.mean(axis=(1, 3), dtype=np.float32))


def _to_uint8(sRGB: NDArray[np.floating]) -> NDArray[np.uint8]:
    return np.rint(255 * np.clip(sRGB, 0, 1)).astype(np.uint8)
