"""Weighted ridge regression of readings on functions of the inputs, with exact leave-one-out residuals.

A reading has three values (XYZ) whose errors are weighed together by a 3 x 3 matrix, so that least squares means least
dE00. Pure linear algebra: which functions of the inputs are tried stands in ``correction.py``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cho_factor, cho_solve

from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.delta_e import dE00

__all__ = ["dE00_roots", "fit_ridge"]

_STEP = 1e-5
"""Of the differences that give the metric, share of the white point: dE00 of 0.01 to 0.1, far above rounding."""


def dE00_roots(XYZ: ArrayLike, white_point: ArrayLike) -> NDArray[np.float64]:
    """(..., 3, 3) matrices W with |W dXYZ| = dE00 for a small step dXYZ from each colour.

    The metric is found by polarisation of dE00 itself; W is its Cholesky factor.
    """
    XYZ, white = np.asarray(XYZ, np.float64), np.asarray(white_point, np.float64)
    Lab, steps = XYZ_to_Lab(XYZ, white), _STEP * np.diag(white)

    def squared(step: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(dE00(Lab, XYZ_to_Lab(XYZ + step, white)), np.float64) ** 2

    own = [squared(step) for step in steps]
    metric = np.empty((*XYZ.shape, 3))
    for i in range(3):
        metric[..., i, i] = own[i]
        for j in range(i):
            metric[..., i, j] = metric[..., j, i] = (squared(steps[i] + steps[j]) - own[i] - own[j]) / 2
    metric /= np.outer(np.diag(steps), np.diag(steps))
    # dE00 is no exact metric: where hue terms meet, the polarised form may fail to be positive by a little
    values, vectors = np.linalg.eigh(metric)
    values = np.maximum(values, 1e-3 * values[..., -1:])
    return np.sqrt(values)[..., :, None] * np.swapaxes(vectors, -1, -2)


def fit_ridge(
    terms: NDArray[np.float64],
    spline: NDArray[np.float64],
    XYZ: NDArray[np.float64],
    roots: NDArray[np.float64],
    ridge: float,
    spline_scale: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coefficients C that minimise mean |W (XYZ - C functions)|^2 + ridge |scaled C|^2.

    A term's coefficient is scaled so that its column of the weighted design has mean square 1; the columns of a
    spline share one scale, under which they have mean square `spline_scale`^2 together.

    Parameters
    ----------
    terms : (T, m) array
        Values of the terms at each reading.
    spline : (T, q) array
        Values of the spline's functions, orthonormal in its penalty.
    XYZ : (T, 3) array
        What is to be explained.
    roots : (T, 3, 3) array
        W, from `dE00_roots`.
    ridge, spline_scale : float

    Returns
    -------
    coefficients : (3, m + q) array
    left_out : (T, 3) array
        XYZ minus its prediction by a fit without that reading, exactly (Allen 1974, PRESS), under the same scaling.
    """
    (T, m), q = terms.shape, spline.shape[1]
    design = np.einsum("tij,tm->timj", roots, np.hstack([terms, spline])).reshape(3 * T, m + q, 3)
    squares = np.mean(design**2, axis=0)
    if q:
        squares[m:] = squares[m:].sum(axis=0) / spline_scale**2
    scale = np.sqrt(np.where(squares > 0, squares, 1.0)).ravel()
    scaled = design.reshape(3 * T, -1) / scale
    wanted = np.einsum("tij,tj->ti", roots, XYZ)
    normal = cho_factor(scaled.T @ scaled + ridge * T * np.eye(len(scale)))
    solved = cho_solve(normal, scaled.T @ wanted.ravel())
    residual = wanted - (scaled @ solved).reshape(T, 3)
    back = cho_solve(normal, scaled.T).reshape(-1, T, 3)
    hat = np.einsum("tim,mtj->tij", scaled.reshape(T, 3, -1), back)
    left_out = np.linalg.solve(roots, np.linalg.solve(np.eye(3) - hat, residual[..., None]))
    return (solved / scale).reshape(m + q, 3).T, np.asarray(left_out[..., 0], np.float64)
