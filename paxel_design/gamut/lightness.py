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

__all__ = ["GRAY_SHEETS", "LightnessArea", "lightness_area", "lightness_figures", "lightness_rectangle"]

_STEP = 0.25
"""Longest chord along the curved edges, in L*: the area is then right to about 1 part in 100,000."""

_GAP = 1e-3
"""Relative gap at which the search for the largest rectangle has proven which basin holds it."""

_GRID = 24
"""Cells a side of the first grid of that search."""

GRAY_SHEETS = (0.5, 0.4, 0.3)
"""Luminance of gray sheets that are told of, as shares of the white sheet's (the paper's remedy, Section VII)."""

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
    L_same : (float, float) or None
        The longest range that both surfaces can have at once; None where there is none (the pattern is always darker
        than a white sheet; a gray one helps, Section VII).
    L_same_by_sheet : dict of float to (float, float) or None
        The same if the second surface were a neutral sheet that shows full white as this luminance: 1 and
        `GRAY_SHEETS`.
    """

    area: float
    polygon: NDArray[np.float64]
    L_pattern: tuple[float, float]
    L_white: tuple[float, float]
    L_same: tuple[float, float] | None
    L_same_by_sheet: dict[float, tuple[float, float] | None]


def lightness_area(joint: JointGamut) -> LightnessArea:
    """The lightness area of a joint gamut and its largest rectangle.

    Raises
    ------
    InputError
        If the model has one surface.
    GamutError
        If no grays, or no area of them, can be shown on both surfaces at once.
    """
    corners = _gray_pairs(joint)
    polygon = Y_to_L(_followed(corners))
    x, y = polygon.T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    white = joint.model.white
    assert white is not None
    # A neutral sheet multiplies all light on it: pairs (s, t) become (s, gain t).
    brightest = float(white.black[1] + white.A[1].sum())
    by_sheet = {Y: _same_range(corners * [1.0, Y / brightest]) for Y in (1.0, *GRAY_SHEETS)}
    return LightnessArea(area, polygon, *_ranges(*largest_rectangle(corners)), _same_range(corners), by_sheet)


def lightness_rectangle(
    joint: JointGamut, *, same_range: bool = False, least_L_pattern: float = 0.0, least_L_white: float = 0.0
) -> tuple[tuple[float, float], tuple[float, float]]:
    """The largest rectangle in the lightness area under a condition.

    Parameters
    ----------
    joint : JointGamut
    same_range : bool
        Ask for one range of L*, the longest that both surfaces can have.
    least_L_pattern, least_L_white : float
        Least length of the range on a surface, L*; the product of both is as large as that allows.

    Returns
    -------
    L_pattern, L_white : (float, float)

    Raises
    ------
    InputError
        If the model has one surface, or both kinds of condition are given.
    GamutError
        If no such rectangle exists.
    """
    corners = _gray_pairs(joint)
    least = np.array([least_L_pattern, least_L_white], np.float64)
    if same_range:
        if np.any(least):
            raise InputError("a lightness rectangle takes same_range or least ranges, not both")
        same = _same_range(corners)
        if same is None:
            raise GamutError(
                "both surfaces have no range of lightness in common at once: the pattern is always darker than the "
                "second surface; use a gray sheet"
            )
        return same, same
    low, high = largest_rectangle(corners, (least[0], least[1]))
    found = _ranges(low, high)
    longest = [r[1] - r[0] for r in found]
    if not all(length > 0 for length in longest) or np.any(np.array(longest) < least - 1e-6):
        free = _ranges(*largest_rectangle(corners))
        raise GamutError(
            f"no rectangle of grays is at least {least[0]:g} on the pattern and {least[1]:g} on the white surface in "
            f"L*; without a condition it is {free[0][1] - free[0][0]:.1f} by {free[1][1] - free[1][0]:.1f}"
        )
    return found


def _gray_pairs(joint: JointGamut) -> NDArray[np.float64]:
    """Corners (m, 2) of the pairs (s, t) with (s gray, t gray) in the joint gamut, counter-clockwise.

    Raises
    ------
    InputError, GamutError
        As `lightness_area`.
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
    return corners[ConvexHull(corners).vertices]


