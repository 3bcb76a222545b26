"""Loops over camera pixels for `gray_sequence`: hard bits, and the slopes of soft ones.

The kernels know Gray code whose bins are single projector pixels; they must not know names of frames, thresholds or
errors. One thread, as in ``kernels.py``.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray

from paxel_runtime.numba_options import CALLED, KERNEL

__all__ = ["add_bit", "amplitude_terms", "median_near", "place_terms", "settle"]


@nb.njit(**KERNEL)
def add_bit(
    lit: NDArray[np.uint16],
    inverse: NDArray[np.uint16],
    bit: int,
    gain: float,
    read_variance: float,
    least_contrast: float,
    likely_contrast: float,
    code: NDArray[np.uint16],
    weak: NDArray[np.uint16],
    faint: NDArray[np.bool_],
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
    least_contrast, likely_contrast : float
        Contrast-to-noise ratio below which the bit is weak, or faint.
    code : (h, w) uint16 array
        Position so far, changed in place.
    weak : (h, w) uint16 array
        The weak bits, each at its own weight; changed in place.
    faint : (h, w) bool array
        Set where a bit is faint.
    """
    for row in range(code.shape[0]):
        for column in range(code.shape[1]):
            p = float(lit[row, column])
            q = float(inverse[row, column])
            contrast = p - q
            one = np.uint16(1) if contrast > 0.0 else np.uint16(0)
            before = code[row, column]
            code[row, column] = (before << np.uint16(1)) | ((before & np.uint16(1)) ^ one)
            ratio = contrast * contrast / (2.0 * read_variance + gain * (p + q))
            if ratio < least_contrast * least_contrast:
                weak[row, column] |= np.uint16(1 << bit)
            if ratio < likely_contrast * likely_contrast:
                faint[row, column] = True


