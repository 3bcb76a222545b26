"""A sheet larger than the printer's paper: over which pages it is spread, and which part of it lies on each.

Neighbours overlap: pages are cut at the left and glued into rows, rows are cut at the top and glued into the sheet.
This file knows sizes only.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

from paxel_runtime.errors import InputError

__all__ = ["LARGEST_PAGE_MM", "MARGIN_MM", "OVERLAP_MM", "PAPERS_MM", "PagePlan", "Tile", "paper_mm", "plan_pages"]

LARGEST_PAGE_MM = 5080.0
"""14400 pt, the largest page of a PDF that every print shop's software takes."""

MARGIN_MM = 10.0
"""Rim of a page without a part of the sheet: it takes ticks and label, and few printers print up to the edge."""

OVERLAP_MM = 10.0

PAPERS_MM: dict[str, tuple[float, float]] = {
    "A0": (841.0, 1189.0),
    "A1": (594.0, 841.0),
    "A2": (420.0, 594.0),
    "A3": (297.0, 420.0),
    "A4": (210.0, 297.0),
    "A3+": (329.0, 483.0),
    "letter": (215.9, 279.4),
    "legal": (215.9, 355.6),
    "tabloid": (279.4, 431.8),
}
"""Sizes of paper by name, width and height of the upright sheet."""

_MOST_PAGES = 2000
_LEAST_TILE_MM = 40.0


@dataclass(frozen=True)
class Tile:
    """The part of the sheet on one page.

    Attributes
    ----------
    row, column : int
        Counted from 0, row 0 on top.
    left_mm, bottom_mm : float
        Its lower left corner on the sheet, from the sheet's lower left corner; may lie outside it.
    """

    row: int
    column: int
    left_mm: float
    bottom_mm: float


@dataclass(frozen=True)
class PagePlan:
    """How a sheet is spread over pages.

    Attributes
    ----------
    sheet_mm : (float, float)
        Width and height of the sheet as it is drawn, crop marks included.
    page_mm : (float, float)
        Width and height of a page.
    rows, columns : int
    overlap_mm : float
        What neighbours have in common.
    margin_mm : float
        Rim of each page; 0 where the sheet is one page.
    """

    sheet_mm: tuple[float, float]
    page_mm: tuple[float, float]
    rows: int = 1
    columns: int = 1
    overlap_mm: float = 0.0
    margin_mm: float = 0.0

    @property
    def tiled(self) -> bool:
        """Whether the sheet is cut into parts."""
        return self.margin_mm > 0

    @property
    def tile_mm(self) -> tuple[float, float]:
        """Width and height of the part of the sheet on a page."""
        return self.page_mm[0] - 2 * self.margin_mm, self.page_mm[1] - 2 * self.margin_mm

    @property
    def pages(self) -> int:
        """Number of pages, the assembly map included."""
        return self.rows * self.columns + (1 if self.tiled else 0)

    def tiles(self) -> Iterator[Tile]:
        """Every part of the sheet, row by row from the top, each from the left; all together lie about its middle."""
        steps = tuple(side - self.overlap_mm for side in self.tile_mm)
        left = (self.sheet_mm[0] - self.columns * steps[0] - self.overlap_mm) / 2
        bottom = (self.sheet_mm[1] - self.rows * steps[1] - self.overlap_mm) / 2
        for row in range(self.rows):
            for column in range(self.columns):
                yield Tile(row, column, left + column * steps[0], bottom + (self.rows - 1 - row) * steps[1])

    def number_of(self, tile: Tile) -> int:
        """Number of a tile's page, counted from 1."""
        return tile.row * self.columns + tile.column + 1


def paper_mm(page: str | tuple[float, float]) -> tuple[float, float]:
    """Width and height of a page by name or as given.

    Raises
    ------
    InputError
        If the name is unknown or a side is not a positive number.
    """
    if isinstance(page, str):
        if page not in PAPERS_MM:
            raise InputError(
                f'printer.page must be "auto", {", ".join(PAPERS_MM)}, or [width, height] in mm, got {page!r}'
            )
        return PAPERS_MM[page]
    width_mm, height_mm = page
    if not (0 < width_mm <= LARGEST_PAGE_MM and 0 < height_mm <= LARGEST_PAGE_MM):
        raise InputError(f"a page must be at most {LARGEST_PAGE_MM:g} mm (14400 pt) on each side, got {list(page)} mm")
    return float(width_mm), float(height_mm)


def plan_pages(
    sheet_size_mm: tuple[float, float], page: str | tuple[float, float] = "auto", overlap_mm: float = OVERLAP_MM
) -> PagePlan:
    """Spread a sheet over as few pages as its size asks for.

    Parameters
    ----------
    sheet_size_mm : (float, float)
        Width and height of the sheet, crop marks included.
    page : str or (float, float)
        ``"auto"``, one page as large as the sheet; a name of `PAPERS_MM`, upright or on its side, whichever takes
        fewer pages; or width and height, as given. A sheet that fits lies in the middle of its one page, without
        ticks.
    overlap_mm : float
        What neighbours have in common, >= 0.

    Raises
    ------
    InputError
        If the page is unknown, larger than a PDF's page may be, or too small to hold a useful part of the sheet.
    """
    width_mm, height_mm = sheet_size_mm
    if page == "auto":
        if max(sheet_size_mm) > LARGEST_PAGE_MM:
            raise InputError(
                f"a sheet on one page must be at most {LARGEST_PAGE_MM:g} mm on each side with its border, got "
                f'{width_mm:g} x {height_mm:g} mm: set printer.page to your printer\'s paper, such as "A0" or '
                "[1370, 2000] for a roll, and it is cut into pages that overlap"
            )
        return PagePlan(sheet_size_mm, sheet_size_mm)
    given = paper_mm(page)
    shapes = [given, given[::-1]] if isinstance(page, str) else [given]
    for shape in shapes:
        if width_mm <= shape[0] and height_mm <= shape[1]:
            return PagePlan(sheet_size_mm, shape)
    tile_mm = min(given) - 2 * MARGIN_MM
    if not 0 <= overlap_mm <= tile_mm / 2 or tile_mm < _LEAST_TILE_MM:
        raise InputError(
            f"a page must leave at least {_LEAST_TILE_MM:g} mm of the sheet within margins of {MARGIN_MM:g} mm, and "
            f"pages overlap by at most half of it, got a page of {given[0]:g} x {given[1]:g} mm and an overlap of "
            f"{overlap_mm:g} mm: take larger paper"
        )
    plans = [_plan(sheet_size_mm, shape, overlap_mm) for shape in shapes]
    best = min(plans, key=lambda plan: plan.pages)
    if best.pages > _MOST_PAGES:
        raise InputError(
            f"a sheet must need at most {_MOST_PAGES} pages, got {best.pages} of {given[0]:g} x {given[1]:g} mm: take "
            'larger paper, such as "A0", or [1370, 2000] for a roll'
        )
    return best


def _plan(sheet_mm: tuple[float, float], page_mm: tuple[float, float], overlap_mm: float) -> PagePlan:
    def count(side_mm: float, page_side_mm: float) -> int:
        step_mm = page_side_mm - 2 * MARGIN_MM - overlap_mm
        return max(1, ceil((side_mm - overlap_mm) / step_mm - 1e-9))

    columns, rows = (count(side, page_side) for side, page_side in zip(sheet_mm, page_mm, strict=True))
    return PagePlan(sheet_mm, page_mm, rows, columns, overlap_mm, MARGIN_MM)
