"""Charts -> SVG that stands in the page itself: text stays text, and no two charts share an id."""

from __future__ import annotations

import html
import io
import re
from typing import TYPE_CHECKING

from paxel_design.report.charts.style import TEXT_WIDTH_MM, style
from paxel_design.report.html.markup import tag

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["chart_svg"]

_MM = 25.4

_READABLE = 0.8
"""A chart is never set smaller than this share of its size on paper: 8 pt letters stay legible, the page scrolls."""

_NO_METADATA = {"Date": None, "Creator": None, "Format": None, "Type": None}

_IDS = re.compile(r'(\bid="|\bhref="#|url\(#)')
_SIZE = re.compile(r'\s(?:width|height)="[^"]*"')


def chart_svg(figure: Figure, name: str, caption: str) -> str:
    """A drawing as an `svg` element in a box that scrolls sideways where the screen is narrow.

    Parameters
    ----------
    figure : matplotlib Figure
    name : str
        Unique in the page; every id in the drawing begins with it.
    caption : str
        What a screen reader says.
    """
    import matplotlib

    file = io.StringIO()
    with matplotlib.rc_context(style()):
        figure.savefig(file, format="svg", metadata=_NO_METADATA)
    drawing = file.getvalue()
    head, body = drawing[drawing.index("<svg") :].split(">", 1)  # without the XML declaration and the document type
    width_mm = figure.get_figwidth() * _MM
    size = f"width:{100 * width_mm / TEXT_WIDTH_MM:.4g}%;min-width:{_READABLE * width_mm:.4g}mm"
    head = _SIZE.sub("", head) + f' role="img" aria-label="{html.escape(caption)}" style="{size}"'
    return tag("div", _IDS.sub(rf"\g<1>{name}--", f"{head}>{body}".strip()), class_="chart scroll", tabindex="0")
