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
from paxel_runtime.numba_options import CALLED, KERNEL
from paxel_runtime.optics.geometry import BenchMaps, raster_to_wall
from paxel_runtime.optics.grid import FineGrid, correlated_noise, in_bands

__all__ = ["InkLayers", "ink_coverage", "make_layers"]

_RAGGED_TILE = 1024
_RAGGED_STEPS_PER_CORRELATION = 4


class InkLayers(NamedTuple):
    """A print as plain arrays; lengths in mm of the nominal pattern.

    Attributes
    ----------
    differs : (L, rows, columns) uint16 array
        For each layer and cell: bit 8, the cell has no ink; bits 0 to 7, the neighbour in direction 0 (right), 1
        (upper right), ... 7 (lower right) differs from the cell in that.
    dot_mm, angle_rad : float
    half_size_mm : (2,) float64 array
        Half of the pattern area.
    scale : (2,) float64 array
        Size of the print in x and y, 1 = nominal.
    offsets_mm : (L, 2) float64 array
        Misregistration of each layer; the layer that decides on overlaps comes first.
    spread_mm : float
        Growth of every edge.
    ragged_mm : (m, m) float32 array
        Periodic noise of the edges; empty where they are smooth.
    ragged_step_mm : float
    """

    differs: NDArray[np.uint16]
    dot_mm: float
    angle_rad: float
    half_size_mm: NDArray[np.float64]
    scale: NDArray[np.float64]
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
        differs=np.stack([_differs(pattern.cells == ink) for ink in inks]),
        dot_mm=float(pattern.dot_size_mm),
        angle_rad=float(np.deg2rad(pattern.angle_deg)),
        half_size_mm=np.array(pattern.size_mm, np.float64) / 2,
        scale=1.0 + np.array(scale_error, np.float64),
        offsets_mm=offsets,
        spread_mm=spread_um / 1000,
        ragged_mm=ragged,
        ragged_step_mm=ragged_correlation_um / 1000 / _RAGGED_STEPS_PER_CORRELATION,
    )


def _differs(inked: NDArray[np.bool_]) -> NDArray[np.uint16]:
    """`InkLayers.differs` of one layer."""
    bits = np.uint16(256) * ~inked
    for bit, (right, up) in enumerate(((1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1))):
        bits = bits | (np.roll(inked, (-up, -right), (0, 1)) != inked) * np.uint16(1 << bit)
    return bits


def ink_coverage(layers: InkLayers, maps: BenchMaps, grid: FineGrid) -> NDArray[np.uint8]:
    """Share of each fine sample's area that each layer decides, (L, rows, columns), 0..255; the rest is bare paper."""
    coverage = np.empty((len(layers.differs), *grid.shape), np.uint8)
    sides_mm = _projected_sample(layers, maps, grid)
    reach_mm = layers.spread_mm + sum(sides_mm) / 2 + np.abs(layers.offsets_mm).max(initial=0.0)
    reach_mm += np.abs(layers.ragged_mm).max(initial=0.0)
    margin = grid.margin_px
    corners_x, corners_y = (np.arange(n + 2 * margin + 1) - margin - 0.5 for n in (grid.width, grid.height))

    def work(start: int, stop: int) -> None:
        corners = np.stack(np.meshgrid(corners_x, corners_y[start : stop + 1]), axis=-1)
        _cover_pixels(
            raster_to_wall(maps, corners), layers, start, grid.subsamples, sides_mm, float(reach_mm), coverage
        )

    in_bands(work, grid.height + 2 * margin, 16)
    return coverage


def _projected_sample(layers: InkLayers, maps: BenchMaps, grid: FineGrid) -> tuple[float, float]:
    """Widths in mm of the two sides of a fine sample, seen along an edge of a cell, at the middle of the projection."""
    step = 1.0 / grid.subsamples
    origin, right, down = raster_to_wall(maps, maps.raster_centre + np.array([[0.0, 0.0], [step, 0.0], [0.0, step]]))
    normal = np.array([np.cos(layers.angle_rad), np.sin(layers.angle_rad)])
    short, long = sorted((abs(float((right - origin) @ normal)), abs(float((down - origin) @ normal))))
    return long, max(short, 1e-9)


@njit(**CALLED)
def _signed_distance(bits: int, left: float, low: float) -> float:
    """Distance, in cells, from a point of a cell to the edge of the ink, negative inside; exact up to one cell.

    `bits` is the cell's `InkLayers.differs`; `left`, `low` is the point's place in the cell, 0..1.
    """
    right, high = 1.0 - left, 1.0 - low
    squared = 1.0
    if bits & 1:
        squared = min(squared, right * right)
    if bits & 4:
        squared = min(squared, high * high)
    if bits & 16:
        squared = min(squared, left * left)
    if bits & 64:
        squared = min(squared, low * low)
    if bits & 2:
        squared = min(squared, right * right + high * high)
    if bits & 8:
        squared = min(squared, left * left + high * high)
    if bits & 32:
        squared = min(squared, left * left + low * low)
    if bits & 128:
        squared = min(squared, right * right + low * low)
    return np.sqrt(squared) if bits & 256 else -np.sqrt(squared)


