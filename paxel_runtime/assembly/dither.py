"""Simplified dithering: inputs x of every pixel and cluster -> the light of every pixel (paper: section V-A3, Eq. 6).

Each projector pixel lights one cluster, so it takes that cluster's N inputs and drops the others. Knows nothing of
colours or pictures.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError

__all__ = ["OUTSIDE", "check_inputs", "dither", "inside_pattern"]

OUTSIDE = 255
"""Label of pixels outside the pattern."""

_ROWS_AT_ONCE = 256


def dither(x: NDArray[np.float32], labels: NDArray[np.uint8], channels: int) -> NDArray[np.float32]:
    """Intensities (H, W, N) of Eq. 6: each pixel takes its own cluster's inputs; 0 outside the pattern.

    Parameters
    ----------
    x : (H, W, n) float32 array
        Linear inputs 0..1 that each pixel's neighbourhood should get, n = K N; may be a memory map, it is read in
        tiles of rows.
    labels : (H, W) or (H, W, N) uint8 array
        Cluster of each pixel, 0..K-1, in each channel where those differ; 255 = outside the pattern.
    channels : int
        N.

    Raises
    ------
    InputError
        If shapes do not fit, or a label names no cluster.
    """
    by_channel = check_inputs(x, labels, channels)
    p = np.empty(by_channel.shape, np.float32)
    for row in range(0, len(p), _ROWS_AT_ONCE):
        tile = slice(row, row + _ROWS_AT_ONCE)
        outside = by_channel[tile] == OUTSIDE
        index = np.where(outside, 0, by_channel[tile].astype(np.intp) * channels + np.arange(channels))
        p[tile] = np.take_along_axis(np.asarray(x[tile], np.float32), index, axis=2)
        p[tile][outside] = 0.0
    return p


def check_inputs(x: NDArray[np.float32], labels: NDArray[np.uint8], channels: int) -> NDArray[np.uint8]:
    """Labels as (H, W, N), a view; raises where inputs and labels do not fit.

    Raises
    ------
    InputError
        If shapes do not fit, or a label names no cluster.
    """
    if x.ndim != 3 or labels.shape not in (x.shape[:2], (*x.shape[:2], channels)) or labels.dtype != np.uint8:
        raise InputError(
            f"assembly needs x (H, W, n) and labels (H, W) or (H, W, {channels}) uint8, got {x.shape} and "
            f"{labels.shape} {labels.dtype}"
        )
    clusters, rest = divmod(x.shape[2], channels)
    if rest or not clusters:
        raise InputError(f"x must have K times {channels} inputs a pixel (clusters times channels), got {x.shape[2]}")
    highest = int(np.max(labels, where=labels != OUTSIDE, initial=0))
    if highest >= clusters:
        raise InputError(
            f"cluster labels must be below {clusters} (x has {x.shape[2]} inputs) or {OUTSIDE}, got {highest}; "
            "model.json and clusters.png must come from the same calibration"
        )
    return np.broadcast_to(labels if labels.ndim == 3 else labels[..., None], (*labels.shape[:2], channels))


def inside_pattern(labels: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Pixels (H, W) that lie on the pattern in every channel."""
    known = labels != OUTSIDE
    return np.asarray(known if known.ndim == 2 else np.all(known, axis=-1))