@nb.njit(**KERNEL)
def median_near(
    code: NDArray[np.uint16], weak: NDArray[np.uint16], fine: int, dark: NDArray[np.bool_], reach: int
) -> NDArray[np.float32]:
    """Median of the codes within `reach` pixels along both axes, (h, w) float32; NaN where fewer than a fifth count.

    The codes of pixels that are lit count, and whose bits are sure but for the `fine` lowest ones. On a sheet the
    median of what lies around a pixel is its own place, and a wrong bit among them does not matter.
    """
    h, w = code.shape
    result = np.empty(code.shape, np.float32)
    around = np.empty((2 * reach + 1) ** 2, np.int64)
    least = (around.size + 4) // 5
    for row in range(h):
        for column in range(w):
            n = 0
            for i in range(max(0, row - reach), min(h, row + reach + 1)):
                for j in range(max(0, column - reach), min(w, column + reach + 1)):
                    if dark[i, j] or (weak[i, j] >> fine) != 0:
                        continue
                    value = np.int64(code[i, j])
                    k = n
                    while k > 0 and around[k - 1] > value:
                        around[k] = around[k - 1]
                        k -= 1
                    around[k] = value
                    n += 1
            result[row, column] = 0.5 * (around[(n - 1) // 2] + around[n // 2]) if n >= least else math.nan
    return result


@nb.njit(**KERNEL)
def amplitude_terms(
    place: NDArray[np.float32],
    light: NDArray[np.float32],
    contrast: NDArray[np.int16],
    variance: NDArray[np.float32],
    table: NDArray[np.float32],
    steps: int,
    pad: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Sums over the fine bits of ``m L (p - q) / variance`` and of ``(m L)^2 / variance``, each (h, w) float32.

    Smoothed over the neighbourhood and divided, they give the share s of the light L that fine stripes still part:
    ``p - q = s L m(place)``. Glare takes from it; ink does not, since it is in L.

    Parameters
    ----------
    place : (h, w) float32 array
        Projector column or row, NaN where unknown (the sums are 0 there).
    light : (h, w) float32 array
        Of each pixel, in the unit of the contrast.
    contrast : (bits, h, w) int16 array
        Captures minus their inverse.
    variance : (h, w) float32 array
        Of one contrast.
    table : (bits, n) float32 array
        Contrast of each bit, -1..1, at places ``i / steps - pad``.
    """
    product = np.zeros(place.shape, np.float32)
    square = np.zeros(place.shape, np.float32)
    last = table.shape[1] - 1
    for row in range(place.shape[0]):
        for column in range(place.shape[1]):
            x = float(place[row, column])
            if math.isnan(x):
                continue
            i = min(max(int((x + pad) * steps + 0.5), 0), last)
            a = 0.0
            b = 0.0
            for k in range(table.shape[0]):
                m = float(table[k, i])
                a += m * contrast[k, row, column]
                b += m * m
            lit = float(light[row, column])
            product[row, column] = a * lit / variance[row, column]
            square[row, column] = b * lit * lit / variance[row, column]
    return product, square


@nb.njit(**KERNEL)
def place_terms(
    place: NDArray[np.float32],
    amplitude: NDArray[np.float32],
    contrast: NDArray[np.int16],
    variance: NDArray[np.float32],
    table: NDArray[np.float32],
    steps: int,
    pad: int,
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """One step of Gauss-Newton for the place, before it is smoothed: score, information and misfit, (h, w) float32.

    ``score = sum a m' (p - q - a m) / variance`` and ``information = sum (a m')^2 / variance`` over the fine bits; the
    misfit is the mean of ``(p - q - a m)^2 / variance`` over them. Parameters are those of `amplitude_terms`.
    """
    score = np.zeros(place.shape, np.float32)
    information = np.zeros(place.shape, np.float32)
    misfit = np.zeros(place.shape, np.float32)
    bits, last = table.shape[0], table.shape[1] - 2
    for row in range(place.shape[0]):
        for column in range(place.shape[1]):
            x = float(place[row, column])
            if math.isnan(x):
                continue
            i = min(max(int((x + pad) * steps + 0.5), 1), last)
            amp = float(amplitude[row, column])
            s = 0.0
            f = 0.0
            c = 0.0
            for k in range(bits):
                slope = 0.5 * steps * amp * (float(table[k, i + 1]) - float(table[k, i - 1]))
                rest = contrast[k, row, column] - amp * float(table[k, i])
                s += slope * rest
                f += slope * slope
                c += rest * rest
            score[row, column] = s / variance[row, column]
            information[row, column] = f / variance[row, column]
            misfit[row, column] = c / (bits * variance[row, column])
    return score, information, misfit


@nb.njit(**KERNEL)
def settle(
    place: NDArray[np.float32],
    sigma: NDArray[np.float32],
    misfit: NDArray[np.float32],
    code: NDArray[np.uint16],
    weak: NDArray[np.uint16],
    faint: NDArray[np.bool_],
    bits: int,
    most_sigma: float,
    most_misfit: float,
    length: int,
    reasons: tuple[int, int, int],
    reason: NDArray[np.uint8],
) -> None:
    """Hold the smooth `place` (in place) against each pixel's own bits; a reason where they do not go together.

    A pixel whose bits are sure (or weak only beside that bit's own edge) stays within its own bin of one projector
    pixel, whatever its neighbours say. Any other takes the smooth place if its neighbourhood knows it to `most_sigma`,
    its own fine bits go with it, and so do its sure ones; failing that its own code, if no bit of it is faint.

    Parameters
    ----------
    place, sigma, misfit : (h, w) float32 arrays
        Place and its standard deviation by the neighbourhood; misfit of the pixel's own fine bits.
    code, weak, faint : see `add_bit`
    bits : int
    most_sigma, most_misfit : float
    length : int
        Width or height of the projector.
    reasons : three ints
        Given for: weak bits, bits that disagree with the neighbourhood, outside the frame.
    reason : (h, w) uint8 array
        Changed where it is 0.
    """
    for row in range(place.shape[0]):
        for column in range(place.shape[1]):
            if reason[row, column] != 0:
                continue
            here = int(code[row, column])
            doubt = int(weak[row, column])
            x = float(place[row, column])
            if doubt == 0 or _beside_edge(here, doubt, bits):
                if math.isnan(x) or abs(x - here) > 1.0:
                    x = float(here)  # an edge in depth, or a speck: the neighbours are elsewhere
                place[row, column] = min(max(x, here - 0.499), here + 0.499)
                if here >= length:
                    reason[row, column] = reasons[2]
                continue
            known = not math.isnan(x) and sigma[row, column] <= most_sigma
            if known and misfit[row, column] <= most_misfit:
                near = math.floor(x + 0.5)
                if near < 0 or near >= length:
                    reason[row, column] = reasons[2]
                    continue
                # a sure bit may differ from the place's only beside that bit's own edge
                differing = (here ^ (here >> 1) ^ near ^ (near >> 1)) & ~doubt
                if differing == 0 or _beside_edge(near, differing, bits):
                    continue
            if not faint[row, column] and here < length:
                place[row, column] = here
            else:
                reason[row, column] = reasons[1] if known else reasons[0]


@nb.njit(**CALLED)
def _beside_edge(here: int, mask: int, bits: int) -> bool:
    """Whether `mask` is a single bit whose change makes Gray code `here` a neighbouring bin."""
    if mask & (mask - 1) != 0:
        return False
    gray = here ^ (here >> 1) ^ mask
    other = 0
    for k in range(bits - 1, -1, -1):
        other = (other << 1) | ((other & 1) ^ ((gray >> k) & 1))
    return abs(other - here) == 1
