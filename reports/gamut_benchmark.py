"""Gamuts: volumes beside other programs, our .gam in Argyll's viewgam, times, oracles, and the paper's sampling.

    python reports/gamut_benchmark.py [--sampling-steps 21]

Volumes of RGB spaces stand beside cielab-gamut-tools (PyPI) and Argyll's iccgamut, as published in design section 8;
viewgam is run where it is installed. Exact sets are asked of HiGHS, product pairs of `invert`, hue sets of a dense
search. Writes ``reference/gamut_benchmark.json``. Sampling 21^6 inputs takes minutes.
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
from scipy.optimize import linprog

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
from paxel_design.gamut.gray_sets import gray_relation
from paxel_design.gamut.margins import hue_margins
from paxel_design.gamut.polytopes import polytope
from paxel_runtime.inversion import invert
from paxel_runtime.model.colorimetry import D65_XYZ, Lab_to_LCh, Lab_to_XYZ, LCh_to_Lab, XYZ_to_Lab, linear_sRGB_to_XYZ
from paxel_runtime.model.effects import CHROMA_FLOOR, HueShift, Neutralize
from paxel_runtime.model.prediction import PredictionModel, SurfaceModel
from paxel_runtime.model.response import ProjectorResponse

PUBLISHED = {"srgb": 833_500, "dci-p3": 1_175_000, "rec2020": 1_856_000}
EXACT = ("full", "decolorize", "neutralize", "full-change")
PROBED = ("full", "decolorize:free", "decolorize:relative", "neutralize")
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


def probes_by_highs(joint: JointGamut, effect: str, count: int) -> dict[str, float]:
    """Colours about the surface of an exact set: how far each is from one with an input and a partner, by HiGHS."""
    model, rng = joint.model, np.random.default_rng(1)
    assert model.white is not None
    gamut = sub_gamut(joint, effect)
    corners = polytope(gamut.normals, gamut.offsets).vertices
    middle, n = corners.mean(axis=0), model.n
    out = rng.dirichlet(np.full(len(corners), 0.02), count) @ corners - middle
    reach = np.max(out @ gamut.normals.T / (gamut.offsets - gamut.normals @ middle), axis=1)
    colors = middle + out / reach[:, None] * (1 + rng.normal(0, 0.02, (count, 1)))
    partner = np.asarray(Lab_to_XYZ((50.0, 0.0, 0.0), model.white_point), np.float64)
    along = np.zeros(3)
    slope, base = gray_relation(joint, "pattern")
    wrong_inside = wrong_outside = 0
    for XYZ, slack in zip(colors, gamut.slack(colors), strict=True):
        if effect.startswith("decolorize"):
            free = effect == "decolorize:free"
            partner = np.zeros(3) if free else (slope * XYZ[1] + base) * model.white_point
            along = model.white_point if free else np.zeros(3)
        rows = 3 if effect == "full" else 6
        A = np.block([[model.pattern.A, np.zeros((3, 1))], [model.white.A, -along[:, None]]])[:rows]
        wanted = np.concatenate((XYZ - model.pattern.black, partner - model.white.black))[:rows]
        one = np.ones((rows, 1))
        distance = linprog(
            np.append(np.zeros(n + 1), 1.0),
            A_ub=np.block([[A, -one], [-A, -one]]),
            b_ub=np.append(wanted, -wanted),
            bounds=[(0, 1)] * n + [(-2, 2), (0, None)],
            method="highs",
        ).fun
        # HiGHS keeps its constraints to 1e-7.
        wrong_inside += int(slack > 1e-6 and distance > 1e-6)
        wrong_outside += int(slack < -1e-6 and distance < 1e-8)
    return {"probes": count, "inside": int(np.sum(gamut.slack(colors) >= 0)), "wrongly_inside": wrong_inside,
            "wrongly_outside": wrong_outside}  # fmt: skip


def pairs_by_invert(joint: JointGamut, count: int) -> dict[str, float]:
    """Random pairs of a product pair: the largest dE that the inversion leaves."""
    rng = np.random.default_rng(2)
    Lab = []
    for side in product_pair(joint):
        corners = polytope(side.normals, side.offsets).vertices
        Lab.append(XYZ_to_Lab(rng.dirichlet(np.full(len(corners), 0.1), count) @ corners, side.white_point))
    result = invert(Lab[0], Lab[1], joint.model)
    worst = np.maximum(result.dE_pattern, result.dE_white)
    return {"pairs": count, "worst_dE": float(worst.max()), "below_1e-3": float(np.mean(worst < 1e-3))}


def hue_margins_by_search(joint: JointGamut, angle: float, count: int) -> dict[str, float]:
    """Colours near a hue set's boundary, and the slack of the best of a dense fan of partners, in XYZ.

    ``missed`` counts colours outside with a partner well in reach, ``unproven`` colours 0.2 inside without one.
    """
    model, rng = joint.model, np.random.default_rng(3)
    XYZ = model.pattern.predict_XYZ(rng.beta(0.5, 0.5, (20 * count, model.n)))
    margin = hue_margins(model, HueShift(angle), "pattern")(XYZ)
    near = np.argsort(np.abs(margin))[:count]
    L, turn = np.linspace(1, 100, 100), np.linspace(angle, 360 - angle, 60)
    C = np.concatenate((np.linspace(CHROMA_FLOOR, 8, 4), np.arange(10.0, 80, 3)))
    fan = np.stack(np.meshgrid(L, C, turn, indexing="ij"), axis=-1).reshape(-1, 3)
    missed = unproven = 0
    for color, value in zip(XYZ[near], margin[near], strict=True):
        hue = float(Lab_to_LCh(XYZ_to_Lab(color, model.white_point))[2])
        partners = np.asarray(Lab_to_XYZ(LCh_to_Lab(fan + np.array([0, 0, hue])), model.white_point))
        slack = float(joint.slack(np.broadcast_to(color, partners.shape), partners).max())
        missed += int(value < -0.01 and slack > 1e-5)
        unproven += int(value > 0.2 and slack < -1e-3)
    return {"colours": count, "inside": int(np.sum(margin[near] >= 0)), "missed": missed, "unproven": unproven}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sampling-steps", type=int, default=0, help="21 for the paper's; 0 leaves it out")
    steps = parser.parse_args().sampling_steps
    figures: dict[str, Any] = {"rgb_spaces": {}, "models": {}}
    for name in RGB_SPACES:
        mesh = gamut_mesh(rgb_space(name, under_D50=True))
        figures["rgb_spaces"][name] = {
            "volume": mesh.volume, "mesh_volume": mesh.mesh_volume, "published": PUBLISHED[name],
            "viewgam_share": viewgam_share(name),
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
        oracles: dict[str, Any] = {effect: probes_by_highs(joint, effect, 200) for effect in PROBED}
        oracles["product pair"] = pairs_by_invert(joint, 2000)
        if clusters < 6:
            oracles |= {
                f"hue-shift:{angle}": hue_margins_by_search(joint, angle, 100 if clusters == 2 else 20)
                for angle in (45, 135)
            }
        figures["models"][f"n = {model.n}"] = {"seconds": seconds, "volumes": volumes, "oracles": oracles}
        print(model.n, json.dumps(figures["models"][f"n = {model.n}"], indent=1), flush=True)
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
