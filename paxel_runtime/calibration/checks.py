"""Readings that cannot be right, found before a model is fitted to them: each named with its row and its cure.

Pure functions of readings by name. What is judged is only what no projector, paper or meter can do; how honest a
projector is stands in ``captures/honesty.py``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure
from paxel_runtime.captures.meter_positions import at_position
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import spectra_to_XYZ

__all__ = ["aperture_warning", "check_readings", "described"]

LEAST_PERIODS = 8
"""Periods across the meter's aperture from which its reading is the mean of the pattern, and not of a few dots."""

_HOPELESS_PERIODS = 2

_SUM_LOW, _SUM_HIGH = 0.4, 1.6
"""Light of all single clusters together as a share of full white: beyond, rows are mixed up or the sheet moved. The
worst projector of the bench, with cross-talk, dimming and fringing, and a pattern that does not fill the spot, gives
0.9 to 1.4."""
_DARKER = 0.98
_UNLIKE = 0.9
_FAINT = 0.02

Readings = Mapping[str, NDArray[np.float64]]


def described(name: str, readings: Readings) -> str:
    """A reading as an error names it: with its row in the table it was read from (the first line is the header's)."""
    row = next((i for i, other in enumerate(readings, 2) if other == name), None)
    return f"reading {name}" + (f" (row {row})" if row else "")


def check_readings(readings: Readings, plan: Iterable[Exposure], channels: tuple[str, ...], K: int) -> None:
    """Whether the readings of `K` clusters can be what the plan says.

    Raises
    ------
    CalibrationError
        If one is missing, holds NaN or no light, is darker than it can be, has another channel's colour, or if the
        single clusters do not add up to full white.
    """
    plan = [e for e in plan if e.device == "meter" and e.clusters in (0, K)]
    missing = [e.name for e in plan if e.name not in readings and not e.mask]
    if missing:
        raise CalibrationError(f"{len(missing)} readings are missing, the first is {missing[0]}; run: paxel capture")
    for e in plan:
        if e.name in readings and not np.all(np.isfinite(readings[e.name])):
            raise CalibrationError(
                f"{described(e.name, readings)} must hold finite numbers, got NaN or infinity: {_again([e.name])}"
            )
    Y = {name: float(spectra_to_XYZ(spectrum)[1]) for name, spectrum in readings.items()}
    surfaces = list(dict.fromkeys(e.surface for e in plan if e.name.endswith("-black")))
    positions = sorted({e.position for e in plan})
    for surface, position in product(surfaces, positions):
        white, black = (at_position(f"read-{surface}-{level}", position) for level in ("white", "black"))
        if not Y[white] > Y[black]:
            raise CalibrationError(
                f"{described(white, readings)} must be brighter than {described(black, readings)}, got "
                f"Y = {Y[white]:.4g} and {Y[black]:.4g}: are rows mixed up? {_again([white, black])}"
            )
    _check_white_is_brightest(readings, Y, channels)
    places = list(dict.fromkeys((e.surface, e.position) for e in plan if e.clusters))
    for surface, position in places:
        _check_singles(readings, Y, surface, channels, K, position)
    _check_colors(readings, places, channels, K)


def aperture_warning(aperture_mm: float, dot_size_mm: float, colorants: int) -> str:
    """What is wrong with a spot of this diameter on a pattern; empty if nothing is.

    Parameters
    ----------
    aperture_mm : float
    dot_size_mm : float
    colorants : int
        Their number C: a period of the pattern is as wide as sqrt(C) dots (C dots fill its cell).

    Raises
    ------
    CalibrationError
        If the spot is not even two periods wide: then a reading tells where the spot lies, and nothing else.
    """
    period_mm = dot_size_mm * float(np.sqrt(colorants))
    periods = aperture_mm / period_mm
    if periods >= LEAST_PERIODS:
        return ""
    text = (
        f"meter.aperture_mm must cover at least {LEAST_PERIODS} periods of the pattern "
        f"({LEAST_PERIODS * period_mm:.1f} mm), got {aperture_mm:g} mm = {periods:.1f} periods: readings depend on "
        "where the spot lies; move the meter back or take a larger aperture"
    )
    if periods < _HOPELESS_PERIODS:
        raise CalibrationError(text)
    return text


