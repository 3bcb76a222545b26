"""A first fit of projector -> camera coordinates, robust from nothing: RANSAC homography, then a polynomial.

Works on a sample of the decoded pixels, a third of which may be wrong. Knows points and weights; must not know
captures or the tables made from the fit. Coordinates in camera pixels and projector pixels.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from paxel_runtime.errors import CalibrationError

__all__ = ["Samples", "Start", "chebyshev_terms", "degree_of", "fit_start", "orders", "polynomial_grid", "tukey"]

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
    coefficients : (m, 2) float64 array
        Of x and y on `chebyshev_terms`.
    ink_px2 : float
        Camera pixels by which a pixel's place moves for a relative gradient of 1/px, see `fit.ink_shift`.
    cutoff_px : float
        Residual from which on a point has no weight.
    """

    coefficients: NDArray[np.float64]
    ink_px2: float
    cutoff_px: float


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
        terms = chebyshev_terms(samples.u, samples.v, width, height, degree)
        coefficients, ink_px2 = _fit_with_ink(terms, samples, weight * trust)
        trust, cutoff_px = tukey(samples.xy + ink_px2 * samples.gradient - terms @ coefficients, weight, trust)
    return Start(coefficients, ink_px2, cutoff_px)


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


def orders(degree: int) -> NDArray[np.int64]:
    """Pairs (i, j) with i + j <= degree, by rising total degree, (m, 2)."""
    return np.array([(i, total - i) for total in range(degree + 1) for i in range(total + 1)])


def degree_of(coefficients: NDArray[np.float64]) -> int:
    """Total degree of a polynomial with m = (d + 1) (d + 2) / 2 coefficients."""
    return (math.isqrt(8 * len(coefficients) + 1) - 3) // 2


def chebyshev_terms(
    u: NDArray[np.float64], v: NDArray[np.float64], width: int, height: int, degree: int
) -> NDArray[np.float64]:
    """Chebyshev products T_i(u) T_j(v), in the order of `orders`, at projector coordinates, (n, m)."""
    order = orders(degree)
    along_u = chebyshev.chebvander((2.0 * u + 1.0) / width - 1.0, degree)
    along_v = chebyshev.chebvander((2.0 * v + 1.0) / height - 1.0, degree)
    return along_u[:, order[:, 0]] * along_v[:, order[:, 1]]


def polynomial_grid(coefficients: NDArray[np.float64], width: int, height: int, step: int = 1) -> NDArray[np.float64]:
    """Camera coordinates (2, rows, columns) at the centre of every block of `step` x `step` projector pixels."""
    degree = degree_of(coefficients)
    order = orders(degree)
    square = np.zeros((2, degree + 1, degree + 1))
    square[:, order[:, 0], order[:, 1]] = coefficients.T
    along_u, along_v = (
        chebyshev.chebvander((2 * np.arange(-(-length // step)) + 1) * step / length - 1.0, degree)
        for length in (width, height)
    )
    return np.einsum("vj,cij,ui->cvu", along_v, square, along_u, optimize=True)
