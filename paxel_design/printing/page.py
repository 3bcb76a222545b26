"""The sheet on a page: pattern and furniture drawn with reportlab, in points, fonts embedded, inks as they are.

The cells are named here and become objects of the PDF afterwards (`cells_pdf`), which reportlab has no calls for.
"""

from __future__ import annotations

import io
from collections.abc import Iterable

from reportlab.lib.colors import CMYKColor
from reportlab.pdfgen.canvas import Canvas

from paxel_design.printing.blocks import CellRaster
from paxel_design.printing.cells_pdf import PT_PER_MM, cell_operators, ink_operator
from paxel_design.printing.font import font_name
from paxel_design.printing.furniture import Modules, Patch
from paxel_design.printing.sheet import BLEED_MM, SLUG_MM, Sheet
from paxel_runtime.model.pattern import Pattern

__all__ = ["draw_page", "draw_sheet"]

_BLACK = CMYKColor(0, 0, 0, 1)
_OUTLINE_MM = 0.1


def draw_page(pattern: Pattern, sheet: Sheet, raster: CellRaster) -> bytes:
    """A PDF of one page; its resources lack the blocks and colour spaces that `cells_pdf.add_cells` gives it."""
    return draw_sheet(sheet, cell_operators(pattern, raster))


def draw_sheet(sheet: Sheet, operators: Iterable[str]) -> bytes:
    """A PDF of one page: what drawing operators place about its middle, and the furniture."""
    buffer = io.BytesIO()
    width_pt, height_pt = (PT_PER_MM * side for side in sheet.page_mm)
    canvas = Canvas(buffer, pagesize=(width_pt, height_pt), invariant=1, pageCompression=1, initialFontName=font_name())
    canvas.setTrimBox(_inset_box(sheet, SLUG_MM))
    canvas.setBleedBox(_inset_box(sheet, SLUG_MM - BLEED_MM))
    # reportlab's own translate() keeps 7 digits, 0.2 um of a wall; its transform() of the blocks kept 6
    canvas.addLiteral(f"1 0 0 1 {width_pt / 2:.7f} {height_pt / 2:.7f} cm")
    for operator in operators:
        canvas.addLiteral(operator)
    _draw_furniture(canvas, sheet)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _inset_box(sheet: Sheet, inset_mm: float) -> tuple[float, float, float, float]:
    width_mm, height_mm = sheet.page_mm
    x0, y0, x1, y1 = (PT_PER_MM * v for v in (inset_mm, inset_mm, width_mm - inset_mm, height_mm - inset_mm))
    return x0, y0, x1, y1


def _draw_furniture(canvas: Canvas, sheet: Sheet) -> None:
    canvas.setStrokeColor(_BLACK)
    for line in sheet.lines:
        canvas.setLineWidth(PT_PER_MM * line.width_mm)
        canvas.line(*(PT_PER_MM * v for v in (*line.start_mm, *line.end_mm)))
    canvas.setLineWidth(PT_PER_MM * _OUTLINE_MM)
    for patch in sheet.patches:
        _draw_patch(canvas, patch, sheet)
    canvas.setFillColor(_BLACK)
    for modules in sheet.modules:
        _draw_modules(canvas, modules)
    for text in sheet.texts:
        canvas.setFont(font_name(), PT_PER_MM * text.height_mm)
        x, y = (PT_PER_MM * v for v in text.at_mm)
        draw = {"left": canvas.drawString, "middle": canvas.drawCentredString, "right": canvas.drawRightString}
        draw[text.anchor](x, y, text.text)


def _draw_patch(canvas: Canvas, patch: Patch, sheet: Sheet) -> None:
    rectangle = tuple(PT_PER_MM * v for v in (*patch.lower_left_mm, *patch.size_mm))
    if patch.colorant is None:
        canvas.rect(*rectangle, stroke=1, fill=0)
        return
    ink = ink_operator(patch.colorant, sheet.plates, separate=True)
    canvas.addLiteral(f"q {ink} {' '.join(f'{v:.6f}' for v in rectangle)} re f Q")


def _draw_modules(canvas: Canvas, modules: Modules) -> None:
    """All black modules as one path, so that no renderer leaves a seam between two of them."""
    path = canvas.beginPath()
    left, top = modules.upper_left_mm
    step = PT_PER_MM * modules.module_mm
    for row, first, length in modules.runs():
        path.rect(PT_PER_MM * left + step * first, PT_PER_MM * top - step * (row + 1), step * length, step)
    canvas.drawPath(path, stroke=0, fill=1)
