"""A `Pattern` as a sheet for the print shop: the PDF, a preview for the screen, and what to tell the shop."""

from paxel_design.printing.instructions import print_sheet_text
from paxel_design.printing.pdf import PrintFigures, write_pattern_pdf
from paxel_design.printing.preview import write_preview

__all__ = ["PrintFigures", "print_sheet_text", "write_pattern_pdf", "write_preview"]
