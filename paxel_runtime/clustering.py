"""Clusters: projector pixels sorted by the colorant they light, by k-means in CIELAB (paper: section IV-B, Fig. 3).

Everything is deterministic: the starts are the colorants' expected colours, the fit looks at a fixed golden-ratio
sample of the pixels, and each centre is named after the colorant it fits best. Knows nothing of cameras, captures or
files, nor of where a colorant is printed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numba import njit, prange
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from paxel_runtime.errors import CalibrationError, InputError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab

__all__ = ["OUTSIDE", "Clusters", "cluster", "cluster_colors", "label_picture", "lloyd"]

OUTSIDE = 255
"""Label of pixels that light no pattern, or are not registered."""

SAMPLE_SIZE = 200_000
"""Pixels the centres are fitted to: their mean is known to 0.1 Lab where the clusters spread by 40."""

MIN_DISTANCE = 5.0
"""Least distance of two colorants' centres, CIELAB: below it the split is one of noise, not of inks."""

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0
_EDGE_MIXTURES = (0.25, 0.5, 0.75)


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
    """

    labels: NDArray[np.uint8]
    names: tuple[str, ...]
    centres_Lab: NDArray[np.float64]
    shares: NDArray[np.float64]
    spread: NDArray[np.float64]
    centre_distances: NDArray[np.float64]


def cluster(
    nodal_XYZ: NDArray[np.float32],
    valid: NDArray[np.bool_],
    colorants: Mapping[str, ArrayLike],
    count: int,
    white_point: ArrayLike,
) -> Clusters:
    """Sort projector pixels into `count` clusters by the colour they light (paper: section IV-B).

    K-means (Lloyd) in CIELAB. It starts at the colorants' expected colours; each cluster beyond them is added where,
    of all mixtures of two colorants, it takes most off the sum of squared distances (fast global k-means; Likas,
    Vlassis and Verbeek 2003). Colorants get their centres by the assignment with the least sum of squared distances
    (Hungarian method); a centre left over is an edge cluster, named after the two colorants whose mixture, additive
    in XYZ, passes nearest.

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
    expected_Lab = _to_Lab(np.array([colorants[name] for name in names], np.float64), white)
    sample_Lab = _sample_Lab(nodal_XYZ, valid, white)

    centres, _ = lloyd(sample_Lab, expected_Lab)
    while len(centres) < count:
        candidates = _edge_candidates(centres[_assign(centres, expected_Lab)], white)
        gains = _distortion_gains(sample_Lab, centres, candidates)
        centres, _ = lloyd(sample_Lab, np.vstack([centres, candidates[np.argmax(gains)]]))

    centres, cluster_names = _name_and_order(centres, expected_Lab, names, white)
    _check_colorants_differ(centres, names)
    labels, sizes, squares = _label_pixels(np.ascontiguousarray(nodal_XYZ, np.float32), valid, centres, white)
    n_per_cluster, distortion = sizes.sum(axis=0), squares.sum(axis=0)
    if np.any(n_per_cluster == 0):
        empty = [name for name, n in zip(cluster_names, n_per_cluster, strict=True) if n == 0]
        raise CalibrationError(_too_few_colors(count, count - len(empty)))
    return Clusters(
        labels=labels,
        names=cluster_names,
        centres_Lab=centres,
        shares=n_per_cluster / n_per_cluster.sum(),
        spread=np.sqrt(distortion / n_per_cluster),
        centre_distances=np.linalg.norm(centres[:, None] - centres[None], axis=-1),
    )


