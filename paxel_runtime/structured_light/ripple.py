"""The ripple of shifted lines: what the lines' shape adds to their phase, measured on the captures and taken out.

With 8 shifts of one pixel, the first harmonic of a pixel's profile over time also collects harmonics 7 and 9 of the
line's shape (aliasing): an error of the position, periodic in one projector pixel, of up to 0.02 pixels (blur 0.36) or
0.03 (fill factor 0.9). Sinusoids are shown in steps of a pixel, whose harmonics 15 and 17 do the same. Knows positions
over the picture; must not know captures or Gray code.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL

__all__ = ["remove_ripple"]

_BLOCK = 32
"""Camera pixels along a block in which the ripple is measured."""
_BLOCKS = 1000
"""Blocks used, spread over the picture: the few coefficients need no more."""
_DEGREE = 4
"""Of the ripple's course over the picture: blur grows to the corners."""
_LIKELY_PX = 0.02
"""Amplitude expected beforehand; matters only where the captures tell little."""
_ORDERS = np.array([(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)])


def remove_ripple(place: NDArray[np.float32], signal: NDArray[np.float32], reason: NDArray[np.uint8]) -> float:
    """Take out of `place` (in place) what the lines' shape adds to their phase; returns its rms amplitude, pixels.

    The ripple is measured in blocks of the picture, against the local quadratic of the positions, and is a smooth
    function of the place in the picture.

    Parameters
    ----------
    place : (h, w) float32 array
        Projector column or row of each camera pixel.
    signal : (h, w) float32 array
    reason : (h, w) uint8 array
        0 where `place` is known.
    """
    corners = _spread_blocks(place.shape)
    ripple, information = _block_ripple(place, signal, reason, corners)
    known = information[:, 0, 0] > 0
    if np.sum(known) < len(_ORDERS):
        return 0.0
    coefficients = _smooth(_along(corners[known] + _BLOCK / 2, place.shape), ripple[known], information[known])
    rows = chebyshev.chebvander(2.0 * (np.arange(place.shape[0]) + 0.5) / place.shape[0] - 1.0, _DEGREE)
    columns = chebyshev.chebvander(2.0 * (np.arange(place.shape[1]) + 0.5) / place.shape[1] - 1.0, _DEGREE)
    return _subtract(place, rows @ coefficients, columns)


