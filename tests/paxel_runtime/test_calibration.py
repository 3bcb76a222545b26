"""The fit of the prediction model from readings: exact where the world is linear, and each error has its cure."""

import numpy as np
import pytest

from paxel_runtime.calibration import fit_model, pattern_area, prediction_error
from paxel_runtime.captures.exposures import plan_readings
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.pattern import Pattern

RGB = ("red", "green", "blue")
PLAN = plan_readings(RGB, (2, 3), bits=8, seed=0, surfaces=("pattern", "white"))
GAMMA = np.array([2.0, 2.2, 1.8])


def _linear_world(noise: float = 0.0, seed: int = 0) -> dict[str, np.ndarray]:
    """Readings of a world that is the model: each cluster adds its own spectrum, over a black level."""
    rng = np.random.default_rng(seed)
    peaks_nm = np.array([620.0, 540.0, 460.0])
    light = np.exp(-(((WAVELENGTHS_NM - peaks_nm[:, None]) / 25) ** 2))
    share = {2: np.array([0.4, 0.6]), 3: np.array([0.3, 0.4, 0.3])}
    gain = {
        "white": {K: np.ones(K) for K in share},
        "pattern": {2: np.array([0.1, 0.8]), 3: np.array([0.05, 0.4, 0.9])},
    }
    readings = {}
    for e in PLAN:
        if e.device != "meter":
            continue
        x = np.array(e.P) ** GAMMA
        K = e.clusters or 2
        x = np.broadcast_to(x, (K, 3))
        spectrum = 7.0 * np.einsum("i,i,ij,jw->w", share[K], gain[e.surface][K], x, light) + 0.02
        readings[e.name] = spectrum * (1 + noise * rng.standard_normal())
    return readings


def test_a_linear_world_is_predicted_exactly() -> None:
    readings = _linear_world()
    model = fit_model(readings, PLAN, RGB, ("black", "white"))
    errors = prediction_error(model, readings, PLAN)
    assert errors["n"] == 100
    # 33 ramp steps and PCHIP between them, tested at other codes: 0.02 dE00 is the interpolation of a gamma curve
    assert errors["pattern"]["dE00_max"] < 0.05
    assert errors["white"]["dE00_max"] < 0.05
    assert model.white_point[1] == pytest.approx(1.0)
    assert model.white is not None
    assert model.white.predict_XYZ(np.ones(6)) == pytest.approx(model.white_point, abs=1e-9)


def test_the_response_is_the_gamma_that_was_measured() -> None:
    model = fit_model(_linear_world(), PLAN, RGB, ("black", "white"))
    P = np.linspace(0, 1, 200)[:, None] * np.ones(3)
    assert model.response.P_to_x(P) == pytest.approx(P**GAMMA, abs=2e-4)  # PCHIP between 33 steps


def test_noise_never_makes_a_response_fall() -> None:
    model = fit_model(_linear_world(noise=0.02), PLAN, RGB, ("black", "white"))
    assert all(np.all(np.diff(curve) >= 0) for curve in model.response.linear)


def test_a_missing_reading_is_named() -> None:
    readings = _linear_world()
    del readings["read-white-K2-1-blue"]
    with pytest.raises(CalibrationError, match="read-white-K2-1-blue; run: paxel capture"):
        fit_model(readings, PLAN, RGB, ("black", "white"))


def test_a_dead_channel_is_named() -> None:
    readings = _linear_world()
    dark = readings["ramp-white-red-00"]
    readings |= {name: dark for name in readings if name.startswith("ramp-white-red")}
    with pytest.raises(CalibrationError, match="the red ramp gives no light"):
        fit_model(readings, PLAN, RGB, ("black", "white"))


@pytest.mark.parametrize("angle_deg", [0.0, 30.0])
def test_the_printed_area_is_found_to_half_a_dot(angle_deg: float) -> None:
    dot_px = 5.12
    pattern = Pattern(
        "checkerboard", ("black", "white"), np.array([[0, 1], [1, 0]], np.uint8), dot_px, angle_deg, (150.3, 100.7)
    )
    x, y = np.meshgrid(np.arange(240) - 119.5, np.arange(160) - 79.5)
    found = pattern_area(pattern.label(x, y) == 0, dot_px)
    outward = np.maximum(np.abs(x) - 150.3 / 2, np.abs(y) - 100.7 / 2)  # distance beyond the edge, corners apart
    assert not found[outward > 0.5 * dot_px].any()
    assert found[outward < -1.0 * dot_px].all()


def test_a_pattern_that_fills_the_frame_is_all_inside() -> None:
    ink = np.indices((60, 80)).sum(axis=0) // 5 % 2 == 0
    assert pattern_area(ink, 5.0).all()


def test_a_sheet_without_ink_is_answered() -> None:
    with pytest.raises(CalibrationError, match="is the pattern under the projection"):
        pattern_area(np.zeros((20, 20), bool), 5.0)
