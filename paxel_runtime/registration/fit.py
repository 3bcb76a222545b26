"""The fits behind `registration`: a robust polynomial over the whole frame, and a smooth residual field.

Projector coordinates (u, v) -> camera coordinates (x, y), from millions of measured pairs: the pairs are gathered as
weighted mean residuals on blocks of the projector's frame, and everything after that is cheap. Knows arrays and
statistics; must not know captures, channels or files. Camera coordinates are in camera pixels, smoothing widths in
projector pixels.
"""

from __future__ import annotations

import math

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import correlate1d
from scipy.sparse import csr_array

from paxel_runtime.numba_options import CALLED, KERNEL
from paxel_runtime.registration.start import chebyshev_terms, orders, polynomial_grid

__all__ = [
    "BLOCK",
    "MAX_DEGREE",
    "RIM",
    "SIGMAS_PX",
    "blocks_to_pixels",
    "choose_degree",
    "choose_sigma",
    "gather",
    "ink_shift",
    "point_residual",
    "smooth_blocks",
]

BLOCK = 4
"""Projector pixels along a block."""
RIM = 3
"""Empty blocks around the frame: the residual field runs on over its rim."""
MAX_DEGREE = 12
SIGMAS_PX = (4.0, 6.0, 8.0, 11.0, 16.0, 23.0, math.inf)
"""Widths tried for the residual field; 4 at least, as a narrower one would follow the dots of ink; inf: no field."""
_CELLS = 8000
"""Cells, of one or more blocks, that the degree of the polynomial is chosen on."""
_PARTS = 5
_LOW_DEGREE = 3
_PRIOR = 1e-4
"""Weight of a pull towards the polynomial of low degree in every block: it counts in holes and beyond the rim only."""
_FIELD_RIDGE = 1e-4
"""Pulls the field to 0 where the weight of the data near by is below this share of the usual."""


@nb.njit(**CALLED)
def _gradient(signal: NDArray[np.float32], row: int, column: int) -> tuple[float, float]:
    """Relative gradient of the signal, 1/px, by differences of fourth order; 0 at the picture's rim."""
    h, w = signal.shape
    here = signal[row, column]
    if row < 2 or column < 2 or row >= h - 2 or column >= w - 2 or not here > 0.0:
        return 0.0, 0.0
    across = 8.0 * (signal[row, column + 1] - signal[row, column - 1])
    across -= signal[row, column + 2] - signal[row, column - 2]
    down = 8.0 * (signal[row + 1, column] - signal[row - 1, column])
    down -= signal[row + 2, column] - signal[row - 2, column]
    return across / (12.0 * here), down / (12.0 * here)


