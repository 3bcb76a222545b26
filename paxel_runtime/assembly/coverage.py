"""Coverages of projector pixels: what assembly does with them before they enter a pixel's response.

A coverage is (H, W, C, M) uint8: the share of each of M colorants in what a pixel lights, 255 = all; C is 1, or the
number of channels where chromatic aberration lays their pixels apart. How coverages are measured stands in
``calibration/``.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import KERNEL

__all__ = ["cluster_coverage", "coverage_from_labels", "spread_coverage"]

_PARENTS = re.compile(r"\+|-\d+$")


def coverage_from_labels(labels: NDArray[np.uint8], clusters: Sequence[str]) -> NDArray[np.uint8]:
    """Coverage (H, W, 1 or N, M) as if each pixel of a cluster lay on its colorant alone: where nothing more is known.

    Parameters
    ----------
    labels : (H, W) or (H, W, N) uint8 array
        255 = outside the pattern.
    clusters : sequence of K str
        Names: the colorants, then edge clusters by their parents, ``"black+white"`` or ``"black+white-2"``, which lie
        half on each.
    """
    colorants = [name for name in clusters if "+" not in name]
    shares = np.zeros((256, len(colorants)), np.uint8)
    for k, name in enumerate(clusters):
        parents = [name] if name in colorants else [m for m in colorants if m in _PARENTS.split(name)]
        for parent in parents:
            shares[k, colorants.index(parent)] = 255 // len(parents)
    return shares[labels if labels.ndim == 3 else labels[..., None]]


def spread_coverage(coverage: NDArray[np.uint8], variance: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Coverage of what a pixel lights when its light reaches beyond its own area: (H, W, C or N, M) uint8.

    Each share becomes a + (s^2 / 2) (its second differences along x and y): a blur of exactly the variance s^2, at
    each pixel its own.

    Parameters
    ----------
    coverage : (H, W, C, M) uint8 array
    variance : (1, 6) or (N, 6) float64 array
        Variance of the point spread for all channels or for each, projector px^2: coefficients of 1, u, v, u^2, u v,
        v^2, where u and v run from -1 at the first column and row to 1 at the last. Taken as 0 where it is below, as 1
        where it is above.

    Raises
    ------
    InputError
        If the coefficients are not finite, or not of the channels.
    """
    channels = max(coverage.shape[2], len(variance))
    if variance.ndim != 2 or variance.shape[1] != 6 or not np.all(np.isfinite(variance)):
        raise InputError(f"a point spread needs 6 finite coefficients a channel, got {variance.tolist()}")
    if len(variance) not in (1, channels) or coverage.shape[2] not in (1, channels):
        raise InputError(f"a point spread of {len(variance)} channels does not fit coverages of {coverage.shape[2]}")
    if not np.any(variance):
        return coverage
    if np.all(variance == variance[0]):
        channels, variance = coverage.shape[2], variance[:1]
    spread = np.empty((*coverage.shape[:2], channels, coverage.shape[3]), np.uint8)
    in_bands(partial(_spread, np.ascontiguousarray(coverage), variance, spread), len(spread))
    return spread


@njit(**KERNEL)
def _spread(
    coverage: NDArray[np.uint8], variance: NDArray[np.float64], spread: NDArray[np.uint8], first: int, stop: int
) -> None:
    height, width, channels, colorants = spread.shape
    planes, kinds = coverage.shape[2], variance.shape[0]
    for row in range(first, stop):
        up, down = max(row - 1, 0), min(row + 1, height - 1)
        v = 2.0 * row / max(height - 1, 1) - 1.0
        for column in range(width):
            left, right = max(column - 1, 0), min(column + 1, width - 1)
            u = 2.0 * column / max(width - 1, 1) - 1.0
            for j in range(channels):
                c, plane = variance[j % kinds], j % planes
                beside = c[0] + c[1] * u + c[2] * v + c[3] * u * u + c[4] * u * v + c[5] * v * v
                beside = 0.5 * min(max(beside, 0.0), 1.0)
                own = 1.0 - 2.0 * beside
                for m in range(colorants):
                    above = own * coverage[up, column, plane, m] + beside * (
                        coverage[up, left, plane, m] + coverage[up, right, plane, m]
                    )
                    here = own * coverage[row, column, plane, m] + beside * (
                        coverage[row, left, plane, m] + coverage[row, right, plane, m]
                    )
                    below = own * coverage[down, column, plane, m] + beside * (
                        coverage[down, left, plane, m] + coverage[down, right, plane, m]
                    )
                    spread[row, column, j, m] = int(own * here + beside * (above + below) + 0.5)


def cluster_coverage(
    coverage: NDArray[np.uint8], labels: NDArray[np.uint8], clusters: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mean coverage of each cluster's pixels in each channel, and the clusters' shares of all pixels inside.

    Parameters
    ----------
    coverage : (H, W, C, M) uint8 array
    labels : (H, W, L) uint8 array
        255 outside; C and L are 1 or the number of channels.
    clusters : int
        K.

    Returns
    -------
    means : (1 or N, K, M) float64 array
        0..1; zeros for a cluster without pixels. One where neither coverage nor labels differ between channels.
    shares : (K,) float64 array
    """
    channels = max(coverage.shape[2], labels.shape[2])
    sums = np.zeros((len(coverage), channels, clusters, coverage.shape[3]), np.int64)
    counts = np.zeros((len(coverage), channels, clusters), np.int64)
    in_bands(
        partial(_row_sums, np.ascontiguousarray(coverage), np.ascontiguousarray(labels), sums, counts), len(coverage)
    )
    total, count = sums.sum(axis=0).astype(np.float64), counts.sum(axis=0).astype(np.float64)
    return total / np.maximum(count, 1.0)[..., None] / 255.0, count.sum(axis=0) / max(count.sum(), 1.0)


@njit(**KERNEL)
def _row_sums(
    coverage: NDArray[np.uint8],
    labels: NDArray[np.uint8],
    sums: NDArray[np.int64],
    counts: NDArray[np.int64],
    first: int,
    stop: int,
) -> None:
    _, width, of_coverage, colorants = coverage.shape
    of_labels = labels.shape[2]
    for row in range(first, stop):
        for column in range(width):
            for j in range(sums.shape[1]):
                label = labels[row, column, j % of_labels]
                if label >= sums.shape[2]:
                    continue
                counts[row, j, label] += 1
                for m in range(colorants):
                    sums[row, j, label, m] += coverage[row, column, j % of_coverage, m]
