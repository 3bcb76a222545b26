"""The cells of a pattern as objects of a PDF: block images with a palette of inks, or outlines for comparison.

Print software paints an image's pixel where its centre falls, at any angle, so the ink keeps its area; an outline
grows by every device pixel it touches (0.547 instead of 0.500 at 1440 dpi), so outlines are an option only. Both are
unit squares, placed by the same matrices. A block reaches one sub-pixel into the next ones, right and above, with what
they show there themselves: without it, rounding leaves a pixel of paper here and there on a seam (1 in 250,000).
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pikepdf
from numpy.typing import NDArray
from pikepdf import Array, Dictionary, Name

from paxel_design.printing.blocks import Block, CellRaster, block_indices, blocks_of, palette_of, paper_index_of
from paxel_design.printing.colour_spaces import indexed_space, plate_space, separation_spaces
from paxel_design.printing.plates import Plates
from paxel_runtime.model.pattern import Colorant, Pattern

__all__ = ["PT_PER_MM", "add_cells", "cell_operators", "ink_operator"]

PT_PER_MM = 72.0 / 25.4

_PLATES = "Plates"
_ZLIB_LEVEL = 6  # rows repeat within the window: level 9 takes eight times as long for as many bytes


@dataclass(frozen=True)
class _Painter:
    """What every block of a sheet has in common."""

    pdf: pikepdf.Pdf
    pattern: Pattern
    raster: CellRaster
    palette: tuple[Colorant | None, ...]
    plates: Plates
    space: pikepdf.Object


def cell_operators(pattern: Pattern, raster: CellRaster) -> Iterator[str]:
    """Drawing operators that place every block about the origin, clipped to the area of the pattern."""
    width_pt, height_pt = (PT_PER_MM * side for side in pattern.size_mm)
    yield f"q {-width_pt / 2:.6f} {-height_pt / 2:.6f} {width_pt:.6f} {height_pt:.6f} re W n"
    cell_pt = PT_PER_MM * pattern.dot_size_mm
    angle = np.deg2rad(pattern.angle_deg)
    c, s = float(np.cos(angle)) * cell_pt, float(np.sin(angle)) * cell_pt
    for block in blocks_of(pattern, raster):
        x, y = c * block.column - s * block.row, s * block.column + c * block.row
        rows, columns = _extent(block, raster)
        matrix = (c * columns, s * columns, -s * rows, c * rows, x, y)
        yield f"q {' '.join(f'{value:.7f}' for value in matrix)} cm /{_block_name(block)} Do Q"
    yield "Q"


def ink_operator(colorant: Colorant | None, plates: Plates, *, separate: bool) -> str:
    """Operators that choose a solid colorant (None: paper) for filling.

    With `separate`, a spot ink by its own plate's colour space; otherwise as amounts on all plates.
    """
    if separate and colorant is not None and colorant.spot:
        return f"/{_spot_name(plates, colorant.spot)} cs 1 scn"
    if plates.spots and not separate:
        return f"/{_PLATES} cs {' '.join(f'{v:g}' for v in plates.amounts(colorant))} scn"
    return f"{' '.join(f'{v:g}' for v in (colorant.cmyk if colorant else (0, 0, 0, 0)))} k"


def add_cells(
    pdf: pikepdf.Pdf,
    page: pikepdf.Page,
    pattern: Pattern,
    raster: CellRaster,
    plates: Plates,
    *,
    vector: bool,
) -> None:
    """Give a page the blocks and colour spaces that `cell_operators` and `ink_operator` name."""
    separations = separation_spaces(pdf, plates)
    space = plate_space(pdf, plates, separations)
    painter = _Painter(pdf, pattern, raster, palette_of(pattern.palette, raster), plates, space)
    blocks = {_block_name(block): block for block in blocks_of(pattern, raster)}
    make = _outlines if vector else _image
    for name, block in blocks.items():
        page.add_resource(make(painter, block), Name.XObject, Name(f"/{name}"))
    for name, separation in separations.items():
        page.add_resource(separation, Name.ColorSpace, Name(f"/{_spot_name(plates, name)}"))


def _block_name(block: Block) -> str:
    return f"Cells-{block.image_key[0]}-{block.image_key[1]}"


def _spot_name(plates: Plates, spot: str) -> str:
    return f"Spot-{plates.names.index(spot)}"


def _extent(block: Block, raster: CellRaster) -> tuple[float, float]:
    """Rows and columns of cells that a block draws: its own and the sub-pixel that it has in common with the next."""
    return block.rows + 1 / raster.subpixels, block.columns + 1 / raster.subpixels


def _image(painter: _Painter, block: Block) -> pikepdf.Stream:
    """The sub-pixels of a block as an image; a PDF image has its first row on top."""
    palette, raster = painter.palette, painter.raster
    bits = next(bits for bits in (1, 2, 4, 8) if len(palette) <= 2**bits)
    with_next = replace(block, rows=block.rows + 1, columns=block.columns + 1)
    indices = block_indices(painter.pattern, with_next, raster, paper_index_of(palette))
    indices = indices[block.rows * raster.subpixels :: -1, : block.columns * raster.subpixels + 1]
    data = _pack(indices, bits)
    return pikepdf.Stream(
        painter.pdf,
        zlib.compress(data.tobytes(), _ZLIB_LEVEL),
        Type=Name.XObject,
        Subtype=Name.Image,
        Width=indices.shape[1],
        Height=indices.shape[0],
        BitsPerComponent=bits,
        ColorSpace=indexed_space(painter.space, [painter.plates.amounts(colorant) for colorant in palette]),
        Interpolate=False,
        Filter=Name.FlateDecode,
    )


def _pack(indices: NDArray[np.uint8], bits: int) -> NDArray[np.uint8]:
    """Rows of indices with `bits` bits each, every row from a byte boundary, high bits first."""
    if bits == 1:
        return np.packbits(indices, axis=1)
    per_byte = 8 // bits
    padded = np.pad(indices, ((0, 0), (0, -indices.shape[1] % per_byte)))
    packed = np.zeros((padded.shape[0], padded.shape[1] // per_byte), np.uint8)
    for i in range(per_byte):
        packed |= padded[:, i::per_byte] << np.uint8(8 - bits * (i + 1))
    return packed


def _outlines(painter: _Painter, block: Block) -> pikepdf.Stream:
    """A block as rectangles of ink in units of cells, one path a colorant; paper is left out."""
    raster, palette = painter.raster, painter.palette
    fine = replace(raster, subpixels=3, shrink=1) if raster.shrink else replace(raster, subpixels=1)
    indices = block_indices(painter.pattern, block, fine, paper_index_of(palette))
    edge = raster.shrink / raster.subpixels
    steps = np.array([edge, 1.0 - 2.0 * edge, edge] if raster.shrink else [1.0])
    x = np.concatenate(([0.0], np.cumsum(np.tile(steps, block.columns))))
    y = np.concatenate(([0.0], np.cumsum(np.tile(steps, block.rows))))
    operators = []
    for index, colorant in enumerate(palette):
        if colorant is None:
            continue
        operators.append(ink_operator(colorant, painter.plates, separate=False))
        for row, first, last in zip(*_runs(indices == index), strict=True):
            operators.append(f"{x[first]:.6g} {y[row]:.6g} {x[last] - x[first]:.6g} {y[row + 1] - y[row]:.6g} re")
        operators.append("f")
    rows, columns = _extent(block, raster)
    spaces = Dictionary({f"/{_PLATES}": painter.space}) if painter.plates.spots else Dictionary()
    return pikepdf.Stream(
        painter.pdf,
        zlib.compress("\n".join(operators).encode("ascii"), _ZLIB_LEVEL),
        Type=Name.XObject,
        Subtype=Name.Form,
        BBox=Array([0, 0, block.columns, block.rows]),
        Matrix=Array([1 / columns, 0, 0, 1 / rows, 0, 0]),
        Resources=Dictionary(ColorSpace=spaces),
        Filter=Name.FlateDecode,
    )


def _runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Row, first column and one past the last column of every run of True along the rows."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    steps = np.diff(padded, axis=1)
    rows, first = np.nonzero(steps == 1)
    return rows, first, np.nonzero(steps == -1)[1]
