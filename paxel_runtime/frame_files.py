"""Frames of device codes as PNG files: one pixel of the picture is one of the projector.

Codes of 8 bits stand as they are. Codes of more bits are written with 16 bits at full scale, as players and projectors
expect of such pictures (10 bits: code * 65535 / 1023, rounded; every code comes back exactly). One channel is a gray
picture, three are red, green and blue in the projector's order of channels, two and four have the last as alpha.

PNG of 16 bits is written here because Pillow has none in colour (PNG, third edition, W3C 2023: sections 5, 9 and 11).
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError, InstallationError
from paxel_runtime.storage import read_image, write_atomically, write_image

__all__ = ["read_frame", "write_frame"]

_MOST = 65535
_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_KIND = {1: 0, 2: 4, 3: 2, 4: 6}  # PNG's colour type by the number of planes
_FILTER_UP = 2  # each byte as the difference from the one above it


def write_frame(path: Path, codes: NDArray[np.unsignedinteger], bits: int) -> None:
    """Write a frame (H, W, N) of device codes, atomically.

    Parameters
    ----------
    path : Path
        Ends in ``.png``.
    codes : (H, W, N) unsigned integer array
        0 to 2**bits - 1; N = 1 to 4.
    bits : int
        Of a code, 1 to 16.

    Raises
    ------
    InputError
        If no PNG holds such a frame, or a code has more bits.
    """
    if codes.ndim != 3 or codes.shape[2] not in _KIND:
        raise InputError(f"a frame's picture must have 1 to 4 channels, got an array of shape {codes.shape}")
    top = 2**bits - 1
    if int(codes.max()) > top:
        raise InputError(f"device codes of {bits} bits must be at most {top}, got {int(codes.max())}")
    if bits <= 8:
        picture = codes.astype(np.uint8)
        write_image(path, picture[..., 0] if picture.shape[2] == 1 else picture)
        return
    full_scale = ((codes.astype(np.uint32) * _MOST + top // 2) // top).astype(np.uint16)
    data = _encode(full_scale)
    write_atomically(path, lambda p: p.write_bytes(data))


def read_frame(path: Path, bits: int) -> NDArray[np.uint16]:
    """The device codes (H, W, N) of a frame that `write_frame` wrote.

    Raises
    ------
    InstallationError
        If the file is missing, no such picture, or has another number of bits.
    """
    if bits <= 8:
        return np.atleast_3d(read_image(path)).astype(np.uint16)
    try:
        picture = _decode(path.read_bytes())
    except FileNotFoundError:
        raise InstallationError(f"{path} is missing; see what to run next with: paxel status") from None
    except (OSError, ValueError, IndexError, KeyError, struct.error, zlib.error):
        raise InstallationError(
            f"{path} must be a picture of 16 bits a channel as Paxel writes it, because projector.bits is {bits}: "
            "make it anew with: paxel project"
        ) from None
    top = 2**bits - 1
    return ((picture.astype(np.uint32) * top + _MOST // 2) // _MOST).astype(np.uint16)


def _encode(picture: NDArray[np.uint16]) -> bytes:
    height, width, planes = picture.shape
    rows = np.ascontiguousarray(picture.astype(">u2")).view(np.uint8).reshape(height, -1)
    filtered = np.full((height, 1 + rows.shape[1]), _FILTER_UP, np.uint8)
    filtered[0, 1:] = rows[0]
    np.subtract(rows[1:], rows[:-1], out=filtered[1:, 1:])  # modulo 256
    header = struct.pack(">IIBBBBB", width, height, 16, _KIND[planes], 0, 0, 0)
    return _SIGNATURE + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in ((b"IHDR", header), (b"IDAT", zlib.compress(filtered.data, 4)), (b"IEND", b""))
    )


def _decode(data: bytes) -> NDArray[np.uint16]:
    """Inverse of `_encode`; ValueError, or an error of the formats' own, for anything else."""
    if not data.startswith(_SIGNATURE):
        raise ValueError("not a PNG")
    place, header, packed = len(_SIGNATURE), b"", b""
    while place < len(data):
        (length,) = struct.unpack_from(">I", data, place)
        name, body = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        header = body if name == b"IHDR" else header
        packed += body if name == b"IDAT" else b""
        place += 12 + length
    width, height, bits, kind, *rest = struct.unpack(">IIBBBBB", header)
    planes = {kind: planes for planes, kind in _KIND.items()}[kind]
    filtered = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(height, 1 + 2 * planes * width)
    if bits != 16 or any(rest) or not np.all(filtered[:, 0] == _FILTER_UP):
        raise ValueError("another form of PNG")
    rows = np.add.accumulate(filtered[:, 1:], axis=0, dtype=np.uint8)
    return rows.view(">u2").reshape(height, width, planes).astype(np.uint16)
