"""Light on a printed or blank sheet: ink, scattering in the paper, ink again; what a sensor or a meter receives.

``sum_jkl G[j, k, l] a_k [s * (a_l L_j)]`` (see `optics`), in bands of rows of the fine raster, and the weights that
its mean over an aperture gives each projector pixel (the adjoint, exact). Kernels are plain convolutions and products
on rows; everything outside a field is dark.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.numba_options import KERNEL
from paxel_runtime.optics.grid import in_bands
from paxel_runtime.optics.light import Footprint, light_rows, spread_columns

__all__ = ["convolve", "convolve_columns", "convolve_rows", "radiance", "scattered_apertures"]

_BAND = 128
_DIM = 0.01
_NEGLIGIBLE = 1e-5
_BYTE = np.float32(1 / 255)


def radiance(
    x: NDArray[np.float32],
    footprints: list[Footprint],
    coverage: NDArray[np.uint8],
    factors: NDArray[np.float32],
    scattering: NDArray[np.float32],
    blur: NDArray[np.float32],
    ambient: NDArray[np.float32] | None = None,
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
    ambient : (planes, 1 + L, 1 + L) float32 array, optional
        Factors of a uniform light of 1 that falls on the whole wall besides.

    Returns
    -------
    (planes, rows, columns) float32 array
    """
    rows, columns = coverage.shape[1:]
    sources = _light_sources(x, footprints, factors)
    spread = [spread_columns(plane, footprint) for plane, footprint, _ in sources]
    peaks = np.array([plane.max() for plane, _, _ in sources])
    of_sources = np.stack([of_source for _, _, of_source in sources], axis=1)
    if ambient is not None:
        peaks = np.append(peaks, np.float32(1.0))
        of_sources = np.concatenate((of_sources, ambient[:, None]), axis=1)
    plans = [_passages(of_plane, peaks, len(scattering) > 1) for of_plane in of_sources]
    seen = np.empty((len(factors), rows, columns), np.float32)

    def work(start: int, stop: int) -> None:
        rim = len(blur) - 1
        wide = rim + len(scattering) - 1
        light = np.empty((len(peaks), stop - start + 2 * wide, columns), np.float32)
        light[len(sources) :] = 1.0
        for (_, footprint, _), source, field in zip(sources, spread, light[: len(sources)], strict=True):
            light_rows(source, footprint, start - wide, field)
        inked, field = np.empty_like(light[0]), np.empty_like(light[0])
        leaving = np.empty((stop - start + 2 * rim, columns), np.float32)
        for plane, passages in enumerate(plans):
            leaving[:] = 0.0
            for out, into in passages:
                _entering(light, coverage, start - wide, into, inked)
                convolve_rows(inked, scattering, field)
                _leaving(field, scattering, coverage, out, start - rim, leaving)
            convolve_rows(leaving, blur, field[: len(leaving)])
            convolve_columns(field[: len(leaving)], blur, seen[plane, start:stop])

    in_bands(work, rows, _BAND)
    if ambient is not None:
        seen /= _kept(columns, scattering, blur)
    return seen


def _kept(columns: int, *kernels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Share of a uniform light that convolutions along rows leave, (columns,): less than 1 near both ends only."""
    share = np.ones((1, columns), np.float32)
    for kernel in kernels:
        within = np.empty_like(share)
        convolve_rows(share, kernel, within)
        share = within
    rim = sum(len(kernel) - 1 for kernel in kernels)
    share[0, rim : columns - rim] = 1.0
    return share[0]


def _light_sources(
    x: NDArray[np.float32], footprints: list[Footprint], factors: NDArray[np.float32]
) -> list[tuple[NDArray[np.float32], Footprint, NDArray[np.float32]]]:
    """Intensities (H, W), footprint, and factors (planes, 1 + L, 1 + L) of each source of light.

    The channels' own, but dim uniform planes (unlit channels at black level) count as one source, with the footprint
    of the first: they differ by the ripple and the rim of what is next to nothing.
    """
    peaks = [float(plane.max()) for plane in x]
    dim = [j for j, plane in enumerate(x) if peaks[j] < _DIM * max(peaks) and plane.min() == plane.max()]
    sources = [(x[j], footprints[j], factors[:, j]) for j in range(len(x)) if j not in dim]
    if any(peaks[j] for j in dim):
        glow = np.tensordot(factors[:, dim], np.array(peaks, np.float32)[dim], axes=(1, 0))
        sources.append((np.ones_like(x[0]), footprints[dim[0]], glow))
    return sources


def _passages(
    factors: NDArray[np.float32], peaks: NDArray[np.float32], scatters: bool
) -> list[tuple[NDArray[np.float32], NDArray[np.float32]]]:
    """Rewrite sum_jkl G[j, k, l] a_k [s * (a_l L_j)] with as few convolutions as the spectra ask for.

    Returns pairs (out (D,), into (N, D)), D = 1 + L, for the sum of (out . a) [s * sum_j (into[j] . a) L_j]. The
    directions `out` are the eigenvectors of sum_j peak_j G_j, without those that hold less than 1e-5 of the light of
    bare paper, in themselves or with another: one is left where a single primary is lit, within whose narrow band the
    inks are neutral. Without scattering, and where inks fluoresce (what enters one leaves through another), G is no
    product of passages and stands as it is.
    """
    weighted = factors.astype(np.float64) * peaks[:, None, None]
    directions = np.eye(weighted.shape[-1])
    if scatters and np.allclose(weighted, np.swapaxes(weighted, 1, 2)):
        directions = np.linalg.eigh(weighted.sum(axis=0))[1]
        held = np.abs(directions.T @ weighted @ directions).sum(axis=0).max(axis=1)
        directions = directions[:, held > _NEGLIGIBLE * weighted[:, 0, 0].sum()]
    into = np.einsum("ko,jkl,ln,mn->ojm", directions, factors, directions, directions)
    return [
        (out.astype(np.float32), np.ascontiguousarray(entering, np.float32))
        for out, entering in zip(directions.T.copy(), into, strict=True)
        if entering.any()
    ]


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


@njit(**KERNEL, fastmath=True)
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


@njit(**KERNEL, fastmath=True)
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


@njit(**KERNEL, fastmath=True)
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


@njit(**KERNEL, fastmath=True)
def _leaving(
    field: NDArray[np.float32],
    kernel: NDArray[np.float32],
    coverage: NDArray[np.uint8],
    factors: NDArray[np.float32],
    start: int,
    leaving: NDArray[np.float32],
) -> None:
    """Add (factors . a) [s * field] on rows from `start` on; `field` was convolved along its rows."""
    inks, rows = coverage.shape[0], coverage.shape[1]
    rim = kernel.shape[0] - 1
    scattered, through = np.empty(leaving.shape[1], np.float32), np.empty(leaving.shape[1], np.float32)
    for i in range(leaving.shape[0]):
        row, target, centre = start + i, leaving[i], field[i + rim]
        for c in range(scattered.shape[0]):
            scattered[c] = kernel[0] * centre[c]
        for k in range(1, rim + 1):
            weight = kernel[k]
            above, below = field[i + rim - k], field[i + rim + k]
            for c in range(scattered.shape[0]):
                scattered[c] += weight * (above[c] + below[c])
        through[:] = factors[0]
        if 0 <= row < rows:
            for ink in range(inks):
                weight = factors[ink + 1] * _BYTE
                if weight != 0.0:
                    covered = coverage[ink, row]
                    for c in range(through.shape[0]):
                        through[c] += weight * covered[c]
        for c in range(target.shape[0]):
            target[c] += through[c] * scattered[c]