def _ranges(low: NDArray[np.float64], high: NDArray[np.float64]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges of L* on the pattern and on the white surface of a rectangle in linear light."""
    L_low, L_high = Y_to_L(np.array([low, high]))
    return (float(L_low[0]), float(L_high[0])), (float(L_low[1]), float(L_high[1]))


def _same_range(corners: NDArray[np.float64]) -> tuple[float, float] | None:
    """The longest [L0, L1] with every pair of it in the polygon; None where only points are.

    For given Y0 the highest Y1 follows from each edge in closed form; then the best Y0 is searched by ever finer
    steps. Only Y0 whose own pair (Y0, Y0) lies inside count.
    """
    edge = np.roll(corners, -1, axis=0) - corners
    normals = np.stack((edge[:, 1], -edge[:, 0]), axis=1)
    offsets = np.sum(normals * corners, axis=1)
    a, b = normals.T
    darkest, lightest = Y_to_L(np.array([corners.min(), corners.max()]))
    L = np.linspace(darkest, lightest, 4001)
    best = (0.0, 0.0)
    for _ in range(4):
        Y0 = L_to_Y(L)
        Y1 = np.full(len(L), np.inf)
        # The corners (Y1, Y1), (Y1, Y0), (Y0, Y1) of the square, each c Y1 <= d - e Y0 for every edge.
        for c, e in ((a + b, 0 * a), (a, b), (b, a)):
            rising = c > 0
            bound = (offsets[rising] - e[rising] * Y0[:, None]) / c[rising]
            Y1 = np.minimum(Y1, np.min(bound, axis=1, initial=np.inf))
            broken = np.any(c[~rising] * Y0[:, None] + e[~rising] * Y0[:, None] > offsets[~rising] + 1e-12, axis=1)
            Y1[broken] = -np.inf
        length = np.where(Y1 > Y0, Y_to_L(np.maximum(Y1, Y0)) - L, 0.0)
        k = int(np.argmax(length))
        if length[k] > best[1] - best[0]:
            best = (float(L[k]), float(L[k] + length[k]))
        L = np.linspace(L[max(k - 1, 0)], L[min(k + 1, len(L) - 1)], 101)
    return best if best[1] - best[0] > 1e-6 else None


def lightness_figures(lightness: LightnessArea) -> dict[str, Any]:
    """The figures of ``gamut/lightness.json`` (design: section 4, *Files*).

    Ranges of L* that both surfaces can have at once are told for this second surface, and for neutral sheets.
    """
    return {
        "area": lightness.area,
        "polygon": lightness.polygon.tolist(),
        "rectangle": {"L_pattern": list(lightness.L_pattern), "L_white": list(lightness.L_white)},
        "same_range": None if lightness.L_same is None else list(lightness.L_same),
        "same_range_by_sheet": {
            "white" if Y == 1 else f"gray {Y:g}": None if same is None else list(same)
            for Y, same in lightness.L_same_by_sheet.items()
        },
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


def largest_rectangle(
    corners: NDArray[np.float64], least: tuple[float, float] = (0.0, 0.0)
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The axis-parallel rectangle in a convex polygon of linear light whose sides in L* have the largest product.

    For given s0 < s1 the best t range follows: a convex polygon holds the rectangle when it holds its four corners,
    so t1 = min(top(s0), top(s1)) and t0 = max(bottom(s0), bottom(s1)). The search over (s0, s1) discards cells whose
    upper bound is below the best rectangle found, so no better basin can be missed; then it closes in on the optimum.

    Parameters
    ----------
    corners : (m, 2) float64 array
        The polygon (s, t) in linear light, counter-clockwise.
    least : (float, float)
        Least length of either side, L*; where none is so large the answer is a point.

    Returns
    -------
    low, high : (2,) float64 arrays
        (s0, t0) and (s1, t1).
    """
    chains = _Chains.of(corners, least)
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
    least: tuple[float, float]

    @classmethod
    def of(cls, corners: NDArray[np.float64], least: tuple[float, float]) -> _Chains:
        """Both chains, each from left to right, of a polygon (m, 2) given counter-clockwise."""
        left, right = np.lexsort((corners[:, 1], corners[:, 0]))[[0, -1]]
        ring = np.roll(corners, -left, axis=0)
        right = (right - left) % len(corners)
        # lexsort begins at the lower end of a vertical left edge and ends at the upper end of a right one.
        return cls(np.append(ring[right:], ring[:1], axis=0)[::-1], ring[: right + 1], least)

    @property
    def s_range(self) -> NDArray[np.float64]:
        """Lowest and highest s of the polygon, (2,)."""
        return self.bottom[[0, -1], 0]

    def area(self, L_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest rectangle between s0 and s1, in L* x L*; 0 where there is none."""
        s = L_to_Y(L_s)
        t1 = np.min(np.interp(s, *self.top.T), axis=-1)
        t0 = np.max(np.interp(s, *self.bottom.T), axis=-1)
        return self._product(L_s[..., 1] - L_s[..., 0], Y_to_L(t1) - Y_to_L(t0))

    def _product(self, width: NDArray[np.float64], height: NDArray[np.float64]) -> NDArray[np.float64]:
        allowed = (width >= self.least[0]) & (height >= self.least[1])
        return np.where(allowed, np.maximum(width, 0) * np.maximum(height, 0), 0.0)

    def area_bound(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
        """A bound above `area` anywhere in the cells low..high, each (..., 2)."""
        s_low, s_high = L_to_Y(low), L_to_Y(high)
        peak, valley = self.top[np.argmax(self.top[:, 1]), 0], self.bottom[np.argmin(self.bottom[:, 1]), 0]
        t1 = np.min(np.interp(np.clip(peak, s_low, s_high), *self.top.T), axis=-1)
        t0 = np.max(np.interp(np.clip(valley, s_low, s_high), *self.bottom.T), axis=-1)
        return self._product(high[..., 1] - low[..., 0], Y_to_L(t1) - Y_to_L(t0))

    def rectangle(self, L_s: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Corners (s0, t0) and (s1, t1) of the largest rectangle between s0 and s1, in linear light."""
        s = L_to_Y(L_s)
        return (
            np.array([s[0], np.max(np.interp(s, *self.bottom.T))]),
            np.array([s[1], np.min(np.interp(s, *self.top.T))]),
        )
