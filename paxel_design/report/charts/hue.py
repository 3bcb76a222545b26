"""Hue-change areas side by side in the (a*, b*) plane, as drawings in lines (Fig. 13, a2 and b2)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np
from numpy.typing import ArrayLike

from paxel_design.report.charts.cells import add_cells
from paxel_design.report.charts.style import GRAYS, PALETTE, TEXT_WIDTH_MM, new_figure, style
from paxel_runtime.model.colorimetry import Lab_to_sRGB

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["hue_chart"]

_RING_L, _RING_CHROMA, _RING_CELLS = 65.0, 45.0, 90


def hue_chart(areas: Mapping[float, tuple[ArrayLike, ArrayLike]]) -> Figure:
    """Colours on the pattern whose hue can turn by each angle on the second surface.

    Parameters
    ----------
    areas : mapping of angle in degrees to two (m, 2) arrays
        [a*, b*] around the area for some lightnesses, and around that for all of them.
    """
    reach = 1.1 * max(float(np.hypot(*np.asarray(polygon).T).max()) for pair in areas.values() for polygon in pair)
    with matplotlib.rc_context(style()):
        figure = new_figure(76.0, TEXT_WIDTH_MM)
        panels = figure.subplots(1, len(areas), sharex=True, sharey=True, squeeze=False)[0]
        for axes, (angle, (some, every)) in zip(panels, areas.items(), strict=True):
            _add_ring(axes, reach)
            axes.axhline(0, color=GRAYS[2], linewidth=0.6)
            axes.axvline(0, color=GRAYS[2], linewidth=0.6)
            axes.fill(*_closed(some).T, facecolor=GRAYS[3], edgecolor=GRAYS[0], linewidth=1.2, label="any: at some "
                      "lightnesses")  # fmt: skip
            axes.fill(*_closed(every).T, facecolor="white", edgecolor=PALETTE[0], hatch="////", linestyle="--",
                      linewidth=1.2, label="all: at every lightness of the halved rectangle")  # fmt: skip
            axes.set(title=f"hue turned by {angle:g}°", xlabel="a*: green to red", aspect="equal")
            axes.set(xlim=(-reach, reach), ylim=(-reach, reach))
        panels[0].set_ylabel("b*: blue to yellow")
        handles, labels = panels[0].get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
    return figure


def _closed(polygon: ArrayLike) -> Any:
    return np.vstack((polygon, np.asarray(polygon)[:1]))


def _add_ring(axes: Any, reach: float) -> None:
    """Which way each hue lies: cells of colour along a circle at the edge of the drawing."""
    hue = 2 * np.pi * np.arange(_RING_CELLS + 1) / _RING_CELLS
    rim = np.stack((np.cos(hue), np.sin(hue)), axis=1)
    corners = reach * np.stack((0.93 * rim[:-1], 0.98 * rim[:-1], 0.98 * rim[1:], 0.93 * rim[1:]), axis=1)
    middle = (rim[:-1] + rim[1:]) / 2
    Lab = np.column_stack((np.full(_RING_CELLS, _RING_L), _RING_CHROMA * middle))
    add_cells(axes, corners, np.clip(Lab_to_sRGB(Lab), 0, 1))
