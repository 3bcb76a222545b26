"""The separable Gaussian behind the eye and behind all local means, as a kernel. Knows arrays only."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.bands import in_bands
from paxel_runtime.numba_options import KERNEL

__all__ = ["gaussian_blur"]

_CUT_SIGMAS = 4.0


def gaussian_blur(
    values: NDArray[np.floating], sigma_px: float, *, repeated: bool = True
) -> NDArray[np.float32] | NDArray[np.float64]:
    """Gaussian blur along rows and columns, the kernel cut at 4 sigma and of sum 1.

    Parameters
    ----------
    values : (H, W) or (H, W, C) float32 or float64 array
    sigma_px : float
        > 0.
    repeated : bool
        Beyond the edge the picture goes on mirrored, the edge's pixels twice; else there is 0.

    Returns
    -------
    array of the same shape and type
    """
    reach = int(_CUT_SIGMAS * sigma_px + 0.5)
    weights = np.exp(-0.5 * (np.arange(reach + 1) / sigma_px) ** 2)
    weights = (weights / (2 * weights.sum() - weights[0])).astype(values.dtype)
    planes = np.ascontiguousarray(values).reshape(*values.shape[:2], math.prod(values.shape[2:]))
    rows, columns = (_sources(size, reach, repeated) for size in planes.shape[:2])
    blurred = np.empty_like(planes)
    in_bands(partial(_blur, planes, weights, rows, columns, blurred), len(planes))
    return blurred.reshape(values.shape)


def _sources(size: int, reach: int, repeated: bool) -> NDArray[np.int64]:
    """Where the pixels -reach .. size + reach - 1 are read from; -1 = nowhere."""
    at = np.arange(-reach, size + reach)
    if not repeated:
        return np.where((at >= 0) & (at < size), at, -1)
    at = at % (2 * size)
    return np.where(at < size, at, 2 * size - 1 - at)


@njit(**KERNEL)
def _blur(
    values: NDArray[np.floating],
    weights: NDArray[np.floating],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    blurred: NDArray[np.floating],
    first: int,
    stop: int,
) -> None:
    _, width, planes = values.shape
    reach = len(weights) - 1
    across = width * planes
    for row in range(first, stop):
        # Down: a sum of whole rows, which vectorises; across: the same with the row and its margins in one array.
        padded = np.zeros((width + 2 * reach) * planes, values.dtype)
        inner = padded[reach * planes : reach * planes + across]
        for tap in range(-reach, reach + 1):
            source = rows[row + reach + tap]
            if source >= 0:
                line, weight = values[source].reshape(across), weights[abs(tap)]
                for i in range(across):
                    inner[i] += weight * line[i]
        for place in range(width + 2 * reach):
            source = columns[place]
            if source >= 0 and not reach <= place < reach + width:
                for c in range(planes):
                    padded[place * planes + c] = inner[source * planes + c]
        out = blurred[row].reshape(across)
        for i in range(across):
            out[i] = weights[0] * inner[i]
        for tap in range(1, reach + 1):
            weight, left, right = weights[tap], padded[(reach - tap) * planes :], padded[(reach + tap) * planes :]
            for i in range(across):
                out[i] += weight * (left[i] + right[i])
