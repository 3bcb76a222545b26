"""What to know about a sorting: its figures, how two sortings agree, and which number of clusters to take."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.clustering.clusters import OUTSIDE, Clusters
from paxel_runtime.errors import InputError

__all__ = ["Agreement", "agreement", "cluster_figures", "suggest_count"]

WORTH_AN_EDGE = 0.08
"""Share of pixels on the edge of two colorants from which an edge cluster of theirs pays: below it the colorants'
clusters lose less contrast to the edges than the solver gains in freedom (a cluster more is N unknowns more)."""


@dataclass(frozen=True, eq=False)
class Agreement:
    """How two sortings of the same pixels agree.

    Attributes
    ----------
    share : float
        Of the pixels that both sort, those with the same label, 0..1.
    matrix : (K, K) float64 array
        Share of those pixels with one label (row) and the other (column); sums to 1.
    both : float
        Of the pixels that either sorts, those that both sort.
    """

    share: float
    matrix: NDArray[np.float64]
    both: float


def agreement(one: NDArray[np.uint8], other: NDArray[np.uint8], clusters: int) -> Agreement:
    """Compare two cluster maps, (H, W) uint8 each, of the same `clusters` names.

    Raises
    ------
    InputError
        If the maps differ in size, or sort no pixel in common.
    """
    if one.shape != other.shape:
        raise InputError(f"cluster maps to compare must have one size, got {one.shape} and {other.shape}")
    both = (one != OUTSIDE) & (other != OUTSIDE)
    n, either = int(both.sum()), int(((one != OUTSIDE) | (other != OUTSIDE)).sum())
    if not n:
        raise InputError("cluster maps to compare must sort some pixel in common, got none")
    pairs = np.bincount(one[both].astype(np.int64) * clusters + other[both], minlength=clusters**2)
    matrix = pairs.reshape(clusters, clusters) / n
    return Agreement(float(np.trace(matrix)), matrix, n / either)


def suggest_count(clusters: Clusters, colorants: Sequence[str]) -> tuple[int, str]:
    """A number of clusters for this print under this projector, and the reason.

    One cluster a colorant, and one more for every two colorants that at least 8 % of the pixels light about equally.
    """
    edges = sorted(((share, pair) for pair, share in clusters.halves.items()), reverse=True)
    worth = [(share, pair) for share, pair in edges if share >= WORTH_AN_EDGE]
    count = len(colorants) + len(worth)
    if worth:
        listed = ", ".join(f"{colorants[p]} and {colorants[q]} {share:.0%}" for share, (p, q) in worth)
        return count, f"of the pixels light about equally {listed}: an edge cluster keeps them out of both"
    share, (p, q) = edges[0]
    return count, (
        f"one a colorant: at most {share:.0%} of the pixels lie on one kind of edge ({colorants[p]} and "
        f"{colorants[q]}), too few for a cluster of their own"
    )


def cluster_figures(clusters: Clusters, colorants: Sequence[str]) -> dict[str, Any]:
    """Figures of a sorting, ready for JSON.

    Returns
    -------
    dict
        ``{"names", "shares", "purity" (by cluster, by colorant), "centres_Lab", "centre_distances", "spread",
        "suggested_count", "reason"}``.
    """
    count, reason = suggest_count(clusters, colorants)
    return {
        "names": list(clusters.names),
        "shares": _rounded(clusters.shares),
        "purity": {
            name: dict(zip(colorants, _rounded(row), strict=True))
            for name, row in zip(clusters.names, clusters.purity, strict=True)
        },
        "centres_Lab": _rounded(clusters.centres_Lab),
        "centre_distances": _rounded(clusters.centre_distances),
        "spread": _rounded(clusters.spread),
        "suggested_count": count,
        "reason": reason,
    }


def _rounded(values: NDArray[np.float64]) -> Any:
    return np.round(values, 4).tolist()