def lloyd(
    points: NDArray[np.float64], starts: NDArray[np.float64], max_iterations: int = 300
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """K-means by Lloyd's iteration from given starts, until no point changes its cluster.

    Parameters
    ----------
    points : (n, d) float64 array
    starts : (K, d) float64 array
        A centre that loses all its points is set anew on the point farthest from its own centre, so starts need only
        be roughly right.
    max_iterations : int
        Where it stops in any case; by then centres move by less than their sampling error.

    Returns
    -------
    centres : (K, d) float64 array
    labels : (n,) int64 array

    Raises
    ------
    CalibrationError
        If the points hold fewer than K different colours.
    """
    centres = np.array(starts, np.float64)
    previous = np.full(len(points), -1, np.int64)
    for _ in range(max_iterations):
        labels, distances = _nearest(points, centres)
        if np.array_equal(labels, previous):
            break
        previous = labels
        sizes = np.bincount(labels, minlength=len(centres))
        for d in range(points.shape[1]):
            sums = np.bincount(labels, weights=points[:, d], minlength=len(centres))
            centres[:, d] = np.where(sizes > 0, sums / np.maximum(sizes, 1), centres[:, d])
        for empty in np.flatnonzero(sizes == 0):
            farthest = int(np.argmax(distances))
            if not distances[farthest] > 0:
                raise CalibrationError(_too_few_colors(len(centres), len(np.unique(labels))))
            centres[empty] = points[farthest]
            distances[farthest] = 0.0
    return centres, labels


def label_picture(labels: NDArray[np.uint8], names: Sequence[str]) -> NDArray[np.uint8]:
    """Colour-coded cluster map, (H, W, 3) uint8 sRGB, as Fig. 3 of the paper.

    Black and white are coded as there: black red, white blue, their edges green (and on). With other colorants
    each cluster has its colorant's own colour and an edge cluster the mean of its parents'. Outside is light gray.

    Raises
    ------
    InputError
        If a label has no name.
    """
    table = np.full((256, 3), 225, np.uint8)
    table[: len(names)] = cluster_colors(names)
    beyond = labels[(labels >= len(names)) & (labels != OUTSIDE)]
    if beyond.size:
        raise InputError(f"labels must be below {len(names)} (or 255 outside), got {int(beyond.max())}")
    return table[labels]


def cluster_colors(names: Sequence[str]) -> NDArray[np.uint8]:
    """sRGB colour, (K, 3) uint8, that stands for each cluster in `label_picture` and its legend."""
    parents = [name.split("-")[0].split("+") for name in names]
    colorants = [names_[0] for names_ in parents if len(names_) == 1]
    if set(colorants) <= {"black", "white"}:
        edges = iter(np.resize(_EDGE_COLORS, (len(names), 3)))
        return np.array([_FIG_3_COLORS[p[0]] if len(p) == 1 else next(edges) for p in parents], np.uint8)
    spare = iter(np.resize(_EDGE_COLORS, (len(names), 3)))
    own = {name: np.array(_COLORANT_COLORS.get(name) or next(spare), np.float64) for name in colorants}
    return np.array([np.mean([own[name] for name in p], axis=0) for p in parents]).astype(np.uint8)


_FIG_3_COLORS = {"black": (214, 55, 46), "white": (44, 98, 190)}
_EDGE_COLORS = ((62, 168, 92), (240, 180, 40), (150, 80, 170), (60, 180, 190))
_COLORANT_COLORS = {
    "black": (35, 35, 35),
    "white": (250, 250, 250),
    "red": (214, 55, 46),
    "green": (62, 168, 92),
    "blue": (44, 98, 190),
    "cyan": (40, 175, 225),
    "magenta": (215, 50, 140),
    "yellow": (250, 215, 40),
}


def _check(nodal_XYZ: NDArray[np.float32], valid: NDArray[np.bool_], names: Sequence[str], count: int) -> None:
    if nodal_XYZ.ndim != 3 or nodal_XYZ.shape[2] != 3 or valid.shape != nodal_XYZ.shape[:2] or valid.dtype != bool:
        raise InputError(
            "clusters need nodal images (H, W, 3) and valid (H, W) bool, "
            f"got {nodal_XYZ.shape} and {valid.shape} of {valid.dtype}"
        )
    if not len(names) >= 2:
        raise InputError(f"clusters need at least two colorants, got {list(names)}")
    if not len(names) <= count < OUTSIDE:
        raise InputError(
            f"clusters.count must be at least the number of colorants ({len(names)}) and below {OUTSIDE}, got {count}"
        )


def _to_Lab(XYZ: NDArray[np.floating], white: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(XYZ_to_Lab(XYZ, white), np.float64)


def _check_colorants_differ(centres_Lab: NDArray[np.float64], names: Sequence[str]) -> None:
    for p, q in combinations(range(len(names)), 2):
        distance = float(np.linalg.norm(centres_Lab[p] - centres_Lab[q]))
        if distance < MIN_DISTANCE:
            raise CalibrationError(
                f"pixels on {names[p]} and on {names[q]} must differ by at least {MIN_DISTANCE:g} in CIELAB, got "
                f"{distance:.1f}: is the pattern under the projection, in focus, and are its dots larger than a pixel?"
            )


def _too_few_colors(asked: int, found: int) -> str:
    return (
        f"{asked} clusters were asked for and the nodal images hold only {found} colours: is the pattern lit, in "
        "focus and not overexposed? Otherwise lower clusters.count"
    )


def _sample_Lab(
    nodal_XYZ: NDArray[np.float32], valid: NDArray[np.bool_], white: NDArray[np.float64]
) -> NDArray[np.float64]:
    """CIELAB of at most `SAMPLE_SIZE` valid pixels, spread by the golden ratio: no stride to beat with the dots."""
    indices = np.flatnonzero(valid)
    if not indices.size:
        raise CalibrationError(
            "no projector pixel is registered on the pattern: is the whole projection in the camera's picture?"
        )
    if indices.size > SAMPLE_SIZE:
        phases = np.arange(SAMPLE_SIZE) * _GOLDEN % 1.0
        indices = indices[np.unique((phases * indices.size).astype(np.int64))]
    XYZ = nodal_XYZ.reshape(-1, 3)[indices].astype(np.float64)
    if not np.all(np.isfinite(XYZ)):
        raise InputError("nodal images must be finite where valid is true, got NaN or infinity")
    return _to_Lab(XYZ, white)


def _assign(centres_Lab: NDArray[np.float64], expected_Lab: NDArray[np.float64]) -> NDArray[np.int64]:
    """Centre of each colorant, (C,): the one-to-one assignment with the least sum of squared distances."""
    costs = np.sum((expected_Lab[:, None] - centres_Lab[None]) ** 2, axis=-1)
    return linear_sum_assignment(costs)[1]


def _mixtures_Lab(
    Lab_1: NDArray[np.float64], Lab_2: NDArray[np.float64], t: ArrayLike, white: NDArray[np.float64]
) -> NDArray[np.float64]:
    """CIELAB of the light of a pixel that covers two colours, the second by share `t`: additive in XYZ."""
    t = np.asarray(t, np.float64)[:, None]
    return _to_Lab((1 - t) * Lab_to_XYZ(Lab_1, white) + t * Lab_to_XYZ(Lab_2, white), white)


def _edge_candidates(colorants_Lab: NDArray[np.float64], white: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where an edge cluster may start: mixtures of every two colorants as they are seen."""
    return np.concatenate([_mixtures_Lab(p, q, _EDGE_MIXTURES, white) for p, q in combinations(colorants_Lab, 2)])


def _distortion_gains(
    points: NDArray[np.float64], centres: NDArray[np.float64], candidates: NDArray[np.float64]
) -> NDArray[np.float64]:
    """How much each candidate, as one more centre, takes off the sum of squared distances, (number of candidates,)."""
    _, distances = _nearest(points, centres)
    return np.array([np.sum(np.maximum(0.0, distances - np.sum((points - c) ** 2, axis=1))) for c in candidates])


def _name_and_order(
    centres: NDArray[np.float64], expected_Lab: NDArray[np.float64], names: tuple[str, ...], white: NDArray[np.float64]
) -> tuple[NDArray[np.float64], tuple[str, ...]]:
    """Centres in the order of the labels, and their names: colorants, then edges by parents and mixture."""
    of_colorant = _assign(centres, expected_Lab)
    shares = np.linspace(0.0, 1.0, 101)
    edges = []
    for k in sorted(set(range(len(centres))) - set(of_colorant.tolist())):
        best = (np.inf, 0, 0, 0.0)
        for p, q in combinations(range(len(names)), 2):
            curve = _mixtures_Lab(centres[of_colorant[p]], centres[of_colorant[q]], shares, white)
            distances = np.linalg.norm(curve - centres[k], axis=1)
            nearest = int(np.argmin(distances))
            best = min(best, (float(distances[nearest]), p, q, float(shares[nearest])))
        edges.append((best[1:], k))
    edges.sort()
    edge_names: list[str] = []
    for (p, q, _), _k in edges:
        base = f"{names[p]}+{names[q]}"
        twins = sum(name.split("-")[0] == base for name in edge_names)
        edge_names.append(f"{base}-{twins + 1}" if twins else base)
    order = [*of_colorant.tolist(), *(k for _, k in edges)]
    return centres[order], (*names, *edge_names)


@njit(cache=True)
def _nearest(
    points: NDArray[np.float64], centres: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Index of the nearest centre of each point (the first of equals), and the squared distance to it."""
    labels = np.empty(len(points), np.int64)
    squares = np.empty(len(points))
    for i in range(len(points)):
        best, label = np.inf, 0
        for k in range(len(centres)):
            square = 0.0
            for d in range(points.shape[1]):
                square += (points[i, d] - centres[k, d]) ** 2
            if square < best:
                best, label = square, k
        labels[i], squares[i] = label, best
    return labels, squares


@njit(cache=True, error_model="numpy", inline="always")
def _cube_root(t: float) -> float:
    """Cube root of t > 0: the exponent divided by 3 in the float's bits, then two Halley steps (3e-14 relative).

    A third of the time of the library's, and half of the time of labelling is cube roots.
    """
    root = np.float64(np.int32(np.float32(t).view(np.int32) // 3 + 709921077).view(np.float32))
    for _ in range(2):
        cube = root * root * root
        root *= (cube + 2.0 * t) / (2.0 * cube + t)
    return root


@njit(cache=True, parallel=True, error_model="numpy")
def _label_pixels(
    nodal_XYZ: NDArray[np.float32],
    valid: NDArray[np.bool_],
    centres_Lab: NDArray[np.float64],
    white: NDArray[np.float64],
) -> tuple[NDArray[np.uint8], NDArray[np.int64], NDArray[np.float64]]:
    """Label of each pixel; per row, each cluster's number of pixels and sum of squared distances (no races)."""
    height, width = valid.shape
    K = len(centres_Lab)
    labels = np.full((height, width), np.uint8(255))
    sizes = np.zeros((height, K), np.int64)
    squares = np.zeros((height, K))
    epsilon, kappa = (6.0 / 29.0) ** 3, (29.0 / 3.0) ** 3
    for row in prange(height):
        f = np.empty(3)
        for column in range(width):
            if not valid[row, column]:
                continue
            for c in range(3):
                t = nodal_XYZ[row, column, c] / white[c]
                f[c] = _cube_root(t) if t > epsilon else (kappa * t + 16.0) / 116.0
            L, a, b = 116.0 * f[1] - 16.0, 500.0 * (f[0] - f[1]), 200.0 * (f[1] - f[2])
            best, label = np.inf, 0
            for k in range(K):
                dL, da, db = L - centres_Lab[k, 0], a - centres_Lab[k, 1], b - centres_Lab[k, 2]
                square = dL * dL + da * da + db * db
                if square < best:
                    best, label = square, k
            labels[row, column] = label
            sizes[row, label] += 1
            squares[row, label] += best
    return labels, sizes, squares
