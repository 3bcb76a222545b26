"""Where the meter's spot lies, what is read there, and that a session moves it there."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from paxel_runtime.captures.acquisition import _Session, plan_exposures
from paxel_runtime.captures.exposures import exposure_from_dict, exposure_to_dict
from paxel_runtime.captures.meter_positions import at_positions, meter_positions_mm
from paxel_runtime.devices.base import Devices
from paxel_runtime.devices.virtual import BenchSetup, VirtualBench
from paxel_runtime.errors import SettingsError
from paxel_runtime.installation import Installation
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.settings import Settings, make_settings


def _settings(positions: int, **keys: object) -> Settings:
    wide = {"pattern.size_mm": [600.0, 400.0], "projector.width_mm": 800.0, "projector.resolution": [1600, 900]}
    return make_settings(overrides=wide | {"meter.positions": positions, **keys})


def test_positions_are_half_way_to_the_rim_of_what_is_smaller() -> None:
    assert meter_positions_mm(_settings(1)) == [(0.0, 0.0)]
    five, nine = (meter_positions_mm(_settings(count)) for count in (5, 9))
    # 600 x 400 mm of pattern under 800 x 450 mm of light: the corners are at (300, 200)
    assert five == [(0, 0), (-150, 100), (150, 100), (150, -100), (-150, -100)]
    assert nine[0] == (0, 0)
    assert set(nine) == {(x, y) for x in (-150, 0, 150) for y in (-100, 0, 100)}
    narrow = _settings(5, **{"projector.width_mm": 320.0})
    assert meter_positions_mm(narrow)[2] == (80, 45)


def test_spots_that_would_leave_the_field_are_refused() -> None:
    keys = {"pattern.size_mm": [60.0, 40.0]}
    assert _settings(1, **keys).meter.aperture_mm == 20.0
    with pytest.raises(SettingsError, match=r"meter\.aperture_mm is above 16 .*got 5 and 20"):
        _settings(5, **keys)
    with pytest.raises(SettingsError, match=r"meter\.positions"):
        _settings(4)


def test_one_position_changes_nothing(tmp_path: Path) -> None:
    plan = plan_exposures(Installation(tmp_path, _settings(1)))
    assert at_positions(plan, 1, 2) == plan
    assert all(e.position == 0 and "position" not in exposure_to_dict(e) for e in plan)


def test_only_the_models_readings_are_taken_everywhere_and_the_meter_moves_as_little_as_can_be(tmp_path: Path) -> None:
    one, five = (plan_exposures(Installation(tmp_path, _settings(count))) for count in (1, 5))
    assert [e for e in five if e.position == 0] == one
    assert len({e.name for e in five}) == len(five)
    assert [exposure_from_dict(exposure_to_dict(e)) for e in five] == five
    K = Settings().clusters.count
    for surface in ("pattern", "white"):
        for position in range(1, 5):
            names = {e.name for e in five if e.surface == surface and e.position == position}
            single = {f"read-{surface}-K{K}-{i}-{c}" for i in range(K) for c in ("red", "green", "blue")}
            expected = {f"read-{surface}-white", f"read-{surface}-black"} | single
            assert names == {f"at-{position}-{name}" for name in expected}
    stops = [(e.surface, e.position) for e in five if e.device == "meter"]
    moves = [after for before, after in pairwise(stops) if before != after]
    assert len(moves) == 2 * 4 + 1  # four on each surface, and back to the centre of the next


def _bench() -> VirtualBench:
    cells = np.array([[0, 1], [1, 0]], np.uint8)
    return VirtualBench(
        BenchSetup(
            pattern=Pattern("checkerboard", ("black", "white"), cells, 0.75, 30.0, (60.0, 40.0)),
            resolution=(240, 136),
            width_mm=35.2,
            channels=("red", "green", "blue"),
            bits=8,
            camera_resolution=(64, 48),
            camera_bits=14,
            aperture_mm=6.0,
            quality="ideal",
            seed=0,
        )
    )


def _upper_left() -> NDArray[np.uint8]:
    frame = np.zeros((136, 240, 3), np.uint8)
    frame[:68, :120] = 255
    return frame


def test_the_bench_reads_where_it_is_aimed_at() -> None:
    """+x right, +y up: of four spots in the quarters only the upper left sees its light, and the centre a fourth."""
    bench = _bench()
    bench.place("white")
    bench.show(_upper_left())
    light = {}
    for xy in ((0.0, 0.0), (-8.8, 5.0), (8.8, 5.0), (8.8, -5.0), (-8.8, -5.0)):
        bench.aim(xy)
        light[xy] = bench.measure().sum()
    full = light.pop((-8.8, 5.0))
    # `ideal` reads without noise; hands aim the projector up to some pixels beside the centre of a spot of 41 pixels
    assert light.pop((0.0, 0.0)) / full == pytest.approx(0.25, abs=0.1)
    assert max(light.values()) < 0.01 * full  # black level of 1/1000, and paper that scatters light
    bench.aim((0.0, 0.0))
    fresh = _bench()
    fresh.place("white")
    fresh.show(_upper_left())
    np.testing.assert_array_equal(bench.measure(), fresh.measure())


class _Recorder:
    """Devices that note where the meter stands when it measures."""

    def __init__(self) -> None:
        self.surface = ""
        self.aim_mm: tuple[float, float] | None = None
        self.aimed = 0
        self.measured: list[tuple[str, tuple[float, float] | None]] = []

    def show(self, codes: NDArray[np.unsignedinteger]) -> None:
        pass

    def capture(self, channel: str | None = None) -> NDArray[np.uint16]:
        return np.zeros((8, 8) if channel else (8, 8, 3), np.uint16)

    def place(self, surface: str) -> None:
        self.surface = surface

    def aim(self, position_mm: tuple[float, float]) -> None:
        self.aim_mm = position_mm
        self.aimed += 1

    def measure(self) -> NDArray[np.float64]:
        self.measured.append((self.surface, self.aim_mm))
        return np.ones(81)


def test_a_session_that_goes_on_aims_the_meter_before_it_measures(tmp_path: Path) -> None:
    settings = _settings(5, **{"projector.resolution": [64, 36]})
    plan = [e for e in plan_exposures(Installation(tmp_path, settings)) if e.device == "meter" and not e.clusters]
    positions_mm = meter_positions_mm(settings)
    half = next(i for i, e in enumerate(plan) if e.position == 3) + 1  # broken off at position 3, and gone on there
    for part in (plan[:half], plan):
        bench = _Recorder()
        session = _Session(
            Installation(tmp_path, settings),
            Devices(projector=bench, camera=bench, meter=bench, operator=bench),
            tmp_path,
            lambda message, done, total: None,
            len(part),
        )
        session.take(part, labels={})
        here = part if len(part) == half else plan[half:]
        assert bench.measured == [(e.surface, positions_mm[e.position]) for e in here]
        assert bench.aimed == 1 + sum(a.position != b.position for a, b in pairwise(here))
