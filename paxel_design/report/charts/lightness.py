"""The lightness area with its largest rectangle, as a drawing in lines (Fig. 13, a1 and b1). Knows polygons of L*."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import ArrayLike

from paxel_design.report.charts.cells import add_cells, boxes
from paxel_design.report.charts.style import GRAYS, PALETTE, new_figure, style
from paxel_runtime.model.colorimetry import Lab_to_sRGB

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["lightness_chart"]

_PATCHES = 20
_RAMP = 3.5
"""Breadth of the gray ramps along the axes, L*."""


def lightness_chart(
    polygon: ArrayLike, L_pattern: Sequence[float], L_white: Sequence[float], second_surface: str
) -> Figure:
    """Grays that both surfaces can show at once, and the largest rectangle among them.

    Parameters
    ----------
    polygon : (m, 2) array
        [L* on the pattern, L* on the second surface] around the area.
    L_pattern, L_white : (float, float)
        The rectangle.
    second_surface : str
        What the second surface is called.
    """
    closed = np.vstack((polygon, np.asarray(polygon)[:1]))
    (x0, x1), (y0, y1) = L_pattern, L_white
    with matplotlib.rc_context(style()):
        figure = new_figure(92.0)
        axes = figure.add_subplot()
        axes.fill(*closed.T, color=GRAYS[3], linewidth=0)
        axes.plot(*closed.T, color=GRAYS[0], label="both surfaces can show these grays at once")
        axes.fill(
            [x0, x1, x1, x0],
            [y0, y0, y1, y1],
            facecolor="white",
            edgecolor=PALETTE[0],
            hatch="////",
            linewidth=1.3,
            label="largest rectangle: any gray of one range\nwith any gray of the other",
        )
        axes.plot([0, 100], [0, 100], color=GRAYS[1], linewidth=0.8, linestyle=":", label="as light on both")
        _add_ramps(axes)
        axes.set(xlim=(-_RAMP, 100), ylim=(-_RAMP, 100), aspect="equal")
        axes.set(xlabel="L* on the pattern", ylabel=f"L* on the {second_surface}")
        figure.legend(loc="outside right upper")
    return figure


def _add_ramps(axes: Any) -> None:
    """What the numbers on the axes look like."""
    edges = np.linspace(0, 100, _PATCHES + 1)
    along, across = np.stack((edges[:-1], edges[1:]), axis=1), [[-_RAMP, 0.0]]
    grays = np.zeros((_PATCHES, 3))
    grays[:, 0] = along.mean(axis=1)
    colours = np.clip(Lab_to_sRGB(grays), 0, 1)
    for corners in (boxes(along, across), boxes(across, along)):
        add_cells(axes, corners, colours)
