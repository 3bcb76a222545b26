"""`paxel gamut`: what a pattern can show."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from paxel_design.commands.options import (
    Angle,
    EffectsOption,
    Force,
    Json,
    LabOption,
    Lightness,
    LightnessBand,
    Scale,
    ShownOn,
    Strength,
    Tolerance,
    effect_of,
    open_installation,
)
from paxel_design.commands.running import records_of, up_to_date
from paxel_design.console import progress_bar, report_records, say
from paxel_runtime.errors import UsageError

__all__ = ["gamut"]


def _option(help: str, *names: str, metavar: str | None = None) -> Any:
    return typer.Option(*names, help=help, metavar=metavar, show_default=False)


def gamut(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    effect: EffectsOption = None,
    shown_on: ShownOn = "pattern",
    angle: Angle = None,
    scale: Scale = None,
    lightness: Lightness = None,
    lightness_band: LightnessBand = None,
    lab: LabOption = None,
    tolerance: Tolerance = None,
    strength: Strength = None,
    hue_area: Annotated[
        float | None,
        _option("Also the area of colours whose hue can turn by this angle, as hue-<angle>.json, .png and .ply."),
    ] = None,
    same_range: Annotated[
        bool,
        _option(
            "Also the longest range of L* that both surfaces can have at once, as lightness-same.json; beside a white "
            "sheet there is none.",
            "--same-range",
        ),
    ] = False,
    least_range: Annotated[
        tuple[float, float] | None,
        _option(
            "Also the largest lightness rectangle with ranges of at least these L* on the pattern and on the white "
            "surface (0 = any), as lightness-<p>_<w>.json.",
            "--least-range",
            metavar="P W",
        ),
    ] = None,
    method: Annotated[str, typer.Option(help="exact, or sampling: the paper's grid of inputs, slow.")] = "exact",
    step: Annotated[float, typer.Option(help="Grid of level sets (hue-shift, chroma), CIELAB units.")] = 2.0,
    beside: Annotated[
        list[str] | None,
        _option(
            "Compare with srgb, dci-p3, rec2020 or the .npz of another sub-gamut: shares of volume; drawn too. Repeat "
            "for several.",
            metavar="BODY",
        ),
    ] = None,
    picture: Annotated[
        Path | None, _option("Also draw the bodies of this run in one CIELAB space into this .png.")
    ] = None,
    model: Annotated[Path | None, _option("A model.json instead of an installation.")] = None,
    out: Annotated[Path | None, _option("With --model: folder to write to.")] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Compute what the pattern can show: lightness area, joint gamut, sub-gamuts as closed meshes.

    A sub-gamut is all colours of one surface that an effect can use. Its volume is in cubic CIELAB units (sRGB:
    820,300); the record tells it with area, parts and handles, and .ply, .glb and .gam (for Argyll) hold the mesh.
    Sets are exact polytopes, but those of hue-shift, chroma and watermark, which are found on a grid of --step.
    One channel on three inks: primaries.json tells which ink limits white, and the area shares that would be better.

    \b
    paxel gamut my-show                                   lightness, joint, full, dual-image and neutralize
    paxel gamut my-show --effect hue-shift --angle 90     one effect
    paxel gamut my-show --effect hue-shift:45 --effect hue-shift:135 --picture hues.png
    paxel gamut my-show --effect full --beside srgb --picture full.png
    paxel gamut my-show --hue-area 180 --same-range
    paxel gamut --model model.json --effect decolorize --lightness relative --json

    With --model FILE no installation is needed; nothing is written then unless --out is given.
    """
    from paxel_design.stages.gamut import GamutRequest, gamut_files, make_gamut, make_gamut_of_model

    settings = {
        "angle": angle, "scale": scale, "lightness": lightness, "lightness_band": lightness_band,
        "tolerance": tolerance, "strength": strength,
    }  # fmt: skip
    given = [f"--{name.replace('_', '-')}" for name, value in {"lab": lab, **settings}.items() if value is not None]
    texts = effect or []
    if given and len(texts) != 1:
        raise UsageError(
            f"{given[0]} belongs to one effect: give --effect too; see paxel gamut --help"
            if not texts
            else f"{given[0]} belongs to one effect, got {len(texts)}: write the settings after each, as hue-shift:45"
        )
    chosen, *further = [effect_of(text, lab, **settings) for text in texts] or [None]
    request = GamutRequest(
        method=method,
        step=step,
        further=tuple(further),
        hue_area_deg=hue_area,
        same_range=same_range,
        least_range=least_range,
        beside=tuple(beside or ()),
        picture=picture,
    )
    if (dir is None) == (model is None):
        raise UsageError("give a folder, or --model FILE: paxel gamut my-show")
    if model is not None:
        with progress_bar() as progress:
            results = make_gamut_of_model(model, chosen, shown_on, out, progress, request)
        _tell(as_json, results, out or model)
        return
    assert dir is not None
    installation = open_installation(dir)
    installation.require("calibration")
    names = gamut_files(installation, chosen, shown_on, request)
    if not force and picture is None and not beside and up_to_date(installation, "gamut", names):
        result = records_of(installation, "gamut", names)
        say("gamut is up to date; nothing to do (--force makes it anew)")
    else:
        with progress_bar() as progress:
            result = make_gamut(installation, chosen, shown_on, progress, request)
    _tell(as_json, result, installation.folder("gamut"))


def _tell(as_json: bool, results: dict[str, Any], where: Path) -> None:
    """The records, and in a sentence what they say of the primaries of one channel."""
    from paxel_design.gamut.primaries import primaries_sentence

    report_records(as_json, results, where)
    if "primaries.json" in results:
        say(primaries_sentence(results["primaries.json"]))
