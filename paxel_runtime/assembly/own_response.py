"""What a projector pixel shows by itself: A(a) = sum of a_m A_m over the colorants that it covers.

The model knows clusters: light on cluster i shows A_i. A cluster's pixels cover the colorants in known shares on
average, so that the colorants' own responses A_m follow by least squares; a pixel's response then is affine in its
coverage. On the second surface all pixels show the same. Knows models and coverages; nothing of pictures.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel

__all__ = ["BLOCK_PX", "OwnResponse", "own_response"]

BLOCK_PX = 8
"""Pixels along a block that shares one A of an image-based model, whose own blur is wider than that."""
_LEAST_WEIGHT = 1e-3
_RIDGE = 1e-6


@dataclass(frozen=True, eq=False)
class OwnResponse:
    """XYZ that a pixel adds to the mean of the surface around it, were all pixels like it, for each channel at full.

    Attributes
    ----------
    on_colorants : (rows, columns, N, M, 3) float32 array
        On the pattern, of a pixel that lies on one colorant; for each block of pixels, or one for all.
    on_second : (rows, columns, N, 3) float32 array
        On the second surface; zeros where there is none.
    A : (rows, columns, 6, n) float32 array
        The model's A of both surfaces in the same blocks.
    block_px : int
        Pixels along a block.
    surfaces : int
        1 or 2.
    """

    on_colorants: NDArray[np.float32]
    on_second: NDArray[np.float32]
    A: NDArray[np.float32]
    block_px: int
    surfaces: int


def own_response(model: PredictionModel, means: NDArray[np.float64], shares: NDArray[np.float64]) -> OwnResponse:
    """Own responses of pixels on each colorant, so that a cluster's mean pixel shows what the model says of it.

    Parameters
    ----------
    model : PredictionModel
        Spectral, or image-based (its A is taken as means over blocks of `BLOCK_PX` pixels).
    means : (1 or N, K, M) array
    shares : (K,) array
        Both from `coverage.cluster_coverage`. With a second surface, the clusters' shares are read off it instead:
        there all pixels are alike, and the readings tell the shares of the very spot that was measured.

    Raises
    ------
    InputError
        If the model has another number of clusters.
    """
    N, K = len(model.channels), len(model.clusters)
    if means.shape[1] != K or shares.shape != (K,):
        raise InputError(f"coverages of {means.shape[1]} clusters do not fit a model of {K}")
    A = [_in_blocks(surface.A) for surface in model.surfaces.values()]
    by_cluster = [a.reshape(*a.shape[:3], K, N) for a in A]  # (rows, columns, 3, K, N)
    if len(A) == 2:
        shares = by_cluster[1].mean(axis=(0, 1))[1].sum(axis=1)
        shares = shares / shares.sum()
    # A_i = share_i sum_m mean_im A_m; light of rare clusters counts little
    weights = np.sqrt(np.maximum(shares, _LEAST_WEIGHT))
    M = means.shape[2]
    to_colorants = [
        np.linalg.pinv(np.concatenate([mean * weights[:, None], _RIDGE * np.eye(M)]))[:, :K] for mean in means
    ]
    of_channels = np.broadcast_to(to_colorants, (N, M, K)) * (weights / np.maximum(shares, _LEAST_WEIGHT))
    on_colorants = np.einsum("nmk,rsckn->rsnmc", of_channels, by_cluster[0])
    second = np.zeros((*A[0].shape[:2], N, 3))
    if len(A) == 2:
        second = np.moveaxis(by_cluster[1].sum(axis=3), 3, 2)
    both = np.zeros((*A[0].shape[:2], 6, model.n), np.float32)
    for k, a in enumerate(A):
        both[:, :, 3 * k : 3 * k + 3] = a
    spectral = model.pattern.A.ndim == 2
    return OwnResponse(
        np.ascontiguousarray(on_colorants, np.float32),
        np.ascontiguousarray(second, np.float32),
        both,
        2**30 if spectral else BLOCK_PX,
        len(A),
    )


def _in_blocks(A: NDArray[np.floating]) -> NDArray[np.float64]:
    """(rows, columns, 3, n): means over blocks of an image-based A where it is known; (1, 1, 3, n) of a spectral."""
    if A.ndim == 2:
        return np.asarray(A, np.float64)[None, None]
    height, width, _, n = A.shape
    rows, columns = -(-height // BLOCK_PX), -(-width // BLOCK_PX)
    means = np.zeros((rows, columns, 3, n))
    starts = np.arange(0, width, BLOCK_PX)
    for i in range(rows):
        band = np.asarray(A[i * BLOCK_PX : (i + 1) * BLOCK_PX], np.float32)
        known = (band[:, :, 1].sum(axis=-1) > 0).sum(axis=0)
        sums = np.add.reduceat(band.sum(axis=0), starts, axis=0)
        counts = np.add.reduceat(known, starts)
        means[i] = sums / np.maximum(counts, 1)[:, None, None]
    return means
