"""Fig. 2 of the paper: how colours form, on the virtual bench.

(a) A saturated red on the black dots and a weak, pale blue on the white ones: blue on the print, red on a white sheet.
(b) The same on six inks: red on those that swallow it (green, blue, cyan), blue on those that return it (magenta, blue,
cyan). (c) One channel of light makes colours on red, green and blue dots. A test of the bench's physics, without any
calibration: a pixel takes the value of the ink that it lights most of (the bench's truth), and the meter reads both
surfaces; what it reads must have the right hue.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from paxel_design.contact_sheet import Group, Tile
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.observer import view_to_sRGB
from reports.bench_models import RGB, read_XYZ, small_bench
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import write_sheet

ITEM = Item(
    "fig02_colour_formation",
    "Fig. 2",
    "drawings: red on black dots, weak blue on white ones: blue on the print, red on a white sheet (a); the same with "
    "six inks (b); one channel on r, g, b dots makes any colour (c)",
)
HUES_DEG = {"red": 30, "yellow": 95, "green": 150, "cyan": 205, "blue": 290, "magenta": 335}
"""CIELAB hue angles that go by these names; a colour has the name of the nearest."""

CHANGE = {"pattern": "blue", "white": "red"}
DARK, RED, PALE_BLUE, BLUE, BOTH = (0, 0, 0), (1, 0, 0), (0, 0.4, 0.6), (0, 0.65, 0.75), (1, 0.65, 0.75)
SIX = ("cyan", "magenta", "yellow", "red", "green", "blue")
PRIMARIES = (((1,), (0,), (0,)), "red"), (((0,), (1,), (0,)), "green"), (((0,), (0,), (1,)), "blue")
MIXTURES = (((1,), (1,), (0,)), "yellow"), (((0,), (1,), (1,)), "cyan"), (((1,), (0,), (1,)), "magenta")
ONE_CHANNEL = tuple((P, {"pattern": name}) for P, name in PRIMARIES + MIXTURES)
PARTS: dict[str, tuple[tuple[str, ...], tuple[str, ...], Any]] = {
    "a, black and white": (("black", "white"), RGB, (((RED, PALE_BLUE), CHANGE),)),
    "b, six inks": (SIX, RGB, (((BOTH, BLUE, DARK, DARK, RED, BOTH), CHANGE),)),
    "c, white light": (("red", "green", "blue"), ("white",), ONE_CHANNEL),
    "c, ultraviolet": (("uv-red", "uv-green", "uv-blue"), ("uv",), ONE_CHANNEL),
}
"""Inks, channels, and lights: device values of each ink (K, N) with the hue that a surface must show."""

ON = {"pattern": "on the print", "white": "on white"}
MIDDLE = np.s_[60:112, 110:202]
EYE_PX = 4.0
"""The eye's blur, 0.58 mm at 4 m."""


def make(run: Run) -> Result:
    """Show every light and read it; the quick set leaves out the mixtures of (c)."""
    figures, relations, groups = {}, {}, []
    for part, (inks, channels, lights) in PARTS.items():
        bench = small_bench(inks, channels)
        labels = np.argmax(bench.truth.coverage()[..., : len(inks)], axis=-1)
        bench.place("pattern" if len(channels) == 1 else "white")
        white = read_XYZ(bench, np.ones((len(inks), len(channels))), labels)
        rows: list[list[Tile]] = []
        for k, (P, wanted) in enumerate(lights[:3] if run.quick else lights):
            codes = np.rint(255 * np.array(P)).astype(np.uint8)[labels]
            if k % 3 == 0:
                rows.append([])
            if len(wanted) > 1:
                rows[-1].append(Tile(codes[MIDDLE], "the light"))
            for surface, name in wanted.items():
                bench.place(surface)
                L, a, b = XYZ_to_Lab(read_XYZ(bench, np.array(P, float), labels) / white[1], white / white[1])
                hue, chroma = np.rad2deg(np.arctan2(b, a)) % 360, np.hypot(a, b)
                key, words = f"{part}: {name} on the {surface}", f"L* {L:.0f}, chroma {chroma:.0f}, hue {hue:.0f}"
                figures[f"{key}, hue"] = Figure(hue, "degrees", "hue angle")
                figures[f"{key}, chroma"] = Figure(chroma, "chroma", "CIELAB")
                away = {n: abs((angle - hue + 180) % 360 - 180) for n, angle in HUES_DEG.items()}
                relations[f"{key} by its hue"] = min(away, key=lambda n: away[n]) == name
                relations[f"{key} has a chroma of 10 at least"] = bool(chroma >= 10)
                for where, blur_px in (("near", 0.0), ("from 4 m", EYE_PX)):
                    seen = view_to_sRGB(bench.view_XYZ(codes, surface), "fixed", white / white[1], blur_px)
                    tile = Tile(seen[MIDDLE], f"{name} {ON[surface]}, {where}", words, emphasis=blur_px > 0)
                    rows[-1].append(tile)
        groups.append(Group(f"({part[0]}) {part[3:]}", tuple(tuple(row) for row in rows)))
    picture = f"{ITEM.name}.jpg"
    write_sheet(run.folder / picture, groups, "How colours form", "after the paper's Fig. 2; fixed exposure")
    hues = [figures[f"{part}: {name} on the {s}, hue"].value for part in list(PARTS)[:2] for s, name in CHANGE.items()]
    ours = (
        f"{sum(relations.values())} of {len(relations)} relations hold, as the meter reads: (a) hue {hues[0]:.0f} "
        f"degrees on the print, {hues[1]:.0f} on white; (b) {hues[2]:.0f} and {hues[3]:.0f}; (c) all six hues"
    )
    return Result(ours, figures, relations, (picture,))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
