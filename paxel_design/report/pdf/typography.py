"""The report's one typeface and its sizes: DejaVu Sans, which matplotlib brings and the charts are lettered in.

Knows reportlab's styles; turns the plain texts of sections into its mark-up. Knows no pages and no blocks.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.sax.saxutils import escape

import matplotlib
from reportlab.lib.colors import Color, HexColor
from reportlab.lib.styles import ParagraphStyle
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

from paxel_design.report.content import Quantity, filled

__all__ = ["BOLD", "INK", "LINK", "REGULAR", "SOFT_INK", "Typography", "link", "markup", "printable", "typography"]

REGULAR, BOLD = "paxel-report", "paxel-report-bold"
"""The two fonts under reportlab's names; registered by `typography`."""

INK, SOFT_INK, LINK = HexColor("#1c1c1e"), HexColor("#626266"), HexColor("#1f4e9c")

_REPLACEMENT = "\ufffd"
"""Stands for a character that the typeface has no glyph for: the name of a picture may be in any script."""


@dataclass(frozen=True, eq=False)
class Typography:
    """Styles of all texts at one size; sizes in points.

    Attributes
    ----------
    size : float
        1 as designed; less where a page has to hold more.
    title, subtitle, section, heading, body, small, bullet, caption, label, note, cell, head : ParagraphStyle
        `cell` and `head` are a table's, `label` and `note` stand above and below a picture.
    """

    size: float
    title: ParagraphStyle
    subtitle: ParagraphStyle
    section: ParagraphStyle
    heading: ParagraphStyle
    body: ParagraphStyle
    small: ParagraphStyle
    bullet: ParagraphStyle
    caption: ParagraphStyle
    label: ParagraphStyle
    note: ParagraphStyle
    cell: ParagraphStyle
    head: ParagraphStyle


@cache
def typography(size: float = 1.0) -> Typography:
    """All styles at `size`; registers the fonts on first use."""
    _register_fonts()

    def style(
        name: str,
        points: float,
        leading: float,
        *,
        before: float = 0.0,
        after: float = 0.0,
        bold: bool = False,
        color: Color = INK,
        indent: float = 0.0,
    ) -> ParagraphStyle:
        return ParagraphStyle(
            name,
            fontName=BOLD if bold else REGULAR,
            fontSize=size * points,
            leading=size * points * leading,
            spaceBefore=size * before,
            spaceAfter=size * after,
            textColor=color,
            leftIndent=size * indent,
            bulletIndent=size * (indent - 9.0),
            bulletFontName=REGULAR,
            bulletFontSize=size * points,
            allowWidows=0,
            allowOrphans=0,
        )

    return Typography(
        size=size,
        title=style("title", 19.0, 1.2, after=3.0, bold=True),
        subtitle=style("subtitle", 9.5, 1.35, after=2.0, color=SOFT_INK),
        section=style("section", 15.0, 1.25, after=7.0, bold=True),
        heading=style("heading", 10.5, 1.3, before=12.0, after=4.0, bold=True),
        body=style("body", 8.8, 1.45, after=5.5),
        small=style("small", 7.4, 1.4, after=4.5, color=SOFT_INK),
        bullet=style("bullet", 8.8, 1.45, after=3.0, indent=11.0),
        caption=style("caption", 7.6, 1.4),
        label=style("label", 7.6, 1.3, bold=True),
        note=style("note", 7.0, 1.35, color=SOFT_INK),
        cell=style("cell", 7.6, 1.35),
        head=style("head", 7.6, 1.35, bold=True),
    )


@cache
def _register_fonts() -> None:
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    pdfmetrics.registerFont(TTFont(REGULAR, str(folder / "DejaVuSans.ttf")))
    pdfmetrics.registerFont(TTFont(BOLD, str(folder / "DejaVuSans-Bold.ttf")))
    pdfmetrics.registerFontFamily(REGULAR, normal=REGULAR, bold=BOLD, italic=REGULAR, boldItalic=BOLD)


def printable(text: str) -> str:
    """A text with what the typeface cannot write replaced by its sign for that, and control characters by spaces."""
    _register_fonts()
    regular, bold = (pdfmetrics.getFont(name).face.charToGlyph for name in (REGULAR, BOLD))
    return "".join(
        character if ord(character) in regular and ord(character) in bold else _REPLACEMENT
        for character in (" " if ord(c) < 32 or ord(c) == 127 else c for c in text)
    )


_GROUP = re.compile(r"(?<=\d) (?=%|\d{3}(?!\d))")
_POWER = re.compile(r"\^([23])(?!\d)")


def markup(text: str, quantities: Mapping[str, Quantity] | None = None) -> str:
    """A plain text as reportlab's mark-up: quantities written, powers raised, no line broken within a number.

    Parameters
    ----------
    text : str
    quantities : mapping of str to Quantity, optional
        Those that the text may name in braces; without it braces are braces.

    Raises
    ------
    InputError
        If the text names a quantity that is not there.
    """
    words = text if quantities is None else filled(text, quantities)
    words = _POWER.sub(lambda power: "²³"[int(power[1]) - 2], words)
    return escape(_GROUP.sub("\u00a0", printable(words)))


def link(anchor: str, marked: str) -> str:
    """Marked-up text that leads to an anchor."""
    return f'<a href="#{escape(anchor)}" color="#{LINK.hexval()[2:]}">{marked}</a>'
