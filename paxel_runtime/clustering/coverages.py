"""Projector pixels sorted by the coverage that the known pattern gives them: the same clusters without colours.

Where the pattern is registered, each pixel's share of every colorant is known, and nothing that blurs or tints the
camera's picture moves a label. K-means runs on the coverages only to place the edge clusters. How coverages come about
stands elsewhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_runtime.clustering.clusters import OUTSIDE, Clusters, check_count
from paxel_runtime.clustering.kernels import label_by_coverage
from paxel_runtime.clustering.kmeans import distortion_gains, lloyd, sample_indices, too_few_colors
from paxel_runtime.clustering.mixtures import make_mixture_labels, names_of_clusters
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import XYZ_to_Lab

__all__ = ["cluster_coverages"]

_EDGE_SHARES = (0.25, 0.5, 0.75)


def cluster_coverages(
    coverage: NDArray[np.float32],
    valid: NDArray[np.bool_],
    names: Sequence[str],
    count: int,
    nodal_XYZ: NDArray[np.float32],
    white_point: ArrayLike,
) -> Clusters:
    """Sort projector pixels into `count` clusters by their coverage with each colorant.

    A pixel belongs to the colorant that covers most of it, or to the edge cluster of the two that cover most, as the
    second one's share of both says.

    Parameters
    ----------
    coverage : (H, W, C) float32 array
        Share of each pixel's area that each colorant covers, 0..1.
    valid : (H, W) bool array
        Pixels on the pattern; the others get label 255 and may hold anything.
    names : sequence of C str
        The colorants.
    count : int
        K, at least C, at most 254.
    nodal_XYZ : (H, W, 3) float32 array
        Nodal images, for the clusters' colours and spread only.
    white_point : (3,) array
        Reference of CIELAB.

    Returns
    -------
    Clusters

    Raises
    ------
    InputError
        If shapes or `count` break their rule, or valid pixels hold coverages that are not finite.
    CalibrationError
        If a cluster stays empty.
    """
    if coverage.ndim != 3 or coverage.shape[2] != len(names) or coverage.shape[:2] != valid.shape:
        raise InputError(
            f"coverages of {len(names)} colorants must be (H, W, {len(names)}) on {valid.shape} pixels, "
            f"got {coverage.shape}"
        )
    check_count(names, count)
    indices = sample_indices(valid)
    sample = coverage.reshape(-1, len(names))[indices].astype(np.float64)
    if not np.all(np.isfinite(sample)):
        raise InputError("coverages must be finite where valid is true, got NaN or infinity")
    centres, edges = _fit(sample, count)
    own = float(np.mean(np.diag(centres[: len(names)])))
    mixtures = make_mixture_labels(len(names), edges, (1.0 - own, own))
    labels, n_per_cluster, mixed, halves = label_by_coverage(
        np.ascontiguousarray(coverage, np.float32), valid, mixtures.pairs, mixtures.bounds, mixtures.labels, count
    )
    if np.any(n_per_cluster == 0):
        raise CalibrationError(too_few_colors(count, int(np.sum(n_per_cluster > 0))))
    purity = mixed / n_per_cluster[:, None]
    centres_Lab, spread = _colors(nodal_XYZ, labels, indices, count, np.asarray(white_point, np.float64))
    return Clusters(
        labels=labels,
        names=names_of_clusters(names, edges),
        centres_Lab=centres_Lab,
        shares=n_per_cluster / n_per_cluster.sum(),
        spread=spread,
        centre_distances=np.linalg.norm(centres_Lab[:, None] - centres_Lab[None], axis=-1),
        purity=purity / purity.sum(axis=1, keepdims=True),
        halves=mixtures.by_pair(halves / n_per_cluster.sum()),
    )


def _fit(sample: NDArray[np.float64], count: int) -> tuple[NDArray[np.float64], list[tuple[int, int, float]]]:
    """Centres, the colorants' first, and (p, q, t) of the edge clusters in the order of their labels."""
    C = sample.shape[1]
    pure = np.eye(C)
    centres, _ = lloyd(sample, pure)
    pairs = list(combinations(range(C), 2))
    candidates = np.array([(1 - t) * pure[p] + t * pure[q] for p, q in pairs for t in _EDGE_SHARES])
    while len(centres) < count:
        gains = distortion_gains(sample, centres, candidates)
        centres, _ = lloyd(sample, np.vstack([centres, candidates[np.argmax(gains)]]))
    edges = []
    for k in range(C, count):
        p, q = sorted(np.argsort(-centres[k], kind="stable")[:2].tolist())
        edges.append((int(p), int(q), float(centres[k, q] / (centres[k, p] + centres[k, q]))))
    return centres, sorted(edges)


def _colors(
    nodal_XYZ: NDArray[np.float32],
    labels: NDArray[np.uint8],
    indices: NDArray[np.int64],
    K: int,
    white: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Centre and spread of each cluster in CIELAB, from a sample of its pixels."""
    Lab = np.asarray(XYZ_to_Lab(nodal_XYZ.reshape(-1, 3)[indices].astype(np.float64), white))
    of_pixel = labels.reshape(-1)[indices]
    seen = np.all(np.isfinite(Lab), axis=1) & (of_pixel != OUTSIDE)
    centres, spread = np.full((K, 3), np.nan), np.full(K, np.nan)
    for k in range(K):
        own = Lab[seen & (of_pixel == k)]
        if len(own):
            centres[k] = own.mean(axis=0)
            spread[k] = np.sqrt(np.mean(np.sum((own - centres[k]) ** 2, axis=1)))
    return centres, spread
