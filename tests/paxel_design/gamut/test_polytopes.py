"""Polytopes against closed forms and against the hull of all corners of the cube of inputs."""

from itertools import product
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.gamut.polytopes import hull_surface, inscribed_ball, polytope, unit_rows, zonotope_half_spaces
from paxel_runtime.errors import GamutError

CUBE = np.concatenate((np.eye(3), -np.eye(3))), np.array([1.0, 1, 1, 0, 0, 0])


def all_corners(generators: NDArray[np.float64], base: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array(list(product((0.0, 1.0), repeat=generators.shape[1]))) @ generators.T + base


@settings(deadline=None, max_examples=30)
@given(st.integers(0, 2**32 - 1), st.sampled_from([(2, 5), (3, 3), (3, 7), (4, 6), (6, 6), (6, 7)]))
def test_the_half_spaces_are_those_of_the_hull_of_all_corners(seed: int, size: tuple[int, int]) -> None:
    rng = np.random.default_rng(seed)
    generators, base = rng.uniform(0, 1, size), rng.uniform(0, 0.01, size[0])
    normals, offsets = zonotope_half_spaces(generators, base)
    corners = all_corners(generators, base)
    hull = ConvexHull(corners)
    assert len(normals) == 2 * comb(size[1], size[0] - 1), "in general position each choice is a pair of facets"
    # Each row touches the set, and each facet of the hull is a row. 1e-9: the hull's own rounding, sharp angles.
    np.testing.assert_allclose(np.max(corners @ normals.T, axis=0), offsets, atol=1e-9)
    distance = hull.equations[:, None, :] - np.column_stack((normals, -offsets))[None]
    assert np.max(np.min(np.abs(distance).max(axis=-1), axis=1)) < 1e-7


@settings(deadline=None, max_examples=60)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3), st.integers(1, 5), st.integers(0, 2))
def test_flat_and_degenerate_zonotopes_are_settled_by_rank(seed: int, rank: int, count: int, twins: int) -> None:
    """Generators in a subspace, some of them twice and one of length zero."""
    rng = np.random.default_rng(seed)
    generators = rng.uniform(0, 1, (4, rank)) @ rng.uniform(0.1, 1, (rank, count))
    generators = np.column_stack((generators, 0.3 * generators[:, :twins], np.zeros(4)))
    base = rng.uniform(0, 1, 4)
    normals, offsets = zonotope_half_spaces(generators, base)
    x = rng.uniform(0, 1, (20, generators.shape[1]))
    points = x @ generators.T + base
    assert np.max(points @ normals.T - offsets) < 1e-12, "what an input gives is inside, to rounding"
    # Off the subspace is outside, and so is beyond the support in any direction.
    U, scale, _ = np.linalg.svd(generators)
    true_rank = np.sum(scale > 1e-9 * scale[0])
    for across in U[:, true_rank:].T:
        assert np.min(np.max((points + 1e-6 * across) @ normals.T - offsets, axis=1)) > 0.9e-6
    for direction in rng.standard_normal((5, true_rank)) @ U[:, :true_rank].T:
        beyond = all_corners(generators, base)
        beyond = beyond[np.argmax(beyond @ direction)] + 1e-6 * direction / np.linalg.norm(direction)
        assert np.max(normals @ beyond - offsets) > 1e-9


def test_no_generator_leaves_one_point() -> None:
    normals, offsets = zonotope_half_spaces(np.zeros((3, 2)), np.array([0.1, 0.2, 0.3]))
    assert np.max(np.abs(offsets - normals @ [0.1, 0.2, 0.3])) == 0
    assert np.max(normals @ [0.1, 0.2, 0.31] - offsets) == pytest.approx(0.01)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1))
def test_a_parallelepiped_has_the_volume_of_its_determinant(seed: int) -> None:
    rng = np.random.default_rng(seed)
    generators = rng.uniform(-1, 1, (3, 3)) + 2 * np.eye(3)
    solid = polytope(*zonotope_half_spaces(generators, rng.uniform(0, 1, 3)))
    assert len(solid.vertices) == 8
    assert len(solid.normals) == 6
    # 1e-9: rounding of a hull of 8 points of size 1.
    assert ConvexHull(solid.vertices).volume == pytest.approx(abs(np.linalg.det(generators)), rel=1e-9)


