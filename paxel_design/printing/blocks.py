"""The pattern as a few block images: how finely a cell is rasterised, where each block lies on the sheet.

A print shop's software renders images faithfully at any angle, while it lets vector rectangles grow by every
touched device pixel. So the torus of cells is cut into blocks of palette indices, each placed as often as it
is needed by a rotated matrix. This file knows cells, millimetres and sub-pixels; it knows no file format.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from paxel_design.printing.plates import is_paper
from paxel_runtime.errors import InputError
from paxel_runtime.model.pattern import Colorant, Pattern

__all__ = [
    "Block",
    "CellRaster",
    "block_indices",
    "blocks_of",
    "palette_of",
    "paper_index_of",
    "plan_cell_raster",
    "printed_shares",
]

# One sub-pixel a cell is as exact in Ghostscript, but viewers and some RIPs smooth enlarged images: 12 keep that blur
# within a twelfth of a dot. Cost grows with the square (Ghostscript: about 0.5 us for each sub-pixel it places).
_FEWEST_SUBPIXELS = 12
_SPREAD_TOLERANCE_UM = 1.0
_LARGEST_BLOCK_PX = 4096
_LARGEST_BLOCK_CELLS = 128
_BAND_CELLS = 128


@dataclass(frozen=True)
class CellRaster:
    """How one cell becomes sub-pixels.

    Attributes
    ----------
    subpixels : int
        Sub-pixels along the edge of a cell.
    shrink : int
        Sub-pixels taken off the ink at every edge between colorants, against ink spread.
    subpixel_um : float
        Edge of a sub-pixel.
    """

    subpixels: int
    shrink: int
    subpixel_um: float

    @property
    def ink_spread_um(self) -> float:
        """The compensation that is realised, within 1 um of the one asked for."""
        return self.shrink * self.subpixel_um


@dataclass(frozen=True)
class Block:
    """One image and where it lies: cells `row` .. `row + rows` of the plane, `image_key` names equal images.

    Attributes
    ----------
    row, column : int
        The lowest, leftmost cell of the block, counted from the centre of the pattern.
    rows, columns : int
        Cells along each edge.
    image_key : (int, int)
        The same cell on the torus: blocks with the same key are the same image.
    """

    row: int
    column: int
    rows: int
    columns: int
    image_key: tuple[int, int]


def plan_cell_raster(dot_size_mm: float, ink_spread_um: float) -> CellRaster:
    """Fewest sub-pixels a cell that give the wanted compensation to 1 um.

    Parameters
    ----------
    dot_size_mm : float
        Edge of a cell.
    ink_spread_um : float
        How far the edge of a printed dot grows outward; that much is taken off the ink at every edge.

    Raises
    ------
    InputError
        If `ink_spread_um` is negative, or so large that nothing would remain of a dot.
    """
    dot_um = 1000.0 * dot_size_mm
    if not 0.0 <= ink_spread_um < dot_um / 2.0:
        raise InputError(
            f"ink_spread_um must be at least 0 and below half a dot ({dot_um / 2.0:g} um), got {ink_spread_um:g}: "
            "make the dots larger or measure the spread again"
        )
    if ink_spread_um <= _SPREAD_TOLERANCE_UM:
        return CellRaster(_FEWEST_SUBPIXELS, 0, dot_um / _FEWEST_SUBPIXELS)
    counts = np.arange(_FEWEST_SUBPIXELS, max(_FEWEST_SUBPIXELS, int(dot_um / _SPREAD_TOLERANCE_UM)) + 1)
    shrinks = np.rint(ink_spread_um * counts / dot_um)
    error_um = np.abs(shrinks * dot_um / counts - ink_spread_um)
    fits = (error_um <= _SPREAD_TOLERANCE_UM) & (shrinks >= 1) & (2 * shrinks < counts)
    if not fits.any():
        raise InputError(
            f"ink_spread_um must leave at least {_SPREAD_TOLERANCE_UM:g} um of a dot of {dot_um:g} um, "
            f"got {ink_spread_um:g}: make the dots larger"
        )
    best = int(np.argmax(fits))
    return CellRaster(int(counts[best]), int(shrinks[best]), dot_um / float(counts[best]))


def palette_of(colorants: Sequence[Colorant], raster: CellRaster) -> tuple[Colorant | None, ...]:
    """What the indices of the block images mean: the colorants, then paper where shrinking needs it; paper is None."""
    palette = tuple(None if is_paper(colorant) else colorant for colorant in colorants)
    return palette if raster.shrink == 0 or None in palette else (*palette, None)


def paper_index_of(palette: Sequence[Colorant | None]) -> int:
    """The index that stands for bare paper, 0 where no index does (and none is needed)."""
    return next((i for i, colorant in enumerate(palette) if colorant is None), 0)


def blocks_of(pattern: Pattern, raster: CellRaster) -> Iterator[Block]:
    """Every block that touches the pattern area, from the lowest row up.

    The torus is repeated up to the largest block, or cut where it is larger than that.
    """
    row_range, column_range = _cell_bounds(pattern)
    largest = min(_LARGEST_BLOCK_CELLS, _LARGEST_BLOCK_PX // raster.subpixels)
    largest = max(1, min(largest, max(row_range[1], column_range[1])))  # a quarter of a small area, not far beyond it
    for row, rows, row_key in _spans(pattern.cells.shape[0], largest, row_range):
        for column, columns, column_key in _spans(pattern.cells.shape[1], largest, column_range):
            block = Block(row, column, rows, columns, (row_key, column_key))
            if _touches_area(pattern, block):
                yield block


def block_indices(pattern: Pattern, block: Block, raster: CellRaster, paper_index: int) -> NDArray[np.uint8]:
    """Palette indices of a block's sub-pixels.

    Parameters
    ----------
    pattern : Pattern
        Its cells are repeated over the plane.
    block : Block
        Which cells.
    raster : CellRaster
        Sub-pixels a cell, and how many of them the ink loses at every edge between colorants.
    paper_index : int
        What stands where ink was taken off; it is bare paper and loses nothing itself.

    Returns
    -------
    (rows * subpixels, columns * subpixels) uint8 array
        Row 0 is the lowest (+y up), as in `Pattern.cells`.
    """
    rows = np.arange(block.row - 1, block.row + block.rows + 1) % pattern.cells.shape[0]
    columns = np.arange(block.column - 1, block.column + block.columns + 1) % pattern.cells.shape[1]
    with_neighbours = pattern.cells[np.ix_(rows, columns)]
    cells, n = with_neighbours[1:-1, 1:-1], raster.subpixels
    indices = cells.repeat(n, axis=0).repeat(n, axis=1)
    if raster.shrink > 0:
        by_cell = indices.reshape(block.rows, n, block.columns, n)
        near = {-1: slice(0, raster.shrink), 0: slice(0, n), 1: slice(n - raster.shrink, n)}
        for up, right in product((-1, 0, 1), repeat=2):
            other = with_neighbours[1 + up : 1 + up + block.rows, 1 + right : 1 + right + block.columns]
            edge = by_cell[:, near[up], :, near[right]]
            np.copyto(edge, np.uint8(paper_index), where=(cells != other)[:, None, :, None])
    return indices


def printed_shares(pattern: Pattern, raster: CellRaster, palette: Sequence[Colorant | None]) -> NDArray[np.float64]:
    """Share of the torus that each index of the palette covers once the ink is shrunk, summing to 1.

    Returns
    -------
    (len(palette),) float64 array
        Exact: of a cell of n x n sub-pixels, a strip of `shrink` is lost at each edge to another colorant, and a
        square of `shrink` at each corner where only the diagonal neighbour is another.
    """
    cells, n, m = pattern.cells, raster.subpixels, raster.shrink
    areas = np.zeros(len(palette))
    for start in range(0, cells.shape[0], _BAND_CELLS):  # a sheet without period has a hundred million cells
        stop = min(start + _BAND_CELLS, cells.shape[0])
        rows = {up: cells[np.arange(start + up, stop + up) % cells.shape[0]] for up in (-1, 0, 1)}
        band = rows[0]
        differs = {
            (up, right): band != np.roll(rows[up], -right, axis=1) for up, right in product((-1, 0, 1), repeat=2)
        }
        height = n - m * (differs[-1, 0].astype(np.int64) + differs[1, 0])
        width = n - m * (differs[0, -1].astype(np.int64) + differs[0, 1])
        corners = sum(
            (differs[up, right] & ~differs[up, 0] & ~differs[0, right]).astype(np.int64)
            for up, right in product((-1, 1), repeat=2)
        )
        kept = height * width - m * m * corners
        areas += np.bincount(band.ravel(), weights=kept.ravel(), minlength=len(palette))
    shares = areas / (cells.size * n * n)
    shares[paper_index_of(palette)] += 1.0 - shares.sum()
    return shares


def _cell_bounds(pattern: Pattern) -> tuple[tuple[int, int], tuple[int, int]]:
    """Rows and columns of cells (first, one past the last) that may touch the pattern area."""
    half_width, half_height = pattern.size_mm[0] / 2.0, pattern.size_mm[1] / 2.0
    angle = np.deg2rad(pattern.angle_deg)
    c, s = abs(np.cos(angle)), abs(np.sin(angle))
    rows = int(np.ceil((s * half_width + c * half_height) / pattern.dot_size_mm))
    columns = int(np.ceil((c * half_width + s * half_height) / pattern.dot_size_mm))
    return (-rows, rows), (-columns, columns)


def _spans(period: int, largest: int, bounds: tuple[int, int]) -> Iterator[tuple[int, int, int]]:
    """Cut one axis of the plane into spans (first cell, cells, first cell on the torus) that cover `bounds`."""
    step = period * max(1, largest // period)
    pieces = -(-step // largest)
    cuts = [step * i // pieces for i in range(pieces + 1)]
    for repeat in range(bounds[0] // step, -(-bounds[1] // step)):
        for first, last in pairwise(cuts):
            if repeat * step + last > bounds[0] and repeat * step + first < bounds[1]:
                yield repeat * step + first, last - first, first


def _touches_area(pattern: Pattern, block: Block) -> bool:
    """Whether the bounding box of the block, in millimetres, meets the pattern area."""
    u = pattern.dot_size_mm * np.array([block.column, block.column + block.columns])
    v = pattern.dot_size_mm * np.array([block.row, block.row + block.rows])
    angle = np.deg2rad(pattern.angle_deg)
    x = np.cos(angle) * u[:, None] - np.sin(angle) * v
    y = np.sin(angle) * u[:, None] + np.cos(angle) * v
    half_width, half_height = pattern.size_mm[0] / 2.0, pattern.size_mm[1] / 2.0
    return bool(x.min() < half_width and x.max() > -half_width and y.min() < half_height and y.max() > -half_height)
