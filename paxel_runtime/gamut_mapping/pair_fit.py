"""Two smooth functions, one a surface, that are best while pairs of their values stay within limits.

A quadratic programme solved by the alternating direction method of multipliers: the functions, their values at sampled
pixels, and their differences are made to agree in turn; every step is a banded back substitution and nearest points in
polygons of the plane. Knows splines and half-planes; nothing of pictures and colours.

References
----------
S. Boyd, N. Parikh, E. Chu, B. Peleato, J. Eckstein, "Distributed Optimization and Statistical Learning via the
Alternating Direction Method of Multipliers", Foundations and Trends in Machine Learning 3 (2011).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix

from paxel_runtime.gamut_mapping.pair_limits import nearest_inside

__all__ = ["Aim", "fit_pair"]

Limits = Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Values (n, 2) -> half-planes about them: normals (n, k, 2) and offsets (n, k)."""

_RELAXATION = 1.6
"""Over-relaxation: 1.5 to 1.8 is the usual advice (Boyd et al., section 3.4.3)."""


@dataclass(frozen=True, eq=False)
class Aim:
    """What one of the two functions c is to be: the least 1/2 c Q c - q c with bounded differences.

    Attributes
    ----------
    quadratic : (size, size) sparse matrix
        Q, positive definite.
    linear : (size,) float64 array
        q.
    sampled : (n, size) sparse matrix
        Values at the sampled pixels.
    bounded : (m, size) sparse matrix
        Combinations with bounds; at the solution the bounds hold up to what the iterations leave.
    bounds : (float, float)
        Least and largest of each of these.
    start : (size,) float64 array
    """

    quadratic: csr_matrix
    linear: NDArray[np.float64]
    sampled: csr_matrix
    bounded: csr_matrix
    bounds: tuple[float, float]
    start: NDArray[np.float64]


class _Surface:
    """State of one function: its unknowns, the copy of its bounded combinations, their multipliers."""

    def __init__(self, aim: Aim) -> None:
        self.aim = aim
        trace = aim.quadratic.diagonal().sum()
        # Each penalty weighs as much as the objective itself.
        self.pull = trace / max(aim.sampled.multiply(aim.sampled).sum(), 1e-12)
        self.pull_bounded = trace / aim.bounded.multiply(aim.bounded).sum()
        self.c = aim.start.copy()
        self.copy = aim.bounded @ self.c
        self.multiplier = np.zeros_like(self.copy)
        self.gather = csr_matrix(aim.sampled.T)
        self.gather_bounded = csr_matrix(aim.bounded.T)
        self.factor = cholesky_banded(
            _banded(
                aim.quadratic
                + self.pull * (self.gather @ aim.sampled)
                + self.pull_bounded * (self.gather_bounded @ aim.bounded)
            ),
            lower=True,
            overwrite_ab=True,
        )

    def step(self, wanted: NDArray[np.float64]) -> NDArray[np.float64]:
        """The function nearest to its aim, to `wanted` at the samples and to its bounds; its values at the samples."""
        aim = self.aim
        right = aim.linear + self.pull * (self.gather @ wanted)
        right += self.pull_bounded * (self.gather_bounded @ (self.copy - self.multiplier))
        self.c = cho_solve_banded((self.factor, True), right, overwrite_b=True, check_finite=False)
        now = _RELAXATION * (aim.bounded @ self.c) + (1 - _RELAXATION) * self.copy
        self.copy = np.clip(now + self.multiplier, *aim.bounds)
        self.multiplier += now - self.copy
        return np.asarray(aim.sampled @ self.c, np.float64)


def fit_pair(
    aims: tuple[Aim, Aim], limits: Limits, *, iterations: int, every: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The two functions nearest to their aims whose values at every sample keep within the limits.

    Parameters
    ----------
    aims : (Aim, Aim)
        With the same samples in the same order.
    limits : callable
        Half-planes about given values; asked again every `every` iterations, so that they are exact at the end.
    iterations, every : int

    Returns
    -------
    (size,) float64 arrays
        The unknowns of both. A sample may lie outside by what the iterations leave.
    """
    surfaces = [_Surface(aim) for aim in aims]
    kept = np.stack([aim.sampled @ aim.start for aim in aims], axis=1)
    multiplier = np.zeros_like(kept)
    values = np.empty_like(kept)
    for iteration in range(iterations):
        if iteration % every == 0:
            normals, offsets = limits(kept)
        for s, surface in enumerate(surfaces):
            values[:, s] = surface.step(kept[:, s] - multiplier[:, s])
        relaxed = _RELAXATION * values + (1 - _RELAXATION) * kept
        kept = nearest_inside(relaxed + multiplier, normals, offsets, kept)
        multiplier += relaxed - kept
    return surfaces[0].c, surfaces[1].c


def _banded(matrix: csr_matrix) -> NDArray[np.float64]:
    """Lower bands of a symmetric matrix, as `scipy.linalg.cholesky_banded` takes them."""
    entries = matrix.tocoo()
    below = entries.row - entries.col
    lower = below >= 0
    bands = np.zeros((below.max(initial=0) + 1, matrix.shape[0]))
    bands[below[lower], entries.col[lower]] = entries.data[lower]
    return bands