@settings(deadline=None, max_examples=25)
@given(st.integers(0, 2**32 - 1), st.floats(-6, 0))
def test_vertices_and_facets_of_a_thin_polytope_keep_their_digits(seed: int, thinness: float) -> None:
    """A zonotope that hugs one axis, with redundant rows added."""
    rng = np.random.default_rng(seed)
    generators = (1 + 10**thinness * rng.uniform(-1, 1, (3, 6))) / 12
    normals, offsets = zonotope_half_spaces(generators, np.zeros(3))
    loose = rng.standard_normal((20, 3))
    solid = polytope(np.concatenate((normals, 3 * loose)), np.append(offsets, 4 * np.abs(loose).sum(axis=1)))
    slack = solid.offsets[:, None] - solid.normals @ solid.vertices.T
    assert slack.min() > -1e-13, "every vertex is inside"
    assert np.sort(slack, axis=0)[2].max() < 1e-13, "and on three facets at least"
    assert np.max(np.min(np.linalg.norm(normals[None] - solid.normals[:, None], axis=-1), axis=1)) < 1e-12
    # Both forms are one set: each given row is the support of the vertices. 1e-12: rounding of numbers of size 1.
    np.testing.assert_allclose(np.max(solid.vertices @ normals.T, axis=0), offsets, atol=1e-12)


def test_the_largest_ball_of_a_cube_and_of_a_simplex() -> None:
    # 1e-9: what HiGHS keeps of rows it was given.
    centre, radius = inscribed_ball(*CUBE)
    assert radius == pytest.approx(0.5, abs=1e-9)
    np.testing.assert_allclose(centre, 0.5, atol=1e-9)
    normals, offsets = unit_rows(np.concatenate((-np.eye(3), np.ones((1, 3)))), np.array([0.0, 0, 0, 1]))
    assert inscribed_ball(normals, offsets)[1] == pytest.approx(1 / (3 + np.sqrt(3)), abs=1e-9)


def test_the_largest_ball_among_many_rows_is_that_of_all_rows() -> None:
    rng = np.random.default_rng(1)
    normals = rng.standard_normal((5000, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    centre = np.array([0.3, 0.3, 0.2])
    # All planes touch one ball but for rounding: the ball is the answer. 1e-9 as above.
    found, radius = inscribed_ball(normals, normals @ centre + 0.2)
    assert radius == pytest.approx(0.2, abs=1e-9)
    np.testing.assert_allclose(found, centre, atol=1e-8)


@pytest.mark.parametrize(
    ("normals", "offsets", "what"),
    [
        (CUBE[0], np.array([1.0, 1, 1, -2, 0, 0]), "empty"),
        (CUBE[0], np.array([1.0, 1, 1, -1, 0, 0]), "flat"),
        (np.concatenate((CUBE[0], np.zeros((1, 3)))), np.append(CUBE[1], -0.1), "no colour can change"),
    ],
)
def test_a_set_without_interior_says_which(
    normals: NDArray[np.float64], offsets: NDArray[np.float64], what: str
) -> None:
    with pytest.raises(GamutError, match=what):
        polytope(normals, offsets)


def test_rows_of_length_zero_that_hold_bound_nothing() -> None:
    solid = polytope(np.concatenate((CUBE[0], np.zeros((2, 3)))), np.append(CUBE[1], [0.0, 0.5]))
    assert ConvexHull(solid.vertices).volume == pytest.approx(1)


@settings(deadline=None, max_examples=40)
@given(st.integers(0, 2**32 - 1), st.integers(3, 8))
def test_a_hull_surface_closes_and_is_wound_outwards(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    solid = polytope(*zonotope_half_spaces(rng.uniform(0, 1, (3, count)) + np.eye(3, count), np.zeros(3)))
    vertices, faces = hull_surface(solid.vertices)
    halves = set(map(tuple, faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)))
    assert len(halves) == 3 * len(faces)
    assert all((b, a) in halves for a, b in halves)
    assert len(vertices) - len(halves) // 2 + len(faces) == 2, "Euler: one sphere"
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(ConvexHull(solid.vertices).volume, rel=1e-9)


def test_points_in_a_plane_have_no_hull_surface() -> None:
    with pytest.raises(GamutError, match="hull"):
        hull_surface(np.random.default_rng(0).uniform(0, 1, (8, 2)) @ np.eye(2, 3))
