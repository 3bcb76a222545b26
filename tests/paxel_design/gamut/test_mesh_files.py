"""Mesh files: read back by others' readers they are the same closed solid, and the same mesh gives the same bytes."""

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from paxel_design.gamut import MESH_FORMATS, GamutMesh, gamut_mesh, rgb_space, sub_gamut, write_mesh
from paxel_runtime.errors import InputError
from paxel_runtime.model.prediction import PredictionModel


@pytest.fixture(scope="module")
def mesh(bw_model: Callable[[int], PredictionModel]) -> GamutMesh:
    return gamut_mesh(sub_gamut(bw_model(2), "neutralize"))


def read_gam(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Both tables of a .gam, as Argyll reads them: vertices by their order, triangles by numbers of vertices."""
    tables = [part.split("END_DATA")[0] for part in path.read_text().split("BEGIN_DATA\n")[1:]]
    vertices, faces = (np.array([row.split() for row in table.strip().split("\n")], float) for table in tables)
    assert np.array_equal(vertices[:, 0], np.arange(len(vertices)))
    return vertices[:, 1:], faces.astype(int)


@pytest.mark.parametrize("suffix", [".ply", ".glb"])
def test_trimesh_reads_the_same_closed_solid(mesh: GamutMesh, tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"mesh{suffix}"
    write_mesh(mesh, path)
    read = trimesh.load(path, force="mesh")
    assert read.is_watertight
    assert read.is_winding_consistent
    assert len(read.faces) == len(mesh.faces)
    # 1e-6: 32-bit coordinates in a .glb.
    assert read.volume == pytest.approx(mesh.mesh_volume, rel=1e-6)


def test_a_ply_keeps_Lab_to_the_last_bit(mesh: GamutMesh, tmp_path: Path) -> None:
    write_mesh(mesh, tmp_path / "mesh.ply")
    read = trimesh.load(tmp_path / "mesh.ply", process=False)
    np.testing.assert_array_equal(read.vertices, mesh.Lab)
    np.testing.assert_array_equal(read.faces, mesh.faces)
    gray = np.argmin(np.hypot(mesh.Lab[:, 1], mesh.Lab[:, 2]))
    assert np.ptp(read.visual.vertex_colors[gray, :3].astype(int)) < 10, "a nearly gray vertex is shown nearly gray"


def test_viewers_of_a_glb_have_lightness_up(mesh: GamutMesh, tmp_path: Path) -> None:
    write_mesh(mesh, tmp_path / "mesh.glb")
    bounds = trimesh.load(tmp_path / "mesh.glb").bounds
    L, a, b = np.stack((mesh.Lab.min(axis=0), mesh.Lab.max(axis=0)), axis=-1)
    # 1e-4: 32-bit coordinates.
    np.testing.assert_allclose(bounds, [[a[0], L[0], -b[1]], [a[1], L[1], -b[0]]], atol=1e-4)


def test_a_gam_is_wound_inwards_as_argyll_has_it(mesh: GamutMesh, tmp_path: Path) -> None:
    write_mesh(mesh, tmp_path / "mesh.gam")
    vertices, faces = read_gam(tmp_path / "mesh.gam")
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    # 1e-5: six digits after the point.
    assert np.einsum("fi,fi->", a, np.cross(b, c)) / 6 == pytest.approx(-mesh.mesh_volume, rel=1e-5)
    assert (tmp_path / "mesh.gam").read_text().startswith("GAMUT")


@pytest.mark.skipif(shutil.which("viewgam") is None, reason="Argyll is not installed")
def test_argyll_reads_the_same_volume(tmp_path: Path) -> None:
    coarse = gamut_mesh(rgb_space("srgb"), 60.0)  # viewgam takes minutes for fine ones
    write_mesh(coarse, tmp_path / "own.gam")
    told = subprocess.run(
        ["viewgam", "-i", "own.gam", "own.gam", "out"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    found = re.search(r"'own.gam' volume = ([0-9.]+)", told.stdout + told.stderr)
    assert found is not None
    assert float(found.group(1)) == pytest.approx(coarse.mesh_volume, rel=1e-4)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_the_same_mesh_gives_the_same_bytes(mesh: GamutMesh, tmp_path: Path, suffix: str) -> None:
    for name in ("one", "two"):
        write_mesh(mesh, tmp_path / f"{name}{suffix}")
    assert (tmp_path / f"one{suffix}").read_bytes() == (tmp_path / f"two{suffix}").read_bytes()


def test_another_suffix_is_answered_with_the_choices(mesh: GamutMesh, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.ply, \.glb, \.gam; got mesh\.stl"):
        write_mesh(mesh, tmp_path / "mesh.stl")
    assert not list(tmp_path.iterdir())
