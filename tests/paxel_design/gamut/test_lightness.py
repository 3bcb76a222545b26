"""Lightness areas with closed forms, and the largest rectangle against brute force."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.gamut import JointGamut, lightness_area, lightness_figures
from paxel_design.gamut.lightness import L_to_Y, Y_to_L, largest_rectangle
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.model.prediction import PredictionModel

Models = Callable[..., PredictionModel]
PRIMARIES = linear_sRGB_to_XYZ(np.eye(3)).T


def brute_force_rectangle(corners: NDArray[np.float64], steps: int) -> float:
    """Largest rectangle on a grid of s0 and s1, by walking the polygon's edges at each s."""
    ends = np.array([corners[:, 0].min(), corners[:, 0].max()])
    s = np.clip(L_to_Y(np.linspace(*Y_to_L(ends), steps)), *ends)
    top, bottom = np.full(steps, -np.inf), np.full(steps, np.inf)
    for (s0, t0), (s1, t1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if s0 == s1:
            continue
        on_edge = (s >= min(s0, s1)) & (s <= max(s0, s1))
        t = t0 + (s[on_edge] - s0) / (s1 - s0) * (t1 - t0)
        top[on_edge], bottom[on_edge] = np.maximum(top[on_edge], t), np.minimum(bottom[on_edge], t)
    height = Y_to_L(np.minimum.outer(top, top)) - Y_to_L(np.maximum.outer(bottom, bottom))
    width = np.subtract.outer(Y_to_L(s), Y_to_L(s))
    return float(np.max(np.maximum(width, 0) * np.maximum(height, 0)))


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 12), st.floats(-3, 0))
def test_the_largest_rectangle_is_inside_and_none_is_larger(seed: int, count: int, darkness: float) -> None:
    points = np.random.default_rng(seed).uniform(0, 10**darkness, (count, 2))
    hull = ConvexHull(points)
    corners = points[hull.vertices]
    low, high = largest_rectangle(corners)
    assert np.all(low <= high)
    for s in (low[0], high[0]):
        for t in (low[1], high[1]):
            assert np.max(hull.equations[:, :2] @ [s, t] + hull.equations[:, 2]) < 1e-12, "rounding"
    found = float(np.prod(Y_to_L(high) - Y_to_L(low)))
    brute = brute_force_rectangle(corners, 301)  # inside too, so never larger than the best but by rounding
    assert found >= brute * (1 - 1e-9)


@pytest.mark.parametrize("scale", [1.0, 0.3, 0.02])
def test_the_largest_rectangle_below_a_diagonal_touches_it(scale: float) -> None:
    """The triangle 0 <= t <= s <= scale: (L(1) - L(s0)) L(t1) with t1 = s0, largest at the middle of the range."""
    low, high = largest_rectangle(scale * np.array([[0.0, 0], [1, 0], [1, 1]]))
    L = float(Y_to_L(np.array(scale)))
    # 1e-4: the product is flat at its top, so its place has half the digits of its value.
    np.testing.assert_allclose(Y_to_L(low), [L / 2, 0], atol=1e-4)
    np.testing.assert_allclose(Y_to_L(high), [L, L / 2], atol=1e-4)


def test_two_surfaces_that_know_nothing_of_each_other_have_a_square(model_of: Models) -> None:
    """Each cluster lights one surface only: every pair of grays from black to white."""
    none = np.zeros((3, 3))
    model = model_of(np.hstack((PRIMARIES, none)), np.hstack((none, PRIMARIES)), 2, black=0.0)
    lightness = lightness_area(JointGamut(model))
    # 1e-6: grays through three primaries, times 116.
    assert lightness.area == pytest.approx(100 * 100, rel=1e-6)
    assert lightness.L_pattern == pytest.approx((0, 100), abs=1e-6)
    assert lightness.L_white == pytest.approx((0, 100), abs=1e-6)


@pytest.mark.parametrize("K", [2, 3])
def test_the_area_is_what_the_joint_gamut_holds(bw_model: Models, K: int) -> None:
    model = bw_model(K)
    joint = JointGamut(model)
    lightness = lightness_area(joint)
    L = (np.arange(200) + 0.5) / 2
    grays = Lab_to_XYZ(np.stack((L, 0 * L, 0 * L), axis=-1), D65_XYZ)
    inside = joint.contains(grays[:, None], grays[None])
    # Cells on a boundary of length 300 are a half wrong at random: 0.5 x 0.5 x sqrt(600) / 1800 is 0.3 %.
    assert lightness.area == pytest.approx(inside.sum() / 4, rel=0.01)
    # The polygon is the boundary, curved edges followed, in short steps, counter-clockwise.
    around = Lab_to_XYZ(np.stack([lightness.polygon, 0 * lightness.polygon, 0 * lightness.polygon], axis=-1), D65_XYZ)
    assert np.abs(joint.slack(around[:, 0], around[:, 1])).max() < 1e-12, "rounding"
    assert np.linalg.norm(lightness.polygon - np.roll(lightness.polygon, 1, axis=0), axis=1).max() < 0.251


@pytest.mark.parametrize("seed", range(3))
def test_every_pair_of_grays_of_the_rectangle_can_be_shown(measured_model: Models, seed: int) -> None:
    joint = JointGamut(measured_model(seed, 3, colored=seed > 0))
    lightness = lightness_area(joint)
    corners = [Lab_to_XYZ([(L, 0.0, 0.0) for L in side], D65_XYZ) for side in (lightness.L_pattern, lightness.L_white)]
    assert joint.slack(corners[0][:, None], corners[1][None]).min() > -1e-12, "rounding"


def test_the_figures_are_those_of_the_file(bw_model: Models) -> None:
    lightness = lightness_area(JointGamut(bw_model(2)))
    figures = lightness_figures(lightness)
    assert set(figures) == {"area", "polygon", "rectangle", "same_range", "same_range_by_sheet"}
    assert figures["same_range_by_sheet"]["white"] is None, "beside white paper the pattern is always darker"
    assert set(figures["same_range_by_sheet"]) == {"white", "gray 0.5", "gray 0.4", "gray 0.3"}
    assert figures["rectangle"] == {"L_pattern": list(lightness.L_pattern), "L_white": list(lightness.L_white)}
    assert len(figures["polygon"][0]) == 2


def test_without_common_grays_there_is_no_area(model_of: Models, measured_model: Models) -> None:
    red = model_of(PRIMARIES[:, [0, 0]] * [0.1, 1], PRIMARIES[:, [0, 0]], 2, black=0.0)
    for model in (red, measured_model(0, 1)):
        with pytest.raises(GamutError, match="no area of grays"):
            lightness_area(JointGamut(model))


def test_one_surface_has_no_lightness_area(bw_model: Models) -> None:
    model = bw_model(2)
    alone = PredictionModel(model.channels, model.clusters, model.pattern, None, model.white_point, model.response)
    with pytest.raises(InputError, match="two surfaces"):
        lightness_area(JointGamut(alone))
