"""Is the projector honest? Whether light adds up, dark steps count, and every pixel is shown as it is sent.

The prediction model takes a projector's channels and pixels for independent lights. Image "improvements" break that:
white boost, dynamic contrast, black crush, sharpening, scaling. A few readings on the last surface and two pictures of
single pixels tell which, in words a technician can act on. Pure functions of readings and pictures by name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter, uniform_filter

from paxel_runtime.captures.exposures import RAMP_STEPS, Exposure, Surface, exposure_name, guide_channel, mask_pixels
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.registration import warp_to_nodal

__all__ = ["Finding", "honesty_figures", "judge", "plan_honesty"]

Word = Literal["honest", "noticeable", "dishonest"]

_DARK_STEPS = (4, 8, 16)
"""Codes of 8 bits near black; as shares of full for other depths."""
_MIDDLE_STEPS = (64, 128, 191)
"""Codes of 8 bits; steps 8, 16 and 24 of the ramps, so that the channels alone are known at them."""
_RAMP_STEPS_OF = (8, 16, 24)
_FLAT_LOW, _FLAT_HIGH = 0, 2
"""Of `_MIDDLE_STEPS`: the two values of the checker of single pixels."""

_NOTICEABLE, _DISHONEST = 0.015, 0.06
"""Relative deviations of light: below the first, less than a just noticeable difference at full light (dE00 0.5); from
the second, more than any decent projector shows."""
_TAKEN = 0.15
"""The second for light that neighbours take from each other: usual for liquid crystals, and the correction knows it."""
_LEAST_WINDOW, _SPOTS_A_WINDOW, _LARGEST_WINDOW = 0.4, 1.5, 0.8
_LEAST_MODULATION = 0.08
"""Modulation of single pixels below which noise decides what is seen."""
_BEATS = 0.6
"""Fall of the modulation of single pixels within `_BEAT_PX`, as a share of its highest there, that only resampling
gives: blur changes over the whole field."""
_BEAT_PX, _STRIDE_PX = 99, 3
_INVISIBLE = 2e-5
"""Rise of light, share of full white, below which a step near black is swallowed: a fifth of what code 4 gives at an
exponent of 2.2, and above a meter's noise on the black level."""
_WINDOW_PX = 7
"""Window of the modulation: shorter than most beats, long enough against noise."""


@dataclass(frozen=True)
class Finding:
    """One question to the projector.

    Attributes
    ----------
    question : str
        ``"white"``, ``"grays"``, ``"near black"``, ``"surround"``, ``"neighbours"`` or ``"single pixels"``.
    word : "honest" | "noticeable" | "dishonest"
    figure : float
        What was measured: a relative deviation of light, or of modulation.
    verdict : str
        In words, with what to switch off.
    """

    question: str
    word: Word
    figure: float
    verdict: str


def plan_honesty(
    channels: tuple[str, ...], surface: Surface, *, bits: int, spot_share: float, camera: bool = True
) -> list[Exposure]:
    """Nine readings and two pictures; the rest is in the ramps and in full white and black anyway.

    Parameters
    ----------
    surface : str
        The one that the ramps are measured on.
    bits : int
        Of the projector's codes.
    spot_share : float
        Diameter of the meter's spot as a share of the projection's shorter side. A spot that leaves no room for a dark
        surround is not asked about it.
    camera : bool
        Whether the pictures of single pixels are taken.
    """
    N, top = len(channels), 2**bits - 1
    levels = {step: float(np.rint(step / 255 * top) / top) for step in (*_DARK_STEPS, *_MIDDLE_STEPS)}
    plan = [Exposure(f"honest-gray-{step:03d}", surface, "meter", P=((levels[step],) * N,)) for step in levels]
    low, high = levels[_MIDDLE_STEPS[_FLAT_LOW]], levels[_MIDDLE_STEPS[_FLAT_HIGH]]
    dark, full = (0.0,) * N, (1.0,) * N
    plan.append(Exposure("honest-checker", surface, "meter", P=((high,) * N, (low,) * N), mask="checker"))
    window = max(_LEAST_WINDOW, round(_SPOTS_A_WINDOW * spot_share, 2))
    if window <= _LARGEST_WINDOW:
        plan += [
            Exposure(f"honest-window-{name}", surface, "meter", P=(P, dark), mask=f"window {window:g}")
            for name, P in (("white", full), ("gray", (low,) * N))
        ]
    if camera:
        guide = guide_channel(channels)
        lit = tuple(1.0 if name == guide else 0.0 for name in channels)
        plan += [
            Exposure(f"honest-{mask}", surface, "camera", P=(lit, dark), channel=guide, mask=mask)
            for mask in ("columns", "rows")
        ]
    return plan


