"""A pattern as a PDF/X-4 in true millimetres that a print shop accepts.

The cells are the block images of `blocks`, the furniture comes from `sheet`, spot inks are plates of their own, fonts
are embedded, and equal arguments give equal bytes. The steps: lay out, draw (`page`), add what reportlab lacks
(`cells_pdf`), spread over pages (`pages`), state the print condition (`pdfx`).
"""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pikepdf

from paxel_design.printing.blocks import CellRaster, palette_of, plan_cell_raster, printed_shares
from paxel_design.printing.cells_pdf import add_cells
from paxel_design.printing.fiducials import DICTIONARY, FIDUCIAL_MM, Fiducial
from paxel_design.printing.page import draw_page
from paxel_design.printing.page_plan import PagePlan, plan_pages
from paxel_design.printing.pages import lay_on_pages
from paxel_design.printing.pdfx import pdfx4_bytes
from paxel_design.printing.sheet import Sheet, pattern_summary, sheet_of
from paxel_runtime.model.pattern import Pattern

__all__ = ["FiducialFigures", "PrintFigures", "write_pattern_pdf"]


@dataclass(frozen=True)
class FiducialFigures:
    """The markers of a sheet: their dictionary in OpenCV, the edge of each, and where they lie about the pattern."""

    dictionary: str
    size_mm: float
    markers: tuple[Fiducial, ...]


@dataclass(frozen=True)
class PrintFigures:
    """What `write_pattern_pdf` made.

    Attributes
    ----------
    sheet_mm, trim_mm : (float, float)
        Width and height of the sheet with crop marks, and after cutting.
    page_mm : (float, float)
        Width and height of each page of the file.
    pages : int
        Number of pages, the assembly map of a tiled sheet included.
    plates : tuple of str
        The inks it takes: process inks, then spot inks.
    subpixels_per_cell : int
        Sub-pixels along the edge of a cell in the block images.
    ink_spread_um : float
        The compensation that is realised, within 1 um of the one asked for.
    shares : dict of str to float
        Share of the area that each colorant has in the file, compensation included.
    fiducials : FiducialFigures
        Millimetres in the pattern's own frame.
    bytes : int
        Length of the file.
    """

    sheet_mm: tuple[float, float]
    trim_mm: tuple[float, float]
    page_mm: tuple[float, float]
    pages: int
    plates: tuple[str, ...]
    subpixels_per_cell: int
    ink_spread_um: float
    shares: dict[str, float]
    fiducials: FiducialFigures
    bytes: int


def write_pattern_pdf(
    pattern: Pattern,
    path: str | os.PathLike[str],
    *,
    dpi: float = 1440,
    ink_spread_um: float = 0.0,
    caption: str = "",
    page: str | tuple[float, float] = "auto",
    recipe: Mapping[str, Any] | None = None,
    vector: bool = False,
) -> PrintFigures:
    """Write the print sheet of a pattern as a PDF/X-4.

    Parameters
    ----------
    pattern : Pattern
        Lies at the centre of the sheet, clipped to its area. A colorant with a spot name is printed from a plate of
        its own.
    path : path-like
        The file to write.
    dpi : float
        Resolution of the printer: stated on the sheet, and a dot must have 3 of its dots; the drawing itself has no
        resolution.
    ink_spread_um : float
        How far the edge of a printed dot grows outward: each dot is drawn smaller by that at every edge.
    caption : str
        The user's own line on the sheet.
    page : str or (float, float)
        ``"auto"``: one page as large as the sheet; a paper's name or width and height in mm: see
        `paxel_design.printing.page_plan.plan_pages`.
    recipe : mapping, optional
        The further keywords of `make_pattern` that the cells were made with, for the sheet's code.
    vector : bool
        Draw outlines instead of images. Print software lets them grow by each device pixel they touch: for cutters
        and for comparison, not for print.

    Returns
    -------
    PrintFigures
        Sizes, and what was realised.

    Raises
    ------
    InputError
        If dots are too small for `dpi` or for `ink_spread_um`, the page is larger than a PDF may be, the caption
        or the code does not fit, or a spot plate is impossible.
    """
    raster = plan_cell_raster(pattern.dot_size_mm, ink_spread_um)
    sheet = sheet_of(pattern, dpi=dpi, ink_spread_um=raster.ink_spread_um, caption=caption, recipe=recipe)
    plan = plan_pages(sheet.page_mm, page)
    content = _render(pattern, sheet, raster, plan, title=caption or pattern_summary(pattern), vector=vector)
    Path(path).write_bytes(content)
    return PrintFigures(
        sheet_mm=sheet.page_mm,
        trim_mm=sheet.trim_mm,
        page_mm=plan.page_mm,
        pages=plan.pages,
        plates=sheet.plates.names,
        subpixels_per_cell=raster.subpixels,
        ink_spread_um=raster.ink_spread_um,
        shares=_shares(pattern, sheet, raster),
        fiducials=FiducialFigures(DICTIONARY, FIDUCIAL_MM, sheet.fiducials),
        bytes=len(content),
    )


def _render(pattern: Pattern, sheet: Sheet, raster: CellRaster, plan: PagePlan, *, title: str, vector: bool) -> bytes:
    with pikepdf.open(io.BytesIO(draw_page(pattern, sheet, raster))) as pdf:
        add_cells(pdf, pdf.pages[0], pattern, raster, sheet.plates, vector=vector)
        lay_on_pages(pdf, plan)
        return pdfx4_bytes(pdf, title=title, subject=pattern_summary(pattern))


def _shares(pattern: Pattern, sheet: Sheet, raster: CellRaster) -> dict[str, float]:
    palette = palette_of(sheet.colorants, raster)
    names = [*pattern.colorants, "bare paper"]
    shares = printed_shares(pattern, raster, palette)
    return {name: round(float(share), 6) for name, share in zip(names, shares, strict=False)}
