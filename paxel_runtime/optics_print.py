"""Ink on paper: how much of every fine sample each ink of a printed pattern covers.

Every ink is a layer of its own: the pattern's cells of that colorant, moved by the press's misregistration, grown by
ink spread, its edges roughened. Coverage is the share of the sample's area, from the exact signed distance to the
layer's edge. Where layers overlap, the darker ink decides; where none is, there is bare paper. This file knows no
light.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from paxel_runtime.model.pattern import Pattern
from paxel_runtime.optics_geometry import BenchMaps, raster_to_wall, to_wall
from paxel_runtime.optics_grid import MARGIN_PX, FineGrid, correlated_noise, in_bands

__all__ = ["InkLayers", "ink_coverage", "make_layers"]

_RAGGED_TILE = 1024
_RAGGED_STEPS_PER_CORRELATION = 4


class InkLayers(NamedTuple):
    """A print as plain arrays; lengths in mm of the nominal pattern.

    Attributes
    ----------
    cells : (rows, columns) uint8 array
    dot_mm, angle_rad : float
    half_size_mm : (2,) float64 array
        Half of the pattern area.
    scale : (2,) float64 array
        Size of the print in x and y, 1 = nominal.
    labels : (L,) int64 array
        Colorant of each layer, the one that decides on overlaps first.
    offsets_mm : (L, 2) float64 array
        Misregistration of each layer.
    spread_mm : float
        Growth of every edge.
    ragged_mm : (m, m) float32 array
        Periodic noise of the edges; empty where they are smooth.
    ragged_step_mm : float
    """

    cells: NDArray[np.uint8]
    dot_mm: float
    angle_rad: float
    half_size_mm: NDArray[np.float64]
    scale: NDArray[np.float64]
    labels: NDArray[np.int64]
    offsets_mm: NDArray[np.float64]
    spread_mm: float
    ragged_mm: NDArray[np.float32]
    ragged_step_mm: float


def make_layers(
    pattern: Pattern,
    inks: list[int],
    scale_error: tuple[float, float],
    offset_um: float,
    spread_um: float,
    ragged_um: float,
    ragged_correlation_um: float,
    seed: int,
) -> InkLayers:
    """Print a pattern.

    Parameters
    ----------
    pattern : Pattern
    inks : list of int
        The colorants that are ink (not bare paper), the darkest first.
    scale_error : (float, float)
        Relative error of the print's width and height.
    offset_um : float
        Distance of every ink from the first, in a direction of its own.
    spread_um, ragged_um, ragged_correlation_um : float
        Growth of every edge; rms and correlation length (1/e) of its noise.
    seed : int
    """
    rng = np.random.default_rng((seed, 3))
    direction = rng.uniform(0, 2 * np.pi, len(inks))
    offsets = offset_um / 1000 * np.stack((np.cos(direction), np.sin(direction)), axis=-1)
    offsets[:1] = 0.0
    ragged = np.empty((0, 0), np.float32)
    if ragged_um > 0:
        tile = correlated_noise((_RAGGED_TILE, _RAGGED_TILE), _RAGGED_STEPS_PER_CORRELATION, rng)
        ragged = (tile * (ragged_um / 1000)).astype(np.float32)
    return InkLayers(
        cells=np.ascontiguousarray(pattern.cells),
        dot_mm=float(pattern.dot_size_mm),
        angle_rad=float(np.deg2rad(pattern.angle_deg)),
        half_size_mm=np.array(pattern.size_mm, np.float64) / 2,
        scale=1.0 + np.array(scale_error, np.float64),
        labels=np.array(inks, np.int64),
        offsets_mm=offsets,
        spread_mm=spread_um / 1000,
        ragged_mm=ragged,
        ragged_step_mm=ragged_correlation_um / 1000 / _RAGGED_STEPS_PER_CORRELATION,
    )


def ink_coverage(layers: InkLayers, maps: BenchMaps, grid: FineGrid) -> NDArray[np.uint8]:
    """Share of each fine sample's area that each layer decides, (L, rows, columns), 0..255; the rest is bare paper."""
    coverage = np.empty((len(layers.labels), *grid.shape), np.uint8)
    long_mm, short_mm = _projected_sample(layers, maps, grid)

    def work(start: int, stop: int) -> None:
        _cover_rows(start, layers, maps, grid, long_mm, short_mm, coverage[:, start:stop])

    in_bands(work, grid.shape[0], 64)
    return coverage


def _projected_sample(layers: InkLayers, maps: BenchMaps, grid: FineGrid) -> tuple[float, float]:
    """Widths in mm of the two sides of a fine sample, seen along an edge of a cell, at the middle of the projection."""
    step = 1.0 / grid.subsamples
    origin, right, down = raster_to_wall(maps, maps.raster_centre + np.array([[0.0, 0.0], [step, 0.0], [0.0, step]]))
    normal = np.array([np.cos(layers.angle_rad), np.sin(layers.angle_rad)])
    sides = sorted((abs(float((right - origin) @ normal)), abs(float((down - origin) @ normal))))
    return sides[1], max(sides[0], 1e-9)


