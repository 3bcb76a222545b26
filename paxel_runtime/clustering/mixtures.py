"""Mixtures of two colorants, and which cluster each belongs to.

Every pixel is taken as a mixture of two colorants: share 1 - t of the first and t of the second, 0 <= t <= 1. Along
each pair lie the clusters: the first colorant, edge clusters in rising t, the second colorant. Numbers only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["MixtureLabels", "make_mixture_labels", "names_of_clusters"]


@dataclass(frozen=True, eq=False)
class MixtureLabels:
    """Label of a mixture of two colorants.

    Attributes
    ----------
    pairs : (P, 2) int64 array
        Colorants p < q of each pair.
    bounds : (P, E) float64 array
        Shares t at which one cluster of the pair ends and the next begins, rising; infinite where there are fewer.
    labels : (P, E + 1) int64 array
        Cluster between the bounds.
    """

    pairs: NDArray[np.int64]
    bounds: NDArray[np.float64]
    labels: NDArray[np.int64]

    def by_pair(self, values: NDArray[np.float64]) -> dict[tuple[int, int], float]:
        """One value a pair, under its colorants."""
        return {(int(p), int(q)): float(value) for (p, q), value in zip(self.pairs, values, strict=True)}


def make_mixture_labels(
    colorants: int, edges: Sequence[tuple[int, int, float]], ends: tuple[float, float] = (0.0, 1.0)
) -> MixtureLabels:
    """Clusters of every pair of colorants, divided half-way between neighbours along the pair.

    Parameters
    ----------
    colorants : int
        C; their clusters are 0 .. C-1.
    edges : sequence of (p, q, t)
        Parents and share of each edge cluster, in the order of their labels C, C+1, ...
    ends : (float, float)
        Shares that stand for the colorants' own clusters.
    """
    pairs = list(combinations(range(colorants), 2))
    most = max((sum((p, q) == pair for p, q, _ in edges) for pair in pairs), default=0)
    bounds = np.full((len(pairs), most + 1), np.inf)
    labels = np.zeros((len(pairs), most + 2), np.int64)
    for i, (p, q) in enumerate(pairs):
        own = sorted((t, colorants + k) for k, (e_p, e_q, t) in enumerate(edges) if (e_p, e_q) == (p, q))
        shares = [ends[0], *(t for t, _ in own), ends[1]]
        bounds[i, : len(shares) - 1] = [0.5 * (a + b) for a, b in pairwise(shares)]
        labels[i, : len(shares)] = [p, *(label for _, label in own), q]
        labels[i, len(shares) :] = q
    return MixtureLabels(np.array(pairs, np.int64), bounds, labels)


def names_of_clusters(colorants: Sequence[str], edges: Sequence[tuple[int, int, float]]) -> tuple[str, ...]:
    """Colorants in their order, then edge clusters by their parents: ``"black+white"``, ``"black+white-2"``."""
    names = []
    for i, (p, q, _) in enumerate(edges):
        twins = sum(earlier[:2] == (p, q) for earlier in edges[:i])
        names.append(f"{colorants[p]}+{colorants[q]}" + (f"-{twins + 1}" if twins else ""))
    return (*colorants, *names)
