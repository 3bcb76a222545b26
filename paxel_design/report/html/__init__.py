"""report.html: the sections in one file that needs no network."""

__all__: list[str] = []