@njit(cache=True, nogil=True, error_model="numpy")
def _signed_distance(cells: NDArray[np.uint8], s: float, t: float, label: int) -> float:
    """Distance, in cells, from a point to the edge of a colorant's area, negative inside; exact up to half a cell."""
    rows, columns = cells.shape
    i, j = int(np.floor(s)), int(np.floor(t))
    left, low = s - i, t - j
    right, high = 1.0 - left, 1.0 - low
    i0, j0 = i % columns, j % rows
    i_left, i_right = (i0 - 1) % columns, (i0 + 1) % columns
    j_low, j_high = (j0 - 1) % rows, (j0 + 1) % rows
    inside = cells[j0, i0] == label
    distance = 1.0
    if (cells[j0, i_left] == label) != inside:
        distance = min(distance, left)
    if (cells[j0, i_right] == label) != inside:
        distance = min(distance, right)
    if (cells[j_low, i0] == label) != inside:
        distance = min(distance, low)
    if (cells[j_high, i0] == label) != inside:
        distance = min(distance, high)
    if (cells[j_low, i_left] == label) != inside:
        distance = min(distance, np.sqrt(left * left + low * low))
    if (cells[j_low, i_right] == label) != inside:
        distance = min(distance, np.sqrt(right * right + low * low))
    if (cells[j_high, i_left] == label) != inside:
        distance = min(distance, np.sqrt(left * left + high * high))
    if (cells[j_high, i_right] == label) != inside:
        distance = min(distance, np.sqrt(right * right + high * high))
    return -distance if inside else distance


@njit(cache=True, nogil=True, error_model="numpy")
def _share_inside(depth: float, long: float, short: float) -> float:
    """Share of a rectangle's area behind a straight edge `depth` beyond its centre.

    The rectangle's sides, seen along the edge, are `long` >= `short`: the integral of a trapezium.
    """
    beyond = (long + short) / 2 - abs(depth)
    if beyond <= 0.0:
        return 1.0 if depth > 0.0 else 0.0
    if beyond >= short:
        return 0.5 + depth / long
    tail = beyond * beyond / (2.0 * long * short)
    return 1.0 - tail if depth > 0.0 else tail


@njit(cache=True, nogil=True, error_model="numpy")
def _ragged_at(x: float, y: float, layers: InkLayers) -> float:
    """Noise of the edges at a point, mm; bilinear in the periodic tile."""
    if layers.ragged_mm.shape[0] == 0:
        return 0.0
    size = layers.ragged_mm.shape[0]
    gx, gy = x / layers.ragged_step_mm, y / layers.ragged_step_mm
    ix, iy = int(np.floor(gx)), int(np.floor(gy))
    fx, fy = gx - ix, gy - iy
    x0, x1, y0, y1 = ix % size, (ix + 1) % size, iy % size, (iy + 1) % size
    low = (1 - fx) * layers.ragged_mm[y0, x0] + fx * layers.ragged_mm[y0, x1]
    high = (1 - fx) * layers.ragged_mm[y1, x0] + fx * layers.ragged_mm[y1, x1]
    return (1 - fy) * low + fy * high


@njit(cache=True, nogil=True, error_model="numpy")
def _cover_rows(
    first_row: int,
    layers: InkLayers,
    maps: BenchMaps,
    grid: FineGrid,
    long_mm: float,
    short_mm: float,
    coverage: NDArray[np.uint8],
) -> None:
    c, s = np.cos(layers.angle_rad) / layers.dot_mm, np.sin(layers.angle_rad) / layers.dot_mm
    step = 1.0 / grid.subsamples
    origin = 0.5 * step - 0.5 - MARGIN_PX
    for row in range(coverage.shape[1]):
        for column in range(coverage.shape[2]):
            x, y = to_wall(origin + column * step, origin + (first_row + row) * step, maps)
            x, y = x / layers.scale[0], y / layers.scale[1]
            free = 255
            for k in range(coverage.shape[0]):
                px, py = x - layers.offsets_mm[k, 0], y - layers.offsets_mm[k, 1]
                depth = -layers.dot_mm * _signed_distance(layers.cells, c * px + s * py, c * py - s * px, layers.labels[k])
                depth = min(depth, min(layers.half_size_mm[0] - abs(px), layers.half_size_mm[1] - abs(py)))
                if abs(depth) < 0.5 * layers.dot_mm:
                    depth += layers.spread_mm + _ragged_at(px + 3.7 * k, py - 5.3 * k, layers)
                share = int(255.0 * _share_inside(depth, long_mm, short_mm) + 0.5)
                coverage[k, row, column] = min(share, free)
                free -= coverage[k, row, column]
