"""Captures of structured light -> sub-pixel projector coordinates of every camera pixel.

Complementary Gray code down to stripes of 4 pixels names the place, 8 shifted lines of period 8 (or sinusoids of
period 16) refine it (paper: IV-A; design: section 7). The position is the phase of the profile *over time in one
camera pixel*: the ink's reflectance multiplies the whole profile and cancels, so black dots decode as white ones do.
Every decision is a contrast over its own noise, and the noise is read off the captures themselves.

Nothing here shows a frame, opens a file, or fits anything across the whole picture (that is `registration`), but for
one correction of the line profile itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.structured_light import kernels
from paxel_runtime.structured_light.captures import Captures
from paxel_runtime.structured_light.checks import (
    DECODED,
    DISAGREE,
    LINE_PERIOD,
    NO_GUIDE,
    OUTSIDE,
    SATURATED,
    SHIFTS,
    TOLERANCE_PX,
    TOO_DARK,
    WEAK_BIT,
    WEAK_LINE,
    SensorNoise,
    check_agreement,
    check_bits,
    check_lines,
    fine_name,
    gray_name,
    odd_share,
    read_noise,
    refuse_dark,
    refuse_odd_pairs,
)
from paxel_runtime.structured_light.decoded import Decoded, sigma_to_confidence
from paxel_runtime.structured_light.frames import AXES, PERIODS_PX, Method, bits_of
from paxel_runtime.structured_light.ripple import remove_ripple

__all__ = ["decode"]

_SATURATION = 65400
"""Raw values from here on are saturated: 65535 by contract, with room for a 14-bit camera's 65532."""
_LEAST_BIT_CONTRAST = 3.0
"""Contrast-to-noise ratio of a bit: a wrong bit needs noise of more than 3 sigma against it."""
_LEAST_LINE_CONTRAST = 3.0
"""Of the first harmonic of lines: its phase is then known to 0.4 projector pixels or better."""
_GUIDE_TOLERANCE_PX = 3.0
"""Lines against the guide channel: its neighbours stand in for it, up to `_GUIDE_REACH` camera pixels away."""
_GUIDE_REACH = 4
_MARGIN_PX = 1.5
"""At the frame's rim a line lacks its neighbour, which would pull the phase inwards."""


def decode(
    read: Callable[[str], NDArray[np.uint16]],
    width: int,
    height: int,
    *,
    guide: Decoded | None = None,
    method: Method = "lines",
) -> Decoded:
    """Sub-pixel projector coordinates of every camera pixel, from captures read one or two at a time.

    Needs about 60 bytes a camera pixel, the captures at hand counted in, and 65 MB for samples, whatever the number of
    captures.

    Parameters
    ----------
    read : callable
        Gives the capture of a frame by its name: (h, w) uint16, raw linear, 65535 = saturated.
    width, height : int
        Resolution of the projector.
    guide : Decoded, optional
        Another channel's result by the same camera from the same place. Only the shifted frames are read then, and
        their period is resolved by the guide.
    method : "lines" | "phase"
        What refines the Gray code.

    Raises
    ------
    CalibrationError
        If captures differ in size or kind, are in a wrong order, or show no light of the projector.
    """
    captures = Captures(read)
    if guide is None:
        coarse, reason, noise = _decode_gray(captures, width, height)
    else:
        captures.shape = guide.reason.shape
        coarse = [kernels.fill_near(np.ascontiguousarray(guide.projector_xy[..., k]), _GUIDE_REACH) for k in (0, 1)]
        reason = np.where(np.isnan(coarse[0]), np.uint8(NO_GUIDE), np.uint8(DECODED))
        noise = guide.noise
    period = PERIODS_PX[method]
    scale = period / LINE_PERIOD
    limits = (
        *(noise.gain, noise.read_variance, _LEAST_LINE_CONTRAST * scale),
        *(TOLERANCE_PX if guide is None else _GUIDE_TOLERANCE_PX, _MARGIN_PX),
    )
    clipped = np.zeros(reason.shape, bool)
    signal = np.zeros(reason.shape, np.float32)
    square = np.zeros(reason.shape, np.float32)
    places = []
    for axis, length, guess in zip(AXES, (width, height), coarse, strict=True):
        highest = gray_name(axis, bits_of(length) - 1) if guide is None else ""
        wave, total = _add_lines(captures, method, axis, guess, highest, reason, clipped)
        place = np.empty(reason.shape, np.float32)
        kernels.join_lines(
            wave, total, guess, period, SHIFTS, *limits, length, (TOO_DARK, WEAK_LINE, DISAGREE, OUTSIDE), reason,
            place, square,
        )  # fmt: skip
        signal += np.hypot(wave[0], wave[1]) / np.float32(2 * scale)  # 8 sinusoids carry twice the light of 8 lines
        places.append(place)
    reason[clipped & (reason != TOO_DARK)] = SATURATED
    check_agreement(reason)
    ripple_px = [remove_ripple(place, signal, reason) for place in places]
    projector_xy = np.stack(places, axis=-1)
    projector_xy[reason != DECODED] = np.nan
    confidence = sigma_to_confidence(np.sqrt(square), reason)
    return Decoded(projector_xy, signal, reason, noise, (ripple_px[0], ripple_px[1]), confidence)


