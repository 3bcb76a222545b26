"""A picture packed for a page: JPEG where that is smaller and no eye sees a difference, else without loss.

Knows pixels and millimetres; knows no PDF file.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB, sRGB_to_Lab, sRGB_to_linear_sRGB
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.pictures import resample

__all__ = ["Raster", "raster_of"]

_LARGEST_PPI = 260.0
"""Finer pixels than this are averaged: print shows no more of a photograph, and the file stays small."""

_PIXEL_PPI = 450.0
"""Pixels that have to stay pixels are repeated up to this: readers smooth over one pixel, here 0.06 mm."""

_QUALITIES = (88, 92, 95)

_BLUR_MM = 0.25
"""Differences are taken of averages over squares of about this edge: an eye at reading distance joins them."""

_MEAN_DE00, _TAIL_DE00 = 1.0, 3.0
"""A JPEG may differ by this, over the whole picture and in its worst 1 %: not seen with both side by side."""

_SAMPLES = 8000
"""Places where that is measured."""

_PROBE = 0.7
"""A JPEG below this share of a quick packing without loss is below a thorough one, which takes ten times as long."""

_BAND = 16
"""The quick one packs so many rows of every four times as many."""


@dataclass(frozen=True)
class Raster:
    """A packed picture.

    Attributes
    ----------
    width, height : int
        Pixels.
    data : bytes
        A JPEG file, or the packed rows of a PNG file: RGB triples, or indices where there is a palette.
    jpeg : bool
    palette : bytes
        RGB triples, at most 256; empty without one.
    """

    width: int
    height: int
    data: bytes
    jpeg: bool
    palette: bytes = b""


def raster_of(picture: NDArray[np.uint8], width_mm: float, *, pixelated: bool) -> Raster:
    """Pack a picture that is set `width_mm` wide.

    Parameters
    ----------
    picture : (h, w, 3) uint8 array
        sRGB.
    width_mm : float
    pixelated : bool
        Keep its pixels as squares: no average, no loss, repeated so finely that no reader smooths them away.
    """
    target = width_mm / 25.4 * (_PIXEL_PPI if pixelated else _LARGEST_PPI)
    if pixelated:
        times = max(1, int(np.ceil(target / picture.shape[1])))
        return _without_loss(np.repeat(np.repeat(picture, times, axis=0), times, axis=1))
    if picture.shape[1] > 1.2 * target:
        picture = _shrunk(picture, round(target))
    blur = max(1, round(_BLUR_MM * picture.shape[1] / width_mm))
    jpeg = _jpeg(picture, blur)
    if jpeg is not None and len(jpeg.data) < _PROBE * _quick_size(picture):
        return jpeg
    exact = _without_loss(picture)
    return exact if jpeg is None or len(exact.data) <= len(jpeg.data) else jpeg


def _shrunk(picture: NDArray[np.uint8], width: int) -> NDArray[np.uint8]:
    """The picture `width` pixels wide, averaged in linear light."""
    height = max(1, round(picture.shape[0] * width / picture.shape[1]))
    linear = resample(sRGB_to_linear_sRGB(picture / 255.0).astype(np.float32), width, height)
    return np.rint(255 * linear_sRGB_to_sRGB(linear)).astype(np.uint8)


def _without_loss(picture: NDArray[np.uint8]) -> Raster:
    """As a PNG packs it, with a palette where 256 colours do."""
    height, width = picture.shape[:2]
    codes = picture.astype(np.uint32) @ np.array([65536, 256, 1], dtype=np.uint32)
    if len(np.unique(codes.ravel()[:: max(1, codes.size // _SAMPLES)])) <= 256:
        colors, indices = np.unique(codes, return_inverse=True)
        if len(colors) <= 256:
            palette = np.stack((colors >> 16, colors >> 8 & 255, colors & 255), axis=-1).astype(np.uint8).tobytes()
            return Raster(width, height, _packed(indices.reshape(height, width).astype(np.uint8)), False, palette)
    return Raster(width, height, _packed(picture), False)


def _quick_size(picture: NDArray[np.uint8]) -> float:
    """About the bytes that a picture takes without loss, judged by a part of its rows."""
    rows = np.arange(picture.shape[0]) % (4 * _BAND) < _BAND
    return len(_packed(picture[rows], level=1)) * picture.shape[0] / int(rows.sum())


def _packed(rows: NDArray[np.uint8], level: int = 9) -> bytes:
    """The data of a PNG: each row after the predictor that suits it, deflated."""
    buffer = io.BytesIO()
    Image.fromarray(rows).save(buffer, format="PNG", compress_level=level)
    file, at, parts = buffer.getvalue(), 8, []
    while at < len(file):
        length, kind = int.from_bytes(file[at : at + 4], "big"), file[at + 4 : at + 8]
        if kind == b"IDAT":
            parts.append(file[at + 8 : at + 8 + length])
        at += 12 + length
    return b"".join(parts)


def _jpeg(picture: NDArray[np.uint8], blur: int) -> Raster | None:
    """The smallest JPEG that looks the same, if there is one."""
    for quality in _QUALITIES:
        buffer = io.BytesIO()
        Image.fromarray(picture).save(buffer, format="JPEG", quality=quality, subsampling=0)
        with Image.open(buffer) as image:
            differences = _differences(picture, np.asarray(image), blur)
        if differences.mean() <= _MEAN_DE00 and np.quantile(differences, 0.99) <= _TAIL_DE00:
            return Raster(picture.shape[1], picture.shape[0], buffer.getvalue(), True)
    return None


def _differences(one: NDArray[np.uint8], other: NDArray[np.uint8], blur: int) -> NDArray[np.float64]:
    """Of averages over squares of `blur` pixels at places all over two pictures, in CIEDE2000."""
    h, w = (side // blur for side in one.shape[:2])
    if h == 0 or w == 0:
        h, w, blur = *one.shape[:2], 1
    places = np.arange(h * w)
    if h * w > _SAMPLES:
        places = np.random.default_rng(0).integers(0, h * w, _SAMPLES)
    rows, columns = ((blur * k)[:, None] + np.arange(blur) for k in np.divmod(places, w))
    averages = (picture[rows[:, :, None], columns[:, None, :]].mean(axis=(1, 2)) / 255.0 for picture in (one, other))
    return dE00(*map(sRGB_to_Lab, averages))
