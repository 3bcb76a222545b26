"""`paxel pattern`: the print sheet."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paxel_design.commands.options import Force, Json
from paxel_design.commands.running import run_stage
from paxel_design.console import report
from paxel_runtime.errors import UsageError

__all__ = ["pattern"]


def pattern(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    list_colorants: Annotated[
        bool, typer.Option("--list-colorants", help="Tell the built-in inks that pattern.colorants may name.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Make the print sheet: a PDF in true millimetres, a PNG preview and a note for the print shop."""
    if list_colorants:
        _list_colorants(as_json)
        return
    if dir is None:
        raise UsageError("give the installation's folder: paxel pattern my-show")
    from paxel_design.stages.print_sheet import make_print

    run_stage(dir, "print", force, as_json, lambda inst, _: make_print(inst), "print/pattern.json")


def _list_colorants(as_json: bool) -> None:
    """The library of colorants: the printer's recipe, and XYZ under equal energy with Y = 1 for the paper."""
    from paxel_runtime.model.colorimetry import spectra_to_XYZ
    from paxel_runtime.model.pattern import colorant_library

    library = colorant_library()
    paper_Y = spectra_to_XYZ(library["white"].reflectance)[1]
    rows = {
        name: {"cmyk": list(c.cmyk), "XYZ": (spectra_to_XYZ(c.reflectance) / paper_Y).round(4).tolist()}
        for name, c in library.items()
    }
    report(as_json, rows, "colorants (solid on FOGRA39 coated paper; white is the bare paper)")
