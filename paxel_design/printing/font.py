"""The one typeface of sheet and preview: Bitstream Vera Sans, which comes with reportlab and may be embedded."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import reportlab
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont

__all__ = ["font_name", "font_path", "missing_characters", "text_width_mm"]


def font_path() -> Path:
    """The TrueType file."""
    return Path(reportlab.__file__).parent / "fonts" / "Vera.ttf"


@cache
def font_name() -> str:
    """Name under which reportlab knows the typeface, registered on first use."""
    name = "paxel-sans"
    pdfmetrics.registerFont(TTFont(name, str(font_path())))
    return name


def text_width_mm(text: str, height_mm: float) -> float:
    """Width of a line of text in font size `height_mm`."""
    return float(pdfmetrics.stringWidth(text, font_name(), height_mm))


def missing_characters(text: str) -> str:
    """The characters of a text that the typeface has no glyph for, each once."""
    glyphs = pdfmetrics.getFont(font_name()).face.charToGlyph
    return "".join(dict.fromkeys(character for character in text if ord(character) not in glyphs))
