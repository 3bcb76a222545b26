"""Fig. 12: checkerboards at 0 and at 30 degrees and blue noise, one cluster lit green, photographed, with spectra.

Moire is what the eye sees of a lit cluster at frequencies below the print's own, the worst over zooms of the projector
of 3 % to either side. How well it is foretold for 30 layouts, and by how pixels are sorted: `moire_ranking.py`.
"""

from __future__ import annotations

import sys

import numpy as np

from paxel_design.patterns import make_pattern
from paxel_design.visibility import moire, moire_of_picture, pattern_visibility
from paxel_runtime.model.pattern import Pattern
from reports.lit_cluster import PITCH_MM, LitCluster, draw_panels
from reports.paper import Figure, Item, Result, Run, run_item

DISTANCE_MM, PIECE_PX, PHOTOGRAPHED_PX = 4000.0, 256, 224
THIRD = "atan(1/3)"
LAYOUTS = {
    "0 degrees": ("checkerboard", 0.0),
    "blue noise": ("blue-noise", 0.0),
    "30 degrees": ("checkerboard", 30.0),
    THIRD: ("checkerboard", float(np.rad2deg(np.arctan(1 / 3)))),
}
LEAST = {0.5: 1.5, 0.75: 2.0, 1.0: 2.0}
"""How many times the moire of 30 degrees that of 0 degrees is at least, by dot size in mm."""

ITEM = Item(
    "fig12_pattern_layouts",
    "Fig. 12",
    "K = 2, one cluster lit green: a regular checkerboard has strong moire; blue noise has none and is seen plainly; "
    "30 degrees has little of both",
)


def make(run: Run) -> Result:
    """Moire foretold and photographed, and how plainly each print is seen by itself."""
    zooms = np.linspace(0.97, 1.03, 4 if run.quick else 13)
    figures, relations, over = {}, {}, {}
    for dot in (0.75,) if run.quick else LEAST:
        worst = {name: worst_moire(layout(name, dot), zooms) for name in LAYOUTS}
        over[dot] = worst["0 degrees"] / worst["30 degrees"]
        figures |= {f"moire, {name}, {dot:g} mm": Figure(v, "thresholds", "ratio") for name, v in worst.items()}
        figures[f"0 over 30 degrees, {dot:g} mm"] = Figure(over[dot], "", "ratio")
        figures[f"{THIRD} over 30 degrees, {dot:g} mm"] = Figure(worst[THIRD] / worst["30 degrees"], "", "ratio")
        relations[f"0 degrees has {LEAST[dot]:g} times the moire of 30 or more, {dot:g} mm"] = over[dot] >= LEAST[dot]
    aligned, off = (
        moire(layout("0 degrees", 5 * PITCH_MM), PITCH_MM * zoom, DISTANCE_MM).contrast for zoom in (1.0, 1.001)
    )
    figures["contrast of an exactly aligned grid"] = Figure(aligned, "", "ratio")
    figures["the same, 0.1 % larger"] = Figure(off, "", "ratio")
    relations["an exactly aligned grid has no moire, 0.1 % of scale brings it back"] = aligned < 1e-6 < 1e-4 < off
    alone, lines, panels, seen = {}, {}, [], {}
    for name in list(LAYOUTS)[:3]:
        pattern = layout(name, 0.75)
        alone[name] = pattern_visibility(pattern, DISTANCE_MM).luminance
        lines[name] = moire(pattern, PITCH_MM, DISTANCE_MM, size_px=PIECE_PX).line_share
        lit = LitCluster(pattern, PHOTOGRAPHED_PX)
        picture = lit.photograph("lab", 2)
        seen[name] = moire_of_picture(picture, 0.75, lit.camera_px_mm, DISTANCE_MM).contrast
        words = name if name == "blue noise" else f"checkerboard, {name}"
        panels.append((f"{words}: 0.75 mm, white cluster (virtual bench)", picture))
        figures[f"print alone, {name}"] = Figure(alone[name], "thresholds", "ratio")
        figures[f"share of moire in its strongest line, {name}"] = Figure(lines[name], "", "share")
        figures[f"photographed slow contrast, {name}"] = Figure(seen[name], "", "ratio")
    relations |= {
        "blue noise by itself is seen far more plainly": alone["blue noise"] > 100 * alone["30 degrees"],
        "its moire has no lines to speak of": lines["blue noise"] < 0.5 * min(lines["0 degrees"], lines["30 degrees"]),
        "the photograph of 0 degrees has more slow contrast than that of 30": seen["0 degrees"] > seen["30 degrees"],
    }
    draw_panels(panels, int(1.6 / 0.75 * PHOTOGRAPHED_PX * PITCH_MM)).save(run.folder / f"{ITEM.name}.jpg", quality=85)
    times = ", ".join(f"{ratio:.1f} at {dot:g} mm" for dot, ratio in over.items())
    ours = f"moire of 0 over 30 degrees: {times}; blue noise by itself at {alone['blue noise']:.0f} thresholds"
    return Result(ours, figures, relations, (f"{ITEM.name}.jpg",))


def layout(name: str, dot_mm: float) -> Pattern:
    """A black-and-white layout somewhat larger than the projection."""
    kind, angle_deg = LAYOUTS[name]
    return make_pattern(kind, ("black", "white"), dot_mm, angle_deg, (80.0, 50.0))


def worst_moire(pattern: Pattern, zooms: np.ndarray) -> float:
    """Thresholds at the worst zoom, each at a phase of its own; pixels sorted by k-means in CIELAB, K = 2."""
    return max(
        moire(pattern, PITCH_MM * zoom, DISTANCE_MM, partition="lab", size_px=PIECE_PX,
              offset_px=(0.37 * k % 1, 0.71 * k % 1)).visibility
        for k, zoom in enumerate(zooms)
    )  # fmt: skip


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
