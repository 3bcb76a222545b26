"""What stands on a page beside its text: running head, foot, the badge of the virtual bench, and the title.

Draws on reportlab's canvas in points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth

from paxel_design.report.pdf.contents import shortened
from paxel_design.report.pdf.layout import LEFT_PT, PAGE_HEIGHT_PT, PAGE_WIDTH_PT, PT_PER_MM, TEXT_WIDTH_PT
from paxel_design.report.pdf.typography import BOLD, REGULAR, SOFT_INK, printable

__all__ = ["Furniture", "draw_foot", "draw_head"]

_HEAD_BASE_PT = PAGE_HEIGHT_PT - 14.5 * PT_PER_MM
_FOOT_BASE_PT = 11.5 * PT_PER_MM
_SIZE_PT = 7.2
_BADGE_SIZE_PT = 6.8
_RULE_PT = 0.4


@dataclass(frozen=True)
class Furniture:
    """What all pages say.

    Attributes
    ----------
    title : str
        Of the report.
    bench : str
        On the badge; empty for none.
    writer, date : str
    pages : int
        Number of pages; 0 while it is unknown.
    """

    title: str
    bench: str
    writer: str
    date: str
    pages: int


def draw_head(furniture: Furniture, section: str) -> Callable[[Any, Any], None]:
    """The head of a section's pages: its title, the report's, and the badge.

    The first page, which has a title of its own, is drawn with an empty `section`: it gets the badge alone.
    """

    def draw(canvas: Any, document: Any) -> None:
        canvas.saveState()
        right = LEFT_PT + TEXT_WIDTH_PT - _draw_badge(canvas, printable(furniture.bench))
        if section:
            style = ParagraphStyle("running head", fontName=BOLD, fontSize=_SIZE_PT)
            left = shortened(printable(section), style, 0.45 * TEXT_WIDTH_PT)
            _text(canvas, LEFT_PT, left, BOLD)
            style = ParagraphStyle("running title", fontName=REGULAR, fontSize=_SIZE_PT)
            title_left = LEFT_PT + stringWidth(left, BOLD, _SIZE_PT) + 14
            title = shortened(printable(furniture.title), style, right - title_left)
            _text(canvas, right - stringWidth(title, REGULAR, _SIZE_PT), title, REGULAR)
            _rule(canvas, _HEAD_BASE_PT - 5)
        canvas.restoreState()

    return draw


def draw_foot(furniture: Furniture) -> Callable[[Any, Any], None]:
    """The foot of a page: writer and date, page x of y."""

    def draw(canvas: Any, document: Any) -> None:
        canvas.saveState()
        _rule(canvas, _FOOT_BASE_PT + 10)
        page = f"page {canvas.getPageNumber()} of {furniture.pages or '?'}"
        style = ParagraphStyle("foot", fontName=REGULAR, fontSize=_SIZE_PT)
        left = " · ".join(part for part in (printable(furniture.writer), printable(furniture.date)) if part)
        room = TEXT_WIDTH_PT - stringWidth(page, REGULAR, _SIZE_PT) - 14
        canvas.setFillColor(SOFT_INK)
        canvas.setFont(REGULAR, _SIZE_PT)
        canvas.drawString(LEFT_PT, _FOOT_BASE_PT, shortened(left, style, room))
        canvas.drawRightString(LEFT_PT + TEXT_WIDTH_PT, _FOOT_BASE_PT, page)
        canvas.restoreState()

    return draw


def _draw_badge(canvas: Any, bench: str) -> float:
    """The bench in a frame at the right; the width that it takes, its distance from what stands left included."""
    if not bench:
        return 0.0
    bench = shortened(bench, ParagraphStyle("badge", fontName=BOLD, fontSize=_BADGE_SIZE_PT), 0.4 * TEXT_WIDTH_PT)
    width = stringWidth(bench, BOLD, _BADGE_SIZE_PT) + 10
    x = LEFT_PT + TEXT_WIDTH_PT - width
    canvas.setLineWidth(0.8)
    canvas.setStrokeColor(SOFT_INK)
    canvas.setFillGray(0.93)
    canvas.roundRect(x, _HEAD_BASE_PT - 2.8, width, 11.5, 2.5, stroke=1, fill=1)
    canvas.setFillGray(0.1)
    canvas.setFont(BOLD, _BADGE_SIZE_PT)
    canvas.drawString(x + 5, _HEAD_BASE_PT + 0.3, bench)
    return width + 8


def _text(canvas: Any, x: float, text: str, font: str) -> None:
    canvas.setFillColor(SOFT_INK)
    canvas.setFont(font, _SIZE_PT)
    canvas.drawString(x, _HEAD_BASE_PT, text)


def _rule(canvas: Any, y: float) -> None:
    canvas.setStrokeColor(SOFT_INK)
    canvas.setLineWidth(_RULE_PT)
    canvas.line(LEFT_PT, y, PAGE_WIDTH_PT - LEFT_PT, y)
