"""Projector pixels sorted by the colour they light: k-means in CIELAB, then a label by light (paper: IV-B, Fig. 3).

Everything is deterministic: the starts are the colorants' expected colours, the fit looks at a fixed sample of the
pixels, and each centre is named after the colorant it fits best. The centres are those of k-means. The label of a
pixel between two of them is that of the colorant it lights more of, because light adds up in XYZ and not in CIELAB: a
pixel half on black and half on white is much nearer to white in CIELAB.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numba
import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from paxel_runtime.clustering.kernels import label_by_light
from paxel_runtime.clustering.kmeans import distortion_gains, lloyd, sample_indices, too_few_colors
from paxel_runtime.clustering.mixtures import make_mixture_labels, names_of_clusters
from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab

__all__ = ["OUTSIDE", "Boundary", "Clusters", "Space", "check_count", "cluster"]

OUTSIDE = 255
"""Label of pixels that light no pattern, or are not registered."""

MIN_DISTANCE = 5.0
"""Least distance of two colorants' centres, CIELAB: below it the split is one of noise, not of inks."""

Space = Literal["lab", "linear"]
"""Where distances are taken: CIELAB (the paper), or XYZ over the white point."""

Boundary = Literal["light", "nearest"]
"""Where clusters meet: half-way in light, or half-way in CIELAB (the paper)."""

_EDGE_MIXTURES = (0.25, 0.5, 0.75)
_BAND_ROWS = 32
_SHARES = np.linspace(0.0, 1.0, 101)

_Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Clusters:
    """Projector pixels sorted into K clusters.

    Attributes
    ----------
    labels : (H, W) uint8 array
        Cluster of each projector pixel; 255 outside the pattern or not registered.
    names : tuple of K str
        The colorants in their given order, then edge clusters by their parents: ``"black+white"``,
        ``"black+white-2"``.
    centres_Lab : (K, 3) float64 array
        Centre of each cluster.
    shares : (K,) float64 array
        Share of the labelled pixels, summing to 1.
    spread : (K,) float64 array
        Root mean square distance of a cluster's pixels from its centre, CIELAB.
    centre_distances : (K, K) float64 array
        Distances between the centres, CIELAB (dE*ab); 0 on the diagonal.
    purity : (K, C) float64 array
        Mean share of each colorant in what the pixels of a cluster light, as the camera sees it (with the blur of
        projector, paper and camera); rows sum to 1.
    halves : dict of (p, q) -> float
        Share of the labelled pixels that light colorants p and q about equally (a quarter to three quarters).
    """

    labels: NDArray[np.uint8]
    names: tuple[str, ...]
    centres_Lab: _Array
    shares: _Array
    spread: _Array
    centre_distances: _Array
    purity: _Array
    halves: dict[tuple[int, int], float]


