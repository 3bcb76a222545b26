"""`paxel project` and `paxel preview`: projection images, and what a viewer sees of them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paxel_design.commands.options import (
    Angle,
    Dir,
    EffectOption,
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
    pictures_of,
)
from paxel_design.console import progress_bar, report_records, say
from paxel_runtime.errors import UsageError

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation
    from paxel_runtime.model.effects import Effect

__all__ = ["preview", "project"]


def _picture(help: str) -> Any:
    return typer.Option(help=help, show_default=False)


def project(
    dir: Annotated[Path | None, typer.Argument(metavar="[DIR]", help="Folder of the installation.")] = None,
    effect: EffectOption = "",
    image: Annotated[Path | None, _picture("The picture of an effect with one, PNG, JPEG, TIFF, WebP ...")] = None,
    on_pattern: Annotated[Path | None, _picture("Of dual-image: the picture for the pattern.")] = None,
    on_white: Annotated[Path | None, _picture("Of dual-image: the picture for the white sheet.")] = None,
    mark: Annotated[Path | None, _picture("Of watermark: the picture that shows faintly.")] = None,
    shown_on: ShownOn = "pattern",
    angle: Angle = None,
    scale: Scale = None,
    lightness: Lightness = None,
    lightness_band: LightnessBand = None,
    lab: LabOption = None,
    tolerance: Tolerance = None,
    strength: Strength = None,
    mapping: Annotated[
        str, typer.Option(help="Of dual-image: adaptive or static, instead of paxel.toml's.", show_default=False)
    ] = "",
    assembly: Annotated[
        str, typer.Option(help="refine, dither or combine, instead of paxel.toml's.", show_default=False)
    ] = "",
    name: Annotated[str, typer.Option(help="Name of the projection (default: the effect).", show_default=False)] = "",
    model: Annotated[
        Path | None, typer.Option(help="A model.json instead of an installation; with --clusters.", show_default=False)
    ] = None,
    clusters: Annotated[
        Path | None, typer.Option(help="With --model: labels of the projector's pixels, a PNG.", show_default=False)
    ] = None,
    bits: Annotated[int, typer.Option(help="With --model: bits of a device code, 8 to 16.")] = 8,
    out: Annotated[Path | None, typer.Option(help="With --model: folder to write to.", show_default=False)] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Turn pictures into a projection image at native projector resolution.

    \b
    paxel project my-show --effect dual-image --on-pattern a.jpg --on-white b.jpg
    paxel project my-show --effect neutralize --image a.jpg            (shows on the pattern, hides on white)
    paxel project my-show --effect hue-shift --angle 90 --image a.jpg  (other hues on white)
    paxel project my-show --effect watermark --image a.jpg --mark b.png --strength 0.05
    paxel project --model model.json --clusters clusters.png --effect full --image a.jpg --out frames

    Writes projection/NAME.png to show full-screen and unscaled (test-frame.png tells whether it is), NAME.json, and
    NAME.moved-<surface>.png: where the picture had more colour than the pattern can show. Pictures keep their own
    colour space; how they are cropped, stretched and straightened says [mapping] in paxel.toml.

    Without --effect every projection that is out of date is made anew from its own pictures.
    """
    given = {"image": image, "on_pattern": on_pattern, "on_white": on_white, "mark": mark}
    settings = {
        "angle": angle, "scale": scale, "lightness": lightness, "lightness_band": lightness_band,
        "tolerance": tolerance, "strength": strength,
    }  # fmt: skip
    loose = [key for key, value in {**given, **settings, "lab": lab}.items() if value is not None]
    if loose and not effect:
        raise UsageError(
            f"--{loose[0].replace('_', '-')} belongs to an effect: give --effect too; see paxel project --help"
        )
    if (dir is None) == (model is None) or (model is None) != (clusters is None):
        raise UsageError("give a folder, or --model FILE and --clusters FILE: paxel project my-show")
    if model is None and (out is not None or bits != 8):
        raise UsageError("--out and --bits go with --model; an installation has its own folder and projector.bits")
    installation = open_installation(dir) if dir is not None else None
    chosen = effect_of(effect, lab, **settings) if effect else None
    pictures = pictures_of(chosen, given) if chosen else {}
    if model is not None:
        from paxel_design.stages.projection import make_projection_of_model

        if chosen is None:
            raise UsageError("--model needs --effect and its pictures; see paxel project --help")
        assert clusters is not None
        name = name or chosen.key
        with progress_bar() as progress:
            record = make_projection_of_model(
                model, clusters, chosen, pictures, name=name, shown_on=shown_on, assembly=assembly, bits=bits, out=out,
                progress=progress,
            )  # fmt: skip
        if out is None:
            say("nothing was written: give --out FOLDER to keep the projection image")
        report_records(as_json, {f"{name}.json": record}, out or model.parent)
        return
    assert installation is not None
    _project_installation(installation, chosen, pictures, name, shown_on, mapping, assembly, force, as_json)


