"""The measured correction: laws that it knows and one that it does not, and a world where it has to stay away."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from paxel_runtime.calibration import correct_model, prediction_error
from paxel_runtime.calibration.correction import LEAST_READINGS
from paxel_runtime.calibration.fit import fit_model
from paxel_runtime.captures.exposures import EXTRA_COUNT, Exposure, frame_codes, plan_readings
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM
from paxel_runtime.model.pattern import Pattern

RGB = ("red", "green", "blue")
Law = Callable[[np.ndarray], np.ndarray]


def plan_of(K: int, extra: int = EXTRA_COUNT) -> list[Exposure]:
    plan = plan_readings(RGB, (K,), bits=8, seed=0, surfaces=("pattern", "white"), extra=extra)
    return [e for e in plan if e.device == "meter"]


def world(plan: list[Exposure], K: int, law: Law, noise: float = 0.001, seed: int = 0) -> dict[str, np.ndarray]:
    """Readings of K clusters over a black level, whose light follows `law` (K, N) -> (K, N)."""
    rng = np.random.default_rng(seed)
    light = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))
    gain = {"white": np.ones(K), "pattern": np.linspace(0.1, 0.9, K)}
    readings = {}
    for e in plan:
        x = np.broadcast_to(np.array(e.P) ** 2.2, (K, 3))
        spectrum = np.einsum("i,ij,jw->w", gain[e.surface] / K, law(x), light) + 0.002
        readings[e.name] = spectrum * (1 + noise * rng.standard_normal())
    return readings


def linear(x: np.ndarray) -> np.ndarray:
    return x


def channels_and_clusters_interact(x: np.ndarray) -> np.ndarray:
    """What no reading of a single channel on a single cluster shows, of both kinds the terms are made of."""
    others = x.sum(axis=1, keepdims=True) - x
    return x * (1 - 0.03 * others) - 0.05 * np.abs(x - x[::-1])


def darker_beside_dark(x: np.ndarray) -> np.ndarray:
    """A cluster alone has dark neighbours, which makes every measured column too small."""
    return x - 0.15 * np.maximum(0, x - x[::-1]) ** 2


def outside_every_basis(x: np.ndarray) -> np.ndarray:
    return x * (1 - 0.12 * np.sin(5 * x.mean()) ** 2)


@pytest.mark.parametrize("K", [2, 3])
def test_a_law_among_the_terms_is_learnt_down_to_the_noise(K: int) -> None:
    plan = plan_of(K)
    readings = world(plan, K, channels_and_clusters_interact)
    plain = fit_model(readings, plan, RGB, tuple("abc"[:K]))
    model, figures = correct_model(plain, readings, plan)
    assert figures is not None
    assert figures["readings"] == EXTRA_COUNT
    assert figures["correction"]["used"]
    before, after = (prediction_error(m, readings, plan) for m in (plain, model))
    for surface in ("pattern", "white"):
        assert before[surface]["dE00_mean"] > 0.4
        # 0.1 % of level noise is dE00 0.05 in the test, and as much again in each of the readings it is learnt from
        assert after[surface]["dE00_mean"] < 0.12
        stated = figures["correction"][surface]
        assert stated["dE00_mean_after"] == pytest.approx(after[surface]["dE00_mean"], abs=0.05)


def test_a_law_outside_the_terms_is_smoothed() -> None:
    plan = plan_of(2, extra=120)
    readings = world(plan, 2, outside_every_basis, noise=0.0)
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    model, figures = correct_model(plain, readings, plan)
    assert figures is not None
    assert figures["correction"]["residual"]
    assert model.correction is not None
    assert len(model.correction.centres) >= 120
    before, after = (prediction_error(m, readings, plan) for m in (plain, model))
    for surface in ("pattern", "white"):
        assert after[surface]["dE00_mean"] < 0.5 * before[surface]["dE00_mean"]


@pytest.mark.parametrize("noise", [0.0, 0.002])
def test_where_the_world_is_linear_nothing_is_used(noise: float) -> None:
    plan = plan_of(2)
    readings = world(plan, 2, linear, noise=noise)
    if noise:  # the columns themselves are right: what is left is noise that cannot be learnt
        exact = world(plan, 2, linear, noise=0.0)
        readings |= {name: exact[name] for name in readings if not name.startswith(("extra", "random"))}
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    model, figures = correct_model(plain, readings, plan)
    assert model is plain
    assert figures is not None
    assert not figures["refined_A"]["used"]
    assert not figures["correction"]["used"]


def test_a_gain_within_its_own_error_is_not_used() -> None:
    plan = plan_of(2, extra=LEAST_READINGS)
    readings = world(plan, 2, linear, noise=0.03)
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    _, figures = correct_model(plain, readings, plan)
    assert figures is not None
    for part in ("refined_A", "correction"):
        if not figures[part]["used"]:
            assert figures[part]["gain_dE00"] <= max(2 * figures[part]["standard_error"], 0.02)
    assert not figures["correction"]["used"]


def test_few_extra_readings_change_nothing() -> None:
    plan = plan_of(2, extra=LEAST_READINGS - 1)
    readings = world(plan, 2, channels_and_clusters_interact)
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    assert correct_model(plain, readings, plan) == (plain, None)


def test_refining_alone_leaves_a_linear_model() -> None:
    plan = plan_of(2)
    readings = world(plan, 2, darker_beside_dark)
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    model, figures = correct_model(plain, readings, plan, linear_only=True)
    assert figures is not None
    assert "correction" not in figures
    assert model.correction is None
    assert figures["refined_A"]["used"]
    before, after = (prediction_error(m, readings, plan) for m in (plain, model))
    assert after["pattern"]["dE00_mean"] < before["pattern"]["dE00_mean"]


def test_one_surface_is_enough() -> None:
    plan = [e for e in plan_of(2) if e.surface == "white"]
    both = plan_of(2)
    readings = world(both, 2, channels_and_clusters_interact)
    model = fit_model(readings, both, RGB, ("a", "b"))
    alone = replace(model, pattern=model.surfaces["white"], white=None)
    renamed = [replace(e, surface="pattern") for e in plan]
    corrected, figures = correct_model(alone, readings | {"read-pattern-white": readings["read-white-white"]}, renamed)
    assert figures is not None
    assert corrected.correction is not None
    assert corrected.correction.surfaces == 1


def test_the_same_readings_give_the_same_correction() -> None:
    plan = plan_of(2)
    readings = world(plan, 2, channels_and_clusters_interact)
    plain = fit_model(readings, plan, RGB, ("a", "b"))
    first, second = (correct_model(plain, readings, plan)[0].correction for _ in range(2))
    assert first is not None
    assert second is not None
    assert np.array_equal(first.coefficients, second.coefficients)
    assert first.terms == second.terms


def test_the_virtual_bench_is_predicted_as_the_design_asks() -> None:
    """60 extra readings on `realistic`, K = 2: mean <= 0.2, 95 % <= 0.4, max <= 0.8 (issue: figures to reach)."""
    size = (320, 180)
    cells = np.array([[0, 1], [1, 0]], np.uint8)
    bench = VirtualBench(
        BenchSetup(
            pattern=Pattern("checkerboard", ("black", "white"), cells, 0.75, 30.0, (160.0, 100.0)),
            resolution=size,
            width_mm=size[0] * 140.6 / 960,
            channels=RGB,
            bits=8,
            camera_resolution=(320, 240),
            camera_bits=14,
            aperture_mm=20.0,
            quality="realistic",
            seed=0,
        )
    )
    labels = {2: (bench.truth.coverage()[..., 0] < 0.5).astype(np.uint8)}
    plan = plan_of(2)
    readings = {}
    for e in plan:
        bench.place(e.surface)
        bench.show(frame_codes(e, RGB, size, 8, labels))
        readings[e.name] = bench.measure()
    plain = fit_model(readings, plan, RGB, ("black", "white"))
    model, _ = correct_model(plain, readings, plan)
    for surface in ("pattern", "white"):
        linear_error, error = (prediction_error(m, readings, plan)[surface] for m in (plain, model))
        assert linear_error["dE00_mean"] <= 0.5
        assert error["dE00_mean"] <= 0.2
        assert error["dE00_p95"] <= 0.4
        assert error["dE00_max"] <= 0.8
