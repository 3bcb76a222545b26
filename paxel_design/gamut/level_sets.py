"""Sets that are no polytopes: margins on a grid in CIELAB -> a closed mesh, a field, and the volume by node count.

The grid is padded: beyond the full gamut a margin goes on straight, by its slope on the gamut's surface, so that the
level set crosses that surface cleanly and is then cut with the exact gamut. Margins are asked on every second node,
and on the others only where the boundary can be near. The mesh's vertices lie on the margin itself, not on its
interpolation; the field is the distance to that mesh, on a grid of half the step: margins bend at the very boundary,
where another condition begins to bind, and a field of them would be wrong there by a fourth of the step. Nothing here
knows what a margin means.

How right hue sets are (b/w print, n = 6, step 2, 20 to 170 degrees; 1,000 places on the boundary each, judged a tenth
of a CIELAB unit inside and outside by a proven search for a partner, which is then inverted: `gamut_oracles` of the
reports): the margin in 996; in the others it misses a partner that straightened lines do not lead to. The field in 881,
to 0.2 units in 951, to 0.4 in 979, in all to 1.6: it rounds creases, and what is thinner than a step is lost, most of
all at 20 degrees, where only wedges are left out (of the 800 at the other angles 733 to 0.1, and all to 0.8). Volumes
by node count differ by 0.1 % between steps 4, 2 and 1, and by 0.2 % from the mesh.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from paxel_design.gamut.contouring import Crossings, crossings_of, net_faces, net_vertices
from paxel_design.gamut.distances import signed_distances
from paxel_design.gamut.gauge import Gauge
from paxel_design.gamut.margins import Margins
from paxel_design.gamut.meshes import GamutMesh, gamut_mesh, gamut_solid, mesh_of_solid
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import Lab_to_XYZ, XYZ_to_Lab
from paxel_runtime.model.subgamut import LabField, SubGamut

__all__ = ["STEP", "LevelSet", "level_set", "level_set_mesh"]

STEP = 2.0
"""Distance of nodes, CIELAB units."""

_PADDING = 2
"""Layers of nodes beyond the full gamut where the margin goes on."""

_LARGEST = 10.0
"""Margins are cut off here: further from the boundary they say nothing more."""

_NOT_ASKED = -2 * _LARGEST
"""Value of nodes beyond the padding."""

_FAR = 2.0
"""Steps from the boundary, as its value and slope tell, from which on a coarse node is far from it: a surface through
a coarse cell is no further than half of its diagonal from one of its corners, 1.7."""

_BOX_EDGE = 16.0
"""Edges of the mesh that tells the full gamut's extent, CIELAB units: right to less than the padding."""

_DEPTH = 0.05
"""How far below the gamut's surface a margin is asked there, CIELAB units. On it every colour has few partners or one;
where inputs are alike up to errors of measurement there are many at once below, and a level set between would run
along the surface, too near to be told from it."""

_SHELL = 1e-3
"""Share of the way to the middle over which that depth is measured."""

_STEEPEST = 3.0
"""Slope with which a margin goes on at most: steeper ones hold only in a thin layer at the gamut's surface."""

_SEARCHES = 10
_NEAR, _SHORT = 0.003, 0.01
"""Where the search along an edge ends: distance to the boundary, CIELAB, or share of the edge that is left."""

_LAST_MOVE = 0.25
"""How far a vertex may at last move onto the boundary, in steps."""

_PLANE = 2e-3
"""One minus the length of a cell's mean normal up to which its vertex need not move: the planes' meeting is then within
1 % of a step of a surface as curved as that."""

_BAND = 2.0
"""Distance from the mesh up to which the field is exact, in its own steps: all corners of a cell that it crosses."""

_NEIGHBOURS = np.ones((3, 3, 3), bool)

_SPECK = 1e-4
"""Share of the volume below which a separate part is a speck that the grid left at a crease, and is dropped."""

_SIMPLIFY = 0.01
"""How far simplifying may move the surface, CIELAB units."""

_Values = NDArray[np.float64]
_MarginsOfLab = Callable[[_Values], tuple[_Values, _Values]]
"""Lab (k, 3), also beyond the full gamut -> margins (k,) and their slopes (k, 3) along L*, a*, b*."""


