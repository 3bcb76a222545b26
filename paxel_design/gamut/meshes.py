"""Sub-gamuts as closed surfaces in CIELAB: exact polytope -> conforming triangles -> volume, area, topology.

The one file that uses manifold3d. A mesh that leaves here is watertight, wound outwards and of positive volume, or a
`GamutError` says why not. It knows polytopes and CIELAB; it does not know effects' conditions or file formats.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from paxel_design.gamut.polytopes import hull_surface, polytope
from paxel_design.gamut.tessellation import edges_of, tessellate
from paxel_runtime.errors import GamutError
from paxel_runtime.model.colorimetry import XYZ_to_Lab
from paxel_runtime.model.subgamut import SubGamut

__all__ = [
    "GamutMesh",
    "exact_volume",
    "gamut_mesh",
    "gamut_solid",
    "hull_volume",
    "mesh_of_solid",
    "simplified_mesh",
    "subgamut_arrays",
    "subgamut_figures",
]

_WELD = 1e-3
"""Corners nearer than this in CIELAB are one: far below what is seen, and wide enough that the slivers between them
keep distinct vertices in the 32-bit numbers of a .glb."""

_MAX_EDGE = 4.0
"""Longest edge of a mesh in CIELAB: the volume of sRGB is then right to 1 part in 25,000."""

_LARGEST_DEVIATION = 0.01
"""Relative difference between the volumes of mesh and set above which edges are halved."""

_NODES = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6.0
"""Barycentric nodes of the quadrature of degree 2 on a triangle; each has a third of the weight."""

_CENTRE = np.full((1, 3), 1 / 3)
"""The node of the quadrature of degree 1."""


@dataclass(frozen=True, eq=False)
class GamutMesh:
    """The closed surface of a set of colours in CIELAB.

    Attributes
    ----------
    Lab : (V, 3) float64 array
        Vertices, on the exact surface.
    faces : (F, 3) int64 array
        Triangles, wound outwards (counter-clockwise seen from outside, with L*, a*, b* a right-handed frame).
    volume, area : float
        Of the set, in cubic and square CIELAB units: by quadrature over the exact curved surface, or for a level set
        the volume by node count and the area of the triangles.
    mesh_volume : float
        Of the flat triangles, as manifold3d takes it.
    components, genus : int
        Separate parts, and handles in all of them.
    volume_error : float
        How far `volume` may be off: the difference from a quadrature of one degree less, or from `mesh_volume`.
    """

    Lab: NDArray[np.float64]
    faces: NDArray[np.int64]
    volume: float
    area: float
    mesh_volume: float
    components: int
    genus: int
    volume_error: float = 0.0


def gamut_mesh(gamut: SubGamut, max_edge: float = _MAX_EDGE) -> GamutMesh:
    """The surface of a sub-gamut in CIELAB (design: section 8, *Meshes*).

    The flat facets of the polytope become curved in CIELAB, so edges are split until each is short there; both
    triangles at an edge split it at one point, so the surface stays closed. (A convex hull in CIELAB would add 10 %
    of volume.)

    Parameters
    ----------
    gamut : SubGamut
    max_edge : float
        Longest edge, in CIELAB units.

    Raises
    ------
    GamutError
        If the set is empty or flat, or its surface does not close.
    """
    try:
        surface = _surface(gamut)
        for edge in max_edge / 2.0 ** np.arange(4):
            mesh = _measured(*tessellate(*surface, gamut.white_point, edge), gamut.white_point)
            if abs(mesh.mesh_volume - mesh.volume) <= _LARGEST_DEVIATION * mesh.volume:
                return mesh
    except GamutError as error:
        raise GamutError(f"sub-gamut {gamut.file_stem} has no mesh: {error}") from error
    raise GamutError(
        f"sub-gamut {gamut.file_stem} has no mesh: its triangles hold {mesh.mesh_volume:.3g} cubic CIELAB units and "
        f"the set {mesh.volume:.3g}; it is too thin for edges of {max_edge / 8:g}"
    )


def exact_volume(gamut: SubGamut, max_edge: float = 2 * _MAX_EDGE) -> float:
    """Volume of a sub-gamut in cubic CIELAB units without making its mesh: to about 1 part in 10,000 as it stands.

    Parameters
    ----------
    gamut : SubGamut
        Half-spaces only.
    max_edge : float
        Longest edge of the quadrature's triangles, CIELAB units.

    Raises
    ------
    GamutError
        If the set is empty or flat.
    """
    return hull_volume(polytope(gamut.normals, gamut.offsets).vertices, gamut.white_point, max_edge)


def hull_volume(corners: NDArray[np.float64], white_point: NDArray[np.float64], max_edge: float) -> float:
    """`exact_volume` of the convex hull of corners (v, 3) in XYZ."""
    XYZ, faces = tessellate(*hull_surface(_welded(corners, white_point)), white_point, max_edge)
    return _exact_volume_and_area(XYZ[faces], white_point)[0]


def _surface(gamut: SubGamut) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Corners in XYZ and flat triangles of the polytope."""
    corners = polytope(gamut.normals, gamut.offsets).vertices
    return hull_surface(_welded(corners, gamut.white_point))


