"""Pictures of an advice: heat maps over angle and dot size, and what is given up for what (Pareto).

The one file of this package that uses matplotlib.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from paxel_design.advice.ranking import Advice, Candidate, pareto

__all__ = ["write_heat_map", "write_pareto"]

_PANELS: tuple[tuple[str, str, str, Callable[[Candidate], float]], ...] = (
    ("score", "score, L*: more is better", "viridis", lambda c: c.score),
    ("moire", "worst moire of a lit cluster, thresholds", "magma_r", lambda c: c.moire.visibility),
    ("print", "print seen by itself, thresholds", "magma_r", lambda c: c.seen),
    ("effect", "effect: free range of L*", "viridis", lambda c: c.effect.lightness),
)
_MARKERS = "osD^v"


def write_heat_map(path: Path, advice: Advice) -> None:
    """Draw score, moire, visibility and effect over angle (and layout) x dot size; the best are numbered."""
    from matplotlib.colors import LogNorm

    columns = sorted({(c.layout == "blue-noise", c.layout, c.asked_angle_deg) for c in advice.candidates})
    rows = sorted({c.asked_dot_px for c in advice.candidates})
    at = {(c.asked_dot_px, c.layout, c.asked_angle_deg): c for c in advice.candidates}
    figure, axes = _figure(12.0, 7.6, 2, 2)
    for panel, (name, title, colours, value) in zip(axes.ravel(), _PANELS, strict=True):
        grid = np.array([[value(at[dot, layout, angle]) for _, layout, angle in columns] for dot in rows])
        norm = LogNorm(max(0.05, grid.min()), max(0.06, grid.max())) if name in ("moire", "print") else None
        image = panel.imshow(np.maximum(grid, 0.05), cmap=colours, norm=norm, aspect="auto", origin="lower")
        figure.colorbar(image, ax=panel)
        middle = np.sqrt(grid.max() * max(grid.min(), 0.05)) if norm else grid.mean()
        for i, row in enumerate(grid):
            for j, shown in enumerate(row):
                dark = (shown > middle) == (name in ("moire", "print"))
                words = "< 0.1" if norm and shown < 0.1 else f"{shown:.3g}"
                panel.text(j, i, words, ha="center", va="center", fontsize=8,
                           color="white" if dark else "black")  # fmt: skip
        panel.set_title(title, fontsize=10)
        panel.set_xticks(range(len(columns)), [_column(layout, angle) for _, layout, angle in columns], fontsize=8)
        panel.set_yticks(range(len(rows)), [f"{dot:g} px\n{dot * advice.setup.pitch_mm:.2f} mm" for dot in rows],
                         fontsize=8)  # fmt: skip
        for k, best in enumerate(advice.best, 1):
            j = [(layout, angle) for _, layout, angle in columns].index((best.layout, best.asked_angle_deg))
            i = rows.index(best.asked_dot_px)
            panel.add_patch(_frame(j, i))
            panel.text(j - 0.45, i + 0.44, str(k), ha="left", va="top", fontsize=8, color="#00a0ff", weight="bold")
    figure.suptitle(_title(advice), fontsize=11)
    _write(figure, path)


def write_pareto(path: Path, advice: Advice) -> None:
    """Draw moire against effect, with the print's visibility as colour; those that no other beats are ringed."""
    from matplotlib.colors import LogNorm

    figure, axes = _figure(7.6, 5.6, 1, 1)
    panel = axes[0, 0]
    norm = LogNorm(0.05, max(10.0, *(c.seen for c in advice.candidates)))
    for marker, layout in zip(_MARKERS, dict.fromkeys(c.layout for c in advice.candidates), strict=False):
        own = [c for c in advice.candidates if c.layout == layout]
        dots = panel.scatter(
            [c.effect.lightness for c in own],
            [max(c.moire.visibility, 0.05) for c in own],
            c=[max(c.seen, 0.05) for c in own],
            norm=norm, cmap="magma_r", marker=marker, s=36, edgecolors="#606060", linewidths=0.5, label=layout,
        )  # fmt: skip
    front = pareto(advice.candidates)
    panel.scatter([c.effect.lightness for c in front], [max(c.moire.visibility, 0.05) for c in front],
                  s=110, facecolors="none", edgecolors="#00a0ff", label="no other is better in all three")  # fmt: skip
    for k, best in enumerate(advice.best, 1):
        there = next(c for c in advice.candidates if c.name == best.name)
        panel.annotate(f"{k}: {best.asked_angle_deg:.0f}°, {best.dot_size_mm:.2f} mm",
                       (there.effect.lightness, max(there.moire.visibility, 0.05)), xytext=(8, -12 - 4 * k),
                       textcoords="offset points", fontsize=8)  # fmt: skip
    panel.set_yscale("log")
    panel.set(xlabel="effect: free range of L*", ylabel="worst moire of a lit cluster, thresholds")
    panel.grid(visible=True, color="#e0e0e0", linewidth=0.6)
    panel.set_axisbelow(True)
    panel.legend(fontsize=8, frameon=False)
    figure.colorbar(dots, ax=panel, label="print seen by itself, thresholds (1 = just)")
    panel.set_title(_title(advice), fontsize=10)
    _write(figure, path)


def _column(layout: str, angle_deg: float) -> str:
    return "blue\nnoise" if layout == "blue-noise" else f"{angle_deg:.4g}°"


def _title(advice: Advice) -> str:
    s = advice.setup
    return (
        f"{', '.join(s.colorants)}; {s.resolution[0]} x {s.resolution[1]} on {s.width_mm:g} mm "
        f"({s.pitch_mm:.4f} mm a pixel), seen from {s.distance_mm / 1000:g} m; K = {s.clusters}"
    )


def _frame(column: int, row: int) -> Any:
    from matplotlib.patches import Rectangle

    return Rectangle((column - 0.48, row - 0.48), 0.96, 0.96, fill=False, edgecolor="#00a0ff", linewidth=2)


def _figure(width: float, height: float, rows: int, columns: int) -> tuple[Any, Any]:
    from matplotlib.figure import Figure  # heavy; without pyplot, so no window system is asked

    figure = Figure(figsize=(width, height), dpi=110, layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False)


def _write(figure: Any, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    figure.savefig(path, metadata={"Software": None})
