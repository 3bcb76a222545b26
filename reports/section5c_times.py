"""Section V-C: how long one 4K projection image takes, K = 2 and 3 with three channels, K = 3 with one.

Two photographs (one, with one channel) are reduced to the lightness a print can show and left out of gamut in most
places, as Eq. 5 is meant for; every pixel is solved, then assembled by Eq. 6 as the paper does. Matrices are readings
of the virtual bench (`bench_models.py`). Times are this machine's; `inversion_benchmark.py` runs the paper's own solver
beside ours.
"""

from __future__ import annotations

import os
import sys
import time

import numpy as np

from paxel_runtime.assembly import AssemblyOptions, assemble
from paxel_runtime.inversion import CAPPED, EXACT, invert
from paxel_runtime.pictures import load_picture
from reports.bench_models import bench_model
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import photograph

PAPER_MINUTES = {"K=2": 13 + 35 / 60, "K=3": 41 + 44 / 60, "single channel": 2 + 26 / 60}
MAPPED = {"pattern": (0.43, 12.0, 0.5), "white": (0.45, 40.0, 0.5)}
"""L* gain and offset, chroma scale: what reduces a photograph to each surface."""

ITEM = Item(
    "section5c_times",
    "Section V-C",
    "4K on a workstation of 8 cores, C++ and BOBYQA: 3 channels, K = 2 13:35 min, K = 3 41:44 min; 1 channel, K = 3 "
    "2:26 min",
)


def make(run: Run) -> Result:
    """Seconds of inversion and assembly for each kind of model."""
    width, height = (480, 270) if run.quick else (3840, 2160)
    figures: dict[str, Figure] = {"cores": Figure(os.cpu_count() or 1, "", "time")}
    words, solved = [], True
    for name, minutes in PAPER_MINUTES.items():
        model = bench_model(name)
        pictures = [load_picture(photograph(one), width, height) for one in ("rocket", "coffee")]
        if model.white is None:
            targets: list[np.ndarray | None] = [pictures[1], None]
        else:
            targets = [_reduced(Lab, *MAPPED[key]) for Lab, key in zip(pictures, MAPPED, strict=True)]
        invert(*(None if Lab is None else Lab[:8] for Lab in targets), model)  # compiles, or reads what was compiled
        labels = np.add.outer(np.arange(height) // 5, np.arange(width) // 5) % len(model.clusters)
        start = time.perf_counter()
        found = invert(*targets, model)
        seconds = time.perf_counter() - start
        assemble(found.x, labels.astype(np.uint8), model, 8, AssemblyOptions(method="dither"))
        whole = time.perf_counter() - start
        paper = None if run.quick else minutes * 60
        figures[f"{name}, inversion"] = Figure(seconds, "s", "time")
        figures[f"{name}, inversion and assembly"] = Figure(whole, "s", "time", paper)
        figures[f"{name}, pixels out of gamut"] = Figure(float(np.mean(found.status != EXACT)), "", "share")
        solved &= float(np.mean(found.status == CAPPED)) < 1e-3
        words.append(f"{name} {whole:.2g} s")
    what = f"{width} x {height}, {os.cpu_count()} cores"
    relations = {"all but one in 1000 pixels end at an optimum": solved}
    return Result(f"{', '.join(words)} ({what})", figures, relations, measured_on="this machine, bench matrices")


def _reduced(Lab: np.ndarray, gain: float, offset: float, chroma: float) -> np.ndarray:
    return np.ascontiguousarray(Lab * np.float32([gain, chroma, chroma]) + np.float32([offset, 0, 0]))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
