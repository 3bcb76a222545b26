"""The plan of a calibration: complete, unique, and each frame is what its exposure says."""

import itertools
import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from paxel_runtime.exposures import (
    RAMP_STEPS,
    RANDOM_COUNT,
    Exposure,
    cluster_counts,
    exposure_from_dict,
    exposure_to_dict,
    frame_codes,
    plan_geometry,
    plan_readings,
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
