"""Fig. 8 of the paper: the dual image of Fig. 7 on a colour print, tiles of c, m, y, r, g, b at 30 degrees, K = 6.

Six inks repeat after six dots, so their texture melts from 6 m only; that is where this is seen from.
"""

from __future__ import annotations

import sys

from reports.fig07_dual_images import PAIRS, dual_images
from reports.paper import Item, Result, Run, run_item

ITEM = Item(
    "fig08_dual_image_colour_pattern",
    "Fig. 8",
    "the example of Fig. 7 on tiles of six inks (K = 6): a similar dual-image effect as with the b/w pattern",
    ("cmyrgb",),
)


def make(run: Run) -> Result:
    """The first pair of Fig. 7."""
    return dual_images(run, ITEM, PAIRS[:1], "Two pictures in one projection, on six inks")


if __name__ == "__main__":
    sys.exit(run_item(ITEM, make))
