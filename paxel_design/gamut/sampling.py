"""The paper's way, kept as a reference: predict an even grid of inputs, and mark each colour that shows the effect.

Section V-A1, after Pjanic and Hersch: 21 steps an input, 21^6 = 85,766,121 of them for three channels and two
clusters (the text misprints the number); colours are marked in CIELAB cells of a unit. It misses the cells that no
sample falls into, and n = 9 inputs would take 8e11 samples. Inputs are streamed: memory is that of the cells.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.joint import JointGamut
from paxel_runtime.errors import InputError
from paxel_runtime.gamut_mapping import luminance_relation
from paxel_runtime.model.delta_e import TRUE_dE00, squared_dE00_jet
from paxel_runtime.model.effects import CHROMA_FLOOR, Decolorize, Effect, Full, HueShift, Monochrome, Neutralize
from paxel_runtime.model.lab_scalars import root
from paxel_runtime.model.subgamut import SURFACES, LabField, SubGamut

__all__ = ["PAPER_STEPS", "sampled_figures", "sampled_gamut"]

PAPER_STEPS = 21
"""Steps of each input, ends included."""

_CELL = 1.0
_ORIGIN_L, _ORIGIN_AB = -2.0, -160.0
_CELLS = (130, 321, 321)
_TOLERANCE = 2.0
"""The paper's dE00 for effects whose own tolerance is 0: a sample never hits a single colour."""

_ROWS = 1 << 12
"""Rows of samples, along the last input, that a thread takes at once."""

_ANY, _NEAR_COLOR, _NEAR_GRAY, _TURNED = range(4)
"""What is asked of a pair; the numbers beside it in `_condition`."""


