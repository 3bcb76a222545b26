"""Contrast: how much of a picture's own detail a view shows. All of L* through the eye."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.observer.smoothing import local_deviation

__all__ = ["coherent_gain", "lightness_range", "local_contrast"]

_WINDOW_DEG = 0.25
_RANGE_PERCENTILES = (0.5, 99.5)
_NO_CONTRAST = 1e-3


def coherent_gain(
    L_view: NDArray[np.floating], L_target: NDArray[np.floating], inner: NDArray[np.bool_]
) -> float | None:
    """Gradient of the view projected on the target's: 1 where every edge has its full height.

    The sum over pixels of grad(view) . grad(target), over that of |grad(target)|^2: what is in the view and not in the
    target (noise, dots, a ghost) is not counted.

    Parameters
    ----------
    L_view, L_target : (H, W) arrays
    inner : (H, W) bool array

    Returns
    -------
    float or None
        None where the target has one lightness.
    """
    projected = power = 0.0
    for axis in (0, 1):
        both = np.logical_and(*_neighbours(inner, axis))
        view, target = (np.subtract(*_neighbours(L.astype(np.float64), axis)[::-1])[both] for L in (L_view, L_target))
        projected += float(view @ target)
        power += float(target @ target)
    return projected / power if power > _NO_CONTRAST**2 * np.count_nonzero(inner) else None


def local_contrast(L: NDArray[np.floating], inner: NDArray[np.bool_], px_per_degree: float) -> float:
    """Mean over the frame of the standard deviation of L* in a Gaussian window of sigma 0.25 degree.

    Parameters
    ----------
    L : (H, W) array
    inner : (H, W) bool array
    px_per_degree : float

    Returns
    -------
    float
        In L*.
    """
    return float(local_deviation(L, inner, _WINDOW_DEG * px_per_degree)[inner].mean())


def lightness_range(L: NDArray[np.floating], inner: NDArray[np.bool_]) -> list[float]:
    """L* of a view's dark and bright ends: its 0.5 and 99.5 percentiles."""
    return [float(v) for v in np.percentile(L[inner], _RANGE_PERCENTILES)]


def _neighbours(values: NDArray[np.generic], axis: int) -> tuple[NDArray[np.generic], NDArray[np.generic]]:
    """Each pixel, and the one after it."""
    first, second = [slice(None)] * 2, [slice(None)] * 2
    first[axis], second[axis] = slice(None, -1), slice(1, None)
    return values[tuple(first)], values[tuple(second)]
