"""The test sheet for measuring ink spread: bare paper, and of each ink a solid and dots of three sizes, numbered.

With it goes a table to write the readings into; `ink_spread` reads it. Dots are drawn as the pattern's are, by the
same images at the same angle, and without compensation.
"""

from __future__ import annotations

import io
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pikepdf

from paxel_design.printing.blocks import plan_cell_raster
from paxel_design.printing.cells_pdf import PT_PER_MM, add_cells, cell_operators
from paxel_design.printing.furniture import (
    PATCH_MM,
    PATCH_PITCH_MM,
    PATCH_ROW_MM,
    RULER_MM,
    SMALL_TEXT_MM,
    Patch,
    Text,
    crop_marks,
    ruler,
    wrap_text,
)
from paxel_design.printing.ink_spread import PAPER, SOLID
from paxel_design.printing.page import draw_sheet
from paxel_design.printing.page_plan import plan_pages
from paxel_design.printing.pages import lay_on_pages
from paxel_design.printing.pdfx import pdfx4_bytes
from paxel_design.printing.plates import Plates, is_paper, plates_of
from paxel_design.printing.sheet import BLEED_MM, Sheet
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import spectra_to_XYZ
from paxel_runtime.model.pattern import Colorant, Pattern, colorant_library
from paxel_runtime.version import WRITER

__all__ = ["DOT_SIZES_MM", "SheetPatch", "measurements_table", "patches_of", "write_test_sheet"]

DOT_SIZES_MM = (0.15, 0.3, 0.6)
"""Small ones tell ink spread from scattering best: twice as large, the uncertainty is four times as large."""

_FEWEST_PIXELS = 5.0  # device pixels along the smallest dot
_COLUMNS = 1 + len(DOT_SIZES_MM)
_EDGE_MM = 10.0
_BELOW_MM = 26.0  # ruler and caption
_TITLE = "Paxel test sheet for ink spread"
_HOW = (
    "Read every patch in its middle, by its number, with one meter",
    "on a white backing. Write X, Y, Z or Y into measurements.csv.",
)
_TEXT_MM = 2.8
_LINE_MM = 4.6
_LIGHTEST_INK = 0.9  # of the paper's XYZ, in that of X, Y and Z where the ink is darkest


@dataclass(frozen=True, eq=False)
class SheetPatch:
    """One numbered patch.

    Attributes
    ----------
    number : int
        Counted from 1, paper first.
    colorant : Colorant, optional
        None for bare paper.
    dot_mm : float
        Dot size of a checkerboard of ink and paper; 0 for a solid.
    lower_left_mm : (float, float)
        From the middle of the sheet; it is `PATCH_MM` wide and high.
    """

    number: int
    colorant: Colorant | None
    dot_mm: float
    lower_left_mm: tuple[float, float]

    @property
    def dots(self) -> str:
        """What stands in the column ``dots_mm``."""
        if self.colorant is None:
            return PAPER
        return f"{self.dot_mm:g}" if self.dot_mm else SOLID

    @property
    def name(self) -> str:
        """Its line on the sheet."""
        if self.colorant is None:
            return f"{self.number}  bare paper"
        return f"{self.number}  {self.colorant.name}, {self.dots}{' mm' if self.dot_mm else ''}"


def patches_of(colorants: Sequence[Colorant], dpi: float) -> list[SheetPatch]:
    """The patches of a sheet for some inks: dots of `DOT_SIZES_MM`, or in that proportion as the printer can.

    Raises
    ------
    InputError
        If no colorant is darker than the paper.
    """
    paper_XYZ = spectra_to_XYZ(colorant_library()["white"].reflectance)
    inks = [
        colorant
        for colorant in colorants
        if not is_paper(colorant) and (spectra_to_XYZ(colorant.reflectance) / paper_XYZ).min() < _LIGHTEST_INK
    ]
    if not inks:
        raise InputError(
            f"a test sheet needs an ink that is darker than the paper, got {', '.join(c.name for c in colorants)}: "
            "make it with a pattern that has black, on the same printer and paper"
        )
    smallest = max(DOT_SIZES_MM[0], np.ceil(1000 * _FEWEST_PIXELS * 25.4 / dpi) / 1000)
    sizes = [0.0, *(float(smallest * size / DOT_SIZES_MM[0]) for size in DOT_SIZES_MM)]
    kinds = [(None, 0.0), *((ink, size) for ink in inks for size in sizes)]
    return [
        SheetPatch(number, ink, size, _lower_left(number, len(inks))) for number, (ink, size) in enumerate(kinds, 1)
    ]


def measurements_table(patches: Sequence[SheetPatch]) -> str:
    """The CSV to fill in, see `paxel_design.printing.ink_spread.parse_readings`."""
    lines = [
        "# Readings of the test sheet's patches, by number. Keep the columns that your meter gives: Y alone, or X,Y,Z,",
        "# or put wavelengths in their place. Any unit will do: only ratios to the paper count. A patch may have more",
        "# than one line; take out the lines you did not read. Then: paxel pattern --ink-spread-from measurements.csv",
        "patch,colorant,dots_mm,X,Y,Z",
    ]
    for patch in patches:
        name = patch.colorant.name if patch.colorant else "white"
        lines.append(f"{patch.number},{name},{patch.dots},,,")
    return "\n".join(lines) + "\n"


