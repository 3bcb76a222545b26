"""Gains of changes as bars, and the ranges of lightness that gray sheets share with the pattern. Knows numbers only."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import matplotlib
import numpy as np

from paxel_design.report.charts.style import GRAYS, PALETTE, new_figure, style
from paxel_runtime.model.colorimetry import Lab_to_sRGB

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["GainBar", "gains_chart", "shared_ranges_chart"]

_WRAP = 52
_LONGEST = 100.0
"""A bar of more percent is cut here; its number stands beside it."""

_MARGIN_MM, _LINE_MM, _GAP = 19.0, 3.9, 0.6
_BAND = 0.72
_RAMP_STEPS, _HALF = 20, 0.3


@dataclass(frozen=True)
class GainBar:
    """One change.

    Attributes
    ----------
    label : str
    percent : float
    volume_percent : float or None
        The gain of the volume of colours besides.
    """

    label: str
    percent: float
    volume_percent: float | None = None


def gains_chart(groups: Sequence[tuple[str, Sequence[GainBar]]]) -> Figure:
    """Bars from the top downwards, under the heading of each group; the volume of colours hatched below its change."""
    with matplotlib.rc_context(style()):
        labels: list[str] = []
        places: list[float] = []
        marks: list[tuple[float, float, bool]] = []
        headings: list[tuple[float, str]] = []
        at = 0.0
        for heading, bars in groups:
            headings.append((at, heading))
            at += 1.0 + _GAP
            for bar in bars:
                lines = textwrap.wrap(bar.label, _WRAP)
                high = max(len(lines), 1 if bar.volume_percent is None else 2)
                labels.append("\n".join(lines))
                places.append(at + (high - 1) / 2)
                first = at + (high - (1 if bar.volume_percent is None else 2)) / 2
                marks.append((first, bar.percent, False))
                if bar.volume_percent is not None:
                    marks.append((first + 1, bar.volume_percent, True))
                at += high + _GAP
        figure = new_figure(_MARGIN_MM + _LINE_MM * at)
        axes = figure.add_subplot()
        for place, percent, of_volume in marks:
            _add_bar(axes, place, percent, of_volume)
        ends = [percent for _, percent, _ in marks]
        axes.set_xlim(min(0.0, 1.3 * min(ends)), 1.2 * min(_LONGEST, max(ends)))
        axes.set_ylim(at - _GAP, -0.8)
        axes.set_yticks(places, labels)
        axes.tick_params(axis="y", length=0)
        axes.grid(visible=False, axis="y")
        axes.axvline(0, color=GRAYS[1], linewidth=0.8)
        axes.set_xlabel("improvement, percent")
        for place, heading in headings:
            axes.annotate(heading, (0, place), xycoords=("axes fraction", "data"), xytext=(-4, 0), ha="right",
                          textcoords="offset points", va="center", weight="bold", fontsize=7.5)  # fmt: skip
        if any(of_volume for *_, of_volume in marks):
            _add_legend(figure)
    return figure


def shared_ranges_chart(sheets: Sequence[tuple[str, tuple[float, float] | None]]) -> Figure:
    """For each second sheet, by name, the range of L* that it shares with the pattern, drawn in its grays."""
    with matplotlib.rc_context(style()):
        figure = new_figure(_MARGIN_MM + 7.0 * len(sheets))
        axes = figure.add_subplot()
        for k, (_, shared) in enumerate(sheets):
            if shared is None:
                axes.text(1.0, k, "none", va="center", fontsize=7.5)
                continue
            _add_ramp(axes, *shared, k)
            axes.text(shared[1] + 1, k, f"{shared[1] - shared[0]:.1f} L*", va="center", fontsize=7.5)
        axes.set_yticks(range(len(sheets)), [name for name, _ in sheets])
        axes.set(xlim=(0, 100), ylim=(len(sheets) - 0.5, -0.5), xlabel="L* that both surfaces can show at once")
        axes.grid(visible=False, axis="y")
    return figure


def _add_bar(axes: Axes, at: float, percent: float, of_volume: bool) -> None:
    shown = min(percent, _LONGEST)
    look: dict[str, Any] = {"color": PALETTE[0]}
    if of_volume:
        look = {"facecolor": "white", "edgecolor": PALETTE[1], "hatch": "////"}
    axes.barh(at, shown, height=_BAND, linewidth=0.8, **look)
    words = f"{percent:+.1f} %" if abs(percent) < 10 else f"{percent:+.0f} %"
    cut = " (bar is cut)" if percent > _LONGEST else ""
    axes.annotate(words + cut, (max(shown, 0.0), at), xytext=(3, 0), textcoords="offset points", va="center",
                  fontsize=7)  # fmt: skip


def _add_legend(figure: Figure) -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(color=PALETTE[0], label="the figure that the table names"),
        Patch(facecolor="white", edgecolor=PALETTE[1], hatch="////", label="volume of colours of two free pictures"),
    ]
    figure.legend(handles=handles, loc="outside lower right", ncols=2)


def _add_ramp(axes: Axes, low: float, high: float, at: float) -> None:
    """A frame from low to high, filled with the grays that it stands for."""
    from matplotlib.patches import Rectangle

    edges = np.linspace(low, high, _RAMP_STEPS + 1)
    for left, right in pairwise(edges):
        gray = np.clip(Lab_to_sRGB(np.array([(left + right) / 2, 0.0, 0.0])), 0, 1)
        place = (left, at - _HALF)
        axes.add_patch(Rectangle(place, right - left, 2 * _HALF, facecolor=gray, edgecolor=gray, linewidth=0.3))
    axes.add_patch(Rectangle((low, at - _HALF), high - low, 2 * _HALF, fill=False, edgecolor=GRAYS[0], linewidth=0.6))