def judge(
    readings: Mapping[str, NDArray[np.float64]],
    channels: tuple[str, ...],
    surface: str,
    captures: Callable[[str], NDArray[np.uint16]] | None = None,
    camera_xy: NDArray[np.float32] | None = None,
) -> list[Finding]:
    """Ask every question whose readings are there.

    Parameters
    ----------
    readings : dict of exposure name -> (81,) array
    channels : tuple of str
    surface : str
        The one that the ramps were measured on.
    captures, camera_xy : optional
        Pictures by name, and the guide channel's lookup table (H, W, 2): for the pictures of single pixels.

    Returns
    -------
    list of Finding
    """
    Y = {name: float(spectra_to_XYZ(spectrum)[1]) for name, spectrum in readings.items()}
    black = Y.get(f"read-{surface}-black", np.nan)

    def light(name: str) -> float:
        """Above the black level; NaN where there is no such reading."""
        return Y.get(name, np.nan) - black

    def alone(step: int) -> float:
        """Of the channels one by one at a step of their ramps."""
        return sum(light(f"ramp-{surface}-{channel}-{step:02d}") for channel in channels)

    white = light(f"read-{surface}-white")
    gray = {step: light(f"honest-gray-{step:03d}") for step in (*_DARK_STEPS, *_MIDDLE_STEPS)}
    low, high = gray[_MIDDLE_STEPS[_FLAT_LOW]], gray[_MIDDLE_STEPS[_FLAT_HIGH]]
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = [_relative(gray[step], alone(k)) for step, k in zip(_MIDDLE_STEPS, _RAMP_STEPS_OF, strict=True)]
        several = len(channels) > 1
        findings = [
            _white(_relative(white, alone(RAMP_STEPS - 1)) if several else np.nan),
            _grays(max(middle, key=abs) if several else np.nan),
            _near_black([gray[step] for step in _DARK_STEPS], white),
            _surround(_relative(light("honest-window-white"), white), _relative(light("honest-window-gray"), low)),
            _neighbours(_relative(light("honest-checker"), 0.5 * (low + high))),
        ]
    if captures is not None and camera_xy is not None:
        findings.append(_single_pixels(captures, channels, surface, camera_xy))
    return [finding for finding in findings if np.isfinite(finding.figure)]


def honesty_figures(findings: list[Finding]) -> dict[str, Any]:
    """``{"word" (the worst), "findings": [...]}``, ready for JSON."""
    order: tuple[Word, ...] = ("honest", "noticeable", "dishonest")
    word = max((f.word for f in findings), key=order.index, default="honest")
    return {"word": word, "findings": [asdict(f) for f in findings]}


def _relative(measured: float, expected: float) -> float:
    return float(np.divide(measured, expected)) - 1.0


def _grade(deviation: float) -> Word:
    if abs(deviation) < _NOTICEABLE:
        return "honest"
    return "noticeable" if abs(deviation) < _DISHONEST else "dishonest"


def _white(deviation: float) -> Finding:
    word = _grade(deviation)
    found = f"full white has {1 + deviation:.1%} of the light of the channels alone"
    cures = {
        "honest": "light adds up",
        "noticeable": "a little cross-talk; the correction from extra readings takes care of it",
        "dishonest": "switch off white boost (BrilliantColor, white segment), eco and dynamic modes"
        if deviation > 0
        else "switch off colour management, power limits and eco modes: the channels take light from each other",
    }
    return Finding("white", word, deviation, f"{found}: {cures[word]}")


def _grays(deviation: float) -> Finding:
    word = _grade(deviation)
    found = f"grays have {1 + deviation:.1%} of the light of the channels alone, at worst"
    cures = {
        "honest": "light adds up at every level",
        "noticeable": "a little cross-talk; the correction from extra readings takes care of it",
        "dishonest": "switch off colour management, skin-tone and vivid modes, set the gamma of all channels alike",
    }
    return Finding("grays", word, deviation, f"{found}: {cures[word]}")


def _near_black(steps: list[float], white: float) -> Finding:
    """The first codes above black, rising: each must give more light than the one before."""
    rises = np.diff([0.0, *steps]) / white
    swallowed = int(np.sum(rises <= _INVISIBLE))
    if not np.all(np.isfinite(rises)):
        return Finding("near black", "honest", np.nan, "")
    codes = ", ".join(str(step) for step in _DARK_STEPS)
    if swallowed == 0:
        return Finding("near black", "honest", 0.0, f"codes {codes} of 255 are all told from black")
    word: Word = "noticeable" if swallowed < len(steps) else "dishonest"
    cure = "raise the brightness setting until code 8 shows" if word == "dishonest" else "the response curve holds it"
    return Finding(
        "near black",
        word,
        swallowed / len(steps),
        f"{swallowed} of the codes {codes} of 255 give no more light: {cure}",
    )