@dataclass(frozen=True, eq=False)
class LevelSet:
    """The part of a full gamut where a margin is >= 0.

    Attributes
    ----------
    gamut : SubGamut
        Its field is the distance to `net`, negative outside, exact to two of its steps from the boundary.
    net : manifold3d.Manifold
        The closed surface in CIELAB before it is cut with the full gamut.
    counted : float
        Volume in cubic CIELAB units, by the nodes whose margin is > 0.
    """

    gamut: SubGamut
    net: manifold3d.Manifold
    counted: float


def level_set(full: SubGamut, effect: str, margins: Margins, step: float = STEP) -> LevelSet:
    """The part of a full gamut where a margin is >= 0.

    Parameters
    ----------
    full : SubGamut
        All colours of the surface, half-spaces only.
    effect : str
        Name of the result.
    margins : Margins
    step : float
        Distance of the nodes where margins are asked, CIELAB units; the field's is half of it. Memory: some 200 bytes
        a node, 50 MB for sRGB at step 2.

    Raises
    ------
    GamutError
        If no node lies in the set, or its surface does not close.
    """
    surface = gamut_mesh(full, _BOX_EDGE).Lab
    # Nodes lie half a step beside the gray axis: on it a colour has no hue. Their number is odd: every second is a
    # node of the coarse grid, the first and the last too.
    first = np.floor(surface.min(axis=0) / step) - _PADDING - 1
    counts = (np.ceil(surface.max(axis=0) / step) + _PADDING + 2 - first).astype(int) | 1
    grid = LabField((first + 0.5) * step, step, np.full(counts, _NOT_ASKED, np.float32))
    gauge = Gauge(full.normals, full.offsets)
    nodes = np.moveaxis(np.indices(counts, np.int32), 0, -1).reshape(-1, 3)
    inside = (gauge(np.asarray(Lab_to_XYZ(_place(grid, nodes), full.white_point))) <= 1).reshape(counts)
    near = binary_dilation(inside, _NEIGHBOURS, iterations=_PADDING)
    margins_of = _continued(full, gauge, margins)
    _ask(grid, near, margins_of)
    # Exactly 0 would put a vertex of the mesh on a node, shared by slivers.
    grid.values[grid.values == 0] = np.float32(1e-6)
    counted = float(np.count_nonzero(inside & (grid.values > 0))) * step**3
    if not counted:
        raise GamutError(
            f"sub-gamut {effect}.on-{full.shown_on} is empty: no colour of a grid of {step:g} CIELAB units can have "
            "such a partner"
        )
    vertices, faces = _net(grid, margins_of)
    net = manifold3d.Manifold(manifold3d.Mesh64(_place(grid, vertices), faces.astype(np.uint64)))
    if net.status() != manifold3d.Error.NoError:
        raise GamutError(
            f"sub-gamut {effect}.on-{full.shown_on} has no mesh: its surface does not close ({net.status().name})"
        )
    field = _field_of_net(grid, vertices, faces)
    return LevelSet(SubGamut(effect, full.shown_on, full.normals, full.offsets, full.white_point, field), net, counted)


def level_set_mesh(level: LevelSet) -> GamutMesh:
    """The closed surface of a level set, cut with its exact full gamut.

    Raises
    ------
    GamutError
        If nothing is left of it.
    """
    gamut = level.gamut
    full = SubGamut(gamut.effect, gamut.shown_on, gamut.normals, gamut.offsets, gamut.white_point)
    cut = (level.net ^ gamut_solid(gamut_mesh(full))).simplify(_SIMPLIFY)
    parts = sorted(cut.decompose(), key=lambda part: -part.volume())
    kept = [part for part in parts if part.volume() > _SPECK * cut.volume()]
    if not kept:
        raise GamutError(f"sub-gamut {gamut.file_stem} has no mesh: it is thinner than the grid that it was asked on")
    whole = manifold3d.Manifold.compose(kept)
    return mesh_of_solid(whole, volume=level.counted, volume_error=abs(whole.volume() - level.counted))


