"""The fine raster on which the virtual bench computes light, its bands, and smooth noise on such rasters.

The fine raster lies in the projector's own raster (of its middle channel): `subsamples` samples a pixel and axis, and
a margin of pixels around for the light that the blur carries outwards. Light on it is a band-limited function known
by point samples; sums over samples are integrals. This file knows no physics.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numba import get_num_threads, njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL

__all__ = ["MARGIN_PX", "FineGrid", "bspline_weights", "correlated_noise", "gaussian_kernel", "in_bands"]

MARGIN_PX = 4
"""Pixels of a grid around the projector's raster, if not more are asked for."""

_LEAST_SUBSAMPLES, _MOST_SUBSAMPLES = 4, 8


class FineGrid(NamedTuple):
    """Fine raster over a projector raster of `width` x `height` pixels, `subsamples` a pixel and axis.

    It holds `margin_px` pixels more on each side.
    """

    width: int
    height: int
    subsamples: int
    margin_px: int = MARGIN_PX

    @classmethod
    def fitting(
        cls, resolution: tuple[int, int], pitch_mm: float, scattering_mm: float, margin_px: int = MARGIN_PX
    ) -> FineGrid:
        """Grid whose step resolves the scattering in the paper (step <= sigma), between 4 and 8 samples a pixel."""
        needed = int(np.ceil(pitch_mm / scattering_mm)) if scattering_mm > 0 else 0
        return cls(*resolution, min(max(needed, _LEAST_SUBSAMPLES), _MOST_SUBSAMPLES), margin_px)

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of samples."""
        return (self.height + 2 * self.margin_px) * self.subsamples, (self.width + 2 * self.margin_px) * self.subsamples

    def to_raster(self, sample: NDArray[np.floating] | NDArray[np.integer]) -> NDArray[np.float64]:
        """Raster coordinate of a sample's index, along either axis."""
        return (np.asarray(sample, np.float64) + 0.5) / self.subsamples - 0.5 - self.margin_px

    def to_sample(self, raster: NDArray[np.floating] | float) -> NDArray[np.float64]:
        """Inverse of `to_raster`."""
        return (np.asarray(raster, np.float64) + 0.5 + self.margin_px) * self.subsamples - 0.5

    def pixel_means(self, field: NDArray[np.floating] | NDArray[np.integer]) -> NDArray[np.float32]:
        """Mean of a field on the whole grid over each projector pixel's area: (height, width) float32."""
        s, first = self.subsamples, self.margin_px * self.subsamples
        inner = field[first : first + self.height * s, first : first + self.width * s]
        return inner.reshape(self.height, s, self.width, s).mean(axis=(1, 3), dtype=np.float32)


def in_bands(work: Callable[[int, int], None], rows: int, band: int) -> None:
    """Call ``work(start, stop)`` for bands of rows, on as many threads as numba may use.

    The kernels release the interpreter's lock, so that bands run side by side; each writes its own rows, so that the
    result does not depend on their order.
    """
    starts = range(0, rows, band)
    with ThreadPoolExecutor(max_workers=get_num_threads()) as pool:
        for done in [pool.submit(work, start, min(start + band, rows)) for start in starts]:
            done.result()


def gaussian_kernel(sigma: float) -> NDArray[np.float32]:
    """One side of a sampled Gaussian, centre first, up to 4 sigma, whose two-sided sum is 1; [1] for sigma = 0.

    For sigma >= 1 the sampled kernel has the variance of the continuous one to 1e-8 (aliasing exp(-2 pi^2 sigma^2)).
    """
    if sigma <= 0:
        return np.ones(1, np.float32)
    half = np.exp(-0.5 * (np.arange(int(np.ceil(4 * sigma)) + 1) / sigma) ** 2)
    return (half / (2 * half.sum() - half[0])).astype(np.float32)


def correlated_noise(shape: tuple[int, int], correlation: float, rng: np.random.Generator) -> NDArray[np.float64]:
    """Periodic Gaussian noise of mean 0 and rms 1 whose autocorrelation is exp(-(r / correlation)^2), r in samples."""
    frequency_y = np.fft.fftfreq(shape[0])[:, None]
    frequency_x = np.fft.rfftfreq(shape[1])[None, :]
    spectrum = np.exp(-0.5 * (np.pi * correlation) ** 2 * (frequency_x**2 + frequency_y**2))
    noise = np.fft.irfft2(np.fft.rfft2(rng.standard_normal(shape)) * spectrum, s=shape)
    noise -= noise.mean()
    return noise / noise.std()


@njit(**KERNEL)
def bspline_weights(t: float) -> tuple[float, float, float, float]:
    """Weights of the cubic B-spline for the samples -1, 0, 1, 2 around a point at `t` in 0..1.

    They sum to 1, are exact in position, and blur by the same variance, 1/3 sample^2, wherever the point lies.
    """
    s = 1.0 - t
    return (
        s * s * s / 6.0,
        (4.0 - 6.0 * t * t + 3.0 * t * t * t) / 6.0,
        (4.0 - 6.0 * s * s + 3.0 * s * s * s) / 6.0,
        t * t * t / 6.0,
    )
