"""Rows and rings of coloured cells, such as scales: one drawing object however many there are."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import PolyCollection
from numpy.typing import ArrayLike

__all__ = ["add_cells", "boxes"]

_SEAM_PT = 0.2
"""Edge in the cell's own colour, so that no viewer shows the background between two."""


def add_cells(axes: Any, corners: ArrayLike, sRGB: ArrayLike) -> None:
    """Fill polygons (n, m, 2) with colours (n, 3), 0..1; the axes' limits stay."""
    cells = PolyCollection(
        list(np.asarray(corners)), facecolors=np.asarray(sRGB), edgecolors="face", linewidths=_SEAM_PT
    )
    axes.add_collection(cells, autolim=False)


def boxes(x: ArrayLike, y: ArrayLike) -> np.ndarray:
    """Corners (n, 4, 2) of boxes between edges x (n, 2) and y (n, 2), broadcast against each other."""
    x, y = np.broadcast_arrays(np.asarray(x, np.float64), np.asarray(y, np.float64))
    return np.stack((x[:, [0, 1, 1, 0]], y[:, [0, 0, 1, 1]]), axis=-1)
