"""How every chart of a report looks: one typeface, sizes in millimetres, line styles that survive gray print."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["GRAYS", "LINE_STYLES", "PALETTE", "TEXT_WIDTH_MM", "new_figure", "settle", "style"]

TEXT_WIDTH_MM = 174.0
"""Width of the text on an A4 page of the report: the widest chart."""

PALETTE = ("#1f4e9c", "#c8501e", "#2e8b57", "#7a3f9d", "#b8860b", "#4d4d4d")
"""Colours in turn; their lightness differs enough for gray print when line styles or hatches differ too."""

GRAYS = ("#1c1c1e", "#626266", "#a8a8ac", "#dedee2")

LINE_STYLES = ("-", "--", ":", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))

_STYLE: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.labelsize": 8.0,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": GRAYS[1],
    "axes.grid": True,
    "grid.color": GRAYS[3],
    "grid.linewidth": 0.4,
    "axes.axisbelow": True,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "paxel",
    "figure.facecolor": "white",
    "figure.constrained_layout.use": True,
}


_LAYOUT_DPI = 300
"""Widths of texts are whole pixels on a screen and are not in PDF and SVG: measured so fine, they agree."""

_LAYOUT_ROUNDS = 3
"""Labels take room from the axes, whose ticks change then: it has come to rest by the third round."""


def style() -> dict[Any, Any]:
    """The matplotlib settings under which charts are made and saved (`matplotlib.rc_context`)."""
    return dict(_STYLE)


def new_figure(height_mm: float, width_mm: float = TEXT_WIDTH_MM) -> Figure:
    """An empty figure of this size in the report's style.

    Draw into it inside ``matplotlib.rc_context(style())``; it belongs to no window.
    """
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context(style()):
        return Figure(figsize=(width_mm / 25.4, height_mm / 25.4))


def settle(figure: Figure) -> None:
    """Lay a finished figure out once and for all.

    Constrained layout goes on from the last drawing: without this, a chart would depend on what was drawn of it before,
    and be another in each format.
    """
    import matplotlib

    dpi = figure.dpi
    with matplotlib.rc_context({**style(), "text.hinting": "none"}):
        figure.set_dpi(_LAYOUT_DPI)
        for _ in range(_LAYOUT_ROUNDS):
            figure.draw_without_rendering()
    figure.set_dpi(dpi)
    figure.set_layout_engine("none")
