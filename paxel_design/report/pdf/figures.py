"""Figures: lines of pictures, each with its label above and its note below, over one caption, never separated.

Knows reportlab and the record of the layout; what is drawn in a cell is an object's name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from reportlab.platypus import Flowable, Paragraph

from paxel_design.report.pdf.layout import TEXT_WIDTH_PT, Box, Layout, set_anchor

__all__ = ["GAP_PT", "Cell", "Figure"]

GAP_PT = 7.0
"""Between cells of a line, and below every line."""

_LEAST_SCALE = 0.8
"""A figure is set so much smaller rather than leave the rest of a page empty."""

_LABEL_GAP_PT = 2.0
_BELOW_GAP_PT = 4.0
_BORDER_PT = 0.3


@dataclass(frozen=True, eq=False)
class Cell:
    """An object of the document in its size.

    Attributes
    ----------
    name : str
        Under which the page draws it (`objects`).
    width, height : float
        Points.
    label, note : Paragraph or None
        Set over and under it, as wide as `room`.
    room : float
        Width of the cell, at least that of the object.
    framed : bool
        A hairline about it: a picture may be white at its edges.
    exact : bool
        At true scale.
    """

    name: str
    width: float
    height: float
    room: float
    label: Paragraph | None = None
    note: Paragraph | None = None
    framed: bool = False
    exact: bool = False


class Figure(Flowable):
    """Lines of cells and a caption on one page.

    Parameters
    ----------
    lines : sequence of sequence of Cell
        Each line at most as wide as the text.
    caption : Paragraph
    layout : Layout
        Where to record objects and boxes.
    anchor : str
        Target of links; empty for a continuation.
    legend : Paragraph, optional
        Between the last line and the caption.
    """

    def __init__(
        self,
        lines: Sequence[Sequence[Cell]],
        caption: Paragraph,
        layout: Layout,
        anchor: str,
        legend: Paragraph | None = None,
    ) -> None:
        super().__init__()
        self.spaceBefore, self.spaceAfter = 6.0, 10.0
        self._lines, self._layout, self._anchor = lines, layout, anchor
        self._below = [part for part in (legend, caption) if part is not None]

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Width and height in points; a little smaller than designed where it fits only so."""
        self._measure(1.0)
        if self.height > availHeight >= self.start_height:
            scalable = sum(_object_height(line) for line in self._lines)
            self._measure(1 - (self.height - availHeight) / scalable)
        return self.width, self.height

    @property
    def start_height(self) -> float:
        """The height without which it does not stand on a page."""
        self._measure(1.0)
        alone = all(len(line) == 1 or not any(cell.framed for cell in line) for line in self._lines)
        if not alone or any(cell.exact for line in self._lines for cell in line):
            return float(self.height)
        return float(self.height - (1 - _LEAST_SCALE) * sum(_object_height(line) for line in self._lines))

    def _measure(self, scale: float) -> None:
        """Widths and heights with all objects scaled."""
        self._scale = scale
        self._heights = [_line_heights(line, scale) for line in self._lines]
        self._below_heights = [part.wrap(TEXT_WIDTH_PT, 0)[1] for part in self._below]
        lines = sum(sum(heights) + GAP_PT for heights in self._heights)
        self.width = TEXT_WIDTH_PT
        self.height = lines + sum(self._below_heights) + _BELOW_GAP_PT * (len(self._below) - 1)

    def draw(self) -> None:
        """Draw from the top down, in reading order."""
        if self._anchor:
            set_anchor(self.canv, self._layout, self._anchor, self.height)
        y = self.height
        for line, (above, below) in zip(self._lines, self._heights, strict=True):
            x = 0.0
            for cell in line:
                self._draw_cell(cell, x, y - above)
                x += cell.room + GAP_PT
            y -= above + below + GAP_PT
        for part, height in zip(self._below, self._below_heights, strict=True):
            y -= height
            self._draw_text(part, 0.0, y)
            y -= _BELOW_GAP_PT

    def _draw_cell(self, cell: Cell, x: float, top: float) -> None:
        if cell.label is not None:
            self._draw_text(cell.label, x, top + _LABEL_GAP_PT)
        width, height = self._scale * cell.width, self._scale * cell.height
        y = top - height
        canvas = self.canv
        canvas.addLiteral(f"q {width:.4f} 0 0 {height:.4f} {x:.4f} {y:.4f} cm /{cell.name} Do Q")
        if cell.framed:
            canvas.setLineWidth(_BORDER_PT)
            canvas.setStrokeGray(0.6)
            canvas.rect(x, y, width, height)
        page = canvas.getPageNumber()
        left, lower = canvas.absolutePosition(x, y)
        self._layout.objects.setdefault(page, set()).add(cell.name)
        self._layout.boxes.append(Box(page, left, lower, width, height, f"object {cell.name}"))
        if cell.note is not None:
            self._draw_text(cell.note, x, y - _LABEL_GAP_PT - cell.note.height)

    def _draw_text(self, paragraph: Paragraph, x: float, y: float) -> None:
        paragraph.drawOn(self.canv, x, y)
        left, lower = self.canv.absolutePosition(x, y)
        page = self.canv.getPageNumber()
        self._layout.boxes.append(Box(page, left, lower, paragraph.width, paragraph.height, "text"))


def _line_heights(line: Sequence[Cell], scale: float) -> tuple[float, float]:
    """Of the labels of a line, and of its objects with their notes, gaps included."""
    above = max((_height(cell.label, cell.room) for cell in line), default=0.0)
    return above, max(scale * cell.height + _height(cell.note, cell.room) for cell in line)


def _object_height(line: Sequence[Cell]) -> float:
    return max(cell.height for cell in line)


def _height(paragraph: Paragraph | None, room: float) -> float:
    return 0.0 if paragraph is None else float(paragraph.wrap(room, 0)[1] + _LABEL_GAP_PT)
