"""Tables on pages: a caption over rows under a header, both repeated where a table goes on.

Knows reportlab and the record of the layout; cells and widths are made by `columns`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.styles import ParagraphStyle
from reportlab.platypus import Flowable, Paragraph

from paxel_design.report.pdf.columns import PAD_X_PT, Cells, Grid, columns_of
from paxel_design.report.pdf.layout import FRAME_HEIGHT_PT, TEXT_WIDTH_PT, Box, Layout, set_anchor
from paxel_design.report.pdf.typography import Typography

__all__ = ["TableFlowable"]

_PAD_Y_PT = 2.2
_CAPTION_GAP_PT = 4.0

_ZEBRA_GRAY, _HEADER_GRAY = 0.955, 0.88
"""Light enough that print in gray keeps the texts on them clear."""

_LEAST_ROWS = 3
"""A table is not parted so that fewer rows stand on one of the pages."""

_WHOLE = 0.4
"""A table lower than this share of a page is not parted."""

_ENOUGH = 0.2
"""Fewer high rows may stand alone if they fill this share of a page."""

_HIGHEST_ROW = 0.35
"""A row that is higher than this share of a page goes on in a further row."""


_EMPTY = ParagraphStyle("empty")


@dataclass(frozen=True, eq=False)
class _Row:
    """Cells of a table in their widths, and how high they are together."""

    cells: Cells
    height: float
    shaded: bool = False


class TableFlowable(Flowable):
    """A table that parts between its rows, each part under the header and its caption.

    Parameters
    ----------
    rows : sequence of _Row
    header : _Row
    widths : (c,) float array
        Of the columns, in points.
    caption : callable
        Makes the caption, given whether this is a continuation.
    layout : Layout
    anchor : str
        Empty for a continuation.
    """

    def __init__(
        self,
        rows: Sequence[_Row],
        header: _Row,
        widths: NDArray[np.float64],
        caption: Callable[[bool], Paragraph],
        layout: Layout,
        anchor: str,
    ) -> None:
        super().__init__()
        self.spaceBefore, self.spaceAfter = 6.0, 10.0
        self._rows, self._header, self._widths = rows, header, widths
        self._make_caption, self._layout, self._anchor = caption, layout, anchor
        self._caption = caption(not anchor)
        self._heights = np.array([row.height for row in rows])

    @classmethod
    def of(
        cls, grid: Grid, type_: Typography, caption: Callable[[bool], Paragraph], layout: Layout, anchor: str
    ) -> TableFlowable:
        """A grid as a table, every second row shaded."""
        columns = columns_of(grid, type_)
        widths = columns.widths
        rows = [part for k, cells in enumerate(columns.rows) for part in _rows_of(cells, widths, shaded=k % 2 == 1)]
        header = _Row(columns.header, _row_height(columns.header, widths))
        return cls(rows, header, widths, caption, layout, anchor)

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        """Width and height in points."""
        self._caption_height = self._caption.wrap(TEXT_WIDTH_PT, 0)[1] + _CAPTION_GAP_PT
        self.width = float(self._widths.sum())
        self.height = self._top_height + float(self._heights.sum())
        return self.width, self.height

    @property
    def _top_height(self) -> float:
        return float(self._caption_height + self._header.height)

    @property
    def start_height(self) -> float:
        """The height without which it does not begin on a page."""
        self.wrap(TEXT_WIDTH_PT, 0)
        if self.height <= _WHOLE * FRAME_HEIGHT_PT:
            return float(self.height)
        return self._top_height + float(self._heights[: self._least_rows()].sum())

    def _least_rows(self) -> int:
        """How many rows the first part has at least."""
        filled = int(np.searchsorted(np.cumsum(self._heights), _ENOUGH * FRAME_HEIGHT_PT)) + 1
        return min(_LEAST_ROWS, filled, len(self._rows))

    def split(self, availWidth: float, availHeight: float) -> list[Flowable]:
        """As many rows as fit, and the others under a repeated header; nothing if too few fit."""
        self.wrap(availWidth, availHeight)
        fresh = availHeight >= FRAME_HEIGHT_PT - 1
        room = availHeight - self._top_height
        count = int(np.searchsorted(np.cumsum(self._heights), room + 1e-6, side="right"))
        if count >= len(self._rows):
            return [self]
        whole = self.height <= _WHOLE * FRAME_HEIGHT_PT
        if not fresh and (whole or count < self._least_rows()):
            return []
        if count == len(self._rows) - 1 and count > _LEAST_ROWS and self._heights[-1] < 2 * self._header.height:
            count -= 1  # no low last row alone
        if count == 0:
            return []
        return [
            TableFlowable(rows, self._header, self._widths, self._make_caption, self._layout, anchor)
            for rows, anchor in ((self._rows[:count], self._anchor), (self._rows[count:], ""))
        ]

    def draw(self) -> None:
        """Draw caption, header and rows from the top down."""
        canvas = self.canv
        if self._anchor:
            set_anchor(canvas, self._layout, self._anchor, self.height)
        y = self.height - self._caption_height
        self._caption.drawOn(canvas, 0, y + _CAPTION_GAP_PT)
        y = self._draw_row(self._header, y, _HEADER_GRAY)
        for row in self._rows:
            y = self._draw_row(row, y, _ZEBRA_GRAY if row.shaded else None)
        canvas.setStrokeGray(0.4)
        canvas.setLineWidth(0.5)
        for at in (0.0, self.height - self._top_height):
            canvas.line(0, at, self.width, at)

    def _draw_row(self, row: _Row, top: float, gray: float | None) -> float:
        """The lower edge of a row whose upper edge is `top`."""
        canvas = self.canv
        if gray is not None:
            canvas.setFillGray(gray)
            canvas.rect(0, top - row.height, self.width, row.height, stroke=0, fill=1)
        page, x = canvas.getPageNumber(), 0.0
        for cell, width in zip(row.cells, self._widths, strict=True):
            y = top - _PAD_Y_PT - cell.height
            cell.drawOn(canvas, x + PAD_X_PT, y)
            left, lower = canvas.absolutePosition(x + PAD_X_PT, y)
            self._layout.boxes.append(Box(page, left, lower, float(width) - 2 * PAD_X_PT, cell.height, "cell"))
            x += float(width)
        return top - row.height


def _row_height(cells: Cells, widths: NDArray[np.float64]) -> float:
    heights = [cell.wrap(width - 2 * PAD_X_PT, 0)[1] for cell, width in zip(cells, widths, strict=True)]
    return float(max(heights, default=0.0) + 2 * _PAD_Y_PT)


def _rows_of(cells: Cells, widths: NDArray[np.float64], *, shaded: bool) -> list[_Row]:
    """A row, or where it is too high to flow from page to page the parts of it that are not."""
    highest = _HIGHEST_ROW * FRAME_HEIGHT_PT
    rows = []
    while (height := _row_height(cells, widths)) > highest:
        halves = [
            (*cell.split(width - 2 * PAD_X_PT, highest - 2 * _PAD_Y_PT), *[Paragraph("", _EMPTY)] * 2)[:2]
            for cell, width in zip(cells, widths, strict=True)
        ]
        upper, cells = zip(*halves, strict=True)
        rows.append(_Row(upper, _row_height(upper, widths), shaded))
    return [*rows, _Row(cells, height, shaded)]