def _project_installation(
    installation: Installation,
    effect: Effect | None,
    pictures: dict[str, Path],
    name: str,
    shown_on: str,
    mapping: str,
    assembly: str,
    force: bool,
    as_json: bool,
) -> None:
    """One projection, or all that are there."""
    from paxel_design.stages.projection import RecordedProjection, make_projection_stage, recorded_projections

    installation.require("calibration")
    if effect is not None:
        wanted = [RecordedProjection(effect, pictures, name or effect.key, shown_on, mapping, assembly)]
    else:
        wanted = recorded_projections(installation)
        if not wanted:
            raise UsageError("no projection yet: give --effect and its pictures; see paxel project --help")
    results = {}
    for one in wanted:
        with progress_bar() as progress:
            results[f"{one.name}.json"], fresh = make_projection_stage(
                installation, one.effect, one.pictures, name=one.name, shown_on=one.shown_on,
                mapping=one.mapping if effect else mapping or one.mapping,
                assembly=one.assembly if effect else assembly or one.assembly, force=force, progress=progress,
            )  # fmt: skip
        if not fresh:
            say(f"projection {one.name} is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("projection"))


def preview(
    dir: Dir,
    name: Annotated[str, typer.Option(help="Only this projection.", show_default=False)] = "",
    distance: Annotated[
        list[float] | None,
        typer.Option(metavar="MM", help="Seen from here too; repeat for several.", show_default=False),
    ] = None,
    sheet_distance: Annotated[
        float | None,
        typer.Option(metavar="MM", help="With the white sheet held this far from the wall.", show_default=False),
    ] = None,
    sheet_tilt: Annotated[
        float | None,
        typer.Option(metavar="DEG", help="With the white sheet turned about the upright axis.", show_default=False),
    ] = None,
    shift: Annotated[
        list[float] | None,
        typer.Option(
            metavar="PX", help="With the print moved by projector pixels since; repeat for several.", show_default=False
        ),
    ] = None,
    planted_mark: Annotated[
        bool, typer.Option(help="Measure ghosts by a mark planted in the other picture: projects once more for each.")
    ] = False,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Photograph the projections on both surfaces of the virtual bench, as a viewer at the set distance sees them.

    \b
    paxel preview my-show --distance 2700 --distance 8000        (from 2.7 m and 8 m too)
    paxel preview my-show --sheet-distance 20 --sheet-tilt 10    (the white sheet held freely)
    paxel preview my-show --shift 0.3                            (the projector was bumped)

    Pictures are at a fixed exposure, and as .auto exposed as the eye adapts to each surface.
    """
    from paxel_design.stages.projection import make_previews
    from paxel_runtime.observer import preview_words
    from paxel_runtime.stages import looks_of

    installation = open_installation(dir)
    looks = looks_of(installation, distance or (), sheet_distance, sheet_tilt, shift or ())
    with progress_bar() as progress:
        results, fresh = make_previews(installation, [name] if name else [], force, progress, looks, planted_mark)
    if not fresh:
        say("preview is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("preview"))
    for record in results.values():
        say("\n".join(preview_words(record)))
