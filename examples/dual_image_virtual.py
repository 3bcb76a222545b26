"""Two photographs in one projection, on the virtual bench: from the print to what a viewer sees on each surface.

python examples/dual_image_virtual.py [FOLDER]
"""

import sys
from importlib.resources import files
from pathlib import Path

from paxel_design import DualImage
from paxel_design.stages.gamut import make_gamut
from paxel_design.stages.print_sheet import make_print
from paxel_runtime.captures.acquisition import capture
from paxel_runtime.installation import Installation
from paxel_runtime.settings import make_settings
from paxel_runtime.stages import calibrate, open_bench, open_devices, preview, project

folder = Path(sys.argv[1] if len(sys.argv) > 1 else "dual-image-example")
photographs = Path(str(files("skimage") / "data"))
small = {
    "pattern.size_mm": [80, 50],
    "projector.resolution": [480, 270],
    "projector.width_mm": 70.3,
    "camera.resolution": [1024, 768],
}

installation = Installation.create(folder, make_settings("bw-checkerboard", small))
make_print(installation)
capture(installation, open_devices(installation), progress=lambda message, done, total: None)
accuracy = calibrate(installation)
make_gamut(installation, DualImage(), "pattern")
project(
    installation,
    DualImage(),
    {"on_pattern": photographs / "astronaut.png", "on_white": photographs / "coffee.png"},
)
seen = preview(installation, "dual-image", open_bench(installation))
print(f"prediction error on the pattern, virtual bench: mean dE00 {accuracy['pattern']['dE00_mean']:.2f}")
print(f"the view against the wanted picture: mean dE00 {seen['on_pattern']['dE00_mean']:.2f}")
print(f"look at {folder / 'preview'}")