def cluster(
    nodal_XYZ: NDArray[np.float32],
    valid: NDArray[np.bool_],
    colorants: Mapping[str, ArrayLike],
    count: int,
    white_point: ArrayLike,
    *,
    space: Space = "lab",
    boundary: Boundary = "light",
) -> Clusters:
    """Sort projector pixels into `count` clusters by the colour they light (paper: section IV-B).

    K-means (Lloyd) starts at the colorants' expected colours; each cluster beyond them is added where, of all mixtures
    of two colorants, it takes most off the sum of squared distances (fast global k-means; Likas, Vlassis and Verbeek
    2003). Colorants get their centres by the assignment with the least sum of squared distances (Hungarian method); a
    centre left over is an edge cluster, named after the two colorants whose mixture, additive in XYZ, passes nearest.
    Then every pixel is taken as the nearest mixture of two colorants, and labelled by its shares.

    Parameters
    ----------
    nodal_XYZ : (H, W, 3) float32 array
        Nodal images normalised so that the white sheet is `white_point`.
    valid : (H, W) bool array
        Registered pixels on the pattern; the others get label 255 and may hold anything.
    colorants : mapping of name -> (3,) array
        Expected XYZ of each colorant, in the order of the labels.
    count : int
        K, at least the number of colorants, at most 254.
    white_point : (3,) array
        Reference of CIELAB.
    space : "lab" | "linear"
        Of the distances.
    boundary : "light" | "nearest"
        ``"nearest"`` is the partition of k-means in CIELAB itself, as in the paper.

    Returns
    -------
    Clusters

    Raises
    ------
    InputError
        If shapes or `count` break their rule, or valid pixels hold numbers that are not finite.
    CalibrationError
        If the pixels hold fewer colours than clusters are asked for, or two colorants look the same.
    """
    names = tuple(colorants)
    white = np.asarray(white_point, np.float64)
    _check(nodal_XYZ, valid, names, count)
    expected = _to_space(np.array([colorants[name] for name in names], np.float64), white, space)
    sample = _to_space(_sample_XYZ(nodal_XYZ, valid), white, space)
    centres, _ = lloyd(sample, expected)
    while len(centres) < count:
        candidates = _edge_candidates(centres[_assign(centres, expected)], white, space)
        gains = distortion_gains(sample, centres, candidates)
        centres, _ = lloyd(sample, np.vstack([centres, candidates[np.argmax(gains)]]))

    centres, edges = _order(centres, expected, white, space)
    centres_XYZ = _to_XYZ(centres, white, space)
    centres_Lab = np.asarray(XYZ_to_Lab(centres_XYZ, white), np.float64)
    _check_colorants_differ(centres_Lab, names)
    mixtures = make_mixture_labels(len(names), edges)
    labels, n_per_cluster, squares, mixed, halves = _label_in_bands(
        nodal_XYZ,
        valid,
        white,
        centres_XYZ[: len(names)],
        mixtures.pairs,
        mixtures.bounds,
        mixtures.labels,
        centres_Lab,
        space == "lab",
        boundary == "nearest",
    )
    cluster_names = names_of_clusters(names, edges)
    if np.any(n_per_cluster == 0):
        raise CalibrationError(too_few_colors(count, int(np.sum(n_per_cluster > 0))))
    return Clusters(
        labels=labels,
        names=cluster_names,
        centres_Lab=centres_Lab,
        shares=n_per_cluster / n_per_cluster.sum(),
        spread=np.sqrt(squares / n_per_cluster),
        centre_distances=np.linalg.norm(centres_Lab[:, None] - centres_Lab[None], axis=-1),
        purity=mixed / n_per_cluster[:, None],
        halves=mixtures.by_pair(halves / n_per_cluster.sum()),
    )