def _again(names: list[str]) -> str:
    rows = " and ".join(names)
    return f"take {rows} out of captures/measurements.csv, then run: paxel capture"


def _check_white_is_brightest(readings: Readings, Y: Mapping[str, float], channels: tuple[str, ...]) -> None:
    """White paper is never darker than the print on it; under one UV channel it may be, and a gray sheet too."""
    reference = next((n for n in ("read-paper-white", "read-white-white") if n in readings), None)
    if reference is None or len(channels) == 1:
        return
    pattern = "read-pattern-white"
    if pattern in readings and Y[reference] < _DARKER * Y[pattern]:
        raise CalibrationError(
            f"{described(reference, readings)} must be brighter than {described(pattern, readings)}, got "
            f"{Y[reference]:.4g} and {Y[pattern]:.4g}: was the white sheet in place, and are both rows named right? "
            f"{_again([reference, pattern])}"
        )


def _check_singles(
    readings: Readings, Y: Mapping[str, float], surface: str, channels: tuple[str, ...], K: int, position: int
) -> None:
    """Single clusters are darker than full white, and together about as bright."""
    black, white = (Y[at_position(f"read-{surface}-{level}", position)] for level in ("black", "white"))
    names = [at_position(f"read-{surface}-K{K}-{i}-{c}", position) for i in range(K) for c in channels]
    light = np.array([Y[name] - black for name in names])
    brightest = int(np.argmax(light))
    if light[brightest] > _SUM_HIGH * (white - black):
        raise CalibrationError(
            f"{described(names[brightest], readings)} must be darker than full white, got "
            f"{light[brightest] / (white - black):.0%} of it: {_again([names[brightest]])}"
        )
    together = float(light.sum() / (white - black))
    if not _SUM_LOW <= together <= _SUM_HIGH:
        raise CalibrationError(
            f"the single clusters of K = {K} on {surface} must add up to about full white, got {together:.0%} of it: "
            "are rows mixed up, does the spot lie on the pattern, did the sheet move? Take all readings "
            f"{at_position(f'read-{surface}', position)}-... out of captures/measurements.csv, then run: paxel capture"
        )


def _check_colors(readings: Readings, places: Iterable[tuple[str, int]], channels: tuple[str, ...], K: int) -> None:
    """A single cluster's light has its own channel's spectrum, not another's."""
    if len(channels) < 2:
        return
    for surface, position in places:
        singles = [[at_position(f"read-{surface}-K{K}-{i}-{c}", position) for c in channels] for i in range(K)]
        black = readings[at_position(f"read-{surface}-black", position)]
        light = np.array([[readings[name] - black for name in row] for row in singles])
        shape = _channel_light(readings, channels)
        shape = light.sum(axis=0) if shape is None else shape
        shape = shape / np.maximum(np.linalg.norm(shape, axis=1, keepdims=True), 1e-30)
        strongest = float(np.linalg.norm(light, axis=-1).max())
        for i in range(K):
            for j, channel in enumerate(channels):
                size = float(np.linalg.norm(light[i, j]))
                likeness = shape @ light[i, j] / max(size, 1e-30)
                other = int(np.argmax(likeness))
                if size > _FAINT * strongest and other != j and likeness[j] < _UNLIKE * likeness[other]:
                    name = singles[i][j]
                    raise CalibrationError(
                        f"{described(name, readings)} must have the spectrum of {channel}, but looks like "
                        f"{channels[other]}: are rows mixed up? {_again([name])}"
                    )


def _channel_light(readings: Readings, channels: tuple[str, ...]) -> NDArray[np.float64] | None:
    """Spectrum of each channel at the end of its ramp, (N, w); None where the meter did not look at the ramps."""
    steps = [[name for name in readings if re.fullmatch(rf"ramp-\w+-{re.escape(c)}-\d+", name)] for c in channels]
    if not all(steps):
        return None
    light = np.array([readings[max(names)] - readings[min(names)] for names in steps])
    dead = np.linalg.norm(light, axis=1) < _FAINT * np.linalg.norm(light, axis=1).max()
    return None if dead.any() else light  # what is wrong with a dead channel is told where its ramp is fitted
