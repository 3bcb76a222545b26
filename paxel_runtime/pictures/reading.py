"""Source pictures: any common file -> CIELAB on the projector's raster (paper: section V-A3).

The Lab of a picture is taken as numbers and used as the target under the installation's own white. Knows files and
rasters; nothing of projectors, gamuts or patterns.
"""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageOps, UnidentifiedImageError

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import D65_XYZ, XYZ_to_Lab, linear_sRGB_to_XYZ, sRGB_to_linear_sRGB

__all__ = ["PLACEMENTS", "load_picture", "place", "resample"]

PLACEMENTS = ("fill", "fit", "stretch")
"""How a picture of another shape meets the frame: cropped to fill it, whole between black bars, or distorted."""

Box = tuple[float, float, float, float]
"""(left, top, right, bottom), in pixels from the corner."""

_ROWS_AT_ONCE = 256


def load_picture(path: str | os.PathLike[str], width: int, height: int, placement: str = "fill") -> NDArray[np.float32]:
    """Read a picture file as CIELAB on the projector's raster.

    Whatever Pillow reads: PNG, JPEG, TIFF, WebP, GIF (first frame), BMP and more; gray at 8 or 16 bits, colour at 8
    bits a channel (Pillow reads 16-bit colour as 8 bits, finer than any sub-gamut needs). The orientation that a
    camera noted in EXIF is applied. Transparent parts are laid over black: no light. An embedded ICC profile is
    converted to sRGB (relative colorimetric, by LittleCMS; colours beyond sRGB are clipped to it); without one the
    file is taken as sRGB. Resampled with antialiasing in linear light.

    Parameters
    ----------
    path : path
    width, height : int
        The projector's raster, pixels.
    placement : "fill" | "fit" | "stretch"
        Crop to fill the frame (about the centre), fit between black bars, or stretch.

    Returns
    -------
    (height, width, 3) float32 array
        CIELAB under D65.

    Raises
    ------
    InputError
        If the file is missing, no picture, damaged, or of a kind that has no defined white (float, 32-bit integer).
    """
    path = Path(path)
    linear = _read_linear_sRGB(path)
    source, frame = place((linear.shape[1], linear.shape[0]), (width, height), placement)
    placed = resample(linear, frame[2] - frame[0], frame[3] - frame[1], source)
    Lab = np.zeros((height, width, 3), np.float32)
    for row in range(0, len(placed), _ROWS_AT_ONCE):
        tile = placed[row : row + _ROWS_AT_ONCE]
        top = frame[1] + row
        Lab[top : top + len(tile), frame[0] : frame[2]] = XYZ_to_Lab(linear_sRGB_to_XYZ(tile), D65_XYZ)
    return Lab


def place(
    picture_size: tuple[int, int], frame_size: tuple[int, int], placement: str
) -> tuple[Box, tuple[int, int, int, int]]:
    """Which part of a picture goes where in a frame.

    Parameters
    ----------
    picture_size, frame_size : (width, height)
    placement : "fill" | "fit" | "stretch"

    Returns
    -------
    source : (left, top, right, bottom) floats
        The part of the picture that is used.
    frame : (left, top, right, bottom) ints
        Where it lies in the frame; the rest of the frame stays black.
    """
    if placement not in PLACEMENTS:
        raise InputError(f"mapping.placement must be one of {', '.join(PLACEMENTS)}; got {placement!r}")
    (w, h), (W, H) = picture_size, frame_size
    if placement == "fill":
        used_w, used_h = min(w, h * W / H), min(h, w * H / W)
        left, top = (w - used_w) / 2, (h - used_h) / 2
        return (left, top, left + used_w, top + used_h), (0, 0, W, H)
    if placement == "fit":
        used_W, used_H = max(1, min(W, round(w * H / h))), max(1, min(H, round(h * W / w)))
        x, y = (W - used_W) // 2, (H - used_H) // 2
        return (0.0, 0.0, float(w), float(h)), (x, y, x + used_W, y + used_H)
    return (0.0, 0.0, float(w), float(h)), (0, 0, W, H)


