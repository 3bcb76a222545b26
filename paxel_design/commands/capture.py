"""`paxel capture`: pictures and readings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from paxel_design.commands.options import Dir, Force, Json
from paxel_design.commands.running import run_stage
from paxel_design.console import say

if TYPE_CHECKING:
    from paxel_runtime.installation import Installation

__all__ = ["capture"]


def capture(dir: Dir, force: Force = False, as_json: Json = False) -> None:
    """Project and capture everything a calibration needs; goes on where it stopped.

    Structured light, white and black, then single clusters, ramps and random test projections. Geometry is decoded
    on the way, so a bad set-up is told before the readings start. Old captures are kept as captures-<n>.
    """
    from paxel_runtime.acquisition import capture as run_capture
    from paxel_runtime.acquisition import plan_exposures
    from paxel_runtime.stages import open_devices

    def run(installation: Installation, progress: Callable[[str, int, int], None]) -> dict[str, Any]:
        plan = plan_exposures(installation)
        pictures = sum(exposure.device == "camera" for exposure in plan)
        say(f"capturing {pictures} pictures and {len(plan) - pictures} readings")
        return run_capture(installation, open_devices(installation), progress, force=force)

    run_stage(dir, "captures", force, as_json, run, "captures/complete.json")