def _decode_gray(
    captures: Captures, width: int, height: int
) -> tuple[list[NDArray[np.float32]], NDArray[np.uint8], SensorNoise]:
    """Coarse position along both axes, reasons so far, and the noise of the camera."""
    white, black = captures("white"), captures("black")
    step = captures.stride()
    few_black = black[::step, ::step].astype(np.float64)
    few_light = white[::step, ::step] - few_black
    refuse_dark(few_light)
    noise: SensorNoise | None = None
    coarse: list[NDArray[np.float32]] = []
    sums: list[tuple[str, float]] = []
    reason = np.zeros(white.shape, np.uint8)
    for axis, length in zip(AXES, (width, height), strict=True):
        code, doubt = np.zeros(white.shape, np.uint16), np.zeros(white.shape, np.uint8)
        for bit in reversed(range(bits_of(length))):
            name = gray_name(axis, bit)
            lit, inverse = captures(name), captures(f"{name}-inverse")
            few_sum = lit[::step, ::step].astype(np.float64) + inverse[::step, ::step] - 2.0 * few_black
            if noise is None:
                noise = read_noise(few_light, few_black, few_sum)
                _mark_dark(white, black, noise, reason)
            sums.append((name, odd_share(few_light, few_black, few_sum, noise)))
            args = (noise.gain, noise.read_variance, _LEAST_BIT_CONTRAST)
            kernels.add_gray_pair(lit, inverse, bit, *args, code, doubt)
        coarse.append(kernels.gray_to_position(code, doubt, bits_of(length), reason, WEAK_BIT))
    assert noise is not None  # both axes have at least 3 bits
    refuse_odd_pairs(sums)
    for axis, length, place in zip(AXES, (width, height), coarse, strict=True):
        check_bits(axis, np.where(reason == DECODED, place, np.nan), bits_of(length))
    return coarse, reason, noise


def _mark_dark(
    white: NDArray[np.uint16], black: NDArray[np.uint16], noise: SensorNoise, reason: NDArray[np.uint8]
) -> None:
    """Mark what the projector does not light."""
    light = white.astype(np.float32) - black
    sigma = np.sqrt(np.float32(2.0 * noise.read_variance) + np.float32(noise.gain) * (white.astype(np.float32) + black))
    reason[light < np.float32(_LEAST_BIT_CONTRAST) * sigma] = TOO_DARK


def _add_lines(
    captures: Captures,
    method: Method,
    axis: Literal["x", "y"],
    coarse: NDArray[np.float32],
    highest_bit: str,
    reason: NDArray[np.uint8],
    clipped: NDArray[np.bool_],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Two harmonics and sum of the shifted frames of one axis; checks that each capture shows its own."""
    wave = np.zeros((4, *reason.shape), np.float32)
    total = np.zeros(reason.shape, np.float32)
    step = captures.stride()
    known = reason[::step, ::step] == DECODED
    few_coarse = coarse[::step, ::step][known].astype(np.float64)
    names = [fine_name(method, axis, shift) for shift in range(SHIFTS)]
    samples = []
    for shift, name in enumerate(names):
        capture = captures(name)
        angle = 2.0 * np.pi * shift / SHIFTS
        kernels.add_line(capture, np.cos(angle), np.sin(angle), _SATURATION, wave, total, clipped)
        samples.append(capture[::step, ::step][known].astype(np.float64))
    check_lines(names, np.array(samples), few_coarse, PERIODS_PX[method], highest_bit)
    return wave, total
