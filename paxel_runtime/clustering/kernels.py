"""Compiled loops over all pixels: label, and sums for the diagnostics. Checked against plain numpy in the tests.

Memory: the labels, besides the pictures given. The lock of the interpreter is released, so that bands of rows can run
side by side.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import INLINED, KERNEL

__all__ = ["label_by_coverage", "label_by_light"]

_EPSILON, _KAPPA = (6.0 / 29.0) ** 3, (29.0 / 3.0) ** 3
_HALF_LOW, _HALF_HIGH = 0.25, 0.75

_Sums = tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int64]]


@njit(**INLINED)
def _cube_root(t: float) -> float:
    """Cube root of t > 0: the exponent divided by 3 in the float's bits, then two Halley steps (3e-14 relative).

    A third of the time of the library's, and half of the time of labelling is cube roots.
    """
    root = np.float64(np.int32(np.float32(t).view(np.int32) // 3 + 709921077).view(np.float32))
    for _ in range(2):
        cube = root * root * root
        root *= (cube + 2.0 * t) / (2.0 * cube + t)
    return root


@njit(**INLINED)
def _f_and_slope(t: float) -> tuple[float, float]:
    """CIELAB's f of a tristimulus ratio, and its derivative."""
    if t > _EPSILON:
        f = _cube_root(t)
        return f, 1.0 / (3.0 * f * f)
    return (_KAPPA * t + 16.0) / 116.0, _KAPPA / 116.0


@njit(**INLINED)
def _square(dx: float, dy: float, dz: float) -> float:
    return dx * dx + dy * dy + dz * dz


@njit(**INLINED)
def _between(t: float, bounds: NDArray[np.float64]) -> int:
    """Number of bounds that t lies above."""
    above = 0
    for b in bounds:
        if t > b:
            above += 1
    return above


def label_by_light(
    nodal_XYZ: NDArray[np.float32],
    valid: NDArray[np.bool_],
    white: NDArray[np.float64],
    colorants_XYZ: NDArray[np.float64],
    pairs: NDArray[np.int64],
    bounds: NDArray[np.float64],
    pair_labels: NDArray[np.int64],
    centres_Lab: NDArray[np.float64],
    perceptual: bool,
    nearest_centre: bool,
) -> _Sums:
    """Label of the mixture of two colorants, additive in XYZ, that is nearest to each pixel.

    Nearest by CIELAB's differential at the pixel (`perceptual`), or in XYZ over white: either way the colorants are
    points e around the pixel, and the mixture nearest to it is a point of the segment between two of them. With
    `nearest_centre` the label is that of the centre nearest in CIELAB instead, and the mixture is only counted.

    Returns
    -------
    labels : (H, W) uint8 array
    sizes, squares : (K,) arrays
        Number of pixels of each cluster, and sum of squared CIELAB distances from its centre.
    shares : (K, C) float64 array
        Sum of the shares of each colorant in each cluster.
    halves : (P,) int64 array
        Pixels that light both colorants of a pair about equally (a quarter to three quarters).
    """
    C, K = len(colorants_XYZ), len(centres_Lab)
    sums = np.zeros(K, np.int64), np.zeros(K), np.zeros((K, C)), np.zeros(len(pairs), np.int64)
    labels = np.full(valid.shape, 255, np.uint8)
    colorants = colorants_XYZ / white
    rules = pairs, bounds, pair_labels, centres_Lab, perceptual, nearest_centre
    scratch = np.empty(3), np.empty(3), np.empty(3), np.empty((C, 3)), np.empty((C, C))
    _label_into(nodal_XYZ, valid, white, colorants, *rules, labels, *sums, *scratch)
    return labels, *sums


