"""Figures of accuracy: what the readings say and nothing else; errors are blamed on the input that has them."""

from dataclasses import replace

import numpy as np
import pytest

from paxel_runtime.calibration import (
    accuracy_picture,
    compare_colors,
    error_by_input,
    error_figures,
    fit_model,
    noise_floor,
    prediction_error,
)
from paxel_runtime.captures.exposures import Exposure, plan_readings
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel

RGB = ("red", "green", "blue")
LIGHT = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))


def world(
    channels: tuple[str, ...], K: int, noise: float = 0.0
) -> tuple[list[Exposure], dict[str, np.ndarray], PredictionModel]:
    """Plan, readings and model of a linear world."""
    rng = np.random.default_rng(0)
    plan = plan_readings(channels, (K,), bits=8, seed=0, surfaces=("pattern", "white"))
    plan = [e for e in plan if e.device == "meter"]
    gain = {"white": np.ones(K), "pattern": np.linspace(0.1, 0.9, K)}
    readings = {}
    for e in plan:
        x = np.broadcast_to(np.array(e.P), (K, len(channels)))
        spectrum = np.einsum("i,ij,jw->w", gain[e.surface] / K, x, LIGHT[: len(channels)]) + 0.002
        readings[e.name] = spectrum * (1 + noise * rng.standard_normal())
    return plan, readings, fit_model(readings, plan, channels, tuple("abc"[:K]))


def test_the_figures_of_known_errors() -> None:
    figures = error_figures(np.arange(101) / 100)
    assert figures == pytest.approx({"dE00_mean": 0.5, "dE00_p95": 0.95, "dE00_max": 1.0})


def test_random_projections_test_large_models_and_the_grid_small_ones() -> None:
    plan, readings, model = world(RGB, 2)
    assert prediction_error(model, readings, plan)["n"] == 100
    plan, readings, model = world(("green",), 3)
    errors = prediction_error(model, readings, plan)
    assert errors["n"] == 5**3
    assert errors["pattern"]["dE00_max"] < 0.01  # the world is the model: what is left is the table of the response


def test_a_missing_reading_is_named() -> None:
    plan, readings, model = world(RGB, 2)
    del readings["random-white-K2-007"]
    with pytest.raises(CalibrationError, match="the reading random-white-K2-007 is missing; run: paxel capture"):
        compare_colors(model, readings, plan)
    with pytest.raises(CalibrationError, match="no test projection of K = 2 on pattern"):
        compare_colors(model, readings, [e for e in plan if not e.name.startswith("random")])


def test_an_error_is_blamed_on_its_cluster_and_channel() -> None:
    plan, readings, model = world(RGB, 2)
    A = model.pattern.A.copy()
    A[:, 4] *= 1.3  # green on the second cluster
    wrong = replace(model, pattern=SurfaceModel(A, model.pattern.black))
    blame = error_by_input(wrong, compare_colors(wrong, readings, plan))["pattern"]
    assert blame["per_channel"]["green"] == max(blame["per_channel"].values())
    assert blame["per_cluster"]["b"] > blame["per_cluster"]["a"]


def test_the_noise_floor_is_the_meters() -> None:
    noise = 0.004
    plan, readings, model = world(RGB, 2, noise)
    rng = np.random.default_rng(1)
    again = [Exposure(f"again-{i}", "white", "meter", P=((1.0,) * 3,)) for i in range(200)]
    white = readings["read-white-white"]
    readings |= {e.name: white * (1 + noise * rng.standard_normal()) for e in again}
    floor = noise_floor(model, readings, [e for e in plan if not e.name.startswith("drift")] + again)
    assert floor["white"]["readings"] == 201
    assert "pattern" not in floor  # nothing was read twice there
    # L* = 116 Y^(1/3) - 16: at white, 0.4 % of Y is dL* 116/3 * 0.004 = 0.155; S_L = 1.747; E|N(0,1)| = 0.798
    expected = 116 / 3 * noise / 1.747 * 0.798
    assert floor["white"]["dE00_mean"] == pytest.approx(expected, rel=0.15)  # 200 normal deviates: 5 % each sigma


def test_the_picture_shows_both_surfaces_and_the_worst_colours() -> None:
    plan, readings, model = world(RGB, 2, 0.02)
    tested = compare_colors(model, readings, plan)
    picture = accuracy_picture("a title", tested, tested, noise_floor(model, readings, plan))
    assert picture.dtype == np.uint8
    one = accuracy_picture("a title", {"white": tested["white"]}, {"white": tested["white"]}, {})
    assert picture.shape[0] > one.shape[0]
    bars = np.all(picture == (0x3A, 0x6E, 0xA5), axis=-1)  # the bars' colour: their area grows with the errors
    smaller = {s: replace(c, dE00=np.where(c.dE00 < c.dE00.max(), c.dE00 / 4, c.dE00)) for s, c in tested.items()}
    fewer = np.all(accuracy_picture("a title", smaller, smaller, {}) == (0x3A, 0x6E, 0xA5), axis=-1)
    assert 0 < fewer.sum() < 0.5 * bars.sum()