def _net(grid: LabField, margins_of: _MarginsOfLab) -> tuple[_Values, NDArray[np.int64]]:
    """Vertices (V, 3) on the boundary, in steps of the grid, and triangles (F, 3)."""
    crossings = crossings_of(grid.values)
    points, normals = _on_the_boundary(crossings, grid, margins_of)
    vertices = net_vertices(crossings, points, normals)
    vertices = _moved_onto_boundary(vertices, _bent_cells(crossings, normals), grid, margins_of)
    return vertices, net_faces(crossings, vertices, points, normals)


def _field_of_net(grid: LabField, vertices: _Values, faces: NDArray[np.int64]) -> LabField:
    """The distance to the net on half of the grid's step; further away no less than that, and as margins tell."""
    step = grid.step / 2
    rough = _doubled(np.clip(grid.values, -_LARGEST, _LARGEST))
    values = signed_distances(2 * vertices, faces, rough.shape, _BAND) * np.float32(step)
    far = np.abs(values) >= np.float32(0.999 * _BAND * step)
    values[far] = np.copysign(np.maximum(np.abs(rough[far]), np.abs(values[far])), values[far])
    return LabField(grid.origin, step, values)


def _place(grid: LabField, nodes: NDArray[np.integer] | _Values) -> _Values:
    """Lab of places (..., 3) in steps of a grid."""
    return grid.origin + grid.step * nodes


def _continued(full: SubGamut, gauge: Gauge, margins: Margins) -> _MarginsOfLab:
    """Margins everywhere: from just below the full gamut's surface outwards straight on, along rays from its middle."""

    def continued(Lab: _Values) -> tuple[_Values, _Values]:
        XYZ = np.asarray(Lab_to_XYZ(Lab, full.white_point), np.float64)
        reach = gauge(XYZ)
        outer = np.flatnonzero(reach > 0.9)
        ray = (XYZ[outer] - gauge.middle) / reach[outer, None]
        shell = [np.asarray(XYZ_to_Lab(gauge.middle + t * ray, full.white_point)) for t in (1.0, 1.0 - _SHELL)]
        depth = np.minimum(_SHELL * _DEPTH / np.linalg.norm(shell[0] - shell[1], axis=1), 0.01)
        beyond = reach[outer] > 1.0 - depth
        outside = outer[beyond]
        XYZ[outside] = gauge.middle + (1.0 - depth[beyond, None]) * ray[beyond]
        values, slopes = margins.with_slopes(XYZ)
        steepness = np.linalg.norm(slopes[outside], axis=1)
        slopes[outside] *= np.minimum(_STEEPEST / np.maximum(steepness, _STEEPEST), 1.0)[:, None]
        way = Lab[outside] - np.asarray(XYZ_to_Lab(XYZ[outside], full.white_point))
        values[outside] += np.einsum("ki,ki->k", slopes[outside], way)
        return values, slopes

    return continued


def _ask(grid: LabField, near: NDArray[np.bool_], margins_of: _MarginsOfLab) -> None:
    """Fill a grid's values near the gamut: asked where the boundary can be, elsewhere between every second node."""
    coarse = tuple(slice(None, None, 2) for _ in range(3))
    # All corners of the coarse cells in which nodes are wanted.
    asked = binary_dilation(near, _NEIGHBOURS)[coarse]
    nodes = np.argwhere(asked)
    values, slopes = margins_of(_place(grid, 2 * nodes))
    distance = np.abs(values) / np.maximum(np.linalg.norm(slopes, axis=1), 1.0)
    rough = np.full(asked.shape, _NOT_ASKED, np.float32)
    rough[asked] = np.clip(values, -_LARGEST, _LARGEST)
    unsure = np.zeros(asked.shape, bool)
    unsure[asked] = distance < _FAR * grid.step
    between = _doubled(rough)
    grid.values[near] = between[near]
    known = np.zeros(near.shape, bool)
    known[coarse] = asked
    # Nodes of the coarse cells around unsure corners; then, until nothing changes, those beside a change of sign.
    wanted = np.zeros(near.shape, bool)
    wanted[coarse] = unsure
    wanted = binary_dilation(wanted, _NEIGHBOURS) | _beside_crossings(grid.values)
    while np.any(wanted := wanted & near & ~known):
        grid.values[wanted] = np.clip(margins_of(_place(grid, np.argwhere(wanted)))[0], -_LARGEST, _LARGEST)
        known |= wanted
        wanted = binary_dilation(_beside_crossings(grid.values), _NEIGHBOURS)


