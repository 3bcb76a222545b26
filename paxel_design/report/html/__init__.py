"""The report as one HTML file that works offline, with bodies that turn."""

from paxel_design.report.html.page import write_html

__all__ = ["write_html"]
