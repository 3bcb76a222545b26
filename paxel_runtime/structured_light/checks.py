"""Checks of structured-light captures: their noise, their order, and whether they show what they should.

Frames carry no tag: that a capture is the one it is taken for follows from complementary pairs that add up, from lines
that agree with the Gray code, and from lines that stand where they should. Knows samples and statistics of captures;
must not know how they are read or decoded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from paxel_runtime.errors import CalibrationError

__all__ = [
    "DECODED",
    "DISAGREE",
    "LINE_PERIOD",
    "NO_GUIDE",
    "ODD_BITS",
    "OUTSIDE",
    "PHASE_PERIOD",
    "REASONS",
    "SATURATED",
    "SHIFTS",
    "TOLERANCE_PX",
    "TOO_DARK",
    "WEAK_BIT",
    "WEAK_LINE",
    "SensorNoise",
    "check_agreement",
    "check_bits",
    "check_lines",
    "fine_name",
    "gray_name",
    "odd_share",
    "read_noise",
    "refuse_dark",
    "refuse_odd_pairs",
]

SHIFTS = 8
"""Frames of shifted lines, or of shifted sinusoids, along one axis."""
LINE_PERIOD = 8
"""Projector pixels from one line to the next: each shift is one pixel."""
PHASE_PERIOD = 16
"""Projector pixels of one sinusoid: each shift is two pixels."""
TOLERANCE_PX = 2.0
"""Lines against Gray code: half a bin of 2 pixels, plus a neighbouring bin's edge moved by ink and noise."""
_MOST_WRONG = 0.05
"""Share of lit pixels that may break a check of order before the captures are refused."""

REASONS = (
    "decoded",
    "too dark",
    "saturated",
    "bit contrast too low",
    "line contrast too low",
    "lines and Gray code disagree",
    "outside the frame",
    "not seen by the guide channel",
    "bits disagree with the neighbours",
)
"""Why a camera pixel has no coordinate: text of each value of `Decoded.reason`."""
DECODED, TOO_DARK, SATURATED, WEAK_BIT, WEAK_LINE, DISAGREE, OUTSIDE, NO_GUIDE, ODD_BITS = range(len(REASONS))


@dataclass(frozen=True)
class SensorNoise:
    """Noise of a raw value I: its variance is ``read_variance + gain * I``, both in raw units (0..65535)."""

    read_variance: float
    gain: float


def read_noise(light: NDArray[np.float64], black: NDArray[np.float64], pair_sum: NDArray[np.float64]) -> SensorNoise:
    """Noise from samples of white - black, black, and a complementary pair minus twice black.

    Were there no noise, the pair's sum would be proportional to white - black (the factor is the lamp's drift); the
    variance of what differs, 4 read_variance + 2 gain (white + black), is fitted over classes of brightness.
    """
    bright = light >= max(float(np.percentile(light, 75)), 1.0)
    factor = float(np.median(pair_sum[bright] / light[bright]))
    difference = (pair_sum - factor * light).ravel()
    # sorted by the mean of both: sorted by either one, a class would be biased by the noise that put a pixel in it
    level = (0.5 * (pair_sum + light) + 2.0 * black).ravel()
    steps = np.diff(np.unique(np.concatenate([black.ravel(), (black + light).ravel()])))
    rounding = float(steps.min()) ** 2 / 12.0 if steps.size else 1.0 / 12.0  # of the camera's own steps
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


def refuse_dark(light: NDArray[np.float64]) -> None:
    """Refuse samples of white - black that show nothing but noise, or black where white should be."""
    low, high = np.percentile(light, (1.0, 99.0))
    if high <= 3.0 * max(-low, 1.0):
        raise CalibrationError(
            "capture white must be brighter than capture black where the projector shines, by more than noise; 99 % "
            f"of the pixels differ by less than {high:.0f} of 65535, 1 % by less than {low:.0f}: is the projection in "
            "view and exposed long enough, the lens open, and was white taken while white was shown?"
        )


def odd_share(
    light: NDArray[np.float64], black: NDArray[np.float64], pair_sum: NDArray[np.float64], noise: SensorNoise
) -> float:
    """Share of the well-lit samples at which a complementary pair does not add up to white + black."""
    sigma = np.sqrt(4.0 * noise.read_variance + 2.0 * noise.gain * np.maximum(light + 2.0 * black, 0.0))
    lit = light > 20.0 * sigma
    if not lit.any():
        lit = light >= np.percentile(light, 90)
    # a frame taken for its complement is wrong by all of the light, drift of the lamp by a few percent
    return float(np.mean(np.abs(pair_sum[lit] - light[lit]) > 0.25 * light[lit]))


def refuse_odd_pairs(pairs: list[tuple[str, float]]) -> None:
    """Refuse captures whose complementary pairs, (name, `odd_share`), do not add up."""
    odd = [(name, share) for name, share in pairs if share > _MOST_WRONG]
    if not odd:
        return
    listed = ", ".join(f"{name} ({share:.0%})" for name, share in odd[:6]) + (", ..." if len(odd) > 6 else "")
    if len(odd) > len(pairs) // 2:
        cause = "white or black is not what it should be, or the camera, the sheet or the light changed"
    else:
        cause = "they are out of order, repeated or old, or something moved while they were taken"
    raise CalibrationError(
        f"a Gray-code capture and its inverse must add up to white + black on at least {1 - _MOST_WRONG:.0%} of the "
        f"lit pixels; {len(odd)} of {len(pairs)} pairs do not (share of pixels off): {listed}: {cause}; take them again"
    )


