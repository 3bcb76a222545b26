"""Tables: a caption over rows under a header that is repeated on every page, numbers aligned on their decimal points.

Knows reportlab and the record of the layout; cells are marked-up texts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import Flowable, Paragraph

from paxel_design.report.pdf.layout import FRAME_HEIGHT_PT, TEXT_WIDTH_PT, Box, Layout, set_anchor
from paxel_design.report.pdf.typography import Typography

__all__ = ["Grid", "TableFlowable"]

_PAD_X, _PAD_Y = 4.0, 2.2
_CAPTION_GAP_PT = 4.0
_ZEBRA, _HEADER = 0.955, 0.88
_LEAST_ROWS = 3
"""A table is not parted so that fewer rows stand on one of the pages."""

_WHOLE = 0.4
"""A table lower than this share of a page is not parted."""

_ENOUGH = 0.2
"""Fewer high rows may stand alone if they fill this share of a page."""

_HIGHEST_ROW = 0.35
"""A row that is higher than this share of a page goes on in a further row."""

_WIDEST_WORD = 0.3
"""A word that is wider than this share of the text, such as a hash, may be broken."""

_NUMBER = re.compile(r"([<>≤≥~±+−–-]?\s?\d(?:[\d\s]*\d)?)((?:\.\d+)?(?:\s?[^\d\s.,]\D{0,8})?)")
"""What stands left of the decimal point, and the rest with its unit; two numbers in a cell are words."""

_TEXT_OF_MARKUP = re.compile(r"<[^>]*>")
_ENTITIES = (("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&"))


@dataclass(frozen=True, eq=False)
class Grid:
    """What a table holds.

    Attributes
    ----------
    header : tuple of str
        Marked-up texts.
    rows : tuple of tuple of str
    numbers : tuple of bool
        Which columns are aligned on decimal points.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[bool, ...]


class _Number(Flowable):
    """A number whose decimal point stands `tail` points left of the cell's right edge."""

    def __init__(self, head: str, rest: str, tail: float, style: ParagraphStyle) -> None:
        super().__init__()
        self._head, self._rest, self._tail, self._style = head, rest, tail, style

    def wrap(self, availWidth: float, availHeight: float) -> tuple[float, float]:
        self.width, self.height = availWidth, self._style.leading
        return self.width, self.height

    def split(self, availWidth: float, availHeight: float) -> list[Flowable]:
        return [self]

    def draw(self) -> None:
        self.canv.setFont(self._style.fontName, self._style.fontSize)
        self.canv.setFillColor(self._style.textColor)
        width = stringWidth(self._head, self._style.fontName, self._style.fontSize)
        at = self.width - self._tail - width
        self.canv.drawString(at, self.height - self._style.fontSize, self._head + self._rest)


Cells = tuple[Flowable, ...]


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
        """Lay a grid out: columns as wide as their texts where they all fit, else words are wrapped."""
        cells, header, widths = _laid_out(grid, type_)
        rows = []
        for k, row in enumerate(cells):
            rows += _rows_of(row, widths, shaded=k % 2 == 1)
        return cls(rows, _Row(header, _row_height(header, widths)), widths, caption, layout, anchor)

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
        y = self._draw_row(self._header, y, _HEADER)
        for row in self._rows:
            y = self._draw_row(row, y, _ZEBRA if row.shaded else None)
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
            y = top - _PAD_Y - cell.height
            cell.drawOn(canvas, x + _PAD_X, y)
            left, lower = canvas.absolutePosition(x + _PAD_X, y)
            self._layout.boxes.append(Box(page, left, lower, float(width) - 2 * _PAD_X, cell.height, "cell"))
            x += float(width)
        return top - row.height


def _row_height(cells: Cells, widths: NDArray[np.float64]) -> float:
    heights = [cell.wrap(width - 2 * _PAD_X, 0)[1] for cell, width in zip(cells, widths, strict=True)]
    return float(max(heights, default=0.0) + 2 * _PAD_Y)