def write_test_sheet(
    colorants: Sequence[Colorant],
    path: str | os.PathLike[str],
    *,
    dpi: float = 1440,
    angle_deg: float = 30.0,
    page: str | tuple[float, float] = "auto",
) -> list[SheetPatch]:
    """Write the test sheet of a pattern's inks as a PDF/X-4.

    Parameters
    ----------
    colorants : sequence of Colorant
        Of the pattern; paper is left out.
    path : path-like
    dpi : float
        Of the printer: the smallest dot has at least 5 of its pixels.
    angle_deg : float
        Of the dots, as in the pattern.
    page : str or (float, float)
        See `paxel_design.printing.page_plan.plan_pages`.

    Returns
    -------
    list of SheetPatch

    Raises
    ------
    InputError
        If no ink is darker than the paper, or `page` is unknown.
    """
    patches = patches_of(colorants, dpi)
    inks = [patch.colorant for patch in patches if patch.colorant and not patch.dot_mm]
    plates = plates_of(inks)
    note = f"{dpi:g} dpi, dots at {angle_deg:g}° as drawn, not compensated; print at 100 % (no scaling), {WRITER}"
    sheet = _sheet(patches, inks, plates, note)
    inked = [patch for patch in patches if patch.colorant]
    with pikepdf.open(io.BytesIO(draw_sheet(sheet, [_place(patch) for patch in inked]))) as pdf:
        for patch in inked:
            form = _form(pdf, patch, plates, angle_deg)
            pdf.pages[0].add_resource(form, pikepdf.Name.XObject, pikepdf.Name(_form_name(patch)))
        lay_on_pages(pdf, plan_pages(sheet.page_mm, page))
        content = pdfx4_bytes(pdf, title=_TITLE, subject=", ".join(ink.name for ink in inks))
    Path(path).write_bytes(content)
    return patches


def _lower_left(number: int, inks: int) -> tuple[float, float]:
    """Paper stands first, below it a row for each ink, with room for ruler and caption under them."""
    row, column = divmod(number + _COLUMNS - 2, _COLUMNS) if number > 1 else (0, 0)
    x = -((_COLUMNS - 1) * PATCH_PITCH_MM + PATCH_MM) / 2 + column * PATCH_PITCH_MM
    return x, ((inks + 1) / 2 - 1 - row) * PATCH_ROW_MM + _BELOW_MM / 2


def _sheet(patches: Sequence[SheetPatch], inks: Sequence[Colorant], plates: Plates, note: str) -> Sheet:
    """Everything but the ink: names, the outline of the paper, ruler, caption, crop marks."""
    half_width, half_height = _COLUMNS * PATCH_PITCH_MM / 2, (len(inks) + 1) * PATCH_ROW_MM / 2
    texts = []
    for patch in patches:
        x, y = patch.lower_left_mm
        texts.append(Text(patch.name, (x, y + PATCH_MM + 1.4), SMALL_TEXT_MM))
    left, top = patches[0].lower_left_mm
    for i, line in enumerate((_TITLE, *_HOW)):
        texts.append(Text(line, (left + PATCH_PITCH_MM, top + PATCH_MM - 3.0 - i * _LINE_MM), _TEXT_MM))
    lines, figures = ruler((-RULER_MM / 2, _BELOW_MM / 2 - half_height - 10.0), along_x=True)
    caption = wrap_text(note, SMALL_TEXT_MM, 2 * half_width)
    texts += [
        Text(line, (left, _BELOW_MM / 2 - half_height - 20.0 - i * _LINE_MM), SMALL_TEXT_MM)
        for i, line in enumerate(caption)
    ]
    trim_mm = (2 * (half_width + _EDGE_MM), 2 * half_height + _BELOW_MM + 2 * _EDGE_MM)
    paper = Patch((left, top), (PATCH_MM, PATCH_MM), None)
    marks = crop_marks(trim_mm, BLEED_MM + 1.0)
    return Sheet(trim_mm, tuple(inks), plates, (*marks, *lines), (paper,), (*texts, *figures), (), (), "")


def _form_name(patch: SheetPatch) -> str:
    return f"/Patch-{patch.number}"


def _place(patch: SheetPatch) -> str:
    """The operators that draw a patch about its middle."""
    x, y = (PT_PER_MM * (v + PATCH_MM / 2) for v in patch.lower_left_mm)
    return f"q 1 0 0 1 {x:.5f} {y:.5f} cm {_form_name(patch)} Do Q"


def _form(pdf: pikepdf.Pdf, patch: SheetPatch, plates: Plates, angle_deg: float) -> pikepdf.Object:
    """A patch as a form about its middle: a pattern of its own, drawn as the print sheet's is."""
    assert patch.colorant is not None
    library = {**colorant_library(), patch.colorant.name: patch.colorant}
    names, cells = (
        ((patch.colorant.name, "white"), [[0, 1], [1, 0]]) if patch.dot_mm else ((patch.colorant.name,), [[0]])
    )
    pattern = Pattern(
        "checkerboard",
        names,
        np.array(cells, np.uint8),
        patch.dot_mm or PATCH_MM,
        angle_deg,
        (PATCH_MM, PATCH_MM),
        library=library,
    )
    raster = plan_cell_raster(pattern.dot_size_mm, 0.0)
    half = PT_PER_MM * PATCH_MM / 2
    page = pdf.add_blank_page(page_size=(2 * half, 2 * half))
    page.contents_add("\n".join(cell_operators(pattern, raster)).encode("ascii"))
    add_cells(pdf, page, pattern, raster, plates, vector=False)
    form = page.as_form_xobject()
    form.BBox = pikepdf.Array([-half, -half, half, half])
    del pdf.pages[-1]
    return form