@njit(**CALLED)
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


@njit(**CALLED)
def _ragged_at(x: float, y: float, layers: InkLayers) -> float:
    """Noise of the edges at a point, mm; bilinear in the periodic tile."""
    if layers.ragged_mm.shape[0] == 0:
        return 0.0
    last = _RAGGED_TILE - 1  # the tile's size is a power of two
    gx, gy = x / layers.ragged_step_mm, y / layers.ragged_step_mm
    ix, iy = int(np.floor(gx)), int(np.floor(gy))
    fx, fy = gx - ix, gy - iy
    x0, x1, y0, y1 = ix & last, (ix + 1) & last, iy & last, (iy + 1) & last
    low = (1 - fx) * layers.ragged_mm[y0, x0] + fx * layers.ragged_mm[y0, x1]
    high = (1 - fx) * layers.ragged_mm[y1, x0] + fx * layers.ragged_mm[y1, x1]
    return (1 - fy) * low + fy * high


@njit(**KERNEL)
def _cover_pixels(
    corners_mm: NDArray[np.float64],
    layers: InkLayers,
    first_pixel: int,
    subsamples: int,
    sides_mm: tuple[float, float],
    reach_mm: float,
    coverage: NDArray[np.uint8],
) -> None:
    """Fill the samples of rows of pixels, whose corners lie at `corners_mm` (rows + 1, columns + 1, 2) on the wall.

    Within a pixel the wall is linear: true to 1e-5 mm for the maps of `geometry`. Farther than `reach_mm` from
    every edge of a cell nothing moves the ink.
    """
    long_mm, short_mm = sides_mm
    cell_rows, cell_columns = layers.differs.shape[1], layers.differs.shape[2]
    c, s = np.cos(layers.angle_rad) / layers.dot_mm, np.sin(layers.angle_rad) / layers.dot_mm
    for i_row in range((corners_mm.shape[0] - 1) * subsamples):
        row = first_pixel * subsamples + i_row
        v = i_row // subsamples
        fy = (i_row % subsamples + 0.5) / subsamples
        for column in range(coverage.shape[2]):
            u = column // subsamples
            fx = (column % subsamples + 0.5) / subsamples
            a, b = (1 - fx) * (1 - fy), fx * (1 - fy)
            d, e = (1 - fx) * fy, fx * fy
            x = a * corners_mm[v, u, 0] + b * corners_mm[v, u + 1, 0]
            x = (x + d * corners_mm[v + 1, u, 0] + e * corners_mm[v + 1, u + 1, 0]) / layers.scale[0]
            y = a * corners_mm[v, u, 1] + b * corners_mm[v, u + 1, 1]
            y = (y + d * corners_mm[v + 1, u, 1] + e * corners_mm[v + 1, u + 1, 1]) / layers.scale[1]
            to_rim = min(layers.half_size_mm[0] - abs(x), layers.half_size_mm[1] - abs(y))
            i, j = c * x + s * y, c * y - s * x
            left, low = i - np.floor(i), j - np.floor(j)
            to_edge = layers.dot_mm * min(min(left, 1.0 - left), min(low, 1.0 - low))
            if to_edge > reach_mm and abs(to_rim) > reach_mm:  # deep inside one cell, or far out on the paper
                cell_row, cell_column = int(np.floor(j)) % cell_rows, int(np.floor(i)) % cell_columns
                for k in range(coverage.shape[0]):
                    inked = to_rim > 0 and layers.differs[k, cell_row, cell_column] < 256
                    coverage[k, row, column] = 255 if inked else 0
                continue
            free = 255
            for k in range(coverage.shape[0]):
                px, py = x - layers.offsets_mm[k, 0], y - layers.offsets_mm[k, 1]
                i, j = c * px + s * py, c * py - s * px
                i_cell, j_cell = int(np.floor(i)), int(np.floor(j))
                bits = layers.differs[k, j_cell % cell_rows, i_cell % cell_columns]
                depth = -layers.dot_mm * _signed_distance(bits, i - i_cell, j - j_cell)
                depth = min(depth, min(layers.half_size_mm[0] - abs(px), layers.half_size_mm[1] - abs(py)))
                if abs(depth) < reach_mm:
                    depth += layers.spread_mm + _ragged_at(px + 3.7 * k, py - 5.3 * k, layers)
                share = min(int(255.0 * _share_inside(depth, long_mm, short_mm) + 0.5), free)
                coverage[k, row, column] = share
                free -= share
