"""Structured light: the frames to show, and captures -> sub-pixel projector coordinates of every camera pixel.

Complementary Gray code down to stripes of 4 pixels names the place, 8 shifted lines of period 8 refine it (paper:
IV-A; design: section 7). A line's position is the phase of its profile *over time in one camera pixel*: the ink's
reflectance multiplies the whole profile and cancels, so black dots decode as white ones do. Every decision is a
contrast over its own noise, and the noise is read off the captures themselves.

Nothing here shows a frame, opens a file, or fits anything across the whole picture (that is `registration`), but for
one correction of the line profile itself.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.optimize import nnls

from paxel_runtime import structured_light_kernels as kernels
from paxel_runtime.errors import CalibrationError, InputError

__all__ = ["LINE_PERIOD", "REASONS", "Decoded", "LightFrame", "SensorNoise", "decode", "plan_frames"]

LINE_PERIOD = 8
"""Projector pixels from one line to the next, and number of shifts."""

REASONS = (
    "decoded",
    "too dark",
    "saturated",
    "bit contrast too low",
    "line contrast too low",
    "lines and Gray code disagree",
    "outside the frame",
    "not seen by the guide channel",
)
"""Why a camera pixel has no coordinate: text of each value of `Decoded.reason`."""
DECODED, TOO_DARK, SATURATED, WEAK_BIT, WEAK_LINE, DISAGREE, OUTSIDE, NO_GUIDE = range(len(REASONS))

_AXES: tuple[Literal["x", "y"], ...] = ("x", "y")
_SATURATION = 65400
"""Raw values from here on are saturated: 65535 by contract, with room for a 14-bit camera's 65532."""
_LEAST_BIT_CONTRAST = 3.0
"""Contrast-to-noise ratio of a bit: a wrong bit needs noise of more than 3 sigma against it."""
_LEAST_LINE_CONTRAST = 3.0
"""Of the lines' first harmonic: its phase is then known to 0.4 projector pixels or better."""
_TOLERANCE_PX = 2.0
"""Lines against Gray code: half a bin of 2 pixels, plus a neighbouring bin's edge moved by ink and noise."""
_GUIDE_TOLERANCE_PX = 3.0
"""Lines against the guide channel: its neighbours stand in for it, up to `_GUIDE_REACH` camera pixels away."""
_GUIDE_REACH = 4
_MARGIN_PX = 1.5
"""At the frame's rim a line lacks its neighbour, which would pull the phase inwards."""
_SAMPLE = 150_000
"""Camera pixels that statistics of whole captures are made from."""
_MOST_WRONG = 0.05
"""Share of lit pixels that may break a check of order before the captures are refused."""
_BLOCK = 32
"""Camera pixels along a block in which the ripple of the lines is measured."""


@dataclass(frozen=True, eq=False)
class LightFrame:
    """One frame of structured light: a profile along one axis, constant along the other.

    Attributes
    ----------
    name : str
        Unique in a plan, fit for file names: ``white``, ``gray-x-3``, ``gray-x-3-inverse``, ``line-y-0``.
    axis : "x" | "y"
        Axis along which the profile runs.
    profile : (W,) or (H,) bool array
        Lit pixels along that axis.
    """

    name: str
    axis: Literal["x", "y"]
    profile: NDArray[np.bool_]

    def pixels(self, width: int, height: int) -> NDArray[np.bool_]:
        """The frame, (height, width) bool; True is lit.

        Raises
        ------
        InputError
            If the frame was planned for another size.
        """
        length = width if self.axis == "x" else height
        if len(self.profile) != length:
            raise InputError(
                f"frame {self.name} was planned for {len(self.profile)} pixels along {self.axis}, asked for {length}"
            )
        profile = self.profile[None, :] if self.axis == "x" else self.profile[:, None]
        return np.broadcast_to(profile, (height, width))


@dataclass(frozen=True)
class SensorNoise:
    """Noise of a raw value I: its variance is ``read_variance + gain * I``, both in raw units (0..65535)."""

    read_variance: float
    gain: float


