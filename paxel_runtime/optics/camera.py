"""The virtual bench's camera: radiance on the fine raster -> samples at its pixels -> glare, noise, rounding.

This file knows nothing of projectors and inks.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.ndimage import convolve, gaussian_filter

from paxel_runtime.numba_options import KERNEL
from paxel_runtime.optics.geometry import LATTICE_PX
from paxel_runtime.optics.grid import bspline_weights, in_bands

__all__ = ["PIXEL_BLUR_PX", "SPLINE_VARIANCE", "demosaic", "expose", "mosaic", "sample_camera", "veil"]

PIXEL_BLUR_PX = 0.5
"""Sigma of the camera lens's blur, camera pixels; the pixel's own square adds 1/12 px^2 of variance."""

SPLINE_VARIANCE = 1 / 3
"""Variance in fine samples^2 that the sampling itself adds, to be left out of the blur before."""

_BAND = 64
_GLARE_BLOCK_PX = 32
_GLARE_SIGMA = 0.08


def sample_camera(
    field: NDArray[np.float32],
    nodes: NDArray[np.float64],
    camera_resolution: tuple[int, int],
    beyond: float = 0.0,
) -> NDArray[np.float32]:
    """Camera picture (h, w) of a field on the fine raster, by cubic B-splines; `beyond` outside the field.

    Parameters
    ----------
    field : (rows, columns) float32 array
    nodes : (rows, columns, 2) float64 array
        From `geometry.camera_to_fine_grid`.
    camera_resolution : (width, height)
    """
    width, height = camera_resolution
    picture = np.empty((height, width), np.float32)

    def work(start: int, stop: int) -> None:
        _sample_rows(field, nodes, start, np.float32(beyond), picture[start:stop])

    in_bands(work, height, 64)
    return picture


@njit(**KERNEL, fastmath=True)
def _sample_rows(
    field: NDArray[np.float32], nodes: NDArray[np.float64], start: int, beyond: float, picture: NDArray[np.float32]
) -> None:
    rows, columns = field.shape
    x_nodes, y_nodes = np.empty(nodes.shape[1]), np.empty(nodes.shape[1])
    one, two, three = np.uint32(1), np.uint32(2), np.uint32(3)  # unsigned: no test for indices from the end
    for i in range(picture.shape[0]):
        above = (start + i) // LATTICE_PX
        down = (start + i) / LATTICE_PX - above
        for k in range(nodes.shape[1]):
            x_nodes[k] = nodes[above, k, 0] + down * (nodes[above + 1, k, 0] - nodes[above, k, 0])
            y_nodes[k] = nodes[above, k, 1] + down * (nodes[above + 1, k, 1] - nodes[above, k, 1])
        for column in range(picture.shape[1]):
            left = column // LATTICE_PX
            right = (column - left * LATTICE_PX) * (1.0 / LATTICE_PX)
            x = x_nodes[left] + right * (x_nodes[left + 1] - x_nodes[left])
            y = y_nodes[left] + right * (y_nodes[left + 1] - y_nodes[left])
            if x < 1.0 or y < 1.0 or x >= columns - 2 or y >= rows - 2:
                picture[i, column] = beyond
                continue
            ix, iy = np.uint32(x), np.uint32(y)
            w0, w1, w2, w3 = bspline_weights(np.float32(x - ix))
            v0, v1, v2, v3 = bspline_weights(np.float32(y - iy))
            ix, iy = ix - one, iy - one
            r0, r1, r2, r3 = field[iy], field[iy + one], field[iy + two], field[iy + three]
            picture[i, column] = (
                w0 * (v0 * r0[ix] + v1 * r1[ix] + v2 * r2[ix] + v3 * r3[ix])
                + w1 * (v0 * r0[ix + one] + v1 * r1[ix + one] + v2 * r2[ix + one] + v3 * r3[ix + one])
                + w2 * (v0 * r0[ix + two] + v1 * r1[ix + two] + v2 * r2[ix + two] + v3 * r3[ix + two])
                + w3 * (v0 * r0[ix + three] + v1 * r1[ix + three] + v2 * r2[ix + three] + v3 * r3[ix + three])
            )


def mosaic(planes: list[NDArray[np.float32]]) -> NDArray[np.float32]:
    """What a Bayer sensor keeps of red, green and blue pictures (h, w): RGGB, red at even rows and columns."""
    kept = planes[1].copy()
    kept[::2, ::2], kept[1::2, 1::2] = planes[0][::2, ::2], planes[2][1::2, 1::2]
    return kept


def demosaic(raw: NDArray[np.uint16]) -> NDArray[np.uint16]:
    """Red, green and blue (3, h, w) of a Bayer mosaic, by bilinear interpolation; exact on uniform colours."""
    masks = np.zeros((3, *raw.shape), np.float32)
    masks[0, ::2, ::2] = masks[2, 1::2, 1::2] = 1.0
    masks[1] = 1.0 - masks[0] - masks[2]
    sparse, dense = np.array([[[1, 2, 1], [2, 4, 2], [1, 2, 1]], [[0, 1, 0], [1, 4, 1], [0, 1, 0]]], np.float32)
    planes = []
    for mask, kernel in zip(masks, (sparse, dense, sparse), strict=True):
        around = convolve(raw * mask, kernel, mode="mirror") / convolve(mask, kernel, mode="mirror")
        planes.append(np.where(mask > 0, raw, np.rint(around)).astype(np.uint16))
    return np.stack(planes)


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
    veiling = veil(picture) if glare > 0 else np.zeros((1, 1), np.float32)
    shot = 1.0 / full_well_e
    read = read_noise_e / full_well_e if np.isfinite(full_well_e) else 0.0
    raw = np.empty(picture.shape, np.uint16)
    generators = rng.spawn(-(-len(picture) // _BAND))

    def work(start: int, stop: int) -> None:
        noise = np.empty((0, 0), np.float32)
        if shot > 0 or read > 0:
            noise = generators[start // _BAND].standard_normal((stop - start, picture.shape[1]), dtype=np.float32)
        _expose_rows(picture, veiling, noise, start, glare, shot, read, 2**bits - 1, raw[start:stop])

    in_bands(work, len(picture), _BAND)
    return raw


@njit(**KERNEL, fastmath=True)
def _expose_rows(
    picture: NDArray[np.float32],
    veiling: NDArray[np.float32],
    noise: NDArray[np.float32],
    start: int,
    glare: float,
    shot: float,
    read: float,
    steps: int,
    raw: NDArray[np.uint16],
) -> None:
    width = picture.shape[1]
    blocks = veiling.shape[1]
    signal, veil_row = np.empty(width, np.float32), np.empty(blocks, np.float32)
    shot_, read2 = np.float32(shot), np.float32(read * read)
    levels, unit = np.float32(steps), np.float32(65535.0 / steps)
    clear, half, zero, full = np.float32(1.0 - glare), np.float32(0.5), np.float32(0.0), np.float32(1.0)
    for i in range(raw.shape[0]):
        source, target = picture[start + i], raw[i]
        for c in range(width):
            signal[c] = clear * source[c]
        if glare > 0.0:
            y = min(max((start + i + 0.5) / _GLARE_BLOCK_PX - 0.5, 0.0), veiling.shape[0] - 1.0)
            j = int(y)
            below = min(j + 1, veiling.shape[0] - 1)
            for n in range(blocks):
                veil_row[n] = glare * (veiling[j, n] + (y - j) * (veiling[below, n] - veiling[j, n]))
            for c in range(width):
                x = min(max((c + 0.5) / _GLARE_BLOCK_PX - 0.5, 0.0), blocks - 1.0)
                n = int(x)
                signal[c] += veil_row[n] + (x - n) * (veil_row[min(n + 1, blocks - 1)] - veil_row[n])
        if noise.shape[0]:
            noise_row = noise[i]
            for c in range(width):
                signal[c] += np.sqrt(max(signal[c], zero) * shot_ + read2) * noise_row[c]
        for c in range(width):
            level = np.int32(min(max(signal[c], zero), full) * levels + half)
            target[c] = np.uint16(np.int32(level * unit + half))
