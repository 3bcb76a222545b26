"""report.pdf: the sections set on A4 pages."""

__all__: list[str] = []