def resample(linear: NDArray[np.float32], width: int, height: int, box: Box | None = None) -> NDArray[np.float32]:
    """Resample linear values (h, w, C), 0..1, to (height, width, C), antialiased, clipped to 0..1 again.

    Bicubic (a = -0.5, widened when shrinking): of Pillow's filters the sharp one that rings least, and in linear
    light ringing shows beside every dark edge.
    """
    bands = [
        np.asarray(
            Image.fromarray(np.ascontiguousarray(linear[..., c])).resize(
                (width, height), Image.Resampling.BICUBIC, box=box
            )
        )
        for c in range(linear.shape[2])
    ]
    return np.clip(np.stack(bands, axis=-1), 0.0, 1.0)


def _read_linear_sRGB(path: Path) -> NDArray[np.float32]:
    """The whole picture upright in linear sRGB over black, (h, w, 3)."""
    try:
        with Image.open(path) as file:
            image = ImageOps.exif_transpose(file)
            image.load()
    except FileNotFoundError:
        raise InputError(f"there is no picture {path}") from None
    except IsADirectoryError:
        raise InputError(f"{path} is a folder; name one picture file") from None
    except UnidentifiedImageError:
        raise InputError(f"{path} is no picture that can be read; save it as PNG, JPEG or TIFF") from None
    except Image.DecompressionBombError as error:
        raise InputError(f"{path} is too large a picture ({error}); scale it down") from None
    except (OSError, SyntaxError, ValueError) as error:  # what Pillow raises on damaged files
        raise InputError(f"{path} is damaged ({error}); save it anew as PNG, JPEG or TIFF") from None
    if image.mode.startswith("I;16"):
        if image.info.get("icc_profile"):
            image = _to_8_bits(image)  # LittleCMS behind Pillow converts 8 bits only
        else:
            return _encoded_to_linear(np.asarray(image)[..., None].repeat(3, axis=2), 65535)
    if image.mode in ("I", "F"):
        raise InputError(f"{path} has pixels of kind {image.mode!r} without a defined white; save it as 8 or 16 bits")
    alpha = image.convert("RGBA").getchannel("A") if image.has_transparency_data else None
    linear = _encoded_to_linear(np.asarray(_to_sRGB(image, path)), 255)
    if alpha is not None:
        linear *= np.asarray(alpha, np.float32)[..., None] / 255
    return linear


def _to_8_bits(image: Image.Image) -> Image.Image:
    gray = Image.fromarray(np.rint(np.asarray(image) / 257).astype(np.uint8))
    gray.info = dict(image.info)
    return gray


def _to_sRGB(image: Image.Image, path: Path) -> Image.Image:
    """The picture as 8-bit sRGB, through its embedded ICC profile where it has one."""
    profile = image.info.get("icc_profile")
    # A profile is about the colours alone, without palette and alpha.
    if image.mode in ("1", "LA"):
        image = image.convert("L")
    elif image.mode in ("P", "PA", "RGBA", "RGBX"):
        image = image.convert("RGB")
    if not profile:
        return image.convert("RGB")
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        converted = ImageCms.profileToProfile(
            image,
            source,
            ImageCms.createProfile("sRGB"),
            renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
            outputMode="RGB",
            flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
    except (ImageCms.PyCMSError, OSError) as error:
        raise InputError(
            f"{path} has an ICC profile that does not fit it ({error}); save it as sRGB, or without a profile"
        ) from None
    assert converted is not None  # only with inPlace=True
    return converted


def _encoded_to_linear(encoded: NDArray[np.unsignedinteger], full: int) -> NDArray[np.float32]:
    """Linear values 0..1 of sRGB codes 0..`full`, by table."""
    return sRGB_to_linear_sRGB(np.arange(full + 1) / full).astype(np.float32)[encoded]
