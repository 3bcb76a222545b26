"""`paxel capture`: pictures and readings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any

import typer

from paxel_design.commands.options import Dir, Force, Json
from paxel_design.commands.running import run_stage
from paxel_design.console import say
from paxel_runtime.errors import UsageError

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = ["capture"]


def capture(
    dir: Dir,
    device: Annotated[
        str,
        typer.Option(help="virtual, or folder for your own camera; default: [devices] kind.", show_default=False),
    ] = "",
    timeout: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="With folder: end if nothing comes for so long.", show_default=False),
    ] = None,
    force: Force = False,
    as_json: Json = False,
) -> None:
    """Project and capture everything a calibration needs; goes on where it stopped.

    Structured light, white and black, then single clusters, ramps and random test projections. Geometry is decoded
    on the way, so a bad set-up is told before the readings start. Old captures are kept as captures-<n>.

    With --device folder the frames are written to captures/frames as numbered PNGs; show them one after the other and
    let any program drop the photographs into captures/photographs. Each is checked when it comes. The meter's spectra
    go into captures/measurements.csv. Ctrl-C at any time; the same command goes on.
    """
    from paxel_runtime.captures.acquisition import capture as run_capture
    from paxel_runtime.captures.acquisition import plan_exposures
    from paxel_runtime.stages import open_devices

    if timeout is not None and not timeout > 0:
        raise UsageError(f"--timeout must be > 0 seconds, got {timeout:g}")

    def run(installation: Installation, progress: Callable[[str, int, int], None]) -> dict[str, Any]:
        devices = open_devices(installation, say, device, timeout)
        plan = plan_exposures(installation)
        geometry = sum(e.device == "camera" and not e.clusters and not e.mask for e in plan)
        pictures = sum(exposure.device == "camera" for exposure in plan)
        say(
            f"capturing {pictures} pictures ({geometry} for the geometry, then {pictures - geometry}) and "
            f"{len(plan) - pictures} readings"
        )
        return run_capture(installation, devices, progress, force=force)

    run_stage(dir, "captures", force, as_json, run, "captures/complete.json")
