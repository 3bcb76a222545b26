"""What stands on the pages of a tiled sheet besides the sheet: ticks for cutting and gluing, labels, and the map.

Each cut edge comes to lie on the ticks with a circle of the page before it; by the order of gluing these are all still
there. Knows a `PagePlan`, and nothing of the sheet.
"""

from __future__ import annotations

import io

from reportlab.lib.colors import CMYKColor
from reportlab.pdfgen.canvas import Canvas

from paxel_design.printing.cells_pdf import PT_PER_MM
from paxel_design.printing.font import font_name
from paxel_design.printing.page_plan import PagePlan, Tile

__all__ = ["page_marks"]

_TICK_NEAR_MM, _TICK_FAR_MM = 1.0, 6.0  # from the part of the sheet outwards
_TICK_MM = 0.15
_LABEL_MM = 2.8
_MAP_TEXT_MM = 3.2
_MAP_LINE_MM = 5.0
_BLACK, _GRAY = CMYKColor(0, 0, 0, 1), CMYKColor(0, 0, 0, 0.35)


def page_marks(plan: PagePlan) -> bytes:
    """Ticks and labels of every page, and the map, as a PDF of its own."""
    buffer = io.BytesIO()
    size = tuple(PT_PER_MM * side for side in plan.page_mm)
    canvas = Canvas(buffer, pagesize=size, invariant=1, pageCompression=1, initialFontName=font_name())
    for tile in plan.tiles():
        _draw_ticks(canvas, plan, tile)
        _draw_label(canvas, plan, tile)
        canvas.showPage()
    _draw_map(canvas, plan)
    canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _line(canvas: Canvas, *ends_mm: float) -> None:
    canvas.line(*(PT_PER_MM * v for v in ends_mm))


def _text(canvas: Canvas, x_mm: float, y_mm: float, text: str, height_mm: float) -> None:
    canvas.setFont(font_name(), PT_PER_MM * height_mm)
    canvas.drawString(PT_PER_MM * x_mm, PT_PER_MM * y_mm, text)


def _draw_ticks(canvas: Canvas, plan: PagePlan, tile: Tile) -> None:
    """Ticks in the margin: at the corners for the cuts, with a circle where the next page's cut edge comes to lie."""
    canvas.setStrokeColor(_BLACK)
    canvas.setLineWidth(PT_PER_MM * _TICK_MM)
    near, far = plan.margin_mm - _TICK_NEAR_MM, plan.margin_mm - _TICK_FAR_MM
    width, height = plan.page_mm
    lies_on_x = [plan.margin_mm, width - plan.margin_mm]
    lies_on_y = [plan.margin_mm, height - plan.margin_mm]
    for x in lies_on_x:
        _line(canvas, x, near, x, far)
        _line(canvas, x, height - near, x, height - far)
    for y in lies_on_y:
        _line(canvas, near, y, far, y)
        _line(canvas, width - near, y, width - far, y)
    if tile.column + 1 < plan.columns:
        x = width - plan.margin_mm - plan.overlap_mm
        for y0, sign in ((0.0, 1.0), (height, -1.0)):
            _register(canvas, x, y0 + sign * (plan.margin_mm - 3.0), along_x=False)
    if tile.row + 1 < plan.rows:
        y = plan.margin_mm + plan.overlap_mm
        for x0, sign in ((0.0, 1.0), (width, -1.0)):
            _register(canvas, x0 + sign * (plan.margin_mm - 3.0), y, along_x=True)


def _register(canvas: Canvas, x_mm: float, y_mm: float, *, along_x: bool) -> None:
    """A tick through a small circle: the edge of the next page lies on its line."""
    reach = 2.0
    canvas.circle(PT_PER_MM * x_mm, PT_PER_MM * y_mm, PT_PER_MM * 0.9, stroke=1, fill=0)
    if along_x:
        _line(canvas, x_mm - reach, y_mm, x_mm + reach, y_mm)
    else:
        _line(canvas, x_mm, y_mm - reach, x_mm, y_mm + reach)


