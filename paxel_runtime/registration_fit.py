"""The fits behind `registration`: a robust polynomial over the whole frame, and a smooth residual field.

Projector coordinates (u, v) -> camera coordinates (x, y), from millions of measured pairs: the pairs are gathered as
weighted mean residuals on blocks of the projector's frame, and everything after that is cheap. Knows arrays and
statistics; must not know captures, channels or files. Camera coordinates are in camera pixels, smoothing widths in
projector pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.ndimage import correlate1d
from scipy.sparse import csr_array

from paxel_runtime.errors import CalibrationError

__all__ = [
    "BLOCK",
    "MAX_DEGREE",
    "RIM",
    "SIGMAS_PX",
    "Samples",
    "Start",
    "blocks_to_pixels",
    "choose_degree",
    "choose_sigma",
    "fit_start",
    "gather",
    "ink_shift",
    "polynomial_grid",
    "smooth_blocks",
    "tukey",
]

BLOCK = 4
"""Projector pixels along a block."""
RIM = 3
"""Empty blocks around the frame: the residual field runs on over its rim."""
MAX_DEGREE = 12
SIGMAS_PX = (4.0, 6.0, 8.0, 11.0, 16.0, 23.0, math.inf)
"""Widths tried for the residual field; 4 at least, as a narrower one would follow the dots of ink; inf: no field."""
_FIELD_RIDGE = 1e-4
"""Pulls the field to 0 where the weight of the data near by is below this share of the usual."""
_BANDS = 4
"""Bands of the picture gathered side by side: a fixed number, so that sums do not depend on the machine."""
_FOLDS = 5
_START_DEGREE = 6
_TUKEY = 6.0
"""Residuals beyond this many standard deviations have no weight."""
_LEAST_SCALE_PX = 0.02
"""Residuals below this are never outliers."""


@dataclass(frozen=True, eq=False)
class Samples:
    """A random choice of decoded camera pixels: places (n,), signal (n,), and the shift by ink's gradient (n, 2)."""

    u: NDArray[np.float64]
    v: NDArray[np.float64]
    xy: NDArray[np.float64]
    signal: NDArray[np.float64]
    gradient: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Start:
    """A first fit.

    Attributes
    ----------
    coefficients : (2, d + 1, d + 1) float64 array
        Chebyshev coefficients of x and y in the projector's normalised u and v.
    ink_px2 : float
        Camera pixels by which the place of a pixel moves for a relative gradient of 1 a pixel (`ink_shift`).
    cutoff_px : float
        Residual from which on a point has no weight.
    """

    coefficients: NDArray[np.float64]
    ink_px2: float
    cutoff_px: float


@nb.njit(cache=True, inline="always")
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


@nb.njit(cache=True)
def ink_shift(signal: NDArray[np.float32], rows: NDArray[np.int64], columns: NDArray[np.int64]) -> NDArray[np.float64]:
    """Direction in which ink moves what a camera pixel measures: the relative gradient of the signal, (n, 2) in 1/px.

    A camera pixel looks through a point spread p at ink r; the mean place of the light it gets is
    ``x + s^2 grad(p * r) / (p * r)``, exactly, for a Gaussian p of variance s^2 (Tweedie's formula). The factor s^2
    is fitted.
    """
    shift = np.empty((rows.size, 2))
    for k in range(rows.size):
        shift[k] = _gradient(signal, rows[k], columns[k])
    return shift


def fit_start(samples: Samples, width: int, height: int, seed: int) -> Start:
    """First fit, robust from nothing: RANSAC homography, then a polynomial with Tukey's weights x signal^2.

    Raises
    ------
    CalibrationError
        If no homography explains half of the points to within 1 % of the picture.
    """
    rng = np.random.default_rng(seed)
    near = _near_homography(samples, width, height, rng)
    if np.mean(near) < 0.5:
        raise CalibrationError(
            "decoded pixels must lie on one smooth sheet: at least 50 % within 1 % of the picture of a common "
            f"homography, got {np.mean(near):.0%}: is the sheet flat, and did nothing move between the captures?"
        )
    weight = (samples.signal / np.median(samples.signal)) ** 2
    trust = near.astype(np.float64)
    ink_px2, cutoff_px = 0.0, math.inf
    for degree in (3, 3, _START_DEGREE, _START_DEGREE, _START_DEGREE, _START_DEGREE):
        terms = _terms(samples.u, samples.v, width, height, degree)
        coefficients, ink_px2 = _fit_with_ink(terms, samples, weight * trust)
        trust, cutoff_px = tukey(samples.xy + ink_px2 * samples.gradient - terms @ coefficients, weight, trust)
    return Start(_square(coefficients, _START_DEGREE), ink_px2, cutoff_px)


