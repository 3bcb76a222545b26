"""Maps of differences over a picture, and the scales beside which they are read. Lightness alone tells their order.

How far a colour was moved goes from white through yellow and red to black; what is left of another picture goes from
black through mid-gray (nothing) to white, tinted blue and orange: both are read in gray print.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import NDArray

from paxel_design.report.charts.cells import add_cells, boxes
from paxel_design.report.charts.style import TEXT_WIDTH_MM, new_figure, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["MOST_GHOST_L", "MOST_MOVED_DE00", "ghost_picture", "moved_map", "scales_chart"]

MOST_MOVED_DE00 = 24.0
"""Distance that is drawn black."""

MOST_GHOST_L = 1.0
"""Difference of L* that is drawn black or white."""

_SCALE_CELLS, _TICKS = 60, 5

_MOVED_RGB = np.array([[1.0, 1.0, 1.0], [1.0, 0.85, 0.35], [0.88, 0.4, 0.1], [0.55, 0.08, 0.1], [0.1, 0.0, 0.05]])
_GHOST_RGB = np.array([[0.02, 0.05, 0.2], [0.25, 0.35, 0.55], [0.5, 0.5, 0.5], [0.8, 0.62, 0.4], [1.0, 0.95, 0.8]])


def moved_map(dE00: NDArray[np.floating]) -> NDArray[np.uint8]:
    """How far each pixel (h, w) was moved, as an sRGB picture (h, w, 3)."""
    return _coloured(np.asarray(dE00) / MOST_MOVED_DE00, _MOVED_RGB)


def ghost_picture(difference_L: NDArray[np.floating]) -> NDArray[np.uint8]:
    """What is left in a view, in L* (h, w), as an sRGB picture (h, w, 3)."""
    return _coloured(0.5 + np.asarray(difference_L) / (2 * MOST_GHOST_L), _GHOST_RGB)


def _coloured(place: NDArray[np.floating], stops: NDArray[np.float64]) -> NDArray[np.uint8]:
    at = np.linspace(0, 1, len(stops))
    sRGB = np.stack([np.interp(place, at, stops[:, c]) for c in range(3)], axis=-1)
    return np.rint(255 * sRGB).astype(np.uint8)


def scales_chart(ghosts: bool) -> Figure:
    """The scales of both maps; that of ghosts where there are any."""
    with matplotlib.rc_context(style()):
        figure = new_figure(18.0, TEXT_WIDTH_MM)
        moved, ghost = figure.subplots(1, 2, gridspec_kw={"wspace": 0.1})
        _add_scale(moved, moved_map, 0.0, MOST_MOVED_DE00, "out of gamut: moved towards gray, dE00")
        if ghosts:
            _add_scale(ghost, ghost_picture, -MOST_GHOST_L, MOST_GHOST_L, "what is left of the other picture, L*")
        else:
            ghost.set_axis_off()
    return figure


def _add_scale(axes: Any, picture: Any, low: float, high: float, words: str) -> None:
    edges = np.linspace(low, high, _SCALE_CELLS + 1)
    cells = np.stack((edges[:-1], edges[1:]), axis=1)
    add_cells(axes, boxes(cells, [[0.0, 1.0]]), picture(cells.mean(axis=1)[None])[0] / 255)
    axes.set(xlim=(low, high), ylim=(0, 1), yticks=(), xlabel=words)
    axes.set_xticks(np.linspace(low, high, _TICKS), [f"{tick:g}" for tick in np.linspace(low, high, _TICKS)])
    axes.grid(visible=False)
    for side in ("top", "right"):
        axes.spines[side].set_visible(True)
