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

from paxel_design.gamut.mesh_files import display_colors
from paxel_design.gamut.meshes import GamutMesh
from paxel_runtime.errors import GamutError

__all__ = ["SceneBody", "write_scene"]

_PALETTE = ("#7f7f7f", "#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#17becf", "#bcbd22")
"""Colours of overlaid bodies in turn; the first, a full gamut's, is gray."""

_AXES_COLOR = "#404040"


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
            _add_body(plotter, body, _PALETTE[k % len(_PALETTE)], alone=len(bodies) == 1, glassy=k + 1 < len(order))
        _add_axes(plotter, bodies)
        labels = [[body.label, body.color or _PALETTE[k % len(_PALETTE)]] for k, body in enumerate(order) if body.label]
        if labels and len(bodies) > 1:
            height = 0.035 * len(labels)
            plotter.add_legend(labels, bcolor="white", size=(0.28, height), loc="upper left", face="rectangle")
        _place_camera(plotter, azimuth_deg)
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


def _add_body(plotter: Any, body: SceneBody, color: str, *, alone: bool, glassy: bool) -> None:
    import pyvista

    surface = pyvista.PolyData.from_regular_faces(_place(body.mesh.Lab), body.mesh.faces.astype(int))
    look: dict[str, Any] = {"color": body.color or color}
    if alone and body.color is None:
        surface["rgb"] = display_colors(body.mesh)
        look = {"scalars": "rgb", "rgb": True}
    plotter.add_mesh(
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


def _place(Lab: Any) -> Any:
    """Right-handed (a*, b*, L*): L* up."""
    return np.ascontiguousarray(Lab[:, [1, 2, 0]])


def _add_axes(plotter: Any, bodies: Sequence[SceneBody]) -> None:
    Lab = np.concatenate([body.mesh.Lab for body in bodies])
    low, high = Lab.min(axis=0), Lab.max(axis=0)
    low, high = 20 * np.floor(low / 20), 20 * np.ceil(high / 20)
    low[0] = max(low[0], 0.0)
    counts = [int(min((b - a) / 20, 8)) + 1 for a, b in zip(low, high, strict=True)]
    plotter.set_background("white")
    plotter.show_bounds(
        bounds=(low[1], high[1], low[2], high[2], low[0], high[0]),
        xtitle="a*",
        ytitle="b*",
        ztitle="L*",
        n_xlabels=counts[1],
        n_ylabels=counts[2],
        n_zlabels=counts[0],
        fmt="%.0f",
        color=_AXES_COLOR,
        grid="back",
        location="outer",
        ticks="outside",
        font_size=11,
        use_3d_text=False,
    )


def _place_camera(plotter: Any, azimuth_deg: float) -> None:
    azimuth, up = np.deg2rad(azimuth_deg), np.deg2rad(20.0)
    direction = (np.cos(up) * np.cos(azimuth), np.cos(up) * np.sin(azimuth), np.sin(up))
    plotter.view_vector(direction, viewup=(0, 0, 1))
    plotter.camera.zoom(1.0)
