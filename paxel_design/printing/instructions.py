"""What to tell the print shop, and what to check on the print, as plain text (``print-sheet.txt``)."""

from __future__ import annotations

from paxel_design.patterns import colorants_of
from paxel_design.printing.blocks import plan_cell_raster
from paxel_design.printing.sheet import RULER_MM, pattern_summary, recipe_of, sheet_of
from paxel_runtime.model.pattern import Pattern
from paxel_runtime.version import WRITER

__all__ = ["print_sheet_text"]


def print_sheet_text(pattern: Pattern, *, dpi: float = 1440, ink_spread_um: float = 0.0, caption: str = "") -> str:
    """The text that goes to the print shop with the PDF that `write_pattern_pdf` makes of the same arguments.

    Raises
    ------
    InputError
        As `write_pattern_pdf`.
    """
    raster = plan_cell_raster(pattern.dot_size_mm, ink_spread_um)
    sheet = sheet_of(pattern, dpi=dpi, ink_spread_um=raster.ink_spread_um, caption=caption)
    inks = "\n".join(
        f"    {colorant.name:10s} {recipe_of(colorant):16s} {100 * share:5.1f} % of the area"
        for colorant, share in zip(colorants_of(pattern.colorants), pattern.shares(), strict=True)
    )
    spread = (
        f"The dots are drawn {raster.ink_spread_um:.1f} um smaller at every edge, against ink spread."
        if raster.shrink
        else "The dots are drawn at their nominal size; ink spread is not compensated."
    )
    width_mm, height_mm = pattern.size_mm
    return f"""\
{caption or "Paxel print sheet"}
{pattern_summary(pattern)}

FOR THE PRINT SHOP
  File         pattern.pdf, one page of {sheet.page_mm[0]:.1f} x {sheet.page_mm[1]:.1f} mm with crop marks
  Cut to       {sheet.trim_mm[0]:.1f} x {sheet.trim_mm[1]:.1f} mm (TrimBox); nothing bleeds, the border is bare paper
  Pattern      {width_mm:g} x {height_mm:g} mm, dots of {pattern.dot_size_mm:g} mm at {pattern.angle_deg:g} degrees
  Scale        exactly 100 %: no fitting to the page, no scaling to the margins
  Resolution   {dpi:g} dpi or finer ({pattern.dot_size_mm * dpi / 25.4:.1f} dots of the printer a dot of the pattern)
  Inks         solids only, in DeviceCMYK; please print the numbers as they are:
{inks}
  Colour       no colour conversion, no ink limiting that turns solids into screens, no conversion of K to CMY
  Edges        no trapping, no overprint, no smoothing, no halftone screen inside the dots
  Paper        flat, matt, without optical brightener; one unprinted sheet of the same paper beside it, as large
               as the pattern (it is the white surface)

{spread}

CHECK ON THE PRINT
  1. Measure both rulers between the middles of their outer ticks: {RULER_MM} mm along x and along y.
     More than 0.5 mm off: the sheet was scaled, have it printed again. Keep the two lengths.
  2. Under a loupe the dots are squares with one solid ink each; paper dots carry no ink.
  3. The patches above the pattern are one solid ink each, large enough for a spectrophotometer.

{WRITER}
"""