def _welded(XYZ: NDArray[np.float64], white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points with one for each cluster of points that cannot be told apart."""
    near = cKDTree(_Lab(XYZ, white_point)).query_pairs(_WELD, output_type="ndarray")
    graph = coo_array((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(XYZ), len(XYZ)))
    _, cluster = connected_components(graph, directed=False)
    _, first = np.unique(cluster, return_index=True)
    return XYZ[first]


def _measured(XYZ: NDArray[np.float64], faces: NDArray[np.int64], white_point: NDArray[np.float64]) -> GamutMesh:
    """The mesh of triangles in XYZ, checked and measured."""
    Lab = _Lab(XYZ, white_point)
    edges, edge_of = edges_of(faces, len(XYZ))
    upwards = np.where(faces < np.roll(faces, -1, axis=1), 1, -1)
    runs = np.bincount(edge_of.ravel(), upwards.ravel())
    if np.any(runs != 0) or len(edge_of) * 3 != 2 * len(edges):
        raise GamutError("its surface does not close: an edge has not two triangles, wound alike")
    a, b, c = np.moveaxis(Lab[faces] - Lab.mean(axis=0), 1, 0)
    mesh_volume = float(np.einsum("fi,fi->", a, np.cross(b, c))) / 6
    if not mesh_volume > 0:
        raise GamutError("its surface is wound inwards")
    volume, area = _exact_volume_and_area(XYZ[faces], white_point)
    graph = coo_array((np.ones(len(edges)), tuple(edges.T)), shape=(len(XYZ), len(XYZ)))
    components = int(connected_components(graph, directed=False, return_labels=False))
    genus = components - (len(XYZ) - len(edges) + len(faces)) // 2
    coarse, _ = _exact_volume_and_area(XYZ[faces], white_point, _CENTRE)
    return GamutMesh(Lab, faces, volume, area, mesh_volume, components, genus, abs(volume - coarse))


def gamut_solid(mesh: GamutMesh) -> manifold3d.Manifold:
    """The same body for boolean operations."""
    return manifold3d.Manifold(manifold3d.Mesh64(mesh.Lab, mesh.faces.astype(np.uint64)))


def mesh_of_solid(solid: manifold3d.Manifold, volume: float | None = None, volume_error: float = 0.0) -> GamutMesh:
    """The mesh of a body that boolean operations made; `volume` is that of its triangles unless it is known better.

    Raises
    ------
    GamutError
        If nothing is left of it.
    """
    if solid.is_empty() or solid.status() != manifold3d.Error.NoError:
        raise GamutError(f"a body of colours is empty or does not close ({solid.status().name})")
    mesh = solid.to_mesh64()
    faces = np.asarray(mesh.tri_verts, np.int64)
    Lab = np.array(mesh.vert_properties[:, :3], np.float64)  # a copy: manifold3d refuses its own read-only arrays
    components = len(solid.decompose())
    return GamutMesh(
        Lab,
        faces,
        float(solid.volume()) if volume is None else volume,
        float(solid.surface_area()),
        float(solid.volume()),
        components,
        int(solid.genus()) + components - 1,
        volume_error,
    )


def simplified_mesh(mesh: GamutMesh, deviation: float) -> GamutMesh:
    """The same body in fewer triangles, for pictures: no point of its surface moves by more than `deviation`, CIELAB.

    Its volume and their error stay those of `mesh`.

    Raises
    ------
    GamutError
        If the body is thinner than that, and nothing is left.
    """
    return mesh_of_solid(gamut_solid(mesh).simplify(deviation), mesh.volume, mesh.volume_error)


def _exact_volume_and_area(
    corners: NDArray[np.float64], white_point: NDArray[np.float64], nodes: NDArray[np.float64] = _NODES
) -> tuple[float, float]:
    """Volume and area in CIELAB bounded by the curved images of flat triangles (F, 3, 3) in XYZ.

    Divergence theorem: volume = integral of Lab . n / 3 over the surface, with n from the derivatives of CIELAB.
    """
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    middle = _Lab(corners.mean(axis=(0, 1)), white_point)
    volume = area = 0.0
    for node in nodes:
        XYZ = np.einsum("k,fkc->fc", node, corners)
        normal = np.cross(_Lab_change(XYZ, first, white_point), _Lab_change(XYZ, second, white_point)) / 2
        normal /= len(nodes)
        volume += float(np.sum((_Lab(XYZ, white_point) - middle) * normal)) / 3
        area += float(np.sum(np.linalg.norm(normal, axis=1)))
    return volume, area


def _Lab(XYZ: NDArray[np.float64], white_point: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(XYZ_to_Lab(XYZ, white_point), np.float64)


def _Lab_change(
    XYZ: NDArray[np.float64], direction: NDArray[np.float64], white_point: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Derivative of CIELAB at XYZ (f, 3) along directions in XYZ (f, 3) (CIE 15:2018, section 8.2.1)."""
    t = XYZ / white_point
    slope = np.where(t > (6 / 29) ** 3, np.maximum(t, 1e-3) ** (-2 / 3) / 3, (29 / 6) ** 2 / 3)
    x, y, z = (slope * direction / white_point).T
    return np.stack((116 * y, 500 * (x - y), 200 * (y - z)), axis=-1)


def subgamut_figures(gamut: SubGamut, mesh: GamutMesh) -> dict[str, Any]:
    """The figures of ``gamut/<effect>.on-<surface>.json`` (design: section 4, *Files*).

    ``volume`` and ``area`` are those of the set; ``mesh_volume`` that of the triangles in the file ``mesh``.
    """
    return {
        "effect": gamut.effect,
        "shown_on": gamut.shown_on,
        "volume": mesh.volume,
        "volume_error": mesh.volume_error,
        "mesh_volume": mesh.mesh_volume,
        "area": mesh.area,
        "watertight": True,
        "components": mesh.components,
        "genus": mesh.genus,
        "mesh": f"{gamut.file_stem}.ply",
        "triangles": len(mesh.faces),
        "method": "exact polytope" if gamut.field is None else f"level set at step {gamut.field.step:g}",
    }


def subgamut_arrays(gamut: SubGamut, mesh: GamutMesh | None = None) -> dict[str, NDArray[Any]]:
    """The arrays of ``gamut/<effect>.on-<surface>.npz``: the fields of the sub-gamut and, if any, the mesh by name.

    ``paxel_runtime.model.subgamut.subgamut_from_arrays`` reads the sub-gamut back.
    """
    arrays = {
        "effect": np.array(gamut.effect),
        "shown_on": np.array(gamut.shown_on),
        "normals": gamut.normals,
        "offsets": gamut.offsets,
        "white_point": gamut.white_point,
    }
    if mesh is not None:
        arrays["Lab"], arrays["faces"] = mesh.Lab, mesh.faces.astype(np.int32)
    if gamut.field is not None:
        arrays["field"], arrays["field_origin"] = gamut.field.values, gamut.field.origin
        arrays["field_step"] = np.array(gamut.field.step)
    return arrays
