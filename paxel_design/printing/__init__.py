"""A `Pattern` as a sheet for the print shop: PDF, preview, and what to tell the shop."""

from paxel_design.printing.pdf import PrintFigures, write_pattern_pdf

__all__ = ["PrintFigures", "write_pattern_pdf"]
