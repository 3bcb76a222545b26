"""Cells of a table in columns: words wrapped, numbers on their decimal points, widths that give every text its due.

Knows reportlab's texts; rows, pages and lines are `tables`'.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.platypus import Flowable, Paragraph

from paxel_design.report.pdf.layout import TEXT_WIDTH_PT
from paxel_design.report.pdf.typography import Typography

__all__ = ["PAD_X_PT", "Cells", "Columns", "Grid", "columns_of"]

PAD_X_PT = 4.0
"""Left and right of every text."""

_WIDEST_WORD = 0.3
"""A word that is wider than this share of the text, such as a hash, may be broken."""

_NUMBER = re.compile(r"([<>≤≥~±+−–-]?\s?\d(?:[\d\s]*\d)?)((?:\.\d+)?(?:\s?[^\d\s.,]\D{0,8})?)")
"""What stands left of the decimal point, and the rest with its unit; two numbers in a cell are words."""

_MARKS = re.compile(r"<[^>]*>")
_ENTITIES = (("&lt;", "<"), ("&gt;", ">"), ("&amp;", "&"))

Cells = tuple[Flowable, ...]
"""A row's texts."""


@dataclass(frozen=True, eq=False)
class Grid:
    """What a table holds.

    Attributes
    ----------
    header : tuple of str
        Marked-up texts.
    rows : tuple of tuple of str
    numbers : tuple of bool
        Which columns hold numbers.
    """

    header: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numbers: tuple[bool, ...]


@dataclass(frozen=True, eq=False)
class Columns:
    """A grid made of texts.

    Attributes
    ----------
    header : Cells
    rows : list of Cells
    widths : (c,) float64 array
        Points, padding included; in all at most the text's width.
    """

    header: Cells
    rows: list[Cells]
    widths: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class _Column:
    """A column's texts, and widths in points: the head's and the cells' on one line, and the widest word's."""

    header: Paragraph
    cells: list[Flowable]
    head_width: float
    cell_width: float
    word_width: float


def columns_of(grid: Grid, type_: Typography) -> Columns:
    """Lay a grid out: all on one line where that fits, else heads on two, else words wrapped as evenly as may be."""
    columns = [
        _column(head, [row[k] for row in grid.rows], type_, number=grid.numbers[k])
        for k, head in enumerate(grid.header)
    ]
    heads, cells, words = (
        np.array([getattr(column, part) for column in columns]) + 2 * PAD_X_PT + 0.5  # 0.5: rounding of widths
        for part in ("head_width", "cell_width", "word_width")
    )
    heads_on_two = np.maximum.reduce((heads / 2, cells, words))
    on_one_line = np.maximum(heads, heads_on_two)
    if heads_on_two.sum() <= TEXT_WIDTH_PT:
        widths = _shared_widths(on_one_line, heads_on_two)
    else:
        widths = _shared_widths(heads_on_two, words)
    rows = [tuple(row) for row in zip(*(column.cells for column in columns), strict=True)]
    return Columns(tuple(column.header for column in columns), rows, widths)


def _column(head: str, texts: Sequence[str], type_: Typography, *, number: bool) -> _Column:
    parts = [_NUMBER.fullmatch(_plain(text)) if number else None for text in texts]
    lead, tail = (max((_width(p[side], type_.cell) for p in parts if p), default=0.0) for side in (1, 2))
    # A column of dashes is one of numbers, too; one of "yes" and "no" is not.
    aligned = number and (any(parts) or not any(map(str.isalpha, "".join(texts))))
    head_style, style = (_right(style) if aligned else style for style in (type_.head, type_.cell))
    cells = [
        _Number(part[1], part[2], tail, type_.cell) if part else Paragraph(text, style)
        for text, part in zip(texts, parts, strict=True)
    ]
    header, words = Paragraph(head, head_style), [cell for cell in cells if isinstance(cell, Paragraph)]
    word_width = min(max(word.minWidth() for word in (header, *words)), _WIDEST_WORD * TEXT_WIDTH_PT)
    return _Column(
        header,
        cells,
        _width_on_one_line(header),
        max(lead + tail, *map(_width_on_one_line, words)) if words else lead + tail,
        max(lead + tail, word_width),
    )


def _shared_widths(natural: NDArray[np.float64], least: NDArray[np.float64]) -> NDArray[np.float64]:
    """Widths of at most the text's in all: natural ones, else between those that are needed least and these."""
    if natural.sum() <= TEXT_WIDTH_PT:
        return natural
    if least.sum() >= TEXT_WIDTH_PT:
        return _equal_shares(least)
    # By the root of what it lacks: a column of few words is not robbed by one that holds sentences.
    wish = np.sqrt(natural - least)
    widths = least.copy()
    while (free := TEXT_WIDTH_PT - widths.sum()) > 1e-6:
        wanting = np.where(widths < natural - 1e-9, wish, 0.0)
        widths = np.minimum(widths + free * wanting / wanting.sum(), natural)
    return widths


def _equal_shares(least: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where not even words fit: columns wider than an equal share give way, and break words."""
    low, high = 0.0, TEXT_WIDTH_PT
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if np.minimum(least, middle).sum() <= TEXT_WIDTH_PT else (low, middle)
    return np.minimum(least, low)


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
        x = self.width - self._tail - _width(self._head, self._style)
        self.canv.drawString(x, self.height - self._style.fontSize, self._head + self._rest)


def _right(style: ParagraphStyle) -> ParagraphStyle:
    return ParagraphStyle(f"{style.name} right", style, alignment=TA_RIGHT)


def _plain(marked: str) -> str:
    text = _MARKS.sub("", marked)
    for entity, sign in _ENTITIES:
        text = text.replace(entity, sign)
    return text


def _width_on_one_line(paragraph: Paragraph) -> float:
    paragraph.wrap(1e6, 1e6)
    return float(max(paragraph.getActualLineWidths0(), default=0.0))


def _width(text: str, style: ParagraphStyle) -> float:
    return float(stringWidth(text, style.fontName, style.fontSize))
