"""Picture files of any common kind -> linear light of their own primaries (paper: section V-A3).

Whatever Pillow reads: PNG, JPEG, TIFF, WebP, GIF (first frame), BMP and more; colour of 16 bits by OpenCV, as Pillow
cuts it to 8. Knows files; nothing of projectors, gamuts or patterns.
"""

from __future__ import annotations

import io
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageCms, ImageOps, UnidentifiedImageError
from PIL.TiffImagePlugin import TiffImageFile

from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.pictures.profiles import D50_XYZ, RGBSpace, profile_name, space_of_profile, sRGB_space

__all__ = ["SourcePicture", "read_picture"]

ASSUMED = "sRGB, assumed: the file has no profile"

_TIFF_BITS, _ORIENTATION = 258, 274
_ROWS_AT_ONCE = 256


@dataclass(frozen=True, eq=False)
class SourcePicture:
    """A picture upright, over black, in linear light.

    Attributes
    ----------
    linear : (h, w, 3) float32 array
        Light of the space's three primaries, 0..1; transparent parts are dark.
    space : RGBSpace
    bits : int
        Bits of a code in the file.
    size : (int, int)
        Width and height of the file's picture, upright; `linear` may be smaller by a whole number.
    """

    linear: NDArray[np.float32]
    space: RGBSpace
    bits: int
    size: tuple[int, int]

    @property
    def description(self) -> str:
        """What was read, for the record: ``"4000 x 3000 of 8 bits, Display P3"``."""
        return f"{self.size[0]} x {self.size[1]} of {self.bits} bits, {self.space.name}"


@dataclass(frozen=True, eq=False)
class _File:
    """What a file holds, upright: codes (h, w, 1 or 3) and opacity."""

    codes: NDArray[np.uint8] | NDArray[np.uint16]
    alpha: NDArray[np.uint8] | NDArray[np.uint16] | None
    space: RGBSpace


def read_picture(path: str | os.PathLike[str], least_size: tuple[int, int] | None = None) -> SourcePicture:
    """Read a picture file.

    The orientation that a camera noted in EXIF is applied. Transparent parts are laid over black: no light. An embedded
    ICC profile gives the primaries and their curves, so colours beyond sRGB stay as they are; without one the file is
    taken as sRGB.

    Parameters
    ----------
    path : path
    least_size : (width, height), optional
        Where the picture is more than four times as large as this, pixels are averaged, in linear light, so that at
        least twice this stays: 50 megapixels then need the memory of their codes and little more.

    Raises
    ------
    InputError
        If the file is missing, no picture, damaged, or of a kind that has no defined white (float, 32-bit integer).
    """
    path = Path(path)
    file = _read_file(path)
    height, width = file.codes.shape[:2]
    factor = 1
    if least_size is not None:
        factor = max(1, int(min(width / (2 * least_size[0]), height / (2 * least_size[1]))))
    top = int(np.iinfo(file.codes.dtype).max)
    return SourcePicture(_linear(file, factor), file.space, 8 if top == 255 else 16, (width, height))


