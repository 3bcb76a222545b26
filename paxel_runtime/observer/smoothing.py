"""Local means under a wide Gaussian, inside a mask: what is local to a place, and what is left above it.

Wide windows are worked on sums over blocks of pixels, so that they cost no more than narrow ones.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from paxel_runtime.errors import InputError
from paxel_runtime.observer.gaussian import gaussian_blur

__all__ = ["high_passed", "local_deviation", "local_mean"]

_SIGMA_PER_BLOCK = 3.0
"""Blocks are at most a third of sigma wide: their variance is taken off, so the Gaussian's shape is kept to 1 %."""

_HALF_AMPLITUDE = math.sqrt(math.log(2.0) / 2.0) / math.pi
"""Sigma of the Gaussian that halves a grating, in periods of it."""


def local_mean(values: NDArray[np.floating], mask: NDArray[np.bool_], sigma_px: float) -> NDArray[np.float64]:
    """Gaussian mean about each pixel over the pixels of a mask alone (normalised convolution).

    Parameters
    ----------
    values : (H, W) array
        Finite inside the mask.
    mask : (H, W) bool array
    sigma_px : float
        > 0.

    Returns
    -------
    (H, W) float64 array
        0 where no pixel of the mask is within reach (4 sigma).

    Raises
    ------
    InputError
        If shapes differ or sigma is not positive.
    """
    if values.ndim != 2 or values.shape != mask.shape:
        raise InputError(f"values and mask must be (H, W) of one shape, got {values.shape} and {mask.shape}")
    if not (sigma_px > 0 and math.isfinite(sigma_px)):
        raise InputError(f"a window's sigma must be > 0 pixels, got {sigma_px}")
    block = max(1, int(sigma_px / _SIGMA_PER_BLOCK))
    sums = _block_sums(np.where(mask, values, 0.0).astype(np.float64), block)
    counts = _block_sums(mask.astype(np.float64), block)
    # The blocks and the interpolation between them are a part of the blur: their variances are known.
    sigma = math.sqrt(sigma_px**2 - (block**2 - 1) / 4) / block
    sums, counts = np.moveaxis(gaussian_blur(np.stack([sums, counts], axis=-1), sigma, repeated=False), -1, 0)
    if block > 1:
        sums, counts = (_interpolated(a, values.shape, block) for a in (sums, counts))
    enough = counts > 1e-6 * block**2
    return np.divide(sums, counts, out=np.zeros(values.shape), where=enough)


def local_deviation(values: NDArray[np.floating], mask: NDArray[np.bool_], sigma_px: float) -> NDArray[np.float64]:
    """Standard deviation about each pixel in a Gaussian window, over the pixels of a mask alone; see `local_mean`."""
    centred = np.where(mask, values, 0.0).astype(np.float64)
    centred -= centred[mask].mean() if mask.any() else 0.0  # nothing is lost between two large squares
    mean = local_mean(centred, mask, sigma_px)
    return np.sqrt(np.maximum(local_mean(centred**2, mask, sigma_px) - mean**2, 0.0))


def high_passed(
    values: NDArray[np.floating], mask: NDArray[np.bool_], px_per_degree: float, cycles_per_degree: float = 1.0
) -> NDArray[np.float64]:
    """What is finer than a grating of `cycles_per_degree`, which keeps half of its amplitude; (H, W)."""
    return values - local_mean(values, mask, _HALF_AMPLITUDE * px_per_degree / cycles_per_degree)


def _block_sums(values: NDArray[np.float64], block: int) -> NDArray[np.float64]:
    """Sums over blocks of `block` x `block` pixels; pixels beyond the edge count as 0."""
    if block == 1:
        return values
    values = np.pad(values, [(0, -n % block) for n in values.shape])
    values = np.sum([values[k::block] for k in range(block)], axis=0)
    return np.asarray(np.sum([values[:, k::block] for k in range(block)], axis=0))


def _interpolated(blocks: NDArray[np.float64], shape: tuple[int, ...], block: int) -> NDArray[np.float64]:
    """Bilinear between the centres of blocks, at every pixel of (H, W); beyond the outermost centres their value."""
    for axis in (0, 1):
        at = np.clip((np.arange(shape[axis]) - (block - 1) / 2) / block, 0, blocks.shape[axis] - 1)
        low = at.astype(int)
        high = np.minimum(low + 1, blocks.shape[axis] - 1)
        share = np.expand_dims(at - low, 1 - axis)
        blocks = np.take(blocks, low, axis) * (1 - share) + np.take(blocks, high, axis) * share
    return blocks
