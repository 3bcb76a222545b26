"""Linear intensities of a projection image -> device codes, through the inverse response.

A device has whole codes only. Rounding to the nearest leaves steps in smooth gradients; a threshold mask of blue noise
(64 x 64, void-and-cluster, repeated; each channel has it from another place) gives the code below or above instead, so
often that the mean *light* is right, in the finest grain. Knows intensities and responses; nothing of pictures.
"""

from __future__ import annotations

from functools import cache, partial
from importlib.resources import files

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.model.response import ProjectorResponse
from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["ROUNDING", "blue_noise", "intensities_to_codes"]

ROUNDING = ("blue-noise", "nearest")
"""How intensities between two codes are met."""

_OUTSIDE_P = {"black": 0.0, "white": 1.0}
_SLACK = 1e-4
"""How far an intensity may leave [0, 1] and still be rounding: below a tenth of a code of 10 bits."""
_OFFSETS = (19, 41)
"""Rows and columns by which the mask is moved from one channel to the next: no channel's grain falls on another's."""


def intensities_to_codes(
    p: NDArray[np.float32],
    inside: NDArray[np.bool_],
    response: ProjectorResponse,
    bits: int,
    *,
    outside: str = "black",
    rounding: str = "blue-noise",
) -> NDArray[np.unsignedinteger]:
    """Device codes that show linear intensities.

    Parameters
    ----------
    p : (H, W, N) float32 array
        Linear intensities 0..1.
    inside : (H, W) bool array
        Pixels that show them.
    response : ProjectorResponse
        N curves.
    bits : int
        Bits of a device code, 1..16.
    outside : "black" | "white"
        What the other pixels show: no light, or all channels at full.
    rounding : "blue-noise" | "nearest"
        A key of `ROUNDING`: right in the mean of the light, or the nearest code at each pixel.

    Returns
    -------
    (H, W, N) uint8 (up to 8 bits) or uint16 array
        Codes 0..2**bits - 1.

    Raises
    ------
    InputError
        If shapes do not fit, a value is no choice, or p is not a number or outside 0..1 inside.
    """
    _check(p, inside, response, bits, outside, rounding)
    full = 2**bits - 1
    codes = np.full(p.shape, round(_OUTSIDE_P[outside] * full), np.uint8 if bits <= 8 else np.uint16)
    P = np.arange(full + 1) / full
    light = np.ascontiguousarray(response.P_to_x(np.repeat(P[:, None], p.shape[2], axis=1)).T)
    p, bad = np.ascontiguousarray(p, np.float32), np.zeros(len(p), np.int64)
    if rounding == "nearest":
        halves = (np.arange(full)[:, None] + np.full(p.shape[2], 0.5)) / full
        thresholds = np.ascontiguousarray(response.P_to_x(halves).T)
        code_rows = partial(_nearest_codes, p, inside, thresholds, codes, bad)
    else:
        code_rows = partial(_dithered_codes, p, inside, light, blue_noise(), *_OFFSETS, codes, bad)
    in_bands(code_rows, len(p))
    if bad.any():
        raise InputError(
            f"intensities must be numbers in 0..1 inside the pattern, got {bad.sum()} that are not: was x inverted?"
        )
    return codes


@cache
def blue_noise() -> NDArray[np.uint8]:
    """Thresholds (64, 64), each of 0..255 equally often; made by ``reports/make_blue_noise_mask.py``."""
    with (files("paxel_runtime") / "data" / "blue_noise.npy").open("rb") as file:
        mask = np.asarray(np.load(file), np.uint8)
    mask.setflags(write=False)
    return mask


def _check(
    p: NDArray[np.float32],
    inside: NDArray[np.bool_],
    response: ProjectorResponse,
    bits: int,
    outside: str,
    rounding: str,
) -> None:
    if p.ndim != 3 or inside.shape != p.shape[:2] or p.shape[2] != len(response.code):
        raise InputError(
            f"codes need intensities (H, W, {len(response.code)}) and a mask (H, W), got {p.shape} and {inside.shape}"
        )
    if not 1 <= bits <= 16:
        raise InputError(f"projector.bits must be 1..16, got {bits}")
    if outside not in _OUTSIDE_P:
        raise InputError(f"assembly.outside must be one of {', '.join(_OUTSIDE_P)}; got {outside!r}")
    if rounding not in ROUNDING:
        raise InputError(f"rounding must be one of {', '.join(ROUNDING)}; got {rounding!r}")


@njit(**CALLED)
def _first_not_below(value: float, table: NDArray[np.float64]) -> int:
    """Index of the first entry of a rising table that is >= value; its length if there is none."""
    low, high = 0, len(table)
    while low < high:
        middle = (low + high) // 2
        if table[middle] < value:
            low = middle + 1
        else:
            high = middle
    return low


@njit(**KERNEL)
def _nearest_codes(
    p: NDArray[np.float32],
    inside: NDArray[np.bool_],
    thresholds: NDArray[np.float64],
    codes: NDArray[np.unsignedinteger],
    bad: NDArray[np.int64],
    first: int,
    stop: int,
) -> None:
    """`thresholds` (N, codes - 1): light half-way, in code, between each code and the next; `bad`: counts of rows."""
    _, width, channels = p.shape
    for row in range(first, stop):
        for column in range(width):
            if not inside[row, column]:
                continue
            for j in range(channels):
                value = np.float64(p[row, column, j])
                if not (value >= -_SLACK and value <= 1.0 + _SLACK):  # also true of NaN
                    bad[row] += 1
                    continue
                codes[row, column, j] = _first_not_below(value, thresholds[j])


@njit(**KERNEL)
def _dithered_codes(
    p: NDArray[np.float32],
    inside: NDArray[np.bool_],
    light: NDArray[np.float64],
    mask: NDArray[np.uint8],
    down: int,
    right: int,
    codes: NDArray[np.unsignedinteger],
    bad: NDArray[np.int64],
    first: int,
    stop: int,
) -> None:
    """`light` (N, codes): what each code shows; `bad`: counts of rows."""
    _, width, channels = p.shape
    rows, columns = mask.shape
    for row in range(first, stop):
        for column in range(width):
            if not inside[row, column]:
                continue
            for j in range(channels):
                value = np.float64(p[row, column, j])
                if not (value >= -_SLACK and value <= 1.0 + _SLACK):  # also true of NaN
                    bad[row] += 1
                    continue
                above = min(_first_not_below(value, light[j]), light.shape[1] - 1)
                if above > 0:
                    below = light[j, above - 1]
                    share = (value - below) / (light[j, above] - below)
                    threshold = (mask[(row + j * down) % rows, (column + j * right) % columns] + 0.5) / 256.0
                    if share < threshold:
                        above -= 1
                codes[row, column, j] = above
