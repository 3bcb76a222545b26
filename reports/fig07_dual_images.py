"""Fig. 7 of the paper: one projection, two pictures: one on the b/w print, another on a white sheet (K = 3).

Photographs of scikit-image's wheel in place of the paper's. Figures are of the view from the installation's distance
through the observer's eye: how far it is from the mapped picture, how much of the other picture ghosts in it, and the
lightness and chroma that are left.
"""

from __future__ import annotations

import sys

from paxel_design.contact_sheet import Group
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import seen_row, shared, show_all, write_sheet

ITEM = Item(
    "fig07_dual_images",
    "Fig. 7",
    "two photographs in one projection on a b/w print (K = 3): ghosting is minimal, lightness contrast significantly "
    "reduced",
    ("bw-checkerboard",),
)
PAIRS = (("astronaut", "coffee"), ("chelsea", "motorcycle_left"))
FIG_6_L_RANGE = 50.0
"""What hue and chroma alterations keep at least (`fig06_hue_and_chroma.py`)."""


def dual_images(run: Run, item: Item, pairs: tuple[tuple[str, str], ...], title: str) -> Result:
    """Both views of each pair on the item's installation; the quick set takes one pair."""
    installation = shared(item.uses[0], run.quick)
    chosen = {f"{item.name[:5]}-{'-'.join(pair)}": pair for pair in (pairs[:1] if run.quick else pairs)}
    shown = show_all(installation, {name: ("dual-image", pair) for name, pair in chosen.items()})
    figures, ghosts, errors, ranges = {}, [], [], []
    for name, one in shown.items():
        for surface, picture in zip(("pattern", "white"), chosen[name], strict=True):
            view, where = one.preview[f"on_{surface}"], f"{picture} on the {surface}"
            low, high = view["L_range"]
            figures |= {
                f"{where}: dE00 to the mapped picture": Figure(view["dE00_mean"], "dE00", "colour difference"),
                f"{where}: ghosting": Figure(view["ghosting_percent"], "%", "percent"),
                f"{where}: lowest lightness": Figure(low, "L*", "CIELAB"),
                f"{where}: highest lightness": Figure(high, "L*", "CIELAB"),
                f"{where}: mean chroma": Figure(view["chroma_mean"], "chroma", "CIELAB"),
            }
            errors.append(view["dE00_mean"])
            ghosts.append(view["ghosting_percent"])
            ranges.append(high - low)
    relations = {
        "each view is its mapped picture within a mean dE00 of 2, the error of the paper's model": max(errors) < 2,
        "ghosting is below 5 % everywhere": max(ghosts) < 5,
        f"lightness ranges over less than the {FIG_6_L_RANGE:g} that a hue shift keeps": max(ranges) < FIG_6_L_RANGE,
    }
    groups = [Group(f"Pair {k + 1}", (seen_row(one, "seen"),)) for k, one in enumerate(shown.values())]
    K, distance_m = installation.settings.clusters.count, installation.settings.viewing.distance_mm / 1000
    write_sheet(
        run.folder / f"{item.name}.jpg",
        groups,
        title,
        f"after the paper's {item.number}; K = {K}, from {distance_m:g} m, eye adapted",
    )
    ours = (
        f"ghosting {max(ghosts):.1f} % at most, dE00 to the mapped picture {max(errors):.2f} at most, lightness over "
        f"{min(ranges):.0f} to {max(ranges):.0f} L*"
    )
    return Result(ours, figures, relations, (f"{item.name}.jpg",))


def make(run: Run) -> Result:
    """The pairs on the checkerboard."""
    return dual_images(run, ITEM, PAIRS, "Two pictures in one projection")


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
