"""Layouts ranked by their moire: as it is foretold, and as the virtual bench's camera sees it.

*Photographed*: 30 layouts, each with its white cluster lit green, against what is foretold for that projector as it is
aimed, with the grain of ragged edges (Spearman's rank correlation), and for a projector aimed straight. *Foretold*: the
worst moire over zooms of 3 % to either side, by how pixels are sorted. Fig. 12 itself is `fig12_pattern_layouts.py`.
Writes reference/moire_ranking.json (five minutes); ``--quick`` writes nothing and compares a few figures with it.

    python -m reports.moire_ranking [--quick]
"""

from __future__ import annotations

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import spearmanr

from paxel_design.patterns import make_pattern
from paxel_design.visibility import moire, moire_of_picture
from paxel_design.visibility.edges import RAGGED_MM
from paxel_design.visibility.moire import Partition
from paxel_runtime.model.pattern import Pattern
from reports.bench_floors import rounded
from reports.lit_cluster import PITCH_MM, LitCluster

RESULT = Path(__file__).parent / "reference" / "moire_ranking.json"
DISTANCE_MM, PIECE_PX, RANKED_PX = 4000.0, 256, 224
PRINT_SCALE = (1.002, 0.999)  # what the rulers of the bench's print measure
ZOOMS = np.linspace(0.97, 1.03, 13)
THIRD = float(np.rad2deg(np.arctan(1 / 3)))
LAYOUTS = {"0": ("checkerboard", 0.0), "30": ("checkerboard", 30.0), "atan(1/3)": ("checkerboard", THIRD),
           "blue noise": ("blue-noise", 0.0)}  # fmt: skip
SORTINGS: tuple[tuple[Partition, int], ...] = (("lab", 2), ("lab", 3), ("light", 2), ("light", 3))
RANKED = [("checkerboard", angle, dot) for dot in (0.5, 0.62, 0.75, 1.0) for angle in (0.0, 10.0, THIRD, 26.565, 30.0,
          37.0, 45.0)] + [("blue-noise", 0.0, dot) for dot in (0.5, 0.75)]  # fmt: skip


def layout(name: str, angle_deg: float, dot_mm: float) -> Pattern:
    """A black-and-white layout somewhat larger than the projection."""
    return make_pattern(name, ("black", "white"), dot_mm, angle_deg, (80.0, 50.0))


def foretold(dots_mm: tuple[float, ...], sortings: Any, zooms: Any) -> dict[str, Any]:
    """The worst moire of every layout over zooms, each at a phase of its own, and its ratio to that of 30 degrees."""
    table: dict[str, Any] = {}
    for partition, K in sortings:
        for dot in dots_mm:
            worst = {name: max(moire(layout(*kind, dot), PITCH_MM * zoom, DISTANCE_MM, K=K, partition=partition,
                                     size_px=PIECE_PX, offset_px=(0.37 * k % 1, 0.71 * k % 1)).visibility
                               for k, zoom in enumerate(zooms)) for name, kind in LAYOUTS.items()}  # fmt: skip
            row = {"visibility": worst, "over 30": {name: seen / worst["30"] for name, seen in worst.items()}}
            table.setdefault(f"{partition}, K = {K}", {})[f"{dot:g} mm"] = row
            print(f"{partition}, K = {K}, {dot:g} mm:", rounded(row))
    return table


def photographed(cases: list[tuple[str, float, float]], sortings: Any) -> dict[str, Any]:
    """Slow contrast foretold and photographed; foretold also for a projector aimed straight, without grain."""
    found: dict[str, Any] = {f"{partition}, K = {K}": [] for partition, K in sortings}
    for case in cases:
        printed, lit = replace(layout(*case), print_scale=PRINT_SCALE), LitCluster(layout(*case), RANKED_PX)
        for partition, K in sortings:
            how: dict[str, Any] = {"K": K, "partition": partition, "size_px": RANKED_PX}
            seen = moire_of_picture(lit.photograph(partition, K), case[2], lit.camera_px_mm, DISTANCE_MM)
            told = moire(printed, PITCH_MM, DISTANCE_MM, **how, aim=lit.aim, ragged_mm=RAGGED_MM)
            row = {"photographed": seen.contrast, "foretold": told.contrast,
                   "straight": moire(printed, PITCH_MM, DISTANCE_MM, **how).contrast}  # fmt: skip
            found[f"{partition}, K = {K}"].append({"layout": case, **row})
            print(*case, partition, K, rounded(row))
    return {name: {"spearman": {key: float(spearmanr([row["photographed"] for row in rows], [row[key] for row in rows])
                                           .statistic) for key in ("foretold", "straight")}, "rows": rows}
            for name, rows in found.items()}  # fmt: skip


def main() -> None:
    """Compute all, or a few figures to compare."""
    options = argparse.ArgumentParser(description="Layouts ranked by their moire")
    options.add_argument("--quick", action="store_true", help="a few figures, compared with the reference")
    if options.parse_args().quick:
        before = json.loads(RESULT.read_text(encoding="utf-8"))
        few = photographed(RANKED[14:17], SORTINGS[1:2])["lab, K = 3"]["rows"]
        for row, was in zip(few, before["photographed"]["lab, K = 3"]["rows"][14:17], strict=True):
            np.testing.assert_allclose([row[k] for k in ("photographed", "foretold")],
                                       [was[k] for k in ("photographed", "foretold")], rtol=0.02)  # fmt: skip
        return
    figures = {"what": "moire of layouts, foretold and photographed (virtual bench)",
               "photographed": photographed(RANKED, SORTINGS),
               "foretold": foretold((0.5, 0.75, 1.0), SORTINGS[:3], ZOOMS)}  # fmt: skip
    RESULT.write_text(json.dumps(rounded(figures), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
