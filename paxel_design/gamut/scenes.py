"""Pictures of gamuts in CIELAB, off screen (Figs. 4 and 10). The one file that uses pyvista.

L* points up, a* and b* span the floor. Each body has the colours of its vertices, or one colour of its own where
several lie over each other: outer ones are glassy.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.mesh_files import display_colors
from paxel_design.gamut.meshes import GamutMesh
from paxel_runtime.errors import GamutError

__all__ = ["SceneBody", "write_scene"]

_PALETTE = ("#7f7f7f", "#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#17becf", "#bcbd22")
"""Colours of overlaid bodies in turn; the first, a full gamut's, is gray."""

_LEGEND_ROW = 0.035
"""Height of a row of the legend, as a share of the picture's."""

_LEGEND_LEFT = 0.03

_MARGIN = 1.12
"""Room about what is drawn, for the halves of texts that reach beyond their places."""

_AXES_COLOR = "#303030"
_GRID_COLOR = "#c0c0c0"


@dataclass(frozen=True, eq=False)
class SceneBody:
    """A body of a picture.

    Attributes
    ----------
    mesh : GamutMesh
    label : str
        What the legend calls it; empty for none.
    color : str or None
        ``"#rrggbb"``; None takes the next colour of the palette, or with one body the colours of its vertices.
    """

    mesh: GamutMesh
    label: str = ""
    color: str | None = None


def write_scene(
    path: Path, bodies: Sequence[SceneBody], *, size_px: tuple[int, int] = (1200, 1000), azimuth_deg: float = -55.0
) -> None:
    """Draw bodies in one CIELAB space and write the picture.

    Parameters
    ----------
    path : Path
        ``.png``.
    bodies : sequence of SceneBody
        The largest is drawn first and, of several, glassy.
    size_px : (int, int)
    azimuth_deg : float
        Where the viewer stands, from +a* towards +b*.

    Raises
    ------
    GamutError
        If there is nothing to draw, or no picture can be drawn on this machine.
    """
    if not bodies:
        raise GamutError("a picture of gamuts needs one body or more, got none")
    plotter = _plotter(size_px)
    try:
        order = sorted(bodies, key=lambda body: -body.mesh.mesh_volume)
        for k, body in enumerate(order):
            _add_body(plotter, body, _PALETTE[k % len(_PALETTE)], depth=k, glassy=k + 1 < len(order))
        direction = _towards_viewer(azimuth_deg)
        plotter.set_background("white")
        drawn = _add_axes(plotter, bodies, direction)
        legend = _add_legend(plotter, order) if len(order) > 1 else 0.0
        _frame(plotter, drawn, direction, legend)
        plotter.enable_depth_peeling(8)  # glass behind glass, in the right order
        plotter.enable_anti_aliasing("ssaa")
        plotter.screenshot(str(path))
    except RuntimeError as error:
        raise GamutError(f"{path.name}: the picture could not be drawn: {error}") from error
    finally:
        plotter.close()


def _plotter(size_px: tuple[int, int]) -> Any:
    """A plotter without a window.

    Raises
    ------
    GamutError
        If pyvista is missing or cannot load its graphics library.
    """
    try:
        import pyvista  # heavy, and the only place that needs it
        from vtkmodules.vtkCommonCore import vtkLogger

        vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)  # it would tell of every display it does without
        return pyvista.Plotter(off_screen=True, window_size=list(size_px), lighting="three lights")
    except (ImportError, RuntimeError, OSError) as error:
        raise GamutError(
            f"pictures of gamuts need pyvista and OpenGL ({error}); install them with: pip install pyvista, and on "
            "Debian: apt-get install libgl1 libegl1 libxrender1"
        ) from error


def _add_body(plotter: Any, body: SceneBody, color: str, *, depth: int, glassy: bool) -> None:
    """Body number `depth` from the outside; a single one is not glassy and has the colours of its vertices."""
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(_place(body.mesh.Lab), body.mesh.faces.astype(int))
    look: dict[str, Any] = {"color": body.color or color}
    if depth == 0 and not glassy and body.color is None:
        surface["rgb"] = display_colors(body.mesh)
        look = {"scalars": "rgb", "rgb": True}
    actor = plotter.add_mesh(
        surface,
        opacity=0.3 if glassy else 1.0,
        smooth_shading=True,
        split_sharp_edges=True,
        feature_angle=60.0,
        specular=0.1,
        ambient=0.25,
        show_scalar_bar=False,
        **look,
    )
    # Where bodies share a face the outer one is in front, everywhere: else they alternate in patches.
    actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
    actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(4.0 * depth, 4.0 * depth)


def _place(Lab: Any) -> Any:
    """Right-handed (a*, b*, L*): L* up."""
    return np.ascontiguousarray(Lab[:, [1, 2, 0]])


def _add_legend(plotter: Any, order: Sequence[SceneBody]) -> float:
    """Name each body in its own colour, the outermost first; the share of the picture's height that this takes."""
    labels = [(body.label, body.color or _PALETTE[k % len(_PALETTE)]) for k, body in enumerate(order) if body.label]
    for row, (label, color) in enumerate(labels):
        place = (_LEGEND_LEFT, 1 - _LEGEND_ROW * (row + 1.3))
        plotter.add_text(label, position=place, viewport=True, font_size=12, color=color, shadow=False, font="arial")
    return _LEGEND_ROW * (len(labels) + 0.3)


