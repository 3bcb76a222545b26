"""Sets of colours and of pairs of colours as data: half-spaces in XYZ, fields in CIELAB, and the slack of a point.

A convex set is kept as rows ``normals @ XYZ <= offsets`` with unit normals, so slack is a distance in XYZ (Y = 1 for
the white point). A set that is not convex is kept as a field besides: numbers on a grid in CIELAB, 0 on its boundary,
positive inside. Nothing here knows models, effects' conditions or meshes: ``paxel_design.gamut`` makes the rows, the
gamut mapping reads them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.errors import GamutError, InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab

__all__ = [
    "SURFACES",
    "LabField",
    "PairGamut",
    "SubGamut",
    "gray_interval",
    "min_slack",
    "subgamut_from_arrays",
]

SURFACES: tuple[str, str] = ("pattern", "white")
"""The two surfaces, by the names that models and files use."""

TOLERANCE = 1e-9
"""Slack below which a point still counts as inside, in XYZ: a millionth of the smallest visible difference."""

_BLOCK = 1 << 21
"""Products of rows and points held at once by `min_slack`: 16 MB."""


_FIELD_UNIT = 0.01
"""What one unit of a field counts in slack: about the XYZ that a unit of CIELAB is worth in mid-tones."""

_GRAY_STEP = 0.05
"""Step along the gray axis at which a field is asked, L*."""


@dataclass(frozen=True, eq=False)
class LabField:
    """A function of CIELAB, trilinear between the nodes of an even grid.

    Attributes
    ----------
    origin : (3,) float64 array
        Lab of node [0, 0, 0].
    step : float
        Distance of the nodes along L*, a* and b*.
    values : (l, m, n) float32 array
        About the distance to the boundary in CIELAB units, negative outside; negative on the grid's whole border.
    """

    origin: NDArray[np.float64]
    step: float
    values: NDArray[np.float32]

    def __post_init__(self) -> None:
        shape = self.values.shape
        if self.origin.shape != (3,) or not self.step > 0 or len(shape) != 3 or min(shape) < 2:
            raise InputError(f"a field needs an origin (3,), a step > 0 and values (l, m, n), got {shape}")

    def at(self, Lab: ArrayLike) -> NDArray[np.float64]:
        """Value at colours (..., 3) -> (...); beyond the grid that of its nearest border point, which is negative."""
        Lab = np.asarray(Lab, np.float64)
        last = np.array(self.values.shape) - 1
        place = np.clip((Lab.reshape(-1, 3) - self.origin) / self.step, 0, last)
        cell = np.minimum(place.astype(np.intp), last - 1)
        t = place - cell
        value = np.zeros(len(place))
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod(np.where(corner, t, 1 - t), axis=1)
            value += weight * self.values[tuple((cell + corner).T)]
        return value.reshape(Lab.shape[:-1])


@dataclass(frozen=True, eq=False)
class SubGamut:
    """The colours of one surface that an effect can use: a convex polytope, or the part of one where a field is >= 0.

    Attributes
    ----------
    effect : str
        The effect in its file-name form, such as ``"neutralize-50_0_0"``.
    shown_on : str
        The surface these colours are shown on, ``"pattern"`` or ``"white"``.
    normals : (m, 3) float64 array
        Unit rows; inside is where ``normals @ XYZ <= offsets``. A flat set has two opposite rows.
    offsets : (m,) float64 array
    white_point : (3,) float64 array
        XYZ of the model's white, Y = 1.
    field : LabField or None
        None where the half-spaces are the whole truth.

    Raises
    ------
    InputError
        If the shapes do not fit, a number is not finite, a row is not a unit row or the surface is unknown.
    """

    effect: str
    shown_on: str
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    white_point: NDArray[np.float64]
    field: LabField | None = None

    def __post_init__(self) -> None:
        if self.shown_on not in SURFACES:
            raise InputError(f"a sub-gamut's shown_on must be one of {', '.join(SURFACES)}; got {self.shown_on!r}")
        _check_rows("a sub-gamut", self.normals, self.offsets, self.white_point, 3)

    @property
    def file_stem(self) -> str:
        """Name of its files without the suffix, such as ``"full.on-pattern"``."""
        return f"{self.effect}.on-{self.shown_on}"

    def slack(self, XYZ: ArrayLike) -> NDArray[np.float64]:
        """Distance in XYZ to the nearest bounding plane, (..., 3) -> (...); negative outside.

        With a field, the smaller of that and a hundredth of the field: about a distance in XYZ too.
        """
        slack = min_slack(self.normals, self.offsets, XYZ)
        if self.field is None:
            return slack
        return np.minimum(slack, _FIELD_UNIT * self.field.at(XYZ_to_Lab(XYZ, self.white_point)))

    def contains(self, XYZ: ArrayLike, tolerance: float = TOLERANCE) -> NDArray[np.bool_]:
        """Whether colours lie inside, (..., 3) -> (...) bool, up to `tolerance` in XYZ."""
        return self.slack(XYZ) >= -tolerance

    def gray_range(self) -> tuple[float, float]:
        """Lowest and highest L* of the grays (multiples of the white point) inside; with a field, of the longest run.

        Raises
        ------
        GamutError
            If no gray lies inside, or only one.
        """
        low, high = gray_interval(self.normals, self.offsets, self.white_point)
        if not high - low > TOLERANCE:
            raise GamutError(
                f"sub-gamut {self.file_stem} must hold a stretch of the gray axis to take a picture's lightness, "
                f"and it holds {'none' if high < low - TOLERANCE else 'a single gray'}; choose another effect or value"
            )
        L = XYZ_to_Lab(np.array([[low], [high]]) * self.white_point, self.white_point)[:, 0]
        return (float(L[0]), float(L[1])) if self.field is None else self._gray_run(float(L[0]), float(L[1]))

    def _gray_run(self, low: float, high: float) -> tuple[float, float]:
        """The longest run of grays between two L* where the field is >= 0."""
        assert self.field is not None
        L = np.linspace(low, high, int((high - low) / _GRAY_STEP) + 2)
        inside = np.concatenate(([False], self.field.at(L[:, None] * np.array([1.0, 0.0, 0.0])) >= 0, [False]))
        begins, ends = np.flatnonzero(inside[1:] & ~inside[:-1]), np.flatnonzero(inside[:-1] & ~inside[1:]) - 1
        longest = np.argmax(ends - begins) if len(begins) else 0
        if not len(begins) or ends[longest] == begins[longest]:
            raise GamutError(
                f"sub-gamut {self.file_stem} must hold a stretch of the gray axis to take a picture's lightness, "
                "and it holds none; choose another effect or value"
            )
        return float(L[begins[longest]]), float(L[ends[longest]])


@dataclass(frozen=True, eq=False)
class PairGamut:
    """The pairs (colour on the pattern, colour on the white surface) that can be shown at once: a joint gamut.

    Attributes
    ----------
    normals : (m, 6) float64 array
        Unit rows over (XYZ on the pattern, XYZ on the white surface).
    offsets : (m,) float64 array
    white_point : (3,) float64 array
        XYZ of the model's white, Y = 1.

    Raises
    ------
    InputError
        If the shapes do not fit, a number is not finite, or a row is not a unit row.
    """

    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    white_point: NDArray[np.float64]

    def __post_init__(self) -> None:
        _check_rows("a pair gamut", self.normals, self.offsets, self.white_point, 6)

    def slack(self, XYZ_pattern: ArrayLike, XYZ_white: ArrayLike) -> NDArray[np.float64]:
        """Distance in the space of pairs to the nearest bounding plane, two (..., 3) -> (...); negative outside."""
        pair = np.broadcast_arrays(np.asarray(XYZ_pattern, np.float64), np.asarray(XYZ_white, np.float64))
        return min_slack(self.normals, self.offsets, np.concatenate(pair, axis=-1))

    def contains(self, XYZ_pattern: ArrayLike, XYZ_white: ArrayLike, tolerance: float = TOLERANCE) -> NDArray[np.bool_]:
        """Whether pairs lie inside, two (..., 3) -> (...) bool, up to `tolerance` in XYZ."""
        return self.slack(XYZ_pattern, XYZ_white) >= -tolerance


def subgamut_from_arrays(arrays: Mapping[str, NDArray[Any]]) -> SubGamut:
    """The sub-gamut of the arrays of ``gamut/<effect>.on-<surface>.npz``."""
    field = None
    if "field" in arrays:
        field = LabField(arrays["field_origin"], float(arrays["field_step"]), arrays["field"])
    return SubGamut(
        str(arrays["effect"]),
        str(arrays["shown_on"]),
        arrays["normals"],
        arrays["offsets"],
        arrays["white_point"],
        field,
    )


def min_slack(normals: NDArray[np.float64], offsets: NDArray[np.float64], points: ArrayLike) -> NDArray[np.float64]:
    """Smallest ``offsets - normals @ point`` of each point, (..., d) -> (...), in blocks of bounded memory."""
    points = np.asarray(points, np.float64)
    if points.ndim == 0 or points.shape[-1] != normals.shape[1]:
        raise InputError(f"colours must come as (..., {normals.shape[1]}), got shape {points.shape}")
    flat = points.reshape(-1, points.shape[-1])
    slack = np.empty(len(flat))
    step = max(1, _BLOCK // len(offsets))
    for i in range(0, len(flat), step):
        slack[i : i + step] = np.min(offsets - flat[i : i + step] @ normals.T, axis=1)
    return slack.reshape(points.shape[:-1])


def gray_interval(
    normals: NDArray[np.float64], offsets: NDArray[np.float64], gray: NDArray[np.float64]
) -> tuple[float, float]:
    """The lowest and highest t with ``normals @ (t gray) <= offsets``; low > high where there is none."""
    slope = normals @ gray
    # Rows along the axis (as both rows of a flat set that holds it) bound nothing, or shut everything out.
    along = np.abs(slope) <= TOLERANCE
    if np.any(offsets[along] < -TOLERANCE):
        return np.inf, -np.inf
    rising, falling = ~along & (slope > 0), ~along & (slope < 0)
    low = np.max(offsets[falling] / slope[falling], initial=-np.inf)
    high = np.min(offsets[rising] / slope[rising], initial=np.inf)
    return float(low), float(high)


def _check_rows(
    what: str,
    normals: NDArray[np.float64],
    offsets: NDArray[np.float64],
    white_point: NDArray[np.float64],
    dimensions: int,
) -> None:
    if normals.ndim != 2 or normals.shape[1] != dimensions or not len(normals) or offsets.shape != normals.shape[:1]:
        raise InputError(
            f"{what} needs normals (m, {dimensions}) and offsets (m,), got {normals.shape} and {offsets.shape}"
        )
    if white_point.shape != (3,) or not np.all(white_point > 0):
        raise InputError(f"{what} needs a white point of three numbers > 0, got {white_point}")
    if not (np.all(np.isfinite(normals)) and np.all(np.isfinite(offsets))):
        raise InputError(f"{what} needs finite half-spaces")
    if np.any(np.abs(np.linalg.norm(normals, axis=1) - 1) > 1e-6):
        raise InputError(f"{what} needs normals of length 1")
