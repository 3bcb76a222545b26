"""The gamut analysis report: what an installation can show, as PDF, HTML and JSON."""

__all__: list[str] = []