@dataclass(frozen=True, eq=False)
class Decoded:
    """What structured light tells of each camera pixel, (h, w).

    Attributes
    ----------
    projector_xy : (h, w, 2) float32 array
        Column and row of the projector that light the pixel (an integer is a pixel's centre); NaN where rejected.
    signal : (h, w) float32 array
        Light of the projector that the pixel sees, raw units, also where rejected: the first harmonic of the lines,
        mean of both axes, which is about white minus black.
    reason : (h, w) uint8 array
        0 = decoded; otherwise an index into `REASONS`.
    noise : SensorNoise
        As read off the captures.
    ripple_px : (float, float)
        Amplitude (rms over the picture) of the lines' ripple that was removed from column and row.
    """

    projector_xy: NDArray[np.float32]
    signal: NDArray[np.float32]
    reason: NDArray[np.uint8]
    noise: SensorNoise
    ripple_px: tuple[float, float]

    @property
    def counts(self) -> dict[str, int]:
        """Number of camera pixels by reason."""
        return dict(zip(REASONS, np.bincount(self.reason.ravel(), minlength=len(REASONS)).tolist(), strict=True))


def plan_frames(width: int, height: int, *, coarse: bool = True) -> tuple[LightFrame, ...]:
    """Frames to show, in order.

    Parameters
    ----------
    width, height : int
        Resolution of the projector, 16 to 65536 each; no power of two is asked for.
    coarse : bool
        With white, black and the Gray code. Without, the 16 shifted lines alone: `decode` then needs the result of a
        channel that was decoded in full.

    Returns
    -------
    tuple of LightFrame
        ``2 + 2 (bits_x + bits_y) + 16`` frames, or 16; bits = ceil(log2(length / 2)).

    Raises
    ------
    InputError
        If the resolution is out of range.
    """
    if not (16 <= width <= 65536 and 16 <= height <= 65536):
        raise InputError(f"structured light needs a projector of 16 to 65536 pixels a side, got {width} x {height}")
    lengths = {"x": width, "y": height}
    frames = []
    if coarse:
        frames = [LightFrame("white", "x", np.ones(width, bool)), LightFrame("black", "x", np.zeros(width, bool))]
        for axis in _AXES:
            index = np.arange(lengths[axis]) >> 1
            for bit in reversed(range(_bits(lengths[axis]))):
                lit = ((index ^ (index >> 1)) >> bit & 1).astype(bool)
                name = _gray_name(axis, bit)
                frames += [LightFrame(name, axis, lit), LightFrame(f"{name}-inverse", axis, ~lit)]
    for axis in _AXES:
        place = np.arange(lengths[axis]) % LINE_PERIOD
        frames += [LightFrame(_line_name(axis, shift), axis, place == shift) for shift in range(LINE_PERIOD)]
    return tuple(frames)


def decode(
    read: Callable[[str], NDArray[np.uint16]], width: int, height: int, *, guide: Decoded | None = None
) -> Decoded:
    """Sub-pixel projector coordinates of every camera pixel, from captures read one or two at a time.

    Needs about 40 bytes a camera pixel beside the captures at hand.

    Parameters
    ----------
    read : callable
        Gives the capture of a frame by its name: (h, w) uint16, raw linear, 65535 = saturated.
    width, height : int
        Resolution of the projector.
    guide : Decoded, optional
        Another channel's result by the same camera from the same place. Only the lines are read then, and their
        period is resolved by the guide.

    Raises
    ------
    CalibrationError
        If captures differ in size or kind, are in a wrong order, or show no light of the projector.
    """
    captures = _Captures(read)
    if guide is None:
        coarse, reason, noise = _decode_gray(captures, width, height)
    else:
        captures.shape = guide.reason.shape
        coarse = [kernels.fill_near(np.ascontiguousarray(guide.projector_xy[..., k]), _GUIDE_REACH) for k in (0, 1)]
        reason = np.where(np.isnan(coarse[0]), np.uint8(NO_GUIDE), np.uint8(DECODED))
        noise = guide.noise
    clipped = np.zeros(reason.shape, bool)
    signal = np.zeros(reason.shape, np.float32)
    places, tolerance_px = [], _TOLERANCE_PX if guide is None else _GUIDE_TOLERANCE_PX
    for axis, length, guess in zip(_AXES, (width, height), coarse, strict=True):
        wave, total = _add_lines(captures, axis, guess, reason, clipped)
        place = np.empty(reason.shape, np.float32)
        limits = (noise.gain, noise.read_variance, _LEAST_LINE_CONTRAST, tolerance_px, _MARGIN_PX, length)
        kernels.join_lines(wave, total, guess, LINE_PERIOD, *limits, (TOO_DARK, WEAK_LINE, DISAGREE, OUTSIDE), reason, place)
        signal += np.hypot(wave[0], wave[1]) / np.float32(2)
        places.append(place)
    reason[clipped & (reason != TOO_DARK)] = SATURATED
    _check_agreement(reason)
    ripple_px = tuple(_remove_ripple(place, signal, reason) for place in places)
    projector_xy = np.stack(places, axis=-1)
    projector_xy[reason != DECODED] = np.nan
    return Decoded(projector_xy, signal, reason, noise, (ripple_px[0], ripple_px[1]))


