"""Embedded ICC profiles: device codes of a picture -> linear light of its own primaries, and their XYZ under D50.

Profiles of three curves and a matrix (sRGB, Display P3, Adobe RGB, ...) and of one gray curve are read here, in full
precision and without clipping to any other space (ICC.1:2022, sections 10.6 and 10.18); others are for LittleCMS.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import D65_XYZ, linear_sRGB_to_XYZ, sRGB_to_linear_sRGB

__all__ = ["D50_XYZ", "RGBSpace", "profile_name", "sRGB_space", "space_of_profile"]

D50_XYZ = np.array([0.9642, 1.0, 0.8249])
"""White of the profile connection space, Y = 1 (ICC.1:2022, section 7.2.16)."""

_SRGB_UNDER_D50 = np.array([[0.43607, 0.38515, 0.14307], [0.22249, 0.71687, 0.06061], [0.01392, 0.09708, 0.71410]])
"""Primaries of sRGB as profiles have them, adapted to D50 by Bradford's matrix, columns (IEC 61966-2-1, amd. 1)."""
_SAME_XYZ, _SAME_LIGHT = 2e-3, 2e-3


@dataclass(frozen=True, eq=False)
class RGBSpace:
    """What a picture's codes mean.

    Attributes
    ----------
    name : str
        For the record.
    curves : tuple of 3 (or 1, gray) (n,) float64 arrays
        Linear light 0..1 at even steps of the code 0..1.
    to_XYZ : (3, 3) float64 array
        Linear light of the three channels -> XYZ, Y = 1 for white.
    white_XYZ : (3,) float64 array
    """

    name: str
    curves: tuple[NDArray[np.floating], ...]
    to_XYZ: NDArray[np.float64]
    white_XYZ: NDArray[np.float64]

    def tables(self, top: int) -> NDArray[np.float32]:
        """Linear light of the codes 0..top, (channels, top + 1)."""
        codes = np.arange(top + 1) / top
        return np.stack([np.interp(codes, np.linspace(0, 1, len(c)), c) for c in self.curves]).astype(np.float32)


def sRGB_space(name: str = "sRGB") -> RGBSpace:
    """sRGB under D65: what a picture without a profile is taken for."""
    curve = sRGB_to_linear_sRGB(np.arange(65536) / 65535)
    return RGBSpace(name, (curve,) * 3, np.asarray(linear_sRGB_to_XYZ(np.eye(3)).T, np.float64), D65_XYZ)


def space_of_profile(profile: bytes) -> RGBSpace | None:
    """The space of a profile of curves and a matrix, or of one gray curve; None for any other.

    Raises
    ------
    ValueError
        If the profile is damaged.
    """
    try:
        tags = _tags(profile)
        space, connection = profile[16:20], profile[20:24]
        if space == b"GRAY" and b"kTRC" in tags and connection == b"XYZ ":
            return RGBSpace(profile_name(profile), (_curve(tags[b"kTRC"]),), np.diag(D50_XYZ), D50_XYZ)
        needed = (b"rTRC", b"gTRC", b"bTRC", b"rXYZ", b"gXYZ", b"bXYZ")
        if space != b"RGB " or b"A2B0" in tags or any(tag not in tags for tag in needed):
            return None
        curves = tuple(_curve(tags[tag]) for tag in needed[:3])
        to_XYZ = np.stack([_XYZ(tags[tag]) for tag in needed[3:]], axis=1)
    except (struct.error, IndexError) as error:
        raise ValueError(f"its tags are cut off ({error})") from None
    if _is_sRGB(curves, to_XYZ):
        return sRGB_space("sRGB")
    return RGBSpace(profile_name(profile), curves, to_XYZ, D50_XYZ)


def _is_sRGB(curves: tuple[NDArray[np.float64], ...], to_XYZ: NDArray[np.float64]) -> bool:
    """Whether a profile is that of sRGB: a picture must not change when it is saved with it."""
    known, codes = sRGB_space(), np.linspace(0, 1, 1024)
    sRGB = np.interp(codes, np.linspace(0, 1, len(known.curves[0])), known.curves[0])
    return bool(
        np.max(np.abs(to_XYZ - _SRGB_UNDER_D50)) < _SAME_XYZ
        and all(np.max(np.abs(np.interp(codes, np.linspace(0, 1, len(c)), c) - sRGB)) < _SAME_LIGHT for c in curves)
    )


def profile_name(profile: bytes) -> str:
    """The profile's own description, as one line."""
    data = _tags(profile).get(b"desc", b"")
    text = ""
    if data[:4] == b"desc":
        (length,) = struct.unpack_from(">I", data, 8)
        text = data[12 : 12 + length].decode("latin-1")
    elif data[:4] == b"mluc" and len(data) >= 28:
        length, offset = struct.unpack_from(">II", data, 20)
        text = data[offset : offset + length].decode("utf-16-be", "replace")
    return " ".join(text.replace("\0", " ").split()) or "ICC profile without a name"


def _tags(profile: bytes) -> dict[bytes, bytes]:
    """Data of each tag by its signature (ICC.1:2022, section 7.3)."""
    if len(profile) < 132 or profile[36:40] != b"acsp":
        raise ValueError("it is no ICC profile")
    (count,) = struct.unpack_from(">I", profile, 128)
    if count > 1000:
        raise ValueError(f"it claims to have {count} tags")
    entries = [struct.unpack_from(">4sII", profile, 132 + 12 * k) for k in range(count)]
    return {signature: profile[offset : offset + size] for signature, offset, size in entries}


def _XYZ(data: bytes) -> NDArray[np.float64]:
    if data[:4] != b"XYZ ":
        raise ValueError(f"a primary is of kind {data[:4]!r}")
    return np.array(struct.unpack_from(">3i", data, 8)) / 65536


def _curve(data: bytes) -> NDArray[np.float64]:
    """A tone curve at even steps: `curv` (a table, a gamma, or none) or `para` (a formula)."""
    x = np.arange(65536) / 65535
    if data[:4] == b"curv":
        (count,) = struct.unpack_from(">I", data, 8)
        if count == 0:
            return np.array([0.0, 1.0])
        if count == 1:
            return np.asarray(x ** (struct.unpack_from(">H", data, 12)[0] / 256), np.float64)
        return np.array(struct.unpack_from(f">{count}H", data, 12)) / 65535
    if data[:4] != b"para":
        raise ValueError(f"a tone curve is of kind {data[:4]!r}")
    (kind,) = struct.unpack_from(">H", data, 8)
    if kind > 4:
        raise ValueError(f"a tone curve has the unknown formula {kind}")
    values = np.array(struct.unpack_from(f">{(1, 3, 4, 5, 7)[kind]}i", data, 12)) / 65536
    g, a, b, c, d, e, f = np.concatenate([values, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0][len(values) - 1 :]])[:7]
    # Y = (a X + b)^g + e from a threshold on, c X + f below it; kinds 1 and 2 are c below -b / a
    if kind == 0:
        return np.asarray(x**g, np.float64)
    if kind in (1, 2):
        threshold, level = -b / a, c if kind == 2 else 0.0
        return np.clip(np.where(x >= threshold, np.maximum(a * x + b, 0) ** g + level, level), 0, 1)
    return np.clip(np.where(x >= d, np.maximum(a * x + b, 0) ** g + e, c * x + f), 0, 1)
