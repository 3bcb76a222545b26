"""The virtual bench's camera: radiance on the fine raster -> samples at its pixels -> glare, noise, rounding.

This file knows nothing of projectors and inks.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from paxel_runtime.optics_geometry import LATTICE_PX
from paxel_runtime.optics_grid import bspline_weights, in_bands

__all__ = ["PIXEL_BLUR_PX", "SPLINE_VARIANCE", "expose", "sample_camera", "veil"]

PIXEL_BLUR_PX = 0.5
"""Sigma of the camera lens's blur, camera pixels; the pixel's own square adds 1/12 px^2 of variance."""

SPLINE_VARIANCE = 1 / 3
"""Variance in fine samples^2 that the sampling itself adds, to be left out of the blur before."""

_GLARE_BLOCK_PX = 32
_GLARE_SIGMA = 0.08


def sample_camera(
    field: NDArray[np.float32], nodes: NDArray[np.float64], camera_resolution: tuple[int, int]
) -> NDArray[np.float32]:
    """Camera picture (h, w) of a field on the fine raster, by cubic B-splines; 0 beyond the field.

    Parameters
    ----------
    field : (rows, columns) float32 array
    nodes : (rows, columns, 2) float64 array
        From `optics_geometry.camera_to_fine_grid`.
    camera_resolution : (width, height)
    """
    width, height = camera_resolution
    picture = np.empty((height, width), np.float32)

    def work(start: int, stop: int) -> None:
        _sample_rows(field, nodes, start, picture[start:stop])

    in_bands(work, height, 64)
    return picture


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _sample_rows(
    field: NDArray[np.float32], nodes: NDArray[np.float64], start: int, picture: NDArray[np.float32]
) -> None:
    rows, columns = field.shape
    for i in range(picture.shape[0]):
        above = (start + i) // LATTICE_PX
        down = (start + i) / LATTICE_PX - above
        for column in range(picture.shape[1]):
            left = column // LATTICE_PX
            right = column / LATTICE_PX - left
            a, b = (1 - right) * (1 - down), right * (1 - down)
            c, d = (1 - right) * down, right * down
            x = a * nodes[above, left, 0] + b * nodes[above, left + 1, 0]
            x += c * nodes[above + 1, left, 0] + d * nodes[above + 1, left + 1, 0]
            y = a * nodes[above, left, 1] + b * nodes[above, left + 1, 1]
            y += c * nodes[above + 1, left, 1] + d * nodes[above + 1, left + 1, 1]
            if x < 1.0 or y < 1.0 or x >= columns - 2 or y >= rows - 2:
                picture[i, column] = 0.0
                continue
            ix, iy = int(x), int(y)
            w0, w1, w2, w3 = bspline_weights(x - ix)
            v0, v1, v2, v3 = bspline_weights(y - iy)
            r0, r1, r2, r3 = field[iy - 1], field[iy], field[iy + 1], field[iy + 2]
            picture[i, column] = (
                v0 * (w0 * r0[ix - 1] + w1 * r0[ix] + w2 * r0[ix + 1] + w3 * r0[ix + 2])
                + v1 * (w0 * r1[ix - 1] + w1 * r1[ix] + w2 * r1[ix + 1] + w3 * r1[ix + 2])
                + v2 * (w0 * r2[ix - 1] + w1 * r2[ix] + w2 * r2[ix + 1] + w3 * r2[ix + 2])
                + v3 * (w0 * r3[ix - 1] + w1 * r3[ix] + w2 * r3[ix + 1] + w3 * r3[ix + 2])
            )


def veil(picture: NDArray[np.float32]) -> NDArray[np.float32]:
    """Light that the lens scatters over the picture, one value a block of 32 x 32 pixels.

    A Gaussian of sigma 8 % of the picture's width of the picture itself, nothing lost at the rim.
    """
    height, width = picture.shape
    block = _GLARE_BLOCK_PX
    padded = np.pad(picture, ((0, -height % block), (0, -width % block)), mode="edge")
    blocks = padded.reshape(len(padded) // block, block, -1, block).mean(axis=(1, 3), dtype=np.float32)
    return gaussian_filter(blocks, _GLARE_SIGMA * width / block, mode="nearest")


def expose(
    picture: NDArray[np.float32],
    glare: float,
    full_well_e: float,
    read_noise_e: float,
    bits: int,
    rng: np.random.Generator,
) -> NDArray[np.uint16]:
    """Raw values of a picture whose 1 is saturation: glare, shot and read noise, clipping, rounding to `bits`.

    Shot noise is Gaussian of the signal's variance: indistinguishable from Poisson's above some 20 electrons, below
    which the read noise is the larger. Raw values have their black level subtracted, so noise below it reads 0.
    """
    noise = np.empty((0, 0), np.float32)
    if np.isfinite(full_well_e) or read_noise_e > 0:
        noise = rng.standard_normal(picture.shape, dtype=np.float32)
    veiling = veil(picture) if glare > 0 else np.zeros((1, 1), np.float32)
    shot = 1.0 / full_well_e
    read = read_noise_e / full_well_e if np.isfinite(full_well_e) else 0.0
    raw = np.empty(picture.shape, np.uint16)

    def work(start: int, stop: int) -> None:
        _expose_rows(picture, veiling, noise, start, stop, glare, shot, read, 2**bits - 1, raw)

    in_bands(work, len(picture), 128)
    return raw


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _expose_rows(
    picture: NDArray[np.float32],
    veiling: NDArray[np.float32],
    noise: NDArray[np.float32],
    start: int,
    stop: int,
    glare: float,
    shot: float,
    read: float,
    steps: int,
    raw: NDArray[np.uint16],
) -> None:
    last_j, last_i = veiling.shape[0] - 1, veiling.shape[1] - 1
    for row in range(start, stop):
        y = min(max((row + 0.5) / _GLARE_BLOCK_PX - 0.5, 0.0), float(last_j))
        j = min(int(y), max(last_j - 1, 0))
        for column in range(picture.shape[1]):
            signal = picture[row, column]
            if glare > 0.0:
                x = min(max((column + 0.5) / _GLARE_BLOCK_PX - 0.5, 0.0), float(last_i))
                i = min(int(x), max(last_i - 1, 0))
                top = veiling[j, i] + (x - i) * (veiling[j, min(i + 1, last_i)] - veiling[j, i])
                below = min(j + 1, last_j)
                low = veiling[below, i] + (x - i) * (veiling[below, min(i + 1, last_i)] - veiling[below, i])
                signal = (1.0 - glare) * signal + glare * (top + (y - j) * (low - top))
            if noise.shape[0]:
                signal += np.sqrt(max(signal, 0.0) * shot + read * read) * noise[row, column]
            level = int(min(max(signal, 0.0), 1.0) * steps + 0.5)
            raw[row, column] = int(level * (65535.0 / steps) + 0.5)
