"""Shadows of convex sets: the colours p of which *some* partner in a set goes with p, as polytopes.

Where the partner is a gray, two of its directions are bound; where it lies in a convex body given by points, it is a
mixture of them. Either way the corners of the shadow are found as the farthest colours in ever more directions, each a
small linear programme over inputs, until every facet of their hull is proven.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.gamut.boxed_lp import INFEASIBLE, OPTIMAL, maximise
from paxel_design.gamut.polytopes import Polytope, polytope_of_points
from paxel_runtime.errors import GamutError
from paxel_runtime.model.prediction import SurfaceModel
from paxel_runtime.numba_options import KERNEL

__all__ = ["shadow_of_body", "shadow_of_grays"]

_PROVEN = 1e-5
"""How far beyond a facet the farthest colour may lie, XYZ with Y = 1: the body's points
are no closer to what they mean."""

_EXACT = 1e-8
"""The same where there is no such body: all corners are found."""

_RANK = 1e-9
"""Relative size below which a singular value counts as zero."""

_MOST_CORNERS = 20_000


def shadow_of_grays(
    own: SurfaceModel, other: SurfaceModel, gray: NDArray[np.float64], *, together: bool = False
) -> Polytope:
    """Colours of surface `own` whose partner can be some multiple of `gray` on surface `other`.

    Parameters
    ----------
    own, other : SurfaceModel
        Of the same inputs.
    gray : (3,) float64 array
        XYZ.
    together : bool
        Not the partner but the sum of colour and partner is the gray.

    Raises
    ------
    GamutError
        If the set is empty or flat, or its corners are not found.
    """
    across = np.linalg.svd(gray[None])[2][1:]
    A, black = (own.A + other.A, own.black + other.black) if together else (other.A, other.black)
    # Two rows, or fewer where all partners are of one hue.
    U, scale, Vt = np.linalg.svd(across @ A, full_matrices=False)
    rank = int(np.sum(scale > _RANK * np.linalg.norm(A)))
    offset = U.T @ (across @ black)
    if np.any(np.abs(offset[rank:]) > _RANK):
        raise GamutError("the set is empty")
    columns, rhs = np.ascontiguousarray(Vt[:rank]), -offset[:rank] / scale[:rank]
    return _hull_of_farthest(_farthest(own, columns, rhs), _EXACT)


def shadow_of_body(own: SurfaceModel, other: SurfaceModel, body: NDArray[np.float64]) -> Polytope:
    """Colours of surface `own` whose partner can lie in the convex hull of `body` on surface `other`.

    Parameters
    ----------
    own, other : SurfaceModel
        Of the same inputs.
    body : (v, 3) float64 array
        XYZ.

    Raises
    ------
    GamutError
        If the set is empty or flat, or its corners are not found.
    """
    n, v = own.A.shape[1], len(body)
    # Inputs x and shares of the body's points; rows: partner, sum of the shares.
    columns = np.zeros((4, n + v))
    columns[:3, :n], columns[:3, n:], columns[3, n:] = other.A, -body.T, 1.0
    rhs = np.append(-other.black, 1.0)

    return _hull_of_farthest(_farthest(own, columns, rhs), _PROVEN)


def _farthest(
    own: SurfaceModel, columns: NDArray[np.float64], rhs: NDArray[np.float64]
) -> Callable[[NDArray[np.float64]], NDArray[np.float64]]:
    """Directions (k, 3) -> farthest colours (k, 3); the first columns of the programme are those of the inputs."""
    n = own.A.shape[1]
    shares = columns.shape[1] - n

    def farthest(directions: NDArray[np.float64]) -> NDArray[np.float64]:
        cost = np.concatenate((directions @ own.A, np.zeros((len(directions), shares))), axis=1)
        x, status = _maximise_each(columns, rhs, cost, n)
        if status == INFEASIBLE:
            raise GamutError("the set is empty")
        if status != OPTIMAL:
            raise GamutError("the corners of a set were not found: its inputs depend on each other")
        return np.asarray(x @ own.A.T + own.black)

    return farthest


@njit(**KERNEL)
def _maximise_each(
    columns: NDArray[np.float64], rhs: NDArray[np.float64], cost: NDArray[np.float64], n: int
) -> tuple[NDArray[np.float64], int]:
    """First n variables of the best point for each row of `cost`, all variables within 0..1."""
    r, m = columns.shape
    lower, upper, v, worth = np.zeros(m), np.ones(m), np.empty(m), np.empty(r)
    basis = np.full(r, -1)
    x = np.empty((len(cost), n))
    for i in range(len(cost)):
        status = maximise(columns, rhs, cost[i], lower, upper, basis, v, worth)
        if status != OPTIMAL:
            return x, status
        x[i] = v[:n]
    return x, OPTIMAL


def _hull_of_farthest(farthest: Callable[[NDArray[np.float64]], NDArray[np.float64]], tolerance: float) -> Polytope:
    """The polytope whose farthest points `farthest` finds, (k, 3) directions -> (k, 3) points, up to `tolerance`."""
    compass = np.array(
        [(i, j, k) for i in (-1, 0, 1) for j in (-1, 0, 1) for k in (-1, 0, 1) if (i, j, k) != (0, 0, 0)]
    )
    first = farthest(compass.astype(np.float64))
    centre = first.mean(axis=0)
    _, spread, Vt = np.linalg.svd(first - centre, full_matrices=False)
    if spread[-1] < 1e-8:
        raise GamutError("the set is flat: it has no volume")
    # In round coordinates, so that a thin set keeps its digits.
    to_round = Vt / (spread / np.sqrt(len(first)))[:, None]
    points = _distinct((first - centre) @ to_round.T)
    proven: set[tuple[float, ...]] = set()
    while len(points) < _MOST_CORNERS:
        equations = np.unique(np.round(ConvexHull(points).equations, 10), axis=0)
        asked = np.array([e for e in equations if tuple(e) not in proven]).reshape(-1, 4)
        if not len(asked):
            return polytope_of_points(np.linalg.solve(to_round, points[ConvexHull(points).vertices].T).T + centre)
        proven.update(tuple(e) for e in asked)
        found = (farthest(asked[:, :3] @ to_round) - centre) @ to_round.T
        beyond = np.einsum("ij,ij->i", found, asked[:, :3]) + asked[:, 3] > tolerance / spread[0]
        if np.any(beyond):
            points = _distinct(np.concatenate((points, found[beyond])))
    raise GamutError(f"the corners of a set were not found: more than {_MOST_CORNERS}")


def _distinct(points: NDArray[np.float64]) -> NDArray[np.float64]:
    _, first = np.unique(np.round(points, 9), axis=0, return_index=True)
    return points[np.sort(first)]
