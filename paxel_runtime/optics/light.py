"""The virtual bench's projector: device codes -> linear intensities -> light on the fine raster, and the adjoint.

Two halves. What the electronics and the panel do to intensities (in the order of the design, section 6: cross-talk,
black level, dimming, fringing); and the footprint with which each projector pixel lights the wall: a box (fill factor)
blurred by a Gaussian that widens towards the corner, with the lens's fall-off. Light is 1 for a uniform frame at full
in the middle; fall-off is that of the irradiance on the wall. This file knows no ink and no camera.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.special import ndtr

from paxel_runtime.numba_options import CALLED, KERNEL
from paxel_runtime.optics.geometry import BenchMaps
from paxel_runtime.optics.grid import FineGrid, in_bands

__all__ = ["Footprint", "drive", "footprint_adjoint", "fringe", "light_rows", "make_footprint", "spread_columns"]

_BINS = 32
_REACH_SIGMAS = 4.5
_TAIL_PX = 2
_RUN = 16


def drive(
    codes: NDArray[np.unsignedinteger],
    table: NDArray[np.float32],
    cross_talk: float,
    black: float,
    dimming: float,
) -> NDArray[np.float32]:
    """Linear intensities that the panel is driven to: response, cross-talk, black level, dimming.

    Parameters
    ----------
    codes : (H, W, N) unsigned integer array
        Device codes.
    table : (N, codes) float32 array
        Linear intensity of every code.
    cross_talk : float
        x_j <- x_j (1 - cross_talk / 2 * sum of the other channels).
    black : float
        x <- black + (1 - black) x.
    dimming : float
        x <- x (1 - dimming * mean of x over frame and channels).

    Returns
    -------
    (N, H, W) float32 array
    """
    codes = np.ascontiguousarray(codes, np.uint16)  # one kernel for all depths
    x = np.empty((codes.shape[2], *codes.shape[:2]), np.float32)
    sums = np.zeros(len(codes))

    def work(start: int, stop: int) -> None:
        _drive_rows(codes, start, stop, table, float(cross_talk), float(black), x, sums)

    in_bands(work, len(codes), 128)
    if dimming:
        x *= np.float32(1.0 - dimming * sums.sum() / x.size)
    return x


@njit(**KERNEL)
def _drive_rows(
    codes: NDArray[np.unsignedinteger],
    start: int,
    stop: int,
    table: NDArray[np.float32],
    cross_talk: float,
    black: float,
    x: NDArray[np.float32],
    sums: NDArray[np.float64],
) -> None:
    channels = x.shape[0]
    for row in range(start, stop):
        row_sum = 0.0
        for column in range(codes.shape[1]):
            total = 0.0
            for j in range(channels):
                total += table[j, codes[row, column, j]]
            for j in range(channels):
                value = float(table[j, codes[row, column, j]])
                value *= 1.0 - 0.5 * cross_talk * (total - value)
                value = black + (1.0 - black) * value
                row_sum += value
                x[j, row, column] = value
        sums[row] = row_sum


def fringe(x: NDArray[np.float32], fraction: float, exponent: float) -> NDArray[np.float32]:
    """Light lost where neighbouring pixels differ.

    x <- x - fraction * mean over the 4 neighbours of max(0, x - x_neighbour)**exponent; the frame's rim has equal
    neighbours outside. (N, H, W) float32 -> the same.
    """
    if fraction == 0:
        return x
    lit = np.empty_like(x)

    def work(start: int, stop: int) -> None:
        _fringe_rows(x, start, stop, float(fraction), float(exponent), lit)

    in_bands(work, x.shape[1], 64)
    return lit


@njit(**KERNEL)
def _fringe_rows(
    x: NDArray[np.float32], start: int, stop: int, fraction: float, exponent: float, lit: NDArray[np.float32]
) -> None:
    height, width = x.shape[1], x.shape[2]
    for j in range(x.shape[0]):
        for row in range(start, stop):
            above, below = max(row - 1, 0), min(row + 1, height - 1)
            for column in range(width):
                value = x[j, row, column]
                loss = 0.0
                for neighbour in (
                    x[j, above, column],
                    x[j, below, column],
                    x[j, row, max(column - 1, 0)],
                    x[j, row, min(column + 1, width - 1)],
                ):
                    if value > neighbour:
                        loss += (value - neighbour) ** exponent
                lit[j, row, column] = value - 0.25 * fraction * loss


class Footprint(NamedTuple):
    """How the pixels of one channel light the fine raster: separable weights that depend on the place.

    A sample of pixel i is lit by the pixels i - reach .. i + reach.

    Attributes
    ----------
    weights_x : (bins, taps, columns) float32 array
        Weight of each of the 2 reach + 1 pixels on a sample, for each bin of blur.
    weights_y : (bins, rows, taps) float32 array
    radius2_x, radius2_y : (columns | rows,) float32 arrays
        Squared distance from the optical axis along each axis; their sum is 1 at the corner of the raster.
    pixel_radius2_y : (H + 2 pad,) float32 array
        The same at the rows of projector pixels, dark ones included.
    fall_off : float
        Loss of light at the corner.
    subsamples : int
    pad : int
        Dark pixels needed on each side of a frame: the raster's rim and the reach.
    """

    weights_x: NDArray[np.float32]
    weights_y: NDArray[np.float32]
    radius2_x: NDArray[np.float32]
    radius2_y: NDArray[np.float32]
    pixel_radius2_y: NDArray[np.float32]
    fall_off: float
    subsamples: int
    pad: int


def make_footprint(
    grid: FineGrid,
    maps: BenchMaps,
    channel: int,
    fill_factor: float,
    blur_centre_px: float,
    blur_corner_px: float,
    fall_off: float,
) -> Footprint:
    """Footprint of a channel.

    The blur's sigma grows with the square of the distance from the optical axis, from centre to corner, in 32 steps;
    so does the loss of light, smoothly. A uniform frame lights the middle with 1 (with a ripple of period 1 pixel where
    the fill factor is below 1).

    Parameters
    ----------
    grid : FineGrid
    maps : BenchMaps
        For the channel's magnification (lateral chromatic aberration) and the optical axis.
    channel : int
    fill_factor : float
        Lit share of a pixel's area.
    blur_centre_px, blur_corner_px : float
        Sigma, projector pixels.
    fall_off : float
        Share of the light lost at the corner.
    """
    sigmas = np.linspace(blur_centre_px, blur_corner_px, _BINS if blur_corner_px != blur_centre_px else 1)
    side = np.sqrt(fill_factor)
    samples = [np.arange(size) for size in grid.shape[::-1]]
    positions = [grid.to_raster(index) for index in samples]
    of_channel = [c + (p - c) / maps.magnification[channel] for c, p in zip(maps.raster_centre, positions, strict=True)]
    shift = max(float(np.abs(own - p).max()) for own, p in zip(of_channel, positions, strict=True))
    reach = int(np.ceil(0.5 + side / 2 + _REACH_SIGMAS * sigmas.max() + shift))
    profiles = [
        _profile(own - (index // grid.subsamples - grid.margin_px), sigmas, reach, side)
        for own, index in zip(of_channel, samples, strict=True)
    ]
    pad = grid.margin_px + reach
    rows = np.arange(-pad, grid.height + pad)
    radius2_x, radius2_y, pixel_radius2_y = (
        (((p - c) / maps.radius_px) ** 2).astype(np.float32)
        for p, c in zip((*positions, rows), maps.raster_centre[[0, 1, 1]], strict=True)
    )
    return Footprint(
        weights_x=np.ascontiguousarray(np.swapaxes(profiles[0], 1, 2)),
        weights_y=profiles[1],
        radius2_x=radius2_x,
        radius2_y=radius2_y,
        pixel_radius2_y=pixel_radius2_y,
        fall_off=fall_off,
        subsamples=grid.subsamples,
        pad=pad,
    )


def _profile(offset: NDArray[np.float64], sigmas: NDArray[np.float64], reach: int, side: float) -> NDArray[np.float32]:
    """Blurred boxes of width `side` at -reach..reach, seen at samples `offset` from pixel 0: (bins, samples, taps).

    What the boxes beyond the reach would give goes to those within it, in proportion: a uniform frame lights a sample,
    and a pixel lights the raster, as much as if nothing were cut off.
    """
    wide = reach + _TAIL_PX
    distance = offset[:, None] - np.arange(-wide, wide + 1)
    near = slice(_TAIL_PX, -_TAIL_PX)
    weights = np.empty((len(sigmas), len(offset), 2 * reach + 1), np.float32)

    def work(start: int, stop: int) -> None:
        for of_bin, sigma in zip(weights[start:stop], sigmas[start:stop], strict=True):
            lit = (ndtr((distance + side / 2) / sigma) - ndtr((distance - side / 2) / sigma)) / side
            of_bin[:] = lit[:, near] * (lit.sum(axis=1) / lit[:, near].sum(axis=1))[:, None]

    in_bands(work, len(sigmas), 4)
    return weights


def spread_columns(x: NDArray[np.float32], footprint: Footprint) -> NDArray[np.float32]:
    """Light along x: (H, W) intensities -> (H + 2 pad, columns) float32, dark rows above and below.

    Intensities may have a rim of up to `Footprint.pad` pixels all around, which light falls on beside the frame.
    """
    padded_rows = len(footprint.pixel_radius2_y)
    dark = (padded_rows - len(x)) // 2
    spread = np.zeros((padded_rows, len(footprint.radius2_x)), np.float32)

    def work(start: int, stop: int) -> None:
        samples = np.repeat(np.pad(x[start:stop], ((0, 0), (dark, dark))), footprint.subsamples, axis=1)
        _spread_rows(samples, footprint, dark + start, spread[dark + start : dark + stop])

    in_bands(work, len(x), 64)
    return spread


@njit(**CALLED)
def _same_blur(radius2: float, radius2_x: NDArray[np.float32], first: int, bins: int) -> tuple[int, int]:
    """Bin of blur at sample `first` of a row, and where (a multiple of 16 samples further on) it ends."""
    bin_ = _blur_bin(radius2 + radius2_x[first], bins)
    last = first + _RUN
    while last < radius2_x.shape[0] and _blur_bin(radius2 + radius2_x[last], bins) == bin_:
        last += _RUN
    return bin_, min(last, radius2_x.shape[0])


@njit(**CALLED)
def _blur_bin(radius2: float, bins: int) -> int:
    return min(int(radius2 * (bins - 1) + 0.5), bins - 1)


@njit(**KERNEL, fastmath=True)
def _spread_rows(samples: NDArray[np.float32], f: Footprint, start: int, spread: NDArray[np.float32]) -> None:
    """`samples` holds every padded pixel `subsamples` times, so that neighbours lie that many samples apart."""
    bins, taps, columns = f.weights_x.shape
    for row in range(spread.shape[0]):
        first = 0
        while first < columns:
            bin_, last = _same_blur(f.pixel_radius2_y[start + row], f.radius2_x, first, bins)
            part = spread[row, first:last]
            for t in range(taps):
                weights = f.weights_x[bin_, t, first:last]
                source = samples[row, first + t * f.subsamples : last + t * f.subsamples]
                for k in range(part.shape[0]):
                    part[k] += weights[k] * source[k]
            first = last


@njit(**KERNEL, fastmath=True)
def light_rows(spread: NDArray[np.float32], f: Footprint, start: int, light: NDArray[np.float32]) -> None:
    """Fill rows of light from `start` on, from what `spread_columns` gave; rows beyond the raster are dark."""
    bins, rows, taps = f.weights_y.shape
    columns = light.shape[1]
    for i in range(light.shape[0]):
        row = start + i
        line = light[i]
        line[:] = 0.0
        if row < 0 or row >= rows:
            continue
        first = 0
        while first < columns:
            bin_, last = _same_blur(f.radius2_y[row], f.radius2_x, first, bins)
            part = line[first:last]
            for t in range(taps):
                weight = f.weights_y[bin_, row, t]
                source = spread[row // f.subsamples + t, first:last]
                for k in range(part.shape[0]):
                    part[k] += weight * source[k]
            first = last
        if f.fall_off:
            loss, centre_light = np.float32(f.fall_off), np.float32(1.0 - f.fall_off * f.radius2_y[row])
            for c in range(columns):
                line[c] *= centre_light - loss * f.radius2_x[c]


def footprint_adjoint(
    weights: NDArray[np.floating], first_row: int, first_column: int, footprint: Footprint, resolution: tuple[int, int]
) -> NDArray[np.float64]:
    """Adjoint of spreading light: (H, W) weights of intensities from weights of light in a window of the fine raster.

    For every frame x: ``sum(weights * light in the window) == sum(result * x)``.
    """
    width, height = resolution
    pad = footprint.pad
    padded = np.zeros((height + 2 * pad, width + 2 * pad))
    _adjoint(np.asarray(weights, np.float64), first_row, first_column, footprint, padded)
    return padded[pad : pad + height, pad : pad + width].copy()


@njit(**KERNEL)
def _adjoint(
    weights: NDArray[np.float64], first_row: int, first_column: int, f: Footprint, padded: NDArray[np.float64]
) -> None:
    bins, taps, _ = f.weights_x.shape
    columns = weights.shape[1]
    spread = np.zeros((padded.shape[0], columns))
    for i in range(weights.shape[0]):
        row = first_row + i
        for c in range(columns):
            column = first_column + c
            weight = weights[i, c] * (1.0 - f.fall_off * (f.radius2_y[row] + f.radius2_x[column]))
            bin_ = _blur_bin(f.radius2_y[row] + f.radius2_x[column // _RUN * _RUN], bins)
            for t in range(taps):
                spread[row // f.subsamples + t, c] += f.weights_y[bin_, row, t] * weight
    for row in range(f.pad, padded.shape[0] - f.pad):
        for c in range(columns):
            column = first_column + c
            bin_ = _blur_bin(f.pixel_radius2_y[row] + f.radius2_x[column // _RUN * _RUN], bins)
            for t in range(taps):
                padded[row, column // f.subsamples + t] += f.weights_x[bin_, t, column] * spread[row, c]
