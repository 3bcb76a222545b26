"""Gamuts: volumes beside other programs, our .gam in Argyll's viewgam, times, and the paper's sampling in one run.

    python reports/gamut_benchmark.py [--sampling-steps 21]

cielab-gamut-tools (PyPI) and Argyll's iccgamut and viewgam are asked where they are installed; the volumes that they
gave are kept in `TOLD` for machines without them. `gamut_oracles.py` asks whether the sets are right. Writes
``reference/gamut_benchmark.json``. With the paper's 21 steps it takes some four minutes on two cores, half of them
for the 85,766,121 samples of each of three sets.
"""

from __future__ import annotations

import argparse
import json
import re
import shutil
import struct
import subprocess
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut import (
    RGB_SPACES,
    JointGamut,
    gamut_mesh,
    lightness_area,
    product_pair,
    rgb_space,
    sampled_figures,
    sampled_gamut,
    subgamut_and_mesh,
    write_mesh,
)
from paxel_design.gamut.comparison import rgb_primaries
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_XYZ, linear_sRGB_to_XYZ
from paxel_runtime.model.effects import parse_effect
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

TOLD = {
    "srgb": {"cielab-gamut-tools": 830_807, "iccgamut": 832_957},
    "dci-p3": {"cielab-gamut-tools": 1_172_361, "iccgamut": 1_176_434},
    "rec2020": {"cielab-gamut-tools": 1_853_300},
}
"""Volumes under D50: cielab-gamut-tools 0.5.4; Argyll 2.3.1, iccgamut -ir -d 20."""

EXACT = ("full", "decolorize", "neutralize", "full-change")
LEVEL_SETS = ("hue-shift:45", "hue-shift:135", "chroma:0.5")
SAMPLED = ("full", "neutralize:50,0,0,2", "hue-shift:45")


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


def timed(run: Callable[[], Any], *, compiled: bool = False) -> tuple[float, Any]:
    """Seconds and result, after one run that compiles where that was not done."""
    if not compiled:
        run()
    start = time.perf_counter()
    result = run()
    return time.perf_counter() - start, result


def told_by_others(name: str) -> dict[str, float]:
    """Volumes of an RGB space under D50 by the programs that are installed, else as they told them once."""
    told: dict[str, float] = dict(TOLD[name])
    try:
        from cielab_gamut_tools import SyntheticGamut

        make = {"srgb": SyntheticGamut.srgb, "dci-p3": SyntheticGamut.dci_p3, "rec2020": SyntheticGamut.bt2020}[name]
        told["cielab-gamut-tools"] = float(make().volume())
    except ImportError:
        pass
    if shutil.which("iccgamut"):
        with tempfile.TemporaryDirectory() as folder:
            (Path(folder) / "space.icc").write_bytes(matrix_profile(rgb_primaries(name, under_D50=True)[0]))
            command = ["iccgamut", "-v", "-ir", "-d", "20", "space.icc"]
            output = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False).stdout
            found = re.search(r"volume of gamut is ([0-9.]+)", output)
            if found:
                told["iccgamut"] = float(found.group(1))
    return told


def matrix_profile(primaries: NDArray[np.float64]) -> bytes:
    """An ICC profile of version 2 (ICC.1:2001-04) of primaries (3, 3) under D50, in columns, with a gamma of 2.2."""

    def xyz(values: Any) -> bytes:
        return b"XYZ \0\0\0\0" + b"".join(struct.pack(">i", round(float(v) * 65536)) for v in values)

    D50 = (0.9642, 1.0, 0.8249)
    curve = b"curv\0\0\0\0" + struct.pack(">IH", 1, 563) + b"\0\0"
    tags = {
        b"desc": b"desc\0\0\0\0" + struct.pack(">I", 2) + b"x\0" + bytes(78 + 3),
        b"cprt": b"text\0\0\0\0x\0\0\0",
        b"wtpt": xyz(D50),
        **{name + b"XYZ": xyz(column) for name, column in zip((b"r", b"g", b"b"), primaries.T, strict=True)},
        **{name + b"TRC": curve for name in (b"r", b"g", b"b")},
    }
    start, table, body = 128 + 4 + 12 * len(tags), struct.pack(">I", len(tags)), b""
    for tag, content in tags.items():
        content += bytes(-len(content) % 4)
        table += tag + struct.pack(">II", start + len(body), len(content))
        body += content
    head = struct.pack(">I4sI", 128 + len(table) + len(body), bytes(4), 0x02100000) + b"mntrRGB XYZ "
    head += struct.pack(">6H", 2001, 4, 1, 0, 0, 0) + b"acsp" + bytes(28) + xyz(D50)[8:]
    return head + bytes(128 - len(head)) + table + body