def check_bits(axis: str, coarse: NDArray[np.float32], bits: int) -> None:
    """Refuse Gray-code captures in which a bit is exchanged with its inverse, or two bits with each other.

    Their pairs add up and (for two bits) the lines agree, but places jump to and fro along the picture: an exchange
    that makes the way along its rows and columns clearly shorter is the one that took place.

    Parameters
    ----------
    axis : str
    coarse : (h, w) float32 array
        Coarse position, NaN where unknown.
    bits : int
    """
    h, w = coarse.shape
    lines = [*coarse[h // 32 :: max(1, h // 16)], *coarse[:, w // 32 :: max(1, w // 16)].T]
    index = [(line[np.isfinite(line)] // 2).astype(np.int64) for line in lines]
    ends = np.cumsum([len(line) for line in index])[:-1]
    gray = np.concatenate(index)
    gray ^= gray >> 1

    def way(code: NDArray[np.int64]) -> float:
        steps = np.abs(np.diff(_gray_to_binary(code, bits)))
        steps[ends[(ends > 0) & (ends <= len(steps))] - 1] = 0
        return float(np.sum(steps))

    found = way(gray)
    tried = {f"{gray_name(axis, k)} and its inverse": gray ^ (1 << k) for k in range(bits)}
    for k in range(bits):
        for j in range(k):
            differ = ((gray >> k) ^ (gray >> j)) & 1
            tried[f"{gray_name(axis, j)} and {gray_name(axis, k)}"] = gray ^ (differ << k) ^ (differ << j)
    ways = {name: way(code) for name, code in tried.items()}
    best = min(ways, key=lambda name: ways[name])
    if ways[best] < 0.8 * found:
        raise CalibrationError(
            f"captures {best} are exchanged (places run smoothly along the picture if they change sides): show the "
            "frames in the order of the plan and take them again"
        )


def _gray_to_binary(gray: NDArray[np.int64], bits: int) -> NDArray[np.int64]:
    binary = gray.copy()
    for shift in (1, 2, 4, 8, 16):
        if shift < bits:
            binary ^= binary >> shift
    return binary


def check_lines(
    names: Sequence[str],
    samples: NDArray[np.float64],
    coarse: NDArray[np.float64],
    period_px: int,
    highest_bit: str = "",
) -> None:
    """Refuse captures of shifted lines that do not light the columns (rows) they should by the coarse position.

    Parameters
    ----------
    names : sequence of str
        Of the captures, in the order of their shifts.
    samples : (8, n) float64 array
        Samples of the captures.
    coarse : (n,) float64 array
        Their coarse positions.
    period_px : int
        From one line to the next, or of the sinusoids, projector pixels.
    highest_bit : str
        Name of the Gray code's highest bit that the coarse positions are from; empty where another channel gave them.
    """
    if coarse.size < 4 * SHIFTS:
        return
    light = samples - np.mean(samples, axis=0)
    seen = light @ np.exp(2j * np.pi * coarse / period_px)
    shown = np.round(np.angle(seen) * SHIFTS / (2.0 * np.pi)).astype(int) % SHIFTS
    shifts = np.arange(SHIFTS)
    absent = np.abs(seen) < 0.3 * np.median(np.abs(seen))
    wrong = shifts[absent | (shown != shifts)]
    if not wrong.size:
        return
    if wrong.size > SHIFTS // 2:
        culprit = "the captures are out of order, of a projector of another size, or something moved"
        # the highest bit's inverse mirrors all places, which nothing but the lines can tell
        if highest_bit and np.all((shown + shifts) % SHIFTS == (shown[0] + shifts[0]) % SHIFTS):
            culprit = f"they run backwards: {highest_bit} and its inverse are exchanged"
        raise CalibrationError(
            f"the shifted lines {names[0]} to {names[-1]} contradict the coarse positions in {wrong.size} of {SHIFTS} "
            f"captures: {culprit}; show the frames in the order of the plan and take them again"
        )
    listed = ", ".join(f"{names[s]} shows {'no line' if absent[s] else names[int(shown[s])]}" for s in wrong)
    raise CalibrationError(f"captures of shifted lines are out of order, repeated or old: {listed}; take them again")


def check_agreement(reason: NDArray[np.uint8]) -> None:
    """Refuse captures whose pixels mostly decode to nonsense."""
    decoded, disagree = int(np.sum(reason == DECODED)), int(np.sum(reason == DISAGREE))
    if disagree > 0.25 * (decoded + disagree):
        raise CalibrationError(
            f"lines and coarse positions must agree within {TOLERANCE_PX:.0f} projector pixels; they differ on "
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


def gray_name(axis: str, bit: int) -> str:
    return f"gray-{axis}-{bit}"


def fine_name(method: str, axis: str, shift: int) -> str:
    return f"{'line' if method == 'lines' else 'phase'}-{axis}-{shift}"