def _label_in_bands(nodal_XYZ: NDArray[np.float32], valid: NDArray[np.bool_], *how: Any) -> tuple[Any, ...]:
    """`label_by_light` on bands of rows side by side: the whole map of labels, and the other results summed.

    The bands do not depend on the machine, so that the sums do not either.
    """
    bands = np.array_split(np.arange(len(valid)), max(1, len(valid) // _BAND_ROWS))
    with ThreadPoolExecutor(numba.get_num_threads()) as pool:
        parts = list(
            pool.map(
                lambda rows: label_by_light(
                    np.ascontiguousarray(nodal_XYZ[rows[0] : rows[-1] + 1], np.float32),
                    np.ascontiguousarray(valid[rows[0] : rows[-1] + 1]),
                    *how,
                ),
                bands,
            )
        )
    labels, *sums = zip(*parts, strict=True)
    return np.concatenate(labels), *(np.sum(part, axis=0) for part in sums)


def _check(nodal_XYZ: NDArray[np.float32], valid: NDArray[np.bool_], names: Sequence[str], count: int) -> None:
    if nodal_XYZ.ndim != 3 or nodal_XYZ.shape[2] != 3 or valid.shape != nodal_XYZ.shape[:2] or valid.dtype != bool:
        raise InputError(
            "clusters need nodal images (H, W, 3) and valid (H, W) bool, "
            f"got {nodal_XYZ.shape} and {valid.shape} of {valid.dtype}"
        )
    check_count(names, count)


def check_count(names: Sequence[str], count: int) -> None:
    """Whether `count` clusters can be named after these colorants.

    Raises
    ------
    InputError
        If there are fewer than two colorants, or fewer clusters than colorants.
    """
    if not len(names) >= 2:
        raise InputError(f"clusters need at least two colorants, got {list(names)}")
    if not len(names) <= count < OUTSIDE:
        raise InputError(
            f"clusters.count must be at least the number of colorants ({len(names)}) and below {OUTSIDE}, got {count}"
        )


def _to_space(XYZ: NDArray[np.floating], white: _Array, space: Space) -> _Array:
    return np.asarray(XYZ_to_Lab(XYZ, white) if space == "lab" else 100.0 * XYZ / white, np.float64)


def _to_XYZ(points: _Array, white: _Array, space: Space) -> _Array:
    return np.asarray(Lab_to_XYZ(points, white) if space == "lab" else 0.01 * points * white, np.float64)


def _check_colorants_differ(centres_Lab: _Array, names: Sequence[str]) -> None:
    for p, q in combinations(range(len(names)), 2):
        distance = float(np.linalg.norm(centres_Lab[p] - centres_Lab[q]))
        if distance < MIN_DISTANCE:
            raise CalibrationError(
                f"pixels on {names[p]} and on {names[q]} must differ by at least {MIN_DISTANCE:g} in CIELAB, got "
                f"{distance:.1f}: is the pattern under the projection, in focus, and are its dots larger than a pixel?"
            )


def _sample_XYZ(nodal_XYZ: NDArray[np.float32], valid: NDArray[np.bool_]) -> _Array:
    XYZ = nodal_XYZ.reshape(-1, 3)[sample_indices(valid)].astype(np.float64)
    if not np.all(np.isfinite(XYZ)):
        raise InputError("nodal images must be finite where valid is true, got NaN or infinity")
    return XYZ


def _assign(centres: _Array, expected: _Array) -> NDArray[np.int64]:
    """Centre of each colorant, (C,): the one-to-one assignment with the least sum of squared distances."""
    return linear_sum_assignment(np.sum((expected[:, None] - centres[None]) ** 2, axis=-1))[1]


def _mixtures(one: _Array, other: _Array, t: ArrayLike, white: _Array, space: Space) -> _Array:
    """Light of a pixel that covers two colours, the second by share `t`: additive in XYZ."""
    t = np.asarray(t, np.float64)[:, None]
    return _to_space((1 - t) * _to_XYZ(one, white, space) + t * _to_XYZ(other, white, space), white, space)


def _edge_candidates(colorants: _Array, white: _Array, space: Space) -> _Array:
    """Where an edge cluster may start: mixtures of every two colorants as they are seen."""
    return np.concatenate([_mixtures(p, q, _EDGE_MIXTURES, white, space) for p, q in combinations(colorants, 2)])


def _order(
    centres: _Array, expected: _Array, white: _Array, space: Space
) -> tuple[_Array, list[tuple[int, int, float]]]:
    """Centres in the order of the labels: colorants, then edges by parents and mixture; and (p, q, t) of the edges."""
    of_colorant = _assign(centres, expected)
    edges = []
    for k in sorted(set(range(len(centres))) - set(of_colorant.tolist())):
        best = (np.inf, 0, 0, 0.0)
        for p, q in combinations(range(len(expected)), 2):
            curve = _mixtures(centres[of_colorant[p]], centres[of_colorant[q]], _SHARES, white, space)
            distances = np.linalg.norm(curve - centres[k], axis=1)
            nearest = int(np.argmin(distances))
            best = min(best, (float(distances[nearest]), p, q, float(_SHARES[nearest])))
        edges.append((best[1:], k))
    edges.sort()
    return centres[[*of_colorant.tolist(), *(k for _, k in edges)]], [parents for parents, _ in edges]