def viewgam_share(name: str) -> float | None:
    """Volume that Argyll's viewgam reads from our .gam of a coarse mesh, over the mesh's own; None without viewgam."""
    if shutil.which("viewgam") is None:
        return None
    with tempfile.TemporaryDirectory() as folder:
        # It tells volumes only of two bodies it cuts, which takes minutes for fine ones.
        mesh = gamut_mesh(rgb_space(name, under_D50=True), 40.0)
        write_mesh(mesh, Path(folder) / "own.gam")
        command = ["viewgam", "-i", "own.gam", "own.gam", "out"]
        told = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        found = re.search(r"'own.gam' volume = ([0-9.]+)", told.stdout + told.stderr)
    return float(found.group(1)) / mesh.mesh_volume if found else None


def against_sampling(joint: JointGamut, steps: int) -> dict[str, Any]:
    """Each set by us and by sampling, in turn: seconds, volumes, and the cells of our set that sampling misses."""
    told = {}
    for text in SAMPLED:
        effect = parse_effect(text)
        sampled_gamut(joint, effect, steps=3)  # compiles
        ours, (exact, mesh) = timed(lambda effect=effect: subgamut_and_mesh(joint, effect))
        start = time.perf_counter()
        cells = sampled_gamut(joint, effect, steps=steps)
        seconds = time.perf_counter() - start
        assert cells.field is not None
        # Cells around our set only: most of the paper's cells are nobody's.
        low, high = (((end - cells.field.origin) / cells.field.step).astype(int) for end in (
            mesh.Lab.min(axis=0), mesh.Lab.max(axis=0) + 2 * cells.field.step
        ))  # fmt: skip
        around = tuple(slice(max(i, 0), j) for i, j in zip(low, high, strict=True))
        found = cells.field.values[around] > 0
        nodes = [cells.field.origin[d] + cells.field.step * np.arange(s.start, s.stop) for d, s in enumerate(around)]
        inside = np.zeros(found.shape, bool)
        for inside_of_L, L in zip(inside, nodes[0], strict=True):
            nodes_of_L = np.stack(np.meshgrid(L, nodes[1], nodes[2], indexing="ij"), axis=-1)[0]
            inside_of_L[:] = exact.contains(Lab_to_XYZ(nodes_of_L, exact.white_point))
        missed = int(np.count_nonzero(inside & ~found))
        told[text] = {
            "seconds": ours, "seconds_of_sampling": seconds, "times_as_fast": seconds / ours, "volume": mesh.volume,
            "volume_of_sampling": sampled_figures(cells)["volume"], "cells": int(inside.sum()), "cells_missed": missed,
        }  # fmt: skip
        print(text, told[text], flush=True)
    return {"steps": steps, "samples": steps**joint.model.n, "sets": told}


def times_of(model: PredictionModel, compiled: bool) -> dict[str, Any]:
    """Seconds, and volumes."""
    seconds: dict[str, float] = {}
    volumes: dict[str, float] = {}
    seconds["joint"], joint = timed(lambda: _with_rows(JointGamut(model)), compiled=compiled)
    seconds["lightness"], _ = timed(lambda: lightness_area(joint), compiled=compiled)
    seconds["product pair"], sides = timed(lambda: product_pair(joint), compiled=compiled)
    volumes |= {f"product pair on {side.shown_on}": gamut_mesh(side).volume for side in sides}
    for effect in (*EXACT, *LEVEL_SETS):
        run = partial(subgamut_and_mesh, joint, effect)
        seconds[effect], (_, mesh) = timed(run, compiled=compiled)
        volumes[effect] = mesh.volume
    return {"rows": len(joint.offsets), "seconds": seconds, "volumes": volumes}


def _with_rows(joint: JointGamut) -> JointGamut:
    assert len(joint.offsets)
    return joint


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sampling-steps", type=int, default=21, help="the paper's are 21; 0 leaves sampling out")
    steps = parser.parse_args().sampling_steps
    path = Path(__file__).parent / "reference" / "gamut_benchmark.json"
    figures: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    figures |= {"rgb_spaces": {}, "models": {}}
    for name in RGB_SPACES:
        mesh = gamut_mesh(rgb_space(name, under_D50=True))
        others = told_by_others(name)
        figures["rgb_spaces"][name] = {
            "volume": mesh.volume, "mesh_volume": mesh.mesh_volume, "others": others,
            "percent_off": {who: 100 * (mesh.volume / volume - 1) for who, volume in others.items()},
            "viewgam_share": viewgam_share(name),
        }  # fmt: skip
        print(name, figures["rgb_spaces"][name], flush=True)
    for clusters, colored in ((2, False), (3, False), (6, True)):
        model = model_of(clusters, colored)
        # The first model has all kernels compiled.
        figures["models"][f"n = {model.n}"] = times_of(model, compiled=clusters > 2)
        print(model.n, json.dumps(figures["models"][f"n = {model.n}"], indent=1), flush=True)
    if steps:
        figures["sampling"] = against_sampling(JointGamut(model_of(2, False)), steps)
    path.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
