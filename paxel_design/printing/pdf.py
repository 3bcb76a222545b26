"""A pattern as a PDF in true millimetres that a print shop accepts.

The pattern is drawn as the block images of `blocks`, the furniture from
`sheet`; everything is DeviceCMYK, fonts are embedded, and equal arguments give equal bytes.
"""

from __future__ import annotations

import io
import os
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.colors import CMYKColor
from reportlab.pdfbase import pdfdoc
from reportlab.pdfgen.canvas import Canvas

from paxel_design.patterns import colorants_of
from paxel_design.printing.blocks import (
    PAPER_CMYK,
    CellRaster,
    block_indices,
    blocks_of,
    palette_of,
    plan_cell_raster,
)
from paxel_design.printing.font import font_name
from paxel_design.printing.sheet import BLEED_MM, SLUG_MM, Sheet, pattern_summary, sheet_of
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.version import WRITER

__all__ = ["PrintFigures", "write_pattern_pdf"]

_PT_PER_MM = 72.0 / 25.4
_BLACK = CMYKColor(0, 0, 0, 1)


@dataclass(frozen=True)
class PrintFigures:
    """What `write_pattern_pdf` made.

    Attributes
    ----------
    page_mm, trim_mm : (float, float)
        Width and height of the page with crop marks, and of the sheet after cutting.
    subpixels_per_cell : int
        Sub-pixels along the edge of a cell in the block images.
    ink_spread_um : float
        The compensation that is realised, within 1 um of the one asked for.
    bytes : int
        Length of the file.
    """

    page_mm: tuple[float, float]
    trim_mm: tuple[float, float]
    subpixels_per_cell: int
    ink_spread_um: float
    bytes: int


def write_pattern_pdf(
    pattern: Pattern,
    path: str | os.PathLike[str],
    *,
    dpi: float = 1440,
    ink_spread_um: float = 0.0,
    caption: str = "",
) -> PrintFigures:
    """Write the print sheet of a pattern as a PDF of one page, as large as the sheet.

    Parameters
    ----------
    pattern : Pattern
        Lies at the centre of the page, clipped to its area.
    path : path-like
        The file to write.
    dpi : float
        Resolution of the printer: stated on the sheet, and a dot must have 3 of its dots; the drawing itself has no
        resolution.
    ink_spread_um : float
        How far the edge of a printed dot grows outward: each dot is drawn smaller by that at every edge.
    caption : str
        The user's own line on the sheet.

    Returns
    -------
    PrintFigures
        Sizes, and what was realised.

    Raises
    ------
    InputError
        If dots are too small for `dpi` or for `ink_spread_um`, the page is larger than a PDF may be, the caption
        does not fit, or a colorant is unknown.
    """
    raster = plan_cell_raster(pattern.dot_size_mm, ink_spread_um)
    sheet = sheet_of(pattern, dpi=dpi, ink_spread_um=raster.ink_spread_um, caption=caption)
    content = _render(pattern, sheet, raster, title=caption or pattern_summary(pattern))
    Path(path).write_bytes(content)
    return PrintFigures(sheet.page_mm, sheet.trim_mm, raster.subpixels, raster.ink_spread_um, len(content))


def _render(pattern: Pattern, sheet: Sheet, raster: CellRaster, title: str) -> bytes:
    buffer = io.BytesIO()
    width_pt, height_pt = (_PT_PER_MM * side for side in sheet.page_mm)
    canvas = Canvas(buffer, pagesize=(width_pt, height_pt), invariant=1, pageCompression=1, initialFontName=font_name())
    canvas.setTitle(title)
    canvas.setAuthor("")
    canvas.setSubject(pattern_summary(pattern))
    canvas.setCreator(WRITER)
    canvas.setTrimBox(_inset_box(sheet, SLUG_MM))
    canvas.setBleedBox(_inset_box(sheet, SLUG_MM - BLEED_MM))
    canvas.translate(width_pt / 2, height_pt / 2)
    _draw_pattern(canvas, pattern, raster)
    _draw_furniture(canvas, sheet)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _inset_box(sheet: Sheet, inset_mm: float) -> tuple[float, float, float, float]:
    width_mm, height_mm = sheet.page_mm
    x0, y0, x1, y1 = (_PT_PER_MM * v for v in (inset_mm, inset_mm, width_mm - inset_mm, height_mm - inset_mm))
    return x0, y0, x1, y1


