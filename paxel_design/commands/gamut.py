"""`paxel gamut`: what a pattern can show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from paxel_design.commands.options import Force, Json, effect_of, open_installation
from paxel_design.commands.running import records_of, up_to_date
from paxel_design.console import progress_bar, report_records, say
from paxel_runtime.errors import UsageError

__all__ = ["gamut"]


def _option(help: str, *names: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, metavar=metavar, show_default=False)


def gamut(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    effect: Annotated[
        str,
        _option(
            "Only this effect's sub-gamut: full, hue-shift, chroma, decolorize, neutralize, full-change, dual-image, "
            "monochrome; settings may follow, as hue-shift:45 or dual-image:volume."
        ),
    ] = "",
    shown_on: Annotated[str, typer.Option(help="Surface of the picture: pattern or white.")] = "pattern",
    angle: Annotated[float | None, _option("Least turn of hue of hue-shift, degrees up to 170 (45).")] = None,
    scale: Annotated[float | None, _option("What chroma multiplies chroma by (0.5).")] = None,
    lightness: Annotated[str | None, _option("Of decolorize's grays: free, relative or same (free).")] = None,
    lightness_band: Annotated[
        float | None, _option("Of hue-shift and chroma: largest difference of L* between the surfaces (free).")
    ] = None,
    lab: Annotated[
        tuple[float, float, float] | None, _option("Uniform colour of neutralize (50 0 0).", "--lab", metavar="L A B")
    ] = None,
    tolerance: Annotated[
        float | None, _option("Of neutralize, and of decolorize with lightness free, dE00 (0 = exact).")
    ] = None,
    hue_area: Annotated[
        float | None, _option("Also the area of colours whose hue can turn by this angle, as hue-<angle>.json.")
    ] = None,
    method: Annotated[str, typer.Option(help="exact, or sampling: the paper's grid of inputs, slow.")] = "exact",
    step: Annotated[float, typer.Option(help="Grid of level sets (hue-shift, chroma), CIELAB units.")] = 2.0,
    picture: Annotated[
        Path | None, _option("Also draw the sub-gamuts of this run into one .png (needs pyvista).")
    ] = None,
    model: Annotated[Path | None, _option("A model.json instead of an installation.")] = None,
    out: Annotated[Path | None, _option("With --model: folder to write to.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compute what the pattern can show: lightness area, joint gamut, sub-gamuts as closed meshes.

    \b
    paxel gamut my-show --effect hue-shift --angle 90
    paxel gamut --model model.json --effect decolorize --lightness relative --json

    Without --effect: lightness, joint, full, dual-image and neutralize. With --model FILE no installation is needed;
    nothing is written then unless --out is given.
    """
    from paxel_design.stages.gamut import GamutRequest, gamut_files, make_gamut, make_gamut_of_model

    settings = {
        "angle": angle, "scale": scale, "lightness": lightness, "lightness_band": lightness_band,
        "tolerance": tolerance,
    }  # fmt: skip
    given = [f"--{name.replace('_', '-')}" for name, value in {"lab": lab, **settings}.items() if value is not None]
    if given and not effect:
        raise UsageError(f"{given[0]} belongs to an effect: give --effect too; see paxel gamut --help")
    chosen = effect_of(effect, lab, **settings) if effect else None
    request = GamutRequest(method=method, step=step, hue_area_deg=hue_area, picture=picture)
    if (dir is None) == (model is None):
        raise UsageError("give a folder, or --model FILE: paxel gamut my-show")
    if model is not None:
        with progress_bar() as progress:
            results = make_gamut_of_model(model, chosen, shown_on, out, progress, request)
        report_records(as_json, results, out or model)
        return
    assert dir is not None
    installation = open_installation(dir)
    installation.require("calibration")
    names = gamut_files(installation, chosen, shown_on, request)
    if not force and picture is None and up_to_date(installation, "gamut", names):
        result = records_of(installation, "gamut", names)
        say("gamut is up to date; nothing to do (--force makes it anew)")
    else:
        with progress_bar() as progress:
            result = make_gamut(installation, chosen, shown_on, progress, request)
    report_records(as_json, result, installation.folder("gamut"))
