"""Charts of the report, drawn with matplotlib and set as vectors."""

from paxel_design.report.charts.style import GRAYS, LINE_STYLES, PALETTE, TEXT_WIDTH_MM, new_figure, settle, style

__all__ = ["GRAYS", "LINE_STYLES", "PALETTE", "TEXT_WIDTH_MM", "new_figure", "settle", "style"]
