"""report.pdf: the sections set on A4 pages."""

from paxel_design.report.pdf.document import write_pdf

__all__ = ["write_pdf"]
