"""Inversion of a whole 4K frame with an image-based model read from disk: reference/image_based.json.

Every pixel has its own A: measured spectra (K = 2, both surfaces) under a fall-off of 24 %, a smooth change of each
input of +-10 % over the picture and 2 % of noise from pixel to pixel, as the grain of ink and paper gives. The wanted
colours are two photographs mapped as in `inversion_benchmark`, most of them out of gamut. The inversion runs in a
process of its own that is asked for its wall time and its peak of resident memory, the mapped pages of A included.

Run from a checkout, on a machine that does nothing else (Debian; 2 minutes, 1.5 GB of disk)::

    python -m reports.image_based            (--height 540: a smaller frame, nothing is written)
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from scipy.ndimage import zoom

from paxel_runtime.calibration import Fields
from paxel_runtime.inversion import invert
from paxel_runtime.model.prediction import PredictionModel
from paxel_runtime.model_image import FOLDER, load_image_model, median_model, write_model_image
from paxel_runtime.storage import model_to_dict, write_json
from reports.inversion_benchmark import MODELS, PAIRS, photographs

RESULT = Path(__file__).parent / "reference" / "image_based.json"
HEIGHT, WIDTH = 2160, 3840


def fields_of(model: PredictionModel, shape: tuple[int, int], seed: int = 0) -> Iterator[Fields]:
    """XYZ of each input at each pixel of each surface."""
    rng = np.random.default_rng(seed)
    y, x = (np.linspace(-1.0, 1.0, size, dtype=np.float32) for size in shape)
    fall_off = 1.0 - 0.12 * (x[None, :] ** 2 + y[:, None] ** 2)
    for name, surface in model.surfaces.items():
        for j in range(model.n):
            nodes = rng.uniform(0.9, 1.1, (6, 8))
            own = zoom(nodes, np.divide(shape, nodes.shape), order=1, grid_mode=True, mode="nearest")
            own = own.astype(np.float32) * fall_off
            own *= 1.0 + 0.02 * rng.standard_normal(shape, np.float32)
            yield Fields(name, j, own[..., None] * surface.A[:, j].astype(np.float32))
        yield Fields(name, None, fall_off[..., None] * surface.black.astype(np.float32))


def prepare(folder: Path, shape: tuple[int, int]) -> None:
    """The model's folder, and the wanted colours as two files."""
    model = MODELS["K=2"]()
    write_model_image(folder, fields_of(model, shape), model.n)
    median = median_model(model, folder, np.ones(shape, bool))
    write_json(folder / "model.json", model_to_dict(median) | {"image": FOLDER})
    for name, Lab in zip(("pattern", "white"), photographs(PAIRS[0], shape, True), strict=True):
        assert Lab is not None
        np.save(folder / f"wanted-{name}.npy", Lab)


def peak_MB() -> float:
    """Most memory that was resident at a time, mapped files included (what `resource` tells is inherited)."""
    status = Path("/proc/self/status").read_text(encoding="ascii")
    return int(status.split("VmHWM:")[1].split()[0]) / 1e3


def measure(folder: Path) -> None:
    """Invert the frame, with warm kernels and cold files, and print the figures."""
    model = load_image_model(folder)
    wanted = [np.load(folder / f"wanted-{name}.npy") for name in ("pattern", "white")]
    tile = tuple(slice(0, 32) for _ in range(2))
    invert(*(Lab[tile] for Lab in wanted), model.at(tile))  # compiles, or loads, the kernels
    before = peak_MB()
    begin, cpu = time.perf_counter(), time.process_time()
    result = invert(wanted[0], wanted[1], model)
    figures = {
        "wall_s": time.perf_counter() - begin,
        "cpu_s": time.process_time() - cpu,
        "status": result.counts(),
        "dE00_pattern_mean": float(result.dE_pattern.mean()),
        "before_MB": before,
        "peak_MB": peak_MB(),
    }
    print(json.dumps(figures))


def main() -> None:
    """Make the model, measure, write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--height", type=int, default=HEIGHT)
    parser.add_argument("--measure", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measure:
        measure(given.measure)
        return
    shape = (given.height, given.height * WIDTH // HEIGHT)
    with tempfile.TemporaryDirectory() as name:
        prepare(Path(name), shape)
        command = [sys.executable, "-m", "reports.image_based", "--measure", name]
        run = subprocess.run(command, check=True, capture_output=True, text=True)
    figures = {"what": "image-based inversion, K = 2, both surfaces, 2 threads", "pixels": shape[0] * shape[1]}
    figures |= {
        key: round(value, 2) if isinstance(value, float) else value for key, value in json.loads(run.stdout).items()
    }
    print(json.dumps(figures, indent=1))
    if given.height == HEIGHT:
        RESULT.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
