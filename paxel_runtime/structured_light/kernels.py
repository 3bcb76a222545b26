"""Loops over camera pixels for `structured_light`: plain arrays in and out, one pass over each capture.

They run on one thread: a capture takes a few milliseconds, and threads would triple the time to compile.

The kernels know Gray code and phases; they must not know names of frames, thresholds or errors.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL

__all__ = [
    "MANY",
    "add_gray_pair",
    "add_line",
    "fill_near",
    "gray_to_position",
    "join_lines",
]

MANY = 255
"""`doubt` of a pixel where more than one bit is in doubt."""


@nb.njit(**KERNEL)
def add_gray_pair(
    lit: NDArray[np.uint16],
    inverse: NDArray[np.uint16],
    bit: int,
    gain: float,
    read_variance: float,
    least_contrast: float,
    code: NDArray[np.uint16],
    doubt: NDArray[np.uint8],
) -> None:
    """Append one bit of Gray code to `code` (binary); bits come most significant first.

    Parameters
    ----------
    lit, inverse : (h, w) uint16 arrays
        Captures of the stripes and of their complement.
    bit : int
        Weight of the bit is ``2**bit``.
    gain, read_variance : float
        A raw value I has the noise variance ``read_variance + gain * I``.
    least_contrast : float
        Contrast-to-noise ratio below which the bit is in doubt.
    code : (h, w) uint16 array
        Position so far, changed in place.
    doubt : (h, w) uint8 array
        0, or 1 + the bit in doubt, or `MANY`; changed in place.
    """
    limit = least_contrast * least_contrast
    for row in range(code.shape[0]):
        for column in range(code.shape[1]):
            p = float(lit[row, column])
            q = float(inverse[row, column])
            contrast = p - q
            ones = np.uint16(1) if contrast > 0.0 else np.uint16(0)
            before = code[row, column]
            code[row, column] = (before << np.uint16(1)) | ((before & np.uint16(1)) ^ ones)
            if contrast * contrast < limit * (2.0 * read_variance + gain * (p + q)):
                doubt[row, column] = bit + 1 if doubt[row, column] == 0 else MANY


@nb.njit(**KERNEL)
def gray_to_position(
    code: NDArray[np.uint16], doubt: NDArray[np.uint8], bits: int, reason: NDArray[np.uint8], too_weak: int
) -> NDArray[np.float32]:
    """Coarse position (h, w) float32 in projector pixels from a code of 2-pixel bins.

    A bit in doubt is harmless at its own edge, where either value names one of the two bins beside the edge: the
    position is then the edge itself. Anywhere else the pixel gets the reason `too_weak`.
    """
    position = np.empty(code.shape, np.float32)
    for row in range(code.shape[0]):
        for column in range(code.shape[1]):
            here = int(code[row, column])
            place = 2.0 * here + 0.5
            which = int(doubt[row, column])
            if which == MANY:
                place = math.nan
            elif which > 0:
                gray = here ^ (here >> 1) ^ (1 << (which - 1))
                other = 0
                for k in range(bits - 1, -1, -1):
                    other = (other << 1) | ((other & 1) ^ ((gray >> k) & 1))
                place = 2.0 * max(here, other) - 0.5 if abs(other - here) == 1 else math.nan
            if math.isnan(place) and reason[row, column] == 0:
                reason[row, column] = too_weak
            position[row, column] = place
    return position


@nb.njit(**KERNEL)
def add_line(
    capture: NDArray[np.uint16],
    cosine: float,
    sine: float,
    saturation: int,
    wave: NDArray[np.float32],
    total: NDArray[np.float32],
    clipped: NDArray[np.bool_],
) -> None:
    """Add one shifted-lines capture to the first two harmonics of each pixel's profile over time.

    Parameters
    ----------
    capture : (h, w) uint16 array
    cosine, sine : float
        Of the phase of this shift.
    saturation : int
        Raw values from here on are saturated.
    wave : (4, h, w) float32 array
        Real and imaginary part of the first harmonic, and of the second, changed in place.
    total : (h, w) float32 array
        Sum of all lines, changed in place (its noise is the noise of the wave).
    clipped : (h, w) bool array
        Set where the capture is saturated.
    """
    for row in range(capture.shape[0]):
        for column in range(capture.shape[1]):
            value = capture[row, column]
            wave[0, row, column] += np.float32(value * cosine)
            wave[1, row, column] += np.float32(value * sine)
            wave[2, row, column] += np.float32(value * (cosine * cosine - sine * sine))
            wave[3, row, column] += np.float32(value * (2.0 * cosine * sine))
            total[row, column] += np.float32(value)
            if value >= saturation:
                clipped[row, column] = True


@nb.njit(**KERNEL)
def join_lines(
    wave: NDArray[np.float32],
    total: NDArray[np.float32],
    coarse: NDArray[np.float32],
    period: int,
    shifts: int,
    gain: float,
    read_variance: float,
    least_contrast: float,
    tolerance_px: float,
    margin_px: float,
    length: int,
    reasons: tuple[int, int, int, int],
    reason: NDArray[np.uint8],
    position: NDArray[np.float32],
    square: NDArray[np.float32],
) -> None:
    """Sub-pixel position: the phase of the lines, its period resolved by the coarse position.

    Parameters
    ----------
    wave, total : see `add_line`
    coarse : (h, w) float32 array
        Position from the Gray code or from another channel, NaN where unknown.
    period, shifts : int
        Projector pixels after which the frames repeat, and number of shifts in them.
    gain, read_variance, least_contrast : see `add_gray_pair`
        The contrast is the amplitude of the wave over the noise of one of its two parts.
    tolerance_px : float
        Largest distance between the lines' position and the coarse one.
    margin_px : float
        Pixels at the frame's rim, where the neighbouring line is missing, that do not count.
    length : int
        Width or height of the projector.
    reasons : four ints
        Reason given for: no light at all, line contrast, disagreement, outside. The first is written where `reason`
        is set already and there is no line either (only stray light made the pixel look lit), the others where it
        is still 0.
    reason : (h, w) uint8 array
        Changed in place.
    position : (h, w) float32 array
        Result; not meaningful where `reason` is not 0.
    square : (h, w) float32 array
        The position's variance by the captures' noise, half of it (the mean of both axes) added in place.
    """
    turn = period / (2.0 * math.pi)
    limit = least_contrast * least_contrast
    for row in range(total.shape[0]):
        for column in range(total.shape[1]):
            re = float(wave[0, row, column])
            im = float(wave[1, row, column])
            guess = float(coarse[row, column])
            line = turn * math.atan2(im, re)
            place = line + period * round((guess - line) / period) if not math.isnan(guess) else math.nan
            position[row, column] = place
            variance = 0.5 * (shifts * read_variance + gain * float(total[row, column]))
            power = re * re + im * im
            weak = power < limit * variance
            # the phase feels the noise across the wave only, and shot noise lies mostly along it, where the light is
            along = (re * re - im * im) * wave[2, row, column] + 2.0 * re * im * wave[3, row, column]
            across = variance - 0.5 * gain * along / max(power, 1e-9)
            square[row, column] += 0.5 * turn * turn * across / max(power, 1e-9)
            if reason[row, column] != 0:
                if weak:
                    reason[row, column] = reasons[0]
            elif weak:
                reason[row, column] = reasons[1]
            elif not abs(place - guess) <= tolerance_px:
                reason[row, column] = reasons[2]
            elif place < margin_px - 0.5 or place > length - 0.5 - margin_px:
                reason[row, column] = reasons[3]


@nb.njit(**KERNEL)
def fill_near(values: NDArray[np.float32], reach: int) -> NDArray[np.float32]:
    """Copy of `values` (h, w) with every NaN that has a known value within `reach` pixels replaced by the nearest."""
    filled = values.copy()
    h, w = values.shape
    for row in range(h):
        for column in range(w):
            if not math.isnan(values[row, column]):
                continue
            best = (reach + 1) * (reach + 1)
            for i in range(max(0, row - reach), min(h, row + reach + 1)):
                for j in range(max(0, column - reach), min(w, column + reach + 1)):
                    distance = (i - row) * (i - row) + (j - column) * (j - column)
                    if distance < best and not math.isnan(values[i, j]):
                        best = distance
                        filled[row, column] = values[i, j]
    return filled
