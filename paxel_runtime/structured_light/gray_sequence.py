"""Gray code alone, as other tools show it -> sub-pixel projector coordinates of every camera pixel.

Complementary Gray code down to single projector pixels, columns then rows, then white and black (the order of
OpenCV's ``GrayCodePattern``). There are no lines to refine it, but a captured bit is not black or white: every
boundary between two projector pixels is the edge of exactly one bit, blurred over about a pixel, so that the contrasts
of the fine bits tell the place between the boundaries. One pixel alone tells it poorly on black ink; a neighbourhood,
on whose sheet the place runs smoothly, tells it well:

1. hard bits of each pixel, by contrast to noise, as a first place (a median over neighbours);
2. the blur of the edges, from how much contrast the finest bit lost;
3. Gauss-Newton on the place, with score and information summed over a Gaussian neighbourhood: the *step* is smoothed,
   not the place, so the sheet may tilt and bend;
4. each pixel's own bits have the last word: where they are sure, it stays in its own bin.

Nothing here opens a file or shows a frame.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.special import erf

from paxel_runtime.structured_light import gray_kernels
from paxel_runtime.structured_light.captures import Captures
from paxel_runtime.structured_light.checks import (
    DECODED,
    ODD_BITS,
    OUTSIDE,
    TOO_DARK,
    WEAK_BIT,
    SensorNoise,
    gray_name,
    read_noise,
    refuse_dark,
)
from paxel_runtime.structured_light.decoded import Decoded, sigma_to_confidence
from paxel_runtime.structured_light.frames import AXES, bits_to_pixel

__all__ = ["decode_gray_sequence"]

_LEAST_CONTRAST = 3.0
"""Contrast-to-noise ratio of a sure bit."""
_LIKELY_CONTRAST = 2.0
"""Of a bit that is better than none, where the neighbourhood does not know the place: wrong once in 44."""
_FINE_BITS = 4
"""Bits whose contrast is followed between their edges: periods of 4 to 32 projector pixels."""
_COARSE_FROM = 2
"""Finest bits that need not be sure for a pixel to count for the first place: wrong, they move it by 3 at most."""
_REACH = 2
"""Camera pixels around, for the median of the first place."""
_SMOOTH_PX = 2.0
"""Camera pixels: sigma of the neighbourhood over which a step is summed."""
_STEPS = 4
"""Of Gauss-Newton; the fourth changes places by a hundredth of a pixel."""
_MOST_SIGMA_PX = 1.5
"""Of one pixel: the neighbourhood, of 50 pixels' weight, then knows the place to 0.2 projector pixels."""
_UNEXPLAINED = 0.1
"""Of a contrast: what the model of blurred edges gets wrong."""
_MOST_MISFIT = 6.0
"""Of a pixel's own fine bits: mean square over variance; 4 bits exceed it by noise once in 12,000."""
_BAND = 256
"""Camera rows refined at once, so that no temporary is as large as a picture."""
_HALO = 64
"""Rows beside a band that its own rows still feel: 2 of the median, and 3 sigma for each of 10 smoothings in a row."""
_TABLE_STEPS = 16
_TABLE_PAD = 4


