"""The gauge of a polytope by its definition."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from paxel_design.gamut.gauge import Gauge, support
from paxel_design.gamut.polytopes import zonotope_half_spaces


@settings(deadline=None, max_examples=20)
@given(st.integers(0, 2**32 - 1), st.integers(3, 7))
def test_a_point_divided_by_its_gauge_lies_on_the_surface(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    normals, offsets = zonotope_half_spaces(rng.uniform(0.1, 1, (3, n)), rng.uniform(0, 0.1, 3))
    gauge = Gauge(normals, offsets)
    points = gauge.middle + rng.standard_normal((300, 3))
    values = gauge(points)
    slack = np.min(offsets - points @ normals.T, axis=1)
    np.testing.assert_array_equal(values < 1, slack > 0)
    on_surface = gauge.middle + (points - gauge.middle) / values[:, None]
    # Thin zonotopes have rows of 1e3 about their middle; rounding is 1e-16 of that.
    np.testing.assert_allclose(np.min(offsets - on_surface @ normals.T, axis=1), 0, atol=1e-9)


def test_no_points_have_no_gauges() -> None:
    normals, offsets = zonotope_half_spaces(np.eye(3), np.zeros(3))
    assert Gauge(normals, offsets)(np.empty((0, 3))).shape == (0,)


def test_the_support_is_the_largest_product() -> None:
    rng = np.random.default_rng(0)
    directions, points = rng.standard_normal((10_000, 3)), rng.standard_normal((40, 3)) + 2
    np.testing.assert_allclose(support(directions, points), np.max(directions @ points.T, axis=1), atol=1e-12)
