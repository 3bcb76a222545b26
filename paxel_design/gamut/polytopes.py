"""Convex polytopes: zonotope -> half-spaces, half-spaces -> vertices and facets. Plain geometry in any space.

Nothing here knows colours, models or effects; `joint` applies it to them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order
from scipy.spatial import ConvexHull, QhullError

from paxel_design.gamut.boxed_lp import OPTIMAL, solve_boxed_lp
from paxel_runtime.errors import GamutError

__all__ = [
    "Polytope",
    "hull_surface",
    "inscribed_ball",
    "polytope",
    "polytope_of_points",
    "unit_rows",
    "zonotope_half_spaces",
]

_RANK = 1e-9
"""Relative size below which a singular value counts as zero: far below any measurement, far above rounding."""

_VACUOUS = 1e-9
"""Length below which a row of a section no longer bounds anything, and how far such a row may be violated: rounding
grows by less than that, and a colour of XYZ below 1 does not notice."""

_FLAT = 1e-8
"""Radius of the largest ball inside below which a set has no interior."""

_LP_TOLERANCE = 1e-10
"""How far the largest ball may reach over a row."""

_BLOCK = 1 << 15
"""Hyperplanes solved at once: 8 MB."""


@dataclass(frozen=True, eq=False)
class Polytope:
    """A bounded convex polytope with interior, in both of its forms.

    Attributes
    ----------
    normals : (m, d) float64 array
        Unit rows, each of them a facet; inside is where ``normals @ point <= offsets``.
    offsets : (m,) float64 array
    vertices : (v, d) float64 array
    """

    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    vertices: NDArray[np.float64]


def zonotope_half_spaces(
    generators: NDArray[np.float64], base: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The half-space form of {generators @ x + base : x in [0, 1]^n} (design: section 8).

    Each facet's hyperplane is spanned by rank - 1 generators; its offset is the support of the zonotope. Spans are
    taken in coordinates where the generators are orthonormal rows, so nearly proportional surfaces do no harm.
    Zero, parallel and coplanar generators are settled by rank; where the zonotope is flat, the directions across it
    bring two opposite rows each.

    Parameters
    ----------
    generators : (d, n) float64 array
    base : (d,) float64 array

    Returns
    -------
    normals : (m, d) float64 array
        Unit rows, at most 2 C(n, d - 1) of them.
    offsets : (m,) float64 array
    """
    U, scale, Vt = np.linalg.svd(generators, full_matrices=True)
    rank = int(np.sum(scale > _RANK * scale[0])) if scale.size and scale[0] > 0 else 0
    across = U[:, rank:].T
    local = Vt[:rank]
    directions = _spanned_hyperplanes(_distinct_directions(local))
    swing = directions @ local
    support = np.maximum(swing, 0).sum(axis=1), np.maximum(-swing, 0).sum(axis=1)
    normals = (directions / scale[:rank]) @ U[:, :rank].T
    normals, offsets = np.concatenate((normals, -normals)), np.concatenate(support)
    length = np.linalg.norm(normals, axis=1)
    normals, offsets = normals / length[:, None], offsets / length
    normals = np.concatenate((normals, across, -across))
    offsets = np.concatenate((offsets, np.zeros(2 * len(across))))
    return normals, offsets + normals @ base


