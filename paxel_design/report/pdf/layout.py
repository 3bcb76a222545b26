"""Where things are on the pages: the page's measures in points, and the record of what was set where.

The record serves three ends: the second pass knows the page of every anchor, the finished file gets the pictures that
were reserved, and tests see that nothing overlaps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from paxel_design.report.charts import TEXT_WIDTH_MM

__all__ = [
    "FIRST_TOP_PT",
    "FRAME_HEIGHT_PT",
    "LEFT_PT",
    "LOWER_PT",
    "PAGE_HEIGHT_PT",
    "PAGE_WIDTH_PT",
    "PT_PER_MM",
    "TEXT_WIDTH_PT",
    "TOP_PT",
    "Box",
    "Layout",
    "set_anchor",
]

PT_PER_MM = 72 / 25.4

PAGE_WIDTH_PT, PAGE_HEIGHT_PT = 210 * PT_PER_MM, 297 * PT_PER_MM
TEXT_WIDTH_PT = TEXT_WIDTH_MM * PT_PER_MM
LEFT_PT = (PAGE_WIDTH_PT - TEXT_WIDTH_PT) / 2

LOWER_PT = 20 * PT_PER_MM
"""From the page's lower edge to the text."""

TOP_PT = 24 * PT_PER_MM
"""From the page's upper edge to the text, below the running head."""

FIRST_TOP_PT = 15 * PT_PER_MM
"""The same on the first page, which has a title in its place."""

FRAME_HEIGHT_PT = PAGE_HEIGHT_PT - TOP_PT - LOWER_PT
"""Height of the text on every page but the first."""


@dataclass(frozen=True)
class Box:
    """A block as set: left, lower edge, width and height in points from the page's lower left corner."""

    page: int
    x: float
    y: float
    width: float
    height: float
    kind: str


@dataclass(eq=False)
class Layout:
    """What one pass over the document set where; pages count from 1.

    Attributes
    ----------
    pages : dict of str to int
        Page of every anchor.
    total : int
        Number of pages.
    boxes : list of Box
        All blocks, in reading order.
    objects : dict of int to set of str
        Names of the pictures and charts that each page refers to.
    """

    pages: dict[str, int] = field(default_factory=dict)
    total: int = 0
    boxes: list[Box] = field(default_factory=list)
    objects: dict[int, set[str]] = field(default_factory=dict)


def set_anchor(canvas: Any, layout: Layout, anchor: str, above_pt: float) -> None:
    """Make the place `above_pt` over the canvas's origin the target of links to `anchor`."""
    _, y = canvas.absolutePosition(0, above_pt)
    canvas.bookmarkPage(anchor, fit="XYZ", left=0, top=y + 6, zoom=0)
    layout.pages[anchor] = canvas.getPageNumber()
