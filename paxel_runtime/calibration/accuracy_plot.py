"""The accuracy report as a picture: every test projection's error, and the worst colours as measured and predicted.

Drawn with Pillow alone, so that a show computer needs no plotting library.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from paxel_runtime.calibration.accuracy import ComparedColors, error_figures
from paxel_runtime.model.colorimetry import Lab_to_sRGB

__all__ = ["accuracy_picture"]

_WIDTH, _PANEL, _MARGIN, _LEFT = 1120, 330, 24, 64
_PLOT_WIDTH, _PLOT_HEIGHT = 620, 210
_WORST = 10
_SWATCH = 34
_INK, _SOFT, _GRID, _BAR, _LINEAR, _NOISE = "#222222", "#666666", "#dddddd", "#3a6ea5", "#c8a24a", "#b4552d"
_STEPS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0)


def accuracy_picture(
    title: str,
    tested: Mapping[str, ComparedColors],
    linear: Mapping[str, ComparedColors],
    floors: Mapping[str, Mapping[str, float]],
) -> NDArray[np.uint8]:
    """One panel a surface: sorted errors as bars, the linear model's as a line, the noise floor; the worst colours.

    Parameters
    ----------
    title : str
        First line: what was measured on what.
    tested, linear : dict of surface -> ComparedColors
        From `compare_colors`: the model's own, and without its correction.
    floors : dict of surface -> {"dE00_mean", ...}
        From `noise_floor`; a surface without repeated readings is absent.

    Returns
    -------
    (h, 1120, 3) uint8 array
        sRGB.
    """
    picture = Image.new("RGB", (_WIDTH, 56 + _PANEL * len(tested)), "white")
    draw = ImageDraw.Draw(picture)
    draw.text((_MARGIN, 18), title, _INK, _font(20))
    top_dE = max(float(c.dE00.max()) for c in (*tested.values(), *linear.values()))
    for place, (surface, colors) in enumerate(tested.items()):
        floor = floors.get(surface, {}).get("dE00_mean")
        _panel(draw, 56 + place * _PANEL, surface, colors, linear[surface], floor, max(1.05 * top_dE, 1e-3))
    return np.asarray(picture)


def _panel(
    draw: Any,
    top: int,
    surface: str,
    colors: ComparedColors,
    linear: ComparedColors,
    floor: float | None,
    highest: float,
) -> None:
    figures = error_figures(colors.dE00)
    words = "mean {dE00_mean:.2f}, 95 % {dE00_p95:.2f}, max {dE00_max:.2f}".format(**figures)
    draw.text((_LEFT, top + 4), f"on the {surface} surface: dE00 {words}", _INK, _font(16))
    plot_top = top + 40
    bottom = plot_top + _PLOT_HEIGHT

    def y(value: float) -> float:
        return bottom - _PLOT_HEIGHT * value / highest

    step = next((s for s in _STEPS if highest / s <= 6), _STEPS[-1])
    for tick in np.arange(0.0, highest, step):
        draw.line([(_LEFT, y(tick)), (_LEFT + _PLOT_WIDTH, y(tick))], _GRID)
        draw.text((_LEFT - 8, y(tick)), f"{tick:g}", _SOFT, _font(12), anchor="rm")
    draw.text((_LEFT - 8, plot_top - 8), "dE00", _SOFT, _font(12), anchor="rm")
    count = len(colors.dE00)
    edges = _LEFT + _PLOT_WIDTH * np.arange(count + 1) / count
    for left, right, value in zip(edges, edges[1:], np.sort(colors.dE00), strict=False):
        draw.rectangle([left, y(value), max(right - 1, left), bottom], _BAR)
    middles = (edges[1:] + edges[:-1]) / 2
    if not np.array_equal(linear.dE00, colors.dE00):
        draw.line(list(zip(middles, [y(v) for v in np.sort(linear.dE00)], strict=True)), _LINEAR, 2)
        _label(draw, plot_top + 4, "line: the linear model, without correction", _LINEAR)
    if floor is not None:
        draw.line([(_LEFT, y(floor)), (_LEFT + _PLOT_WIDTH, y(floor))], _NOISE, 2)
        _label(draw, plot_top + 22, f"the same frame read again: {floor:.2f}", _NOISE)
    draw.line([(_LEFT, bottom), (_LEFT + _PLOT_WIDTH, bottom)], _INK)
    draw.text((_LEFT, bottom + 6), f"{count} test projections, from the best to the worst", _SOFT, _font(13))
    _swatches(draw, _LEFT + _PLOT_WIDTH + 48, top + 4, colors)


def _label(draw: Any, top: int, text: str, color: str) -> None:
    """Text in the plot, on white: no grid line runs through it."""
    place = (_LEFT + 12, top)
    draw.rectangle(draw.textbbox(place, text, _font(13)), "white")
    draw.text(place, text, color, _font(13))


def _swatches(draw: Any, left: int, top: int, colors: ComparedColors) -> None:
    """The worst colours: measured above predicted, edge to edge."""
    worst = np.argsort(colors.dE00)[::-1][:_WORST]
    draw.text((left, top), "the worst: left measured, right predicted", _INK, _font(14))
    for place, index in enumerate(worst):
        column, row = divmod(place, _WORST // 2)
        x, y = left + column * 180, top + 36 + row * (_SWATCH + 8)
        for side, Lab in enumerate((colors.measured_Lab[index], colors.predicted_Lab[index])):
            sRGB = tuple(int(v) for v in np.rint(255 * np.clip(Lab_to_sRGB(Lab), 0, 1)))
            draw.rectangle([x + side * _SWATCH, y, x + (side + 1) * _SWATCH - 1, y + _SWATCH - 1], sRGB)
        draw.text((x + 2 * _SWATCH + 10, y + _SWATCH / 2), f"{colors.dE00[index]:.2f}", _INK, _font(13), anchor="lm")


def _font(size: int) -> Any:
    return ImageFont.load_default(size)