def _doubled(values: NDArray[np.float32]) -> NDArray[np.float32]:
    """Values on a grid (l, m, n) of half the step, (2 l - 1, 2 m - 1, 2 n - 1), trilinear between."""
    for axis in range(3):
        ends = np.moveaxis(values, axis, 0)
        fine = np.empty((2 * len(ends) - 1, *ends.shape[1:]), np.float32)
        fine[::2], fine[1::2] = ends, (ends[:-1] + ends[1:]) / 2
        values = np.moveaxis(fine, 0, axis)
    return values


def _beside_crossings(values: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Nodes with a neighbour along an axis of another sign; those never asked do not count."""
    beside = np.zeros(values.shape, bool)
    positive, asked = values > 0, values > _NOT_ASKED
    for axis in range(3):
        low = tuple(slice(None, -1) if k == axis else slice(None) for k in range(3))
        high = tuple(slice(1, None) if k == axis else slice(None) for k in range(3))
        crossed = (positive[low] != positive[high]) & asked[low] & asked[high]
        beside[low] |= crossed
        beside[high] |= crossed
    return beside


def _on_the_boundary(crossings: Crossings, field: LabField, margins_of: _MarginsOfLab) -> tuple[_Values, _Values]:
    """Where each crossing lies (e, 3), in steps, and the unit normal there (e, 3): Newton's rule between two ends.

    Edges to nodes that were never asked lie outside the gamut: there the field decides, and there is no normal.
    """
    f0, f1 = (np.asarray(field.values[tuple(ends.T)], np.float64) for ends in (crossings.low, crossings.high))
    share = f0 / (f0 - f1)
    low, high = np.zeros(len(share)), np.ones(len(share))
    slopes = np.zeros((len(share), 3))
    left = np.flatnonzero(np.minimum(f0, f1) > _NOT_ASKED)
    for _ in range(_SEARCHES):
        at = share[left]
        value, slope = margins_of(_place(field, crossings.points(share)[left]))
        slopes[left] = slope
        as_low = np.sign(value) == np.sign(f0[left])
        low[left], high[left] = np.where(as_low, at, low[left]), np.where(as_low, high[left], at)
        along = field.step * slope[np.arange(len(left)), crossings.axis[left]]
        newton = at - value / np.where(along == 0, np.inf, along)
        # Where the tangent leads out of what is left of the edge, halve that.
        within = (newton > low[left]) & (newton < high[left])
        share[left] = np.where(within, newton, (low[left] + high[left]) / 2)
        near = np.abs(value) <= _NEAR * np.maximum(np.linalg.norm(slope, axis=1), 1.0)
        share[left[near]] = at[near]
        left = left[~near & (high[left] - low[left] > _SHORT)]
        if not len(left):
            break
    length = np.linalg.norm(slopes, axis=1, keepdims=True)
    return crossings.points(share), slopes / np.where(length == 0, 1.0, length)


def _bent_cells(crossings: Crossings, normals: _Values) -> NDArray[np.intp]:
    """Cells in which the boundary is curved or creased, as the normals (e, 3) of its crossings tell."""
    cell, known = crossings.around.ravel(), np.repeat(np.any(normals, axis=1), 4)
    count = np.bincount(cell, known, len(crossings.cells))
    total = np.stack([np.bincount(cell, np.repeat(n, 4), len(count)) for n in normals.T], axis=1)
    return np.flatnonzero(np.linalg.norm(total, axis=1) < (1 - _PLANE) * count)


def _moved_onto_boundary(
    vertices: _Values, some: NDArray[np.integer], field: LabField, margins_of: _MarginsOfLab
) -> _Values:
    """Vertices (V, 3), in steps, with some of them moved along the slope to where the margin is 0."""
    value, slope = margins_of(_place(field, vertices[some]))
    steepness = np.linalg.norm(slope, axis=1)
    distance = np.where(steepness > 0, value / np.where(steepness > 0, steepness, 1.0), 0.0) / field.step
    near = np.abs(distance) <= _LAST_MOVE
    moved = vertices.copy()
    moved[some[near]] -= (distance / np.where(steepness > 0, steepness, 1.0))[near, None] * slope[near]
    return moved