def _name(plan: PagePlan, tile: Tile) -> str:
    return f"row {tile.row + 1} of {plan.rows}, column {tile.column + 1} of {plan.columns}"


def _draw_label(canvas: Canvas, plan: PagePlan, tile: Tile) -> None:
    """What page this is and where it is cut, in the lower margin."""
    before = [name for name, index in (("left", tile.column), ("top", tile.row)) if index]
    cut = f"cut {', then '.join(before)}" if before else "no cut"
    canvas.setFillColor(_BLACK)
    text = f"{_name(plan, tile)}: {cut}. Page {plan.number_of(tile)} of {plan.pages}, this side up"
    _text(canvas, plan.margin_mm + 12.0, 4.6, text, _LABEL_MM)


def _draw_map(canvas: Canvas, plan: PagePlan) -> None:
    """All pages in their places, drawn to scale, with what to do."""
    lines = _instructions(plan)
    width, height = plan.page_mm
    canvas.setFillColor(_BLACK)
    scale = min(1.0, width / 210.0)
    for i, line in enumerate(lines):
        _text(
            canvas, plan.margin_mm, height - plan.margin_mm - scale * _MAP_LINE_MM * (i + 1), line, scale * _MAP_TEXT_MM
        )
    top = height - plan.margin_mm - scale * _MAP_LINE_MM * (len(lines) + 1)
    room = (width - 2 * plan.margin_mm, top - plan.margin_mm)
    tiles = list(plan.tiles())
    left, bottom = tiles[0].left_mm, tiles[-1].bottom_mm
    whole = (plan.sheet_mm[0] - 2 * left, plan.sheet_mm[1] - 2 * bottom)
    factor = min(room[0] / whole[0], room[1] / whole[1])

    def box(x_mm: float, y_mm: float, size_mm: tuple[float, float]) -> tuple[float, float, float, float]:
        x, y = plan.margin_mm + factor * (x_mm - left), top - factor * (whole[1] - (y_mm - bottom))
        return PT_PER_MM * x, PT_PER_MM * y, PT_PER_MM * factor * size_mm[0], PT_PER_MM * factor * size_mm[1]

    canvas.setStrokeColor(_GRAY)
    canvas.setLineWidth(PT_PER_MM * 0.5)
    canvas.rect(*box(0.0, 0.0, plan.sheet_mm))
    canvas.setStrokeColor(_BLACK)
    canvas.setLineWidth(PT_PER_MM * 0.1)
    text_mm = max(0.8, min(_MAP_TEXT_MM, 0.2 * factor * plan.tile_mm[0]))
    for tile in tiles:
        x, y, w, h = box(tile.left_mm, tile.bottom_mm, plan.tile_mm)
        canvas.rect(x, y, w, h)
        canvas.setFont(font_name(), PT_PER_MM * text_mm)
        canvas.drawCentredString(x + w / 2, y + h / 2, str(plan.number_of(tile)))


def _instructions(plan: PagePlan) -> list[str]:
    rows, columns = plan.rows, plan.columns
    size = f"{plan.sheet_mm[0]:.1f} × {plan.sheet_mm[1]:.1f} mm"
    return [
        f"How {rows * columns} pages make one sheet of {size}: {rows} rows of {columns}, seen from the front",
        f"1. Print at 100 %, no scaling; pages are {plan.page_mm[0]:g} × {plan.page_mm[1]:g} mm.",
        "2. Row by row: on all pages but those of column 1 cut the left margin off, exactly between the corner ticks.",
        f"    Lay it on the page left of it, {plan.overlap_mm:g} mm over it, its cut edge on the ticks with a circle;",
        "    the dots of both pages must meet. Glue.",
        "3. Then cut the upper margin off every row but the first, and lay each row on the one above it the same way.",
        "4. Cut the whole sheet along its crop marks, and measure its rulers: 100 mm each.",
        "The gray frame below is the sheet; boxes are pages with their numbers, overlapping as they will lie.",
    ]
