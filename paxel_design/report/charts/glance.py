"""What a model can show at one glance: the light of each cluster, the grays and the colours of each surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from paxel_design.report.charts.style import GRAYS, LINE_STYLES, PALETTE, new_figure, style
from paxel_runtime.model.colorimetry import Lab_to_sRGB, XYZ_to_Lab
from paxel_runtime.model.prediction import PredictionModel

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["glance_chart"]

_SURFACES = {"pattern": "pattern", "white": "white surface"}
_RANDOM_INPUTS = 4000


def glance_chart(model: PredictionModel) -> Figure:
    """Three panels: swatches of each cluster at full, ranges of L*, and colours in a* and b*.

    Of the linear part of a spectral model; colours outside sRGB are shown as its nearest.
    """
    import matplotlib

    with matplotlib.rc_context(style()):
        figure = new_figure(58)
        swatches, lightness, colours = figure.subplots(1, 3, width_ratios=(1.1, 0.9, 1))
        _draw_swatches(swatches, model)
        _draw_lightness(lightness, model)
        _draw_colours(colours, model)
        return figure


def _Lab(model: PredictionModel, surface: str, x: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(XYZ_to_Lab(model.surfaces[surface].predict_XYZ(x), model.white_point))


def _draw_swatches(axes: Any, model: PredictionModel) -> None:
    """Rows: inputs at full, one channel on one cluster; columns: surfaces."""
    surfaces = list(model.surfaces)
    shown = [_Lab(model, surface, np.eye(model.n)) for surface in surfaces]
    picture = np.clip(np.stack([Lab_to_sRGB(Lab) for Lab in shown], axis=1), 0, 1)
    axes.imshow(picture, aspect="auto", interpolation="nearest")
    labels = [f"{channel} on {cluster}" for cluster in model.clusters for channel in model.channels]
    small = min(7.0, 90 / len(labels))
    axes.set_yticks(range(model.n), labels, fontsize=small)
    axes.set_xticks(range(len(surfaces)), [_SURFACES[surface] for surface in surfaces])
    axes.grid(visible=False)
    axes.set_title("each input alone")


def _draw_lightness(axes: Any, model: PredictionModel) -> None:
    for place, surface in enumerate(model.surfaces):
        low, high = (float(_Lab(model, surface, np.full(model.n, value))[0]) for value in (0.0, 1.0))
        axes.bar(place, high - low, 0.5, bottom=low, color=GRAYS[2], edgecolor=GRAYS[0], hatch="////" * place, lw=0.6)
        axes.text(place, high + 1, f"{high:.0f}", ha="center", va="bottom", fontsize=7)
        axes.text(place, low - 1, f"{low:.0f}", ha="center", va="top", fontsize=7)
    axes.set_xticks(range(len(model.surfaces)), [_SURFACES[surface] for surface in model.surfaces])
    axes.set(ylim=(-8, 108), xlim=(-0.6, len(model.surfaces) - 0.4), ylabel="L*", title="black to full")
    axes.grid(visible=False, axis="x")


def _draw_colours(axes: Any, model: PredictionModel) -> None:
    """Outline of all colours seen along the gray axis: of the corners of the input cube, or of many of them."""
    if model.n <= 12:
        corners = np.array(np.meshgrid(*[(0.0, 1.0)] * model.n)).reshape(model.n, -1).T
    else:
        corners = np.random.default_rng(0).integers(0, 2, (_RANDOM_INPUTS, model.n)).astype(np.float64)
        corners = np.vstack((corners, np.eye(model.n)))
    for k, surface in enumerate(model.surfaces):
        ab = _Lab(model, surface, corners)[:, 1:]
        ring = ab[ConvexHull(ab).vertices]
        ring = np.vstack((ring, ring[:1]))
        axes.plot(*ring.T, LINE_STYLES[k], color=PALETTE[k], label=_SURFACES[surface])
    axes.axhline(0, color=GRAYS[2], lw=0.6)
    axes.axvline(0, color=GRAYS[2], lw=0.6)
    axes.set(aspect="equal", xlabel="a*", ylabel="b*")
    axes.set_title("all colours", pad=18)
    axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, fontsize=6.5)
