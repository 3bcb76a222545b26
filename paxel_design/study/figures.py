"""The charts of a study, as in Fig. 13: lightness areas with their rectangles, and hue areas, by dot size and by K.

The one file of this package that uses matplotlib.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.report.charts import GRAYS, LINE_STYLES, PALETTE, new_figure, style
from paxel_design.study.cases import Case
from paxel_runtime.version import WRITER

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["write_study_figure"]

_HEIGHT_MM, _WIDTH_MM = 78.0, 260.0
_MARKERS = "osD^vP"
_USUAL_DOT_MM = 0.75

Figures = Mapping[str, Any]


def write_study_figure(path: Path, figures: Mapping[Case, Figures]) -> None:
    """Draw a study: two rows of charts for each layout and angle, lightness and hue.

    Parameters
    ----------
    path : Path
        ``.png``.
    figures : mapping of Case -> dict
        What `measure_case` returns.
    """
    import matplotlib

    layouts: dict[tuple[str, float], dict[Case, Figures]] = {}
    for case, found in figures.items():
        layouts.setdefault((case.layout, case.angle_deg), {})[case] = found
    figure = new_figure(2 * _HEIGHT_MM * len(layouts), _WIDTH_MM)
    with matplotlib.rc_context(style()):
        panels = figure.subplots(2 * len(layouts), 3, squeeze=False)
        for k, ((layout, angle_deg), cases) in enumerate(layouts.items()):
            _draw_layout(panels[2 * k : 2 * k + 2], f"{layout}, {angle_deg:.4g}°", cases)
        measured_on = ", ".join(dict.fromkeys(found["measured_on"] for found in figures.values()))
        figure.suptitle(f"What dot size and number of clusters change ({measured_on})", fontsize=10)
        figure.savefig(path, dpi=130, metadata={"Software": WRITER})


def _draw_layout(panels: Any, name: str, cases: Mapping[Case, Figures]) -> None:
    """Lightness above hue: by dot size, by K, and all cases."""
    dots, counts = sorted({c.dot_size_mm for c in cases}), sorted({c.clusters for c in cases})
    dot, count = min(dots, key=lambda mm: abs(mm - _USUAL_DOT_MM)), min(counts, key=lambda K: (abs(K - 3), K))
    of = {(c.dot_size_mm, c.clusters): found for c, found in cases.items()}
    by_dot = {f"{mm:g} mm": of[mm, count] for mm in dots if (mm, count) in of}
    by_count = {f"K = {K}": of[dot, K] for K in counts if (dot, K) in of}
    for column, (series, what) in enumerate(
        ((by_dot, f"{name}: by dot size, K = {count}"), (by_count, f"{name}: by K, dots of {dot:g} mm"))
    ):
        _draw_lightness(panels[0, column], what, series)
        _draw_hue(panels[1, column], what, series)
    _draw_all(panels[0, 2], "lightness rectangle, L* x L*", dots, counts, of, _rectangle_area)
    _draw_all(panels[1, 2], "hues that can turn by 180°, a* x b*", dots, counts, of, _hue_area)


def _draw_lightness(panel: Axes, title: str, series: Mapping[str, Figures]) -> None:
    for (name, found), color, line in zip(series.items(), PALETTE * 9, LINE_STYLES * 9, strict=False):
        if found["lightness"] is None:
            panel.plot([], [], color=color, linestyle=line, label=f"{name}: none")
            continue
        (x0, x1), (y0, y1) = (found["lightness"]["rectangle"][key] for key in ("L_pattern", "L_white"))
        polygon = np.array(found["lightness"]["polygon"])
        panel.plot(*_closed(polygon), color=color, linestyle=line, label=f"{name}: {x1 - x0:.1f} x {y1 - y0:.1f}")
        panel.plot([x0, x1, x1, x0, x0], [y0, y0, y1, y1, y0], color=color, linestyle=line, linewidth=0.8)
    panel.plot([0, 100], [0, 100], color=GRAYS[2], linewidth=0.7)
    panel.set(xlim=(0, 100), ylim=(0, 100), xlabel="L* on the pattern", ylabel="L* on the white surface", title=title)
    panel.set_aspect("equal")
    panel.legend(loc="lower right", title="free range of L*", title_fontsize=7.5)


def _draw_hue(panel: Axes, title: str, series: Mapping[str, Figures]) -> None:
    for (name, found), color, line in zip(series.items(), PALETTE * 9, LINE_STYLES * 9, strict=False):
        if found["hue"] is None:
            panel.plot([], [], color=color, linestyle=line, label=f"{name}: none")
            continue
        label = f"{name}: {found['hue']['area_any']:.0f}"
        panel.plot(*_closed(np.array(found["hue"]["polygon_any"])), color=color, linestyle=line, label=label)
    panel.set(xlabel="a* on the pattern", ylabel="b* on the pattern", title=title)
    panel.set_aspect("equal", adjustable="datalim")
    panel.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, title="area", title_fontsize=7.5)


def _draw_all(
    panel: Axes,
    title: str,
    dots: Sequence[float],
    counts: Sequence[int],
    of: Mapping[tuple[float, int], Figures],
    area: Callable[[Figures], float],
) -> None:
    """An area of every case over dot size, a line for each K."""
    for K, color, line, marker in zip(counts, PALETTE * 9, LINE_STYLES * 9, _MARKERS * 9, strict=False):
        here = [mm for mm in dots if (mm, K) in of]
        panel.plot(here, [area(of[mm, K]) for mm in here], color=color, linestyle=line, marker=marker, markersize=4,
                   label=f"K = {K}")  # fmt: skip
    panel.set_ylim(bottom=0)
    panel.set(xlabel="dot size, mm", title=title)
    panel.set_xticks(dots, [f"{mm:g}" for mm in dots])
    panel.legend(loc="lower right")


def _rectangle_area(found: Figures) -> float:
    if found["lightness"] is None:
        return 0.0
    (x0, x1), (y0, y1) = found["lightness"]["rectangle"].values()
    return float((x1 - x0) * (y1 - y0))


def _hue_area(found: Figures) -> float:
    return 0.0 if found["hue"] is None else float(found["hue"]["area_any"])


def _closed(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Columns of a polygon (m, 2), its first corner again at the end."""
    return np.vstack((polygon, polygon[:1])).T
