"""What each projector pixel covers of each colorant, as assembly needs it: one byte a share, from print or picture.

Where the printed design is registered, coverage is known and only packed here. Else it is read off the nodal images:
a pixel between two colorants lights a mixture of their signals. Channels have planes of their own where chromatic
aberration lays their pixels apart. Pure functions on arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from paxel_runtime.bands import in_bands
from paxel_runtime.errors import InputError
from paxel_runtime.numba_options import KERNEL

__all__ = ["DIFFERENT_PX", "channels_differ", "coverage_from_nodal", "pack_coverage"]

DIFFERENT_PX = 0.03
"""Displacement (95 % of the pixels) above which channels have coverages of their own: it moves shares by 3 %."""

_OUTSIDE = 255
_LEAST_SOLID = 30
_JOINT_WEIGHT = 0.05**2
"""Squared contrast of two colorants in a channel at which its own mixture counts as much as that of all channels."""


def channels_differ(camera_xy: Sequence[NDArray[np.floating]], valid: NDArray[np.bool_]) -> bool:
    """Whether the channels' lookup tables (H, W, 2) lie farther apart than `DIFFERENT_PX` projector pixels."""
    first = camera_xy[0]
    pitch_px = float(np.nanmedian(np.hypot(*np.moveaxis(np.diff(first, axis=1), -1, 0))))
    stride = max(1, round((valid.size / 100_000) ** 0.5))
    some = (slice(None, None, stride), slice(None, None, stride))
    known = valid[some]
    if not known.any():
        return False
    apart = [np.hypot(*np.moveaxis((table - first)[some][known], -1, 0)) for table in camera_xy[1:]]
    return any(float(np.nanquantile(distance, 0.95)) > DIFFERENT_PX * pitch_px for distance in apart)


def pack_coverage(shares: Sequence[NDArray[np.floating]]) -> NDArray[np.uint8]:
    """Coverages (H, W, M) of one or N channels, 0..1, as (H, W, 1 or N, M) uint8, 255 = all."""
    packed = np.empty((*shares[0].shape[:2], len(shares), shares[0].shape[2]), np.uint8)
    for j, plane in enumerate(shares):
        for rows in (slice(k, k + 256) for k in range(0, len(plane), 256)):
            packed[rows, :, j] = np.rint(255 * np.clip(plane[rows], 0, 1))
    return packed


def coverage_from_nodal(
    nodal: NDArray[np.float32], labels: NDArray[np.uint8], colorants: int, *, by_channel: bool = False
) -> NDArray[np.uint8]:
    """Coverage estimated from nodal images: pixels between two colorants are mixtures of what solids signal.

    A pixel is taken as a mixture of two of the colorants that it or its eight neighbours are nearest to, whichever two
    explain it best; among neighbours of one colorant it is all of that. What camera and paper blur stays in it.

    Parameters
    ----------
    nodal : (H, W, N) float32 array
        Reflectance factor of what each pixel lights, NaN where unknown.
    labels : (H, W) uint8 array
        Cluster of each pixel, the colorants first; 255 = outside the pattern.
    colorants : int
        M.
    by_channel : bool
        Mixtures of each channel by itself, as far as it tells the two colorants apart.

    Returns
    -------
    (H, W, 1 or N, M) uint8 array
        255 = all; 0 everywhere outside the pattern.

    Raises
    ------
    InputError
        If shapes do not fit or a colorant has no pixels.
    """
    if nodal.ndim != 3 or labels.shape != nodal.shape[:2]:
        raise InputError(f"coverages need nodal images (H, W, N) and labels (H, W), got {nodal.shape}, {labels.shape}")
    solids = _solid_signals(nodal, labels, colorants)
    known = (labels != _OUTSIDE) & np.all(np.isfinite(nodal), axis=-1)
    packed = np.zeros((*labels.shape, nodal.shape[2] if by_channel else 1, colorants), np.uint8)
    nearest = np.full(labels.shape, _OUTSIDE, np.uint8)
    signals = np.ascontiguousarray(nodal, np.float32)
    in_bands(partial(_nearest_solid, signals, known, solids, nearest), len(nearest))
    in_bands(partial(_mixtures, signals, nearest, solids, by_channel, packed), len(packed))
    return packed


def _solid_signals(nodal: NDArray[np.float32], labels: NDArray[np.uint8], colorants: int) -> NDArray[np.float32]:
    """Median signal of the pixels of each colorant among neighbours of the same, (M, N)."""
    same = maximum_filter(labels, 3) == minimum_filter(labels, 3)
    solids = np.empty((colorants, nodal.shape[2]), np.float32)
    for m in range(colorants):
        own = labels == m
        inner = own & same
        chosen = inner if np.count_nonzero(inner) >= _LEAST_SOLID else own
        if not chosen.any():
            raise InputError(f"coverages need pixels of every colorant; colorant {m} of {colorants} has none")
        solids[m] = np.nanmedian(nodal[chosen], axis=0)
    return solids


@njit(**KERNEL)
def _nearest_solid(
    nodal: NDArray[np.float32],
    known: NDArray[np.bool_],
    solids: NDArray[np.float32],
    nearest: NDArray[np.uint8],
    first: int,
    stop: int,
) -> None:
    _, width, channels = nodal.shape
    for row in range(first, stop):
        for column in range(width):
            if not known[row, column]:
                continue
            least = np.inf
            for m in range(solids.shape[0]):
                distance = 0.0
                for j in range(channels):
                    distance += (nodal[row, column, j] - solids[m, j]) ** 2
                if distance < least:
                    least = distance
                    nearest[row, column] = m


@njit(**KERNEL)
def _mixtures(
    nodal: NDArray[np.float32],
    nearest: NDArray[np.uint8],
    solids: NDArray[np.float32],
    by_channel: bool,
    packed: NDArray[np.uint8],
    first: int,
    stop: int,
) -> None:
    height, width, channels = nodal.shape
    M = solids.shape[0]
    for row in range(first, stop):
        near = np.empty(M, np.bool_)
        for column in range(width):
            if nearest[row, column] >= M:
                continue
            near[:] = False
            for r in range(max(row - 1, 0), min(row + 2, height)):
                for c in range(max(column - 1, 0), min(column + 2, width)):
                    if nearest[r, c] < M:
                        near[nearest[r, c]] = True
            best_p, best_q, best_t, least = int(nearest[row, column]), int(nearest[row, column]), 0.0, np.inf
            for p in range(M):
                for q in range(p + 1, M):
                    if not (near[p] and near[q]):
                        continue
                    along, length = 0.0, 0.0
                    for j in range(channels):
                        step = solids[q, j] - solids[p, j]
                        along += (nodal[row, column, j] - solids[p, j]) * step
                        length += step * step
                    t = min(max(along / max(length, 1e-12), 0.0), 1.0)
                    rest = 0.0
                    for j in range(channels):
                        mixed = solids[p, j] + t * (solids[q, j] - solids[p, j])
                        rest += (nodal[row, column, j] - mixed) ** 2
                    if rest < least:
                        best_p, best_q, best_t, least = p, q, t, rest
            for k in range(packed.shape[2]):
                t = best_t
                if by_channel and best_p != best_q:
                    step = solids[best_q, k] - solids[best_p, k]
                    own = (nodal[row, column, k] - solids[best_p, k]) * step
                    t = min(max((own + _JOINT_WEIGHT * best_t) / (step * step + _JOINT_WEIGHT), 0.0), 1.0)
                share = int(255.0 * t + 0.5)
                packed[row, column, k, best_q] = share
                packed[row, column, k, best_p] = 255 - share if best_p != best_q else 255
