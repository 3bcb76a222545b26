"""Drift: a straight line is found and taken out, noise is left alone."""

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.calibration.drift import correct_drift
from paxel_runtime.captures.exposures import Exposure, plan_readings
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

PLAN = plan_readings(("red", "green", "blue"), (3, 2), bits=8, seed=0, surfaces=("pattern", "white"))


def _readings(slope: float, noise: float) -> dict[str, NDArray[np.float64]]:
    rng = np.random.default_rng(0)
    readings = {}
    for surface in ("white", "pattern"):
        here = [e for e in PLAN if e.surface == surface and e.device == "meter"]
        for i, e in enumerate(here):
            level = 1 + slope * i / (len(here) - 1) + noise * rng.standard_normal()
            readings[e.name] = level * (0.1 + np.mean(e.P)) * np.ones(len(WAVELENGTHS_NM))
    return readings


def test_a_linear_drift_is_taken_out() -> None:
    corrected, figures = correct_drift(_readings(0.05, 1e-4), PLAN)
    steady = _readings(0.0, 1e-4)
    gain = np.array([corrected[name].mean() / steady[name].mean() for name in steady])
    # Levels are relative to the session's mean, which is the same for all of a surface; 1e-4 of noise is left.
    assert np.ptp(gain[: len(gain) // 3]) < 2e-3
    assert figures["white"]["corrected"]
    assert figures["white"]["slope_percent"] == pytest.approx(5.0, abs=0.2)
    assert figures["white"]["rms_percent"] < 0.05
    assert list(corrected) == list(steady)


def test_noise_is_no_drift() -> None:
    readings = _readings(0.0, 0.003)
    corrected, figures = correct_drift(readings, PLAN)
    for surface, figure in figures.items():
        if not figure["corrected"]:
            same = [e.name for e in PLAN if e.surface == surface and e.device == "meter"]
            assert all(np.array_equal(corrected[name], readings[name]) for name in same)
        # A line through eight readings with noise of 0.3 % has a slope of this order by chance.
        assert abs(figure["slope_percent"]) < 1.5
    assert not all(figure["corrected"] for figure in figures.values())


def test_without_repetitions_nothing_is_done() -> None:
    plan = [e for e in PLAN if not e.name.startswith("drift-")]
    readings = {e.name: np.ones(81) for e in plan if e.device == "meter"}
    assert correct_drift(readings, plan) == (readings, {})


def test_full_white_is_repeated_all_along() -> None:
    for surface in ("white", "pattern"):
        here: list[Exposure] = [e for e in PLAN if e.surface == surface and e.device == "meter"]
        places = [i for i, e in enumerate(here) if e.name.startswith("drift-")]
        assert np.diff([0, *places]).max() <= 51
        assert places[-1] == len(here) - 1
        assert all(here[i].P == ((1.0, 1.0, 1.0),) for i in places)
