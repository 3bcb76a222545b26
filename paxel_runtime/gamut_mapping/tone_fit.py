"""Fitting the tone curves of two pictures that are shown at once: contrast where each has detail, every pair in reach.

The aim of each curve is slope 1, the source itself, and a slope counts by what it adds to the local standard deviation
of lightness. Knows lightness pictures, tone curves and the joint gamut; nothing of files and settings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix, diags, eye

from paxel_runtime.gamut_mapping.pair_fit import Aim, fit_pair
from paxel_runtime.gamut_mapping.pair_limits import half_planes, relevant_rows
from paxel_runtime.gamut_mapping.tone_curves import ToneCurves
from paxel_runtime.model.subgamut import PairGamut
from paxel_runtime.observer.smoothing import local_mean

__all__ = ["BINS", "ReducedPicture", "Samples", "fit_tone_curves", "slope_gains"]

BINS = 8
"""Cells over the lightness of the source."""

WINDOW_DEG = 0.25
"""Sigma of the window in which contrast is local."""

_SMOOTHNESS = 0.4
"""Weight of changes over the frame."""
_STRAIGHTNESS = 0.2
"""Weight of changes of the slope."""
_LEAST_SLOPE = 0.5
"""Least slope of a curve, in slopes of static mapping."""
_NEAR_STATIC = 1e-4
"""Weight of the distance from static mapping: decides where nothing else does."""
_MARGIN_L = 0.05
"""How far inside the joint gamut the samples are kept, L*: the pixels between them stay inside as well."""
_FLAT_L = 0.05
"""A window whose lightness deviates less, L*, has no detail."""
_ROUNDS = (64, 128)
"""Iterations before and after the two surfaces' weights are balanced by what each gained."""
_EVERY = 32
_BALANCE = 2.0
"""How strongly the surface that gained less is preferred then; 1 would be the product of both gains."""


@dataclass(frozen=True, eq=False)
class ReducedPicture:
    """The lightness of a picture on a coarse raster, where its local contrast is judged.

    Attributes
    ----------
    L : (h, w) float64 array
        Means over blocks of the source.
    mask : (h, w) bool array
        Blocks that are shown.
    px_per_degree : float
        Of the coarse raster.
    """

    L: NDArray[np.float64]
    mask: NDArray[np.bool_]
    px_per_degree: float


@dataclass(frozen=True, eq=False)
class Samples:
    """Pixel pairs that stand for all.

    Attributes
    ----------
    rows, columns : (n,) int64 arrays
    Lab : (n, 6) float64 array
        Static targets: Lab on the pattern, then on the white surface, with the chroma that room is kept for.
    """

    rows: NDArray[np.int64]
    columns: NDArray[np.int64]
    Lab: NDArray[np.float64]


