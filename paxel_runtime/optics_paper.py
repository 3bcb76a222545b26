"""Light on a printed or blank sheet: ink, scattering in the paper, ink again; what a sensor or a meter receives.

``sum_jkl G[j, k, l] a_k [s * (a_l L_j)]`` (see `optics`), in bands of rows of the fine raster, and the weights that
its mean over an aperture gives each projector pixel (the adjoint, exact). Kernels are plain convolutions and products
on rows; everything outside a field is dark.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.optics_grid import in_bands
from paxel_runtime.optics_light import Footprint, light_rows, spread_columns

__all__ = ["convolve", "convolve_columns", "convolve_rows", "radiance", "scattered_apertures"]

_BAND = 96
_BYTE = np.float32(1 / 255)


def radiance(
    x: NDArray[np.float32],
    footprints: list[Footprint],
    coverage: NDArray[np.uint8],
    factors: NDArray[np.float32],
    scattering: NDArray[np.float32],
    blur: NDArray[np.float32],
) -> NDArray[np.float32]:
    """What sensors see of the sheet, on the fine raster.

    Parameters
    ----------
    x : (N, H, W) float32 array
        Linear intensities.
    footprints : list of N Footprint
    coverage : (L, rows, columns) uint8 array
        Ink on the fine raster, 0..255; L = 0 for a blank sheet.
    factors : (planes, N, 1 + L, 1 + L) float32 array
        From `optics.pair_factors`.
    scattering, blur : (radius + 1,) float32 arrays
        One side of the paper's and of the sensor's kernel, in samples.

    Returns
    -------
    (planes, rows, columns) float32 array
    """
    columns = len(footprints[0].first_x)
    rows = len(footprints[0].first_y)
    lit = [j for j in range(len(x)) if x[j].any()]
    spread = [spread_columns(x[j], footprints[j]) for j in lit]
    seen = np.empty((len(factors), rows, columns), np.float32)

    def work(start: int, stop: int) -> None:
        rim = len(blur) - 1
        wide = rim + len(scattering) - 1
        light = np.empty((len(lit), stop - start + 2 * wide, columns), np.float32)
        for j, source in enumerate(spread):
            light_rows(source, footprints[lit[j]], start - wide, light[j])
        inked, field = np.empty_like(light[0]), np.empty_like(light[0])
        leaving = np.empty((stop - start + 2 * rim, columns), np.float32)
        for plane, of_channels in enumerate(factors[:, lit]):
            leaving[:] = 0.0
            for k in range(1 + len(coverage)):
                if not of_channels[:, k].any():
                    continue
                _entering(light, coverage, start - wide, of_channels[:, k], inked)
                convolve_rows(inked, scattering, field)
                _leaving(field, scattering, coverage, k - 1, start - rim, leaving)
            convolve_rows(leaving, blur, field[: len(leaving)])
            convolve_columns(field[: len(leaving)], blur, seen[plane, start:stop])

    in_bands(work, rows, _BAND)
    return seen


def scattered_apertures(
    aperture: NDArray[np.float32], coverage: NDArray[np.uint8], scattering: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Weights of the light for each pair of passages, a_l [s * (a_k aperture)]: (1 + L, 1 + L, rows, columns), [k, l].

    Parameters
    ----------
    aperture : (rows, columns) float32 array
        Weights of the radiance, with a rim of zeros as wide as `scattering`.
    coverage : (L, rows, columns) uint8 array
        Of the same window.
    scattering : (radius + 1,) float32 array
    """
    inks = np.concatenate((np.ones((1, *aperture.shape), np.float32), coverage * _BYTE))
    return np.stack([convolve(ink * aperture, scattering) * inks for ink in inks])


