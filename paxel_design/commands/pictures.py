"""`paxel project` and `paxel preview`: projection images, and what a viewer sees of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paxel_design.commands.options import Dir, Force, Json, effect_of, open_installation, pictures_of
from paxel_design.console import progress_bar, report_records, say
from paxel_runtime.errors import UsageError

__all__ = ["preview", "project"]


def project(
    dir: Dir,
    effect: Annotated[str, typer.Option(help="full, dual-image, or neutralize[:L,a,b].", show_default=False)] = "",
    image: Annotated[Path | None, typer.Option(help="The picture of a one-picture effect.", show_default=False)] = None,
    on_pattern: Annotated[Path | None, typer.Option(help="Picture for the pattern.", show_default=False)] = None,
    on_white: Annotated[Path | None, typer.Option(help="Picture for the white sheet.", show_default=False)] = None,
    shown_on: Annotated[str, typer.Option(help="Surface that shows --image: pattern or white.")] = "pattern",
    lab: Annotated[
        tuple[float, float, float] | None,
        typer.Option("--lab", metavar="L A B", help="Uniform colour of neutralize.", show_default=False),
    ] = None,
    name: Annotated[str, typer.Option(help="Name of the projection (default: the effect).", show_default=False)] = "",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Turn pictures into a projection image at native projector resolution.

    \b
    paxel project my-show --effect dual-image --on-pattern a.jpg --on-white b.jpg
    paxel project my-show --effect neutralize --image a.jpg      (shows on the pattern, hides on white)

    Without --effect every projection that is out of date is made anew from its own pictures.
    """
    from paxel_design.stages.projection import make_projection_stage, recorded_projections

    installation = open_installation(dir)
    installation.require("calibration")
    if effect:
        given = {"image": image, "on_pattern": on_pattern, "on_white": on_white}
        chosen = effect_of(effect, lab)
        wanted = [(chosen, pictures_of(chosen, given), name or chosen.key, shown_on)]
    else:
        wanted = recorded_projections(installation)
        if not wanted:
            raise UsageError("no projection yet: give --effect and its pictures; see paxel project --help")
    results = {}
    for chosen, pictures, projection_name, surface in wanted:
        with progress_bar() as progress:
            results[f"{projection_name}.json"], fresh = make_projection_stage(
                installation, chosen, pictures, name=projection_name, shown_on=surface, force=force, progress=progress
            )
        if not fresh:
            say(f"projection {projection_name} is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("projection"))


def preview(
    dir: Dir,
    name: Annotated[str, typer.Option(help="Only this projection.", show_default=False)] = "",
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Photograph the projections on both surfaces of the virtual bench, as a viewer at the set distance sees them."""
    from paxel_design.stages.projection import make_previews

    installation = open_installation(dir)
    with progress_bar() as progress:
        results, fresh = make_previews(installation, [name] if name else [], force, progress)
    if not fresh:
        say("preview is up to date; nothing to do (--force makes it anew)")
    report_records(as_json, results, installation.folder("preview"))
