"""Samples of captures: a few rows and columns at full resolution, and what two of them have in common.

Small enough that those of a whole sequence fit into memory; must not know what a capture should show.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Sample", "displacement", "line_ends", "odd_share", "same_picture", "take_sample"]

_LINES = 24
"""Rows, and columns, of a sample."""
_SATURATION = 65400
_REACH_PX = 12
"""Camera pixels that a movement is looked for."""
_MOVED_PX = 0.7
"""Camera pixels; less is left to the figures of the fit."""
_ODD = 0.25
"""Of the light: difference from which on two values are not the same. The lamp's drift is a few percent."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A few rows and columns of a capture, at its full resolution.

    Attributes
    ----------
    rows : (n, w) uint16 array
    columns : (n, h) uint16 array
    clipped : float
        Share of saturated pixels in the whole capture.
    """

    rows: NDArray[np.uint16]
    columns: NDArray[np.uint16]
    clipped: float

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the capture."""
        return self.rows.shape[1], self.columns.shape[1]

    @property
    def values(self) -> NDArray[np.float64]:
        """All sampled pixels in one row."""
        return np.concatenate([self.rows.ravel(), self.columns.ravel()]).astype(np.float64)


def take_sample(capture: NDArray[np.uint16]) -> Sample:
    """Sample a capture, (h, w) uint16, 65535 = saturated."""
    at = [np.unique(((np.arange(_LINES) + 0.5) * length / _LINES).astype(int)) for length in capture.shape]
    return Sample(capture[at[0]], np.ascontiguousarray(capture[:, at[1]].T), float(np.mean(capture >= _SATURATION)))


def odd_share(one: Sample, two: Sample, full: NDArray[np.float64], light: NDArray[np.float64]) -> float:
    """Share of the lit pixels at which two captures do not add up to `full`, by a quarter of the light.

    Parameters
    ----------
    full, light : (n,) float64 arrays
        White plus black, and white minus black (0 where it is dark), of the sampled pixels.
    """
    lit = light > 0
    excess = (one.values + two.values - full)[lit]
    return float(np.mean(np.abs(excess) > _ODD * light[lit])) if excess.size else 1.0


def same_picture(one: Sample, two: Sample, light: NDArray[np.float64]) -> bool:
    """Whether two captures show the same, but for noise."""
    lit = light > 0
    return float(np.mean(np.abs(one.values - two.values)[lit] > _ODD * light[lit])) < 0.02


def line_ends(sample: Sample) -> NDArray[np.int64]:
    """Where in `Sample.values` a row or column of the picture ends."""
    widths = [sample.rows.shape[1]] * len(sample.rows) + [sample.columns.shape[1]] * len(sample.columns)
    return np.cumsum(widths)


def displacement(before: tuple[Sample, Sample], now: tuple[Sample, Sample]) -> tuple[float, float] | None:
    """How far the sum of two captures moved against the sum of two others, camera pixels along x and y.

    None where neither fits better displaced.
    """
    moved = False
    shift = []
    for lines in ("rows", "columns"):
        a, b = (sum(getattr(s, lines).astype(np.float64) for s in pair) for pair in (before, now))
        misfit = _misfits(a, b)
        best = int(np.argmin(misfit))
        moved |= misfit[best] < 0.6 * misfit[_REACH_PX] and abs(best - _REACH_PX) >= 1
        place = float(best - _REACH_PX)
        if 0 < best < len(misfit) - 1:
            left, here, right = misfit[best - 1 : best + 2]
            place += 0.5 * (left - right) / max(left - 2.0 * here + right, 1e-12)
        shift.append(place)
    return (shift[0], shift[1]) if moved and max(map(abs, shift)) >= _MOVED_PX else None


def _misfits(a: NDArray[np.float64], b: NDArray[np.float64]) -> list[float]:
    """Mean square difference of b, displaced by -`_REACH_PX` to `_REACH_PX` pixels, from a."""
    length = a.shape[1]
    return [
        float(np.mean((a[:, _REACH_PX : length - _REACH_PX] - b[:, _REACH_PX + d : length - _REACH_PX + d]) ** 2))
        for d in range(-_REACH_PX, _REACH_PX + 1)
    ]