def convolve(field: NDArray[np.float32], kernel: NDArray[np.float32]) -> NDArray[np.float32]:
    """Convolution of a (rows, columns) float32 field with a separable kernel (one side, centre first)."""
    rim = len(kernel) - 1
    along_rows = np.zeros((len(field) + 2 * rim, field.shape[1]), np.float32)
    convolve_rows(np.ascontiguousarray(field), kernel, along_rows[rim : rim + len(field)])
    result = np.empty_like(field)
    convolve_columns(along_rows, kernel, result)
    return result


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def convolve_rows(field: NDArray[np.float32], kernel: NDArray[np.float32], result: NDArray[np.float32]) -> None:
    """Convolve each row; (rows, columns) -> the same shape."""
    columns = field.shape[1]
    for row in range(field.shape[0]):
        source, target = field[row], result[row]
        for c in range(columns):
            target[c] = kernel[0] * source[c]
        for k in range(1, kernel.shape[0]):
            weight = kernel[k]
            before, behind = source[: columns - k], source[k:]
            right, left = target[k:], target[: columns - k]
            for c in range(columns - k):
                right[c] += weight * before[c]
            for c in range(columns - k):
                left[c] += weight * behind[c]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def convolve_columns(field: NDArray[np.float32], kernel: NDArray[np.float32], result: NDArray[np.float32]) -> None:
    """Convolve each column; (rows + 2 radius, columns) -> (rows, columns)."""
    rim = kernel.shape[0] - 1
    for row in range(result.shape[0]):
        target, centre = result[row], field[row + rim]
        for c in range(target.shape[0]):
            target[c] = kernel[0] * centre[c]
        for k in range(1, rim + 1):
            weight = kernel[k]
            above, below = field[row + rim - k], field[row + rim + k]
            for c in range(target.shape[0]):
                target[c] += weight * (above[c] + below[c])


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _entering(
    light: NDArray[np.float32],
    coverage: NDArray[np.uint8],
    start: int,
    factors: NDArray[np.float32],
    inked: NDArray[np.float32],
) -> None:
    """sum_jl factors[j, l] a_l L_j, the light in the paper, on rows from `start` on; no ink beyond the raster."""
    inks, rows = coverage.shape[0], coverage.shape[1]
    for i in range(inked.shape[0]):
        row, target = start + i, inked[i]
        target[:] = 0.0
        for j in range(light.shape[0]):
            source = light[j, i]
            weight = factors[j, 0]
            for c in range(target.shape[0]):
                target[c] += weight * source[c]
            if row < 0 or row >= rows:
                continue
            for ink in range(inks):
                weight = factors[j, ink + 1] * _BYTE
                if weight == 0.0:
                    continue
                covered = coverage[ink, row]
                for c in range(target.shape[0]):
                    target[c] += weight * covered[c] * source[c]


@njit(cache=True, nogil=True, error_model="numpy", fastmath=True)
def _leaving(
    field: NDArray[np.float32],
    kernel: NDArray[np.float32],
    coverage: NDArray[np.uint8],
    ink: int,
    start: int,
    leaving: NDArray[np.float32],
) -> None:
    """Add a [s * field] for one ink (-1: the paper, a = 1); `field` was convolved along its rows."""
    rim, rows = kernel.shape[0] - 1, coverage.shape[1]
    scattered = np.empty(leaving.shape[1], np.float32)
    for i in range(leaving.shape[0]):
        row, target = start + i, leaving[i]
        if ink >= 0 and (row < 0 or row >= rows):
            continue
        centre = field[i + rim]
        for c in range(scattered.shape[0]):
            scattered[c] = kernel[0] * centre[c]
        for k in range(1, rim + 1):
            weight = kernel[k]
            above, below = field[i + rim - k], field[i + rim + k]
            for c in range(scattered.shape[0]):
                scattered[c] += weight * (above[c] + below[c])
        if ink < 0:
            for c in range(target.shape[0]):
                target[c] += scattered[c]
        else:
            covered = coverage[ink, row]
            for c in range(target.shape[0]):
                target[c] += scattered[c] * (covered[c] * _BYTE)
