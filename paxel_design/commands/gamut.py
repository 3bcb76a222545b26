"""`paxel gamut`: what a pattern can show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paxel_design.commands.options import Force, Json, effect_of, open_installation
from paxel_design.commands.running import records_of, up_to_date
from paxel_design.console import progress_bar, report_records, say
from paxel_runtime.errors import UsageError

__all__ = ["gamut"]


def gamut(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    effect: Annotated[
        str,
        typer.Option(help="Only this effect's sub-gamut: full, dual-image, neutralize[:L,a,b].", show_default=False),
    ] = "",
    shown_on: Annotated[str, typer.Option(help="Surface of the picture: pattern or white.")] = "pattern",
    lab: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--lab", metavar="L A B", help="Uniform colour of neutralize.", show_default=False),
    ] = None,
    model: Annotated[
        Path | None, typer.Option(help="A model.json instead of an installation.", show_default=False)
    ] = None,
    out: Annotated[Path | None, typer.Option(help="With --model: folder to write to.", show_default=False)] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compute what the pattern can show: lightness area, joint gamut, sub-gamuts as closed meshes.

    Without --effect: lightness, joint, full, dual-image and neutralize. With --model FILE no installation is needed;
    nothing is written then unless --out is given.
    """
    from paxel_design.stages.gamut import gamut_files, make_gamut, make_gamut_of_model

    chosen = effect_of(effect, lab) if effect else None
    if (dir is None) == (model is None):
        raise UsageError("give a folder, or --model FILE: paxel gamut my-show")
    if model is not None:
        report_records(as_json, make_gamut_of_model(model, chosen, shown_on, out), out or model)
        return
    assert dir is not None
    installation = open_installation(dir)
    installation.require("calibration")
    names = gamut_files(installation, chosen, shown_on)
    if not force and up_to_date(installation, "gamut", names):
        result = records_of(installation, "gamut", names)
        say("gamut is up to date; nothing to do (--force makes it anew)")
    else:
        with progress_bar() as progress:
            result = make_gamut(installation, chosen, shown_on, progress)
    report_records(as_json, result, installation.folder("gamut"))
