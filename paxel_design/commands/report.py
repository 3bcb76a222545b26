"""`paxel report`: the gamut analysis report."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from paxel_design.commands.options import Force, Json, open_installation
from paxel_design.console import print_json, progress_bar, say
from paxel_runtime.errors import UsageError

__all__ = ["report"]


def _option(help: str) -> Any:
    return typer.Option(help=help, show_default=False)


def report(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    model: Annotated[Path | None, _option("A model.json instead of an installation.")] = None,
    out: Annotated[Path | None, _option("With --model: folder to write to.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Tell what an installation can show, how good it is and what would make it better: as PDF, HTML and JSON.

    \b
    paxel report my-show                                  report/report.pdf, report.html and report.json
    paxel report --model model.json --out my-report       of a model.json alone: gamuts, and what would help

    It needs a calibrated installation, and tells of gamuts, projections and previews what is up to date: run paxel
    gamut, project and preview first for a whole report. Gamuts are computed where they are not there. report.html
    turns the gamuts in 3-D and needs no network; report.json holds every figure with its unit and its source.
    """
    from paxel_design.stages.report import make_report, make_report_of_model

    if (dir is None) == (model is None):
        raise UsageError("give a folder, or --model FILE: paxel report my-show")
    if model is not None:
        with progress_bar() as progress:
            result = make_report_of_model(model, out, progress)
        if out is None:
            say("nothing was written: give --out FOLDER to keep the report")
        _tell(as_json, result, out)
        return
    assert dir is not None
    if out is not None:
        raise UsageError("--out goes with --model; an installation has its own folder, report/")
    installation = open_installation(dir)
    installation.require("calibration")
    folder = installation.folder("report")
    done = any(s.stage.name == "report" and s.state == "done" for s in installation.status())
    if done and not force and all((folder / file).is_file() for file in ("report.pdf", "report.html")):
        from paxel_runtime.storage import read_json

        say("report is up to date; nothing to do (--force makes it anew)")
        result = read_json(folder / "report.json")
    else:
        with progress_bar() as progress:
            result = make_report(installation, progress)
    _tell(as_json, result, folder)


def _tell(as_json: bool, result: dict[str, Any], folder: Path | None) -> None:
    """The record; or where the report is, and what was judged."""
    if as_json:
        print_json(result)
        return
    console = Console(highlight=False)
    if folder is not None:
        console.print(f"report: {folder / 'report.pdf'} and report.html", markup=False, soft_wrap=True)
    table = Table("verdict", "what", "value", "rule", title="what was judged", title_justify="left")
    for row in result["verdicts"]:
        value = row["value"] if isinstance(row["value"], str) else f"{row['value']:.4g}"
        table.add_row(row["judgement"], f"{row['section']}: {row['name']}", value, row["rule"])
    if table.row_count:
        console.print(table)