def sampled_gamut(
    joint: JointGamut,
    effect: Effect,
    shown_on: str = "pattern",
    *,
    steps: int = PAPER_STEPS,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> SubGamut:
    """The cells of CIELAB in which a sample showed the effect, as a field: 1 there and -1 elsewhere.

    Parameters
    ----------
    joint : JointGamut
    effect : Effect
        ``full``, ``monochrome``, ``hue-shift``, ``decolorize`` or ``neutralize``. The last two take their tolerance,
        or the paper's dE00 of 2 where it is 0.
    shown_on : {"pattern", "white"}
    steps : int
        Steps of each input, >= 2; steps**n samples are predicted.
    progress : callable
        Told (samples done, samples in all).

    Raises
    ------
    InputError
        If the effect has no condition here, or there would be more than 1e10 samples.
    """
    model = joint.model
    total = steps**model.n
    if steps < 2 or total > 10**10:
        raise InputError(
            f"sampling needs 2 or more steps and at most 1e10 samples, got {steps} steps of {model.n} inputs, "
            f"{total:.3g} samples; use the exact method"
        )
    kind, numbers = _condition(joint, effect, shown_on)
    own = model.surfaces[shown_on]
    other = model.surfaces.get(SURFACES[1 - SURFACES.index(shown_on)], own)
    cells = np.zeros(_CELLS, bool)
    sides = [np.ascontiguousarray(a, np.float64) for s in (own, other) for a in (s.A, s.black)]
    rows = total // steps

    def run(first: int) -> int:
        count = min(_ROWS, rows - first)
        _mark(first, count, steps, *sides, model.white_point, kind, numbers, cells)
        return count * steps

    done = 0
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        for count in pool.map(run, range(0, rows, _ROWS)):
            done += count
            progress(done, total)
    origin = np.array([_ORIGIN_L, _ORIGIN_AB, _ORIGIN_AB])
    field = LabField(origin, _CELL, np.where(cells, np.float32(1), np.float32(-1)))
    name = f"{effect.name}_sampled"
    return SubGamut(name, shown_on, *joint.surface(shown_on), model.white_point, field)


def sampled_figures(gamut: SubGamut) -> dict[str, Any]:
    """The figures of a sampled sub-gamut: its volume is the number of marked cells of one cubic unit."""
    assert gamut.field is not None
    return {
        "effect": gamut.effect,
        "shown_on": gamut.shown_on,
        "volume": float(np.count_nonzero(gamut.field.values > 0)) * _CELL**3,
        "sampled": True,
        "mesh": None,
        "method": "sampling of inputs, cells of one CIELAB unit",
    }


def _condition(joint: JointGamut, effect: Effect, shown_on: str) -> tuple[int, NDArray[np.float64]]:
    """What is asked of a pair, and its numbers: (4,) float64."""
    if isinstance(effect, Full | Monochrome):
        return _ANY, np.zeros(4)
    if isinstance(effect, Neutralize):
        return _NEAR_COLOR, np.array([*effect.Lab, effect.tolerance or _TOLERANCE])
    if isinstance(effect, Decolorize):
        surfaces = joint.model.surfaces
        other = surfaces[SURFACES[1 - SURFACES.index(shown_on)]]
        slope, base = luminance_relation(surfaces[shown_on], other) if effect.lightness == "relative" else (1.0, 0.0)
        free = effect.lightness == "free"
        return _NEAR_GRAY, np.array([np.nan if free else slope, base, 0.0, effect.tolerance or _TOLERANCE])
    if isinstance(effect, HueShift):
        band = np.inf if effect.lightness_band is None else effect.lightness_band
        return _TURNED, np.array([np.deg2rad(effect.angle_deg), CHROMA_FLOOR, band, 0.0])
    raise InputError(
        f"effect {effect.text} is no condition on single pairs of colours; method sampling knows: "
        "full, monochrome, hue-shift, decolorize, neutralize"
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _mark(
    first: int,
    count: int,
    steps: int,
    A_own: NDArray[np.float64],
    b_own: NDArray[np.float64],
    A_other: NDArray[np.float64],
    b_other: NDArray[np.float64],
    white: NDArray[np.float64],
    kind: int,
    numbers: NDArray[np.float64],
    cells: NDArray[np.bool_],
) -> None:
    """Mark the cells of the samples of `count` rows, from number `first` on; the last input runs along a row."""
    n = A_own.shape[1]
    own, other = np.empty(3), np.empty(3)
    for i in range(first, first + count):
        rest = i
        own[:], other[:] = b_own, b_other
        for j in range(n - 2, -1, -1):
            x = (rest % steps) / (steps - 1)
            rest //= steps
            for c in range(3):
                own[c] += A_own[c, j] * x
                other[c] += A_other[c, j] * x
        for k in range(steps):
            x = k / (steps - 1)
            L, a, b = _Lab(own, A_own[:, n - 1], x, white)
            if kind != _ANY:
                q_L, q_a, q_b = _Lab(other, A_other[:, n - 1], x, white)
                if not _shows(kind, numbers, L, a, b, q_L, q_a, q_b):
                    continue
            cells[
                round((L - _ORIGIN_L) / _CELL),
                round((a - _ORIGIN_AB) / _CELL),
                round((b - _ORIGIN_AB) / _CELL),
            ] = True


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _shows(
    kind: int, numbers: NDArray[np.float64], L: float, a: float, b: float, q_L: float, q_a: float, q_b: float
) -> bool:
    """Whether the colour and its partner q show the effect."""
    if kind == _TURNED:
        if math.hypot(q_a, q_b) < numbers[1] or abs(q_L - L) > numbers[2]:
            return False
        # The angle between both, 0..pi: hues wrap by themselves.
        return math.atan2(abs(a * q_b - b * q_a), a * q_a + b * q_b) >= numbers[0]
    wanted_L, wanted_a, wanted_b = q_L, 0.0, 0.0
    if kind == _NEAR_COLOR:
        wanted_L, wanted_a, wanted_b = numbers[0], numbers[1], numbers[2]
    elif not math.isnan(numbers[0]):
        wanted_L = 116.0 * root(numbers[0] * ((L + 16.0) / 116.0) ** 3 + numbers[1]) - 16.0
    return squared_dE00_jet(wanted_L, wanted_a, wanted_b, q_L, q_a, q_b, TRUE_dE00)[0] <= numbers[3] ** 2


@njit(cache=True, nogil=True, error_model="numpy", inline="always")
def _Lab(
    start: NDArray[np.float64], along: NDArray[np.float64], x: float, white: NDArray[np.float64]
) -> tuple[float, float, float]:
    """CIELAB of the light start + x along."""
    fx = root((start[0] + along[0] * x) / white[0])
    fy = root((start[1] + along[1] * x) / white[1])
    fz = root((start[2] + along[2] * x) / white[2])
    return 116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)
