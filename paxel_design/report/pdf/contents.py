"""The contents: a line for each section and heading, then figures and tables, with dots up to the page's number.

Knows anchors and the pages that an earlier pass found for them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import Flowable

from paxel_design.report.pdf.layout import TEXT_WIDTH_PT
from paxel_design.report.pdf.typography import BOLD, SOFT_INK

__all__ = ["ContentsColumns", "ContentsLine", "Entry", "shortened"]

_INDENT_PT = 14.0
_PAGE_ROOM_PT = 22.0
_COLUMN_GAP_PT = 18.0
_COLUMN_PT = (TEXT_WIDTH_PT - _COLUMN_GAP_PT) / 2


@dataclass(frozen=True)
class Entry:
    """A line of the contents.

    Attributes
    ----------
    anchor : str
    text : str
        Plain.
    level : int
        0 for sections, 1 for headings, figures and tables.
    """

    anchor: str
    text: str
    level: int


def shortened(text: str, style: ParagraphStyle, width: float) -> str:
    """A text that is no wider than `width`, cut at a word where it would be."""
    if stringWidth(text, style.fontName, style.fontSize) <= width:
        return text
    room = width - stringWidth(" …", style.fontName, style.fontSize)
    while text and stringWidth(text, style.fontName, style.fontSize) > room:
        text = text[: text.rfind(" ")] if " " in text[1:] else text[:-1]
    return text.rstrip(" ,;:") + " …"


class ContentsLine(Flowable):
    """One line, all of it a link."""

    def __init__(self, entry: Entry, style: ParagraphStyle, pages: Mapping[str, int]) -> None:
        super().__init__()
        self.spaceBefore = 0.35 * style.leading if style.fontName == BOLD else 0.0
        self._entry, self._style = entry, style
        self._page = str(pages.get(entry.anchor, ""))

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Width and height in points."""
        self.width, self.height = availWidth, self._style.leading
        return self.width, self.height

    def draw(self) -> None:
        """Text, dots, page."""
        canvas, style = self.canv, self._style
        left = _INDENT_PT * self._entry.level
        base = self.height - style.fontSize
        text = shortened(self._entry.text, style, self.width - left - _PAGE_ROOM_PT)
        canvas.setFont(style.fontName, style.fontSize)
        canvas.setFillColor(style.textColor)
        canvas.drawString(left, base, text)
        canvas.drawRightString(self.width, base, self._page)
        start = left + stringWidth(text, style.fontName, style.fontSize) + 5
        end = self.width - stringWidth(self._page, style.fontName, style.fontSize) - 4
        if end > start:
            # Drawn, not written: text that is copied or read aloud holds no dots.
            canvas.saveState()
            canvas.setStrokeColor(SOFT_INK)
            canvas.setLineWidth(0.7)
            canvas.setLineCap(1)
            canvas.setDash([0, 4], (end - start) % 4)
            canvas.line(end, base + 0.6, start, base + 0.6)
            canvas.restoreState()
        canvas.linkRect("", self._entry.anchor, (0, 0, self.width, self.height), relative=1, thickness=0)


class ContentsColumns(Flowable):
    """Lines in two columns, the left one first."""

    def __init__(self, lines: Sequence[ContentsLine]) -> None:
        super().__init__()
        self._lines = lines

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Width and height in points."""
        tops = [line for line in range(len(self._lines)) if self._lines[line].getSpaceBefore()]
        for line in self._lines:
            line.wrap(_COLUMN_PT, 0)
        # A column begins with a section, where there are any.
        breaks = [*(tops or range(len(self._lines))), len(self._lines)]
        self._left = min(breaks, key=self._height)
        self.width, self.height = TEXT_WIDTH_PT, self._height(self._left)
        return self.width, self.height

    def _height(self, left: int) -> float:
        """Of the higher column, if the left one has so many lines."""
        columns = (self._lines[:left], self._lines[left:])
        return max(
            sum(line.height + (line.getSpaceBefore() if k else 0.0) for k, line in enumerate(c)) for c in columns
        )

    def split(self, availWidth: float, availHeight: float) -> list[Flowable]:
        """As many lines as fit, and the others."""
        for count in range(len(self._lines), 0, -1):
            first = ContentsColumns(self._lines[:count])
            if first.wrap(availWidth, availHeight)[1] <= availHeight:
                return [first, ContentsColumns(self._lines[count:])]
        return []

    def draw(self) -> None:
        """Each column from the top down."""
        y = self.height
        for k, line in enumerate(self._lines):
            x = 0.0 if k < self._left else TEXT_WIDTH_PT - _COLUMN_PT
            y = (self.height if k in (0, self._left) else y - line.getSpaceBefore()) - line.height
            line.drawOn(self.canv, x, y)