def _frame(plotter: Any, drawn: NDArray[np.float64], direction: NDArray[np.float64], legend: float) -> None:
    """Look along `-direction` in parallel projection, so that `drawn` (k, 3) fills the picture under the legend."""
    right = np.cross([0.0, 0.0, 1.0], direction)
    right /= np.linalg.norm(right)
    up = np.cross(direction, right)
    across = np.stack((drawn @ right, drawn @ up), axis=1)
    low, high = across.min(axis=0), across.max(axis=0)
    width, height = plotter.window_size
    free = 1 - legend
    half = _MARGIN / 2 * max((high[0] - low[0]) * height / width, (high[1] - low[1]) / free)
    # The middle of what is drawn stands in the middle of the free part, which is below the picture's middle.
    middle = (low + high) / 2 + np.array([0.0, half * legend])
    focus = middle[0] * right + middle[1] * up + (drawn @ direction).mean() * direction
    camera = plotter.camera
    camera.enable_parallel_projection()
    camera.focal_point, camera.position, camera.up = focus, focus + 1000 * direction, (0.0, 0.0, 1.0)
    camera.parallel_scale = half
    plotter.renderer.ResetCameraClippingRange()


def _add_axes(plotter: Any, bodies: Sequence[SceneBody], direction: NDArray[np.float64]) -> NDArray[np.float64]:
    """The floor and the two walls behind the bodies with a grid, and numbers along the edges in front.

    Parameters
    ----------
    direction : (3,) float64 array
        Towards the viewer, as (a*, b*, L*).

    Returns
    -------
    (k, 3) float64 array
        Corners of the walls, and places of all texts.
    """
    import pyvista

    place = np.concatenate([_place(body.mesh.Lab) for body in bodies])
    low, high = place.min(axis=0), place.max(axis=0)
    step = np.array([_tick_step(max(high[0] - low[0], high[1] - low[1]))] * 2 + [_tick_step(high[2] - low[2])])
    low, high = step / 2 * np.floor(2 * low / step), step / 2 * np.ceil(2 * high / step)
    low[2] = max(low[2], 0.0)
    front = np.where(direction > 0, high, low)
    back = np.where(direction > 0, low, high)
    ticks = [np.arange(np.ceil(low[k] / step[k]) * step[k], high[k] + 1e-9, step[k]) for k in range(3)]
    lines = []
    for along in range(3):
        for across in set(range(3)) - {along}:
            for tick in {*ticks[across].tolist(), low[across], high[across]}:
                ends = np.array([back, back])
                ends[:, across], ends[:, along] = tick, (low[along], high[along])
                lines.append(ends)
    grid = pyvista.line_segments_from_points(np.concatenate(lines))
    plotter.add_mesh(grid, color=_GRID_COLOR, line_width=1, lighting=False)
    # a* and b* along the floor's two edges in front; L* up the edge at the left, behind one of them.
    outer = 0.06 * np.linalg.norm((high - low)[:2])
    up_edge = front.copy()
    left = 0 if direction[0] * direction[1] < 0 else 1
    up_edge[left] = back[left]
    drawn = [np.concatenate(lines)]
    for k, start in enumerate((front, front, up_edge)):
        # On the floor, away from the bodies: across the edge that the numbers stand along.
        away = np.zeros(3)
        if k < 2:
            away[1 - k] = np.sign(direction[1 - k]) * outer
        else:
            away[left] = -np.sign(direction[left]) * outer
        points = np.tile(start + away, (len(ticks[k]), 1))
        points[:, k] = ticks[k]
        if k < 2:
            points[:, 2] = low[2]
        title = points.mean(axis=0, keepdims=True) + 1.2 * away
        _add_text(plotter, points, [f"{tick:.0f}" for tick in ticks[k]], 15)
        _add_text(plotter, title, [("a*", "b*", "L*")[k]], 20)
        drawn += [points, title]
    return np.concatenate(drawn)


def _tick_step(span: float) -> float:
    """Distance of ticks, 20 or 40 units or a fine one, for some three to nine of them."""
    return next((step for step in (1.0, 2.0, 5.0, 10.0, 20.0) if span <= 7 * step), 40.0)


def _add_text(plotter: Any, points: NDArray[np.float64], texts: list[str], size: int) -> None:
    plotter.add_point_labels(
        points,
        texts,
        font_size=size,
        text_color=_AXES_COLOR,
        show_points=False,
        shape=None,
        always_visible=True,
        justification_horizontal="center",
        justification_vertical="center",
    )


def _towards_viewer(azimuth_deg: float) -> NDArray[np.float64]:
    azimuth, up = np.deg2rad(azimuth_deg), np.deg2rad(22.0)
    return np.array([np.cos(up) * np.cos(azimuth), np.cos(up) * np.sin(azimuth), np.sin(up)])
