"""What the command line says: results as tables or JSON on standard output, messages and progress on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

__all__ = ["messages", "print_json", "print_table", "progress_bar", "report", "report_records", "say"]

messages = Console(stderr=True, highlight=False)


def report_records(as_json: bool, results: dict[str, Any], where: Path) -> None:
    """One result as its own record; several under their file names."""
    if as_json:
        print_json(next(iter(results.values())) if len(results) == 1 else results)
        return
    for name, record in results.items():
        print_table(str(where / name), record)


def report(as_json: bool, result: dict[str, Any], line: str) -> None:
    """A result as one JSON object, or as a line and a table of its figures."""
    if as_json:
        print_json(result)
        return
    Console(highlight=False).print(line, markup=False, soft_wrap=True)
    print_table("", result)


def print_table(title: str, figures: dict[str, Any]) -> None:
    """A small table of the figures of a record; provenance is left to the file."""
    table = Table(title=title or None, title_justify="left", show_header=False)
    for key, value in _flat(figures):
        table.add_row(escape(key), escape(value))
    if table.row_count:
        Console(highlight=False).print(table)


_NOT_SHOWN = {
    "writer",
    "inputs",
    "settings",
    "polygon",
    "polygon_any",
    "polygon_all",
    "schema",
    "version",
    "cells",
    "seed",
    "text",
}
"""Provenance and long lists: in the file, not in the table."""

_DETAILS = {
    "degree",
    "sigma_px",
    "points",
    "outliers",
    "residual_p95_px",
    "residual_max_px",
    "ink_px2",
    "markers",
    "linear",
    "purity",
    "centres_Lab",
    "centre_distances",
    "matrix",
    "design",
    "by_input",
    "extra_readings",
    "dE00_rms",
    "source_dE00_p95",
    "ghosting_fine_percent",
    "pictures_correlation",
    "texture_L",
    "local_contrast_L",
    "L_range_mapped",
    "chroma_mean_mapped",
}
"""Figures for whoever looks into the file, at any depth."""


def _flat(figures: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for key, value in figures.items():
        if key in _DETAILS or (not prefix and key in _NOT_SHOWN):
            continue
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list | tuple):
            yield f"{prefix}{key}", ", ".join(f"{v:.4g}" if isinstance(v, float) else str(v) for v in value)
        else:
            yield f"{prefix}{key}", f"{value:.4g}" if isinstance(value, float) else str(value)


def print_json(data: dict[str, Any]) -> None:
    sys.stdout.write(json.dumps(data, indent=1, ensure_ascii=False) + "\n")


def say(text: str) -> None:
    messages.print(text, markup=False, soft_wrap=True)


@contextmanager
def progress_bar() -> Iterator[Callable[[str, int, int], None]]:
    """A progress bar on standard error: what is done now, how far, how long."""
    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeElapsedColumn())
    with Progress(*columns, console=messages, transient=True) as bar:
        task = bar.add_task("start", total=None)

        def update(message: str, done: int, total: int) -> None:
            bar.update(task, description=message, completed=done, total=total)

        yield update
