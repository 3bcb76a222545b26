"""Pixels -> data URIs: without loss where pixels are looked at one by one or that costs little, else JPEG."""

from __future__ import annotations

import base64
import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

__all__ = ["photo_uri", "picture_uri"]

_JPEG_QUALITY = 85

_WORTH = 1.5
"""A PNG that is larger than the JPEG by no more than this factor is taken instead: flat maps and drawings."""

_WIDTH_PX = {1: 1600, 2: 1200}
_NARROW_PX = 900
"""Largest width of a picture by how many share the line: two pixels for each of the screen's, and room to enlarge."""


def picture_uri(picture: NDArray[np.uint8], *, exact: bool, abreast: int = 1) -> str:
    """Pixels as a data URI.

    Parameters
    ----------
    picture : (h, w, 3) uint8 array
        sRGB.
    exact : bool
        Every pixel as it is, however large: crops at true scale, pixels enlarged. Else it may be averaged down to at
        most 1600 px, and is stored with losses where that spares much.
    abreast : int
        How many pictures share the line.
    """
    image = Image.fromarray(picture)
    if exact:
        return _png(image)
    widest = _WIDTH_PX.get(abreast, _NARROW_PX)
    if image.width > widest:
        image = image.resize((widest, round(image.height * widest / image.width)), Image.Resampling.LANCZOS)
    lossless, lossy = _png(image), photo_uri(image)
    return lossless if len(lossless) <= _WORTH * len(lossy) else lossy


def photo_uri(image: Image.Image) -> str:
    """A picture as JPEG, its colours as sharp as its lightness: fine coloured dots and lines stay."""
    file = io.BytesIO()
    image.save(file, format="JPEG", quality=_JPEG_QUALITY, subsampling=0)
    return _data_uri("image/jpeg", file.getvalue())


def _data_uri(kind: str, content: bytes) -> str:
    """``data:<kind>;base64,...``."""
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"


def _png(image: Image.Image) -> str:
    file = io.BytesIO()
    image.save(file, format="PNG", compress_level=6)
    return _data_uri("image/png", file.getvalue())