@nb.njit(**KERNEL)
def ink_shift(signal: NDArray[np.float32], rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Direction in which ink moves what a camera pixel measures: the relative gradient of the signal, (n, 2) in 1/px.

    A camera pixel looks through a point spread p at ink r; the mean place of the light it gets is
    ``x + s^2 grad(p * r) / (p * r)``, exactly, for a Gaussian p of variance s^2 (Tweedie's formula). The factor s^2
    is fitted.
    """
    shift = np.empty((rows.size, 2))
    for k in range(rows.size):
        shift[k, 0], shift[k, 1] = _gradient(signal, rows[k], columns[k])
    return shift


@nb.njit(**CALLED)
def point_residual(
    u: float,
    v: float,
    signal: NDArray[np.float32],
    row: int,
    column: int,
    table: NDArray[np.float64],
    ink_px2: float,
) -> tuple[float, float]:
    """Way from the table's place of projector (u, v) to the camera pixel that decoded to it, freed of ink's pull."""
    height, width = table.shape[1], table.shape[2]
    left = min(max(math.floor(u), 0), width - 2)
    top = min(max(math.floor(v), 0), height - 2)
    across, down = _gradient(signal, row, column)
    off_x = column + ink_px2 * across - _between(table[0], top, left, v - top, u - left)
    off_y = row + ink_px2 * down - _between(table[1], top, left, v - top, u - left)
    return off_x, off_y


def gather(
    projector_xy: NDArray[np.float32],
    signal: NDArray[np.float32],
    reference: float,
    table: NDArray[np.float64],
    ink_px2: float,
    cutoff_px: float,
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Collect the residuals of all decoded camera pixels on blocks of the projector's frame.

    Parameters
    ----------
    projector_xy : (h, w, 2) float32 array
        NaN where not decoded.
    signal : (h, w) float32 array
    reference : float
        Signal of weight 1.
    table : (2, H, W) float64 array
        Camera coordinates of the projector's pixels that residuals are taken from.
    ink_px2, cutoff_px : see `Start`

    Returns
    -------
    sums : (3, rows + 2 RIM, columns + 2 RIM) float64 array
        Sums over each block of weight (Tukey x signal^2), weight x residual of x, and of y; `RIM` empty blocks around.
    hit : (H, W) bool array
        Projector pixels that a point with a weight fell on.
    """
    sums = np.zeros((3, *(-(-size // BLOCK) + 2 * RIM for size in table.shape[1:])))
    hit = np.zeros(table.shape[1:], np.bool_)
    _gather_into(projector_xy, signal, reference, table, ink_px2, cutoff_px, sums, hit)
    return sums, hit


@nb.njit(**KERNEL)
def _gather_into(
    projector_xy: NDArray[np.float32],
    signal: NDArray[np.float32],
    reference: float,
    table: NDArray[np.float64],
    ink_px2: float,
    cutoff_px: float,
    sums: NDArray[np.float64],
    hit: NDArray[np.bool_],
) -> None:
    height, width = table.shape[1], table.shape[2]
    for row in range(signal.shape[0]):
        for column in range(signal.shape[1]):
            u = float(projector_xy[row, column, 0])
            v = float(projector_xy[row, column, 1])
            if math.isnan(u):
                continue
            off_x, off_y = point_residual(u, v, signal, row, column, table, ink_px2)
            part = (off_x * off_x + off_y * off_y) / (cutoff_px * cutoff_px)
            if not part < 1.0:
                continue
            weight = (1.0 - part) * (1.0 - part) * (signal[row, column] / reference) ** 2
            i = min(max(math.floor(v + 0.5), 0), height - 1)
            j = min(max(math.floor(u + 0.5), 0), width - 1)
            hit[i, j] = True
            i = i // BLOCK + RIM
            j = j // BLOCK + RIM
            sums[0, i, j] += weight
            sums[1, i, j] += weight * off_x
            sums[2, i, j] += weight * off_y


@nb.njit(**CALLED)
def _between(plane: NDArray[np.float64], top: int, left: int, fy: float, fx: float) -> float:
    upper = plane[top, left] * (1.0 - fx) + plane[top, left + 1] * fx
    return upper * (1.0 - fy) + (plane[top + 1, left] * (1.0 - fx) + plane[top + 1, left + 1] * fx) * fy


def choose_degree(
    sums: NDArray[np.float64], start: NDArray[np.float64], width: int, height: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Polynomial of the degree that predicts blocks left out best (cross-validation in 5 parts).

    Parameters
    ----------
    sums : see `gather`
    start : (m, 2) float64 array
        Coefficients of the polynomial that the residuals in `sums` belong to.

    Returns
    -------
    coefficients : (m, 2) float64 array
    sums : as given
        Residuals of that polynomial.
    """
    inner = (slice(None), slice(RIM, -RIM), slice(RIM, -RIM))
    step = BLOCK * max(1, math.isqrt(sums[inner][0].size // _CELLS))
    weight, off_x, off_y = _merge(sums[inner], step // BLOCK)
    rows, columns = np.indices(weight.shape).reshape(2, -1)
    terms = chebyshev_terms(step * (columns + 0.5) - 0.5, step * (rows + 0.5) - 0.5, width, height, MAX_DEGREE)
    before = polynomial_grid(start, width, height, step).reshape(2, -1).T
    weight = weight.ravel()
    full = weight > 0
    xy = before + np.column_stack([off_x.ravel(), off_y.ravel()]) / np.where(full, weight, 1.0)[:, None]
    # a mean is as good as its weight, up to the scatter that cells share whatever their weight
    trust = weight / (weight + np.median(weight[full]))
    middle = np.average(xy, axis=0, weights=trust)  # misfits are differences of squares: keep those small
    part = np.random.default_rng(seed).integers(0, _PARTS, weight.size)
    products = np.stack([_products(terms[part == k], xy[part == k] - middle, trust[part == k]) for k in range(_PARTS)])
    low = _solve(products.sum(axis=0), len(orders(_LOW_DEGREE)))
    prior = _products(terms, terms[:, : len(low)] @ low, np.full(weight.size, _PRIOR))
    sizes = [len(orders(degree)) for degree in range(1, MAX_DEGREE + 1)]
    m = sizes[int(np.argmin([_left_out_misfit(products, prior, size) for size in sizes]))]
    coefficients = _solve(products.sum(axis=0) + prior, m)
    coefficients[0] += middle
    after = sums.copy()
    moved = polynomial_grid(start, width, height, BLOCK) - polynomial_grid(coefficients, width, height, BLOCK)
    after[1:, RIM:-RIM, RIM:-RIM] += sums[0, RIM:-RIM, RIM:-RIM] * moved
    return coefficients, after


def _merge(sums: NDArray[np.float64], factor: int) -> NDArray[np.float64]:
    """Sums over `factor` x `factor` blocks; the last ones may be cut off by the frame's rim."""
    _, h, w = sums.shape
    padded = np.pad(sums, ((0, 0), (0, -h % factor), (0, -w % factor)))
    return padded.reshape(3, padded.shape[1] // factor, factor, padded.shape[2] // factor, factor).sum(axis=(2, 4))


def _products(terms: NDArray[np.float64], xy: NDArray[np.float64], weight: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weighted products of all terms and, last, both coordinates, with each other."""
    columns = np.hstack([terms, xy])
    return (columns.T * weight) @ columns


def _solve(products: NDArray[np.float64], m: int) -> NDArray[np.float64]:
    """Coefficients (m, 2) of the first m terms."""
    ridge = 1e-12 * np.trace(products[:m, :m]) / m
    return np.linalg.solve(products[:m, :m] + ridge * np.eye(m), products[:m, -2:])


def _left_out_misfit(products: NDArray[np.float64], prior: NDArray[np.float64], m: int) -> float:
    """Squared misfit of each part under the fit of m terms to the others, summed."""
    misfit = 0.0
    for part in products:
        fitted = _solve(products.sum(axis=0) - part + prior, m)
        cross = np.sum(fitted * part[:m, -2:])
        misfit += float(np.trace(part[-2:, -2:]) - 2.0 * cross + np.sum(fitted * (part[:m, :m] @ fitted)))
    return misfit


def choose_sigma(sums: NDArray[np.float64], seed: int) -> float:
    """Width of the residual field that predicts a quarter of the blocks, left out, best; inf: none is better."""
    left_out = np.random.default_rng(seed).random(sums.shape[1:]) < 0.25
    kept = np.where(left_out, 0.0, sums)
    test = left_out & (sums[0] > 0)
    weight = sums[0, test]
    mean = sums[1:, test] / weight
    scores = [float(np.sum(weight * (mean - _local_quadratic(kept, sigma_px, test)) ** 2)) for sigma_px in SIGMAS_PX]
    return SIGMAS_PX[int(np.argmin(scores))]


def smooth_blocks(sums: NDArray[np.float64], sigma_px: float) -> NDArray[np.float64]:
    """Smooth residuals at the blocks' centres: a local quadratic under Gaussian weights, fading to 0 without data.

    A quadratic, not a mean, as a mean flattens what bends and is pulled inwards at the frame's rim.

    Parameters
    ----------
    sums : see `gather`
    sigma_px : float
        Width of the weights; inf gives zeros.

    Returns
    -------
    (2, rows, columns) float64 array
    """
    everywhere = np.ones(sums.shape[1:], bool)
    return _local_quadratic(sums, sigma_px, everywhere).reshape(2, *everywhere.shape)


def _local_quadratic(sums: NDArray[np.float64], sigma_px: float, at: NDArray[np.bool_]) -> NDArray[np.float64]:
    """`smooth_blocks` at some blocks only, (2, n): most of the work is one 6 x 6 system a block."""
    if not math.isfinite(sigma_px):
        return np.zeros((2, int(np.sum(at))))
    sigma = sigma_px / BLOCK
    offset = np.arange(-math.ceil(3.0 * sigma), math.ceil(3.0 * sigma) + 1) / sigma
    gauss = np.exp(-0.5 * offset**2)
    gauss /= gauss.sum()
    kernels = [gauss * offset**k for k in range(5)]

    def moments(plane: NDArray[np.float64], order: int) -> dict[tuple[int, int], NDArray[np.float64]]:
        along = [correlate1d(plane, kernels[i], axis=1, mode="constant") for i in range(order + 1)]
        return {
            (i, j): correlate1d(along[i], kernels[j], axis=0, mode="constant")[at]
            for i in range(order + 1)
            for j in range(order + 1 - i)
        }

    powers = [(i, total - i) for total in range(3) for i in range(total + 1)]
    mass, off_x, off_y = moments(sums[0], 4), moments(sums[1], 2), moments(sums[2], 2)
    normal = np.stack([np.stack([mass[a + c, b + d] for c, d in powers], axis=-1) for a, b in powers], axis=-2)
    right = np.stack([np.stack([off[p] for p in powers], axis=-1) for off in (off_x, off_y)], axis=-1)
    lit = mass[0, 0][mass[0, 0] > 0]
    normal += (_FIELD_RIDGE * float(np.median(lit)) if lit.size else 1.0) * np.eye(len(powers))
    return np.ascontiguousarray(np.linalg.solve(normal, right)[:, 0].T, np.float64)


def blocks_to_pixels(field: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Cubic interpolation of a field (2, rows, columns) at the blocks' centres to all pixels, (2, height, width)."""
    rows, columns = ((np.arange(length) + 0.5) / BLOCK - 0.5 + RIM for length in (height, width))
    matrices = [_spline_matrix(n, places) for n, places in ((field.shape[1], rows), (field.shape[2], columns))]
    return np.stack([(matrices[0] @ (matrices[1] @ plane.T).T) for plane in field])


def _spline_matrix(nodes: int, places: NDArray[np.float64]) -> csr_array:
    """Sparse matrix that takes values at integers to a Catmull-Rom cubic at places, at least one node from the ends."""
    left = np.floor(places).astype(np.int64)
    t = places - left
    weights = np.stack(
        [
            ((2.0 - t) * t - 1.0) * t / 2.0,
            ((3.0 * t - 5.0) * t * t + 2.0) / 2.0,
            ((4.0 - 3.0 * t) * t + 1.0) * t / 2.0,
            (t - 1.0) * t * t / 2.0,
        ],
        axis=-1,
    )
    rows = np.repeat(np.arange(places.size), 4)
    columns = (left[:, None] + np.arange(-1, 3)).ravel()
    return csr_array((weights.ravel(), (rows, columns)), shape=(places.size, nodes))
