"""The installation's own pixels sorted anew: what another number of clusters, or another way of sorting, would give.

A calibration leaves behind what share of its light every projector pixel sends to each colorant. What the colorants
return follows from the measured model, and then the model of any clusters; lens, paper, ink and projector are those on
the wall. Two such models, with the present clusters and with others, are compared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from paxel_design.what_if.simulated_print import SortedBy
from paxel_runtime.clustering import OUTSIDE, cluster, cluster_coverages
from paxel_runtime.installation import Installation
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.storage import read_image, read_npz

__all__ = ["Pixels", "model_of_pixels", "pixels_of", "sorted_anew"]

_MOST = 250_000
"""Pixels that are looked at: the mean of a cluster is then known to a thousandth."""

_GOLDEN = (np.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, eq=False)
class Pixels:
    """Projector pixels on the pattern.

    Attributes
    ----------
    coverage : (P, M) float32 array
        Share of each pixel's light on each colorant.
    labels : (P,) uint8 array
        Cluster of each.
    """

    coverage: NDArray[np.float32]
    labels: NDArray[np.uint8]


def pixels_of(installation: Installation) -> Pixels | None:
    """Pixels of a calibrated installation, of its middle channel, spread over the pattern; None where none are kept."""
    folder = installation.folder("calibration")
    files = folder / "coverages.npz", folder / "clusters.png"
    if not all(file.is_file() for file in files):
        return None
    coverage, labels = read_npz(files[0])["coverage"], read_image(files[1])
    channel = coverage.shape[2] // 2
    labels = labels if labels.ndim == 2 else labels[..., channel]
    if labels.shape != coverage.shape[:2]:
        return None
    lit = np.flatnonzero(labels != OUTSIDE)
    if len(lit) > _MOST:  # by the golden ratio: no stride to beat with the dots
        lit = lit[(np.arange(_MOST) * _GOLDEN % 1.0 * len(lit)).astype(np.int64)]
    share = coverage[:, :, channel].reshape(labels.size, -1)[lit].astype(np.float32)
    return Pixels(share / np.maximum(share.sum(axis=1, keepdims=True), 1e-6), labels.ravel()[lit])


def model_of_pixels(model: PredictionModel, pixels: Pixels, labels: NDArray[np.uint8], K: int) -> PredictionModel:
    """The linear model of pixels in K clusters whose colorants return what a measured model says.

    Parameters
    ----------
    model : PredictionModel
        Measured with `pixels.labels`.
    pixels : Pixels
    labels : (P,) array
        Another cluster of each pixel, 0 .. K-1.
    K : int
    """
    of_colorants, of_paper = _returned(model, pixels)
    mixed = _sums(pixels.coverage, labels, K) / len(labels)  # (K, M)
    A_pattern = np.einsum("km,mnc->ckn", mixed, of_colorants).reshape(3, -1)
    A_white = np.einsum("k,nc->ckn", mixed.sum(axis=1), of_paper).reshape(3, -1)
    return replace(
        model.linear,
        clusters=tuple(f"cluster {k + 1}" for k in range(K)),
        pattern=SurfaceModel(A_pattern, model.pattern.black),
        white=None if model.white is None else SurfaceModel(A_white, model.white.black),
    )


def sorted_anew(
    model: PredictionModel, pixels: Pixels, colorants: tuple[str, ...], K: int, by: SortedBy
) -> NDArray[np.uint8]:
    """Cluster of each pixel, (P,), by the functions of a calibration.

    Raises
    ------
    InputError, CalibrationError
        If there cannot be so many clusters.
    """
    of_colorants, _ = _returned(model, pixels)
    white = model.white_point
    solids_XYZ = of_colorants.sum(axis=1)  # (M, 3)
    seen = (pixels.coverage @ solids_XYZ).astype(np.float32)[:, None]
    valid = np.ones(seen.shape[:2], bool)
    if by == "design":
        return cluster_coverages(pixels.coverage[:, None], valid, colorants, K, seen, white).labels[:, 0]
    return cluster(seen, valid, dict(zip(colorants, solids_XYZ, strict=True)), K, white).labels[:, 0]


def _returned(model: PredictionModel, pixels: Pixels) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """XYZ that each colorant returns of all light of each channel, (M, N, 3), by least squares; and paper, (N, 3)."""
    K, N = len(model.clusters), len(model.channels)
    mixed = _sums(pixels.coverage, pixels.labels, K) / len(pixels.labels)
    columns = np.asarray(model.pattern.A, np.float64).reshape(3, K, N).transpose(1, 2, 0)
    found, *_ = np.linalg.lstsq(mixed, columns.reshape(K, -1), rcond=None)
    of_paper = np.zeros((N, 3))
    if model.white is not None:
        of_paper = np.asarray(model.white.A, np.float64).reshape(3, K, N).sum(axis=1).T
    return np.maximum(found.reshape(-1, N, 3), 0.0), of_paper


def _sums(coverage: NDArray[np.float32], labels: NDArray[np.uint8], K: int) -> NDArray[np.float64]:
    """Light of each cluster on each colorant, (K, M), in pixels."""
    return np.stack([np.bincount(labels, weights=share, minlength=K)[:K] for share in coverage.T], axis=1)