def _distinct_directions(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors along the columns of (r, n), one for each line: (k, r); columns of length zero drop out."""
    length = np.linalg.norm(vectors, axis=0)
    units = (vectors[:, length > _RANK] / length[length > _RANK]).T
    kept: list[NDArray[np.float64]] = []
    for unit in units:
        # |u - (u.v) v| is the sine of the angle, exact where the cosine would round to 1.
        if all(np.linalg.norm(unit - (unit @ other) * other) > _RANK for other in kept):
            kept.append(unit)
    return np.array(kept).reshape(len(kept), vectors.shape[0])


def _spanned_hyperplanes(units: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals (h, r) of the hyperplanes through 0 that r - 1 of the (k, r) vectors span, each once."""
    k, r = units.shape
    if r <= 1:
        return np.ones((r, r))
    choices = np.array(list(combinations(range(k), r - 1)))
    normals = [np.empty((0, r))]
    for i in range(0, len(choices), _BLOCK):
        spans = units[choices[i : i + _BLOCK]]
        _, sigma, Vt = np.linalg.svd(spans)
        normals.append(Vt[sigma[:, -1] > _RANK, -1])
    found = np.concatenate(normals)
    # One sign for both normals of a plane, then one of those that agree to nine digits (a pair that rounds apart
    # stays twice, which costs a row and changes nothing).
    found *= np.sign(np.take_along_axis(found, np.argmax(np.abs(found), axis=1)[:, None], axis=1))
    _, first = np.unique(np.round(found, 9) + 0.0, axis=0, return_index=True)
    return found[np.sort(first)]


def unit_rows(
    normals: NDArray[np.float64], offsets: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The same half-spaces with unit rows, without those that bound nothing.

    Raises
    ------
    GamutError
        If a row of length zero cannot be satisfied: the set is empty.
    """
    length = np.linalg.norm(normals, axis=1)
    bounds = length > _VACUOUS
    if np.any(offsets[~bounds] < -_VACUOUS):
        raise GamutError("the set is empty: a condition that no colour can change is broken")
    return normals[bounds] / length[bounds, None], offsets[bounds] / length[bounds]


def inscribed_ball(
    normals: NDArray[np.float64], offsets: NDArray[np.float64], reach: float = 10.0
) -> tuple[NDArray[np.float64], float]:
    """Centre and radius of the largest ball in {normals @ p <= offsets} with unit rows; radius < 0 where it is empty.

    A linear programme over few rows, to which the most violated ones are added until none is: milliseconds where all
    17,136 rows of a joint gamut would take seconds.

    Parameters
    ----------
    normals : (m, d) float64 array
    offsets : (m,) float64 array
    reach : float
        The ball is looked for in the cube of half-width `reach` about 0.
    """
    d = normals.shape[1]
    cube = np.concatenate((np.eye(d), -np.eye(d)))
    rows = np.unique(np.argmax(cube @ normals.T, axis=1))
    while True:
        # The dual programme has only d + 1 rows: offsets @ y smallest, normals.T @ y = 0, sum of y = 1, 0 <= y <= 1.
        columns = np.ones((d + 1, len(rows) + 2 * d))
        columns[:d] = np.concatenate((normals[rows], cube)).T
        cost = -np.concatenate((offsets[rows], np.full(2 * d, reach)))
        status, _, worth = solve_boxed_lp(columns, np.eye(d + 1)[d], cost, np.zeros(len(cost)), np.ones(len(cost)))
        if status != OPTIMAL:
            raise GamutError("the largest ball inside a set was not found: its rows are too much alike")
        centre, radius = -worth[:d], -worth[d]
        slack = offsets - normals @ centre
        excess = radius - slack
        excess[rows] = -np.inf  # rows that are in are kept as well as rounding lets them: never add one twice
        worst = np.argpartition(-excess, min(10 * d, len(excess) - 1))[: 10 * d]
        broken = worst[excess[worst] > _LP_TOLERANCE]
        if not len(broken):
            return centre, float(np.min(slack))
        rows = np.append(rows, broken)


def polytope(normals: NDArray[np.float64], offsets: NDArray[np.float64]) -> Polytope:
    """Vertices and facets of a bounded intersection of half-spaces.

    Parameters
    ----------
    normals : (m, d) float64 array
        Rows of any length, also redundant ones.
    offsets : (m,) float64 array

    Raises
    ------
    GamutError
        If the set is empty, or flat (no ball of radius 1e-8 fits in).
    """
    normals, offsets = unit_rows(normals, offsets)
    centre, radius = inscribed_ball(normals, offsets)
    if radius < _FLAT:
        raise GamutError("the set is empty" if radius < -_FLAT else "the set is flat: it has no volume")
    # Twice in coordinates where the set is about round, so that one that hugs the gray axis keeps its digits: first
    # as the rows see it from the centre (Dikin's ellipsoid), then as the vertices spread.
    _, tightness, Vt = np.linalg.svd(normals / (offsets - normals @ centre)[:, None], full_matrices=False)
    facets, vertices = _dual_hull(normals, offsets, centre, Vt.T / tightness)
    normals, offsets = normals[facets], offsets[facets]
    facets, vertices = _dual_hull(normals, offsets, *_round_shape(vertices))
    return Polytope(normals[facets], offsets[facets], vertices)


def _dual_hull(
    normals: NDArray[np.float64], offsets: NDArray[np.float64], centre: NDArray[np.float64], shape: NDArray[np.float64]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Rows that are facets, and the vertices: the hull of the dual points about an inner point, as `shape` maps it."""
    try:
        hull = ConvexHull(normals @ shape / (offsets - normals @ centre)[:, None])
    except QhullError as error:
        raise GamutError(f"the vertices of a set were not found: {str(error).splitlines()[0]}") from error
    return hull.vertices, hull.equations[:, :-1] / -hull.equations[:, -1:] @ shape.T + centre


def _round_shape(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean of points (v, d), and the (d, d) map of a round cloud onto theirs."""
    centre = points.mean(axis=0)
    _, spread, Vt = np.linalg.svd(points - centre, full_matrices=False)
    return centre, Vt.T * (spread / np.sqrt(len(points)))


def polytope_of_points(points: NDArray[np.float64]) -> Polytope:
    """The convex hull of points (p, d).

    Raises
    ------
    GamutError
        If the hull is flat.
    """
    centre, shape = _round_shape(points)
    try:
        if np.linalg.cond(shape) > 1 / _FLAT:
            raise GamutError("the set is flat: it has no volume")
        round_points = np.linalg.solve(shape, (points - centre).T).T
        hull = ConvexHull(round_points)
    except (QhullError, np.linalg.LinAlgError) as error:
        raise GamutError("the set is flat: it has no volume") from error
    # Facets of more than d corners come as several simplices with one equation.
    _, first = np.unique(np.round(hull.equations, 9), axis=0, return_index=True)
    normals = np.linalg.solve(shape.T, hull.equations[np.sort(first), :-1].T).T
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    corners = points[np.unique(hull.simplices)]
    return Polytope(normals, np.max(normals @ corners.T, axis=1), corners)


def hull_surface(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices and triangles of the convex hull of points in three dimensions, wound outwards.

    Parameters
    ----------
    points : (p, 3) float64 array

    Returns
    -------
    vertices : (v, 3) float64 array
        Those of the points that are corners.
    faces : (f, 3) int64 array

    Raises
    ------
    GamutError
        If the points lie in one plane, or the triangles do not close.
    """
    try:
        centre, shape = _round_shape(points)
        hull = ConvexHull(np.linalg.solve(shape, (points - centre).T).T)
    except (QhullError, np.linalg.LinAlgError) as error:
        raise GamutError(f"the hull of a set was not found: {str(error).splitlines()[0]}") from error
    corners = np.unique(hull.simplices)
    return points[corners], _wound_outwards(points[corners], np.searchsorted(corners, hull.simplices))


def _wound_outwards(vertices: NDArray[np.float64], faces: NDArray[np.int64]) -> NDArray[np.int64]:
    """The faces of a closed connected surface, each wound like its neighbours and the whole outwards.

    By neighbourhood, because the normal of a sliver has no certain sign.
    """
    halves = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    order = np.lexsort(np.sort(halves, axis=1).T)
    pair = order.reshape(-1, 2) if len(order) % 2 == 0 else np.empty((0, 2), np.intp)
    first, second = halves[pair[:, 0]], halves[pair[:, 1]]
    alike = np.all(first == second, axis=1)
    if not len(pair) or not np.all(alike | np.all(first == second[:, ::-1], axis=1)):
        raise GamutError("the triangles of a hull do not close")
    one, other = np.sort(pair // 3, axis=1).T
    graph = coo_array((np.ones(len(pair)), (one, other)), shape=(len(faces), len(faces))).tocsr()
    sequence, parent = breadth_first_order(graph, 0, directed=False)
    # Whether a face disagrees with its parent; then with the parent's parent, and so on up to the first.
    key = one * len(faces) + other
    order = np.argsort(key)
    child, parent = sequence[1:].astype(np.intp), parent.astype(np.intp)
    step = np.minimum(child, parent[child]) * len(faces) + np.maximum(child, parent[child])
    turned = np.zeros(len(faces), bool)
    turned[child] = alike[order[np.searchsorted(key[order], step)]]
    parent[sequence[0]] = sequence[0]
    while np.any(parent != sequence[0]):
        turned ^= turned[parent]
        parent = parent[parent]
    faces = np.where(turned[:, None], faces[:, ::-1], faces)
    a, b, c = np.moveaxis(vertices[faces] - vertices.mean(axis=0), 1, 0)
    outwards = np.einsum("fi,fi->", a, np.cross(b, c)) > 0
    return faces if outwards else faces[:, ::-1]