def _spread_blocks(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """First row and column of at most about `_BLOCKS` blocks on a regular grid, (n, 2)."""
    step = max(_BLOCK, int(np.sqrt(shape[0] * shape[1] / _BLOCKS)))
    first = [np.arange(0, length - _BLOCK + 1, step) for length in shape]
    return np.stack(np.meshgrid(*first, indexing="ij"), axis=-1).reshape(-1, 2)


def _along(row_column: NDArray[np.floating], shape: tuple[int, ...]) -> NDArray[np.float64]:
    """Chebyshev polynomials of total degree up to `_DEGREE` at places of the picture, (n, 2) -> (n, 15)."""
    rows, columns = (chebyshev.chebvander(2.0 * row_column[:, k] / shape[k] - 1.0, _DEGREE) for k in (0, 1))
    return rows[:, _ORDERS[:, 0]] * columns[:, _ORDERS[:, 1]]


def _smooth(
    terms: NDArray[np.float64], ripple: NDArray[np.float64], information: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Coefficients (2, d + 1, d + 1) of the cosine and sine amplitudes, by information-weighted least squares."""
    n = terms.shape[1]
    normal = np.einsum("kp,kab,kq->apbq", terms, information, terms, optimize=True).reshape(2 * n, 2 * n)
    right = np.einsum("kp,kab,kb->ap", terms, information, ripple, optimize=True).ravel()
    square = np.zeros((2, _DEGREE + 1, _DEGREE + 1))
    solution = np.linalg.solve(normal + np.eye(2 * n) / _LIKELY_PX**2, right).reshape(2, n)
    square[:, _ORDERS[:, 0], _ORDERS[:, 1]] = solution
    return square


def _block_ripple(
    place: NDArray[np.float32], signal: NDArray[np.float32], reason: NDArray[np.uint8], corners: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosine and sine amplitude in each block, (n, 2), and their information, (n, 2, 2), 0 where nothing is known.

    In a block the position is a quadratic of the picture's coordinates plus the ripple. The quadratic is eliminated
    (Schur complement), so that a block in which the two cannot be told apart has no say.
    """
    n = len(corners)
    solution: NDArray[np.float64] = np.zeros((n, 8))
    cutoff_px = np.full(n, np.inf)
    for _ in range(3):
        normal, misfit = np.zeros((n, 9, 9)), np.zeros((n, 3))
        _normals(place, signal, reason, corners, _BLOCK, solution, cutoff_px, normal, misfit)
        known = (misfit[:, 2] >= _BLOCK**2 / 2) & (misfit[:, 0] > 0)
        normal[~known] = np.eye(9)
        normal /= normal[:, :1, :1]
        normal[:, np.arange(8), np.arange(8)] += 1e-9
        # the misfit is about the solution before: that of the first round, which had none, says nothing
        rms = np.sqrt(misfit[:, 1] / np.maximum(misfit[:, 0], 1e-30))
        cutoff_px = np.where(np.any(solution, axis=1), np.maximum(6.0 * rms, 1e-3), np.inf)
        solution = np.linalg.solve(normal[:, :8, :8], normal[:, :8, 8:])[..., 0].astype(np.float64)
    mixed = normal[:, :6, 6:8]
    rest = normal[:, 6:8, 6:8] - np.swapaxes(mixed, 1, 2) @ np.linalg.solve(normal[:, :6, :6], mixed)
    count = np.where(known, misfit[:, 2], 0.0)
    return solution[:, 6:], rest * (count / np.maximum(rms**2, 1e-10))[:, None, None]


@nb.njit(**KERNEL)
def _normals(
    position: NDArray[np.float32],
    signal: NDArray[np.float32],
    reason: NDArray[np.uint8],
    corners: NDArray[np.int64],
    size: int,
    solution: NDArray[np.float64],
    cutoff_px: NDArray[np.float64],
    normal: NDArray[np.float64],
    misfit: NDArray[np.float64],
) -> None:
    """Normal equations, in each block of the picture, of the positions as a quadratic of the place plus a ripple.

    The eight terms are 1, x, y, x^2, x y, y^2 (x, y = -1..1 in the block), cos(2 pi u) and sin(2 pi u) at the measured
    position u. Weights are signal^2 times Tukey's about `solution`.

    Parameters
    ----------
    position, signal, reason : (h, w) arrays
    corners : (blocks, 2) int64 array
        First row and column of each block.
    size : int
        Pixels along a block.
    solution : (blocks, 8) float64 array
        Coefficients of the round before.
    cutoff_px : (blocks,) float64 array
        Residual from which on a pixel has no weight; inf: all count.
    normal : (blocks, 9, 9) float64 array
        Zeros in; out: weighted products of the eight terms and, last, the position less that of the block's first
        pixel.
    misfit : (blocks, 3) float64 array
        Zeros in; out: sum of weights, weighted sum of squared residuals, number of pixels.
    """
    for block in range(corners.shape[0]):
        top, left = corners[block, 0], corners[block, 1]
        terms = np.empty(9)
        origin = math.nan
        for i in range(top, top + size):
            for j in range(left, left + size):
                if reason[i, j] != 0:
                    continue
                place = float(position[i, j])
                if math.isnan(origin):
                    origin = math.floor(place)
                x = 2.0 * (j - left) / size - 1.0
                y = 2.0 * (i - top) / size - 1.0
                angle = 2.0 * math.pi * (place - origin)
                terms[0], terms[1], terms[2], terms[3] = 1.0, x, y, x * x
                terms[4], terms[5], terms[6], terms[7] = x * y, y * y, math.cos(angle), math.sin(angle)
                terms[8] = place - origin
                residual = terms[8]
                for p in range(8):
                    residual -= solution[block, p] * terms[p]
                part = (residual / cutoff_px[block]) ** 2
                if part >= 1.0:
                    continue
                weight = (1.0 - part) * (1.0 - part) * float(signal[i, j]) ** 2
                misfit[block, 0] += weight
                misfit[block, 1] += weight * residual * residual
                misfit[block, 2] += 1.0
                for p in range(9):
                    for q in range(p + 1):
                        normal[block, p, q] += weight * terms[p] * terms[q]
        for p in range(9):
            for q in range(p):
                normal[block, q, p] = normal[block, p, q]


@nb.njit(**KERNEL)
def _subtract(
    position: NDArray[np.float32], row_terms: NDArray[np.float64], column_terms: NDArray[np.float64]
) -> float:
    """Subtract ``a cos(2 pi u) + b sin(2 pi u)`` from positions in place; returns the rms of (a, b) over the picture.

    Parameters
    ----------
    position : (h, w) float32 array
        u with its ripple.
    row_terms : (2, h, m) float64 array
        For a and b: polynomial along the row's own place, one coefficient for each term of the columns.
    column_terms : (w, m) float64 array
    """
    h, w = position.shape
    squares = 0.0
    for row in range(h):
        for column in range(w):
            a = 0.0
            b = 0.0
            for k in range(column_terms.shape[1]):
                a += row_terms[0, row, k] * column_terms[column, k]
                b += row_terms[1, row, k] * column_terms[column, k]
            squares += a * a + b * b
            seen = float(position[row, column])
            place = seen
            for _ in range(2):  # the ripple belongs to the true place: fixed point, error amplitude^3
                angle = 2.0 * math.pi * (place - math.floor(place)) if not math.isnan(place) else 0.0
                place = seen - a * math.cos(angle) - b * math.sin(angle)
            position[row, column] = place
    return math.sqrt(squares / (h * w))
