"""The Gaussian that the blue-noise methods measure crowding with, on a torus."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["blur", "gaussian_kernel"]


def gaussian_kernel(sigma: float, least_radius: int = 1) -> NDArray[np.float64]:
    """Gaussian of peak 1 and standard deviation `sigma` cells, cut at 4 sigma: (2 R + 1, 2 R + 1)."""
    radius = max(least_radius, int(np.ceil(4 * sigma)))
    x = np.arange(-radius, radius + 1)
    line = np.exp(-(x**2) / (2 * sigma**2))
    return np.outer(line, line)


def blur(fields: NDArray[np.generic], kernel: NDArray[np.float64]) -> NDArray[np.float64]:
    """(..., H, W) fields convolved with an even kernel, at most (H, W) large, on the torus."""
    shape = fields.shape[-2:]
    radius = kernel.shape[0] // 2
    padded = np.zeros(shape)
    padded[: kernel.shape[0], : kernel.shape[1]] = kernel
    transfer = np.fft.rfft2(np.roll(padded, (-radius, -radius), (0, 1)))
    return np.asarray(np.fft.irfft2(np.fft.rfft2(fields) * transfer, s=shape), np.float64)