def _draw_pattern(canvas: Canvas, pattern: Pattern, raster: CellRaster) -> None:
    """Place every block by its rotated matrix, clipped to the pattern area; equal blocks share one image."""
    palette = palette_of(colorants_of(pattern.colorants), raster)
    paper_index = palette.index(PAPER_CMYK) if raster.shrink else 0
    canvas.saveState()
    width_pt, height_pt = (_PT_PER_MM * side for side in pattern.size_mm)
    clip = canvas.beginPath()
    clip.rect(-width_pt / 2, -height_pt / 2, width_pt, height_pt)
    canvas.clipPath(clip, stroke=0, fill=0)
    cell_pt = _PT_PER_MM * pattern.dot_size_mm
    angle = np.deg2rad(pattern.angle_deg)
    c, s = float(np.cos(angle)) * cell_pt, float(np.sin(angle)) * cell_pt
    known: set[str] = set()
    for block in blocks_of(pattern, raster):
        name = f"cells-{block.image_key[0]}-{block.image_key[1]}"
        if name not in known:
            known.add(name)
            _add_indexed_image(canvas, name, block_indices(pattern, block, raster, paper_index), palette)
        x, y = c * block.column - s * block.row, s * block.column + c * block.row
        matrix = (c * block.columns, s * block.columns, -s * block.rows, c * block.rows, x, y)
        canvas.saveState()
        # reportlab's own transform() keeps 6 digits, which moves the far corner of a wall-sized pattern
        canvas.addLiteral(" ".join(f"{value:.7f}" for value in matrix) + " cm")
        canvas.doForm(name)
        canvas.restoreState()
    canvas.restoreState()


def _add_indexed_image(
    canvas: Canvas, name: str, indices: NDArray[np.uint8], palette: tuple[tuple[float, float, float, float], ...]
) -> None:
    """Define an image XObject with a CMYK palette, which reportlab has no public call for.

    `indices` has row 0 lowest; a PDF image has its first row on top.
    """
    bits = next(bits for bits in (1, 2, 4, 8) if len(palette) <= 2**bits)
    table = np.rint(255.0 * np.array(palette)).astype(np.uint8).tobytes().hex()
    dictionary = pdfdoc.PDFDictionary(
        {
            "Type": pdfdoc.PDFName("XObject"),
            "Subtype": pdfdoc.PDFName("Image"),
            "Width": indices.shape[1],
            "Height": indices.shape[0],
            "BitsPerComponent": bits,
            "ColorSpace": f"[/Indexed /DeviceCMYK {len(palette) - 1} <{table}>]",
            "Interpolate": pdfdoc.PDFfalse,
            "Filter": pdfdoc.PDFName("FlateDecode"),
        }
    )
    image = pdfdoc.PDFStream(dictionary, zlib.compress(_pack(indices[::-1], bits), 9) + b"\n")
    document = canvas._doc
    document.Reference(image, document.getXObjectName(name))
    document.addForm(name, image)


def _pack(indices: NDArray[np.uint8], bits: int) -> bytes:
    """Rows of indices with `bits` bits each, every row from a byte boundary, high bits first."""
    per_byte = 8 // bits
    padded = np.pad(indices, ((0, 0), (0, -indices.shape[1] % per_byte)))
    packed = np.zeros((padded.shape[0], padded.shape[1] // per_byte), np.uint8)
    for i in range(per_byte):
        packed |= padded[:, i::per_byte] << np.uint8(8 - bits * (i + 1))
    return packed.tobytes()


def _draw_furniture(canvas: Canvas, sheet: Sheet) -> None:
    canvas.setStrokeColor(_BLACK)
    for line in sheet.lines:
        canvas.setLineWidth(_PT_PER_MM * line.width_mm)
        canvas.line(*(_PT_PER_MM * v for v in (*line.start_mm, *line.end_mm)))
    canvas.setLineWidth(_PT_PER_MM * 0.1)
    for patch in sheet.patches:
        rectangle = (_PT_PER_MM * v for v in (*patch.lower_left_mm, *patch.size_mm))
        if patch.colorant is None:
            canvas.rect(*rectangle, stroke=1, fill=0)
        else:
            canvas.setFillColor(CMYKColor(*patch.colorant.cmyk))
            canvas.rect(*rectangle, stroke=0, fill=1)
    canvas.setFillColor(_BLACK)
    for text in sheet.texts:
        canvas.setFont(font_name(), _PT_PER_MM * text.height_mm)
        x, y = (_PT_PER_MM * v for v in text.at_mm)
        draw = {"left": canvas.drawString, "middle": canvas.drawCentredString, "right": canvas.drawRightString}
        draw[text.anchor](x, y, text.text)
