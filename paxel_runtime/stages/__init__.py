"""The stages of an installation: read its folder, call the pure functions, write the stage's own folder as a whole.

One file a stage; `capture` is in ``captures/acquisition.py``. Each returns the figures it wrote. What is up to date is
decided by the caller.
"""

from paxel_runtime.stages.calibration import calibrate
from paxel_runtime.stages.devices import open_bench, open_devices
from paxel_runtime.stages.projection import load_sub_gamut, project, projection_inputs
from paxel_runtime.stages.views import preview

__all__ = [
    "calibrate",
    "load_sub_gamut",
    "open_bench",
    "open_devices",
    "preview",
    "project",
    "projection_inputs",
]
