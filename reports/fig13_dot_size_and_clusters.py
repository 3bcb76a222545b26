"""Fig. 13: what dot size and the number of clusters K change, by a whole calibration of every combination.

The paper evaluates dots of 1.0, 0.75 and 0.5 mm and shows that K = 3 gains most of what more clusters can. Ours is the
study that `paxel study` makes by default: nine calibrations on the virtual bench, 3 minutes on 2 idle cores; what is
finished in the folder is not measured again. Pixels are sorted by k-means; of K = 5 clusters of a black-and-white print
three are edges. Nothing is fitted to the relations.
"""

from __future__ import annotations

import shutil
import sys
from itertools import pairwise

from paxel_design.study import Study, run_study
from paxel_runtime.errors import CalibrationError
from reports.paper import Figure, Item, Result, Run, run_item

ITEM = Item(
    "fig13_dot_size_and_clusters",
    "Fig. 13",
    "lightness rectangle and area of hues that can turn by 180 degrees, b/w checkerboard at 30 degrees: they grow with "
    "dot size (0.5, 0.75, 1.0 mm) and with K, ever slower; no figures",
)
QUICK = Study(
    dot_sizes_mm=(0.5, 1.0),
    overrides={"projector.resolution": [240, 135], "meter.aperture_mm": 15.0},
    ghosting=False,
)
AREAS = {
    "lightness rectangle": ("lightness", "rectangle_area"),
    "hue-180 area (any)": ("hue", "area_any"),
    "hue-180 area (all)": ("hue", "area_all"),
}


def make(run: Run) -> Result:
    """The study, its areas, and what Fig. 13 shows of them."""
    folder = run.folder / "fig13-study"
    cases = run_study(QUICK if run.quick else Study(), folder)["cases"]
    if failed := [case["error"] for case in cases if "error" in case]:
        raise CalibrationError(f"{len(failed)} cases failed, the first with: {failed[0]}")
    figures, relations, gains = {}, {}, []
    dots = sorted({case["dot_size_mm"] for case in cases})
    for name, (table, key) in AREAS.items():
        of = {(case["dot_size_mm"], case["clusters"]): case[table][key] for case in cases}
        unit = "L* x L*" if table == "lightness" else "a* x b*"
        figures |= {f"{name}, {dot:g} mm, K = {K}": Figure(of[dot, K], unit, "area") for dot, K in of}
        for K in (2, 3, 5):
            by_dot = [of[dot, K] for dot in dots]
            relations[f"{name}, K = {K}: grows with dot size"] = all(low < high for low, high in pairwise(by_dot))
        for dot in dots:
            grown, more = of[dot, 3] - of[dot, 2], of[dot, 5] - of[dot, 3]
            relations |= {
                f"{name}, {dot:g} mm: grows from K = 2 to 3": grown > 0,
                f"{name}, {dot:g} mm: grows from K = 3 to 5 by less than half of that": more < 0.5 * grown,
                f"{name}, {dot:g} mm: does not fall by more than 2 % from K = 3 to 5": more >= -0.02 * of[dot, 3],
            }
            figures[f"{name}, {dot:g} mm, growth from K = 3 to 5 over 2 to 3"] = Figure(more / grown, "", "ratio")
        gains.append(f"{name} {' / '.join(f'{of[dot, 3]:.0f}' for dot in dots)}")
    for case in cases:
        where = f"{case['dot_size_mm']:g} mm, K = {case['clusters']}"
        for surface in ("pattern", "white"):
            error = case["prediction"][surface]["dE00_mean"]
            figures[f"prediction, {where}, {surface}"] = Figure(error, "dE00", "colour difference")
            if case["ghosting_percent"]:
                ghost = case["ghosting_percent"][surface]
                figures[f"ghosting, {where}, {surface}"] = Figure(ghost, "%", "percent")
    picture = f"{ITEM.name}.png"
    shutil.copyfile(folder / "study.png", run.folder / picture)
    ours = f"K = 3, dots of {' / '.join(f'{dot:g}' for dot in dots)} mm: {', '.join(gains)}"
    return Result(ours, figures, relations, (picture,))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
