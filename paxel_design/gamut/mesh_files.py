"""Meshes in CIELAB -> .ply, .glb, .gam files. The one file that uses trimesh; the same mesh gives the same bytes.

Vertices keep the order L*, a*, b* in every file. A .glb turns the whole mesh so that viewers, for which +y is up,
show +L* up, +a* to the right and +b* away from the viewer.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from paxel_design.gamut.meshes import GamutMesh
from paxel_runtime.errors import InputError
from paxel_runtime.model.colorimetry import Lab_to_sRGB
from paxel_runtime.version import WRITER

__all__ = ["MESH_FORMATS", "display_colors", "write_mesh"]

_UP = np.array([[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Rotation (L*, a*, b*) -> (a*, L*, -b*)."""


def write_mesh(mesh: GamutMesh, path: Path) -> None:
    """Write a mesh in the format that the suffix of `path` names.

    Parameters
    ----------
    mesh : GamutMesh
    path : Path
        ``.ply`` (binary, 64-bit coordinates), ``.glb`` (for viewers) or ``.gam`` (for Argyll's viewgam).

    Raises
    ------
    InputError
        If the suffix is another.
    """
    if path.suffix not in MESH_FORMATS:
        raise InputError(f"a mesh file must end in {', '.join(MESH_FORMATS)}; got {path.name}")
    path.write_bytes(MESH_FORMATS[path.suffix](mesh))


def _ply(mesh: GamutMesh) -> bytes:
    """Stanford PLY, binary little-endian, with vertex colours."""
    header = "\n".join(
        (
            "ply",
            "format binary_little_endian 1.0",
            f"comment {WRITER}; x y z are CIELAB L* a* b*",
            f"element vertex {len(mesh.Lab)}",
            *(f"property double {axis}" for axis in "xyz"),
            *(f"property uchar {name}" for name in ("red", "green", "blue")),
            f"element face {len(mesh.faces)}",
            "property list uchar int vertex_indices",
            "end_header\n",
        )
    )
    vertices = np.zeros(len(mesh.Lab), [("Lab", "<f8", 3), ("color", "u1", 3)])
    vertices["Lab"], vertices["color"] = mesh.Lab, display_colors(mesh)
    faces = np.zeros(len(mesh.faces), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    return header.encode() + vertices.tobytes() + faces.tobytes()


def _glb(mesh: GamutMesh) -> bytes:
    """Binary glTF 2.0 with vertex colours and vertex normals."""
    import trimesh  # heavy: only where a file is made

    surface = trimesh.Trimesh(mesh.Lab, mesh.faces, vertex_colors=display_colors(mesh), process=False)
    scene = trimesh.Scene()
    scene.add_geometry(surface, node_name="gamut", geom_name="gamut", transform=_UP)
    scene.metadata.clear()
    content = scene.export(file_type="glb", include_normals=True)
    assert isinstance(content, bytes)
    return content


def _gam(mesh: GamutMesh) -> bytes:
    """Argyll's gamut surface: a CGATS file of two tables, wound inwards; no date, so that bytes repeat."""
    Lab = [f"{i} {L:.6f} {a:.6f} {b:.6f}" for i, (L, a, b) in enumerate((mesh.Lab + 0.0).tolist())]
    corners = [f"{i} {k} {j}" for i, j, k in mesh.faces.tolist()]
    lines = (
        "GAMUT  ",
        "",
        'DESCRIPTOR "Argyll Gamut surface poligon data"',
        f'ORIGINATOR "{WRITER}"',
        'KEYWORD "COLOR_REP"',
        'COLOR_REP "LAB"',
        'KEYWORD "GAMUT_CENTER"',
        'GAMUT_CENTER "{:.6f} {:.6f} {:.6f}"'.format(*mesh.Lab.mean(axis=0)),
        "",
        "NUMBER_OF_FIELDS 4",
        *_cgats_table("VERTEX_NO LAB_L LAB_A LAB_B", Lab),
        "",
        "NUMBER_OF_FIELDS 3",
        *_cgats_table("VERTEX_0 VERTEX_1 VERTEX_2", corners),
        "",
    )
    return "\n".join(lines).encode("ascii")


def _cgats_table(fields: str, rows: list[str]) -> list[str]:
    return [
        "BEGIN_DATA_FORMAT",
        fields,
        "END_DATA_FORMAT",
        "",
        f"NUMBER_OF_SETS {len(rows)}",
        "BEGIN_DATA",
        *rows,
        "END_DATA",
    ]


def display_colors(mesh: GamutMesh) -> NDArray[np.uint8]:
    """sRGB 8-bit colours (V, 3) of the vertices, the nearest in each channel where one is outside sRGB."""
    return np.round(np.clip(Lab_to_sRGB(mesh.Lab), 0.0, 1.0) * 255).astype(np.uint8)


MESH_FORMATS: dict[str, Callable[[GamutMesh], bytes]] = {".ply": _ply, ".glb": _glb, ".gam": _gam}
"""Suffix -> what makes the bytes of the file."""
