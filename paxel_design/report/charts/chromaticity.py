"""Primaries and whites in the CIE 1931 chromaticity diagram, as a drawing in lines. Knows chromaticities and names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import matplotlib
import numpy as np

from paxel_design.gamut.comparison import rgb_primaries
from paxel_design.report.charts.style import GRAYS, PALETTE, new_figure, style
from paxel_runtime.model.colorimetry import spectra_to_XYZ

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["chromaticity_chart"]

_LOCUS = slice(4, 65)
"""Of the 81 wavelengths 380..780 nm: beyond 400 and 700 nm the locus stands still."""

_MARKERS = ("o", "s", "^", "D", "v")


def chromaticity_chart(
    primaries: Mapping[str, Sequence[float]], whites: Mapping[str, Sequence[float]], all_at_full: Sequence[float]
) -> Figure:
    """The triangle of the primaries beside that of sRGB.

    Parameters
    ----------
    primaries : mapping of name to (x, y)
    whites : mapping of name to (x, y)
        Whites that one may want.
    all_at_full : (x, y)
        Of all primaries at full.
    """
    locus = spectra_to_XYZ(np.eye(81))[_LOCUS]
    with matplotlib.rc_context(style()):
        figure = new_figure(92.0)
        axes = figure.add_subplot()
        axes.plot(*_closed(_xy(locus)).T, color=GRAYS[2], linewidth=0.8, label="colours of single wavelengths")
        axes.plot(*_closed(_xy(rgb_primaries("srgb")[0].T)).T, color=GRAYS[1], linestyle=":", label="sRGB")
        corners = np.array(list(primaries.values()))
        axes.plot(*_closed(corners).T, color=PALETTE[0], label="the print's primaries", marker="o", markersize=4)
        middle, plate = corners.mean(axis=0), {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 0.5}
        for name, at in zip(primaries, corners, strict=True):
            away = 9 * (at - middle) / np.linalg.norm(at - middle)
            axes.annotate(name, at, xytext=away, textcoords="offset points", ha="left" if away[0] > 0 else "right",
                          va="center", bbox=plate)  # fmt: skip
        axes.plot(*all_at_full, color=PALETTE[1], marker="x", markersize=7, linestyle="none",
                  label="all primaries at full")  # fmt: skip
        for k, (name, xy) in enumerate(whites.items()):
            axes.plot(*xy, color=GRAYS[0], marker=_MARKERS[k % len(_MARKERS)], markersize=4, fillstyle="none",
                      linestyle="none", label=f"white {name}")  # fmt: skip
        axes.set(xlim=(0, 0.75), ylim=(0, 0.87), aspect="equal", xlabel="x", ylabel="y")
        figure.legend(loc="outside right upper")
    return figure


def _xy(XYZ: np.ndarray) -> np.ndarray:
    return XYZ[:, :2] / XYZ.sum(axis=1, keepdims=True)


def _closed(polygon: np.ndarray) -> np.ndarray:
    return np.vstack((polygon, polygon[:1]))
