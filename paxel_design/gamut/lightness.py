"""Which grays the two surfaces can show at once: the lightness area and its largest rectangle (Section VI-B).

In linear light the pairs (s, t) with (s gray, t gray) in the joint gamut are a convex polygon; in L* x L* its edges
curve. The largest rectangle in there is how much contrast two independent pictures can have.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.gamut.joint import JointGamut
from paxel_design.gamut.polytopes import polytope
from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab

__all__ = ["LightnessArea", "lightness_area", "lightness_figures"]

_STEP = 0.25
"""Longest chord along the curved edges, in L*: the area is then right to about 1 part in 100,000."""

_GAP = 1e-3
"""Relative gap at which the search for the largest rectangle has proven which basin holds it."""

_GRID = 24
"""Cells a side of the first grid of that search."""

_ONES = np.ones(3)
_L_ONLY = np.array([1.0, 0.0, 0.0])


@dataclass(frozen=True, eq=False)
class LightnessArea:
    """The pairs of L* that the two surfaces can show at once, both gray (multiples of the white point).

    Attributes
    ----------
    area : float
        In L* x L*.
    polygon : (m, 2) float64 array
        [L* on the pattern, L* on the white surface] around the area, counter-clockwise, curved edges followed.
    L_pattern, L_white : (float, float)
        The rectangle with the largest product of both lightness ranges: every pair of grays from the two ranges can
        be shown at once.
    """

    area: float
    polygon: NDArray[np.float64]
    L_pattern: tuple[float, float]
    L_white: tuple[float, float]


def lightness_area(joint: JointGamut) -> LightnessArea:
    """The lightness area of a joint gamut and its largest rectangle.

    Raises
    ------
    InputError
        If the model has one surface.
    GamutError
        If no grays, or no area of them, can be shown on both surfaces at once.
    """
    if joint.model.white is None:
        raise InputError("a lightness area needs a model of two surfaces, got one")
    gray = joint.model.white_point
    normals = np.stack((joint.normals[:, :3] @ gray, joint.normals[:, 3:] @ gray), axis=1)
    try:
        corners = polytope(normals, joint.offsets).vertices
    except GamutError as error:
        raise GamutError(
            f"the two surfaces have no area of grays that they show at once: {error}; the pattern's colorants must "
            "mix to gray in more than one lightness"
        ) from error
    corners = corners[ConvexHull(corners).vertices]
    polygon = Y_to_L(_followed(corners))
    x, y = polygon.T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    low, high = largest_rectangle(corners)
    L_low, L_high = Y_to_L(np.array([low, high]))
    return LightnessArea(area, polygon, (float(L_low[0]), float(L_high[0])), (float(L_low[1]), float(L_high[1])))


def lightness_figures(lightness: LightnessArea) -> dict[str, Any]:
    """The figures of ``gamut/lightness.json`` (design: section 4, *Files*)."""
    return {
        "area": lightness.area,
        "polygon": lightness.polygon.tolist(),
        "rectangle": {"L_pattern": list(lightness.L_pattern), "L_white": list(lightness.L_white)},
    }


def Y_to_L(Y: NDArray[np.float64]) -> NDArray[np.float64]:
    """L* of the luminance factor Y, 1 for white; any shape."""
    return np.asarray(XYZ_to_Lab(Y[..., None] * _ONES, _ONES)[..., 0], np.float64)


def L_to_Y(L: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of `Y_to_L`."""
    return np.asarray(Lab_to_XYZ(L[..., None] * _L_ONLY, _ONES)[..., 1], np.float64)


