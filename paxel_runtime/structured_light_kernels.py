"""Loops over camera pixels for `structured_light`: plain arrays in and out, one pass over each capture.

The kernels know Gray code and phases; they must not know names of frames, thresholds or errors.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray

__all__ = [
    "MANY",
    "add_gray_pair",
    "add_line",
    "fill_near",
    "gray_to_position",
    "join_lines",
    "ripple_blocks",
    "subtract_ripple",
]

MANY = 255
"""`doubt` of a pixel where more than one bit is in doubt."""


@nb.njit(cache=True, parallel=True)
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
    for row in nb.prange(code.shape[0]):
        for column in range(code.shape[1]):
            p = float(lit[row, column])
            q = float(inverse[row, column])
            contrast = p - q
            ones = np.uint16(1) if contrast > 0.0 else np.uint16(0)
            before = code[row, column]
            code[row, column] = (before << np.uint16(1)) | ((before & np.uint16(1)) ^ ones)
            if contrast * contrast < limit * (2.0 * read_variance + gain * (p + q)):
                doubt[row, column] = bit + 1 if doubt[row, column] == 0 else MANY


@nb.njit(cache=True, parallel=True)
def gray_to_position(
    code: NDArray[np.uint16], doubt: NDArray[np.uint8], bits: int, reason: NDArray[np.uint8], too_weak: int
) -> NDArray[np.float32]:
    """Coarse position (h, w) float32 in projector pixels from a code of 2-pixel bins.

    A bit in doubt is harmless at its own edge, where either value names one of the two bins beside the edge: the
    position is then the edge itself. Anywhere else the pixel gets the reason `too_weak`.
    """
    position = np.empty(code.shape, np.float32)
    for row in nb.prange(code.shape[0]):
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


@nb.njit(cache=True, parallel=True)
def add_line(
    capture: NDArray[np.uint16],
    cosine: float,
    sine: float,
    saturation: int,
    wave: NDArray[np.float32],
    total: NDArray[np.float32],
    clipped: NDArray[np.bool_],
) -> None:
    """Add one shifted-lines capture to the first harmonic of each pixel's profile over time.

    Parameters
    ----------
    capture : (h, w) uint16 array
    cosine, sine : float
        Of the phase of this shift.
    saturation : int
        Raw values from here on are saturated.
    wave : (2, h, w) float32 array
        Real and imaginary part of the harmonic, changed in place.
    total : (h, w) float32 array
        Sum of all lines, changed in place (its noise is the noise of the wave).
    clipped : (h, w) bool array
        Set where the capture is saturated.
    """
    for row in nb.prange(capture.shape[0]):
        for column in range(capture.shape[1]):
            value = capture[row, column]
            wave[0, row, column] += np.float32(value * cosine)
            wave[1, row, column] += np.float32(value * sine)
            total[row, column] += np.float32(value)
            if value >= saturation:
                clipped[row, column] = True


@nb.njit(cache=True, parallel=True)
def join_lines(
    wave: NDArray[np.float32],
    total: NDArray[np.float32],
    coarse: NDArray[np.float32],
    period: int,
    gain: float,
    read_variance: float,
    least_contrast: float,
    tolerance_px: float,
    margin_px: float,
    length: int,
    reasons: tuple[int, int, int, int],
    reason: NDArray[np.uint8],
    position: NDArray[np.float32],
) -> None:
    """Sub-pixel position: the phase of the lines, its period resolved by the coarse position.

    Parameters
    ----------
    wave, total : see `add_line`
    coarse : (h, w) float32 array
        Position from the Gray code or from another channel, NaN where unknown.
    period : int
        Projector pixels between two lines = number of shifts.
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
    """
    turn = period / (2.0 * math.pi)
    limit = least_contrast * least_contrast
    for row in nb.prange(total.shape[0]):
        for column in range(total.shape[1]):
            re = float(wave[0, row, column])
            im = float(wave[1, row, column])
            guess = float(coarse[row, column])
            line = turn * math.atan2(im, re)
            place = line + period * round((guess - line) / period) if not math.isnan(guess) else math.nan
            position[row, column] = place
            variance = 0.5 * (period * read_variance + gain * float(total[row, column]))
            weak = re * re + im * im < limit * variance
            if reason[row, column] != 0:
                if weak:
                    reason[row, column] = reasons[0]
            elif weak:
                reason[row, column] = reasons[1]
            elif not abs(place - guess) <= tolerance_px:
                reason[row, column] = reasons[2]
            elif place < margin_px - 0.5 or place > length - 0.5 - margin_px:
                reason[row, column] = reasons[3]


@nb.njit(cache=True, parallel=True)
def fill_near(values: NDArray[np.float32], reach: int) -> NDArray[np.float32]:
    """Copy of `values` (h, w) with every NaN that has a known value within `reach` pixels replaced by the nearest."""
    filled = values.copy()
    h, w = values.shape
    for row in nb.prange(h):
        for column in range(w):
            if not math.isnan(values[row, column]):
                continue
            best = (reach + 1) * (reach + 1)
            here = np.int64(row)
            for i in range(max(0, here - reach), min(h, here + reach + 1)):
                for j in range(max(0, column - reach), min(w, column + reach + 1)):
                    distance = (i - here) * (i - here) + (j - column) * (j - column)
                    if distance < best and not math.isnan(values[i, j]):
                        best = distance
                        filled[row, column] = values[i, j]
    return filled


@nb.njit(cache=True, parallel=True)
def ripple_normals(
    position: NDArray[np.float32],
    signal: NDArray[np.float32],
    reason: NDArray[np.uint8],
    size: int,
    solution: NDArray[np.float64],
    cutoff_px: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normal equations, in each block of the picture, of the positions as a quadratic of the place plus a ripple.

    The eight terms are 1, x, y, x^2, x y, y^2 (x, y = -1..1 in the block), cos(2 pi u) and sin(2 pi u) at the measured
    position u. Weights are signal^2 times Tukey's about `solution`.

    Parameters
    ----------
    position, signal, reason : (h, w) arrays
    size : int
        Pixels along a block; what is left over at the right and below has no block.
    solution : (blocks, 8) float64 array
        Coefficients of the round before; blocks run along the rows.
    cutoff_px : (blocks,) float64 array
        Residual from which on a pixel has no weight; inf: all count.

    Returns
    -------
    normal : (blocks, 9, 9) float64 array
        Weighted products of the eight terms and, last, the position less that of the block's first pixel.
    misfit : (blocks, 3) float64 array
        Sum of weights, weighted sum of squared residuals, number of pixels.
    """
    columns = position.shape[1] // size
    normal = np.zeros((solution.shape[0], 9, 9))
    misfit = np.zeros((solution.shape[0], 3))
    for index in nb.prange(solution.shape[0]):
        block = np.int64(index)
        top, left = (block // columns) * size, (block % columns) * size
        terms = np.empty(9)
        origin = math.nan
        for i in range(top, top + size):
            for j in range(left, left + size):
                if reason[i, j] != 0:
                    continue
                place = float(position[i, j])
                if math.isnan(origin):
                    origin = math.floor(place)
                x = 2.0 * (j - left) / size - 1.0
                y = 2.0 * (i - top) / size - 1.0
                angle = 2.0 * math.pi * (place - origin)
                terms[0], terms[1], terms[2], terms[3] = 1.0, x, y, x * x
                terms[4], terms[5], terms[6], terms[7] = x * y, y * y, math.cos(angle), math.sin(angle)
                terms[8] = place - origin
                residual = terms[8]
                for p in range(8):
                    residual -= solution[block, p] * terms[p]
                part = (residual / cutoff_px[block]) ** 2
                if part >= 1.0:
                    continue
                weight = (1.0 - part) * (1.0 - part) * float(signal[i, j]) ** 2
                misfit[block, 0] += weight
                misfit[block, 1] += weight * residual * residual
                misfit[block, 2] += 1.0
                for p in range(9):
                    for q in range(p + 1):
                        normal[block, p, q] += weight * terms[p] * terms[q]
        for p in range(9):
            for q in range(p):
                normal[block, q, p] = normal[block, p, q]
    return normal, misfit


@nb.njit(cache=True, parallel=True)
def subtract_ripple(
    position: NDArray[np.float32], row_terms: NDArray[np.float64], column_terms: NDArray[np.float64]
) -> float:
    """Subtract ``a cos(2 pi u) + b sin(2 pi u)`` from positions in place; returns the rms of (a, b) over the picture.

    Parameters
    ----------
    position : (h, w) float32 array
        u with its ripple.
    row_terms : (2, h, m) float64 array
        For a and b: polynomial along the row's own place, one coefficient for each term of the columns.
    column_terms : (w, m) float64 array
    """
    h, w = position.shape
    squares = 0.0
    for row in nb.prange(h):
        for column in range(w):
            a = 0.0
            b = 0.0
            for k in range(column_terms.shape[1]):
                a += row_terms[0, row, k] * column_terms[column, k]
                b += row_terms[1, row, k] * column_terms[column, k]
            squares += a * a + b * b
            seen = float(position[row, column])
            place = seen
            for _ in range(2):  # the ripple belongs to the true place: fixed point, error amplitude^3
                angle = 2.0 * math.pi * (place - math.floor(place)) if not math.isnan(place) else 0.0
                place = seen - a * math.cos(angle) - b * math.sin(angle)
            position[row, column] = place
    return math.sqrt(squares / (h * w))
