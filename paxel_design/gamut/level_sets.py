"""Sets that are no polytopes: margins on a grid in CIELAB -> a field, its volume by node count, and a closed mesh.

The grid is padded: outside the full gamut a margin is continued along rays from the gamut's middle, so that the level
set crosses the gamut's surface cleanly and is then cut with the exact gamut. Where the surface crosses the grid's
edges is found on the margin itself, not on its interpolation. Nothing here knows what a margin means.
"""

from __future__ import annotations

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from paxel_design.gamut.contouring import Crossings, crossings_of, smoothed, surface_net
from paxel_design.gamut.margins import Margins
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, gamut_solid, mesh_of_solid
from paxel_design.gamut.polytopes import inscribed_ball
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ
from paxel_runtime.model.subgamut import LabField, SubGamut, min_slack

__all__ = ["STEP", "field_volume", "level_set", "level_set_mesh"]

STEP = 2.0
"""Distance of nodes, CIELAB units."""

_PADDING = 2
"""Layers of nodes beyond the full gamut where the margin is continued."""

_LARGEST = 10.0
"""Margins are cut off here: further from the boundary they say nothing more."""

_NOT_ASKED = -2 * _LARGEST
"""Value of nodes beyond the padding."""

_PULL = 1e-6
"""How far below the gamut's surface, as a share of the way to the middle, a margin is asked there: on it, rounding may
leave a colour without any input."""

_SECANTS = 12
_NEAR_ZERO, _NEAR_PLACE = 0.01, 0.005
"""Where the search along an edge ends: margin, and share of the edge."""

_SPECK = 1e-4
"""Share of the volume below which a separate part is a speck that the grid left at a crease, and is dropped."""

_SIMPLIFY = 0.02
"""How far simplifying may move the surface, CIELAB units."""


def level_set(full: SubGamut, effect: str, margins: Margins, step: float = STEP) -> SubGamut:
    """The part of a full gamut where a margin is >= 0, as a field.

    Parameters
    ----------
    full : SubGamut
        All colours of the surface, half-spaces only.
    effect : str
        Name of the result.
    margins : callable
        XYZ (k, 3) inside `full` -> (k,), about CIELAB units.
    step : float
        Distance of the nodes, CIELAB units. Memory: some 100 bytes a node, 25 MB for sRGB at step 2.

    Raises
    ------
    GamutError
        If no node lies in the set.
    """
    surface = gamut_mesh(full).Lab
    # Nodes lie half a step beside the gray axis: on it a colour has no hue.
    first = np.floor(surface.min(axis=0) / step) - _PADDING - 1
    counts = (np.ceil(surface.max(axis=0) / step) + _PADDING + 2 - first).astype(int)
    origin = (first + 0.5) * step
    nodes = origin + step * np.moveaxis(np.indices(counts), 0, -1)
    XYZ = np.asarray(Lab_to_XYZ(nodes, full.white_point), np.float64)
    inside = full.contains(XYZ)
    near = binary_dilation(inside, np.ones((3, 3, 3), bool), iterations=_PADDING)
    values = np.full(counts, _NOT_ASKED, np.float32)
    values[near] = np.clip(_continued(full, margins)(XYZ[near]), -_LARGEST, _LARGEST)
    # Exactly 0 would put a vertex of the mesh on a node, shared by slivers.
    values[values == 0] = np.float32(1e-6)
    if not np.any(inside & (values > 0)):
        raise GamutError(
            f"sub-gamut {effect}.on-{full.shown_on} is empty: no colour of a grid of {step:g} CIELAB units can have "
            "such a partner"
        )
    return SubGamut(effect, full.shown_on, full.normals, full.offsets, full.white_point, LabField(origin, step, values))


def field_volume(gamut: SubGamut) -> float:
    """Volume by node count, in cubic CIELAB units, of a sub-gamut with a field."""
    field = gamut.field
    assert field is not None
    nodes = field.origin + field.step * np.argwhere(field.values > 0)
    inside = min_slack(gamut.normals, gamut.offsets, Lab_to_XYZ(nodes, gamut.white_point)) >= 0
    return float(np.count_nonzero(inside)) * field.step**3


