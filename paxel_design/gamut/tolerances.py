"""What lies within a dE00 of a gray or of a colour, as points whose convex hull is the body.

Such bodies bulge outwards in XYZ too (their width grows like Y^(2/3)), so the hull of points on their surface lies
inside and falls short by the sagitta between neighbouring points: 3 % of the tolerance about grays, 6 % about strong
colours. Wide ones about dark colours are dented where CIELAB turns linear; they are made smaller until their hull
holds nothing beyond the tolerance (7 % for a tolerance of 10). No partner is further off than the tolerance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00

__all__ = ["ball_about", "tube_about_grays"]

_HUES = 24
_LATITUDES = 13
"""15 degrees of dE00 apart both ways: the middle between four points is 10.6 degrees off, 1 - cos = 1.7 %."""

_GRAYS = 9
"""In equal ratios of L* + 16 above L* 8: each 17 % from the next, between which Y^(2/3) bends by 0.6 %."""


_SHRINKINGS = 6
_EXCESS = 2e-4
"""Relative excess over the tolerance that is let pass."""


def ball_about(Lab: NDArray[np.float64], tolerance: float, white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ of points (v, 3) on the surface dE00 = `tolerance` about one colour (3,), or within it where that dents."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, _LATITUDES)[:, None]
    hue = 2 * np.pi * np.arange(_HUES) / _HUES
    across = np.cos(latitude)
    directions = np.stack(np.broadcast_arrays(np.sin(latitude), across * np.cos(hue), across * np.sin(hue)), axis=-1)
    poles, middle = directions[[0, -1], 0], directions[1:-1].reshape(-1, 3)
    within = tolerance
    for _ in range(_SHRINKINGS):
        points = _at_tolerance(Lab, np.concatenate((poles, middle)), within, white_point)
        excess = _farthest_in_hull(points, Lab, white_point) / tolerance
        if excess <= 1 + _EXCESS:
            break
        within /= excess
    return points


def _farthest_in_hull(points: NDArray[np.float64], Lab: NDArray[np.float64], white_point: NDArray[np.float64]) -> float:
    """Largest dE00 from `Lab` on the hull of XYZ `points` (v, 3): at corners, on edges and in the middle of facets."""
    corners = points[ConvexHull(points / np.ptp(points, axis=0)).simplices]
    mixtures = np.array([(1, 0, 0), (1, 1, 0), (0, 1, 1), (1, 0, 1), (1, 1, 1)]) / np.array([[1], [2], [2], [2], [3]])
    places = XYZ_to_Lab(np.einsum("mk,fkc->mfc", mixtures, corners), white_point)
    return float(dE00(places, Lab).max())


def tube_about_grays(Y: float, tolerance: float, white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ of points (v, 3) on the surface of all that lies within `tolerance` of a gray from black to luminance `Y`.

    Up to L* 8, where CIELAB is linear, that would have one width in XYZ and grow from there on: no convex body, and its
    hull would let partners be 2.8 dE00 off for 2. Below L* 8 + `tolerance` it therefore fades out to none at black.
    """
    hue = 2 * np.pi * np.arange(_HUES) / _HUES
    ring = np.stack((0 * hue, np.cos(hue), np.sin(hue)), axis=-1)
    darkest = (8 + tolerance + 16) / 116
    roots = np.geomspace(darkest, max(np.cbrt(Y), 1.1 * darkest), _GRAYS)
    rings = [_at_tolerance(np.array([L, 0.0, 0.0]), ring, tolerance, white_point) for L in 116 * roots - 16]
    return np.concatenate((np.zeros((1, 3)), *rings))


def _at_tolerance(
    Lab: NDArray[np.float64], directions: NDArray[np.float64], tolerance: float, white_point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """XYZ of the points about `Lab` where dE00 reaches `tolerance`, by halvings, even in dE00 as `directions` are."""
    steps = _steps_to(Lab, directions, tolerance)
    # The body is near an ellipsoid, up to 1 to 4: directions even on a sphere are stretched as it is.
    for _ in range(3):
        _, stretch, axes = np.linalg.svd(steps, full_matrices=False)
        steps = _steps_to(Lab, directions @ axes.T * stretch @ axes, tolerance)
    return np.asarray(Lab_to_XYZ(Lab + steps, white_point), np.float64)


def _steps_to(Lab: NDArray[np.float64], directions: NDArray[np.float64], tolerance: float) -> NDArray[np.float64]:
    """Steps along directions in CIELAB to where dE00 reaches `tolerance`."""
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    low, high = np.zeros(len(directions)), np.full(len(directions), 20.0 * tolerance)
    for _ in range(40):
        middle = (low + high) / 2
        inside = dE00(Lab + middle[:, None] * directions, np.broadcast_to(Lab, directions.shape)) <= tolerance
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return low[:, None] * directions