def fit_tone_curves(
    static: tuple[ToneCurves, ToneCurves],
    pictures: tuple[ReducedPicture, ReducedPicture],
    sources: tuple[NDArray[np.float64], NDArray[np.float64]],
    samples: Samples,
    pairs: PairGamut,
) -> tuple[ToneCurves, ToneCurves]:
    """The tone curves of two pictures with the most local contrast at which every sampled pair can be shown.

    Parameters
    ----------
    static : (ToneCurves, ToneCurves)
        Straight lines of static mapping: where the search starts, and the measure of slopes.
    pictures : (ReducedPicture, ReducedPicture)
    sources : (n,) float64 arrays
        Source lightness of the samples on each surface.
    samples : Samples
    pairs : PairGamut

    Returns
    -------
    ToneCurves, ToneCurves
    """
    pairs = relevant_rows(pairs, samples.Lab)
    direction = np.zeros_like(samples.Lab)
    direction[:, [0, 3]] = 1.0

    def limits(L: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        Lab = samples.Lab.copy()
        Lab[:, [0, 3]] = L
        return half_planes(Lab, direction, L, pairs, _MARGIN_L)

    gains = [slope_gains(pictures[s], static[s]) for s in range(2)]
    sampled = [static[s].sampled(samples.rows, samples.columns, sources[s]) for s in range(2)]
    curves, weights = static, np.ones(2)
    for iterations in _ROUNDS:
        first, second = (_aim(static[s], curves[s], weights[s] * gains[s], sampled[s]) for s in range(2))
        fitted = fit_pair((first, second), limits, iterations=iterations, every=_EVERY)
        curves = (_curves(static[0], fitted[0]), _curves(static[1], fitted[1]))
        gained = [_contrast(curves[s], gains[s]) / _contrast(static[s], gains[s]) for s in range(2)]
        weights = weights * (np.sqrt(np.prod(gained)) / np.array(gained)) ** _BALANCE
    return curves


def _curves(like: ToneCurves, unknowns: NDArray[np.float64]) -> ToneCurves:
    """The curves of a fit, which may fall by what the iterations left where there are no pixels: made to rise."""
    return ToneCurves(like.grid, np.maximum.accumulate(like.grid.unraveled(unknowns), axis=2), like.L_from)


def _contrast(curves: ToneCurves, gains: NDArray[np.float64]) -> float:
    """Local contrast of curves to first order: the sum of slopes by their gains."""
    return float(np.sum(np.diff(curves.control, axis=2) * gains)) or 1.0


def _aim(
    static: ToneCurves,
    now: ToneCurves,
    gains: NDArray[np.float64],
    sampled: csr_matrix,
) -> Aim:
    """Slope 1 by its gains, with smooth and straight curves; slopes at least half of static mapping's, at most 1."""
    grid, width = static.grid, static.bin_width
    slopes = grid.differences(2) / width
    down, across = (grid.differences(axis) / width for axis in (0, 1))
    bends = grid.differences(2, order=2) / width
    gain = grid.raveled(gains)
    near = eye(grid.size) / width**2
    line = grid.raveled(static.control)
    quadratic = slopes.T @ diags(gain) @ slopes + _SMOOTHNESS * (down.T @ down + across.T @ across)
    quadratic = quadratic + _STRAIGHTNESS * (bends.T @ bends) + _NEAR_STATIC * near
    linear = slopes.T @ gain + _NEAR_STATIC / width**2 * line
    slope = float(np.mean(np.diff(static.control[0, 0]))) / width
    return Aim(
        quadratic.tocsr(), linear, sampled, slopes, (_LEAST_SLOPE * slope, max(1.0, slope)), grid.raveled(now.control)
    )


def slope_gains(picture: ReducedPicture, curves: ToneCurves) -> NDArray[np.float64]:
    """What the slope between two control values adds to the local standard deviation of lightness, mean 1.

    With q_k(L) how much of L lies in the stretch of slope k, M = sum of slope_k q_k, and the standard deviation of M in
    a window changes with slope_k by cov(q_k, M) / sd(M); here at M = L.

    Returns
    -------
    (rows, columns, bins + 1) float64 array
    """
    grid = curves.grid
    sigma = WINDOW_DEG * picture.px_per_degree
    L, mask = picture.L, picture.mask
    L = np.where(mask, L - L[mask].mean(), 0.0)
    mean = local_mean(L, mask, sigma)
    deviation = np.sqrt(np.maximum(local_mean(L * L, mask, sigma) - mean**2, 0.0))
    share = curves.share(picture.L)
    at = [_nodes(cells, size) for cells, size in zip(grid.cells, L.shape, strict=True)]
    gains = np.empty((grid.shape[0], grid.shape[1], grid.bins + 1))
    for k in range(grid.bins + 1):
        place = np.clip(share * grid.bins - k, -1, 1)
        q = np.where(place < 0, 0.5 * (1 + place) ** 2, 1 - 0.5 * (1 - place) ** 2)
        covariance = local_mean(q * L, mask, sigma) - local_mean(q, mask, sigma) * mean
        gain = np.divide(covariance, deviation, out=np.zeros_like(L), where=deviation > _FLAT_L)
        gains[..., k] = gain[np.ix_(*at)]
    gains = np.maximum(gains, 0.0)
    mean_gain = gains.mean()
    return gains / mean_gain if mean_gain > 0 else gains


def _nodes(cells: int, size: int) -> NDArray[np.int64]:
    """Nearest pixels, of `size` along an axis, to the centres of the axis' splines."""
    return np.clip((np.arange(cells + 2) - 0.5) / cells * size, 0, size - 1).astype(np.int64)