def level_set_mesh(gamut: SubGamut, margins: Margins | None = None) -> GamutMesh:
    """The closed surface of a sub-gamut with a field, cut with its exact full gamut.

    Parameters
    ----------
    gamut : SubGamut
    margins : callable, optional
        What the field was made of: the vertices are moved to where it is 0; without it to where the field is.

    Raises
    ------
    GamutError
        If the surface does not close.
    """
    field = gamut.field
    assert field is not None
    full = SubGamut(gamut.effect, gamut.shown_on, gamut.normals, gamut.offsets, gamut.white_point)
    crossings = crossings_of(field.values)
    share = _places_on_edges(crossings, field, margins and _continued(full, margins), gamut.white_point)
    places, faces = surface_net(crossings, share, field.values.shape)
    places = smoothed(places, faces)
    solid = manifold3d.Manifold(manifold3d.Mesh64(field.origin + field.step * places, faces.astype(np.uint64)))
    if solid.status() != manifold3d.Error.NoError:
        raise GamutError(f"sub-gamut {gamut.file_stem} has no mesh: its surface does not close ({solid.status().name})")
    cut = (solid ^ gamut_solid(gamut_mesh(full))).simplify(_SIMPLIFY)
    parts = sorted(cut.decompose(), key=lambda part: -part.volume())
    kept = [part for part in parts if part.volume() > _SPECK * cut.volume()]
    if not kept:
        raise GamutError(f"sub-gamut {gamut.file_stem} has no mesh: it is thinner than its grid of {field.step:g}")
    volume = field_volume(gamut)
    whole = manifold3d.Manifold.compose(kept)
    return mesh_of_solid(whole, volume=volume, volume_error=abs(whole.volume() - volume))


def _continued(full: SubGamut, margins: Margins) -> Margins:
    """Margins everywhere: colours outside the full gamut are pulled straight towards its middle, onto its surface."""
    middle, _ = inscribed_ball(full.normals, full.offsets)
    room = full.offsets - full.normals @ middle

    def continued(XYZ: NDArray[np.float64]) -> NDArray[np.float64]:
        values = np.empty(len(XYZ))
        for i in range(0, len(XYZ), 65536):
            ray = XYZ[i : i + 65536] - middle
            reach = np.max(ray @ full.normals.T / room, axis=1, initial=0.0)
            values[i : i + 65536] = margins(middle + ray / np.maximum(reach * (1 + _PULL), 1.0)[:, None])
        return values

    return continued


def _places_on_edges(
    crossings: Crossings, field: LabField, margins: Margins | None, white_point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Where each crossing lies on its edge (e,), by the Illinois rule on the margin.

    Edges to nodes that were never asked lie outside the gamut: there, as without margins, the field decides.
    """
    f0, f1 = (np.asarray(field.values[tuple(ends.T)], np.float64) for ends in (crossings.low, crossings.high))
    share = f0 / (f0 - f1)
    if margins is None:
        return share
    edge = np.eye(3)[crossings.axis]
    low, high = np.zeros(len(share)), np.ones(len(share))
    left = np.flatnonzero(np.minimum(f0, f1) > _NOT_ASKED)
    for _ in range(_SECANTS):
        Lab = field.origin + field.step * (crossings.low[left] + share[left, None] * edge[left])
        value = margins(np.asarray(Lab_to_XYZ(Lab, white_point), np.float64))
        as_low = np.sign(value) == np.sign(f0[left])
        # The end that stays counts half, so that neither sticks.
        f0[left], f1[left] = np.where(as_low, value, f0[left] / 2), np.where(as_low, f1[left] / 2, value)
        low[left] = np.where(as_low, share[left], low[left])
        high[left] = np.where(as_low, high[left], share[left])
        left = left[(np.abs(value) > _NEAR_ZERO) & (high[left] - low[left] > _NEAR_PLACE)]
        part = np.clip(f0[left] / np.where(f0[left] == f1[left], 1, f0[left] - f1[left]), 0.02, 0.98)
        share[left] = low[left] + (high[left] - low[left]) * part
    return share
