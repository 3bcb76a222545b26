"""Half-planes of pairs and the fit within them: against finite differences, brute force and closed forms."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, eye

from paxel_design.gamut import JointGamut
from paxel_runtime.gamut_mapping.pair_fit import Aim, fit_pair
from paxel_runtime.gamut_mapping.pair_limits import half_planes, nearest_inside, relevant_rows
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.subgamut import PairGamut


@pytest.fixture(scope="module")
def pairs(bw_model) -> PairGamut:  # type: ignore[no-untyped-def]
    return JointGamut(bw_model(3)).pairs


def _slack(pairs: PairGamut, Lab: NDArray[np.float64]) -> NDArray[np.float64]:
    return pairs.slack(Lab_to_XYZ(Lab[..., :3], pairs.white_point), Lab_to_XYZ(Lab[..., 3:], pairs.white_point))


def _some_pairs(n: int) -> NDArray[np.float64]:
    rng = np.random.default_rng(0)
    Lab = rng.normal(0, 6, (n, 6))
    Lab[:, [0, 3]] = rng.uniform((5, 20), (70, 95), (n, 2))
    return Lab


def test_half_planes_have_the_slope_of_the_boundary(pairs: PairGamut) -> None:
    """Where a pair steps along u by h, its distance to the nearest plane changes as the half-plane says."""
    Lab, rng = _some_pairs(40), np.random.default_rng(1)
    direction = rng.normal(size=Lab.shape)
    at = rng.normal(size=(40, 2))
    normals, offsets = half_planes(Lab, direction, at, pairs)
    distance = offsets - np.einsum("nkc,nc->nk", normals, at)
    nearest = np.argmin(distance, axis=1)
    inside = _slack(pairs, Lab) >= 0
    assert 5 < inside.sum() < 35  # both kinds are here
    np.testing.assert_array_equal(distance.min(axis=1) >= 0, inside)
    # On the nearest plane the slack of that row is 0 to first order: a small step towards it closes that share of it.
    h = 1e-4
    for n in range(40):
        step = h * distance[n, nearest[n]] * normals[n, nearest[n]]
        moved = Lab[n] + np.repeat(step, 3) * direction[n]
        before, after = (
            pairs.offsets - pairs.normals @ Lab_to_XYZ(pair.reshape(2, 3), pairs.white_point).ravel()
            for pair in (Lab[n], moved)
        )
        share = (before - after) / before
        assert np.min(np.abs(share - h)) < 1e-3 * h  # second order in h


def test_a_margin_moves_the_planes(pairs: PairGamut) -> None:
    Lab = _some_pairs(5)
    direction = np.tile([1.0, 0, 0, 1.0, 0, 0], (5, 1))
    normals, offsets = half_planes(Lab, direction, Lab[:, [0, 3]], pairs)
    closer = half_planes(Lab, direction, Lab[:, [0, 3]], pairs, margin=0.5)
    np.testing.assert_array_equal(closer[0], normals)
    np.testing.assert_allclose(closer[1], offsets - 0.5)


@settings(max_examples=40)
@given(seed=st.integers(0, 2**32 - 1))
def test_nearest_points_against_brute_force(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0, 2 * np.pi, 6)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    offsets = rng.uniform(0.1, 1, 6)  # the origin is inside
    point = rng.normal(0, 2, 2)
    found = nearest_inside(point[None], normals[None], offsets[None], np.zeros((1, 2)))[0]
    assert np.all(normals @ found <= offsets + 1e-8)
    # The nearest point of a convex set: no point of the set lies beyond the plane through it across the way there.
    grid = np.stack(np.meshgrid(*[np.linspace(-6, 6, 241)] * 2), axis=-1).reshape(-1, 2)
    inside = grid[np.all(grid @ normals.T <= offsets, axis=1)]
    assert np.max((inside - found) @ (point - found), initial=0.0) <= 1e-7


def test_no_room_at_all() -> None:
    normals, offsets = np.array([[[1.0, 0.0], [-1.0, 0.0]]]), np.array([[-1.0, -1.0]])
    np.testing.assert_array_equal(
        nearest_inside(np.zeros((1, 2)), normals, offsets, np.full((1, 2), 7.0)), [[7.0, 7.0]]
    )


def test_rows_that_matter(pairs: PairGamut, monkeypatch: pytest.MonkeyPatch) -> None:
    assert relevant_rows(pairs, _some_pairs(10)) is pairs  # few enough
    monkeypatch.setattr("paxel_runtime.gamut_mapping.pair_limits._FEW", 0)
    Lab = _some_pairs(300)
    far = PairGamut(np.tile(pairs.normals, (2, 1)), np.append(pairs.offsets, pairs.offsets + 1), pairs.white_point)
    kept = relevant_rows(far, Lab)
    assert len(kept.offsets) <= len(pairs.offsets)
    np.testing.assert_allclose(_slack(kept, Lab), _slack(pairs, Lab), atol=1e-12)  # the probes themselves are exact


def _plain_aim(wanted: float, n: int = 4, bounds: tuple[float, float] = (-10.0, 10.0)) -> Aim:
    """n unknowns that are each to be `wanted`, and are their own samples."""
    one = csr_matrix(eye(n))
    return Aim(one, np.full(n, wanted), one, one, bounds, np.zeros(n))


def _half_plane(normal: tuple[float, float], offset: float):  # type: ignore[no-untyped-def]
    def limits(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        return np.tile(np.array(normal), (len(values), 1, 1)), np.full((len(values), 1), offset)

    return limits


def test_without_limits_the_aim_is_met() -> None:
    c, d = fit_pair((_plain_aim(1.0), _plain_aim(2.0)), _half_plane((1.0, 0.0), 1e6), iterations=100, every=50)
    np.testing.assert_allclose(c, 1, atol=1e-6)  # 100 iterations at a rate of 1/2 or better
    np.testing.assert_allclose(d, 2, atol=1e-6)


def test_on_a_limit_the_nearest_pair_is_found() -> None:
    """(1, 2) onto x + y <= 2: (0.5, 1.5)."""
    s = np.sqrt(0.5)
    c, d = fit_pair((_plain_aim(1.0), _plain_aim(2.0)), _half_plane((s, s), 2 * s), iterations=100, every=50)
    np.testing.assert_allclose(c, 0.5, atol=1e-6)
    np.testing.assert_allclose(d, 1.5, atol=1e-6)


def test_bounds_hold() -> None:
    c, d = fit_pair(
        (_plain_aim(1.0, bounds=(-1, 0.25)), _plain_aim(2.0)), _half_plane((1.0, 0.0), 1e6), iterations=100, every=50
    )
    np.testing.assert_allclose(c, 0.25, atol=1e-6)
    np.testing.assert_allclose(d, 2, atol=1e-6)
