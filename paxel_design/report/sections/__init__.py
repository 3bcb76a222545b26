"""The chapters of the report, a file each: `section(source) -> Section`."""

__all__: list[str] = []
