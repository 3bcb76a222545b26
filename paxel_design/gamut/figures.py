"""Two-dimensional figures of Fig. 13: lightness areas and hue-change areas, as pictures and as meshes in a plane.

The one file of this package that uses matplotlib.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.hue_area import HueArea
from paxel_design.gamut.lightness import LightnessArea
from paxel_runtime.model.colorimetry import Lab_to_sRGB
from paxel_runtime.version import WRITER

__all__ = ["plane_mesh", "write_hue_figure", "write_lightness_figure", "write_plane"]

_COLORS = ("#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd")


def plane_mesh(polygon: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 2) and triangles (F, 3), counter-clockwise, of the inside of a polygon (m, 2).

    The polygon must be star-shaped about its centroid, as lightness areas and hue-change areas are: one fan.
    """
    x, y = polygon.T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    centre = np.stack(((x + np.roll(x, -1)) @ cross, (y + np.roll(y, -1)) @ cross)) / (3 * cross.sum())
    count = len(polygon)
    corner = np.arange(count)
    return np.vstack((polygon, centre)), np.stack((np.full(count, count), corner, (corner + 1) % count), axis=1)


def write_plane(path: Path, polygon: NDArray[np.float64]) -> None:
    """Write the inside of a polygon (m, 2), as `plane_mesh` makes it, at height 0: ``.ply`` in text."""
    vertices, faces = plane_mesh(polygon)
    lines = [
        "ply",
        "format ascii 1.0",
        f"comment {WRITER}",
        f"element vertex {len(vertices)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header",
        *(f"{x:.9g} {y:.9g} 0" for x, y in vertices.tolist()),
        *(f"3 {i} {j} {k}" for i, j, k in faces.tolist()),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def write_lightness_figure(path: Path, areas: Mapping[str, LightnessArea]) -> None:
    """Draw lightness areas with their largest rectangles, one or several by name (Fig. 13, a1 and b1)."""
    figure, axes = _figure()
    for (name, area), color in zip(areas.items(), _COLORS * len(areas), strict=False):
        closed = np.vstack((area.polygon, area.polygon[:1]))
        axes.fill(*closed.T, color=color, alpha=0.15, linewidth=0)
        axes.plot(*closed.T, color=color, linewidth=1.5, label=f"{name}: area {area.area:.0f}".removeprefix(": "))
        (x0, x1), (y0, y1) = area.L_pattern, area.L_white
        axes.plot(
            [x0, x1, x1, x0, x0],
            [y0, y0, y1, y1, y0],
            color=color,
            linestyle="--",
            linewidth=1.2,
            label=f"largest rectangle {x1 - x0:.1f} x {y1 - y0:.1f}",
        )
        if area.L_same is not None:
            z0, z1 = area.L_same
            axes.plot([z0, z1, z1, z0, z0], [z0, z0, z1, z1, z0], color=color, linestyle=":", linewidth=1.2,
                      label=f"same range {z0:.1f} to {z1:.1f}")  # fmt: skip
    axes.plot([0, 100], [0, 100], color="#b0b0b0", linewidth=0.8)
    axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="L* on the pattern", ylabel="L* on the white surface")
    axes.set_title("Grays that both surfaces can show at once")
    axes.legend(loc="lower right", fontsize=8, frameon=False)
    _write(figure, path)


def write_hue_figure(path: Path, areas: Mapping[str, HueArea]) -> None:
    """Draw hue-change areas, one or several by name (Fig. 13, a2 and b2), on a floor of the colours themselves."""
    figure, axes = _figure()
    reach = 1.1 * max(float(np.abs(area.polygon_any).max()) for area in areas.values())
    a, b = np.meshgrid(np.linspace(-reach, reach, 256), np.linspace(-reach, reach, 256))
    floor = np.clip(Lab_to_sRGB(np.stack((np.full_like(a, 60.0), a, b), axis=-1)), 0, 1)
    axes.imshow(0.5 + 0.5 * floor, extent=(-reach, reach, -reach, reach), origin="lower", interpolation="bilinear")
    for (name, area), color in zip(areas.items(), _COLORS * len(areas), strict=False):
        prefix = f"{name}, " if name else ""
        for polygon, size, style, words in (
            (area.polygon_any, area.area_any, "-", "some lightnesses"),
            (area.polygon_all, area.area_all, "--", "all of the halved rectangle"),
        ):
            axes.plot(*np.vstack((polygon, polygon[:1])).T, color=color if name else "black", linestyle=style,
                      linewidth=1.5, label=f"{prefix}{words}: area {size:.0f}")  # fmt: skip
    angle = next(iter(areas.values())).angle_deg
    axes.set(xlabel="a* on the pattern", ylabel="b* on the pattern", aspect="equal")
    axes.set_title(f"Colours whose hue can turn by {angle:g}°")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), fontsize=8, frameon=False)
    _write(figure, path)


def _figure() -> tuple[Any, Any]:
    from matplotlib.figure import Figure  # heavy; without pyplot, so no window system is asked

    figure = Figure(figsize=(5.2, 5.4), dpi=150, layout="constrained")
    axes = figure.add_subplot()
    axes.grid(visible=True, color="#e0e0e0", linewidth=0.6)
    axes.set_axisbelow(True)
    return figure, axes


def _write(figure: Any, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    figure.savefig(path, metadata={"Software": None})