class _Captures:
    """Reads captures and refuses those of another size or kind than the first."""

    def __init__(self, read: Callable[[str], NDArray[np.uint16]]) -> None:
        self._read = read
        self.shape: tuple[int, ...] = ()

    def __call__(self, name: str) -> NDArray[np.uint16]:
        capture = self._read(name)
        if capture.ndim != 2 or capture.dtype != np.uint16:
            raise CalibrationError(
                f"capture {name} must be one plane of uint16, got {capture.dtype} of shape {capture.shape}"
            )
        self.shape = self.shape or capture.shape
        if capture.shape != self.shape:
            raise CalibrationError(
                f"capture {name} has {capture.shape[1]} x {capture.shape[0]} pixels, the others "
                f"{self.shape[1]} x {self.shape[0]}: take it again with the same camera setting"
            )
        return capture

    def stride(self) -> int:
        """Step along both axes that leaves about `_SAMPLE` pixels of a capture."""
        return max(1, int(np.sqrt(self.shape[0] * self.shape[1] / _SAMPLE)))


def _decode_gray(
    captures: _Captures, width: int, height: int
) -> tuple[list[NDArray[np.float32]], NDArray[np.uint8], SensorNoise]:
    """Coarse position along both axes, reasons so far, and the noise of the camera."""
    white, black = captures("white"), captures("black")
    step = captures.stride()
    few_black = black[::step, ::step].astype(np.float64)
    few_light = white[::step, ::step] - few_black
    noise: SensorNoise | None = None
    coarse, odd = [], []
    reason = np.zeros(white.shape, np.uint8)
    for axis, length in zip(_AXES, (width, height), strict=True):
        code, doubt = np.zeros(white.shape, np.uint16), np.zeros(white.shape, np.uint8)
        for bit in reversed(range(_bits(length))):
            name = _gray_name(axis, bit)
            lit, inverse = captures(name), captures(f"{name}-inverse")
            few_sum = lit[::step, ::step].astype(np.float64) + inverse[::step, ::step] - 2.0 * few_black
            if noise is None:
                noise = _read_noise(few_light, few_black, few_sum)
                _mark_dark(white, black, noise, reason)
            share = _share_odd(few_light, few_black, few_sum, noise)
            if share > _MOST_WRONG:
                odd.append((name, share))
            args = (noise.gain, noise.read_variance, _LEAST_BIT_CONTRAST)
            kernels.add_gray_pair(lit, inverse, bit, *args, code, doubt)
        coarse.append(kernels.gray_to_position(code, doubt, _bits(length), reason, WEAK_BIT))
    assert noise is not None  # both axes have at least 3 bits
    _refuse_odd_pairs(odd, _bits(width) + _bits(height))
    return coarse, reason, noise