def _rows_of(cells: Cells, widths: NDArray[np.float64], *, shaded: bool) -> list[_Row]:
    """A row, or where it is too high to flow from page to page the parts of it that are not."""
    highest = _HIGHEST_ROW * FRAME_HEIGHT_PT
    rows = []
    while (height := _row_height(cells, widths)) > highest:
        halves = [
            (*cell.split(width - 2 * _PAD_X, highest - 2 * _PAD_Y), *[Paragraph("", _EMPTY)] * 2)[:2]
            for cell, width in zip(cells, widths, strict=True)
        ]
        upper, cells = zip(*halves, strict=True)
        rows.append(_Row(upper, _row_height(upper, widths), shaded))
    return [*rows, _Row(cells, height, shaded)]


_EMPTY = ParagraphStyle("empty")


def _laid_out(grid: Grid, type_: Typography) -> tuple[list[Cells], Cells, NDArray[np.float64]]:
    """Cells, header and widths of the columns."""
    right = {
        style.name: ParagraphStyle(f"{style.name} right", style, alignment=TA_RIGHT)
        for style in (type_.cell, type_.head)
    }
    columns, headers, natural, least = [], [], [], []
    for k, head in enumerate(grid.header):
        texts = [row[k] for row in grid.rows]
        parts = [_NUMBER.fullmatch(_plain(text)) if grid.numbers[k] else None for text in texts]
        as_number = any(parts)
        lead, tail = (max((_width(p[side], type_.cell) for p in parts if p), default=0.0) for side in (1, 2))
        style = right[type_.cell.name] if as_number else type_.cell
        column = [
            _Number(part[1], part[2], tail, type_.cell) if part else Paragraph(text, style)
            for text, part in zip(texts, parts, strict=True)
        ]
        headers.append(Paragraph(head, right[type_.head.name] if as_number else type_.head))
        columns.append(column)
        words = [headers[-1], *(cell for cell in column if isinstance(cell, Paragraph))]
        natural.append(max(lead + tail, *map(_natural_width, words)) + 2 * _PAD_X + 0.5)
        longest = min(max(word.minWidth() for word in words), _WIDEST_WORD * TEXT_WIDTH_PT)
        least.append(min(natural[-1], max(lead + tail, longest) + 2 * _PAD_X + 0.5))
    widths = _column_widths(np.array(natural), np.array(least))
    return [tuple(row) for row in zip(*columns, strict=True)], tuple(headers), widths


def _column_widths(natural: NDArray[np.float64], least: NDArray[np.float64]) -> NDArray[np.float64]:
    """Widths of at most the text's in all: natural ones, else between the longest word and the natural width."""
    if natural.sum() <= TEXT_WIDTH_PT:
        return natural
    if least.sum() > TEXT_WIDTH_PT:
        # Words are broken: those columns give way that are wider than an equal share.
        low, high = 0.0, TEXT_WIDTH_PT
        for _ in range(50):
            middle = (low + high) / 2
            low, high = (middle, high) if np.minimum(least, middle).sum() <= TEXT_WIDTH_PT else (low, middle)
        return np.minimum(least, low)
    free = TEXT_WIDTH_PT - least.sum()
    # A column that needs little more is not robbed by one that holds whole sentences.
    wish = np.sqrt(natural - least)
    widths = least + free * wish / wish.sum()
    for _ in range(len(widths)):
        over = widths > natural
        spare = (widths - natural)[over].sum()
        widths = np.where(over, natural, widths)
        open_ = widths < natural - 1e-9
        if spare < 1e-6 or not open_.any():
            break
        widths = widths + np.where(open_, spare * wish / wish[open_].sum(), 0.0)
    return widths


def _plain(marked: str) -> str:
    text = _TEXT_OF_MARKUP.sub("", marked)
    for entity, sign in _ENTITIES:
        text = text.replace(entity, sign)
    return text


def _natural_width(paragraph: Paragraph) -> float:
    """Of its text on one line."""
    paragraph.wrap(1e6, 1e6)
    return float(max(paragraph.getActualLineWidths0(), default=0.0))


def _width(text: str, style: ParagraphStyle) -> float:
    return float(stringWidth(text, style.fontName, style.fontSize))
