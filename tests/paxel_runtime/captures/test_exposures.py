"""The plan of a calibration: complete, unique, and each frame is what its exposure says."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.captures.exposures import (
    GRID_STEPS,
    RAMP_STEPS,
    RANDOM_COUNT,
    Exposure,
    cluster_counts,
    exposure_from_dict,
    exposure_to_dict,
    frame_codes,
    mask_pixels,
    plan_geometry,
    plan_readings,
    white_reading,
)

RGB = ("red", "green", "blue")
SIZE = (96, 54)


def _plan() -> list[Exposure]:
    return plan_geometry(RGB, SIZE) + plan_readings(RGB, (3, 2), bits=8, seed=1, surfaces=("pattern", "white"))


def test_names_are_unique_and_survive_json() -> None:
    plan = _plan()
    assert len({e.name for e in plan}) == len(plan)
    assert [exposure_from_dict(json.loads(json.dumps(exposure_to_dict(e)))) for e in plan] == plan


def test_readings_hold_what_table_one_needs() -> None:
    plan = [e for e in _plan() if e.device == "meter"]
    for surface in ("pattern", "white"):
        here = [e for e in plan if e.surface == surface]
        for K in (2, 3):
            singles = [e for e in here if e.clusters == K and e.name.startswith("read-")]
            assert sorted(np.ravel(e.P).tolist() for e in singles) == sorted(np.eye(3 * K).tolist())
            assert sum(e.clusters == K and e.name.startswith("random-") for e in here) == RANDOM_COUNT
    assert sum(e.name.startswith("ramp-") for e in plan) == RAMP_STEPS * len(RGB)


def test_the_surface_changes_only_twice() -> None:
    surfaces = [e.surface for e in _plan()]
    assert sum(a != b for a, b in itertools.pairwise(surfaces)) == 2


def test_random_projections_are_whole_codes_and_the_same_on_both_surfaces() -> None:
    tests = {e.name: np.array(e.P) for e in _plan() if e.name.startswith("random-")}
    for name, P in tests.items():
        assert np.allclose(P * 255, np.rint(P * 255), atol=1e-9)
        assert np.array_equal(P, tests[name.replace("white", "pattern")])


@given(st.integers(2, 5), st.integers(1, 4), st.integers(0, 1000))
def test_a_cluster_frame_lights_each_pixel_with_its_own_cluster(K: int, N: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, K, (SIZE[1], SIZE[0])).astype(np.uint8)
    labels[0, 0] = 255
    P = rng.integers(0, 256, (K, N)) / 255
    exposure = Exposure("x", "pattern", "meter", clusters=K, P=tuple(map(tuple, P.tolist())))
    codes = frame_codes(exposure, tuple("abcd"[:N]), SIZE, 8, {K: labels})
    assert np.array_equal(codes[0, 0], np.zeros(N))
    inside = labels != 255
    assert np.array_equal(codes[inside], np.rint(P * 255)[labels[inside]])


def test_structured_light_lights_one_channel_fully_or_not() -> None:
    for exposure in plan_geometry(RGB, SIZE):
        if exposure.light:
            codes = frame_codes(exposure, RGB, SIZE, 8, {})
            j = RGB.index(exposure.channel)
            assert set(np.unique(codes[..., j])) <= {0, 255}
            assert not codes[..., [m for m in range(3) if m != j]].any()


@pytest.mark.parametrize(("count", "colorants", "both"), [(3, 2, (3, 2)), (2, 2, (2, 3)), (8, 6, (8, 6))])
def test_another_count_is_measured_for_comparison(count: int, colorants: int, both: tuple[int, int]) -> None:
    assert cluster_counts(count, colorants) == both


def test_extra_readings_are_others_than_those_that_test() -> None:
    plan = plan_readings(RGB, (3, 2), bits=8, seed=1, surfaces=("pattern", "white"), extra=60)
    for surface in ("pattern", "white"):
        extra = [e for e in plan if e.name.startswith(f"extra-{surface}-K3-")]
        assert [e.name for e in extra] == [f"extra-{surface}-K3-{i:03d}" for i in range(60)]
        assert not {e.P for e in extra} & {e.P for e in plan if e.name.startswith("random-")}
    assert not any(e.name.startswith("extra-pattern-K2") for e in plan)
    # Asking for extra readings changes nothing of the others.
    assert [e for e in plan if not e.name.startswith(("extra-", "drift-"))] == [
        e for e in _plan() if e.device == "meter" or e.clusters if not e.name.startswith("drift-")
    ]


def test_three_inputs_are_tested_on_the_whole_grid() -> None:
    plan = plan_readings(("uv",), (3,), bits=8, seed=0, surfaces=("pattern",))
    grid = [e.P for e in plan if e.name.startswith("grid-pattern-K3-")]
    assert len(set(grid)) == len(grid) == GRID_STEPS**3  # 125 measurements, Table II
    assert {round(255 * v) for P in grid for row in P for v in row} == {0, 64, 128, 191, 255}
    assert not any(e.name.startswith("random-") for e in plan)
    assert white_reading(e.name for e in plan) == "read-pattern-white"


def test_a_gray_sheet_needs_the_paper_once() -> None:
    surfaces = ("pattern", "white", "paper")
    pictures = {e.name for e in plan_geometry(RGB, SIZE, surfaces) if e.surface == "paper"}
    assert pictures == {"paper-white", "paper-black", *(f"paper-{f}-{c}" for f in ("full", "dark") for c in RGB)}
    plan = plan_readings(RGB, (2,), bits=8, seed=0, surfaces=surfaces)
    assert [e.name for e in plan if e.surface == "paper"] == ["read-paper-white"]
    assert plan[0].name == white_reading(e.name for e in plan)  # it lies there already
    assert white_reading(["read-white-white", "read-pattern-white"]) == "read-white-white"


def test_the_camera_may_look_at_the_ramps() -> None:
    plan = plan_readings(RGB, (2,), bits=8, seed=0, surfaces=("pattern", "white"), ramps="camera")
    assert {e.device for e in plan if e.name.startswith("ramp-")} == {"camera"}


@pytest.mark.parametrize("mask", ["checker", "columns", "rows", "window 0.5"])
def test_masks_divide_the_frame(mask: str) -> None:
    inside = mask_pixels(mask, *SIZE)
    assert inside.shape == (SIZE[1], SIZE[0])
    expected = 0.25 if mask.startswith("window") else 0.5
    assert inside.mean() == pytest.approx(expected, abs=0.02)  # whole pixels of a frame of 96 x 54
    codes = frame_codes(Exposure("x", "white", "meter", P=((1.0,) * 3, (0.2,) * 3), mask=mask), RGB, SIZE, 8, {})
    assert set(np.unique(codes[inside])) == {255}
    assert set(np.unique(codes[~inside])) == {51}
    if mask.startswith("window"):
        assert np.array_equal(inside, inside[::-1, ::-1])
        assert inside[SIZE[1] // 2, SIZE[0] // 2]


def test_single_pixels_alternate() -> None:
    checker, columns, rows = (mask_pixels(mask, *SIZE) for mask in ("checker", "columns", "rows"))
    assert np.all(checker[:, 1:] != checker[:, :-1])
    assert np.all(checker[1:] != checker[:-1])
    assert np.all(columns[:, 1:] != columns[:, :-1])
    assert np.all(columns[1:] == columns[:-1])
    assert np.array_equal(mask_pixels("columns", SIZE[1], SIZE[0]).T, rows)


def test_structured_light_by_phase_has_as_many_pictures_with_levels_between() -> None:
    lines, phase = plan_geometry(RGB, SIZE), plan_geometry(RGB, SIZE, method="phase")
    assert [e.name.replace("-line-", "-phase-") for e in lines] == [e.name for e in phase]
    shown = next(e for e in phase if e.light == "phase-x-3" and e.channel == "red")
    codes = frame_codes(shown, RGB, SIZE, 8, {})
    place = np.arange(SIZE[0])
    # half a code of rounding, and where that is a tie float32 may go either way
    assert np.abs(codes[0, :, 0] - (127.5 + 127.5 * np.cos(2 * np.pi * (place - 6) / 16))).max() < 0.501
    assert np.all(codes == codes[:1])
    assert not codes[..., 1:].any()