def _read_noise(light: NDArray[np.float64], black: NDArray[np.float64], pair_sum: NDArray[np.float64]) -> SensorNoise:
    """Noise from samples of white - black, black, and a complementary pair minus twice black.

    Were there no noise, the pair's sum would be proportional to white - black (the factor is the lamp's drift); the
    variance of what differs, 4 read_variance + 2 gain (white + black), is fitted over classes of brightness.
    """
    bright = light > np.percentile(light, 75)
    factor = float(np.median(pair_sum[bright] / np.maximum(light[bright], 1.0))) if bright.any() else 1.0
    difference = (pair_sum - factor * light).ravel()
    # sorted by the mean of both: sorted by either one, a class would be biased by the noise that put a pixel in it
    level = (0.5 * (pair_sum + light) + 2.0 * black).ravel()
    steps = np.diff(np.unique(black))
    rounding = float(steps.min()) ** 2 / 12.0 if steps.size else 1.0 / 12.0
    levels, variances = [], []
    for members in np.array_split(np.argsort(level, kind="stable"), 24):
        squares = difference[members] ** 2
        # trimmed, as edges of ink may have moved; not a median, which few steps of rounding would make 0
        kept = squares[squares <= 36.0 * max(float(np.median(squares)), 4.0 * rounding)]
        levels.append(max(float(np.mean(level[members])), 0.0))
        variances.append(max(float(np.mean(kept)), 4.0 * rounding))
    rows = np.column_stack([np.full(len(levels), 4.0), 2.0 * np.array(levels)]) / np.array(variances)[:, None]
    (read_variance, gain), _ = nnls(rows, np.ones(len(levels)))
    return SensorNoise(max(float(read_variance), rounding), float(gain))


def _mark_dark(
    white: NDArray[np.uint16], black: NDArray[np.uint16], noise: SensorNoise, reason: NDArray[np.uint8]
) -> None:
    """Mark what the projector does not light; refuse captures in which that is nearly everything."""
    light = white.astype(np.float32) - black
    sigma = np.sqrt(np.float32(2.0 * noise.read_variance) + np.float32(noise.gain) * (white.astype(np.float32) + black))
    reason[light < np.float32(_LEAST_BIT_CONTRAST) * sigma] = TOO_DARK
    share = float(np.mean(reason == DECODED))
    if share < 0.01:
        raise CalibrationError(
            f"white must be brighter than black where the projector shines, it is on {share:.1%} of the camera's "
            "picture: is the projection in view, the lens open, and white taken while white was shown?"
        )


def _share_odd(
    light: NDArray[np.float64], black: NDArray[np.float64], pair_sum: NDArray[np.float64], noise: SensorNoise
) -> float:
    """Share of the well-lit samples at which a complementary pair does not add up to white + black."""
    sigma = np.sqrt(4.0 * noise.read_variance + 2.0 * noise.gain * np.maximum(light + 2.0 * black, 0.0))
    lit = light > 20.0 * sigma
    if not lit.any():
        lit = light > np.percentile(light, 90)
    # a frame taken for its complement is wrong by all of the light, drift of the lamp by a few percent
    return float(np.mean(np.abs(pair_sum[lit] - light[lit]) > 0.25 * light[lit]))


def _refuse_odd_pairs(odd: list[tuple[str, float]], pairs: int) -> None:
    if not odd:
        return
    listed = ", ".join(f"{name} ({share:.0%})" for name, share in odd[:6]) + (", ..." if len(odd) > 6 else "")
    if len(odd) > pairs // 2:
        cause = "white or black is not what it should be, or the camera, the sheet or the light changed"
    else:
        cause = "they are out of order, repeated or old, or something moved while they were taken"
    raise CalibrationError(
        f"a Gray-code capture and its inverse must add up to white + black on at least {1 - _MOST_WRONG:.0%} of the "
        f"lit pixels; {len(odd)} of {pairs} pairs do not (share of pixels off): {listed}: {cause}; take them again"
    )


