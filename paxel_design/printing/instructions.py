"""What to tell the print shop, and what to check on the print, as plain text (``print-sheet.txt``)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from paxel_design.printing.blocks import CellRaster, palette_of, plan_cell_raster, printed_shares
from paxel_design.printing.furniture import RULER_MM
from paxel_design.printing.page_plan import PagePlan, plan_pages
from paxel_design.printing.pdfx import OUTPUT_CONDITION
from paxel_design.printing.plates import recipe_of
from paxel_design.printing.sheet import Sheet, pattern_summary, sheet_of
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.version import WRITER

__all__ = ["print_sheet_text"]


def print_sheet_text(
    pattern: Pattern,
    *,
    dpi: float = 1440,
    ink_spread_um: float = 0.0,
    caption: str = "",
    page: str | tuple[float, float] = "auto",
    recipe: Mapping[str, Any] | None = None,
) -> str:
    """The text that goes to the print shop with the PDF that `write_pattern_pdf` makes of the same arguments.

    Raises
    ------
    InputError
        As `write_pattern_pdf`.
    """
    raster = plan_cell_raster(pattern.dot_size_mm, ink_spread_um)
    sheet = sheet_of(pattern, dpi=dpi, ink_spread_um=raster.ink_spread_um, caption=caption, recipe=recipe)
    plan = plan_pages(sheet.page_mm, page)
    width_mm, height_mm = pattern.size_mm
    return f"""\
{caption or "Paxel print sheet"}
{pattern_summary(pattern)}

FOR THE PRINT SHOP
  File         pattern.pdf, PDF/X-4, {_pages_text(plan)}
  Cut to       {sheet.trim_mm[0]:.1f} x {sheet.trim_mm[1]:.1f} mm{"" if plan.tiled else " (TrimBox)"}; \
nothing bleeds, the border is bare paper
  Pattern      {width_mm:g} x {height_mm:g} mm, dots of {pattern.dot_size_mm:g} mm at {pattern.angle_deg:g} degrees
  Scale        exactly 100 %: no fitting to the page, no scaling to the margins
  Resolution   {dpi:g} dpi or finer ({pattern.dot_size_mm * dpi / 25.4:.1f} dots of the printer a dot of the pattern)
  Inks         {_inks_text(sheet)}
{_shares_text(pattern, sheet, raster)}
  Colour       colour management off, or "keep numbers": what stands in the file is amounts of ink; no ink limiting
               that turns solids into screens, no conversion of K to CMY. The file names {OUTPUT_CONDITION} as its
               print condition because PDF/X-4 wants one; your own inks and paper will do.
  Edges        no trapping (the file says Trapped: False), no overprint, no smoothing or sharpening,
               no halftone screen inside the dots
  Paper        flat, matt, without optical brightener; with it one unprinted sheet of the same paper, at least
               {width_mm:g} x {height_mm:g} mm: it is the white surface of the installation

{_spread_text(raster)}

CHECK ON THE PRINT
  1. Measure both rulers between the middles of their outer ticks: {RULER_MM} mm along x and along y.
     More than 0.5 mm off: the sheet was scaled, have it printed again. Else write the two lengths into
     paxel.toml: [printer] measured_ruler_mm = [x, y].
  2. Under a loupe the dots are squares with one solid ink each; paper dots carry no ink.
  3. The patches above the pattern are one solid ink each, large enough for a spectrophotometer; the outlined one
     is bare paper.
  4. The four black squares at the corners are how a camera finds the pattern: keep them clean and uncovered. The
     code holds the description of the pattern; any telephone reads it.

{WRITER}
"""


def _pages_text(plan: PagePlan) -> str:
    size = f"{plan.page_mm[0]:.1f} x {plan.page_mm[1]:.1f} mm"
    if not plan.tiled:
        return f"one page of {size} with crop marks"
    return (
        f"{plan.pages} pages of {size}: {plan.rows} rows of {plan.columns} parts\n"
        f"               that overlap by {plan.overlap_mm:g} mm, and a map of how they go together"
    )


def _inks_text(sheet: Sheet) -> str:
    if not sheet.plates.spots:
        return "solids only, in DeviceCMYK; please print the numbers as they are:"
    spots = ", ".join(f'"{colorant.spot}"' for colorant in sheet.plates.spots)
    return (
        f"solids only, on these spot plates: {spots}.\n"
        "               Load these inks by name and do not convert them to process colours; what a screen\n"
        "               shows of them is a stand-in:"
    )


def _shares_text(pattern: Pattern, sheet: Sheet, raster: CellRaster) -> str:
    shares = [float(share) for share in printed_shares(pattern, raster, palette_of(sheet.colorants, raster))]
    lines = [
        f"    {colorant.name:12s} {recipe_of(colorant):20s} {100 * share:5.1f} % of the area"
        for colorant, share in zip(sheet.colorants, shares, strict=False)
    ]
    if len(shares) > len(sheet.colorants):  # shrunk ink leaves paper
        lines.append(f"    {'bare paper':12s} {recipe_of(None):20s} {100 * shares[-1]:5.1f} % of the area")
    return "\n".join(lines)


def _spread_text(raster: CellRaster) -> str:
    if not raster.shrink:
        return "The dots are drawn at their nominal size; ink spread is not compensated."
    return f"The dots are drawn {raster.ink_spread_um:.1f} um smaller at every edge, against ink spread."
