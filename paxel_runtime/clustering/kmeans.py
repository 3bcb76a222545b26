"""K-means on points: Lloyd's iteration from given starts, and one more cluster where it helps most.

Deterministic: a fixed sample of the pixels, ties to the first. Points and centres only; what they mean is elsewhere.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.errors import CalibrationError
from paxel_runtime.numba_options import KERNEL

__all__ = ["SAMPLE_SIZE", "distortion_gains", "lloyd", "nearest", "sample_indices", "too_few_colors"]

SAMPLE_SIZE = 200_000
"""Pixels the centres are fitted to: their mean is known to 0.1 Lab where the clusters spread by 40."""

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


def lloyd(
    points: NDArray[np.float64], starts: NDArray[np.float64], max_iterations: int = 300
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """K-means by Lloyd's iteration from given starts, until no point changes its cluster.

    Parameters
    ----------
    points : (n, d) float64 array
    starts : (K, d) float64 array
        A centre that loses all its points is set anew on the point farthest from its own centre, so starts need only
        be roughly right.
    max_iterations : int
        Where it stops in any case; by then centres move by less than their sampling error.

    Returns
    -------
    centres : (K, d) float64 array
    labels : (n,) int64 array

    Raises
    ------
    CalibrationError
        If the points hold fewer than K different colours.
    """
    centres = np.array(starts, np.float64)
    previous = np.full(len(points), -1, np.int64)
    for _ in range(max_iterations):
        labels, distances = nearest(points, centres)
        if np.array_equal(labels, previous):
            break
        previous = labels
        sizes = np.bincount(labels, minlength=len(centres))
        for d in range(points.shape[1]):
            sums = np.bincount(labels, weights=points[:, d], minlength=len(centres))
            centres[:, d] = np.where(sizes > 0, sums / np.maximum(sizes, 1), centres[:, d])
        for empty in np.flatnonzero(sizes == 0):
            farthest = int(np.argmax(distances))
            if not distances[farthest] > 0:
                raise CalibrationError(too_few_colors(len(centres), len(np.unique(labels))))
            centres[empty] = points[farthest]
            distances[farthest] = 0.0
    return centres, labels


def distortion_gains(
    points: NDArray[np.float64], centres: NDArray[np.float64], candidates: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How much each candidate, as one more centre, takes off the sum of squared distances, (number of candidates,).

    The step of fast global k-means (Likas, Vlassis and Verbeek 2003).
    """
    _, distances = nearest(points, centres)
    return np.array([np.sum(np.maximum(0.0, distances - np.sum((points - c) ** 2, axis=1))) for c in candidates])


def sample_indices(valid: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Flat indices of at most `SAMPLE_SIZE` valid pixels, spread by the golden ratio: no stride to beat with the dots.

    Raises
    ------
    CalibrationError
        If no pixel is valid.
    """
    indices = np.flatnonzero(valid)
    if not indices.size:
        raise CalibrationError(
            "no projector pixel is registered on the pattern: is the whole projection in the camera's picture?"
        )
    if indices.size > SAMPLE_SIZE:
        chosen = np.zeros(indices.size, bool)
        chosen[(np.arange(SAMPLE_SIZE) * _GOLDEN % 1.0 * indices.size).astype(np.int64)] = True
        indices = indices[chosen]
    return indices


def too_few_colors(asked: int, found: int) -> str:
    """Text of the error where pixels hold fewer colours than clusters are asked for."""
    return (
        f"{asked} clusters were asked for and the nodal images hold only {found} colours: is the pattern lit, in "
        "focus and not overexposed? Otherwise lower clusters.count"
    )


@njit(**KERNEL)
def nearest(points: NDArray[np.float64], centres: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Index of the nearest centre of each point (the first of equals), and the squared distance to it."""
    labels = np.empty(len(points), np.int64)
    squares = np.empty(len(points))
    for i in range(len(points)):
        best, label = np.inf, 0
        for k in range(len(centres)):
            square = 0.0
            for d in range(points.shape[1]):
                square += (points[i, d] - centres[k, d]) ** 2
            if square < best:
                best, label = square, k
        labels[i], squares[i] = label, best
    return labels, squares
