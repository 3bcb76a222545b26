"""Photographs from anywhere: the files that cameras and tethering programs leave, read as captures.

Knows picture files; must not know what they show or what they are for.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import tifffile
from numpy.typing import NDArray
from PIL import Image, UnidentifiedImageError

from paxel_runtime.errors import DeviceError

__all__ = ["PHOTOGRAPH_ENDINGS", "list_photographs", "read_photograph", "to_one_plane"]

PHOTOGRAPH_ENDINGS = (".tif", ".tiff", ".png", ".jpg", ".jpeg", ".bmp", ".webp")
"""Endings of files that count as photographs, in lower case."""


def list_photographs(folder: Path) -> list[Path]:
    """Photographs of a folder by name, numbers by value: ``IMG_9`` before ``IMG_10``. Hidden files do not count."""
    found = [
        path
        for path in folder.iterdir()
        if path.suffix.lower() in PHOTOGRAPH_ENDINGS and not path.name.startswith(".") and path.is_file()
    ]
    return sorted(found, key=lambda path: _natural(path.name))


def _natural(name: str) -> list[tuple[int, int, str]]:
    parts = re.findall(r"\d+|\D+", name.lower())
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]


def read_photograph(path: Path) -> NDArray[np.uint16]:
    """Read a photograph as it was saved, (h, w) or (h, w, 3) uint16, 65535 = saturated.

    TIFF with 8 or 16 bits; PNG, JPEG, BMP and WebP (colour with 8 bits a channel, gray with 8 or 16). The picture is
    not turned by a note in it: all photographs of a session come from the same camera. A JPEG's values are undone from
    sRGB's curve, any other file's are taken as linear.

    Raises
    ------
    DeviceError
        If the file is missing, cut short, or no picture of such a kind.
    """
    try:
        picture = _read_tiff(path) if path.suffix.lower() in (".tif", ".tiff") else _read_other(path)
    except FileNotFoundError:
        raise DeviceError(f"{path} is missing; take it again") from None
    except UnidentifiedImageError:
        raise DeviceError(f"{path} is no picture that can be read; save it as TIFF, PNG or JPEG") from None
    except (OSError, SyntaxError, ValueError, IndexError, tifffile.TiffFileError) as error:
        raise DeviceError(f"{path} is cut short or damaged ({error}); copy it or take it again") from None
    if picture.ndim == 3 and picture.shape[2] in (2, 4):
        picture = picture[..., :-1]  # without its opacity
    if picture.ndim == 3 and picture.shape[2] == 1:
        picture = picture[..., 0]
    if picture.ndim not in (2, 3) or (picture.ndim == 3 and picture.shape[2] != 3):
        raise DeviceError(f"{path} must hold one picture of one or three planes, got shape {picture.shape}")
    if picture.dtype == np.uint8:
        table = np.arange(256) / 255
        if path.suffix.lower() in (".jpg", ".jpeg"):
            table = np.where(table <= 0.04045, table / 12.92, ((table + 0.055) / 1.055) ** 2.4)
        return np.rint(table * 65535).astype(np.uint16)[picture]
    if picture.dtype != np.uint16:
        raise DeviceError(f"{path} must have 8 or 16 bits a value, got {picture.dtype}; save it as a 16-bit TIFF")
    return picture.astype(np.uint16, copy=False)


def _read_tiff(path: Path) -> NDArray[np.generic]:
    picture = tifffile.imread(path)
    return np.moveaxis(picture, 0, -1) if picture.ndim == 3 and picture.shape[0] in (3, 4) else picture


def _read_other(path: Path) -> NDArray[np.generic]:
    with Image.open(path) as image:
        image.load()
        if image.mode.startswith("I"):
            return np.asarray(image).astype(np.uint16)
        return np.asarray(image if image.mode in ("L", "RGB", "RGBA", "LA") else image.convert("RGB"))


def to_one_plane(picture: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """A photograph as one plane: the mean of three."""
    if picture.ndim == 2:
        return picture
    return (picture.sum(axis=2, dtype=np.uint32) // 3).astype(np.uint16)
