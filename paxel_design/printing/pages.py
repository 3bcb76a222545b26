"""A sheet on pages: every page shows its part of the one drawing, which the file holds once, between its marks."""

from __future__ import annotations

import io

import pikepdf

from paxel_design.printing.cells_pdf import PT_PER_MM
from paxel_design.printing.drawing import Drawing
from paxel_design.printing.page_marks import page_marks
from paxel_design.printing.page_plan import PagePlan, Tile
from paxel_runtime.errors import InputError

__all__ = ["lay_on_pages"]


def lay_on_pages(pdf: pikepdf.Pdf, plan: PagePlan) -> None:
    """Turn a PDF of one sheet into the pages of a plan, and a map of them at the end.

    Blocks and furniture of the sheet stand in the file once; a page names those blocks that reach into it, since
    software that prints works through all of an image before it clips it. The file grows by 1 to 2 kB a page. On
    a plan of one page the sheet is moved to its middle.

    Parameters
    ----------
    pdf : pikepdf.Pdf
        One page, ``plan.sheet_mm`` large; changed in place.
    plan : PagePlan

    Raises
    ------
    InputError
        If the PDF has more pages than one, or its page is not the plan's sheet.
    """
    box = [float(v) for v in pdf.pages[0].mediabox]
    found_mm = tuple((box[i + 2] - box[i]) / PT_PER_MM for i in (0, 1))
    if len(pdf.pages) != 1 or max(abs(a - b) for a, b in zip(found_mm, plan.sheet_mm, strict=True)) > 0.01:
        raise InputError(
            f"a plan of pages must be laid on one sheet of {plan.sheet_mm[0]:.2f} x {plan.sheet_mm[1]:.2f} mm, "
            f"got {len(pdf.pages)} of {found_mm[0]:.2f} x {found_mm[1]:.2f} mm"
        )
    if not plan.tiled:
        _centre(pdf.pages[0], plan)
        return
    drawing = Drawing.of(pdf)
    with pikepdf.open(io.BytesIO(page_marks(plan))) as marks:
        pdf.pages.extend(marks.pages)
    del pdf.pages[0]
    for page, tile in zip(pdf.pages, plan.tiles(), strict=False):
        box_pt = _box_on_sheet(plan, tile, (box[0], box[1]))
        page.Resources.XObject = pikepdf.Dictionary(Sheet=drawing.part(pdf, box_pt))
        page.contents_add(_place(plan, box_pt), prepend=True)
    for page in pdf.pages:
        for key in ("/BleedBox", "/TrimBox"):
            page.obj[key] = page.mediabox


def _box_on_sheet(plan: PagePlan, tile: Tile, corner_pt: tuple[float, float]) -> tuple[float, float, float, float]:
    """A tile in the sheet's own points: left, bottom, right, top."""
    left, bottom = corner_pt[0] + PT_PER_MM * tile.left_mm, corner_pt[1] + PT_PER_MM * tile.bottom_mm
    return left, bottom, left + PT_PER_MM * plan.tile_mm[0], bottom + PT_PER_MM * plan.tile_mm[1]


def _place(plan: PagePlan, box_pt: tuple[float, float, float, float]) -> bytes:
    """Draw the part of the sheet in its place on the page; the part's own box clips it."""
    margin = PT_PER_MM * plan.margin_mm
    return f"q 1 0 0 1 {margin - box_pt[0]:.5f} {margin - box_pt[1]:.5f} cm /Sheet Do Q\n".encode()


def _centre(page: pikepdf.Page, plan: PagePlan) -> None:
    """Move the drawing and its boxes to the middle of a larger page."""
    x, y = (PT_PER_MM * (side - own) / 2 for side, own in zip(plan.page_mm, plan.sheet_mm, strict=True))
    if max(x, y) < 1e-6:
        return
    page.contents_add(f"q 1 0 0 1 {x:.5f} {y:.5f} cm\n".encode(), prepend=True)
    page.contents_add(b"\nQ")
    for key in ("/BleedBox", "/TrimBox", "/CropBox", "/ArtBox"):
        if key in page.obj:
            left, bottom, right, top = (float(v) for v in page.obj[key])
            page.obj[key] = pikepdf.Array([left + x, bottom + y, right + x, top + y])
    page.mediabox = pikepdf.Array([0, 0, *(PT_PER_MM * side for side in plan.page_mm)])
