"""Signed distances to a mesh, beside every triangle's by hand and beside half-spaces."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.gamut.distances import signed_distances
from paxel_design.gamut.polytopes import hull_surface

Array = NDArray[np.float64]


def distance_by_samples(places: Array, vertices: Array, faces: NDArray[np.int64]) -> Array:
    """Distance (k,) to the nearest of many points of each triangle: never too small."""
    shares = np.array([(i, j, 24 - i - j) for i in range(25) for j in range(25 - i)]) / 24
    points = (shares @ vertices[faces]).reshape(-1, 3)
    return np.array([np.linalg.norm(points - place, axis=1).min() for place in places])


def test_distances_to_a_turned_body_are_those_to_its_triangles_and_its_side_that_of_its_planes() -> None:
    rng = np.random.default_rng(0)
    corners = 5.5 + 5.0 * rng.standard_normal((14, 3)) / np.sqrt(3)
    vertices, faces = hull_surface(corners)
    shape, reach = (12, 11, 13), 2.5
    found = signed_distances(vertices, faces, shape, reach)
    nodes = np.moveaxis(np.indices(shape), 0, -1).reshape(-1, 3).astype(float)
    planes = ConvexHull(corners).equations
    beyond = np.max(nodes @ planes[:, :3].T + planes[:, 3], axis=1)
    clear = np.abs(beyond) > 1e-6
    assert np.count_nonzero(beyond < 0) > 50
    assert np.array_equal((found.ravel() > 0)[clear], (beyond < 0)[clear])
    sampled = distance_by_samples(nodes, vertices, faces)
    # Inside a convex body the nearest plane is the nearest triangle.
    inside = beyond < 0
    assert np.allclose(found.ravel()[inside], np.minimum(-beyond[inside], reach), atol=1e-6)
    # Samples are up to a 24th of an edge away, sideways: of 18 steps three fourths.
    outside = ~inside & (sampled < reach)
    assert np.all(-found.ravel()[outside] < sampled[outside] + 1e-6)
    assert np.all(np.hypot(found.ravel()[outside], 18 / 24) > sampled[outside])
    assert np.all(found.ravel()[~inside & (sampled > np.hypot(reach, 18 / 24))] == -reach)


def test_corners_on_nodes_and_edges_along_rays_leave_no_hole() -> None:
    """A box whose corners are nodes: each ray meets it twice or not at all."""
    low, high = np.array([2, 3, 1]), np.array([6, 5, 7])
    vertices, faces = hull_surface(np.stack(np.meshgrid(*np.stack((low, high), axis=1)), -1).reshape(-1, 3) * 1.0)
    found = signed_distances(vertices, faces, (9, 9, 9), 2.0)
    nodes = np.moveaxis(np.indices((9, 9, 9)), 0, -1)
    depth = np.min(np.minimum(nodes - low, high - nodes), axis=-1)
    assert np.all(found[depth > 0] > 0)
    assert np.all(found[depth < 0] < 0)
    assert np.allclose(found[depth >= 0], np.minimum(depth[depth >= 0], 2), atol=1e-6)
