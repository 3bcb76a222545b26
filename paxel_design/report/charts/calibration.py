"""Charts of a calibration: prediction errors beside the paper's, residual maps, clusters, response curves.

Knows arrays and names; where they come from is not known here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from paxel_design.report.charts.style import GRAYS, LINE_STYLES, PALETTE, new_figure, style
from paxel_runtime.model.colorimetry import Lab_to_sRGB
from paxel_runtime.model.response import ProjectorResponse

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["ErrorRow", "accuracy_chart", "cluster_chart", "cluster_shades", "residual_chart", "response_chart"]

_HATCHES = ("", "////", "....", "xxxx", "\\\\\\\\", "++++")
_DETAIL_PX = (72, 54)


@dataclass(frozen=True)
class ErrorRow:
    """One line of `accuracy_chart`: dE00 mean, 95 % and largest by surface; `hatched` where others measured it."""

    label: str
    errors: Mapping[str, tuple[float, float, float]]
    hatched: bool = False


def accuracy_chart(rows: Sequence[ErrorRow], surfaces: Sequence[str]) -> Figure:
    """Prediction errors as bars (mean), whiskers (95 %) and diamonds (largest), a panel a surface."""
    import matplotlib

    largest = max(error[2] for row in rows for error in row.errors.values())
    with matplotlib.rc_context(style()):
        figure = new_figure(22 + 9 * len(rows))
        panels = figure.subplots(1, len(surfaces), sharex=True, sharey=True, squeeze=False)[0]
        for axes, surface in zip(panels, surfaces, strict=True):
            for place, row in enumerate(rows):
                if surface in row.errors:
                    _error_bar(axes, -place, row, *row.errors[surface])
            axes.set_yticks([-place for place in range(len(rows))], [row.label for row in rows])
            axes.grid(visible=False, axis="y")
            title = "on the pattern" if surface == "pattern" else "on the white surface"
            axes.set(title=title, xlabel="dE00", xlim=(0, 1.06 * largest))
        return figure


def _error_bar(axes: Any, y: float, row: ErrorRow, mean: float, p95: float, largest: float) -> None:
    color, hatch = (GRAYS[3], "////") if row.hatched else (PALETTE[0], "")
    axes.barh(y, mean, height=0.62, color=color, hatch=hatch, edgecolor=GRAYS[0], linewidth=0.5)
    axes.plot([mean, p95], [y, y], color=GRAYS[0], lw=1.0)
    axes.plot([p95, p95], [y - 0.15, y + 0.15], color=GRAYS[0], lw=1.0)
    axes.plot([largest], [y], marker="D", ms=3.2, color=GRAYS[0])


def residual_chart(residuals: Mapping[str, NDArray[np.floating]], block_px: int) -> Figure:
    """Maps over the projection of how far measured points lie from the table, one a channel.

    Parameters
    ----------
    residuals : mapping of channel to (rows, columns) array
        Rms over blocks, camera pixels; NaN where nothing was measured.
    block_px : int
        Edge of a block, projector pixels.
    """
    import matplotlib

    known = np.concatenate([values[np.isfinite(values)] for values in residuals.values()])
    top = 1.5 * max(float(np.percentile(known, 99)), 1e-3) if known.size else 1.0
    rows, columns = next(iter(residuals.values())).shape
    each = 160 / len(residuals)
    with matplotlib.rc_context(style()):
        figure = new_figure(18 + min(each, 80) * rows / columns, 174 if len(residuals) > 1 else 110)
        panels = figure.subplots(1, len(residuals), squeeze=False, sharey=True)[0]
        for axes, (channel, values) in zip(panels, residuals.items(), strict=True):
            extent = (0, columns * block_px, rows * block_px, 0)
            image = axes.imshow(values, cmap=_gray_safe_map(), vmin=0, vmax=top, extent=extent, interpolation="nearest")
            axes.set(title=channel, xlabel="projector pixels")
            axes.grid(visible=False)
            axes.set_facecolor(GRAYS[3])
        figure.colorbar(image, ax=list(panels), label="rms, camera pixels", shrink=0.9, pad=0.01)
        return figure


def _gray_safe_map() -> str:
    return "YlGnBu"  # its lightness falls evenly


def response_chart(response: ProjectorResponse, channels: Sequence[str]) -> Figure:
    """Light by code of every channel, on even and on logarithmic scales, beside a power of 2.2."""
    import matplotlib

    power = np.linspace(0, 1, 200)
    with matplotlib.rc_context(style()):
        figure = new_figure(70)
        even, logarithmic = figure.subplots(1, 2)
        for axes in (even, logarithmic):
            axes.plot(power, power**2.2, color=GRAYS[2], lw=3.0, label="power of 2.2")
            for k, channel in enumerate(channels):
                code, linear = np.asarray(response.code[k]), np.asarray(response.linear[k])
                line, color = LINE_STYLES[k % len(LINE_STYLES)], PALETTE[k % len(PALETTE)]
                shown = linear > 0 if axes is logarithmic else slice(None)
                axes.plot(code[shown], linear[shown], ls=line, color=color, label=channel)
            axes.set(xlabel="code sent, 1 = full", xlim=(0, 1))
        even.set(ylabel="light, 1 = full", ylim=(0, 1.02), title="even scale")
        logarithmic.set(yscale="log", ylim=(1e-4, 1.3), title="the same near black, logarithmic")
        even.legend(loc="upper left")
        return figure


def cluster_chart(
    labels: NDArray[np.uint8],
    names: Sequence[str],
    colorants: Sequence[str],
    purity: Mapping[str, Mapping[str, float]],
    shares: Sequence[float],
    shades: NDArray[np.uint8],
) -> Figure:
    """The middle of the cluster map with its legend, and what ink the light of each cluster meets.

    Parameters
    ----------
    labels : (H, W) uint8 array
        Cluster of every projector pixel; 255 outside.
    names, colorants : sequence of str
    purity : mapping of cluster to mapping of colorant to share
    shares : sequence of float
        Of the projector's pixels, by cluster.
    shades : (K, 3) uint8 array
        Of `cluster_shades`.
    """
    import matplotlib
    from matplotlib.patches import Patch

    colors = shades / 255.0
    table = np.full((256, 3), 1.0)
    table[: len(names)] = colors
    (height, width), (H, W) = _DETAIL_PX[::-1], labels.shape
    top, left = max(0, (H - height) // 2), max(0, (W - width) // 2)
    detail = labels[top : top + height, left : left + width]
    with matplotlib.rc_context(style()):
        figure = new_figure(58 + 4 * len(names))
        plane, bars = figure.subplots(1, 2, width_ratios=(1, 1.15))
        plane.imshow(table[detail], interpolation="nearest", extent=(left, left + width, top + height, top))
        plane.set(title="cluster of each projector pixel, middle of the field", xlabel="projector pixels")
        plane.grid(visible=False)
        handles = [
            Patch(facecolor=color, edgecolor=GRAYS[0], linewidth=0.4, label=f"{name}, {share:.0%} of the pixels")
            for name, color, share in zip(names, colors, shares, strict=True)
        ]
        figure.legend(handles=handles, loc="outside lower left", ncols=min(3, len(names)))
        own = dict(zip(names, colors, strict=True))
        inks = [own.get(name, (1.0, 1.0, 1.0)) for name in colorants]
        _purity_bars(bars, names, colorants, purity, inks)
        return figure


def _purity_bars(
    axes: Any,
    names: Sequence[str],
    colorants: Sequence[str],
    purity: Mapping[str, Mapping[str, float]],
    inks: Sequence[Any],
) -> None:
    places = -np.arange(len(names))
    before = np.zeros(len(names))
    for k, colorant in enumerate(colorants):
        share = np.array([purity[name].get(colorant, 0.0) for name in names])
        axes.barh(places, share, 0.62, left=before, color=inks[k], hatch=_HATCHES[k % len(_HATCHES)],
                  edgecolor=GRAYS[0], linewidth=0.5, label=colorant)  # fmt: skip
        before = before + share
    axes.set_yticks(places, list(names))
    axes.grid(visible=False, axis="y")
    axes.set(xlim=(0, 1), xlabel="share of the cluster's light")
    axes.set_title("what ink a cluster's light meets", pad=20)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=min(4, len(colorants)))


def cluster_shades(centres_Lab: ArrayLike) -> NDArray[np.uint8]:
    """A colour for each cluster, (K, 3) uint8 sRGB: its own hue, at lightnesses that differ, for gray print too.

    Parameters
    ----------
    centres_Lab : (K, 3) array
        Mean colours of the clusters.
    """
    Lab = np.array(centres_Lab, np.float64)
    order = np.argsort(Lab[:, 0], kind="stable")
    if len(Lab) > 1:
        Lab[order, 0] = np.linspace(32, 92, len(Lab))
    Lab[:, 1:] *= 0.8  # dark and light colours have less room
    return np.rint(255 * np.clip(np.asarray(Lab_to_sRGB(Lab), np.float64), 0.0, 1.0)).astype(np.uint8)
