"""The stages of an installation: read its folder, call the pure functions, write the stage's own folder as a whole.

One file a stage; `capture` is in ``captures/acquisition.py``. Each returns the figures it wrote. What is up to date is
decided by the caller.
"""

from paxel_runtime.stages.calibration import calibrate
from paxel_runtime.stages.devices import open_bench, open_devices
from paxel_runtime.stages.looks import Look, looks_of, usual_look
from paxel_runtime.stages.projection import (
    load_pair_gamut,
    load_sub_gamut,
    mapping_options,
    picture_frame,
    project,
    projection_inputs,
    write_projection,
)
from paxel_runtime.stages.views import fresh_preview, preview

__all__ = [
    "Look",
    "calibrate",
    "fresh_preview",
    "load_pair_gamut",
    "load_sub_gamut",
    "looks_of",
    "mapping_options",
    "open_bench",
    "open_devices",
    "picture_frame",
    "preview",
    "project",
    "projection_inputs",
    "usual_look",
    "write_projection",
]