def _linear(file: _File, factor: int) -> NDArray[np.float32]:
    """Codes to light, tile by tile, each block of factor x factor pixels averaged."""
    tables = file.space.tables(int(np.iinfo(file.codes.dtype).max))
    height, width = (length // factor for length in file.codes.shape[:2])
    linear = np.empty((height, width, 3), np.float32)
    for first in range(0, height, _ROWS_AT_ONCE):
        rows = slice(first * factor, min(first + _ROWS_AT_ONCE, height) * factor)
        tile = np.empty((rows.stop - rows.start, width * factor, 3), np.float32)
        for c in range(3):
            codes = file.codes[rows, : width * factor, min(c, file.codes.shape[2] - 1)]
            tile[..., c] = tables[min(c, len(tables) - 1)][codes]
        if file.alpha is not None:
            alpha = file.alpha[rows, : width * factor, None]
            tile *= alpha.astype(np.float32) / np.iinfo(alpha.dtype).max
        if factor > 1:
            tile = tile.reshape(len(tile) // factor, factor, width, factor, 3).mean(axis=(1, 3), dtype=np.float32)
        linear[first : first + len(tile)] = tile
    return linear


def _read_file(path: Path) -> _File:
    try:
        with Image.open(path) as file:
            if _has_colour_of_16_bits(path, file):
                return _read_16_bits(path, file)
            profile = file.info.get("icc_profile")
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
    except InputError:
        raise
    except (OSError, SyntaxError, ValueError) as error:  # what Pillow raises on damaged files
        raise InputError(f"{path} is damaged ({error}); save it anew as PNG, JPEG or TIFF") from None
    if image.mode in ("I", "F"):
        raise InputError(f"{path} has pixels of kind {image.mode!r} without a defined white; save it as 8 or 16 bits")
    if image.mode.startswith("I;16"):
        space = _space(profile, path, gray=True)
        if space is None:
            raise _no_such_profile(path, "a gray picture of 16 bits needs a gray profile of one curve")
        return _File(np.asarray(image).astype(np.uint16)[..., None], None, space)
    alpha = np.asarray(image.convert("RGBA").getchannel("A")) if image.has_transparency_data else None
    # A profile is about the colours alone, without palette and alpha.
    if image.mode in ("1", "LA"):
        image = image.convert("L")
    elif image.mode in ("P", "PA", "RGBA", "RGBX"):
        image = image.convert("RGB")
    if not profile and image.mode not in ("L", "RGB"):
        image = image.convert("RGB")
    space = _space(profile, path, gray=image.mode == "L") if image.mode in ("L", "RGB") else None
    if space is None:
        return _by_littlecms(image, profile or b"", alpha, path)
    return _File(np.atleast_3d(np.asarray(image)), alpha, space)


def _space(profile: bytes | None, path: Path, gray: bool) -> RGBSpace | None:
    """The space of a picture; None where only LittleCMS knows it."""
    if not profile:
        return sRGB_space(ASSUMED)
    try:
        space = space_of_profile(profile)
    except ValueError as error:
        raise _no_such_profile(path, str(error)) from None
    if space is not None and (len(space.curves) == 1) != gray:
        if gray:
            return RGBSpace(space.name, space.curves[:1], np.diag(D50_XYZ), D50_XYZ)
        raise _no_such_profile(path, "a gray profile in a picture of three channels")
    return space


def _no_such_profile(path: Path, why: str) -> InputError:
    return InputError(f"{path} has an ICC profile that does not fit it ({why}); save it as sRGB, or without a profile")


def _by_littlecms(image: Image.Image, profile: bytes, alpha: NDArray[np.uint8] | None, path: Path) -> _File:
    """Colours of any other profile (CMYK, tables), by LittleCMS as CIELAB of 8 bits; taken as light of X, Y and Z."""
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        converted = ImageCms.profileToProfile(
            image,
            source,
            ImageCms.createProfile("LAB"),
            renderingIntent=ImageCms.Intent.RELATIVE_COLORIMETRIC,
            outputMode="LAB",
            flags=ImageCms.Flags.BLACKPOINTCOMPENSATION,
        )
    except (ImageCms.PyCMSError, OSError) as error:
        raise _no_such_profile(path, str(error)) from None
    assert converted is not None  # only with inPlace=True
    encoded = np.asarray(converted)
    shares = np.empty(encoded.shape, np.uint16)
    for first in range(0, len(encoded), _ROWS_AT_ONCE):
        tile = encoded[first : first + _ROWS_AT_ONCE].astype(np.int16)
        Lab = np.stack([tile[..., 0] / 2.55, *((tile[..., c] + 128) % 256 - 128.0 for c in (1, 2))], axis=-1)
        shares[first : first + len(tile)] = np.rint(65535 * np.clip(Lab_to_XYZ(Lab, np.ones(3)), 0, 1))
    space = RGBSpace(profile_name(profile), (np.array([0.0, 1.0]),) * 3, np.diag(D50_XYZ), D50_XYZ)
    return _File(shares, alpha, space)


def _has_colour_of_16_bits(path: Path, file: Image.Image) -> bool:
    if file.format == "PNG":
        with path.open("rb") as png:
            bits, kind = png.read(26)[24:]  # of the header
        return bits == 16 and kind != 0
    if isinstance(file, TiffImageFile):
        bits = file.tag_v2.get(_TIFF_BITS, ())
        return len(bits) > 1 and set(bits) == {16}
    return False


def _read_16_bits(path: Path, file: Image.Image) -> _File:
    import cv2  # heavy

    decoded = cv2.imdecode(np.fromfile(path, np.uint8), cv2.IMREAD_UNCHANGED)
    if decoded is None or decoded.dtype != np.uint16:
        raise InputError(f"{path} is damaged, or a kind of 16 bits that cannot be read; save it anew as PNG or TIFF")
    # OpenCV turns TIFF upright itself, and PNG not with this flag.
    orientation = 1 if isinstance(file, TiffImageFile) else file.getexif().get(_ORIENTATION, 1)
    decoded = _upright(np.atleast_3d(decoded), orientation)
    alpha = np.ascontiguousarray(decoded[..., -1]) if decoded.shape[2] in (2, 4) else None
    codes = decoded[..., 2::-1] if decoded.shape[2] > 2 else decoded[..., :1]  # OpenCV counts blue, green, red
    profile = file.info.get("icc_profile")
    if profile and profile[16:20] == b"GRAY":
        codes = codes[..., :1]
    space = _space(profile, path, gray=codes.shape[2] == 1)
    if space is None:
        raise _no_such_profile(path, "of 16 bits only profiles of three curves and a matrix can be read")
    return _File(np.ascontiguousarray(codes), alpha, space)


def _upright(picture: NDArray[np.uint16], orientation: int) -> NDArray[np.uint16]:
    """As EXIF's orientation asks: 2, 4, 5 and 7 are mirrored."""
    if orientation in (5, 6, 7, 8):
        picture = picture.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        picture = picture[::-1]
    if orientation in (2, 3, 6, 7):
        picture = picture[:, ::-1]
    return picture
