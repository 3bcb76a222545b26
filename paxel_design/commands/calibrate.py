"""`paxel calibrate`: from captures to a prediction model."""

from __future__ import annotations

from paxel_design.commands.options import Dir, Force, Json
from paxel_design.commands.running import run_stage

__all__ = ["calibrate"]


def calibrate(dir: Dir, force: Force = False, as_json: Json = False) -> None:
    """Fit the prediction model from the captures and state its error on random projections (dE00)."""
    from paxel_runtime.stages import calibrate as run_calibrate

    run_stage(dir, "calibration", force, as_json, lambda inst, _: run_calibrate(inst), "calibration/accuracy.json")
