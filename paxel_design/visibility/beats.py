"""Where a layout beats with a projector's raster: periods and directions of the stripes, as an explanation.

From the layout's lines and the raster's frequencies alone; how strong a beat is seen tells `moire`.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from paxel_design.visibility.spectrum import layout_spectrum
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Pattern

__all__ = ["SLOW_SHARE", "Beat", "beats"]

SLOW_SHARE = 0.35
"""Moire is what is slower than this many cycles a dot: half the fundamental of a checkerboard."""

_LINES = 60
"""Strongest lines of a layout that beats are looked for among."""

_MOST_LINES = 40_000
"""Cells times zones: beyond, as of blue noise, there are only a random layout's many faint lines."""


@dataclass(frozen=True)
class Beat:
    """One beat of a layout's line with the raster.

    Attributes
    ----------
    period_mm, direction_deg : float
        Distance from stripe to stripe, and the direction across them, counter-clockwise from +x.
    orders : (int, int)
        Of the raster, along x and y, that the line was folded by.
    line_per_mm : (float, float)
        The sum of two of the layout's lines.
    strength : float
        Product of the contrasts of the two.
    """

    period_mm: float
    direction_deg: float
    orders: tuple[int, int]
    line_per_mm: tuple[float, float]
    strength: float


def beats(pattern: Pattern, pitch_mm: float, count: int = 6, orders: int = 3) -> list[Beat]:
    """The slow beats of a layout with the raster, strongest first: why a picture shows stripes where it does.

    Which pixels are lit is one of the layout's lines folded by the raster, and the print multiplies it by another: so
    sums of two lines beat with multiples of the raster's frequency. An estimate of places; `moire` has the contrast.

    Parameters
    ----------
    pitch_mm : float
    count : int
        How many at most.
    orders : int
        Largest order of the raster, along x and y.

    Raises
    ------
    InputError
        If the pitch is not positive.
    """
    if not pitch_mm > 0:
        raise InputError(f"beats need pitch_mm > 0, got {pitch_mm}")
    # up to the raster's own frequency, where dots of several pixels have their higher harmonics
    zones = int(np.ceil(pattern.dot_size_mm / pitch_mm)) + 1
    spectrum = layout_spectrum(pattern, zones if pattern.cells.size * zones**2 <= _MOST_LINES else 0)
    strongest = np.argsort(spectrum.contrast)[::-1][:_LINES]
    lines = np.concatenate([spectrum.frequency_per_mm[strongest], -spectrum.frequency_per_mm[strongest]])
    contrast = np.tile(spectrum.contrast[strongest], 2)
    found: dict[tuple[int, int], Beat] = {}
    for a, b in combinations_with_replacement(range(len(lines)), 2):
        f = lines[a] + lines[b]
        m = np.rint(f * pitch_mm).astype(int)
        slow = f - m / pitch_mm
        length = float(np.hypot(*slow))
        if not m.any() or np.abs(m).max() > orders or not 1e-6 < length < SLOW_SHARE / pattern.dot_size_mm:
            continue
        if slow[0] < 0 or (slow[0] == 0 and slow[1] < 0):
            f, m, slow = -f, -m, -slow
        place = (round(float(slow[0]) * 1e4), round(float(slow[1]) * 1e4))
        strength = float(contrast[a] * contrast[b])
        if place not in found or strength > found[place].strength:
            direction = float(np.rad2deg(np.arctan2(slow[1], slow[0])))
            found[place] = Beat(1 / length, direction, (int(m[0]), int(m[1])), (float(f[0]), float(f[1])), strength)
    return sorted(found.values(), key=lambda beat: -beat.strength)[:count]
