"""Gamuts: volumes beside other programs, our .gam in Argyll's viewgam, times, and the paper's sampling in the same run.

    python reports/gamut_benchmark.py [--sampling-steps 21]

Volumes of RGB spaces stand beside cielab-gamut-tools (PyPI) and Argyll's iccgamut, as published in design section 8;
viewgam is run where it is installed. Writes ``reference/gamut_benchmark.json``. Sampling 21^6 inputs takes minutes.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from paxel_design.gamut import (
    RGB_SPACES,
    JointGamut,
    gamut_mesh,
    lightness_area,
    product_pair,
    rgb_space,
    sampled_figures,
    sampled_gamut,
    sub_gamut,
    subgamut_and_mesh,
    write_mesh,
)
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.model.effects import Neutralize
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

PUBLISHED = {"srgb": 833_500, "dci-p3": 1_175_000, "rec2020": 1_856_000}
EXACT = ("full", "decolorize", "neutralize", "full-change")
LEVEL_SETS = ("hue-shift:45", "hue-shift:135", "chroma:0.5")


def model_of(clusters: int, colored: bool) -> PredictionModel:
    """A print in grays, or in six colours, under sRGB's primaries, with 0.3 % of errors of measurement."""
    rng = np.random.default_rng(clusters)
    primaries = linear_sRGB_to_XYZ(np.eye(3)).T
    solids = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0, 1, 1], [1, 0, 1], [1, 1, 0]])[:clusters]
    ink = 0.05 + 0.85 * solids if colored else np.linspace(0.04, 1, clusters)[:, None]
    reflectance = 0.85 * ink + 0.15 * ink.mean(axis=0)
    A_white = np.tile(primaries / clusters, clusters) * (1 + 0.003 * rng.standard_normal((3, 3 * clusters)))
    A = np.concatenate([r[:, None] * primaries / clusters for r in reflectance], axis=1)
    A *= 1 + 0.003 * rng.standard_normal(A.shape)
    scale, code = 1 / (1.001 * A_white[1].sum()), np.linspace(0, 1, 3)
    pattern, white = (SurfaceModel(scale * M, 0.001 * scale * M.sum(axis=1)) for M in (A, A_white))
    names = tuple(f"cluster {i}" for i in range(clusters))
    response = ProjectorResponse((code,) * 3, (code,) * 3)
    return PredictionModel(("red", "green", "blue"), names, pattern, white, D65_XYZ, response)


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """Seconds and result, after one run that compiles."""
    run()
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


def viewgam_volume(name: str) -> float | None:
    """Volume that Argyll's viewgam reads from our .gam; None without viewgam."""
    if shutil.which("viewgam") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        write_mesh(gamut_mesh(rgb_space(name, under_D50=True)), Path(folder) / "own.gam")
        command = ["viewgam", "-v", "own.gam", "out"]
        told = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        found = re.search(r"[Vv]olume[^0-9]*([0-9.]+)", told.stdout + told.stderr)
    return float(found.group(1)) if found else None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sampling-steps", type=int, default=0, help="21 for the paper's; 0 leaves it out")
    steps = parser.parse_args().sampling_steps
    figures: dict[str, Any] = {"rgb_spaces": {}, "models": {}}
    for name in RGB_SPACES:
        mesh = gamut_mesh(rgb_space(name, under_D50=True))
        figures["rgb_spaces"][name] = {
            "volume": mesh.volume, "mesh_volume": mesh.mesh_volume, "published": PUBLISHED[name],
            "viewgam": viewgam_volume(name),
        }  # fmt: skip
        print(name, figures["rgb_spaces"][name], flush=True)
    for clusters, colored in ((2, False), (3, False), (6, True)):
        model = model_of(clusters, colored)
        seconds: dict[str, float] = {}
        volumes: dict[str, float] = {}
        seconds["joint"], joint = timed(lambda model=model: _with_rows(JointGamut(model)))
        seconds["lightness"], _ = timed(lambda joint=joint: lightness_area(joint))
        seconds["product pair"], _ = timed(lambda joint=joint: product_pair(joint))
        for effect in (*EXACT, *LEVEL_SETS):
            seconds[effect], (_, mesh) = timed(lambda joint=joint, effect=effect: subgamut_and_mesh(joint, effect))
            volumes[effect] = mesh.volume
        figures["models"][f"n = {model.n}"] = {"seconds": seconds, "volumes": volumes}
        print(model.n, json.dumps({"seconds": seconds, "volumes": volumes}, indent=1), flush=True)
    if steps:
        figures["sampling"] = against_sampling(JointGamut(model_of(2, False)), steps)
        print(figures["sampling"])
    path = Path(__file__).parent / "reference" / "gamut_benchmark.json"
    path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


def _with_rows(joint: JointGamut) -> JointGamut:
    assert len(joint.offsets)
    return joint


def against_sampling(joint: JointGamut, steps: int) -> dict[str, Any]:
    """The neutralisation set by sampling: time, and the share of the exact set's cells of one unit that it misses."""
    start = time.perf_counter()
    cells = sampled_gamut(joint, Neutralize((50, 0, 0), 2.0), steps=steps)
    seconds = time.perf_counter() - start
    exact = sub_gamut(joint, Neutralize((50, 0, 0), 2.0))
    assert cells.field is not None
    nodes = cells.field.origin + cells.field.step * np.moveaxis(np.indices(cells.field.values.shape), 0, -1)
    inside = exact.contains(Lab_to_XYZ(nodes, exact.white_point))
    missed = np.count_nonzero(inside & (cells.field.values < 0)) / np.count_nonzero(inside)
    return {"steps": steps, "seconds": seconds, "cells": sampled_figures(cells)["volume"], "share_missed": missed}


if __name__ == "__main__":
    main()
