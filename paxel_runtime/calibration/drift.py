"""Drift: how the light changed from one repetition of full white to the next, and a straight line taken out.

Each surface is a session of its own: the readings taken on it, in their order. Pure functions of readings by name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.captures.exposures import Exposure

__all__ = ["correct_drift"]

_LEAST_CHECKS = 4
"""Repetitions from which a slope can be told from the meter's noise."""

Readings = Mapping[str, NDArray[np.float64]]


def correct_drift(
    readings: Readings, plan: Iterable[Exposure]
) -> tuple[dict[str, NDArray[np.float64]], dict[str, dict[str, Any]]]:
    """Readings without the linear part of the light's drift, where repetitions of full white show that there is one.

    Readings beside the centre stay as they are: they are taken relative to the full white of their own position.
    Whether a line helps is decided by predicting each repetition from the others (leave-one-out), by the line and by
    their mean.

    Returns
    -------
    readings : dict
        All of them, in their order.
    figures : dict of surface -> dict
        ``{"checks", "range_percent" (highest to lowest level), "slope_percent" (over the session, by the line),
        "corrected", "rms_percent" (of the levels about what was taken out)}``.
    """
    plan = [e for e in plan if e.device == "meter" and e.name in readings and e.position == 0]
    corrected = dict(readings)
    figures: dict[str, dict[str, Any]] = {}
    for surface in dict.fromkeys(e.surface for e in plan):
        here = [e.name for e in plan if e.surface == surface]
        checks = [i for i, name in enumerate(here) if name.startswith((f"drift-{surface}-", f"read-{surface}-white"))]
        if len(checks) < 2:
            continue
        spectra = np.array([readings[here[i]] for i in checks])
        mean = spectra.mean(axis=0)
        level = spectra @ mean / (mean @ mean)
        time = np.array(checks) / max(len(here) - 1, 1)
        slope, offset = np.polyfit(time, level, 1) if len(checks) >= _LEAST_CHECKS else (0.0, 1.0)
        helps = len(checks) >= _LEAST_CHECKS and _left_out(time, level, 1) < _left_out(time, level, 0)
        line = offset + slope * time if helps else np.ones(len(time))
        if helps:
            for i, name in enumerate(here):
                corrected[name] = readings[name] / (offset + slope * i / max(len(here) - 1, 1))
        figures[surface] = {
            "checks": len(checks),
            "range_percent": 100 * float(np.ptp(level)),
            "slope_percent": 100 * float(slope),
            "corrected": bool(helps),
            "rms_percent": 100 * float(np.std(level - line)),
        }
    return corrected, figures


def _left_out(time: NDArray[np.float64], level: NDArray[np.float64], degree: int) -> float:
    """Mean square error of each level as predicted by a polynomial through the others."""
    errors = []
    for i in range(len(time)):
        others = np.arange(len(time)) != i
        errors.append(level[i] - np.polyval(np.polyfit(time[others], level[others], degree), time[i]))
    return float(np.mean(np.square(errors)))
