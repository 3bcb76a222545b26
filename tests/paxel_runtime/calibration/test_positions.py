"""Readings at several positions: what is taken out by the local white, what is left, and what a model makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.calibration.checks import check_readings
from paxel_runtime.calibration.drift import correct_drift
from paxel_runtime.calibration.fit import fit_model
from paxel_runtime.calibration.positions import local_white_gain, moved_to_mean, position_spread
from paxel_runtime.captures.exposures import frame_codes, plan_readings
from paxel_runtime.captures.meter_positions import at_positions, meter_positions_mm
from paxel_runtime.devices.bench_qualities import QUALITIES
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import CalibrationError
from paxel_runtime.model.colorimetry import WAVELENGTHS_NM, spectra_to_XYZ
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.settings import make_settings

RGB = ("red", "green", "blue")
LIGHT = np.exp(-(((WAVELENGTHS_NM - np.array([[620.0], [540.0], [460.0]])) / 25) ** 2))
INK = {"pattern": np.array([0.05, 0.9]), "white": np.array([1.0, 1.0])}
CENTRE_PLAN = plan_readings(RGB, (2, 3), bits=8, seed=0, surfaces=("pattern", "white"))
PLAN = at_positions(CENTRE_PLAN, 5, 2)
POSITIONS_MM = [(0.0, 0.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)]
Readings = dict[str, NDArray[np.float64]]


def _readings(level: tuple[float, ...] = (1.0, 0.8, 0.7, 0.9, 0.6), ink: tuple[float, ...] = (1.0,) * 5) -> Readings:
    """A b/w pattern under a light of some level at each position, and `ink` times as much light from the black ink."""
    readings = {}
    for e in PLAN:
        if e.device == "meter":
            x = np.array(e.P) ** 2.2 + 0.001
            K = max(len(x), 2)
            of_cluster = np.interp(np.arange(K), [0, K - 1], INK[e.surface])
            of_cluster[0] *= ink[e.position] if e.surface == "pattern" else 1.0
            x = np.broadcast_to(x, (K, 3)) * level[e.position]
            readings[e.name] = np.einsum("i,ij,jw->w", of_cluster / K, x, LIGHT)
    return readings


def test_the_same_print_under_uneven_light_is_one_model() -> None:
    """A light that only falls off is taken out to rounding; the white point stays the centre's."""
    readings = _readings()
    centre = fit_model(readings, CENTRE_PLAN, RGB, ("black", "white"))
    model = fit_model(readings, PLAN, RGB, ("black", "white"))
    for surface in ("pattern", "white"):
        np.testing.assert_allclose(model.surfaces[surface].A, centre.surfaces[surface].A, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(model.surfaces[surface].black, centre.surfaces[surface].black, rtol=1e-12)
    np.testing.assert_array_equal(model.white_point, centre.white_point)
    spread = position_spread(readings, PLAN, RGB, 2, POSITIONS_MM)
    assert spread["white_percent"] == pytest.approx([100, 80, 70, 90, 60])
    for figures in spread["surfaces"].values():
        assert figures["as_read"]["dE00_mean"] > 1.0
        assert figures["local_white"]["dE00_max"] < 1e-6  # rounding


def test_the_mean_print_is_the_model_and_what_differs_is_the_spread() -> None:
    """A of black is the mean of the inks, where 0.6 to 1.4 of it is read; white paper has no spread."""
    ink = (1.0, 0.6, 1.4, 1.4, 1.2)
    readings = _readings(ink=ink)
    model = fit_model(readings, PLAN, RGB, ("black", "white"))
    even = fit_model(_readings(), PLAN, RGB, ("black", "white"))
    np.testing.assert_allclose(model.pattern.A[:, :3], np.mean(ink) * even.pattern.A[:, :3], rtol=1e-12)
    np.testing.assert_allclose(model.pattern.A[:, 3:], even.pattern.A[:, 3:], rtol=1e-9)
    spread = position_spread(readings, PLAN, RGB, 2, POSITIONS_MM)["surfaces"]
    by_position = spread["pattern"]["local_white"]["dE00_by_position"]
    assert np.argmax(by_position) == 1  # 0.6 is farthest from the mean, 1.12
    assert np.argmin(by_position) == 4  # 1.2 is next to it
    assert spread["white"]["local_white"]["dE00_max"] < 1e-6


def test_what_was_refined_at_the_centre_is_moved_to_the_mean() -> None:
    """Without refinement that is the fit of all positions; a refinement of A stays."""
    readings = _readings(ink=(1.0, 0.6, 1.4, 1.4, 1.2))
    centre, mean = (fit_model(readings, plan, RGB, ("black", "white")) for plan in (CENTRE_PLAN, PLAN))
    moved = moved_to_mean(centre, centre, mean)
    refined = replace(centre, pattern=replace(centre.pattern, A=1.01 * centre.pattern.A))
    change = moved_to_mean(refined, centre, mean).pattern.A - moved.pattern.A
    np.testing.assert_allclose(change, 0.01 * centre.pattern.A, rtol=1e-9, atol=1e-15)
    for surface in ("pattern", "white"):
        np.testing.assert_allclose(moved.surfaces[surface].A, mean.surfaces[surface].A, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(moved.surfaces[surface].black, mean.surfaces[surface].black, rtol=1e-12)


def test_one_position_and_a_K_for_comparison_are_the_centres() -> None:
    readings = _readings()
    assert position_spread(readings, CENTRE_PLAN, RGB, 2, POSITIONS_MM[:1]) == {}
    names = ("black", "black+white", "white")
    for plan in (CENTRE_PLAN, PLAN):
        model = fit_model(readings, plan, RGB, names)
        expected = spectra_to_XYZ(readings["read-pattern-K3-0-red"] - readings["read-pattern-black"])
        white = spectra_to_XYZ(readings["read-white-white"])[1]
        np.testing.assert_array_equal(model.pattern.A[:, 0], expected / white)


def test_a_white_without_blue_is_related_by_its_Y() -> None:
    """Where white has no Z to divide by, its Y tells the level."""
    line = np.where(WAVELENGTHS_NM == 680, 1.0, 0.0)
    red = {"read-white-white": line, "at-1-read-white-white": 0.5 * line}
    assert spectra_to_XYZ(line)[2] == 0.0
    np.testing.assert_allclose(local_white_gain(red, 1), 2.0)
    np.testing.assert_array_equal(local_white_gain(red, 0), 1.0)


def test_drift_is_told_by_the_centre_alone() -> None:
    """White is dimmer elsewhere; that is no drift. What was read there stays as it was read."""
    readings = _readings()
    corrected, figures = correct_drift(readings, PLAN)
    assert all(drift["range_percent"] < 1e-9 for drift in figures.values())
    assert all(np.array_equal(corrected[e.name], readings[e.name]) for e in PLAN if e.position)


@pytest.mark.parametrize(
    ("one", "other", "says"),
    [
        ("at-3-read-pattern-white", "at-3-read-pattern-black", "at-3-read-pattern-white .* must be brighter than"),
        ("at-2-read-white-K2-1-red", "at-2-read-white-K2-1-blue", "at-2-read-white-K2-1-red .* looks like blue"),
        ("at-4-read-white-K2-0-red", "at-4-read-white-white", "at-4-read-white-K2-0-red .* must be darker than full"),
    ],
)
def test_rows_that_are_mixed_up_elsewhere_are_named(one: str, other: str, says: str) -> None:
    readings = _readings()
    check_readings(readings, PLAN, RGB, 2)
    readings[one], readings[other] = readings[other], readings[one]
    with pytest.raises(CalibrationError, match=says):
        check_readings(readings, PLAN, RGB, 2)
    del readings[one]
    with pytest.raises(CalibrationError, match=f"1 readings are missing, the first is {one}"):
        check_readings(readings, PLAN, RGB, 2)


def _on_the_bench(quality: str) -> tuple[Readings, dict[str, object]]:
    """Readings of the bench at five positions, and their spread."""
    settings = make_settings(
        overrides={
            "projector.resolution": [480, 270],
            "projector.width_mm": 70.3,
            "pattern.size_mm": [80.0, 50.0],
            "meter.positions": 5,
            "meter.aperture_mm": 12.0,
        }
    )
    bench = VirtualBench(
        BenchSetup(
            pattern=Pattern(
                "checkerboard", ("black", "white"), np.array([[0, 1], [1, 0]], np.uint8), 0.75, 30.0, (80.0, 50.0)
            ),
            resolution=(480, 270),
            width_mm=70.3,
            channels=RGB,
            bits=8,
            camera_resolution=(1024, 768),
            camera_bits=14,
            aperture_mm=12.0,
            quality=quality,
            seed=0,
        )
    )
    labels = {2: (bench.truth.coverage()[..., 0] < 0.5).astype(np.uint8)}
    plan = [e for e in PLAN if e.name.startswith(("read-", "at-")) and e.device == "meter" and e.clusters in (0, 2)]
    positions_mm = meter_positions_mm(settings)
    readings = {}
    for e in plan:
        bench.place(e.surface)
        bench.aim(positions_mm[e.position])
        bench.show(frame_codes(e, RGB, (480, 270), 8, labels))
        readings[e.name] = bench.measure()
    return readings, position_spread(readings, plan, RGB, 2, positions_mm)


def test_fall_off_is_seen_and_taken_out_on_the_bench() -> None:
    """`realistic` loses 24 % at the corners as the square of the distance: 6 % half way to them."""
    _, spread = _on_the_bench("realistic")
    # the field's middle lies some millimetres beside the centre that the hands aimed at: 1.5 %
    half_way = 100 * (1 - QUALITIES["realistic"].fall_off / 4)
    assert spread["white_percent"] == pytest.approx([100, *[half_way] * 4], abs=1.5)
    for surface, left in (("white", 0.3), ("pattern", 0.75)):  # blur towards the corners mixes ink into its neighbours
        figures = spread["surfaces"][surface]
        assert figures["as_read"]["dE00_mean"] > 0.2
        assert figures["local_white"]["dE00_mean"] < left * figures["as_read"]["dE00_mean"]


def test_an_even_light_has_no_spread_but_that_of_counted_dots() -> None:
    """`ideal` has neither fall-off nor noise: what is left is how many dots of each ink a spot of 11 periods covers."""
    _, spread = _on_the_bench("ideal")
    assert spread["white_percent"] == pytest.approx([100] * 5, abs=0.1)
    for figures in spread["surfaces"].values():
        assert figures["as_read"]["dE00_max"] < 0.3
        assert figures["local_white"]["dE00_mean"] == pytest.approx(figures["as_read"]["dE00_mean"], abs=0.01)