def _followed(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The polygon (m, 2) in linear light with points along its edges, so that no chord is long in L*."""
    pieces = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        # Even steps of the cube root where the light along the edge changes most; CIELAB is nearly even in them.
        fine = np.linspace(0, 1, 2049)[:, None]
        length = np.cumsum(np.linalg.norm(np.diff(Y_to_L(a + fine * (b - a)), axis=0), axis=1))
        count = int(np.ceil(length[-1] / _STEP)) + 1
        t = np.interp(np.arange(count) / count * length[-1], np.append(0, length), fine[:, 0])
        pieces.append(a + t[:, None] * (b - a))
    return np.concatenate(pieces)


def largest_rectangle(corners: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The axis-parallel rectangle in a convex polygon of linear light whose sides in L* have the largest product.

    For given s0 < s1 the best t range follows: a convex polygon holds the rectangle when it holds its four corners,
    so t1 = min(top(s0), top(s1)) and t0 = max(bottom(s0), bottom(s1)). The search over (s0, s1) discards cells whose
    upper bound is below the best rectangle found, so no better basin can be missed; then it closes in on the optimum.

    Parameters
    ----------
    corners : (m, 2) float64 array
        The polygon (s, t) in linear light, counter-clockwise.

    Returns
    -------
    low, high : (2,) float64 arrays
        (s0, t0) and (s1, t1).
    """
    chains = _Chains.of(corners)
    darkest, lightest = Y_to_L(chains.s_range)
    grid = np.linspace(darkest, lightest, _GRID + 1)
    cells = np.array([(i, j) for i in range(_GRID) for j in range(i, _GRID)])
    low, width = grid[cells], grid[1] - grid[0]  # low: (cells, 2), L(s0) and L(s1) at the near corner of a cell
    best, at = 0.0, low[0]
    while len(low):
        areas = chains.area(low + width / 2)
        if areas.max() > best:
            best, at = float(areas.max()), low[np.argmax(areas)] + width / 2
        low = low[chains.area_bound(low, low + width) > best * (1 + _GAP)]
        width /= 2
        low = (low[:, None] + width * np.array([(0, 0), (0, 1), (1, 0), (1, 1)])).reshape(-1, 2)
    return chains.rectangle(_closed_in(chains, at, 4 * width))


def _closed_in(chains: _Chains, at: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
    """The best (L(s0), L(s1)) near `at`, by ever smaller grids about the best so far."""
    steps = np.stack(np.meshgrid(np.linspace(-1, 1, 17), np.linspace(-1, 1, 17)), axis=-1).reshape(-1, 2)
    while reach > 1e-9:
        near = np.clip(at + reach * steps, *Y_to_L(chains.s_range))
        at = near[np.argmax(chains.area(near))]
        reach *= 0.7
    return at


@dataclass(frozen=True, eq=False)
class _Chains:
    """A convex polygon as a concave top and a convex bottom over s; candidates are (L(s0), L(s1)), (..., 2)."""

    top: NDArray[np.float64]
    bottom: NDArray[np.float64]

    @classmethod
    def of(cls, corners: NDArray[np.float64]) -> _Chains:
        """Both chains, each from left to right, of a polygon (m, 2) given counter-clockwise."""
        left, right = np.lexsort((corners[:, 1], corners[:, 0]))[[0, -1]]
        ring = np.roll(corners, -left, axis=0)
        right = (right - left) % len(corners)
        # lexsort begins at the lower end of a vertical left edge and ends at the upper end of a right one.
        return cls(np.append(ring[right:], ring[:1], axis=0)[::-1], ring[: right + 1])

    @property
    def s_range(self) -> NDArray[np.float64]:
        """Lowest and highest s of the polygon, (2,)."""
        return self.bottom[[0, -1], 0]

    def area(self, L_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest rectangle between s0 and s1, in L* x L*; 0 where there is none."""
        s = L_to_Y(L_s)
        t1 = np.min(np.interp(s, *self.top.T), axis=-1)
        t0 = np.max(np.interp(s, *self.bottom.T), axis=-1)
        return np.maximum(L_s[..., 1] - L_s[..., 0], 0) * np.maximum(Y_to_L(t1) - Y_to_L(t0), 0)

    def area_bound(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
        """A bound above `area` anywhere in the cells low..high, each (..., 2)."""
        s_low, s_high = L_to_Y(low), L_to_Y(high)
        peak, valley = self.top[np.argmax(self.top[:, 1]), 0], self.bottom[np.argmin(self.bottom[:, 1]), 0]
        t1 = np.min(np.interp(np.clip(peak, s_low, s_high), *self.top.T), axis=-1)
        t0 = np.max(np.interp(np.clip(valley, s_low, s_high), *self.bottom.T), axis=-1)
        return np.maximum(high[..., 1] - low[..., 0], 0) * np.maximum(Y_to_L(t1) - Y_to_L(t0), 0)

    def rectangle(self, L_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Corners (s0, t0) and (s1, t1) of the largest rectangle between s0 and s1, in linear light."""
        s = L_to_Y(L_s)
        return (
            np.array([s[0], np.max(np.interp(s, *self.bottom.T))]),
            np.array([s[1], np.min(np.interp(s, *self.top.T))]),
        )