def decode_gray_sequence(read: Callable[[str], NDArray[np.uint16]], width: int, height: int) -> Decoded:
    """Sub-pixel projector coordinates from a sequence of complementary Gray code down to single pixels.

    Needs about 65 bytes a camera pixel, the captures at hand counted in, whatever the number of captures.

    Parameters
    ----------
    read : callable
        Gives the capture of a frame of `plan_gray_sequence` by its name: (h, w) uint16, 65535 = saturated.
    width, height : int
        Resolution of the projector.

    Returns
    -------
    Decoded
        Where a pixel's own bits are sure, its coordinates rounded are its Gray code.

    Raises
    ------
    CalibrationError
        If captures differ in size or kind, or show no light of the projector.
    """
    captures = Captures(read)
    white, black = captures("white"), captures("black")
    step = captures.stride()
    few_black = black[::step, ::step].astype(np.float64)
    few_light = white[::step, ::step] - few_black
    refuse_dark(few_light)
    first = gray_name("x", bits_to_pixel(width) - 1)
    pair = captures(first)[::step, ::step].astype(np.float64) + captures(f"{first}-inverse")[::step, ::step]
    noise = read_noise(few_light, few_black, pair - 2.0 * few_black)

    light = np.maximum(white.astype(np.float32) - black, np.float32(0))
    variance = np.float32(2.0 * noise.read_variance) + np.float32(noise.gain) * (white.astype(np.float32) + black)
    dark = light < np.float32(_LEAST_CONTRAST) * np.sqrt(variance)
    reason = np.where(dark, np.uint8(TOO_DARK), np.uint8(DECODED))
    places, square = [], np.zeros(light.shape, np.float32)
    for axis, length in zip(AXES, (width, height), strict=True):
        place, sigma_px = _decode_axis(captures, axis, length, noise, light, variance, dark, reason)
        places.append(place)
        square += np.square(sigma_px) / np.float32(2)
    projector_xy = np.stack(places, axis=-1)
    projector_xy[reason != DECODED] = np.nan
    confidence = sigma_to_confidence(np.sqrt(square), reason)
    return Decoded(projector_xy, light, reason, noise, (0.0, 0.0), confidence)


