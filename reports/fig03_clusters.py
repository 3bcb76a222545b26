"""Fig. 3 of the paper: pixels sorted by the colorant they light, K = 2 and K = 3, beside the nodal image.

The nodal image is what the camera sees of the b/w print under full white, moved to the projector's raster and divided
by the white sheet; k-means in CIELAB sorts its pixels. How pure the clusters are is asked of the bench's truth: the
share of each ink in each projector pixel.
"""

from __future__ import annotations

import sys

import numpy as np

from paxel_design.contact_sheet import Group, Tile
from paxel_runtime.captures.acquisition import load_captures
from paxel_runtime.clustering import OUTSIDE, label_picture
from paxel_runtime.model.colorimetry import linear_sRGB_to_sRGB
from paxel_runtime.stages import open_bench
from reports.paper import Figure, Item, Result, Run, run_item
from reports.shared_installations import shared, write_sheet

ITEM = Item(
    "fig03_clusters",
    "Fig. 3",
    "nodal image of a b/w print; K = 2: black and white areas; K = 3: also the pixels that light both, at the borders",
    ("bw-checkerboard",),
)
DETAIL_PX = (104, 58)


def make(run: Run) -> Result:
    """Maps and purities of both sortings that calibration makes."""
    installation = shared("bw-checkerboard", run.quick)
    captures = load_captures(installation)
    black_share = open_bench(installation).truth.coverage()[..., 0]
    figures, relations, pure = {}, {}, {}
    height, width = captures.valid.shape
    top, left = (height - DETAIL_PX[1]) // 2, (width - DETAIL_PX[0]) // 2
    middle = np.s_[top : top + DETAIL_PX[1], left : left + DETAIL_PX[0]]
    nodal = np.rint(255 * linear_sRGB_to_sRGB(np.clip(np.nan_to_num(captures.nodal), 0, 1))).astype(np.uint8)
    tiles = [Tile(nodal[middle], "(a) nodal image, full white")]
    for K, letter in ((2, "b"), (3, "c")):
        labels, names = captures.labels[K], captures.facts["clusters"][str(K)]["names"]
        tiles.append(Tile(label_picture(labels, names)[middle], f"({letter}) K = {K}: {', '.join(names)}"))
        reflectance, black = {}, {}
        for k, name in enumerate(names):
            here = labels == k
            reflectance[name] = float(np.nanmean(captures.nodal[here]))
            black[name] = float(black_share[here].mean())
            share = here.sum() / (labels != OUTSIDE).sum()
            figures[f"K = {K}, {name}: share of pixels"] = Figure(share, "", "share")
            figures[f"K = {K}, {name}: black ink in its pixels"] = Figure(black[name], "", "share")
        pure[K] = (black["black"] + 1 - black["white"]) / 2
        figures[f"K = {K}: purity of black and white"] = Figure(pure[K], "", "share")
        in_order = [name for name in ("black", "black+white", "white") if name in names]
        values = [reflectance[name] for name in in_order]
        relations[f"K = {K}: {' < '.join(in_order)} in reflectance"] = values == sorted(values)
    relations["black and white are purer with K = 3 than with K = 2"] = pure[3] > pure[2]
    relations["K = 3: the pixels of black+white light each ink by 25 % at least"] = 0.25 <= black["black+white"] <= 0.75
    picture = f"{ITEM.name}.png"
    group = Group("the middle of the print; red: black ink, blue: white paper, green: both", (tuple(tiles),))
    write_sheet(run.folder / picture, [group], "Clusters of projector pixels", "after the paper's Fig. 3")
    both = figures["K = 3, black+white: share of pixels"].value
    ours = f"purity of black and white {pure[2]:.0%} with K = 2, {pure[3]:.0%} with K = 3, where {both:.0%} light both"
    return Result(ours, figures, relations, (picture,))


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
