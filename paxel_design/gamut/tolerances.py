"""What lies within a dE00 of a gray or of a colour, as points whose convex hull is the body.

Such bodies bulge outwards in XYZ too (their width grows like Y^(2/3)), so the hull of points on their surface lies
inside and falls short by the sagitta between neighbouring points: about 1 % of the tolerance.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00

__all__ = ["ball_about", "balls_along_grays", "tube_about_grays"]

_HUES = 16
_LATITUDES = 7
_GRAYS = 11


def ball_about(Lab: NDArray[np.float64], tolerance: float, white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ of points (v, 3) on the surface dE00 = `tolerance` about one colour (3,)."""
    latitude = np.linspace(-np.pi / 2, np.pi / 2, _LATITUDES)[:, None]
    hue = 2 * np.pi * np.arange(_HUES) / _HUES
    across = np.cos(latitude)
    directions = np.stack(np.broadcast_arrays(np.sin(latitude), across * np.cos(hue), across * np.sin(hue)), axis=-1)
    poles, middle = directions[[0, -1], 0], directions[1:-1].reshape(-1, 3)
    return _at_tolerance(Lab, np.concatenate((poles, middle)), tolerance, white_point)


def balls_along_grays(
    Y: tuple[float, float], tolerance: float, white_point: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """XYZ of points (v, 3) within `tolerance` of grays over a range of luminance, and the luminance of each's gray.

    dE00 allows more lightness at both ends of the scale than in its middle, so what lies within it of its own gray is
    not convex along the grays. Lightness is allowed here as in the middle, which is never more than dE00 allows.
    """
    body, place = [], []
    latitude = np.linspace(-np.pi / 2, np.pi / 2, _LATITUDES)[1:-1]
    for L, luminance in _even_lightness(Y):
        gray = np.array([L, 0.0, 0.0])
        rings = [_at_tolerance(gray, _ring(), tolerance * float(np.cos(a)), white_point) for a in latitude]
        Lab = np.asarray(XYZ_to_Lab(rings, white_point), np.float64)
        Lab[..., 0] += tolerance * np.sin(latitude)[:, None]
        ends = np.array([(L - tolerance, 0.0, 0.0), (L + tolerance, 0.0, 0.0)])
        body.append(np.asarray(Lab_to_XYZ(np.concatenate((ends, Lab.reshape(-1, 3))), white_point), np.float64))
        place.append(np.full(len(body[-1]), luminance))
    return np.concatenate(body), np.concatenate(place)


def tube_about_grays(Y: tuple[float, float], tolerance: float, white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    """XYZ of points (v, 3) on the surface of all that lies within `tolerance` of a gray of a range of luminance."""
    return np.concatenate(
        [_at_tolerance(np.array([L, 0.0, 0.0]), _ring(), tolerance, white_point) for L, _ in _even_lightness(Y)]
    )


def _ring() -> NDArray[np.float64]:
    """Directions of all hues in CIELAB, (h, 3)."""
    hue = 2 * np.pi * np.arange(_HUES) / _HUES
    return np.stack((0 * hue, np.cos(hue), np.sin(hue)), axis=-1)


def _even_lightness(Y: tuple[float, float]) -> list[tuple[float, float]]:
    """(L*, luminance) of grays from one luminance to another, even in the cube root."""
    roots = np.linspace(np.cbrt(max(Y[0], 0.0)), np.cbrt(Y[1]), _GRAYS)
    L = np.where(roots**3 > (6 / 29) ** 3, 116 * roots - 16, (29 / 3) ** 3 * roots**3)
    return list(zip(L.tolist(), (roots**3).tolist(), strict=True))


def _at_tolerance(
    Lab: NDArray[np.float64], directions: NDArray[np.float64], tolerance: float, white_point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """XYZ of the points from `Lab` along directions in CIELAB where dE00 reaches `tolerance`, by halvings."""
    low, high = np.zeros(len(directions)), np.full(len(directions), 20.0 * tolerance)
    for _ in range(40):
        middle = (low + high) / 2
        inside = dE00(Lab + middle[:, None] * directions, np.broadcast_to(Lab, directions.shape)) <= tolerance
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(Lab_to_XYZ(Lab + low[:, None] * directions, white_point), np.float64)