def _add_lines(
    captures: _Captures,
    axis: Literal["x", "y"],
    coarse: NDArray[np.float32],
    reason: NDArray[np.uint8],
    clipped: NDArray[np.bool_],
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """First harmonic and sum of the lines of one axis; checks that each capture shows its own line."""
    wave = np.zeros((2, *reason.shape), np.float32)
    total = np.zeros(reason.shape, np.float32)
    step = captures.stride()
    known = reason[::step, ::step] == DECODED
    few_coarse = coarse[::step, ::step][known].astype(np.float64)
    samples = []
    for shift in range(LINE_PERIOD):
        capture = captures(_line_name(axis, shift))
        angle = 2.0 * np.pi * shift / LINE_PERIOD
        kernels.add_line(capture, np.cos(angle), np.sin(angle), _SATURATION, wave, total, clipped)
        samples.append(capture[::step, ::step][known].astype(np.float64))
    _check_lines(axis, np.array(samples), few_coarse)
    return wave, total


def _check_lines(axis: Literal["x", "y"], samples: NDArray[np.float64], coarse: NDArray[np.float64]) -> None:
    """Refuse line captures that do not light the columns (rows) they should by the coarse position."""
    if coarse.size < 4 * LINE_PERIOD:
        return
    light = samples - np.mean(samples, axis=0)
    seen = light @ np.exp(2j * np.pi * coarse / LINE_PERIOD)
    shown = np.round(np.angle(seen) * LINE_PERIOD / (2.0 * np.pi)).astype(int) % LINE_PERIOD
    shifts = np.arange(LINE_PERIOD)
    absent = np.abs(seen) < 0.3 * np.median(np.abs(seen))
    wrong = shifts[absent | (shown != shifts)]
    if not wrong.size:
        return
    if wrong.size > LINE_PERIOD // 2:
        culprit = _exchanged_bit(axis, samples, coarse)
        raise CalibrationError(
            f"the shifted lines of axis {axis} contradict its coarse positions in {wrong.size} of {LINE_PERIOD} "
            f"captures: {culprit}; show the frames in the order of the plan and take them again"
        )
    listed = ", ".join(
        f"{_line_name(axis, s)} shows {'no line' if absent[s] else _line_name(axis, int(shown[s]))}" for s in wrong
    )
    raise CalibrationError(f"captures of shifted lines are out of order, repeated or old: {listed}; take them again")


def _exchanged_bit(axis: str, samples: NDArray[np.float64], coarse: NDArray[np.float64]) -> str:
    """Name the Gray-code pair whose exchange would make lines and Gray code agree."""
    wave = np.exp(2j * np.pi * np.arange(LINE_PERIOD) / LINE_PERIOD) @ samples
    line = np.angle(wave) * LINE_PERIOD / (2.0 * np.pi)
    index = np.floor(np.maximum(coarse, 0.0) / 2.0).astype(np.int64)
    bits = max(int(index.max()).bit_length(), 1)
    for bit in range(bits):
        flipped, gray = np.zeros_like(index), index ^ (index >> 1) ^ (1 << bit)
        for k in reversed(range(bits)):
            flipped = (flipped << 1) | ((flipped & 1) ^ (gray >> k & 1))
        off = (line - (2.0 * flipped + 0.5) + LINE_PERIOD / 2) % LINE_PERIOD - LINE_PERIOD / 2
        if np.mean(np.abs(off) <= _TOLERANCE_PX) > 1.0 - _MOST_WRONG:
            return f"{_gray_name(axis, bit)} and its inverse are exchanged"
    return "the captures are out of order, or of a projector of another size"


def _check_agreement(reason: NDArray[np.uint8]) -> None:
    """Refuse captures whose pixels mostly decode to nonsense."""
    decoded, disagree = int(np.sum(reason == DECODED)), int(np.sum(reason == DISAGREE))
    if disagree > 0.25 * (decoded + disagree):
        raise CalibrationError(
            f"lines and coarse positions must agree within {_TOLERANCE_PX:.0f} projector pixels; they differ on "
            f"{disagree / (decoded + disagree):.0%} of the pixels: the captures are out of order, or the camera or the "
            "sheet moved between them; take them again"
        )
    if decoded < 0.002 * reason.size:
        counts = np.bincount(reason.ravel(), minlength=len(REASONS))
        most = REASONS[int(np.argmax(counts[1:])) + 1]
        raise CalibrationError(
            f"structured light could be decoded on {decoded} of {reason.size} camera pixels (mostly: {most}): check "
            "exposure and focus, and that the projection fills most of the picture"
        )


def _remove_ripple(place: NDArray[np.float32], signal: NDArray[np.float32], reason: NDArray[np.uint8]) -> float:
    """Take out of `place` (in place) what the lines' shape adds to their phase; returns its rms amplitude, pixels.

    With 8 shifts the first harmonic also collects the profile's harmonics 7 and 9: an error of up to 0.02 pixels
    (blur 0.36) or 0.03 (fill factor 0.9), periodic in one projector pixel. It is measured against the local plane of
    the picture, as a smooth function of the place in it (blur grows to the corners).
    """
    ripple, information = _block_ripple(place, signal, reason)
    used = np.argwhere(information[..., 0, 0] > 0)
    if len(used) < 4:
        return 0.0
    extent = np.maximum(np.array(place.shape) / _BLOCK, 1.0)
    terms = _ripple_terms(2.0 * (used + 0.5) / extent - 1.0)
    a, b = ripple[used[:, 0], used[:, 1]].T
    aa, ab, bb = (information[used[:, 0], used[:, 1], i, j] for i, j in ((0, 0), (0, 1), (1, 1)))
    n = terms.shape[1]
    normal = np.zeros((2 * n, 2 * n))
    normal[:n, :n] = terms.T @ (aa[:, None] * terms)
    normal[n:, n:] = terms.T @ (bb[:, None] * terms)
    normal[:n, n:] = terms.T @ (ab[:, None] * terms)
    normal[n:, :n] = normal[:n, n:].T
    right = np.concatenate([terms.T @ (aa * a + ab * b), terms.T @ (ab * a + bb * b)])
    # amplitudes of more than a few hundredths of a pixel do not occur; matters only where little is known
    solution = np.linalg.solve(normal + np.eye(2 * n) / 0.02**2, right).reshape(2, n)
    rows = chebyshev.chebvander(2.0 * (np.arange(place.shape[0]) + 0.5) / place.shape[0] - 1.0, 4)
    columns = chebyshev.chebvander(2.0 * (np.arange(place.shape[1]) + 0.5) / place.shape[1] - 1.0, 4)
    cosine = np.zeros((2, 5, 5))
    cosine[:, _DEGREES[:, 0], _DEGREES[:, 1]] = solution
    return kernels.subtract_ripple(place, rows @ cosine, columns)


def _block_ripple(
    place: NDArray[np.float32], signal: NDArray[np.float32], reason: NDArray[np.uint8]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine amplitude in each block, (rows, columns, 2), and their information, (rows, columns, 2, 2).

    In a block the position is a quadratic of the picture's coordinates plus the ripple. The quadratic is eliminated
    (Schur complement), so that a block in which the two cannot be told apart has no say.
    """
    rows, columns = place.shape[0] // _BLOCK, place.shape[1] // _BLOCK
    solution, cutoff_px = np.zeros((rows * columns, 8)), np.full(rows * columns, np.inf)
    for _ in range(3):
        normal, misfit = kernels.ripple_normals(place, signal, reason, _BLOCK, solution, cutoff_px)
        known = misfit[:, 2] >= _BLOCK**2 / 2
        normal[~known] = np.eye(9)
        normal /= normal[:, :1, :1]
        normal[:, np.arange(8), np.arange(8)] += 1e-9
        # the misfit is about the solution before: that of the first round, which had none, says nothing
        rms = np.sqrt(misfit[:, 1] / np.maximum(misfit[:, 0], 1e-30))
        cutoff_px = np.where(np.any(solution, axis=1), np.maximum(6.0 * rms, 1e-3), np.inf)
        solution = np.linalg.solve(normal[:, :8, :8], normal[:, :8, 8:])[..., 0]
    mixed = normal[:, :6, 6:8]
    rest = normal[:, 6:8, 6:8] - np.swapaxes(mixed, 1, 2) @ np.linalg.solve(normal[:, :6, :6], mixed)
    variance = np.maximum(rms**2, 1e-10)
    information = rest * (np.where(known, misfit[:, 2], 0.0) / variance)[:, None, None]
    return solution[:, 6:].reshape(rows, columns, 2), information.reshape(rows, columns, 2, 2)


_DEGREES = np.array([(i, j) for i in range(5) for j in range(5 - i)])


def _ripple_terms(row_column: NDArray[np.float64]) -> NDArray[np.float64]:
    """Chebyshev polynomials of total degree 4 at places -1..1, (m, 2) -> (m, 15)."""
    rows, columns = (chebyshev.chebvander(row_column[:, k], 4) for k in (0, 1))
    return rows[:, _DEGREES[:, 0]] * columns[:, _DEGREES[:, 1]]


def _bits(length: int) -> int:
    """Bits of Gray code that tell bins of 2 pixels apart: its finest stripes are 4 pixels wide."""
    return ((length + 1) // 2 - 1).bit_length()


def _gray_name(axis: str, bit: int) -> str:
    return f"gray-{axis}-{bit}"


def _line_name(axis: str, shift: int) -> str:
    return f"line-{axis}-{shift}"
