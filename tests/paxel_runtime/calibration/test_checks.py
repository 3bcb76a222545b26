"""Readings that cannot be right: each kind is found, named with its row, and told how to mend; right ones pass."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.calibration.checks import aperture_warning, check_readings
from paxel_runtime.calibration.fit import fit_model
from paxel_runtime.captures.exposures import plan_readings
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM

RGB = ("red", "green", "blue")
PLAN = plan_readings(RGB, (2,), bits=8, seed=0, surfaces=("pattern", "white"))
LIGHT = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))
INK = {"pattern": np.array([0.05, 0.9]), "white": np.array([1.0, 1.0])}

Readings = dict[str, NDArray[np.float64]]


def _readings() -> Readings:
    """A b/w pattern under a projector with a black level of 1/1000, in the order of the plan."""
    readings = {}
    for e in PLAN:
        if e.device == "meter":
            x = np.broadcast_to(np.array(e.P) ** 2.2, (2, 3)) + 0.001
            readings[e.name] = np.einsum("i,ij,jw->w", INK[e.surface] / 2, x, LIGHT)
    return readings


def _swap(readings: Readings, one: str, other: str) -> None:
    readings[one], readings[other] = readings[other], readings[one]


def _set(readings: Readings, name: str, spectrum: NDArray[np.float64]) -> None:
    readings[name] = spectrum


ROW = {name: row for row, name in enumerate(_readings(), 2)}


def test_right_readings_pass() -> None:
    check_readings(_readings(), PLAN, RGB, 2)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda r: r.pop("read-pattern-K2-1-red"), "1 readings are missing, the first is read-pattern-K2-1-red"),
        (
            lambda r: _set(r, "read-white-K2-0-green", np.full(81, np.nan)),
            rf"reading read-white-K2-0-green \(row {ROW['read-white-K2-0-green']}\) must hold finite numbers",
        ),
        (
            lambda r: _swap(r, "read-white-white", "read-pattern-white"),
            rf"read-white-white \(row {ROW['read-white-white']}\) must be brighter than reading read-pattern-white",
        ),
        (
            lambda r: _swap(r, "read-white-white", "read-white-black"),
            r"read-white-white .* must be brighter than reading read-white-black .* are rows mixed up",
        ),
        (
            lambda r: _swap(r, "read-white-K2-0-red", "read-white-K2-0-blue"),
            r"read-white-K2-0-red .* must have the spectrum of red, but looks like blue: are rows mixed up",
        ),
        (
            lambda r: _set(r, "read-pattern-K2-0-red", 5 * r["read-pattern-white"]),
            r"read-pattern-K2-0-red .* must be darker than full white, got 5\d\d%",
        ),
        (
            lambda r: [
                _set(r, f"read-white-K2-{i}-{c}", 0.2 * r[f"read-white-K2-{i}-{c}"]) for i in (0, 1) for c in RGB
            ],
            r"single clusters of K = 2 on white must add up to about full white, got 20%",
        ),
    ],
)
def test_wrong_readings_are_named(spoil: Callable[[Readings], object], says: str) -> None:
    readings = _readings()
    spoil(readings)
    with pytest.raises(CalibrationError, match=says) as error:
        fit_model(readings, PLAN, RGB, ("black", "white"))
    assert "paxel capture" in str(error.value)  # the cure


def test_a_gray_sheet_may_be_darker_than_the_pattern_and_paper_is_the_white_point() -> None:
    plan = plan_readings(RGB, (2,), bits=8, seed=0, surfaces=("pattern", "white", "paper"))
    readings = _readings()
    for name in [name for name in readings if "-white-" in name]:
        readings[name] = 0.3 * readings[name]
    readings["read-paper-white"] = np.ones(3) @ LIGHT
    model = fit_model(readings, plan, RGB, ("black", "white"))
    assert model.white is not None
    # Full white on the sheet: 0.3 of the paper's, the black level of 1/1000 included.
    assert model.white.predict_XYZ(np.ones(6))[1] == pytest.approx(0.3 * 1.001)
    assert model.white_point[1] == pytest.approx(1.0)
    readings["read-paper-white"] = 0.1 * readings["read-paper-white"]
    with pytest.raises(CalibrationError, match=r"read-paper-white .* must be brighter than reading read-pattern-white"):
        fit_model(readings, plan, RGB, ("black", "white"))


def test_the_meters_spot_covers_many_periods() -> None:
    assert aperture_warning(20.0, 0.75, 2) == ""
    text = aperture_warning(5.0, 0.75, 2)  # a period is sqrt(2) dots: 1.06 mm
    assert "at least 8 periods of the pattern (8.5 mm), got 5 mm = 4.7 periods" in text
    with pytest.raises(CalibrationError, match=r"got 2 mm = 1\.9 periods"):
        aperture_warning(2.0, 0.75, 2)