def _surround(white: float, gray: float) -> Finding:
    """The same spot in a dark frame and in a frame that is lit as a whole."""
    deviation = max((white, gray), key=abs) if np.isfinite([white, gray]).all() else np.nan
    word = _grade(deviation)
    found = f"a spot has {1 + deviation:.1%} of its light when the frame around it is dark"
    cures = {
        "honest": "a spot does not depend on the rest of the frame",
        "noticeable": "stray light, or a mild power limit; keep it in mind for pictures that are mostly dark",
        "dishonest": "switch off dynamic contrast, auto iris, lamp dimming and average-brightness limits",
    }
    return Finding("surround", word, deviation, f"{found}: {cures[word]}")


def _neighbours(deviation: float) -> Finding:
    """A checker of single pixels has the mean light of its two values."""
    word = _grade(deviation)
    if -_TAKEN < deviation <= -_DISHONEST:
        word = "noticeable"
    found = f"single pixels of two values have {1 + deviation:.1%} of the light of flat frames of them"
    cures = {
        "honest": "neighbouring pixels do not touch each other",
        "noticeable": "neighbours interact a little; the correction from extra readings takes care of it",
        "dishonest": "switch off sharpening, detail and edge enhancement"
        if deviation > 0
        else "neighbouring pixels take much light from each other (usual for liquid crystals): switch off noise "
        "reduction and smoothing, and leave the correction on",
    }
    return Finding("neighbours", word, deviation, f"{found}: {cures[word]}")


def _single_pixels(
    captures: Callable[[str], NDArray[np.uint16]],
    channels: tuple[str, ...],
    surface: str,
    camera_xy: NDArray[np.float32],
) -> Finding:
    """Modulation of stripes of single pixels over the field, as the camera sees it.

    Twice the stripes less full light, with the sign that was sent, over full light: 1 where pixels are sharp squares,
    less by the blur of projector, paper and camera. Where pixels were resampled it beats.
    """
    guide = guide_channel(channels)
    height, width = camera_xy.shape[:2]

    def nodal(name: str) -> NDArray[np.float32]:
        return warp_to_nodal(captures(name).astype(np.float32), camera_xy)

    dark = nodal(exposure_name(surface, "dark", guide, channels))
    light = nodal(exposure_name(surface, "full", guide, channels)) - dark
    worst, best, ripple = np.nan, np.nan, np.nan
    for mask in ("columns", "rows"):
        sign = np.where(mask_pixels(mask, width, height), 1.0, -1.0)
        stripes = nodal(f"honest-{mask}") - dark
        seen = np.isfinite(stripes) & np.isfinite(light) & (light > 0.1 * np.nanmax(light))
        modulation = np.where(seen, sign * (2.0 * stripes - light) / np.where(seen, light, 1.0), 0.0)
        whole = uniform_filter(seen.astype(np.float64), _WINDOW_PX)[::_STRIDE_PX, ::_STRIDE_PX] > 0.999
        if whole.any():
            local = uniform_filter(modulation, _WINDOW_PX)[::_STRIDE_PX, ::_STRIDE_PX]
            low, high = np.quantile(local[whole], (0.01, 0.99))
            if not ripple >= (here := _ripple(local, whole)):  # also from NaN
                worst, best, ripple = float(low), float(high), here
    found = f"single pixels are modulated by {worst:.0%} to {best:.0%} over the field"
    if best < _LEAST_MODULATION:
        return Finding(
            "single pixels",
            "noticeable",
            ripple,
            f"{found}: the camera cannot tell them; focus the projector, move the camera nearer (two of its pixels a "
            "projector pixel), and see that nothing scales the picture",
        )
    if ripple > _BEATS:
        return Finding(
            "single pixels",
            "dishonest",
            ripple,
            f"{found}, in beats: they are not shown one to one; send the native resolution, and switch off scaling, "
            "overscan, keystone correction and warping",
        )
    return Finding("single pixels", "honest", ripple, f"{found}: they are shown one to one")


def _ripple(local: NDArray[np.float64], whole: NDArray[np.bool_]) -> float:
    """How much the modulation falls within some dozen pixels, as a share of its highest there; the field's median."""
    size = _BEAT_PX // _STRIDE_PX
    highest = maximum_filter(np.where(whole, local, -np.inf), size)
    lowest = minimum_filter(np.where(whole, local, np.inf), size)
    told = whole & (highest > _LEAST_MODULATION)
    return float(np.median((highest - lowest)[told] / highest[told])) if told.any() else 0.0
