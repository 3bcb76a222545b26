"""The paper's way, kept as a reference: predict an even grid of inputs, and mark each colour that shows the effect.

Section V-A1, after Pjanic and Hersch: 21 steps an input, 21^6 = 85,766,121 of them for three channels and two
clusters (the text misprints the number); colours are marked in CIELAB cells of a unit. It misses the cells that no
sample falls into, and n = 9 inputs would take 8e11 samples. Inputs are streamed: memory is that of the cells.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numba
import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_design.gamut.gray_sets import gray_relation
from paxel_design.gamut.joint import JointGamut
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_LCh, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00
from paxel_runtime.model.effects import CHROMA_FLOOR, Decolorize, Effect, Full, HueShift, Monochrome, Neutralize
from paxel_runtime.model.subgamut import SURFACES, LabField, SubGamut

__all__ = ["PAPER_STEPS", "sampled_figures", "sampled_gamut"]

PAPER_STEPS = 21
"""Steps of each input, ends included."""

_CELL = 1.0
_ORIGIN = np.array([-2.0, -160.0, -160.0])
_CELLS = (130, 321, 321)
_TOLERANCE = 2.0
"""The paper's dE00 for effects whose own tolerance is 0: a sample never hits a single colour."""

_CHUNK = 1 << 16

_Condition = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.bool_]]


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
    condition = _condition(joint, effect, shown_on)
    own = model.surfaces[shown_on]
    other = model.surfaces.get(SURFACES[1 - SURFACES.index(shown_on)], own)
    cells = np.zeros(_CELLS, bool)

    def run(first: int) -> int:
        x = _grid_inputs(first, min(_CHUNK, total - first), steps, model.n)
        Lab = np.asarray(XYZ_to_Lab(x @ own.A.T + own.black, model.white_point), np.float64)
        keep = condition(Lab, np.asarray(XYZ_to_Lab(x @ other.A.T + other.black, model.white_point), np.float64))
        cells[tuple(np.rint((Lab[keep] - _ORIGIN) / _CELL).astype(int).T)] = True
        return len(x)

    done = 0
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        for count in pool.map(run, range(0, total, _CHUNK)):
            done += count
            progress(done, total)
    field = LabField(_ORIGIN, _CELL, np.where(cells, np.float32(1), np.float32(-1)))
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


def _condition(joint: JointGamut, effect: Effect, shown_on: str) -> _Condition:
    """(own Lab, partner's Lab) (k, 3) -> whether the pair shows the effect (k,)."""
    if isinstance(effect, Full | Monochrome):
        return lambda own, partner: np.ones(len(own), bool)
    if isinstance(effect, Neutralize):
        wanted = np.array(effect.Lab)
        return lambda own, partner: dE00(partner, wanted) <= (effect.tolerance or _TOLERANCE)
    if isinstance(effect, Decolorize):
        slope, base = gray_relation(joint, shown_on) if effect.lightness == "relative" else (1.0, 0.0)

        def is_gray(own: NDArray[np.float64], partner: NDArray[np.float64]) -> NDArray[np.bool_]:
            gray = np.zeros_like(partner)
            gray[:, 0] = partner[:, 0]
            if effect.lightness != "free":
                Y = slope * np.maximum((own[:, 0] + 16) / 116, 0) ** 3 + base
                gray[:, 0] = 116 * np.cbrt(Y) - 16
            return dE00(partner, gray) <= (effect.tolerance or _TOLERANCE)

        return is_gray
    if isinstance(effect, HueShift):
        band = np.inf if effect.lightness_band is None else effect.lightness_band

        def is_turned(own: NDArray[np.float64], partner: NDArray[np.float64]) -> NDArray[np.bool_]:
            LCh, partner_LCh = Lab_to_LCh(own), Lab_to_LCh(partner)
            turn = np.abs((partner_LCh[:, 2] - LCh[:, 2] + 180) % 360 - 180)
            near = np.abs(partner[:, 0] - own[:, 0]) <= band
            return (turn >= effect.angle_deg) & (partner_LCh[:, 1] >= CHROMA_FLOOR) & near

        return is_turned
    raise InputError(
        f"effect {effect.text} is no condition on single pairs of colours; method sampling knows: "
        "full, monochrome, hue-shift, decolorize, neutralize"
    )


@njit(cache=True, nogil=True)
def _grid_inputs(first: int, count: int, steps: int, n: int) -> NDArray[np.float64]:
    """Inputs number first, first + 1, ... of the grid, the last input changing fastest: (count, n)."""
    x = np.empty((count, n))
    for i in range(count):
        rest = first + i
        for j in range(n - 1, -1, -1):
            x[i, j] = (rest % steps) / (steps - 1)
            rest //= steps
    return x