def _decode_axis(
    captures: Captures,
    axis: str,
    length: int,
    noise: SensorNoise,
    light: NDArray[np.float32],
    variance: NDArray[np.float32],
    dark: NDArray[np.bool_],
    reason: NDArray[np.uint8],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Place along one axis and its standard deviation; reasons are added."""
    bits = bits_to_pixel(length)
    fine = min(_FINE_BITS, bits)
    code, weak, faint = (np.zeros(dark.shape, kind) for kind in (np.uint16, np.uint16, bool))
    limits = (noise.gain, noise.read_variance, _LEAST_CONTRAST, _LIKELY_CONTRAST)
    contrast = np.zeros((fine, *dark.shape), np.int16)
    for bit in reversed(range(bits)):
        name = gray_name(axis, bit)
        lit, inverse = captures(name), captures(f"{name}-inverse")
        gray_kernels.add_bit(lit, inverse, bit, *limits, code, weak, faint)
        if bit < fine:  # halved, so that 16 bits hold it with its sign
            contrast[bit] = (lit.astype(np.int32) - inverse) >> 1
    step = captures.stride()
    table = contrast_table(length, fine, _edge_blur_px(contrast[:, ::step, ::step], dark[::step, ::step], length))
    place, sigma_px = np.empty(dark.shape, np.float32), np.empty(dark.shape, np.float32)
    for top in range(0, dark.shape[0], _BAND):
        low, high = max(0, top - _HALO), min(dark.shape[0], top + _BAND + _HALO)
        rows, own = slice(low, high), slice(top - low, min(dark.shape[0], top + _BAND) - low)
        first = gray_kernels.median_near(code[rows], weak[rows], _COARSE_FROM, dark[rows], _REACH)
        fitted = _refine(first, light[rows] / np.float32(2), contrast[:, rows], variance[rows] / np.float32(4), table)
        x, sigma, misfit = (np.ascontiguousarray(a[own]) for a in fitted)
        inside = slice(top, top + _BAND)
        gray_kernels.settle(
            x, sigma, misfit, code[inside], weak[inside], faint[inside], bits, _MOST_SIGMA_PX, _MOST_MISFIT, length,
            (WEAK_BIT, ODD_BITS, OUTSIDE), reason[inside],
        )  # fmt: skip
        place[inside], sigma_px[inside] = x, sigma
    return place, sigma_px


def _refine(
    first: NDArray[np.float32],
    light: NDArray[np.float32],
    contrast: NDArray[np.int16],
    variance: NDArray[np.float32],
    table: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
    """Gauss-Newton on the place with steps summed over the neighbourhood.

    Returns the place, its standard deviation by the noise of one pixel of the neighbourhood, and the misfit.
    """

    def around(values: NDArray[np.float32]) -> NDArray[np.float32]:
        return gaussian_filter(values, _SMOOTH_PX, mode="nearest", truncate=3.0)

    known = np.isfinite(first)
    weight = around(known.astype(np.float32))
    # the median is a staircase of whole pixels; smoothed, a sheet is left as it is
    with np.errstate(invalid="ignore", divide="ignore"):
        place = np.where(weight > 0.2, around(np.where(known, first, np.float32(0))) / weight, np.float32(np.nan))
    tiny = np.float32(1e-12)
    for _ in range(_STEPS):
        product, square = gray_kernels.amplitude_terms(
            place, light, contrast, variance, table, _TABLE_STEPS, _TABLE_PAD
        )
        share = around(product) / np.maximum(around(square), tiny)
        amplitude = np.maximum(share, np.float32(0)) * light
        # what blurred edges leave unexplained grows with the light, and would else outvote the noise
        total = variance + np.square(np.float32(_UNEXPLAINED) * amplitude)
        score, information, misfit = gray_kernels.place_terms(
            place, amplitude, contrast, total, table, _TABLE_STEPS, _TABLE_PAD
        )
        step = around(score) / np.maximum(around(information), tiny)
        place += np.clip(step, np.float32(-0.5), np.float32(0.5))
    of_noise = around(information * total / variance)
    sigma_px = 1.0 / np.sqrt(np.maximum(of_noise, tiny))
    return place, sigma_px.astype(np.float32, copy=False), misfit


def contrast_table(length: int, bits: int, blur_px: float) -> NDArray[np.float32]:
    """Contrast of the finest bits of Gray code along the projector, edges blurred by a Gaussian, (bits, n) in -1..1.

    Entry i is the place ``i / _TABLE_STEPS - _TABLE_PAD``; beyond the frame the code goes on as if it were larger.
    """
    offset = np.arange((4 << (bits - 1)) * _TABLE_STEPS) / _TABLE_STEPS  # one period of the coarsest bit
    table = np.full((bits, offset.size), -1.0, np.float32)
    for bit in range(bits):
        period = 4 << bit
        # lit from 2^bit - 1/2 to 3 * 2^bit - 1/2 of every period; edges within reach of the blur count
        for first in range(-period, offset.size // _TABLE_STEPS + period, period):
            for edge, sign in ((first + (1 << bit) - 0.5, 1.0), (first + 3 * (1 << bit) - 0.5, -1.0)):
                table[bit] += sign * (1.0 + erf((offset - edge) / (blur_px * np.sqrt(2.0))))
    places = np.arange((length + 2 * _TABLE_PAD) * _TABLE_STEPS) - _TABLE_PAD * _TABLE_STEPS
    return table[:, places % offset.size]


def _edge_blur_px(contrast: NDArray[np.int16], dark: NDArray[np.bool_], length: int) -> float:
    """Sigma of the bits' edges, projector pixels, from the mean square contrast of bit 0 over that of bit 2."""
    coarse = min(2, len(contrast) - 1)
    lit = contrast[:, ~dark].astype(np.float64)
    lost = float(np.mean(lit[0] ** 2) / max(float(np.mean(lit[coarse] ** 2)), 1e-9)) if lit.size else 1.0
    blurs = np.linspace(0.2, 1.6, 29)
    ratios = []
    for blur in blurs:
        squares = np.mean(contrast_table(56, coarse + 1, blur) ** 2, axis=1)  # whole periods
        ratios.append(squares[0] / squares[coarse])
    return float(np.interp(-lost, -np.array(ratios), blurs))