@njit(**KERNEL)
def _label_into(
    nodal_XYZ: NDArray[np.float32],
    valid: NDArray[np.bool_],
    white: NDArray[np.float64],
    colorants: NDArray[np.float64],
    pairs: NDArray[np.int64],
    bounds: NDArray[np.float64],
    pair_labels: NDArray[np.int64],
    centres_Lab: NDArray[np.float64],
    perceptual: bool,
    nearest_centre: bool,
    labels: NDArray[np.uint8],
    sizes: NDArray[np.int64],
    squares: NDArray[np.float64],
    shares: NDArray[np.float64],
    halves: NDArray[np.int64],
    ratio: NDArray[np.float64],
    f: NDArray[np.float64],
    slope: NDArray[np.float64],
    e: NDArray[np.float64],
    gram: NDArray[np.float64],
) -> None:
    """`label_by_light` over white, into zeros; the arrays from `ratio` on are scratch."""
    C, K, P = len(colorants), len(centres_Lab), len(pairs)
    for row in range(valid.shape[0]):
        for column in range(valid.shape[1]):
            if not valid[row, column]:
                continue
            for c in range(3):
                ratio[c] = nodal_XYZ[row, column, c] / white[c]
                f[c], slope[c] = _f_and_slope(ratio[c])
                if not perceptual:
                    slope[c] = 1.0
            for i in range(C):
                d0 = (colorants[i, 0] - ratio[0]) * slope[0]
                d1 = (colorants[i, 1] - ratio[1]) * slope[1]
                d2 = (colorants[i, 2] - ratio[2]) * slope[2]
                if perceptual:
                    d0, d1, d2 = 500.0 * (d0 - d1), 116.0 * d1, 200.0 * (d1 - d2)
                e[i, 0], e[i, 1], e[i, 2] = d0, d1, d2
                for j in range(i + 1):
                    gram[j, i] = d0 * e[j, 0] + d1 * e[j, 1] + d2 * e[j, 2]
            best, pair, t = gram[0, 0], 0, 0.0
            for i in range(P):
                p, q = pairs[i, 0], pairs[i, 1]
                along = gram[p, p] - gram[p, q]  # of the pixel's foot on the way from p to q, times the way's length
                length = along + gram[q, q] - gram[p, q]
                if 0.0 < along < length:
                    square = gram[p, p] - along * along / length
                    if square < best:
                        best, pair, t = square, i, along / length
                elif p == 0 and gram[q, q] < best:
                    best, pair, t = gram[q, q], i, 1.0
            label = pair_labels[pair, _between(t, bounds[pair])]
            L, a, b = 116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])
            if nearest_centre:
                best = np.inf
                for k in range(K):
                    square = _square(L - centres_Lab[k, 0], a - centres_Lab[k, 1], b - centres_Lab[k, 2])
                    if square < best:
                        best, label = square, k
            labels[row, column] = label
            sizes[label] += 1
            squares[label] += _square(L - centres_Lab[label, 0], a - centres_Lab[label, 1], b - centres_Lab[label, 2])
            shares[label, pairs[pair, 0]] += 1.0 - t
            shares[label, pairs[pair, 1]] += t
            if _HALF_LOW < t < _HALF_HIGH:
                halves[pair] += 1


@njit(**KERNEL)
def label_by_coverage(
    coverage: NDArray[np.float32],
    valid: NDArray[np.bool_],
    pairs: NDArray[np.int64],
    bounds: NDArray[np.float64],
    pair_labels: NDArray[np.int64],
    clusters: int,
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float64], NDArray[np.int64]]:
    """Label of the two colorants that cover most of each pixel's area, by the second one's share of both.

    Returns
    -------
    labels, sizes, shares, halves
        As `label_by_light`, of the whole picture; shares are sums of the coverages.
    """
    height, width, C = coverage.shape
    labels = np.full((height, width), np.uint8(255))
    sizes, shares = np.zeros(clusters, np.int64), np.zeros((clusters, C))
    halves = np.zeros(len(pairs), np.int64)
    index = np.zeros((C, C), np.int64)
    for i in range(len(pairs)):
        index[pairs[i, 0], pairs[i, 1]] = i
    for row in range(height):
        for column in range(width):
            if not valid[row, column]:
                continue
            first, second = 0, 1
            if coverage[row, column, 1] > coverage[row, column, 0]:
                first, second = 1, 0
            for c in range(2, C):
                if coverage[row, column, c] > coverage[row, column, first]:
                    first, second = c, first
                elif coverage[row, column, c] > coverage[row, column, second]:
                    second = c
            p, q = min(first, second), max(first, second)
            total = coverage[row, column, p] + coverage[row, column, q]
            t = coverage[row, column, q] / total if total > 0.0 else 0.0
            pair = index[p, q]
            label = pair_labels[pair, _between(t, bounds[pair])]
            labels[row, column] = label
            sizes[label] += 1
            for c in range(C):
                shares[label, c] += coverage[row, column, c]
            if _HALF_LOW < t < _HALF_HIGH:
                halves[pair] += 1
    return labels, sizes, shares, halves