def _near_homography(
    samples: Samples, width: int, height: int, rng: np.random.Generator, trials: int = 300
) -> NDArray[np.bool_]:
    """Points that the best of many homographies from 4 points (RANSAC) puts within 1 % of the picture's diagonal."""
    few = rng.permutation(len(samples.u))[:2000]
    uv = np.column_stack([2.0 * samples.u / width - 1.0, 2.0 * samples.v / height - 1.0])
    limit = 0.01 * float(np.hypot(*np.ptp(samples.xy, axis=0)))
    best, best_cost = None, math.inf
    for _ in range(trials):
        four = rng.choice(few, 4, replace=False)
        homography = _homography(uv[four], samples.xy[four])
        if homography is None:
            continue
        cost = float(np.sum(np.minimum(_distance(homography, uv[few], samples.xy[few]), limit)))
        if cost < best_cost:
            best, best_cost = homography, cost
    if best is None:
        return np.zeros(len(samples.u), bool)
    return _distance(best, uv, samples.xy) < limit


def _homography(uv: NDArray[np.float64], xy: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Homography (3, 3) through 4 pairs; None where they are degenerate."""
    rows = np.zeros((8, 8))
    rows[:4, :2], rows[:4, 2] = uv, 1.0
    rows[4:, 3:5], rows[4:, 5] = uv, 1.0
    rows[:4, 6:] = -uv * xy[:, :1]
    rows[4:, 6:] = -uv * xy[:, 1:]
    try:
        return np.append(np.linalg.solve(rows, xy.T.ravel()), 1.0).reshape(3, 3)
    except np.linalg.LinAlgError:
        return None


def _distance(homography: NDArray[np.float64], uv: NDArray[np.float64], xy: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of mapped points from where they were seen; infinite behind the camera."""
    mapped = np.column_stack([uv, np.ones(len(uv))]) @ homography.T
    ahead = mapped[:, 2] > 1e-6
    divisor = np.where(ahead, mapped[:, 2], 1.0)
    off = mapped[:, :2] / divisor[:, None] - xy
    return np.where(ahead, np.hypot(off[:, 0], off[:, 1]), math.inf)


def _fit_with_ink(
    terms: NDArray[np.float64], samples: Samples, weight: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Weighted least squares of both coordinates at once, with one ink factor; (m, 2) coefficients and the factor."""
    m = terms.shape[1]
    weighted = terms * weight[:, None]
    gram = weighted.T @ terms
    data = weighted.T @ np.column_stack([samples.xy, samples.gradient])
    gram[np.diag_indices(m)] *= 1.0 + 1e-12
    solved = np.linalg.solve(gram, data)
    place, slope = solved[:, :2], solved[:, 2:]
    rest_xy, rest_gradient = samples.xy - terms @ place, samples.gradient - terms @ slope
    information = float(np.sum(weight[:, None] * rest_gradient**2))
    ink_px2 = -float(np.sum(weight[:, None] * rest_gradient * rest_xy)) / information if information > 0.0 else 0.0
    return place + ink_px2 * slope, ink_px2


def tukey(
    residual: NDArray[np.float64], weight: NDArray[np.float64], trust: NDArray[np.float64]
) -> tuple[NDArray[np.float64], float]:
    """Tukey's weights (n,) of residuals (n, 2), and the residual from which on they are 0.

    Parameters
    ----------
    weight : (n,) float64 array
        Weights by signal.
    trust : (n,) float64 array
        Weights of the round before: what has none does not count for the scale.
    """
    size = np.hypot(residual[:, 0], residual[:, 1])
    # the median of a two-dimensional normal distribution's radius is 1.1774 sigma
    cutoff_px = _TUKEY * max(_weighted_median(size, weight * (trust > 0)) / 1.1774, _LEAST_SCALE_PX)
    return np.where(size < cutoff_px, (1.0 - (size / cutoff_px) ** 2) ** 2, 0.0), cutoff_px


def _weighted_median(values: NDArray[np.float64], weight: NDArray[np.float64]) -> float:
    order = np.argsort(values)
    share = np.cumsum(weight[order])
    return float(values[order[np.searchsorted(share, 0.5 * share[-1])]])


@nb.njit(cache=True, parallel=True)
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
    height, width = table.shape[1:]
    rows, columns = -(-height // BLOCK) + 2 * RIM, -(-width // BLOCK) + 2 * RIM
    sums = np.zeros((_BANDS, 3, rows, columns))
    hit = np.zeros((height, width), np.bool_)
    band_rows = -(-signal.shape[0] // _BANDS)
    for index in nb.prange(_BANDS):
        band = np.int64(index)
        for row in range(band * band_rows, min((band + 1) * band_rows, signal.shape[0])):
            for column in range(signal.shape[1]):
                u = float(projector_xy[row, column, 0])
                v = float(projector_xy[row, column, 1])
                if math.isnan(u):
                    continue
                left = min(max(math.floor(u), 0), width - 2)
                top = min(max(math.floor(v), 0), height - 2)
                fx = u - left
                fy = v - top
                across, down = _gradient(signal, row, column)
                off_x = column + ink_px2 * across - _between(table[0], top, left, fy, fx)
                off_y = row + ink_px2 * down - _between(table[1], top, left, fy, fx)
                part = (off_x * off_x + off_y * off_y) / (cutoff_px * cutoff_px)
                if not part < 1.0:
                    continue
                weight = (1.0 - part) * (1.0 - part) * (signal[row, column] / reference) ** 2
                i = min(max(math.floor(v + 0.5), 0), height - 1)
                j = min(max(math.floor(u + 0.5), 0), width - 1)
                hit[i, j] = True
                i = i // BLOCK + RIM
                j = j // BLOCK + RIM
                sums[band, 0, i, j] += weight
                sums[band, 1, i, j] += weight * off_x
                sums[band, 2, i, j] += weight * off_y
    return sums.sum(axis=0), hit


@nb.njit(cache=True, inline="always")
def _between(plane: NDArray[np.float64], top: int, left: int, fy: float, fx: float) -> float:
    upper = plane[top, left] * (1.0 - fx) + plane[top, left + 1] * fx
    return upper * (1.0 - fy) + (plane[top + 1, left] * (1.0 - fx) + plane[top + 1, left + 1] * fx) * fy


def choose_degree(
    sums: NDArray[np.float64], start: NDArray[np.float64], width: int, height: int, seed: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], int]:
    """Polynomial of the degree that predicts blocks left out best.

    Parameters
    ----------
    sums : see `gather`
    start : (2, d + 1, d + 1) float64 array
        Polynomial that the residuals in `sums` belong to.

    Returns
    -------
    coefficients : (2, degree + 1, degree + 1) float64 array
    sums : as given
        Residuals of that polynomial.
    degree : int
    """
    rows, columns = np.nonzero(sums[0] > 0)
    weight = sums[0, rows, columns]
    u, v = (BLOCK * (index - RIM + 0.5) - 0.5 for index in (columns, rows))
    before = _terms(u, v, width, height, start.shape[1] - 1) @ _flat(start)
    xy = before + (sums[1:, rows, columns] / weight).T
    # a block's mean is as good as its weight, up to the scatter that blocks share whatever their weight
    trust = weight / (weight + np.median(weight))
    terms = _terms(u, v, width, height, MAX_DEGREE)
    fold = np.random.default_rng(seed).integers(0, _FOLDS, weight.size)
    grams, data = [], []
    for k in range(_FOLDS):
        part = terms[fold == k]
        weighted = part * trust[fold == k, None]
        grams.append(weighted.T @ part)
        data.append(weighted.T @ xy[fold == k])
    gram, datum = np.sum(grams, axis=0), np.sum(data, axis=0)
    scores = []
    for degree in range(1, MAX_DEGREE + 1):
        m = (degree + 1) * (degree + 2) // 2
        score = 0.0
        for k in range(_FOLDS):
            solved = _solve(gram[:m, :m] - grams[k][:m, :m], datum[:m] - data[k][:m])
            left_out = fold == k
            misfit = xy[left_out] - terms[left_out, :m] @ solved
            score += float(np.sum(trust[left_out, None] * misfit**2))
        scores.append(score)
    degree = int(np.argmin(scores)) + 1
    m = (degree + 1) * (degree + 2) // 2
    solved = _solve(gram[:m, :m], datum[:m])
    after = sums.copy()
    after[1:, rows, columns] += weight * (before - terms[:, :m] @ solved).T
    return _square(solved, degree), after, degree


def choose_sigma(sums: NDArray[np.float64], seed: int) -> float:
    """Width of the residual field that predicts a quarter of the blocks, left out, best; inf: none is better."""
    left_out = np.random.default_rng(seed).random(sums.shape[1:]) < 0.25
    kept = np.where(left_out, 0.0, sums)
    test = left_out & (sums[0] > 0)
    weight = sums[0, test]
    mean = sums[1:, test] / weight
    scores = [float(np.sum(weight * (mean - smooth_blocks(kept, sigma_px)[:, test]) ** 2)) for sigma_px in SIGMAS_PX]
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
    if not math.isfinite(sigma_px):
        return np.zeros_like(sums[1:])
    sigma = sigma_px / BLOCK
    offset = np.arange(-math.ceil(3.0 * sigma), math.ceil(3.0 * sigma) + 1) / sigma
    gauss = np.exp(-0.5 * offset**2)
    gauss /= gauss.sum()
    kernels = [gauss * offset**k for k in range(5)]

    def moments(plane: NDArray[np.float64], order: int) -> dict[tuple[int, int], NDArray[np.float64]]:
        along = [correlate1d(plane, kernels[i], axis=1, mode="constant") for i in range(order + 1)]
        return {
            (i, j): correlate1d(along[i], kernels[j], axis=0, mode="constant")
            for i in range(order + 1)
            for j in range(order + 1 - i)
        }

    powers = [(i, total - i) for total in range(3) for i in range(total + 1)]
    mass, off_x, off_y = moments(sums[0], 4), moments(sums[1], 2), moments(sums[2], 2)
    normal = np.stack([np.stack([mass[a + c, b + d] for c, d in powers], axis=-1) for a, b in powers], axis=-2)
    right = np.stack([np.stack([off[p] for p in powers], axis=-1) for off in (off_x, off_y)], axis=-1)
    lit = mass[0, 0][mass[0, 0] > 0]
    normal += (_FIELD_RIDGE * float(np.median(lit)) if lit.size else 1.0) * np.eye(len(powers))
    return np.moveaxis(np.linalg.solve(normal, right)[..., 0, :], -1, 0)


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


def polynomial_grid(coefficients: NDArray[np.float64], width: int, height: int) -> NDArray[np.float64]:
    """Camera coordinates (2, height, width) of every projector pixel's centre."""
    degree = coefficients.shape[1] - 1
    along_u = chebyshev.chebvander((2.0 * np.arange(width) + 1.0) / width - 1.0, degree)
    along_v = chebyshev.chebvander((2.0 * np.arange(height) + 1.0) / height - 1.0, degree)
    return np.einsum("vj,cij,ui->cvu", along_v, coefficients, along_u, optimize=True)


def _orders(degree: int) -> NDArray[np.int64]:
    """Pairs (i, j) with i + j <= degree, by rising total degree, (m, 2)."""
    return np.array([(i, total - i) for total in range(degree + 1) for i in range(total + 1)])


def _terms(u: NDArray[np.float64], v: NDArray[np.float64], width: int, height: int, degree: int) -> NDArray[np.float64]:
    """Chebyshev products of total degree up to `degree` at projector coordinates, (n, m)."""
    order = _orders(degree)
    along_u = chebyshev.chebvander((2.0 * u + 1.0) / width - 1.0, degree)
    along_v = chebyshev.chebvander((2.0 * v + 1.0) / height - 1.0, degree)
    return along_u[:, order[:, 0]] * along_v[:, order[:, 1]]


def _square(flat: NDArray[np.float64], degree: int) -> NDArray[np.float64]:
    """(m, 2) coefficients in the order of `_orders` -> (2, degree + 1, degree + 1)."""
    order = _orders(degree)
    square = np.zeros((2, degree + 1, degree + 1))
    square[:, order[:, 0], order[:, 1]] = flat.T
    return square


def _flat(square: NDArray[np.float64]) -> NDArray[np.float64]:
    """Inverse of `_square`."""
    order = _orders(square.shape[1] - 1)
    return square[:, order[:, 0], order[:, 1]].T


def _solve(gram: NDArray[np.float64], data: NDArray[np.float64]) -> NDArray[np.float64]:
    """Solve normal equations; a whiff of ridge keeps high degrees tame over holes."""
    return np.linalg.solve(gram + 1e-10 * np.trace(gram) / len(gram) * np.eye(len(gram)), data)
