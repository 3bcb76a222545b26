"""The gamut analysis report: gather what is there, make its sections, set them as PDF, HTML and JSON."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from paxel_design.report.beside import beside
from paxel_design.report.charts import settle
from paxel_design.report.content import Chart, Section
from paxel_design.report.html import write_html
from paxel_design.report.pdf import write_pdf
from paxel_design.report.record import report_record
from paxel_design.report.sections import (
    calibration,
    definitions,
    gamuts,
    pattern,
    pictures,
    provenance,
    recommendations,
    summary,
)
from paxel_design.report.source import ReportSource, installation_source, model_source
from paxel_runtime.errors import InputError
from paxel_runtime.installation import Installation
from paxel_runtime.storage import file_sha256, write_json
from paxel_runtime.version import WRITER

__all__ = ["FILES", "make_report", "make_report_of_model", "report_sections"]

Progress = Callable[[str, int, int], None]
Chapter = Callable[[ReportSource], Section]

FILES = ("report.pdf", "report.html", "report.json")

_TITLE = "Gamut analysis report"

_CHAPTERS: dict[str, Chapter] = {
    "pattern": pattern.section,
    "calibration": calibration.section,
    "gamuts": gamuts.section,
    "pictures": pictures.section,
    "recommendations": recommendations.section,
    "definitions": definitions.section,
    "provenance": provenance.section,
}
"""After the summary, in the report's order."""

_OF_INSTALLATIONS = ("pattern", "pictures")
_STEPS = len(_CHAPTERS) + len(("pdf", "html"))
_MOST_JOBS = 2
"""Processes: the pictures take about as long as all other chapters, and the PDF longer than the HTML."""


def report_sections(source: ReportSource, progress: Progress = lambda *_: None, jobs: int = 1) -> list[Section]:
    """All chapters, the summary first; with two `jobs` the pictures are looked at in a process of their own.

    A model.json alone has no chapters on what only an installation has.
    """
    names = [name for name in _CHAPTERS if source.installation is not None or name not in _OF_INSTALLATIONS]
    later = {name: beside(_CHAPTERS[name], source, jobs=jobs) for name in names if name == "pictures"}
    made: dict[str, Section] = {}
    for name in sorted(names, key=lambda name: name in later):
        progress(f"report: {name}", len(made), _STEPS)
        made[name] = later[name]() if name in later else _CHAPTERS[name](source)
    chapters = [made[name] for name in names]
    sections = [summary.section(source, chapters), *chapters]
    for chart in (block for section in sections for block in section.blocks if isinstance(block, Chart)):
        settle(chart.figure)
    return sections


def make_report(
    installation: Installation, progress: Progress = lambda *_: None, jobs: int | None = None
) -> dict[str, Any]:
    """Write ``report/`` of a calibrated installation; returns ``report.json``.

    Gamuts, projections and previews are told where they are up to date; gamuts are computed where they are not, and of
    pictures the report says how they are made.

    Parameters
    ----------
    installation : Installation
    progress : callable
    jobs : int, optional
        Processes; as many as there are cores, up to two, by default.

    Raises
    ------
    InstallationError
        If the installation is not calibrated, or that is out of date: why, and which command makes it.
    """
    source = installation_source(installation)
    inputs = installation.inputs("report", extra_files={name: installation.path / name for name in source.records})
    jobs = _jobs(jobs)
    sections = report_sections(source, progress, jobs)
    name, settings = installation.path.resolve().name, installation.settings.pattern
    with installation.writing("report") as folder:
        return _write(
            folder,
            source,
            sections,
            f"{name}: {settings.layout}, {', '.join(settings.colorants)}",
            inputs,
            progress,
            jobs,
        )


def make_report_of_model(
    path: Path, out: Path | None, progress: Progress = lambda *_: None, jobs: int | None = None
) -> dict[str, Any]:
    """The same of a model.json alone; writes only where `out` names a folder.

    Raises
    ------
    InputError
        If the model cannot be read, or `out` is a file.
    """
    if out is not None and out.exists() and not out.is_dir():
        raise InputError(f"--out must be a folder, and {out} is a file")
    source, jobs = model_source(path), _jobs(jobs)
    sections = report_sections(source, progress, jobs)
    inputs = {"settings": {}, "files": {path.name: file_sha256(path)}}
    if out is None:
        return {"writer": WRITER, **_record(source, sections, path.name, inputs)}
    out.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".report-", dir=out) as scratch:  # all files are there, or none
        record = _write(Path(scratch), source, sections, path.name, inputs, progress, jobs)
        for file in FILES:
            (Path(scratch) / file).replace(out / file)
    return record


def _write(
    folder: Path,
    source: ReportSource,
    sections: Sequence[Section],
    subtitle: str,
    inputs: dict[str, Any],
    progress: Progress,
    jobs: int,
) -> dict[str, Any]:
    """All three files; returns what report.json holds."""
    record = _record(source, sections, subtitle, inputs)
    about: dict[str, Any] = {
        "title": _TITLE, "subtitle": subtitle, "bench": source.bench, "writer": WRITER, "date": source.date,
    }  # fmt: skip
    html_written = beside(write_html, folder / "report.html", sections, **about, jobs=jobs)
    progress("report: PDF and HTML", len(_CHAPTERS), _STEPS)
    write_pdf(folder / "report.pdf", sections, **about)
    html_written()
    write_json(folder / "report.json", record)
    return {"writer": WRITER, **record}


def _jobs(asked: int | None) -> int:
    return min(_MOST_JOBS, os.cpu_count() or 1) if asked is None else asked


def _record(source: ReportSource, sections: Sequence[Section], subtitle: str, inputs: dict[str, Any]) -> dict[str, Any]:
    return report_record(sections, title=_TITLE, subtitle=subtitle, bench=source.bench, date=source.date, inputs=inputs)
