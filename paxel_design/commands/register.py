"""`paxel register`: the lookup table after a bump."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from paxel_design.commands.options import Dir, Json, open_installation
from paxel_design.console import report, say
from paxel_runtime.errors import UsageError

__all__ = ["register"]


def register(
    dir: Dir,
    quick: Annotated[bool, typer.Option("--quick", help="From one picture, after the projector was bumped.")] = False,
    picture: Annotated[
        Path | None, typer.Option(help="Photograph of the frame, where no device takes it.", show_default=False)
    ] = None,
    as_json: Json = False,
) -> None:
    """Bring the registration up to date after the projector was bumped: one frame, one picture, a warp of the table.

    Projections made before fit again after: paxel project my-show. Where the warp does not suffice, nothing is changed
    and the figure tells by how much.

    Example:  paxel register my-show --quick
    """
    if not quick:
        raise UsageError("say --quick; a full registration belongs to: paxel capture DIR --force")
    from paxel_runtime.devices.base import Devices
    from paxel_runtime.stages import open_devices
    from paxel_runtime.stages.registration import run_quick_registration, take_quick_picture, write_quick_frame

    installation = open_installation(dir)
    installation.require("calibration")
    if picture is None:
        devices = open_devices(installation)
        if not isinstance(devices, Devices):
            path = write_quick_frame(installation)
            say(f"show {path} full screen, photograph it as the captures were, and run:")
            say(f"paxel register {dir} --quick --picture PHOTOGRAPH")
            return
        figures = run_quick_registration(
            installation, take_quick_picture(installation, devices.projector, devices.camera)
        )
    else:
        figures = run_quick_registration(installation, picture)
    report(as_json, figures, f"registration: moved by {figures['moved_px']:.2f} camera pixels, the warp suffices")
